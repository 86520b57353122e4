//! Several rays in flight.

use super::{Batch, Record};
use crate::block::bundle::{Bundle, ChildRef};
use crate::bvh::{Columns, Walk};
use crate::prim::Leaves;
use crate::query::Query;
use crate::ray::{NarrowSlab, PreparedRay, Slab};
use crate::simd::{Simd, Width};
use crate::trace::Question;

/// So many rays are in flight: enough to hide the way to memory, few enough to stay in the first cache. 8 to 24 are
/// equally fast: see `docs/METHODS.md`.
const FLIGHTS: usize = 12;

/// Children that one of them may have to come back to. Nearly all rays need fewer; the others are traced
/// alone.
const ROOM: usize = 96;

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

impl<'m, Q: Question<'m> + Copy, A: Record<Q::Answer>> Batch<'_, 'm, Q, A> {
    /// Traces rays that have little in common: while the memory that one needs next is on its way, the others go on.
    #[inline(always)]
    pub(super) fn fly<S: Simd>(mut self, s: S) {
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
                if let Turn::Ended(ended) = turn {
                    self.write(*number, Q::answer(s, self.block.whole, ray, query, ended));
                } else {
                    self.answer_alone(*number);
                }
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
        while let Some(given) = self.rays.get(*next) {
            flight.number = *next;
            *next += 1;
            let Some((ray, slab)) = given.prepare_with(s, self.block.header.extent()) else {
                self.answer_alone(flight.number);
                continue;
            };
            let query = self.question.query(self.block.whole, ray.t_max);
            walk.restart(query.t_bound());
            flight.query = Some(query);
            flight.slab = slab;
            flight.ray = ray;
            return true;
        }
        flight.query = None;
        false
    }
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
        if !walk.enter::<S, Q, 16>(s, bundle, &slab.wide::<S, 16>(s), t_bounds) {
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
