//! Refs along a curve put together to runs, each of which is one leaf block.
//!
//! What has to be grown then is a tenth of the primitives, and no one has to ask again what fits into a block.

use super::curve::{along_curve, number_of};
use super::places::Places;
use super::refs::PrimRef;
use super::split::{Areas, greater};
use crate::block::leaf::{TRIANGLES, TriangleBlock};
use crate::caller::{Caller, PARTS};
use crate::prim::{Shapes, Source};
use crate::simd::prefetch;
use crate::storage;

/// Of fewer refs no runs are made: what they save is over in a millisecond, and of few leaves each matters to rays.
const FROM: usize = 4096;

/// The bytes that a run takes in the end: its block, and its part of the bundles as `needs` has it.
const FINISHED: usize = size_of::<TriangleBlock>() + 42;

/// Replaces the first `count` refs, of `prims` primitives, by runs, each of the first `apart` by one of its own. These go where the
/// refs were; the places for them are returned, and an `order` is left behind for [`name_ids`]. `None` where there are too few refs,
/// too little room, or too many runs: then the refs are still there.
///
/// `bytes` begin with the refs.
pub(super) fn put_into_runs(
    (count, apart, prims): (usize, usize, usize),
    places: &Places,
    (source, areas): (Source, Areas),
    caller: &Caller,
    bytes: &mut [u8],
) -> Option<Places> {
    const REF: usize = size_of::<PrimRef>();
    const KEYS: usize = 2 * size_of::<u64>();
    let size = places.refs + bytes.len();
    let (front, back) = bytes.split_at_mut_checked((REF + KEYS) * count)?;
    let (refs, keys) = front.split_at_mut_checked(REF * count)?;
    let keys = storage::view_mut::<u64>(keys, 0, 2 * count)?.split_at_mut(count);
    let along = storage::view::<PrimRef>(refs, 0, count).filter(|refs| refs.len() >= FROM)?;
    let words = along_curve(along, apart, keys, caller)?;
    let cutting = Cutting { refs: along, apart, source, areas };
    let pieces = cutting.cut(words, storage::view_mut(back, 0, count)?, caller);
    let run_count = pieces.cut.iter().map(|cut| cut.runs).sum();
    let places = places.fitting(run_count, run_count, size)?;
    let order = (places.nodes - places.refs).checked_sub(2 * size_of::<u32>() * prims)?;
    let order = order.checked_sub((REF + KEYS) * count)?;
    let finished = run_count.checked_mul(FINISHED)?.checked_add(size_of::<u32>() * prims)?;
    if finished > size - places.refs {
        return None;
    }
    let to = storage::view_mut(refs, 0, run_count)?;
    pieces.bring_together(storage::view(back, 0, count)?, to, caller)?;
    pieces.name_in_order(words, storage::view_mut(back, order, prims)?, caller)?;
    Some(places)
}

/// Replaces numbers of entries of the order, which is at the end of `free`, by these entries.
pub(super) fn name_ids(ids: &mut [u32], free: &[u8], caller: &Caller) -> Option<()> {
    let order = free.len().checked_sub(size_of_val(ids))?;
    let order = storage::view::<u32>(free, order, ids.len())?;
    let size = caller.part_size(ids.len(), PIECE);
    let mut parts = [const { None }; PARTS];
    for (part, ids) in parts.iter_mut().zip(ids.chunks_mut(size)) {
        *part = Some((ids, Some(())));
    }
    caller.for_each(&mut parts, |part| {
        let Some((ids, named)) = part else { return };
        *named = ids.iter_mut().try_for_each(|id| {
            *id = *order.get(*id as usize)?;
            Some(())
        });
    });
    parts.iter().flatten().try_for_each(|(_, named)| *named)
}

/// Runs end with every so many refs: so no run depends on what was seen of the ones before.
const PART: usize = 512;
/// What is shared out are multiples of these.
const PIECE: usize = 8 * PART;

/// Refs, and the vertices of refs, are fetched so far ahead.
const AHEAD: usize = 16;

/// What a run costs beside the area of its box, in areas of its largest ref: the lane in a bundle, and its bytes.
const PRICE: f32 = 2.0;

