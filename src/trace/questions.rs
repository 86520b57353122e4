//! The questions: the closest hit, any hit, a hit that is known.

use core::marker::PhantomData;

use super::{Question, ask, hit, record};
use crate::block::Finished;
use crate::query::{
    Any, Choice, Closest, Decide, Either, Exact, ExactMet, Filter, Locate, Wanted, Watch,
};
use crate::ray::{Hit, PreparedRay, Ray};
use crate::simd::{SMALL, Simd};

/// The closest hit that the filter leaves; `MEMORY` as for [`Closest`].
#[derive(Clone, Copy)]
pub(crate) struct ClosestHit<D, W, const MEMORY: usize> {
    pub(super) choice: Choice,
    watch: W,
    decide: PhantomData<D>,
}

/// Half a kilobyte of stack, which is spent only where there is plenty: see [`Closest`].
pub(crate) const MEMORY: usize = if cfg!(target_pointer_width = "64") { 1 } else { 0 };

/// Whether anything is hit that the filter leaves.
#[derive(Clone, Copy)]
pub(crate) struct AnyHit<D, W> {
    pub(super) choice: Choice,
    watch: W,
    decide: PhantomData<D>,
}

impl<D, W, const MEMORY: usize> ClosestHit<D, W, MEMORY> {
    #[inline(always)]
    pub fn new(choice: Choice, watch: W) -> Self {
        ClosestHit { choice, watch, decide: PhantomData }
    }
}

impl<D, W> AnyHit<D, W> {
    #[inline(always)]
    pub fn new(choice: Choice, watch: W) -> Self {
        AnyHit { choice, watch, decide: PhantomData }
    }
}

impl<'m, D: Decide, W: Watch, const MEMORY: usize> Question<'m> for ClosestHit<D, W, MEMORY> {
    type Query = Closest<'m, D, W, MEMORY>;
    type Answer = Option<Hit>;
    const RARE: bool = W::COUNTS;

    #[inline(always)]
    fn query(self, block: Finished<'m>, t_max: f32) -> Self::Query {
        let filter = Filter::new(self.choice, block);
        Closest::new(filter, t_max, self.watch)
    }

    #[inline(always)]
    fn answer<S: Simd>(
        s: S,
        block: Finished<'m>,
        ray: &PreparedRay,
        query: &mut Self::Query,
        _ended: bool,
    ) -> Option<Hit> {
        if let Some(lane) = query.waiting() {
            if let Some((t, weights)) = D::sure(s, ray, &lane) {
                return Some(record(s, block, lane.place, t, weights));
            }
            query.settle(ray);
        }
        let Closest { best, watch, .. } = query;
        Some(hit::<D>(s, block, ray, best.as_ref()?, watch))
    }

    fn nothing() -> Option<Hit> {
        None
    }
}

impl<'m, D: Decide, W: Watch> Question<'m> for AnyHit<D, W> {
    type Query = Any<'m, D, W>;
    type Answer = bool;
    const RARE: bool = W::COUNTS;

    #[inline(always)]
    fn query(self, block: Finished<'m>, t_max: f32) -> Self::Query {
        let filter = Filter::new(self.choice, block);
        Any::new(filter, t_max, self.watch)
    }

    #[inline(always)]
    fn answer<S: Simd>(
        _: S,
        _: Finished<'m>,
        _: &PreparedRay,
        _: &mut Self::Query,
        ended: bool,
    ) -> bool {
        ended
    }

    fn nothing() -> bool {
        false
    }
}

/// One of these two, as is known when it is asked: one code for both. Any hit is answered by [`Hit::MISS`].
#[derive(Clone, Copy)]
struct EitherHit<D, W> {
    choice: Choice,
    watch: W,
    any: bool,
    decide: PhantomData<D>,
}

impl<'m, D: Decide, W: Watch> Question<'m> for EitherHit<D, W> {
    type Query = Either<'m, D, W>;
    type Answer = Option<Hit>;

    fn query(self, block: Finished<'m>, t_max: f32) -> Self::Query {
        let EitherHit { choice, watch, any, .. } = self;
        Either { closest: Closest::new(Filter::new(choice, block), t_max, watch), any }
    }

    fn answer<S: Simd>(
        s: S,
        block: Finished<'m>,
        ray: &PreparedRay,
        query: &mut Self::Query,
        ended: bool,
    ) -> Option<Hit> {
        match query.any {
            true => ended.then_some(Hit::MISS),
            false => ClosestHit::<D, W, 0>::answer(s, block, ray, &mut query.closest, ended),
        }
    }

    fn nothing() -> Option<Hit> {
        None
    }
}

/// The closest hit of a block without what is in instances or, with `any`, [`Hit::MISS`] if anything is hit.
#[inline(always)]
pub(crate) fn either_hit<D: Decide, W: Watch>(
    block: Finished,
    ray: &Ray,
    choice: Choice,
    watch: W,
    any: bool,
) -> Option<Hit> {
    match any {
        _ if SMALL => {
            ask(block, ray, EitherHit::<D, W> { choice, watch, any, decide: PhantomData })
        }
        true => ask(block, ray, AnyHit::<D, W>::new(choice, watch)).then_some(Hit::MISS),
        false => ask(block, ray, ClosestHit::<D, W, MEMORY>::new(choice, watch)),
    }
}

/// A known meeting.
#[derive(Clone, Copy)]
pub(crate) struct LocateHit<D> {
    wanted: Wanted,
    decide: PhantomData<D>,
}

impl<D> LocateHit<D> {
    pub fn new(wanted: Wanted) -> Self {
        LocateHit { wanted, decide: PhantomData }
    }
}

impl<'m, D: Decide> Question<'m> for LocateHit<D> {
    type Query = Locate<'m, D>;
    type Answer = Option<D::Met>;
    // Hits of the watertight mode, which is tried second, are rarely looked up.
    const RARE: bool = !D::ANY_BOXES;

    #[inline(always)]
    fn query(self, block: Finished<'m>, t_max: f32) -> Self::Query {
        Locate::new(self.wanted, t_max, block.parts().prim_ids)
    }

    #[inline(always)]
    fn answer<S: Simd>(
        _: S,
        _: Finished<'m>,
        _: &PreparedRay,
        query: &mut Self::Query,
        _: bool,
    ) -> Self::Answer {
        query.found
    }

    fn nothing() -> Self::Answer {
        None
    }
}

/// The meeting that wins: what [`ClosestHit`] answers before it is written down. Asked when meetings in two instances are too
/// close for floats.
#[derive(Clone, Copy)]
pub(crate) struct ClosestMet(pub Choice);

impl<'m> Question<'m> for ClosestMet {
    type Query = Closest<'m, Exact, (), MEMORY>;
    type Answer = Option<ExactMet>;
    const RARE: bool = true;

    fn query(self, block: Finished<'m>, t_max: f32) -> Self::Query {
        let filter = Filter::new(self.0, block);
        Closest::new(filter, t_max, ())
    }

    fn answer<S: Simd>(
        _: S,
        _: Finished<'m>,
        ray: &PreparedRay,
        query: &mut Self::Query,
        _: bool,
    ) -> Self::Answer {
        query.settle(ray);
        query.best
    }

    fn nothing() -> Self::Answer {
        None
    }
}
