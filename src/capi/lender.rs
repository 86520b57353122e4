//! Build options from C: choices, and what the caller lends to a build.

use core::ffi::c_void;
use core::sync::atomic::{AtomicBool, Ordering};

use super::control;
use super::status::Error;
use super::types::{
    RT_GRID_NESTED, RT_GRID_OCTREE, RT_GRID_UNIFORM, RT_LAYOUT_AUTOMATIC, RT_LAYOUT_COMPACT,
    RT_LAYOUT_WIDE_4, RT_LAYOUT_WIDE_8, RT_LAYOUT_WIDE_16, RT_PLAIN_LIST_ALWAYS,
    RT_PLAIN_LIST_AUTOMATIC, RT_PLAIN_LIST_NEVER, RT_QUALITY_BALANCED, RT_QUALITY_BEST,
    RT_QUALITY_FAST, RtBuildOptions,
};
use super::{stopping_panics, versioned};
use crate::accel::Layout;
use crate::build::{BuildOptions, PlainList, Quality};
use crate::caller::Threads;
use crate::grid::{GridKind, GridOptions};
use crate::kinds::THREADS;

/// A C caller during a build.
pub(super) struct Lender(Option<RtBuildOptions>);

// SAFETY: tasks that run on other threads do not reach it: the only thread that calls the caller's
// functions, and hands `user` to them, is the one that builds.
unsafe impl Sync for Lender {}

impl Lender {
    /// The options at `options`; null means the default ones.
    ///
    /// # Safety
    ///
    /// `options` is null or valid; its functions may be called with its `user` while it lives, and
    /// `parallel_for` calls its task as `RtParallelFor` says.
    pub unsafe fn read(options: *const RtBuildOptions) -> Result<Lender, Error> {
        if options.is_null() {
            return Ok(Lender(None));
        }
        // SAFETY: the caller's promise.
        Ok(Lender(Some(unsafe { versioned::read(options) }?)))
    }

    /// What says how far a build is.
    pub fn progress(&self) -> impl Fn(f32) -> bool + '_ {
        |done| {
            let call = self.0.as_ref().and_then(|raw| Some((raw.progress?, raw.user)));
            // SAFETY: the caller's function with what belongs to it, as promised to `read`.
            call.is_none_or(|(progress, user)| unsafe { progress(user, done) })
        }
    }

    /// The threads that are lent.
    pub fn threads(&self) -> Option<&dyn Threads> {
        let lends = self.0.as_ref().is_some_and(|raw| THREADS && raw.parallel_for.is_some());
        if lends { Some(self) } else { None }
    }

    /// The options as a build takes them.
    pub fn options<'l>(
        &'l self,
        progress: &'l dyn Fn(f32) -> bool,
    ) -> Result<BuildOptions<'l>, Error> {
        let Some(raw) = &self.0 else { return Ok(BuildOptions::default()) };
        let quality = match raw.quality {
            RT_QUALITY_BALANCED => Quality::Balanced,
            RT_QUALITY_FAST => Quality::Fast,
            RT_QUALITY_BEST => Quality::Best,
            _ => return Err(Error::InvalidArgument),
        };
        let layout = match raw.layout {
            RT_LAYOUT_AUTOMATIC => Layout::Automatic,
            RT_LAYOUT_COMPACT => Layout::Compact,
            RT_LAYOUT_WIDE_4 | RT_LAYOUT_WIDE_8 | RT_LAYOUT_WIDE_16 => Layout::Wide(raw.layout),
            _ => return Err(Error::InvalidArgument),
        };
        let refit = match raw.refit {
            0 => false,
            1 => true,
            _ => return Err(Error::InvalidArgument),
        };
        let plain_list = match raw.plain_list {
            RT_PLAIN_LIST_AUTOMATIC => PlainList::Automatic,
            RT_PLAIN_LIST_NEVER => PlainList::Never,
            RT_PLAIN_LIST_ALWAYS => PlainList::Always,
            _ => return Err(Error::InvalidArgument),
        };
        let (threads, progress) = (self.threads(), Some(progress));
        let (grid, rays_per_prim) = (grid_options(raw)?, raw.rays_per_prim);
        // Written so that a NaN is refused.
        if !(rays_per_prim >= 0.0) {
            return Err(Error::InvalidArgument);
        }
        Ok(BuildOptions {
            quality,
            layout,
            refit,
            plain_list,
            grid,
            rays_per_prim,
            threads,
            progress,
        })
    }
}

