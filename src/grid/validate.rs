//! Whether the grids of a foreign block can be traversed.

use crate::block::cells::{Cell, GridHead, LAST, MOST_DEPTH, Run, cell, cell_count, resolution};
use crate::block::leaf::LeafRef;
use crate::prim::Leaves;

/// Whether the grids have just the words there are, each run and each grid belongs to one cell, grids are nested no deeper than a
/// walk can follow, and every entry names lanes that exist.
///
/// Grids and runs are stored in the order of the words that name them, grids after all that are less deep. So one pass with two
/// counters, which starts each grid and each run where the one before it ended, proves that no two
/// cells share any; a walk then ends.
pub(crate) fn grids_are_sound(
    grids: &[GridHead],
    words: &[u32],
    runs: &[Run],
    leaves: &Leaves,
) -> bool {
    let finite = |v: &[f64; 3]| v.iter().all(|x| x.is_finite());
    let shaped = |head: &GridHead| {
        finite(&head.lower) && finite(&head.per_length) && head.per_length.iter().all(|n| *n > 0.0)
    };
    !grids.is_empty() && grids.iter().all(shaped) && {
        let mut checker = Checker { words, runs, leaves, next_word: 0, next_run: 0 };
        let outermost = grids.iter().all(|head| checker.grid_at(head.first_word as usize));
        outermost && checker.all_words() && checker.next_run == runs.len()
    }
}

/// How far words and runs have been named.
struct Checker<'m, 'l> {
    words: &'m [u32],
    runs: &'m [Run],
    leaves: &'m Leaves<'l>,
    next_word: usize,
    next_run: usize,
}

impl Checker<'_, '_> {
    /// Whether the next grid starts at this word, and is there; goes on to the one after it.
    fn grid_at(&mut self, first: usize) -> bool {
        if first != self.next_word {
            return false;
        }
        let Some(end) = self.end_of(first) else { return false };
        self.next_word = end;
        true
    }

    /// The word behind a grid's last one.
    fn end_of(&self, first: usize) -> Option<usize> {
        let word = *self.words.get(first)?;
        let cells = cell_count(resolution(word));
        let end = (first as u64 + 1).checked_add(cells)?;
        (word >> 30 == 0 && cells > 0 && end <= self.words.len() as u64).then_some(end as usize)
    }

    /// Goes through all words, which must be those of grids that were named.
    fn all_words(&mut self) -> bool {
        let (mut first, mut depth) = (0, 1);
        let mut deeper = self.next_word;
        while first < self.next_word {
            if first == deeper {
                (depth, deeper) = (depth + 1, self.next_word);
            }
            let Some(end) = self.end_of(first).filter(|_| depth <= MOST_DEPTH) else {
                return false;
            };
            if !(first + 1..end).all(|place| self.word(place)) {
                return false;
            }
            first = end;
        }
        first == self.words.len()
    }

    /// Whether a cell's word is sound.
    fn word(&mut self, place: usize) -> bool {
        match self.words.get(place).map(|word| cell(*word)) {
            Some(Cell::Empty) => true,
            Some(Cell::Run(first)) => first == self.next_run && self.skip_run(),
            Some(Cell::Boxed(first)) => {
                // Any bytes are a box.
                self.next_run += 1;
                first + 1 == self.next_run && self.skip_run()
            }
            Some(Cell::Grid(first)) => self.grid_at(first),
            None => false,
        }
    }

