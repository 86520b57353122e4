//! A query behind a pointer: what is rarely asked shares one traversal, whatever it asks.

use super::{Query, SphereLane, TriangleLane, Watch};
use crate::ray::PreparedRay;

/// What a traversal wants of a [`Query`].
pub(crate) trait Asked {
    fn t_bound(&self) -> f32;
    fn triangle(&mut self, ray: &PreparedRay, lane: &TriangleLane) -> bool;
    fn sphere(&mut self, ray: &PreparedRay, lane: &SphereLane) -> bool;
    fn step(&mut self);
    fn block(&mut self, tests: u32);
}

impl<Q: Query> Asked for Q {
    fn t_bound(&self) -> f32 {
        Query::t_bound(self)
    }

    fn triangle(&mut self, ray: &PreparedRay, lane: &TriangleLane) -> bool {
        Query::triangle(self, ray, lane)
    }

    fn sphere(&mut self, ray: &PreparedRay, lane: &SphereLane) -> bool {
        Query::sphere(self, ray, lane)
    }

    fn step(&mut self) {
        self.watch().step();
    }

    fn block(&mut self, tests: u32) {
        self.watch().block(tests);
    }
}

/// A query of any type, but none of an index. `ORDERED` is that of [`Query`].
pub(crate) struct Erased<'q, const ORDERED: bool>(pub &'q mut (dyn Asked + 'q));

impl<const ORDERED: bool> Query for Erased<'_, ORDERED> {
    type Watch = Self;
    // Some of them ask for that.
    const ANY_BOXES: bool = false;
    const ORDERED: bool = ORDERED;

    fn t_bound(&self) -> f32 {
        self.0.t_bound()
    }

    fn triangle(&mut self, ray: &PreparedRay, lane: &TriangleLane) -> bool {
        self.0.triangle(ray, lane)
    }

    fn sphere(&mut self, ray: &PreparedRay, lane: &SphereLane) -> bool {
        self.0.sphere(ray, lane)
    }

    fn watch(&mut self) -> &mut Self {
        self
    }
}

impl<const ORDERED: bool> Watch for Erased<'_, ORDERED> {
    type Lent<'a>
        = Erased<'a, ORDERED>
    where
        Self: 'a;

    fn lend(&mut self) -> Erased<'_, ORDERED> {
        Erased(self.0)
    }

    const COUNTS: bool = true;

    fn step(&mut self) {
        self.0.step();
    }

    fn block(&mut self, tests: u32) {
        self.0.block(tests);
    }
}
