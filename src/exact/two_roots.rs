//! The order of two roots, of two spheres or of one.
//!
//! `t <=> t'` is the sign of `B + s sqrt(D) - s' sqrt(D')`. On one line both polynomials share `a`, and `B = b' - b`. On
//! two lines everything is multiplied by `a a'`: `B = a b' - a' b`, and the discriminants get `a'^2` and `a^2`.
//! Signs of sums with square roots follow from signs of squares, twice: eighth degree on one line,
//! sixteenth on two.

use core::cmp::Ordering;

use super::sphere::{Eighth, Root, Second};
use super::triangle::shifts;
use super::units::in_shortest;
use crate::math::integer::{Integer, Number};

/// Holds everything of sixteenth degree: 4475 bits.
type Sixteenth = Integer<70>;

/// A root, or a root times a positive number: `sign sqrt(discriminant) - b`.
struct Terms<N> {
    b: N,
    discriminant: N,
    /// Equal for a double root.
    sign: Ordering,
}

impl Root {
    /// The order of two roots, on one line or on different ones.
    pub fn compare(&self, other: &Root) -> Ordering {
        let (p, q) = (&self.roots, &other.roots);
        let (up, down) = shifts(p.exponent() - q.exponent());
        if (p.a - q.a).sign() != Ordering::Equal {
            return order::<Sixteenth>(self.terms(up, Some(&q.a)), other.terms(down, Some(&p.a)));
        }
        let b = (p.b.bits() + up).max(q.b.bits() + down);
        let d = (p.discriminant.bits() + 2 * up).max(q.discriminant.bits() + 2 * down);
        // The rest of `order` is a square of twice `b + 1` bits less two discriminants.
        let rest = (2 * b + 2).max(d + 1) + 1;
        let bits = (2 * rest).max(2 * d + 2) + 1;
        in_shortest!(bits, Eighth, order_on_one_line(self, other, up, down))
    }

    /// The terms in a unit that is smaller by `2^shift`, times `factor`.
    fn terms<N: Number>(&self, shift: u32, factor: Option<&Second>) -> Terms<N> {
        let sign = match (self.roots.touch(), self.far) {
            (true, _) => Ordering::Equal,
            (false, true) => Ordering::Greater,
            (false, false) => Ordering::Less,
        };
        let b = N::of(&self.roots.b).shifted(shift);
        let discriminant = N::of(&self.roots.discriminant).shifted(2 * shift);
        match factor.map(N::of) {
            None => Terms { b, discriminant, sign },
            Some(a) => Terms { b: b * a, discriminant: discriminant * a * a, sign },
        }
    }
}

fn order_on_one_line<N: Number>(p: &Root, q: &Root, up: u32, down: u32) -> Ordering {
    order::<N>(p.terms(up, None), q.terms(down, None))
}

/// The sign of `B + s sqrt(D) - s' sqrt(D')`.
fn order<N: Number>(p: Terms<N>, q: Terms<N>) -> Ordering {
    let shift = q.b - p.b;
    let wider = (p.discriminant - q.discriminant).sign();
    let roots = match (p.sign, q.sign) {
        (s, t) if s != t => s.cmp(&t),
        (Ordering::Greater, _) => wider,
        (Ordering::Less, _) => wider.reverse(),
        (Ordering::Equal, _) => Ordering::Equal,
    };
    sign_of_sum(shift.sign(), roots, || {
        // The order of `B^2` and `(s sqrt(D) - s' sqrt(D'))^2`: the sign of `B^2 - D - D' + 2 s s' sqrt(D D')`.
        let rest = shift * shift - p.discriminant - q.discriminant;
        let mixed = match (p.sign, q.sign) {
            (Ordering::Equal, _) | (_, Ordering::Equal) => Ordering::Equal,
            (s, t) if s == t => Ordering::Greater,
            _ => Ordering::Less,
        };
        sign_of_sum(rest.sign(), mixed, || {
            let product = p.discriminant * q.discriminant;
            (rest * rest - product.shifted(2)).sign()
        })
    })
}

/// The sign of a sum of two numbers of these signs; `sizes` orders the first one's size against the
/// second one's, and is asked only when they pull in different directions.
fn sign_of_sum(first: Ordering, second: Ordering, sizes: impl FnOnce() -> Ordering) -> Ordering {
    match (first, second) {
        (sign, Ordering::Equal) | (Ordering::Equal, sign) => sign,
        (p, q) if p == q => p,
        (p, q) => match sizes() {
            Ordering::Greater => p,
            Ordering::Less => q,
            Ordering::Equal => Ordering::Equal,
        },
    }
}
