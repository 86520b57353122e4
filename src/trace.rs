//! One ray through one block: a question, compiled once for each backend from the ray to the answer.

use core::marker::PhantomData;

use crate::block::leaf::{KIND_TRIANGLES, LeafRef, Place};
use crate::block::{Block, Bundles, Finished, KIND_BVH, KIND_GRID};
use crate::bvh;
use crate::grid::{self, Cells};
use crate::kinds::{GRID, WIDE};
use crate::math::Bits;
use crate::prim::Leaves;
use crate::query::{
    Any, Choice, Closest, Decide, Either, Erased, Exact, ExactMet, Filter, Locate, Meets, Query,
    SureMeetings, Wanted, Watch, geometry_of,
};
use crate::ray::{Abreast, FrameSlab, Hit, Interval, Late, NONE, PreparedRay, Ray, Slab};
use crate::simd::{self, Kernel, SMALL, Scalar, Simd};

/// What is asked of a ray.
pub(crate) trait Question<'m> {
    type Query: Query;
    type Answer;
    /// Whether it need not be fast: then it is asked as odd rays ask, which saves its code for every backend.
    const RARE: bool = false;

    /// The query, of which nothing beyond this `t` of the frame is asked.
    fn query(self, block: &Block<'m>, t_max: f32) -> Self::Query;

    /// The answer, from a query that a traversal has fed; `ended` is whether it ended the search.
    fn answer(
        block: &Block<'m>,
        ray: &PreparedRay,
        query: &mut Self::Query,
        ended: bool,
    ) -> Self::Answer;

    /// The answer of a ray that can hit nothing.
    fn nothing() -> Self::Answer;
}

/// The closest hit that the filter leaves; `MEMORY` as for [`Closest`].
#[derive(Clone, Copy)]
pub(crate) struct ClosestHit<D, W, const MEMORY: usize> {
    choice: Choice,
    watch: W,
    decide: PhantomData<D>,
}

/// Half a kilobyte of stack, which is spent only where there is plenty: see [`Closest`].
pub(crate) const MEMORY: usize = if cfg!(target_pointer_width = "64") { 1 } else { 0 };

/// Whether anything is hit that the filter leaves.
#[derive(Clone, Copy)]
pub(crate) struct AnyHit<D, W> {
    choice: Choice,
    watch: W,
    decide: PhantomData<D>,
}

impl<D, W, const MEMORY: usize> ClosestHit<D, W, MEMORY> {
    #[inline(always)]
    pub fn new(choice: Choice, watch: W) -> Self {
        ClosestHit { choice, watch, decide: PhantomData }
    }
}

impl<D, W> AnyHit<D, W> {
    #[inline(always)]
    pub fn new(choice: Choice, watch: W) -> Self {
        AnyHit { choice, watch, decide: PhantomData }
    }
}

impl<'m, D: Decide, W: Watch, const MEMORY: usize> Question<'m> for ClosestHit<D, W, MEMORY> {
    type Query = Closest<'m, D, W, MEMORY>;
    type Answer = Option<Hit>;
    const RARE: bool = W::COUNTS;

    #[inline(always)]
    fn query(self, block: &Block<'m>, t_max: f32) -> Self::Query {
        let filter = Filter::new(self.choice, block.geometries, block.prim_ids);
        Closest::new(filter, t_max, self.watch)
    }

    #[inline(always)]
    fn answer(
        block: &Block,
        ray: &PreparedRay,
        query: &mut Self::Query,
        _ended: bool,
    ) -> Option<Hit> {
        let Closest { best, watch, .. } = query;
        Some(hit::<D>(block.whole, ray, best.as_ref()?, watch))
    }

    fn nothing() -> Option<Hit> {
        None
    }
}

impl<'m, D: Decide, W: Watch> Question<'m> for AnyHit<D, W> {
    type Query = Any<'m, D, W>;
    type Answer = bool;
    const RARE: bool = W::COUNTS;

    #[inline(always)]
    fn query(self, block: &Block<'m>, t_max: f32) -> Self::Query {
        let filter = Filter::new(self.choice, block.geometries, block.prim_ids);
        Any::new(filter, t_max, self.watch)
    }

