//! Rounding errors and neighbouring floats.

use super::binary::Binary;

/// The unit roundoff of `f64`: half the distance from 1 to the next float.
pub(crate) const UNIT: f64 = f64::EPSILON / 2.0;

/// The unit roundoff of `f32`.
pub(crate) const UNIT32: f32 = f32::EPSILON / 2.0;

/// The bound on the relative error of a product of `n` factors `1 + d`, each `|d| <= UNIT`.
///
/// Source: \[Hig02\], lemma 3.1.
pub(crate) const fn gamma(n: u32) -> f64 {
    let nu = n as f64 * UNIT;
    // The quotient is rounded; one ulp more keeps the bound.
    nu / (1.0 - nu) * (1.0 + 2.0 * UNIT)
}

/// Far above the relative error of a few roundings in `f64`: for bounds that need not be tight.
pub(crate) const LOOSE: f64 = 1e-12;

/// The largest `f32` that is not above `x`; NaN stays NaN.
#[inline]
pub(crate) fn f32_below(x: f64) -> f32 {
    let rounded = x as f32;
    if f64::from(rounded) > x { rounded.next_down() } else { rounded }
}

/// The smallest `f32` that is not below `x`; NaN stays NaN.
#[inline]
pub(crate) fn f32_above(x: f64) -> f32 {
    let rounded = x as f32;
    if f64::from(rounded) < x { rounded.next_up() } else { rounded }
}

/// Where to go from what is no float.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Round {
    Below,
    Above,
    /// Ties to even.
    Nearest,
}

/// `x * 2^n` for a finite `x`, rounded once: for results at the ends of the floats, in integers.
#[cold]
#[inline(never)]
pub(crate) fn scaled_by(x: f32, n: i32, round: Round) -> f32 {
    let Binary { mantissa, exponent } = Binary::of(x);
    if mantissa == 0 {
        return x;
    }
    let size = mantissa.unsigned_abs();
    let spare = size.leading_zeros() - 8;
    let (size, exponent) = (size << spare, exponent + n - spare as i32);
    // Below the least float's place. Of more than 25 bits nothing is left, as of 25.
    let lost = (-149 - exponent).clamp(0, 25) as u32;
    let (kept, rest) = (size >> lost, size & ((1 << lost) - 1));
    let half = 1 << lost >> 1;
    let away = match round {
        Round::Nearest => rest > half || rest == half && rest != 0 && kept & 1 == 1,
        Round::Above => rest != 0 && mantissa > 0,
        Round::Below => rest != 0 && mantissa < 0,
    };
    let ends_at_max = round == if mantissa > 0 { Round::Below } else { Round::Above };
    let bits = match exponent {
        // The highest bit of what is normal adds one to the exponent; a carry does so as well.
        ..=104 => (((exponent + 149).max(0) as u32) << 23) + kept + u32::from(away),
        _ if ends_at_max => f32::MAX.to_bits(),
        _ => f32::INFINITY.to_bits(),
    };
    f32::from_bits(bits).copysign(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use raykern_harness::make::Random;

    #[test]
    fn scaling_rounds_as_f64_does() {
        let mut random = Random::new(7);
        for _ in 0..200_000 {
            let x = f32::from_bits(random.bits() as u32);
            let n = random.below(560) as i32 - 280;
            if !x.is_finite() {
                continue;
            }
            let product = f64::from(x) * 2f64.powi(n);
            for (round, expected) in [
                (Round::Below, f32_below(product)),
                (Round::Above, f32_above(product)),
                (Round::Nearest, product as f32),
            ] {
                let ours = scaled_by(x, n, round);
                assert_eq!(ours.to_bits(), expected.to_bits(), "{x:e} * 2^{n}, {round:?}");
            }
        }
    }
}
