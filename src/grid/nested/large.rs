//! Large primitives, which are kept out of the cells.

use crate::block::Census;
use crate::block::leaf::TRIANGLES_AT_LEAST;
use crate::caller::Caller;
use crate::math::{Aabb, wide};
use crate::prim::{GRAIN, Names, Shape, Visitor, box_around, visit};
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
    boxes: [Aabb; MOST],
    count: usize,
    /// Around all others.
    pub others: Aabb,
}

fn length(aabb: &Aabb) -> f64 {
    (wide(aabb.upper) - wide(aabb.lower)).max_element()
}

/// The same rounded: less work, where most are short.
fn rounded_length(aabb: &Aabb) -> f32 {
    let [x, y, z] = [0, 1, 2].map(|k| aabb.upper[k] - aabb.lower[k]);
    x.max(y).max(z)
}

/// A search for them.
struct Search {
    found: Large,
    /// What is no longer than this is none of them.
    least: f64,
    /// Whether all can be hit.
    sound: bool,
}

impl Search {
    #[inline(always)]
    fn look_at(&mut self, id: u32, aabb: &Aabb) {
        let is_short = f64::from(rounded_length(aabb)) * ROUNDED < self.least;
        if is_short || length(aabb) <= self.least {
            self.found.others.add(aabb);
        } else {
            self.found.insert(id, *aabb);
            self.least = self.found.least().max(self.least);
        }
    }
}

impl Visitor for Search {
    #[inline(always)]
    fn triangle(&mut self, id: u32, corners: Option<[[f32; 3]; 3]>, _names: Names) {
        let is_sound = |corners| self.sound || Shape::Triangle(corners).sound().is_some();
        if let Some(corners) = corners.filter(|corners| is_sound(*corners)) {
            self.look_at(id, &box_around(corners));
        }
    }

    #[inline(always)]
    fn other(&mut self, id: u32, shape: Shape) {
        if let Some(shape) = shape.sound() {
            self.look_at(id, &shape.aabb());
        }
    }
}

impl Large {
    const NONE: Self =
        Large { ids: [0; MOST], boxes: [Aabb::EMPTY; MOST], count: 0, others: Aabb::EMPTY };

    /// Finds them: the longest, of equally long ones the first.
    pub fn find(scene: &Scene, census: &Census, caller: &Caller) -> Self {
        let least = length(&census.bounds) * LONG;
        let mut found = Large::NONE;
        if f64::from(census.longest) * ROUNDED < least {
            found.others = census.bounds;
            return found;
        }
        let (limit, sound) = (census.prim_limit as usize, census.ignored_count == 0);
        let of_part = |ids: Range<usize>| {
            let mut part = Search { found: Large::NONE, least, sound };
            visit(scene, ids.start as u32..ids.end as u32, &mut part);
            part.found
        };
        caller.for_parts(limit, caller.part_size(limit, GRAIN), of_part, |part| {
            found.others.add(&part.others);
            for i in 0..part.count {
                found.insert(part.ids[i], part.boxes[i]);
            }
        });
        found.ids[..found.count].sort_unstable();
        // Which of two zeros it is depends on how parts were cut.
        found.others.lower = found.others.lower.map(|x| x + 0.0);
        found.others.upper = found.others.upper.map(|x| x + 0.0);
        found
    }

    /// Keeps the longest, in falling order; what is not among these is one of the others.
    fn insert(&mut self, id: u32, aabb: Aabb) {
        let known = &self.boxes[..self.count];
        let place = known.partition_point(|other| length(other) >= length(&aabb));
        if self.count == MOST {
            let last = if place == MOST { aabb } else { self.boxes[MOST - 1] };
            self.others.add(&last);
        }
        self.count = (self.count + 1).min(MOST);
        if place < MOST {
            self.boxes[place..self.count].rotate_right(1);
            self.ids[place..self.count].rotate_right(1);
            (self.boxes[place], self.ids[place]) = (aabb, id);
        }
    }

    /// What is no longer than this would not be kept.
    fn least(&self) -> f64 {
        if self.count == MOST { length(&self.boxes[MOST - 1]) } else { 0.0 }
    }

    /// The box around them.
    pub fn bounds(&self) -> Aabb {
        let mut bounds = Aabb::EMPTY;
        self.boxes[..self.count].iter().for_each(|aabb| bounds.add(aabb));
        bounds
    }

    /// Their numbers, rising.
    pub fn ids(&self) -> &[u32] {
        &self.ids[..self.count]
    }
}
