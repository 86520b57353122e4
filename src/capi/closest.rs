//! Asking for the closest point.

use super::query::query_options;
use super::status::Error;
use super::types::{RtAccel, RtPointHit, RtQuery};
use super::versioned::pointer;
use super::{accel_at, answer};
use crate::closest::PointHit;
use crate::ray::NONE;

/// The point closest to `point`, three floats, on the triangles and the surfaces of spheres within
/// `radius`, ends included; of what the mask and `skip` of `query` leave, which may be null. `skip`
/// leaves out all of a sphere here; `facing` and `precision` are not asked.
///
/// Returns whether there is one, and writes it, or none, to `*out`. When another pointer is null or the query is
/// refused: false, and nothing is written.
///
/// Distances are computed in double precision, the same bits from every structure and on every machine,
/// and of equal ones the first by instance, geometry and primitive wins. They are within 2^-46 of the distance plus the
/// primitive's longest edge or diameter: nothing is closer by more than that.
///
/// In instances they are those of the images of vertices, rounded to double precision, and of the ellipsoids that spheres
/// become; if a map stretches by at most 2^10 times as much along one axis as along another, within 2^-40 of
/// the distance and the longest axis.
///
/// Nothing is within a radius that is negative or NaN, from a point that is not finite, or beyond FLT_MAX.
///
/// # Safety
///
/// Every pointer is null or valid, and nobody else uses `*out` during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_closest_point(
    accel: *const RtAccel,
    point: *const f32,
    radius: f32,
    query: *const RtQuery,
    out: *mut RtPointHit,
) -> bool {
    let ask = || -> Result<bool, Error> {
        // SAFETY: the caller's promise.
        let accel = unsafe { accel_at(accel) }?;
        let (point, out) = (pointer(point.cast::<[f32; 3]>())?, pointer(out)?);
        // SAFETY: the caller's promise.
        let options = unsafe { query_options(query) }?;
        // SAFETY: not null, aligned, and three floats as the caller promises.
        let found = accel.closest_point(unsafe { point.read() }, radius, &options);
        // SAFETY: not null, aligned, and valid as the caller promises.
        unsafe { out.write(found.map_or(RtPointHit::NONE, RtPointHit::from)) };
        Ok(found.is_some())
    };
    answer(|| ask().unwrap_or(false), false)
}

impl RtPointHit {
    const NONE: Self = RtPointHit {
        distance: f32::INFINITY,
        point: [0.0; 3],
        u: 0.0,
        v: 0.0,
        prim: NONE,
        geometry: NONE,
        instance: NONE,
    };
}

impl From<PointHit> for RtPointHit {
    fn from(hit: PointHit) -> RtPointHit {
        let PointHit { distance, point, u, v, prim, geometry, instance } = hit;
        RtPointHit { distance, point, u, v, prim, geometry, instance }
    }
}
