//! Rays through a grid, sixteen side by side, each on a way of its own.
//!
//! What is computed for cells is computed for all of them at once; what is listed in cells is looked at ray by ray. A ray whose
//! search is over makes place for the next. Each ray comes to the cells that it would come to alone.

use super::{Batch, Record};
use crate::block::Block;
use crate::grid::{Cells, Entry, Found, Walks, Way, from_afar, visit};
use crate::math::Bits;
use crate::prim::Leaves;
use crate::query::Query;
use crate::ray::{NarrowSlab, PreparedRay};
use crate::simd::Simd;
use crate::trace::Question;

/// A ray on its way, in a place of its own that it is made in.
struct Walker<Q> {
    /// Which of the rays it is.
    number: usize,
    ray: PreparedRay,
    slab: NarrowSlab,
    query: Option<Q>,
    /// How many of the outermost grids it has come to.
    grids: usize,
}

impl<Q> Walker<Q> {
    const NONE: Self = Walker {
        number: 0,
        ray: PreparedRay::BLANK,
        slab: NarrowSlab::BLANK,
        query: None,
        grids: 0,
    };
}

/// How a search goes on.
enum Turn<S: Simd> {
    Walks(Way<S>),
    Ended(bool),
}

impl<Q: Query> Walker<Q> {
    /// Comes into the next outermost grid that is not over at once.
    #[inline(always)]
    fn arrive<S: Simd>(&mut self, s: S, cells: &Cells) -> Turn<S> {
        let Walker { ray, slab, query: Some(query), grids, .. } = self else {
            return Turn::Ended(false);
        };
        while let Some(head) = cells.grids.get(*grids) {
            *grids += 1;
            let ended = match Way::into(s, cells, head, ray, slab, query.t_bound()) {
                Entry::Beside => false,
                Entry::Listed(listed) => visit(s, cells, listed, ray, slab, query),
                Entry::Afar => return Turn::Ended(from_afar(cells, ray, query)),
                Entry::Way(way) => return Turn::Walks(way),
            };
            if ended {
                return Turn::Ended(true);
            }
        }
        Turn::Ended(false)
    }
}

/// Rays on their way, and those that wait for their turn.
struct Walkers<'a, 'm, Q: Question<'m>, A, S: Simd> {
    batch: Batch<'a, 'm, Q, A>,
    cells: Cells<'m>,
    walkers: [Walker<Q::Query>; 16],
    walks: Walks<S>,
    /// The first ray that was not taken up yet.
    next: usize,
    /// Whose search goes on: one bit each.
    going: u32,
}

impl<'m, Q: Question<'m> + Copy, A: Record<Q::Answer>> Batch<'_, 'm, Q, A> {
    /// Traces rays through a grid.
    #[inline(always)]
    pub(super) fn walk<S: Simd>(mut self, s: S) {
        let leaves = Leaves::of(self.block);
        let Block { grids, words, runs, .. } = *self.block;
        let count = self.rays.len().min(self.answers.len());
        let mut walkers = Walkers {
            batch: self.part(0, count),
            cells: Cells { grids, words, runs, leaves },
            walkers: [const { Walker::NONE }; 16],
            walks: Walks::NOWHERE,
            next: 0,
            going: 0,
        };
        for lane in 0..16 {
            walkers.take_up(s, lane);
        }
        while walkers.going != 0 {
            walkers.go_on(s);
        }
    }
}

impl<'m, Q: Question<'m> + Copy, A: Record<Q::Answer>, S: Simd> Walkers<'_, 'm, Q, A, S> {
    /// Each ray looks at its cell and what is in it, and goes on to the next.
    #[inline(always)]
    fn go_on(&mut self, s: S) {
        let found = self.walks.look(s, &self.cells, self.going);
        let mut ended = 0;
        for lane in Bits(found.listed) {
            ended |= u32::from(self.visit(s, &found, lane)) << lane;
        }
        for lane in Bits(found.grids) {
            self.walks.enter(s, &self.cells, &found, lane);
        }
        let moves = self.going & !found.grids & !ended;
        let goes = self.walks.advance(s, &found, moves);
        for lane in Bits(moves & !goes) {
            if !self.walks.leave(s, lane) {
                self.arrive(s, lane);
            }
        }
        for lane in Bits(ended) {
            self.end(s, lane, true);
        }
    }

    /// Looks at what is listed in a cell; whether that ends the search.
    #[inline(always)]
    fn visit(&mut self, s: S, found: &Found, lane: usize) -> bool {
        let Walker { ray, slab, query: Some(query), .. } = &mut self.walkers[lane % 16] else {
            return false;
        };
        let listed = self.walks.listed(found, lane);
        let ended = visit(s, &self.cells, listed, ray, slab, query);
        self.walks.heed(lane, query.t_bound());
        ended
    }

    /// Brings a ray into its next outermost grid, or ends its search.
    #[inline(always)]
    fn arrive(&mut self, s: S, lane: usize) {
        match self.walkers[lane % 16].arrive(s, &self.cells) {
            Turn::Walks(way) => self.walks.set(lane, &way),
            Turn::Ended(ended) => self.end(s, lane, ended),
        }
    }

    /// Writes the answer of a ray, and gives its place to the next.
    #[inline(always)]
    fn end(&mut self, s: S, lane: usize, ended: bool) {
        self.answer(s, lane, ended);
        self.take_up(s, lane);
    }

    /// Writes the answer of a ray.
    #[inline(always)]
    fn answer(&mut self, s: S, lane: usize, ended: bool) {
        if let Walker { number, ray, query: Some(query), .. } = &mut self.walkers[lane % 16] {
            let answer = Q::answer(s, self.batch.block.whole, ray, query, ended);
            self.batch.write(*number, answer);
        }
    }

    /// Gives a place to the next ray that comes into a grid, if there is one.
    #[inline(always)]
    fn take_up(&mut self, s: S, lane: usize) {
        self.going &= !(1 << lane);
        while let Some(given) = self.batch.rays.get(self.next) {
            let number = self.next;
            self.next += 1;
            let Some((ray, slab)) = given.prepare_with(s, self.batch.block.header.extent()) else {
                self.batch.answer_alone(number);
                continue;
            };
            let query = Some(self.batch.question.query(self.batch.block.whole, ray.t_max));
            let walker = &mut self.walkers[lane % 16];
            *walker = Walker { number, ray, slab, query, grids: 0 };
            match walker.arrive(s, &self.cells) {
                Turn::Walks(way) => {
                    self.walks.set(lane, &way);
                    self.going |= 1 << lane;
                    return;
                }
                Turn::Ended(ended) => self.answer(s, lane, ended),
            }
        }
    }
}
