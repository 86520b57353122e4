//! One ray through one block: a question, compiled once for each backend from the ray to the answer.

use core::marker::PhantomData;

use crate::block::{Block, Bundles, KIND_BVH, KIND_GRID};
use crate::bvh;
use crate::grid::{self, Cells};
use crate::prim::Leaves;
use crate::query::{Any, Closest, Decide, Filter, Locate, Meets, Query, Watch, geometry_of};
use crate::ray::{Hit, NONE, NarrowSlab, PreparedRay, Ray, Slab, WideSlab};
use crate::simd::{self, Kernel, Scalar, Simd};

/// What is asked of a ray.
pub(crate) trait Question {
    type Query: Query;
    type Answer;

    fn query(self, ray: &PreparedRay) -> Self::Query;

    /// The answer, from a query that a traversal has fed; `ended` is whether it ended the search.
    fn answer(
        block: &Block,
        ray: &PreparedRay,
        query: &mut Self::Query,
        ended: bool,
    ) -> Self::Answer;

    /// The answer of a ray that can hit nothing.
    fn nothing() -> Self::Answer;
}

/// The closest hit that the filter leaves; `MEMORY` as for [`Closest`].
#[derive(Clone, Copy)]
pub(crate) struct ClosestHit<'m, D, W, const MEMORY: usize> {
    filter: Filter<'m>,
    watch: W,
    decide: PhantomData<D>,
}

/// Whether anything is hit that the filter leaves.
#[derive(Clone, Copy)]
pub(crate) struct AnyHit<'m, D, W> {
    filter: Filter<'m>,
    watch: W,
    decide: PhantomData<D>,
}

impl<'m, D, W, const MEMORY: usize> ClosestHit<'m, D, W, MEMORY> {
    #[inline(always)]
    pub fn new(filter: Filter<'m>, watch: W) -> Self {
        ClosestHit { filter, watch, decide: PhantomData }
    }
}

impl<'m, D, W> AnyHit<'m, D, W> {
    #[inline(always)]
    pub fn new(filter: Filter<'m>, watch: W) -> Self {
        AnyHit { filter, watch, decide: PhantomData }
    }
}

impl<'m, D: Decide, W: Watch, const MEMORY: usize> Question for ClosestHit<'m, D, W, MEMORY> {
    type Query = Closest<'m, D, W, MEMORY>;
    type Answer = Option<Hit>;

    #[inline(always)]
    fn query(self, ray: &PreparedRay) -> Self::Query {
        Closest::new(self.filter, ray, self.watch)
    }

    #[inline(always)]
    fn answer(
        block: &Block,
        ray: &PreparedRay,
        query: &mut Self::Query,
        _ended: bool,
    ) -> Option<Hit> {
        let Closest { best, watch, .. } = query;
        Some(hit::<D>(block, ray, best.as_ref()?, watch))
    }

    fn nothing() -> Option<Hit> {
        None
    }
}

impl<'m, D: Decide, W: Watch> Question for AnyHit<'m, D, W> {
    type Query = Any<'m, D, W>;
    type Answer = bool;

    #[inline(always)]
    fn query(self, ray: &PreparedRay) -> Self::Query {
        Any::new(self.filter, ray, self.watch)
    }

    #[inline(always)]
    fn answer(_: &Block, _: &PreparedRay, _: &mut Self::Query, ended: bool) -> bool {
        ended
    }

    fn nothing() -> bool {
        false
    }
}

/// The answer to `question` for one ray.
#[inline(always)]
pub(crate) fn ask<Q: Question>(block: &Block, ray: &Ray, question: Q) -> Q::Answer {
    let ask = Ask { block, ray, question };
    // What is counted need not be fast, which saves its code for every backend.
    if <Q::Query as Query>::Watch::COUNTS { ask.run(Scalar) } else { simd::dispatch(ask) }
}

/// One ray, waiting for a backend.
struct Ask<'a, 'm, Q> {
    block: &'a Block<'m>,
    ray: &'a Ray,
    question: Q,
}

