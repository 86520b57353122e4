//! A ray and a sphere in real arithmetic.
//!
//! `t` is a root of `a t^2 + 2 b t + c` with `a = d . d`, `b = (o - c) . d`, `c = |o - c|^2 - r^2`, each of second
//! degree in the given floats.

use core::cmp::Ordering;

use super::triangle::Quotient;
use super::{Line, difference, dot, given};
use crate::math::expansion::Expansion;
use crate::math::float::sqrt;
use crate::math::rounding::UNIT;

/// The two roots: where a ray's line enters and leaves a sphere.
#[derive(Clone, Copy)]
pub(crate) struct Roots {
    a: Expansion,
    b: Expansion,
    c: Expansion,
    /// `b^2 - a c`, not negative.
    discriminant: Expansion,
}

impl Roots {
    /// The roots, or `None` when the line misses the sphere.
    pub fn new(ray: &Line, centre: [f32; 3], radius: f32) -> Option<Self> {
        let (o, d) = given(ray);
        let from_centre = difference(o, centre);
        let (a, b) = (dot(&d, &d), dot(&from_centre, &d));
        let r = Expansion::difference(f64::from(radius), 0.0);
        let mut c = dot(&from_centre, &from_centre);
        c.add_product(&r, &r.negated());
        let discriminant = Expansion::cross(&b, &b, &a, &c);
        (discriminant.sign() != Ordering::Less).then_some(Roots { a, b, c, discriminant })
    }

    /// Whether both roots are one.
    pub fn touch(&self) -> bool {
        self.discriminant.sign() == Ordering::Equal
    }

    /// Which root is nearer to zero: the entry, unless the middle of both is negative.
    pub fn nearest(&self) -> usize {
        usize::from(self.b.sign() == Ordering::Greater)
    }

    /// Both roots in `f64`, and bounds on their errors. The larger one comes from the formula, in
    /// which nothing cancels, the smaller one from their product.
    pub fn approximate(&self) -> [(f64, f64); 2] {
        let (a, b, c) = (self.a.approximate(), self.b.approximate(), self.c.approximate());
        let q = -(b + sqrt(self.discriminant.approximate()).copysign(b));
        let (large, small) = if q == 0.0 { (0.0, 0.0) } else { (q / a, c / q) };
        // Without a product there is one root twice, or one of them is zero.
        let small = if self.touch() { large } else { small };
        [large.min(small), large.max(small)].map(|t| (t, 16.0 * UNIT * t.abs()))
    }
}

/// One of two roots.
pub(crate) struct Root {
    roots: Roots,
    far: bool,
}

impl Root {
    pub fn new(roots: Roots, root: usize) -> Self {
        Root { roots, far: root == 1 }
    }

    pub fn approximate(&self) -> (f64, f64) {
        self.roots.approximate()[usize::from(self.far)]
    }

    /// The order against a number at which the polynomial has the sign `value`, and half its
    /// derivative the sign `slope`.
    fn compare_by(&self, value: Ordering, slope: Ordering) -> Ordering {
        // Seen from the far root; the near one is its mirror image.
        let slope = if self.far { slope } else { slope.reverse() };
        let beyond = match (value, slope) {
            (Ordering::Greater, Ordering::Greater) => Ordering::Less,
            (Ordering::Equal, Ordering::Greater | Ordering::Equal) => Ordering::Equal,
            _ => Ordering::Greater,
        };
        if self.far { beyond } else { beyond.reverse() }
    }

    /// The order against a float of at most 48 bits: fourth degree.
    pub fn compare_with(&self, x: f64) -> Ordering {
        let one = Expansion::difference(1.0, 0.0);
        self.compare_with_ratio(&Expansion::difference(x, 0.0), &one)
    }

    /// The order against the distance of a plane: eighth degree.
    pub fn compare_with_quotient(&self, other: &Quotient) -> Ordering {
        self.compare_with_ratio(&other.dividend, &other.divisor)
    }

    /// The order against `n / d`, `d` positive: the signs of `a n^2 + 2 b n d + c d^2` and `a n + b d`.
    fn compare_with_ratio(&self, n: &Expansion, d: &Expansion) -> Ordering {
        let Roots { a, b, c, .. } = &self.roots;
        let mut slope = Expansion::ZERO;
        slope.add_product(a, n);
        slope.add_product(b, d);
        let (mut bd, mut cd) = (slope, Expansion::ZERO);
        bd.add_product(b, d);
        cd.add_product(c, d);
        let mut value = Expansion::ZERO;
        value.add_product(&bd, n);
        value.add_product(&cd, d);
        self.compare_by(value.sign(), slope.sign())
    }

    /// The order of two roots on one ray, which have `a` in common.
    ///
    /// That is the sign of `B + s sqrt(D) - s' sqrt(D')` with `B = b' - b`. Signs of sums with square roots
    /// follow from signs of squares, twice; the last is of eighth degree.
    pub fn compare(&self, other: &Root) -> Ordering {
        let sign = |root: &Root| if root.far { Ordering::Greater } else { Ordering::Less };
        let (p, q) = (&self.roots.discriminant, &other.roots.discriminant);
        let mut shift = other.roots.b;
        shift.add_all(&self.roots.b.negated());
        // The sign of s sqrt(D) - s' sqrt(D').
        let mut wider = *p;
        wider.add_all(&q.negated());
        let (s, t) = (self.signed(sign(self)), other.signed(sign(other)));
        let roots = match (s, t) {
            (s, t) if s != t => s.cmp(&t),
            (Ordering::Greater, _) => wider.sign(),
            (Ordering::Less, _) => wider.sign().reverse(),
            _ => Ordering::Equal,
        };
        match (shift.sign(), roots) {
            (b, Ordering::Equal) => b,
            (Ordering::Equal, r) => r,
            (b, r) if b == r => b,
            // Of different signs: the larger square wins.
            (b, r) => match self.compare_squares(other, &shift, s == t) {
                Ordering::Greater => b,
                Ordering::Less => r,
                Ordering::Equal => Ordering::Equal,
            },
        }
    }

    /// The sign of the root's square-root term: zero when the roots are one.
    fn signed(&self, sign: Ordering) -> Ordering {
        if self.roots.touch() { Ordering::Equal } else { sign }
    }

    /// The order of `B^2` and `(s sqrt(D) - s' sqrt(D'))^2`: the sign of `B^2 - D - D' +- 2 sqrt(D D')`.
    fn compare_squares(&self, other: &Root, shift: &Expansion, same: bool) -> Ordering {
        let (p, q) = (&self.roots.discriminant, &other.roots.discriminant);
        let mut rest = Expansion::ZERO;
        rest.add_product(shift, shift);
        rest.add_all(&p.negated());
        rest.add_all(&q.negated());
        let mixed = if same { Ordering::Greater } else { Ordering::Less };
        let mixed = if self.roots.touch() || other.roots.touch() { Ordering::Equal } else { mixed };
        match (rest.sign(), mixed) {
            (r, Ordering::Equal) => r,
            (Ordering::Equal, m) => m,
            (r, m) if r == m => r,
            (r, m) => {
                let four_p = p.scaled(4.0);
                match Expansion::cross(&rest, &rest, &four_p, q).sign() {
                    Ordering::Greater => r,
                    Ordering::Less => m,
                    Ordering::Equal => Ordering::Equal,
                }
            }
        }
    }
}
