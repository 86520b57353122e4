//! Rays that are alike: as one thick ray through the bundles, and side by side through the leaves.

use super::work::Work;
use super::{Batch, Record};
use crate::block::bundle::{Bundle, ChildRef};
use crate::block::leaf::{KIND_TRIANGLES, LeafRef, TriangleBlock, block_ref};
use crate::bvh::{Columns, ENOUGH_ROOM, Walk};
use crate::math::Bits;
use crate::math::rounding::{LOOSE, f32_above, f32_below};
use crate::prim::Leaves;
use crate::query::{Exact, Query};
use crate::ray::{Alike, Entered, GROUPS, RayPacket, Sixteen};
use crate::sieve::{Aim, Found, Opened, Sheared};
use crate::simd::{Lanes, Scalar, Simd, Width};
use crate::trace::{Firsts, Together};

/// What the packets of a batch use one after the other.
pub(super) struct Room {
    packet: RayPacket,
    sheared: Sheared,
    pub work: Work,
}

impl Room {
    pub fn new(alike: Alike) -> Self {
        Room { packet: RayPacket::new(alike), sheared: [[[0.0; 16]; 2]; 16], work: Work::default() }
    }
}

/// Rays on their way together.
///
/// What `f32` is sure of needs no more for now: a triangle that surely is met, and surely before what was met so far, takes
/// its place. Its `t` is computed at the end, and only for the one that is left. All else is decided for the ray alone.
struct Company<'a, 'm, Q: Together<'m>, A> {
    batch: Batch<'a, 'm, Q, A>,
    leaves: Leaves<'m>,
    packet: &'a mut RayPacket,
    /// One bit for each ray that met something, or that is answered.
    met: [u32; GROUPS],
    /// What it met, before all others so far.
    firsts: [Firsts; GROUPS],
    /// Below its depth; the packet knows what is above.
    near: [Sixteen; GROUPS],
    /// All bits, unless some primitives are left out: then each is asked for alone.
    trusted: u32,
    work: &'a mut Work,
}

impl<'m, Q: Together<'m>, A: Record<Q::Answer>> Batch<'_, 'm, Q, A> {
    /// Traces rays that are alike, 16 for each of the [groups](GROUPS) at most.
    #[inline(always)]
    pub(super) fn trace_together<S: Simd>(self, s: S, alike: Alike, room: &mut Room) {
        let Room { packet, sheared, work } = room;
        work.set_out(self.rays.len());
        let sound = packet.set(s, alike, self.rays);
        let mut company = Company {
            leaves: Leaves::of(self.block),
            packet,
            met: [0; GROUPS],
            firsts: [Firsts::NONE; GROUPS],
            near: [[f32::INFINITY; 16]; GROUPS],
            trusted: if self.question.sees_all() { u32::MAX } else { 0 },
            work,
            batch: self,
        };
        company.descend(s, sheared);
        company.settle(s, sound);
    }
}

impl<'m, Q: Together<'m>, A: Record<Q::Answer>> Company<'_, 'm, Q, A> {
    #[inline(always)]
    fn descend<S: Simd>(&mut self, s: S, room: &mut Sheared) {
        let mut columns = Columns::<ENOUGH_ROOM>::UNWRITTEN;
        let mut walk = Walk::new(&mut columns, self.packet.highest(s));
        loop {
            let (hull, bound) = (self.packet.hull(s), Width::<16>::splat(s, walk.t_bound()));
            while !walk.at().is_leaf() {
                let Some(bundle) = self.batch.bundles.get(walk.at().bundle_number()) else {
                    return;
                };
                let Entered { boxes, near, tests, visits } = hull.enters(&bundle.walls, bound);
                self.work.at_bundle(tests, visits);
                self.fetch(s, bundle, boxes);
                if !walk.go_on(s, bundle, (boxes, near), Q::Query::ORDERED) {
                    return;
                }
            }
            if walk.at() == ChildRef::NONE {
                return;
            }
            self.visit(s, walk.at().leaf_block(), room);
            let bound = self.packet.highest(s);
            if bound == f32::NEG_INFINITY {
                return;
            }
            walk.leave(s, bound, Q::Query::ORDERED);
        }
    }

