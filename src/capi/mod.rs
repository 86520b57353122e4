//! The C face: checks, converts, calls. No geometry lives here.
//!
//! `build.rs` makes `include/raykern.h` of these files. Every entry point passes through [`guard`]
//! or [`answer`], which set the caller's floating-point state aside and stop panics.

// Unit tests link the harness, and with it the names of entry points already.
#[cfg(not(test))]
mod batch;
#[cfg(not(test))]
mod build;
#[cfg(not(test))]
mod closest;
#[cfg(not(test))]
mod hits;
#[cfg(not(test))]
mod query;
#[cfg(not(test))]
mod refit;
#[cfg(not(test))]
mod version;

mod control;
mod lender;
mod scene;
mod status;
mod types;
mod versioned;

use crate::accel::Accel;
use crate::storage::ALIGNMENT;
use status::{Error, RT_OK, RtStatus};
use types::RtAccel;

/// Runs an entry point that returns a status.
#[inline]
fn guard(work: impl FnOnce() -> Result<(), Error>) -> RtStatus {
    let result = control::with_default(|| stopping_panics(work));
    match result.unwrap_or(Err(Error::Internal)) {
        Ok(()) => RT_OK,
        Err(error) => error.status(),
    }
}

/// Runs an entry point that returns an answer; after a panic it is `otherwise`.
#[inline]
fn answer<R>(work: impl FnOnce() -> R, otherwise: R) -> R {
    control::with_default(move || stopping_panics(work)).unwrap_or(otherwise)
}

/// What `work` returns, or `None` when it panicked.
///
/// Whatever `work` was writing to is memory of the caller, who is told that it failed, so nobody
/// sees a value that was left half-finished.
#[cfg(feature = "std")]
fn stopping_panics<R>(work: impl FnOnce() -> R) -> Option<R> {
    std::panic::catch_unwind(std::panic::AssertUnwindSafe(work)).ok()
}

/// Without std a panic cannot be caught: it ends in the panic handler and does not come back.
#[cfg(not(feature = "std"))]
#[inline]
fn stopping_panics<R>(work: impl FnOnce() -> R) -> Option<R> {
    Some(work())
}

/// The accel at a pointer from C.
///
/// # Safety
///
/// `accel` is null, or it is what a build, `rt_accel_open` or `rt_accel_pack` returned, or a copy of
/// that block, and nobody writes to it during `'m`.
#[cfg_attr(target_os = "none", inline(never))]
#[cfg_attr(not(target_os = "none"), inline(always))]
unsafe fn accel_at<'m>(accel: *const RtAccel) -> Result<Accel<'m>, Error> {
    if accel.is_null() {
        return Err(Error::NullPointer);
    }
    if !accel.addr().is_multiple_of(ALIGNMENT) {
        return Err(Error::Misaligned);
    }
    // SAFETY: not null, aligned, and a block as the caller promises.
    unsafe { Accel::from_ptr(accel.cast()) }.ok_or(Error::NotABlock)
}

/// Stops the thread: without std there is nothing to unwind with, nobody to tell, and no way out
/// that a library may take.
#[cfg(all(feature = "capi-panic", not(any(feature = "std", test))))]
#[panic_handler]
fn stop(_: &core::panic::PanicInfo) -> ! {
    loop {
        core::hint::spin_loop();
    }
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use super::*;
    use status::RT_ERROR_INTERNAL;

    #[test]
    fn panics_stop_at_the_boundary() {
        assert_eq!(guard(|| panic!("on purpose")), RT_ERROR_INTERNAL);
        assert_eq!(answer(|| panic!("on purpose"), 7), 7);
        assert_eq!(guard(|| Ok(())), RT_OK);
    }
}
