//! Fills leaf blocks, each to the end before the next.

use super::gather::{Shape, geometries};
use super::numbers::Numbers;
use super::visit::for_each_named_in;
use crate::block::leaf::{
    KIND_SPHERES, KIND_TRIANGLES, LeafRef, SPHERES, SphereBlock, TRIANGLES, TriangleBlock,
    block_ref,
};
use crate::block::{Census, PartsMut};
use crate::kinds::{BALLS, REFIT};
use crate::math::rounding::f32_above;
use crate::math::{Aabb, sum_abs, wide};
use crate::scene::Scene;

/// Packs all primitives that count in the order of their numbers, each once; returns the number of triangle blocks.
pub(crate) fn pack_in_order(scene: &Scene, census: &Census, parts: PartsMut) -> u32 {
    geometries(scene, parts.geometries);
    let mut packer =
        Packer::new(parts.triangle_blocks, parts.sphere_blocks, 0, census.triangle_count);
    let triangle_count = (census.triangle_count as usize).min(parts.prim_ids.len());
    let (triangle_ids, sphere_ids) = parts.prim_ids.split_at_mut(triangle_count);
    let (mut triangle_ids, mut sphere_ids) = (triangle_ids.iter_mut(), sphere_ids.iter_mut());
    for_each_named_in(scene, 0..u32::MAX, census.ignored_count == 0, |prim, names| {
        let shape = if REFIT && census.refit { names.of(prim.shape) } else { prim.shape };
        let ids = if shape.is_triangle() { &mut triangle_ids } else { &mut sphere_ids };
        if let (Some(id), Some(_)) = (ids.next(), packer.push(&shape)) {
            *id = prim.id;
        }
    });
    packer.triangle_block_count() as u32
}

/// Primitives go in one by one and come to lie in blocks, in the order of their coming.
///
/// Triangles of one block share vertices of equal bits; what is to be refitted brings [names](super::names::Names) as
/// vertices. A block is closed when the next triangle
/// would need a seventeenth vertex or lane, so every block but the last holds at least five.
pub(crate) struct Packer<'b> {
    triangle_blocks: &'b mut [TriangleBlock],
    sphere_blocks: &'b mut [SphereBlock],
    triangles: Fill,
    spheres: Fill,
    numbers: Numbers,
}

/// How far blocks of one kind are filled.
#[derive(Clone, Copy, Default)]
struct Fill {
    /// Blocks in use; the last of them is the one being filled.
    blocks: usize,
    /// Vertices in that block.
    vertices: usize,
    /// The entry of `prim_ids` that the next primitive gets.
    next_id: u32,
    /// Whether the last block takes no more.
    closed: bool,
}

impl<'b> Packer<'b> {
    /// Packs into these blocks. The ids of triangles start at entry `first_triangle` of `prim_ids`, those of
    /// spheres at entry `first_sphere`.
    pub fn new(
        triangle_blocks: &'b mut [TriangleBlock],
        sphere_blocks: &'b mut [SphereBlock],
        first_triangle: u32,
        first_sphere: u32,
    ) -> Self {
        let spheres = Fill { next_id: first_sphere, ..Fill::default() };
        let triangles = Fill { next_id: first_triangle, ..Fill::default() };
        Packer { triangle_blocks, sphere_blocks, triangles, spheres, numbers: Numbers::NONE }
    }

    /// The number of triangle blocks in use.
    pub fn triangle_block_count(&self) -> usize {
        self.triangles.blocks
    }

    /// The same of spheres.
    pub fn sphere_block_count(&self) -> usize {
        self.spheres.blocks
    }

    /// Lets the next primitive begin a block, of whichever kind it is.
    pub fn close(&mut self) {
        self.triangles.closed = true;
        self.spheres.closed = true;
    }

    /// Adds a primitive; returns the block it went to, as [`LeafRef::block`] has it, and its lane.
    /// `None` when the blocks are full, which the sizes that `needs` plans exclude.
    pub fn push(&mut self, shape: &Shape) -> Option<(u32, u32)> {
        // Not by `packed`, which costs small builds 0.9 kB.
        match *shape {
            Shape::Triangle(corners) => self.push_triangle(corners),
            _ if !BALLS => None,
            Shape::Sphere { centre, radius } => self.push_sphere(centre, radius),
            Shape::Box(aabb) => {
                let (centre, radius) = ball_around(&aabb);
                self.push_sphere(centre, radius)
            }
        }
    }

    /// Adds a primitive to a leaf, in which are then six of one kind at the most.
    pub fn push_to(&mut self, leaf: &mut Option<LeafRef>, shape: &Shape) -> Option<()> {
        let (block, lane) = self.push(shape)?;
        let leaf = leaf.get_or_insert(LeafRef { block, lanes: 0 });
        // At most one step to the next block: five triangles always fit into it.
        leaf.lanes |= 1 << (lane + 16 * (block - leaf.block));
        Some(())
    }

