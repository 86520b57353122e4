//! A ray and a triangle in real arithmetic.

use core::cmp::Ordering;

use super::{Line, cross, difference, dot, given};
use crate::math::expansion::Expansion;
use crate::math::rounding::UNIT;

/// The volumes `d . (p x q)` over the edges opposite to the second, third and first vertex, half of
/// what the triangle test computes in `f64`.
pub(crate) fn volumes(ray: &Line, [a, b, c]: [[f32; 3]; 3]) -> [Expansion; 3] {
    let (o, d) = given(ray);
    let (ra, rb, rc) = (difference(a, o), difference(b, o), difference(c, o));
    [(&rc, &ra), (&ra, &rb), (&rb, &rc)].map(|(p, q)| dot(&d, &cross(p, q)))
}

/// The `t` of a plane as a quotient of real numbers, the divisor positive.
pub(crate) struct Quotient {
    pub dividend: Expansion,
    pub divisor: Expansion,
}

impl Quotient {
    /// The `t` at which the ray meets the plane of a triangle; `None` when it is parallel to it.
    pub fn new(ray: &Line, [a, b, c]: [[f32; 3]; 3]) -> Option<Self> {
        let (o, d) = given(ray);
        let n = cross(&difference(b, a), &difference(c, a));
        let (dividend, divisor) = (dot(&difference(a, o), &n), dot(&d, &n));
        match divisor.sign() {
            Ordering::Less => {
                Some(Quotient { dividend: dividend.negated(), divisor: divisor.negated() })
            }
            Ordering::Equal => None,
            Ordering::Greater => Some(Quotient { dividend, divisor }),
        }
    }

    /// The quotient in `f64`, and a bound on its error.
    pub fn approximate(&self) -> (f64, f64) {
        let t = self.dividend.approximate() / self.divisor.approximate();
        (t, 8.0 * UNIT * t.abs())
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
}

/// Whether the line comes from the side where the vertices run counter-clockwise.
pub(crate) fn faces(ray: &Line, [a, b, c]: [[f32; 3]; 3]) -> bool {
    let (_, d) = given(ray);
    dot(&d, &cross(&difference(b, a), &difference(c, a))).sign() == Ordering::Less
}

/// Whether the triangle has area.
pub(crate) fn has_area([a, b, c]: [[f32; 3]; 3]) -> bool {
    let n = cross(&difference(b, a), &difference(c, a));
    n.iter().any(|x| x.sign() != Ordering::Equal)
}
