//! Divides full cells, one after the other.

use super::cost::{self, FULL};
use super::fill::{Cells, box_in, list_cell, make_room};
use super::growing::Growing;
use super::lists::{Record, Waiting};
use super::{TRIES, WORK};
use crate::block::cells::{box_word, cell_count, grid_word, resolution_word};
use crate::grid::list::List;
use crate::grid::near::{NOTHING, Near, Sum};
use crate::grid::options::GridOptions;
use crate::grid::sixteen::Sixteen;
use crate::grid::space::Space;
use crate::prim::Source;

/// What the grids of one depth have in common.
#[derive(Clone, Copy)]
pub(super) struct Depth {
    /// Cells for each primitive.
    pub density: f64,
    /// Whether cells in these are as deep as they may be.
    pub is_last: bool,
}

/// Divides cells of one depth.
pub(super) struct Divider<'s, 'a, 'p> {
    pub source: Source<'s, 'a>,
    /// The outermost grid.
    pub space: Space,
    pub options: &'p GridOptions,
    pub depth: Depth,
    /// Whether these are a part of those there are, and there may be more room than it has.
    pub is_part: bool,
    /// The lists of the cells.
    pub list: &'p [u32],
    pub growing: Growing<'p>,
    /// How many pairs of a cell and a number there are in the grid that was counted last.
    pub pair_count: usize,
    /// How many numbers cells may list, and how many they do, waiting ones too.
    pub most: u64,
    pub total: u64,
    /// The most that they did, or would have if a grid that was tried had been worth it.
    pub peak: u64,
    /// Into how many parts at most an outermost cell is divided along an axis.
    pub finest: f64,
}

/// What counting the primitives in the cells of a grid leads to.
#[derive(Clone, Copy, PartialEq)]
enum Counted {
    WorthIt,
    NotWorthIt,
    /// Its cells are so small that primitives are in too many.
    TooFine,
    NoRoom,
}

/// By how many numbers the lists of a cell's cells are likely to be longer than its own, at the least: with room for
/// fewer it is not tried.
pub(super) fn least_growth(count: u32) -> u64 {
    u64::from(count / 16)
}

