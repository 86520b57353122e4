//! The bundle: the fast form of a BVH, several sibling records side by side.

#![allow(unsafe_code, reason = "a promise about the layout drawn here")]

use super::leaf::{KIND_SPHERES, KIND_TRIANGLES};
use crate::storage::Plain;

/// `W` sibling records of a box and a reference, transposed: 4, 8 or 16.
///
/// ```text
/// byte 0            4W           8W           12W          16W          20W          24W      28W
///      | lower x[W] | lower y[W] | lower z[W] | upper x[W] | upper y[W] | upper z[W] | ref[W] |
/// ```
///
/// Lanes without a child come last; their boxes are [empty](Self::EMPTY), so no ray enters them.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(16))]
pub(crate) struct Bundle<const W: usize> {
    /// Lower x y z, then upper x y z.
    pub walls: [[f32; W]; 6],
    pub refs: [ChildRef; W],
}
const _: () = assert!(size_of::<Bundle<4>>() == 112 && size_of::<Bundle<8>>() == 224);
const _: () = assert!(size_of::<Bundle<16>>() == 448);

/// Bytes of a bundle for each of its lanes.
pub(crate) const LANE: usize = 28;
const _: () = assert!(size_of::<Bundle<4>>() == 4 * LANE && size_of::<Bundle<16>>() == 16 * LANE);

// SAFETY: numbers only; 28 W is a multiple of 16 for W = 4, 8 and 16, so no padding.
unsafe impl Plain for Bundle<4> {}
// SAFETY: as above.
unsafe impl Plain for Bundle<8> {}
// SAFETY: as above.
unsafe impl Plain for Bundle<16> {}

impl<const W: usize> Bundle<W> {
    pub const EMPTY: Self = Bundle {
        walls: [
            [f32::INFINITY; W],
            [f32::INFINITY; W],
            [f32::INFINITY; W],
            [f32::NEG_INFINITY; W],
            [f32::NEG_INFINITY; W],
            [f32::NEG_INFINITY; W],
        ],
        refs: [ChildRef::NONE; W],
    };

    /// The child in the lowest lane of a mask.
    #[inline(always)]
    pub fn child(&self, mask: u32) -> ChildRef {
        self.refs.get(mask.trailing_zeros() as usize).copied().unwrap_or(ChildRef::NONE)
    }
}

/// What a lane of a bundle refers to.
///
/// ```text
/// bit 31     30       29 .. 0
///     | leaf | sphere | number of the leaf block |
///     | 0    | number of the bundle              |
/// ```
///
/// A leaf is all of one leaf block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub(crate) struct ChildRef(pub u32);

impl ChildRef {
    /// No child.
    pub const NONE: ChildRef = ChildRef(u32::MAX);
    /// The first bundle.
    pub const ROOT: ChildRef = ChildRef(0);
    const LEAF: u32 = 1 << 31;
    const SPHERES: u32 = 1 << 30;

    pub fn bundle(number: u32) -> Self {
        ChildRef(number & !Self::LEAF)
    }

    /// The leaf that is block `number` of this kind.
    pub fn leaf(kind: u32, number: u32) -> Self {
        let spheres = if kind == KIND_SPHERES { Self::SPHERES } else { 0 };
        ChildRef(Self::LEAF | spheres | number & (Self::SPHERES - 1))
    }

    pub fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// The number of the bundle, unless it is a leaf.
    pub fn bundle_number(self) -> usize {
        self.0 as usize
    }

    /// The references as words.
    #[inline(always)]
    pub fn words<const W: usize>(refs: &[ChildRef; W]) -> &[u32; W] {
        // SAFETY: a reference is a word and nothing else, by `repr(transparent)`.
        unsafe { &*core::ptr::from_ref(refs).cast() }
    }

    /// Kind and number of the block of a leaf.
    pub fn leaf_block(self) -> (u32, usize) {
        let kind = if self.0 & Self::SPHERES != 0 { KIND_SPHERES } else { KIND_TRIANGLES };
        (kind, (self.0 & (Self::SPHERES - 1)) as usize)
    }
}

/// The bundles of a block, if its layout has them.
#[derive(Clone, Copy)]
pub(crate) enum Bundles<'m> {
    None,
    Four(&'m [Bundle<4>]),
    Eight(&'m [Bundle<8>]),
    Sixteen(&'m [Bundle<16>]),
}

impl Bundles<'_> {
    /// Their size in bytes.
    pub fn size(&self) -> usize {
        match self {
            Bundles::None => 0,
            Bundles::Four(bundles) => size_of_val(*bundles),
            Bundles::Eight(bundles) => size_of_val(*bundles),
            Bundles::Sixteen(bundles) => size_of_val(*bundles),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn references_keep_what_they_are_made_of() {
        assert_eq!(ChildRef::bundle(77).bundle_number(), 77);
        assert!(!ChildRef::bundle(77).is_leaf());
        for kind in [KIND_SPHERES, KIND_TRIANGLES] {
            let leaf = ChildRef::leaf(kind, 1_000_000);
            assert!(leaf.is_leaf());
            assert_eq!(leaf.leaf_block(), (kind, 1_000_000));
        }
        assert!(ChildRef::NONE.is_leaf(), "what is not there is no bundle");
    }
}
