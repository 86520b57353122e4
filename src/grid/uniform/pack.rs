//! Packs primitives that were sorted into leaf blocks.

use crate::block::leaf::{SPHERES, SphereBlock, TRIANGLES_AT_LEAST, TriangleBlock};
use crate::caller::{Caller, PARTS};
use crate::grid::list::front;
use crate::prim::{GRAIN, Packer, Source};

/// So many primitives begin with a block of their own, so that they are packed alike on any thread.
const CHUNK: usize = GRAIN;

/// The blocks that so many primitives can take, of which `least` fit into each.
pub(super) fn most_blocks(count: usize, least: usize) -> usize {
    count / CHUNK * CHUNK.div_ceil(least) + (count % CHUNK).div_ceil(least)
}

/// Some primitives, and the blocks that they come to.
struct Part<'p, B> {
    first: usize,
    ids: &'p [u32],
    blocks: &'p mut [B],
    /// Where these are among all.
    at: usize,
    used: Option<usize>,
}

/// Packs triangles; returns how many blocks they take.
pub(super) fn pack_triangles(
    source: Source,
    ids: &[u32],
    blocks: &mut [TriangleBlock],
    caller: &Caller,
) -> Option<usize> {
    let mut jobs = parts(ids, 0, TRIANGLES_AT_LEAST, blocks, caller)?;
    caller.for_each(&mut jobs, |job| {
        if let Some(part) = job {
            part.used = part.pack(source);
        }
    });
    let pieces = jobs.map(|job| job.map(|part| (part.at, part.used)));
    pieces.into_iter().flatten().try_fold(0, |end, (at, used)| {
        let used = used?;
        if at > end {
            blocks.copy_within(at..at + used, end);
        }
        Some(end + used)
    })
}

/// Packs spheres, whose ids begin at entry `first`; all blocks are full but those that end a chunk.
pub(super) fn pack_spheres(
    source: Source,
    ids: &[u32],
    first: usize,
    blocks: &mut [SphereBlock],
    caller: &Caller,
) -> Option<()> {
    let mut jobs = parts(ids, first, SPHERES, blocks, caller)?;
    caller.for_each(&mut jobs, |job| {
        if let Some(part) = job {
            part.used = part.pack(source);
        }
    });
    jobs.iter().flatten().try_for_each(|part| part.used.map(|_| ()))
}

/// The ids in parts, each with the blocks that it can take.
fn parts<'p, B>(
    ids: &'p [u32],
    first: usize,
    least: usize,
    mut blocks: &'p mut [B],
    caller: &Caller,
) -> Option<[Option<Part<'p, B>>; PARTS]> {
    let (mut jobs, mut at) = ([const { None }; PARTS], 0);
    let size = caller.part_size(ids.len(), CHUNK);
    for (i, (job, ids)) in jobs.iter_mut().zip(ids.chunks(size)).enumerate() {
        let count = most_blocks(ids.len(), least);
        let blocks = front(&mut blocks, count)?;
        *job = Some(Part { first: first + i * size, ids, blocks, at, used: None });
        at += count;
    }
    Some(jobs)
}

impl Part<'_, TriangleBlock> {
    fn pack(&mut self, source: Source) -> Option<usize> {
        let (mut used, mut shapes) = (0, source.shapes());
        for (i, ids) in self.ids.chunks(CHUNK).enumerate() {
            let first = (self.first + i * CHUNK) as u32;
            let mut packer = Packer::new(self.blocks.get_mut(used..)?, &mut [], first, 0);
            for (i, id) in ids.iter().enumerate() {
                shapes.look_ahead(|ahead| ids.get(i + ahead).copied());
                packer.push(&shapes.get(*id)?)?;
            }
            used += packer.triangle_block_count();
        }
        Some(used)
    }
}

impl Part<'_, SphereBlock> {
    fn pack(&mut self, source: Source) -> Option<usize> {
        let (mut used, mut shapes) = (0, source.shapes());
        for (i, ids) in self.ids.chunks(CHUNK).enumerate() {
            let first = (self.first + i * CHUNK) as u32;
            let mut packer = Packer::new(&mut [], self.blocks.get_mut(used..)?, 0, first);
            for id in ids {
                packer.push(&shapes.get(*id)?)?;
            }
            used += ids.len().div_ceil(SPHERES);
        }
        Some(used)
    }
}