/// What the options say of grids.
fn grid_options(raw: &RtBuildOptions) -> Result<GridOptions, Error> {
    let kind = match raw.grid_kind {
        RT_GRID_NESTED => GridKind::Nested,
        RT_GRID_UNIFORM => GridKind::Uniform,
        RT_GRID_OCTREE => GridKind::Octree,
        _ => return Err(Error::InvalidArgument),
    };
    let options = GridOptions { kind, density: raw.grid_density, depth: raw.grid_depth };
    if options.are_in_range() { Ok(options) } else { Err(Error::InvalidArgument) }
}

/// A task, as `context` points to it.
struct Task<'t> {
    task: &'t (dyn Fn(u32) + Sync),
    /// Whether one panicked, which must not reach the caller's thread.
    failed: AtomicBool,
}

/// Runs a task on a thread of the caller's, whose floating-point state may be any.
///
/// # Safety
///
/// `context` is what `parallel_for` was given, and that call has not returned.
unsafe extern "C" fn run(context: *mut c_void, index: u32) {
    // SAFETY: it points to the task of a call that waits.
    let Task { task, failed } = unsafe { &*context.cast_const().cast::<Task>() };
    if control::with_default(|| stopping_panics(|| task(index))).is_none() {
        failed.store(true, Ordering::Relaxed);
    }
}

impl Threads for Lender {
    fn worker_count(&self) -> usize {
        self.0.as_ref().map_or(1, |raw| raw.worker_count as usize)
    }

    fn parallel_for(&self, count: u32, task: &(dyn Fn(u32) + Sync)) {
        if let Some(raw) = &self.0
            && let Some(parallel_for) = raw.parallel_for
        {
            let task = Task { task, failed: AtomicBool::new(false) };
            let context = core::ptr::from_ref(&task).cast_mut().cast();
            // SAFETY: the caller's function with what belongs to it, as promised to `read`.
            unsafe { parallel_for(raw.user, count, Some(run), context) };
            // On this thread it can be told. Without std it does not come back.
            #[cfg(feature = "std")]
            assert!(!task.failed.into_inner(), "a task panicked");
        }
    }
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use super::super::types::RtTask;
    use super::*;

    unsafe extern "C" fn backwards(_: *mut c_void, count: u32, task: RtTask, context: *mut c_void) {
        for i in (0..count).rev() {
            // SAFETY: as it was given.
            unsafe { task.expect("a task")(context, i) };
        }
    }

    #[test]
    fn a_task_that_panics_is_told_to_the_build_and_not_to_the_thread() {
        // SAFETY: zeros are a value of it.
        let zero = unsafe { core::mem::zeroed::<RtBuildOptions>() };
        let raw = RtBuildOptions {
            struct_size: size_of::<RtBuildOptions>() as u32,
            worker_count: 2,
            parallel_for: Some(backwards),
            ..zero
        };
        // SAFETY: valid, and its function does as it should.
        let lender = unsafe { Lender::read(&raw) }.expect("options");
        let ran = AtomicBool::new(false);
        let all = |bad: u32| {
            lender.parallel_for(5, &|i| {
                assert!(i != bad, "on purpose");
                if i == 0 {
                    ran.store(true, Ordering::Relaxed);
                }
            });
        };
        assert!(stopping_panics(|| all(9)).is_some() && ran.swap(false, Ordering::Relaxed));
        assert!(stopping_panics(|| all(3)).is_none() && ran.into_inner(), "the others ran");
    }
}
