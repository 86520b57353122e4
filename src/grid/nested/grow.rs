//! Divides space, and lists what comes near each cell.

use super::cost::{self, FULL};
use super::distance;
use super::large::{Large, for_each_other};
use super::lists::{BOX_WORDS, END, List, Room, Waiting, numbers};
use crate::block::Census;
use crate::block::cells::{
    CellBox, EMPTY, GridHead, box_word, cell_count, grid_word, resolution_word, run_word,
};
use crate::grid::options::GridOptions;
use crate::grid::overlap::cells_near;
use crate::grid::space::Space;
use crate::math::Aabb;
use crate::prim::{Shapes, Survey, geometries};
use crate::scene::Scene;

/// A grid whose boxes reach more cells than this for each number that may be listed is too fine: it would take too
/// long to find out which of these are near.
const WORK: u64 = 32;

/// How often a grid that is too fine is halved along each axis before it is given up.
const TRIES: u32 = 10;

/// What has grown; words and lists lie at the end of the memory.
pub(super) struct Grown {
    /// The outermost grids: for large primitives, if there are any, and for all others.
    pub heads: [Option<GridHead>; 2],
    pub words: usize,
    pub listed: usize,
    /// With how much room it was done.
    pub most: u64,
}

/// Grows a grid whose cells list about `most` numbers at the most; `None` when not even the outermost grid has room.
pub(super) fn grow(
    scene: &Scene,
    survey: &Survey,
    census: &Census,
    options: &GridOptions,
    most: u64,
    bytes: &mut [u8],
) -> Option<Grown> {
    let large = Large::find(scene, census);
    let mut room = Room::new(survey, most, bytes)?;
    geometries(scene, room.geometries);
    let mut heads = [None; 2];
    if !large.ids().is_empty() {
        let first_word = large_cell(&large, &mut room)?;
        heads[0] = Some(Space::over(&large.bounds[0], [1; 3]).head(first_word, 1));
    }
    let others = census.hittable() - large.ids().len() as u32;
    if others > 0 {
        let first_word = room.words.len() as u32;
        let outermost = Outermost { scene, census, large: &large, options, count: others };
        let space = outermost.grow(most, &mut room)?;
        let finest = Divider::new(scene, space, options, most, &mut room).divide_all()?;
        heads[1] = Some(space.head(first_word, finest));
    }
    distance::fill(&mut room)?;
    Some(Grown { heads, words: room.words.len(), listed: room.listed.len(), most })
}

/// One cell that lists all large primitives. The grid's own box is as good as one in the cell.
fn large_cell(large: &Large, room: &mut Room) -> Option<u32> {
    let first_word = room.words.len() as u32;
    room.words.push(resolution_word([1; 3]))?;
    let first = list_cell(&mut room.listed, CellBox::WHOLE, large.ids())?;
    room.words.push(run_word(first))?;
    Some(first_word)
}

/// Lists what is in a cell that is not divided, and returns where.
fn list_cell(listed: &mut List, cell_box: CellBox, ids: &[u32]) -> Option<u32> {
    let first = listed.grow(BOX_WORDS + ids.len())?;
    let (place, list) = listed.all()[first..].split_first_chunk_mut()?;
    *place = cell_box.words();
    list.copy_from_slice(ids);
    *list.last_mut()? |= END;
    Some(first as u32)
}

/// The box of a cell's primitives, as far as it is in the cell and wider by what a walk may be off.
fn box_in(space: &Space, cell: [u32; 3], shapes: &mut Shapes, ids: &[u32]) -> CellBox {
    let mut aabb = Aabb::EMPTY;
    for shape in ids.iter().filter_map(|id| shapes.get(id & !END)) {
        aabb.add(&shape.aabb());
    }
    let (mut lower, mut upper) = (space.point(aabb.lower), space.point(aabb.upper));
    for k in 0..3 {
        lower[k] -= f64::from(cell[k]) + 2.0 * space.dilation[k];
        upper[k] -= f64::from(cell[k]) - 2.0 * space.dilation[k];
    }
    CellBox::around(lower, upper)
}

/// The grid that all but large primitives are in.
struct Outermost<'s, 'a> {
    scene: &'s Scene<'a, 'a>,
    census: &'s Census,
    large: &'s Large,
    options: &'s GridOptions,
    count: u32,
}

impl Outermost<'_, '_> {
    /// As fine as the rule says, or half that, or half of that, until it fits.
    fn grow(&self, most: u64, room: &mut Room) -> Option<Space> {
        let first_word = room.words.len();
        (0..TRIES).find_map(|coarser| {
            room.words.shrink_to(first_word);
            room.lists[0].shrink_to(0);
            let bounds = &self.large.bounds[1];
            let resolution = cost::outer(bounds, self.options, self.count, coarser);
            let space = Space::over(bounds, resolution);
            self.fill(&space, most, room).map(|()| space)
        })
    }

