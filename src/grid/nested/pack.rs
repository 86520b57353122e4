//! Packs the lists of some words into leaf blocks and runs.

use super::lists::{BOX_WORDS, END};
use super::recent::{Held, Recent, TOGETHER};
use crate::block::cells::{Cell, CellBox, LAST, Run, box_word, cell, run_word};
use crate::block::leaf::{
    KIND_SPHERES, KIND_TRIANGLES, SPHERES, SphereBlock, TriangleBlock, block_ref,
};
use crate::prim::{Packer, Shape, Shapes, Source};

/// So many words begin with blocks of their own: whatever is in other words, theirs are packed alike, and on any thread. On average that leaves
/// half a block free.
pub(super) const CHUNK: usize = 1 << 11;

/// However few of a list a block must hold for them not to be stored again, these are enough only if they are not alone.
const ENOUGH_AT_LEAST: usize = 2;

/// Where leaf blocks come to more bytes than this for each triangle, if every cell has its own, less is enough.
const MUCH: u64 = 60;

/// The entries that the run of a list can have: a box, and one for each block, which holds two or is of a kind the first,
/// the last, or being filled when some numbers are looked at together.
fn most_runs(len: usize) -> usize {
    (1 + len).min(6 + len / ENOUGH_AT_LEAST + 2 * (len / TOGETHER))
}

/// How much some words list.
#[derive(Clone, Copy, Default)]
pub(super) struct Tally {
    /// Numbers of triangles and of spheres.
    pub triangles: usize,
    pub spheres: usize,
    pub sphere_blocks: usize,
    /// As many as there can be.
    pub runs: usize,
}

/// What cells list, and whose the numbers are.
#[derive(Clone, Copy)]
pub(super) struct Lists<'s> {
    pub listed: &'s [u32],
    /// Numbers below are triangles.
    pub triangle_limit: u32,
    /// Blocks with fewer triangles than this on average would take [`MUCH`] memory.
    pub few: u64,
}

impl Lists<'_> {
    /// The list of a cell and its box, if it has them.
    fn of(&self, word: u32) -> Option<(&[u32], Option<CellBox>)> {
        let (first, boxed) = match cell(word) {
            Cell::Run(first) => (first, false),
            Cell::Boxed(first) => (first, true),
            Cell::Empty | Cell::Grid(_) => return None,
        };
        let (cell_box, list) = self.listed.get(first..)?.split_first_chunk::<BOX_WORDS>()?;
        let len = 1 + list.iter().position(|id| id & END != 0)?;
        Some((&list[..len], boxed.then(|| CellBox::from_words(*cell_box))))
    }

    /// How much words that begin with a chunk list.
    pub fn tally(&self, words: &[u32]) -> Tally {
        let mut tally = Tally::default();
        for words in words.chunks(CHUNK) {
            let mut spheres = 0;
            for (list, _) in words.iter().filter_map(|word| self.of(*word)) {
                let is_sphere = |id: &&u32| **id & !END >= self.triangle_limit;
                let round = list.iter().filter(is_sphere).count();
                tally.triangles += list.len() - round;
                spheres += round;
                tally.runs += most_runs(list.len());
            }
            tally.spheres += spheres;
            tally.sphere_blocks += spheres.div_ceil(SPHERES);
        }
        tally
    }
}

impl Tally {
    /// With fewer triangles in a block it would be [`MUCH`] memory for `count` triangles.
    pub fn few(&self, count: u32) -> u64 {
        size_of::<TriangleBlock>() as u64 * self.triangles as u64 / (MUCH * u64::from(count.max(1)))
    }

    pub fn add(&mut self, other: &Tally) {
        self.triangles += other.triangles;
        self.spheres += other.spheres;
        self.sphere_blocks += other.sphere_blocks;
        self.runs += other.runs;
    }
}

/// Words to be packed, and the memory for it.
pub(super) struct Part<'b> {
    pub words: &'b mut [u32],
    /// The numbers of triangles and of spheres, and where among all numbers they begin.
    pub ids: [&'b mut [u32]; 2],
    pub first_ids: [usize; 2],
    pub sphere_blocks: &'b mut [SphereBlock],
    pub triangle_blocks: &'b mut [TriangleBlock],
    pub runs: &'b mut [Run],
    /// How much of these is in use; what names them counts from their begin.
    pub used: Used,
}

