//! Building, opening and copying blocks.

use core::mem::MaybeUninit;

use super::lender::Lender;
use super::scene::CheckedScene;
use super::status::{Error, RtStatus};
use super::types::{
    RT_KIND_BVH, RT_KIND_GRID, RT_KIND_LIST, RT_LAYOUT_COMPACT, RtAccel, RtBuildOptions, RtInfo,
    RtMemory, RtScene,
};
use super::versioned::{Output, pointer};
use super::{accel_at, guard};
use crate::accel::{Accel, Info, Kind, Layout};
use crate::build::{BuildOptions, Memory, build_bvh, build_grid, bvh_needs, grid_needs};
use crate::error::BuildError;
use crate::scene::Scene;
use crate::storage::ALIGNMENT;

/// Writes to `*out` the memory that `rt_build_bvh` needs for `scene`. `options` may be null.
///
/// # Safety
///
/// Every pointer is null or valid, as are the scene's; nobody else uses `*out` during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_bvh_needs(
    scene: *const RtScene,
    options: *const RtBuildOptions,
    out: *mut RtMemory,
) -> RtStatus {
    // SAFETY: the caller's promise.
    guard(|| unsafe { needs(scene, options, out, bvh_needs) })
}

/// Writes to `*out` the memory that `rt_build_grid` needs for `scene`. `options` may be null.
///
/// # Safety
///
/// Every pointer is null or valid, as are the scene's; nobody else uses `*out` during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_grid_needs(
    scene: *const RtScene,
    options: *const RtBuildOptions,
    out: *mut RtMemory,
) -> RtStatus {
    // SAFETY: the caller's promise.
    guard(|| unsafe { needs(scene, options, out, grid_needs) })
}

/// Writes to `*out` the memory that `rt_build` needs for `scene`. `options` may be null.
///
/// # Safety
///
/// Every pointer is null or valid, as are the scene's; nobody else uses `*out` during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_needs(
    scene: *const RtScene,
    options: *const RtBuildOptions,
    out: *mut RtMemory,
) -> RtStatus {
    // SAFETY: the caller's promise.
    guard(|| unsafe { needs(scene, options, out, crate::build::needs) })
}

/// Builds a bounding volume hierarchy over `scene` in `memory`, which has `size` bytes and starts at
/// a multiple of 64. `options` may be null.
///
/// When refused, nothing is written; when cancelled, `memory` holds no structure.
///
/// With less than the `size` of `rt_bvh_needs` leaf blocks are fewer and fuller, and in the last
/// resort the layout is compact; `rt_accel_info` says which it is.
///
/// The finished block lies at the front of `memory`, and `*out` is its first byte; what lies behind
/// `rt_accel_size` bytes may be used again. The scene is copied and no longer needed.
///
/// # Safety
///
/// Every pointer is null or valid, as are the scene's; `memory` is valid for `size` bytes, overlaps
/// nothing else that is passed, and nobody else uses it or `*out` during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_build_bvh(
    scene: *const RtScene,
    options: *const RtBuildOptions,
    memory: *mut core::ffi::c_void,
    size: usize,
    out: *mut *const RtAccel,
) -> RtStatus {
    // SAFETY: the caller's promise.
    guard(|| unsafe { build(scene, options, memory.cast(), size, out, build_bvh) })
}

/// Builds what is likely to take the least time, building it and tracing `options->rays_per_prim` rays for each primitive: a
/// list, a grid or a BVH; `rt_accel_info` says which it is. All else as `rt_build_bvh`.
///
/// # Safety
///
/// As for `rt_build_bvh`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_build(
    scene: *const RtScene,
    options: *const RtBuildOptions,
    memory: *mut core::ffi::c_void,
    size: usize,
    out: *mut *const RtAccel,
) -> RtStatus {
    // SAFETY: the caller's promise.
    guard(|| unsafe { build(scene, options, memory.cast(), size, out, crate::build::build) })
}

