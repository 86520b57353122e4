//! How far empty space goes on, in each octant of directions.

use crate::block::cells::{SIDES, cell_count, resolution};
use crate::caller::{Caller, PARTS};
use core::mem::take;

/// No cube is larger than that.
const FAR: u32 = SIDES[7] as u32;

/// So many words are worth a thread.
const PART: usize = 1 << 14;

/// Writes into the word of each empty cell how large a cube of empty cells it is the corner of, for each octant. `sides` is for
/// scratch: a number for each cell of the largest grid, or for each word where there are threads.
pub(super) fn fill(words: &mut [u32], sides: &mut [u32], caller: &Caller) -> Option<()> {
    if caller.part_count() == 1 || words.len() < PART || sides.len() < words.len() {
        return fill_grids(words, sides);
    }
    let (mut jobs, size) = ([const { None }; PARTS], caller.part_size(words.len(), PART));
    let (mut words, mut sides) = (words, sides);
    for job in &mut jobs {
        let end = grids_in(words, size)?;
        let (grids, more) = take(&mut words).split_at_mut(end);
        let (own, rest) = take(&mut sides).split_at_mut(grids.len());
        (words, sides) = (more, rest);
        *job = Some((grids, own, None));
    }
    caller.for_each(&mut jobs, |job| {
        if let Some((words, sides, done)) = job {
            *done = fill_grids(words, sides);
        }
    });
    jobs.iter().flatten().try_for_each(|(_, _, done)| *done)
}

/// The words of the first grids, at least `size` if there are so many.
fn grids_in(words: &[u32], size: usize) -> Option<usize> {
    let mut end = 0;
    while end < size.min(words.len()) {
        end += 1 + cell_count(resolution(*words.get(end)?)) as usize;
    }
    Some(end)
}

/// The same for the grids in some words, one after the other.
fn fill_grids(mut words: &mut [u32], sides: &mut [u32]) -> Option<()> {
    while let Some((word, rest)) = words.split_first_mut() {
        let n = resolution(*word);
        let (cells, more) = rest.split_at_mut_checked(cell_count(n) as usize)?;
        let sides = sides.get_mut(..cells.len())?;
        for octant in 0..8 {
            fill_octant(cells, n.map(|n| n as usize), octant, sides);
        }
        words = more;
    }
    Some(())
}

/// The side of a cell's cube is one more than the least of the seven cells ahead of it, or nothing when it is not empty. Beyond
/// the walls all is empty.
fn fill_octant(words: &mut [u32], [nx, ny, nz]: [usize; 3], octant: u32, sides: &mut [u32]) {
    // Cells in the order in which those ahead come first.
    let place = |i: usize, n: usize, axis: u32| if octant >> axis & 1 == 0 { n - 1 - i } else { i };
    let rows = |j: usize, k: usize| (j < ny && k < nz).then(|| nx * (j + ny * k));
    for k in 0..nz {
        for j in 0..ny {
            let row = |dj: usize, dk: usize| {
                let (j, k) = (j.checked_sub(dj)?, k.checked_sub(dk)?);
                rows(place(j, ny, 1), place(k, nz, 2))
            };
            let here = nx * (place(j, ny, 1) + ny * place(k, nz, 2));
            let beside = [row(1, 0), row(0, 1), row(1, 1)];
            // Of the cell before: its side, and the least one beside it.
            let (mut before, mut beside_before) = (FAR, FAR);
            for i in 0..nx {
                let i = place(i, nx, 0);
                let beside = beside.into_iter().flatten();
                let beside = beside.fold(FAR, |least, row| least.min(sides[row + i]));
                let least = before.min(beside_before).min(beside);
                let word = &mut words[here + i];
                let side = if *word >> 30 == 0 { (least + 1).min(FAR) } else { 0 };
                (before, beside_before) = (side, beside);
                sides[here + i] = side;
                if side > 0 {
                    *word |= number_of(side) << (3 * octant);
                }
            }
        }
    }
}

/// The number in [`SIDES`] of the largest side that is not above this one.
fn number_of(side: u32) -> u32 {
    const NUMBERS: [u32; FAR as usize + 1] = [0, 0, 1, 2, 3, 3, 4, 4, 5, 5, 5, 5, 6, 6, 6, 6, 7];
    NUMBERS[side.min(FAR) as usize]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::cells::{run_word, side_ahead};

    #[test]
    fn numbers_name_the_largest_side_that_fits() {
        for side in 1..=FAR {
            let fits = SIDES.iter().rposition(|other| u32::from(*other) <= side);
            assert_eq!(Some(number_of(side) as usize), fits, "{side}");
        }
    }

    /// Every cube that is named is empty, and the next larger one is not.
    #[test]
    fn cubes_are_empty_and_as_large_as_can_be() {
        let n = [7usize, 5, 6];
        let mut words = [0u32; 7 * 5 * 6];
        for number in [0, 17, 33, 101, 102, 160, 209] {
            words[number] = run_word(number as u32);
        }
        let taken = words;
        for octant in 0..8 {
            fill_octant(&mut words, n, octant, &mut [0; 7 * 5 * 6]);
        }
        let is_empty = |cell: [usize; 3], octant: u32, side: usize| {
            (0..side.pow(3)).all(|i| {
                let steps = [i % side, i / side % side, i / side / side];
                let at = [0, 1, 2].map(|k| {
                    let falls = octant >> k & 1 == 1;
                    if falls { cell[k].wrapping_sub(steps[k]) } else { cell[k] + steps[k] }
                });
                (0..3).any(|k| at[k] >= n[k]) || taken[at[0] + 7 * (at[1] + 5 * at[2])] == 0
            })
        };
        for (number, word) in words.iter().enumerate().filter(|(_, word)| **word >> 30 == 0) {
            let cell = [number % 7, number / 7 % 5, number / 35];
            for octant in 0..8 {
                let side = side_ahead(*word, octant);
                assert!(is_empty(cell, octant, SIDES[side].into()), "{cell:?} {octant}");
                if side < 7 {
                    assert!(!is_empty(cell, octant, SIDES[side + 1].into()), "{cell:?} {octant}");
                }
            }
        }
    }
}
