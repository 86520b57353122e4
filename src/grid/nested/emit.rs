//! From lists of numbers to leaf blocks and runs: the finished block.

use core::ops::Range;

use super::Attempt;
use super::grow::Grown;
use super::lists::keep;
use super::pack::{CHUNK, Lists, Part, Tally, Used, settle};
use crate::block::cells::{GridHead, Run};
use crate::block::leaf::{SphereBlock, TriangleBlock};
use crate::block::{Census, Counts, Geometry, KIND_GRID, LAYOUT_COMPACT, PartsMut};
use crate::caller::{Caller, PARTS};
use crate::grid::list::front;
use crate::prim::{Source, Survey, geometries};
use crate::scene::Scene;
use crate::storage::{ALIGNMENT, view, view_mut};

/// Packs what the cells list, each cell's after the one before it, so that a cell's are in few blocks; returns the size of the
/// block, or `None` when it does not fit, or when the caller wants no more.
///
/// ```text
/// | header | .. | triangle blocks of each part, with room for more | runs of each part, likewise | kept words | lists |
/// ```
pub(super) fn emit(
    scene: &Scene,
    survey: &Survey,
    census: &Census,
    grown: &Grown,
    attempt: &Attempt,
    bytes: &mut [u8],
) -> Option<usize> {
    let caller = attempt.caller;
    let kept_at = keep(grown.most, grown.words, grown.listed, bytes)?;
    let (front, kept) = bytes.split_at_mut(kept_at);
    let (words, listed) = view::<u32>(kept, 0, grown.words + grown.listed)?.split_at(grown.words);
    let lists = Lists { listed, triangle_limit: census.triangle_limit, few: 0 };
    let tallies = Tallies::new(words, lists, caller);
    let lists = Lists { few: tallies.all.few(census.triangle_count), ..lists };
    let runs_at = front.len().checked_sub(size_of::<Run>() * tallies.all.runs)?;
    let runs_at = runs_at / ALIGNMENT * ALIGNMENT;
    let (front, runs) = front.split_at_mut(runs_at);
    let runs = view_mut::<Run>(runs, 0, tallies.all.runs)?;
    let room = most_counts(survey, grown, &tallies.all, front.len())?;
    let mut parts = room.parts_mut(front)?;
    for (place, head) in parts.grids.iter_mut().zip(grown.heads.iter().flatten()) {
        *place = *head;
    }
    geometries(scene, parts.geometries);
    let mut packing = Packing { scene, lists, caller, words, runs };
    let packed = packing.pack(&tallies, &mut parts);
    // What is too much for the memory of a part need not be too much.
    let packed = packed.or_else(|| packing.pack(&tallies.together()?, &mut parts))?;
    attempt.done(1.0)?;
    let used = join_blocks(&packed, parts.triangle_blocks);
    join_ids(&packed, &used, &mut parts);
    let (triangle_blocks, runs) = (used.triangle_blocks as u32, used.runs as u32);
    let prim_ids = (used.ids[0] + used.ids[1]) as u32;
    let counts = Counts { prim_ids, triangle_blocks, runs, ..room };
    close_up(&room, &counts, bytes)?;
    join_runs(&packed, runs_at, &counts, caller, bytes)?;
    counts.seal(KIND_GRID, LAYOUT_COMPACT, census, bytes)
}

/// How much the words of each part list, and all.
struct Tallies {
    /// Words of a part.
    size: usize,
    parts: [Option<Tally>; PARTS],
    all: Tally,
}

impl Tallies {
    fn new(words: &[u32], lists: Lists, caller: &Caller) -> Self {
        let size = caller.part_size(words.len(), CHUNK);
        let (mut parts, mut all) = ([None; PARTS], Tally::default());
        let mut places = parts.iter_mut();
        let tally = |part: Range<usize>| lists.tally(&words[part]);
        caller.for_parts(words.len(), size, tally, |tally| {
            all.add(&tally);
            if let Some(place) = places.next() {
                *place = Some(tally);
            }
        });
        Tallies { size, parts, all }
    }

