//! Asking: one ray, or many.

use super::status::{Error, RtStatus};
use super::types::{
    RT_FACING_BACK, RT_FACING_BOTH, RT_FACING_FRONT, RT_PRECISION_EXACT, RT_PRECISION_WATERTIGHT,
    RtAccel, RtHit, RtQuery, RtRay, RtSurface,
};
use super::versioned::{self, Output, pointer};
use super::{accel_at, answer, guard};
use core::mem::offset_of;

use crate::accel::Accel;
use crate::query::{Facing, Precision, PrimId, QueryOptions};
use crate::ray::{Hit, Ray};
use crate::surface::Surface;

/// The closest hit: the least `t`, and at equal `t` the first by geometry and primitive.
///
/// Returns whether there is one, and writes it, or the miss, to `*hit`. When a pointer is null:
/// false, and nothing is written.
///
/// # Safety
///
/// Every pointer is null or valid, and nobody else uses `*hit` during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_intersect(
    accel: *const RtAccel,
    ray: *const RtRay,
    hit: *mut RtHit,
) -> bool {
    let ask = || -> Result<bool, Error> {
        // SAFETY: the caller's promise.
        let accel = unsafe { accel_at(accel) }?;
        // SAFETY: the caller's promise.
        let (ray, hit) = (unsafe { ray_at(ray) }?, pointer(hit)?);
        let found = accel.intersect(ray);
        // SAFETY: not null, aligned, and valid as the caller promises.
        unsafe { hit.write(found.unwrap_or(Hit::MISS).into()) };
        Ok(found.is_some())
    };
    answer(|| ask().unwrap_or(false), false)
}

/// Whether the ray hits anything: true exactly when `rt_intersect` is. False when a pointer is null.
///
/// # Safety
///
/// Both pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_occluded(accel: *const RtAccel, ray: *const RtRay) -> bool {
    let ask = || -> Result<bool, Error> {
        // SAFETY: the caller's promise.
        let accel = unsafe { accel_at(accel) }?;
        // SAFETY: the caller's promise.
        Ok(accel.occluded(unsafe { ray_at(ray) }?))
    };
    answer(|| ask().unwrap_or(false), false)
}

/// `rt_intersect` for what `query` leaves; null leaves everything. When the query is refused, for a
/// reason that `rt_query_check` tells: false, and nothing is written.
///
/// # Safety
///
/// Every pointer is null or valid, and nobody else uses `*hit` during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_intersect_with(
    accel: *const RtAccel,
    ray: *const RtRay,
    query: *const RtQuery,
    hit: *mut RtHit,
) -> bool {
    let ask = || -> Result<bool, Error> {
        // SAFETY: the caller's promise.
        let accel = unsafe { accel_at(accel) }?;
        // SAFETY: the caller's promise.
        let (ray, hit) = (unsafe { ray_at(ray) }?, pointer(hit)?);
        // SAFETY: the caller's promise.
        let options = unsafe { query_options(query) }?;
        let found = accel.intersect_with(ray, &options);
        // SAFETY: not null, aligned, and valid as the caller promises.
        unsafe { hit.write(found.unwrap_or(Hit::MISS).into()) };
        Ok(found.is_some())
    };
    answer(|| ask().unwrap_or(false), false)
}

/// `rt_occluded` for what `query` leaves; null leaves everything. False when the query is refused.
///
/// # Safety
///
/// Every pointer is null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_occluded_with(
    accel: *const RtAccel,
    ray: *const RtRay,
    query: *const RtQuery,
) -> bool {
    let ask = || -> Result<bool, Error> {
        // SAFETY: the caller's promise.
        let accel = unsafe { accel_at(accel) }?;
        // SAFETY: the caller's promise.
        let ray = unsafe { ray_at(ray) }?;
        // SAFETY: the caller's promise.
        let options = unsafe { query_options(query) }?;
        Ok(accel.occluded_with(ray, &options))
    };
    answer(|| ask().unwrap_or(false), false)
}

/// Why a query with these options would be refused, or RT_OK. Null is the default query.
///
/// # Safety
///
/// `query` is null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_query_check(query: *const RtQuery) -> RtStatus {
    // SAFETY: the caller's promise.
    guard(|| unsafe { query_options(query) }.map(drop))
}

/// `rt_intersect` for `count` rays. When a pointer is null, nothing is written.
///
/// # Safety
///
/// Every pointer is null or valid for `count` elements, and nobody else uses `hits` during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_intersect_batch(
    accel: *const RtAccel,
    rays: *const RtRay,
    hits: *mut RtHit,
    count: usize,
) {
    // SAFETY: the caller's promise.
    let _ = unsafe { rt_intersect_batch_with(accel, rays, 0, core::ptr::null(), hits, 0, count) };
}

