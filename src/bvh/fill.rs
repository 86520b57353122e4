//! Fills the leaf blocks of the wide layouts, from the ids in the order of the tree.

use super::emit::BEGINS;
use crate::block::PartsMut;
use crate::block::leaf::{SphereBlock, TriangleBlock};
use crate::caller::{Caller, PARTS};
use crate::prim::{GRAIN, Packer, Source};
use crate::scene::Scene;

/// The ids of some leaf blocks, and those blocks.
struct Run<'b> {
    /// The number of the first id.
    first: usize,
    ids: &'b mut [u32],
    triangle_blocks: &'b mut [TriangleBlock],
    sphere_blocks: &'b mut [SphereBlock],
    packed: Option<()>,
}

/// Packs the leaf blocks, over `named` vertices if they will move, and takes the marks off the ids, of which those of spheres begin at `first_sphere`.
///
/// Each run begins with a block, so where runs begin does not matter.
pub(super) fn pack(
    (scene, named): (&Scene, bool),
    first_sphere: usize,
    parts: PartsMut,
    caller: &Caller,
) -> Option<()> {
    let PartsMut { geometries, prim_ids, sphere_blocks, triangle_blocks, .. } = parts;
    let source = Source { scene, geometries, named };
    let size = caller.part_size(prim_ids.len(), GRAIN);
    let prim_count = prim_ids.len();
    let (mut ids, mut triangles, mut spheres) = (prim_ids, triangle_blocks, sphere_blocks);
    let (mut runs, mut first) = ([const { None }; PARTS], 0);
    for run in runs.iter_mut().take(prim_count.div_ceil(size)) {
        let end = size + ids.iter().skip(size).take_while(|id| **id & BEGINS == 0).count();
        let (own, rest) = ids.split_at_mut(end.min(ids.len()));
        let begins = |ids: &[u32]| ids.iter().filter(|id| **id & BEGINS != 0).count();
        let (a, b) = own.split_at(first_sphere.saturating_sub(first).min(own.len()));
        let (triangle_blocks, more) = triangles.split_at_mut_checked(begins(a))?;
        let (sphere_blocks, others) = spheres.split_at_mut_checked(begins(b))?;
        let next = first + own.len();
        *run = Some(Run { first, ids: own, triangle_blocks, sphere_blocks, packed: None });
        (ids, triangles, spheres, first) = (rest, more, others, next);
    }
    caller.for_each(&mut runs, |run| {
        if let Some(run) = run {
            run.packed = run.pack(source, first_sphere);
        }
    });
    runs.iter().flatten().try_for_each(|run| run.packed)
}

/// Takes the marks off the ids of leaves that have no blocks.
pub(super) fn take_marks_off(ids: &mut [u32]) {
    ids.iter_mut().for_each(|id| *id &= !BEGINS);
}

impl Run<'_> {
    fn pack(&mut self, source: Source, first_sphere: usize) -> Option<()> {
        let (first, first_sphere) = (self.first as u32, self.first.max(first_sphere) as u32);
        let (triangles, spheres) = (&mut *self.triangle_blocks, &mut *self.sphere_blocks);
        let block_count = triangles.len();
        let mut packer = Packer::new(triangles, spheres, first, first_sphere);
        let mut shapes = source.shapes();
        for i in 0..self.ids.len() {
            shapes.look_ahead(|n| self.ids.get(i + n).map(|id| id & !BEGINS));
            let id = self.ids.get_mut(i)?;
            if *id & BEGINS != 0 {
                packer.close();
            }
            *id &= !BEGINS;
            match shapes.corners(*id) {
                Some(corners) => packer.push_triangle(corners)?,
                None => packer.push(&shapes.get(*id)?)?,
            };
        }
        (packer.triangle_block_count() == block_count).then_some(())
    }
}
