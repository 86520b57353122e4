//! Which instances a ray comes to, by the index over them.

use crate::block::bundle::ChildRef;
use crate::block::level::Level;
use crate::block::{Block, Bundles, KIND_BVH};
use crate::math::rounding::f32_above;
use crate::math::wide;
use crate::query::{Counts, Query, SphereLane, TriangleLane, Watch};
use crate::ray::{Late, NONE, PreparedRay, Ray, WideSlab};
use crate::simd::{self, Kernel, Scalar, Simd};
use crate::trace::trace;

/// What is done for each instance that a ray comes to: it gets the number, and returns a limit of `t` of what is still of
/// interest, or `None` to end the search.
pub(crate) type Visit<'v> = dyn FnMut(u32) -> Option<f32> + 'v;

/// Calls `visit` for each instance whose rounded ray may hit something, near ones first as far as the index is a tree, and
/// hardly ever twice. Boxes and cells of the index are counted if there are `counts`.
pub(crate) fn visit_reached(
    level: &Level,
    ray: &Ray,
    mut counts: Option<&mut Counts>,
    visit: &mut Visit,
) {
    let widening = if is_calm(level, ray) { 0.0 } else { widening(level, ray) };
    // What is not a tree has its boxes in its cells, as wide as they are.
    if widening == 0.0 || level.index.header().kind == KIND_BVH {
        let widening = f32_above(widening);
        let reached = match counts.as_deref_mut() {
            None => simd::dispatch(Reaching { level, ray, widening, visit, watch: () }),
            Some(watch) => Reaching { level, ray, widening, visit, watch }.run(Scalar),
        };
        if reached.is_some() {
            return;
        }
    }
    if let Some(counts) = counts {
        counts.steps += level.instances.len() as u64;
    }
    visit_all(level, ray, widening, visit);
}

/// Whether the boxes of the index are wide enough for a ray from so far away.
#[inline(always)]
pub(super) fn is_calm(level: &Level, ray: &Ray) -> bool {
    ray.origin.iter().all(|x| x.abs() <= level.head.calm)
}

/// By how much the boxes of the index must be wider for a ray from so far away.
fn widening(level: &Level, ray: &Ray) -> f64 {
    let farthest = ray.origin.iter().fold(0.0f32, |farthest, x| farthest.max(x.abs()));
    let beyond = f64::from(farthest) - f64::from(level.head.calm);
    f64::from(level.head.spread) * beyond.max(0.0)
}

/// The instance that is a leaf of an index in bundles, where each is one.
#[inline(always)]
pub(super) fn instance_of(index: &Block, leaf: ChildRef) -> Option<u32> {
    let (_, number) = leaf.leaf_block();
    index.prim_ids.get(number).copied()
}

/// Calls `visit` for each instance whose box the ray comes to, one after the other: for rays at the ends of the floats, and
/// for rays from far away where the index is a list or a grid.
#[cold]
fn visit_all(level: &Level, ray: &Ray, widening: f64, visit: &mut Visit) {
    let Some(prepared) = ray.prepare(level.index.header().extent()) else { return };
    let mut near = Near::new(&prepared, widening);
    for number in 0..level.instances.len() as u32 {
        if near.reaches(level, number) {
            let Some(limit) = visit(number) else { return };
            near.limit_to(limit);
        }
    }
}

/// A ray against the boxes of single instances, in `f64`.
struct Near {
    slab: WideSlab,
    widening: f64,
    t_scale: f64,
    t_bound: f32,
    /// Rays of directions so small that rounding them may turn them are near everything.
    everywhere: bool,
}

impl Near {
    fn new(ray: &PreparedRay, widening: f64) -> Self {
        let longest = ray.given.direction.iter().fold(0.0f32, |longest, x| longest.max(x.abs()));
        Near {
            slab: WideSlab::new(ray),
            widening,
            t_scale: ray.t_scale,
            t_bound: ray.t_max,
            everywhere: longest < SHORTEST,
        }
    }

