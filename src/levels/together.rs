//! Many rays through a block with instances: those that come to the same instance next are a batch in its object space.
//!
//! The rays of a chunk [find](Gather) the instances that they come to. Then all go to the nearest that is left for each, those for
//! the same one together, up to the best hit so far, until none has anywhere to go. So everything that makes batches fast, rays
//! that are alike traced as one and others while memory is waited for, works in instances as it does without.

use core::{iter, mem, slice};

use super::manner::{are_small, are_unlike, manner_of};
use super::stops::{CHUNK, Gather, Stops};
use super::{Shown, World, any, closest};
use crate::batch::{self, Record};
use crate::block::Finished;
use crate::block::level::InstanceRecord;
use crate::query::{Choice, Exact, QueryOptions};
use crate::ray::{Hit, NONE, Ray};
use crate::simd::{self, Kernel, SMALL, Simd};
use crate::trace::{AnyHit, ClosestHit, Together};

/// So few rays are asked for one by one.
const FEW: usize = 4;

/// The exact closest hit of each ray in a block with instances, [`Hit::MISS`] without one. Stops at the end of the shorter
/// slice.
pub(crate) fn closest_of_each(
    block: Finished,
    rays: &[Ray],
    options: &QueryOptions,
    hits: &mut [Hit],
) {
    of_each::<Nearest>(block, rays, options, hits);
}

/// Whether each ray hits anything, exactly, in a block with instances. Stops at the end of the shorter slice.
pub(crate) fn any_of_each(
    block: Finished,
    rays: &[Ray],
    options: &QueryOptions,
    occluded: &mut [bool],
) {
    of_each::<Whether>(block, rays, options, occluded);
}

/// What is asked of all rays, and how the answers of instances become one.
trait Asked {
    type Met;
    type Answer: Record<Self::Met> + Copy;
    type Question: for<'m> Together<'m, Answer = Self::Met>;
    const NOTHING: Self::Answer;
    /// Neighbours that pass further from each other, of the child's size, are no stream.
    const FAR: f32;

    fn question(choice: Choice) -> Self::Question;

    /// Up to where a ray with this answer has something to look for, if at all.
    fn limit(answer: &Self::Answer, ray: &Ray) -> Option<f32>;

    /// Takes in what a ray met in an instance.
    fn take(world: &World, ray: &Ray, instance: u32, met: Self::Answer, answer: &mut Self::Answer);

    fn alone(block: Finished, ray: &Ray, options: &QueryOptions) -> Self::Answer;
}

/// The closest hit.
struct Nearest;

impl Asked for Nearest {
    type Met = Option<Hit>;
    type Answer = Hit;
    type Question = ClosestHit<Exact, (), 0>;
    const NOTHING: Hit = Hit::MISS;
    const FAR: f32 = 1.0 / 64.0;

    fn question(choice: Choice) -> Self::Question {
        ClosestHit::new(choice, ())
    }

    fn limit(answer: &Hit, ray: &Ray) -> Option<f32> {
        let above = answer.t.next_up();
        Some(if above < ray.t_max { above } else { ray.t_max })
    }

    fn take(world: &World, ray: &Ray, instance: u32, met: Hit, answer: &mut Hit) {
        let hit = Hit { instance, ..met };
        if hit.prim != NONE && world.is_before::<Exact>(ray, &hit, answer) {
            *answer = hit;
        }
    }

    fn alone(block: Finished, ray: &Ray, options: &QueryOptions) -> Hit {
        closest::<Exact, _>(block, ray, options, ()).unwrap_or(Hit::MISS)
    }
}

/// Whether there is a hit.
struct Whether;

impl Asked for Whether {
    type Met = bool;
    type Answer = bool;
    type Question = AnyHit<Exact, ()>;
    const NOTHING: bool = false;
    const FAR: f32 = f32::INFINITY;

