//! Whether triangles fit into one leaf block: at most 16, over at most 16 vertices of distinct bits.

use crate::block::leaf::{TRIANGLES, low_bits};
use crate::prim::{Numbers, Vertices};

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
