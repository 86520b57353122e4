//! Exact sums and products of floats.

use std::cmp::Ordering;
use std::ops::{Add, Mul, Neg, Sub};

use num_bigint::{BigInt, Sign};

/// The number `mantissa * 2^exponent`, of any size. Every finite float is one.
#[derive(Clone, Debug)]
pub struct Dyadic {
    mantissa: BigInt,
    exponent: i32,
}

impl Dyadic {
    /// Zero.
    pub fn zero() -> Self {
        Dyadic { mantissa: BigInt::ZERO, exponent: 0 }
    }

    /// The very value of `x`.
    ///
    /// # Panics
    ///
    /// When `x` is not finite.
    pub fn from_f32(x: f32) -> Self {
        assert!(x.is_finite(), "{x} is no number");
        let bits = x.to_bits();
        let (field, fraction) = ((bits >> 23 & 0xff) as i32, i64::from(bits & 0x7f_ffff));
        let magnitude = if field == 0 { fraction } else { fraction | 0x80_0000 };
        let exponent = field.max(1) - 150;
        if magnitude == 0 {
            return Self::zero();
        }
        // Odd mantissas keep the products short.
        let spare = magnitude.trailing_zeros();
        let signed = if x < 0.0 { -magnitude } else { magnitude };
        Dyadic { mantissa: BigInt::from(signed >> spare), exponent: exponent + spare as i32 }
    }

    /// The very value of `x`.
    ///
    /// # Panics
    ///
    /// When `x` is not finite.
    pub fn from_f64(x: f64) -> Self {
        assert!(x.is_finite(), "{x} is no number");
        let bits = x.to_bits();
        let (field, fraction) = ((bits >> 52 & 0x7ff) as i32, (bits & ((1 << 52) - 1)) as i64);
        let magnitude = if field == 0 { fraction } else { fraction | 1 << 52 };
        let signed = if x < 0.0 { -magnitude } else { magnitude };
        Dyadic { mantissa: BigInt::from(signed), exponent: field.max(1) - 1075 }
    }

    /// Half of it.
    pub fn half(mut self) -> Self {
        self.exponent -= 1;
        self
    }

    /// -1, 0 or 1.
    pub fn sign(&self) -> i32 {
        match self.mantissa.sign() {
            Sign::Minus => -1,
            Sign::NoSign => 0,
            Sign::Plus => 1,
        }
    }

    /// `x` and `n` with `|value - x * 2^n| <= 2^-60 |value|` and `1 <= |x| < 2`, or zeros.
    fn scaled(&self) -> (f64, i32) {
        let bits = self.mantissa.bits() as i32;
        if bits == 0 {
            return (0.0, 0);
        }
        let drop = (bits - 63).max(0);
        let top = i64::try_from(&self.mantissa >> drop).expect("63 bits and a sign") as f64;
        let scale = 2f64.powi(1 - bits + drop);
        (top * scale, self.exponent + bits - 1)
    }

    /// Roughly `self / divisor`, for numbers far beyond the range of `f64` as well.
    pub fn ratio(&self, divisor: &Dyadic) -> f64 {
        let ((p, m), (q, n)) = (self.scaled(), divisor.scaled());
        ldexp(p / q, m - n)
    }

    /// Roughly the square root; zero for what is negative.
    pub fn sqrt_ratio(&self, divisor: &Dyadic) -> f64 {
        let ((p, m), (q, n)) = (self.scaled(), divisor.scaled());
        let half = (m - 2 * n).div_euclid(2);
        let odd = (m - 2 * n).rem_euclid(2);
        ldexp((p.max(0.0) * 2f64.powi(odd)).sqrt() / q, half)
    }

    fn aligned(a: &Dyadic, b: &Dyadic) -> (BigInt, BigInt, i32) {
        // The exponent of zero means nothing and must not make the other number long.
        let exponent = match (a.sign(), b.sign()) {
            (0, _) => b.exponent,
            (_, 0) => a.exponent,
            _ => a.exponent.min(b.exponent),
        };
        let shift = |x: &Dyadic| match x.sign() {
            0 => BigInt::ZERO,
            _ => &x.mantissa << (x.exponent - exponent),
        };
        (shift(a), shift(b), exponent)
    }
}

