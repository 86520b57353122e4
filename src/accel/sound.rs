//! Whether foreign bytes that look like a block can be traversed.

use crate::block::level::Level;
use crate::block::{Block, Bundles, KIND_BVH, KIND_GRID, KIND_LIST};
use crate::kinds::{GRID, WIDE};
use crate::prim::{self, Leaves};
use crate::{bvh, grid};

/// Whether what is not in instances can be traversed.
#[inline]
pub(super) fn block_is_sound(block: &Block) -> bool {
    is_sound(block, false)
}

fn is_sound(block: &Block, of_index: bool) -> bool {
    let Block { header, geometries, grids, nodes, bundles, words, runs, .. } = *block;
    let leaves = Leaves::of(block);
    let no_grid = grids.is_empty() && words.is_empty() && runs.is_empty();
    let no_nodes = nodes.is_empty();
    let no_motion = header.counts.motions == 0;
    let structure = match (header.kind, bundles) {
        (KIND_LIST, Bundles::None) => no_grid && no_nodes,
        (KIND_GRID, Bundles::None) if GRID => {
            no_nodes && no_motion && grid::grids_are_sound(grids, words, runs, &leaves)
        }
        (KIND_BVH, Bundles::None) => no_grid && bvh::tree_is_sound(nodes, &leaves),
        (KIND_BVH, Bundles::Four(bundles)) if WIDE => {
            no_grid && no_nodes && bvh::bundles_are_sound(bundles, &leaves, of_index)
        }
        (KIND_BVH, Bundles::Eight(bundles)) if WIDE => {
            no_grid && no_nodes && bvh::bundles_are_sound(bundles, &leaves, of_index)
        }
        (KIND_BVH, Bundles::Sixteen(bundles)) if WIDE => {
            no_grid && no_nodes && bvh::bundles_are_sound(bundles, &leaves, of_index)
        }
        _ => false,
    };
    let first_sphere =
        geometries.get(header.mesh_count as usize).map_or(header.prim_limit, |g| g.first);
    let numbered = header.mesh_count as usize <= geometries.len()
        && header.triangle_limit == first_sphere
        && first_sphere <= header.prim_limit;
    let (triangles, prims) = (header.triangle_limit, header.prim_limit);
    structure && numbered && prim::leaves_are_sound(&leaves, geometries, triangles, prims)
}

/// Whether the instances number what there is, their index can be traversed, and the children are there and can be too.
pub(super) fn level_is_sound(level: &Level) -> bool {
    let index = level.index.parts();
    let count = level.instances.len() as u32;
    let children = level.head.child_count;
    is_sound(&index, true)
        && index.prim_ids.iter().all(|instance| *instance < count)
        && index.header.triangle_limit == 0
        && index.header.prim_limit == count
        && level.instances.iter().all(|instance| instance.child < children)
        && level.are_packed(|child| block_is_sound(&child.parts()))
}
