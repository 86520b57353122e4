//! The plain uniform grid: count, prefix sum, fill.

mod pack;
mod plan;
mod runs;
mod sort;

use super::Needs;
use super::narrow::Narrow;
use super::options::GridOptions;
use crate::block::cells::resolution_word;
use crate::block::{Census, Counts, KIND_GRID, LAYOUT_COMPACT, PartsMut};
use crate::caller::Caller;
use crate::error::BuildError;
use crate::prim::{Source, Survey, geometries};
use crate::scene::Scene;
pub(super) use plan::Plan;
use sort::Sorter;

/// The memory for the grid that the rule wants, and its plan.
pub(crate) fn needs(
    scene: &Scene,
    survey: &Survey,
    census: &Census,
    options: &GridOptions,
    caller: &Caller,
) -> Result<Needs, BuildError> {
    let finest = Plan::finest(scene, survey, census, options, caller, usize::MAX)?;
    let coarsest = Plan::coarsest(scene, survey, census, caller)?;
    let minimum = coarsest.size.min(finest.size);
    Ok(Needs { size: finest.size, minimum, plan: Some(finest) })
}

/// Builds into `bytes`, which are at least what is planned; returns the size of the
/// finished block. At least one primitive can be hit.
///
/// Each primitive is stored once: they are sorted by the cell of their centre and packed into leaf
/// blocks in that order, and a cell's run names the lanes of all blocks that are in it.
pub(crate) fn build(
    scene: &Scene,
    census: &Census,
    plan: &Plan,
    caller: &Caller,
    bytes: &mut [u8],
) -> Result<usize, BuildError> {
    match build_as_planned(scene, census, plan, caller, bytes) {
        Some(size) => Ok(size),
        None if caller.cancelled() => Err(BuildError::Cancelled),
        None => Err(BuildError::OutOfMemory { minimum: plan.size }),
    }
}

fn build_as_planned(
    scene: &Scene,
    census: &Census,
    plan: &Plan,
    caller: &Caller,
    bytes: &mut [u8],
) -> Option<usize> {
    caller.done(0.2)?;
    let space = &plan.space;
    // All that is before the leaf blocks, in whose place pairs are sorted.
    let before = Counts { sphere_blocks: 0, triangle_blocks: 0, runs: 0, ..plan.counts };
    let PartsMut { geometries: table, prim_ids, grids, words, rest, .. } =
        before.parts_mut(bytes)?;
    geometries(scene, table);
    *grids.first_mut()? = space.head(0, 1);
    let (resolution, words) = words.split_first_mut()?;
    *resolution = resolution_word(space.resolution);
    let cells = Narrow::new(space);
    Sorter { scene, census, cells: &cells }.sort(words, prim_ids, rest, caller)?;
    caller.done(0.5)?;
    let packing = Counts { runs: 0, ..plan.counts };
    let PartsMut { geometries, prim_ids, sphere_blocks, triangle_blocks, .. } =
        packing.parts_mut(bytes)?;
    let source = Source { scene, geometries, named: false };
    let (triangles, spheres) = prim_ids.split_at(census.triangle_count as usize);
    let triangle_blocks = pack::pack(source, triangles, 0, triangle_blocks, caller)? as u32;
    pack::pack(source, spheres, triangles.len(), sphere_blocks, caller)?;
    caller.done(0.7)?;
    let packed = Counts { triangle_blocks, ..packing };
    let runs = runs::write(&cells, packed.parts_mut(bytes)?, caller)?;
    let counts = Counts { runs, ..packed };
    counts.seal(KIND_GRID, LAYOUT_COMPACT, census, bytes)
}
