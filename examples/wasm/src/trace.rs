//! The module `page.wasm`: a picture of a block.

use core::slice;

use raykern::Accel;

use crate::mesh::PageMesh;
use crate::picture::{Camera, Shown};

/// Traces the picture of a block into `pixels`, one word each; returns the steps that rays took, or -1 if there is no block.
///
/// # Safety
///
/// All of it is there, and nobody else uses the pixels.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn trace(
    mesh: &PageMesh,
    block: *const u8,
    size: usize,
    camera: &Camera,
    pixels: *mut u32,
) -> f64 {
    // SAFETY: the caller's promise.
    let (vertices, indices) = unsafe { mesh.parts() };
    // SAFETY: the caller's promise.
    let block = unsafe { slice::from_raw_parts(block, size) };
    // SAFETY: the caller's promise.
    let pixels = unsafe { slice::from_raw_parts_mut(pixels, camera.pixel_count()) };
    let Ok(accel) = Accel::open(block) else { return -1.0 };
    Shown { accel, vertices, indices }.trace(camera, pixels)
}
