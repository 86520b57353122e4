//! The plain uniform grid: count, prefix sum, fill.

mod plan;

use super::options::GridOptions;
use super::space::{Range, Space};
use crate::block::cells::{EMPTY, LAST, Run, resolution_word, run_word};
use crate::block::leaf::{KIND_SPHERES, KIND_TRIANGLES, SphereBlock, TriangleBlock, block_ref};
use crate::block::{Census, Counts, KIND_GRID, LAYOUT_COMPACT, PartsMut};
use crate::error::BuildError;
use crate::math::Aabb;
use crate::prim::{Packer, Shape, Shapes, Survey, for_each_counted, geometries};
use crate::scene::Scene;
use plan::Plan;

/// The bytes for the grid that the rule wants, and the bytes below which there is none.
pub(crate) fn needs(
    scene: &Scene,
    survey: &Survey,
    census: &Census,
    options: &GridOptions,
) -> Result<(usize, usize), BuildError> {
    let finest = Plan::finest(scene, survey, census, options, usize::MAX)?;
    let coarsest = Plan::coarsest(scene, survey, census)?;
    Ok((finest.size, coarsest.size.min(finest.size)))
}

/// Builds into `bytes`, which are at least the minimum of [`needs`]; returns the size of the
/// finished block. At least one primitive can be hit.
///
/// Each primitive is stored once: they are sorted by the cell of their centre and packed into leaf
/// blocks in that order, and a cell's run names the lanes of all blocks that are in it.
pub(crate) fn build(
    scene: &Scene,
    survey: &Survey,
    census: &Census,
    options: &GridOptions,
    bytes: &mut [u8],
) -> Result<usize, BuildError> {
    let plan = Plan::finest(scene, survey, census, options, bytes.len())?;
    let short = BuildError::OutOfMemory { minimum: plan.size };
    let packing = Counts { runs: 0, ..plan.counts };
    let triangle_blocks = pack(scene, census, &plan.space, &packing, bytes).ok_or(short)? as u32;
    let packed = Counts { triangle_blocks, ..packing };
    let runs = count_runs(&plan.space, &packed, bytes).ok_or(short)?;
    let counts = Counts { runs, ..packed };
    fill_runs(&plan.space, &counts, bytes).ok_or(short)?;
    counts.seal(KIND_GRID, LAYOUT_COMPACT, census, bytes).ok_or(short)
}

/// Sorts the primitives by cell and packs them; returns the number of triangle blocks.
fn pack(
    scene: &Scene,
    census: &Census,
    space: &Space,
    counts: &Counts,
    bytes: &mut [u8],
) -> Option<usize> {
    let PartsMut {
        geometries: table, prim_ids, grids, words, sphere_blocks, triangle_blocks, ..
    } = counts.parts_mut(bytes)?;
    geometries(scene, table);
    *grids.first_mut()? = space.head(0, 1);
    let (resolution, words) = words.split_first_mut()?;
    *resolution = resolution_word(space.resolution);
    let (triangles, spheres) = prim_ids.split_at_mut(census.triangle_count as usize);
    sort_by_cell(scene, census, space, words, triangles, Shape::is_triangle);
    sort_by_cell(scene, census, space, words, spheres, |shape| !shape.is_triangle());
    let mut packer = Packer::new(triangle_blocks, sphere_blocks, 0, census.triangle_count);
    let mut shapes = Shapes::new(scene, table);
    for id in triangles.iter().chain(spheres.iter()) {
        packer.push(&shapes.get(*id)?)?;
    }
    Some(packer.triangle_block_count())
}

/// Fills `ids` with the primitives of one kind in the order of the cells of their centres: a
/// counting sort, with `words` as the counters.
fn sort_by_cell(
    scene: &Scene,
    census: &Census,
    space: &Space,
    words: &mut [u32],
    ids: &mut [u32],
    of_kind: impl Fn(&Shape) -> bool,
) {
    if ids.is_empty() {
        return;
    }
    words.fill(0);
    let cell = |shape: &Shape| {
        let Aabb { lower, upper } = shape.aabb();
        let [lower, upper] = [lower, upper].map(|p| space.point(p));
        space.number(space.cell_of([0, 1, 2].map(|k| (lower[k] + upper[k]) / 2.0)))
    };
    for_each_counted(scene, census, |prim| {
        if let Some(count) = words.get_mut(cell(&prim.shape)).filter(|_| of_kind(&prim.shape)) {
            *count += 1;
        }
    });
    counts_to_starts(words);
    for_each_counted(scene, census, |prim| {
        if !of_kind(&prim.shape) {
            return;
        }
        if let Some(next) = words.get_mut(cell(&prim.shape)) {
            if let Some(id) = ids.get_mut(*next as usize) {
                *id = prim.id;
            }
            *next += 1;
        }
    });
}

