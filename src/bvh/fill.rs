//! Fills the leaf blocks of the wide layouts, from the ids in the order of the tree.

use super::emit::BEGINS;
use crate::block::PartsMut;
use crate::block::leaf::{SphereBlock, TriangleBlock};
use crate::caller::{Caller, PARTS};
use crate::prim::{BlockWriter, GRAIN, Packer, Source};
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
        let (triangles, spheres) =
            self.ids.split_at_mut(first_sphere.saturating_sub(self.first).min(self.ids.len()));
        let first = self.first as u32;
        pack_triangles(source, first, triangles, self.triangle_blocks)?;
        pack_spheres(source, first + triangles.len() as u32, spheres, self.sphere_blocks)
    }
}

/// Packs triangles, whose first id is entry `first`: each block has those from one mark to the next.
fn pack_triangles(
    source: Source,
    mut first: u32,
    mut ids: &mut [u32],
    blocks: &mut [TriangleBlock],
) -> Option<()> {
    let mut writer = BlockWriter::new(source.shapes());
    for block in blocks {
        *ids.first_mut()? &= !BEGINS;
        let count = 1 + ids.iter().skip(1).take_while(|id| **id & BEGINS == 0).count();
        let next = |n: usize| ids.get(n).map(|id| id & !BEGINS);
        writer.write(block, first, ids.get(..count)?, next)?;
        first += count as u32;
        ids = ids.split_at_mut_checked(count)?.1;
    }
    ids.is_empty().then_some(())
}

/// The same of spheres.
fn pack_spheres(
    source: Source,
    first: u32,
    ids: &mut [u32],
    blocks: &mut [SphereBlock],
) -> Option<()> {
    let mut packer = Packer::new(&mut [], blocks, 0, first);
    let mut shapes = source.shapes();
    for id in ids {
        if *id & BEGINS != 0 {
            packer.close();
        }
        *id &= !BEGINS;
        packer.push(&shapes.get(*id)?)?;
    }
    Some(())
}
