//! Rounding errors and neighbouring floats.

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