    /// Adds a triangle.
    pub fn push_triangle(&mut self, corners: [[f32; 3]; 3]) -> Option<(u32, u32)> {
        let fill = &mut self.triangles;
        let open = fill.blocks.checked_sub(1).and_then(|b| self.triangle_blocks.get(b));
        let fits = open.is_some_and(|block| {
            let known = |v: &[f32; 3]| usize::from(self.numbers.find(&block.vertices, v).is_ok());
            !fill.closed
                && (block.count as usize) < TRIANGLES
                && (fill.vertices + 3 <= TRIANGLES
                    || fill.vertices + 3 <= TRIANGLES + corners.iter().map(known).sum::<usize>())
        });
        if !fits {
            self.triangle_blocks.get_mut(fill.blocks)?.clear(fill.next_id);
            self.numbers = Numbers::NONE;
            fill.blocks += 1;
            fill.vertices = 0;
            fill.closed = false;
        }
        let number = fill.blocks - 1;
        let block = self.triangle_blocks.get_mut(number)?;
        let lane = block.count;
        for (k, corner) in corners.iter().enumerate() {
            let v = self.numbers.number(&mut block.vertices, corner, &mut fill.vertices);
            block.set_corner(lane as usize, k, v);
        }
        block.aabb.add(&Shape::Triangle(corners).aabb());
        block.live |= 1 << lane;
        block.count += 1;
        fill.next_id += 1;
        Some((block_ref(KIND_TRIANGLES, number as u32), lane))
    }

    fn push_sphere(&mut self, [x, y, z]: [f32; 3], radius: f32) -> Option<(u32, u32)> {
        let fill = &mut self.spheres;
        let open = fill.blocks.checked_sub(1).and_then(|b| self.sphere_blocks.get(b));
        if fill.closed || open.is_none_or(|block| block.count as usize == SPHERES) {
            *self.sphere_blocks.get_mut(fill.blocks)? =
                SphereBlock { first: fill.next_id, ..SphereBlock::EMPTY };
            fill.blocks += 1;
            fill.closed = false;
        }
        let number = fill.blocks - 1;
        let block = self.sphere_blocks.get_mut(number)?;
        let lane = block.count;
        block.set_sphere(lane as usize, [x, y, z], radius);
        block.live |= 1 << lane;
        block.count += 1;
        fill.next_id += 1;
        Some((block_ref(KIND_SPHERES, number as u32), lane))
    }
}

/// What stands for a shape in leaf blocks: for a box a ball around it.
pub(crate) fn packed(shape: Shape) -> Shape {
    match shape {
        Shape::Box(aabb) => {
            let (centre, radius) = ball_around(&aabb);
            Shape::Sphere { centre, radius }
        }
        shape => shape,
    }
}

/// The centre of a box, and its distance from the corners or a little more.
fn ball_around(aabb: &Aabb) -> ([f32; 3], f32) {
    let (lower, upper) = (wide(aabb.lower), wide(aabb.upper));
    let centre = ((lower + upper) / 2.0).to_array().map(|x| x as f32);
    let reach = sum_abs((upper - wide(centre)).max(wide(centre) - lower));
    (centre, f32_above(reach))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(x: f32) -> Shape {
        Shape::Triangle([[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x, 1.0, 0.0]])
    }

    #[test]
    fn blocks_of_separate_triangles_hold_five() {
        let mut blocks = [TriangleBlock::EMPTY; 4];
        let mut packer = Packer::new(&mut blocks, &mut [], 0, 0);
        let places: [_; 16] = core::array::from_fn(|i| packer.push(&triangle(3.0 * i as f32)));
        assert!(places.iter().all(Option::is_some));
        assert_eq!(packer.triangle_block_count(), 4);
        assert_eq!(blocks.map(|b| b.count), [5, 5, 5, 1]);
        assert_eq!(blocks.map(|b| b.first), [0, 5, 10, 15]);
        assert_eq!(blocks[1].triangle(2)[1], [22.0, 0.0, 0.0]);
        assert_eq!((blocks[1].aabb.lower, blocks[1].aabb.upper), ([15., 0., 0.], [28., 1., 0.]));
    }

    #[test]
    fn shared_vertices_are_stored_once() {
        let mut blocks = [TriangleBlock::EMPTY; 1];
        let mut packer = Packer::new(&mut blocks, &mut [], 0, 0);
        for _ in 0..16 {
            assert!(packer.push(&triangle(0.0)).is_some());
        }
        assert!(packer.push(&triangle(0.0)).is_none(), "a seventeenth lane does not exist");
    }

    #[test]
    fn a_leaf_may_straddle_two_blocks() {
        let mut blocks = [TriangleBlock::EMPTY; 2];
        let mut packer = Packer::new(&mut blocks, &mut [], 0, 0);
        let mut leaf = |n: usize| {
            let mut leaf = None;
            for i in 0..n {
                let shape = triangle(3.0 * (i + 10 * n) as f32);
                packer.push_to(&mut leaf, &shape).expect("room");
            }
            leaf.expect("a leaf")
        };
        let (first, second) = (leaf(3), leaf(6));
        assert_eq!((first.number(), first.lanes), (0, 0b111));
        assert_eq!((second.number(), second.lanes), (0, 0b1111 << 16 | 0b11000));
    }
}
