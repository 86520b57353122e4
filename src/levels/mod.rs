//! One ray through a block with instances: what is not in any first, then the instances that it comes to, near ones first.
//!
//! Each instance is asked the question anew, for the ray in its object space, up to the best hit so far. So the traversal
//! is the same for both levels, and exists once: only the walk through the index is another, with a query that calls
//! back for each instance. Answers of different instances are compared by their rounded `t`; where these are equal, in
//! real arithmetic.

mod reach;
mod stops;
mod together;

use core::cmp::Ordering;

use crate::block::Finished;
use crate::block::level::{InstanceRecord, Level};
use crate::query::{Choice, Counts, Decide, Exact, QueryOptions, Watch, Watertight, shares_bit};
use crate::ray::{Hit, NONE, Ray};
use crate::trace::{ClosestMet, any_hit, ask, closest_hit};

pub(crate) use reach::visit_reached;
pub(crate) use together::{any_of_each, closest_of_each};

/// The closest hit of a block with instances among what `options` leave.
#[inline(never)]
pub(crate) fn closest<D: Across, W: Watch>(
    block: Finished,
    ray: &Ray,
    options: &QueryOptions,
    mut watch: W,
) -> Option<Hit> {
    let level = block.level()?;
    let mut ask_in = |place: &Shown, ray: &Ray| {
        if place.is_empty() {
            return None;
        }
        let choice = place.choice(options);
        let hit = closest_hit::<D, _>(place.block, ray, choice, watch.lend())?;
        Some(Hit { instance: place.instance, ..hit })
    };
    let own = Shown::own(block);
    let mut best = ask_in(&own, ray).map(|hit| Best { hit, shown: own, ray: *ray });
    let limited = |best: &Option<Best>| Ray {
        t_max: best.as_ref().map_or(ray.t_max, |best| best.limit(ray)),
        ..*ray
    };
    let (start, mut steps) = (limited(&best), Counts::default());
    let counts = W::COUNTS.then_some(&mut steps);
    visit_reached(&level, &start, counts, &mut |number| {
        let found = Shown::of(&level, number, options).and_then(|(shown, record)| {
            let ray = record.object_ray(&limited(&best))?;
            ask_in(&shown, &ray).map(|hit| Best { hit, shown, ray })
        });
        if let Some(found) = found
            && best.as_ref().is_none_or(|best| found.is_before::<D>(best, options))
        {
            best = Some(found);
        }
        Some(limited(&best).t_max)
    });
    watch.steps(steps.steps);
    best.map(|best| best.hit)
}

/// Whether anything that `options` leave is hit in a block with instances.
#[inline(never)]
pub(crate) fn any<D: Decide, W: Watch>(
    block: Finished,
    ray: &Ray,
    options: &QueryOptions,
    mut watch: W,
) -> bool {
    let Some(level) = block.level() else { return false };
    let mut is_hit_in = |place: &Shown, ray: &Ray| {
        let choice = place.choice(options);
        !place.is_empty() && any_hit::<D, _>(place.block, ray, choice, watch.lend())
    };
    if is_hit_in(&Shown::own(block), ray) {
        return true;
    }
    let (mut hit, mut steps) = (false, Counts::default());
    let counts = W::COUNTS.then_some(&mut steps);
    visit_reached(&level, ray, counts, &mut |number| {
        hit = Shown::of(&level, number, options).is_some_and(|(shown, record)| {
            record.object_ray(ray).is_some_and(|ray| is_hit_in(&shown, &ray))
        });
        (!hit).then_some(ray.t_max)
    });
    watch.steps(steps.steps);
    hit
}

/// The block of an instance, or the one that has instances.
#[derive(Clone, Copy)]
pub(crate) struct Shown<'m> {
    pub block: Finished<'m>,
    /// [`NONE`] for the one that has them.
    pub instance: u32,
}

impl<'m> Shown<'m> {
    /// That of no instance.
    pub fn own(block: Finished<'m>) -> Self {
        Shown { block, instance: NONE }
    }

    /// That of an instance, if `options` leave it.
    pub fn of(
        level: &Level<'m>,
        instance: u32,
        options: &QueryOptions,
    ) -> Option<(Self, &'m InstanceRecord)> {
        let record = level.instances.get(instance as usize)?;
        let seen = shares_bit(record.mask, options.mask);
        let block = level.child(record).filter(|_| seen)?;
        Some((Shown { block, instance }, record))
    }

    /// Whether it has no primitives of its own.
    fn is_empty(&self) -> bool {
        self.block.header().counts.prim_ids == 0
    }

    /// What `options` leave of it.
    #[inline(always)]
    pub fn choice(&self, options: &QueryOptions) -> Choice {
        let block = self.block.parts();
        Choice::new(options, self.instance, block.geometries, block.header.prim_limit)
    }
}

/// The best hit so far, and the ray in whose space it is.
pub(crate) struct Best<'m> {
    hit: Hit,
    shown: Shown<'m>,
    ray: Ray,
}

impl Best<'_> {
    /// A limit that is not below the real `t`, which the hit's is rounded from.
    fn limit(&self, ray: &Ray) -> f32 {
        self.hit.t.next_up().min(ray.t_max)
    }

    /// Whether this comes first: at a smaller `t`, or at an equal one in an instance of a smaller number.
    fn is_before<D: Across>(&self, other: &Best, options: &QueryOptions) -> bool {
        match self.hit.t.partial_cmp(&other.hit.t) {
            Some(Ordering::Less) => true,
            Some(Ordering::Greater) | None => false,
            Some(Ordering::Equal) => match D::order(self, other, options) {
                Ordering::Less => true,
                Ordering::Greater => false,
                // `NONE` comes before all numbers.
                Ordering::Equal => {
                    self.hit.instance.wrapping_add(1) < other.hit.instance.wrapping_add(1)
                }
            },
        }
    }
}

/// How meetings of one rounded `t` on different lines are ordered.
pub(crate) trait Across: Decide {
    fn order(a: &Best, b: &Best, options: &QueryOptions) -> Ordering;
}

impl Across for Exact {
    #[cold]
    fn order(a: &Best, b: &Best, options: &QueryOptions) -> Ordering {
        let met =
            |best: &Best| ask(best.shown.block, &best.ray, ClosestMet(best.shown.choice(options)));
        let both = met(a).zip(met(b));
        both.map_or(Ordering::Equal, |(p, q)| p.compare(&a.ray.line(), &q, &b.ray.line()))
    }
}

impl Across for Watertight {
    fn order(_: &Best, _: &Best, _: &QueryOptions) -> Ordering {
        Ordering::Equal
    }
}
