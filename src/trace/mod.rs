//! One ray through one block: a question, compiled once for each backend from the ray to the answer.

mod questions;
mod settle;

pub(crate) use questions::{AnyHit, ClosestHit, ClosestMet, LocateHit, MEMORY, either_hit};
pub(crate) use settle::{Firsts, Together};

use crate::block::leaf::Place;
use crate::block::{Block, Bundles, Finished, KIND_BVH, KIND_GRID};
use crate::bvh;
use crate::grid::{self, Cells};
use crate::kinds::{GRID, WIDE};
use crate::prim::Leaves;
use crate::query::{Decide, Erased, Meets, Query, Watch, geometry_of};
use crate::ray::{Early, FrameSlab, Hit, Late, NONE, PreparedRay, Ray, Slab};
use crate::simd::{self, Kernel, SMALL, Scalar, Simd};

/// What is asked of a ray.
pub(crate) trait Question<'m> {
    type Query: Query;
    type Answer;
    /// Whether it need not be fast: then it is asked as odd rays ask, which saves its code for every backend.
    const RARE: bool = false;

    /// The query, of which nothing beyond this `t` of the frame is asked.
    fn query(self, block: Finished<'m>, t_max: f32) -> Self::Query;

    /// The answer, from a query that a traversal has fed; `ended` is whether it ended the search.
    fn answer<S: Simd>(
        s: S,
        block: Finished<'m>,
        ray: &PreparedRay,
        query: &mut Self::Query,
        ended: bool,
    ) -> Self::Answer;

    /// The answer of a ray that can hit nothing.
    fn nothing() -> Self::Answer;
}

/// The answer to `question` for one ray, without what is in instances.
#[inline(always)]
pub(crate) fn ask<'m, Q: Question<'m>>(block: Finished<'m>, ray: &Ray, question: Q) -> Q::Answer {
    if SMALL || Q::RARE {
        return ask_any(block, ray, question);
    }
    simd::dispatch(Ask { block, ray, question })
}

/// The same by a backend that is chosen already.
#[inline(always)]
pub(crate) fn ask_by<'m, S: Simd, Q: Question<'m>>(
    s: S,
    block: Finished<'m>,
    ray: &Ray,
    question: Q,
) -> Q::Answer {
    if SMALL || Q::RARE {
        return ask_any(block, ray, question);
    }
    s.run(Ask { block, ray, question })
}

/// One ray, waiting for a backend.
struct Ask<'a, 'm, Q> {
    block: Finished<'m>,
    ray: &'a Ray,
    question: Q,
}

impl<'m, Q: Question<'m>> Kernel for Ask<'_, 'm, Q> {
    type Output = Q::Answer;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> Q::Answer {
        let Ask { block, ray, question } = self;
        let extent = block.header().extent();
        let Some((late, slab)) = ray.set_out(s, extent) else {
            // A copy is lent: what was made by parts, as in an instance, had better not go through memory.
            let ray = *ray;
            return ask_any(block, &ray, question);
        };
        let mut query = question.query(block, late.t_max);
        let mut prepared = None;
        let ended = trace(s, block, (&late, &mut prepared), &slab, &mut query);
        // Nothing that is not prepared has met anything.
        let Some(ray) = &prepared else { return Q::nothing() };
        Q::answer(s, block, ray, &mut query, ended)
    }
}

/// For any ray: for those at the ends of the floats, which are so rare that portable code will do, behind pointers; for
/// questions that are rare; and for all where code shall be small.
#[cold]
#[inline(never)]
fn ask_any<'m, Q: Question<'m>>(block: Finished<'m>, ray: &Ray, question: Q) -> Q::Answer {
    let extent = block.header().extent();
    // Where it is: a copy would be another kind of call, and twice the room.
    let mut prepared = ray.prepare_any(extent.scene);
    let Some(ray) = &prepared else { return Q::nothing() };
    let mut query = question.query(block, ray.t_max);
    let slab = FrameSlab::new(ray, extent);
    // Those who add up stacks do not see through pointers.
    let ended = match Q::Query::ORDERED {
        _ if SMALL => trace(Scalar, block, (&Early, &mut prepared), &slab, &mut query),
        true => trace_any(block, &mut prepared, &slab, Erased::<true>(&mut query)),
        false => trace_any(block, &mut prepared, &slab, Erased::<false>(&mut query)),
    };
    let Some(ray) = &prepared else { return Q::nothing() };
    Q::answer(Scalar, block, ray, &mut query, ended)
}

/// [`trace`] for queries of any type.
#[inline(never)]
fn trace_any<const ORDERED: bool>(
    block: Finished,
    prepared: &mut Option<PreparedRay>,
    slab: &FrameSlab,
    mut query: Erased<ORDERED>,
) -> bool {
    trace(Scalar, block, (&Early, prepared), slab, &mut query)
}

/// The record of the meeting that won. A backend writes it as a whole here too, for whoever copies it.
#[inline(never)]
fn hit<D: Decide>(
    s: impl Simd,
    block: Finished,
    ray: &PreparedRay,
    best: &D::Met,
    watch: &mut impl Watch,
) -> Hit {
    record(s, block, best.place(), D::t(ray, best, watch), D::weights(best))
}

/// The record of a meeting.
#[inline(always)]
pub(crate) fn record(s: impl Simd, block: Finished, place: Place, t: f32, [u, v]: [f32; 2]) -> Hit {
    let Name { prim, geometry } = name(&block.parts(), place);
    Hit::of_whole(s, Hit { t, u, v, prim, geometry, instance: NONE })
}

/// What the caller calls a primitive.
#[derive(Clone, Copy)]
struct Name {
    prim: u32,
    geometry: u32,
}

#[inline(always)]
fn name(block: &Block, place: Place) -> Name {
    let number = place.prim(block.prim_ids);
    let (geometry, first) =
        geometry_of(number, block.geometries).map_or((NONE, 0), |(place, g)| (place, g.first));
    Name { prim: number - first, geometry }
}

/// Offers `query` what the ray meets, by the one traversal of the structure at hand. The ray is prepared when it comes to a
/// leaf, unless it is.
#[inline(always)]
pub(crate) fn trace<S: Simd, Q: Query>(
    s: S,
    block: Finished,
    (late, prepared): (&impl Late, &mut Option<PreparedRay>),
    slab: &impl Slab,
    query: &mut Q,
) -> bool {
    // Here, where it is known what they are: parts that are not used cost nothing then.
    let block = &block.parts();
    let leaves = &Leaves::of(block);
    match block.bundles {
        Bundles::Sixteen(bundles) if WIDE => {
            bvh::traverse_wide(s, bundles, leaves, (late, prepared), slab, query)
        }
        Bundles::Eight(bundles) if WIDE => {
            bvh::traverse_wide(s, bundles, leaves, (late, prepared), slab, query)
        }
        Bundles::Four(bundles) if WIDE => {
            bvh::traverse_wide(s, bundles, leaves, (late, prepared), slab, query)
        }
        _ => {
            if prepared.is_none() {
                *prepared = Some(late.prepare());
            }
            let Some(ray) = prepared else { return false };
            // A copy, which may be lent to what is out of line: the way through bundles keeps its own in registers.
            let slab = &{ *slab };
            match block.header.kind {
                KIND_BVH => bvh::traverse(s, block.nodes, leaves, ray, slab, query),
                KIND_GRID if GRID => {
                    let (Block { grids, words, runs, .. }, leaves) = (*block, *leaves);
                    grid::walk(s, &Cells { grids, words, runs, leaves }, ray, slab, query)
                }
                _ => leaves.intersect_all(s, ray, slab, query),
            }
        }
    }
}
