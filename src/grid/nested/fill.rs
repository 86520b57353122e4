//! From pairs of a cell and a number to the lists of a grid's cells.

use super::growing::Growing;
use super::lists::{BOX_WORDS, END, Waiting};
use crate::block::cells::{CellBox, EMPTY, box_word};
use crate::grid::list::List;
use crate::grid::space::Space;
use crate::math::Aabb;
use crate::prim::{Shapes, box_around};
use core::ops::Range;

/// Where the next number of a cell's list goes: in the list that waits, or nowhere, as there is none.
const WAITS: u32 = 1 << 31;
const NOTHING: u32 = u32::MAX;

/// Makes room for the lists of some cells of a grid, whose words say how many numbers each has: to stay for up to `full` of them, to wait
/// for more. `first` is the word of cell 0.
pub(super) fn make_room(
    growing: &mut Growing,
    space: &Space,
    first: usize,
    cells: Range<usize>,
    full: u32,
) -> Option<()> {
    let Growing { words, listed, next, queue, .. } = growing;
    for (number, word) in cells.clone().zip(&mut words.from(first)[cells]) {
        let count = *word;
        *word = if count == 0 {
            NOTHING
        } else if count <= full {
            (listed.grow(BOX_WORDS + count as usize)? + BOX_WORDS) as u32
        } else {
            let place = space.place_of(space.cell(number as u32));
            let (word, list) = ((first + number) as u32, next.grow(count as usize)? as u32);
            queue.push(Waiting { place, word, first: list, count, becomes: EMPTY }.packed())?;
            WAITS | list
        };
    }
    Some(())
}

/// Cells of a grid that follow each other, for whose lists there is room.
pub(super) struct Cells<'p> {
    /// The number of the first.
    pub first: usize,
    pub words: &'p mut [u32],
    /// The lists that stay, and the number of their first element; those that wait, likewise.
    pub listed: (&'p mut [u32], usize),
    pub next: (&'p mut [u32], usize),
}

impl Cells<'_> {
    /// Writes down the numbers of these cells, in the order in which they come.
    pub fn list(&mut self, pairs: &[[u32; 2]]) {
        for [cell, id] in pairs {
            let Some(word) = self.words.get_mut((*cell as usize).wrapping_sub(self.first)) else {
                continue;
            };
            let (list, first) = if *word & WAITS == 0 { &mut self.listed } else { &mut self.next };
            list[(*word & !WAITS) as usize - *first] = *id;
            *word += 1;
        }
    }

    /// Ends the lists that stay, each with the box of its cell before it, which `box_of` finds by the cell's number and its list, and
    /// writes the words.
    pub fn finish(&mut self, mut box_of: impl FnMut(u32, &[u32]) -> CellBox) -> Option<()> {
        // Each word holds the end of its list, which is where the box before the next one is.
        let (listed, first) = &mut self.listed;
        let mut start = *first;
        for (number, word) in (self.first as u32..).zip(&mut *self.words) {
            if *word & WAITS != 0 {
                *word = EMPTY;
                continue;
            }
            let end = *word as usize;
            let (place, list) = listed[start - *first..end - *first].split_first_chunk_mut()?;
            *place = box_of(number, list).words();
            *list.last_mut()? |= END;
            *word = box_word(start as u32);
            start = end;
        }
        Some(())
    }
}

/// Lists what is in a cell that is not divided, and returns where.
pub(super) fn list_cell(listed: &mut List<u32>, cell_box: CellBox, ids: &[u32]) -> Option<u32> {
    let first = listed.grow(BOX_WORDS + ids.len())?;
    let (place, list) = listed.from(first).split_first_chunk_mut()?;
    *place = cell_box.words();
    list.copy_from_slice(ids);
    *list.last_mut()? |= END;
    Some(first as u32)
}

/// The box of a cell's primitives, as far as it is in the cell and wider by what a walk may be off.
pub(super) fn box_in(space: &Space, cell: [u32; 3], shapes: &mut Shapes, ids: &[u32]) -> CellBox {
    let mut aabb = Aabb::EMPTY;
    for id in ids {
        match shapes.corners(*id) {
            Some(corners) => aabb.add(&box_around(corners)),
            None => drop(shapes.get(*id).map(|shape| aabb.add(&shape.aabb()))),
        }
    }
    let (mut lower, mut upper) = (space.point(aabb.lower), space.point(aabb.upper));
    for k in 0..3 {
        lower[k] -= f64::from(cell[k]) + 2.0 * space.dilation[k];
        upper[k] -= f64::from(cell[k]) - 2.0 * space.dilation[k];
    }
    CellBox::around(lower, upper)
}
