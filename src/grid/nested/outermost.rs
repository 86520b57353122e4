//! The grid that all but large primitives are in.

use super::cost::{self, FULL};
use super::fill::{Cells, box_in, make_room};
use super::growing::Growing;
use super::large::Large;
use super::lists::Room;
use super::{TRIES, WORK};
use crate::block::Census;
use crate::block::cells::{cell_count, resolution_word};
use crate::caller::{Caller, PARTS};
use crate::grid::list::List;
use crate::grid::near::Near;
use crate::grid::options::GridOptions;
use crate::grid::sixteen::{Sixteen, for_each_sixteen};
use crate::grid::space::Space;
use crate::prim::{GRAIN, Source};
use crate::scene::Scene;
use core::mem::take;
use core::ops::Range;

/// What the outermost grid is made of.
pub(super) struct Outermost<'s, 'a> {
    pub scene: &'s Scene<'a, 'a>,
    pub census: &'s Census,
    pub large: &'s Large,
    pub options: &'s GridOptions,
    /// How many primitives it is to hold.
    pub count: u32,
    /// How many numbers its cells may list.
    pub most: u64,
}

/// Some primitives, counted in the cells that they come near.
struct Part<'p> {
    ids: Range<u32>,
    counts: &'p mut [u32],
    pairs: List<'p, [u32; 2]>,
    /// Cells that were looked at.
    work: u64,
    /// Whether there was room for the pairs.
    fits: bool,
}

impl Part<'_> {
    /// Counts primitives, unless it has become too much.
    #[inline(always)]
    fn take(&mut self, sixteen: &Sixteen, near: &Near, large: &[u32], most: u64) {
        let Part { counts, pairs, work, fits, .. } = self;
        if *fits && *work <= most {
            *work += near.find(sixteen, large, |cell, id, _| {
                counts[cell] += 1;
                *fits &= pairs.push([cell as u32, id]).is_some();
            });
        }
    }
}

impl Outermost<'_, '_> {
    /// As fine as the rule says, or half that, or half of that, until it fits. Its full cells wait; the pairs are those of its cells.
    pub fn grow(&self, room: &mut Room, caller: &Caller) -> Option<Space> {
        let Room { source, growing, .. } = room;
        let ends = growing.ends();
        (0..TRIES).find_map(|coarser| {
            growing.shrink_to(ends);
            let bounds = &self.large.others;
            let resolution = cost::outer(bounds, self.options, self.count, coarser);
            let space = Space::over(bounds, resolution);
            let cells = cell_count(space.resolution) as usize;
            let first = growing.words.grow(1 + cells)?;
            growing.words.from(first)[0] = resolution_word(space.resolution);
            self.count_refs(&space, first + 1, growing, caller)?;
            self.list(&space, first + 1, *source, growing, caller)?;
            Some(space)
        })
    }

    /// Writes down what comes near which cells, whose words begin at `first`, and counts it; `None` when it is too much.
    fn count_refs(
        &self,
        space: &Space,
        first: usize,
        growing: &mut Growing,
        caller: &Caller,
    ) -> Option<()> {
        // All parts but the first count where lists will be later.
        let cells = growing.words.from(first).len();
        let parts = caller.part_count().min(1 + growing.next.rest().len() / cells);
        let mut count_in = |parts| self.count_in(parts, space, first, growing, caller);
        // What is too much for a part need not be too much.
        count_in(parts).or_else(|| if parts > 1 { count_in(1) } else { None })
    }

