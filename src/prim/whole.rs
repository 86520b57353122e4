//! Fills leaf blocks whose triangles are chosen, and fit.

use super::numbers::Numbers;
use super::shapes::Shapes;
use crate::block::leaf::{TRIANGLES, TriangleBlock, corner_shift, low_bits};
use crate::math::Aabb;

/// Writes whole blocks, one after the other.
///
/// Triangles share vertices of equal bits. Most of these are known by their number in the mesh, and need not be fetched and
/// compared again.
pub(crate) struct BlockWriter<'s, 'a> {
    shapes: Shapes<'s, 'a>,
    numbers: Numbers,
    known: Known,
}

impl<'s, 'a> BlockWriter<'s, 'a> {
    pub fn new(shapes: Shapes<'s, 'a>) -> Self {
        BlockWriter { shapes, numbers: Numbers::NONE, known: Known::NOTHING }
    }

    /// Fills a block with the triangles `ids`, of which the first one's entry in `prim_ids` is `first`; `None` where they do
    /// not fit. `next` gives the id of the triangle that comes so many after the first, in this block or behind it.
    pub fn write(
        &mut self,
        block: &mut TriangleBlock,
        first: u32,
        ids: &[u32],
        next: impl Fn(usize) -> Option<u32>,
    ) -> Option<()> {
        if ids.len() > TRIANGLES {
            return None;
        }
        let (count, live) = (ids.len() as u32, low_bits(ids.len() as u32));
        *block = TriangleBlock { first, count, live, ..TriangleBlock::EMPTY };
        self.numbers = Numbers::NONE;
        self.known.forget();
        let (mut corners, mut vertices) = ([0u64; 3], 0);
        for (lane, id) in ids.iter().enumerate() {
            self.shapes.look_ahead(|n| next(lane + n));
            let (mesh, numbers) = self.shapes.numbered(*id)?;
            for (corners, number) in corners.iter_mut().zip(numbers) {
                let v = match self.known.find(mesh, number) {
                    Some(v) => v,
                    None => {
                        let v = self.add(block, number, &mut vertices)?;
                        self.known.learn(mesh, number, v);
                        v
                    }
                };
                *corners |= (v as u64) << corner_shift(lane);
            }
        }
        block.corners = corners.map(u64::to_le_bytes);
        Some(())
    }

    /// The number in the block of a vertex, which becomes the next of `count` if it is new.
    fn add(
        &mut self,
        block: &mut TriangleBlock,
        number: usize,
        count: &mut usize,
    ) -> Option<usize> {
        let vertex = self.shapes.vertex(number)?;
        block.aabb.add(&Aabb { lower: vertex, upper: vertex });
        if *count < TRIANGLES {
            return Some(self.numbers.number(&mut block.vertices, &vertex, count));
        }
        self.numbers.find(&block.vertices, &vertex).ok()
    }
}

/// The vertices of a block by their numbers in meshes: a table that forgets what another vertex takes the place of.
struct Known {
    /// Mesh and number, and the block with the number in it.
    entries: [(u64, u64); 64],
    /// Counts blocks, from 1 on.
    block: u64,
}

impl Known {
    const NOTHING: Known = Known { entries: [(0, 0); 64], block: 0 };

    /// Begins another block.
    fn forget(&mut self) {
        self.block += 1;
    }

    #[inline(always)]
    fn find(&self, mesh: u32, number: usize) -> Option<usize> {
        let (vertex, place) = self.entries[number % 64];
        let known = (vertex == name(mesh, number)) & (place / TRIANGLES as u64 == self.block);
        known.then_some(place as usize % TRIANGLES)
    }

    #[inline(always)]
    fn learn(&mut self, mesh: u32, number: usize, v: usize) {
        let place = self.block * TRIANGLES as u64 + v as u64;
        self.entries[number % 64] = (name(mesh, number), place);
    }
}

/// A vertex of all meshes; `mesh` is the first triangle of its own.
#[inline(always)]
fn name(mesh: u32, number: usize) -> u64 {
    u64::from(mesh) << 32 | number as u64
}
