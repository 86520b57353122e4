//! Rays that are alike: as one thick ray through the bundles, and side by side through the leaves.

use super::Batch;
use crate::block::bundle::{Bundle, ChildRef};
use crate::block::leaf::{KIND_TRIANGLES, Place, TriangleBlock};
use crate::bvh::{Columns, ENOUGH_ROOM, Walk};
use crate::math::rounding::f32_above;
use crate::prim::Leaves;
use crate::query::{Query, TriangleLane};
use crate::ray::{Alike, GROUPS, PACKET, PreparedRay, RayPacket, Sixteen, WideBoxes};
use crate::sieve::{Aim, Found, Opened, Sheared};
use crate::simd::{Lanes, Scalar, Simd, Width};
use crate::trace::Question;

/// No block has this number.
const NOWHERE: u32 = u32::MAX;

/// Rays on their way together.
///
/// What `f32` is sure of needs no more for now: a triangle that surely is met, and surely before what was met so far, takes
/// its place. Its `t` is computed at the end, and only for the one that is left. All else is for the ray alone.
struct Company<'a, 'b, 'm, Q: Question, A> {
    batch: Batch<'a, 'm, Q, A>,
    leaves: Leaves<'m>,
    packet: &'b mut RayPacket,
    /// Below the depth of what was met so far; minus infinity when that is not known.
    near: &'b mut [Sixteen; GROUPS],
    /// The block and the lane of the triangle that surely was met, and surely before all others.
    blocks: &'b mut [[u32; 16]; GROUPS],
    lanes: &'b mut [[u32; 16]; GROUPS],
    /// Rays that had to be looked at alone.
    members: &'b mut [Option<Member<Q::Query>>; PACKET],
}

/// A ray that had to be looked at alone.
struct Member<Q> {
    ray: PreparedRay,
    query: Q,
}

impl<Q: Question + Copy, A> Batch<'_, '_, Q, A> {
    /// Traces rays that are alike, [`PACKET`] at most.
    #[inline(always)]
    pub(super) fn trace_together<S: Simd>(mut self, s: S, alike: Alike) {
        let mut packet = RayPacket::new(alike);
        let sound = packet.set(s, self.rays);
        for number in 0..self.rays.len().min(PACKET) {
            if sound[number / 16] >> (number % 16) & 1 == 0 {
                self.answer_alone(number);
            } else {
                self.write(number, Q::nothing());
            }
        }
        // Where the filter has a say, no triangle is taken without asking it.
        let near = if self.question.sees_all() { f32::INFINITY } else { f32::NEG_INFINITY };
        Company {
            leaves: Leaves::of(self.block),
            batch: self,
            packet: &mut packet,
            near: &mut [[near; 16]; GROUPS],
            blocks: &mut [[NOWHERE; 16]; GROUPS],
            lanes: &mut [[0; 16]; GROUPS],
            members: &mut [const { None }; PACKET],
        }
        .run(s);
    }
}

