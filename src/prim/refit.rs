//! Leaf blocks over primitives that have moved.

use super::Leaves;
use super::gather::Shape;
use super::shapes::{Shapes, Source};
use crate::block::leaf::{KIND_TRIANGLES, LeafRef, SPHERES, SphereBlock, TRIANGLES, TriangleBlock};
use crate::caller::{Caller, PARTS};
use crate::math::Aabb;

/// Blocks are shared out in multiples of this many.
const BLOCKS: usize = 256;

/// Brings all leaf blocks to where their primitives are now; returns how many triangles and how many spheres can be hit.
///
/// A lane keeps its primitive and the numbers of its corners, which say where each vertex goes. Places that no lane
/// uses which can be hit are zero, so that what is not finite never gets into a block.
pub(crate) fn refit_leaves(
    source: Source,
    prim_ids: &[u32],
    triangle_blocks: &mut [TriangleBlock],
    sphere_blocks: &mut [SphereBlock],
    caller: &Caller,
) -> [u32; 2] {
    let triangles = for_each_block(triangle_blocks, source, caller, |block, shapes| {
        let entries = Entries { ids: prim_ids, first: block.first as usize };
        entries.read(block.held(), shapes, block);
        block.live.count_ones()
    });
    let spheres = for_each_block(sphere_blocks, source, caller, |block, shapes| {
        let entries = Entries { ids: prim_ids, first: block.first as usize };
        entries.read(block.held(), shapes, block);
        block.live.count_ones()
    });
    [triangles, spheres]
}

/// The sum of what `renew` returns for each block. It has the shapes of `source`.
fn for_each_block<B: Send>(
    blocks: &mut [B],
    source: Source,
    caller: &Caller,
    renew: impl Fn(&mut B, &mut Shapes) -> u32 + Sync,
) -> u32 {
    let size = caller.part_size(blocks.len(), BLOCKS);
    let mut parts = [const { None }; PARTS];
    for (part, blocks) in parts.iter_mut().zip(blocks.chunks_mut(size)) {
        *part = Some((blocks, 0));
    }
    caller.for_each(&mut parts, |part| {
        if let Some((blocks, sum)) = part {
            let mut shapes = source.shapes();
            *sum = blocks.iter_mut().map(|block| renew(block, &mut shapes)).sum();
        }
    });
    parts.iter().flatten().map(|(_, sum)| sum).sum()
}

/// The entries of `prim_ids` from one on.
struct Entries<'i> {
    ids: &'i [u32],
    first: usize,
}

impl Entries<'_> {
    /// Reads what the lanes in `held` hold into `block`.
    #[inline(always)]
    fn read(&self, held: u32, shapes: &mut Shapes, block: &mut impl Renewed) {
        let count = held.count_ones() as usize;
        block.clear();
        for entry in self.first..self.first.saturating_add(count) {
            shapes.look_ahead(|n| self.ids.get(entry.saturating_add(n)).copied());
            let shape = self.ids.get(entry).and_then(|id| shapes.get(*id)?.sound());
            if let Some(shape) = shape {
                block.take(entry - self.first, &shape);
            }
        }
    }
}

/// A leaf block that is filled anew.
trait Renewed {
    /// Forgets where everything is.
    fn clear(&mut self);

    /// Takes the shape in `lane`, which can be hit.
    fn take(&mut self, lane: usize, shape: &Shape);
}

impl Renewed for TriangleBlock {
    fn clear(&mut self) {
        let TriangleBlock { corners, first, count, .. } = *self;
        *self = TriangleBlock { corners, first, count, ..TriangleBlock::EMPTY };
    }

    #[inline(always)]
    fn take(&mut self, lane: usize, shape: &Shape) {
        let Shape::Triangle(corners) = shape else { return };
        for (v, corner) in self.corner_numbers(lane).into_iter().zip(corners) {
            for (axis, x) in self.vertices.iter_mut().zip(corner) {
                axis[v % TRIANGLES] = *x;
            }
        }
        self.aabb.add(&shape.aabb());
        self.live |= 1 << lane;
    }
}

impl Renewed for SphereBlock {
    fn clear(&mut self) {
        let SphereBlock { first, count, .. } = *self;
        *self = SphereBlock { first, count, ..SphereBlock::EMPTY };
    }

    #[inline(always)]
    fn take(&mut self, lane: usize, shape: &Shape) {
        let (Shape::Sphere { centre: [x, y, z], radius }, i) = (*shape, lane % SPHERES) else {
            return;
        };
        (self.x[i], self.y[i], self.z[i], self.radius[i]) = (x, y, z, radius);
        self.live |= 1 << i;
    }
}

impl Leaves<'_> {
    /// The smallest box that a build makes around what can be hit among the lanes of a leaf.
    pub fn tight_box(&self, leaf: LeafRef) -> Aabb {
        let (kind, number) = (leaf.kind(), leaf.number());
        let mut aabb = self.tight_box_of_block((kind, number), leaf.lanes & 0xFFFF);
        if leaf.lanes >> 16 != 0 {
            aabb.add(&self.tight_box_of_block((kind, number + 1), leaf.lanes >> 16));
        }
        aabb
    }

    /// The same among the `lanes` of one block.
    pub fn tight_box_of_block(&self, (kind, number): (u32, usize), lanes: u32) -> Aabb {
        let mut aabb = Aabb::EMPTY;
        if kind == KIND_TRIANGLES {
            let Some(block) = self.triangle_blocks.get(number) else { return aabb };
            if block.lanes() & !lanes == 0 {
                return block.aabb;
            }
            for i in (0..TRIANGLES).filter(|i| (block.lanes() & lanes) >> i & 1 != 0) {
                aabb.add(&Shape::Triangle(block.triangle(i)).aabb());
            }
        } else if let Some(block) = self.sphere_blocks.get(number) {
            for i in (0..SPHERES).filter(|i| (block.lanes() & lanes) >> i & 1 != 0) {
                let (centre, radius) = block.sphere(i);
                aabb.add(&Shape::Sphere { centre, radius }.aabb());
            }
        }
        aabb
    }
}
