//! What can be hit: the layer that list, grid and BVH stand on.

mod gather;
mod pack;
mod sphere;
mod triangle;
mod validate;

pub(crate) use gather::{Shape, Survey, for_each_prim, geometries, shape, survey};
pub(crate) use pack::Packer;
pub(crate) use sphere::surface_normal;
pub(crate) use triangle::normal;
pub(crate) use validate::leaves_are_sound;

use crate::block::leaf::{KIND_SPHERES, KIND_TRIANGLES, LeafRef, SphereBlock, TriangleBlock};
use crate::exact::Meeting;
use crate::query::{Candidate, Query};
use crate::ray::PreparedRay;

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
    pub fn intersect_all<Q: Query>(&self, ray: &PreparedRay, query: &mut Q) -> bool {
        for (number, block) in self.triangle_blocks.iter().enumerate() {
            query.saw_step();
            let part = ray.slab(&block.aabb, query.t_bound());
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
        query.saw_block(lanes.count_ones());
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
        Lanes(lanes & block.lanes()).any(|lane| {
            let triangle = block.triangle(lane);
            let Some(hit) = triangle::intersect(ray, triangle) else { return false };
            let candidate = Candidate {
                t: hit.t,
                t_error: hit.t_error,
                meeting: Meeting::Triangle(triangle),
                weights: hit.weights,
                prim: self.prim_id(block.first, lane),
                place: (number as u32, lane as u32),
                front: hit.front,
                skippable: true,
            };
            offer(&candidate, ray, query)
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
        Lanes(lanes & block.lanes()).any(|lane| {
            let (centre, radius) = block.sphere(lane);
            let Some(hit) = sphere::intersect(ray, centre, radius) else { return false };
            (0..2).any(|root| {
                let candidate = Candidate {
                    t: hit.t[root],
                    t_error: hit.t_error[root],
                    meeting: Meeting::Sphere { centre, radius, root },
                    weights: [0.0; 2],
                    prim: self.prim_id(block.first, lane),
                    place: (number as u32, lane as u32),
                    front: root == 0,
                    // A line that only touches meets front and back in one point.
                    skippable: hit.touches || root == hit.nearest,
                };
                offer(&candidate, ray, query)
            })
        })
    }

    /// The flat number of the primitive in a lane. Blocks are checked before they are traversed,
    /// so the entry exists.
    fn prim_id(&self, first: u32, lane: usize) -> u32 {
        self.prim_ids.get(first as usize + lane).copied().unwrap_or(crate::ray::NONE)
    }
}

/// Offers what is within the ray's limits; what lies beyond the best hit so far is not looked at
/// closely.
fn offer<Q: Query>(candidate: &Candidate, ray: &PreparedRay, query: &mut Q) -> bool {
    candidate.interval().near <= query.t_bound()
        && candidate.is_within(ray)
        && query.accept(candidate)
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
