//! Geometries and leaf blocks: the primitives as every structure stores them.

#![allow(unsafe_code, reason = "promises about the layouts drawn here")]

use crate::math::Aabb;
use crate::storage::Plain;

/// Triangles in a [`TriangleBlock`] at most, and vertices too.
pub(crate) const TRIANGLES: usize = 16;
/// Triangles of which none share a vertex always fit into one block: `5 * 3 <= 16`.
pub(crate) const TRIANGLES_AT_LEAST: usize = 5;
/// Spheres in a [`SphereBlock`] at most.
pub(crate) const SPHERES: usize = 15;

/// Up to 16 triangles over up to 16 shared vertices.
///
/// ```text
/// byte 0        64       128      192       216     220     224   248    252        256
///      | x[16] | y[16] | z[16] | corners | first | count | aabb | live | reserved |
/// ```
///
/// `corners[k]` holds the number of vertex `k` of each triangle in a nibble, the lower one of a byte
/// first: those of even triangles in the first four bytes, those of odd ones in the others. So eight
/// bytes repeated, each half shifted by a nibble for every second lane, are the numbers of all 16.
/// Triangle `i < count` is primitive `prim_ids[first + i]`. It can be hit if bit `i` of `live` is set: all of them, but
/// in blocks that may be refitted. `aabb` holds those.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct TriangleBlock {
    /// x, y and z of the vertices.
    pub vertices: [[f32; TRIANGLES]; 3],
    pub corners: [[u8; TRIANGLES / 2]; 3],
    pub first: u32,
    pub count: u32,
    pub aabb: Aabb,
    pub live: u32,
    pub reserved: u32,
}
const _: () = assert!(size_of::<TriangleBlock>() == 256);

// SAFETY: numbers only; 3 * 64 + 24 + 8 + 24 + 8 = 256, so no padding.
unsafe impl Plain for TriangleBlock {}

impl TriangleBlock {
    pub const EMPTY: Self = TriangleBlock {
        vertices: [[0.0; TRIANGLES]; 3],
        corners: [[0; TRIANGLES / 2]; 3],
        first: 0,
        count: 0,
        aabb: Aabb::EMPTY,
        live: 0,
        reserved: 0,
    };

    /// Empties the block. Part by part: a record would be put together elsewhere and copied, or stand in the program.
    #[inline(always)]
    pub fn clear(&mut self, first: u32) {
        self.vertices = [[0.0; TRIANGLES]; 3];
        self.corners = [[0; TRIANGLES / 2]; 3];
        (self.first, self.count) = (first, 0);
        self.aabb = Aabb::EMPTY;
        (self.live, self.reserved) = (0, 0);
    }

    /// The vertices of triangle `i < 16`, whatever the block holds.
    #[cfg_attr(target_os = "none", inline(never))]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    pub fn triangle(&self, i: usize) -> [[f32; 3]; 3] {
        let [x, y, z] = &self.vertices;
        let [a, b, c] = self.corner_numbers(i);
        let vertex = |v: usize| [x[v % TRIANGLES], y[v % TRIANGLES], z[v % TRIANGLES]];
        [vertex(a), vertex(b), vertex(c)]
    }

    /// The numbers of the vertices of triangle `i < 16`, each below 16 whatever the block holds.
    #[inline(always)]
    pub fn corner_numbers(&self, i: usize) -> [usize; 3] {
        let (byte, shift) = nibble(i);
        let [a, b, c] = &self.corners;
        let number = |list: &[u8; TRIANGLES / 2]| usize::from(list[byte] >> shift & 15);
        [number(a), number(b), number(c)]
    }

    /// The lanes that can be hit, one bit each.
    #[inline(always)]
    pub fn lanes(&self) -> u32 {
        self.live
    }

    /// The lanes that have a triangle, whether it can be hit or not.
    pub fn held(&self) -> u32 {
        low_bits(self.count.min(TRIANGLES as u32))
    }

    /// Writes vertex number `v` for corner `k` of triangle `i`.
    pub fn set_corner(&mut self, i: usize, k: usize, v: usize) {
        let (byte, shift) = nibble(i);
        let byte = &mut self.corners[k % 3][byte];
        *byte = (*byte & !(15 << shift)) | ((v as u8 & 15) << shift);
    }
}

/// The byte of triangle `i < 16` in a list of corners, and the bits below its nibble.
#[inline(always)]
fn nibble(i: usize) -> (usize, usize) {
    let shift = corner_shift(i);
    (shift / 8, shift % 8)
}

/// The bits below the number of triangle `i < 16`, where a list of corners is one word, its first byte lowest.
#[inline(always)]
pub(crate) fn corner_shift(i: usize) -> usize {
    4 * (i % 2 * 8 + i / 2 % 8)
}

