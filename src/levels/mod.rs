//! One ray through a block with instances: what is not in any first, then the instances that it comes to, near ones first.
//!
//! Each instance is asked the question anew, for the ray in its object space, up to the best hit so far. So the traversal
//! is the same for both levels, and exists once: only the walk through the index is another, with a query that calls
//! back for each instance. Answers of different instances are compared by their rounded `t`; where these are equal, in
//! real arithmetic.

mod manner;
mod reach;
mod stops;
mod through;
mod together;

use core::cmp::Ordering;
use core::marker::PhantomData;

use crate::block::Finished;
use crate::block::level::{InstanceRecord, Level};
use crate::query::{Choice, Counts, Decide, Exact, QueryOptions, Watch, Watertight, shares_bit};
use crate::ray::{Hit, NONE, Ray};
use crate::simd::Simd;
use crate::trace::{AnyHit, ClosestHit, ClosestMet, MEMORY, ask, ask_by};

use through::{Search, visit, visit_by};

pub(crate) use reach::visit_reached;
pub(crate) use together::{any_of_each, closest_of_each};

/// The closest hit of a block with instances among what `options` leave.
#[inline(never)]
pub(crate) fn closest<D: Across, W: Watch>(
    block: Finished,
    ray: &Ray,
    options: &QueryOptions,
    watch: W,
) -> Option<Hit> {
    let level = &block.level()?;
    let decide = PhantomData::<D>;
    let mut search = ClosestSearch { block, level, options, ray: *ray, best: None, watch, decide };
    if !Shown::own(block).is_empty() {
        visit(&mut search, NONE);
    }
    let (start, mut counts) = (search.ray, Counts::default());
    visit_by::<W>(level, &start, &mut search, &mut counts);
    search.watch.steps(counts.steps);
    search.best.map(|best| best.hit)
}

/// Whether anything that `options` leave is hit in a block with instances.
#[inline(never)]
pub(crate) fn any<D: Decide, W: Watch>(
    block: Finished,
    ray: &Ray,
    options: &QueryOptions,
    watch: W,
) -> bool {
    let Some(level) = &block.level() else { return false };
    let decide = PhantomData::<D>;
    let mut search = AnySearch { block, level, options, ray, hit: false, watch, decide };
    if !Shown::own(block).is_empty() {
        visit(&mut search, NONE);
    }
    if !search.hit {
        let mut counts = Counts::default();
        visit_by::<W>(level, ray, &mut search, &mut counts);
        search.watch.steps(counts.steps);
    }
    search.hit
}

/// The search for the closest hit.
struct ClosestSearch<'a, 'm, D, W> {
    block: Finished<'m>,
    level: &'a Level<'m>,
    options: &'a QueryOptions,
    /// Up to the best hit so far.
    ray: Ray,
    best: Option<Best<'m>>,
    watch: W,
    decide: PhantomData<D>,
}

impl<D: Across, W: Watch> Search for ClosestSearch<'_, '_, D, W> {
    #[inline(always)]
    fn visit<S: Simd>(&mut self, s: S, instance: u32) -> Option<f32> {
        let place = Shown::at(self.block, self.level, instance, self.options, &self.ray);
        if let Some((shown, ray)) = place {
            let question =
                ClosestHit::<D, _, MEMORY>::new(shown.choice(self.options), self.watch.lend());
            let mut room = [[0.0; 4]; 2];
            if let Some(hit) = ask_by(s, shown.block, ray.settled(s, &mut room), question) {
                self.take(Best { hit: Hit { instance, ..hit }, shown, ray });
            }
        }
        Some(self.ray.t_max)
    }
}

impl<'m, D: Across, W> ClosestSearch<'_, 'm, D, W> {
    fn take(&mut self, found: Best<'m>) {
        if self.best.as_ref().is_none_or(|best| found.is_before::<D>(best, self.options)) {
            // Not below the real `t`, which the hit's is rounded from.
            self.ray.t_max = found.hit.t.next_up().min(self.ray.t_max);
            self.best = Some(found);
        }
    }
}

/// The search for any hit.
struct AnySearch<'a, 'm, D, W> {
    block: Finished<'m>,
    level: &'a Level<'m>,
    options: &'a QueryOptions,
    ray: &'a Ray,
    hit: bool,
    watch: W,
    decide: PhantomData<D>,
}

impl<D: Decide, W: Watch> Search for AnySearch<'_, '_, D, W> {
    #[inline(always)]
    fn visit<S: Simd>(&mut self, s: S, instance: u32) -> Option<f32> {
        if let Some((shown, ray)) =
            Shown::at(self.block, self.level, instance, self.options, self.ray)
        {
            let question = AnyHit::<D, _>::new(shown.choice(self.options), self.watch.lend());
            let mut room = [[0.0; 4]; 2];
            self.hit = ask_by(s, shown.block, ray.settled(s, &mut room), question);
        }
        (!self.hit).then_some(self.ray.t_max)
    }
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

    /// That of an instance, or of none, if `options` leave something of it, and the ray in its space.
    #[inline(always)]
    fn at(
        block: Finished<'m>,
        level: &Level<'m>,
        instance: u32,
        options: &QueryOptions,
        ray: &Ray,
    ) -> Option<(Self, Ray)> {
        let (shown, ray) = if instance == NONE {
            (Shown::own(block), *ray)
        } else {
            let (shown, record) = Shown::of(level, instance, options)?;
            (shown, record.object_ray(ray)?)
        };
        (!shown.is_empty()).then_some((shown, ray))
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
