//! What is known of a surface where a ray met it.

use glam::DVec3;

use crate::exact::Line;
use crate::instance::Map;
use crate::interval::{sphere, triangle};
use crate::math::float::limited;
use crate::math::rounding::{UNIT, UNIT32, f32_above, f32_below};
use crate::math::wide;

/// The surface at a hit, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// The point of the hit, rounded.
    pub position: [f32; 3],
    /// Bound on the distance of `position` from the surface, along each axis; in instances also on what a ray that starts
    /// there is moved by when it is rounded in object space.
    pub position_error: f32,
    /// Unit normal: `(v1 - v0) x (v2 - v0)`, or outward on spheres; never flipped to the ray.
    pub normal: [f32; 3],
    /// `position` moved off the surface to the side of the normal.
    pub front_origin: [f32; 3],
    /// `position` moved off the surface to the other side.
    pub back_origin: [f32; 3],
}

/// A point of a surface in `f64`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spot {
    point: DVec3,
    /// The point is off by a few units of this, along each axis.
    size: f64,
    /// What a ray that starts here may be off by, after rounding in object space; zero outside instances.
    blur: f64,
    /// Of length one.
    normal: DVec3,
}

impl Spot {
    /// Where the line meets a triangle.
    pub fn on_triangle(line: &Line, corners: [[f32; 3]; 3]) -> Self {
        let [u, v] = triangle::plane(line, &corners).map_or([0.0; 2], |met| met.weights);
        // Whatever the error of the weights, the point lies in the triangle.
        let u = limited(u, 0.0, 1.0);
        let v = limited(v, 0.0, 1.0 - u);
        let [a, b, c] = corners.map(wide);
        let point = a + u * (b - a) + v * (c - a);
        let size = a.abs().max(b.abs()).max(c.abs()).max_element();
        Spot { point, size, blur: 0.0, normal: triangle::normal(corners) }
    }

    /// Where the line enters (`root` 0) or leaves a sphere.
    pub fn on_sphere(line: &Line, centre: [f32; 3], radius: f32, root: usize) -> Self {
        let normal = sphere::normal(line, centre, radius, root);
        let centre = wide(centre);
        let radius = f64::from(radius);
        let size = centre.abs().max_element() + radius;
        Spot { point: centre + radius * normal, size, blur: 0.0, normal }
    }

    /// The same spot of an instance, in the world.
    ///
    /// The map takes the error along with it, and adds four roundings of what it adds up.
    pub fn mapped(&self, map: &Map) -> Self {
        let size = map.widest(DVec3::splat(self.size)) + map.shift().abs();
        let rounding = map.widest(self.point.abs() + f64::from(f32::from_bits(1)));
        Spot {
            point: map.point(self.point),
            size: 1.25 * size.max_element(),
            blur: 1.01 * f64::from(UNIT32) * rounding.max_element(),
            normal: map.normal(self.normal).normalize_or_zero(),
        }
    }

    /// The surface, rounded.
    pub fn surface(&self) -> Surface {
        let Spot { point, size, blur, normal } = *self;
        // Half an ulp of the largest coordinate, the error of `point`, and the least float so that the
        // bound is never zero.
        const HALF_ULP: f64 = f32::EPSILON as f64 / 2.0;
        let bound = point.abs().max_element() * HALF_ULP + size * 32.0 * UNIT + blur;
        let error = f32_above(bound + f64::from(f32::from_bits(1)));
        let position = point.to_array().map(|x| x as f32);
        // Off by at most `error` along each axis, the position is off the surface by at most this.
        let off = f64::from(error) * (normal.abs().x + normal.abs().y + normal.abs().z);
        Surface {
            position,
            position_error: error,
            normal: normal.to_array().map(|x| x as f32),
            front_origin: moved(position, normal * off),
            back_origin: moved(position, normal * -off),
        }
    }
}

/// `position + by`, each coordinate rounded away from `position`.
fn moved(position: [f32; 3], by: DVec3) -> [f32; 3] {
    let [x, y, z] = (wide(position) + by).to_array();
    let away = |target, by| if by > 0.0 { f32_above(target) } else { f32_below(target) };
    [away(x, by.x), away(y, by.y), away(z, by.z)]
}
