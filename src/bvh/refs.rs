//! Primitives as the builder sees them.

#![allow(unsafe_code, reason = "a promise about the layout drawn here")]

use core::ops::Range;

use super::split::{Areas, Box4};
use crate::block::Census;
use crate::caller::{Caller, PARTS};
use crate::kinds::{BALLS, REFIT, THREADS, WIDE};
use crate::math::Aabb;
use crate::prim::{GRAIN, Names, Shape, Visitor, box_around, for_each_named_in, visit};
use crate::scene::Scene;
use crate::storage::Plain;

/// A primitive as the builder sees it, or a strip: triangles with consecutive ids, each with an edge of the one before.
///
/// ```text
/// byte 0       12   16      28      32
///      | lower | id | upper | count |
/// ```
///
/// The id stands in the fourth lane of the box, below `2^30` and with that bit set; the count is a float, negative for
/// spheres. So all lanes are zero or normal floats: computing with subnormal ones is slow.
#[derive(Clone, Copy)]
#[repr(C)]
pub(crate) struct PrimRef {
    pub bounds: Box4,
}
const _: () = assert!(size_of::<PrimRef>() == 32);

// SAFETY: eight numbers of equal size, so no padding.
unsafe impl Plain for PrimRef {}

/// How much larger the box of a strip may be than those of its triangles together. Measured: see `docs/METHODS.md`.
const WASTE: f32 = 1.2;

impl PrimRef {
    /// Set in that word.
    const NORMAL: u32 = 1 << 30;

    /// The first id and the number of ids of the ref that has these words.
    pub fn ids_of(words: &[u32; 8]) -> [u32; 2] {
        [words[3] & !Self::NORMAL, f32::from_bits(words[7]).abs() as u32]
    }

    pub fn new(id: u32, aabb: &Aabb, sphere: bool) -> Self {
        let lane = |[x, y, z]: [f32; 3], word: u32| {
            // -0 becomes +0.
            [x + 0.0, y + 0.0, z + 0.0, f32::from_bits(word)]
        };
        let count = if sphere { -1.0f32 } else { 1.0 };
        let (lower, upper) =
            (lane(aabb.lower, id | Self::NORMAL), lane(aabb.upper, count.to_bits()));
        PrimRef { bounds: Box4 { lower, upper } }
    }

    pub const NONE: PrimRef = PrimRef { bounds: Box4::ZERO };

    /// Of no primitive yet; the first one gets this id.
    pub fn run(id: usize) -> PrimRef {
        let mut bounds = Box4::EMPTY;
        (bounds.lower[3], bounds.upper[3]) = (f32::from_bits(id as u32 | Self::NORMAL), 0.0);
        PrimRef { bounds }
    }

    /// The same of primitives whose ids are so much higher.
    pub fn moved(mut self, by: usize) -> PrimRef {
        let id = self.id() + by as u32;
        self.bounds.lower[3] = f32::from_bits(id | Self::NORMAL);
        self
    }

    pub fn id(&self) -> u32 {
        self.bounds.lower[3].to_bits() & !Self::NORMAL
    }

    pub fn is_sphere(&self) -> bool {
        BALLS && self.bounds.upper[3] < 0.0
    }

    /// The number of primitives: their ids are consecutive.
    pub fn count(&self) -> usize {
        self.bounds.upper[3].abs() as usize
    }

    /// Takes in another ref, whose primitives count from now on.
    #[inline(always)]
    pub fn take_in(&mut self, other: &PrimRef) {
        let (id, count) = (self.bounds.lower[3], self.bounds.upper[3] + other.bounds.upper[3]);
        self.bounds.add(&other.bounds);
        (self.bounds.lower[3], self.bounds.upper[3]) = (id, count);
    }

    /// Takes in the triangle of the next id, if the area of both together is at most [`WASTE`] times the sum of each.
    fn extend(&mut self, next: &PrimRef, areas: Areas) -> bool {
        let mut both = self.bounds;
        both.add(&next.bounds);
        let area = |bounds: &Box4| areas.of_finite(bounds);
        let pays = area(&both) <= WASTE * (area(&self.bounds) + area(&next.bounds));
        if pays {
            both.lower[3] = self.bounds.lower[3];
            both.upper[3] = self.bounds.upper[3] + 1.0;
            self.bounds = both;
        }
        pays
    }
}

