//! What can be hit: the layer that list, grid and BVH stand on.

mod census;
mod gather;
mod known;
mod names;
mod numbers;
mod pack;
mod refit;
mod shapes;
mod validate;
mod visit;
mod whole;

pub(crate) use gather::{GRAIN, Shape, Survey, box_around, geometries, geometry_table, survey};
pub(crate) use known::Known;
pub(crate) use names::Names;
pub(crate) use names::digest;
pub(crate) use numbers::{Numbers, Vertices};
pub(crate) use pack::{Packer, pack_in_order, packed};
pub(crate) use refit::refit_leaves;
pub(crate) use shapes::{Shapes, Source};
pub(crate) use validate::leaves_are_sound;
pub(crate) use visit::{Visitor, for_each_named_in, visit};
pub(crate) use whole::BlockWriter;

use crate::block::Block;
use crate::block::leaf::{
    KIND_SPHERES, KIND_TRIANGLES, LeafRef, Place, SphereBlock, TriangleBlock,
};
use crate::kinds::{BALLS, SPHERES};
use crate::math::{Aabb, Bits};
use crate::query::{Query, SphereLane, TriangleLane, Watch};
use crate::ray::{PreparedRay, Slab, WideSlab};
use crate::sieve::{self, Single, Triangles};
use crate::simd::{Kernel, SMALL, Simd, Width};

/// The leaf blocks of one accel.
#[derive(Clone, Copy)]
pub(crate) struct Leaves<'m> {
    pub triangle_blocks: &'m [TriangleBlock],
    pub sphere_blocks: &'m [SphereBlock],
    pub prim_ids: &'m [u32],
}

impl<'m> Leaves<'m> {
    /// Those of a block.
    #[inline(always)]
    pub fn of(block: &Block<'m>) -> Self {
        let Block { triangle_blocks, sphere_blocks, prim_ids, .. } = *block;
        Leaves { triangle_blocks, sphere_blocks, prim_ids }
    }
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
            if slab.part_by(s, &block.aabb, query.t_bound()).is_empty() {
                continue;
            }
            if self.intersect_block(s, KIND_TRIANGLES, number, block.lanes(), ray, query) {
                return true;
            }
        }
        for (number, block) in self.sphere_blocks.iter().enumerate().filter(|_| BALLS) {
            if self.intersect_block(s, KIND_SPHERES, number, block.lanes(), ray, query) {
                return true;
            }
        }
        false
    }

    /// Offers `query` what the ray meets in a block of a wide BVH, all of which is one leaf, or the instance that is one.
    #[inline(always)]
    pub fn intersect_whole<S: Simd, Q: Query>(
        &self,
        s: S,
        (kind, number): (u32, usize),
        ray: &PreparedRay,
        query: &mut Q,
    ) -> bool {
        if Q::OF_INDEX {
            return self.prim_ids.get(number).is_some_and(|id| query.instance(*id));
        }
        self.intersect_block(s, kind, number, u32::MAX, ray, query)
    }

    /// The box of a block; all of space for one that has none.
    #[inline(always)]
    pub fn aabb(&self, (kind, number): (u32, usize)) -> Aabb {
        // Spheres may be hit beyond the largest float.
        let everywhere = Aabb { lower: [f32::NEG_INFINITY; 3], upper: [f32::INFINITY; 3] };
        let block = self.triangle_blocks.get(number).filter(|_| kind == KIND_TRIANGLES);
        block.map_or(everywhere, |block| block.aabb)
    }

    /// Has a block fetched that will be visited soon.
    #[inline(always)]
    pub fn prefetch<S: Simd>(&self, s: S, (kind, number): (u32, usize)) {
        if kind == KIND_TRIANGLES {
            if let Some(block) = self.triangle_blocks.get(number) {
                s.prefetch(block);
            }
        } else if let Some(block) = self.sphere_blocks.get(number) {
            s.prefetch(block);
        }
    }

    /// Offers `query` what the ray meets among those of `lanes` that are in use.
    #[cfg_attr(target_os = "none", inline(never))]
    #[cfg_attr(not(target_os = "none"), inline(always))]
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
        } else if kind == KIND_SPHERES && (SPHERES || Q::OF_INDEX) {
            let Some(block) = self.sphere_blocks.get(number) else { return false };
            self.spheres(block, number, lanes & block.lanes(), ray, query)
        } else {
            false
        }
    }

    /// Offers `query` what the ray meets among some lanes of a block; out of line for a backend that shall be small.
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
        if SMALL {
            return one_by_one(block, number as u32, lanes, ray, query);
        }
        // What a hit is called is far away, and asked for last.
        if Q::ORDERED
            && let Some(id) = self.prim_ids.get(block.first as usize)
        {
            s.prefetch(id);
        }
        Look { block, number, lanes, ray, query }.run(s)
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
        if Q::OF_INDEX {
            return Bits(lanes).any(|lane| {
                let place = Place::of_lane(number as u32, block.first, lane as u32);
                query.instance(place.prim(self.prim_ids))
            });
        }
        query.watch().block(lanes.count_ones());
        Bits(lanes).any(|lane| {
            let (centre, radius) = block.sphere(lane);
            sieve::sphere(ray, query.t_bound(), centre, radius).is_some_and(|detail| {
                let place = Place::of_lane(number as u32, block.first, lane as u32);
                query.sphere(ray, &SphereLane { centre, radius, place, detail })
            })
        })
    }
}

