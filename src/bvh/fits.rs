//! Whether triangles fit into one leaf block: at most 16, over at most 16 vertices of distinct bits.

use crate::block::leaf::TRIANGLES;

/// The distinct vertices of a few triangles, as bits.
#[derive(Clone, Copy)]
pub(crate) struct Corners {
    bits: [[u32; TRIANGLES]; 3],
    count: usize,
}

impl Corners {
    pub const NONE: Corners = Corners { bits: [[0; TRIANGLES]; 3], count: 0 };

    /// Adds a vertex unless it is there; false when it would be the seventeenth.
    pub fn add(&mut self, vertex: [f32; 3]) -> bool {
        self.add_bits(vertex.map(f32::to_bits))
    }

    /// Adds the vertices of `other`; false when there would be more than 16.
    pub fn merge(&mut self, other: &Corners) -> bool {
        (0..other.count.min(TRIANGLES)).all(|i| self.add_bits(other.bits.map(|axis| axis[i])))
    }

    fn add_bits(&mut self, vertex: [u32; 3]) -> bool {
        let [x, y, z] = &self.bits;
        let same = |i: usize| x[i] == vertex[0] && y[i] == vertex[1] && z[i] == vertex[2];
        if (0..self.count.min(TRIANGLES)).any(same) {
            return true;
        }
        if self.count >= TRIANGLES {
            return false;
        }
        for (axis, bits) in self.bits.iter_mut().zip(vertex) {
            axis[self.count] = bits;
        }
        self.count += 1;
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sixteen_vertices_fit_and_equal_bits_count_once() {
        let mut corners = Corners::NONE;
        assert!((0..16).all(|i| corners.add([i as f32, 0.0, 1.0])));
        assert!(corners.add([3.0, 0.0, 1.0]), "known");
        assert!(!corners.clone().add([3.0, -0.0, 1.0]), "other bits");
        assert!(!corners.clone().add([3.0, 0.0, 2.0]), "the seventeenth");
        let mut known = Corners::NONE;
        assert!(known.merge(&corners) && known.merge(&corners) && known.count == 16);
        let mut one = Corners::NONE;
        assert!(one.add([9.5, 0.0, 0.0]) && !one.merge(&corners));
    }
}
