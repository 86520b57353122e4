//! Divides space, and lists what comes near each cell.

use super::fill::list_cell;
use super::growing::Growing;
use super::large::Large;
use super::levels::Levels;
use super::lists::Room;
use super::outermost::Outermost;
use super::{Attempt, distance};
use crate::block::Census;
use crate::block::cells::{CellBox, GridHead, resolution_word, run_word};
use crate::grid::options::GridOptions;
use crate::grid::space::Space;
use crate::prim::Survey;
use crate::scene::Scene;

/// What has grown; words and lists lie at the end of the memory.
pub(super) struct Grown {
    /// The outermost grids: for large primitives, if there are any, and for all others.
    pub heads: [Option<GridHead>; 2],
    pub words: usize,
    pub listed: usize,
    /// With how much room it was done.
    pub most: u64,
}

/// Grows a grid whose cells list about `most` numbers at the most; `None` when not even the outermost grid has room, or
/// when the caller wants no more.
pub(super) fn grow(
    scene: &Scene,
    survey: &Survey,
    census: &Census,
    options: &GridOptions,
    attempt: &Attempt,
    bytes: &mut [u8],
) -> Option<Grown> {
    let Attempt { most, caller, .. } = *attempt;
    attempt.done(0.0)?;
    let large = Large::find(scene, census, caller);
    let mut room = Room::new(scene, survey, most, bytes)?;
    let mut heads = [None; 2];
    if !large.ids().is_empty() {
        let first_word = large_cell(&large, &mut room.growing)?;
        heads[0] = Some(Space::over(&large.bounds(), [1; 3]).head(first_word, 1));
    }
    let count = census.hittable() - large.ids().len() as u32;
    if count > 0 {
        let first_word = room.growing.words.end() as u32;
        let outermost = Outermost { scene, census, large: &large, options, count, most };
        let space = outermost.grow(&mut room, caller)?;
        attempt.done(0.3)?;
        let total = (large.ids().len() + room.growing.pairs.len()) as u64;
        let levels = Levels { space, options, caller, most, total, finest: 1.0 };
        heads[1] = Some(space.head(first_word, levels.divide_all(&mut room)?));
    }
    let Growing { words, listed, pairs, .. } = &mut room.growing;
    pairs.clear();
    attempt.done(0.6)?;
    distance::fill(words.all(), pairs.rest().as_flattened_mut(), caller)?;
    Some(Grown { heads, words: words.len(), listed: listed.len(), most })
}

/// One cell that lists all large primitives. The grid's own box is as good as one in the cell.
fn large_cell(large: &Large, growing: &mut Growing) -> Option<u32> {
    let first_word = growing.words.end() as u32;
    growing.words.push(resolution_word([1; 3]))?;
    let first = list_cell(&mut growing.listed, CellBox::WHOLE, large.ids())?;
    growing.words.push(run_word(first))?;
    Some(first_word)
}
