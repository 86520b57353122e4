//! The cells of grids, and grids within cells.
//!
//! ```text
//! grids                the grids that hold everything, each over a box of its own
//! words                grid after grid: its resolution, then a word for each cell, x fastest
//! runs[first ..]       the lanes of leaf blocks in a cell, the last entry marked; before them, if the word says so, a box
//! ```
//!
//! A cell's word has two bits of tag and thirty bits of meaning:
//!
//! ```text
//! bit 31 30 29                        0
//!     | 0  0 | the empty cubes ahead   |    nothing is in the cell
//!     | 0  1 | first entry of its run  |
//!     | 1  0 | first word of its grid  |    the cell is divided once more
//!     | 1  1 | the box before its run  |    nothing in the cell is outside of that
//! ```
//!
//! An empty cell says, for each octant of directions, how large a cube of empty cells it is the corner of: three
//! bits an octant, the number of a side in [`SIDES`]. This is the offsets-and-entries form of a compressed sparse row, with
//! the end of a row marked in its last entry instead of taken from the next row's offset.
//!
//! The grids of `grids` come first, then the grids in their cells, then those in the cells of these, each
//! in the order of the words that name them.

#![allow(unsafe_code, reason = "promises about the layouts drawn here")]

use super::leaf::LeafRef;
use crate::math::Aabb;
use crate::storage::Plain;

/// Where a grid that is in no other lies: cell `(i, j, k)` spans the points `p` with `i <= (p - lower) * per_length <= i + 1`
/// in x, and likewise in y and z.
///
/// ```text
/// byte 0       24           48       52           56       80         128
///      | lower | per length | finest | first word | bounds | reserved |
/// ```
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(crate) struct GridHead {
    /// The corner of cell (0, 0, 0).
    pub lower: [f64; 3],
    /// How many cells there are to a unit of length.
    pub per_length: [f64; 3],
    /// Along no axis is a cell divided into more than this many, grids in its grid included.
    pub finest: u32,
    /// The word of its resolution.
    pub first_word: u32,
    /// The box of what is in it, which rays are held against first.
    pub bounds: Aabb,
    pub reserved: [u32; 12],
}
const _: () = assert!(size_of::<GridHead>() == 128);

// SAFETY: numbers only; 24 + 24 + 4 + 4 + 24 + 48 = 128, so no padding.
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

/// What of a cell its contents take up: an entry before those of its run.
///
/// ```text
/// byte 0               4               8
///      | lower x y z 0 | upper x y z 0 |
/// ```
///
/// A byte counts steps of [`STEP`](Self::STEP) from [`BEGIN`](Self::BEGIN), both in cells: an eighth on either side is what errors of
/// the walk and of the box have to themselves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct CellBox {
    pub lower: [u8; 4],
    pub upper: [u8; 4],
}

impl CellBox {
    pub const STEP: f32 = 5.0 / 1024.0;
    pub const BEGIN: f32 = -1.0 / 8.0;
    /// All that is in the cell.
    pub const WHOLE: Self = CellBox { lower: [0; 4], upper: [255, 255, 255, 0] };

    /// The box between corners in cells, from the cell's own corner, rounded outwards.
    pub fn around(lower: [f64; 3], upper: [f64; 3]) -> Self {
        let mut around = Self::WHOLE;
        for k in 0..3 {
            // The casts saturate.
            let steps = |x: f64| (x - f64::from(Self::BEGIN)) / f64::from(Self::STEP);
            around.lower[k] = steps(lower[k]) as u8;
            around.upper[k] = (steps(upper[k]) + 1.0) as u8;
        }
        around
    }

    /// As two numbers, the higher bits of the second clear.
    pub fn words(self) -> [u32; 2] {
        [self.lower, self.upper].map(u32::from_le_bytes)
    }

    pub fn from_words(words: [u32; 2]) -> Self {
        let [lower, upper] = words.map(u32::to_le_bytes);
        CellBox { lower, upper }
    }
}

/// Marks the last entry of a run.
pub(crate) const LAST: u32 = 1 << 31;
const TAG_RUN: u32 = 1 << 30;
const TAG_GRID: u32 = 2 << 30;
const TAG_BOX: u32 = 3 << 30;
/// The highest entry at which a run can start, and the highest word at which a grid can.
pub(crate) const VALUE: u32 = TAG_RUN - 1;

/// The word of an empty cell beside which nothing is known to be empty.
pub(crate) const EMPTY: u32 = 0;

/// Grids lie in grids this deep at most, the outermost counted.
pub(crate) const MOST_DEPTH: usize = 8;

/// The most cells along an axis of one grid.
pub(crate) const MOST_CELLS: u32 = 1023;

