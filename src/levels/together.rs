//! Many rays through a block with instances: those that come to the same instance next are a batch in its object space.
//!
//! The rays of a chunk [find](Gather) the instances that they come to. Then all go to the nearest that is left for each, those for
//! the same one together, up to the best hit so far, until none has anywhere to go. So everything that makes batches fast, rays
//! that are alike traced as one and others while memory is waited for, works in instances as it does without.

use super::stops::{CHUNK, Gather, Stops};
use super::{Best, Shown, any, closest};
use crate::batch::{self, Manner, Record};
use crate::block::Finished;
use crate::block::level::{InstanceRecord, Level};
use crate::query::{Choice, Exact, QueryOptions};
use crate::ray::{Hit, NONE, Ray};
use crate::simd;
use crate::trace::{AnyHit, ClosestHit, Together};

/// So few rays are asked for one by one.
const FEW: usize = 4;

/// So many pairs of neighbours are looked at.
const LOOKED_AT: usize = 12;
/// Rays that pass this near each other, of the child's largest coordinate, meet much the same of it.
const CLOSE: f32 = 1.0 / 700.0;
/// Directions that differ less, of their largest component, are alike.
const ALIKE: f32 = 1.0 / 8.0;

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
    /// Neighbours that pass further from each other, of the child's largest coordinate, are no stream.
    const FAR: f32;

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
    const FAR: f32 = 1.0 / 64.0;

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
    const FAR: f32 = f32::INFINITY;

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

impl<'m> Chunk<'_, 'm> {
    /// Answers for up to [`CHUNK`] rays.
    fn ask<A: Asked>(&self, rays: &[Ray], answers: &mut [A::Answer]) {
        answers.fill(A::NOTHING);
        let own = Shown::own(self.block);
        if !own.is_empty() {
            batch::ask_all(own.block, rays, answers, A::question(own.choice(self.options)));
        }
        let (mut limited, mut stops) = ([NO_RAY; CHUNK], [Stops::NONE; CHUNK]);
        let limited = &mut limited[..rays.len()];
        limited.copy_from_slice(rays);
        set_limits::<A>(rays, answers, limited);
        if !simd::dispatch(Gather { level: self.level, rays: limited, stops: &mut stops }) {
            return self.ask_alone::<A>(rays, answers, |_, _| true);
        }
        let (mut turns, mut room) = ([Turn::NONE; CHUNK], Room::new::<A>());
        loop {
            let count = self.take_turns::<A>(answers, limited, &mut stops, &mut turns);
            if count == 0 {
                break;
            }
            for turns in turns[..count].chunk_by(|a, b| self.go_together(a, b)) {
                self.visit::<A>(turns, limited, &mut room, answers);
            }
            set_limits::<A>(rays, answers, limited);
        }
        self.ask_alone::<A>(rays, answers, |i, limit| !stops[i].are_all(limit));
    }

    /// Finds where each ray goes that has somewhere to go, by child and instance; returns how many these are.
    fn take_turns<A: Asked>(
        &self,
        answers: &[A::Answer],
        rays: &[Ray],
        stops: &mut [Stops; CHUNK],
        turns: &mut [Turn; CHUNK],
    ) -> usize {
        let mut count = 0;
        for (i, ((ray, answer), stops)) in rays.iter().zip(answers).zip(stops).enumerate() {
            if A::limit(answer, ray).is_none() {
                continue;
            }
            while let Some(instance) = stops.next(ray.t_max) {
                if let Some((_, record)) = Shown::of(self.level, instance, self.options) {
                    turns[count] = Turn { child: record.child, instance, ray: i as u32 };
                    count += 1;
                    break;
                }
            }
        }
        turns[..count].sort_unstable();
        count
    }

    /// Whether the same question is asked of the same block.
    fn go_together(&self, a: &Turn, b: &Turn) -> bool {
        let alike = a.instance == b.instance || self.options.skip.is_none();
        a.child == b.child && alike
    }

    /// Asks a child about rays in its space: all for whom it is the same question.
    fn visit<A: Asked>(
        &self,
        turns: &[Turn],
        rays: &[Ray],
        room: &mut Room<A::Answer>,
        answers: &mut [A::Answer],
    ) {
        let first = turns.first().and_then(|turn| self.shown(turn.instance));
        let Some((shown, _)) = first else { return };
        let Room { there, who, met } = room;
        let mut count = 0;
        for turn in turns {
            let ray = &rays[turn.ray as usize];
            if let Some(ray) = self.shown(turn.instance).and_then(|(_, at)| at.object_ray(ray)) {
                (there[count], who[count]) = (ray, *turn);
                count += 1;
            }
        }
        let (there, met) = (&there[..count], &mut met[..count]);
        let question = A::question(shown.choice(self.options));
        if count < FEW {
            batch::ask_each(shown.block, there, met, question);
        } else {
            let manner = manner_of::<A>(shown.block, there, who);
            batch::ask_in(manner, shown.block, there, met, question);
        }
        for (met, turn) in met.iter().zip(who) {
            let i = turn.ray as usize;
            A::take(self, &rays[i], turn.instance, *met, &mut answers[i]);
        }
    }

    fn shown(&self, instance: u32) -> Option<(Shown<'m>, &'m InstanceRecord)> {
        Shown::of(self.level, instance, self.options)
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

    fn best(&self, ray: &Ray, hit: &Hit) -> Option<Best<'m>> {
        if hit.instance == NONE {
            let own = Best { hit: *hit, shown: Shown::own(self.block), ray: *ray };
            return (hit.prim != NONE).then_some(own);
        }
        let (shown, record) = self.shown(hit.instance)?;
        Some(Best { hit: *hit, shown, ray: record.object_ray(ray)? })
    }
}

