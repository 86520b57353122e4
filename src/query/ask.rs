//! The questions: the closest hit, any hit, a known hit.

use super::waiting::Waiting;
use super::{Decide, Filter, Meets, Query, SphereLane, TriangleLane, Watch};
use crate::block::leaf::Place;
use crate::ray::{Interval, PreparedRay};
use crate::simd::SMALL;

/// The closest hit: least `t`, and of equal ones the first primitive.
///
/// `MEMORY` is 1 to remember what comparisons of the best hit took, which ties make use of, or 0 to be small.
pub(crate) struct Closest<'m, D: Decide, W, const MEMORY: usize> {
    filter: Filter<'m>,
    t_bound: f32,
    waiting: [Waiting; WAITS],
    pub best: Option<D::Met>,
    memory: [D::Memory; MEMORY],
    pub watch: W,
}

/// How many triangles may wait: none where code shall be small.
const WAITS: usize = if SMALL { 0 } else { 1 };

impl<'m, D: Decide, W: Watch, const MEMORY: usize> Closest<'m, D, W, MEMORY> {
    #[inline(always)]
    pub fn new(filter: Filter<'m>, t_max: f32, watch: W) -> Self {
        Closest {
            waiting: core::array::from_fn(|_| Waiting::new(&filter, t_max)),
            filter,
            t_bound: t_max,
            best: None,
            memory: core::array::from_fn(|_| D::Memory::default()),
            watch,
        }
    }

    /// The triangle of which the rest waits until the end.
    #[inline(always)]
    pub fn waiting(&self) -> Option<TriangleLane<'m>> {
        self.waiting.first()?.lane(|| self.filter.block.parts().triangle_blocks)
    }

    /// Computes what waits. Nothing else was met then.
    #[inline(always)]
    pub fn settle(&mut self, ray: &PreparedRay) {
        let block = self.filter.block;
        let ended = |waiting: &mut Waiting| waiting.end(|| block.parts().triangle_blocks);
        if let Some(lane) = self.waiting.first_mut().and_then(ended)
            && let Some((met, in_doubt)) = &D::likely(ray, &lane, &mut self.watch)
        {
            self.consider(ray, met, *in_doubt);
        }
    }

    /// In line where room is no matter.
    #[cfg_attr(target_pointer_width = "64", inline(always))]
    #[cfg_attr(not(target_pointer_width = "64"), inline(never))]
    fn consider(&mut self, ray: &PreparedRay, met: &D::Met, in_doubt: bool) {
        // Asked here, real arithmetic does not stand on the stack above what found the meeting.
        if in_doubt && !D::is_met(ray, met, &mut self.watch) {
            return;
        }
        if !self.filter.faces(met.front()) {
            return;
        }
        if let Some(best) = &self.best {
            // The grid offers a primitive once for each cell that holds it.
            let known = met.place() == best.place() && met.root() == best.root();
            let (prim_ids, memory) = (self.filter.prim_ids(), self.memory.first_mut());
            if known || !D::is_before(ray, met, best, prim_ids, memory, &mut self.watch) {
                return;
            }
        }
        self.best = Some(*met);
        let t_bound = D::t_bound(ray, met);
        if t_bound < self.t_bound {
            self.t_bound = t_bound;
        }
    }
}

impl<D: Decide, W: Watch, const MEMORY: usize> Query for Closest<'_, D, W, MEMORY> {
    type Watch = W;
    const ANY_BOXES: bool = D::ANY_BOXES;
    const ORDERED: bool = true;
    const CAN_WAIT: bool = D::ANY_BOXES && WAITS > 0;

    #[inline(always)]
    fn may_wait(&mut self, ray: &PreparedRay, place: Place, part: Interval<f32>) -> bool {
        let waits = self.waiting.first_mut().is_some_and(|w| w.takes(ray, place, part));
        if waits {
            self.t_bound = part.far;
        }
        waits
    }

    #[inline(always)]
    fn t_bound(&self) -> f32 {
        self.t_bound
    }

    #[inline(always)]
    fn triangle(&mut self, ray: &PreparedRay, lane: &TriangleLane) -> bool {
        self.settle(ray);
        // What was offered once is not computed again.
        let known = match &self.best {
            Some(best) => {
                best.place() == lane.place || D::is_surely_after(lane, best, self.filter.prim_ids())
            }
            None => false,
        };
        if !known
            && self.filter.sees(lane.place, true)
            && let Some((met, in_doubt)) = &D::likely(ray, lane, &mut self.watch)
        {
            self.consider(ray, met, *in_doubt);
        }
        false
    }

    fn sphere(&mut self, ray: &PreparedRay, lane: &SphereLane) -> bool {
        self.settle(ray);
        if self.filter.sees(lane.place, false) {
            for met in D::sphere(ray, lane, &mut self.watch).into_iter().flatten() {
                if self.filter.sees(lane.place, met.skippable()) {
                    self.consider(ray, &met, false);
                }
            }
        }
        false
    }

    #[inline(always)]
    fn watch(&mut self) -> &mut W {
        &mut self.watch
    }
}

/// Whether anything is hit.
pub(crate) struct Any<'m, D, W> {
    filter: Filter<'m>,
    t_max: f32,
    watch: W,
    decide: core::marker::PhantomData<D>,
}

