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
use crate::query::{Choice, Decide, Exact, QueryOptions, Watch, Watertight, shares_bit};
use crate::ray::{Hit, NONE, Ray};
use crate::simd::Simd;
use crate::trace::{AnyHit, ClosestHit, ClosestMet, MEMORY, ask, ask_by};

use through::{Begin, Search, through};

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
    through::<ClosestSearch<D, W>>(&World::new(block, level, options), ray, watch)
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
    through::<AnySearch<D, W>>(&World::new(block, level, options), ray, watch)
}

/// The search for the closest hit.
struct ClosestSearch<'a, 'm, D, W> {
    world: &'a World<'a, 'm>,
    ray: &'a Ray,
    /// Up to the best hit so far.
    t_max: f32,
    best: Option<Hit>,
    watch: W,
    decide: PhantomData<D>,
}

impl<'a, 'm, D: Across, W: Watch> Begin<'a, 'm> for ClosestSearch<'a, 'm, D, W> {
    #[inline(always)]
    fn new(world: &'a World<'a, 'm>, ray: &'a Ray, watch: W) -> Self {
        ClosestSearch { world, ray, t_max: ray.t_max, best: None, watch, decide: PhantomData }
    }
}

impl<D: Across, W: Watch> Search for ClosestSearch<'_, '_, D, W> {
    type Watch = W;
    type Found = Option<Hit>;

    #[inline(always)]
    fn own<S: Simd>(&mut self, s: S) -> Option<f32> {
        let own = Shown::own(self.world.block);
        if !own.is_empty() {
            let question = own.closest_hit::<D, _>(self.world.options, self.watch.lend());
            if let Some(hit) = ask_by(s, own.block, self.ray, question) {
                self.take(hit);
            }
        }
        Some(self.t_max)
    }

    #[inline(always)]
    fn visit<S: Simd>(&mut self, s: S, instance: u32) -> Option<f32> {
        let mut room = [0.0; 8];
        if let Some((shown, record)) = self.world.shown(instance)
            && let Some(ray) = record.object_ray_by(s, self.ray, self.t_max, &mut room)
        {
            let question =
                ClosestHit::<D, _, MEMORY>::new(self.world.choice(&shown), self.watch.lend());
            if let Some(hit) = ask_by(s, shown.block, ray, question) {
                self.take(Hit { instance, ..hit });
            }
        }
        Some(self.t_max)
    }

    #[inline(always)]
    fn found(mut self, steps: u64) -> Option<Hit> {
        self.watch.steps(steps);
        self.best
    }
}

impl<D: Across, W> ClosestSearch<'_, '_, D, W> {
    #[inline(always)]
    fn take(&mut self, hit: Hit) {
        let first = match &self.best {
            // Copies are lent: what is known of the best had better stay in registers.
            Some(best) => self.world.is_before::<D>(self.ray, &{ hit }, &{ *best }),
            None => true,
        };
        if first {
            // Not below the real `t`, which the hit's is rounded from.
            self.t_max = hit.t.next_up().min(self.t_max);
            self.best = Some(hit);
        }
    }
}

/// The search for any hit.
struct AnySearch<'a, 'm, D, W> {
    world: &'a World<'a, 'm>,
    ray: &'a Ray,
    hit: bool,
    watch: W,
    decide: PhantomData<D>,
}

impl<'a, 'm, D: Decide, W: Watch> Begin<'a, 'm> for AnySearch<'a, 'm, D, W> {
    #[inline(always)]
    fn new(world: &'a World<'a, 'm>, ray: &'a Ray, watch: W) -> Self {
        AnySearch { world, ray, hit: false, watch, decide: PhantomData }
    }
}

impl<D: Decide, W: Watch> Search for AnySearch<'_, '_, D, W> {
    type Watch = W;
    type Found = bool;

    #[inline(always)]
    fn own<S: Simd>(&mut self, s: S) -> Option<f32> {
        let own = Shown::own(self.world.block);
        if !own.is_empty() {
            let question = own.any_hit::<D, _>(self.world.options, self.watch.lend());
            self.hit = ask_by(s, own.block, self.ray, question);
        }
        (!self.hit).then_some(self.ray.t_max)
    }

