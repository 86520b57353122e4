//! Asking for all hits of a ray.

use super::batch::filled;
use super::query::{query_options, ray_at};
use super::status::{Error, RtStatus};
use super::types::{RtAccel, RtCursor, RtHit, RtQuery, RtRay};
use super::versioned::{self, Output, pointer};
use super::{accel_at, answer, guard};
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
/// 0, and nothing written, when another pointer is null, when query or cursor are refused, and when the cursor names a hit that the
/// ray does not have: `rt_all_hits_checked` says which.
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
    // SAFETY: the caller's promise.
    let ask = || unsafe { all_hits((accel, ray, query), cursor, (hits, capacity)) };
    answer(|| ask().unwrap_or(0), 0)
}

/// `rt_all_hits` that says why it was refused, and else writes to `*count` how many hits it wrote. RT_ERROR_NOT_FOUND: the ray does
/// not have the hit that the cursor names. When refused, nothing is written.
///
/// # Safety
///
/// As for `rt_all_hits`; nobody else uses `*count` during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_all_hits_checked(
    accel: *const RtAccel,
    ray: *const RtRay,
    query: *const RtQuery,
    cursor: *mut RtCursor,
    hits: *mut RtHit,
    capacity: usize,
    count: *mut usize,
) -> RtStatus {
    guard(|| {
        let count = pointer(count)?;
        // SAFETY: the caller's promise.
        let found = unsafe { all_hits((accel, ray, query), cursor, (hits, capacity)) }?;
        // SAFETY: not null, aligned, and valid as the caller promises.
        unsafe { count.write(found) };
        Ok(())
    })
}

/// Writes hits and moves the cursor; returns how many there are.
///
/// # Safety
///
/// As for `rt_all_hits`.
unsafe fn all_hits(
    (accel, ray, query): (*const RtAccel, *const RtRay, *const RtQuery),
    cursor: *mut RtCursor,
    (hits, capacity): (*mut RtHit, usize),
) -> Result<usize, Error> {
    // SAFETY: the caller's promise.
    let accel = unsafe { accel_at(accel) }?;
    // SAFETY: the caller's promise.
    let ray = unsafe { ray_at(ray) }?;
    // SAFETY: the caller's promise.
    let options = unsafe { query_options(query) }?;
    let bytes = capacity.checked_mul(size_of::<RtHit>());
    bytes.filter(|bytes| isize::try_from(*bytes).is_ok()).ok_or(Error::TooLarge)?;
    let room = (pointer(hits)?.as_ptr(), capacity);
    let list = List { accel: &accel, ray, options: &options, room };
    if cursor.is_null() {
        // SAFETY: the caller's promise.
        return unsafe { list.fill(&mut None) };
    }
    // SAFETY: the caller's promise.
    let mut last = unsafe { versioned::read(cursor) }?.checked()?;
    // SAFETY: the caller's promise.
    let out = unsafe { Output::new(cursor) }?;
    // Before anything is written, though the list looks for it again: a search between two floats.
    accel.hits_after(ray, &options, &mut last, &mut []).ok_or(Error::NotFound)?;
    // SAFETY: the caller's promise.
    let count = unsafe { list.fill(&mut last) }?;
    out.write(|struct_size| RtCursor::new(struct_size, last));
    Ok(count)
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
    /// The room is valid, and nobody else uses it during the call.
    unsafe fn fill(&self, last: &mut Option<HitKey>) -> Result<usize, Error> {
        let (hits, capacity) = self.room;
        let hits = hits.cast::<Hit>();
        let mut written = 0;
        while written < capacity {
            let size = PART.min(capacity - written);
            // SAFETY: within the room, which the caller promises; a hit of C is one of ours.
            let part = unsafe { filled(hits.wrapping_add(written), size, Hit::MISS) };
            let count = self.accel.hits_after(self.ray, self.options, last, part);
            let count = count.ok_or(Error::NotFound)?;
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
