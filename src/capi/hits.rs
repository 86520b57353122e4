//! Asking for all hits of a ray.

use super::batch::filled;
use super::query::{query_options, ray_at};
use super::status::Error;
use super::types::{RtAccel, RtCursor, RtHit, RtQuery, RtRay};
use super::versioned::{self, Output, pointer};
use super::{accel_at, answer};
use crate::accel::Accel;
use crate::hits::HitKey;
use crate::query::{PrimId, QueryOptions};
use crate::ray::{Hit, Ray};

/// All hits that `query` leaves, null leaves everything, in the order of their real `t`; at equal `t` by
/// instance, geometry and primitive. Writes the first of them to `hits`, as many as `capacity`, and returns how
/// many: the nearest few.
///
/// With a cursor, which begins as zeros but for its `struct_size`, each call goes on after the last
/// hit of the call before, and the cursor with it. Fewer hits than `capacity`: there are no more. Nothing is
/// lost or given twice between two calls for the same accel, ray and query, even where several hits
/// round to one `t`. `cursor` may be null: each call begins with the first hit.
///
/// Each primitive of each instance is given at most once, but a sphere twice: where the ray enters and where it leaves,
/// also when it only touches. At a shared edge or vertex all triangles that are met are given. Exact
/// whatever `query->precision` is, and the first of all is that of `rt_intersect`. What is in `hits`
/// behind those returned may be written too.
///
/// 0 when another pointer is null, when query or cursor are refused, as `rt_query_check` would, and
/// when the cursor names a hit that the ray does not have.
///
/// # Safety
///
/// Every pointer is null or valid, `hits` for `capacity` elements, and nobody else uses `*cursor` or
/// `hits` during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_all_hits(
    accel: *const RtAccel,
    ray: *const RtRay,
    query: *const RtQuery,
    cursor: *mut RtCursor,
    hits: *mut RtHit,
    capacity: usize,
) -> usize {
    let ask = || -> Result<usize, Error> {
        // SAFETY: the caller's promise.
        let accel = unsafe { accel_at(accel) }?;
        // SAFETY: the caller's promise.
        let ray = unsafe { ray_at(ray) }?;
        // SAFETY: the caller's promise.
        let options = unsafe { query_options(query) }?;
        if capacity
            .checked_mul(size_of::<RtHit>())
            .is_none_or(|size| isize::try_from(size).is_err())
        {
            return Err(Error::TooLarge);
        }
        let list = List { accel: &accel, ray, options: &options, room: (hits, capacity) };
        if cursor.is_null() {
            // SAFETY: the caller's promise.
            return unsafe { list.fill(&mut None) };
        }
        // SAFETY: the caller's promise.
        let mut last = unsafe { versioned::read(cursor) }?.checked()?;
        // SAFETY: the caller's promise.
        let out = unsafe { Output::new(cursor) }?;
        // SAFETY: the caller's promise.
        let count = unsafe { list.fill(&mut last) }?;
        out.write(|struct_size| RtCursor::new(struct_size, last));
        Ok(count)
    };
    answer(|| ask().unwrap_or(0), 0)
}

/// So many hits are looked for in one search: of a large array most is never written.
const PART: usize = 256;

struct List<'a> {
    accel: &'a Accel<'a>,
    ray: &'a Ray,
    options: &'a QueryOptions,
    room: (*mut RtHit, usize),
}

impl List<'_> {
    /// Writes what comes after `last`; returns how many.
    ///
    /// # Safety
    ///
    /// The room is null or valid, and nobody else uses it during the call.
    unsafe fn fill(&self, last: &mut Option<HitKey>) -> Result<usize, Error> {
        let (hits, capacity) = self.room;
        let hits = pointer(hits)?.as_ptr().cast::<Hit>();
        let mut written = 0;
        while written < capacity {
            let size = PART.min(capacity - written);
            // SAFETY: within the room, which the caller promises; a hit of C is one of ours.
            let part = unsafe { filled(hits.wrapping_add(written), size, Hit::MISS) };
            let count = self.accel.more_hits(self.ray, self.options, last, part);
            written += count;
            if count < size {
                break;
            }
        }
        Ok(written)
    }
}

impl RtCursor {
    fn checked(&self) -> Result<Option<HitKey>, Error> {
        let RtCursor { begun, root, t, prim, geometry, instance, .. } = *self;
        match begun {
            0 => Ok(None),
            1 => Ok(Some(HitKey { id: PrimId { prim, geometry, instance }, root, t })),
            _ => Err(Error::InvalidArgument),
        }
    }

    fn new(struct_size: u32, last: Option<HitKey>) -> Self {
        let none =
            RtCursor { struct_size, begun: 0, root: 0, t: 0.0, prim: 0, geometry: 0, instance: 0 };
        let Some(HitKey { id: PrimId { prim, geometry, instance }, root, t }) = last else {
            return none;
        };
        RtCursor { begun: 1, root, t, prim, geometry, instance, ..none }
    }
}
