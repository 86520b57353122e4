//! The grids of one depth before those of the next: one after the other, or many at the same time.

use super::cost;
use super::divide::{Depth, Divider, least_growth};
use super::growing::{Growing, Pieces};
use super::lists::{Record, Room, Waiting};
use crate::caller::{Caller, PARTS};
use crate::grid::options::GridOptions;
use crate::grid::space::Space;
use crate::prim::Source;
use core::mem::take;

/// Divides full cells, those of one depth before those of the next.
pub(super) struct Levels<'r> {
    /// The outermost grid.
    pub space: Space,
    pub options: &'r GridOptions,
    pub caller: &'r Caller<'r>,
    /// How many numbers cells may list, and how many they do, waiting ones too.
    pub most: u64,
    pub total: u64,
    /// Into how many parts at most an outermost cell is divided along an axis.
    pub finest: f64,
}

/// Some cells that wait, divided as if any number might be listed.
struct Part<'s, 'a, 'p> {
    divider: Divider<'s, 'a, 'p>,
    waiting: &'p mut [Record],
    done: Option<()>,
}

impl Part<'_, '_, '_> {
    fn outcome(&self) -> Outcome {
        let count = |cell: &Record| Waiting::unpacked(*cell).count;
        Outcome {
            pieces: self.divider.growing.pieces(),
            cells: self.waiting.len(),
            more: self.done.map(|()| self.divider.total - START),
            peak: self.divider.peak - START,
            largest: self.waiting.iter().map(count).max().unwrap_or(0),
            finest: self.divider.finest,
        }
    }
}

/// About so many numbers of cells that wait are a part.
const PART: usize = 1 << 13;

/// What a part begins to count from, so that it may go down.
const START: u64 = u64::MAX / 4;

/// What such a part came to.
struct Outcome {
    pieces: Pieces,
    cells: usize,
    /// By how many the numbers that are listed became more; nothing if there was no room for them.
    more: Option<u64>,
    /// By how many at the most, also if a grid had been worth it that was not: one thread tries none for which there is no room.
    peak: u64,
    /// How many numbers the largest of the cells listed.
    largest: u32,
    finest: f64,
}

impl<'r> Levels<'r> {
    /// Divides all cells that wait, and the cells in these; returns into how many parts at most along an axis.
    pub fn divide_all(mut self, room: &mut Room) -> Option<u32> {
        for depth in 2..=self.options.most_depth() {
            room.turn();
            let left = self.most.saturating_sub(self.total);
            let depth = Depth {
                density: cost::inner_density(room.list.len() as u64, left),
                is_last: depth == self.options.most_depth(),
            };
            let done = self.divide_together(room, depth)?;
            self.divide_rest(room, done, depth)?;
        }
        room.turn();
        Some(self.finest as u32)
    }

    /// Divides cells one after the other, from cell `done` on.
    fn divide_rest(&mut self, room: &mut Room, done: usize, depth: Depth) -> Option<()> {
        let Room { source, list, waiting, growing } = room;
        let waiting = waiting.all().get_mut(done..)?;
        let mut divider = self.divider(*source, list.all(), growing.free(), depth);
        (divider.most, divider.total, divider.is_part) = (self.most, self.total, false);
        divider.divide_each(waiting)?;
        (self.total, self.finest) = (divider.total, divider.finest);
        let pieces = divider.growing.pieces();
        growing.join(&pieces, waiting);
        Some(())
    }

    /// A divider of cells with these lists, to which any number may be listed.
    fn divider<'s, 'a, 'p>(
        &self,
        source: Source<'s, 'a>,
        list: &'p [u32],
        growing: Growing<'p>,
        depth: Depth,
    ) -> Divider<'s, 'a, 'p>
    where
        'r: 'p,
    {
        let Levels { space, options, finest, .. } = *self;
        let (most, total) = (u64::MAX / 2, START);
        Divider {
            source,
            space,
            options,
            depth,
            is_part: true,
            list,
            growing,
            pair_count: 0,
            most,
            total,
            peak: total,
            finest,
        }
    }

    /// Divides cells at the same time, round after round; returns how many of the first are done.
    ///
    /// A part of a round knows nothing of the others. If it had not enough room, or if there are more numbers with its than may be
    /// listed, its cells and all that follow are left, to be divided one by one.
    fn divide_together(&mut self, room: &mut Room, depth: Depth) -> Option<usize> {
        let (mut done, all) = (0, room.waiting.len());
        if self.caller.part_count() == 1 || room.list.len() < PART {
            return Some(0);
        }
        while done < all {
            for outcome in self.divide_parts(room, done, depth).into_iter().flatten() {
                let Outcome { pieces, cells, more, peak, largest, finest } = outcome;
                let total = more.map(|more| self.total + more);
                let tried = self.total + peak;
                let fits = |total: &u64| (*total).max(tried) + least_growth(largest) <= self.most;
                let Some(total) = total.filter(fits) else { return Some(done) };
                room.growing.join(&pieces, room.waiting.all().get(done..done + cells)?);
                (self.total, self.finest) = (total, self.finest.max(finest));
                done += cells;
            }
        }
        Some(done)
    }

    /// Divides as many cells from cell `done` on as make a round.
    fn divide_parts(&self, room: &mut Room, done: usize, depth: Depth) -> [Option<Outcome>; PARTS] {
        let Room { source, list, waiting, growing } = room;
        let (mut waiting, mut free) = (&mut waiting.all()[done..], growing.free());
        let list = &*list.all();
        // The lists of cells that wait follow each other.
        let first = |cells: &[Record]| {
            cells.first().map_or(list.len(), |cell| Waiting::unpacked(*cell).first as usize)
        };
        let (mut jobs, mut from) = ([const { None }; PARTS], first(waiting));
        let end = list.len().min(from + PART * self.caller.part_count());
        for job in jobs.iter_mut() {
            if from >= end {
                break;
            }
            let count = waiting.partition_point(|cell| first(&[*cell]) < from + PART);
            let (own, others) = take(&mut waiting).split_at_mut(count);
            let to = first(others);
            let (growing, rest) = free.split((to - from) as u64, (end.max(to) - from) as u64);
            let divider = self.divider(*source, list, growing, depth);
            *job = Some(Part { divider, waiting: own, done: None });
            (waiting, free, from) = (others, rest, to);
        }
        self.caller.for_each(&mut jobs, |job| {
            if let Some(Part { divider, waiting, done }) = job {
                *done = divider.divide_each(waiting);
            }
        });
        jobs.map(|job| Some(job?.outcome()))
    }
}
