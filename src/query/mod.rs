//! What a ray may ask: its options, and the traversal's side of the question.
//!
//! A traversal offers lanes of leaf blocks that the [`sieve`](crate::sieve) could not reject. How
//! a lane is decided is a [`Decide`]: [`Exact`] or [`Watertight`]. What is made of those that are met
//! is a [`Query`]: [`Closest`], [`Any`] or [`Locate`], which go with each precision, or [`NextHits`], which is exact.

mod ask;
mod erased;
mod exact;
mod hits;
mod options;
mod waiting;
mod watertight;

pub(crate) use ask::{Any, Closest, Either, Locate, Wanted};
pub(crate) use erased::Erased;
pub(crate) use exact::{Exact, ExactMet, SureMeetings};
pub(crate) use hits::NextHits;
pub(crate) use options::shares_bit;
pub(crate) use options::{Choice, Filter, flat_number, geometry_of};
pub use options::{Facing, Precision, PrimId, QueryOptions};
pub(crate) use watertight::Watertight;

use crate::block::leaf::{Place, TriangleBlock};
use crate::math::float::limited;
use crate::ray::{Interval, PreparedRay};
use crate::sieve::SphereDetail;
use crate::simd::Simd;

/// What a query did, for charts and heat maps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Boxes of BVH nodes, or cells of a grid, looked at; those of an index over instances too.
    pub steps: u64,
    /// Leaf blocks opened.
    pub blocks: u64,
    /// Triangles and spheres tested.
    pub tests: u64,
    /// Meetings whose `t` was computed in `f64`.
    pub intervals: u64,
    /// Decisions that took real arithmetic.
    pub exact: u64,
    /// Final `t` whose rounding took real arithmetic.
    pub roundings: u64,
}

/// Looks on while a query is answered: nobody, or [`Counts`].
pub(crate) trait Watch {
    /// The same, for a part of the query.
    type Lent<'a>: Watch
    where
        Self: 'a;

    fn lend(&mut self) -> Self::Lent<'_>;

    /// Whether somebody looks.
    const COUNTS: bool = false;

    /// A box or a cell was looked at.
    fn step(&mut self) {}
    /// A leaf block was opened, to test this many lanes.
    fn block(&mut self, _tests: u32) {}
    /// The `t` of a meeting was computed in `f64`.
    fn interval(&mut self) {}
    /// A decision took real arithmetic.
    fn exact(&mut self) {}
    /// The rounding of the answer took real arithmetic.
    fn rounding(&mut self) {}
    /// So many boxes and cells were looked at unwatched.
    fn steps(&mut self, _count: u64) {}
}

impl Watch for () {
    type Lent<'a> = ();

    fn lend(&mut self) {}
}

impl Watch for &mut Counts {
    type Lent<'a>
        = &'a mut Counts
    where
        Self: 'a;

    fn lend(&mut self) -> &mut Counts {
        self
    }

    const COUNTS: bool = true;

    fn step(&mut self) {
        self.steps += 1;
    }

    fn block(&mut self, tests: u32) {
        self.blocks += 1;
        self.tests += u64::from(tests);
    }

    fn interval(&mut self) {
        self.intervals += 1;
    }

    fn exact(&mut self) {
        self.exact += 1;
    }

    fn rounding(&mut self) {
        self.roundings += 1;
    }

    fn steps(&mut self, count: u64) {
        self.steps += count;
    }
}

/// A triangle that the filter could not reject.
#[derive(Clone, Copy)]
pub(crate) struct TriangleLane<'b> {
    pub block: &'b TriangleBlock,
    /// Where it is stored. Its number is farther away, and looked up only where it matters.
    pub place: Place,
    /// The ray's line passes between the edges: this is no longer in doubt.
    pub sure: bool,
    /// And the real `t` is within the ray's limits.
    pub inside: bool,
}

impl TriangleLane<'_> {
    /// Its vertices. Not kept: an array that anything out of line could see would have to be in memory, and what
    /// is written to memory by parts is slow to read as a whole.
    #[inline(always)]
    pub fn corners(&self) -> [[f32; 3]; 3] {
        self.block.triangle(self.place.lane as usize)
    }
}

/// A sphere that the filter could not reject.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SphereLane {
    pub centre: [f32; 3],
    pub radius: f32,
    pub place: Place,
    pub detail: SphereDetail,
}

/// The question a traversal answers: it offers lanes and obeys the bound. The same lane may come
/// twice.
pub(crate) trait Query {
    type Watch: Watch;

    /// Whether the answer is the same however conservatively boxes are tested: then this may be done in any
    /// way, fused or in `f64`.
    const ANY_BOXES: bool;

    /// Whether near nodes had better come first.
    const ORDERED: bool;

