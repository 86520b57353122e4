//! One ray through a block with instances: what is not in any first, then the instances that it comes to, near ones first.
//!
//! Each instance is asked the question anew, for the ray in its object space, up to the best hit so far. So the traversal
//! is the same for both levels, and exists once: only the walk through the index is another, with a query that calls
//! back for each instance. Answers of different instances are compared by their rounded `t`; where these are equal, in
//! real arithmetic.

use core::cmp::Ordering;

use crate::block::level::{InstanceRecord, Level};
use crate::block::{Bundles, Finished, KIND_BVH};
use crate::math::rounding::f32_above;
use crate::math::wide;
use crate::query::{
    Choice, Counts, Decide, Exact, Query, QueryOptions, SphereLane, TriangleLane, Watch,
    Watertight, shares_bit,
};
use crate::ray::{Hit, Late, NONE, PreparedRay, Ray, WideSlab};
use crate::simd::{self, Kernel, Scalar, Simd};
use crate::trace::{ClosestMet, any_hit, ask, closest_hit, trace};

/// The closest hit of a block with instances among what `options` leave.
#[inline(never)]
pub(crate) fn closest<D: Across, W: Watch>(
    block: Finished,
    ray: &Ray,
    options: &QueryOptions,
    mut watch: W,
) -> Option<Hit> {
    let level = block.level()?;
    let mut ask_in = |place: &Shown, ray: &Ray| {
        if place.is_empty() {
            return None;
        }
        let choice = place.choice(options);
        let hit = closest_hit::<D, _>(place.block, ray, choice, watch.lend())?;
        Some(Hit { instance: place.instance, ..hit })
    };
    let own = Shown::own(block);
    let mut best = ask_in(&own, ray).map(|hit| Best { hit, shown: own, ray: *ray });
    let limited = |best: &Option<Best>| Ray {
        t_max: best.as_ref().map_or(ray.t_max, |best| best.limit(ray)),
        ..*ray
    };
    let (start, mut steps) = (limited(&best), Counts::default());
    let counts = W::COUNTS.then_some(&mut steps);
    visit_reached(&level, &start, counts, &mut |number| {
        let found = Shown::of(&level, number, options).and_then(|(shown, record)| {
            let ray = record.object_ray(&limited(&best))?;
            ask_in(&shown, &ray).map(|hit| Best { hit, shown, ray })
        });
        if let Some(found) = found
            && best.as_ref().is_none_or(|best| found.is_before::<D>(best, options))
        {
            best = Some(found);
        }
        Some(limited(&best).t_max)
    });
    watch.steps(steps.steps);
    best.map(|best| best.hit)
}

/// Whether anything that `options` leave is hit in a block with instances.
#[inline(never)]
pub(crate) fn any<D: Decide, W: Watch>(
    block: Finished,
    ray: &Ray,
    options: &QueryOptions,
    mut watch: W,
) -> bool {
    let Some(level) = block.level() else { return false };
    let mut is_hit_in = |place: &Shown, ray: &Ray| {
        let choice = place.choice(options);
        !place.is_empty() && any_hit::<D, _>(place.block, ray, choice, watch.lend())
    };
    if is_hit_in(&Shown::own(block), ray) {
        return true;
    }
    let (mut hit, mut steps) = (false, Counts::default());
    let counts = W::COUNTS.then_some(&mut steps);
    visit_reached(&level, ray, counts, &mut |number| {
        hit = Shown::of(&level, number, options).is_some_and(|(shown, record)| {
            record.object_ray(ray).is_some_and(|ray| is_hit_in(&shown, &ray))
        });
        (!hit).then_some(ray.t_max)
    });
    watch.steps(steps.steps);
    hit
}

/// The block of an instance, or the one that has instances.
#[derive(Clone, Copy)]
pub(crate) struct Shown<'m> {
    pub block: Finished<'m>,
    /// [`NONE`] for the one that has them.
    pub instance: u32,
}

impl<'m> Shown<'m> {
    /// That of no instance.
    pub fn own(block: Finished<'m>) -> Self {
        Shown { block, instance: NONE }
    }

    /// That of an instance, if `options` leave it.
    pub fn of(
        level: &Level<'m>,
        instance: u32,
        options: &QueryOptions,
    ) -> Option<(Self, &'m InstanceRecord)> {
        let record = level.instances.get(instance as usize)?;
        let seen = shares_bit(record.mask, options.mask);
        let block = level.child(record).filter(|_| seen)?;
        Some((Shown { block, instance }, record))
    }

