//! Refs along a curve put together to runs, each of which is one leaf block.
//!
//! What has to be grown then is a tenth of the primitives, and no one has to ask again what fits into a block.

use super::curve::{along_curve, number_of};
use super::places::Places;
use super::refs::PrimRef;
use super::split::{Areas, greater};
use crate::block::leaf::{TRIANGLES, TriangleBlock};
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
    source: Source,
    areas: Areas,
    bytes: &mut [u8],
) -> Option<Places> {
    const REF: usize = size_of::<PrimRef>();
    const KEYS: usize = 2 * size_of::<u64>();
    let (refs, rest) = bytes.split_at_mut_checked(REF * count)?;
    let (keys, rest) = rest.split_at_mut_checked(KEYS * count)?;
    let (runs, order) = rest.split_at_mut_checked(REF * count)?;
    let refs = storage::view::<PrimRef>(refs, 0, count).filter(|refs| refs.len() >= FROM)?;
    let (keys, spare) = storage::view_mut::<u64>(keys, 0, 2 * count)?.split_at_mut(count);
    let (large, refs) = refs.split_at_checked(apart)?;
    let (keys, spare) = (keys.get_mut(apart..)?, spare.get_mut(apart..)?);
    let along = Along { refs, keys: along_curve(refs, keys, spare) };
    let runs = storage::view_mut::<PrimRef>(runs, 0, count)?;
    let order = storage::view_mut::<u32>(order, 0, prims)?;
    let mut runs = Runs { runs, order, count: 0, ids: 0 };
    for one in large.chunks(1) {
        runs.push(one)?;
    }
    cut_into_runs(&along, source, areas, &mut runs)?;
    let run_count = runs.count;
    let size = places.refs + bytes.len();
    let places = places.fitting(run_count, run_count, size)?;
    let place = (places.nodes - places.refs).checked_sub(2 * size_of::<u32>() * prims)?;
    let end = REF * run_count;
    if place < end || run_count * FINISHED + size_of::<u32>() * prims > bytes.len() {
        return None;
    }
    let (at_runs, at_order) = ((REF + KEYS) * count, (2 * REF + KEYS) * count);
    bytes.copy_within(at_runs..at_runs + end, 0);
    bytes.copy_within(at_order..at_order + size_of::<u32>() * prims, place);
    Some(places)
}

/// Replaces numbers of entries of the order, which is at the end of `free`, by these entries.
pub(super) fn name_ids(ids: &mut [u32], free: &[u8]) -> Option<()> {
    let order = free.len().checked_sub(size_of_val(ids))?;
    let order = storage::view::<u32>(free, order, ids.len())?;
    for id in ids {
        *id = *order.get(*id as usize)?;
    }
    Some(())
}

/// Runs end with every so many refs.
const PART: usize = 512;

/// Refs, and the vertices of refs, are fetched so far ahead.
const AHEAD: usize = 16;

/// What a run costs beside the area of its box, in areas of its largest ref: the lane in a bundle, and its bytes.
const PRICE: f32 = 2.0;

/// Refs in some order, which is to be cut into runs.
struct Along<'r> {
    refs: &'r [PrimRef],
    /// Of which the lowest bits are [numbers](number_of) of refs.
    keys: &'r [u64],
}

/// Runs, and the ids of their primitives: the id of a run is where these begin.
struct Runs<'r> {
    runs: &'r mut [PrimRef],
    order: &'r mut [u32],
    count: usize,
    ids: usize,
}

impl Runs<'_> {
    /// Adds a run of these refs.
    fn push(&mut self, refs: &[PrimRef]) -> Option<()> {
        let mut run = PrimRef::run(self.ids);
        for r in refs {
            let end = self.ids + r.count();
            for (place, id) in self.order.get_mut(self.ids..end)?.iter_mut().zip(r.id()..) {
                *place = id;
            }
            self.ids = end;
            run.take_in(r);
        }
        *self.runs.get_mut(self.count)? = run;
        self.count += 1;
        Some(())
    }
}