    fn count_in(
        &self,
        parts: usize,
        space: &Space,
        first: usize,
        growing: &mut Growing,
        caller: &Caller,
    ) -> Option<()> {
        let Growing { words, next, pairs, .. } = growing;
        pairs.clear();
        let (mut counts, mut more) = (words.from(first), next.rest());
        let mut room = pairs.free();
        let (cells, limit) = (counts.len(), self.census.prim_limit);
        let size = (limit as usize).div_ceil(parts).next_multiple_of(GRAIN) as u32;
        let mut jobs = [const { None }; PARTS];
        for (job, start) in jobs.iter_mut().zip((0..limit).step_by(size as usize)) {
            let ids = start..limit.min(start.saturating_add(size));
            let (pairs, rest) = room.split(ids.len() as u64, u64::from(limit - start));
            room = rest;
            *job = Some(Part { ids, counts, pairs, work: 0, fits: true });
            let others = take(&mut more);
            (counts, more) = others.split_at_mut(cells.min(others.len()));
        }
        caller.for_each(&mut jobs, |job| {
            if let Some(part) = job {
                self.count_part(space, part);
            }
        });
        let parts = || jobs.iter().flatten();
        let fits = parts().all(|part| part.fits);
        let work = parts().fold(0u64, |work, part| work.saturating_add(part.work));
        let (whole, rest) = jobs.split_first_mut()?;
        for part in rest.iter().flatten() {
            for (sum, count) in whole.as_mut()?.counts.iter_mut().zip(&*part.counts) {
                *sum += count;
            }
        }
        let pieces = jobs.map(|job| job.map(|part| part.pairs.piece()));
        for piece in pieces.into_iter().flatten() {
            pairs.join(piece);
        }
        (fits && work <= WORK * self.most).then_some(())
    }

    fn count_part(&self, space: &Space, part: &mut Part) {
        let (most, near, large) = (WORK * self.most, Near::new(space), self.large.ids());
        part.counts.fill(0);
        let ids = part.ids.start as usize..part.ids.end as usize;
        for_each_sixteen(self.scene, ids, self.census.ignored_count == 0, |sixteen| {
            part.take(sixteen, &near, large, most);
        });
    }

    /// Gives each cell its list. Each thread fills those of some cells, and looks at all pairs for that.
    fn list(
        &self,
        space: &Space,
        first: usize,
        source: Source,
        growing: &mut Growing,
        caller: &Caller,
    ) -> Option<()> {
        let full = if self.options.most_depth() > 1 { FULL } else { u32::MAX };
        let [_, mut listed_at, mut next_at, _] = growing.ends();
        let starts = (listed_at, next_at);
        let (parts, total) = (caller.worker_count(), growing.pairs.len());
        let mut ends = [(0, 0, 0); PARTS];
        let mut start = 0;
        for (part, end) in ends.iter_mut().enumerate().take(parts) {
            let counts = &growing.words.from(first)[start..];
            let cells = if part + 1 == parts { counts.len() } else { share(counts, total / parts) };
            make_room(growing, space, first, start..start + cells, full)?;
            start += cells;
            *end = (cells, growing.listed.end(), growing.next.end());
        }
        let Growing { words, listed, next, pairs, .. } = growing;
        let mut words = words.from(first);
        let (mut listed, mut next) = (listed.from(starts.0), next.from(starts.1));
        let mut jobs = [const { None }; PARTS];
        let mut first = 0;
        for (job, (cells, listed_end, next_end)) in jobs.iter_mut().zip(ends).take(parts) {
            let (own_words, more_words) = take(&mut words).split_at_mut(cells);
            let (own_listed, more) = take(&mut listed).split_at_mut(listed_end - listed_at);
            let (own_next, others) = take(&mut next).split_at_mut(next_end - next_at);
            let listed_cells = (own_listed, listed_at);
            let cells =
                Cells { first, words: own_words, listed: listed_cells, next: (own_next, next_at) };
            first += cells.words.len();
            (words, listed, next) = (more_words, more, others);
            (listed_at, next_at) = (listed_end, next_end);
            *job = Some((cells, None));
        }
        let pairs = &*pairs.all();
        caller.for_each(&mut jobs, |job| {
            if let Some((cells, done)) = job {
                cells.list(pairs);
                let mut shapes = source.shapes();
                *done = cells.finish(|cell, ids| box_in(space, space.cell(cell), &mut shapes, ids));
            }
        });
        jobs.iter().flatten().try_for_each(|(_, done)| *done)
    }
}

/// How many cells it takes to list about `share` numbers.
fn share(counts: &[u32], share: usize) -> usize {
    let mut sum = 0;
    let reaches = |count: &u32| {
        sum += *count as usize;
        sum >= share
    };
    counts.iter().position(reaches).map_or(counts.len(), |last| last + 1)
}