impl Divider<'_, '_, '_> {
    /// Divides cells that wait, or lists what is in those that had better stay whole; writes down what they become.
    pub fn divide_each(&mut self, waiting: &mut [Record]) -> Option<()> {
        for record in waiting {
            let mut cell = Waiting::unpacked(*record);
            cell.becomes = match self.divide(&cell)? {
                Some(word) => word,
                None => self.leave_whole(&cell)?,
            };
            *record = cell.packed();
        }
        Some(())
    }

    /// Lists what is in a cell.
    fn leave_whole(&mut self, cell: &Waiting) -> Option<u32> {
        let space = self.space.within(cell.place, [1; 3]);
        let ids = &self.list[cell.first as usize..][..cell.count as usize];
        let cell_box = box_in(&space, [0; 3], &mut self.source.shapes(), ids);
        Some(box_word(list_cell(&mut self.growing.listed, cell_box, ids)?))
    }

    /// Divides a cell, more coarsely if it must be; returns its word, if it is not to stay whole.
    fn divide(&mut self, cell: &Waiting) -> Option<Option<u32>> {
        if self.total + least_growth(cell.count) > self.most {
            return Some(None);
        }
        for coarser in 0..TRIES {
            let Divider { space, options, depth, .. } = self;
            let resolution =
                cost::inner(space, &cell.place, options, cell.count, depth.density, coarser);
            let Some(resolution) = resolution else { break };
            let space = self.space.within(cell.place, resolution);
            let (first, near) = (self.growing.words.end(), Near::new(&space));
            let counted = self.count_all(cell, &space, &near);
            if counted == Counted::WorthIt {
                self.total += self.pair_count as u64;
                self.total -= u64::from(cell.count);
                self.finest = space.parts().into_iter().fold(self.finest, f64::max);
                self.fill(&space, &near, first + 1)?;
                return Some(Some(grid_word(first as u32)));
            }
            self.growing.words.shrink_to(first);
            match counted {
                Counted::NoRoom if self.is_part => return None,
                Counted::NoRoom | Counted::TooFine => {}
                Counted::WorthIt | Counted::NotWorthIt => break,
            }
        }
        Some(None)
    }

    /// Begins the grid in a cell by counting what is in its cells.
    fn count_all(&mut self, cell: &Waiting, space: &Space, near: &Near) -> Counted {
        let cells = cell_count(space.resolution) as usize;
        let Some(first) = self.growing.words.grow(1 + cells) else { return Counted::NoRoom };
        self.growing.words.from(first)[0] = resolution_word(space.resolution);
        let counted = self.count_refs(cell, near, first + 1);
        if counted == Counted::WorthIt {
            let would = self.total + self.pair_count as u64 - u64::from(cell.count);
            self.peak = self.peak.max(would);
        }
        let counts = &self.growing.words.from(first)[1..];
        if counted == Counted::WorthIt && !cost::is_worth_it(cell.count, counts) {
            return Counted::NotWorthIt;
        }
        counted
    }

    /// Writes down which primitives come near which cells, counts them, and adds up their boxes.
    fn count_refs(&mut self, cell: &Waiting, near: &Near, first: usize) -> Counted {
        let left = (self.most + u64::from(cell.count)).saturating_sub(self.total);
        let ids = &self.list[cell.first as usize..][..cell.count as usize];
        let Growing { words, pairs, .. } = &mut self.growing;
        let counts = words.from(first);
        counts.fill(0);
        pairs.clear();
        let Some((boxes, mut pairs)) = boxes_and_pairs(pairs.rest(), counts.len()) else {
            return Counted::NoRoom;
        };
        boxes.fill(NOTHING);
        let (mut work, mut full) = (0, false);
        let (mut shapes, mut sixteen) = (self.source.shapes(), Sixteen::EMPTY);
        for ids in ids.chunks(16) {
            sixteen.clear();
            for id in ids {
                match shapes.corners(*id) {
                    Some(corners) => sixteen.push_triangle(*id, corners),
                    None => shapes.get(*id).is_some_and(|shape| sixteen.push(*id, &shape)),
                };
            }
            work += near.find(&sixteen, &[], |number, id, ends| {
                counts[number] += 1;
                full |= pairs.push([number as u32, id]).is_none();
                ends.add(&mut boxes[number]);
            });
            if full || pairs.len() as u64 > left {
                return Counted::NoRoom;
            }
            if work > WORK * u64::from(cell.count) {
                return Counted::TooFine;
            }
        }
        self.pair_count = pairs.len();
        Counted::WorthIt
    }

    /// Gives each cell of a grid its list.
    fn fill(&mut self, space: &Space, near: &Near, first: usize) -> Option<()> {
        let full = if self.depth.is_last { u32::MAX } else { FULL };
        let [_, listed_from, next_from, _] = self.growing.ends();
        let all = 0..cell_count(space.resolution) as usize;
        make_room(&mut self.growing, space, first, all, full)?;
        let Growing { words, listed, next, pairs, .. } = &mut self.growing;
        let mut cells = Cells {
            first: 0,
            words: words.from(first),
            listed: (listed.from(listed_from), listed_from),
            next: (next.from(next_from), next_from),
        };
        let (boxes, mut pairs) = boxes_and_pairs(pairs.rest(), cells.words.len())?;
        cells.list(pairs.rest().get(..self.pair_count)?);
        cells.finish(|number, _| near.box_in(space.cell(number), &boxes[number as usize]))
    }
}

/// The room for pairs in two: a box for each cell of a grid, and pairs.
fn boxes_and_pairs(
    room: &mut [[u32; 2]],
    cells: usize,
) -> Option<(&mut [Sum], List<'_, [u32; 2]>)> {
    const PAIRS: usize = size_of::<Sum>() / size_of::<[u32; 2]>();
    let (boxes, pairs) = room.split_at_mut_checked(PAIRS * cells)?;
    Some((boxes.as_flattened_mut().as_chunks_mut().0, List::new(pairs)))
}
