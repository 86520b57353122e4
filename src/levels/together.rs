//! Many rays through a block with instances: those that come to the same instance next are a batch in its object space.
//!
//! The rays of a chunk [find](Gather) the instances that they come to. Then all go to the nearest that is left for each, those for
//! the same one together, up to the best hit so far, until none has anywhere to go. So everything that makes batches fast, rays
//! that are alike traced as one and others while memory is waited for, works in instances as it does without.

use super::stops::{CHUNK, Gather, Stops};
use super::{Best, Shown, any, closest};
use crate::batch::{self, Record};
use crate::block::Finished;
use crate::block::level::Level;
use crate::query::{Choice, Exact, QueryOptions};
use crate::ray::{Hit, NONE, Ray};
use crate::simd;
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

    fn question(choice: Choice) -> Self::Question;

    /// Up to where a ray with this answer has something to look for, if at all.
    fn limit(answer: &Self::Answer, ray: &Ray) -> Option<f32>;

    /// Takes in what a ray met in an instance.
    fn take(chunk: &Chunk, ray: &Ray, instance: u32, met: Self::Answer, answer: &mut Self::Answer);

    fn alone(block: Finished, ray: &Ray, options: &QueryOptions) -> Self::Answer;
}

/// The closest hit.
struct Nearest;

impl Asked for Nearest {
    type Met = Option<Hit>;
    type Answer = Hit;
    type Question = ClosestHit<Exact, (), 0>;
    const NOTHING: Hit = Hit::MISS;

    fn question(choice: Choice) -> Self::Question {
        ClosestHit::new(choice, ())
    }

    fn limit(answer: &Hit, ray: &Ray) -> Option<f32> {
        let above = answer.t.next_up();
        Some(if above < ray.t_max { above } else { ray.t_max })
    }

