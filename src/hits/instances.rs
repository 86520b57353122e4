//! Lists of hits in blocks with instances: those of each instance that the ray comes to, in one order.

use core::cmp::Ordering;

use super::{HitKey, fill_marked, from, key_of, locate};
use crate::block::Finished;
use crate::block::level::Level;
use crate::levels::{Shown, visit_reached};
use crate::query::{ExactMet, PrimId, QueryOptions};
use crate::ray::{Hit, NONE, Ray};

/// So many hits of an instance are looked for at a time.
const FETCH: usize = 8;

/// As [`fill`](super::fill), for a block with this level.
pub(super) fn fill(
    block: Finished,
    level: &Level,
    ray: &Ray,
    options: &QueryOptions,
    last: &mut Option<HitKey>,
    hits: &mut [Hit],
) -> Option<usize> {
    let places = Places { block, level, ray };
    let mut list = List { places, options, after: None, hits, count: 0 };
    if let Some(key) = last {
        places.met(key)?;
        list.after = Some(*key);
    }
    if list.hits.is_empty() {
        return Some(0);
    }
    let start = last.map_or(*ray, |key| from(ray, &key));
    list.gather(&Shown::own(block), &start);
    visit_reached(level, &list.limited(&start), None, &mut |number| {
        let limited = list.limited(&start);
        if let Some((shown, record)) = Shown::of(level, number, options)
            && let Some(ray) = record.object_ray(&limited)
        {
            list.gather(&shown, &ray);
        }
        Some(list.limited(&start).t_max)
    });
    let count = list.count;
    if let Some(hit) = hits.get(..count).and_then(<[_]>::last) {
        *last = Some(key_of(hit));
    }
    Some(count)
}

/// Where the hits of a ray are looked up.
#[derive(Clone, Copy)]
struct Places<'a, 'm> {
    block: Finished<'m>,
    level: &'a Level<'m>,
    ray: &'a Ray,
}

impl Places<'_, '_> {
    /// The meeting that `key` names, and the ray in whose space it is.
    fn met(&self, key: &HitKey) -> Option<(ExactMet, Ray)> {
        let alone = HitKey { id: PrimId { instance: NONE, ..key.id }, ..*key };
        if key.id.instance == NONE {
            return Some((locate(self.block, self.ray, &alone)?, *self.ray));
        }
        let record = self.level.instances.get(key.id.instance as usize)?;
        let ray = record.object_ray(self.ray)?;
        Some((locate(self.level.child(record)?, &ray, &alone)?, ray))
    }

    /// The order of two hits of the ray: by their real `t`, then by instance, geometry, primitive and root.
    fn order(&self, a: &HitKey, b: &HitKey) -> Ordering {
        if a.id == b.id {
            return a.root.cmp(&b.root);
        }
        let by_t = match a.t.partial_cmp(&b.t) {
            Some(Ordering::Equal) | None => {
                let both = self.met(a).zip(self.met(b));
                both.map_or(Ordering::Equal, |((p, of_p), (q, of_q))| {
                    p.compare(&of_p.line(), &q, &of_q.line())
                })
            }
            Some(order) => order,
        };
        // `NONE` comes before all numbers.
        let number = |key: &HitKey| (key.id.instance.wrapping_add(1), key.id.geometry, key.id.prim);
        by_t.then_with(|| number(a).cmp(&number(b)))
    }
}

/// The first hits after one that is known, sorted, where the ray leaves a sphere [marked](super::LEAVES).
struct List<'a, 'm, 'h> {
    places: Places<'a, 'm>,
    options: &'a QueryOptions,
    after: Option<HitKey>,
    hits: &'h mut [Hit],
    count: usize,
}

impl List<'_, '_, '_> {
    /// Takes those hits of `shown` in, by the ray in its space, that come before the last one or find room.
    fn gather(&mut self, shown: &Shown, ray: &Ray) {
        let own = |key: &HitKey| key.id.instance == shown.instance;
        let alone = |key: HitKey| HitKey { id: PrimId { instance: NONE, ..key.id }, ..key };
        let mut last = self.after.filter(own).map(alone);
        loop {
            let mut found = [Hit::MISS; FETCH];
            let count = fill_marked(shown, ray, self.options, &mut last, &mut found).unwrap_or(0);
            for hit in found.iter().take(count) {
                if !self.offer(Hit { instance: shown.instance, ..*hit }) {
                    return;
                }
            }
            if count < FETCH {
                return;
            }
        }
    }

    /// Takes a hit in; false when it comes after the last one for which there is room.
    fn offer(&mut self, hit: Hit) -> bool {
        let (places, key) = (self.places, key_of(&hit));
        if self.after.is_some_and(|after| places.order(&key, &after) != Ordering::Greater) {
            return true;
        }
        let sorted = self.hits.get(..self.count).unwrap_or(&[]);
        // What is there already belongs to an instance that was come to twice.
        let place = match sorted.binary_search_by(|other| places.order(&key_of(other), &key)) {
            Ok(_) => return true,
            Err(place) => place,
        };
        if place == self.hits.len() {
            return false;
        }
        self.count = (self.count + 1).min(self.hits.len());
        let mut moved = hit;
        for hit in self.hits.iter_mut().take(self.count).skip(place) {
            core::mem::swap(hit, &mut moved);
        }
        true
    }

    /// The part of a ray in which hits would still be taken in.
    fn limited(&self, ray: &Ray) -> Ray {
        let last = self.hits.last().filter(|_| self.count == self.hits.len());
        // The real `t` is below that.
        let most = last.map_or(ray.t_max, |hit| hit.t.next_up());
        Ray { t_max: if most < ray.t_max { most } else { ray.t_max }, ..*ray }
    }
}
