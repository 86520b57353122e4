//! The cells of a grid.
//!
//! ```text
//! words[cell]        what is in the cell: nothing, or the first entry of its run
//! runs[first ..]     the lanes of leaf blocks in the cell, the last entry marked
//! ```
//!
//! A word has two bits of tag and thirty bits of meaning. Tag 0 is an empty cell, tag 1 a run; tag 2
//! is kept for sub-grids, and the thirty bits of an empty cell for distances to what is not empty.
//! This is the offsets-and-entries form of a compressed sparse row, with the end of a row marked in
//! its last entry instead of taken from the next row's offset.

#![allow(unsafe_code, reason = "promises about the layouts drawn here")]

use super::leaf::LeafRef;
use crate::storage::Plain;

/// Where the cells lie: cell `(i, j, k)` is word `first_word + i + nx * (j + ny * k)`.
///
/// ```text
/// byte 0       24     48           60           64
///      | lower | cell | resolution | first word |
/// ```
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct GridHead {
    /// The corner of cell (0, 0, 0).
    pub lower: [f64; 3],
    /// The edges of a cell.
    pub cell: [f64; 3],
    pub resolution: [u32; 3],
    pub first_word: u32,
}
const _: () = assert!(size_of::<GridHead>() == 64);

// SAFETY: numbers only; 24 + 24 + 12 + 4 = 64, so no padding.
unsafe impl Plain for GridHead {}

/// One entry of a cell's run.
///
/// ```text
/// byte 0       4       8
///      | block | lanes |
/// ```
///
/// The lower half of `lanes` says which lanes of `block` are in the cell; bit 31 marks the last entry
/// of the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub(crate) struct Run {
    pub block: u32,
    pub lanes: u32,
}
const _: () = assert!(size_of::<Run>() == 8);

// SAFETY: two numbers of equal size.
unsafe impl Plain for Run {}

/// Marks the last entry of a run.
pub(crate) const LAST: u32 = 1 << 31;
const TAG_RUN: u32 = 1 << 30;
/// The highest entry at which a run can start.
pub(crate) const VALUE: u32 = TAG_RUN - 1;

/// The word of an empty cell.
pub(crate) const EMPTY: u32 = 0;

/// The word of a cell whose run starts at entry `first`.
pub(crate) fn run_word(first: u32) -> u32 {
    TAG_RUN | first
}

/// The entry at which the cell's run starts, unless it is empty.
pub(crate) fn run_start(word: u32) -> Option<usize> {
    (word & !VALUE == TAG_RUN).then_some((word & VALUE) as usize)
}

impl Run {
    pub fn leaf(self) -> LeafRef {
        LeafRef { block: self.block, lanes: self.lanes & 0xFFFF }
    }

    pub fn is_last(self) -> bool {
        self.lanes & LAST != 0
    }
}