/// How a child had better be asked about these rays.
///
/// Where rays begin says little here: those of a camera begin at one point, and come to a small instance as far apart as any.
fn manner_of<A: Asked>(child: Finished, rays: &[Ray], turns: &[Turn]) -> Manner {
    let header = child.header();
    let middle = [0, 1, 2].map(|k| 0.5 * (header.bounds.lower[k] + header.bounds.upper[k]));
    let (mut pairs, mut apart, mut sum) = (0, 0, 0.0);
    for (rays, turns) in rays.windows(2).zip(turns.windows(2)).take(LOOKED_AT) {
        let distance = largest_difference(passing(&rays[0], middle), passing(&rays[1], middle));
        let same = turns[0].instance == turns[1].instance;
        let [a, b] = [0, 1].map(|i| rays[i].direction);
        let alike = same && largest_difference(a, b) < ALIKE * largest_difference(a, [0.0; 3]);
        pairs += 1;
        sum += if alike { distance } else { f32::INFINITY };
        apart += usize::from(!(alike && distance < A::FAR * header.reach));
    }
    match () {
        () if sum < CLOSE * header.reach * pairs as f32 => Manner::AsTheyAre,
        () if 2 * apart < pairs => Manner::Stream,
        () => Manner::Flights,
    }
}

/// Where the line of a ray is nearest to a point, or nearly.
fn passing(ray: &Ray, point: [f32; 3]) -> [f32; 3] {
    let Ray { origin: o, direction: d, .. } = *ray;
    let dot = |v: [f32; 3]| v[0] * d[0] + v[1] * d[1] + v[2] * d[2];
    let t = dot([point[0] - o[0], point[1] - o[1], point[2] - o[2]]) / dot(d);
    [o[0] + t * d[0], o[1] + t * d[1], o[2] + t * d[2]]
}

fn largest_difference(a: [f32; 3], b: [f32; 3]) -> f32 {
    (0..3).fold(0.0, |largest, k| f32::max(largest, (b[k] - a[k]).abs()))
}

const NO_RAY: Ray = Ray::new([0.0; 3], [0.0; 3]);

/// A ray and the instance that it goes to, which shows a child.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Turn {
    child: u32,
    instance: u32,
    ray: u32,
}

impl Turn {
    const NONE: Self = Turn { child: 0, instance: NONE, ray: 0 };
}

/// Room for the rays that a child is asked about.
struct Room<Answer> {
    there: [Ray; CHUNK],
    who: [Turn; CHUNK],
    met: [Answer; CHUNK],
}

impl<Answer> Room<Answer> {
    fn new<A: Asked<Answer = Answer>>() -> Self {
        Room { there: [NO_RAY; CHUNK], who: [Turn::NONE; CHUNK], met: [A::NOTHING; CHUNK] }
    }
}

fn set_limits<A: Asked>(rays: &[Ray], answers: &[A::Answer], limited: &mut [Ray]) {
    for ((ray, answer), limited) in rays.iter().zip(answers).zip(limited) {
        limited.t_max = A::limit(answer, ray).unwrap_or(f32::NEG_INFINITY);
    }
}
