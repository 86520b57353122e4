//! A line and a triangle in real arithmetic.
//!
//! With points of `s` bits and a direction of `d`: differences stay below `2^(s + 1)`, the components of a
//! cross product of two below `2^(2 s + 3)`, its product with a third below `2^(3 s + 6)` and with the
//! direction below `2^(2 s + d + 5)`. At most `s = 278` and `d = 278`, for foreign bits as well.

use core::cmp::Ordering;

use super::units::{Unit, Units, cross, dot, in_shortest, minus};
use super::{Line, Triangle};
use crate::math::binary::Binary;
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
pub(crate) fn volumes(line: &Line, triangle: &Triangle) -> [f64; 3] {
    let units = units(line, *triangle);
    in_shortest!(units.bits(2, 1, 5), Third, volumes_in(units, line, *triangle))
}

fn volumes_in<N: Number>(units: Units, line: &Line, [a, b, c]: Triangle) -> [f64; 3] {
    let (o, d) = (units.space.count::<N>(line.origin), units.ahead.count(line.direction));
    let from_origin = |p| minus(&units.space.count(p), &o);
    let (a, b, c) = (from_origin(a), from_origin(b), from_origin(c));
    let exponent = 2 * units.space.exponent + units.ahead.exponent;
    [(&c, &a), (&a, &b), (&b, &c)]
        .map(|(p, q)| dot(&d, &cross(p, q)).to_integer::<14>().approximate(exponent))
}

/// Whether the triangle has area.
pub(crate) fn has_area(triangle: Triangle) -> bool {
    let unit = Unit::of(&triangle);
    in_shortest!(2 * unit.bits + 3, Third, has_area_in(unit, triangle))
}

fn has_area_in<N: Number>(unit: Unit, [a, b, c]: Triangle) -> bool {
    let n = exact_normal::<N>(&unit.count(a), &unit.count(b), &unit.count(c));
    n.iter().any(|x| x.sign() != Ordering::Equal)
}

/// `(b - a) x (c - a)`, each component within `1.001 UNIT` of the real one.
pub(crate) fn normal(triangle: Triangle) -> [f64; 3] {
    let unit = Unit::of(&triangle);
    in_shortest!(2 * unit.bits + 3, Third, normal_in(unit, triangle))
}

fn normal_in<N: Number>(unit: Unit, [a, b, c]: Triangle) -> [f64; 3] {
    let n = exact_normal::<N>(&unit.count(a), &unit.count(b), &unit.count(c));
    n.map(|x| x.to_integer::<14>().approximate(2 * unit.exponent))
}

fn exact_normal<N: Number>(a: &[N; 3], b: &[N; 3], c: &[N; 3]) -> [N; 3] {
    cross(&minus(b, a), &minus(c, a))
}

fn units(line: &Line, [a, b, c]: Triangle) -> Units {
    Units { space: Unit::of(&[line.origin, a, b, c]), ahead: Unit::of(&[line.direction]) }
}

/// The dividend and the divisor of the `t` of a plane.
fn parts<N: Number>(units: Units, line: &Line, [a, b, c]: Triangle) -> [Third; 2] {
    let (o, d) = (units.space.count::<N>(line.origin), units.ahead.count(line.direction));
    let (a, b, c) = (units.space.count(a), units.space.count(b), units.space.count(c));
    let to_plane = minus(&a, &o);
    let n = exact_normal(&a, &b, &c);
    [dot(&to_plane, &n).to_integer(), dot(&d, &n).to_integer()]
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
        let bits = units.bits(2, 1, 5).max(units.bits(3, 0, 6));
        let [dividend, divisor] = in_shortest!(bits, Third, parts(units, line, triangle));
        let exponent = units.of_t();
        match divisor.sign() {
            Ordering::Less => Some(Quotient { dividend: -dividend, divisor: -divisor, exponent }),
            Ordering::Equal => None,
            Ordering::Greater => Some(Quotient { dividend, divisor, exponent }),
        }
    }

    /// A float, or the middle of two.
    pub(super) fn float(Binary { mantissa, exponent }: Binary) -> Self {
        let whole = |x| Third::scaled(x, 0);
        Quotient { dividend: whole(mantissa), divisor: whole(1), exponent }
    }

    /// The order against a float, or the middle of two.
    pub fn compare_with_float(&self, x: Binary) -> Ordering {
        self.compare(&Self::float(x))
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
        let bits = bits(self, other, up).max(bits(other, self, down)) + 1;
        in_shortest!(bits, Sixth, order(self, other, up, down))
    }
}

fn order<N: Number>(p: &Quotient, q: &Quotient, up: u32, down: u32) -> Ordering {
    let left = N::of(&p.dividend).shifted(up) * N::of(&q.divisor);
    let right = N::of(&q.dividend).shifted(down) * N::of(&p.divisor);
    (left - right).sign()
}

/// The shifts that bring two numbers to one unit, when the first one's is `2^apart` of the second's.
pub(super) fn shifts(apart: i32) -> (u32, u32) {
    (apart.max(0) as u32, apart.min(0).unsigned_abs())
}