/// Replaces each count by the sum of those before it; returns the sum of all.
fn counts_to_starts(words: &mut [u32]) -> u32 {
    let mut sum = 0;
    for word in words {
        (*word, sum) = (sum, sum + *word);
    }
    sum
}

/// Leaves in each word the start of its cell's run; returns the number of entries.
fn count_runs(space: &Space, counts: &Counts, bytes: &mut [u8]) -> Option<u32> {
    let PartsMut { words, sphere_blocks, triangle_blocks, .. } = counts.parts_mut(bytes)?;
    let words = words.get_mut(1..)?;
    words.fill(0);
    for_each_entry(space, triangle_blocks, sphere_blocks, |cell, _| {
        if let Some(count) = words.get_mut(cell) {
            *count += 1;
        }
    });
    Some(counts_to_starts(words))
}

/// Writes the runs, each in the order of blocks, and the final words.
fn fill_runs(space: &Space, counts: &Counts, bytes: &mut [u8]) -> Option<()> {
    let PartsMut { words, sphere_blocks, triangle_blocks, runs, .. } = counts.parts_mut(bytes)?;
    let words = words.get_mut(1..)?;
    for_each_entry(space, triangle_blocks, sphere_blocks, |cell, entry| {
        if let Some(next) = words.get_mut(cell) {
            if let Some(run) = runs.get_mut(*next as usize) {
                *run = entry;
            }
            *next += 1;
        }
    });
    // Each word now holds the end of its run, which is where the next one starts.
    let mut start = 0;
    for word in words {
        let end = *word;
        *word = if start == end { EMPTY } else { run_word(start) };
        if start < end {
            runs.get_mut(end as usize - 1)?.lanes |= LAST;
        }
        start = end;
    }
    Some(())
}

/// Calls `f` with every cell that holds lanes of a block and the entry that says so, block by block.
fn for_each_entry(
    space: &Space,
    triangle_blocks: &[TriangleBlock],
    sphere_blocks: &[SphereBlock],
    mut f: impl FnMut(usize, Run),
) {
    for (number, block) in triangle_blocks.iter().enumerate() {
        let boxes = |i| Shape::Triangle(block.triangle(i)).aabb();
        let block_ref = block_ref(KIND_TRIANGLES, number as u32);
        cells_of_block(space, block.count, boxes, |cell, lanes| {
            f(cell, Run { block: block_ref, lanes });
        });
    }
    for (number, block) in sphere_blocks.iter().enumerate() {
        let boxes = |i| {
            let (centre, radius) = block.sphere(i);
            Shape::Sphere { centre, radius }.aabb()
        };
        let block_ref = block_ref(KIND_SPHERES, number as u32);
        cells_of_block(space, block.count, boxes, |cell, lanes| {
            f(cell, Run { block: block_ref, lanes });
        });
    }
}

/// Calls `f` with each cell that one of the `count` boxes reaches, and the lanes of those that do.
///
/// Blocks are packed in the order of cells, so the boxes of one block lie close together and the
/// cells around all of them are few.
fn cells_of_block(
    space: &Space,
    count: u32,
    boxes: impl Fn(usize) -> Aabb,
    mut f: impl FnMut(usize, u32),
) {
    let mut ranges = [Range { first: [0; 3], last: [0; 3] }; 16];
    let mut all = Range { first: [u32::MAX; 3], last: [0; 3] };
    let ranges = &mut ranges[..(count as usize).min(16)];
    for (lane, range) in ranges.iter_mut().enumerate() {
        *range = space.range_of(&boxes(lane));
        for k in 0..3 {
            all.first[k] = all.first[k].min(range.first[k]);
            all.last[k] = all.last[k].max(range.last[k]);
        }
    }
    let lanes_with = |axis: usize, i: u32| {
        let reaches = |range: &Range| range.first[axis] <= i && i <= range.last[axis];
        ranges.iter().rev().fold(0u32, |lanes, range| lanes << 1 | u32::from(reaches(range)))
    };
    for z in all.first[2]..=all.last[2] {
        let in_z = lanes_with(2, z);
        for y in all.first[1]..=all.last[1] {
            let in_yz = in_z & lanes_with(1, y);
            if in_yz == 0 {
                continue;
            }
            for x in all.first[0]..=all.last[0] {
                let lanes = in_yz & lanes_with(0, x);
                if lanes != 0 {
                    f(space.number([x, y, z]), lanes);
                }
            }
        }
    }
}
