//! Asking for many rays.

use core::mem::offset_of;

use super::query::query_options;
use super::status::{Error, RtStatus};
use super::types::{RtAccel, RtHit, RtQuery, RtRay};
use super::versioned::pointer;
use super::{accel_at, guard};
use crate::accel::Accel;
use crate::query::QueryOptions;
use crate::ray::{Hit, Ray};

/// `rt_intersect` for `count` rays, on the calling thread: parts of an array may be asked for at the same time. When a pointer is null or
/// the arrays overlap, nothing is written; `rt_intersect_batch_with` says so.
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

/// `rt_occluded` for `count` rays: 1 for a hit, 0 for none. When a pointer is null or the arrays overlap, nothing is
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
/// The arrays do not overlap, or at equal strides each hit lies in the place of its own ray or between two rays; anything else is
/// refused. So hits may take the place of rays, or stand beside them in one struct.
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
/// apart. A stride of 0 means packed. `query` may be null. When refused, nothing is written. Arrays may overlap as above.
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

/// So many rays are read, asked for together and answered before the next, where they lie apart.
const PART: usize = 128;
/// And where they lie side by side, as the library has them: few enough for the answers to stay in the cache, which
/// are written twice.
const SIDE_BY_SIDE: usize = 4096;

/// How the rays of a batch are asked for together, and what stands for no answer yet.
type AskTogether<'m, A> = (A, fn(&Accel<'m>, &[Ray], &QueryOptions, &mut [A]));

/// Asks for each of `count` rays and writes the answers; arrays come with their strides.
///
/// # Safety
///
/// Every pointer is null or valid for `count` elements, and nobody else uses `out` during the call.
unsafe fn batch<'m, A: SameAs<T>, T>(
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
    if count > 0 && !rays.may_be_answered_in(&out, count) {
        return Err(Error::InvalidArgument);
    }
    if rays.is_packed() && out.is_packed() {
        for first in (0..count).step_by(SIDE_BY_SIDE) {
            let size = SIDE_BY_SIDE.min(count - first);
            let (rays, out) = (rays.at(first).cast(), out.at(first).cast_mut().cast());
            // SAFETY: below `count`, and valid as the caller promises; any ray of C is one of ours, and so is an answer.
            let rays = unsafe { core::slice::from_raw_parts(rays, size) };
            // SAFETY: as above; memory of C may never have been written.
            let answers = unsafe { filled(out, size, none) };
            ask(&accel, rays, &options, answers);
        }
        return Ok(());
    }
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

/// An answer that C reads in place.
///
/// # Safety
///
/// Every value is one of `T`, of the same size, alignment and layout.
unsafe trait SameAs<T>: Copy + Into<T> {}

// SAFETY: the layouts are compared below.
unsafe impl SameAs<RtHit> for Hit {}
// SAFETY: true is 1, false is 0, in one byte.
unsafe impl SameAs<u8> for bool {}

/// `size` elements at `at`, all of them `value`.
///
/// # Safety
///
/// They are valid, and nobody else uses them during `'o`.
pub(super) unsafe fn filled<'o, A: Copy>(at: *mut A, size: usize, value: A) -> &'o mut [A] {
    for i in 0..size {
        // SAFETY: the caller's promise.
        unsafe { at.wrapping_add(i).write(value) };
    }
    // SAFETY: the caller's promise, and all were written.
    unsafe { core::slice::from_raw_parts_mut(at, size) }
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

    /// Whether no answer written to `out` takes the place of a ray that is still to be read: the arrays do not overlap, or at equal
    /// strides each answer lies within the reach of its own ray, or between rays.
    fn may_be_answered_in<A>(&self, out: &Column<A>, count: usize) -> bool {
        let (ray, answer, stride) = (self.first.addr(), out.first.addr(), self.stride);
        let end = |first, stride, size| first + (count - 1) * stride + size;
        if end(ray, stride, size_of::<T>()) <= answer
            || end(answer, out.stride, size_of::<A>()) <= ray
        {
            return true;
        }
        if out.stride != stride {
            return false;
        }
        let is_own = answer.checked_sub(ray).is_some_and(|at| at + size_of::<A>() <= stride);
        // How far an answer begins behind the last ray that begins before it.
        let behind = match answer.checked_sub(ray) {
            Some(at) => at.checked_rem(stride),
            None => (ray - answer).checked_rem(stride).map(|before| stride - before),
        };
        let behind = behind.unwrap_or(0);
        is_own || (size_of::<T>() <= behind && behind + size_of::<A>() <= stride)
    }

    fn is_packed(&self) -> bool {
        self.stride == size_of::<T>()
    }

    /// Where element `i` is; `new` has checked that this does not overflow below `count`.
    fn at(&self, i: usize) -> *const T {
        self.first.wrapping_byte_add(i * self.stride)
    }
}

/// A hit of Rust is one of C.
const _: () = {
    assert!(size_of::<RtHit>() == size_of::<Hit>() && align_of::<RtHit>() == align_of::<Hit>());
    assert!(offset_of!(RtHit, t) == offset_of!(Hit, t));
    assert!(offset_of!(RtHit, u) == offset_of!(Hit, u));
    assert!(offset_of!(RtHit, v) == offset_of!(Hit, v));
    assert!(offset_of!(RtHit, prim) == offset_of!(Hit, prim));
    assert!(offset_of!(RtHit, geometry) == offset_of!(Hit, geometry));
    assert!(offset_of!(RtHit, instance) == offset_of!(Hit, instance));
};
