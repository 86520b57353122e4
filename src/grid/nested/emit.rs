//! From lists of numbers to leaf blocks and runs: the finished block.

use super::grow::Grown;
use super::lists::{BOX_WORDS, END, Room, numbers};
use crate::block::cells::{Cell, CellBox, LAST, Run, box_word, cell, run_word};
use crate::block::leaf::{KIND_TRIANGLES, SPHERES, TRIANGLES, TriangleBlock, block_ref};
use crate::block::{Census, Counts, KIND_GRID, LAYOUT_COMPACT, PartsMut};
use crate::prim::{Packer, Shapes, Survey, geometries};
use crate::scene::Scene;
use crate::storage::{ALIGNMENT, view_mut};

/// Packs what the cells list, each cell's after the one before it, so that a cell's are in few blocks; returns the size of the
/// block, or `None` when it does not fit.
///
/// A primitive is stored again for each cell that lists it, unless the block being filled holds it already.
pub(super) fn emit(
    scene: &Scene,
    survey: &Survey,
    census: &Census,
    grown: &Grown,
    bytes: &mut [u8],
) -> Option<usize> {
    let kept_at = Room::keep(grown.most, grown.words, grown.listed, bytes)?;
    let (front, kept) = bytes.split_at_mut(kept_at);
    let kept = view_mut::<u32>(kept, 0, grown.words + grown.listed)?;
    let (words, listed) = kept.split_at_mut(grown.words);
    let runs_at = front.len().checked_sub(size_of::<Run>() * most_runs(listed))?;
    let runs_at = runs_at / ALIGNMENT * ALIGNMENT;
    let (front, runs) = front.split_at_mut(runs_at);
    let len = runs.len() / size_of::<Run>();
    let runs = view_mut::<Run>(runs, 0, len)?;
    let mut counts = most_counts(survey, census, grown, listed, front.len())?;
    let parts = counts.parts_mut(front)?;
    (counts.triangle_blocks, counts.runs) = fill(scene, census, grown, parts, words, listed, runs)?;
    let at = counts.offsets()?;
    let runs_end = runs_at + size_of::<Run>() * counts.runs as usize;
    bytes.copy_within(runs_at..runs_end, at.runs);
    counts.seal(KIND_GRID, LAYOUT_COMPACT, census, bytes)
}

/// As many runs as the lists can need: one for each block, of which the second and later ones hold five numbers or are the last.
fn most_runs(listed: &[u32]) -> usize {
    let (mut runs, mut in_list) = (0, 0);
    for id in listed {
        in_list += 1;
        if id & END != 0 {
            // A box, and runs of triangles and of spheres.
            runs += in_list.min(4 + in_list / 5);
            in_list = 0;
        }
    }
    runs
}

/// The sizes of the parts, with all triangle blocks for which there is room.
fn most_counts(
    survey: &Survey,
    census: &Census,
    grown: &Grown,
    listed: &[u32],
    size: usize,
) -> Option<Counts> {
    let spheres = numbers(listed).filter(|id| id & !END >= census.triangle_limit).count();
    let counts = Counts {
        geometries: survey.geometry_count,
        prim_ids: numbers(listed).count() as u32,
        grids: grown.heads.iter().flatten().count() as u32,
        words: grown.words as u32,
        sphere_blocks: spheres.div_ceil(SPHERES) as u32,
        ..Counts::default()
    };
    let room = size.checked_sub(counts.offsets()?.end)? / size_of::<TriangleBlock>();
    Some(Counts { triangle_blocks: room.min(listed.len()) as u32, ..counts })
}

/// Writes everything but the header; returns the numbers of triangle blocks and runs.
fn fill(
    scene: &Scene,
    census: &Census,
    grown: &Grown,
    parts: PartsMut,
    words: &[u32],
    listed: &[u32],
    runs: &mut [Run],
) -> Option<(u32, u32)> {
    let PartsMut { geometries: table, prim_ids, grids, triangle_blocks, sphere_blocks, .. } = parts;
    for (place, head) in grids.iter_mut().zip(grown.heads.iter().flatten()) {
        *place = *head;
    }
    geometries(scene, table);
    let is_triangle = |id: &u32| id & !END < census.triangle_limit;
    let first_sphere = numbers(listed).filter(is_triangle).count() as u32;
    let mut emitter = Emitter {
        shapes: Shapes::new(scene, table),
        packer: Packer::new(triangle_blocks, sphere_blocks, 0, first_sphere),
        prim_ids,
        next_id: [0, first_sphere as usize],
        open: (u32::MAX, [u32::MAX; TRIANGLES]),
        runs,
        run_count: 0,
    };
    for (out, word) in parts.words.iter_mut().zip(words) {
        *out = match cell(*word) {
            Cell::Run(first) => run_word(emitter.list(listed.get(first + BOX_WORDS..)?)?),
            Cell::Boxed(first) => {
                let (cell_box, list) = listed.get(first..)?.split_first_chunk()?;
                let first = emitter.cell_box(CellBox::from_words(*cell_box))?;
                emitter.list(list)?;
                box_word(first)
            }
            Cell::Empty | Cell::Grid(_) => *word,
        };
    }
    Some((emitter.packer.triangle_block_count() as u32, emitter.run_count as u32))
}

/// What packing writes to.
struct Emitter<'s, 'a, 'b> {
    shapes: Shapes<'s, 'a>,
    packer: Packer<'b>,
    prim_ids: &'b mut [u32],
    /// Where the numbers of the next triangle and sphere go.
    next_id: [usize; 2],
    /// The triangle block being filled, and whose are its lanes.
    open: (u32, [u32; TRIANGLES]),
    runs: &'b mut [Run],
    run_count: usize,
}

impl Emitter<'_, '_, '_> {
    /// Writes the box of a cell before its run, and returns its entry.
    fn cell_box(&mut self, cell_box: CellBox) -> Option<u32> {
        *self.runs.get_mut(self.run_count)? = Run::of_box(cell_box);
        self.run_count += 1;
        Some(self.run_count as u32 - 1)
    }

    /// Packs a list that begins here, and returns its first entry.
    fn list(&mut self, listed: &[u32]) -> Option<u32> {
        let first = self.run_count;
        for id in listed {
            let (block, lane) = self.pack(id & !END)?;
            let is_same =
                self.run_count > first && self.runs.get(self.run_count - 1)?.block == block;
            if !is_same {
                *self.runs.get_mut(self.run_count)? = Run { block, lanes: 0 };
                self.run_count += 1;
            }
            let run = self.runs.get_mut(self.run_count - 1)?;
            run.lanes |= 1 << lane;
            if id & END != 0 {
                run.lanes |= LAST;
                break;
            }
        }
        Some(first as u32)
    }

    /// The block and the lane of a primitive: where it is in the open block, or a new place.
    fn pack(&mut self, id: u32) -> Option<(u32, u32)> {
        let (open, ids) = &mut self.open;
        if let Some(lane) = ids.iter().position(|other| *other == id) {
            return Some((*open, lane as u32));
        }
        let shape = self.shapes.get(id)?;
        let (block, lane) = self.packer.push(&shape)?;
        let is_triangle =
            block >= block_ref(KIND_TRIANGLES, 0) && block < block_ref(KIND_TRIANGLES + 1, 0);
        if is_triangle {
            if block != *open {
                (*open, *ids) = (block, [u32::MAX; TRIANGLES]);
            }
            *ids.get_mut(lane as usize)? = id;
        }
        let next = &mut self.next_id[usize::from(!is_triangle)];
        *self.prim_ids.get_mut(*next)? = id;
        *next += 1;
        Some((block, lane))
    }
}