impl<Q: Question> Kernel for Ask<'_, '_, Q> {
    type Output = Q::Answer;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Q::Answer {
        let Some(ray) = self.ray.prepare_with(s, self.block.header.reach) else {
            return Q::nothing();
        };
        let mut query = self.question.query(&ray);
        let ended = trace(s, self.block, &ray, &mut query);
        Q::answer(self.block, &ray, &mut query, ended)
    }
}

/// The meeting with the primitive of this flat number at this answered `t`.
pub(crate) fn locate<D: Decide>(
    block: &Block,
    ray: &PreparedRay,
    number: u32,
    t: f32,
) -> Option<D::Met> {
    let find = Find { block, ray, query: Locate::<D>::new(number, t, ray, block.prim_ids) };
    // Hits of the watertight mode, which is tried second, are rarely looked up.
    if D::ANY_BOXES { simd::dispatch(find) } else { find.run(Scalar) }
}

struct Find<'a, 'm, D: Decide> {
    block: &'a Block<'m>,
    ray: &'a PreparedRay,
    query: Locate<'m, D>,
}

impl<D: Decide> Kernel for Find<'_, '_, D> {
    type Output = Option<D::Met>;

    #[inline(always)]
    fn run<S: Simd>(mut self, s: S) -> Option<D::Met> {
        trace(s, self.block, self.ray, &mut self.query);
        self.query.found
    }
}

/// The record of the meeting that won.
#[inline(never)]
fn hit<D: Decide>(block: &Block, ray: &PreparedRay, best: &D::Met, watch: &mut impl Watch) -> Hit {
    let number = best.place().prim(block.prim_ids);
    let (geometry, first) =
        geometry_of(number, block.geometries).map_or((NONE, 0), |(place, g)| (place, g.first));
    let [u, v] = D::weights(ray, best);
    let t = D::t(ray, best, watch);
    Hit { t, u, v, prim: number - first, geometry, instance: NONE }
}

/// Offers `query` what the ray meets, by the one traversal of the structure at hand.
#[inline(always)]
fn trace<S: Simd, Q: Query>(s: S, block: &Block, ray: &PreparedRay, query: &mut Q) -> bool {
    let leaves = Leaves::of(block);
    if let (KIND_GRID, Some(head)) = (block.header.kind, block.grids.first()) {
        let Block { words, runs, .. } = *block;
        return grid::walk(s, &Cells { head, words, runs, leaves }, ray, query);
    }
    // Boxes in `f32` where the frame allows.
    match NarrowSlab::new(s, ray) {
        Some(slab) => boxes(s, block, &leaves, ray, &slab, query),
        None => wide_boxes(block, &leaves, ray, query),
    }
}

/// For rays and scenes at the ends of the floats. They are so rare that portable code will do.
#[cold]
#[inline(never)]
fn wide_boxes<Q: Query>(block: &Block, leaves: &Leaves, ray: &PreparedRay, query: &mut Q) -> bool {
    boxes(Scalar, block, leaves, ray, &WideSlab::new(ray), query)
}

#[inline(always)]
fn boxes<S: Simd, Q: Query>(
    s: S,
    block: &Block,
    leaves: &Leaves,
    ray: &PreparedRay,
    slab: &impl Slab,
    query: &mut Q,
) -> bool {
    match (block.header.kind, block.bundles) {
        (KIND_BVH, Bundles::None) => bvh::traverse(s, block.nodes, leaves, ray, slab, query),
        (_, Bundles::Four(bundles)) => bvh::traverse_wide(s, bundles, leaves, ray, slab, query),
        (_, Bundles::Eight(bundles)) => bvh::traverse_wide(s, bundles, leaves, ray, slab, query),
        (_, Bundles::Sixteen(bundles)) => bvh::traverse_wide(s, bundles, leaves, ray, slab, query),
        (_, Bundles::None) => leaves.intersect_all(s, ray, slab, query),
    }
}