/// What is cut, and how.
struct Cutting<'r, 's, 'a> {
    refs: &'r [PrimRef],
    /// Each of so many, which come first, is a run of its own.
    apart: usize,
    source: Source<'s, 'a>,
    areas: Areas,
}

impl Cutting<'_, '_, '_> {
    /// Cuts refs, whose order is that of the [keys](number_of), into runs; each piece into the front of its part of `runs`, with
    /// primitives that count from its first one. The keys are replaced by first ids and counts of the refs.
    fn cut(&self, keys: &mut [u64], runs: &mut [PrimRef], caller: &Caller) -> Pieces {
        let size = caller.part_size(keys.len(), PIECE);
        let mut parts = [const { None }; PARTS];
        let mut pieces = Pieces { size, cut: [Cut::default(); PARTS] };
        let places = keys.chunks_mut(size).zip(runs.chunks_mut(size));
        for (part, (i, (place, cut))) in
            parts.iter_mut().zip(places.zip(&mut pieces.cut).enumerate())
        {
            *part = Some((i * size, place, cut));
        }
        caller.for_each(&mut parts, |part| {
            if let Some((first, (keys, runs), cut)) = part {
                **cut = self.cut_piece(*first, keys, runs);
            }
        });
        pieces
    }

    /// Cuts the refs from place `first` of the order on.
    fn cut_piece(&self, first: usize, keys: &mut [u64], runs: &mut [PrimRef]) -> Cut {
        let (mut shapes, mut seen) = (self.source.shapes(), Seen::NOTHING);
        let mut part = Part { refs: [PrimRef::NONE; PART], fresh: [0; PART], count: 0 };
        let mut cut = Cut::default();
        for start in (0..keys.len()).step_by(PART) {
            part.read(self.refs, keys.get_mut(start..).unwrap_or_default(), &mut shapes, &mut seen);
            let mut at = 0;
            while at < part.count {
                let alone = first + start + at < self.apart;
                let length = if alone { 1 } else { part.length(at, self.areas) };
                cut.push(part.refs.get(at..at + length).unwrap_or_default(), runs);
                at += length;
            }
        }
        cut
    }
}

/// How many runs a piece became, and how many primitives these have.
#[derive(Clone, Copy, Default)]
struct Cut {
    runs: usize,
    prims: usize,
}

impl Cut {
    /// Adds a run of these refs.
    fn push(&mut self, refs: &[PrimRef], runs: &mut [PrimRef]) {
        let mut run = PrimRef::run(self.prims);
        refs.iter().for_each(|r| run.take_in(r));
        self.prims += run.count();
        if let Some(place) = runs.get_mut(self.runs) {
            *place = run;
            self.runs += 1;
        }
    }
}

/// What pieces of `size` refs were cut into.
struct Pieces {
    size: usize,
    cut: [Cut; PARTS],
}

impl Pieces {
    /// Moves the runs of all pieces together, with primitives that count from the first of all.
    fn bring_together(&self, runs: &[PrimRef], to: &mut [PrimRef], caller: &Caller) -> Option<()> {
        let mut parts = [const { None }; PARTS];
        let (mut free, mut prims) = (to, 0);
        for (part, (cut, runs)) in parts.iter_mut().zip(self.cut.iter().zip(runs.chunks(self.size)))
        {
            let (to, rest) = core::mem::take(&mut free).split_at_mut_checked(cut.runs)?;
            *part = Some((runs, to, prims));
            (free, prims) = (rest, prims + cut.prims);
        }
        caller.for_each(&mut parts, |part| {
            let Some((runs, to, prims)) = part else { return };
            to.iter_mut().zip(*runs).for_each(|(to, run)| *to = run.moved(*prims));
        });
        Some(())
    }

