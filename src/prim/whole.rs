//! Fills leaf blocks whose triangles are chosen, and fit.

use super::known::Known;
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
        block.clear(first);
        (block.count, block.live) = (count, live);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prim::{Packer, Source, geometry_table};
    use crate::scene::{Mesh, Scene};
    use std::vec::Vec;

    /// The block that a writer makes of these triangles of a scene, after one of others; and that of a packer.
    fn blocks_of(scene: &Scene, ids: &[u32]) -> [Option<TriangleBlock>; 2] {
        let geometries: Vec<_> = geometry_table(scene).collect();
        let source = Source { scene, geometries: &geometries, named: false };
        let mut writer = BlockWriter::new(source.shapes());
        let mut block = TriangleBlock::EMPTY;
        let mut write = |ids: &[u32]| writer.write(&mut block, 7, ids, |_| None).map(|()| block);
        write(&[3, 2, 1, 0]).expect("four triangles fit");
        let written = write(ids);
        let (mut packed, mut shapes) = ([TriangleBlock::EMPTY; 1], source.shapes());
        let mut packer = Packer::new(&mut packed, &mut [], 7, 0);
        let pushed = ids.iter().try_for_each(|id| packer.push(&shapes.get(*id)?).map(|_| ()));
        [written, pushed.map(|()| packed[0])]
    }

    fn words(block: &TriangleBlock) -> Vec<u32> {
        let corners = block.aabb.lower.iter().chain(&block.aabb.upper);
        let floats = block.vertices.iter().flatten().chain(corners);
        let numbers = block.corners.iter().flatten().map(|n| u32::from(*n));
        let rest = [block.first, block.count, block.live, block.reserved];
        floats.map(|x| x.to_bits()).chain(numbers).chain(rest).collect()
    }

    #[test]
    fn whole_blocks_are_those_that_are_packed_one_by_one() {
        // Vertices 64 apart want one place of the table; every fifth one has the bits of the one before.
        let vertex = |i: u32| [(i - u32::from(i % 5 == 4)) as f32, -0.0, (i % 3) as f32];
        let vertices: Vec<_> = (0..200).map(vertex).collect();
        let strip: Vec<_> = (0..14).map(|i| [i, i + 1, i + 2]).collect();
        let apart: Vec<_> = (0..8).map(|i| [64 * (i % 3), 64 * (i % 3) + 1, i]).collect();
        let soup: Vec<_> = (0..6).map(|i| [i, i + 1, i + 3].map(vertex)).collect();
        let meshes =
            [Mesh::indexed(&vertices, &strip), Mesh::indexed(&vertices, &apart), Mesh::soup(&soup)];
        let scene = Scene::new(&meshes, &[]);
        let all: [&[u32]; 6] = [
            &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13],
            &[14, 15, 16, 17, 18, 19, 20, 21],
            &[0, 14, 1, 15, 22, 2, 16, 23],
            &[22, 23, 24, 25, 26, 27],
            &[5; 16],
            &[27],
        ];
        for ids in all {
            let [written, packed] = blocks_of(&scene, ids).map(|block| block.map(|b| words(&b)));
            assert!(written.is_some() && written == packed, "{ids:?}");
        }
        assert!(blocks_of(&scene, &[5; 17])[0].is_none(), "a seventeenth triangle");
        let apart: Vec<_> =
            (0..6).map(|i| [3 * i, 3 * i + 1, 3 * i + 2].map(|x| [x as f32; 3])).collect();
        let meshes = [Mesh::soup(&apart)];
        assert!(
            blocks_of(&Scene::new(&meshes, &[]), &[0, 1, 2, 3, 4, 5])[0].is_none(),
            "18 vertices"
        );
    }
}