/// Builds a grid, of the kind that the options name: all else as `rt_build_bvh`. With less memory it is coarser, in the last
/// resort one cell.
///
/// # Safety
///
/// As for `rt_build_bvh`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_build_grid(
    scene: *const RtScene,
    options: *const RtBuildOptions,
    memory: *mut core::ffi::c_void,
    size: usize,
    out: *mut *const RtAccel,
) -> RtStatus {
    // SAFETY: the caller's promise.
    guard(|| unsafe { build(scene, options, memory.cast(), size, out, build_grid) })
}

/// The bytes of the block that begins at `accel`: what to copy or save, unless it refers to others. 0 for null, and for what is no
/// block.
///
/// # Safety
///
/// `accel` is null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_accel_size(accel: *const RtAccel) -> usize {
    // SAFETY: the caller's promise.
    super::answer(|| unsafe { accel_at(accel) }.map_or(0, |accel| accel.block().len()), 0)
}

/// Writes to `*out` what the block holds. `out->struct_size` must be set.
///
/// # Safety
///
/// Both pointers are null or valid, and nobody else uses `*out` during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_accel_info(accel: *const RtAccel, out: *mut RtInfo) -> RtStatus {
    guard(|| {
        // SAFETY: the caller's promise.
        let accel = unsafe { accel_at(accel) }?;
        // SAFETY: the caller's promise.
        let out = unsafe { Output::new(out) }?;
        out.write(|struct_size| RtInfo::new(struct_size, &accel.info()));
        Ok(())
    })
}

/// Opens a block that was built earlier, perhaps elsewhere, after checking it from end to end. It
/// stays where it is, at a multiple of 64 bytes; `size` may be larger than the block.
///
/// Whatever is accepted can be queried safely; whether it still describes the scene is not known.
///
/// # Safety
///
/// `block` is null or valid for reads of `size` bytes for as long as the accel is used, and nobody
/// writes to it during that time; `out` is null or valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_accel_open(
    block: *const core::ffi::c_void,
    size: usize,
    out: *mut *const RtAccel,
) -> RtStatus {
    guard(|| {
        let block = pointer(block.cast::<u8>())?;
        let out = pointer(out)?;
        // A slice cannot be longer, and no block is.
        let size = size.min(isize::MAX as usize);
        // SAFETY: the caller's promise.
        let bytes = unsafe { core::slice::from_raw_parts(block.as_ptr(), size) };
        let accel = Accel::open(bytes)?;
        // SAFETY: not null, aligned, and valid as the caller promises.
        unsafe { out.write(accel.block().as_ptr().cast()) };
        Ok(())
    })
}

/// Writes to `*out` the memory that `rt_accel_pack` needs.
///
/// # Safety
///
/// Both pointers are null or valid, and nobody else uses `*out` during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_accel_pack_needs(
    accel: *const RtAccel,
    out: *mut RtMemory,
) -> RtStatus {
    guard(|| {
        // SAFETY: the caller's promise.
        let Memory { size, minimum, alignment } = unsafe { accel_at(accel) }?.pack_needs()?;
        let out = pointer(out)?;
        // SAFETY: not null, aligned, and valid as the caller promises.
        unsafe { out.write(RtMemory { size, minimum, alignment }) };
        Ok(())
    })
}

/// Writes the accel, with everything it refers to, as one block into `memory`, which has `size`
/// bytes and starts at a multiple of 64: the accel of each instance once, however many show it. A block that refers to
/// nothing is copied.
///
/// `memory` may overlap an accel that refers to nothing, for example to move it to a tighter place; the old one is then
/// gone. It must not overlap one that refers to others, nor these.
///
/// # Safety
///
/// Every pointer is null or valid, `memory` for `size` bytes, and nobody else uses it or `*out`
/// during the call.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rt_accel_pack(
    accel: *const RtAccel,
    memory: *mut core::ffi::c_void,
    size: usize,
    out: *mut *const RtAccel,
) -> RtStatus {
    guard(|| {
        let (is_linked, needed) = {
            // SAFETY: the caller's promise.
            let accel = unsafe { accel_at(accel) }?;
            (accel.is_linked(), accel.pack_needs()?.size)
        };
        let memory = pointer(memory.cast::<u8>())?;
        let out = pointer(out)?;
        if memory.addr().get() % ALIGNMENT != 0 {
            return Err(Error::Misaligned);
        }
        if size < needed {
            return Err(Error::OutOfMemory);
        }
        if is_linked {
            // SAFETY: valid for `needed` bytes, and no part of an accel, as the caller promises.
            let memory = unsafe { core::slice::from_raw_parts_mut(memory.as_ptr().cast(), needed) };
            // SAFETY: the caller's promise.
            unsafe { accel_at(accel) }?.pack(memory)?;
        } else {
            // SAFETY: both are valid for `needed` bytes; they may overlap.
            unsafe { memory.as_ptr().copy_from(accel.cast(), needed) };
        }
        // SAFETY: not null, aligned, and valid as the caller promises.
        unsafe { out.write(memory.as_ptr().cast_const().cast()) };
        Ok(())
    })
}

