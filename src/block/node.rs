//! The node, byte by byte.

#![allow(unsafe_code, reason = "a promise about the layout drawn here")]

use super::leaf::LeafRef;
use crate::math::Aabb;
use crate::storage::Plain;

/// A box and what it holds.
///
/// ```text
/// byte 0       12      16      28      32
///      | lower | first | upper | lanes |
/// ```
///
/// `lanes == 0`: the children are nodes `first` and `first + 1`, which share a cache line.
/// Otherwise a leaf: `first` and `lanes` are a [`LeafRef`]. Node 0 is the root, node 1 is unused.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub(crate) struct BvhNode {
    pub lower: [f32; 3],
    pub first: u32,
    pub upper: [f32; 3],
    pub lanes: u32,
}
const _: () = assert!(size_of::<BvhNode>() == 32);

// SAFETY: numbers only; 12 + 4 + 12 + 4 = 32, so no padding.
unsafe impl Plain for BvhNode {}

impl BvhNode {
    pub fn inner(aabb: &Aabb, first: u32) -> Self {
        BvhNode { lower: aabb.lower, first, upper: aabb.upper, lanes: 0 }
    }

    pub fn is_leaf(&self) -> bool {
        self.lanes != 0
    }

    pub fn leaf(&self) -> LeafRef {
        LeafRef { block: self.first, lanes: self.lanes }
    }

    /// The lower and the upper corner of the box.
    #[inline(always)]
    pub fn corners(&self) -> [&[f32; 3]; 2] {
        [&self.lower, &self.upper]
    }

    pub fn aabb(&self) -> Aabb {
        Aabb { lower: self.lower, upper: self.upper }
    }
}
