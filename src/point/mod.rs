//! The question of a point: what in the scene is closest to it.
//!
//! A structure offers a [`Seek`] the leaves whose boxes come within its [bound](Around::is_within), near ones
//! first: [`Nearest`], which looks at primitives, or [`NearInstances`]. All arithmetic is `f64` in one order of operations, whatever the structure, so the answer has the same bits
//! from all of them; how far it can be from the real one, `docs/METHODS.md` derives.

mod around;
mod ellipsoid;
mod image;
mod instances;
mod shape;
#[cfg(test)]
mod tests;

use glam::DVec3;

use crate::block::leaf::{KIND_SPHERES, KIND_TRIANGLES, LeafRef, Place};
use crate::math::float::sqrt;
use crate::math::{Aabb, Bits, wide};
use crate::prim::Leaves;
use crate::query::Filter;
use crate::simd::{self, SMALL};
pub(crate) use around::Around;
use around::Sift;
pub(crate) use image::Image;
pub(crate) use instances::NearInstances;
use shape::Foot;

/// What looks for something close: a structure offers it leaves and obeys the bound. The same leaf may come again.
pub(crate) trait Seek {
    /// Where the point is, and how close a box must come.
    fn around(&self) -> &Around;

    /// Looks no farther than this for now.
    fn look_up_to(&mut self, distance: f64);

    /// Whether what is closest of all lies within this distance, or nothing does: then there is no need to look farther.
    fn is_settled_within(&self, distance: f64) -> bool;

    fn leaves(&self) -> &Leaves<'_>;

    /// Considers those of `lanes` of a block that are in use.
    fn block(&mut self, block: (u32, usize), lanes: u32);

    /// Considers the lanes of a leaf.
    fn leaf(&mut self, leaf: LeafRef) {
        let (kind, number) = (leaf.kind(), leaf.number());
        let (lanes, next) = (leaf.lanes & 0xFFFF, leaf.lanes >> 16);
        self.block((kind, number), lanes);
        if next != 0 {
            self.block((kind, number + 1), next);
        }
    }

    /// Considers everything.
    fn all(&mut self) {
        for number in 0..self.leaves().triangle_blocks.len() {
            self.block((KIND_TRIANGLES, number), u32::MAX);
        }
        for number in 0..self.leaves().sphere_blocks.len() {
            self.block((KIND_SPHERES, number), u32::MAX);
        }
    }
}

/// What is closest so far.
pub(crate) struct Nearest<'m> {
    /// Where the point is, to boxes.
    around: Around,
    /// Where it is to primitives, or rather to their images.
    world: DVec3,
    image: Image,
    filter: Filter<'m>,
    leaves: Leaves<'m>,
    /// The square of the distance up to which everything counts.
    limit: f64,
    /// How far to look for now.
    sight: f64,
    best: Option<(u32, Foot)>,
}

/// So few triangles are looked at one by one.
const FEW: u32 = 4;

impl<'m> Nearest<'m> {
    /// Nothing yet of what `image` makes of a block's primitives; what is not farther from `point` than the root of `limit`
    /// counts. `reach` is the largest coordinate of the block.
    pub fn new(
        image: Image,
        point: [f32; 3],
        limit: f64,
        reach: f32,
        filter: Filter<'m>,
        leaves: Leaves<'m>,
    ) -> Self {
        let world = wide(point);
        let (point, size) = image.origin_of(world, f64::from(reach));
        let (around, sight) = (Around::new(point, size), f64::INFINITY);
        let mut nearest =
            Nearest { around, world, image, filter, leaves, limit, sight, best: None };
        nearest.narrow();
        nearest
    }

    /// Sets the bound by how far to look, by the limit and by what is closest so far.
    fn narrow(&mut self) {
        let best = self.best.map_or(self.limit, |(_, foot)| foot.square);
        self.around.limit_to(self.sight.min(sqrt(best) * self.image.shrinks()));
    }

    /// The number of the closest primitive and the point on it.
    pub fn best(&self) -> Option<(u32, Foot)> {
        self.best
    }

    /// Keeps the closest, of equally close ones the first. A NaN is none.
    fn consider(&mut self, place: Place, foot: Foot) {
        let least = self.best.map_or(self.limit, |(_, best)| best.square);
        if !(foot.square <= least) || !self.filter.sees(place, true) {
            return;
        }
        let number = place.prim(self.leaves.prim_ids);
        let first = self.best.is_none_or(|(best, _)| number < best);
        if foot.square < least || first {
            self.best = Some((number, foot));
            self.narrow();
        }
    }
}

impl Seek for Nearest<'_> {
    #[inline(always)]
    fn around(&self) -> &Around {
        &self.around
    }

    fn look_up_to(&mut self, distance: f64) {
        self.sight = distance;
        self.narrow();
    }

    fn is_settled_within(&self, distance: f64) -> bool {
        let far = self.best.map_or(self.limit, |(_, foot)| foot.square);
        let distance = distance / self.image.shrinks();
        far <= distance * distance
    }

    fn leaves(&self) -> &Leaves<'_> {
        &self.leaves
    }

    fn block(&mut self, (kind, number): (u32, usize), lanes: u32) {
        if kind == KIND_TRIANGLES {
            let Some(block) = self.leaves.triangle_blocks.get(number) else { return };
            if !self.around.is_within(self.around.square_to(&block.aabb)) {
                return;
            }
            let mut lanes = lanes & block.lanes();
            if !SMALL && lanes.count_ones() > FEW {
                lanes &= simd::dispatch(Sift(&self.around, block));
            }
            for lane in Bits(lanes) {
                let corners = block.triangle(lane);
                if self.around.is_within(self.around.square_to(&Aabb::around(&corners))) {
                    let corners = corners.map(|corner| self.image.of(corner));
                    let foot = shape::on_triangle(self.world, corners);
                    self.consider(Place::of_lane(number as u32, block.first, lane as u32), foot);
                }
            }
        } else if kind == KIND_SPHERES {
            let Some(block) = self.leaves.sphere_blocks.get(number) else { return };
            for lane in Bits(lanes & block.lanes()) {
                let (centre, radius) = block.sphere(lane);
                let foot = self.image.foot_on_sphere(self.world, centre, radius);
                self.consider(Place::of_lane(number as u32, block.first, lane as u32), foot);
            }
        }
    }
}