    /// Goes to the end of the next run, the entries of which must exist.
    fn skip_run(&mut self) -> bool {
        let rest = self.runs.get(self.next_run..).unwrap_or(&[]);
        let Some(length) = rest.iter().position(|run| run.is_last()) else { return false };
        self.next_run += length + 1;
        rest[..=length].iter().all(|run| {
            let leaf = LeafRef { block: run.block, lanes: run.lanes & !LAST };
            leaf.lanes <= 0xFFFF && self.leaves.has(leaf)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::cells::{CellBox, EMPTY, box_word, grid_word, resolution_word, run_word};
    use crate::block::leaf::TriangleBlock;
    use crate::math::Aabb;
    use std::vec::Vec;

    const HEAD: GridHead = GridHead {
        lower: [0.0; 3],
        per_length: [1.0; 3],
        finest: 1,
        first_word: 0,
        bounds: Aabb { lower: [0.0; 3], upper: [1.0; 3] },
        reserved: [0; 12],
    };

    fn entry(lanes: u32) -> Run {
        Run { block: 1 << 30, lanes }
    }

    fn are_sound(heads: &[GridHead], words: &[u32], runs: &[Run]) -> bool {
        let block = TriangleBlock { count: 2, ..TriangleBlock::EMPTY };
        let leaves = Leaves { triangle_blocks: &[block], sphere_blocks: &[], prim_ids: &[0, 1] };
        grids_are_sound(heads, words, runs, &leaves)
    }

    /// One grid of three cells.
    fn is_sound(cells: [u32; 3], runs: &[Run]) -> bool {
        are_sound(&[HEAD], &[&[resolution_word([3, 1, 1])][..], &cells].concat(), runs)
    }

    #[test]
    fn each_run_belongs_to_one_cell() {
        let runs = [entry(1), entry(2 | LAST), entry(3 | LAST)];
        assert!(is_sound([run_word(0), EMPTY, run_word(2)], &runs));
        assert!(!is_sound([run_word(0), EMPTY, run_word(0)], &runs), "shared entries");
        assert!(!is_sound([run_word(2), EMPTY, run_word(0)], &runs), "out of order");
        assert!(!is_sound([run_word(1), EMPTY, run_word(2)], &runs), "a gap");
        assert!(!is_sound([run_word(0), EMPTY, EMPTY], &runs), "entries of no cell");
        assert!(!is_sound([run_word(0), EMPTY, run_word(2)], &runs[..2]), "no entries");
        let endless = [entry(1), entry(2), entry(3)];
        assert!(!is_sound([run_word(0), EMPTY, EMPTY], &endless), "a run without an end");
        assert!(!is_sound([3 << 30, EMPTY, EMPTY], &[]), "no box and no entries");
    }

    #[test]
    fn boxes_belong_to_one_cell() {
        let cell_box = Run::of_box(CellBox::WHOLE);
        let runs = [cell_box, entry(1), entry(2 | LAST), entry(3 | LAST)];
        assert!(is_sound([box_word(0), EMPTY, run_word(3)], &runs));
        assert!(!is_sound([run_word(0), EMPTY, run_word(3)], &runs), "a box as lanes");
        assert!(!is_sound([box_word(1), EMPTY, run_word(3)], &runs), "a gap");
        assert!(!is_sound([box_word(0), EMPTY, box_word(3)], &runs), "no entries after a box");
        assert!(!is_sound([box_word(0), EMPTY, EMPTY], &runs[..1]), "nothing but a box");
    }

    #[test]
    fn each_grid_belongs_to_one_cell() {
        let n = resolution_word;
        let two = [
            n([3, 1, 1]),
            grid_word(4),
            EMPTY,
            grid_word(6),
            n([1; 3]),
            EMPTY,
            n([1, 2, 1]),
            EMPTY,
            EMPTY,
        ];
        assert!(are_sound(&[HEAD], &two, &[]));
        let with = |place: usize, word: u32| {
            let mut words = two;
            words[place] = word;
            are_sound(&[HEAD], &words, &[])
        };
        assert!(!with(3, grid_word(4)), "a shared grid");
        assert!(!with(3, EMPTY), "words of no grid");
        assert!(!with(1, grid_word(0)), "a loop");
        assert!(!with(1, grid_word(5)), "a gap");
        assert!(!with(6, n([1, 3, 1])), "a word too few");
        assert!(!with(6, n([1, 1, 1])), "a word too many");
        assert!(!with(6, n([0, 1, 1])), "no cells");
        assert!(!with(6, 1 << 31 | n([1, 2, 1])), "a resolution with a tag");
        let second = GridHead { first_word: 2, ..HEAD };
        let words = [n([1; 3]), EMPTY, n([1; 3]), EMPTY];
        assert!(are_sound(&[HEAD, second], &words, &[]));
        assert!(!are_sound(&[second, HEAD], &words, &[]));
        assert!(!are_sound(&[HEAD], &words, &[]));
        assert!(!are_sound(&[], &[], &[]));
    }

    #[test]
    fn grids_are_not_too_deep() {
        let nested = |depth: u32| {
            let inner = (1..depth).flat_map(|i| [resolution_word([1; 3]), grid_word(2 * i)]);
            inner.chain([resolution_word([1; 3]), EMPTY]).collect::<Vec<_>>()
        };
        assert!(are_sound(&[HEAD], &nested(MOST_DEPTH as u32), &[]));
        assert!(!are_sound(&[HEAD], &nested(MOST_DEPTH as u32 + 1), &[]));
    }

    #[test]
    fn entries_name_lanes_that_exist() {
        for run in [entry(4 | LAST), entry(LAST), entry(1 << 16 | LAST), Run { block: 0, lanes: 1 }]
        {
            assert!(!is_sound([run_word(0), EMPTY, EMPTY], &[run]), "{run:?}");
        }
    }

    #[test]
    fn cells_have_a_size() {
        let words = [resolution_word([1; 3]), EMPTY];
        assert!(are_sound(&[HEAD], &words, &[]));
        for n in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(!are_sound(&[GridHead { per_length: [1.0, n, 1.0], ..HEAD }], &words, &[]));
        }
        assert!(!are_sound(&[GridHead { lower: [f64::NAN; 3], ..HEAD }], &words, &[]));
    }
}
