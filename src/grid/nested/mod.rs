//! Nested grids: a coarse one, and finer ones in its full cells.
//!
//! [`grow`] divides space and lists in each cell the numbers of what comes near it: first an [`outermost`] grid, then, depth by depth, the
//! full cells ([`levels`], [`divide`]). [`emit`] makes of the lists the finished block, some words at a time ([`pack`]).
//! Both work in the caller's memory: the lists and words grow at its end, the block at its front.

mod cost;
mod distance;
mod divide;
mod emit;
mod fill;
mod grow;
mod growing;
mod large;
mod levels;
mod lists;
mod outermost;
mod pack;
mod recent;

use super::options::GridOptions;
use super::space::Space;
use crate::block::cells::{LAST, Run, resolution_word, run_word};
use crate::block::leaf::{
    KIND_SPHERES, KIND_TRIANGLES, SPHERES, TRIANGLES_AT_LEAST, TriangleBlock, block_ref,
};
use crate::block::{Census, Counts, KIND_GRID, LAYOUT_COMPACT, PartsMut};
use crate::caller::Caller;
use crate::error::BuildError;
use crate::prim::{Survey, pack_in_order};
use crate::scene::Scene;

/// A grid whose boxes reach more cells than this for each number that may be listed is too fine: it would take too
/// long to find out which of these are near.
const WORK: u64 = 32;

/// How often a grid that is too fine is made coarser before it is given up: the finest is of one cell by then.
const TRIES: u32 = 20;

/// Bytes for each primitive that a build may use beyond what one cell takes.
const SPARE: usize = 56;
/// And for the whole scene.
const SPARE_AT_LEAST: usize = 16 * 1024;

/// The sizes of a grid of one cell, in which every primitive is once.
fn one_cell(survey: &Survey, census: &Census) -> Counts {
    let sphere_blocks = census.sphere_count.div_ceil(SPHERES as u32);
    let triangle_blocks = census.triangle_count.div_ceil(TRIANGLES_AT_LEAST as u32);
    Counts {
        geometries: survey.geometry_count,
        prim_ids: census.hittable(),
        grids: 1,
        words: 2,
        sphere_blocks,
        triangle_blocks,
        runs: sphere_blocks + triangle_blocks,
        ..Counts::default()
    }
}

/// The bytes that a build can use, and the least that it needs.
pub(super) fn needs(survey: &Survey, census: &Census) -> Result<(usize, usize), BuildError> {
    let minimum = one_cell(survey, census).offsets().ok_or(BuildError::TooLarge)?.end;
    let spare = (census.hittable() as usize).checked_mul(SPARE);
    let size = spare.and_then(|spare| minimum.checked_add(spare)?.checked_add(SPARE_AT_LEAST));
    let size = size.filter(|size| isize::try_from(*size).is_ok()).ok_or(BuildError::TooLarge)?;
    Ok((size.next_multiple_of(crate::storage::ALIGNMENT), minimum))
}

/// Builds into `bytes`, which are at least the minimum of [`needs`]; returns the size of the finished
/// block.
///
/// While the block does not fit, the cells may list a quarter less; in the end there is one cell.
pub(super) fn build(
    scene: &Scene,
    survey: &Survey,
    census: &Census,
    options: &GridOptions,
    caller: &Caller,
    bytes: &mut [u8],
) -> Result<usize, BuildError> {
    let mut most = lists::most_refs(survey, bytes.len()).min(most_packed(scene, bytes.len()));
    let mut begun = 0.1;
    while most > u64::from(census.hittable()) && !caller.cancelled() {
        let attempt = Attempt { most, caller, begun };
        let grown = grow::grow(scene, survey, census, options, &attempt, bytes);
        let Some(grown) = grown else { break };
        if let Some(size) = emit::emit(scene, survey, census, &grown, &attempt, bytes) {
            return Ok(size);
        }
        (most, begun) = (most / 4 * 3, attempt.part(1.0));
    }
    if caller.cancelled() {
        return Err(BuildError::Cancelled);
    }
    build_one_cell(scene, survey, census, bytes)
}

/// A build in which cells may list so many numbers.
struct Attempt<'a> {
    most: u64,
    caller: &'a Caller<'a>,
    /// How far the whole was when it began.
    begun: f32,
}

impl Attempt<'_> {
    /// Says how far it is, from 0 to 1; `None` when the caller wants no more.
    fn done(&self, part: f32) -> Option<()> {
        self.caller.done(self.part(part))
    }

    /// The same of the whole, which it does not finish, as it may not fit.
    fn part(&self, part: f32) -> f32 {
        self.begun + 0.8 * part * (1.0 - self.begun)
    }
}

/// How many numbers can be listed so that the blocks fit, roughly: what does not is tried again.
///
/// A block holds 14 triangles of a closed mesh, which has half a vertex for each, and 5 that share none.
fn most_packed(scene: &Scene, size: usize) -> u64 {
    let (mut triangles, mut vertices) = (1, 1);
    for mesh in (0..scene.mesh_count()).filter_map(|m| scene.mesh(m)) {
        triangles += mesh.triangle_count();
        // Those that stand in threes may be equal.
        let vertex_count = mesh.vertex_count().min(3 * mesh.triangle_count());
        vertices += if mesh.is_indexed() { vertex_count } else { mesh.triangle_count() / 2 };
    }
    let in_a_block = (7.2 * triangles as f64 / vertices as f64).clamp(5.0, 14.0);
    // A number in a list, one in the block, a part of a run and of a word.
    (size as f64 / (size_of::<TriangleBlock>() as f64 / in_a_block + 12.0)) as u64
}

/// All primitives in one cell, in the order of their numbers.
fn build_one_cell(
    scene: &Scene,
    survey: &Survey,
    census: &Census,
    bytes: &mut [u8],
) -> Result<usize, BuildError> {
    let mut counts = one_cell(survey, census);
    let minimum = counts.offsets().map_or(usize::MAX, |at| at.end);
    let short = BuildError::OutOfMemory { minimum };
    let parts = counts.parts_mut(bytes).ok_or(short)?;
    if let ([head], [resolution, cell]) = (&mut *parts.grids, &mut *parts.words) {
        *head = Space::over(&census.bounds, [1; 3]).head(0, 1);
        (*resolution, *cell) = (resolution_word([1; 3]), run_word(0));
    }
    counts.triangle_blocks = pack_in_order(scene, census, parts);
    counts.runs = counts.triangle_blocks + counts.sphere_blocks;
    let PartsMut { triangle_blocks, sphere_blocks, runs, .. } =
        counts.parts_mut(bytes).ok_or(short)?;
    let triangles = triangle_blocks.iter().map(|block| (KIND_TRIANGLES, block.lanes()));
    let spheres = sphere_blocks.iter().map(|block| (KIND_SPHERES, block.lanes()));
    let numbers = (0..counts.triangle_blocks).chain(0..counts.sphere_blocks);
    for ((run, (kind, lanes)), number) in runs.iter_mut().zip(triangles.chain(spheres)).zip(numbers)
    {
        *run = Run { block: block_ref(kind, number), lanes };
    }
    if let Some(last) = runs.last_mut() {
        last.lanes |= LAST;
    }
    counts.seal(KIND_GRID, LAYOUT_COMPACT, census, bytes).ok_or(short)
}