    #[inline(always)]
    fn answer(_: &Block, _: &PreparedRay, _: &mut Self::Query, ended: bool) -> bool {
        ended
    }

    fn nothing() -> bool {
        false
    }
}

/// One of these two, as is known when it is asked: one code for both. Any hit is answered by [`Hit::MISS`].
#[derive(Clone, Copy)]
struct EitherHit<D, W> {
    choice: Choice,
    watch: W,
    any: bool,
    decide: PhantomData<D>,
}

impl<'m, D: Decide, W: Watch> Question<'m> for EitherHit<D, W> {
    type Query = Either<'m, D, W>;
    type Answer = Option<Hit>;

    fn query(self, block: &Block<'m>, t_max: f32) -> Self::Query {
        let EitherHit { choice, watch, any, .. } = self;
        Either { closest: ClosestHit::new(choice, watch).query(block, t_max), any }
    }

    fn answer(
        block: &Block<'m>,
        ray: &PreparedRay,
        query: &mut Self::Query,
        ended: bool,
    ) -> Option<Hit> {
        match query.any {
            true => ended.then_some(Hit::MISS),
            false => ClosestHit::<D, W, 0>::answer(block, ray, &mut query.closest, ended),
        }
    }

    fn nothing() -> Option<Hit> {
        None
    }
}

/// The closest hit of a block without what is in instances.
#[inline(always)]
pub(crate) fn closest_hit<D: Decide, W: Watch>(
    block: Finished,
    ray: &Ray,
    choice: Choice,
    watch: W,
) -> Option<Hit> {
    if SMALL {
        return either_hit::<D, W>(block, ray, choice, watch, false);
    }
    ask(block, ray, ClosestHit::<D, W, MEMORY>::new(choice, watch))
}

/// Whether anything is hit in a block without what is in instances.
#[inline(always)]
pub(crate) fn any_hit<D: Decide, W: Watch>(
    block: Finished,
    ray: &Ray,
    choice: Choice,
    watch: W,
) -> bool {
    if SMALL {
        return either_hit::<D, W>(block, ray, choice, watch, true).is_some();
    }
    ask(block, ray, AnyHit::<D, W>::new(choice, watch))
}

#[inline(never)]
fn either_hit<D: Decide, W: Watch>(
    block: Finished,
    ray: &Ray,
    choice: Choice,
    watch: W,
    any: bool,
) -> Option<Hit> {
    ask(block, ray, EitherHit::<D, W> { choice, watch, any, decide: PhantomData })
}

/// What each of sixteen rays meets before all others: a lane of a leaf block.
#[derive(Clone, Copy)]
pub(crate) struct Firsts {
    /// The block's number and kind, as in a [`LeafRef`].
    pub blocks: [u32; 16],
    /// One bit.
    pub lanes: [u32; 16],
}

impl Firsts {
    pub const NONE: Self = Firsts { blocks: [0; 16], lanes: [0; 16] };

    /// What ray `i` meets.
    #[inline(always)]
    pub fn leaf(&self, i: usize) -> LeafRef {
        LeafRef { block: self.blocks[i % 16], lanes: self.lanes[i % 16] }
    }
}

/// The triangle in the one lane of `leaf`.
#[inline(always)]
fn met_triangle(block: &Block, leaf: LeafRef) -> Option<(Place, [[f32; 3]; 3])> {
    let (number, lane) = (leaf.number(), leaf.lanes.trailing_zeros());
    let triangles = block.triangle_blocks.get(number).filter(|_| leaf.kind() == KIND_TRIANGLES)?;
    let entry = triangles.first.wrapping_add(lane);
    Some((Place { block: number as u32, lane, entry }, triangles.triangle(lane as usize)))
}

/// Writes a triangle into the lanes from `first` on: all that follow may meet the same one.
#[inline(always)]
fn fill_from(first: usize, columns: &mut [[f32; 8]; 9], triangle: &[[f32; 3]; 3]) {
    for (column, x) in columns.iter_mut().zip(triangle.as_flattened()) {
        for (lane, place) in column.iter_mut().enumerate() {
            *place = if lane < first { *place } else { *x };
        }
    }
}

