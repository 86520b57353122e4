//! Lists of hits: all of them in order, a few at a time.

use crate::block::{Block, Finished};
use crate::query::{
    Choice, Decide, Exact, ExactMet, Filter, Meets, NextHits, PrimId, Wanted, flat_number,
};
use crate::ray::{Hit, PreparedRay, Ray};
use crate::trace::{self, LocateHit, Question};

/// A hit among all that a ray has: its primitive, which of two roots, and its `t`.
///
/// Of two hits that round to one `t` this still says which: nothing is lost or doubled when a list goes on after it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HitKey {
    /// What is hit.
    pub id: PrimId,
    /// 0 for triangles and where the ray enters a sphere, 1 where it leaves one.
    pub root: u32,
    /// The hit's `t`.
    pub t: f32,
}

/// All hits along a ray in order, from [`Accel::hits`](crate::Accel::hits).
#[derive(Clone)]
pub struct Hits<'m> {
    block: Finished<'m>,
    ray: Ray,
    choice: Choice,
    last: Option<HitKey>,
    /// What the last search has found, of which `next..count` are still to be given.
    found: [Hit; FETCH],
    next: usize,
    count: usize,
}

/// So many hits are looked for at a time.
const FETCH: usize = 8;

impl<'m> Hits<'m> {
    pub(crate) fn new(block: Finished<'m>, ray: Ray, choice: Choice) -> Self {
        // As if one search had filled the room and all of it had been given.
        let (next, count) = (FETCH, FETCH);
        Hits { block, ray, choice, last: None, found: [Hit::MISS; FETCH], next, count }
    }
}

impl Iterator for Hits<'_> {
    type Item = Hit;

    fn next(&mut self) -> Option<Hit> {
        if self.next == FETCH {
            let Hits { block, ray, choice, .. } = self;
            self.count = fill(*block, ray, *choice, &mut self.last, &mut self.found);
            self.next = 0;
        }
        let hit = self.found[..self.count].get(self.next).copied()?;
        self.next += 1;
        Some(hit)
    }
}

impl core::iter::FusedIterator for Hits<'_> {}

impl core::fmt::Debug for Hits<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Hits").field("ray", &self.ray).field("last", &self.last).finish()
    }
}

/// The first hits after `last` into `hits`; returns how many, and `last` becomes the last of them.
pub(crate) fn fill(
    block: Finished,
    ray: &Ray,
    choice: Choice,
    last: &mut Option<HitKey>,
    hits: &mut [Hit],
) -> usize {
    let mut ray = *ray;
    let mut after = None;
    if let Some(key) = last {
        after = locate(block, &ray, key);
        if after.is_none() {
            return 0;
        }
        // The real `t` is above this. Limits that are no numbers stay.
        let below = key.t.next_down();
        if below > ray.t_min {
            ray.t_min = below;
        }
    }
    if hits.is_empty() {
        return 0;
    }
    let (count, root) = trace::ask(block, &ray, HitsAfter { choice, after, hits });
    if let Some(hit) = hits[..count].last() {
        let Hit { prim, geometry, instance, t, .. } = *hit;
        let id = PrimId { prim, geometry, instance };
        *last = Some(HitKey { id, root: root as u32, t });
    }
    count
}

/// The meeting that `key` names.
fn locate(block: Finished, ray: &Ray, key: &HitKey) -> Option<ExactMet> {
    let Block { geometries, header, .. } = block.parts();
    let prim = flat_number(&key.id, geometries, header.prim_limit)?;
    // Where the real `t` is, since it was rounded to the nearest float.
    let ray = ray.with_limits(key.t.next_down(), key.t.next_up());
    let wanted = Wanted { prim, t: key.t, root: Some(key.root as usize) };
    trace::ask(block, &ray, LocateHit::<Exact>::new(wanted))
}

/// The first hits after one that is known, into memory for them.
struct HitsAfter<'h> {
    choice: Choice,
    after: Option<ExactMet>,
    hits: &'h mut [Hit],
}

impl<'m, 'h> Question<'m> for HitsAfter<'h> {
    type Query = NextHits<'m, 'h>;
    /// How many, and the root of the last.
    type Answer = (usize, usize);

    fn query(self, block: &Block<'m>, t_max: f32) -> Self::Query {
        let filter = Filter::new(self.choice, block.geometries, block.prim_ids);
        NextHits::new(filter, block, self.after.as_ref(), t_max, self.hits)
    }

    fn answer(block: &Block, ray: &PreparedRay, query: &mut Self::Query, _: bool) -> Self::Answer {
        query.finish(ray, |met| {
            trace::record(block, met.place(), Exact::t(ray, met, &mut ()), Exact::weights(met))
        })
    }

    fn nothing() -> Self::Answer {
        (0, 0)
    }
}
