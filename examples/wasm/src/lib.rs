//! What the page asks of the library: it builds a structure over the page's mesh and traces rows of a picture.
//!
//! All memory is the page's, by address; there are no variables.

#![no_std]

mod picture;

use core::mem::MaybeUninit;
use core::slice;

use picture::{Camera, Shown};
use raykern::{Accel, BuildOptions, GridKind, GridOptions, Layout, Mesh, PlainList, Scene};

#[panic_handler]
fn panicked(_: &core::panic::PanicInfo) -> ! {
    core::arch::wasm32::unreachable()
}

/// A mesh in the page's memory.
#[repr(C)]
pub struct PageMesh {
    vertices: *const [f32; 3],
    vertex_count: usize,
    indices: *const [u32; 3],
    triangle_count: usize,
}

impl PageMesh {
    /// # Safety
    ///
    /// The arrays are there, and nobody writes to them meanwhile.
    unsafe fn parts<'a>(&self) -> (&'a [[f32; 3]], &'a [[u32; 3]]) {
        // SAFETY: the caller's promise.
        let vertices = unsafe { slice::from_raw_parts(self.vertices, self.vertex_count) };
        // SAFETY: likewise.
        (vertices, unsafe { slice::from_raw_parts(self.indices, self.triangle_count) })
    }
}

/// The structures: 0 BVH, 1 nested grids, 2 one grid.
fn options(structure: u32) -> (bool, BuildOptions<'static>) {
    let kind = if structure == 2 { GridKind::Uniform } else { GridKind::Nested };
    let options = BuildOptions {
        layout: Layout::Compact,
        plain_list: PlainList::Never,
        grid: GridOptions { kind, ..GridOptions::default() },
        ..BuildOptions::default()
    };
    (structure != 0, options)
}

/// The bytes that a build wants; 0 if it cannot be.
///
/// # Safety
///
/// The mesh is there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn needs(mesh: &PageMesh, structure: u32) -> usize {
    // SAFETY: the caller's promise.
    let (vertices, indices) = unsafe { mesh.parts() };
    let meshes = [Mesh::indexed(vertices, indices)];
    let (scene, (grid, options)) = (Scene::new(&meshes, &[]), options(structure));
    let needs = if grid { raykern::grid_needs } else { raykern::bvh_needs };
    needs(&scene, &options).map_or(0, |memory| memory.size)
}

/// Builds into `size` bytes, a multiple of 64 away from address 0; returns the bytes of the block, or 0.
///
/// # Safety
///
/// Mesh and memory are there, and nobody else uses the memory.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn build(
    mesh: &PageMesh,
    structure: u32,
    memory: *mut MaybeUninit<u8>,
    size: usize,
) -> usize {
    // SAFETY: the caller's promise.
    let (vertices, indices) = unsafe { mesh.parts() };
    // SAFETY: the caller's promise.
    let memory = unsafe { slice::from_raw_parts_mut(memory, size) };
    let meshes = [Mesh::indexed(vertices, indices)];
    let (scene, (grid, options)) = (Scene::new(&meshes, &[]), options(structure));
    let build = if grid { raykern::build_grid } else { raykern::build_bvh };
    build(&scene, &options, memory).map_or(0, |accel| accel.block().len())
}

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
