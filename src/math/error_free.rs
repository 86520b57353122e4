//! Sums and products of two floats without error.
//!
//! Source: \[She97\]. Both hold in round-to-nearest while nothing over- or underflows.

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sum_is_its_two_parts() {
        assert_eq!(two_sum(1e30, 1.0), (1e30, 1.0));
        assert_eq!(two_sum(1.0, -1e30), (-1e30, 1.0));
        assert_eq!(two_sum(0.5, 0.25), (0.75, 0.0));
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
