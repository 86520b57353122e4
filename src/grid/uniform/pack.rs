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

/// A kind of leaf block, and how primitives are packed into blocks of it.
pub(super) trait Packed: Sized + Copy + Send {
    /// Primitives that any block has room for.
    const LEAST: usize;

    /// Fills `blocks` with primitives that begin at entry `first`.
    fn packer(blocks: &mut [Self], first: u32) -> Packer<'_>;

    /// The blocks that a packer has begun.
    fn used(packer: &Packer) -> usize;
}

impl Packed for TriangleBlock {
    const LEAST: usize = TRIANGLES_AT_LEAST;

    fn packer(blocks: &mut [Self], first: u32) -> Packer<'_> {
        Packer::new(blocks, &mut [], first, 0)
    }

    fn used(packer: &Packer) -> usize {
        packer.triangle_block_count()
    }
}

impl Packed for SphereBlock {
    const LEAST: usize = SPHERES;

    fn packer(blocks: &mut [Self], first: u32) -> Packer<'_> {
        Packer::new(&mut [], blocks, 0, first)
    }

    fn used(packer: &Packer) -> usize {
        packer.sphere_block_count()
    }
}

/// Packs primitives of one kind, whose ids begin at entry `first`; returns how many blocks they take.
pub(super) fn pack<B: Packed>(
    source: Source,
    ids: &[u32],
    first: usize,
    blocks: &mut [B],
    caller: &Caller,
) -> Option<usize> {
    let mut jobs = parts(ids, first, blocks, caller)?;
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

/// The ids in parts, each with the blocks that it can take.
fn parts<'p, B: Packed>(
    ids: &'p [u32],
    first: usize,
    mut blocks: &'p mut [B],
    caller: &Caller,
) -> Option<[Option<Part<'p, B>>; PARTS]> {
    let (mut jobs, mut at) = ([const { None }; PARTS], 0);
    let size = caller.part_size(ids.len(), CHUNK);
    for (i, (job, ids)) in jobs.iter_mut().zip(ids.chunks(size)).enumerate() {
        let count = most_blocks(ids.len(), B::LEAST);
        let blocks = front(&mut blocks, count)?;
        *job = Some(Part { first: first + i * size, ids, blocks, at, used: None });
        at += count;
    }
    Some(jobs)
}

impl<B: Packed> Part<'_, B> {
    fn pack(&mut self, source: Source) -> Option<usize> {
        let (mut used, mut shapes) = (0, source.shapes());
        for (i, ids) in self.ids.chunks(CHUNK).enumerate() {
            let mut packer =
                B::packer(self.blocks.get_mut(used..)?, (self.first + i * CHUNK) as u32);
            for (i, id) in ids.iter().enumerate() {
                shapes.look_ahead(|ahead| ids.get(i + ahead).copied());
                match shapes.corners(*id) {
                    Some(corners) => packer.push_triangle(corners)?,
                    None => packer.push(&shapes.get(*id)?)?,
                };
            }
            used += B::used(&packer);
        }
        Some(used)
    }
}
