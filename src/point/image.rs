//! What an instance makes of primitives, to a point.

use glam::DVec3;

use super::ellipsoid::{Frame, on_ellipsoid};
use super::shape::{Foot, on_sphere};
use crate::instance::Map;
use crate::math::wide;

/// A map that primitives are seen through, or none.
pub(crate) struct Image {
    map: Option<Map>,
    /// Nothing in object space is more than so many times as far away as its image in the world, or as near.
    shrinks: f64,
    stretches: f64,
}

impl Image {
    /// What is as it is stored.
    pub const SAME: Image = Image { map: None, shrinks: 1.0, stretches: 1.0 };

    /// By the map of an instance.
    pub fn new(map: Map) -> Image {
        let inverse = Frame::of(map.world_to_object.map(DVec3::from));
        // A millionth more than covers what rounding does.
        let [shrinks, stretches] =
            [inverse, Frame::of(map.linear())].map(|frame| frame.largest() * 1.000_001);
        Image { map: Some(map), shrinks, stretches }
    }

    /// See the field.
    pub fn shrinks(&self) -> f64 {
        self.shrinks
    }

    /// The image of a vertex.
    #[inline(always)]
    pub fn of(&self, vertex: [f32; 3]) -> DVec3 {
        self.map.as_ref().map_or(wide(vertex), |map| map.point(wide(vertex)))
    }

    /// What the image of is `world`, and the size in object space of what the rounding of this and of images is relative to, if
    /// coordinates there are up to `reach`.
    pub fn origin_of(&self, world: DVec3, reach: f64) -> (DVec3, f64) {
        let Some(map) = &self.map else { return (world, world.abs().max_element() + reach) };
        let away = world - map.shift();
        let origin = map.world_to_object.map(|row| DVec3::from(row).dot(away));
        let size = world.abs().max_element() + map.shift().abs().max_element();
        let seen = size + self.stretches * reach;
        (DVec3::from(origin), 3.0 * self.shrinks * seen + reach)
    }

    /// The closest point of the image of a sphere.
    pub fn foot_on_sphere(&self, point: DVec3, centre: [f32; 3], radius: f32) -> Foot {
        match &self.map {
            None => on_sphere(point, centre, radius),
            Some(map) => {
                let axes = map.linear().map(|column| f64::from(radius) * column);
                on_ellipsoid(point, map.point(wide(centre)), axes)
            }
        }
    }
}