/// A question that rays can ask together, by what is sure of each without a query.
pub(crate) trait Together<'m>: Question<'m> + Copy {
    /// Whether it leaves no primitive out.
    fn sees_all(&self) -> bool;

    /// Answers by `write` for rays of which it is sure what they meet before all others, within their limits: those of
    /// `rays` in the lanes of `lanes`. The lanes of those for which that takes more than a look.
    fn settle<S: Simd>(
        s: S,
        block: &Block,
        rays: &Abreast,
        firsts: &Firsts,
        lanes: u32,
        write: impl FnMut(usize, Self::Answer),
    ) -> u32;

    /// What a query was offered before all else, and the `t` between which it is met.
    fn best(query: &Self::Query) -> Option<(LeafRef, Interval<f64>)>;
}

impl<'m, const MEMORY: usize> Together<'m> for ClosestHit<Exact, (), MEMORY> {
    #[inline(always)]
    fn sees_all(&self) -> bool {
        self.choice.sees_all()
    }

    #[inline(always)]
    fn settle<S: Simd>(
        s: S,
        block: &Block,
        rays: &Abreast,
        firsts: &Firsts,
        lanes: u32,
        mut write: impl FnMut(usize, Option<Hit>),
    ) -> u32 {
        let mut unsettled = lanes;
        for half in [0, 8] {
            if lanes >> half & 0xFF == 0 {
                continue;
            }
            let mut corners = [[0.0; 8]; 9];
            let mut named = [None; 8];
            let mut last = None;
            for i in Bits(lanes >> half & 0xFF) {
                let leaf = firsts.leaf(half + i);
                let name = match last {
                    Some((known, name)) if known == leaf => name,
                    _ => {
                        let Some((place, triangle)) = met_triangle(block, leaf) else { continue };
                        fill_from(i, &mut corners, &triangle);
                        let name = name(block, place);
                        last = Some((leaf, name));
                        name
                    }
                };
                named[i % 8] = Some(name);
            }
            let SureMeetings { sure, t, weights: [u, v] } =
                Exact::of_sure(s, rays.lines(half), &corners);
            for (i, name) in named.into_iter().enumerate() {
                if let Some(Name { prim, geometry }) = name
                    && sure >> i & 1 == 1
                {
                    let hit = Hit { t: t[i], u: u[i], v: v[i], prim, geometry, instance: NONE };
                    write(half + i, Some(hit));
                    unsettled &= !(1 << (half + i));
                }
            }
        }
        unsettled
    }

    fn best(query: &Self::Query) -> Option<(LeafRef, Interval<f64>)> {
        query.best.as_ref().map(|met| (met.leaf(), met.interval()))
    }
}

impl<'m> Together<'m> for AnyHit<Exact, ()> {
    #[inline(always)]
    fn sees_all(&self) -> bool {
        self.choice.sees_all()
    }

    #[inline(always)]
    fn settle<S: Simd>(
        _: S,
        _: &Block,
        _: &Abreast,
        _: &Firsts,
        lanes: u32,
        mut write: impl FnMut(usize, bool),
    ) -> u32 {
        for lane in Bits(lanes) {
            write(lane, true);
        }
        0
    }

    fn best(_: &Self::Query) -> Option<(LeafRef, Interval<f64>)> {
        None
    }
}

/// A known meeting.
#[derive(Clone, Copy)]
pub(crate) struct LocateHit<D> {
    wanted: Wanted,
    decide: PhantomData<D>,
}

impl<D> LocateHit<D> {
    pub fn new(wanted: Wanted) -> Self {
        LocateHit { wanted, decide: PhantomData }
    }
}

impl<'m, D: Decide> Question<'m> for LocateHit<D> {
    type Query = Locate<'m, D>;
    type Answer = Option<D::Met>;
    // Hits of the watertight mode, which is tried second, are rarely looked up.
    const RARE: bool = !D::ANY_BOXES;

    #[inline(always)]
    fn query(self, block: &Block<'m>, t_max: f32) -> Self::Query {
        Locate::new(self.wanted, t_max, block.prim_ids)
    }

    #[inline(always)]
    fn answer(_: &Block, _: &PreparedRay, query: &mut Self::Query, _: bool) -> Self::Answer {
        query.found
    }

