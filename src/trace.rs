//! One ray through one block: a question, compiled once for each backend from the ray to the answer.

use core::marker::PhantomData;

use crate::block::{Block, Bundles, KIND_BVH, KIND_GRID};
use crate::bvh;
use crate::grid::{self, Cells};
use crate::prim::Leaves;
use crate::query::{Any, Closest, Decide, Filter, Locate, Meets, Query, Watch, geometry_of};
use crate::ray::{Hit, NONE, PreparedRay, Ray, Slab, WideSlab};
use crate::simd::{self, Kernel, Scalar, Simd};

/// What is asked of a ray.
pub(crate) trait Question {
    type Query: Query;
    type Answer;
    /// Whether it need not be fast, which saves its code for every backend.
    const RARE: bool = false;

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
    const RARE: bool = W::COUNTS;

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
    const RARE: bool = W::COUNTS;

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

/// The meeting with the primitive of a number at an answered `t`.
#[derive(Clone, Copy)]
pub(crate) struct LocateHit<'m, D> {
    number: u32,
    t: f32,
    prim_ids: &'m [u32],
    decide: PhantomData<D>,
}

impl<'m, D> LocateHit<'m, D> {
    /// With this flat number and `t`.
    pub fn new(number: u32, t: f32, block: &Block<'m>) -> Self {
        LocateHit { number, t, prim_ids: block.prim_ids, decide: PhantomData }
    }
}

impl<'m, D: Decide> Question for LocateHit<'m, D> {
    type Query = Locate<'m, D>;
    type Answer = Option<D::Met>;
    // Hits of the watertight mode, which is tried second, are rarely looked up.
    const RARE: bool = !D::ANY_BOXES;

    #[inline(always)]
    fn query(self, ray: &PreparedRay) -> Self::Query {
        Locate::new(self.number, self.t, ray, self.prim_ids)
    }

    #[inline(always)]
    fn answer(_: &Block, _: &PreparedRay, query: &mut Self::Query, _: bool) -> Self::Answer {
        query.found
    }

    fn nothing() -> Self::Answer {
        None
    }
}

/// The answer to `question` for one ray.
#[inline(always)]
pub(crate) fn ask<Q: Question>(block: &Block, ray: &Ray, question: Q) -> Q::Answer {
    let ask = Ask { block, ray, question };
    if Q::RARE { ask.run(Scalar) } else { simd::dispatch(ask) }
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
        let Ask { block, ray, question } = self;
        let Some((ray, slab)) = ray.prepare_with(s, block.header.reach) else {
            return ask_odd(block, ray, question);
        };
        let mut query = question.query(&ray);
        let ended = trace(s, block, &ray, &slab, &mut query);
        Q::answer(block, &ray, &mut query, ended)
    }
}

/// For rays and scenes at the ends of the floats, with boxes in `f64`. They are so rare that portable code will do.
#[cold]
#[inline(never)]
fn ask_odd<Q: Question>(block: &Block, ray: &Ray, question: Q) -> Q::Answer {
    let Some(ray) = ray.prepare_odd(block.header.reach) else { return Q::nothing() };
    let mut query = question.query(&ray);
    let ended = trace(Scalar, block, &ray, &WideSlab::new(&ray), &mut query);
    Q::answer(block, &ray, &mut query, ended)
}

/// The record of the meeting that won.
#[inline(never)]
fn hit<D: Decide>(block: &Block, ray: &PreparedRay, best: &D::Met, watch: &mut impl Watch) -> Hit {
    let number = best.place().prim(block.prim_ids);
    let (geometry, first) =
        geometry_of(number, block.geometries).map_or((NONE, 0), |(place, g)| (place, g.first));
    let [u, v] = D::weights(best);
    let t = D::t(ray, best, watch);
    Hit { t, u, v, prim: number - first, geometry, instance: NONE }
}

/// Offers `query` what the ray meets, by the one traversal of the structure at hand.
#[inline(always)]
fn trace<S: Simd, Q: Query>(
    s: S,
    block: &Block,
    ray: &PreparedRay,
    slab: &impl Slab,
    query: &mut Q,
) -> bool {
    let leaves = &Leaves::of(block);
    match block.bundles {
        Bundles::Sixteen(bundles) => bvh::traverse_wide(s, bundles, leaves, ray, slab, query),
        Bundles::Eight(bundles) => bvh::traverse_wide(s, bundles, leaves, ray, slab, query),
        Bundles::Four(bundles) => bvh::traverse_wide(s, bundles, leaves, ray, slab, query),
        Bundles::None => match block.header.kind {
            KIND_BVH => bvh::traverse(s, block.nodes, leaves, ray, slab, query),
            KIND_GRID => {
                let (Block { grids, words, runs, .. }, leaves) = (*block, *leaves);
                grid::walk(s, &Cells { grids, words, runs, leaves }, ray, slab, query)
            }
            _ => leaves.intersect_all(s, ray, slab, query),
        },
    }
}
