//! The operations that `core` leaves to a library: chosen here and nowhere else.
//!
//! All of them are exact or correctly rounded, or use nothing but such operations, so all choices give the same bits.

/// The correctly rounded square root.
pub(crate) fn sqrt(x: f64) -> f64 {
    #[cfg(feature = "std")]
    return std::primitive::f64::sqrt(x);
    #[cfg(not(feature = "std"))]
    return libm::sqrt(x);
}

/// The correctly rounded square root of an `f32`.
pub(crate) fn sqrt32(x: f32) -> f32 {
    #[cfg(feature = "std")]
    return std::primitive::f32::sqrt(x);
    #[cfg(not(feature = "std"))]
    return libm::sqrtf(x);
}

/// About the cube root of a positive normal number, to a part in 2^40: by Newton's method, with the same bits on every machine.
pub(crate) fn cube_root(x: f64) -> f64 {
    // A third of the exponent, and of the fraction: within a tenth.
    let mut root = f64::from_bits(x.to_bits() / 3 + (1023 << 52) / 3 * 2);
    for _ in 0..4 {
        root -= (root - x / (root * root)) / 3.0;
    }
    root
}

/// `2^n`, for `-149 <= n <= 127`: below -126 it is subnormal.
#[inline(always)]
pub(crate) const fn narrow_power_of_two(n: i32) -> f32 {
    if n < -126 { f32::from_bits(1 << (n + 149)) } else { f32::from_bits(((n + 127) as u32) << 23) }
}

/// `2^n`; for what is not a normal float, the nearest power that is.
#[inline(always)]
pub(crate) fn power_of_two(n: i32) -> f64 {
    f64::from_bits(((n.clamp(-1022, 1023) + 1023) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::cube_root;

    #[test]
    fn cube_roots_are_near() {
        for x in [1e-300, 1e-9, 0.3, 1.0, 2.0, 7.9, 8.0, 1e6, 1e300] {
            let root = cube_root(x);
            assert!((root * root * root / x - 1.0).abs() < 1e-12, "{x} {root}");
        }
    }
}