    fn fill(&self, space: &Space, most: u64, room: &mut Room) -> Option<()> {
        let cells = cell_count(space.resolution) as usize;
        let first = room.words.grow(1 + cells)?;
        room.words.all()[first] = resolution_word(space.resolution);
        let total = self.count_refs(space, most, &mut room.words.all()[first + 1..])?;
        room.lists[0].grow(total)?;
        let (starts, list) = (&mut room.words.all()[first + 1..], room.lists[0].all());
        let mut sum = 0;
        for start in starts.iter_mut() {
            (*start, sum) = (sum, sum + *start);
        }
        for_each_other(self.scene, self.census, self.large, |prim| {
            cells_near(space, &prim.shape, |cell| {
                if let Some(next) = starts.get_mut(cell) {
                    list[*next as usize] = prim.id;
                    *next += 1;
                }
            });
        });
        self.part(space, first + 1, room)
    }

    /// Counts what comes near each cell; `None` when it is too much.
    fn count_refs(&self, space: &Space, most: u64, counts: &mut [u32]) -> Option<usize> {
        counts.fill(0);
        let (mut work, mut total) = (0u64, 0);
        for_each_other(self.scene, self.census, self.large, |prim| {
            if work <= WORK * most {
                work += cells_near(space, &prim.shape, |cell| {
                    counts[cell] += 1;
                    total += 1;
                });
            }
        });
        (work <= WORK * most).then_some(total)
    }

    /// Lists the cells with few primitives, and lets the others wait. Each word holds the end of the cell's list, which is
    /// where the next one's begins.
    fn part(&self, space: &Space, first: usize, room: &mut Room) -> Option<()> {
        let Room { geometries, words, listed, lists: [list, _], waiting: [queue, _], .. } = room;
        let mut shapes = Shapes::new(self.scene, geometries);
        let mut start = 0;
        for number in 0..cell_count(space.resolution) as usize {
            let word = &mut words.all()[first + number];
            let end = *word;
            let count = end - start;
            *word = EMPTY;
            if count > FULL && self.options.most_depth() > 1 {
                let place = space.place_of(space.cell(number as u32));
                let word = (first + number) as u32;
                queue.push(&Waiting { place, word, first: start, count })?;
            } else if count > 0 {
                let ids = &list.all()[start as usize..end as usize];
                let cell_box = box_in(space, space.cell(number as u32), &mut shapes, ids);
                *word = box_word(list_cell(listed, cell_box, ids)?);
            }
            start = end;
        }
        Some(())
    }
}

/// Divides full cells, those of one depth before those of the next.
struct Divider<'s, 'a, 'r, 'b> {
    scene: &'s Scene<'a, 'a>,
    space: Space,
    options: &'s GridOptions,
    most: u64,
    room: &'r mut Room<'b>,
    /// Numbers that cells list, waiting ones too.
    total: u64,
    finest: f64,
}

impl<'s, 'a, 'r, 'b> Divider<'s, 'a, 'r, 'b> {
    fn new(
        scene: &'s Scene<'a, 'a>,
        space: Space,
        options: &'s GridOptions,
        most: u64,
        room: &'r mut Room<'b>,
    ) -> Self {
        let total = (numbers(room.listed.all()).count() + room.lists[0].len()) as u64;
        Divider { scene, space, options, most, room, total, finest: 1.0 }
    }

    /// Divides all cells that wait, and the cells in these; returns into how many parts at most along an axis.
    fn divide_all(mut self) -> Option<u32> {
        for depth in 2..=self.options.most_depth() {
            let is_last = depth == self.options.most_depth();
            for number in 0..self.room.waiting[0].len() {
                let cell = self.room.waiting[0].get(number)?;
                if !self.divide(&cell, is_last)? {
                    self.leave_whole(&cell)?;
                }
            }
            self.room.lists.swap(0, 1);
            self.room.waiting.swap(0, 1);
            self.room.lists[1].shrink_to(0);
            self.room.waiting[1].clear();
        }
        Some(self.finest as u32)
    }

    /// Lists what is in a cell that waits.
    fn leave_whole(&mut self, cell: &Waiting) -> Option<()> {
        let Room { geometries, words, listed, lists: [list, _], .. } = &mut *self.room;
        let ids = &list.all()[cell.first as usize..][..cell.count as usize];
        let space = self.space.within(cell.place, [1; 3]);
        let mut shapes = Shapes::new(self.scene, geometries);
        let cell_box = box_in(&space, [0; 3], &mut shapes, ids);
        words.all()[cell.word as usize] = box_word(list_cell(listed, cell_box, ids)?);
        Some(())
    }

