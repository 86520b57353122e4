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

/// `2^n`; for what is not a normal float, the nearest power that is.
pub(crate) fn power_of_two(n: i32) -> f64 {
    f64::from_bits(((n.clamp(-1022, 1023) + 1023) as u64) << 52)
}
