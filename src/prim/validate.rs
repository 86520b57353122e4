//! Whether the leaf blocks of a foreign block can be traversed.

use super::Leaves;
use crate::block::Geometry;
use crate::block::leaf::{KIND_SPHERES, KIND_TRIANGLES, LeafRef, SPHERES, TRIANGLES};
use crate::kinds::BALLS;

/// Whether every lane in use has an id, triangles below `triangle_limit` and spheres from there to
/// `prim_limit`, whether only those can be hit, and whether the geometries number them all.
pub(crate) fn leaves_are_sound(
    leaves: &Leaves,
    geometries: &[Geometry],
    triangle_limit: u32,
    prim_limit: u32,
) -> bool {
    let ids = |first: u32, count: u32, most: usize| -> Option<&[u32]> {
        let count = usize::try_from(count).ok().filter(|n| (1..=most).contains(n))?;
        let first = first as usize;
        leaves.prim_ids.get(first..first.checked_add(count)?)
    };
    let triangles = leaves.triangle_blocks.iter().all(|block| {
        let ids = ids(block.first, block.count, TRIANGLES);
        let sound = ids.is_some_and(|ids| ids.iter().all(|id| *id < triangle_limit));
        sound && block.lanes() & !block.held() == 0
    });
    let spheres = !BALLS
        || leaves.sphere_blocks.iter().all(|block| {
            let ids = ids(block.first, block.count, SPHERES);
            let range = triangle_limit..prim_limit;
            let sound = ids.is_some_and(|ids| ids.iter().all(|id| range.contains(id)));
            sound && block.lanes() & !block.held() == 0
        });
    let starts = geometries.first().is_none_or(|g| g.first == 0);
    let ordered = geometries.is_sorted_by_key(|g| g.first);
    let ends = geometries.last().map_or(prim_limit == 0, |g| g.first <= prim_limit);
    triangles && spheres && starts && ordered && ends
}

impl Leaves<'_> {
    /// Whether the leaf names lanes in use of blocks that exist.
    pub fn has(&self, leaf: LeafRef) -> bool {
        let lanes_of = |number: usize| match leaf.kind() {
            KIND_TRIANGLES => self.triangle_blocks.get(number).map_or(0, |block| block.held()),
            KIND_SPHERES if BALLS => self.sphere_blocks.get(number).map_or(0, |block| block.held()),
            _ => 0,
        };
        let lanes = lanes_of(leaf.number()) | lanes_of(leaf.number() + 1) << 16;
        leaf.lanes != 0 && leaf.lanes & !lanes == 0
    }
}