/// `rt_occluded` for `count` rays: 1 for a hit, 0 for none. When a pointer is null, nothing is
/// written.
///
/// # Safety
///
/// Every pointer is null or valid for `count` elements, and nobody else uses `occluded` during the
/// call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_occluded_batch(
    accel: *const RtAccel,
    rays: *const RtRay,
    occluded: *mut u8,
    count: usize,
) {
    // SAFETY: the caller's promise.
    let _ =
        unsafe { rt_occluded_batch_with(accel, rays, 0, core::ptr::null(), occluded, 0, count) };
}

/// `rt_intersect_with` for `count` rays, `ray_stride` bytes apart, into hits `hit_stride` bytes
/// apart. A stride of 0 means packed; others are multiples of 4 and no less than the struct.
/// `query` may be null. When refused, nothing is written.
///
/// # Safety
///
/// Every pointer is null or valid for `count` elements, and nobody else uses `hits` during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_intersect_batch_with(
    accel: *const RtAccel,
    rays: *const RtRay,
    ray_stride: usize,
    query: *const RtQuery,
    hits: *mut RtHit,
    hit_stride: usize,
    count: usize,
) -> RtStatus {
    let out = (hits, hit_stride);
    let ask = Accel::intersect_batch_with;
    // SAFETY: the caller's promise.
    guard(|| unsafe { batch(accel, (rays, ray_stride), query, out, count, (Hit::MISS, ask)) })
}

/// `rt_occluded_with` for `count` rays, `ray_stride` bytes apart, into bytes `occluded_stride` bytes
/// apart. A stride of 0 means packed. `query` may be null. When refused, nothing is written.
///
/// # Safety
///
/// Every pointer is null or valid for `count` elements, and nobody else uses `occluded` during the
/// call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_occluded_batch_with(
    accel: *const RtAccel,
    rays: *const RtRay,
    ray_stride: usize,
    query: *const RtQuery,
    occluded: *mut u8,
    occluded_stride: usize,
    count: usize,
) -> RtStatus {
    let out = (occluded, occluded_stride);
    let ask = Accel::occluded_batch_with;
    // SAFETY: the caller's promise.
    guard(|| unsafe { batch(accel, (rays, ray_stride), query, out, count, (false, ask)) })
}

/// Writes to `*out` the surface at a hit that a query on this accel returned for this ray.
/// `out->struct_size` must be set. Costs about as much as `rt_intersect`.
///
/// # Safety
///
/// Every pointer is null or valid, and nobody else uses `*out` during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_hit_surface(
    accel: *const RtAccel,
    ray: *const RtRay,
    hit: *const RtHit,
    out: *mut RtSurface,
) -> RtStatus {
    guard(|| {
        // SAFETY: the caller's promise.
        let accel = unsafe { accel_at(accel) }?;
        // SAFETY: the caller's promise.
        let ray = unsafe { ray_at(ray) }?;
        // SAFETY: not null, aligned, and valid as the caller promises.
        let hit = unsafe { pointer(hit)?.read() }.into();
        // SAFETY: the caller's promise.
        let out = unsafe { Output::new(out) }?;
        let surface = accel.surface(ray, &hit).ok_or(Error::NotFound)?;
        out.write(|struct_size| RtSurface::new(struct_size, &surface));
        Ok(())
    })
}

/// So many rays are read, asked for together and answered before the next.
const PART: usize = 128;

/// How the rays of a batch are asked for together, and what stands for no answer yet.
type AskTogether<'m, A> = (A, fn(&Accel<'m>, &[Ray], &QueryOptions, &mut [A]));

/// Asks for each of `count` rays and writes the answers; arrays come with their strides.
///
/// # Safety
///
/// Every pointer is null or valid for `count` elements, and nobody else uses `out` during the call.
unsafe fn batch<'m, A: Copy + Into<T>, T>(
    accel: *const RtAccel,
    rays: (*const RtRay, usize),
    query: *const RtQuery,
    out: (*mut T, usize),
    count: usize,
    (none, ask): AskTogether<'m, A>,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    let accel = unsafe { accel_at(accel) }?;
    // SAFETY: the caller's promise.
    let options = unsafe { query_options(query) }?;
    let rays = Column::new(rays.0, rays.1, count)?;
    let out = Column::new(out.0.cast_const(), out.1, count)?;
    let mut part = [Ray::new([0.0; 3], [0.0; 3]); PART];
    let mut answers = [none; PART];
    for first in (0..count).step_by(PART) {
        let size = PART.min(count - first);
        for (i, ray) in part[..size].iter_mut().enumerate() {
            // SAFETY: below `count`, and valid as the caller promises.
            *ray = unsafe { rays.at(first + i).read() }.into();
        }
        ask(&accel, &part[..size], &options, &mut answers[..size]);
        for (i, answer) in answers[..size].iter().enumerate() {
            // SAFETY: as above; C passed this pointer as one to write to.
            unsafe { out.at(first + i).cast_mut().write((*answer).into()) };
        }
    }
    Ok(())
}