    /// Writes the ids of all primitives in the order of the runs.
    fn name_in_order(&self, words: &[u64], to: &mut [u32], caller: &Caller) -> Option<()> {
        let mut parts = [const { None }; PARTS];
        let mut free = to;
        for (part, (cut, words)) in
            parts.iter_mut().zip(self.cut.iter().zip(words.chunks(self.size)))
        {
            let (to, rest) = core::mem::take(&mut free).split_at_mut_checked(cut.prims)?;
            *part = Some((words, to));
            free = rest;
        }
        caller.for_each(&mut parts, |part| {
            let Some((words, to)) = part else { return };
            let mut places = to.iter_mut();
            for word in *words {
                let (first, count) = (*word as u32, (*word >> 32) as usize);
                (first..).zip(places.by_ref().take(count)).for_each(|(id, place)| *place = id);
            }
        });
        Some(())
    }
}

/// A few refs that follow each other.
struct Part {
    refs: [PrimRef; PART],
    /// For each, four bits a distance: how many of its vertices none of so many refs before it has.
    fresh: [u64; PART],
    count: usize,
}

/// One in each of sixteen places.
const ONES: u64 = 0x1111_1111_1111_1111;

impl Part {
    /// Reads the refs of the first keys, which are replaced by their first ids and counts.
    fn read(&mut self, refs: &[PrimRef], keys: &mut [u64], shapes: &mut Shapes, seen: &mut Seen) {
        self.count = keys.len().min(PART);
        for i in 0..self.count {
            let of = |key: &u64| refs.get(number_of(*key));
            if let Some(r) = keys.get(i + 2 * AHEAD).and_then(of) {
                prefetch(r);
            }
            if let Some(r) = keys.get(i + AHEAD).and_then(of) {
                shapes.prefetch(r.id());
            }
            let Some(r) = of(&keys[i]) else { continue };
            self.refs[i % PART] = *r;
            self.fresh[i % PART] = seen.fresh(r, shapes);
            keys[i] = (r.count() as u64) << 32 | u64::from(r.id());
        }
    }

    /// The length of the best run that begins with ref `at`: that of the least cost a triangle.
    fn length(&self, at: usize, areas: Areas) -> usize {
        let Some(first) = self.refs.get(at) else { return 1 };
        let (mut bounds, mut largest) = (first.bounds, 0.0);
        let (mut triangles, mut vertices) = (0, 0);
        let mut best = (f32::INFINITY, 1);
        let own = self.refs.iter().zip(&self.fresh).take(self.count).skip(at);
        for ((r, fresh), length) in own.zip(1..) {
            triangles += r.count();
            vertices += (fresh >> (4 * (length - 1) % 64) & 15) as usize;
            if triangles.max(vertices) > TRIANGLES {
                break;
            }
            bounds.add(&r.bounds);
            largest = greater(areas.of_finite(&r.bounds), largest);
            let cost = (areas.of_finite(&bounds) + PRICE * largest) / triangles as f32;
            if cost <= best.0 {
                best = (cost, length);
            }
        }
        best.1
    }
}

/// Where vertices were seen last: a table by their numbers, that forgets.
struct Seen {
    vertices: [(u64, usize); 512],
    /// Refs so far.
    count: usize,
}

impl Seen {
    const NOTHING: Seen = Seen { vertices: [(u64::MAX, 0); 512], count: 0 };

