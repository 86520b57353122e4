//! The operations that `core` leaves to a library: chosen here and nowhere else.
//!
//! All of them are exact or correctly rounded, or use nothing but such operations, so all choices give the same bits.

/// Whether each operation on a `f64` is a call of a hundred instructions: on microcontrollers.
pub(crate) const SLOW_F64: bool = cfg!(all(target_os = "none", target_pointer_width = "32"));

/// And each operation on an `f32` a call of half a hundred.
const SLOW_F32: bool = SLOW_F64
    && cfg!(any(target_abi = "eabi", all(target_arch = "riscv32", not(target_feature = "f"))));

/// `x < y`, of numbers.
#[inline(always)]
pub(crate) fn less(x: f32, y: f32) -> bool {
    if SLOW_F32 { less_by_bits(x, y) } else { x < y }
}

/// The same by the order of their bits, whatever that says of NaN.
#[inline(always)]
fn less_by_bits(x: f32, y: f32) -> bool {
    let rank = |x: f32| match x.to_bits() as i32 {
        bits @ 0.. => bits,
        // Below zero in the order of sizes; -0 becomes 0.
        bits => i32::MIN.wrapping_sub(bits),
    };
    rank(x) < rank(y)
}

/// `x`, but not below `low` nor above `high`, which are in that order; NaN becomes `low`.
#[cfg_attr(target_os = "none", inline(never))]
#[cfg_attr(not(target_os = "none"), inline)]
pub(crate) fn limited<T: PartialOrd>(x: T, low: T, high: T) -> T {
    // As compilers write `max` and `min` these ask twice whether something is NaN.
    let x = if x > low { x } else { low };
    if x < high { x } else { high }
}

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
    use super::{cube_root, less_by_bits};

    #[test]
    fn bits_are_in_the_order_of_numbers() {
        let sizes = [0.0, 1e-45, 2e-45, 1e-38, 0.5, 1.0, 1f32.next_up(), f32::MAX, f32::INFINITY];
        for x in sizes.into_iter().flat_map(|x| [x, -x]) {
            for y in sizes.into_iter().flat_map(|y| [y, -y]) {
                assert_eq!(less_by_bits(x, y), x < y, "{x} {y}");
            }
        }
    }

    #[test]
    fn cube_roots_are_near() {
        for x in [1e-300, 1e-9, 0.3, 1.0, 2.0, 7.9, 8.0, 1e6, 1e300] {
            let root = cube_root(x);
            assert!((root * root * root / x - 1.0).abs() < 1e-12, "{x} {root}");
        }
    }
}
