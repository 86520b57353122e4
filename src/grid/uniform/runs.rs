//! The runs of the cells, found from the leaf blocks.
//!
//! A thread counts and fills the runs of some rows of cells, and looks for that at all blocks that come near.

use super::sort::counts_to_starts;
use crate::block::PartsMut;
use crate::block::cells::{EMPTY, LAST, Run, run_word};
use crate::block::leaf::{KIND_SPHERES, KIND_TRIANGLES, SphereBlock, TriangleBlock, block_ref};
use crate::caller::{Caller, PARTS};
use crate::grid::list::front;
use crate::grid::space::{Range, Space};
use crate::math::Aabb;
use crate::prim::Shape;
use crate::storage::view_mut;

/// Writes the words of all cells, and their runs behind the leaf blocks, each in the order of blocks; returns how many entries these have.
pub(super) fn write(space: &Space, parts: PartsMut, caller: &Caller) -> Option<u32> {
    let PartsMut { words, sphere_blocks, triangle_blocks, rest, .. } = parts;
    let blocks = Blocks { space, triangles: triangle_blocks, spheres: sphere_blocks };
    let (rows, row) = (space.resolution[1] * space.resolution[2], space.resolution[0]);
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
    fn place(&self, space: &Space) -> (core::ops::Range<u32>, usize) {
        let row = space.resolution[0] as usize;
        let count = (self.words.len() / row) as u32;
        (self.first..self.first + count, self.first as usize * row)
    }

    /// Leaves in each word the start of its cell's run among those of these rows.
    fn count(&mut self, blocks: &Blocks) {
        let (rows, first) = self.place(blocks.space);
        self.words.fill(0);
        blocks.for_each_entry(rows, |cell, _| {
            if let Some(count) = self.words.get_mut(cell - first) {
                *count += 1;
            }
        });
        self.count = counts_to_starts(self.words);
    }

    /// Writes the runs, and the final words.
    fn fill(&mut self, blocks: &Blocks) {
        let (rows, first) = self.place(blocks.space);
        blocks.for_each_entry(rows, |cell, entry| {
            if let Some(next) = self.words.get_mut(cell - first) {
                if let Some(run) = self.runs.get_mut(*next as usize) {
                    *run = entry;
                }
                *next += 1;
            }
        });
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
    space: &'p Space,
    triangles: &'p [TriangleBlock],
    spheres: &'p [SphereBlock],
}

impl Blocks<'_> {
    /// Calls `f` with every cell of some rows that holds lanes of a block and the entry that says so, block by block.
    fn for_each_entry(&self, rows: core::ops::Range<u32>, mut f: impl FnMut(usize, Run)) {
        let [_, ny, _] = self.space.resolution;
        for (number, block) in (0..).zip(self.triangles) {
            let Range { first, last } = self.space.range_of(&block.aabb);
            if last[1] + ny * last[2] < rows.start || first[1] + ny * first[2] >= rows.end {
                continue;
            }
            let boxes = |i| Shape::Triangle(block.triangle(i)).aabb();
            let block_ref = block_ref(KIND_TRIANGLES, number);
            self.cells_of_block(&rows, block.count, boxes, |cell, lanes| {
                f(cell, Run { block: block_ref, lanes });
            });
        }
        for (number, block) in (0..).zip(self.spheres) {
            let boxes = |i| {
                let (centre, radius) = block.sphere(i);
                Shape::Sphere { centre, radius }.aabb()
            };
            let block_ref = block_ref(KIND_SPHERES, number);
            self.cells_of_block(&rows, block.count, boxes, |cell, lanes| {
                f(cell, Run { block: block_ref, lanes });
            });
        }
    }

    /// Calls `f` with each cell of the rows that one of the `count` boxes reaches, and the lanes of those that do.
    ///
    /// Blocks are packed in the order of cells, so the boxes of one block lie close together and the
    /// cells around all of them are few.
    fn cells_of_block(
        &self,
        rows: &core::ops::Range<u32>,
        count: u32,
        boxes: impl Fn(usize) -> Aabb,
        mut f: impl FnMut(usize, u32),
    ) {
        let space = self.space;
        let mut ranges = [Range { first: [0; 3], last: [0; 3] }; 16];
        let mut all = Range { first: [u32::MAX; 3], last: [0; 3] };
        let ranges = &mut ranges[..(count as usize).min(16)];
        for (lane, range) in ranges.iter_mut().enumerate() {
            *range = space.range_of(&boxes(lane));
            for k in 0..3 {
                all.first[k] = all.first[k].min(range.first[k]);
                all.last[k] = all.last[k].max(range.last[k]);
            }
        }
        let lanes_with = |axis: usize, i: u32| {
            let reaches = |range: &Range| range.first[axis] <= i && i <= range.last[axis];
            ranges.iter().rev().fold(0u32, |lanes, range| lanes << 1 | u32::from(reaches(range)))
        };
        let mut along_x = [0; 16];
        for (x, lanes) in (all.first[0]..=all.last[0]).zip(&mut along_x) {
            *lanes = lanes_with(0, x);
        }
        let ny = space.resolution[1];
        for z in all.first[2]..=all.last[2] {
            let in_z = lanes_with(2, z);
            for y in all.first[1]..=all.last[1] {
                let in_yz = in_z & lanes_with(1, y);
                if in_yz == 0 || !rows.contains(&(y + ny * z)) {
                    continue;
                }
                for (i, x) in (all.first[0]..=all.last[0]).enumerate() {
                    let lanes = in_yz & along_x.get(i).map_or_else(|| lanes_with(0, x), |x| *x);
                    if lanes != 0 {
                        f(space.number([x, y, z]), lanes);
                    }
                }
            }
        }
    }
}
