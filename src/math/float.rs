//! The operations that `core` leaves to a library: chosen here and nowhere else.
//!
//! All of them are exact or correctly rounded, so both choices give the same bits.

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
