//! Many rays through one block, several in flight: while the memory that one needs next is on its way, the
//! others go on.

use crate::block::bundle::{Bundle, ChildRef};
use crate::block::{Block, Bundles};
use crate::bvh::{Columns, Walk};
use crate::prim::Leaves;
use crate::query::Query;
use crate::ray::{NarrowSlab, PreparedRay, Ray, Slab};
use crate::simd::{self, Kernel, Simd, Width};
use crate::trace::{Question, ask};

/// So many rays are in flight: enough to hide the way to memory, few enough to stay in the first cache. 8 to 24 are
/// equally fast: see `docs/METHODS.md`.
const FLIGHTS: usize = 12;

/// Children that one of them may have to come back to. Nearly all rays need fewer; the others are traced
/// alone.
const ROOM: usize = 96;

/// Answers `question` for each ray, by `keep` into its answer; stops at the end of the shorter slice.
pub(crate) fn ask_all<Q: Question + Copy, A>(
    block: &Block,
    rays: &[Ray],
    answers: &mut [A],
    question: Q,
    keep: fn(Q::Answer) -> A,
) {
    // Only for the layout that is chosen automatically: others would be more copies of the code.
    match block.bundles {
        Bundles::Sixteen(bundles) if rays.len() > 1 => {
            simd::dispatch(AskAll { block, bundles, rays, answers, question, keep });
        }
        _ => ask_each(block, rays, answers, question, keep),
    }
}

/// The same, one ray after the other.
pub(crate) fn ask_each<Q: Question + Copy, A>(
    block: &Block,
    rays: &[Ray],
    answers: &mut [A],
    question: Q,
    keep: fn(Q::Answer) -> A,
) {
    for (ray, answer) in rays.iter().zip(answers) {
        *answer = keep(ask(block, ray, question));
    }
}

struct AskAll<'a, 'm, Q: Question, A> {
    block: &'a Block<'m>,
    bundles: &'m [Bundle<16>],
    rays: &'a [Ray],
    answers: &'a mut [A],
    question: Q,
    keep: fn(Q::Answer) -> A,
}

impl<Q: Question + Copy, A> Kernel for AskAll<'_, '_, Q, A> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, s: S) {
        if S::FLIES {
            self.fly(s);
        } else {
            let AskAll { block, rays, answers, question, keep, .. } = self;
            ask_each(block, rays, answers, question, keep);
        }
    }
}

/// A ray on its way, in a place of its own that it is made in: moving it would cost as much as a visit.
struct Flight<Q> {
    /// Which of the rays it is.
    number: usize,
    ray: PreparedRay,
    slab: NarrowSlab,
    /// `None` when there is no ray.
    query: Option<Q>,
}

impl<Q> Flight<Q> {
    const NONE: Self =
        Flight { number: 0, ray: PreparedRay::BLANK, slab: NarrowSlab::BLANK, query: None };
}

/// What a ray did when it was its turn.
enum Turn {
    GoesOn,
    Ended(bool),
    /// It has too many children to come back to.
    Crowded,
}

impl<Q: Question + Copy, A> AskAll<'_, '_, Q, A> {
    #[inline(always)]
    fn fly<S: Simd>(mut self, s: S) {
        let leaves = Leaves::of(self.block);
        let mut columns = [const { Columns::<ROOM>::UNWRITTEN }; FLIGHTS];
        let mut walks = columns.each_mut().map(|columns| Walk::new(columns, 0.0));
        let mut flights = [const { Flight::<Q::Query>::NONE }; FLIGHTS];
        let mut next = 0;
        let mut aloft = 0;
        for (flight, walk) in flights.iter_mut().zip(&mut walks) {
            aloft += usize::from(self.take_off(s, &mut next, flight, walk));
        }
        while aloft > 0 {
            for (flight, walk) in flights.iter_mut().zip(&mut walks) {
                let Flight { number, ray, slab, query: Some(query) } = flight else { continue };
                let turn = turn(s, walk, self.bundles, &leaves, ray, slab, query);
                if matches!(turn, Turn::GoesOn) {
                    continue;
                }
                self.land(*number, ray, query, turn);
                aloft -= usize::from(!self.take_off(s, &mut next, flight, walk));
            }
        }
    }

    /// Starts the next ray that can hit something; false when there is none.
    #[inline(always)]
    fn take_off<S: Simd>(
        &mut self,
        s: S,
        next: &mut usize,
        flight: &mut Flight<Q::Query>,
        walk: &mut Walk<ROOM>,
    ) -> bool {
        while let (Some(given), Some(answer)) = (self.rays.get(*next), self.answers.get_mut(*next))
        {
            flight.number = *next;
            *next += 1;
            let Some((ray, slab)) = given.prepare_with(s, self.block.header.reach) else {
                *answer = (self.keep)(alone(self.block, given, self.question));
                continue;
            };
            let query = self.question.query(&ray);
            walk.restart(query.t_bound());
            flight.query = Some(query);
            flight.slab = slab;
            flight.ray = ray;
            return true;
        }
        flight.query = None;
        false
    }

    /// Writes the answer of a ray whose way has ended.
    #[inline(always)]
    fn land(&mut self, number: usize, ray: &PreparedRay, query: &mut Q::Query, turn: Turn) {
        let answer = match (turn, self.rays.get(number)) {
            (Turn::Crowded, Some(ray)) => alone(self.block, ray, self.question),
            (turn, _) => Q::answer(self.block, ray, query, matches!(turn, Turn::Ended(true))),
        };
        if let Some(place) = self.answers.get_mut(number) {
            *place = (self.keep)(answer);
        }
    }
}

/// A ray at the ends of the floats, or one that had no room in flight.
#[cold]
#[inline(never)]
fn alone<Q: Question>(block: &Block, ray: &Ray, question: Q) -> Q::Answer {
    ask(block, ray, question)
}

/// Visits one bundle or one leaf, and has the next fetched.
#[inline(always)]
fn turn<S: Simd, Q: Query>(
    s: S,
    walk: &mut Walk<ROOM>,
    bundles: &[Bundle<16>],
    leaves: &Leaves,
    ray: &PreparedRay,
    slab: &NarrowSlab,
    query: &mut Q,
) -> Turn {
    if !walk.at().is_leaf() {
        let Some(bundle) = bundles.get(walk.at().bundle_number()) else {
            return Turn::Ended(false);
        };
        let t_bounds = Width::<16>::splat(s, walk.t_bound());
        if !walk.enter(s, bundle, &slab.wide::<S, 16>(s), t_bounds, query) {
            return Turn::Crowded;
        }
    } else if walk.open(s, leaves, ray, query) {
        return Turn::Ended(true);
    }
    let next = walk.at();
    if !next.is_leaf() {
        if let Some(bundle) = bundles.get(next.bundle_number()) {
            s.prefetch(bundle);
        }
    } else if next == ChildRef::NONE {
        return Turn::Ended(false);
    } else {
        leaves.prefetch(s, next.leaf_block());
    }
    Turn::GoesOn
}
