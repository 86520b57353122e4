//! Up to sixteen vertices, each once.

use crate::block::leaf::TRIANGLES;

/// The x, y and z of vertices.
pub(crate) type Vertices = [[f32; TRIANGLES]; 3];

/// The numbers of vertices by their bits: a hash table, since what was written a moment ago is slow to search with
/// vectors. Large enough that two vertices rarely want one place.
#[derive(Clone, Copy)]
pub(crate) struct Numbers([u8; 256]);

impl Numbers {
    pub const NONE: Numbers = Numbers([u8::MAX; 256]);

    /// The number of a vertex, or the free place of the table for it.
    #[cfg_attr(target_os = "none", inline(never))]
    #[cfg_attr(not(target_os = "none"), inline)]
    pub fn find(&self, vertices: &Vertices, vertex: &[f32; 3]) -> Result<usize, usize> {
        let mut place = place_of(vertex);
        // At most 16 places are taken.
        loop {
            let v = usize::from(self.0[place % 256]);
            if v >= TRIANGLES {
                return Err(place % 256);
            }
            if holds(vertices, v, vertex) {
                return Ok(v);
            }
            place += 1;
        }
    }

    /// The number of a vertex, which becomes the next of `count` if it is new; they are fewer than 16 then. There is no
    /// branch on that, since nobody could guess it.
    #[cfg_attr(target_os = "none", inline(never))]
    #[cfg_attr(not(target_os = "none"), inline)]
    pub fn number(
        &mut self,
        vertices: &mut Vertices,
        vertex: &[f32; 3],
        count: &mut usize,
    ) -> usize {
        let mut place = place_of(vertex);
        let v = usize::from(self.0[place % 256]);
        let known = (v < TRIANGLES) & holds(vertices, v, vertex);
        if v < TRIANGLES && !known {
            match self.find(vertices, vertex) {
                Ok(v) => return v,
                Err(free) => place = free,
            }
        }
        let v = if known { v } else { *count } % TRIANGLES;
        self.0[place % 256] = v as u8;
        for (axis, x) in vertices.iter_mut().zip(vertex) {
            axis[v] = *x;
        }
        *count += usize::from(!known);
        v
    }
}

/// Whether vertex `v` has just these bits.
#[inline]
fn holds(vertices: &Vertices, v: usize, vertex: &[f32; 3]) -> bool {
    let [x, y, z] = vertex.map(f32::to_bits);
    let ([xs, ys, zs], v) = (vertices, v % TRIANGLES);
    (xs[v].to_bits() ^ x) | (ys[v].to_bits() ^ y) | (zs[v].to_bits() ^ z) == 0
}

/// The place of the table at which to look for a vertex first.
#[inline]
fn place_of(vertex: &[f32; 3]) -> usize {
    let [x, y, z] = vertex.map(f32::to_bits);
    let hash =
        x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA77) ^ z.wrapping_mul(0xC2B2_AE3D);
    (hash >> 24) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_of_one_place_are_told_apart() {
        // Some of a few thousand share their place with the first.
        let shared: std::vec::Vec<_> = (0..8000)
            .map(|i| [i as f32, 1.0, -1.0])
            .filter(|v| place_of(v) == place_of(&[0.0, 1.0, -1.0]))
            .take(TRIANGLES)
            .collect();
        assert_eq!(shared.len(), TRIANGLES);
        let (mut vertices, mut numbers, mut count) = ([[0.0; TRIANGLES]; 3], Numbers::NONE, 0);
        for _ in 0..2 {
            for (i, vertex) in shared.iter().enumerate() {
                assert_eq!(numbers.number(&mut vertices, vertex, &mut count), i);
            }
            assert_eq!(count, TRIANGLES);
        }
        assert!(numbers.find(&vertices, &[0.5, 1.0, -1.0]).is_err());
    }
}