    fn limit_to(&mut self, t: f32) {
        let t_bound = f32_above(f64::from(t) * self.t_scale);
        self.t_bound = if t_bound < self.t_bound { t_bound } else { self.t_bound };
    }

    fn reaches(&self, level: &Level, number: u32) -> bool {
        let Some(record) = level.instances.get(number as usize) else { return false };
        let aabb = &record.bounds;
        // The infinite walls of an empty box would be taken for wide.
        let has_something = aabb.lower[0] <= aabb.upper[0];
        let (lower, upper) = (wide(aabb.lower) - self.widening, wide(aabb.upper) + self.widening);
        has_something
            && (self.everywhere
                || !self.slab.clip(lower, upper, f64::from(self.t_bound)).is_empty())
    }
}

/// What bounds on boxes grant to directions holds for those whose largest component is not below this.
const SHORTEST: f32 = 1.0 / (1u64 << 60) as f32;

/// A ray on its way through the index, waiting for a backend. The answer is `None` if the ray is none for which boxes in
/// `f32` are right.
struct Reaching<'a, 'm, 'v, W> {
    level: &'a Level<'m>,
    ray: &'a Ray,
    widening: f32,
    visit: &'a mut Visit<'v>,
    watch: W,
}

impl<W: Watch> Kernel for Reaching<'_, '_, '_, W> {
    type Output = Option<()>;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Option<()> {
        let Reaching { level, ray, widening, visit, watch } = self;
        let block = &level.index.parts();
        let (late, slab) = ray.set_out(s, block.header.extent())?;
        let slab = if widening > 0.0 { slab.widened(widening) } else { slab };
        // Where each instance is a leaf its box was tested on the way.
        let alone = !matches!(block.bundles, Bundles::None);
        let near = (!alone).then(|| Near::new(&late.prepare(), f64::from(widening)));
        let (t_bound, t_scale) = (late.t_max, late.t_scale());
        let mut query =
            Extent { level, visit, t_bound, t_scale, near, visited: [NONE; MAILBOX], watch };
        trace(s, block.whole, (&late, &mut None), &slab, &mut query);
        Some(())
    }
}

/// So many instances that were visited are remembered: a grid comes to one once for each of its cells.
const MAILBOX: usize = 32;

/// The query that calls back for instances.
pub(super) struct Extent<'a, 'm, 'v, W> {
    level: &'a Level<'m>,
    visit: &'a mut Visit<'v>,
    t_bound: f32,
    t_scale: f64,
    near: Option<Near>,
    visited: [u32; MAILBOX],
    watch: W,
}

impl<W: Watch> Query for Extent<'_, '_, '_, W> {
    type Watch = W;
    // The same instances for every backend, for the sake of the watertight mode.
    const ANY_BOXES: bool = false;
    const ORDERED: bool = true;
    const OF_INDEX: bool = true;

    #[inline(always)]
    fn t_bound(&self) -> f32 {
        self.t_bound
    }

    fn triangle(&mut self, _: &PreparedRay, _: &TriangleLane) -> bool {
        false
    }

    fn sphere(&mut self, _: &PreparedRay, _: &SphereLane) -> bool {
        false
    }

    #[inline(never)]
    fn instance(&mut self, number: u32) -> bool {
        let slot = number as usize % MAILBOX;
        if let Some(near) = &self.near {
            if self.visited[slot] == number {
                return false;
            }
            self.watch.step();
            if !near.reaches(self.level, number) {
                return false;
            }
        }
        self.visited[slot] = number;
        let Some(limit) = (self.visit)(number) else { return true };
        if let Some(near) = &mut self.near {
            near.limit_to(limit);
        }
        let t_bound = f32_above(f64::from(limit) * self.t_scale);
        self.t_bound = if t_bound < self.t_bound { t_bound } else { self.t_bound };
        false
    }

    #[inline(always)]
    fn watch(&mut self) -> &mut W {
        &mut self.watch
    }
}