/// Writes runs of refs that follow each other.
fn cut_into_runs(along: &Along, source: Source, areas: Areas, runs: &mut Runs) -> Option<()> {
    let mut shapes = source.shapes();
    let mut seen = Seen::NOTHING;
    let mut part = Part { refs: [PrimRef::NONE; PART], fresh: [0; PART], count: 0 };
    for first in (0..along.keys.len()).step_by(PART) {
        part.read(along, first, &mut shapes, &mut seen);
        let mut at = 0;
        while at < part.count {
            let length = part.length(at, areas);
            runs.push(part.refs.get(at..at + length)?)?;
            at += length;
        }
    }
    Some(())
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
    fn read(&mut self, along: &Along, first: usize, shapes: &mut Shapes, seen: &mut Seen) {
        let keys = along.keys.get(first..).unwrap_or_default();
        self.count = keys.len().min(PART);
        let of = |key: &u64| along.refs.get(number_of(*key));
        let places = self.refs.iter_mut().zip(&mut self.fresh);
        for (i, (key, (place, fresh))) in keys.iter().zip(places).enumerate() {
            if let Some(r) = keys.get(i + 2 * AHEAD).and_then(of) {
                prefetch(r);
            }
            if let Some(r) = keys.get(i + AHEAD).and_then(of) {
                shapes.prefetch(r.id());
            }
            let Some(r) = of(key) else { continue };
            *place = *r;
            *fresh = seen.fresh(r, shapes, first + i);
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
}

impl Seen {
    const NOTHING: Seen = Seen { vertices: [(u64::MAX, 0); 512] };

    /// How many vertices of the ref at this place the refs before it do not have, as [`Part::fresh`] has it.
    fn fresh(&mut self, r: &PrimRef, shapes: &mut Shapes, place: usize) -> u64 {
        let mut fresh = 0;
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
    use crate::caller::Caller;
    use crate::prim::{Packer, geometry_table, survey};
    use crate::scene::{Mesh, Scene};
    use std::vec::Vec;

    /// A sheet of triangles in an order without sense, its runs as lists of triangles, and how many triangles fit into blocks
    /// if each run is one.
    fn runs_of(strip: usize, indexed: bool) -> Vec<Vec<u32>> {
        const SIDE: u32 = 60;
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
        let (scene, caller) = (Scene::new(&meshes, &[]), Caller::new(None, None));
        let census = Census::take(&scene, &survey(&scene).unwrap(), &caller).unwrap();
        let geometries: Vec<_> = geometry_table(&scene).collect();
        let source = Source { scene: &scene, geometries: &geometries, named: false };
        let mut refs = std::vec![PrimRef::NONE; count as usize];
        let found = gather(&scene, &census, strip, &caller, &mut refs);
        let refs = &refs[..found];
        let (mut keys, mut spare) = (std::vec![0; found], std::vec![0; found]);
        let along = Along { refs, keys: along_curve(refs, &mut keys, &mut spare) };
        let (mut runs, mut order) = (refs.to_vec(), std::vec![0; count as usize]);
        let areas = Areas::new(&census.bounds);
        let mut cut = Runs { runs: &mut runs, order: &mut order, count: 0, ids: 0 };
        cut_into_runs(&along, source, areas, &mut cut).expect("room");
        let run_count = cut.count;
        let runs: Vec<Vec<_>> = (runs[..run_count].iter())
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
        for (strip, indexed, fewest) in [(1, true, 8.0), (4, true, 8.0), (1, false, 4.5)] {
            let runs = runs_of(strip, indexed);
            let mut all = runs.concat();
            let mean = all.len() as f32 / runs.len() as f32;
            assert!(mean > fewest, "{strip} {indexed}: {mean} a run");
            all.sort_unstable();
            assert!(all.iter().copied().eq(0..all.len() as u32), "{strip} {indexed}");
        }
    }
}