    /// Whether it matters if a triangle surely is met within the limits: to those that want any hit.
    #[inline(always)]
    fn wants_inside(&self) -> bool {
        !Self::ORDERED
    }

    /// Nothing beyond this `t` of the frame is of interest any more.
    fn t_bound(&self) -> f32;

    /// Whether triangles that surely are met may wait until the end.
    const CAN_WAIT: bool = false;

    /// A triangle that is stored there, between whose edges the ray surely passes in this part of itself: whether it may wait, and
    /// need not be considered.
    #[inline(always)]
    fn may_wait(&mut self, _: &PreparedRay, _: Place, _: Interval<f32>) -> bool {
        false
    }

    /// Considers a triangle; true ends the traversal.
    fn triangle(&mut self, ray: &PreparedRay, lane: &TriangleLane) -> bool;

    /// Considers a sphere; true ends the traversal.
    fn sphere(&mut self, ray: &PreparedRay, lane: &SphereLane) -> bool;

    /// Whether it is asked of an index, in which lanes of sphere blocks are instances.
    const OF_INDEX: bool = false;

    /// Considers the instance of this number; true ends the traversal.
    fn instance(&mut self, _number: u32) -> bool {
        false
    }

    fn watch(&mut self) -> &mut Self::Watch;
}

/// How lanes are decided and meetings are ordered.
pub(crate) trait Decide {
    /// A meeting of the ray with a primitive, within the ray's limits as far as this can tell.
    type Met: Copy + Meets;

    /// Whether the answer is the same however conservatively boxes are tested.
    const ANY_BOXES: bool;

    /// The meeting with a triangle that the filter could not reject.
    #[inline(always)]
    fn triangle(
        ray: &PreparedRay,
        lane: &TriangleLane,
        watch: &mut impl Watch,
    ) -> Option<Self::Met> {
        let (met, in_doubt) = Self::likely(ray, lane, watch)?;
        (!in_doubt || Self::is_met(ray, &met, watch)).then_some(met)
    }

    /// The same, and whether it is in doubt: then [`is_met`](Self::is_met) tells.
    fn likely(
        ray: &PreparedRay,
        lane: &TriangleLane,
        watch: &mut impl Watch,
    ) -> Option<(Self::Met, bool)>;

    /// Whether what is in doubt is within the ray's limits.
    #[inline(always)]
    fn is_met(_ray: &PreparedRay, _met: &Self::Met, _watch: &mut impl Watch) -> bool {
        true
    }

    /// `t` and weights of a triangle that the ray surely meets within its limits, if that takes no more than a look.
    #[inline(always)]
    fn sure<S: Simd>(_: S, _ray: &PreparedRay, _lane: &TriangleLane) -> Option<(f32, [f32; 2])> {
        None
    }

    /// The meetings with a sphere that lie within the limits, entering and leaving.
    fn sphere(
        ray: &PreparedRay,
        lane: &SphereLane,
        watch: &mut impl Watch,
    ) -> [Option<Self::Met>; 2];

    /// What is remembered of the best meeting while others are compared with it.
    type Memory: Default;

    /// Whether `met` comes before `best`: at a smaller `t`, or at an equal one with a smaller number.
    fn is_before(
        ray: &PreparedRay,
        met: &Self::Met,
        best: &Self::Met,
        prim_ids: &[u32],
        memory: Option<&mut Self::Memory>,
        watch: &mut impl Watch,
    ) -> bool;

    /// Whether a triangle, if it is met at all, surely comes after `best`.
    fn is_surely_after(lane: &TriangleLane, best: &Self::Met, prim_ids: &[u32]) -> bool;

    /// A `t` of the frame that is not below the real one of `met`, or whatever stands for it.
    fn t_bound(ray: &PreparedRay, met: &Self::Met) -> f32;

    /// The given `t` of the answer.
    fn t(ray: &PreparedRay, met: &Self::Met, watch: &mut impl Watch) -> f32;

    /// The weights of the second and the third vertex.
    fn weights(met: &Self::Met) -> [f32; 2];
}

/// What every meeting knows of itself.
pub(crate) trait Meets {
    fn place(&self) -> Place;
    /// Whether the ray meets the front; `None` when this cannot tell.
    fn front(&self) -> Option<bool>;
    /// Which of the meetings with one primitive it is.
    fn root(&self) -> usize;
    /// Whether skipping the primitive skips this: false for the root of a sphere that is not the
    /// nearest to `t = 0`.
    fn skippable(&self) -> bool;
}

/// The part of `[0, 1]` in which weights lie: neither they nor `1 - u - v` are negative; `v` gives way.
pub(crate) fn clamped_weights([u, v]: [f32; 2]) -> [f32; 2] {
    let u = limited(u, 0.0, 1.0) + 0.0;
    let v = limited(v, 0.0, 1.0 - u) + 0.0;
    [u, v]
}