/// Up to 15 spheres.
///
/// ```text
/// byte 0        60       120      180           240     244     248    252        256
///      | x[15] | y[15] | z[15] | radius[15] | first | count | live | reserved |
/// ```
///
/// Sphere `i < count` is primitive `prim_ids[first + i]`, and can be hit if bit `i` of `live` is set.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct SphereBlock {
    pub x: [f32; SPHERES],
    pub y: [f32; SPHERES],
    pub z: [f32; SPHERES],
    pub radius: [f32; SPHERES],
    pub first: u32,
    pub count: u32,
    pub live: u32,
    pub reserved: u32,
}
const _: () = assert!(size_of::<SphereBlock>() == 256);

// SAFETY: numbers only; 4 * 60 + 4 + 4 + 8 = 256, so no padding.
unsafe impl Plain for SphereBlock {}

impl SphereBlock {
    pub const EMPTY: Self = SphereBlock {
        x: [0.0; SPHERES],
        y: [0.0; SPHERES],
        z: [0.0; SPHERES],
        radius: [0.0; SPHERES],
        first: 0,
        count: 0,
        live: 0,
        reserved: 0,
    };

    /// Centre and radius of sphere `i < 15`, whatever the block holds.
    pub fn sphere(&self, i: usize) -> ([f32; 3], f32) {
        let i = i % SPHERES;
        ([self.x[i], self.y[i], self.z[i]], self.radius[i])
    }

    /// Writes sphere `i < 15`.
    pub fn set_sphere(&mut self, i: usize, [x, y, z]: [f32; 3], radius: f32) {
        let i = i % SPHERES;
        (self.x[i], self.y[i], self.z[i], self.radius[i]) = (x, y, z, radius);
    }

    /// The lanes that can be hit, one bit each.
    #[inline(always)]
    pub fn lanes(&self) -> u32 {
        self.live
    }

    /// The lanes that have a sphere, whether it can be hit or not.
    pub fn held(&self) -> u32 {
        low_bits(self.count.min(SPHERES as u32))
    }
}

/// `n <= 16` ones.
#[inline(always)]
pub(crate) fn low_bits(n: u32) -> u32 {
    (1 << n.min(16)) - 1
}

/// One geometry of the scene: a mesh or a sphere set.
///
/// ```text
/// byte 0            4      8
///      | first prim | mask |
/// ```
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct Geometry {
    /// The flat number of its first primitive.
    pub first: u32,
    pub mask: u32,
}
const _: () = assert!(size_of::<Geometry>() == 8);

// SAFETY: two numbers of equal size.
unsafe impl Plain for Geometry {}

/// Which lanes of which leaf block: what a leaf of a BVH and an entry of a grid cell refer to.
///
/// `block` holds the kind in its two highest bits and the block's number below. Lanes 0..16 are
/// those of that block, lanes 16..32 those of the block after it: a BVH leaf may straddle two, so
/// blocks are always filled to the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct LeafRef {
    pub block: u32,
    pub lanes: u32,
}

/// Where a primitive is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Place {
    /// The number of its leaf block among those of its kind.
    pub block: u32,
    pub lane: u32,
    /// The number of its entry in `prim_ids`.
    pub entry: u32,
}

impl Place {
    /// The place of a lane of the block with this number and first entry.
    #[inline(always)]
    pub fn of_lane(block: u32, first: u32, lane: u32) -> Self {
        Place { block, lane, entry: first.wrapping_add(lane) }
    }

    /// The flat number of the primitive. Blocks are checked before they are traversed, so the entry exists.
    #[inline(always)]
    pub fn prim(self, prim_ids: &[u32]) -> u32 {
        prim_ids.get(self.entry as usize).copied().unwrap_or(u32::MAX)
    }
}

/// The kinds of leaf blocks.
pub(crate) const KIND_TRIANGLES: u32 = 1;
pub(crate) const KIND_SPHERES: u32 = 2;
/// Block numbers lie below the bits of the kind.
pub(crate) const BLOCK_BITS: u32 = 30;

/// A block's kind and number in one word.
pub(crate) const fn block_ref(kind: u32, number: u32) -> u32 {
    kind << BLOCK_BITS | number
}

impl LeafRef {
    #[inline(always)]
    pub fn kind(self) -> u32 {
        self.block >> BLOCK_BITS
    }

    #[inline(always)]
    pub fn number(self) -> usize {
        (self.block & ((1 << BLOCK_BITS) - 1)) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_are_nibbles() {
        let mut block = TriangleBlock::EMPTY;
        for v in 0..16 {
            block.vertices[0][v] = v as f32;
        }
        for i in 0..16 {
            for k in 0..3 {
                block.set_corner(i, k, (i * 5 + k) % 16);
            }
        }
        for i in 0..16 {
            let x = block.triangle(i).map(|vertex| vertex[0]);
            assert_eq!(x, [0, 1, 2].map(|k| ((i * 5 + k) % 16) as f32));
        }
    }

    #[test]
    fn a_reference_keeps_kind_and_number() {
        let leaf = LeafRef { block: block_ref(KIND_SPHERES, 1_000_000), lanes: 5 };
        assert_eq!((leaf.kind(), leaf.number()), (KIND_SPHERES, 1_000_000));
        assert_eq!((low_bits(0), low_bits(3), low_bits(16)), (0, 7, 0xFFFF));
    }
}
