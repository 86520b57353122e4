//! A line and a triangle in real arithmetic, for processors of 32 bits: what [`triangle`](super::triangle) does, in a fraction
//! of its code and stack. Numbers have no units here, but one fixed point, and are computed when they are asked for.
//!
//! With `ring(x; p, q, r) = x . (p x q + q x r + r x p)`, all that is asked is a sum of rings: the normal of a triangle
//! is what is in brackets, and `(p - o) x (q - o) = p x q + q x o + o x p`.

use core::cmp::Ordering;

use super::{Distance, Line, Meeting, Triangle, between, sphere, triangle};
use crate::kinds::SPHERES;
use crate::math::binary::Binary;
use crate::math::fixed::{Fixed, Product};
use crate::math::rounding::UNIT;

/// Adds `x . (p x q)`, or subtracts it.
#[inline(never)]
fn add_volume(sum: &mut Fixed, x: &[f32; 3], p: &[f32; 3], q: &[f32; 3], minus: bool) {
    let ([x, y, z], [px, py, pz], [qx, qy, qz]) = (x, p, q);
    let mut add = |x: &f32, p: &f32, q: &f32, minus| sum.add_product(x, p, q, minus);
    add(x, py, qz, minus);
    add(x, pz, qy, !minus);
    add(y, pz, qx, minus);
    add(y, px, qz, !minus);
    add(z, px, qy, minus);
    add(z, py, qx, !minus);
}

/// Adds a ring, or subtracts it. In line: numbers that are summed up lie deep in the stack.
#[inline(always)]
fn add_ring(sum: &mut Fixed, x: &[f32; 3], [p, q, r]: [&[f32; 3]; 3], minus: bool) {
    add_volume(sum, x, p, q, minus);
    add_volume(sum, x, q, r, minus);
    add_volume(sum, x, r, p, minus);
}

/// A ring in `f64`, within `1.001 UNIT`; its sign is exact.
#[inline(never)]
fn ring(x: &[f32; 3], [p, q, r]: [&[f32; 3]; 3]) -> f64 {
    let mut sum = Fixed::ZERO;
    add_ring(&mut sum, x, [p, q, r], false);
    sum.approximate()
}

/// See [`triangle::volumes`]: exact in sign, and in size within `1.001 UNIT`.
#[inline(never)]
pub(crate) fn volumes(Line { origin, direction }: &Line, [a, b, c]: &Triangle) -> [f64; 3] {
    [
        ring(direction, [c, a, origin]),
        ring(direction, [a, b, origin]),
        ring(direction, [b, c, origin]),
    ]
}

/// See [`triangle::normal`]: each component within `1.001 UNIT` of the real one.
pub(crate) fn normal([a, b, c]: Triangle) -> [f64; 3] {
    AXES.map(|axis| ring(&axis, [&a, &b, &c]))
}

const AXES: [[f32; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Whether the triangle has area.
#[inline(never)]
pub(crate) fn has_area([a, b, c]: Triangle) -> bool {
    AXES.iter().any(|axis| ring(axis, [&a, &b, &c]) != 0.0)
}

/// The `t` at which a line meets the plane of a triangle that it is not parallel to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quotient {
    line: Line,
    triangle: Triangle,
}

impl Quotient {
    /// The `t` at which the line meets the plane of a triangle; `None` when it is parallel to it.
    pub fn new(line: &Line, triangle: Triangle) -> Option<Self> {
        Parts::new(line, &triangle)?;
        Some(Quotient { line: *line, triangle })
    }

    /// The same number as one of the large quotients.
    fn long(&self) -> triangle::Quotient {
        // It exists: this was made only if the line is not parallel.
        triangle::Quotient::new(&self.line, self.triangle)
            .unwrap_or_else(|| triangle::Quotient::float(Binary::of(0.0)))
    }

    fn parts(&self) -> Parts<'_> {
        Parts::Of(&self.line, &self.triangle)
    }

    /// The quotient in `f64`, and a bound on its error.
    ///
    /// Dividend and divisor are off by `1.001 UNIT` each, and their quotient is rounded: below
    /// `3.01 UNIT`. Both are between 2^-447 and 2^392 in size, far from the ends of `f64`.
    pub fn approximate(&self) -> (f64, f64) {
        self.parts().size()
    }

    /// The order of two of them, on one line or on different ones.
    pub fn compare(&self, other: &Quotient) -> Ordering {
        self.parts().compare(&other.parts())
    }

    /// The order against a float, or the middle of two.
    pub fn compare_with_float(&self, x: Binary) -> Ordering {
        self.parts().compare(&Parts::Float(x))
    }
}

/// What a dividend and a divisor are computed from, each when it is asked for: those of a [`Quotient`], or of a float.
enum Parts<'a> {
    Of(&'a Line, &'a Triangle),
    Float(Binary),
}

/// See [`super::order`]: what is lent is not copied.
#[cfg_attr(target_pointer_width = "64", allow(dead_code, reason = "tested there"))]
#[inline]
pub(crate) fn order(line: &Line, one: &Meeting, other: &Meeting) -> Option<Ordering> {
    match (one, other) {
        (Meeting::Triangle(one), Meeting::Triangle(other)) => {
            Some(Parts::new(line, one)?.compare(&Parts::new(line, other)?))
        }
        _ if !SPHERES => None,
        _ => Some(Distance::new(line, one)?.compare(&Distance::new(line, other)?)),
    }
}