/// Writes a ref for each primitive that can be hit, or for up to `strip` triangles; returns the number of refs.
pub(crate) fn gather(
    scene: &Scene,
    census: &Census,
    strip: usize,
    caller: &Caller,
    refs: &mut [PrimRef],
) -> usize {
    let (all, sound) = (census.prim_limit as usize, census.ignored_count == 0);
    let strips = (WIDE && strip > 1).then(|| (strip, Areas::new(&census.bounds)));
    if !THREADS {
        let mut whole = Part { ids: 0..all, refs, count: 0 };
        whole.gather(scene, census, strips);
        return whole.count;
    }
    let room = |ids: Range<usize>| {
        let room = if sound || ids.len() == all { ids.len() } else { hittable(scene, &ids) };
        (ids, room)
    };
    let mut parts = [const { None }; PARTS];
    let (mut free, mut places) = (&mut *refs, parts.iter_mut());
    caller.for_parts(all, caller.part_size(all, GRAIN), room, |(ids, room)| {
        let room = room.min(free.len());
        let (refs, rest) = core::mem::take(&mut free).split_at_mut(room);
        free = rest;
        if let Some(part) = places.next() {
            *part = Some(Part { ids, refs, count: 0 });
        }
    });
    caller.for_each(&mut parts, |part| {
        if let Some(part) = part {
            part.gather(scene, census, strips);
        }
    });
    let sizes = parts.map(|part| part.map_or((0, 0), |part| (part.refs.len(), part.count)));
    let (mut start, mut end) = (0, 0);
    for (room, count) in sizes {
        if start > end {
            refs.copy_within(start..start + count, end);
        }
        start += room;
        end += count;
    }
    end
}

/// The refs that there would be for each primitive, seen from a few hundred of them. `refs` is overwritten.
pub(crate) fn refs_per_prim(
    scene: &Scene,
    census: &Census,
    strip: usize,
    refs: &mut [PrimRef],
) -> f32 {
    const WINDOW: usize = 64;
    const WINDOWS: usize = 16;
    let all = census.prim_limit as usize;
    let strips = Some((strip, Areas::new(&census.bounds)));
    let (mut prims, mut count) = (0, 0);
    for start in (0..all).step_by((all / WINDOWS).max(WINDOW)) {
        let ids = start..(start + WINDOW).min(all);
        prims += ids.len();
        let mut part = Part { ids, refs: &mut *refs, count: 0 };
        part.gather(scene, census, strips);
        count += part.count;
    }
    count as f32 / prims as f32
}

/// How many of these can be hit.
fn hittable(scene: &Scene, ids: &Range<usize>) -> usize {
    let mut count = 0;
    for_each_named_in(scene, ids.start as u32..ids.end as u32, false, |_, _| count += 1);
    count
}

/// The refs of consecutive ids.
struct Part<'r> {
    ids: Range<usize>,
    refs: &'r mut [PrimRef],
    count: usize,
}

impl Part<'_> {
    /// Writes the refs. With `strips`, up to so many triangles go as one, but never across a multiple of [`GRAIN`], so that
    /// it does not matter where parts begin.
    fn gather(&mut self, scene: &Scene, census: &Census, strips: Option<(usize, Areas)>) {
        let ids = self.ids.start as u32..self.ids.end as u32;
        visit(scene, ids, &mut Gathering { part: self, census, strips, last: None });
    }

    #[inline(always)]
    fn push(&mut self, new: PrimRef) {
        if let Some(r) = self.refs.get_mut(self.count) {
            *r = new;
            self.count += 1;
        }
    }

    /// Extends the last ref by `new`, if that pays.
    #[inline(always)]
    fn extend(&mut self, new: &PrimRef, (most, areas): (usize, Areas)) -> bool {
        let last = self.count.checked_sub(1).and_then(|i| self.refs.get_mut(i));
        last.is_some_and(|last| last.count() < most && last.extend(new, areas))
    }
}

/// Refs being written.
struct Gathering<'p, 'r> {
    part: &'p mut Part<'r>,
    census: &'p Census,
    strips: Option<(usize, Areas)>,
    /// The last triangle.
    last: Option<(u32, [[f32; 3]; 3])>,
}

