//! The compact layout: from a scene to binary nodes in the caller's memory.

use super::How;
use super::MAX_DEPTH;
use super::branch::grow;
use super::budget::leaf_budget;
use super::refs::{PrimRef, gather};
use super::split::Areas;
use super::spread::unevenness_of_all;
use super::tree::{Depth, Grown, Limits};
use crate::block::leaf::{SPHERES, TRIANGLES_AT_LEAST};
use crate::block::{BvhNode, Census, Counts, KIND_BVH, LAYOUT_COMPACT, PartsMut};
use crate::error::BuildError;
use crate::kinds::REFIT;
use crate::prim::{Packer, Source, Survey, geometries};
use crate::scene::Scene;
use crate::storage;

/// Primitives of a leaf at most. Six triangles never need more than the rest of one block and a
/// second one.
const LEAF_MAX: usize = 6;

/// The sizes of the parts, with room for the most that they may need.
///
/// While the tree grows, the refs lie behind the nodes; when it is done, their ids move to the front
/// and the leaf blocks take their place. So the memory is that of the larger of the two.
struct Plan {
    leaves: usize,
    growing: Counts,
    packing: Counts,
    ref_count: usize,
    size: usize,
}

impl Plan {
    /// The plan for the tree that SAH wants (`full`), or for the least that works.
    fn new(survey: &Survey, census: &Census, full: bool) -> Result<Plan, BuildError> {
        let (triangles, spheres) = (census.triangle_count, census.sphere_count);
        let prims = census.hittable();
        let mixed = census.is_mixed();
        let leaves = leaf_budget(prims as usize, mixed, LEAF_MAX, full);
        let growing = Counts {
            geometries: survey.geometry_count,
            prim_ids: prims,
            nodes: 2 * leaves as u32,
            ..Counts::default()
        };
        let packing = Counts {
            sphere_blocks: spheres.div_ceil(SPHERES as u32),
            triangle_blocks: triangles.div_ceil(TRIANGLES_AT_LEAST as u32),
            motions: census.refit.into(),
            ..growing
        };
        let refs = (prims as usize).checked_mul(size_of::<PrimRef>());
        let grown = growing.offsets().and_then(|at| at.end.checked_add(refs?));
        let packed = packing.offsets().map(|at| at.end);
        let size = grown.zip(packed).and_then(|(a, b)| storage::align_up(a.max(b) as u64));
        let size = size.and_then(|size| usize::try_from(size).ok()).ok_or(BuildError::TooLarge)?;
        Ok(Plan { leaves, growing, packing, ref_count: prims as usize, size })
    }
}

/// The bytes for the tree that SAH wants, and the bytes below which there is none.
pub(crate) fn needs(survey: &Survey, census: &Census) -> Result<(usize, usize), BuildError> {
    Ok((Plan::new(survey, census, true)?.size, Plan::new(survey, census, false)?.size))
}

/// Builds into `bytes`, which are zero and at least the minimum of [`needs`]; returns the size of
/// the finished block. At least one primitive can be hit.
pub(crate) fn build(
    scene: &Scene,
    survey: &Survey,
    census: &Census,
    how: &How,
    bytes: &mut [u8],
) -> Result<usize, BuildError> {
    let full = Plan::new(survey, census, true)?;
    let fits = full.size <= bytes.len();
    let plan = if fits { full } else { Plan::new(survey, census, false)? };
    let short = BuildError::OutOfMemory { minimum: plan.size };
    how.caller.done(0.1).ok_or(short)?;
    let node_count = grow_tree(scene, census, &plan, how, bytes).ok_or(short)?;
    let counts = Counts { nodes: node_count as u32, ..plan.packing };
    how.caller.done(0.7).ok_or(short)?;
    let triangle_blocks = pack_leaves(scene, census, &counts, bytes).ok_or(short)?;
    let counts = Counts { triangle_blocks: triangle_blocks as u32, ..counts };
    counts.seal(KIND_BVH, LAYOUT_COMPACT, census, bytes).ok_or(short)
}

/// Grows the tree and writes geometries and ids; returns the number of nodes.
fn grow_tree(
    scene: &Scene,
    census: &Census,
    plan: &Plan,
    how: &How,
    bytes: &mut [u8],
) -> Option<usize> {
    let PartsMut { geometries: table, prim_ids, nodes, rest, .. } =
        plan.growing.parts_mut(bytes)?;
    geometries(scene, table);
    let refs = storage::view_mut::<PrimRef>(rest, 0, plan.ref_count)?;
    gather(scene, census, 1, how.caller, refs);
    let mixed = census.is_mixed();
    let unevenness = unevenness_of_all(refs, Areas::new(&census.bounds), how.caller);
    let effort = how.effort.for_uneven(unevenness).unwrap_or(how.effort);
    let leaves = plan.leaves;
    let limits = Limits { mixed, ..Limits::new(leaves, LEAF_MAX, Depth::Paying, effort) };
    let node_count = grow(nodes, refs, plan.ref_count, &limits, how.caller)?.nodes;
    // Triangles first, then spheres, each in the order of the leaves.
    let mut ids = prim_ids.iter_mut();
    for kind in [false, true] {
        for r in refs.iter().filter(|r| r.is_sphere() == kind) {
            *ids.next()? = r.id();
        }
    }
    Some(node_count)
}

/// Packs the leaves, in the order in which a depth-first walk meets them, and points the nodes at
/// their lanes; returns the number of triangle blocks.
fn pack_leaves(scene: &Scene, census: &Census, counts: &Counts, bytes: &mut [u8]) -> Option<usize> {
    let PartsMut { geometries, prim_ids, nodes, sphere_blocks, triangle_blocks, .. } =
        counts.parts_mut(bytes)?;
    let (triangles, spheres) = prim_ids.split_at_checked(census.triangle_count as usize)?;
    let (mut triangles, mut spheres) = (triangles.iter(), spheres.iter());
    let mut packer = Packer::new(triangle_blocks, sphere_blocks, 0, census.triangle_count);
    let mut shapes = Source { scene, geometries, named: REFIT && census.refit }.shapes();
    for_each_leaf(nodes, |node| {
        let (count, is_sphere) = Grown::of(node);
        let ids = if is_sphere { &mut spheres } else { &mut triangles };
        let mut leaf = None;
        for id in ids.take(count) {
            packer.push_to(&mut leaf, &shapes.get(*id)?)?;
        }
        let leaf = leaf?;
        node.first = leaf.block;
        node.lanes = leaf.lanes;
        Some(())
    })?;
    Some(packer.triangle_block_count())
}

/// Calls `f` with each leaf, left before right.
fn for_each_leaf(
    nodes: &mut [BvhNode],
    mut f: impl FnMut(&mut BvhNode) -> Option<()>,
) -> Option<()> {
    let mut stack = [0u32; MAX_DEPTH];
    let mut pending = 1;
    while pending > 0 {
        pending -= 1;
        let node = nodes.get_mut(*stack.get(pending)? as usize)?;
        if node.is_leaf() {
            f(node)?;
            continue;
        }
        let pair = node.first;
        *stack.get_mut(pending)? = pair + 1;
        *stack.get_mut(pending + 1)? = pair;
        pending += 2;
    }
    Some(())
}
