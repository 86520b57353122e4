//! Shapes by their flat numbers.

use super::gather::{Shape, sphere};
use crate::block::Geometry;
use crate::kinds::{INSTANCES, REFIT, SPHERES};
use crate::query::geometry_of;
use crate::scene::{Mesh, Scene};
use crate::simd::prefetch;

/// So many ids ahead shapes are fetched: about one fetch from memory takes as long.
const AHEAD: usize = 16;

/// Where shapes are looked up.
#[derive(Clone, Copy)]
pub(crate) struct Source<'s, 'a> {
    pub scene: &'s Scene<'a, 'a>,
    pub geometries: &'s [Geometry],
    /// Whether triangles shall have the [names](Mesh::names) of their vertices in place of these.
    pub named: bool,
}

impl<'s, 'a> Source<'s, 'a> {
    pub fn shapes(self) -> Shapes<'s, 'a> {
        Shapes { source: self, mesh: None }
    }
}

/// Finds shapes by their flat numbers, quickly if the next one is of the same mesh.
pub(crate) struct Shapes<'s, 'a> {
    source: Source<'s, 'a>,
    mesh: Option<(u32, Mesh<'a>)>,
}

impl<'s, 'a> Shapes<'s, 'a> {
    /// Has shapes fetched that come soon: first the indices, then what they name. `next` gives the number of the shape
    /// that comes so many later.
    #[inline]
    pub fn look_ahead(&self, next: impl Fn(usize) -> Option<u32>) {
        if let Some(id) = next(2 * AHEAD) {
            self.prefetch(id);
        }
        if let Some(id) = next(AHEAD) {
            self.prefetch_vertices(id);
        }
    }

    /// Has the indices of a shape fetched into the cache, if it is of the last one's mesh.
    #[inline]
    pub fn prefetch(&self, id: u32) {
        let Some((first, mesh)) = &self.mesh else { return };
        if let Some(index) = mesh.first_index(id.wrapping_sub(*first) as usize) {
            prefetch(index);
        }
    }

    /// Has the vertices of a shape fetched, if it is of the last one's mesh; its indices had better be in the cache.
    #[inline]
    fn prefetch_vertices(&self, id: u32) {
        let Some((first, mesh)) = &self.mesh else { return };
        if let Some(vertices) = mesh.first_words(id.wrapping_sub(*first) as usize) {
            vertices.into_iter().for_each(prefetch);
        }
    }

    /// The numbers of a triangle's vertices, if they have any, and the first triangle of its mesh.
    #[inline]
    pub fn numbers(&mut self, id: u32) -> Option<(u32, [usize; 3])> {
        let found = self.numbered(id)?;
        let indexed = self.mesh.as_ref().is_some_and(|(_, mesh)| mesh.is_indexed());
        indexed.then_some(found)
    }

    /// The places of a triangle's vertices in its mesh, which becomes the last one, and the first triangle of that.
    #[inline(always)]
    pub fn numbered(&mut self, id: u32) -> Option<(u32, [usize; 3])> {
        let of_last = |(first, mesh): &(u32, Mesh)| {
            Some((*first, mesh.numbers(id.checked_sub(*first)? as usize)?))
        };
        if let Some(found) = self.mesh.as_ref().and_then(of_last) {
            return Some(found);
        }
        self.find(id)?;
        self.mesh.as_ref().and_then(of_last)
    }

    /// A vertex of the last one's mesh.
    #[inline(always)]
    pub fn vertex(&self, number: usize) -> Option<[f32; 3]> {
        let (first, mesh) = self.mesh.as_ref()?;
        if REFIT && self.source.named {
            return Some(Mesh::name(*first, number));
        }
        mesh.vertex(number)
    }

    /// The shape with flat number `id`, whether it can be hit or not.
    #[inline]
    pub fn get(&mut self, id: u32) -> Option<Shape> {
        self.corners(id).map(Shape::Triangle).or_else(|| self.find(id))
    }

    /// The corners of a triangle of the last one's mesh: they are not read from a [`Shape`], which would lie in memory.
    #[inline(always)]
    pub fn corners(&self, id: u32) -> Option<[[f32; 3]; 3]> {
        let (first, mesh) = self.mesh.as_ref()?;
        self.triangle(*first, mesh, id.checked_sub(*first)?)
    }

    #[inline(always)]
    fn triangle(&self, first: u32, mesh: &Mesh, i: u32) -> Option<[[f32; 3]; 3]> {
        if REFIT && self.source.named {
            mesh.names(first, i as usize)
        } else {
            mesh.triangle(i as usize)
        }
    }

    #[cold]
    fn find(&mut self, id: u32) -> Option<Shape> {
        let Source { scene, geometries, .. } = self.source;
        if let Some(boxes) = scene.boxes().filter(|_| INSTANCES) {
            return Some(Shape::Box(boxes.aabb(id as usize)));
        }
        let (number, geometry) = geometry_of(id, geometries)?;
        let (number, first) = (number as usize, geometry.first);
        let prim = id - first;
        self.mesh = scene.mesh(number).map(|mesh| (first, mesh));
        match number.checked_sub(scene.mesh_count()) {
            None => self.triangle(first, &scene.mesh(number)?, prim).map(Shape::Triangle),
            Some(_) if !SPHERES => None,
            Some(set) => scene.sphere_set(set)?.sphere(prim as usize).map(sphere),
        }
    }
}