    /// Whether it has no primitives of its own.
    fn is_empty(&self) -> bool {
        self.block.header().counts.prim_ids == 0
    }

    /// What `options` leave of it.
    #[inline(always)]
    pub fn choice(&self, options: &QueryOptions) -> Choice {
        let block = self.block.parts();
        Choice::new(options, self.instance, block.geometries, block.header.prim_limit)
    }
}

/// The best hit so far, and the ray in whose space it is.
pub(crate) struct Best<'m> {
    hit: Hit,
    shown: Shown<'m>,
    ray: Ray,
}

impl Best<'_> {
    /// A limit that is not below the real `t`, which the hit's is rounded from.
    fn limit(&self, ray: &Ray) -> f32 {
        self.hit.t.next_up().min(ray.t_max)
    }

    /// Whether this comes first: at a smaller `t`, or at an equal one in an instance of a smaller number.
    fn is_before<D: Across>(&self, other: &Best, options: &QueryOptions) -> bool {
        match self.hit.t.partial_cmp(&other.hit.t) {
            Some(Ordering::Less) => true,
            Some(Ordering::Greater) | None => false,
            Some(Ordering::Equal) => match D::order(self, other, options) {
                Ordering::Less => true,
                Ordering::Greater => false,
                // `NONE` comes before all numbers.
                Ordering::Equal => {
                    self.hit.instance.wrapping_add(1) < other.hit.instance.wrapping_add(1)
                }
            },
        }
    }
}

/// How meetings of one rounded `t` on different lines are ordered.
pub(crate) trait Across: Decide {
    fn order(a: &Best, b: &Best, options: &QueryOptions) -> Ordering;
}

impl Across for Exact {
    #[cold]
    fn order(a: &Best, b: &Best, options: &QueryOptions) -> Ordering {
        let met =
            |best: &Best| ask(best.shown.block, &best.ray, ClosestMet(best.shown.choice(options)));
        let both = met(a).zip(met(b));
        both.map_or(Ordering::Equal, |(p, q)| p.compare(&a.ray.line(), &q, &b.ray.line()))
    }
}

impl Across for Watertight {
    fn order(_: &Best, _: &Best, _: &QueryOptions) -> Ordering {
        Ordering::Equal
    }
}

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
    let index = level.index.header();
    let farthest = ray.origin.iter().fold(0.0f32, |farthest, x| farthest.max(x.abs()));
    let beyond = f64::from(farthest) - f64::from(level.head.calm);
    let widening = f64::from(level.head.spread) * beyond.max(0.0);
    // What is not a tree has its boxes in its cells, as wide as they are.
    if widening == 0.0 || index.kind == KIND_BVH {
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

/// Calls `visit` for each instance whose box the ray comes to, one after the other: for rays at the ends of the floats, and
/// for rays from far away where the index is a list or a grid.
#[cold]
fn visit_all(level: &Level, ray: &Ray, widening: f64, visit: &mut Visit) {
    let Some(prepared) = ray.prepare(level.index.header().reach) else { return };
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
        let (mut late, slab) = ray.set_out(s, block.header.reach)?;
        let slab = if widening > 0.0 { slab.widened(widening) } else { slab };
        // Where each instance is a leaf its box was tested on the way.
        let alone = !matches!(block.bundles, Bundles::None);
        let near = (!alone).then(|| Near::new(late.prepare(), f64::from(widening)));
        let (t_bound, t_scale) = (late.t_max, late.t_scale());
        let mut query =
            Reach { level, visit, t_bound, t_scale, near, visited: [NONE; MAILBOX], watch };
        trace(s, block, &mut late, &slab, &mut query);
        Some(())
    }
}

/// So many instances that were visited are remembered: a grid comes to one once for each of its cells.
const MAILBOX: usize = 32;

/// The query that calls back for instances.
struct Reach<'a, 'm, 'v, W> {
    level: &'a Level<'m>,
    visit: &'a mut Visit<'v>,
    t_bound: f32,
    t_scale: f64,
    near: Option<Near>,
    visited: [u32; MAILBOX],
    watch: W,
}

impl<W: Watch> Query for Reach<'_, '_, '_, W> {
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