impl Visitor for Gathering<'_, '_> {
    #[inline(always)]
    fn triangle(&mut self, id: u32, corners: Option<[[f32; 3]; 3]>, names: Names) {
        let Some(mut corners) = corners else { return };
        let census = self.census;
        let mut aabb = box_around(corners);
        if REFIT && census.refit {
            aabb = Shape::Triangle(corners).place(&census.bounds);
            corners = names.corners().unwrap_or(corners);
        } else if census.ignored_count > 0 && Shape::Triangle(corners).sound().is_none() {
            return;
        }
        let new = PrimRef::new(id, &aabb, false);
        let Some(strips) = self.strips.filter(|_| WIDE) else { return self.part.push(new) };
        let follows = self.last.is_some_and(|(one, other)| {
            one + 1 == id && !(id as usize).is_multiple_of(GRAIN) && share_edge(&other, &corners)
        });
        if !(follows && self.part.extend(&new, strips)) {
            self.part.push(new);
        }
        self.last = Some((id, corners));
    }

    #[inline(always)]
    fn other(&mut self, id: u32, shape: Shape) {
        let census = self.census;
        let counts = census.ignored_count == 0 || shape.sound().is_some();
        let aabb = if REFIT && census.refit { shape.place(&census.bounds) } else { shape.aabb() };
        if counts {
            self.part.push(PrimRef::new(id, &aabb, true));
        }
    }
}

/// Whether two vertices of one are vertices of the other, to the bit.
#[inline]
fn share_edge(a: &[[f32; 3]; 3], b: &[[f32; 3]; 3]) -> bool {
    let mut shared = 0;
    for [x, y, z] in a.map(|v| v.map(f32::to_bits)) {
        for v in b {
            let differs = (v[0].to_bits() ^ x) | (v[1].to_bits() ^ y) | (v[2].to_bits() ^ z);
            shared += u32::from(differs == 0);
        }
    }
    shared >= 2
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::caller::tests::Tasks;
    use crate::prim::survey;
    use crate::scene::Mesh;
    use std::vec::Vec;

    /// The first id and the number of triangles of each ref over triangles along a band.
    fn strips(indices: &[[u32; 3]], strip: usize, caller: &Caller) -> Vec<[usize; 2]> {
        let vertices: Vec<_> = (0..20_000).map(|i| [(i / 2) as f32, (i % 2) as f32, 0.0]).collect();
        let meshes = [Mesh::indexed(&vertices, indices)];
        let scene = Scene::new(&meshes, &[]);
        let census = Census::take(&scene, &survey(&scene).unwrap(), caller).unwrap();
        let mut refs = std::vec![PrimRef::new(0, &Aabb::EMPTY, false); indices.len()];
        let count = gather(&scene, &census, strip, caller, &mut refs);
        refs[..count].iter().map(|r| [r.id() as usize, r.count()]).collect()
    }

    #[test]
    fn strips_are_as_long_as_they_may_be_and_end_with_the_grain() {
        let band: Vec<_> = (0..10_000).map(|i| [i, i + 1, i + 2]).collect();
        let alone = Caller::new(None, None);
        let found = strips(&band[..7], 3, &alone);
        assert_eq!(found, [[0, 3], [3, 3], [6, 1]]);
        assert_eq!(strips(&band[..3], 1, &alone), [[0, 1], [1, 1], [2, 1]]);
        let apart: Vec<_> = band.iter().step_by(2).copied().collect();
        assert!(
            strips(&apart, 4, &alone).iter().all(|[_, count]| *count == 1),
            "one common vertex"
        );
        let found = strips(&band, 3, &alone);
        assert!(found.contains(&[GRAIN - 1, 1]) && found.contains(&[GRAIN, 3]));
        assert!(strips(&band, 3, &Caller::new(Some(&Tasks(3)), None)) == found, "with threads");
    }

    #[test]
    fn what_cannot_be_hit_is_in_no_strip() {
        let mut band: Vec<_> = (0..10_000).map(|i| [i, i + 1, i + 2]).collect();
        for i in [1, 4000, 9000] {
            band[i] = [7, 7, 8];
        }
        let found = strips(&band, 4, &Caller::new(None, None));
        assert_eq!(found[..2], [[0, 1], [2, 4]]);
        assert_eq!(found.iter().map(|[_, count]| count).sum::<usize>(), band.len() - 3);
        assert!(strips(&band, 4, &Caller::new(Some(&Tasks(3)), None)) == found, "with threads");
    }
}