    fn question(choice: Choice) -> Self::Question {
        AnyHit::new(choice, ())
    }

    fn limit(answer: &bool, ray: &Ray) -> Option<f32> {
        (!answer).then_some(ray.t_max)
    }

    fn take(_: &World, _: &Ray, _: u32, met: bool, answer: &mut bool) {
        *answer |= met;
    }

    fn alone(block: Finished, ray: &Ray, options: &QueryOptions) -> bool {
        any::<Exact, _>(block, ray, options, ())
    }
}

fn of_each<A: Asked>(
    block: Finished,
    rays: &[Ray],
    options: &QueryOptions,
    answers: &mut [A::Answer],
) {
    let Some(level) = &block.level() else { return };
    let chunk = Chunk(World::new(block, level, options));
    // What cannot be is not linked.
    let flies = !SMALL && simd::dispatch(Flies);
    let cached = are_small(level);
    // What is behind the shorter slice stays as it is.
    let count = rays.len().min(answers.len());
    let (rays, answers) = (&rays[..count], &mut answers[..count]);
    for (rays, answers) in rays.chunks(CHUNK).zip(answers.chunks_mut(CHUNK)) {
        if flies && !(cached && are_unlike(rays)) {
            chunk.ask::<A>(rays, answers);
        } else {
            answers.fill(A::NOTHING);
            chunk.ask_alone::<A>(rays, answers, |_| true);
        }
    }
}

/// Whether [batches](batch) are more than one ray after the other.
struct Flies;

impl Kernel for Flies {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self, _: S) -> bool {
        S::FLIES
    }
}

/// Where the rays of a chunk are traced.
struct Chunk<'a, 'm>(World<'a, 'm>);

