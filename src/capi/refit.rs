//! Refitting blocks.

use core::ffi::c_void;

use super::guard;
use super::lender::Lender;
use super::scene::CheckedScene;
use super::status::RtStatus;
use super::types::{RtBuildOptions, RtScene};
use super::versioned::pointer;
use crate::caller::Caller;
use crate::refit::refit;
use crate::scene::Scene;

/// Lets the block at the front of `memory` follow `moved`: the scene that was built, with other vertices, spheres or masks.
/// The block was built with `RtBuildOptions.refit`, or opened, in these `size` bytes or copied to them; its accel stays valid.
///
/// Meshes, sphere sets, counts and vertex numbers must be the same. Where things are does not matter: what ceases to be
/// finite or to have an area is ignored, and what was ignored may become visible. Answers are those of a structure that is
/// built anew; `RtInfo.cost_growth` says when building anew is likely to pay. Needs no memory beyond the block, which is
/// untouched unless the status is RT_OK. Nobody traces rays through the block during the call.
///
/// # Safety
///
/// Every pointer is null or valid, as are the scene's; `memory` is valid for `size` bytes, overlaps
/// nothing else that is passed, and nobody else uses it during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_accel_refit(
    memory: *mut c_void,
    size: usize,
    moved: *const RtScene,
) -> RtStatus {
    // SAFETY: the caller's promise.
    unsafe { rt_accel_refit_with(memory, size, moved, core::ptr::null()) }
}

/// The same on the threads that `options` lend; all else in them but `struct_size` is ignored. `options` may be null. The bytes do
/// not depend on the number of threads.
///
/// # Safety
///
/// As for `rt_accel_refit`; `options` is null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_accel_refit_with(
    memory: *mut c_void,
    size: usize,
    moved: *const RtScene,
    options: *const RtBuildOptions,
) -> RtStatus {
    guard(|| {
        // SAFETY: the caller's promise.
        let scene = unsafe { CheckedScene::new(moved) }?;
        // SAFETY: the caller's promise.
        let lender = unsafe { Lender::read(options) }?;
        let memory = pointer(memory.cast::<u8>())?;
        // A slice cannot be longer, and no block is.
        let size = size.min(isize::MAX as usize);
        // SAFETY: valid for `size` bytes and used by nobody else, as the caller promises.
        let bytes = unsafe { core::slice::from_raw_parts_mut(memory.as_ptr(), size) };
        refit(bytes, &Scene::foreign(&scene, &scene), &Caller::new(lender.threads(), None))?;
        Ok(())
    })
}