/// The sides of empty cubes that a word can name, in cells.
pub(crate) const SIDES: [u8; 8] = [1, 2, 3, 4, 6, 8, 12, 16];

/// How many cells such cubes reach beyond their first.
pub(crate) const AHEAD: [f32; 8] = {
    let (mut ahead, mut i) = ([0.0; 8], 0);
    while i < 8 {
        ahead[i] = SIDES[i] as f32 - 1.0;
        i += 1;
    }
    ahead
};

/// What a cell's word says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cell {
    Empty,
    /// The entry at which its run starts.
    Run(usize),
    /// The word of its grid's resolution.
    Grid(usize),
    /// The entry of its [`CellBox`], which its run follows.
    Boxed(usize),
}

/// The meaning of a cell's word.
#[inline(always)]
pub(crate) fn cell(word: u32) -> Cell {
    let value = (word & VALUE) as usize;
    match word & !VALUE {
        0 => Cell::Empty,
        TAG_RUN => Cell::Run(value),
        TAG_GRID => Cell::Grid(value),
        _ => Cell::Boxed(value),
    }
}

/// The word of a cell whose run starts at entry `first`.
pub(crate) fn run_word(first: u32) -> u32 {
    TAG_RUN | first
}

/// The word of a cell whose box is entry `first`.
pub(crate) fn box_word(first: u32) -> u32 {
    TAG_BOX | first
}

/// The word of a cell whose grid starts at word `first`.
pub(crate) fn grid_word(first: u32) -> u32 {
    TAG_GRID | first
}

/// Of an empty cell's word, the side of the empty cube towards an octant as its number in [`SIDES`]; bit `k` of
/// the octant says that coordinate `k` falls.
#[inline(always)]
pub(crate) fn side_ahead(word: u32, octant: u32) -> usize {
    (word >> (3 * octant) & 7) as usize
}

/// The word of a grid's resolution.
///
/// ```text
/// bit 31 30 29     20 19     10 9       0
///     | 0  0 |   nz   |   ny   |   nx   |
/// ```
pub(crate) fn resolution_word([x, y, z]: [u32; 3]) -> u32 {
    x | y << 10 | z << 20
}

/// The cells along each axis by that word.
#[inline(always)]
pub(crate) fn resolution(word: u32) -> [u32; 3] {
    [word & MOST_CELLS, word >> 10 & MOST_CELLS, word >> 20 & MOST_CELLS]
}

/// The number of cells of a grid.
pub(crate) fn cell_count(resolution: [u32; 3]) -> u64 {
    resolution.iter().map(|n| u64::from(*n)).product()
}

impl Run {
    #[inline(always)]
    pub fn leaf(self) -> LeafRef {
        LeafRef { block: self.block, lanes: self.lanes & 0xFFFF }
    }

    /// The entry that is a box.
    pub fn of_box(cell_box: CellBox) -> Self {
        let [block, lanes] = cell_box.words();
        Run { block, lanes }
    }

    #[inline(always)]
    pub fn cell_box(self) -> CellBox {
        CellBox::from_words([self.block, self.lanes])
    }

    #[inline(always)]
    pub fn is_last(self) -> bool {
        self.lanes & LAST != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_keep_what_they_say() {
        assert_eq!(cell(EMPTY), Cell::Empty);
        assert_eq!(cell(run_word(VALUE)), Cell::Run(VALUE as usize));
        assert_eq!(cell(grid_word(7)), Cell::Grid(7));
        assert_eq!(cell(box_word(9)), Cell::Boxed(9));
        assert_eq!(resolution(resolution_word([1023, 1, 512])), [1023, 1, 512]);
        let word = 5 << 21 | 3;
        assert_eq!([0, 1, 7].map(|octant| side_ahead(word, octant)), [3, 0, 5]);
        assert_eq!(cell(word), Cell::Empty);
    }

    #[test]
    fn boxes_of_cells_are_rounded_outwards() {
        for [lower, upper] in [[0.3, 0.4], [0.0, 1.0], [0.5, 0.5], [-0.12, 1.1]] {
            let cell_box = CellBox::around([lower; 3], [upper; 3]);
            let at = |q: u8| CellBox::BEGIN + f32::from(q) * CellBox::STEP;
            let [near, far] =
                [cell_box.lower, cell_box.upper].map(|corner| f64::from(at(corner[0])));
            assert!(near <= lower && lower < near + 0.006, "{lower} {near}");
            assert!(upper <= far && far < upper + 0.006, "{upper} {far}");
            assert_eq!(Run::of_box(cell_box).cell_box(), cell_box);
            assert!(!Run::of_box(cell_box).is_last());
        }
        let beyond = CellBox::around([-9.0; 3], [f64::INFINITY; 3]);
        assert_eq!(beyond, CellBox::WHOLE);
    }
}