fn ldexp(x: f64, n: i32) -> f64 {
    // In two steps, so that neither power leaves the range while the product is inside.
    let n = n.clamp(-1000, 1000);
    x * 2f64.powi(n / 2) * 2f64.powi(n - n / 2)
}

impl Add for &Dyadic {
    type Output = Dyadic;
    fn add(self, other: &Dyadic) -> Dyadic {
        let (a, b, exponent) = Dyadic::aligned(self, other);
        Dyadic { mantissa: a + b, exponent }
    }
}

impl Sub for &Dyadic {
    type Output = Dyadic;
    fn sub(self, other: &Dyadic) -> Dyadic {
        let (a, b, exponent) = Dyadic::aligned(self, other);
        Dyadic { mantissa: a - b, exponent }
    }
}

impl Mul for &Dyadic {
    type Output = Dyadic;
    fn mul(self, other: &Dyadic) -> Dyadic {
        Dyadic {
            mantissa: &self.mantissa * &other.mantissa,
            exponent: self.exponent + other.exponent,
        }
    }
}

impl Neg for Dyadic {
    type Output = Dyadic;
    fn neg(self) -> Dyadic {
        Dyadic { mantissa: -self.mantissa, ..self }
    }
}

impl PartialEq for Dyadic {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Dyadic {}

impl PartialOrd for Dyadic {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Dyadic {
    fn cmp(&self, other: &Self) -> Ordering {
        let (a, b, _) = Dyadic::aligned(self, other);
        a.cmp(&b)
    }
}

/// A vector of exact numbers.
pub type Vector = [Dyadic; 3];

/// The exact vector.
pub fn vector(v: [f32; 3]) -> Vector {
    v.map(Dyadic::from_f32)
}

/// `a - b`
pub fn difference(a: &Vector, b: &Vector) -> Vector {
    std::array::from_fn(|k| &a[k] - &b[k])
}

/// `a . b`
pub fn dot(a: &Vector, b: &Vector) -> Dyadic {
    &(&(&a[0] * &b[0]) + &(&a[1] * &b[1])) + &(&a[2] * &b[2])
}

/// `a x b`
pub fn cross(a: &Vector, b: &Vector) -> Vector {
    let minor = |i: usize, j: usize| &(&a[i] * &b[j]) - &(&a[j] * &b[i]);
    [minor(1, 2), minor(2, 0), minor(0, 1)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn floats_are_taken_as_they_are() {
        let one = Dyadic::from_f32(1.0);
        for (x, sign) in [(1e-45f32, 1), (-f32::MIN_POSITIVE, -1), (f32::MAX, 1), (-0.0, 0)] {
            let exact = Dyadic::from_f32(x);
            assert_eq!(exact.sign(), sign, "{x}");
            assert_eq!(exact.ratio(&one), f64::from(x));
            assert_eq!(Dyadic::from_f64(f64::from(x)), exact);
        }
        let (a, b) = (Dyadic::from_f32(3e38), Dyadic::from_f32(1e-45));
        assert_eq!(&(&(&a + &b) - &a), &b);
        assert!(&a + &b > a && -b < Dyadic::zero());
    }

    #[test]
    fn ratios_are_close_far_outside_the_range_of_f64() {
        let tiny = Dyadic::from_f32(3e-45);
        let power = (0..20).fold(Dyadic::from_f32(1.0), |p, _| &p * &tiny);
        let more = &power * &Dyadic::from_f32(-12.0);
        assert_eq!(more.ratio(&power), -12.0);
        let nine = &(&power * &power) * &Dyadic::from_f32(9.0);
        assert!((nine.sqrt_ratio(&power) - 3.0).abs() < 1e-15);
    }
}
