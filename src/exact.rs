//! Where a ray meets a triangle, in real arithmetic: what `f64` could not decide.
//!
//! Everything here is a polynomial in the given floats, evaluated without error \[She97\]: volumes are
//! of third degree, comparisons of two distances of sixth. A few microseconds each, on the stack.

use core::cmp::Ordering;

use crate::math::expansion::Expansion;
use crate::math::rounding::UNIT;
use crate::ray::PreparedRay;

type Vector = [Expansion; 3];

fn difference(p: [f32; 3], q: [f32; 3]) -> Vector {
    [0, 1, 2].map(|k| Expansion::difference(f64::from(p[k]), f64::from(q[k])))
}

fn cross(p: &Vector, q: &Vector) -> Vector {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| Expansion::cross(&p[i], &q[j], &p[j], &q[i]))
}

fn dot(p: &Vector, q: &Vector) -> Expansion {
    let mut sum = Expansion::ZERO;
    for k in 0..3 {
        sum.add_product(&p[k], &q[k]);
    }
    sum
}

/// Origin and direction as the floats they were given as.
fn given(ray: &PreparedRay) -> ([f32; 3], Vector) {
    let narrow = |v: glam::DVec3| v.to_array().map(|x| x as f32);
    (narrow(ray.origin), difference(narrow(ray.direction), [0.0; 3]))
}

/// The volumes `d . (p x q)` over the edges opposite to the second, third and first vertex, half of
/// what the triangle test computes in `f64`.
pub(crate) fn volumes(ray: &PreparedRay, [a, b, c]: [[f32; 3]; 3]) -> [Expansion; 3] {
    let (o, d) = given(ray);
    let (ra, rb, rc) = (difference(a, o), difference(b, o), difference(c, o));
    [(&rc, &ra), (&ra, &rb), (&rb, &rc)].map(|(p, q)| dot(&d, &cross(p, q)))
}

/// The `t` of a plane as a quotient of real numbers, the divisor positive.
pub(crate) struct Quotient {
    dividend: Expansion,
    divisor: Expansion,
}

impl Quotient {
    /// The `t` at which the ray meets the plane of a triangle that it is not parallel to.
    pub fn new(ray: &PreparedRay, [a, b, c]: [[f32; 3]; 3]) -> Self {
        let (o, d) = given(ray);
        let n = cross(&difference(b, a), &difference(c, a));
        let (dividend, divisor) = (dot(&difference(a, o), &n), dot(&d, &n));
        if divisor.sign() == Ordering::Less {
            Quotient { dividend: dividend.negated(), divisor: divisor.negated() }
        } else {
            Quotient { dividend, divisor }
        }
    }

    /// The nearest floats of `f64`, nearly, and a bound on the error; `None` for a parallel ray.
    pub fn approximate(&self) -> Option<(f64, f64)> {
        if self.divisor.sign() == Ordering::Equal {
            return None;
        }
        let t = self.dividend.approximate() / self.divisor.approximate();
        Some((t, 8.0 * UNIT * t.abs()))
    }

    /// The order of two of them.
    pub fn compare(&self, other: &Quotient) -> Ordering {
        Expansion::cross(&self.dividend, &other.divisor, &other.dividend, &self.divisor).sign()
    }

    /// The order against a float of at most 48 bits.
    pub fn compare_with(&self, x: f64) -> Ordering {
        let x = Expansion::difference(x, 0.0);
        let one = Expansion::difference(1.0, 0.0);
        Expansion::cross(&self.dividend, &one, &x, &self.divisor).sign()
    }

    /// The nearest `f32`, ties to even.
    pub fn round(&self) -> f32 {
        // Right but for the last step, since the quotient of `f64` is.
        let near = self.approximate().map_or(0.0, |(t, _)| t as f32);
        let is_odd = near.to_bits() & 1 == 1;
        let below = self.compare_with(midpoint(near.next_down(), near));
        let above = self.compare_with(midpoint(near, near.next_up()));
        if below == Ordering::Less || (below == Ordering::Equal && is_odd) {
            near.next_down()
        } else if above == Ordering::Greater || (above == Ordering::Equal && is_odd) {
            near.next_up()
        } else {
            near
        }
    }
}

/// The middle of two neighbours; beyond the largest float, where its next neighbour would be.
fn midpoint(a: f32, b: f32) -> f64 {
    const BEYOND: f64 = 2.0 * (1u128 << 127) as f64;
    let finite = |x: f32| {
        if x.is_finite() { f64::from(x) } else { BEYOND.copysign(f64::from(x)) }
    };
    (finite(a) + finite(b)) / 2.0
}

/// Whether the triangle has area.
pub(crate) fn has_area([a, b, c]: [[f32; 3]; 3]) -> bool {
    let n = cross(&difference(b, a), &difference(c, a));
    n.iter().any(|x| x.sign() != Ordering::Equal)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ray::Ray;

    fn quotient(z: f32, slope: f32) -> Quotient {
        let triangle = [[0.0, 0.0, z], [1.0, 0.0, z + slope], [0.0, 1.0, z]];
        let ray = Ray::new([0.0; 3], [0.0, 0.0, 3.0]).prepare().expect("a valid ray");
        Quotient::new(&ray, triangle)
    }

    #[test]
    fn thirds_are_ordered_and_rounded() {
        let third = quotient(1.0, 0.0);
        assert_eq!(third.compare(&quotient(1.0, 0.5)), Ordering::Equal);
        assert_eq!(third.compare(&quotient(1.0f32.next_up(), 0.5)), Ordering::Less);
        assert_eq!(third.compare_with(1.0 / 3.0), Ordering::Greater);
        assert_eq!(third.round(), 1.0 / 3.0);
    }

    #[test]
    fn midpoints_go_to_even() {
        // 3 t = z, with t in the middle of two floats.
        let t = 1.0 + f64::from(f32::EPSILON) / 2.0;
        let ray = Ray::new([0.0; 3], [0.0, 0.0, 1.0]).prepare().expect("a valid ray");
        let far = Ray { origin: [0.0, 0.0, -1.0], ..Ray::new([0.0; 3], [0.0, 0.0, 1.0]) };
        let far = far.prepare().expect("a valid ray");
        let z = (t - 1.0) as f32;
        let triangle = [[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]];
        assert_eq!(Quotient::new(&far, triangle).compare_with(t), Ordering::Equal);
        assert_eq!(Quotient::new(&far, triangle).round(), 1.0);
        assert_eq!(Quotient::new(&ray, triangle).round(), z);
        let beside = triangle.map(|[x, y, z]| [x, y, z.next_up()]);
        assert_eq!(Quotient::new(&far, beside).round(), 1.0f32.next_up());
    }
}
