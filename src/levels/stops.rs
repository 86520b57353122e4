//! Where several rays go: the instances that each comes to, near ones first.
//!
//! Rays that are alike go through the index as one, the others one by one. Nothing is asked of the instances yet, so no hit
//! ends the search; what is found stays in order of distance, and whoever asks stops at the first that is too far.

use core::mem;

use super::reach::{instance_of, is_calm, visit_reached};
use crate::block::bundle::{Bundle, ChildRef};
use crate::block::level::Level;
use crate::block::{Block, Bundles};
use crate::math::Bits;
use crate::math::rounding::{LOOSE, f32_below};
use crate::ray::{Alike, NONE, Ray, RayPacket, Slab, WideBoxes};
use crate::simd::{Kernel, Lanes, Simd, Width};

/// So many rays are taken at a time.
pub(super) const CHUNK: usize = 128;
/// So many instances of a ray are remembered, the nearest.
const ROOM: usize = 8;

/// The instances that one ray comes to, near ones first.
#[derive(Clone, Copy)]
pub(super) struct Stops {
    /// The ray enters their boxes at no smaller `t`.
    near: [f32; ROOM],
    instances: [u32; ROOM],
    count: u8,
    next: u8,
    /// Those for which there was no room it enters at no smaller `t` than this.
    beyond: f32,
}

impl Stops {
    pub const NONE: Self = Stops {
        near: [f32::INFINITY; ROOM],
        instances: [NONE; ROOM],
        count: 0,
        next: 0,
        beyond: f32::INFINITY,
    };

    /// The next one that the ray enters before `limit`.
    pub fn next(&mut self, limit: f32) -> Option<u32> {
        let next = usize::from(self.next);
        let near = *self.near.get(next).filter(|_| self.next < self.count)?;
        // What follows is no nearer.
        if !(near <= limit) {
            self.count = 0;
            return None;
        }
        self.next += 1;
        self.instances.get(next).copied()
    }

    /// Whether there is none before `limit` for which there was no room.
    pub fn are_all(&self, limit: f32) -> bool {
        self.beyond > limit || self.beyond == f32::INFINITY
    }

    fn add(&mut self, instance: u32, near: f32) {
        let (mut last, count) = ((near, instance), usize::from(self.count));
        for (near, instance) in self.near.iter_mut().zip(&mut self.instances).take(count) {
            if last.0 < *near {
                last = (mem::replace(near, last.0), mem::replace(instance, last.1));
            }
        }
        let places = (self.near.get_mut(count), self.instances.get_mut(count));
        if let (Some(near), Some(instance)) = places {
            (*near, *instance) = last;
            self.count += 1;
        } else if last.0 < self.beyond {
            self.beyond = last.0;
        }
    }
}

/// Rays on their way through the index, waiting for a backend.
pub(super) struct Gather<'a, 'm> {
    pub level: &'a Level<'m>,
    pub rays: &'a [Ray],
    pub stops: &'a mut [Stops; CHUNK],
}

impl Kernel for Gather<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        let Gather { level, rays, stops } = self;
        let index = &level.index.parts();
        let mut gatherer = Gatherer { level, index, found: Found::NONE, packet: None };
        let mut first = 0;
        while first < rays.len() {
            let (rays, stops) = (&rays[first..], &mut stops[first..]);
            let alike = Alike::first_of(s, rays, index.header.extent());
            if let Some((alike, count)) = alike
                && gatherer.together(s, alike, &rays[..count], stops)
            {
                first += count;
                continue;
            }
            for (ray, stops) in rays.iter().zip(stops).take(16) {
                gatherer.alone(s, ray, stops);
            }
            first += 16;
        }
    }
}

struct Gatherer<'a, 'm> {
    level: &'a Level<'m>,
    index: &'a Block<'m>,
    found: Found,
    packet: Option<RayPacket>,
}

