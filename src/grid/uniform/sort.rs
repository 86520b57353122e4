//! Sorts primitives by the cell of their centre.

use crate::block::Census;
use crate::caller::{Caller, PARTS};
use crate::grid::list::{List, front};
use crate::grid::narrow::{Axis, Narrow};
use crate::grid::sixteen::{Sixteen, ends, for_each_sixteen};
use crate::prim::GRAIN;
use crate::scene::Scene;
use crate::simd::{Kernel, Lanes, Simd, Width, dispatch};
use crate::storage::view_mut;
use core::ops::Range;

/// What is to be sorted, and by which cells.
pub(super) struct Sorter<'s> {
    pub scene: &'s Scene<'s, 's>,
    pub census: &'s Census,
    pub cells: &'s Narrow,
}

/// Pairs of a cell and the number of a primitive.
type Pairs<'p> = List<'p, [u32; 2]>;

impl Sorter<'_> {
    /// Fills `ids` with the numbers of triangles and then of spheres, both in the order of cells. `words` are counters, and in `scratch` there is
    /// room for two words for each primitive.
    pub fn sort(
        &self,
        words: &mut [u32],
        ids: &mut [u32],
        scratch: &mut [u8],
        caller: &Caller,
    ) -> Option<()> {
        let words_in_scratch = scratch.len() / size_of::<u32>();
        let scratch = view_mut::<u32>(scratch, 0, words_in_scratch)?.as_chunks_mut().0;
        let mut pairs = List::new(scratch);
        self.find_cells(&mut pairs, caller)?;
        let triangle_count = self.census.triangle_count as usize;
        let (triangles, spheres) = ids.split_at_mut(triangle_count);
        // The numbers of triangles are before those of spheres.
        let (triangle_pairs, sphere_pairs) = pairs.all().split_at(triangle_count);
        sort_pairs(triangle_pairs, words, triangles, caller)?;
        sort_pairs(sphere_pairs, words, spheres, caller)
    }

    /// Writes down the cell of each primitive, in the order of their numbers.
    fn find_cells(&self, pairs: &mut Pairs, caller: &Caller) -> Option<()> {
        let limit = self.census.prim_limit as usize;
        // Parts have room for primitives that cannot be hit, too, as they may be anywhere.
        let parted = pairs.rest().len() >= limit;
        let size = if parted { caller.part_size(limit, GRAIN) } else { limit };
        let (mut jobs, mut room) = ([const { None }; PARTS], pairs.free());
        for (job, start) in jobs.iter_mut().zip((0..limit).step_by(size)) {
            let ids = start..limit.min(start + size);
            let (own, rest) = room.split(ids.len() as u64, (limit - start) as u64);
            room = rest;
            *job = Some((ids, own, None));
        }
        caller.for_each(&mut jobs, |job| {
            if let Some((ids, pairs, done)) = job {
                *done = self.find_cells_of(ids.clone(), pairs);
            }
        });
        let pieces = jobs.map(|job| job.map(|(_, pairs, done)| done.map(|()| pairs.piece())));
        for piece in pieces.into_iter().flatten() {
            pairs.join(piece?);
        }
        Some(())
    }

    fn find_cells_of(&self, ids: Range<usize>, pairs: &mut Pairs) -> Option<()> {
        let (sound, mut done) = (self.census.ignored_count == 0, Some(()));
        for_each_sixteen(self.scene, ids, sound, |sixteen| {
            done = done.and_then(|()| self.write(sixteen, pairs));
        });
        done
    }

    /// Writes down the cells of primitives.
    fn write(&self, sixteen: &Sixteen, pairs: &mut Pairs) -> Option<()> {
        let [x, y, z] = dispatch(Middles { cells: self.cells, sixteen });
        let [nx, ny, _] = self.cells.resolution;
        (0..sixteen.count.min(16)).try_for_each(|lane| {
            let [x, y, z] = [x[lane] as u32, y[lane] as u32, z[lane] as u32];
            pairs.push([x + nx * (y + ny * z), sixteen.ids[lane]])
        })
    }
}

/// Finds the cells that the middles of the boxes of sixteen primitives are in.
struct Middles<'a> {
    cells: &'a Narrow,
    sixteen: &'a Sixteen,
}

impl Kernel for Middles<'_> {
    type Output = [[f32; 16]; 3];

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> [[f32; 16]; 3] {
        let half = Width::<16>::splat(s, 0.5);
        let mut cells = [[0.0; 16]; 3];
        for (k, cells) in cells.iter_mut().enumerate() {
            let axis: Axis<_> = self.cells.axis::<S, 16>(s, k);
            let [least, largest] = ends(self.sixteen.along(s, k));
            axis.cell(axis.at(least.mul(half).add(largest.mul(half)))).store(cells);
        }
        cells
    }
}

/// A counting sort in which each thread sorts what is in some of the cells.
fn sort_pairs(
    pairs: &[[u32; 2]],
    words: &mut [u32],
    ids: &mut [u32],
    caller: &Caller,
) -> Option<()> {
    if ids.is_empty() {
        return Some(());
    }
    let size = words.len().div_ceil(caller.worker_count());
    let mut jobs = [const { None }; PARTS];
    for (job, (i, words)) in jobs.iter_mut().zip(words.chunks_mut(size).enumerate()) {
        *job = Some(Cells { first: i * size, words, count: 0, ids: &mut [] });
    }
    caller.for_each(&mut jobs, |job| {
        if let Some(cells) = job {
            cells.count(pairs);
        }
    });
    let mut ids = ids;
    for cells in jobs.iter_mut().flatten() {
        cells.ids = front(&mut ids, cells.count)?;
    }
    caller.for_each(&mut jobs, |job| {
        if let Some(cells) = job {
            cells.fill(pairs);
        }
    });
    Some(())
}

/// Cells that follow each other, and what is in them.
struct Cells<'p> {
    /// The number of the first.
    first: usize,
    words: &'p mut [u32],
    count: usize,
    ids: &'p mut [u32],
}

impl Cells<'_> {
    fn word(&mut self, cell: u32) -> Option<&mut u32> {
        self.words.get_mut((cell as usize).wrapping_sub(self.first))
    }

    /// Leaves in each word where the cell's ids begin.
    fn count(&mut self, pairs: &[[u32; 2]]) {
        self.words.fill(0);
        for [cell, _] in pairs {
            if let Some(count) = self.word(*cell) {
                *count += 1;
            }
        }
        self.count = counts_to_starts(self.words) as usize;
    }

    fn fill(&mut self, pairs: &[[u32; 2]]) {
        for [cell, id] in pairs {
            if let Some(next) = self.word(*cell) {
                let place = *next as usize;
                *next += 1;
                if let Some(out) = self.ids.get_mut(place) {
                    *out = *id;
                }
            }
        }
    }
}

/// Replaces each count by the sum of those before it; returns the sum of all.
pub(super) fn counts_to_starts(words: &mut [u32]) -> u32 {
    let mut sum = 0;
    for word in words {
        (*word, sum) = (sum, sum + *word);
    }
    sum
}