    /// Divides a cell, more coarsely if it must be; false when it stays whole.
    fn divide(&mut self, cell: &Waiting, is_last: bool) -> Option<bool> {
        for coarser in 0..TRIES {
            let resolution =
                cost::inner(&self.space, &cell.place, self.options, cell.count, coarser);
            let Some(resolution) = resolution else { break };
            let space = self.space.within(cell.place, resolution);
            let first = self.room.words.len();
            match self.count_all(cell, &space) {
                Some(true) => {
                    self.room.words.all()[cell.word as usize] = grid_word(first as u32);
                    self.total += self.room.pairs.len() as u64 / 2;
                    self.total -= u64::from(cell.count);
                    self.finest = space.parts().into_iter().fold(self.finest, f64::max);
                    self.part(&space, first + 1, is_last)?;
                    return Some(true);
                }
                counted => {
                    self.room.words.shrink_to(first);
                    if counted.is_some() {
                        break;
                    }
                }
            }
        }
        Some(false)
    }

    /// Begins the grid in a cell by counting what is in its cells; whether it is worth it, and `None` when it is too fine.
    fn count_all(&mut self, cell: &Waiting, space: &Space) -> Option<bool> {
        let cells = cell_count(space.resolution) as usize;
        let first = self.room.words.grow(1 + cells)?;
        self.room.words.all()[first] = resolution_word(space.resolution);
        self.count_refs(cell, space, first + 1)?;
        Some(cost::is_worth_it(cell.count, &self.room.words.all()[first + 1..]))
    }

    /// Writes down which primitives come near which cells, and counts them; `None` when it is too much.
    fn count_refs(&mut self, cell: &Waiting, space: &Space, first: usize) -> Option<()> {
        let Room { geometries, words, lists: [list, _], pairs, .. } = &mut *self.room;
        let counts = &mut words.all()[first..];
        counts.fill(0);
        pairs.shrink_to(0);
        let left = 2 * (self.most + u64::from(cell.count)).saturating_sub(self.total) as usize;
        let (mut work, mut full) = (0, false);
        let mut shapes = Shapes::new(self.scene, geometries);
        for id in &list.all()[cell.first as usize..][..cell.count as usize] {
            let shape = shapes.get(*id)?;
            work += cells_near(space, &shape, |number| {
                counts[number] += 1;
                full |= pairs.push(number as u32).is_none() | pairs.push(*id).is_none();
            });
            if full || pairs.len() > left || work > WORK * u64::from(cell.count) {
                return None;
            }
        }
        Some(())
    }

    /// Gives each cell its list: cells with few primitives one that stays, others one that waits.
    fn part(&mut self, space: &Space, first: usize, is_last: bool) -> Option<()> {
        let Room {
            geometries, words, listed, lists: [_, next], waiting: [_, queue], pairs, ..
        } = &mut *self.room;
        let mut shapes = Shapes::new(self.scene, geometries);
        let words = &mut words.all()[first..];
        let mut start = listed.len();
        for (number, word) in words.iter_mut().enumerate() {
            let count = *word;
            *word = if count == 0 {
                NOTHING
            } else if count <= FULL || is_last {
                (listed.grow(BOX_WORDS + count as usize)? + BOX_WORDS) as u32
            } else {
                let place = space.place_of(space.cell(number as u32));
                let (word, first) = ((first + number) as u32, next.grow(count as usize)? as u32);
                queue.push(&Waiting { place, word, first, count })?;
                WAITS | first
            };
        }
        let (listed, next) = (listed.all(), next.all());
        for [number, id] in pairs.all().as_chunks::<2>().0 {
            let word = &mut words[*number as usize];
            let list = if *word & WAITS == 0 { &mut *listed } else { &mut *next };
            list[(*word & !WAITS) as usize] = *id;
            *word += 1;
        }
        // Each word now holds the end of the cell's list, which is where the next one's box begins.
        for (number, word) in words.iter_mut().enumerate() {
            if *word & WAITS == 0 {
                let end = *word as usize;
                let (place, list) = listed[start..end].split_first_chunk_mut()?;
                *place = box_in(space, space.cell(number as u32), &mut shapes, list).words();
                *list.last_mut()? |= END;
                *word = box_word(start as u32);
                start = end;
            } else {
                *word = EMPTY;
            }
        }
        Some(())
    }
}

/// Where the next number of a cell's list goes: in the list that waits, or nowhere, as there is none.
const WAITS: u32 = 1 << 31;
const NOTHING: u32 = u32::MAX;
