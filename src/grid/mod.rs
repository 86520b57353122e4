//! A regular grid in flat arrays.
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

mod build;
mod plan;
mod validate;
mod walk;

pub(crate) use build::{build, needs};
pub(crate) use validate::grid_is_sound;
pub(crate) use walk::walk;

use glam::DVec3;

use crate::math::Aabb;
use crate::prim::LeafRef;
use crate::storage::Plain;

/// Primitives are put into every cell that their box comes nearer to than this part of a cell.
///
/// Stepping errs by less (see [`walk`]), so a ray never leaves the cells in which a primitive that
/// it meets is listed.
const DILATION: f64 = 1.0 / 1024.0;

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

const LAST: u32 = 1 << 31;
const TAG_RUN: u32 = 1 << 30;
const VALUE: u32 = TAG_RUN - 1;

/// The word of an empty cell.
const EMPTY: u32 = 0;

/// The word of a cell whose run starts at entry `first`.
fn run_word(first: u32) -> u32 {
    TAG_RUN | first
}

/// The entry at which the cell's run starts, unless it is empty.
fn run_start(word: u32) -> Option<usize> {
    (word & !VALUE == TAG_RUN).then_some((word & VALUE) as usize)
}

impl Run {
    fn leaf(self) -> LeafRef {
        LeafRef { block: self.block, lanes: self.lanes & 0xFFFF }
    }

    fn is_last(self) -> bool {
        self.lanes & LAST != 0
    }
}

impl GridHead {
    fn cell_count(&self) -> u64 {
        self.resolution.iter().map(|n| u64::from(*n)).product()
    }

    /// The `i`-th wall across axis `k`: the same arithmetic wherever a wall is needed.
    fn wall(&self, k: usize, i: u32) -> f64 {
        self.lower[k] + f64::from(i) * self.cell[k]
    }

    /// The corners of the whole grid.
    fn corners(&self) -> (DVec3, DVec3) {
        let upper = [0, 1, 2].map(|k| self.wall(k, self.resolution[k]));
        (self.lower.into(), upper.into())
    }

    /// The cell with coordinate `x` on axis `k`, or the one nearest to it. The cast saturates, and
    /// NaN goes to cell 0.
    fn cell_at(&self, k: usize, x: f64) -> u32 {
        let i = ((x - self.lower[k]) / self.cell[k]) as u32;
        i.min(self.resolution[k] - 1)
    }

    /// The first and the last cell on each axis that the box, dilated, reaches.
    fn cells_of(&self, aabb: &Aabb) -> [[u32; 2]; 3] {
        [0, 1, 2].map(|k| {
            let dilation = self.cell[k] * DILATION;
            [
                self.cell_at(k, f64::from(aabb.lower[k]) - dilation),
                self.cell_at(k, f64::from(aabb.upper[k]) + dilation),
            ]
        })
    }

    /// The number of the word of a cell.
    fn word(&self, cell: [u32; 3]) -> usize {
        let [i, j, k] = cell.map(|c| c as usize);
        let [nx, ny, _] = self.resolution.map(|n| n as usize);
        self.first_word as usize + i + nx * (j + ny * k)
    }
}