    /// The same as one part, if there were several.
    fn together(&self) -> Option<Tallies> {
        let mut parts = [None; PARTS];
        parts[0] = Some(self.all);
        self.parts[1].map(|_| Tallies { size: usize::MAX, parts, all: self.all })
    }
}

/// The sizes of the parts, with all triangle blocks for which there is room.
fn most_counts(survey: &Survey, grown: &Grown, all: &Tally, size: usize) -> Option<Counts> {
    let counts = Counts {
        geometries: survey.geometry_count,
        prim_ids: (all.triangles + all.spheres) as u32,
        grids: grown.heads.iter().flatten().count() as u32,
        words: grown.words as u32,
        sphere_blocks: all.sphere_blocks as u32,
        ..Counts::default()
    };
    let room = size.checked_sub(counts.offsets()?.end)? / size_of::<TriangleBlock>();
    Some(Counts { triangle_blocks: room.min(all.triangles) as u32, ..counts })
}

/// What a part was packed to, and where in the memory of all.
#[derive(Clone, Copy)]
struct Packed {
    words: usize,
    /// Of triangles and of spheres.
    ids_at: [usize; 2],
    triangle_blocks_at: usize,
    runs_at: usize,
    used: Used,
}

/// Fills all but the header, part after part or at the same time.
struct Packing<'s> {
    scene: &'s Scene<'s, 's>,
    lists: Lists<'s>,
    caller: &'s Caller<'s>,
    /// What is to be packed, and where runs go.
    words: &'s [u32],
    runs: &'s mut [Run],
}

impl Packing<'_> {
    fn pack(&mut self, tallies: &Tallies, parts: &mut PartsMut) -> Option<[Option<Packed>; PARTS]> {
        let all = tallies.all;
        let geometries: &[Geometry] = parts.geometries;
        parts.words.copy_from_slice(self.words);
        let mut words = &mut *parts.words;
        let (mut triangles, mut spheres) = parts.prim_ids.split_at_mut(all.triangles);
        let (mut sphere_blocks, mut blocks) =
            (&mut *parts.sphere_blocks, &mut *parts.triangle_blocks);
        let mut runs = &mut *self.runs;
        let (mut done, blocks_len, runs_len) = (Tally::default(), blocks.len(), runs.len());
        let mut jobs = [const { None }; PARTS];
        for (job, tally) in jobs.iter_mut().zip(tallies.parts.iter().flatten()) {
            // Of the triangle blocks, of which nobody knows how many it will be, as many as of the triangles that are left.
            let left = (all.triangles - done.triangles).max(1) as u64;
            let share = blocks.len() as u64 * tally.triangles as u64 / left;
            let at = (blocks_len - blocks.len(), runs_len - runs.len());
            let size = tallies.size.min(words.len());
            let part = Part {
                words: front(&mut words, size)?,
                ids: [front(&mut triangles, tally.triangles)?, front(&mut spheres, tally.spheres)?],
                first_ids: [done.triangles, all.triangles + done.spheres],
                sphere_blocks: front(&mut sphere_blocks, tally.sphere_blocks)?,
                triangle_blocks: front(&mut blocks, share as usize)?,
                runs: front(&mut runs, tally.runs)?,
                used: Used::default(),
            };
            *job = Some((part, at, None));
            done.add(tally);
        }
        let (lists, scene) = (self.lists, self.scene);
        self.caller.for_each(&mut jobs, |job| {
            if let Some((part, _, done)) = job {
                *done = part.pack(lists, Source { scene, geometries, named: false });
            }
        });
        jobs.iter().flatten().try_for_each(|(_, _, done)| *done)?;
        Some(jobs.map(|job| {
            let (part, (triangle_blocks_at, runs_at), _) = job?;
            let (words, ids_at, used) = (part.words.len(), part.first_ids, part.used);
            Some(Packed { words, ids_at, triangle_blocks_at, runs_at, used })
        }))
    }
}

