//! Whether triangles fit into one leaf block: at most 16, over at most 16 vertices of distinct bits.

use super::refs::PrimRef;
use crate::block::leaf::{TRIANGLES, low_bits};
use crate::prim::{Known, Numbers, Shapes, Vertices};

/// Tells by the numbers of vertices what surely fits.
pub(super) struct Fits<'s, 'a> {
    shapes: Shapes<'s, 'a>,
    known: Known,
}

impl<'s, 'a> Fits<'s, 'a> {
    pub fn new(shapes: Shapes<'s, 'a>) -> Self {
        Fits { shapes, known: Known::NOTHING }
    }

    /// Whether the triangles of these refs fit into one block. What has other numbers counts as another vertex.
    pub fn are_a_block(&mut self, refs: &[PrimRef]) -> bool {
        let triangles = refs.iter().map(PrimRef::count).sum::<usize>();
        if triangles > TRIANGLES || refs.iter().any(PrimRef::is_sphere) {
            return false;
        }
        self.known.forget();
        let mut vertices = 0;
        refs.iter().all(|r| {
            vertices += self.new_vertices(r);
            vertices <= TRIANGLES
        })
    }

    /// How many vertices of a ref the ones before do not have.
    fn new_vertices(&mut self, r: &PrimRef) -> usize {
        let mut count = 0;
        for id in (r.id()..).take(r.count()) {
            // A strip has two vertices more than triangles.
            let Some((mesh, numbers)) = self.shapes.numbers(id) else { return r.count() + 2 };
            for number in numbers {
                count += usize::from(self.known.find(mesh, number).is_none());
                self.known.learn(mesh, number, 0);
            }
        }
        count
    }
}

/// The distinct vertices of a few triangles.
#[derive(Clone, Copy)]
pub(crate) struct Corners {
    vertices: Vertices,
    count: usize,
}

impl Corners {
    pub const NONE: Corners = Corners { vertices: [[0.0; TRIANGLES]; 3], count: 0 };

    /// Becomes those of a few triangles, which have 16 at the most. In place, as what was just written is slow to copy.
    #[inline]
    pub fn become_those_of(&mut self, triangles: impl Iterator<Item = [[f32; 3]; 3]>) {
        self.count = 0;
        let mut numbers = Numbers::NONE;
        for triangle in triangles {
            for vertex in &triangle {
                numbers.number(&mut self.vertices, vertex, &mut self.count);
            }
        }
    }

    /// Adds the vertices of `other`; false when there would be more than 16.
    pub fn merge(&mut self, other: &Corners) -> bool {
        // The other's differ from each other, so what is added need not be searched; and nothing is
        // added before the last was looked for, as above.
        let is_new = |i: &usize| self.find(self.count, &other.get(*i)) == 0;
        let new = (0..other.count).filter(is_new).fold(0u32, |bits, i| bits | 1 << i);
        if self.count + new.count_ones() as usize > TRIANGLES {
            return false;
        }
        for i in (0..other.count).filter(|i| new >> i & 1 == 1) {
            self.set(self.count, other.get(i));
            self.count += 1;
        }
        true
    }

    fn get(&self, i: usize) -> [f32; 3] {
        let [x, y, z] = &self.vertices;
        [x[i % TRIANGLES], y[i % TRIANGLES], z[i % TRIANGLES]]
    }

    fn set(&mut self, i: usize, vertex: [f32; 3]) {
        for (axis, x) in self.vertices.iter_mut().zip(vertex) {
            axis[i % TRIANGLES] = x;
        }
    }

    /// Which of the first `count` vertices have just these bits, one bit each. All are compared, without
    /// a branch: that is a few vector instructions.
    #[inline]
    fn find(&self, count: usize, vertex: &[f32; 3]) -> u32 {
        let ([xs, ys, zs], [x, y, z]) = (&self.vertices, vertex.map(f32::to_bits));
        // Rows of four, as most machines have vectors of four.
        let mut rows = [0u32; 4];
        for first in (0..count.min(TRIANGLES)).step_by(4) {
            for (lane, row) in rows.iter_mut().enumerate() {
                let i = (first + lane) % TRIANGLES;
                let differs = (xs[i].to_bits() ^ x) | (ys[i].to_bits() ^ y) | (zs[i].to_bits() ^ z);
                *row |= if differs == 0 { 1 << i } else { 0 };
            }
        }
        (rows[0] | rows[1] | rows[2] | rows[3]) & low_bits(count as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Aabb;
    use crate::prim::{Source, geometry_table};
    use crate::scene::{Mesh, Scene};
    use std::vec::Vec;

    #[test]
    fn what_fits_is_told_by_numbers() {
        let vertices = [[0.0; 3]; 40];
        let strip: Vec<_> = (0..17).map(|i| [i, i + 1, i + 2]).collect();
        let fan: Vec<_> = (0..17).map(|i| [30, 30 + i % 5, 31 + i % 5]).collect();
        let soup: Vec<_> = (0..17).map(|_| [[0.0; 3]; 3]).collect();
        let meshes =
            [Mesh::indexed(&vertices, &strip), Mesh::indexed(&vertices, &fan), Mesh::soup(&soup)];
        let scene = Scene::new(&meshes, &[]);
        let geometries: Vec<_> = geometry_table(&scene).collect();
        let source = Source { scene: &scene, geometries: &geometries, named: false };
        let mut fits = Fits::new(source.shapes());
        let mut fit = |firsts: core::ops::Range<u32>, strip: u32, sphere: bool| {
            let refs: Vec<_> = (firsts.step_by(strip as usize))
                .map(|id| {
                    let mut r = PrimRef::new(id, &Aabb::EMPTY, sphere);
                    r.bounds.upper[3] *= strip as f32;
                    r
                })
                .collect();
            fits.are_a_block(&refs)
        };
        for _ in 0..2 {
            assert!(fit(0..14, 1, false) && !fit(0..15, 1, false), "16 and 17 vertices");
            assert!(fit(0..14, 2, false), "in pairs");
            assert!(fit(17..33, 1, false) && !fit(17..34, 1, false), "16 and 17 triangles");
            assert!(fit(34..39, 1, false) && !fit(34..40, 1, false), "three vertices each");
            assert!(fit(34..42, 2, false) && !fit(34..44, 2, false), "four vertices a pair");
            assert!(!fit(0..2, 1, true), "spheres");
        }
    }

    fn triangles(vertices: &[[f32; 3]]) -> impl Iterator<Item = [[f32; 3]; 3]> {
        vertices.chunks_exact(3).map(|v| [v[0], v[1], v[2]])
    }

    #[test]
    fn sixteen_vertices_fit_and_equal_bits_count_once() {
        let vertex = |i: usize| [i as f32, 0.0, 1.0];
        let fifteen: [_; 15] = core::array::from_fn(vertex);
        let of = |vertices: &[[f32; 3]]| {
            let mut corners = Corners::NONE;
            corners.become_those_of(triangles(vertices));
            corners
        };
        let mut corners = of(&fifteen);
        let one = |extra| of(&[extra, vertex(3), vertex(4)]);
        assert!(corners.merge(&corners.clone()) && corners.count == 15);
        assert!(corners.merge(&one(vertex(15))) && corners.count == 16);
        assert!(corners.merge(&one(vertex(15))), "known");
        assert!(!corners.clone().merge(&one([3.0, -0.0, 1.0])), "other bits");
        assert!(!corners.clone().merge(&one([3.0, 0.0, 2.0])), "the seventeenth");
        let twice = of(&[1, 2, 3, 3, 1, 4].map(vertex));
        assert_eq!(twice.count, 4);
    }
}
