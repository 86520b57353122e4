//! One ray through one block: a question, compiled once for each backend from the ray to the answer.

use crate::block::{Block, Bundles, KIND_BVH, KIND_GRID};
use crate::bvh;
use crate::grid::{self, Cells};
use crate::prim::Leaves;
use crate::query::{Any, Closest, Decide, Filter, Locate, Meets, Query, Watch, geometry_of};
use crate::ray::{Hit, NONE, NarrowSlab, PreparedRay, Ray, Slab, WideSlab};
use crate::simd::{self, Kernel, Scalar, Simd};

/// The closest hit that `filter` leaves.
#[inline(always)]
pub(crate) fn closest<D: Decide, W: Watch>(
    block: &Block,
    ray: &Ray,
    filter: Filter,
    watch: W,
) -> Option<Hit> {
    let question =
        FindClosest { block, ray, filter, watch, decide: core::marker::PhantomData::<D> };
    // What is counted need not be fast, which saves its code for every backend.
    if W::COUNTS { question.run(Scalar) } else { simd::dispatch(question) }
}

/// Whether anything is hit that `filter` leaves.
#[inline(always)]
pub(crate) fn any<D: Decide, W: Watch>(block: &Block, ray: &Ray, filter: Filter, watch: W) -> bool {
    let question = FindAny { block, ray, filter, watch, decide: core::marker::PhantomData::<D> };
    if W::COUNTS { question.run(Scalar) } else { simd::dispatch(question) }
}

/// The meeting with the primitive of this flat number at this answered `t`.
pub(crate) fn locate<D: Decide>(
    block: &Block,
    ray: &PreparedRay,
    number: u32,
    t: f32,
) -> Option<D::Met> {
    let question = Find { block, ray, query: Locate::<D>::new(number, t, ray, block.prim_ids) };
    // Hits of the watertight mode, which is tried second, are rarely looked up.
    if D::ANY_BOXES { simd::dispatch(question) } else { question.run(Scalar) }
}

struct FindClosest<'a, 'm, D, W> {
    block: &'a Block<'m>,
    ray: &'a Ray,
    filter: Filter<'m>,
    watch: W,
    decide: core::marker::PhantomData<D>,
}

impl<D: Decide, W: Watch> Kernel for FindClosest<'_, '_, D, W> {
    type Output = Option<Hit>;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Option<Hit> {
        let ray = self.ray.prepare_with(s, self.block.header.reach)?;
        let mut query = Closest::<D, _>::new(self.filter, &ray, self.watch);
        trace(s, self.block, &ray, &mut query);
        let Closest { best, watch, .. } = &mut query;
        Some(hit::<D>(self.block, &ray, best.as_ref()?, watch))
    }
}

struct FindAny<'a, 'm, D, W> {
    block: &'a Block<'m>,
    ray: &'a Ray,
    filter: Filter<'m>,
    watch: W,
    decide: core::marker::PhantomData<D>,
}

impl<D: Decide, W: Watch> Kernel for FindAny<'_, '_, D, W> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> bool {
        let Some(ray) = self.ray.prepare_with(s, self.block.header.reach) else { return false };
        trace(s, self.block, &ray, &mut Any::<D, _>::new(self.filter, &ray, self.watch))
    }
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
#[inline(always)]
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
