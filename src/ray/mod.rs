//! Rays, hits, and what a traversal knows about a ray before it starts.

use crate::simd::{Lanes, Simd, Width};

mod abreast;
mod alike;
mod axis;
#[cfg(test)]
mod bounds;
mod exponents;
mod frame;
mod frame_slab;
mod packet;
mod prepare;
mod slab;

pub(crate) use abreast::{Abreast, Sixteen};
pub(crate) use alike::Alike;
pub(crate) use axis::Axis;
pub(crate) use frame::{PreparedRay, TINY};
pub(crate) use frame_slab::FrameSlab;
pub(crate) use packet::{Entered, GROUPS, RayPacket, Spread};
pub(crate) use prepare::{Early, Late};
pub(crate) use slab::{NarrowSlab, Slab, WideBoxes, WideSlab};

/// The number that stands for "no primitive", "no geometry" and "not in an instance".
pub const NONE: u32 = u32::MAX;

/// The set of points `origin + t * direction` with `t_min <= t <= t_max`, both ends included.
///
/// `direction` need not have length one; `t` counts in its lengths. The limits may be infinite and
/// `t_min` may be negative. A ray with a NaN or an infinity in `origin` or `direction`, with a zero
/// direction, with a NaN limit or with `t_min > t_max` hits nothing.
///
/// ```text
/// byte 0        12      16           28      32
///      | origin | t_min | direction | t_max |
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Ray {
    /// Where `t` is zero.
    pub origin: [f32; 3],
    /// The smallest `t` that counts.
    pub t_min: f32,
    /// The step for `t = 1`, of any length but zero.
    pub direction: [f32; 3],
    /// The largest `t` that counts.
    pub t_max: f32,
}
const _: () = assert!(size_of::<Ray>() == 32);

impl Ray {
    /// The ray from `origin` along `direction` with `t` from 0 to infinity.
    pub const fn new(origin: [f32; 3], direction: [f32; 3]) -> Self {
        Ray { origin, t_min: 0.0, direction, t_max: f32::INFINITY }
    }

    /// Its numbers as they are drawn above.
    #[allow(unsafe_code, reason = "a promise about the layout drawn here")]
    #[inline(always)]
    pub(crate) fn row(&self) -> &[f32; 8] {
        // SAFETY: eight floats in C's order, without padding as they fill its 32 bytes.
        unsafe { &*core::ptr::from_ref(self).cast() }
    }

    /// The ray with these numbers.
    #[allow(unsafe_code, reason = "a promise about the layout drawn here")]
    #[inline(always)]
    pub(crate) fn of_row(row: &[f32; 8]) -> &Self {
        // SAFETY: as for `row`.
        unsafe { &*core::ptr::from_ref(row).cast() }
    }

    /// Its halves, each a vector on most machines.
    #[inline(always)]
    pub(crate) fn rows(&self) -> [[f32; 4]; 2] {
        let Ray { origin: [x, y, z], t_min, direction: [dx, dy, dz], t_max } = *self;
        [[x, y, z, t_min], [dx, dy, dz, t_max]]
    }

    /// The ray with these halves, which is written by these: what is written by parts is slow to read as a whole.
    #[allow(unsafe_code, reason = "a promise about the layout drawn here")]
    #[inline(always)]
    pub(crate) fn of_rows(rows: [[f32; 4]; 2]) -> Self {
        // SAFETY: eight floats, as for `row`.
        unsafe { core::mem::transmute(rows) }
    }

    /// The same ray, limited to `t_min <= t <= t_max`.
    pub const fn with_limits(self, t_min: f32, t_max: f32) -> Self {
        Ray { t_min, t_max, ..self }
    }
}

/// Where a ray meets a scene.
///
/// ```text
/// byte 0   4   8   12     16         20         24
///      | t | u | v | prim | geometry | instance |
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Hit {
    /// The parameter of the hit, in lengths of the ray's direction.
    pub t: f32,
    /// The weight of the triangle's second vertex, from 0 to 1 and, if exact, within 2^-23 of the real one; 0 on spheres.
    pub u: f32,
    /// The same of the third vertex.
    pub v: f32,
    /// The number of the triangle or sphere within its geometry.
    pub prim: u32,
    /// The number of the mesh, or the number of meshes plus the number of the sphere set.
    pub geometry: u32,
    /// The number of the instance, [`NONE`] outside instances.
    pub instance: u32,
}
const _: () = assert!(size_of::<Hit>() == 24);

impl Hit {
    /// A hit that is written at once: what is written by parts is slow to copy.
    #[allow(unsafe_code, reason = "a promise about the layout drawn above")]
    #[inline(always)]
    pub(crate) fn of_whole(s: impl Simd, Hit { t, u, v, prim, geometry, instance }: Hit) -> Self {
        #[repr(C, packed(4))]
        struct Whole([f32; 4], u64);
        let mut first = [0.0; 4];
        Width::<4>::load(s, &[t, u, v, f32::from_bits(prim)]).store(&mut first);
        let [low, high] = match cfg!(target_endian = "little") {
            true => [geometry, instance],
            false => [instance, geometry],
        };
        // SAFETY: any bits are a hit, and these are its 24 bytes in their order.
        unsafe { core::mem::transmute(Whole(first, u64::from(high) << 32 | u64::from(low))) }
    }

    /// What the C entry points write for a ray that hits nothing.
    pub const MISS: Hit =
        Hit { t: f32::INFINITY, u: 0.0, v: 0.0, prim: NONE, geometry: NONE, instance: NONE };
}

/// The part `near ..= far` of a ray, or of what is known of a `t`; empty when `near > far`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interval<T> {
    pub near: T,
    pub far: T,
}

impl<T: PartialOrd> Interval<T> {
    pub fn is_empty(&self) -> bool {
        // Written so that a NaN counts as not empty: what is unclear is looked at.
        self.near > self.far
    }
}
