//! Vectors of three, with every operation and its order written out: the same bits everywhere.

use glam::Vec3;

pub(super) fn dot(p: Vec3, q: Vec3) -> f32 {
    p.x * q.x + p.y * q.y + p.z * q.z
}

pub(super) fn cross(p: Vec3, q: Vec3) -> Vec3 {
    let minor = |a: f32, b: f32, c: f32, d: f32| a * d - b * c;
    Vec3::new(minor(p.y, p.z, q.y, q.z), minor(p.z, p.x, q.z, q.x), minor(p.x, p.y, q.x, q.y))
}

/// `|x| + |y| + |z|`.
pub(super) fn sum_abs(v: Vec3) -> f32 {
    v.x.abs() + v.y.abs() + v.z.abs()
}