/// See [`super::is_within`]: likewise.
#[cfg_attr(target_pointer_width = "64", allow(dead_code, reason = "tested there"))]
#[inline]
pub(crate) fn is_within(line: &Line, meeting: &Meeting, limits: [f32; 2]) -> bool {
    match meeting {
        Meeting::Triangle(corners) => Parts::new(line, corners)
            .is_some_and(|t| between(limits, |limit| t.compare(&Parts::Float(limit)))),
        _ if !SPHERES => false,
        _ => Distance::new(line, meeting).is_some_and(|t| t.is_within(limits)),
    }
}

/// See [`super::to_plane`]: likewise.
#[cfg_attr(target_pointer_width = "64", allow(dead_code, reason = "tested there"))]
pub(crate) fn to_plane(line: &Line, triangle: &Triangle) -> Option<(f64, f64)> {
    Some(Parts::new(line, triangle)?.size())
}

impl<'a> Parts<'a> {
    /// Those of a line and the plane of a triangle; `None` when these are parallel.
    fn new(line: &'a Line, triangle: &'a Triangle) -> Option<Self> {
        let [a, b, c] = triangle;
        let is_parallel = ring(&line.direction, [a, b, c]) == 0.0;
        (!is_parallel).then_some(Parts::Of(line, triangle))
    }

    /// Adds `(a - origin) . n` to zero.
    #[inline(never)]
    fn add_dividend(&self, sum: &mut Fixed) {
        match self {
            Parts::Float(x) => sum.add_float(*x),
            Parts::Of(line, corners) => {
                let [a, b, c] = corners;
                add_volume(sum, a, b, c, false);
                add_ring(sum, &line.origin, [a, b, c], true);
            }
        }
    }

    /// Adds `direction . n` to zero.
    #[inline(never)]
    fn add_divisor(&self, sum: &mut Fixed) {
        match self {
            Parts::Float(_) => sum.add_float(Binary { mantissa: 1, exponent: 0 }),
            Parts::Of(line, [a, b, c]) => add_ring(sum, &line.direction, [a, b, c], false),
        }
    }

    /// See [`Quotient::approximate`].
    fn size(&self) -> (f64, f64) {
        let t = self.approximate(false) / self.approximate(true);
        (t, 4.0 * UNIT * t.abs())
    }

    /// The dividend or the divisor in `f64`, within `1.001 UNIT`. One at a time is on the stack.
    #[inline(never)]
    fn approximate(&self, divisor: bool) -> f64 {
        let mut sum = Fixed::ZERO;
        if divisor {
            self.add_divisor(&mut sum)
        } else {
            self.add_dividend(&mut sum)
        }
        sum.approximate()
    }

    /// The order of two quotients: `N / D` and `N' / D'` are in the order of `N D'` and `N' D`, of sixth degree, or in the
    /// other one if `D` and `D'` are of different signs.
    #[inline(never)]
    fn compare(&self, other: &Parts) -> Ordering {
        let mut difference = Product::ZERO;
        let [n, e] = self.add_sizes(other, &mut difference);
        // With all bits flipped, `-1 - x` becomes `-1 - x + y`, and then `x - y`.
        difference.flip();
        let [m, d] = other.add_sizes(self, &mut difference);
        difference.flip();
        let order = (n * e).cmp(&(m * d)).then_with(|| match n * e {
            0.. => difference.sign(),
            _ => difference.sign().reverse(),
        });
        if d == e { order } else { order.reverse() }
    }

    /// Adds the product of the sizes of the own dividend and the other's divisor, and says what their signs are.
    #[inline(never)]
    fn add_sizes(&self, other: &Parts, product: &mut Product) -> [i32; 2] {
        let (mut dividend, mut divisor) = (Fixed::ZERO, Fixed::ZERO);
        self.add_dividend(&mut dividend);
        other.add_divisor(&mut divisor);
        let signs = [dividend.take_sign() as i32, divisor.take_sign() as i32];
        product.add(&dividend, &divisor);
        signs
    }
}

/// The `t` at which a line enters a sphere or leaves it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Root {
    line: Line,
    centre: [f32; 3],
    radius: f32,
    root: usize,
}

impl Root {
    /// `None` when the line misses the sphere.
    pub fn new(line: &Line, centre: [f32; 3], radius: f32, root: usize) -> Option<Self> {
        sphere::Root::new(line, centre, radius, root)?;
        Some(Root { line: *line, centre, radius, root })
    }

    pub fn approximate(&self) -> (f64, f64) {
        self.long().map_or((0.0, 0.0), |t| t.approximate())
    }

    /// See [`sphere::Root::compare_with`].
    pub fn compare_with(&self, x: &Quotient) -> Ordering {
        self.long().map_or(Ordering::Equal, |t| t.compare_with(&x.long()))
    }

    /// The order against a float, or the middle of two.
    pub fn compare_with_float(&self, x: Binary) -> Ordering {
        self.long().map_or(Ordering::Equal, |t| t.compare_with_float(x))
    }

    /// The order of two roots, on one line or on different ones.
    pub fn compare(&self, other: &Root) -> Ordering {
        self.long().zip(other.long()).map_or(Ordering::Equal, |(p, q)| p.compare(&q))
    }

    /// The same number with its polynomial; it exists, as for [`Quotient::long`].
    fn long(&self) -> Option<sphere::Root> {
        sphere::Root::new(&self.line, self.centre, self.radius, self.root)
    }
}