    fn nothing() -> Self::Answer {
        None
    }
}

/// The meeting that wins: what [`ClosestHit`] answers before it is written down. Asked when meetings in two instances are too
/// close for floats.
#[derive(Clone, Copy)]
pub(crate) struct ClosestMet(pub Choice);

impl<'m> Question<'m> for ClosestMet {
    type Query = Closest<'m, Exact, (), MEMORY>;
    type Answer = Option<ExactMet>;
    const RARE: bool = true;

    fn query(self, block: &Block<'m>, t_max: f32) -> Self::Query {
        Closest::new(Filter::new(self.0, block.geometries, block.prim_ids), t_max, ())
    }

    fn answer(_: &Block, _: &PreparedRay, query: &mut Self::Query, _: bool) -> Self::Answer {
        query.best
    }

    fn nothing() -> Self::Answer {
        None
    }
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
        // Parts are not lent to what is out of line, which would have them all computed.
        let block = &block.parts();
        let reach = block.header.reach;
        let Some((mut late, slab)) = ray.set_out(s, reach) else {
            return ask_any(block.whole, ray, question);
        };
        let mut query = question.query(block, late.t_max);
        let ended = trace(s, block, &mut late, &slab, &mut query);
        // Nothing that is not prepared has met anything.
        late.prepared().map_or(Q::nothing(), |ray| Q::answer(block, ray, &mut query, ended))
    }
}

/// For any ray: for those at the ends of the floats, which are so rare that portable code will do, behind pointers; for
/// questions that are rare; and for all where code shall be small.
#[cold]
#[inline(never)]
fn ask_any<'m, Q: Question<'m>>(block: Finished<'m>, ray: &Ray, question: Q) -> Q::Answer {
    let block = &block.parts();
    let reach = block.header.reach;
    let Some(mut ray) = ray.prepare_any(reach) else { return Q::nothing() };
    let mut query = question.query(block, ray.t_max);
    let slab = FrameSlab::new(&ray, reach);
    // Those who add up stacks do not see through pointers.
    let ended = match Q::Query::ORDERED {
        _ if SMALL => trace(Scalar, block, &mut ray, &slab, &mut query),
        true => trace_any(block, &mut ray, &slab, Erased::<true>(&mut query)),
        false => trace_any(block, &mut ray, &slab, Erased::<false>(&mut query)),
    };
    Q::answer(block, &ray, &mut query, ended)
}

/// [`trace`] for queries of any type.
#[inline(never)]
fn trace_any<const ORDERED: bool>(
    block: &Block,
    ray: &mut PreparedRay,
    slab: &FrameSlab,
    mut query: Erased<ORDERED>,
) -> bool {
    trace(Scalar, block, ray, slab, &mut query)
}

/// The record of the meeting that won.
#[inline(never)]
fn hit<D: Decide>(
    block: Finished,
    ray: &PreparedRay,
    best: &D::Met,
    watch: &mut impl Watch,
) -> Hit {
    record(&block.parts(), best.place(), D::t(ray, best, watch), D::weights(best))
}

/// The record of a meeting.
#[inline(always)]
pub(crate) fn record(block: &Block, place: Place, t: f32, [u, v]: [f32; 2]) -> Hit {
    let Name { prim, geometry } = name(block, place);
    Hit { t, u, v, prim, geometry, instance: NONE }
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

/// Offers `query` what the ray meets, by the one traversal of the structure at hand.
#[inline(always)]
pub(crate) fn trace<S: Simd, Q: Query>(
    s: S,
    block: &Block,
    ray: &mut impl Late,
    slab: &impl Slab,
    query: &mut Q,
) -> bool {
    let leaves = &Leaves::of(block);
    match block.bundles {
        Bundles::Sixteen(bundles) if WIDE => {
            bvh::traverse_wide(s, bundles, leaves, ray, slab, query)
        }
        Bundles::Eight(bundles) if WIDE => bvh::traverse_wide(s, bundles, leaves, ray, slab, query),
        Bundles::Four(bundles) if WIDE => bvh::traverse_wide(s, bundles, leaves, ray, slab, query),
        _ => {
            let ray = ray.prepare();
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
