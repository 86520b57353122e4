//! Vertices that were just seen, by their numbers in meshes.

use crate::block::leaf::TRIANGLES;
use crate::kinds::WIDE;

/// Places of the table, a power of two. Only builds of wide layouts ask it; what they make depends on it.
const PLACES: usize = if WIDE { 64 } else { 1 };

/// The vertices of a few triangles: a table that forgets one where another wants its place.
pub(crate) struct Known {
    /// Mesh and number; and how often all was forgotten before, with the place among the vertices.
    entries: [(u64, u64); PLACES],
    /// From 1 on, so that nothing is known at first.
    times: u64,
}

impl Known {
    pub const NOTHING: Known = Known { entries: [(0, 0); PLACES], times: 1 };

    pub fn forget(&mut self) {
        self.times += 1;
    }

    /// The place, below 16, of vertex `number` of the mesh whose first triangle is `mesh`.
    #[inline(always)]
    pub fn find(&self, mesh: u32, number: usize) -> Option<usize> {
        let (vertex, place) = self.entries[number & (PLACES - 1)];
        let known = (vertex == name(mesh, number)) & (place / TRIANGLES as u64 == self.times);
        known.then_some(place as usize % TRIANGLES)
    }

    #[inline(always)]
    pub fn learn(&mut self, mesh: u32, number: usize, place: usize) {
        let place = self.times * TRIANGLES as u64 + (place % TRIANGLES) as u64;
        self.entries[number & (PLACES - 1)] = (name(mesh, number), place);
    }
}

#[inline(always)]
fn name(mesh: u32, number: usize) -> u64 {
    u64::from(mesh) << 32 | number as u64
}
