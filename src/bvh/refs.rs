//! Primitives as the builder sees them.

#![allow(unsafe_code, reason = "a promise about the layout drawn here")]

use super::split::Box4;
use crate::block::Census;
use crate::math::Aabb;
use crate::prim::{Shape, for_each_prim_in};
use crate::scene::Scene;
use crate::storage::Plain;

/// A primitive as the builder sees it.
///
/// ```text
/// byte 0       12   16      28          32
///      | lower | id | upper | is sphere |
/// ```
///
/// The id stands in the fourth lane of the box, below `2^30` and with that bit set. So all lanes are
/// zero or normal floats: computing with subnormal ones is slow.
#[derive(Clone, Copy)]
#[repr(C)]
pub(crate) struct PrimRef {
    pub bounds: Box4,
}
const _: () = assert!(size_of::<PrimRef>() == 32);

// SAFETY: eight numbers of equal size, so no padding.
unsafe impl Plain for PrimRef {}

impl PrimRef {
    /// Where the id is among the words of a ref.
    pub const ID: usize = 3;

    /// Set in that word.
    const NORMAL: u32 = 1 << 30;

    /// The id in that word.
    pub fn id_of(word: u32) -> u32 {
        word & !Self::NORMAL
    }

    pub fn new(id: u32, aabb: &Aabb, sphere: bool) -> Self {
        let lane = |[x, y, z]: [f32; 3], word: u32| {
            // -0 becomes +0.
            [x + 0.0, y + 0.0, z + 0.0, f32::from_bits(word)]
        };
        let sphere = if sphere { 1.0f32.to_bits() } else { 0 };
        let (lower, upper) = (lane(aabb.lower, id | Self::NORMAL), lane(aabb.upper, sphere));
        PrimRef { bounds: Box4 { lower, upper } }
    }

    pub fn id(&self) -> u32 {
        Self::id_of(self.bounds.lower[3].to_bits())
    }

    pub fn is_sphere(&self) -> bool {
        self.bounds.upper[3].to_bits() != 0
    }
}

/// Writes a ref for each primitive that can be hit.
pub(crate) fn gather(scene: &Scene, census: &Census, refs: &mut [PrimRef]) {
    let mut free = refs.iter_mut();
    for_each_prim_in(scene, 0..u32::MAX, census.ignored_count == 0, |prim| {
        if let Some(r) = free.next() {
            let sphere = matches!(prim.shape, Shape::Sphere { .. });
            *r = PrimRef::new(prim.id, &prim.shape.aabb(), sphere);
        }
    });
}