type Needs = fn(&Scene, &BuildOptions) -> Result<Memory, BuildError>;
type Build = for<'m> fn(
    &Scene<'_, 'm>,
    &BuildOptions,
    &'m mut [MaybeUninit<u8>],
) -> Result<Accel<'m>, BuildError>;

/// # Safety
///
/// As for `rt_bvh_needs`.
unsafe fn needs(
    scene: *const RtScene,
    options: *const RtBuildOptions,
    out: *mut RtMemory,
    needs: Needs,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    let scene = unsafe { CheckedScene::new(scene) }?;
    // SAFETY: the caller's promise.
    let lender = unsafe { Lender::read(options) }?;
    let progress = lender.progress();
    let options = lender.options(&progress)?;
    let out = pointer(out)?;
    let Memory { size, minimum, alignment } = needs(&Scene::foreign(&scene, &scene), &options)?;
    // SAFETY: not null, aligned, and valid as the caller promises.
    unsafe { out.write(RtMemory { size, minimum, alignment }) };
    Ok(())
}

/// # Safety
///
/// As for `rt_build_bvh`.
unsafe fn build(
    scene: *const RtScene,
    options: *const RtBuildOptions,
    memory: *mut MaybeUninit<u8>,
    size: usize,
    out: *mut *const RtAccel,
    build: Build,
) -> Result<(), Error> {
    // SAFETY: the caller's promise.
    let scene = unsafe { CheckedScene::new(scene) }?;
    // SAFETY: the caller's promise.
    let lender = unsafe { Lender::read(options) }?;
    let progress = lender.progress();
    let options = lender.options(&progress)?;
    let memory = pointer(memory)?;
    let out = pointer(out)?;
    // A slice cannot be longer, and no build needs more.
    let size = size.min(isize::MAX as usize);
    // SAFETY: valid for `size` bytes and used by nobody else, as the caller promises.
    let memory = unsafe { core::slice::from_raw_parts_mut(memory.as_ptr(), size) };
    let accel = build(&Scene::foreign(&scene, &scene), &options, memory)?;
    // SAFETY: not null, aligned, and valid as the caller promises.
    unsafe { out.write(accel.block().as_ptr().cast()) };
    Ok(())
}

impl RtInfo {
    fn new(struct_size: u32, info: &Info) -> RtInfo {
        let kind = match info.kind {
            Kind::List => RT_KIND_LIST,
            Kind::Grid => RT_KIND_GRID,
            Kind::Bvh => RT_KIND_BVH,
        };
        let layout = match info.layout {
            Layout::Automatic | Layout::Compact => RT_LAYOUT_COMPACT,
            Layout::Wide(width) => width,
        };
        RtInfo {
            struct_size,
            kind,
            layout,
            lower: info.lower,
            upper: info.upper,
            triangle_count: info.triangle_count,
            sphere_count: info.sphere_count,
            instance_count: info.instance_count,
            ignored_count: info.ignored_count,
            resolution: info.resolution,
            size: info.size,
            structure_size: info.structure_size,
            leaf_size: info.leaf_size,
            id_size: info.id_size,
            refit: info.cost_growth.is_some().into(),
            cost_growth: info.cost_growth.unwrap_or(0.0),
        }
    }
}
