//! Sums and products of floats without error, as pairs or rows of floats.
//!
//! Source: \[She97\]. All of it holds in round-to-nearest while nothing over- or underflows; the
//! inputs here are products of a few `f32`, between 1e-180 and 1e154, which is far inside `f64`.

use core::cmp::Ordering;

/// `(s, e)` with `s + e == a + b` exactly and `s` the rounded sum.
pub(crate) fn two_sum(a: f64, b: f64) -> (f64, f64) {
    let s = a + b;
    let b_seen = s - a;
    let a_seen = s - b_seen;
    (s, (a - a_seen) + (b - b_seen))
}

/// `(p, e)` with `p + e == a * b` exactly and `p` the rounded product.
pub(crate) fn two_product(a: f64, b: f64) -> (f64, f64) {
    let p = a * b;
    let (a_high, a_low) = split(a);
    let (b_high, b_low) = split(b);
    let e = a_low * b_low - (((p - a_high * b_high) - a_low * b_high) - a_high * b_low);
    (p, e)
}

/// `a` as a sum of two floats of at most 26 bits each.
fn split(a: f64) -> (f64, f64) {
    const SHIFT: f64 = (1u64 << 27) as f64 + 1.0;
    let c = SHIFT * a;
    let high = c - (c - a);
    (high, a - high)
}

/// A real number as a sum of floats that do not overlap, the smallest first.
///
/// Holds every polynomial of up to sixth degree in `f32`s, whatever their exponents: such a number is
/// a multiple of 2^-894 and below 2^776, so no term underflows or overflows, and 1670 bits are 32
/// terms once they are packed tightly. Of eighth degree it holds those in floats that are zero or
/// between 2^-110 and 2^120: multiples of 2^-1072, below 2^970, 39 terms.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Expansion {
    terms: [f64; CAPACITY],
    count: usize,
}

/// Room for 32 tight terms and for what gathers until they are packed again.
const CAPACITY: usize = 48;

impl Expansion {
    pub const ZERO: Expansion = Expansion { terms: [0.0; CAPACITY], count: 0 };

    /// `a - b`.
    pub fn difference(a: f64, b: f64) -> Self {
        let mut difference = Expansion::ZERO;
        difference.add(a);
        difference.add(-b);
        difference
    }

    /// Adds one float.
    pub fn add(&mut self, x: f64) {
        if self.count == CAPACITY {
            self.pack();
        }
        let (mut carried, mut kept) = (x, 0);
        for i in 0..self.count {
            let (sum, rest) = two_sum(carried, self.terms[i]);
            carried = sum;
            kept = self.keep(kept, rest);
        }
        self.count = self.keep(kept, carried);
    }

    /// Adds `a * b`.
    pub fn add_product(&mut self, a: &Expansion, b: &Expansion) {
        for x in a.terms() {
            for y in b.terms() {
                let (product, rest) = two_product(*x, *y);
                self.add(rest);
                self.add(product);
            }
        }
    }

    /// `a * b - c * d`.
    pub fn cross(a: &Expansion, b: &Expansion, c: &Expansion, d: &Expansion) -> Self {
        let mut cross = Expansion::ZERO;
        cross.add_product(a, b);
        cross.add_product(&c.negated(), d);
        cross
    }

    /// Adds another number.
    pub fn add_all(&mut self, other: &Expansion) {
        other.terms().iter().for_each(|x| self.add(*x));
    }

    /// The number times a power of two.
    pub fn scaled(&self, power: f64) -> Self {
        Expansion { terms: self.terms.map(|x| x * power), count: self.count }
    }

    pub fn negated(&self) -> Self {
        Expansion { terms: self.terms.map(|x| -x), count: self.count }
    }

    /// The order of the number against zero.
    pub fn sign(&self) -> Ordering {
        // Terms do not overlap, so the last one outweighs all before it.
        let largest = self.terms().last().copied().unwrap_or(0.0);
        largest.partial_cmp(&0.0).unwrap_or(Ordering::Equal)
    }

    /// The number within one unit in the last place.
    pub fn approximate(&self) -> f64 {
        self.terms().iter().sum()
    }