    /// Has children fetched, nearly all of which will be visited.
    #[inline(always)]
    fn fetch<S: Simd>(&self, s: S, bundle: &Bundle<16>, children: u32) {
        let mut rest = children;
        while rest != 0 {
            let child = bundle.refs[rest.trailing_zeros() as usize % 16];
            rest &= rest - 1;
            if child.is_leaf() {
                self.leaves.prefetch(s, child.leaf_block());
            } else if let Some(bundle) = self.batch.bundles.get(child.bundle_number()) {
                s.prefetch(bundle);
            }
        }
    }

    /// Offers a leaf to the rays that enter its box.
    #[inline(always)]
    fn visit<S: Simd>(&mut self, s: S, leaf: (u32, usize), room: &mut Sheared) {
        let (kind, number) = leaf;
        let entered = self.packet.entered(s, &self.leaves.aabb(leaf));
        if entered == [0; GROUPS] {
            return;
        }
        let block = block_ref(kind, number as u32);
        if kind != KIND_TRIANGLES {
            for (group, entered) in entered.into_iter().enumerate() {
                self.ask_alone(group, entered, LeafRef { block, lanes: 0xFFFF });
            }
            return;
        }
        let Some(triangles) = self.leaves.triangle_blocks.get(number) else { return };
        let opened = Opened::new(s, &self.packet.alike, &self.packet.spread, triangles);
        if opened.lanes == 0 {
            return;
        }
        for (group, entered) in entered.into_iter().enumerate() {
            if entered != 0 {
                self.work.at_leaf(entered);
                self.look(s, group, entered, block, &opened, room);
            }
        }
    }

    /// Offers the triangles of a block to rays of a group.
    #[inline(always)]
    fn look<S: Simd>(
        &mut self,
        s: S,
        group: usize,
        entered: u32,
        block: u32,
        opened: &Opened,
        room: &mut Sheared,
    ) {
        let mut aim = Aim::new(s, self.packet.group(group), opened, room);
        let active = entered & aim.within(s);
        let mut rest = aim.passed(s, opened, active);
        while rest != 0 {
            let lane = rest.trailing_zeros();
            rest &= rest - 1;
            // Those of any hits are met once.
            let active = if Q::Query::ORDERED { active } else { active & !self.met[group] };
            let mut found = aim.look(s, opened, lane as usize, active);
            found.clear &= self.trusted;
            found.sure &= self.trusted;
            let (taken, doubt) = if Q::Query::ORDERED {
                self.order(s, group, &found, aim.span(s, &found))
            } else {
                self.within_limits(s, group, &found, opened.block, lane)
            };
            self.met[group] |= taken;
            s.set_words(taken, block, &mut self.firsts[group].blocks);
            s.set_words(taken, 1 << lane, &mut self.firsts[group].lanes);
            self.fetch_id(s, opened.block.first.wrapping_add(lane));
            if doubt != 0 {
                self.ask_alone(group, doubt, LeafRef { block, lanes: 1 << lane });
            }
            if Q::Query::ORDERED {
                aim.limit(s, Width::<16>::load(s, &self.packet.group(group).high));
            }
        }
        if !Q::Query::ORDERED {
            self.packet.group(group).end(s, self.met[group]);
        }
    }

    /// The rays that meet a triangle within their limits, and those of which this is in doubt.
    ///
    /// Rays that start beside a large triangle are in doubt for `f32`, all of them together.
    #[inline(always)]
    fn within_limits<S: Simd>(
        &mut self,
        s: S,
        group: usize,
        found: &Found<<S as Width<16>>::V>,
        block: &TriangleBlock,
        lane: u32,
    ) -> (u32, u32) {
        let (mut met, mut doubt) = (found.clear, found.candidates & !found.clear);
        let rays = self.packet.group(group);
        for half in [0, 8] {
            let lanes = found.sure & doubt & 0xFF << half;
            if lanes != 0 {
                let corners = block.triangle(lane as usize);
                let [inside, outside] =
                    Exact::within_limits(s, rays.lines(half), rays.limits(half), &corners);
                met |= lanes & inside << half;
                doubt &= !(lanes & (inside | outside) << half);
            }
        }
        (met, doubt)
    }

