//! Many rays through one block: as one where they are alike, as a stream where they begin together, and else several in
//! flight; through a grid sixteen side by side.

mod flights;
mod packet;
mod stream;
mod walkers;
mod work;

use crate::block::bundle::Bundle;
use crate::block::{Block, Bundles, Finished, KIND_GRID};
use crate::kinds::{GRID, WIDE};
use crate::query::Query;
use crate::ray::{Alike, Hit, Ray};
use crate::simd::{self, Kernel, Simd};
use crate::trace::{Question, Together, ask};

/// Of blocks of fewer bytes, what rays visit mostly is in the cache, and single calls then wait for nothing that others could
/// use: with closest hits, and with any hits, which are over sooner.
const NEAR: [usize; 2] = [2 << 20, 16 << 20];
/// Of blocks of fewer bytes, so much is visited by all rays that they go together wherever they begin.
const SMALL: usize = 128 << 10;
/// Fewer rays through a grid are faster one by one: making place for sixteen takes as long as some five rays.
const MANY: usize = 64;
/// After packets that had better been a stream so many rays are one, whatever they are.
const AFTER_THIN: usize = 1024;
/// How far apart two rays begin that have nothing to do with each other, of the scene's largest coordinate.
const FAR: f32 = 1.0 / 64.0;
/// So many rays are looked at for that.
const LOOKED_AT: usize = 64;

/// What an answer is written down as.
pub(crate) trait Record<Answer> {
    fn of(answer: Answer) -> Self;
}

impl Record<Option<Hit>> for Hit {
    #[inline(always)]
    fn of(hit: Option<Hit>) -> Hit {
        hit.unwrap_or(Hit::MISS)
    }
}

impl Record<bool> for bool {
    #[inline(always)]
    fn of(occluded: bool) -> bool {
        occluded
    }
}

/// How rays are traced that are many.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Manner {
    /// By what is seen of them: as one where they are alike.
    AsTheyAre,
    /// As a stream.
    Stream,
    /// Several in flight.
    Flights,
}

/// Answers `question` for each ray; stops at the end of the shorter slice.
pub(crate) fn ask_all<'m, Q: Together<'m>, A: Record<Q::Answer>>(
    block: Finished<'m>,
    rays: &[Ray],
    answers: &mut [A],
    question: Q,
) {
    ask_in(Manner::AsTheyAre, block, rays, answers, question);
}

/// The same for rays of which more is known.
pub(crate) fn ask_in<'m, Q: Together<'m>, A: Record<Q::Answer>>(
    manner: Manner,
    block: Finished<'m>,
    rays: &[Ray],
    answers: &mut [A],
    question: Q,
) {
    // Only for the layout that is chosen automatically: others would be more copies of the code.
    let parts = &block.parts();
    let bundles = match parts.bundles {
        _ if rays.len() < 2 => return ask_each(block, rays, answers, question),
        Bundles::Sixteen(bundles) if WIDE => bundles,
        _ if GRID && parts.header.kind == KIND_GRID && rays.len() >= MANY => &[],
        _ => return ask_each(block, rays, answers, question),
    };
    simd::dispatch(Batch { block: parts, bundles, rays, answers, question, manner });
}

/// The same, one ray after the other.
pub(crate) fn ask_each<'m, Q: Question<'m> + Copy, A: Record<Q::Answer>>(
    block: Finished<'m>,
    rays: &[Ray],
    answers: &mut [A],
    question: Q,
) {
    for (ray, answer) in rays.iter().zip(answers) {
        *answer = A::of(ask(block, ray, question));
    }
}

/// Rays that ask the same question, and where their answers go.
struct Batch<'a, 'm, Q: Question<'m>, A> {
    block: &'a Block<'m>,
    /// None of a grid.
    bundles: &'m [Bundle<16>],
    rays: &'a [Ray],
    answers: &'a mut [A],
    question: Q,
    manner: Manner,
}

