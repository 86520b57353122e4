//! What `f32` knows of one triangle, for the mode that decides by it.

use glam::Vec3;

use super::areas::{Across, area};
use super::meetings::Middle;
use super::triangle::{One, all_sheared};
use super::vector::{cross, dot, sum_abs};
use crate::math::float::limited;
use crate::math::rounding::UNIT32;
use crate::ray::{PreparedRay, TINY};

/// One triangle in `f32`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TriangleDetail {
    /// The frame's `t`, between those of the nearest and the farthest vertex.
    pub t: f32,
    /// What it may be off; infinite where the triangle is seen edge-on.
    pub t_error: f32,
    /// Weights of the second and the third vertex.
    pub weights: [f32; 2],
    /// Whether the line meets the front, where rounding leaves no doubt.
    pub front: Option<bool>,
}

/// What `f32` knows of a triangle that the filter does not reject.
///
/// In line where room is no matter: corners that are handed on in memory are written one by one and read in pairs, which is slow.
#[cfg_attr(target_pointer_width = "64", inline(always))]
pub(crate) fn detail(ray: &PreparedRay, corners: [[f32; 3]; 3]) -> TriangleDetail {
    let rate = ray.shear.depth_rate;
    let (depth, t_error, front) = match plane(ray, corners) {
        Some(Plane { t, t_error, front }) => (t * rate, t_error, Some(front)),
        None => edge_on(ray, corners),
    };
    let [(a_along, a), (b_along, b), (c_along, c)] = all_sheared(ray, &corners);
    let [over_a, over_b, over_c] = over([&a, &b, &c]);
    let total = over_a + over_b + over_c;
    let [nearest, farthest] = extremes([a_along.depth[0], b_along.depth[0], c_along.depth[0]]);
    TriangleDetail {
        // A NaN, from 0 / 0, loses to the depths of the vertices.
        t: limited(depth, nearest, farthest) / rate,
        t_error,
        weights: [over_b / total, over_c / total],
        front,
    }
}

/// The depth at which the ray meets a triangle whose plane hardly tells, what the frame's `t` may be off, and the side.
#[cold]
#[inline(never)]
fn edge_on(ray: &PreparedRay, corners: [[f32; 3]; 3]) -> (f32, f32, Option<bool>) {
    let ([a, b, c], k) = (corners, ray.shear.axes[2] as usize);
    let middle = Middle::between(ray, extremes([a[k], b[k], c[k]]));
    let One { areas, meetings } = One::new(ray, &middle, corners);
    let [[over_a], [over_b], [over_c]] = areas.over;
    let ([area_error], [size_of_total], [rise]) = (areas.error, meetings.total, meetings.rise);
    let total = over_a + over_b + over_c;
    // The total carries the errors of three areas, and less than as much again of its own.
    let is_clear = size_of_total > 6.0 * area_error;
    let front = is_clear.then_some((total < 0.0) == (ray.shear.depth_scale > 0.0));
    (middle.depth[0] + rise / size_of_total, f32::INFINITY, front)
}

/// The areas over each of three vertices.
fn over([a, b, c]: [&Across<[f32; 1]>; 3]) -> [f32; 3] {
    [area::<_, false, 1>(b, c)[0], area::<_, false, 1>(c, a)[0], area::<_, false, 1>(a, b)[0]]
}

/// The least and the largest of three.
fn extremes([a, b, c]: [f32; 3]) -> [f32; 2] {
    let (low, high) = if a < b { (a, b) } else { (b, a) };
    [if low < c { low } else { c }, if high > c { high } else { c }]
}

/// Where the ray meets the plane of a triangle, in the frame, and a bound on the error of that.
struct Plane {
    t: f32,
    t_error: f32,
    front: bool,
}

/// The meeting with the plane; `None` when they are nearly parallel.
///
/// Far tighter than what the areas give for a ray that starts on a large triangle: the error grows with the
/// distance to the first vertex instead of with the triangle. The computation is that of
/// [`interval`](crate::interval) with another unit, and its bounds.
#[cfg_attr(target_pointer_width = "64", inline(always))]
fn plane(ray: &PreparedRay, corners: [[f32; 3]; 3]) -> Option<Plane> {
    let [a, b, c] = corners.map(|vertex| Vec3::from(vertex) * ray.scale);
    let (e1, e2) = (b - a, c - a);
    let n = cross(e1, e2);
    let d = Vec3::from_slice(&ray.direction);
    let to_plane = a - Vec3::from_slice(&ray.origin);
    let along = dot(d, n);
    let size = 8.5 * UNIT32 * sum_abs(e1) * sum_abs(e2);
    let along_error = sum_abs(d) * size + TINY;
    if !(4.0 * along_error < along.abs()) {
        return None;
    }
    let t = dot(to_plane, n) / along;
    // Half as much again for the divisor's own error, and a few roundings of the quotient and limits.
    let error = (sum_abs(to_plane) * size + TINY + t.abs() * along_error) / along.abs();
    let t_error = 1.5 * error + 8.0 * UNIT32 * t.abs();
    Some(Plane { t, t_error, front: along < 0.0 })
}