/// Elements of a caller's array at equal distances.
struct Column<T> {
    first: *const T,
    stride: usize,
}

impl<T> Column<T> {
    /// Checked for null, unless there are no elements, for alignment and for overflow.
    fn new(first: *const T, stride: usize, count: usize) -> Result<Self, Error> {
        let stride = if stride == 0 { size_of::<T>() } else { stride };
        if stride < size_of::<T>() || stride % align_of::<T>() != 0 {
            return Err(Error::InvalidArgument);
        }
        if count > 0 {
            let first = pointer(first)?;
            let bytes = count.checked_mul(stride).filter(|bytes| isize::try_from(*bytes).is_ok());
            first.addr().checked_add(bytes.ok_or(Error::TooLarge)?).ok_or(Error::TooLarge)?;
        }
        Ok(Column { first, stride })
    }

    /// Where element `i` is; `new` has checked that this does not overflow below `count`.
    fn at(&self, i: usize) -> *const T {
        self.first.wrapping_byte_add(i * self.stride)
    }
}

/// The ray at `ray`, checked for null and alignment.
///
/// # Safety
///
/// `ray` is null or valid, and nobody writes to it during `'r`.
#[inline(always)]
unsafe fn ray_at<'r>(ray: *const RtRay) -> Result<&'r Ray, Error> {
    let ray = pointer(ray)?;
    // SAFETY: not null, aligned, valid as the caller promises, and of the same layout.
    Ok(unsafe { ray.cast().as_ref() })
}

/// A ray of C is one of Rust: the same floats in the same places, of which any is allowed.
const _: () = {
    assert!(size_of::<RtRay>() == size_of::<Ray>() && align_of::<RtRay>() == align_of::<Ray>());
    assert!(offset_of!(RtRay, origin) == offset_of!(Ray, origin));
    assert!(offset_of!(RtRay, t_min) == offset_of!(Ray, t_min));
    assert!(offset_of!(RtRay, direction) == offset_of!(Ray, direction));
    assert!(offset_of!(RtRay, t_max) == offset_of!(Ray, t_max));
};

/// The options at `query`, or the default ones for null.
///
/// # Safety
///
/// `query` is null or valid.
unsafe fn query_options(query: *const RtQuery) -> Result<QueryOptions, Error> {
    if query.is_null() {
        return Ok(QueryOptions::default());
    }
    // SAFETY: the caller's promise.
    unsafe { versioned::read(query) }?.checked()
}

impl RtQuery {
    fn checked(&self) -> Result<QueryOptions, Error> {
        let facing = match self.facing {
            RT_FACING_BOTH => Facing::Both,
            RT_FACING_FRONT => Facing::Front,
            RT_FACING_BACK => Facing::Back,
            _ => return Err(Error::InvalidArgument),
        };
        let skip = match self.skip {
            0 => None,
            1 => Some(PrimId {
                prim: self.skip_prim,
                geometry: self.skip_geometry,
                instance: self.skip_instance,
            }),
            _ => return Err(Error::InvalidArgument),
        };
        let precision = match self.precision {
            RT_PRECISION_EXACT => Precision::Exact,
            RT_PRECISION_WATERTIGHT => Precision::Watertight,
            _ => return Err(Error::InvalidArgument),
        };
        Ok(QueryOptions { precision, mask: self.mask, facing, skip })
    }
}

impl From<RtRay> for Ray {
    #[inline]
    fn from(ray: RtRay) -> Ray {
        let RtRay { origin, t_min, direction, t_max } = ray;
        Ray { origin, t_min, direction, t_max }
    }
}

impl From<Hit> for RtHit {
    #[inline]
    fn from(hit: Hit) -> RtHit {
        let Hit { t, u, v, prim, geometry, instance } = hit;
        RtHit { t, u, v, prim, geometry, instance }
    }
}

impl From<RtHit> for Hit {
    #[inline]
    fn from(hit: RtHit) -> Hit {
        let RtHit { t, u, v, prim, geometry, instance } = hit;
        Hit { t, u, v, prim, geometry, instance }
    }
}

impl RtSurface {
    fn new(struct_size: u32, surface: &Surface) -> RtSurface {
        let Surface { position, position_error, normal, front_origin, back_origin } = *surface;
        RtSurface { struct_size, position, position_error, normal, front_origin, back_origin }
    }
}
