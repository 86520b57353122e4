//! The runs of the cells, found from the leaf blocks.
//!
//! A thread counts and fills the runs of some rows of cells, and looks for that at all blocks that come near.

use super::sort::counts_to_starts;
use crate::block::PartsMut;
use crate::block::cells::{EMPTY, LAST, Run, run_word};
use crate::block::leaf::{
    KIND_SPHERES, KIND_TRIANGLES, SPHERES, SphereBlock, TriangleBlock, block_ref,
};
use crate::caller::{Caller, PARTS};
use crate::grid::list::front;
use crate::grid::narrow::{Axis, Narrow};
use crate::grid::space::Range as Cells;
use crate::prim::Shape;
use crate::simd::{Kernel, Lanes, Simd, Width, dispatch};
use crate::storage::view_mut;
use core::ops::Range;

/// Writes the words of all cells, and their runs behind the leaf blocks, each in the order of blocks; returns how many entries these have.
pub(super) fn write(cells: &Narrow, parts: PartsMut, caller: &Caller) -> Option<u32> {
    let PartsMut { words, sphere_blocks, triangle_blocks, rest, .. } = parts;
    let blocks = Blocks { cells, triangles: triangle_blocks, spheres: sphere_blocks };
    let [nx, ny, nz] = cells.resolution;
    let (rows, row) = (ny * nz, nx);
    let size = rows.div_ceil(caller.part_count() as u32);
    let mut jobs = [const { None }; PARTS];
    let words = words.get_mut(1..)?.chunks_mut((size * row) as usize);
    for (job, (i, words)) in jobs.iter_mut().zip((0..).zip(words)) {
        *job = Some(Rows { first: i * size, words, start: 0, count: 0, runs: &mut [] });
    }
    caller.for_each(&mut jobs, |job| {
        if let Some(rows) = job {
            rows.count(&blocks);
        }
    });
    let (mut sum, all) = (0, jobs.iter().flatten().map(|rows| rows.count as usize).sum());
    let mut runs = view_mut::<Run>(rest, 0, all)?;
    for rows in jobs.iter_mut().flatten() {
        rows.runs = front(&mut runs, rows.count as usize)?;
        (rows.start, sum) = (sum, sum + rows.count);
    }
    caller.for_each(&mut jobs, |job| {
        if let Some(rows) = job {
            rows.fill(&blocks);
        }
    });
    Some(sum)
}

/// Rows of cells along x that follow each other.
struct Rows<'p> {
    /// The number of the first.
    first: u32,
    words: &'p mut [u32],
    /// Where its runs begin among all, how many entries they have, and these.
    start: u32,
    count: u32,
    runs: &'p mut [Run],
}

impl Rows<'_> {
    /// The rows, and the number of their first cell.
    fn place(&self, cells: &Narrow) -> (Range<u32>, usize) {
        let row = cells.resolution[0] as usize;
        let count = (self.words.len() / row) as u32;
        (self.first..self.first + count, self.first as usize * row)
    }

    /// Leaves in each word the start of its cell's run among those of these rows.
    fn count(&mut self, blocks: &Blocks) {
        let (rows, first) = self.place(blocks.cells);
        self.words.fill(0);
        let words = &mut *self.words;
        let f = |cell: usize, _| {
            if let Some(count) = words.get_mut(cell - first) {
                *count += 1;
            }
        };
        dispatch(Entries { blocks, rows, f });
        self.count = counts_to_starts(self.words);
    }

    /// Writes the runs, and the final words.
    fn fill(&mut self, blocks: &Blocks) {
        let (rows, first) = self.place(blocks.cells);
        let (words, runs) = (&mut *self.words, &mut *self.runs);
        let f = |cell: usize, entry| {
            if let Some(next) = words.get_mut(cell - first) {
                if let Some(run) = runs.get_mut(*next as usize) {
                    *run = entry;
                }
                *next += 1;
            }
        };
        dispatch(Entries { blocks, rows, f });
        // Each word now holds the end of its run, which is where the next one starts.
        let mut start = 0;
        for word in &mut *self.words {
            let end = *word;
            *word = if start == end { EMPTY } else { run_word(self.start + start) };
            if let Some(last) = self.runs[start as usize..end as usize].last_mut() {
                last.lanes |= LAST;
            }
            start = end;
        }
    }
}

/// The leaf blocks in the cells.
struct Blocks<'p> {
    cells: &'p Narrow,
    triangles: &'p [TriangleBlock],
    spheres: &'p [SphereBlock],
}

/// Calls `f` with every cell of some rows that holds lanes of a block and the entry that says so, block by block.
struct Entries<'p, F> {
    blocks: &'p Blocks<'p>,
    rows: Range<u32>,
    f: F,
}

/// The cells that the primitives of a block reach along each axis, and how many primitives these are.
struct Reach<V> {
    first: [V; 3],
    last: [V; 3],
    lanes: u32,
}

