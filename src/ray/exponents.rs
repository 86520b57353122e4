//! Powers of two that bring rays into their frames, and limits that are rounded on the way.

use crate::math::float::narrow_power_of_two;
use crate::math::rounding::{Round, scaled_by};
use crate::simd::{Lanes, SMALL, Simd, Width};

/// Ordinary scenes, origins and directions are smaller than this, and not all smaller than its reciprocal.
pub(super) const ORDINARY: f32 = (1u64 << 60) as f32;

#[inline(always)]
pub(super) fn is_ordinary(x: f32) -> bool {
    (1.0 / ORDINARY..ORDINARY).contains(&x)
}

/// That of infinity, and of NaN.
pub(super) const EXPONENT: u32 = f32::INFINITY.to_bits();

/// The power of two that brings an ordinary number, and all that are not larger, below 1.
#[inline(always)]
pub(super) fn scale_below(x: f32) -> f32 {
    f32::from_bits(below(x.to_bits()))
}

/// The same in each lane.
#[inline(always)]
pub(super) fn scales_below<S: Simd>(s: S, v: <S as Width<4>>::V) -> <S as Width<4>>::V {
    by_bits(s, v, below)
}

/// The bits of the one by those of the other.
#[inline(always)]
fn below(bits: u32) -> u32 {
    (253u32 << 23).wrapping_sub(bits & EXPONENT)
}

/// In each lane the power of two that an ordinary number is not below, and below twice of.
#[inline(always)]
pub(super) fn powers<S: Simd>(s: S, v: <S as Width<4>>::V) -> <S as Width<4>>::V {
    by_bits(s, v, |bits| bits & EXPONENT)
}

/// In each lane the reciprocal of a power of two, by its exponent.
#[inline(always)]
pub(super) fn reciprocals<S: Simd>(s: S, powers: <S as Width<4>>::V) -> <S as Width<4>>::V {
    by_bits(s, powers, |bits| (254u32 << 23).wrapping_sub(bits))
}

/// What compilers make one instruction of.
#[inline(always)]
fn by_bits<S: Simd>(s: S, v: <S as Width<4>>::V, f: impl Fn(u32) -> u32) -> <S as Width<4>>::V {
    let mut lanes = [0.0; 4];
    v.store(&mut lanes);
    Width::<4>::load(s, &lanes.map(|x| f32::from_bits(f(x.to_bits()))))
}

/// The bits of the largest absolute value: floats without a sign are in the order of their bits, with
/// infinities and NaN above the others.
#[cfg_attr(target_os = "none", inline(never))]
pub(super) fn largest_bits(v: &[f32; 3]) -> u32 {
    v.iter().fold(0, |most, x| most.max(x.abs().to_bits()))
}

/// The exponent `e` with `|x| < 2^e` by the bits of `|x|`, at least -126; 129 for infinity.
pub(super) fn exponent_above(bits: u32) -> i32 {
    (bits >> 23) as i32 - 126
}

/// `t * scale`, the scale a power of two, unless it is neither zero nor a normal float, but also when it is infinite.
#[inline(always)]
fn scaled(t: f32, scale: f32) -> Option<f32> {
    let product = t * scale;
    (product.abs() >= f32::MIN_POSITIVE || t == 0.0).then_some(product)
}

/// `t * 2^n` of a finite `t`, which is a float unless it is not a normal one. Out of line, and without `f64`.
#[cfg_attr(target_os = "none", inline(always))]
#[cfg_attr(not(target_os = "none"), inline(never))]
pub(super) fn rounded(t: f32, n: i32, round: Round) -> f32 {
    let in_floats = !SMALL && (-126..=127).contains(&n);
    let exact = if in_floats { scaled(t, narrow_power_of_two(n)) } else { None };
    match exact {
        Some(product) if product.abs() <= f32::MAX => product,
        _ => scaled_by(t, n, round),
    }
}
