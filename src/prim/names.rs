//! Vertices by their numbers, where they will move: equal now need not be equal later.

use core::ops::Range;

use super::gather::{GRAIN, Shape};
use crate::caller::Caller;
use crate::scene::{Mesh, Scene};

impl Mesh<'_> {
    /// What stands for a vertex where vertices are compared by their bits: two are the same if they are the same vertex.
    /// `first` is the flat number of the mesh's first triangle.
    #[inline]
    pub(crate) fn name(first: u32, vertex: usize) -> [f32; 3] {
        [f32::from_bits(vertex as u32), f32::from_bits(first), 0.0]
    }

    /// The same for those of triangle `i`.
    #[inline]
    pub(crate) fn names(&self, first: u32, i: usize) -> Option<[[f32; 3]; 3]> {
        Some(self.numbers(i)?.map(|v| Mesh::name(first, v)))
    }
}

/// Knows the vertices of a shape by name, if it is a triangle: its mesh, that one's first triangle and its own number.
#[derive(Clone, Copy)]
pub(crate) struct Names<'m, 'a>(pub Option<(&'m Mesh<'a>, u32, u32)>);

impl Names<'_, '_> {
    /// The shape with names in place of vertices.
    #[inline]
    pub fn of(self, shape: Shape) -> Shape {
        self.corners().map_or(shape, Shape::Triangle)
    }

    /// The names of the corners, if they have any.
    #[inline]
    pub fn corners(self) -> Option<[[f32; 3]; 3]> {
        self.0.and_then(|(mesh, first, i)| mesh.names(first, i as usize))
    }
}

/// A digest of the vertex numbers of all triangles; `None` if one has no vertex. Any change of a number changes it, but
/// for one in 2^64.
pub(crate) fn digest(scene: &Scene, caller: &Caller) -> Option<u64> {
    let mut sum = Some(0u64);
    for (m, mesh) in (0u64..).zip((0..scene.mesh_count()).filter_map(|m| scene.mesh(m))) {
        let count = mesh.triangle_count();
        let digest = |triangles: Range<usize>| {
            triangles.map(|i| triangle_digest(&mesh, m, i)).try_fold(0, add)
        };
        let size = caller.part_size(count, GRAIN);
        caller.for_parts(count, size, digest, |part| sum = sum.and_then(|sum| add(sum, part)));
    }
    sum
}

fn add(sum: u64, more: Option<u64>) -> Option<u64> {
    Some(sum.wrapping_add(more?))
}

/// A few multiplications stir a triangle, its place and its mesh; the sum of all does not depend on their order.
#[inline]
fn triangle_digest(mesh: &Mesh, m: u64, i: usize) -> Option<u64> {
    const ODD: u64 = 0x9E37_79B9_7F4A_7C15;
    let numbers = mesh.numbers(i)?;
    let stir = |state: u64, word: u64| {
        let product = (state ^ word).wrapping_mul(ODD);
        product ^ product >> 32
    };
    let last = numbers.into_iter().fold(0, usize::max);
    let place = stir(m << 32 | i as u64, ODD);
    (last < mesh.vertex_count()).then(|| numbers.into_iter().fold(place, |s, v| stir(s, v as u64)))
}
