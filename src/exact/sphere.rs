//! A line and a sphere in real arithmetic.
//!
//! `t` is a root of `a t^2 + 2 b t + c` with `a = d . d`, `b = (o - m) . d`, `c = |o - m|^2 - r^2`, each of second
//! degree in the given floats. With points of `s` bits and a direction of `d`: `a < 2^(2 d + 2)`,
//! `|b| < 2^(s + d + 3)`, `|c| < 2^(2 s + 4)`, and the discriminant `b^2 - a c` stays below `2^(2 s + 2 d + 7)`.

use core::cmp::Ordering;

use super::Line;
use super::triangle::{Quotient, shifts};
use super::units::{Unit, Units, dot, in_shortest, minus};
use crate::math::binary::Binary;
use crate::math::float::sqrt;
use crate::math::integer::{Integer, Number};
use crate::math::rounding::UNIT;

/// Holds everything of second degree: 560 bits.
pub(super) type Second = Integer<9>;
/// Holds everything of third degree: 840 bits.
type Third = Integer<14>;
/// Holds everything of fourth degree: 1119 bits.
type Fourth = Integer<18>;
/// Holds everything of eighth degree: 2243 bits.
pub(super) type Eighth = Integer<36>;

/// The two roots: where a line enters and leaves a sphere.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Roots {
    pub(super) a: Second,
    pub(super) b: Second,
    pub(super) c: Second,
    /// `b^2 - a c`, not negative.
    pub(super) discriminant: Fourth,
    /// The exponents of the units of space and of the direction.
    space: i32,
    ahead: i32,
}

impl Roots {
    /// The roots, or `None` when the line misses the sphere.
    pub fn new(line: &Line, centre: [f32; 3], radius: f32) -> Option<Self> {
        let space = Unit::of(&[line.origin, centre, [radius, 0.0, 0.0]]);
        let units = Units { space, ahead: Unit::of(&[line.direction]) };
        let ([a, b, c], discriminant) =
            in_shortest!(units.bits(2, 2, 7), Fourth, polynomial(units, line, centre, radius));
        let (space, ahead) = (space.exponent, units.ahead.exponent);
        let is_met = discriminant.sign() != Ordering::Less;
        is_met.then_some(Roots { a, b, c, discriminant, space, ahead })
    }

    /// Whether both roots are one.
    pub fn touch(&self) -> bool {
        self.discriminant.sign() == Ordering::Equal
    }

    /// Which root is nearer to zero: the entry, unless the middle of both is negative.
    pub fn nearest(&self) -> usize {
        usize::from(self.b.sign() == Ordering::Greater)
    }

    /// The exponent of the unit of `t`.
    pub fn exponent(&self) -> i32 {
        self.space - self.ahead
    }

    /// Both roots in `f64`, and bounds on their errors.
    ///
    /// The larger one comes from the formula, in which nothing cancels, the smaller one from their
    /// product. `a`, `b`, `c` and the discriminant are off by `1.001 UNIT` each; the square root by half of
    /// that and a rounding, the sum by `2.51 UNIT`, either root by `4.52 UNIT`. They are taken in their
    /// real size, between 2^-596 and 2^530, and their quotients lie between 2^-558 and 2^558.
    pub fn approximate(&self) -> [(f64, f64); 2] {
        let (a, c) = (self.a.approximate(2 * self.ahead), self.c.approximate(2 * self.space));
        let b = self.b.approximate(self.space + self.ahead);
        let root = sqrt(self.discriminant.approximate(2 * (self.space + self.ahead)));
        let q = -(b + root.copysign(b));
        let (large, small) = if q == 0.0 { (0.0, 0.0) } else { (q / a, c / q) };
        // Without a product there is one root twice, or one of them is zero.
        let small = if self.touch() { large } else { small };
        [large.min(small), large.max(small)].map(|t| (t, 5.0 * UNIT * t.abs()))
    }
}

/// The direction from the centre of a sphere to where the line enters (`root` 0) or leaves it, of any
/// length, each part of it within a few units of its length; zeros for a line that misses.
///
/// With `v` from the centre to the origin that is `(a v - b d) -+ sqrt(D) d`: across the line and along
/// it, neither of them longer than their sum. The first has third degree and is exact before it is rounded.
pub(crate) fn from_centre(line: &Line, centre: [f32; 3], radius: f32, root: usize) -> [f64; 3] {
    let space = Unit::of(&[line.origin, centre, [radius, 0.0, 0.0]]);
    let units = Units { space, ahead: Unit::of(&[line.direction]) };
    let Some(roots) = Roots::new(line, centre, radius) else { return [0.0; 3] };
    let across = in_shortest!(units.bits(1, 2, 6), Third, across(units, line, centre));
    let exponent = 2 * (roots.space + roots.ahead);
    let along = sqrt(roots.discriminant.approximate(exponent));
    let along = if root == 0 { -along } else { along };
    let ([x, y, z], [dx, dy, dz]) = (across, line.direction.map(f64::from));
    [x + along * dx, y + along * dy, z + along * dz]
}

