//! What a ray may ask: its options, and the traversal's side of the question.

use core::cmp::Ordering;

use crate::block::Geometry;
use crate::exact::{Distance, Meeting};
use crate::ray::{Interval, NONE, PreparedRay};

/// Which of two sides of a surface a ray may meet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Facing {
    /// Both sides.
    #[default]
    Both,
    /// Only the front: the side from which a triangle's vertices run counter-clockwise, and the
    /// outside of a sphere.
    Front,
    /// Only the back.
    Back,
}

/// How right an answer must be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// Hit or miss, which primitive and which order as in real arithmetic; `t` is the nearest float;
    /// the same bits from every structure and on every machine.
    #[default]
    Exact,
    /// In `f32`, for the last per cent of speed and for processors without `f64`: nothing that the ray
    /// hits is missed, and `t` is within a stated bound.
    Watertight,
}

/// A primitive by its numbers, as they stand in a [`Hit`](crate::Hit).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PrimId {
    /// The number within the geometry.
    pub prim: u32,
    /// The mesh, or the number of meshes plus the sphere set.
    pub geometry: u32,
    /// The instance, [`NONE`](crate::NONE) outside instances.
    pub instance: u32,
}

/// What one query may leave out. The default leaves out nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct QueryOptions {
    /// How right the answer must be.
    pub precision: Precision,
    /// A geometry is seen when its mask and this one share a bit, or when either is zero.
    pub mask: u32,
    /// The sides of surfaces that count.
    pub facing: Facing,
    /// A primitive to leave out, such as the one the ray starts on. Of a sphere only the root
    /// nearest to `t = 0` is left out, so that a ray refracted into it still leaves it.
    pub skip: Option<PrimId>,
}

/// What a query did, for charts and heat maps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Boxes of BVH nodes, or cells of a grid, looked at.
    pub steps: u64,
    /// Leaf blocks opened.
    pub blocks: u64,
    /// Triangles and spheres tested.
    pub tests: u64,
    /// Meetings whose `t` was computed in `f64`.
    pub intervals: u64,
    /// Decisions that took real arithmetic.
    pub exact: u64,
    /// Final `t` whose rounding took real arithmetic.
    pub roundings: u64,
}

/// A primitive that the ray meets within its limits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Candidate {
    pub t: f64,
    /// A bound on the error of `t`.
    pub t_error: f64,
    /// What is met, from which the real `t` follows.
    pub meeting: Meeting,
    /// Weights of the triangle's second and third vertex.
    pub weights: [f64; 2],
    /// The flat number of the primitive.
    pub prim: u32,
    /// Where it is stored: the number of its leaf block and its lane.
    pub place: (u32, u32),
    /// Whether the ray meets the front.
    pub front: bool,
    /// Whether skipping the primitive skips this hit: false for the far root of a sphere.
    pub skippable: bool,
}

impl Candidate {
    /// Which of the meetings with one primitive this is.
    fn root(&self) -> usize {
        match self.meeting {
            Meeting::Triangle(_) => 0,
            Meeting::Sphere { root, .. } => root,
        }
    }

    /// Floats between which the real `t` lies.
    ///
    /// `t_error` grants at least one rounding of `t` more than the error needs, which covers the
    /// rounding of these two sums; a hundredth of it covers its own arithmetic.
    pub fn interval(&self) -> Interval {
        let margin = 1.01 * self.t_error;
        Interval { near: self.t - margin, far: self.t + margin }
    }

    /// Whether the real `t` is within the ray's limits.
    pub fn is_within(&self, ray: &PreparedRay) -> bool {
        let Interval { near, far } = self.interval();
        if far < ray.t_min || near > ray.t_max {
            return false;
        }
        if near > ray.t_min && far < ray.t_max {
            return true;
        }
        Distance::new(&ray.line(), &self.meeting).is_some_and(|t| {
            t.compare_with(ray.t_min as f32) != Ordering::Less
                && t.compare_with(ray.t_max as f32) != Ordering::Greater
        })
    }

    /// The order along the ray: that of the real `t`, and of equal ones that of the numbers.
    fn order(&self, other: &Candidate, ray: &PreparedRay) -> Ordering {
        let (a, b) = (self.interval(), other.interval());
        let apart = a.far < b.near || b.far < a.near;
        let by_float = || self.t.partial_cmp(&other.t).unwrap_or(Ordering::Equal);
        let by_t = if apart {
            by_float()
        } else if self.meeting.surely_equal(&other.meeting) {
            Ordering::Equal
        } else {
            let distance = |candidate: &Candidate| Distance::new(&ray.line(), &candidate.meeting);
            distance(self).zip(distance(other)).map_or_else(by_float, |(p, q)| p.compare(&q))
        };
        by_t.then(self.prim.cmp(&other.prim))
    }

    /// The nearest `f32` to the real `t`, ties to even.
    pub fn rounded_t(&self, ray: &PreparedRay) -> f32 {
        let nearest = self.t as f32;
        let Interval { near, far } = self.interval();
        if near as f32 == nearest && far as f32 == nearest {
            return nearest;
        }
        Distance::new(&ray.line(), &self.meeting).map_or(nearest, |t| t.round())
    }
}

/// The question a traversal answers: it offers candidates and obeys the bound.
pub(crate) trait Query {
    /// Nothing beyond this `t` is of interest any more.
    fn t_bound(&self) -> f64;

    /// Considers a candidate; true ends the traversal. The same candidate may come twice.
    fn accept(&mut self, candidate: &Candidate) -> bool;

    /// The traversal looked at a box or a cell.
    fn saw_step(&mut self) {}

