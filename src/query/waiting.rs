//! A triangle that surely is met, of which the rest can wait.

use super::{Filter, TriangleLane};
use crate::block::leaf::{Place, TriangleBlock};
use crate::ray::{Interval, PreparedRay};

/// The triangle that comes first as far as single precision tells: what is answered of it is computed when the search
/// ends, or when something else is met that may come first.
///
/// Most rays that hit anything compute one `t` so, and no node waits for it.
pub(super) struct Waiting {
    /// The number of its block, [`NOWHERE`] if nothing waits, and its lane there. By themselves: what is written by parts is
    /// slow to read as a whole, as a [`Place`] would be.
    block: u32,
    lane: u32,
    /// What is met before this `t` of the frame comes before all that was met so far.
    first_before: f32,
}

/// No block has this number.
const NOWHERE: u32 = u32::MAX;

impl Waiting {
    /// Nothing, and nothing ever if the filter asks more of a triangle than that it is met.
    #[inline(always)]
    pub fn new(filter: &Filter, t_max: f32) -> Self {
        let first_before = if filter.sees_all() { t_max } else { f32::NEG_INFINITY };
        Waiting { block: NOWHERE, lane: 0, first_before }
    }

    /// Takes the triangle that is stored there, which the ray surely meets in this part of itself, if that comes first and is within the
    /// ray's limits; whether it does.
    ///
    /// The frame's limits are outside of the given ones by less than the part is wider than what is real: what lies strictly between
    /// them is within those.
    #[inline(always)]
    pub fn takes(&mut self, ray: &PreparedRay, place: Place, part: Interval<f32>) -> bool {
        let first = ray.t_min < part.near && part.far < self.first_before;
        if first {
            *self = Waiting { block: place.block, lane: place.lane, first_before: part.near };
        }
        first
    }

    /// The one that waits, of the blocks that this was made for.
    #[inline(always)]
    pub fn lane<'m>(
        &self,
        blocks: impl FnOnce() -> &'m [TriangleBlock],
    ) -> Option<TriangleLane<'m>> {
        if self.block == NOWHERE {
            return None;
        }
        let block = blocks().get(self.block as usize)?;
        let place = Place::of_lane(self.block, block.first, self.lane);
        Some(TriangleLane { block, place, sure: true, inside: true })
    }

    /// The same, which waits no longer; nor does any that comes after it.
    #[inline(always)]
    pub fn end<'m>(
        &mut self,
        blocks: impl FnOnce() -> &'m [TriangleBlock],
    ) -> Option<TriangleLane<'m>> {
        let lane = self.lane(blocks);
        (self.block, self.first_before) = (NOWHERE, f32::NEG_INFINITY);
        lane
    }
}