    /// How many vertices of the next ref the ones before it do not have, as [`Part::fresh`] has it.
    fn fresh(&mut self, r: &PrimRef, shapes: &mut Shapes) -> u64 {
        let (mut fresh, place) = (0, self.count);
        self.count += 1;
        for id in (r.id()..).take(r.count()) {
            let Some((mesh, numbers)) = shapes.numbers(id) else {
                // A strip has two vertices more than triangles.
                return ONES * (r.count() as u64 + 2);
            };
            for number in numbers {
                let vertex = u64::from(mesh) << 32 | number as u64;
                let slot = &mut self.vertices[number % 512];
                let distance = if slot.0 == vertex { place - slot.1 } else { 16 };
                fresh += if distance < 16 { ONES & ((1 << (4 * distance)) - 1) } else { ONES };
                *slot = (vertex, place);
            }
        }
        fresh
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::Census;
    use crate::bvh::refs::gather;
    use crate::caller::tests::Tasks;
    use crate::prim::{Packer, geometry_table, survey};
    use crate::scene::{Mesh, Scene};
    use std::vec::Vec;

    /// A sheet of triangles in an order without sense, its runs as lists of triangles, and how many triangles fit into blocks
    /// if each run is one.
    fn runs_of(strip: usize, indexed: bool, apart: usize, caller: &Caller) -> Vec<Vec<u32>> {
        const SIDE: u32 = 90;
        let vertices: Vec<_> = (0..(SIDE + 1) * (SIDE + 1))
            .map(|i| [i % (SIDE + 1), i / (SIDE + 1), i % 3].map(|x| x as f32))
            .collect();
        let count = 2 * SIDE * SIDE;
        let indices: Vec<_> = (0..count)
            .map(|i| i * 1009 % count)
            .map(|i| {
                let corner = i / 2 / SIDE * (SIDE + 1) + i / 2 % SIDE;
                let far = corner + SIDE + 2;
                if i % 2 == 0 { [corner, corner + 1, far] } else { [corner, far, far - 1] }
            })
            .collect();
        let soup: Vec<_> = indices.iter().map(|t| t.map(|v| vertices[v as usize])).collect();
        let mesh = if indexed { Mesh::indexed(&vertices, &indices) } else { Mesh::soup(&soup) };
        let meshes = [mesh];
        let scene = Scene::new(&meshes, &[]);
        let census = Census::take(&scene, &survey(&scene).unwrap(), caller).unwrap();
        let geometries: Vec<_> = geometry_table(&scene).collect();
        let source = Source { scene: &scene, geometries: &geometries, named: false };
        let mut refs = std::vec![PrimRef::NONE; count as usize];
        let found = gather(&scene, &census, strip, caller, &mut refs);
        let refs = &refs[..found];
        let (mut keys, mut spare) = (std::vec![0; found], std::vec![0; found]);
        let keys = along_curve(refs, apart, (&mut keys, &mut spare), caller).expect("a curve");
        let (mut runs, mut together) = (refs.to_vec(), refs.to_vec());
        let mut order = std::vec![0; count as usize];
        let areas = Areas::new(&census.bounds);
        let pieces = Cutting { refs, apart, source, areas }.cut(keys, &mut runs, caller);
        let run_count = pieces.cut.iter().map(|cut| cut.runs).sum();
        pieces.bring_together(&runs, &mut together[..run_count], caller).expect("room");
        pieces.name_in_order(keys, &mut order, caller).expect("room");
        let runs: Vec<Vec<_>> = (together[..run_count].iter())
            .map(|run| order[run.id() as usize..][..run.count()].to_vec())
            .collect();
        let mut blocks = std::vec![TriangleBlock::EMPTY; run_count];
        let mut packer = Packer::new(&mut blocks, &mut [], 0, 0);
        for run in &runs {
            packer.close();
            for id in run {
                packer.push_triangle(soup[*id as usize]).expect("a run fits into a block");
            }
        }
        runs
    }

    #[test]
    fn each_run_fits_into_a_block_and_each_triangle_is_in_one() {
        let alone = Caller::new(None, None);
        for (strip, indexed, fewest) in [(1, true, 8.0), (4, true, 8.0), (1, false, 4.5)] {
            let runs = runs_of(strip, indexed, 0, &alone);
            let mut all = runs.concat();
            let mean = all.len() as f32 / runs.len() as f32;
            assert!(mean > fewest, "{strip} {indexed}: {mean} a run");
            all.sort_unstable();
            assert!(all.iter().copied().eq(0..all.len() as u32), "{strip} {indexed}");
        }
    }

    #[test]
    fn pieces_are_cut_alike_by_all_threads_and_what_stands_apart_is_alone() {
        for apart in [0, 3] {
            let alone = runs_of(1, true, apart, &Caller::new(None, None));
            for workers in [2, 3, 40] {
                let tasks = Tasks(workers);
                let shared = runs_of(1, true, apart, &Caller::new(Some(&tasks), None));
                assert!(shared == alone, "{apart} {workers}");
            }
            assert!(alone[..apart].iter().zip(0..).all(|(run, id)| *run == [id]));
        }
    }
}