impl<'m, Q: Together<'m>, A: Record<Q::Answer>> Kernel for Batch<'_, 'm, Q, A> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(mut self, s: S) {
        if !S::FLIES {
            let Batch { block, rays, answers, question, .. } = self;
            return ask_each(block.whole, rays, answers, question);
        }
        if GRID && self.block.header.kind == KIND_GRID {
            return self.walk(s);
        }
        let count = self.rays.len().min(self.answers.len());
        let (mut first, mut room, mut thin) = (0, None, false);
        while first < count {
            let (manner, (alike, end)) = match thin {
                true => (Manner::Stream, (None, count.min(first + AFTER_THIN))),
                false => (self.manner, self.stretch(s, first, count)),
            };
            let part = Batch { manner, ..self.part(first, end) };
            first = end;
            thin = match alike {
                Some(alike) => {
                    let room = room.get_or_insert_with(|| packet::Room::new(alike));
                    part.trace_together(s, alike, room);
                    room.work.is_thin()
                }
                None => {
                    part.trace_apart(s);
                    false
                }
            };
        }
    }
}

impl<'m, Q: Question<'m> + Copy, A: Record<Q::Answer>> Batch<'_, 'm, Q, A> {
    /// Where the packet that begins with the ray `first` ends, or else where the next one begins.
    #[inline(always)]
    fn stretch<S: Simd>(&self, s: S, first: usize, count: usize) -> (Option<Alike>, usize) {
        let mut end = if self.manner == Manner::AsTheyAre { first } else { count };
        while end < count {
            let rays = &self.rays[end..count];
            if let Some((alike, length)) = Alike::first_of(s, rays, self.block.header.extent()) {
                return if end == first { (Some(alike), end + length) } else { (None, end) };
            }
            end = count.min(end + 16);
        }
        (None, end)
    }

    /// Traces rays that are not alike.
    #[inline(always)]
    fn trace_apart<S: Simd>(self, s: S) {
        let size = self.block.whole.bytes().len();
        if size < SMALL || self.had_better_stream() {
            self.stream(s);
        } else if size < NEAR[usize::from(!Q::Query::ORDERED)] {
            let Batch { block, rays, answers, question, .. } = self;
            ask_each(block.whole, rays, answers, question);
        } else {
            self.fly(s);
        }
    }

    /// Whether most rays begin near the one before, if nothing else is known of them.
    #[inline(always)]
    fn had_better_stream(&self) -> bool {
        if self.manner != Manner::AsTheyAre {
            return self.manner == Manner::Stream;
        }
        let far = FAR * self.block.header.reach;
        let (mut pairs, mut apart) = (0, 0);
        for pair in self.rays.windows(2).take(LOOKED_AT) {
            let mut most = 0f32;
            for k in 0..3 {
                most = most.max((pair[1].origin[k] - pair[0].origin[k]).abs());
            }
            pairs += 1;
            apart += usize::from(most > far);
        }
        2 * apart < pairs
    }

    /// The rays from `first` to `end`.
    #[inline(always)]
    fn part(&mut self, first: usize, end: usize) -> Batch<'_, 'm, Q, A> {
        let Batch { block, bundles, rays, question, manner, .. } = *self;
        let (rays, answers) = (&rays[first..end], &mut self.answers[first..end]);
        Batch { block, bundles, rays, answers, question, manner }
    }

    /// Writes the answer of a ray.
    #[inline(always)]
    fn write(&mut self, number: usize, answer: Q::Answer) {
        if let Some(place) = self.answers.get_mut(number) {
            *place = A::of(answer);
        }
    }

    /// Answers for a ray at the ends of the floats, or one that had no room.
    #[cold]
    #[inline(never)]
    fn answer_alone(&mut self, number: usize) {
        if let Some(ray) = self.rays.get(number) {
            let answer = ask(self.block.whole, ray, self.question);
            self.write(number, answer);
        }
    }
}
