//! Whether the grid of a foreign block can be traversed.

use crate::block::cells::{EMPTY, GridHead, LAST, Run, run_start};
use crate::block::leaf::LeafRef;
use crate::prim::Leaves;

/// Whether the one grid has just the words there are, each run belongs to one cell, and every entry
/// names lanes that exist.
///
/// Runs are stored in the order of their cells. So one pass with a counter, which starts each run
/// where the one before it ended, proves that no two cells share entries; a walk then reads each
/// entry at most once.
pub(crate) fn grid_is_sound(
    grids: &[GridHead],
    words: &[u32],
    runs: &[Run],
    leaves: &Leaves,
) -> bool {
    let [head] = grids else { return false };
    let finite = |v: &[f64; 3]| v.iter().all(|x| x.is_finite());
    let shaped = finite(&head.lower)
        && finite(&head.cell)
        && head.cell.iter().all(|edge| *edge > 0.0)
        && head.resolution.iter().all(|n| (1..=u32::from(u16::MAX)).contains(n))
        && head.first_word == 0
        && head.cell_count() == words.len() as u64;
    shaped && runs_are_sound(words, runs, leaves)
}

fn runs_are_sound(words: &[u32], runs: &[Run], leaves: &Leaves) -> bool {
    let mut next = 0;
    for word in words.iter().filter(|word| **word != EMPTY) {
        if run_start(*word) != Some(next) {
            return false;
        }
        let Some(length) = runs[next..].iter().position(|run| run.is_last()) else { return false };
        next += length + 1;
    }
    let entries_exist = runs.iter().all(|run| {
        let leaf = LeafRef { block: run.block, lanes: run.lanes & !LAST };
        leaf.lanes <= 0xFFFF && leaves.has(leaf)
    });
    next == runs.len() && entries_exist
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::cells::run_word;
    use crate::block::leaf::TriangleBlock;

    const HEAD: GridHead =
        GridHead { lower: [0.0; 3], cell: [1.0; 3], resolution: [3, 1, 1], first_word: 0 };

    fn entry(lanes: u32) -> Run {
        Run { block: 1 << 30, lanes }
    }

    fn is_sound(head: GridHead, words: &[u32], runs: &[Run]) -> bool {
        let block = TriangleBlock { count: 2, ..TriangleBlock::EMPTY };
        let leaves = Leaves { triangle_blocks: &[block], sphere_blocks: &[], prim_ids: &[0, 1] };
        grid_is_sound(&[head], words, runs, &leaves)
    }

    #[test]
    fn each_run_belongs_to_one_cell() {
        let runs = [entry(1), entry(2 | LAST), entry(3 | LAST)];
        assert!(is_sound(HEAD, &[run_word(0), EMPTY, run_word(2)], &runs));
        assert!(!is_sound(HEAD, &[run_word(0), EMPTY, run_word(0)], &runs), "shared entries");
        assert!(!is_sound(HEAD, &[run_word(2), EMPTY, run_word(0)], &runs), "out of order");
        assert!(!is_sound(HEAD, &[run_word(1), EMPTY, run_word(2)], &runs), "a gap");
        assert!(!is_sound(HEAD, &[run_word(0), EMPTY, EMPTY], &runs), "entries of no cell");
        assert!(!is_sound(HEAD, &[run_word(0), EMPTY, run_word(2)], &runs[..2]), "no entries");
        let endless = [entry(1), entry(2), entry(3)];
        assert!(!is_sound(HEAD, &[run_word(0), EMPTY, EMPTY], &endless), "a run without an end");
        assert!(!is_sound(HEAD, &[2 << 30, EMPTY, EMPTY], &[]), "a tag that is not in use");
    }

    #[test]
    fn entries_name_lanes_that_exist() {
        for run in [entry(4 | LAST), entry(LAST), entry(1 << 16 | LAST), Run { block: 0, lanes: 1 }]
        {
            assert!(!is_sound(HEAD, &[run_word(0), EMPTY, EMPTY], &[run]), "{run:?}");
        }
    }

    #[test]
    fn cells_have_a_size_and_a_number() {
        let words = [EMPTY; 3];
        assert!(is_sound(HEAD, &words, &[]));
        assert!(!is_sound(HEAD, &words[..2], &[]), "a word too few");
        for cell in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(!is_sound(GridHead { cell: [1.0, cell, 1.0], ..HEAD }, &words, &[]));
        }
        assert!(!is_sound(GridHead { lower: [f64::NAN; 3], ..HEAD }, &words, &[]));
        assert!(!is_sound(GridHead { resolution: [3, 1, 0], ..HEAD }, &[], &[]));
        assert!(!is_sound(GridHead { first_word: 1, ..HEAD }, &words, &[]));
    }
}