#[derive(Clone, Copy, Default)]
pub(super) struct Used {
    pub ids: [usize; 2],
    pub sphere_blocks: usize,
    pub triangle_blocks: usize,
    pub runs: usize,
}

impl Used {
    pub fn add(&mut self, other: &Used) {
        (0..2).for_each(|kind| self.ids[kind] += other.ids[kind]);
        self.sphere_blocks += other.sphere_blocks;
        self.triangle_blocks += other.triangle_blocks;
        self.runs += other.runs;
    }
}

impl Part<'_> {
    /// Packs what the words list, which come to name runs. `None` when it does not fit.
    pub fn pack(&mut self, lists: Lists, source: Source) -> Option<()> {
        let chunks = self.words.len().div_ceil(CHUNK);
        (0..chunks).try_for_each(|chunk| self.pack_chunk(chunk, lists, source))
    }

    fn pack_chunk(&mut self, chunk: usize, lists: Lists, source: Source) -> Option<()> {
        let Used { ids: [triangle, sphere], sphere_blocks, triangle_blocks, runs } = self.used;
        let [triangle_ids, sphere_ids] = &mut self.ids;
        let mut emitter = Emitter {
            shapes: source.shapes(),
            held: Held::NONE,
            left: [0; TOGETHER],
            corners: [[[0.0; 3]; 3]; TOGETHER],
            packer: Packer::new(
                self.triangle_blocks.get_mut(triangle_blocks..)?,
                self.sphere_blocks.get_mut(sphere_blocks..)?,
                (self.first_ids[0] + triangle) as u32,
                (self.first_ids[1] + sphere) as u32,
            ),
            blocks: [triangle_blocks as u32, sphere_blocks as u32],
            ids: [triangle_ids.get_mut(triangle..)?, sphere_ids.get_mut(sphere..)?],
            id_counts: [0; 2],
            recent: Recent::NONE,
            few: lists.few,
            runs: Runs { runs: self.runs, count: runs },
        };
        for word in self.words.chunks_mut(CHUNK).nth(chunk)? {
            let Some((list, cell_box)) = lists.of(*word) else { continue };
            *word = match cell_box {
                Some(cell_box) => box_word(emitter.runs.push(Run::of_box(cell_box))?),
                None => run_word(emitter.runs.count as u32),
            };
            emitter.list(list)?;
        }
        let Emitter { packer, id_counts, runs, .. } = emitter;
        self.used = Used {
            ids: [triangle + id_counts[0], sphere + id_counts[1]],
            sphere_blocks: sphere_blocks + packer.sphere_block_count(),
            triangle_blocks: triangle_blocks + packer.triangle_block_count(),
            runs: runs.count,
        };
        Some(())
    }
}

/// What a chunk is packed to.
struct Emitter<'s, 'a, 'b> {
    shapes: Shapes<'s, 'a>,
    /// What is known of a list, and what is left of it. Kept here as a copy of what was just written by parts takes long.
    held: Held,
    left: [u32; TOGETHER],
    /// The corners of what is packed next.
    corners: [[[f32; 3]; 3]; TOGETHER],
    packer: Packer<'b>,
    recent: Recent,
    /// See [`Lists::few`].
    few: u64,
    /// So many blocks of triangles and of spheres are before those of the packer.
    blocks: [u32; 2],
    /// The numbers of triangles and of spheres, and how many there are.
    ids: [&'b mut [u32]; 2],
    id_counts: [usize; 2],
    runs: Runs<'b>,
}

/// Runs that are written.
struct Runs<'b> {
    runs: &'b mut [Run],
    count: usize,
}

impl Runs<'_> {
    /// Writes an entry and returns its number: a run, or the box of a cell before its run.
    #[inline]
    fn push(&mut self, run: Run) -> Option<u32> {
        *self.runs.get_mut(self.count)? = run;
        self.count += 1;
        Some(self.count as u32 - 1)
    }

    /// Lets the run that begins at `first` name lanes of a block.
    #[inline]
    fn name(&mut self, block: u32, lanes: u32, first: usize) -> Option<()> {
        if self.count == first || self.runs.get(self.count - 1)?.block != block {
            self.push(Run { block, lanes: 0 })?;
        }
        self.runs.get_mut(self.count - 1)?.lanes |= lanes;
        Some(())
    }
}