impl Gatherer<'_, '_> {
    /// For one ray.
    #[inline(always)]
    fn alone<S: Simd>(&mut self, s: S, ray: &Ray, stops: &mut Stops) {
        if let Bundles::Sixteen(bundles) = self.index.bundles
            && is_calm(self.level, ray)
            && let Some((late, slab)) = ray.set_out(s, self.index.header.extent())
            && self.found.all(s, bundles, &slab.wide::<S, 16>(s), late.t_max)
        {
            let t_scale = late.t_scale();
            for (leaf, near) in self.found.leaves() {
                let near = f32_below(f64::from(near) / t_scale);
                stops.add(instance_of(self.index, leaf).unwrap_or(NONE), near);
            }
            return;
        }
        self.any_way(ray, stops);
    }

    /// For rays that are alike; false if they had better go one by one.
    #[inline(always)]
    fn together<S: Simd>(&mut self, s: S, alike: Alike, rays: &[Ray], stops: &mut [Stops]) -> bool {
        let Bundles::Sixteen(bundles) = self.index.bundles else { return false };
        if !rays.iter().all(|ray| is_calm(self.level, ray)) {
            return false;
        }
        let packet = self.packet.get_or_insert_with(|| RayPacket::new(alike));
        let sound = packet.set(s, alike, rays);
        if !self.found.all(s, bundles, &packet.hull(s), packet.highest(s)) {
            return false;
        }
        let depth = alike.axes[2];
        for (leaf, near) in self.found.leaves() {
            let Some(instance) = instance_of(self.index, leaf) else { continue };
            let Some(record) = self.level.instances.get(instance as usize) else { continue };
            let entered = packet.entered(s, &record.bounds);
            for (group, (entered, sound)) in entered.into_iter().zip(sound).enumerate() {
                for lane in Bits(entered & sound) {
                    let number = 16 * group + lane;
                    let (Some(ray), Some(stops)) = (rays.get(number), stops.get_mut(number)) else {
                        continue;
                    };
                    // Depths are what `t` times this is.
                    let rate = f64::from(ray.direction[depth].abs()) * f64::from(alike.scale);
                    let t = f64::from(near) / rate;
                    stops.add(instance, f32_below(t - t.abs() * LOOSE));
                }
            }
        }
        true
    }

    /// For any ray and any index, without a word on the distance.
    #[cold]
    #[inline(never)]
    fn any_way(&self, ray: &Ray, stops: &mut Stops) {
        visit_reached(self.level, ray, None, &mut |instance| {
            stops.add(instance, f32::NEG_INFINITY);
            Some(ray.t_max)
        });
    }
}

/// So many leaves of the index are found at a time, and so many bundles to come back to remembered.
const MOST: usize = 48;

/// Leaves of the index, and where they are entered, in the order in which they were found.
struct Found {
    leaves: [ChildRef; MOST],
    near: [f32; MOST],
    count: usize,
}

impl Found {
    const NONE: Self = Found { leaves: [ChildRef::NONE; MOST], near: [0.0; MOST], count: 0 };

    fn leaves(&self) -> impl Iterator<Item = (ChildRef, f32)> {
        self.leaves.into_iter().zip(self.near).take(self.count)
    }

    /// Becomes all leaves whose boxes are entered up to `t_bound`; false when there is no room.
    #[inline(always)]
    fn all<S: Simd>(
        &mut self,
        s: S,
        bundles: &[Bundle<16>],
        boxes: &impl WideBoxes<S, 16>,
        t_bound: f32,
    ) -> bool {
        self.count = 0;
        let t_bounds = Width::<16>::splat(s, t_bound);
        let (mut stack, mut height) = ([0; MOST], 1);
        while height > 0 {
            height -= 1;
            let Some(bundle) = bundles.get(stack[height]) else { return false };
            let (entered, near) = boxes.entered::<true>(&bundle.walls, t_bounds);
            let mut lanes = [0.0; 16];
            near.store(&mut lanes);
            if self.count.max(height) + 16 > MOST {
                return false;
            }
            for lane in Bits(entered) {
                let child = bundle.refs[lane % 16];
                if child.is_leaf() {
                    (self.leaves[self.count], self.near[self.count]) = (child, lanes[lane % 16]);
                    self.count += 1;
                } else {
                    stack[height] = child.bundle_number();
                    height += 1;
                }
            }
        }
        true
    }
}
