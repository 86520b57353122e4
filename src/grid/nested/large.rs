//! Large primitives, which are kept out of the cells.

use crate::block::Census;
use crate::block::leaf::TRIANGLES_AT_LEAST;
use crate::math::{Aabb, wide};
use crate::prim::{Prim, for_each_counted};
use crate::scene::Scene;

/// At most so many, which are one block whatever vertices they share, and only those longer than this part of the scene.
const MOST: usize = TRIANGLES_AT_LEAST;
const LONG: f64 = 0.1;

/// The largest primitives: tested by every ray that meets the box around them, and in no other cell.
///
/// They would be in many cells, and the box of all that is left is often much smaller without them.
pub(super) struct Large {
    ids: [u32; MOST],
    count: usize,
    /// Around them, and around all others.
    pub bounds: [Aabb; 2],
}

fn length(aabb: &Aabb) -> f64 {
    (wide(aabb.upper) - wide(aabb.lower)).max_element()
}

impl Large {
    /// Finds them: the longest, of equally long ones the first.
    pub fn find(scene: &Scene, census: &Census) -> Self {
        let least = length(&census.bounds) * LONG;
        let mut found = Large { ids: [0; MOST], count: 0, bounds: [Aabb::EMPTY; 2] };
        let mut lengths = [0.0; MOST];
        for_each_counted(scene, census, |prim| {
            let length = length(&prim.shape.aabb());
            if length > least {
                found.insert(&mut lengths, length, prim.id);
            }
        });
        if found.count == 0 {
            found.bounds[1] = census.bounds;
            return found;
        }
        found.ids[..found.count].sort_unstable();
        for_each_counted(scene, census, |prim| {
            let side = usize::from(!found.has(prim.id));
            found.bounds[side].add(&prim.shape.aabb());
        });
        found
    }

    /// Keeps the longest, in falling order.
    fn insert(&mut self, lengths: &mut [f64; MOST], length: f64, id: u32) {
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

/// All others.
pub(super) fn for_each_other(
    scene: &Scene,
    census: &Census,
    large: &Large,
    mut f: impl FnMut(Prim),
) {
    for_each_counted(scene, census, |prim| {
        if large.ids().is_empty() || !large.has(prim.id) {
            f(prim);
        }
    });
}
