//! Asking for one ray.

use super::status::{Error, RtStatus};
use super::types::{
    RT_FACING_BACK, RT_FACING_BOTH, RT_FACING_FRONT, RT_PRECISION_EXACT, RT_PRECISION_WATERTIGHT,
    RtAccel, RtHit, RtQuery, RtRay, RtSurface,
};
use super::versioned::{self, Output, pointer};
use super::{accel_at, answer, guard};
use core::mem::offset_of;

use crate::accel::Accel;
use crate::query::{Exact, Facing, Precision, PrimId, QueryOptions, Watertight};
use crate::ray::{Hit, Ray};
use crate::surface::Surface;

/// The closest hit: the least `t`, and at equal `t` the first by instance, geometry and primitive.
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
    // SAFETY: the caller's promise.
    unsafe { exact(accel, ray, Wanted::Closest(hit)) }
}

/// Whether the ray hits anything: true exactly when `rt_intersect` is. False when a pointer is null.
///
/// # Safety
///
/// Both pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_occluded(accel: *const RtAccel, ray: *const RtRay) -> bool {
    // SAFETY: the caller's promise.
    unsafe { exact(accel, ray, Wanted::Any) }
}

/// `rt_intersect` with RT_PRECISION_WATERTIGHT: no code of the exact answer is linked for it.
///
/// # Safety
///
/// Every pointer is null or valid, and nobody else uses `*hit` during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_intersect_watertight(
    accel: *const RtAccel,
    ray: *const RtRay,
    hit: *mut RtHit,
) -> bool {
    // SAFETY: the caller's promise.
    unsafe { watertight(accel, ray, Wanted::Closest(hit)) }
}

/// `rt_occluded` with RT_PRECISION_WATERTIGHT: true exactly when `rt_intersect_watertight` is.
///
/// # Safety
///
/// Both pointers are null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_occluded_watertight(accel: *const RtAccel, ray: *const RtRay) -> bool {
    // SAFETY: the caller's promise.
    unsafe { watertight(accel, ray, Wanted::Any) }
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
    // SAFETY: the caller's promise.
    unsafe { chosen(accel, ray, query, Wanted::Closest(hit)) }
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
    // SAFETY: the caller's promise.
    unsafe { chosen(accel, ray, query, Wanted::Any) }
}

/// What is asked of a ray.
#[derive(Clone, Copy)]
enum Wanted {
    /// The closest hit, to be written there.
    Closest(*mut RtHit),
    /// Whether there is any.
    Any,
}

/// Both questions, answered exactly: one function for them where code shall be small.
///
/// # Safety
///
/// As for [`rt_intersect`].
#[cfg_attr(target_os = "none", inline(never))]
#[cfg_attr(not(target_os = "none"), inline(always))]
unsafe fn exact(accel: *const RtAccel, ray: *const RtRay, wanted: Wanted) -> bool {
    // SAFETY: the caller's promise.
    unsafe { answered(accel, ray, wanted, |accel, ray, any| Ok(accel.either::<Exact>(ray, any))) }
}

/// The same in `f32`.
///
/// # Safety
///
/// As for [`rt_intersect`].
#[cfg_attr(target_os = "none", inline(never))]
#[cfg_attr(not(target_os = "none"), inline(always))]
unsafe fn watertight(accel: *const RtAccel, ray: *const RtRay, wanted: Wanted) -> bool {
    // SAFETY: the caller's promise.
    unsafe {
        answered(accel, ray, wanted, |accel, ray, any| Ok(accel.either::<Watertight>(ray, any)))
    }
}

/// The same as `query` wants it.
///
/// # Safety
///
/// As for [`rt_intersect_with`].
#[cfg_attr(target_os = "none", inline(never))]
#[cfg_attr(not(target_os = "none"), inline(always))]
unsafe fn chosen(
    accel: *const RtAccel,
    ray: *const RtRay,
    query: *const RtQuery,
    wanted: Wanted,
) -> bool {
    // SAFETY: the caller's promise.
    let options = || unsafe { query_options(query) };
    // SAFETY: the caller's promise.
    unsafe {
        answered(accel, ray, wanted, |accel, ray, any| {
            Ok(accel.either_with(ray, &options()?, (), any))
        })
    }
}

/// Whether `find` finds what is wanted, which is written down.
///
/// # Safety
///
/// As for [`rt_intersect`].
#[inline(always)]
unsafe fn answered(
    accel: *const RtAccel,
    ray: *const RtRay,
    wanted: Wanted,
    find: impl FnOnce(&Accel, &Ray, bool) -> Result<Option<Hit>, Error>,
) -> bool {
    let ask = move || -> Result<bool, Error> {
        // SAFETY: the caller's promise.
        let accel = unsafe { accel_at(accel) }?;
        // SAFETY: the caller's promise.
        let ray = unsafe { ray_at(ray) }?;
        let hit = match wanted {
            Wanted::Closest(hit) => Some(pointer(hit)?),
            Wanted::Any => None,
        };
        let found = find(&accel, ray, hit.is_none())?;
        if let Some(hit) = hit {
            // By hand, as `unwrap_or` takes 28 bytes more of a microcontroller's flash.
            let found = match found {
                Some(found) => found,
                None => Hit::MISS,
            };
            // SAFETY: not null, aligned, and valid as the caller promises.
            unsafe { hit.write(found.into()) };
        }
        Ok(found.is_some())
    };
    answer(move || ask().unwrap_or(false), false)
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

/// The ray at `ray`, checked for null and alignment.
///
/// # Safety
///
/// `ray` is null or valid, and nobody writes to it during `'r`.
#[inline(always)]
pub(super) unsafe fn ray_at<'r>(ray: *const RtRay) -> Result<&'r Ray, Error> {
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
pub(super) unsafe fn query_options(query: *const RtQuery) -> Result<QueryOptions, Error> {
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