    fn take(chunk: &Chunk, ray: &Ray, instance: u32, met: Hit, answer: &mut Hit) {
        let met = Hit { instance, ..met };
        if met.t < answer.t || met.t == answer.t && chunk.is_before(ray, &met, answer) {
            *answer = met;
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

    fn question(choice: Choice) -> Self::Question {
        AnyHit::new(choice, ())
    }

    fn limit(answer: &bool, ray: &Ray) -> Option<f32> {
        (!answer).then_some(ray.t_max)
    }

    fn take(_: &Chunk, _: &Ray, _: u32, met: bool, answer: &mut bool) {
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
    for (rays, answers) in rays.chunks(CHUNK).zip(answers.chunks_mut(CHUNK)) {
        let count = rays.len().min(answers.len());
        Chunk { block, level, options }.ask::<A>(&rays[..count], &mut answers[..count]);
    }
}

/// Where the rays of a chunk are traced.
struct Chunk<'a, 'm> {
    block: Finished<'m>,
    level: &'a Level<'m>,
    options: &'a QueryOptions,
}

impl Chunk<'_, '_> {
    /// Answers for up to [`CHUNK`] rays.
    fn ask<A: Asked>(&self, rays: &[Ray], answers: &mut [A::Answer]) {
        answers.fill(A::NOTHING);
        let own = Shown::own(self.block);
        if !own.is_empty() {
            batch::ask_all(own.block, rays, answers, A::question(own.choice(self.options)));
        }
        let mut limited = [Ray::new([0.0; 3], [0.0; 3]); CHUNK];
        let limited = &mut limited[..rays.len()];
        limited.copy_from_slice(rays);
        set_limits::<A>(rays, answers, limited);
        let mut stops = [Stops::NONE; CHUNK];
        if !simd::dispatch(Gather { level: self.level, rays: limited, stops: &mut stops }) {
            return self.ask_alone::<A>(rays, answers, |_, _| true);
        }
        let mut room = Room {
            there: [Ray::new([0.0; 3], [0.0; 3]); CHUNK],
            who: [0; CHUNK],
            met: [A::NOTHING; CHUNK],
        };
        let mut turns = [Turn { instance: NONE, ray: 0 }; CHUNK];
        loop {
            set_limits::<A>(rays, answers, limited);
            let turns = next_turns::<A>(answers, limited, &mut stops, &mut turns);
            if turns.is_empty() {
                break;
            }
            for turns in turns.chunk_by(|a, b| a.instance == b.instance) {
                self.visit::<A>(turns, limited, &mut room, answers);
            }
        }
        self.ask_alone::<A>(rays, answers, |i, limit| !stops[i].are_all(limit));
    }

    /// Asks an instance about all rays whose turn it is.
    fn visit<A: Asked>(
        &self,
        turns: &[Turn],
        rays: &[Ray],
        room: &mut Room<A::Answer>,
        answers: &mut [A::Answer],
    ) {
        let Some(first) = turns.first() else { return };
        let shown = Shown::of(self.level, first.instance, self.options);
        let Some((shown, record)) = shown.filter(|(shown, _)| !shown.is_empty()) else { return };
        let Room { there, who, met } = room;
        let mut count = 0;
        for turn in turns {
            if let Some(ray) = record.object_ray(&rays[turn.ray]) {
                (there[count], who[count]) = (ray, turn.ray);
                count += 1;
            }
        }
        let (there, met) = (&there[..count], &mut met[..count]);
        let question = A::question(shown.choice(self.options));
        if count < FEW {
            batch::ask_each(shown.block, there, met, question);
        } else {
            batch::ask_apart(shown.block, there, met, question);
        }
        for (met, i) in met.iter().zip(who) {
            A::take(self, &rays[*i], first.instance, *met, &mut answers[*i]);
        }
    }

    /// Answers anew for each ray that has something to look for and of which `wanted` says so.
    fn ask_alone<A: Asked>(
        &self,
        rays: &[Ray],
        answers: &mut [A::Answer],
        wanted: impl Fn(usize, f32) -> bool,
    ) {
        for (i, (ray, answer)) in rays.iter().zip(answers).enumerate() {
            if A::limit(answer, ray).is_some_and(|limit| wanted(i, limit)) {
                *answer = A::alone(self.block, ray, self.options);
            }
        }
    }

    /// Whether of two hits at one rounded `t` the first comes before the second.
    #[cold]
    fn is_before(&self, ray: &Ray, hit: &Hit, other: &Hit) -> bool {
        let both = self.best(ray, hit).zip(self.best(ray, other));
        both.is_some_and(|(hit, other)| hit.is_before::<Exact>(&other, self.options))
    }

    fn best(&self, ray: &Ray, hit: &Hit) -> Option<Best<'_>> {
        if hit.instance == NONE {
            return (hit.prim != NONE).then(|| Best { hit: *hit, shown: Shown::own(self.block), ray: *ray });
        }
        let (shown, record) = Shown::of(self.level, hit.instance, self.options)?;
        Some(Best { hit: *hit, shown, ray: record.object_ray(ray)? })
    }
}

/// Room for the rays of one instance.
struct Room<Answer> {
    there: [Ray; CHUNK],
    /// Which of the chunk they are.
    who: [usize; CHUNK],
    met: [Answer; CHUNK],
}

/// A ray and the instance that it goes to.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Turn {
    instance: u32,
    ray: usize,
}

fn set_limits<A: Asked>(rays: &[Ray], answers: &[A::Answer], limited: &mut [Ray]) {
    for ((ray, answer), limited) in rays.iter().zip(answers).zip(limited) {
        limited.t_max = A::limit(answer, ray).unwrap_or(f32::NEG_INFINITY);
    }
}

/// Where each ray goes that has somewhere to go, by instance.
fn next_turns<'t, A: Asked>(
    answers: &[A::Answer],
    rays: &[Ray],
    stops: &mut [Stops; CHUNK],
    turns: &'t mut [Turn; CHUNK],
) -> &'t [Turn] {
    let mut count = 0;
    for (i, ((ray, answer), stops)) in rays.iter().zip(answers).zip(stops).enumerate() {
        if A::limit(answer, ray).is_some()
            && let Some(instance) = stops.next(ray.t_max)
        {
            turns[count] = Turn { instance, ray: i };
            count += 1;
        }
    }
    let turns = &mut turns[..count];
    turns.sort_unstable();
    turns
}
