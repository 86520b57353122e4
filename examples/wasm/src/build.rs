//! The module `build.wasm`: blocks over a mesh.

use core::mem::MaybeUninit;
use core::slice;

use raykern::{BuildOptions, GridKind, GridOptions, Layout, Mesh, PlainList, Scene};

use crate::mesh::PageMesh;

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
