//! Where several rays go: the instances that each comes to, near ones first.
//!
//! Rays that are alike go through the index as one, the others one by one. Nothing is asked of the instances yet, so no hit
//! ends the search; what is found stays in order of distance, and whoever asks stops at the first that is too far.

use super::reach::{visit_reached, widening};
use crate::block::bundle::{Bundle, ChildRef};
use crate::block::level::Level;
use crate::block::{Block, Bundles};
use crate::math::Bits;
use crate::math::rounding::f32_below;
use crate::ray::{Alike, Ray, RayPacket, Slab, WideBoxes};
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
    count: usize,
    next: usize,
    /// Those for which there was no room it enters at no smaller `t` than this.
    beyond: f32,
}

impl Stops {
    pub const NONE: Self =
        Stops { near: [0.0; ROOM], instances: [0; ROOM], count: 0, next: 0, beyond: f32::INFINITY };

    /// The next one that the ray enters before `limit`.
    pub fn next(&mut self, limit: f32) -> Option<u32> {
        let instance = *self.instances[..self.count].get(self.next)?;
        // What follows is no nearer.
        self.next = if self.near[self.next] <= limit { self.next + 1 } else { self.count };
        (self.near[self.next - 1] <= limit).then_some(instance)
    }

    /// Whether there is none before `limit` for which there was no room.
    pub fn are_all(&self, limit: f32) -> bool {
        self.beyond > limit || self.beyond == f32::INFINITY
    }

    fn add(&mut self, instance: u32, near: f32) {
        let mut place = self.count;
        while place > 0 && near < self.near[place - 1] {
            place -= 1;
        }
        if self.count == ROOM {
            let last = if place == ROOM { near } else { self.near[ROOM - 1] };
            self.beyond = if last < self.beyond { last } else { self.beyond };
            if place == ROOM {
                return;
            }
            self.count -= 1;
        }
        self.near.copy_within(place..self.count, place + 1);
        self.instances.copy_within(place..self.count, place + 1);
        (self.near[place], self.instances[place]) = (near, instance);
        self.count += 1;
    }
}

/// Rays on their way through the index, waiting for a backend. The answer is false if rays had better go one after the other
/// there.
pub(super) struct Gather<'a, 'm> {
    pub level: &'a Level<'m>,
    pub rays: &'a [Ray],
    pub stops: &'a mut [Stops; CHUNK],
}

impl Kernel for Gather<'_, '_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> bool {
        if !S::FLIES {
            return false;
        }
        let Gather { level, rays, stops } = self;
        let index = &level.index.parts();
        let mut gatherer = Gatherer { level, index, found: Found::NONE };
        let mut first = 0;
        while first < rays.len() {
            let rest = &rays[first..];
            let alike = Alike::first_of(s, rest, index.header.reach);
            let count = match alike {
                Some((alike, count))
                    if gatherer.together(s, alike, &rest[..count], &mut stops[first..]) =>
                {
                    count
                }
                _ => {
                    let count = rest.len().min(16);
                    for (ray, stops) in rest[..count].iter().zip(&mut stops[first..]) {
                        gatherer.alone(s, ray, stops);
                    }
                    count
                }
            };
            first += count;
        }
        true
    }
}

struct Gatherer<'a, 'm> {
    level: &'a Level<'m>,
    index: &'a Block<'m>,
    found: Found,
}

impl Gatherer<'_, '_> {
    /// For one ray.
    #[inline(always)]
    fn alone<S: Simd>(&mut self, s: S, ray: &Ray, stops: &mut Stops) {
        if let Bundles::Sixteen(bundles) = self.index.bundles
            && widening(self.level, ray) == 0.0
            && let Some((late, slab)) = ray.set_out(s, self.index.header.reach)
            && self.found.all(s, bundles, &slab.wide::<S, 16>(s), late.t_max)
        {
            let t_scale = late.t_scale();
            for (leaf, near) in self.found.leaves() {
                let near = f32_below(f64::from(near) / t_scale);
                stops.add(self.instance(leaf), near);
            }
            return;
        }
        self.any_way(ray, stops);
    }

    /// For rays that are alike; false if they had better go one by one.
    #[inline(always)]
    fn together<S: Simd>(&mut self, s: S, alike: Alike, rays: &[Ray], stops: &mut [Stops]) -> bool {
        let Bundles::Sixteen(bundles) = self.index.bundles else { return false };
        if rays.iter().any(|ray| widening(self.level, ray) != 0.0) {
            return false;
        }
        let mut packet = RayPacket::new(alike);
        let sound = packet.set(s, rays);
        if !self.found.all(s, bundles, &packet.hull(s), packet.highest(s)) {
            return false;
        }
        let depth = alike.axes[2];
        for (leaf, near) in self.found.leaves() {
            let instance = self.instance(leaf);
            let Some(record) = self.level.instances.get(instance as usize) else { continue };
            let entered = packet.entered(s, &record.bounds);
            for (group, entered) in entered.into_iter().enumerate() {
                for lane in Bits(entered & sound[group]) {
                    let number = 16 * group + lane;
                    let (Some(ray), Some(stops)) = (rays.get(number), stops.get_mut(number)) else {
                        continue;
                    };
                    // Depths are what `t` times this is.
                    let rate = f64::from(ray.direction[depth].abs()) * f64::from(alike.scale);
                    let t = f64::from(near) / rate;
                    stops.add(instance, f32_below(t - t.abs() * 1e-12));
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

    /// The instance that is a leaf of the index.
    fn instance(&self, leaf: ChildRef) -> u32 {
        let (_, number) = leaf.leaf_block();
        let block = self.index.sphere_blocks.get(number);
        let id = block.and_then(|block| self.index.prim_ids.get(block.first as usize));
        id.copied().unwrap_or(u32::MAX)
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
        self.leaves[..self.count].iter().copied().zip(self.near)
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