    #[inline(always)]
    fn visit<S: Simd>(&mut self, s: S, instance: u32) -> Option<f32> {
        let mut room = [0.0; 8];
        if let Some((shown, record)) = self.world.shown(instance)
            && let Some(ray) = record.object_ray_by(s, self.ray, self.ray.t_max, &mut room)
        {
            let question = AnyHit::<D, _>::new(self.world.choice(&shown), self.watch.lend());
            self.hit = ask_by(s, shown.block, ray, question);
        }
        (!self.hit).then_some(self.ray.t_max)
    }

    #[inline(always)]
    fn found(mut self, steps: u64) -> bool {
        self.watch.steps(steps);
        self.hit
    }
}

/// A block with instances, what belongs to these, and what is left of both.
struct World<'a, 'm> {
    block: Finished<'m>,
    level: &'a Level<'m>,
    options: &'a QueryOptions,
    /// What the options leave where nothing is skipped.
    unskipped: Choice,
}

impl<'a, 'm> World<'a, 'm> {
    fn new(block: Finished<'m>, level: &'a Level<'m>, options: &'a QueryOptions) -> Self {
        let unskipped = Choice::new(&QueryOptions { skip: None, ..*options }, NONE, &[], 0);
        World { block, level, options, unskipped }
    }

    /// What the options leave of what is shown.
    ///
    /// Mostly a copy of what was written long before: a processor waits for numbers that it has just written by parts.
    #[inline(always)]
    fn choice(&self, shown: &Shown) -> Choice {
        match self.options.skip {
            None => self.unskipped,
            Some(_) => shown.choice(self.options),
        }
    }

    /// What an instance shows, if the options leave it and there is something.
    #[inline(always)]
    fn shown(&self, instance: u32) -> Option<(Shown<'m>, &'m InstanceRecord)> {
        Shown::of(self.level, instance, self.options).filter(|(shown, _)| !shown.is_empty())
    }

    /// Whether a hit of the ray comes before another one: at a smaller `t`, or at an equal one in an instance of a smaller number.
    #[inline(always)]
    fn is_before<D: Across>(&self, ray: &Ray, hit: &Hit, other: &Hit) -> bool {
        hit.t < other.t || hit.t == other.t && self.wins_tie::<D>(ray, hit, other)
    }

    /// The same for hits at one rounded `t`.
    #[cold]
    #[inline(never)]
    fn wins_tie<D: Across>(&self, ray: &Ray, hit: &Hit, other: &Hit) -> bool {
        let both = self.best(ray, hit).zip(self.best(ray, other));
        match both.map_or(Ordering::Equal, |(a, b)| D::order(&a, &b, self.options)) {
            Ordering::Less => true,
            Ordering::Greater => false,
            // `NONE` comes before all numbers.
            Ordering::Equal => hit.instance.wrapping_add(1) < other.instance.wrapping_add(1),
        }
    }

    fn best(&self, ray: &Ray, hit: &Hit) -> Option<Best<'m>> {
        if hit.instance == NONE {
            return Some(Best { shown: Shown::own(self.block), ray: *ray });
        }
        let (shown, record) = self.shown(hit.instance)?;
        Some(Best { shown, ray: record.object_ray(ray)? })
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

    /// What to ask it for the closest hit.
    #[inline(always)]
    fn closest_hit<D, W>(&self, options: &QueryOptions, watch: W) -> ClosestHit<D, W, MEMORY> {
        ClosestHit::new(self.choice(options), watch)
    }

    /// What to ask it for any hit.
    #[inline(always)]
    fn any_hit<D, W>(&self, options: &QueryOptions, watch: W) -> AnyHit<D, W> {
        AnyHit::new(self.choice(options), watch)
    }
}

/// Where a hit is, and the ray in whose space that is.
pub(crate) struct Best<'m> {
    shown: Shown<'m>,
    ray: Ray,
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
