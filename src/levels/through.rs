//! One ray through the index, and into each instance that it comes to.

use core::hint::black_box;

use super::World;
use super::reach::{Extent, instance_of, is_calm, visit_reached};
use crate::block::Bundles;
use crate::block::level::Level;
use crate::bvh::{Columns, ENOUGH_ROOM, Walk};
use crate::math::rounding::f32_above;
use crate::query::{Counts, Watch};
use crate::ray::{Ray, Slab};
use crate::simd::{self, Kernel, Simd, Width};

/// What is looked for.
pub(super) trait Search: Sized {
    type Watch: Watch;
    type Found;

    /// Looks among the primitives that are in no instance. A limit of `t` of what is still of interest, or `None` to end the
    /// search.
    fn own<S: Simd>(&mut self, s: S) -> Option<f32>;

    /// Looks into an instance, likewise.
    fn visit<S: Simd>(&mut self, s: S, instance: u32) -> Option<f32>;

    /// What was found, after so many boxes and cells of the index.
    fn found(self, steps: u64) -> Self::Found;
}

/// A search that can begin.
pub(super) trait Begin<'a, 'm>: Search {
    /// Nothing looked at yet.
    fn new(world: &'a World<'a, 'm>, ray: &'a Ray, watch: Self::Watch) -> Self;
}

/// What a search finds in what is in no instance and in each instance whose rounded ray may hit something, near ones first as
/// far as the index is a tree.
///
/// For the layout that is chosen automatically this is one piece of code from the ray to the answer, which stays in registers
/// on the way; others go the way that is there for all questions.
#[inline(always)]
pub(super) fn through<'a, 'm, T: Begin<'a, 'm>>(
    world: &'a World<'a, 'm>,
    ray: &'a Ray,
    watch: T::Watch,
) -> T::Found {
    simd::dispatch(Through::<T> { world, ray, watch })
}

/// A search that has not begun: made here, it would go through memory.
struct Through<'a, 'm, T: Search> {
    world: &'a World<'a, 'm>,
    ray: &'a Ray,
    watch: T::Watch,
}

impl<'a, 'm, T: Begin<'a, 'm>> Kernel for Through<'a, 'm, T> {
    type Output = T::Found;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> T::Found {
        let Through { world, ray, watch } = self;
        let (level, mut search) = (world.level, T::new(world, ray, watch));
        let Some(limit) = search.own(s) else { return search.found(0) };
        if !T::Watch::COUNTS && S::FLIES && walk(s, level, ray, limit, &mut search).is_some() {
            return search.found(0);
        }
        any_way(level, &Ray { t_max: limit, ..*ray }, search)
    }
}

/// Visits instances, near ones first. The answer is `None` if this is no ray or no index for it; then nothing was visited.
#[inline(always)]
fn walk<S: Simd>(
    s: S,
    level: &Level,
    ray: &Ray,
    limit: f32,
    search: &mut impl Search,
) -> Option<()> {
    let index = &level.index.parts();
    let Bundles::Sixteen(bundles) = index.bundles else { return None };
    if !is_calm(level, ray) {
        return None;
    }
    let (late, slab) = ray.set_out(s, index.header.extent())?;
    let t_scale = late.t_scale();
    let in_frame = |limit: f32| f32_above(f64::from(limit) * t_scale);
    let (mut limit, mut t_bound) = (limit, late.t_max);
    if limit < ray.t_max {
        t_bound = in_frame(limit);
    }
    let mut columns = Columns::<ENOUGH_ROOM>::UNWRITTEN;
    let mut walk = Walk::new(&mut columns, t_bound);
    loop {
        if !walk.at().is_leaf() {
            // From memory anew after a visit, over which no vector is kept: ten would be written and read for each.
            let boxes = black_box(&slab).wide::<S, 16>(s);
            let t_bounds = Width::<16>::splat(s, walk.t_bound());
            while !walk.at().is_leaf() {
                let bundle = bundles.get(walk.at().bundle_number());
                let entered = bundle.is_some_and(|bundle| {
                    walk.enter::<S, Extent<'_, '_, '_, ()>, 16>(s, bundle, &boxes, t_bounds)
                });
                if !entered {
                    return Some(());
                }
            }
        }
        let Some(instance) = instance_of(index, walk.at()) else { return Some(()) };
        let Some(left) = search.visit(s, instance) else { return Some(()) };
        if left < limit {
            (limit, t_bound) = (left, in_frame(left));
        }
        walk.leave(s, t_bound, true);
    }
}

/// The same for any ray and any index.
#[cold]
#[inline(never)]
fn any_way<T: Search>(level: &Level, ray: &Ray, mut search: T) -> T::Found {
    let mut counts = Counts::default();
    let counted = T::Watch::COUNTS.then_some(&mut counts);
    visit_reached(level, ray, counted, &mut |instance| {
        simd::dispatch(Visit(&mut search, instance))
    });
    search.found(counts.steps)
}

struct Visit<'s, T>(&'s mut T, u32);

impl<T: Search> Kernel for Visit<'_, T> {
    type Output = Option<f32>;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Option<f32> {
        self.0.visit(s, self.1)
    }
}
