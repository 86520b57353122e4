//! The filter of spheres, in `f32`: it rejects what the ray surely does not meet.

use glam::Vec3;

use super::vector::{dot, sum_abs};
use crate::math::float::sqrt32;
use crate::math::rounding::UNIT32;
use crate::ray::{PreparedRay, TINY};

/// One sphere in `f32`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SphereDetail {
    /// The two `t` in the frame, in order.
    pub t: [f32; 2],
    /// A bound on the error of both.
    pub t_error: f32,
    /// Whether the second of them is nearer to zero.
    pub far_is_nearest: bool,
}

/// Where the ray's line passes a sphere.
pub(super) struct Chord {
    /// From the centre to the origin.
    v: Vec3,
    /// `d . d` and `v . d`.
    a: f32,
    b: f32,
    /// The `t` of the point nearest the centre.
    pub middle: f32,
    /// A bound on the length of `v`.
    pub reach: f32,
    /// The square of half the chord.
    pub discriminant: f32,
    /// What the discriminant may be off.
    pub unsure: f32,
}

pub(super) fn chord(ray: &PreparedRay, centre: [f32; 3], r: f32) -> Chord {
    let d = Vec3::from_slice(&ray.direction);
    let v = Vec3::from_slice(&ray.origin) - Vec3::from(centre) * ray.scale;
    let (a, b) = (dot(d, d), dot(v, d));
    let middle = -(b / a);
    let l = v + d * middle;
    let (reach, near) = (sum_abs(v), sum_abs(l));
    let unsure = 32.0 * UNIT32 * near * reach
        + (16.0 * UNIT32 * reach) * (16.0 * UNIT32 * reach)
        + 16.0 * UNIT32 * (near * near + r * r)
        + TINY;
    Chord { v, a, b, middle, reach, discriminant: r * r - dot(l, l), unsure }
}

/// What the filter knows of a sphere, unless the ray surely does not meet it within its limits and up to the
/// bound.
///
/// The discriminant is taken at the point of the line nearest the centre, so that distance does not
/// spoil it. Conservative for every finite sphere and prepared ray. No operation is fused.
///
/// Source: \[HGA19\]; the bounds are those of the same computation in `f64`, with the unit of `f32`.
pub(crate) fn sphere(
    ray: &PreparedRay,
    t_bound: f32,
    centre: [f32; 3],
    radius: f32,
) -> Option<SphereDetail> {
    let r = radius * ray.scale;
    let Chord { v, a, b, middle, reach, discriminant, unsure } = chord(ray, centre, r);
    if discriminant < -unsure {
        return None;
    }
    // The line is inside for at most the radius on either side, as the direction is at least 1 long.
    let half = r * (1.0 + 8.0 * UNIT32) + 32.0 * UNIT32 * (reach + r) + TINY;
    if middle - half > t_bound || middle + half < ray.t_min {
        return None;
    }
    let half_chord = sqrt32(a * discriminant.max(0.0));
    let most = sqrt32(a * (discriminant + unsure));
    let least = sqrt32(a * (discriminant - unsure).max(0.0));
    // The larger root from the formula, in which nothing cancels, the smaller one from their product.
    let q = -(b + half_chord.copysign(b));
    let power = dot(v, v) - r * r;
    let (large, small) = if q == 0.0 { (0.0, 0.0) } else { (q / a, power / q) };
    // What rounding does to the product may not carry the root out of the sphere.
    let small = small.max(middle - half).min(middle + half);
    // Infinite where the line touches the sphere at its origin.
    let from_power = 16.0 * UNIT32 * (reach * reach + r * r) / q.abs();
    let t_error = (most - least) + 64.0 * UNIT32 * (reach + r) + from_power + TINY;
    Some(SphereDetail {
        t: if large < small { [large, small] } else { [small, large] },
        t_error,
        far_is_nearest: b > 0.0,
    })
}