impl<F: FnMut(usize, Run)> Kernel for Entries<'_, F> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(mut self, s: S) {
        let Blocks { cells, triangles, spheres } = *self.blocks;
        let axes =
            [cells.axis::<S, 16>(s, 0), cells.axis::<S, 16>(s, 1), cells.axis::<S, 16>(s, 2)];
        for (number, block) in (0..).zip(triangles) {
            let range = cells.range_of(&block.aabb);
            if self.is_in_rows(&range) {
                let reach = Reach::of_triangles(s, &axes, block);
                self.each_cell(s, &range, &reach, block_ref(KIND_TRIANGLES, number));
            }
        }
        for (number, block) in (0..).zip(spheres) {
            let (range, ends) = of_spheres(cells, block);
            if self.is_in_rows(&range) {
                let reach = Reach::loaded(s, &ends, block.lanes());
                self.each_cell(s, &range, &reach, block_ref(KIND_SPHERES, number));
            }
        }
    }
}

impl<F: FnMut(usize, Run)> Entries<'_, F> {
    /// Whether cells of a range may be in the rows.
    #[inline(always)]
    fn is_in_rows(&self, Cells { first, last }: &Cells) -> bool {
        let [_, ny, _] = self.blocks.cells.resolution;
        last[1] + ny * last[2] >= self.rows.start && first[1] + ny * first[2] < self.rows.end
    }

    /// Calls `f` with each cell of a range that is in the rows and that a primitive of a block reaches.
    ///
    /// Blocks are packed in the order of cells, so what is in one block lies close together and the cells around all of it are few.
    #[inline(always)]
    fn each_cell<S: Simd>(
        &mut self,
        s: S,
        Cells { first, last }: &Cells,
        reach: &Reach<<S as Width<16>>::V>,
        block: u32,
    ) {
        let [nx, ny, _] = self.blocks.cells.resolution;
        let mut along_x = [0; 16];
        for (x, lanes) in (first[0]..=last[0]).zip(&mut along_x) {
            *lanes = reach.lanes_with(s, 0, x);
        }
        for z in first[2]..=last[2] {
            let in_z = reach.lanes & reach.lanes_with(s, 2, z);
            for y in first[1]..=last[1] {
                let (in_yz, row) = (in_z & reach.lanes_with(s, 1, y), y + ny * z);
                if in_yz == 0 || !self.rows.contains(&row) {
                    continue;
                }
                for (i, x) in (0..).zip(first[0]..=last[0]) {
                    let in_x: Option<&u32> = along_x.get::<usize>(i);
                    let lanes =
                        in_yz & if let Some(x) = in_x { *x } else { reach.lanes_with(s, 0, x) };
                    if lanes != 0 {
                        (self.f)(x as usize + nx as usize * row as usize, Run { block, lanes });
                    }
                }
            }
        }
    }
}

impl<V: Lanes<16>> Reach<V> {
    #[inline(always)]
    fn loaded<S: Simd + Width<16, V = V>>(s: S, ends: &[[[f32; 16]; 3]; 2], lanes: u32) -> Self {
        let [[a, b, c], [d, e, f]] = ends;
        let first = [Width::<16>::load(s, a), Width::<16>::load(s, b), Width::<16>::load(s, c)];
        let last = [Width::<16>::load(s, d), Width::<16>::load(s, e), Width::<16>::load(s, f)];
        Reach { first, last, lanes }
    }

    #[inline(always)]
    fn of_triangles<S: Simd + Width<16, V = V>>(
        s: S,
        axes: &[Axis<V>; 3],
        block: &TriangleBlock,
    ) -> Self {
        let (mut first, mut last) =
            ([Width::<16>::splat(s, 0.0); 3], [Width::<16>::splat(s, 0.0); 3]);
        let [a, b, c] = &block.corners;
        for k in 0..3 {
            let at = axes[k].at(Width::<16>::load(s, &block.vertices[k]));
            let corners = Width::<16>::of_corners(s, at, [a, b, c]);
            first[k] = axes[k].first(corners[0].min(corners[1]).min(corners[2]));
            last[k] = axes[k].last(corners[0].max(corners[1]).max(corners[2]));
        }
        Reach { first, last, lanes: block.lanes() }
    }

    /// One bit for each that reaches cell `i` along an axis.
    #[inline(always)]
    fn lanes_with<S: Simd + Width<16, V = V>>(&self, s: S, axis: usize, i: u32) -> u32 {
        let at = Width::<16>::splat(s, i as f32);
        self.first[axis].less_or_equal(at) & at.less_or_equal(self.last[axis])
    }
}

/// The cells around a block of spheres, and the first and the last of each along each axis.
fn of_spheres(cells: &Narrow, block: &SphereBlock) -> (Cells, [[[f32; 16]; 3]; 2]) {
    let mut all = Cells { first: [u32::MAX; 3], last: [0; 3] };
    let (mut firsts, mut lasts) = ([[0.0; 16]; 3], [[0.0; 16]; 3]);
    for lane in 0..(block.count as usize).min(SPHERES) {
        let (centre, radius) = block.sphere(lane);
        let Cells { first, last } = cells.range_of(&Shape::Sphere { centre, radius }.aabb());
        for k in 0..3 {
            all.first[k] = all.first[k].min(first[k]);
            all.last[k] = all.last[k].max(last[k]);
            (firsts[k][lane], lasts[k][lane]) = (first[k] as f32, last[k] as f32);
        }
    }
    (all, [firsts, lasts])
}