/// `a v - b d`.
fn across<N: Number>(units: Units, line: &Line, centre: [f32; 3]) -> [f64; 3] {
    let d = units.ahead.count::<N>(line.direction);
    let v = minus(&units.space.count::<N>(line.origin), &units.space.count(centre));
    let (a, b) = (dot(&d, &d), dot(&v, &d));
    let exponent = units.space.exponent + 2 * units.ahead.exponent;
    let ([vx, vy, vz], [dx, dy, dz]) = (v, d);
    [a * vx - b * dx, a * vy - b * dy, a * vz - b * dz]
        .map(|number| number.to_integer::<14>().approximate(exponent))
}

/// One of two roots.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Root {
    pub roots: Roots,
    pub far: bool,
}

impl Root {
    /// `root` 0 where the line enters, 1 where it leaves; `None` when it misses.
    pub fn new(line: &Line, centre: [f32; 3], radius: f32, root: usize) -> Option<Self> {
        Some(Root { roots: Roots::new(line, centre, radius)?, far: root == 1 })
    }

    pub fn approximate(&self) -> (f64, f64) {
        self.roots.approximate()[usize::from(self.far)]
    }

    /// The order against a float, or the middle of two.
    pub fn compare_with_float(&self, x: Binary) -> Ordering {
        self.compare_with(&Quotient::float(x))
    }

    /// The order against the distance of a plane, eighth degree, or a float, fourth degree.
    ///
    /// `x = n / d 2^k` in the unit of the roots lies beyond the far one exactly when `a x^2 + 2 b x + c` and half
    /// its derivative, `a x + b`, are positive. Both are multiplied by powers of `d`, which is, and
    /// of two, so that no exponent is negative: `n` is shifted, or `b` once and `c` twice.
    pub fn compare_with(&self, x: &Quotient) -> Ordering {
        let Roots { a, b, c, .. } = &self.roots;
        let (up, down) = shifts(x.exponent - self.roots.exponent());
        let (n, d) = (x.dividend.bits() + up, x.divisor.bits());
        let (a, b, c) = (a.bits() + 2 * n, b.bits() + down + n + d, c.bits() + 2 * (down + d));
        let bits = a.max(b + 1).max(c) + 2;
        let [value, slope] = in_shortest!(bits, Eighth, signs_at(&self.roots, x, up, down));
        // Seen from the far root; the near one is its mirror image.
        let slope = if self.far { slope } else { slope.reverse() };
        let beyond = match (value, slope) {
            (Ordering::Greater, Ordering::Greater) => Ordering::Less,
            (Ordering::Equal, Ordering::Greater | Ordering::Equal) => Ordering::Equal,
            _ => Ordering::Greater,
        };
        if self.far { beyond } else { beyond.reverse() }
    }
}

/// `a`, `b` and `c`, and the discriminant.
fn polynomial<N: Number>(
    units: Units,
    line: &Line,
    centre: [f32; 3],
    radius: f32,
) -> ([Second; 3], Fourth) {
    let d = units.ahead.count::<N>(line.direction);
    let from_centre = minus(&units.space.count(line.origin), &units.space.count(centre));
    let r = N::count(radius, units.space.exponent);
    let (a, b) = (dot(&d, &d), dot(&from_centre, &d));
    let c = dot(&from_centre, &from_centre) - r * r;
    ([a, b, c].map(|x| x.to_integer()), (b * b - a * c).to_integer())
}

/// The signs of `a n^2 + 2 b n d + c d^2` and `a n + b d`.
fn signs_at<N: Number>(roots: &Roots, x: &Quotient, up: u32, down: u32) -> [Ordering; 2] {
    let (n, d) = (N::of(&x.dividend).shifted(up), N::of(&x.divisor));
    let an = N::of(&roots.a) * n;
    let bd = N::of(&roots.b).shifted(down) * d;
    let cd = N::of(&roots.c).shifted(2 * down) * d;
    let slope = an + bd;
    [(slope + bd) * n + cd * d, slope].map(|x| x.sign())
}
