//! Vectors in `f64`.
//!
//! On a processor of 32 bits each operation on a `f64` is a call, or many instructions: there these functions are calls as
//! well, and elsewhere in line.

use glam::DVec3;

/// Three `f32` as three `f64`: exact.
pub(crate) fn wide(p: [f32; 3]) -> DVec3 {
    DVec3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]))
}

/// `|x| + |y| + |z|`.
#[cfg_attr(not(target_pointer_width = "64"), inline(never))]
pub(crate) fn sum_abs(v: DVec3) -> f64 {
    let v = v.abs();
    v.x + v.y + v.z
}

/// `p - q`.
#[cfg_attr(target_pointer_width = "64", inline(always))]
#[cfg_attr(not(target_pointer_width = "64"), inline(never))]
pub(crate) fn minus(p: DVec3, q: DVec3) -> DVec3 {
    p - q
}

/// The cross product.
#[cfg_attr(target_pointer_width = "64", inline(always))]
#[cfg_attr(not(target_pointer_width = "64"), inline(never))]
pub(crate) fn cross(p: DVec3, q: DVec3) -> DVec3 {
    p.cross(q)
}

/// The dot product.
#[cfg_attr(target_pointer_width = "64", inline(always))]
#[cfg_attr(not(target_pointer_width = "64"), inline(never))]
pub(crate) fn dot(p: DVec3, q: DVec3) -> f64 {
    p.dot(q)
}
