//! Ray against sphere in `f64`.

use glam::DVec3;

use crate::math::expansion::{two_product, two_sum};
use crate::math::float::sqrt;
use crate::math::rounding::UNIT;
use crate::math::wide;
use crate::ray::PreparedRay;

/// Where a ray's line enters and leaves a sphere; `t[0] <= t[1]`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SphereHit {
    pub t: [f64; 2],
    pub t_error: f64,
}

/// The meetings of the ray's line with the sphere's surface, whatever their `t`.
///
/// Best effort for this version: the discriminant is that of `f64` arithmetic, taken at the point
/// of the line nearest the centre so that distance does not spoil it. Of the two roots, the larger
/// comes from the quadratic formula and the smaller from their product, whose cancellation, when the
/// ray starts on the surface, is carried out in twice the precision.
///
/// Source: \[HGA19\].
pub(crate) fn intersect(ray: &PreparedRay, centre: [f32; 3], radius: f32) -> Option<SphereHit> {
    let d = ray.direction;
    let r = f64::from(radius);
    let to_origin = ray.origin - wide(centre);
    let a = d.length_squared();
    let b = to_origin.dot(d);
    let nearest = to_origin - d * (b / a);
    let discriminant = r * r - nearest.length_squared();
    // Written so that a NaN is a miss.
    if !(discriminant >= 0.0) {
        return None;
    }
    let half_chord = sqrt(a * discriminant);
    let q = -(b + half_chord.copysign(b));
    let product = power(to_origin, r);
    // With `q` zero the line touches the sphere at `t = 0`.
    let (far, near) = if q == 0.0 { (0.0, 0.0) } else { (q / a, product / q) };
    let length = sqrt(a);
    let size = nearest.length_squared() + r * r + 1e-9 * to_origin.length_squared();
    let t_error = 64.0 * UNIT * (size / (sqrt(discriminant) * length) + far.abs());
    let widest = sqrt(64.0 * UNIT * size) / length + 64.0 * UNIT * far.abs();
    Some(SphereHit { t: [near.min(far), near.max(far)], t_error: t_error.min(widest) })
}

/// `|v|^2 - r^2`, the power of a point, as if rounded from twice the precision.
fn power(v: DVec3, r: f64) -> f64 {
    let products =
        [two_product(v.x, v.x), two_product(v.y, v.y), two_product(v.z, v.z), two_product(-r, r)];
    let (mut high, mut low) = (0.0, 0.0);
    for (p, p_error) in products {
        let (sum, error) = two_sum(high, p);
        high = sum;
        low += error + p_error;
    }
    high + low
}

/// The outward unit normal at `point`, which lies on the sphere up to rounding.
pub(crate) fn surface_normal(point: DVec3, centre: [f32; 3]) -> DVec3 {
    (point - wide(centre)).normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ray::Ray;

    fn meet(origin: [f32; 3], direction: [f32; 3], radius: f32) -> Option<[f64; 2]> {
        let ray = Ray::new(origin, direction).prepare().expect("a valid ray");
        intersect(&ray, [0.0; 3], radius).map(|hit| hit.t)
    }

    #[test]
    fn both_roots_in_order_whatever_the_direction() {
        assert_eq!(meet([0.0, 0.0, 5.0], [0.0, 0.0, -2.0], 1.0), Some([2.0, 3.0]));
        assert_eq!(meet([0.0, 0.0, 5.0], [0.0, 0.0, 2.0], 1.0), Some([-3.0, -2.0]));
        assert_eq!(meet([0.0, 0.0, 0.5], [0.0, 0.0, 1.0], 1.0), Some([-1.5, 0.5]));
        assert_eq!(meet([0.0; 3], [0.0, 3.0, 4.0], 10.0), Some([-2.0, 2.0]));
    }

    #[test]
    fn a_tangent_touches_once() {
        assert_eq!(meet([1.0, 0.0, -3.0], [0.0, 0.0, 1.0], 1.0), Some([3.0, 3.0]));
        assert_eq!(meet([1.0, 0.0, 0.0], [0.0, 0.0, 1.0], 1.0), Some([0.0, 0.0]));
        assert_eq!(meet([1.0f32.next_up(), 0.0, -3.0], [0.0, 0.0, 1.0], 1.0), None);
    }

    #[test]
    fn a_ray_from_the_surface_keeps_its_small_root() {
        // On the surface up to rounding: the power of the point is about 1e-8, exactly known.
        let x = 0.6f32;
        let y = 0.8f32;
        let [near, far] = meet([x, y, 0.0], [1.0, 0.0, 0.0], 1.0).expect("a hit");
        let power = f64::from(x) * f64::from(x) + f64::from(y) * f64::from(y) - 1.0;
        let expected = -power / f64::from(x) / 2.0;
        let small = if far.abs() < near.abs() { far } else { near };
        assert!((small - expected).abs() < 1e-6 * expected.abs(), "{small} {expected}");
    }
}
