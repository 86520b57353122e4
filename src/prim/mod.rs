//! What can be hit: the layer that list, grid and BVH stand on.

mod gather;
mod pack;
mod validate;

pub(crate) use gather::{
    Shape, Shapes, Survey, for_each_prim, for_each_prim_in, geometries, shape, survey,
};
pub(crate) use pack::Packer;
pub(crate) use validate::leaves_are_sound;

use crate::block::leaf::{KIND_SPHERES, KIND_TRIANGLES, LeafRef, SphereBlock, TriangleBlock};
use crate::query::{Query, SphereLane, TriangleLane, Watch};
use crate::ray::{PreparedRay, Slab, WideSlab};
use crate::sieve::{self, Depths};
use crate::simd::Simd;

/// The leaf blocks of one accel.
#[derive(Clone, Copy)]
pub(crate) struct Leaves<'m> {
    pub triangle_blocks: &'m [TriangleBlock],
    pub sphere_blocks: &'m [SphereBlock],
    pub prim_ids: &'m [u32],
}

impl Leaves<'_> {
    /// Offers `query` what the ray meets among the lanes of `leaf`; true when it wants no more.
    #[inline(always)]
    pub fn intersect<S: Simd, Q: Query>(
        &self,
        s: S,
        leaf: LeafRef,
        ray: &PreparedRay,
        query: &mut Q,
    ) -> bool {
        let (kind, number) = (leaf.kind(), leaf.number());
        let (lanes, next) = (leaf.lanes & 0xFFFF, leaf.lanes >> 16);
        (lanes != 0 && self.intersect_block(s, kind, number, lanes, ray, query))
            || (next != 0 && self.intersect_block(s, kind, number + 1, next, ray, query))
    }

    /// Offers `query` what the ray meets in any block: the traversal of a plain list.
    #[inline(always)]
    pub fn intersect_all<S: Simd, Q: Query>(
        &self,
        s: S,
        ray: &PreparedRay,
        slab: &impl Slab,
        query: &mut Q,
    ) -> bool {
        for (number, block) in self.triangle_blocks.iter().enumerate() {
            query.watch().step();
            let part = slab.part(&block.aabb, query.t_bound());
            if !part.is_empty()
                && self.intersect_block(s, KIND_TRIANGLES, number, block.lanes(), ray, query)
            {
                return true;
            }
        }
        for (number, block) in self.sphere_blocks.iter().enumerate() {
            if self.intersect_block(s, KIND_SPHERES, number, block.lanes(), ray, query) {
                return true;
            }
        }
        false
    }

    /// Offers `query` what the ray meets in a block of a wide BVH, all of which is one leaf.
    #[inline(always)]
    pub fn intersect_whole<S: Simd, Q: Query>(
        &self,
        s: S,
        (kind, number): (u32, usize),
        ray: &PreparedRay,
        query: &mut Q,
    ) -> bool {
        self.intersect_block(s, kind, number, u32::MAX, ray, query)
    }

    /// Offers `query` what the ray meets among those of `lanes` that are in use.
    #[inline(always)]
    fn intersect_block<S: Simd, Q: Query>(
        &self,
        s: S,
        kind: u32,
        number: usize,
        lanes: u32,
        ray: &PreparedRay,
        query: &mut Q,
    ) -> bool {
        if kind == KIND_TRIANGLES {
            let Some(block) = self.triangle_blocks.get(number) else { return false };
            self.triangles(s, block, number, lanes & block.lanes(), ray, query)
        } else if kind == KIND_SPHERES {
            let Some(block) = self.sphere_blocks.get(number) else { return false };
            self.spheres(block, number, lanes & block.lanes(), ray, query)
        } else {
            false
        }
    }

    #[inline(always)]
    fn triangles<S: Simd, Q: Query>(
        &self,
        s: S,
        block: &TriangleBlock,
        number: usize,
        lanes: u32,
        ray: &PreparedRay,
        query: &mut Q,
    ) -> bool {
        query.watch().block(lanes.count_ones());
        let t_bound = query.t_bound();
        let found = sieve::triangles(s, ray, &Depths::new(ray, t_bound), block, lanes);
        // Many in doubt: the block is small for the precision of the sieve, and of the boxes above it.
        let in_doubt = (found.candidates & lanes & !found.sure).count_ones();
        if Q::ANY_BOXES && in_doubt > 2 && !is_near(ray, block, t_bound) {
            return false;
        }
        for lane in Lanes(found.candidates & lanes) {
            let corners = block.triangle(lane);
            // What was found in a lane before may already be nearer.
            let bound = query.t_bound();
            if bound < t_bound && !sieve::is_candidate(ray, &Depths::new(ray, bound), corners) {
                continue;
            }
            let has = |mask: u32| mask >> lane & 1 == 1;
            let lane = TriangleLane {
                corners,
                prim: self.prim_id(block.first, lane),
                place: (number as u32, lane as u32),
                sure: has(found.sure),
                inside: has(found.inside),
            };
            if query.triangle(ray, &lane) {
                return true;
            }
        }
        false
    }

    #[inline(never)]
    fn spheres<Q: Query>(
        &self,
        block: &SphereBlock,
        number: usize,
        lanes: u32,
        ray: &PreparedRay,
        query: &mut Q,
    ) -> bool {
        query.watch().block(lanes.count_ones());
        Lanes(lanes).any(|lane| {
            let (centre, radius) = block.sphere(lane);
            sieve::sphere(ray, query.t_bound(), centre, radius).is_some_and(|detail| {
                let prim = self.prim_id(block.first, lane);
                let place = (number as u32, lane as u32);
                query.sphere(ray, &SphereLane { centre, radius, prim, place, detail })
            })
        })
    }

    /// The flat number of the primitive in a lane. Blocks are checked before they are traversed,
    /// so the entry exists.
    fn prim_id(&self, first: u32, lane: usize) -> u32 {
        self.prim_ids.get(first as usize + lane).copied().unwrap_or(crate::ray::NONE)
    }
}

/// Whether the ray comes near a block, in `f64`.
#[inline(never)]
fn is_near(ray: &PreparedRay, block: &TriangleBlock, t_bound: f32) -> bool {
    !WideSlab::new(ray).part(&block.aabb, t_bound).is_empty()
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
