//! The exact oracle: what a ray hits in real arithmetic, and a judge of claimed hits.
//!
//! It shares no code with the core, only the types of its face. Floats are taken as the numbers
//! they are; a triangle's `t` is a fraction of integers, a sphere's has a square root in it, and
//! both are compared without rounding. Slow and plain: about a millisecond a ray on a million
//! triangles, after a conservative sieve in `f64`.
//!
//! Two cases that the semantics leave open are settled here. A line that only touches a sphere
//! enters and leaves it in one point; it shows the front and the back there, and skipping the
//! sphere leaves out that point. Of two roots as far from `t = 0` as each other, skipping leaves out
//! the entering one.

pub mod dyadic;
mod judge;
pub mod point;
mod root;
mod sieve;
mod sphere;
mod triangle;

use raykern::{Facing, QueryOptions, Ray};

use crate::model::Model;
use dyadic::vector;
pub use judge::{Judgement, Tally};
pub use root::{Root, ulps_apart};
pub use sieve::Place;
use sieve::{Shape, Sieve};

/// Decides rays against one model.
#[derive(Debug)]
pub struct Oracle {
    sieve: Sieve,
    masks: Vec<u32>,
}

/// A meeting of a ray with a primitive, exactly.
#[derive(Clone, Debug)]
pub struct ExactHit {
    /// Which primitive.
    pub place: Place,
    /// Where, as a real number.
    pub t: Root,
    /// The weights of a triangle's second and third vertex to about 1e-15; zeros on spheres.
    pub weights: [f64; 2],
    /// Whether the ray meets the front.
    pub front: bool,
}

/// What a ray hits.
#[derive(Clone, Debug)]
pub struct Verdict {
    /// The closest hit: least `t`, and of equal ones the first in order.
    pub hit: Option<ExactHit>,
    /// The other primitives hit at the same `t`.
    pub equal_t: Vec<Place>,
}

impl Oracle {
    /// The oracle for a model whose geometries are seen by every ray.
    pub fn new(model: &Model) -> Self {
        Self::with_masks(model, &[])
    }

    /// The oracle for a model whose geometry `i` has mask `masks[i]`; missing ones are 0.
    pub fn with_masks(model: &Model, masks: &[u32]) -> Self {
        Oracle { sieve: Sieve::new(model), masks: masks.to_vec() }
    }

    /// The closest hit among what `options` leaves.
    pub fn closest(&self, ray: &Ray, options: &QueryOptions) -> Verdict {
        let mut hits = self.all_hits(ray, options).into_iter();
        let hit = hits.next();
        let equal_t = match &hit {
            Some(first) => hits
                .take_while(|other| other.t == first.t)
                .map(|other| other.place)
                .filter(|place| *place != first.place)
                .collect(),
            None => Vec::new(),
        };
        Verdict { hit, equal_t }
    }

    /// Every hit within the ray's limits that `options` leaves, in order: by `t`, at equal `t` by place, and where a sphere
    /// is only touched entering before leaving.
    pub fn all_hits(&self, ray: &Ray, options: &QueryOptions) -> Vec<ExactHit> {
        let mut hits = Vec::new();
        if !hits_anything(ray) {
            return hits;
        }
        let limits = [ray.t_min.max(-f32::MAX), ray.t_max.min(f32::MAX)].map(Root::float);
        self.sieve.each_near(ray.origin, ray.direction, |place, shape| {
            if self.sees(place, options) {
                let meetings = meetings(ray, place, shape, options);
                hits.extend(meetings.into_iter().filter(|hit| {
                    hit.t >= limits[0] && hit.t <= limits[1] && faces(hit, options.facing)
                }));
            }
        });
        hits.sort_by(|a, b| a.t.cmp(&b.t).then(a.place.cmp(&b.place)));
        hits
    }

    fn sees(&self, place: Place, options: &QueryOptions) -> bool {
        let mask = self.masks.get(place.geometry as usize).copied().unwrap_or(0);
        mask == 0 || options.mask == 0 || mask & options.mask != 0
    }
}

/// False for rays that hit nothing by definition.
fn hits_anything(ray: &Ray) -> bool {
    let finite = |v: [f32; 3]| v.iter().all(|x| x.is_finite());
    let moves = ray.direction.iter().any(|x| *x != 0.0);
    // Between two infinities of one sign there is no real number. A NaN limit fails the comparisons.
    let some_t = ray.t_min <= ray.t_max && ray.t_min < f32::INFINITY && ray.t_max > -f32::INFINITY;
    finite(ray.origin) && finite(ray.direction) && moves && some_t
}

fn faces(hit: &ExactHit, facing: Facing) -> bool {
    match facing {
        Facing::Both => true,
        Facing::Front => hit.front,
        Facing::Back => !hit.front,
    }
}

/// The meetings of the ray's line with one shape, without those that are skipped.
fn meetings(ray: &Ray, place: Place, shape: Shape, options: &QueryOptions) -> Vec<ExactHit> {
    let skipped = options.skip.is_some_and(|id| {
        id.instance == raykern::NONE && (id.geometry, id.prim) == (place.geometry, place.prim)
    });
    let (origin, direction) = (vector(ray.origin), vector(ray.direction));
    match shape {
        Shape::Triangle(_) if skipped => Vec::new(),
        Shape::Triangle(corners) => {
            let hit = triangle::meet(&origin, &direction, corners);
            let exact =
                hit.map(|hit| ExactHit { place, t: hit.t, weights: hit.weights, front: hit.front });
            exact.into_iter().collect()
        }
        Shape::Sphere(sphere) => {
            let Some([enter, leave]) = sphere::meet(&origin, &direction, sphere) else {
                return Vec::new();
            };
            let touches = enter == leave;
            let leave_is_nearer = leave.magnitude() < enter.magnitude();
            let at = |t, front| ExactHit { place, t, weights: [0.0; 2], front };
            let mut hits = Vec::new();
            if !(skipped && (touches || !leave_is_nearer)) {
                hits.push(at(enter, true));
            }
            if !(skipped && (touches || leave_is_nearer)) {
                hits.push(at(leave, false));
            }
            hits
        }
    }
}

#[cfg(test)]
mod tests;
