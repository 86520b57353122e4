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

/// The exact sign of `terms[0] + terms[1] + ...`, as its order against zero.
pub(crate) fn sign_of_sum<const N: usize>(terms: [f64; N]) -> Ordering {
    // `row[.. i]` is a sum without overlap, ordered by size, equal to the first `i` terms.
    let mut row = [0.0; N];
    for (i, term) in terms.into_iter().enumerate() {
        let mut carried = term;
        for entry in &mut row[..i] {
            (carried, *entry) = two_sum(carried, *entry);
        }
        row[i] = carried;
    }
    // Entries do not overlap, so the last one that is not zero outweighs all before it.
    let largest = row.into_iter().rev().find(|x| *x != 0.0).unwrap_or(0.0);
    largest.partial_cmp(&0.0).unwrap_or(Ordering::Equal)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_rounding_loses_still_decides() {
        assert_eq!(sign_of_sum([1e30, 1.0, -1e30]), Ordering::Greater);
        assert_eq!(sign_of_sum([1e30, -1e-60, -1e30, 0.0]), Ordering::Less);
        assert_eq!(sign_of_sum([0.1, 0.2, -0.1, -0.2]), Ordering::Equal);
        assert_eq!(sign_of_sum([3.0, 1e-300, -2.0, -1.0]), Ordering::Greater);
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