/// Moves the triangle blocks of the parts together; returns how much all have.
fn join_blocks(packed: &[Option<Packed>; PARTS], blocks: &mut [TriangleBlock]) -> Used {
    let mut all = Used::default();
    for Packed { used, triangle_blocks_at: at, .. } in packed.iter().flatten() {
        if *at > all.triangle_blocks {
            blocks.copy_within(*at..at + used.triangle_blocks, all.triangle_blocks);
        }
        all.add(used);
    }
    all
}

/// Moves the numbers of the parts together, as triangles that are named take none, and lets blocks name them where they now are.
fn join_ids(packed: &[Option<Packed>; PARTS], used: &Used, parts: &mut PartsMut) {
    let packed = || packed.iter().flatten();
    let of_part = |part: &Packed| (part.ids_at[0], part.used.ids[0], part.used.triangle_blocks);
    let firsts = parts.triangle_blocks.iter_mut().map(|block| &mut block.first);
    join(packed().map(of_part), 0, parts.prim_ids, firsts);
    let of_part = |part: &Packed| (part.ids_at[1], part.used.ids[1], part.used.sphere_blocks);
    let firsts = parts.sphere_blocks.iter_mut().map(|block| &mut block.first);
    join(packed().map(of_part), used.ids[0], parts.prim_ids, firsts);
}

/// Moves numbers together from `to` on: of each part, where they are, how many, and how many blocks name them by their `firsts`.
fn join<'b>(
    parts: impl Iterator<Item = (usize, usize, usize)>,
    mut to: usize,
    ids: &mut [u32],
    mut firsts: impl Iterator<Item = &'b mut u32>,
) {
    for (at, count, blocks) in parts {
        if at > to {
            ids.copy_within(at..at + count, to);
        }
        firsts.by_ref().take(blocks).for_each(|first| *first -= (at - to) as u32);
        to += count;
    }
}

/// Moves what lies behind the numbers to where it lies in the finished block, as those are fewer than there was room for.
fn close_up(room: &Counts, counts: &Counts, bytes: &mut [u8]) -> Option<()> {
    let (from, to) = (room.offsets()?, counts.offsets()?);
    for (from, to, count, size) in [
        (from.grids, to.grids, counts.grids, size_of::<GridHead>()),
        (from.words, to.words, counts.words, size_of::<u32>()),
        (from.sphere_blocks, to.sphere_blocks, counts.sphere_blocks, size_of::<SphereBlock>()),
        (
            from.triangle_blocks,
            to.triangle_blocks,
            counts.triangle_blocks,
            size_of::<TriangleBlock>(),
        ),
    ] {
        bytes.copy_within(from..from + count as usize * size, to);
    }
    Some(())
}

/// Moves the runs of the parts behind the triangle blocks, and lets them and the words name what is where it now is.
fn join_runs(
    packed: &[Option<Packed>; PARTS],
    from: usize,
    counts: &Counts,
    caller: &Caller,
    bytes: &mut [u8],
) -> Option<()> {
    const RUN: usize = size_of::<Run>();
    let mut to = counts.offsets()?.runs;
    for Packed { used, runs_at, .. } in packed.iter().flatten() {
        let start = from + RUN * runs_at;
        bytes.copy_within(start..start + RUN * used.runs, to);
        to += RUN * used.runs;
    }
    let PartsMut { mut words, mut runs, .. } = counts.parts_mut(bytes)?;
    let (mut jobs, mut before) = ([const { None }; PARTS], Used::default());
    for (job, part) in jobs.iter_mut().zip(packed.iter().flatten()) {
        let (words, runs) = (front(&mut words, part.words)?, front(&mut runs, part.used.runs)?);
        *job = Some((words, runs, before, None));
        before.add(&part.used);
    }
    // The first part's names are right.
    caller.for_each(&mut jobs[1..], |job| {
        if let Some((words, runs, before, done)) = job {
            *done = settle(words, runs, before);
        }
    });
    jobs[1..].iter().flatten().try_for_each(|(_, _, _, done)| *done)
}
