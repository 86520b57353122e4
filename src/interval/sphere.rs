//! Ray against sphere: filters in `f64`, and real arithmetic where they are unsure.

use glam::DVec3;

use crate::exact::{self, Line, Roots};
use crate::math::error_free::{two_product, two_sum};
use crate::math::float::sqrt;
use crate::math::rounding::UNIT;
use crate::math::{sum_abs, wide};

/// Where a ray's line enters and leaves a sphere; `t[0] <= t[1]`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SphereMeeting {
    pub t: [f64; 2],
    pub t_error: [f64; 2],
    /// The root nearer to `t = 0`.
    pub nearest: usize,
    /// Whether both roots are one.
    pub touches: bool,
    /// Whether it took real arithmetic to know.
    pub exact: bool,
}

/// The meetings of the line with the sphere's surface, whatever their `t`.
///
/// Exact: hit or miss is that of real arithmetic, for all finite inputs, and each `t` is within its
/// error. The filter takes the discriminant at the point of the line nearest the centre, so that
/// distance does not spoil it; the larger root comes from the quadratic formula and the smaller
/// from their product, whose cancellation, when the line starts on the surface, is carried out in
/// twice the precision. What the filter cannot bound well is computed without error.
///
/// Source: \[HGA19\]; the bounds are derived in `docs/METHODS.md`.
pub(crate) fn meet(line: &Line, centre: [f32; 3], radius: f32) -> Option<SphereMeeting> {
    let (o, d) = (wide(line.origin), wide(line.direction));
    let r = f64::from(radius);
    let v = o - wide(centre);
    let (a, b, reach) = (d.length_squared(), v.dot(d), sum_abs(v));
    let (discriminant, unsure) = discriminant(v, d, r);
    if discriminant < -unsure {
        return None;
    }
    let difference_is_exact = (0..3).all(|k| two_sum(o[k], -f64::from(centre[k])).1 == 0.0);
    let b_error = 8.0 * UNIT * reach * sum_abs(d);
    let clear = difference_is_exact && unsure < discriminant / 1024.0 && b_error < b.abs() / 1024.0;
    if !clear {
        return exactly(line, centre, radius);
    }
    let half_chord = sqrt(a * discriminant);
    let q = -(b + half_chord.copysign(b));
    // Half of the discriminant's relative error, and a few roundings.
    let q_error = b_error + half_chord * (0.51 * unsure / discriminant + 8.0 * UNIT);
    let (power, power_error) = power(v, r);
    let (large, small) = (q / a, power / q);
    let large_error = q_error / a + 8.0 * UNIT * large.abs();
    let small_error =
        (power_error + small.abs() * q_error) / q.abs() * 1.01 + 2.0 * UNIT * small.abs();
    let backwards = large < small;
    Some(SphereMeeting {
        t: if backwards { [large, small] } else { [small, large] },
        t_error: if backwards { [large_error, small_error] } else { [small_error, large_error] },
        nearest: usize::from(b > 0.0),
        touches: false,
        exact: false,
    })
}

/// The square of half the chord, and what that may be off.
pub(super) fn discriminant(v: DVec3, d: DVec3, r: f64) -> (f64, f64) {
    let l = v - d * (v.dot(d) / d.length_squared());
    let (reach, near) = (sum_abs(v), sum_abs(l));
    let unsure = 32.0 * UNIT * near * reach
        + (16.0 * UNIT * reach) * (16.0 * UNIT * reach)
        + 16.0 * UNIT * (near * near + r * r);
    (r * r - l.length_squared(), unsure)
}

/// The same, computed without error and rounded.
fn exactly(line: &Line, centre: [f32; 3], radius: f32) -> Option<SphereMeeting> {
    let roots = Roots::new(line, centre, radius)?;
    let [(enter, enter_error), (leave, leave_error)] = roots.approximate();
    Some(SphereMeeting {
        t: [enter, leave],
        t_error: [enter_error, leave_error],
        nearest: roots.nearest(),
        touches: roots.touch(),
        exact: true,
    })
}

/// `|v|^2 - r^2`, the power of a point, in twice the precision, and a bound on its error.
fn power(v: DVec3, r: f64) -> (f64, f64) {
    let products =
        [two_product(v.x, v.x), two_product(v.y, v.y), two_product(v.z, v.z), two_product(-r, r)];
    let (mut high, mut low) = (0.0, 0.0);
    for (p, p_error) in products {
        let (sum, error) = two_sum(high, p);
        high = sum;
        low += error + p_error;
    }
    let size = v.length_squared() + r * r;
    let power = high + low;
    (power, 32.0 * UNIT * UNIT * size + UNIT * power.abs())
}

/// The outward unit normal where the line enters (`root` 0) or leaves the sphere, within a few units.
pub(crate) fn normal(line: &Line, centre: [f32; 3], radius: f32, root: usize) -> DVec3 {
    DVec3::from(exact::from_centre(line, centre, radius, root)).normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn roots(origin: [f32; 3], direction: [f32; 3], radius: f32) -> Option<[f64; 2]> {
        meet(&Line { origin, direction }, [0.0; 3], radius).map(|meeting| meeting.t)
    }

    #[test]
    fn both_roots_in_order_whatever_the_direction() {
        assert_eq!(roots([0.0, 0.0, 5.0], [0.0, 0.0, -2.0], 1.0), Some([2.0, 3.0]));
        assert_eq!(roots([0.0, 0.0, 5.0], [0.0, 0.0, 2.0], 1.0), Some([-3.0, -2.0]));
        assert_eq!(roots([0.0, 0.0, 0.5], [0.0, 0.0, 1.0], 1.0), Some([-1.5, 0.5]));
        assert_eq!(roots([0.0; 3], [0.0, 3.0, 4.0], 10.0), Some([-2.0, 2.0]));
    }

    #[test]
    fn a_tangent_touches_once() {
        assert_eq!(roots([1.0, 0.0, -3.0], [0.0, 0.0, 1.0], 1.0), Some([3.0, 3.0]));
        assert_eq!(roots([1.0, 0.0, 0.0], [0.0, 0.0, 1.0], 1.0), Some([0.0, 0.0]));
        assert_eq!(roots([1.0f32.next_up(), 0.0, -3.0], [0.0, 0.0, 1.0], 1.0), None);
    }

    #[test]
    fn a_ray_from_the_surface_keeps_its_small_root() {
        // On the surface up to rounding: the power of the point is about 1e-8, exactly known.
        let x = 0.6f32;
        let y = 0.8f32;
        let [near, far] = roots([x, y, 0.0], [1.0, 0.0, 0.0], 1.0).expect("a hit");
        let power = f64::from(x) * f64::from(x) + f64::from(y) * f64::from(y) - 1.0;
        let expected = -power / f64::from(x) / 2.0;
        let small = if far.abs() < near.abs() { far } else { near };
        assert!((small - expected).abs() < 1e-6 * expected.abs(), "{small} {expected}");
    }
}
