//! Many hits of one ray in order: the question behind lists of hits and the nearest few.

use core::cmp::Ordering;

use super::{Decide, Exact, ExactMet, Filter, Meets, Query, SphereLane, TriangleLane};
use crate::block::leaf::{KIND_TRIANGLES, LeafRef, Place, SphereBlock, TriangleBlock};
use crate::block::{Block, Finished};
use crate::math::rounding::{f32_above, f32_below};
use crate::ray::{Hit, PreparedRay};

/// The first hits after one that is known, as many as there is room for, each once.
///
/// In order of their real `t`, at equal `t` of their primitives' numbers, and of one sphere the entering root first. That
/// is an order of all meetings of a ray in which no two are equal: what compares as equal was offered before.
///
/// The room is the caller's memory for hits. While the search goes on, its first `count` elements hold [what is
/// kept](keep) of the meetings, sorted.
pub(crate) struct NextHits<'m, 'h> {
    filter: Filter<'m>,
    triangle_blocks: &'m [TriangleBlock],
    sphere_blocks: &'m [SphereBlock],
    after: Option<Hit>,
    t_bound: f32,
    kept: &'h mut [Hit],
    count: usize,
    watch: (),
}

/// A meeting in the memory of a hit: floats around its real `t`, and where to meet it again.
///
/// ```text
/// byte 0      4     8   12            16           20                      24
///      | near | far | - | flat number | leaf block | lane bit, root, sure |
/// ```
///
/// The rest is computed again when two meetings are too close to each other for this, and for the answer.
fn keep(met: &ExactMet, number: u32, sure: bool) -> Hit {
    let (leaf, interval) = (met.leaf(), met.interval());
    Hit {
        t: f32_below(interval.near),
        u: f32_above(interval.far),
        v: 0.0,
        prim: number,
        geometry: leaf.block,
        instance: leaf.lanes | (met.root() as u32) << ROOT | u32::from(sure) << SURE,
    }
}

/// Bits above those of the lanes: the root, and whether the sieve was sure of a triangle.
const ROOT: u32 = 16;
const SURE: u32 = 17;

fn root_of(kept: &Hit) -> usize {
    (kept.instance >> ROOT) as usize & 1
}

impl<'m, 'h> NextHits<'m, 'h> {
    /// Those after `after`, if that is given, into `room`.
    pub fn new(
        filter: Filter<'m>,
        block: Finished<'m>,
        after: Option<&ExactMet>,
        t_max: f32,
        room: &'h mut [Hit],
    ) -> Self {
        let Block { triangle_blocks, sphere_blocks, .. } = block.parts();
        let after = after.map(|met| keep(met, met.place().prim(filter.prim_ids()), false));
        NextHits {
            filter,
            triangle_blocks,
            sphere_blocks,
            after,
            t_bound: t_max,
            kept: room,
            count: 0,
            watch: (),
        }
    }

    /// Writes over each kept meeting what `record` makes of it; returns how many they are.
    pub fn finish(&mut self, ray: &PreparedRay, record: impl Fn(&ExactMet) -> Hit) -> usize {
        for i in 0..self.count {
            let met = self.kept.get(i).and_then(|kept| self.meet_again(ray, kept));
            if let Some(kept) = self.kept.get_mut(i) {
                *kept = met.as_ref().map_or(Hit::MISS, &record);
            }
        }
        self.count
    }

    fn consider(&mut self, ray: &PreparedRay, met: &ExactMet, sure: bool) {
        if !self.filter.faces(met.front()) {
            return;
        }
        let number = met.place().prim(self.filter.prim_ids());
        let order = |kept: &Hit| self.compare(ray, (met, number), kept);
        if self.after.as_ref().is_some_and(|after| order(after) != Ordering::Greater) {
            return;
        }
        let kept = self.kept.get(..self.count).unwrap_or(&[]);
        let place = match kept.last() {
            None => 0,
            // Near ones are mostly offered first.
            Some(last) if order(last) == Ordering::Greater => self.count,
            Some(_) => match kept.binary_search_by(|kept| order(kept).reverse()) {
                Ok(_) => return,
                Err(place) => place,
            },
        };
        self.insert(ray, place, keep(met, number, sure));
    }

    /// Puts it there; the last one gives way when there is no room.
    fn insert(&mut self, ray: &PreparedRay, place: usize, new: Hit) {
        let capacity = self.kept.len();
        if place < capacity {
            self.count = (self.count + 1).min(capacity);
            let mut moved = new;
            for kept in self.kept.iter_mut().take(self.count).skip(place) {
                core::mem::swap(kept, &mut moved);
            }
        }
        if self.count == capacity
            && let Some(last) = self.kept.last()
        {
            self.t_bound = self.t_bound.min(ray.t_above(f64::from(last.u), 0.0));
        }
    }

    fn compare(&self, ray: &PreparedRay, (met, number): (&ExactMet, u32), kept: &Hit) -> Ordering {
        if number == kept.prim {
            return met.root().cmp(&root_of(kept));
        }
        let interval = met.interval();
        if interval.far < f64::from(kept.t) {
            return Ordering::Less;
        }
        if interval.near > f64::from(kept.u) {
            return Ordering::Greater;
        }
        // Only in blocks of foreign bytes something is not met again. As what comes before it is not given, lists end.
        let Some(other) = self.meet_again(ray, kept) else { return Ordering::Less };
        match Exact::is_before(ray, met, &other, self.filter.prim_ids(), None, &mut ()) {
            true => Ordering::Less,
            false => Ordering::Greater,
        }
    }

    /// The meeting of which `kept` was kept.
    fn meet_again(&self, ray: &PreparedRay, kept: &Hit) -> Option<ExactMet> {
        let leaf = LeafRef { block: kept.geometry, lanes: kept.instance & 0xFFFF };
        let (number, lane) = (leaf.number(), leaf.lanes.trailing_zeros());
        let place =
            |first: u32| Place { block: number as u32, lane, entry: first.wrapping_add(lane) };
        if leaf.kind() == KIND_TRIANGLES {
            let block = self.triangle_blocks.get(number)?;
            let place = place(block.first);
            let sure = kept.instance >> SURE & 1 == 1;
            let lane = TriangleLane { block, place, sure, inside: false };
            return Exact::triangle(ray, &lane, &mut ());
        }
        let block = self.sphere_blocks.get(number)?;
        let sphere = block.sphere(lane as usize);
        Exact::roots(ray, sphere, place(block.first), &mut ())[root_of(kept)]
    }
}

impl Query for NextHits<'_, '_> {
    type Watch = ();
    const ANY_BOXES: bool = Exact::ANY_BOXES;
    const ORDERED: bool = true;

    #[inline(always)]
    fn t_bound(&self) -> f32 {
        self.t_bound
    }

    fn triangle(&mut self, ray: &PreparedRay, lane: &TriangleLane) -> bool {
        if self.filter.sees(lane.place, true)
            && let Some(met) = Exact::triangle(ray, lane, &mut ())
        {
            self.consider(ray, &met, lane.sure);
        }
        false
    }

    fn sphere(&mut self, ray: &PreparedRay, lane: &SphereLane) -> bool {
        if self.filter.sees(lane.place, false) {
            for met in Exact::sphere(ray, lane, &mut ()).iter().flatten() {
                if self.filter.sees(lane.place, met.skippable()) {
                    self.consider(ray, met, false);
                }
            }
        }
        false
    }

    #[inline(always)]
    fn watch(&mut self) -> &mut () {
        &mut self.watch
    }
}