impl<'m, D: Decide, W: Watch> Any<'m, D, W> {
    #[inline(always)]
    pub fn new(filter: Filter<'m>, t_max: f32, watch: W) -> Self {
        Any { filter, t_max, watch, decide: core::marker::PhantomData }
    }
}

impl<D: Decide, W: Watch> Query for Any<'_, D, W> {
    type Watch = W;
    const ANY_BOXES: bool = D::ANY_BOXES;
    const ORDERED: bool = false;

    #[inline(always)]
    fn t_bound(&self) -> f32 {
        self.t_max
    }

    #[inline(always)]
    fn triangle(&mut self, ray: &PreparedRay, lane: &TriangleLane) -> bool {
        if !self.filter.sees(lane.place, true) {
            return false;
        }
        // Neither `t` nor side is needed of what is surely hit.
        if lane.inside && self.filter.both_sides() {
            return true;
        }
        D::triangle(ray, lane, &mut self.watch).is_some_and(|met| self.filter.faces(met.front()))
    }

    fn sphere(&mut self, ray: &PreparedRay, lane: &SphereLane) -> bool {
        self.filter.sees(lane.place, false)
            && D::sphere(ray, lane, &mut self.watch).iter().flatten().any(|met| {
                self.filter.sees(lane.place, met.skippable()) && self.filter.faces(met.front())
            })
    }

    #[inline(always)]
    fn watch(&mut self) -> &mut W {
        &mut self.watch
    }
}

/// [`Closest`], or [`Any`] if `any` says so: the same code for both.
pub(crate) struct Either<'m, D: Decide, W> {
    pub closest: Closest<'m, D, W, 0>,
    pub any: bool,
}

impl<D: Decide, W: Watch> Query for Either<'_, D, W> {
    type Watch = W;
    const ANY_BOXES: bool = D::ANY_BOXES;
    const ORDERED: bool = true;

    #[inline(always)]
    fn wants_inside(&self) -> bool {
        // What the watertight mode asks of a lane takes no longer than this.
        self.any && D::ANY_BOXES
    }

    #[inline(always)]
    fn t_bound(&self) -> f32 {
        self.closest.t_bound
    }

    #[inline(always)]
    fn triangle(&mut self, ray: &PreparedRay, lane: &TriangleLane) -> bool {
        let filter = &self.closest.filter;
        // Neither `t` nor side is needed of what is surely hit.
        if lane.inside && filter.both_sides() && filter.sees(lane.place, true) {
            return true;
        }
        self.closest.triangle(ray, lane);
        self.any && self.closest.best.is_some()
    }

    fn sphere(&mut self, ray: &PreparedRay, lane: &SphereLane) -> bool {
        self.closest.sphere(ray, lane);
        self.any && self.closest.best.is_some()
    }

    #[inline(always)]
    fn watch(&mut self) -> &mut W {
        &mut self.closest.watch
    }
}

/// Finds the hit with this primitive and this answered `t` again.
pub(crate) struct Locate<'m, D: Decide> {
    wanted: Wanted,
    prim_ids: &'m [u32],
    t_max: f32,
    pub found: Option<D::Met>,
    watch: (),
}

/// A hit by the flat number of its primitive, its `t` and, if both of a sphere have that, its root.
#[derive(Clone, Copy)]
pub(crate) struct Wanted {
    pub prim: u32,
    pub t: f32,
    /// Either one when this is `None`.
    pub root: Option<usize>,
}

impl<'m, D: Decide> Locate<'m, D> {
    #[inline(always)]
    pub fn new(wanted: Wanted, t_max: f32, prim_ids: &'m [u32]) -> Self {
        Locate { wanted, prim_ids, t_max, found: None, watch: () }
    }

    #[inline(always)]
    fn consider(&mut self, ray: &PreparedRay, met: Option<D::Met>) -> bool {
        let Wanted { t, root, .. } = self.wanted;
        let is_wanted = |met: &D::Met| {
            root.is_none_or(|root| root == met.root()) && D::t(ray, met, &mut ()) == t
        };
        let Some(met) = met.filter(is_wanted) else { return false };
        // Blocks of foreign bytes may have one number twice. Lists, which ask for a root, go on behind the last of them, or they
        // would not end.
        let is_later = self
            .found
            .as_ref()
            .is_none_or(|found| !D::is_before(ray, &met, found, self.prim_ids, None, &mut ()));
        if is_later {
            self.found = Some(met);
        }
        root.is_none()
    }
}

impl<D: Decide> Query for Locate<'_, D> {
    type Watch = ();
    const ANY_BOXES: bool = D::ANY_BOXES;
    const ORDERED: bool = true;

    #[inline(always)]
    fn t_bound(&self) -> f32 {
        self.t_max
    }

    #[inline(always)]
    fn triangle(&mut self, ray: &PreparedRay, lane: &TriangleLane) -> bool {
        lane.place.prim(self.prim_ids) == self.wanted.prim && {
            let met = D::triangle(ray, lane, &mut ());
            self.consider(ray, met)
        }
    }

    fn sphere(&mut self, ray: &PreparedRay, lane: &SphereLane) -> bool {
        lane.place.prim(self.prim_ids) == self.wanted.prim
            && D::sphere(ray, lane, &mut ()).into_iter().any(|met| self.consider(ray, met))
    }

    #[inline(always)]
    fn watch(&mut self) -> &mut () {
        &mut self.watch
    }
}