impl<'m> Chunk<'_, 'm> {
    /// Answers for up to [`CHUNK`] rays, as many as both slices have.
    ///
    /// Out of line: it takes room on the stack that one ray after the other does not. That is 20 kB: for each ray where it stops,
    /// 72 bytes, the ray in the world and in an instance, 32 each, whose it is, 8, and two answers.
    #[inline(never)]
    fn ask<A: Asked>(&self, rays: &[Ray], answers: &mut [A::Answer]) {
        let count = rays.len().min(answers.len()).min(CHUNK);
        let (rays, answers) = (&rays[..count], &mut answers[..count]);
        answers.fill(A::NOTHING);
        let World { block, level, options, .. } = self.0;
        let own = Shown::own(block);
        if !own.is_empty() {
            batch::ask_all(own.block, rays, answers, A::question(own.choice(options)));
        }
        let mut limited = [NO_RAY; CHUNK];
        let limited = &mut limited[..count];
        limit::<A>(rays, answers, limited);
        let mut stops = [Stops::NONE; CHUNK];
        simd::dispatch(Gather { level, rays: limited, stops: &mut stops });
        let (mut turns, mut room) = ([NONE; CHUNK], Room::new::<A>());
        while self.take_turns(limited, &mut stops, &mut turns) {
            while self.visit::<A>(&mut turns, limited, &mut room, answers) {}
            limit::<A>(rays, answers, limited);
        }
        for ((ray, answer), stops) in rays.iter().zip(answers).zip(&stops) {
            self.ask_alone::<A>(slice::from_ref(ray), slice::from_mut(answer), |limit| {
                !stops.are_all(limit)
            });
        }
    }

    /// Finds the instance that each ray goes to next, [`NONE`] for those that have nowhere to go; whether any goes.
    fn take_turns(
        &self,
        rays: &[Ray],
        stops: &mut [Stops; CHUNK],
        turns: &mut [u32; CHUNK],
    ) -> bool {
        let mut any = false;
        for ((ray, stops), turn) in rays.iter().zip(stops).zip(turns) {
            let seen = |instance: &u32| self.0.shown(*instance).is_some();
            *turn = iter::from_fn(|| stops.next(ray.t_max)).find(seen).unwrap_or(NONE);
            any |= *turn != NONE;
        }
        any
    }

    /// Asks the child that the first ray goes to about all rays in its space for which that is the same question; their turns
    /// are over. False if none goes anywhere.
    fn visit<A: Asked>(
        &self,
        turns: &mut [u32; CHUNK],
        given: &[Ray],
        room: &mut Room<A::Answer>,
        answers: &mut [A::Answer],
    ) -> bool {
        let first = turns.iter().copied().find(|turn| *turn != NONE);
        let Some((shown, of_first)) = first.and_then(|instance| self.0.shown(instance)) else {
            return false;
        };
        let goes_along = |instance: u32, record: &InstanceRecord| {
            let alike = shown.instance == instance || self.0.options.skip.is_none();
            record.child == of_first.child && alike
        };
        let mut count = 0;
        for (i, (ray, turn)) in given.iter().zip(turns).enumerate() {
            let place = self.0.shown(*turn).filter(|(_, record)| goes_along(*turn, record));
            let Some((_, record)) = place else { continue };
            let instance = mem::replace(turn, NONE);
            if let Some(ray) = record.object_ray(ray) {
                (room.rays[count], room.who[count]) = (ray, Traveller { instance, ray: i as u32 });
                count += 1;
            }
        }
        let (rays, who) = (&room.rays[..count], &room.who[..count]);
        let met = &mut room.met[..count];
        self.ask_child::<A>(&shown, rays, who, met);
        for (met, who) in met.iter().zip(who) {
            let i = who.ray as usize;
            A::take(&self.0, &given[i], who.instance, *met, &mut answers[i]);
        }
        true
    }

    /// Asks a child about rays in its space.
    fn ask_child<A: Asked>(
        &self,
        shown: &Shown,
        rays: &[Ray],
        who: &[Traveller],
        met: &mut [A::Answer],
    ) {
        let question = A::question(shown.choice(self.0.options));
        if rays.len() < FEW {
            batch::ask_each(shown.block, rays, met, question);
        } else {
            let manner = manner_of(shown.block, rays, who, A::FAR);
            batch::ask_in(manner, shown.block, rays, met, question);
        }
    }

    /// Answers for each ray by itself if it has something to look for up to a limit of which `wanted` says so.
    fn ask_alone<A: Asked>(
        &self,
        rays: &[Ray],
        answers: &mut [A::Answer],
        wanted: impl Fn(f32) -> bool,
    ) {
        for (ray, answer) in rays.iter().zip(answers) {
            if A::limit(answer, ray).is_some_and(&wanted) {
                *answer = A::alone(self.0.block, ray, self.0.options);
            }
        }
    }
}

const NO_RAY: Ray = Ray::new([0.0; 3], [0.0; 3]);

/// Which ray of a chunk one is in the space of an instance, and of which.
#[derive(Clone, Copy)]
pub(super) struct Traveller {
    pub instance: u32,
    pub ray: u32,
}

/// Room for the rays that a child is asked about.
struct Room<Answer> {
    rays: [Ray; CHUNK],
    who: [Traveller; CHUNK],
    met: [Answer; CHUNK],
}

impl<Answer> Room<Answer> {
    fn new<A: Asked<Answer = Answer>>() -> Self {
        let who = [Traveller { instance: NONE, ray: 0 }; CHUNK];
        Room { rays: [NO_RAY; CHUNK], who, met: [A::NOTHING; CHUNK] }
    }
}

/// Limits rays to what they still look for.
fn limit<A: Asked>(rays: &[Ray], answers: &[A::Answer], limited: &mut [Ray]) {
    for ((ray, answer), limited) in rays.iter().zip(answers).zip(limited) {
        // None is hit by a ray that ends before it begins.
        let t_max = A::limit(answer, ray).unwrap_or(f32::NEG_INFINITY);
        *limited = Ray { t_max, ..*ray };
    }
}
