//! A mesh by address.

use core::slice;

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
    pub unsafe fn parts<'a>(&self) -> (&'a [[f32; 3]], &'a [[u32; 3]]) {
        // SAFETY: the caller's promise.
        let vertices = unsafe { slice::from_raw_parts(self.vertices, self.vertex_count) };
        // SAFETY: likewise.
        (vertices, unsafe { slice::from_raw_parts(self.indices, self.triangle_count) })
    }
}