/// Offers `query` what the ray meets among some lanes of a block, one after the other: in little code. Their order matters
/// to no answer.
#[cfg_attr(not(target_os = "none"), inline(never))]
fn one_by_one<Q: Query>(
    block: &TriangleBlock,
    number: u32,
    lanes: u32,
    ray: &PreparedRay,
    query: &mut Q,
) -> bool {
    query.watch().block(lanes.count_ones());
    let Some(sieve) = Single::new(ray, query.t_bound(), block) else { return false };
    Bits(lanes).any(|lane| {
        let lane = lane as u32;
        let Some(left) = sieve.look(lane) else { return false };
        let place = Place::of_lane(number, block.first, lane);
        let inside = query.wants_inside() && sieve.is_inside(&left);
        query.triangle(ray, &TriangleLane { block, place, sure: left.sure, inside })
    })
}

/// The first look at the triangles of a block.
struct Look<'a, Q> {
    block: &'a TriangleBlock,
    number: usize,
    lanes: u32,
    ray: &'a PreparedRay,
    query: &'a mut Q,
}

impl<Q: Query> Kernel for Look<'_, Q> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> bool {
        // Triangles that share nothing fill a block's vertices before half of its lanes.
        if S::IN_HALVES && self.lanes < 1 << 8 {
            self.among::<S, 8>(s)
        } else {
            self.among::<S, 16>(s)
        }
    }
}

impl<Q: Query> Look<'_, Q> {
    /// The look at the first `N` lanes.
    #[inline(always)]
    fn among<S: Simd + Width<N>, const N: usize>(self, s: S) -> bool {
        let Look { block, number, lanes, ray, query } = self;
        query.watch().block(lanes.count_ones());
        let t_bound = query.t_bound();
        let found = if Q::ANY_BOXES {
            sieve::triangles::<S, true, N>(s, ray, t_bound, block, lanes)
        } else {
            sieve::triangles::<S, false, N>(s, ray, t_bound, block, lanes)
        };
        let Some(found) = found else { return false };
        let number = number as u32;
        // Neither `t` nor order matters to those that want any hit.
        let inside = if Q::ORDERED { 0 } else { found.inside(s, ray) };
        let alone = found.candidates.is_power_of_two();
        if Q::CAN_WAIT && alone && found.sure != 0 {
            let lane = found.sure.trailing_zeros();
            let place = Place::of_lane(number, block.first, lane);
            if query.may_wait(ray, place, found.part(s, ray, lane)) {
                return false;
            }
        }
        if alone || inside != 0 {
            let lane = if inside == 0 { found.candidates } else { inside }.trailing_zeros();
            let certain = Certain { sure: found.sure >> lane & 1 == 1, inside: inside != 0 };
            let ended = consider(block, number, lane, certain, ray, query);
            if ended || alone {
                return ended;
            }
        }
        s.run(Several { block, number, t_bound, found: found.stored(), ray, query })
    }
}

/// What the sieve left of a block, several lanes, near ones first.
///
/// Out of line: what all rays of a loop would share for it, in registers and on the stack, few of them use.
struct Several<'a, Q> {
    block: &'a TriangleBlock,
    number: u32,
    t_bound: f32,
    found: Triangles<[f32; 16], 16>,
    ray: &'a PreparedRay,
    query: &'a mut Q,
}

impl<Q: Query> Kernel for Several<'_, Q> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> bool {
        let Several { block, number, t_bound, found, ray, query } = self;
        let found = found.loaded(s);
        let Triangles { candidates, sure, .. } = found;
        // Many in doubt: the block is small for the precision of the sieve, and of the boxes above it.
        let in_doubt = (candidates & !sure).count_ones();
        if Q::ANY_BOXES && in_doubt > 2 && !is_near(ray, block, t_bound) {
            return false;
        }
        let mut rest = candidates;
        while rest != 0 {
            let lane = found.nearest(s, rest);
            rest &= !(1 << lane);
            let sure = sure >> lane & 1 == 1;
            let place = Place::of_lane(number, block.first, lane);
            let waits = Q::CAN_WAIT && sure && query.may_wait(ray, place, found.part(s, ray, lane));
            let certain = Certain { sure, inside: false };
            if !waits && consider(block, number, lane, certain, ray, query) {
                return true;
            }
            // What was found in a lane may be nearer than others.
            if rest != 0 && query.t_bound() < t_bound {
                rest &= found.up_to(s, ray, query.t_bound());
            }
        }
        false
    }
}

/// What the sieve knows of a lane that it did not reject.
#[derive(Clone, Copy)]
struct Certain {
    sure: bool,
    inside: bool,
}

/// Offers `query` a lane; true when it wants no more.
///
/// Out of line, and so the same code for every backend, layout and structure: what is left is for scalar numbers. All
/// arguments fit into registers: what is written to memory by parts is slow to read as a whole.
#[inline(never)]
fn consider<Q: Query>(
    block: &TriangleBlock,
    number: u32,
    lane: u32,
    Certain { sure, inside }: Certain,
    ray: &PreparedRay,
    query: &mut Q,
) -> bool {
    let place = Place::of_lane(number, block.first, lane);
    query.triangle(ray, &TriangleLane { block, place, sure, inside })
}

/// Whether the ray comes near a block, in `f64`.
#[inline(never)]
fn is_near(ray: &PreparedRay, block: &TriangleBlock, t_bound: f32) -> bool {
    !WideSlab::new(ray).part(block.aabb.corners(), t_bound).is_empty()
}