impl Emitter<'_, '_, '_> {
    /// Packs a list.
    ///
    /// A triangle is stored again for each cell that lists it, unless a block that was filled a moment ago holds it beside enough others of
    /// the list.
    fn list(&mut self, list: &[u32]) -> Option<()> {
        let first = self.runs.count;
        for ids in list.chunks(TOGETHER) {
            self.list_some(ids, first)?;
        }
        self.runs.runs.get_mut(self.runs.count - 1)?.lanes |= LAST;
        Some(())
    }

    /// The same of some of its numbers; its first run is `first`.
    #[inline]
    fn list_some(&mut self, ids: &[u32], first: usize) -> Option<()> {
        let open = (self.packer.triangle_block_count() as u32).wrapping_sub(1);
        let enough = self.enough();
        self.recent.hold(ids, open, &mut self.held);
        self.held.keep(enough);
        let count = self.held.left(ids, &mut self.left);
        for (age, lanes) in self.held.blocks() {
            let block = block_ref(KIND_TRIANGLES, self.blocks[0] + open - age);
            self.runs.name(block, lanes, first)?;
        }
        let triangles = self.look_up(count)?;
        for i in 0..count {
            let id = self.left[i % TOGETHER] & !END;
            let (block, lane) = match i < triangles {
                true => self.pack_triangle(id, self.corners[i % TOGETHER])?,
                false => self.pack_sphere(id)?,
            };
            self.runs.name(block, 1 << lane, first)?;
        }
        Some(())
    }

    /// How many of a list a block must hold for them not to be stored again: half of what has filled a block so far, or a quarter
    /// where memory is dear.
    #[inline]
    fn enough(&self) -> u32 {
        let (stored, blocks) = (self.id_counts[0], self.packer.triangle_block_count().max(1));
        let part = if (stored as u64) < self.few * blocks as u64 { 4 } else { 2 };
        ((stored + part / 2 * blocks) / (part * blocks)).max(ENOUGH_AT_LEAST) as u32
    }

    /// Brings the corners of the triangles that are left, which come before spheres; returns how many these are. All at once, as nothing then waits for
    /// each of them.
    #[inline]
    fn look_up(&mut self, count: usize) -> Option<usize> {
        for (i, (id, corners)) in self.left.iter().zip(&mut self.corners).enumerate().take(count) {
            let id = id & !END;
            *corners = match self.shapes.corners(id) {
                Some(corners) => corners,
                None => match self.shapes.get(id)? {
                    Shape::Triangle(corners) => corners,
                    Shape::Sphere { .. } | Shape::Box(_) => return Some(i),
                },
            };
        }
        Some(count)
    }

    /// Packs a triangle; returns the block and the lane.
    #[inline]
    fn pack_triangle(&mut self, id: u32, corners: [[f32; 3]; 3]) -> Option<(u32, u32)> {
        let (block, lane) = self.packer.push_triangle(corners)?;
        self.recent.put(id, block - block_ref(KIND_TRIANGLES, 0), lane);
        self.write_id(id, 0)?;
        Some((block + self.blocks[0], lane))
    }

    /// The same of what is no triangle.
    fn pack_sphere(&mut self, id: u32) -> Option<(u32, u32)> {
        let (block, lane) = self.packer.push(&self.shapes.get(id)?)?;
        self.write_id(id, 1)?;
        Some((block + self.blocks[1], lane))
    }

    #[inline]
    fn write_id(&mut self, id: u32, kind: usize) -> Option<()> {
        *self.ids[kind].get_mut(self.id_counts[kind])? = id;
        self.id_counts[kind] += 1;
        Some(())
    }
}

/// Lets the words and runs of a part, which count from its begin, count from that of all; `None` if they are not what
/// [`Part::pack`] made them.
pub(super) fn settle(words: &mut [u32], runs: &mut [Run], before: &Used) -> Option<()> {
    let mut runs = runs.iter_mut();
    for word in words {
        match cell(*word) {
            Cell::Empty | Cell::Grid(_) => continue,
            Cell::Boxed(_) => drop(runs.next()?),
            Cell::Run(_) => {}
        }
        *word += before.runs as u32;
        loop {
            let run = runs.next()?;
            let is_sphere = run.block >= block_ref(KIND_SPHERES, 0);
            let blocks = if is_sphere { before.sphere_blocks } else { before.triangle_blocks };
            run.block += blocks as u32;
            if run.is_last() {
                break;
            }
        }
    }
    Some(())
}
