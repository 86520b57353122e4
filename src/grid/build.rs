//! From a scene to a finished grid in the caller's memory: count, prefix sum, fill.

use super::plan::Plan;
use crate::block::cells::{EMPTY, GridHead, LAST, Run, run_word};
use crate::block::leaf::{KIND_SPHERES, KIND_TRIANGLES, SphereBlock, TriangleBlock, block_ref};
use crate::block::{Census, Counts, KIND_GRID, LAYOUT_COMPACT, PartsMut};
use crate::error::BuildError;
use crate::math::Aabb;
use crate::prim::{Packer, Shape, Survey, for_each_prim, geometries, shape};
use crate::scene::Scene;

/// The bytes for the grid that the rule wants, and the bytes below which there is none.
pub(crate) fn needs(
    scene: &Scene,
    survey: &Survey,
    census: &Census,
) -> Result<(usize, usize), BuildError> {
    let finest = Plan::finest(scene, survey, census, usize::MAX)?;
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
    bytes: &mut [u8],
) -> Result<usize, BuildError> {
    let plan = Plan::finest(scene, survey, census, bytes.len())?;
    let short = BuildError::OutOfMemory { minimum: plan.size };
    let packing = Counts { runs: 0, ..plan.counts };
    let triangle_blocks = pack(scene, census, &plan.head, &packing, bytes).ok_or(short)? as u32;
    let packed = Counts { triangle_blocks, ..packing };
    let runs = count_runs(&plan.head, &packed, bytes).ok_or(short)?;
    let counts = Counts { runs, ..packed };
    fill_runs(&plan.head, &counts, bytes).ok_or(short)?;
    counts.seal(KIND_GRID, LAYOUT_COMPACT, census, bytes).ok_or(short)
}

/// Sorts the primitives by cell and packs them; returns the number of triangle blocks.
fn pack(
    scene: &Scene,
    census: &Census,
    head: &GridHead,
    counts: &Counts,
    bytes: &mut [u8],
) -> Option<usize> {
    let PartsMut {
        geometries: table, prim_ids, grids, words, sphere_blocks, triangle_blocks, ..
    } = counts.parts_mut(bytes)?;
    geometries(scene, table);
    *grids.first_mut()? = *head;
    let (triangles, spheres) = prim_ids.split_at_mut(census.triangle_count as usize);
    sort_by_cell(scene, head, words, triangles, |shape| matches!(shape, Shape::Triangle(_)));
    sort_by_cell(scene, head, words, spheres, |shape| matches!(shape, Shape::Sphere { .. }));
    let mut packer = Packer::new(triangle_blocks, sphere_blocks, 0, census.triangle_count);
    for id in triangles.iter().chain(spheres.iter()) {
        packer.push(&shape(scene, table, *id)?)?;
    }
    Some(packer.triangle_block_count())
}

/// Fills `ids` with the primitives of one kind in the order of the cells of their centres: a
/// counting sort, with `words` as the counters.
fn sort_by_cell(
    scene: &Scene,
    head: &GridHead,
    words: &mut [u32],
    ids: &mut [u32],
    of_kind: impl Fn(&Shape) -> bool,
) {
    words.fill(0);
    let cell = |shape: &Shape| {
        let centre = shape.aabb().centroid2() / 2.0;
        head.word([0, 1, 2].map(|k| head.cell_at(k, centre[k])))
    };
    for_each_prim(scene, |prim| {
        if let Some(count) = words.get_mut(cell(&prim.shape)).filter(|_| of_kind(&prim.shape)) {
            *count += 1;
        }
    });
    counts_to_starts(words);
    for_each_prim(scene, |prim| {
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
fn count_runs(head: &GridHead, counts: &Counts, bytes: &mut [u8]) -> Option<u32> {
    let PartsMut { words, sphere_blocks, triangle_blocks, .. } = counts.parts_mut(bytes)?;
    words.fill(0);
    for_each_entry(head, triangle_blocks, sphere_blocks, |cell, _| {
        if let Some(count) = words.get_mut(cell) {
            *count += 1;
        }
    });
    Some(counts_to_starts(words))
}

/// Writes the runs, each in the order of blocks, and the final words.
fn fill_runs(head: &GridHead, counts: &Counts, bytes: &mut [u8]) -> Option<()> {
    let PartsMut { words, sphere_blocks, triangle_blocks, runs, .. } = counts.parts_mut(bytes)?;
    for_each_entry(head, triangle_blocks, sphere_blocks, |cell, entry| {
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
    head: &GridHead,
    triangle_blocks: &[TriangleBlock],
    sphere_blocks: &[SphereBlock],
    mut f: impl FnMut(usize, Run),
) {
    for (number, block) in triangle_blocks.iter().enumerate() {
        let boxes = |i| Shape::Triangle(block.triangle(i)).aabb();
        let block_ref = block_ref(KIND_TRIANGLES, number as u32);
        cells_of_block(head, block.count, boxes, |cell, lanes| {
            f(cell, Run { block: block_ref, lanes });
        });
    }
    for (number, block) in sphere_blocks.iter().enumerate() {
        let boxes = |i| {
            let (centre, radius) = block.sphere(i);
            Shape::Sphere { centre, radius }.aabb()
        };
        let block_ref = block_ref(KIND_SPHERES, number as u32);
        cells_of_block(head, block.count, boxes, |cell, lanes| {
            f(cell, Run { block: block_ref, lanes });
        });
    }
}

/// Calls `f` with each cell that one of the `count` boxes reaches, and the lanes of those that do.
///
/// Blocks are packed in the order of cells, so the boxes of one block lie close together and the
/// cells around all of them are few.
fn cells_of_block(
    head: &GridHead,
    count: u32,
    boxes: impl Fn(usize) -> Aabb,
    mut f: impl FnMut(usize, u32),
) {
    let mut ranges = [[[0u32; 2]; 3]; 16];
    let mut all = [[u32::MAX, 0]; 3];
    let ranges = &mut ranges[..(count as usize).min(16)];
    for (lane, range) in ranges.iter_mut().enumerate() {
        *range = head.cells_of(&boxes(lane));
        for k in 0..3 {
            all[k] = [all[k][0].min(range[k][0]), all[k][1].max(range[k][1])];
        }
    }
    let lanes_with = |axis: usize, i: u32| {
        let reaches = |range: &[[u32; 2]; 3]| range[axis][0] <= i && i <= range[axis][1];
        ranges.iter().rev().fold(0u32, |lanes, range| lanes << 1 | u32::from(reaches(range)))
    };
    for z in all[2][0]..=all[2][1] {
        let in_z = lanes_with(2, z);
        for y in all[1][0]..=all[1][1] {
            let in_yz = in_z & lanes_with(1, y);
            if in_yz == 0 {
                continue;
            }
            for x in all[0][0]..=all[0][1] {
                let lanes = in_yz & lanes_with(0, x);
                if lanes != 0 {
                    f(head.word([x, y, z]), lanes);
                }
            }
        }
    }
}
