//! The question of a point to an index: which instances come close.

use super::{Around, Seek};
use crate::block::leaf::{KIND_SPHERES, Place};
use crate::block::level::Level;
use crate::math::float::sqrt;
use crate::math::{Bits, wide};
use crate::prim::Leaves;
use crate::ray::NONE;

/// What is done for each instance that may be the closest: it gets the number, and returns the square of the distance beyond
/// which nothing is of interest any more.
type Visit<'v> = dyn FnMut(u32) -> f64 + 'v;

/// So many instances that were visited are remembered: a grid lists one in each of its cells.
const MAILBOX: usize = 32;

/// Visits instances, near ones first as far as the index is ordered.
pub(crate) struct NearInstances<'a, 'm, 'v> {
    level: &'a Level<'m>,
    leaves: Leaves<'m>,
    around: Around,
    /// The square of the distance up to which instances count.
    limit: f64,
    /// How far to look for now.
    sight: f64,
    /// The last that were visited, by number.
    visited: [u32; MAILBOX],
    visit: &'a mut Visit<'v>,
}

impl<'a, 'm, 'v> NearInstances<'a, 'm, 'v> {
    /// Nothing visited yet; what is not farther from `point` than the root of `limit` counts.
    pub fn new(
        level: &'a Level<'m>,
        point: [f32; 3],
        limit: f64,
        visit: &'a mut Visit<'v>,
    ) -> Self {
        let (point, index) = (wide(point), level.index.parts());
        let size = point.abs().max_element() + f64::from(index.header.reach);
        let (leaves, around) = (Leaves::of(&index), Around::new(point, size));
        let (sight, visited) = (f64::INFINITY, [NONE; MAILBOX]);
        let mut near = NearInstances { level, leaves, around, limit, sight, visited, visit };
        near.narrow();
        near
    }

    fn narrow(&mut self) {
        self.around.limit_to(self.sight.min(sqrt(self.limit)));
    }

    /// Visits an instance if its box comes within the bound.
    pub fn consider(&mut self, number: u32) {
        let slot = number as usize % MAILBOX;
        let Some(record) = self.level.instances.get(number as usize) else { return };
        let square = self.around.square_to(&record.bounds);
        if self.visited[slot] != number && self.around.is_within(square) {
            self.visited[slot] = number;
            self.limit = (self.visit)(number);
            self.narrow();
        }
    }
}

impl Seek for NearInstances<'_, '_, '_> {
    #[inline(always)]
    fn around(&self) -> &Around {
        &self.around
    }

    fn look_up_to(&mut self, distance: f64) {
        self.sight = distance;
        self.narrow();
    }

    fn is_settled_within(&self, distance: f64) -> bool {
        self.limit <= distance * distance
    }

    fn leaves(&self) -> &Leaves<'_> {
        &self.leaves
    }

    fn block(&mut self, (kind, number): (u32, usize), lanes: u32) {
        let Leaves { sphere_blocks, prim_ids, .. } = self.leaves;
        // In bundles each is a leaf.
        if sphere_blocks.is_empty() {
            prim_ids.get(number).into_iter().for_each(|id| self.consider(*id));
            return;
        }
        let Some(block) = sphere_blocks.get(number).filter(|_| kind == KIND_SPHERES) else {
            return;
        };
        for lane in Bits(lanes & block.lanes()) {
            self.consider(Place::of_lane(number as u32, block.first, lane as u32).prim(prim_ids));
        }
    }
}
