//! Rays that begin near each other and go anywhere: through the tree together, each bundle once for all that enter it.
//!
//! What is computed for one of them waits for nothing of another, so the processor works on several at once, and
//! guesses wrong once a bundle instead of once a ray. Sources: \[Tsa09\], \[Bar14\].

use super::{Batch, Record};
use crate::block::bundle::{Bundle, ChildRef};
use crate::bvh::{SharedStack, fetch};
use crate::math::Bits;
use crate::prim::Leaves;
use crate::query::Query;
use crate::ray::{Interval, NarrowSlab, PreparedRay};
use crate::simd::{Simd, Width};
use crate::trace::Question;

/// So many rays go together: one bit of a word each. 64 are no faster.
const STREAM: usize = 32;

/// A ray of a stream, in a place of its own that it is made in.
struct Member<Q> {
    ray: PreparedRay,
    slab: NarrowSlab,
    /// `None` in places without a ray.
    query: Option<Q>,
}

impl<Q> Member<Q> {
    const NONE: Self = Member { ray: PreparedRay::BLANK, slab: NarrowSlab::BLANK, query: None };
}

impl<'m, Q: Question<'m> + Copy, A: Record<Q::Answer>> Batch<'_, 'm, Q, A> {
    /// Traces rays that have little more in common than where they begin.
    #[inline(always)]
    pub(super) fn stream<S: Simd>(mut self, s: S) {
        let mut members = [const { Member::<Q::Query>::NONE }; STREAM];
        for first in (0..self.rays.len()).step_by(STREAM) {
            let rays = self.join(s, first, &mut members);
            let mut stream = Stream {
                bundles: self.bundles,
                leaves: Leaves::of(self.block),
                members: &mut members,
                going: rays,
            };
            stream.descend(s);
            let ended = rays & !stream.going;
            for lane in Bits(rays) {
                if let Member { ray, query: Some(query), .. } = &mut members[lane % STREAM] {
                    let answer = Q::answer(s, self.block.whole, ray, query, ended >> lane & 1 == 1);
                    self.write(first + lane, answer);
                }
            }
        }
    }

    /// Prepares the rays from `first` on; one bit for each that takes part. The others are answered.
    #[inline(always)]
    fn join<S: Simd>(
        &mut self,
        s: S,
        first: usize,
        members: &mut [Member<Q::Query>; STREAM],
    ) -> u32 {
        let mut joined = 0;
        for (lane, member) in members.iter_mut().enumerate() {
            let Some(given) = self.rays.get(first + lane) else { break };
            let Some((ray, slab)) = given.prepare_with(s, self.block.header.extent()) else {
                self.answer_alone(first + lane);
                continue;
            };
            member.query = Some(self.question.query(self.block.whole, ray.t_max));
            member.ray = ray;
            member.slab = slab;
            joined |= 1 << lane;
        }
        joined
    }
}

/// Rays on their way through a tree.
struct Stream<'a, 'm, Q> {
    bundles: &'m [Bundle<16>],
    leaves: Leaves<'m>,
    members: &'a mut [Member<Q>; STREAM],
    /// Those whose query has not ended: one bit each.
    going: u32,
}

impl<Q: Query> Stream<'_, '_, Q> {
    /// Each ray comes to the bundles and leaves that it would come to alone, but for the order of those at a distance.
    #[inline(always)]
    fn descend<S: Simd>(&mut self, s: S) {
        let mut stack = SharedStack::new();
        let (mut at, mut here) = (ChildRef::ROOT, self.going);
        while here != 0 {
            if at.is_leaf() {
                self.open(s, at, here);
            } else {
                let Some(bundle) = self.bundles.get(at.bundle_number()) else { return };
                if !self.enter(s, bundle, here, &mut stack) {
                    return;
                }
            }
            (at, here) = stack.pop(self.going);
        }
    }

    /// Finds the children of a bundle that the rays of `here` enter; false when there is no room for them.
    #[inline(always)]
    fn enter<S: Simd>(
        &self,
        s: S,
        bundle: &Bundle<16>,
        here: u32,
        stack: &mut SharedStack,
    ) -> bool {
        let mut entered = [0; 16];
        let mut least = Width::<16>::splat(s, f32::INFINITY);
        for lane in Bits(here) {
            let Member { slab, query: Some(query), .. } = &self.members[lane % STREAM] else {
                continue;
            };
            let t_bound = Width::<16>::splat(s, query.t_bound());
            let boxes = slab.boxes::<S, 16>(s);
            let Interval { near, far } = boxes.part::<true, 16>(&bundle.walls, t_bound);
            least = Width::<16>::note(s, [near, far], 1 << lane, &mut entered, least);
        }
        let lanes = Width::<16>::used_words(s, &entered);
        for child in Bits(lanes) {
            fetch(s, self.bundles, &self.leaves, bundle.refs[child % 16]);
        }
        if Q::ORDERED {
            stack.push_by_distance(s, bundle, lanes, &entered, least)
        } else {
            stack.push(s, bundle, lanes, &entered)
        }
    }

    /// Offers a leaf to the rays of `here`.
    #[inline(always)]
    fn open<S: Simd>(&mut self, s: S, leaf: ChildRef, here: u32) {
        for lane in Bits(here) {
            if let Member { ray, query: Some(query), .. } = &mut self.members[lane % STREAM]
                && self.leaves.intersect_whole(s, leaf.leaf_block(), ray, query)
            {
                self.going &= !(1 << lane);
            }
        }
    }
}
