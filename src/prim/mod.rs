//! What can be hit: the layer that list, grid and BVH stand on.

#[cfg(test)]
mod bounds;
mod gather;
mod pack;
mod sphere;
mod triangle;
mod validate;

pub(crate) use gather::{Shape, Survey, for_each_prim, geometries, shape, survey};
pub(crate) use pack::Packer;
pub(crate) use validate::leaves_are_sound;

use crate::block::leaf::{KIND_SPHERES, KIND_TRIANGLES, LeafRef, SphereBlock, TriangleBlock};
use crate::query::{Query, Watch};
use crate::ray::{PreparedRay, Slab};
use triangle::Depths;

/// The leaf blocks of one accel.
#[derive(Clone, Copy)]
pub(crate) struct Leaves<'m> {
    pub triangle_blocks: &'m [TriangleBlock],
    pub sphere_blocks: &'m [SphereBlock],
    pub prim_ids: &'m [u32],
}

impl Leaves<'_> {
    /// Offers `query` what the ray meets among the lanes of `leaf`; true when it wants no more.
    pub fn intersect<Q: Query>(&self, leaf: LeafRef, ray: &PreparedRay, query: &mut Q) -> bool {
        let number = leaf.number();
        let halves = [(number, leaf.lanes & 0xFFFF), (number + 1, leaf.lanes >> 16)];
        for (number, lanes) in halves {
            if lanes != 0 && self.intersect_block(leaf.kind(), number, lanes, ray, query) {
                return true;
            }
        }
        false
    }

    /// Offers `query` what the ray meets in any block: the traversal of a plain list.
    pub fn intersect_all<Q: Query>(
        &self,
        ray: &PreparedRay,
        slab: &impl Slab,
        query: &mut Q,
    ) -> bool {
        for (number, block) in self.triangle_blocks.iter().enumerate() {
            query.watch().step();
            let part = slab.part(&block.aabb, query.t_bound());
            if !part.is_empty()
                && self.intersect_block(KIND_TRIANGLES, number, block.lanes(), ray, query)
            {
                return true;
            }
        }
        (0..self.sphere_blocks.len()).any(|number| {
            let lanes = self.sphere_blocks[number].lanes();
            self.intersect_block(KIND_SPHERES, number, lanes, ray, query)
        })
    }

    fn intersect_block<Q: Query>(
        &self,
        kind: u32,
        number: usize,
        lanes: u32,
        ray: &PreparedRay,
        query: &mut Q,
    ) -> bool {
        query.watch().block(lanes.count_ones());
        match kind {
            KIND_TRIANGLES => self
                .triangle_blocks
                .get(number)
                .is_some_and(|block| self.triangles(block, number, lanes, ray, query)),
            KIND_SPHERES => self
                .sphere_blocks
                .get(number)
                .is_some_and(|block| self.spheres(block, number, lanes, ray, query)),
            _ => false,
        }
    }

    fn triangles<Q: Query>(
        &self,
        block: &TriangleBlock,
        number: usize,
        lanes: u32,
        ray: &PreparedRay,
        query: &mut Q,
    ) -> bool {
        let depths = Depths::new(ray, query.t_bound());
        Lanes(lanes & block.lanes()).any(|lane| {
            let (place, prim) = ((number as u32, lane as u32), self.prim_id(block.first, lane));
            triangle::lane(ray, &depths, block, place, prim)
                .is_some_and(|lane| query.triangle(ray, &lane))
        })
    }

    fn spheres<Q: Query>(
        &self,
        block: &SphereBlock,
        number: usize,
        lanes: u32,
        ray: &PreparedRay,
        query: &mut Q,
    ) -> bool {
        let t_bound = query.t_bound();
        Lanes(lanes & block.lanes()).any(|lane| {
            let (place, prim) = ((number as u32, lane as u32), self.prim_id(block.first, lane));
            sphere::lane(ray, t_bound, block, place, prim)
                .is_some_and(|lane| query.sphere(ray, &lane))
        })
    }

    /// The flat number of the primitive in a lane. Blocks are checked before they are traversed,
    /// so the entry exists.
    fn prim_id(&self, first: u32, lane: usize) -> u32 {
        self.prim_ids.get(first as usize + lane).copied().unwrap_or(crate::ray::NONE)
    }
}

/// The numbers of the bits that are set, from the lowest.
struct Lanes(u32);

impl Iterator for Lanes {
    type Item = usize;

    fn next(&mut self) -> Option<usize> {
        let lane = self.0.trailing_zeros();
        self.0 &= self.0.wrapping_sub(1);
        (lane < 32).then_some(lane as usize)
    }
}