impl<Q: Question + Copy, A> Company<'_, '_, '_, Q, A> {
    #[inline(always)]
    fn run<S: Simd>(mut self, s: S) {
        self.descend(s);
        if Q::Query::ORDERED {
            for number in 0..self.batch.rays.len().min(PACKET) {
                self.settle(number);
            }
        }
    }

    #[inline(always)]
    fn descend<S: Simd>(&mut self, s: S) {
        let (mut columns, mut room) = (Columns::<ENOUGH_ROOM>::UNWRITTEN, [[[0.0; 16]; 2]; 16]);
        let mut walk = Walk::new(&mut columns, self.packet.highest(s));
        loop {
            let (hull, bound) = (self.packet.hull(s), Width::<16>::splat(s, walk.t_bound()));
            while !walk.at().is_leaf() {
                let Some(bundle) = self.batch.bundles.get(walk.at().bundle_number()) else { return };
                let (entered, near) = hull.entered::<true>(&bundle.walls, bound);
                self.fetch(s, bundle, entered);
                if !walk.go_on::<S, Q::Query, 16>(s, bundle, entered, near) {
                    return;
                }
            }
            if walk.at() == ChildRef::NONE {
                return;
            }
            self.visit(s, walk.at().leaf_block(), &mut room);
            let bound = self.packet.highest(s);
            if bound == f32::NEG_INFINITY {
                return;
            }
            walk.leave::<S, Q::Query>(s, bound);
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
        if kind != KIND_TRIANGLES {
            return self.visit_alone(leaf, entered);
        }
        let Some(block) = self.leaves.triangle_blocks.get(number) else { return };
        let opened = Opened::new(s, &self.packet.alike, block);
        for (group, entered) in entered.into_iter().enumerate() {
            if entered != 0 {
                self.look(s, group, entered, number as u32, &opened, room);
            }
        }
    }

    /// Offers the triangles of a block to the rays of a group.
    #[inline(always)]
    fn look<S: Simd>(
        &mut self,
        s: S,
        group: usize,
        entered: u32,
        number: u32,
        opened: &Opened,
        room: &mut Sheared,
    ) {
        let block = opened.block;
        let mut aim = Aim::new(s, self.packet.group(group), opened, room);
        let mut active = entered & aim.within(s);
        let mut rest = aim.passed(s, opened, active);
        while rest != 0 {
            let lane = rest.trailing_zeros();
            rest &= rest - 1;
            let found = aim.look(s, opened, lane as usize, active);
            let doubt = if Q::Query::ORDERED {
                let nearer = self.take(s, group, &found, aim.span(s, &found));
                s.set_words(nearer.before, number, &mut self.blocks[group]);
                s.set_words(nearer.before, lane, &mut self.lanes[group]);
                if let Some(id) = self.leaves.prim_ids.get((block.first.wrapping_add(lane)) as usize) {
                    s.prefetch(id);
                }
                aim.limit(s, Width::<16>::load(s, &self.packet.group(group).high));
                found.candidates & !(nearer.before | nearer.after)
            } else if self.near[group][0] == f32::INFINITY {
                let mut rest = found.clear;
                active &= !rest;
                while rest != 0 {
                    self.occlude(16 * group + rest.trailing_zeros() as usize);
                    rest &= rest - 1;
                }
                found.candidates & !found.clear
            } else {
                found.candidates
            };
            if doubt != 0 {
                active &= !self.doubt(group, doubt, number, lane, block);
                aim.limit(s, Width::<16>::load(s, &self.packet.group(group).high));
            }
        }
    }

    /// Lets what surely is met before all else take its place.
    #[inline(always)]
    fn take<S: Width<16>>(
        &mut self,
        s: S,
        group: usize,
        found: &Found<S::V>,
        [near, far]: [S::V; 2],
    ) -> Order {
        let (best_near, best_far) =
            (s.load(&self.near[group]), Width::<16>::load(s, &self.packet.group(group).high));
        let before = found.clear & far.less(best_near);
        let after = found.clear & best_far.less(near);
        s.select(before, near, best_near).store(&mut self.near[group]);
        s.select(before, far, best_far).store(&mut self.packet.group(group).high);
        Order { before, after }
    }

    /// The ray has its answer: something is hit.
    fn occlude(&mut self, number: usize) {
        if let Some(answer) = Q::of_hit() {
            self.batch.write(number, answer);
        }
        self.packet.group(number / 16).end(number);
    }

    /// Asks some rays of a group alone for a triangle; those that want no more.
    #[cold]
    #[inline(never)]
    fn doubt(&mut self, group: usize, rays: u32, number: u32, lane: u32, block: &TriangleBlock) -> u32 {
        let (mut rest, mut ended) = (rays, 0);
        while rest != 0 {
            let ray = rest.trailing_zeros();
            rest &= rest - 1;
            let place = Place { block: number, lane, entry: block.first.wrapping_add(lane) };
            let lane = TriangleLane { block, place, sure: false, inside: false };
            let offer = |member: &mut Member<Q::Query>| member.query.triangle(&member.ray, &lane);
            ended |= u32::from(self.ask_alone(16 * group + ray as usize, offer)) << ray;
        }
        ended
    }

    /// Offers a leaf to each ray alone.
    #[inline(never)]
    fn visit_alone(&mut self, leaf: (u32, usize), entered: [u32; GROUPS]) {
        let leaves = self.leaves;
        for (group, entered) in entered.into_iter().enumerate() {
            let mut rest = entered;
            while rest != 0 {
                let number = 16 * group + rest.trailing_zeros() as usize;
                rest &= rest - 1;
                self.ask_alone(number, |Member { ray, query }| {
                    leaves.intersect_whole(Scalar, leaf, ray, query)
                });
            }
        }
    }

    /// Has one ray decide something alone, with all that it met before; true when it wants no more.
    fn ask_alone(
        &mut self,
        number: usize,
        decide: impl FnOnce(&mut Member<Q::Query>) -> bool,
    ) -> bool {
        let Some(ray) = self.batch.rays.get(number).copied() else { return true };
        self.join(number);
        let Some(Some(member)) = self.members.get_mut(number) else { return true };
        let ended = decide(member);
        // From the ray's own frame to the depths of the one they have in common.
        let t_bound = f64::from(member.query.t_bound()) / member.ray.t_scale;
        let Alike { axes, scale, .. } = self.packet.alike;
        let bound = t_bound * f64::from(ray.direction[axes[2]].abs()) * f64::from(scale);
        let (group, lane) = (number / 16 % GROUPS, number % 16);
        let high = &mut self.packet.group(group).high[lane];
        *high = high.min(f32_above(bound + bound.abs() * 1e-12));
        self.near[group][lane] = f32::NEG_INFINITY;
        if ended {
            self.occlude(number);
        }
        ended
    }

    /// Makes a ray ready to be asked alone, and tells it what it met.
    fn join(&mut self, number: usize) {
        let (group, lane) = (number / 16 % GROUPS, number % 16);
        let Some(member) = self.members.get_mut(number) else { return };
        if member.is_none() {
            let ray = self.batch.rays[number].prepare_with(Scalar, self.batch.block.header.reach);
            *member = ray.map(|(ray, _)| Member { query: self.batch.question.query(&ray), ray });
        }
        let number = core::mem::replace(&mut self.blocks[group][lane], NOWHERE);
        if let (Some(member), Some(block)) = (member, self.leaves.triangle_blocks.get(number as usize)) {
            let lane = sure(block, number, self.lanes[group][lane]);
            member.query.triangle(&member.ray, &lane);
        }
    }

    /// Answers for a ray that is at its end.
    #[inline(always)]
    fn settle(&mut self, number: usize) {
        let (group, lane) = (number / 16 % GROUPS, number % 16);
        let block_number = self.blocks[group][lane];
        let alone = self.members[number].is_some();
        if !alone && let Some(block) = self.leaves.triangle_blocks.get(block_number as usize) {
            let lane = sure(block, block_number, self.lanes[group][lane]);
            if let Some(answer) = Q::of_sure(self.batch.block, &self.batch.rays[number], &lane) {
                return self.batch.write(number, answer);
            }
        }
        if alone || block_number != NOWHERE {
            self.settle_alone(number);
        }
    }

    #[cold]
    #[inline(never)]
    fn settle_alone(&mut self, number: usize) {
        self.join(number);
        if let Some(Member { ray, query }) = &mut self.members[number] {
            let answer = Q::answer(self.batch.block, ray, query, false);
            self.batch.write(number, answer);
        }
    }
}

/// Rays that surely meet one triangle before another, and those that do after it.
struct Order {
    before: u32,
    after: u32,
}

/// A triangle that surely is met within the limits.
#[inline(always)]
fn sure(block: &TriangleBlock, number: u32, lane: u32) -> TriangleLane<'_> {
    let place = Place { block: number, lane, entry: block.first.wrapping_add(lane) };
    TriangleLane { block, place, sure: true, inside: true }
}
