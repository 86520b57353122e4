//! Rays that are alike, as one thick ray through the bundles and each by itself through the leaves.

use super::Batch;
use crate::block::bundle::ChildRef;
use crate::bvh::{Columns, ENOUGH_ROOM, Walk};
use crate::prim::Leaves;
use crate::query::Query;
use crate::ray::{GROUPS, PACKET, PreparedRay, Ray, SlabPacket};
use crate::simd::{Lanes, Simd, Width};
use crate::trace::Question;

/// Fewer rays are not worth it.
const LEAST: usize = 8;
/// How far directions may be apart along an axis, of their largest component, and origins, of the scene's largest
/// coordinate.
const ASUNDER: f32 = 0.25;
const APART: f32 = 0.125;

/// Whether rays had better be traced together: they begin and run nearly the same, and the same way along each axis.
#[inline(always)]
pub(super) fn are_alike<S: Simd>(s: S, rays: &[Ray], reach: f32) -> bool {
    let Some(first) = rays.first() else { return false };
    let [o, d] = first.rows();
    let (o, d) = (Width::<4>::load(s, &o), Width::<4>::load(s, &d));
    let (mut o_least, mut o_most, mut d_least, mut d_most) = (o, o, d, d);
    for ray in rays {
        let [o, d] = ray.rows();
        let (o, d) = (Width::<4>::load(s, &o), Width::<4>::load(s, &d));
        (o_least, o_most) = (o.min(o_least), o.max(o_most));
        (d_least, d_most) = (d.min(d_least), d.max(d_most));
    }
    let mut extremes = [[0.0; 4]; 4];
    o_least.store(&mut extremes[0]);
    o_most.store(&mut extremes[1]);
    d_least.store(&mut extremes[2]);
    d_most.store(&mut extremes[3]);
    let [o_least, o_most, d_least, d_most] = extremes;
    let (mut apart, mut asunder, mut longest, mut one_way) = (0f32, 0f32, 0f32, true);
    for k in 0..3 {
        apart = apart.max(o_most[k] - o_least[k]);
        asunder = asunder.max(d_most[k] - d_least[k]);
        longest = longest.max(d_most[k].abs());
        one_way &= d_least[k] > 0.0 || d_most[k] < 0.0;
    }
    rays.len() >= LEAST && one_way && asunder <= ASUNDER * longest && apart <= APART * reach
}

/// A ray of a packet.
struct Member<Q> {
    ray: PreparedRay,
    /// `None` when it is answered.
    query: Option<Q>,
}

impl<Q> Member<Q> {
    const NONE: Self = Member { ray: PreparedRay::BLANK, query: None };
}

impl<'m, Q: Question<'m> + Copy, A> Batch<'_, 'm, Q, A> {
    /// Traces rays that [are alike](are_alike), [`PACKET`] at most.
    #[inline(always)]
    pub(super) fn trace_together<S: Simd>(mut self, s: S) {
        let mut members = [const { Member::<Q::Query>::NONE }; PACKET];
        let mut slabs = SlabPacket::EMPTY;
        for (number, member) in members.iter_mut().enumerate().take(self.rays.len()) {
            match self.rays[number].prepare_with(s, self.block.header.reach) {
                Some((ray, slab)) => {
                    let query = self.question.query(self.block, ray.t_max);
                    slabs.set(number, &slab);
                    slabs.set_bound(number, query.t_bound());
                    *member = Member { ray, query: Some(query) };
                }
                None => self.answer_alone(number),
            }
        }
        self.descend(s, &mut members, &mut slabs);
        for (number, member) in members.iter_mut().enumerate() {
            if let Some(query) = &mut member.query {
                self.write(number, Q::answer(self.block, &member.ray, query, false));
            }
        }
    }

    #[inline(always)]
    fn descend<S: Simd>(
        &mut self,
        s: S,
        members: &mut [Member<Q::Query>; PACKET],
        slabs: &mut SlabPacket,
    ) {
        let leaves = Leaves::of(self.block);
        let mut columns = Columns::<ENOUGH_ROOM>::UNWRITTEN;
        let mut walk = Walk::new(&mut columns, slabs.largest_bound(s));
        loop {
            let (hull, bound) = (slabs.hull(s), Width::<16>::splat(s, walk.t_bound()));
            while !walk.at().is_leaf() {
                let Some(bundle) = self.bundles.get(walk.at().bundle_number()) else { return };
                if !walk.enter::<S, Q::Query, 16>(s, bundle, &hull, bound) {
                    return;
                }
            }
            if walk.at() == ChildRef::NONE {
                return;
            }
            let leaf = walk.at().leaf_block();
            let aabb = leaves.aabb(leaf);
            for group in 0..GROUPS {
                let mut entered = slabs.entered(s, group, &aabb);
                while entered != 0 {
                    let number = 16 * group + entered.trailing_zeros() as usize % 16;
                    entered &= entered - 1;
                    let Member { ray, query: Some(query) } = &mut members[number] else { continue };
                    if leaves.intersect_whole(s, leaf, ray, query) {
                        let answer = Q::answer(self.block, ray, query, true);
                        members[number].query = None;
                        slabs.set_bound(number, f32::NEG_INFINITY);
                        self.write(number, answer);
                    } else {
                        slabs.set_bound(number, query.t_bound());
                    }
                }
            }
            let bound = slabs.largest_bound(s);
            if bound == f32::NEG_INFINITY {
                return;
            }
            walk.leave::<S, Q::Query>(s, bound);
        }
    }
}