    /// The traversal opened a leaf block to test some of its lanes.
    fn saw_block(&mut self, tests: u32) {
        let _ = tests;
    }
}

/// What a query leaves out, in flat numbers.
#[derive(Clone, Copy)]
pub(crate) struct Filter<'m> {
    geometries: &'m [Geometry],
    mask: u32,
    facing: Facing,
    skip: u32,
}

impl<'m> Filter<'m> {
    /// The filter of `options` over a scene with these geometries.
    pub fn new(options: &QueryOptions, geometries: &'m [Geometry], prim_limit: u32) -> Self {
        let skip = options.skip.and_then(|id| flat_number(&id, geometries, prim_limit));
        let QueryOptions { mask, facing, .. } = *options;
        Filter { geometries, mask, facing, skip: skip.unwrap_or(NONE) }
    }

    fn lets_pass(&self, candidate: &Candidate) -> bool {
        let side = match self.facing {
            Facing::Both => true,
            Facing::Front => candidate.front,
            Facing::Back => !candidate.front,
        };
        side && !(candidate.skippable && candidate.prim == self.skip)
            && (self.mask == 0 || self.sees(candidate.prim))
    }

    fn sees(&self, prim: u32) -> bool {
        let mask = geometry_of(prim, self.geometries).map_or(0, |(_, g)| g.mask);
        mask == 0 || mask & self.mask != 0
    }
}

/// The number of the geometry that holds the flat number `prim`, and the geometry.
pub(crate) fn geometry_of(prim: u32, geometries: &[Geometry]) -> Option<(u32, &Geometry)> {
    // Empty geometries share their first number with the next one; the last of them holds it.
    let after = geometries.partition_point(|g| g.first <= prim);
    let number = after.checked_sub(1)?;
    Some((number as u32, geometries.get(number)?))
}

/// The flat number of a primitive outside instances, or `None` when it does not exist.
pub(crate) fn flat_number(id: &PrimId, geometries: &[Geometry], prim_limit: u32) -> Option<u32> {
    let g = id.geometry as usize;
    let end = geometries.get(g.checked_add(1)?).map_or(prim_limit, |next| next.first);
    let prim = geometries.get(g)?.first.checked_add(id.prim)?;
    (id.instance == NONE && prim < end).then_some(prim)
}

/// The closest hit: least `t`, and of equal ones the first primitive.
pub(crate) struct Closest<'q, 'm> {
    ray: &'q PreparedRay,
    filter: Filter<'m>,
    t_bound: f64,
    pub best: Option<Candidate>,
}

impl<'q, 'm> Closest<'q, 'm> {
    pub fn new(filter: Filter<'m>, ray: &'q PreparedRay) -> Self {
        Closest { ray, filter, t_bound: ray.t_max, best: None }
    }
}

impl Query for Closest<'_, '_> {
    fn t_bound(&self) -> f64 {
        self.t_bound
    }

    fn accept(&mut self, candidate: &Candidate) -> bool {
        // The grid offers a primitive once for each cell that holds it.
        let first = self.best.is_none_or(|best| {
            (candidate.prim != best.prim || candidate.root() != best.root())
                && candidate.order(&best, self.ray) == Ordering::Less
        });
        if first && self.filter.lets_pass(candidate) {
            self.best = Some(*candidate);
            // Boxes are compared with real distances, so the bound is one of the real `t`.
            self.t_bound = self.t_bound.min(candidate.interval().far);
        }
        false
    }
}

/// Whether anything is hit.
pub(crate) struct Any<'m> {
    filter: Filter<'m>,
    t_max: f64,
    pub hit: bool,
}

impl<'m> Any<'m> {
    pub fn new(filter: Filter<'m>, ray: &PreparedRay) -> Self {
        Any { filter, t_max: ray.t_max, hit: false }
    }
}

impl Query for Any<'_> {
    fn t_bound(&self) -> f64 {
        self.t_max
    }

    fn accept(&mut self, candidate: &Candidate) -> bool {
        self.hit |= self.filter.lets_pass(candidate);
        self.hit
    }
}

/// Finds the one hit with this primitive and this rounded `t` again.
pub(crate) struct Locate<'q> {
    ray: &'q PreparedRay,
    prim: u32,
    t: f32,
    t_max: f64,
    pub found: Option<Candidate>,
}

impl<'q> Locate<'q> {
    pub fn new(prim: u32, t: f32, ray: &'q PreparedRay) -> Self {
        // The real `t` rounds to the given one, so it lies below the next float.
        Locate { ray, prim, t, t_max: ray.t_max.min(f64::from(t.next_up())), found: None }
    }
}

impl Query for Locate<'_> {
    fn t_bound(&self) -> f64 {
        self.t_max
    }

    fn accept(&mut self, candidate: &Candidate) -> bool {
        if candidate.prim == self.prim && candidate.rounded_t(self.ray) == self.t {
            self.found = Some(*candidate);
        }
        self.found.is_some()
    }
}

/// Another query, and what the traversal did for it.
pub(crate) struct Counted<'c, Q> {
    pub query: Q,
    pub counts: &'c mut Counts,
}

impl<Q: Query> Query for Counted<'_, Q> {
    fn t_bound(&self) -> f64 {
        self.query.t_bound()
    }

    fn accept(&mut self, candidate: &Candidate) -> bool {
        self.query.accept(candidate)
    }

    fn saw_step(&mut self) {
        self.counts.steps += 1;
    }

    fn saw_block(&mut self, tests: u32) {
        self.counts.blocks += 1;
        self.counts.tests += u64::from(tests);
    }
}
