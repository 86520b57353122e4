//! Where the wide builder keeps what, in memory of a given size.

use super::budget::leaf_budget;
use super::refs::PrimRef;
use crate::block::{BvhNode, Census, Counts};
use crate::prim::Survey;
use crate::storage::ALIGNMENT;

/// Where the scratch lies: behind all that is finished.
///
/// ```text
/// | header | geometries | refs | keys | keys | runs | order |        putting refs into runs, if that is wanted
/// | header | geometries | refs or runs  ...  | order | .. | nodes |    growing
/// | header | geometries | scratch   ...           | ids | nodes |    mending
/// | header | geometries | ...         | choices | ids   | nodes |    choosing
/// | header | geometries | prim_ids | bundles | choices | ids | nodes | emitting
/// | header | geometries | prim_ids | bundles | spheres | triangles | packing
/// ```
#[derive(Clone, Copy)]
pub(super) struct Places {
    pub refs: usize,
    pub nodes: usize,
    /// Refs at most: more than primitives, where some may be cut in two.
    pub room: usize,
    /// Leaves of the binary tree at most.
    pub leaves: usize,
}

impl Places {
    /// The places in memory of `size` bytes for what a scene without large primitives wants; `None` when
    /// they do not fit.
    pub fn new(survey: &Survey, census: &Census, leaf_max: usize, size: usize) -> Option<Places> {
        let mixed = census.is_mixed();
        let room = census.hittable() as usize;
        // More leaves, a half of the primitives or all, made no ray through an even scene faster: the collapse puts
        // them together again.
        Places::with_leaves(survey, census, leaf_budget(room, mixed, leaf_max, false), size)
    }

    /// The same for so many leaves.
    pub fn with_leaves(
        survey: &Survey,
        census: &Census,
        leaves: usize,
        size: usize,
    ) -> Option<Places> {
        let room = census.hittable() as usize;
        Places { refs: front(survey)?, nodes: 0, room, leaves }.fitting(room, leaves, size)
    }

    /// The same with other numbers of refs and leaves, if they fit.
    pub fn fitting(&self, room: usize, leaves: usize, size: usize) -> Option<Places> {
        let nodes = (size / ALIGNMENT * ALIGNMENT).checked_sub(leaves.checked_mul(PAIR)?)?;
        let refs = self.refs;
        let end = refs.checked_add(room.checked_mul(size_of::<PrimRef>())?)?;
        (end <= nodes).then_some(Places { refs, nodes, room, leaves })
    }

    /// What `count` refs of an uneven scene want, as far as `size` bytes reach: a leaf for each of them, as a wall shall
    /// not be in one with a chair; and, if refs may be cut, a quarter more of them, which takes half of what is free at most.
    /// These places have room for so many refs and for `least` leaves.
    pub fn for_uneven(self, count: usize, least: usize, cut: bool, size: usize) -> Places {
        const REF: usize = size_of::<PrimRef>();
        let end = self.nodes + self.leaves * PAIR;
        let free = (end - self.refs).saturating_sub(count * REF + least * PAIR);
        let more = if cut { (count / 4).min(free / (2 * REF)) } else { 0 };
        let room = count + more;
        let leaves = room.min(least + (free - more * REF) / PAIR).max(least);
        self.fitting(room, leaves, size).unwrap_or(self)
    }
}

/// What the nodes of one more leaf take.
pub(super) const PAIR: usize = 2 * size_of::<BvhNode>();

/// The end of header and geometries.
fn front(survey: &Survey) -> Option<usize> {
    let counts = Counts { geometries: survey.geometry_count, ..Counts::default() };
    counts.offsets().map(|at| at.end)
}