    /// The rays that meet a triangle surely before what they met so far, which that replaces, and those of which this is
    /// in doubt.
    #[inline(always)]
    fn order<S: Width<16>>(
        &mut self,
        s: S,
        group: usize,
        found: &Found<S::V>,
        [near, far]: [S::V; 2],
    ) -> (u32, u32) {
        let high = &mut self.packet.group(group).high;
        let (best_near, best_far) = (s.load(&self.near[group]), s.load(high));
        let before = found.clear & far.less(best_near);
        let after = found.clear & best_far.less(near);
        s.select(before, near, best_near).store(&mut self.near[group]);
        s.select(before, far, best_far).store(high);
        (before, found.candidates & !(before | after))
    }

    /// Has the number of a primitive fetched: it is far away, and asked for last.
    #[inline(always)]
    fn fetch_id<S: Simd>(&self, s: S, entry: u32) {
        if Q::Query::ORDERED
            && let Some(id) = self.leaves.prim_ids.get(entry as usize)
        {
            s.prefetch(id);
        }
    }

    /// Decides for some rays of a group one by one what of a leaf they meet.
    #[cold]
    #[inline(never)]
    fn ask_alone(&mut self, group: usize, rays: u32, leaf: LeafRef) {
        let (mut rest, extent) = (rays, self.batch.block.header.extent());
        while rest != 0 {
            let lane = rest.trailing_zeros() as usize % 16;
            rest &= rest - 1;
            let Some(given) = self.batch.rays.get(16 * group + lane) else { return };
            let Some(ray) = given.prepare(extent) else { continue };
            let mut query = self.batch.question.query(self.batch.block.whole, ray.t_max);
            if let Some(leaf) = self.leaf(group, lane) {
                self.leaves.intersect(Scalar, leaf, &ray, &mut query);
            }
            let ended = self.leaves.intersect(Scalar, leaf, &ray, &mut query);
            if ended {
                self.met[group] |= 1 << lane;
            } else if let Some((leaf, t)) = Q::best(&mut query, &ray) {
                // Away from zero by more than the rounding of this.
                let rate = f64::from(given.direction[self.packet.alike.axes[2]].abs())
                    * f64::from(self.packet.alike.scale);
                let (near, far) = (t.near * rate, t.far * rate);
                self.met[group] |= 1 << lane;
                self.firsts[group].blocks[lane] = leaf.block;
                self.firsts[group].lanes[lane] = leaf.lanes;
                self.near[group][lane] = f32_below(near - near.abs() * LOOSE);
                self.packet.group(group).high[lane] = f32_above(far + far.abs() * LOOSE);
            }
        }
    }

    /// What a ray met.
    #[inline(always)]
    fn leaf(&self, group: usize, lane: usize) -> Option<LeafRef> {
        let met = Q::Query::ORDERED && self.met[group] >> lane & 1 == 1;
        met.then_some(self.firsts[group].leaf(lane))
    }

    /// Writes the answers. Rays that are not `sound` are not in the packet.
    #[inline(always)]
    fn settle<S: Simd>(&mut self, s: S, sound: [u32; GROUPS]) {
        let Company { batch, firsts, met, packet, .. } = self;
        let mut unsettled = [0; GROUPS];
        for (group, sound) in sound.into_iter().enumerate() {
            let first = 16 * group;
            let there = batch.rays.len().saturating_sub(first).min(16);
            let (met, there) = (met[group] & sound, (1 << there) - 1);
            for lane in Bits(sound & !met) {
                batch.write(first + lane, Q::nothing());
            }
            for lane in Bits(there & !sound) {
                batch.answer_alone(first + lane);
            }
            let block = batch.block;
            let write = |lane, answer| batch.write(first + lane, answer);
            unsettled[group] = Q::settle(s, block, packet.group(group), &firsts[group], met, write);
        }
        for (group, unsettled) in unsettled.into_iter().enumerate() {
            for lane in Bits(unsettled) {
                self.settle_alone(16 * group + lane, self.firsts[group].leaf(lane));
            }
        }
    }

    /// Answers for a ray whose hit takes more than a look.
    #[cold]
    #[inline(never)]
    fn settle_alone(&mut self, number: usize, leaf: LeafRef) {
        let Batch { block, rays, question, .. } = self.batch;
        let Some(ray) = rays[number].prepare(block.header.extent()) else { return };
        let mut query = question.query(block.whole, ray.t_max);
        let ended = self.leaves.intersect(Scalar, leaf, &ray, &mut query);
        self.batch.write(number, Q::answer(Scalar, block.whole, &ray, &mut query, ended));
    }
}
