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