    fn terms(&self) -> &[f64] {
        &self.terms[..self.count]
    }

    /// Writes `x` at place `kept` unless it is zero; returns the next free place. There always is
    /// room for numbers; only what is infinite or NaN, from a block of foreign bytes, finds none.
    fn keep(&mut self, kept: usize, x: f64) -> usize {
        match self.terms.get_mut(kept) {
            Some(term) if x != 0.0 => {
                *term = x;
                kept + 1
            }
            _ => kept,
        }
    }

    /// Packs the bits into as few terms as hold them, each at least 53 bits below the next.
    fn pack(&mut self) {
        // Downwards, each sum takes in all that it can; what it cannot is carried on.
        let mut bottom = self.count;
        let mut carried = 0.0;
        for i in (0..self.count).rev() {
            let (sum, rest) = two_sum(carried, self.terms[i]);
            carried = if rest == 0.0 {
                sum
            } else {
                bottom -= 1;
                self.terms[bottom] = sum;
                rest
            };
        }
        // Upwards again, which brings the terms to the front.
        let (top, mut kept) = (self.count, 0);
        for i in bottom..top {
            let (sum, rest) = two_sum(self.terms[i], carried);
            carried = sum;
            kept = self.keep(kept, rest);
        }
        self.count = self.keep(kept, carried);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    fn sum(terms: &[f64]) -> Expansion {
        let mut sum = Expansion::ZERO;
        terms.iter().for_each(|x| sum.add(*x));
        sum
    }

    #[test]
    fn what_rounding_loses_still_decides() {
        assert_eq!(sum(&[1e30, 1.0, -1e30]).sign(), Ordering::Greater);
        assert_eq!(sum(&[1e30, -1e-60, -1e30, 0.0]).sign(), Ordering::Less);
        assert_eq!(sum(&[0.1, 0.2, -0.1, -0.2]).sign(), Ordering::Equal);
        assert_eq!(sum(&[3.0, 1e-300, -2.0, -1.0]).sign(), Ordering::Greater);
        assert_eq!(sum(&[1e30, 0.5, -1e30]).approximate(), 0.5);
    }

    #[test]
    fn more_terms_than_fit_are_packed() {
        // Single bits, 16 apart: they do not overlap, and there are more than fit unpacked.
        let bits: Vec<f64> = (-50..50).map(|i| 2f64.powi(16 * i)).collect();
        let mut number = sum(&bits);
        assert!(number.count <= CAPACITY);
        bits.iter().rev().for_each(|x| number.add(-x));
        assert_eq!(number.sign(), Ordering::Equal);
        assert_eq!(number.count, 0);
    }

    #[test]
    fn sixth_degree_of_the_extremes_is_exact() {
        // (a^3)(b^3) - (b^3)(a^3) cancels, and one unit of the least size tips it.
        let (a, b) = (f64::from(f32::from_bits(1)), f64::from(f32::MAX));
        let cube = |x: f64, y: f64| {
            let (x, y) = (sum(&[x]), Expansion::difference(y, x));
            let mut square = Expansion::ZERO;
            square.add_product(&y, &y);
            let mut cube = Expansion::ZERO;
            cube.add_product(&square, &x);
            cube.add_product(&square, &y);
            cube
        };
        let (p, q) = (cube(a, b), cube(b, a));
        let mut number = Expansion::cross(&p, &q, &q, &p);
        assert_eq!(number.sign(), Ordering::Equal);
        number.add(a.powi(6));
        assert_eq!(number.sign(), Ordering::Greater);
        let smallest = cube(a, 2.0 * a);
        assert_eq!(smallest.approximate(), 2.0 * a.powi(3));
    }

    #[test]
    fn a_product_is_its_two_parts() {
        // (1 + 2^-30)^2 = 1 + 2^-29 + 2^-60, of which one float holds all but the last term.
        let a = 1.0 + 2f64.powi(-30);
        assert_eq!(two_product(a, a), (1.0 + 2f64.powi(-29), 2f64.powi(-60)));
        let (p, e) = two_product(f64::from(0.1f32), 1.0 / 3.0);
        assert!(p != 0.0 && e.abs() <= p * f64::EPSILON);
    }
}
