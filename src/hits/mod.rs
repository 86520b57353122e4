//! Lists of hits: all of them in order, a few at a time.

mod instances;

use crate::block::{Block, Finished};
use crate::levels::Shown;
use crate::query::{
    Choice, Decide, Exact, ExactMet, Filter, Meets, NextHits, PrimId, QueryOptions, Wanted,
    flat_number,
};
use crate::ray::{Hit, NONE, PreparedRay, Ray};
use crate::simd::Simd;
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
    options: QueryOptions,
    last: Option<HitKey>,
    /// What the last search has found, of which `next..count` are still to be given.
    found: [Hit; FETCH],
    next: usize,
    count: usize,
}

/// So many hits are looked for at a time.
const FETCH: usize = 8;

impl<'m> Hits<'m> {
    pub(crate) fn new(block: Finished<'m>, ray: Ray, options: QueryOptions) -> Self {
        // As if one search had filled the room and all of it had been given.
        let (next, count) = (FETCH, FETCH);
        Hits { block, ray, options, last: None, found: [Hit::MISS; FETCH], next, count }
    }
}

impl Iterator for Hits<'_> {
    type Item = Hit;

    fn next(&mut self) -> Option<Hit> {
        if self.next == FETCH {
            let Hits { block, ray, options, .. } = self;
            let found = fill(*block, ray, options, &mut self.last, &mut self.found);
            self.count = found.unwrap_or(0);
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

/// The first hits after `last` into `hits`; returns how many, and `last` becomes the last of them. `None` when the ray does not
/// have that: nothing is written then.
pub(crate) fn fill(
    block: Finished,
    ray: &Ray,
    options: &QueryOptions,
    last: &mut Option<HitKey>,
    hits: &mut [Hit],
) -> Option<usize> {
    let count = match block.level() {
        None => fill_marked(&Shown::own(block), ray, options, last, hits),
        Some(level) => instances::fill(block, &level, ray, options, last, hits),
    }?;
    hits.iter_mut().take(count).for_each(|hit| hit.u = hit.u.max(0.0));
    Some(count)
}

/// The weight of a hit for which this one stands for now: where the ray leaves a sphere.
const LEAVES: f32 = -1.0;

/// The first hits after `last` that are in no instance, where the ray leaves a sphere [marked](LEAVES). All keys and hits are as if the
/// block stood alone.
fn fill_marked(
    shown: &Shown,
    ray: &Ray,
    options: &QueryOptions,
    last: &mut Option<HitKey>,
    hits: &mut [Hit],
) -> Option<usize> {
    let (block, mut ray) = (shown.block, *ray);
    let mut after = None;
    if let Some(key) = last {
        after = Some(locate(block, &ray, key)?);
        ray = from(&ray, key);
    }
    if hits.is_empty() {
        return Some(0);
    }
    let choice = shown.choice(options);
    let count = trace::ask(block, &ray, HitsAfter { choice, after, hits });
    if let Some(hit) = hits.get(..count).and_then(<[_]>::last) {
        *last = Some(key_of(hit));
    }
    Some(count)
}

/// The key of a hit that is marked if the ray leaves a sphere there.
fn key_of(hit: &Hit) -> HitKey {
    let Hit { prim, geometry, instance, t, u, .. } = *hit;
    HitKey { id: PrimId { prim, geometry, instance }, root: (u == LEAVES).into(), t }
}

/// A ray that begins where the hit of `key` is, or just before: its real `t` is above that. Limits that are no numbers stay.
fn from(ray: &Ray, key: &HitKey) -> Ray {
    let below = key.t.next_down();
    Ray { t_min: if below > ray.t_min { below } else { ray.t_min }, ..*ray }
}

/// The meeting that `key` names, in a block that stands alone.
fn locate(block: Finished, ray: &Ray, key: &HitKey) -> Option<ExactMet> {
    if key.id.instance != NONE {
        return None;
    }
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
    /// How many.
    type Answer = usize;

    fn query(self, block: Finished<'m>, t_max: f32) -> Self::Query {
        let filter = Filter::new(self.choice, block);
        NextHits::new(filter, block, self.after.as_ref(), t_max, self.hits)
    }

    fn answer<S: Simd>(
        s: S,
        block: Finished<'m>,
        ray: &PreparedRay,
        query: &mut Self::Query,
        _: bool,
    ) -> Self::Answer {
        query.finish(ray, |met| {
            let t = Exact::t(ray, met, &mut ());
            let hit = trace::record(s, block, met.place(), t, Exact::weights(met));
            Hit { u: if met.root() == 1 { LEAVES } else { hit.u }, ..hit }
        })
    }

    fn nothing() -> Self::Answer {
        0
    }
}
