//! Large primitives, which are kept out of the cells.

use crate::block::Census;
use crate::block::leaf::TRIANGLES_AT_LEAST;
use crate::caller::Caller;
use crate::math::{Aabb, wide};
use crate::prim::{GRAIN, Prim, for_each_prim_in};
use crate::scene::Scene;
use core::ops::Range;

/// At most so many, which are one block whatever vertices they share, and only those longer than this part of the scene.
const MOST: usize = TRIANGLES_AT_LEAST;
const LONG: f64 = 0.1;
/// What a length may have lost by rounding.
const ROUNDED: f64 = 1.0 + 1.0 / (1u64 << 22) as f64;

/// The largest primitives: tested by every ray that meets the box around them, and in no other cell.
///
/// They would be in many cells, and the box of all that is left is often much smaller without them.
#[derive(Clone, Copy)]
pub(super) struct Large {
    ids: [u32; MOST],
    lengths: [f64; MOST],
    count: usize,
    /// Around them, and around all others.
    pub bounds: [Aabb; 2],
}

fn length(aabb: &Aabb) -> f64 {
    (wide(aabb.upper) - wide(aabb.lower)).max_element()
}

impl Large {
    const NONE: Self =
        Large { ids: [0; MOST], lengths: [0.0; MOST], count: 0, bounds: [Aabb::EMPTY; 2] };

    /// Finds them: the longest, of equally long ones the first.
    pub fn find(scene: &Scene, census: &Census, caller: &Caller) -> Self {
        let least = length(&census.bounds) * LONG;
        let mut found = Large::NONE;
        if f64::from(census.longest) * ROUNDED < least {
            found.bounds[1] = census.bounds;
            return found;
        }
        let long = |part: &mut Large, prim: Prim| {
            let length = length(&prim.shape.aabb());
            if length > least {
                part.insert(length, prim.id);
            }
        };
        in_parts(scene, census, caller, long, |part| {
            for i in 0..part.count {
                found.insert(part.lengths[i], part.ids[i]);
            }
        });
        if found.count == 0 {
            found.bounds[1] = census.bounds;
            return found;
        }
        found.ids[..found.count].sort_unstable();
        let known = found;
        let bound = |part: &mut Large, prim: Prim| {
            let side = usize::from(!known.has(prim.id));
            part.bounds[side].add(&prim.shape.aabb());
        };
        in_parts(scene, census, caller, bound, |part| {
            (0..2).for_each(|side| found.bounds[side].add(&part.bounds[side]));
        });
        found
    }

    /// Keeps the longest, in falling order.
    fn insert(&mut self, length: f64, id: u32) {
        let lengths = &mut self.lengths;
        let place = lengths[..self.count].partition_point(|other| *other >= length);
        if place == MOST {
            return;
        }
        self.count = (self.count + 1).min(MOST);
        lengths[place..self.count].rotate_right(1);
        self.ids[place..self.count].rotate_right(1);
        (lengths[place], self.ids[place]) = (length, id);
    }

    /// Whether a primitive is one of them.
    pub fn has(&self, id: u32) -> bool {
        self.ids().binary_search(&id).is_ok()
    }

    /// Their numbers, rising.
    pub fn ids(&self) -> &[u32] {
        &self.ids[..self.count]
    }
}

/// Gives `take` what `work` makes of the primitives of each part, in order.
fn in_parts(
    scene: &Scene,
    census: &Census,
    caller: &Caller,
    work: impl Fn(&mut Large, Prim) + Sync,
    take: impl FnMut(Large),
) {
    let (limit, sound) = (census.prim_limit as usize, census.ignored_count == 0);
    let made = |ids: Range<usize>| {
        let mut part = Large::NONE;
        let ids = ids.start as u32..ids.end as u32;
        for_each_prim_in(scene, ids, sound, |prim| work(&mut part, prim));
        part
    };
    caller.for_parts(limit, caller.part_size(limit, GRAIN), made, take);
}

/// All others with these numbers.
pub(super) fn for_each_other(
    scene: &Scene,
    census: &Census,
    large: &Large,
    ids: Range<u32>,
    mut f: impl FnMut(Prim),
) {
    for_each_prim_in(scene, ids, census.ignored_count == 0, |prim| {
        if large.ids().is_empty() || !large.has(prim.id) {
            f(prim);
        }
    });
}
