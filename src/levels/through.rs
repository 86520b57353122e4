//! One ray through the index, and into each instance that it comes to.

use super::reach::{Reach, instance_of, visit_reached, widening};
use crate::block::Bundles;
use crate::block::level::Level;
use crate::bvh::{Columns, ENOUGH_ROOM, Walk};
use crate::math::rounding::f32_above;
use crate::query::{Counts, Watch};
use crate::ray::{Ray, Slab};
use crate::simd::{self, Kernel, Simd, Width};

/// What is looked for in instances.
pub(super) trait Search {
    /// Looks into an instance. A limit of `t` of what is still of interest, or `None` to end the search.
    fn visit<S: Simd>(&mut self, s: S, instance: u32) -> Option<f32>;
}

/// Lets `search` visit each instance whose rounded ray may hit something, near ones first as far as the index is a tree.
///
/// For the layout that is chosen automatically this is one piece of code from the ray to the question; others go the way
/// that is there for all questions.
pub(super) fn visit_by<W: Watch>(
    level: &Level,
    ray: &Ray,
    search: &mut impl Search,
    counts: &mut Counts,
) {
    if !W::COUNTS && simd::dispatch(Through { level, ray, search }).is_some() {
        return;
    }
    let counts = W::COUNTS.then_some(counts);
    visit_reached(level, ray, counts, &mut |instance| visit(search, instance));
}

/// Lets `search` visit one instance. Out of line: where there are no vectors all of the question is compiled into it.
#[inline(never)]
pub(super) fn visit(search: &mut impl Search, instance: u32) -> Option<f32> {
    simd::dispatch(Visit { search, instance })
}

struct Visit<'a, T> {
    search: &'a mut T,
    instance: u32,
}

impl<T: Search> Kernel for Visit<'_, T> {
    type Output = Option<f32>;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Option<f32> {
        self.search.visit(s, self.instance)
    }
}

/// The answer is `None` if this is no ray or no index for it; then nothing was visited.
struct Through<'a, 'm, T> {
    level: &'a Level<'m>,
    ray: &'a Ray,
    search: &'a mut T,
}

impl<T: Search> Kernel for Through<'_, '_, T> {
    type Output = Option<()>;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Option<()> {
        let Through { level, ray, search } = self;
        let index = &level.index.parts();
        let Bundles::Sixteen(bundles) = index.bundles else { return None };
        if !S::FLIES || widening(level, ray) > 0.0 {
            return None;
        }
        let (late, slab) = ray.set_out(s, index.header.reach)?;
        let (boxes, t_scale) = (slab.wide::<S, 16>(s), late.t_scale());
        let mut columns = Columns::<ENOUGH_ROOM>::UNWRITTEN;
        let mut walk = Walk::new(&mut columns, late.t_max);
        loop {
            let t_bounds = Width::<16>::splat(s, walk.t_bound());
            while !walk.at().is_leaf() {
                let bundle = bundles.get(walk.at().bundle_number());
                let entered = bundle.is_some_and(|bundle| {
                    walk.enter::<S, Reach<'_, '_, '_, ()>, 16>(s, bundle, &boxes, t_bounds)
                });
                if !entered {
                    return Some(());
                }
            }
            let Some(instance) = instance_of(index, walk.at()) else { return Some(()) };
            let Some(limit) = search.visit(s, instance) else { return Some(()) };
            walk.leave::<S, Reach<'_, '_, '_, ()>>(s, f32_above(f64::from(limit) * t_scale));
        }
    }
}
