//! A line and a triangle in real arithmetic.
//!
//! With points of `s` bits and a direction of `d`: differences stay below `2^(s + 1)`, the components of a
//! cross product of two below `2^(2 s + 3)`, its product with a third below `2^(3 s + 6)` and with the
//! direction below `2^(2 s + d + 5)`. At most `s = 278` and `d = 278`, for foreign bits as well.

use core::cmp::Ordering;

use super::units::{Binary, Unit, Units, cross, dot, is_short};
use super::{Line, Triangle};
use crate::math::float::power_of_two;
use crate::math::integer::{Integer, Number};
use crate::math::rounding::UNIT;

/// Holds everything of third degree: 840 bits.
type Third = Integer<14>;
/// Holds the products of two of them: 1680 bits. With a float, which has its own unit, `t` makes 1300.
type Sixth = Integer<27>;

/// The volumes `d . (p x q)` over the edges opposite to the second, third and first vertex, half of
/// what the triangle test computes in `f64`.
///
/// Exact in sign; in size within `1.001 UNIT` of the real one.
pub(crate) fn volumes(line: &Line, triangle: Triangle) -> [f64; 3] {
    let units = units(line, triangle);
    let Units { space, ahead } = units;
    let exponent = 2 * space.exponent + ahead.exponent;
    if is_short(2 * space.bits + ahead.bits + 5) {
        volumes_in::<i128>(units, line, triangle).map(|v| v.to_integer::<2>().approximate(exponent))
    } else {
        volumes_in::<Third>(units, line, triangle).map(|v| v.approximate(exponent))
    }
}

fn volumes_in<N: Number>(units: Units, line: &Line, triangle: Triangle) -> [N; 3] {
    let d = units.ahead.vector(line.direction);
    let [a, b, c] = triangle.map(|p| units.space.difference::<N>(p, line.origin));
    [(&c, &a), (&a, &b), (&b, &c)].map(|(p, q)| dot(&d, &cross(p, q)))
}

/// Whether the triangle has area.
pub(crate) fn has_area(triangle: Triangle) -> bool {
    let unit = Unit::of(&triangle);
    if is_short(2 * unit.bits + 3) {
        normal::<i128>(unit, triangle).iter().any(|x| *x != 0)
    } else {
        normal::<Third>(unit, triangle).iter().any(|x| x.sign() != Ordering::Equal)
    }
}

fn normal<N: Number>(unit: Unit, [a, b, c]: Triangle) -> [N; 3] {
    cross(&unit.difference(b, a), &unit.difference(c, a))
}

fn units(line: &Line, [a, b, c]: Triangle) -> Units {
    Units { space: Unit::of(&[line.origin, a, b, c]), ahead: Unit::of(&[line.direction]) }
}

/// The number `dividend / divisor * 2^exponent`, the divisor positive.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quotient {
    pub dividend: Third,
    pub divisor: Third,
    pub exponent: i32,
}

impl Quotient {
    /// The `t` at which the line meets the plane of a triangle; `None` when it is parallel to it.
    pub fn new(line: &Line, triangle: Triangle) -> Option<Self> {
        let units = units(line, triangle);
        let Units { space, ahead } = units;
        let bits = 2 * space.bits + 5 + ahead.bits.max(space.bits + 1);
        let [dividend, divisor] = if is_short(bits) {
            Self::parts::<i128>(units, line, triangle).map(|x| x.to_integer())
        } else {
            Self::parts::<Third>(units, line, triangle)
        };
        let exponent = units.of_t();
        match divisor.sign() {
            Ordering::Less => Some(Quotient { dividend: -dividend, divisor: -divisor, exponent }),
            Ordering::Equal => None,
            Ordering::Greater => Some(Quotient { dividend, divisor, exponent }),
        }
    }

    fn parts<N: Number>(units: Units, line: &Line, triangle: Triangle) -> [N; 2] {
        let n = normal::<N>(units.space, triangle);
        let to_plane = units.space.difference(triangle[0], line.origin);
        [dot(&to_plane, &n), dot(&units.ahead.vector(line.direction), &n)]
    }

    /// A float, or the middle of two.
    pub(super) fn float(Binary { mantissa, exponent }: Binary) -> Self {
        let whole = |x| Third::scaled(x, 0);
        Quotient { dividend: whole(mantissa), divisor: whole(1), exponent }
    }

    /// The quotient in `f64`, and a bound on its error.
    ///
    /// Dividend and divisor are off by `1.001 UNIT` each, and their quotient is rounded: below
    /// `3.01 UNIT`. The powers of two are exact: the dividend is below 2^840, the quotient of integers
    /// above 2^-840, and `t` between 2^-834 and 2^834.
    pub fn approximate(&self) -> (f64, f64) {
        let ratio = self.dividend.approximate(0) / self.divisor.approximate(0);
        let t = ratio * power_of_two(self.exponent);
        (t, 4.0 * UNIT * t.abs())
    }

    /// The order of two of them, on one line or on different ones: sixth degree.
    ///
    /// `t = N / D 2^e`, and `N D' 2^(e - e')` is compared with `N' D` or, when the exponent is
    /// negative, the other one shifted. In the unit `2^-149` all of this has at most 1680 bits, and in the
    /// larger units that are used here it is smaller by a power of two.
    pub fn compare(&self, other: &Quotient) -> Ordering {
        let (up, down) = shifts(self.exponent - other.exponent);
        let bits = |p: &Quotient, q: &Quotient, up| p.dividend.bits() + up + q.divisor.bits();
        if is_short(bits(self, other, up).max(bits(other, self, down)) + 1) {
            self.excess::<i128>(other, up, down).sign()
        } else {
            self.excess::<Sixth>(other, up, down).sign()
        }
    }

    fn excess<N: Number>(&self, other: &Quotient, up: u32, down: u32) -> N {
        let product =
            |p: &Quotient, q: &Quotient, up| N::of(&p.dividend).shifted(up) * N::of(&q.divisor);
        product(self, other, up) - product(other, self, down)
    }
}

/// The shifts that bring two numbers to one unit, when the first one's is `2^apart` of the second's.
pub(super) fn shifts(apart: i32) -> (u32, u32) {
    (apart.max(0) as u32, apart.min(0).unsigned_abs())
}
