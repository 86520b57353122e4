//! Rays, hits, and what a traversal knows about a ray before it starts.

use glam::DVec3;

use crate::exact::Line;
use crate::math::rounding::gamma;
use crate::math::{Aabb, sum_abs, wide};

/// The number that stands for "no primitive", "no geometry" and "not in an instance".
pub const NONE: u32 = u32::MAX;

/// The set of points `origin + t * direction` with `t_min <= t <= t_max`, both ends included.
///
/// `direction` need not have length one; `t` counts in its lengths. The limits may be infinite and
/// `t_min` may be negative. A ray with a NaN or an infinity in `origin` or `direction`, with a zero
/// direction, with a NaN limit or with `t_min > t_max` hits nothing.
///
/// ```text
/// byte 0        12      16           28      32
///      | origin | t_min | direction | t_max |
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Ray {
    /// Where `t` is zero.
    pub origin: [f32; 3],
    /// The smallest `t` that counts.
    pub t_min: f32,
    /// The step for `t = 1`, of any length but zero.
    pub direction: [f32; 3],
    /// The largest `t` that counts.
    pub t_max: f32,
}
const _: () = assert!(size_of::<Ray>() == 32);

impl Ray {
    /// The ray from `origin` along `direction` with `t` from 0 to infinity.
    pub const fn new(origin: [f32; 3], direction: [f32; 3]) -> Self {
        Ray { origin, t_min: 0.0, direction, t_max: f32::INFINITY }
    }

    /// The same ray, limited to `t_min <= t <= t_max`.
    pub const fn with_limits(self, t_min: f32, t_max: f32) -> Self {
        Ray { t_min, t_max, ..self }
    }
}

/// Where a ray meets a scene.
///
/// ```text
/// byte 0   4   8   12     16         20         24
///      | t | u | v | prim | geometry | instance |
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Hit {
    /// The parameter of the hit, in lengths of the ray's direction.
    pub t: f32,
    /// The weight of the triangle's second vertex; 0 on spheres.
    pub u: f32,
    /// The weight of the triangle's third vertex; 0 on spheres.
    pub v: f32,
    /// The number of the triangle or sphere within its geometry.
    pub prim: u32,
    /// The number of the mesh, or the number of meshes plus the number of the sphere set.
    pub geometry: u32,
    /// The number of the instance, [`NONE`] outside instances.
    pub instance: u32,
}
const _: () = assert!(size_of::<Hit>() == 24);

impl Hit {
    /// What the C entry points write for a ray that hits nothing.
    pub const MISS: Hit =
        Hit { t: f32::INFINITY, u: 0.0, v: 0.0, prim: NONE, geometry: NONE, instance: NONE };
}

/// A ray that can hit something, with what every box and primitive test needs of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PreparedRay {
    pub origin: DVec3,
    pub direction: DVec3,
    /// `1 / direction`, infinite with the sign of a zero component.
    pub inverse: DVec3,
    /// The sum of the direction's absolute components.
    pub direction_size: f64,
    /// At least `-f32::MAX`.
    pub t_min: f64,
    /// At most `f32::MAX`: a `t` beyond it is a miss.
    pub t_max: f64,
}

/// The part `near ..= far` of a ray, or of what is known of a `t`; empty when `near > far`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Interval {
    pub near: f64,
    pub far: f64,
}

impl Ray {
    /// What traversal needs, or `None` for a ray that hits nothing by definition.
    pub(crate) fn prepare(&self) -> Option<PreparedRay> {
        let finite = |v: [f32; 3]| v.iter().all(|x| x.is_finite());
        let points = self.direction.iter().any(|x| *x != 0.0);
        let t_min = f64::from(self.t_min.max(-f32::MAX));
        let t_max = f64::from(self.t_max.min(f32::MAX));
        // `max` and `min` drop a NaN, so it is looked for in the limits as given.
        let limits = self.t_min <= self.t_max && t_min <= t_max;
        if !(finite(self.origin) && finite(self.direction) && points && limits) {
            return None;
        }
        let direction = wide(self.direction);
        Some(PreparedRay {
            origin: wide(self.origin),
            direction,
            inverse: 1.0 / direction,
            direction_size: sum_abs(direction),
            t_min,
            t_max,
        })
    }
}

impl PreparedRay {
    /// Origin and direction as they were given.
    pub fn line(&self) -> Line {
        let given = |v: DVec3| v.to_array().map(|x| x as f32);
        Line { origin: given(self.origin), direction: given(self.direction) }
    }

    /// The part of the ray inside `[lower, upper]` with `t_min <= t <= t_bound`.
    ///
    /// Conservative: if a point of the ray with such a `t` lies, in real arithmetic, in the closed
    /// box, the interval is not empty and holds that `t`. A box that is only nearly touched may be
    /// reported too. Holds for every prepared ray and every box, infinite walls included.
    ///
    /// A zero component of the direction is allowed: its reciprocal is infinite, the walls are
    /// chosen by its sign bit, and the NaN of `0 * infinity` loses both comparisons.
    ///
    /// The distance to a wall, `(wall - origin) * inverse`, carries three roundings, so it is within
    /// `gamma(3)` of the real one. Widening the interval takes two more, and `gamma(6)` covers all
    /// five; it is applied to magnitudes, so negative `t` are widened outwards as well. Nothing
    /// underflows: differences of `f32` are at least 1e-45 and reciprocals at least 2e-39.
    ///
    /// Source: \[Ize13\]. No division, no branch.
    pub fn clip(&self, lower: DVec3, upper: DVec3, t_bound: f64) -> Interval {
        const PAD: f64 = gamma(6);
        let mut near = f64::NEG_INFINITY;
        let mut far = f64::INFINITY;
        for k in 0..3 {
            let (o, inverse) = (self.origin[k], self.inverse[k]);
            let backwards = inverse.is_sign_negative();
            let (first, last) = if backwards { (upper[k], lower[k]) } else { (lower[k], upper[k]) };
            let enter = (first - o) * inverse;
            let leave = (last - o) * inverse;
            near = if enter > near { enter } else { near };
            far = if leave < far { leave } else { far };
        }
        // An infinite distance stays infinite: only its finite part is widened.
        near -= near.abs().min(f64::MAX) * PAD;
        far += far.abs().min(f64::MAX) * PAD;
        Interval {
            near: if near > self.t_min { near } else { self.t_min },
            far: if far < t_bound { far } else { t_bound },
        }
    }

    /// [`clip`](Self::clip) for a box as it is stored.
    pub fn slab(&self, aabb: &Aabb, t_bound: f64) -> Interval {
        self.clip(wide(aabb.lower), wide(aabb.upper), t_bound)
    }
}

impl Interval {
    pub fn is_empty(&self) -> bool {
        // Written so that a NaN counts as not empty: what is unclear is looked at.
        self.near > self.far
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNIT_BOX: Aabb = Aabb { lower: [0.0; 3], upper: [1.0; 3] };

    fn slab(ray: Ray) -> Interval {
        let ray = ray.prepare().expect("a valid ray");
        ray.slab(&UNIT_BOX, ray.t_max)
    }

    #[test]
    fn rays_that_hit_nothing_are_not_prepared() {
        let good = Ray::new([0.0; 3], [0.0, 0.0, 1.0]);
        assert!(good.prepare().is_some());
        for bad in [
            Ray { origin: [f32::NAN, 0.0, 0.0], ..good },
            Ray { origin: [0.0, f32::INFINITY, 0.0], ..good },
            Ray { direction: [0.0, -0.0, 0.0], ..good },
            Ray { direction: [0.0, f32::NEG_INFINITY, 0.0], ..good },
            good.with_limits(f32::NAN, 1.0),
            good.with_limits(0.0, f32::NAN),
            good.with_limits(2.0, 1.0),
            good.with_limits(f32::INFINITY, f32::INFINITY),
        ] {
            assert!(bad.prepare().is_none(), "{bad:?}");
        }
        assert!(good.with_limits(1.0, 1.0).prepare().is_some());
        assert!(good.with_limits(f32::NEG_INFINITY, f32::INFINITY).prepare().is_some());
    }

    #[test]
    fn a_ray_in_a_wall_touches_the_box() {
        for x in [0.0, 1.0, -0.0] {
            for dz in [1.0, -1.0] {
                let ray = Ray::new([x, 0.5, 0.5 - dz], [0.0, -0.0, dz]);
                let part = slab(ray);
                assert!(!part.is_empty() && part.near <= 0.5 && part.far >= 1.5, "{part:?}");
            }
        }
        assert!(slab(Ray::new([1.0f32.next_up(), 0.5, -1.0], [0.0, 0.0, 1.0])).is_empty());
        assert!(slab(Ray::new([0.5, -1e-45, -1.0], [-0.0, 0.0, 1.0])).is_empty());
    }

    #[test]
    fn limits_are_inclusive_and_may_be_negative() {
        let ray = Ray::new([0.5, 0.5, 3.0], [0.0, 0.0, 1.0]);
        assert!(slab(ray).is_empty());
        let part = slab(ray.with_limits(-10.0, -2.0));
        assert!(!part.is_empty() && part.near <= -3.0 && part.far == -2.0);
        assert!(slab(ray.with_limits(-1.9, 5.0)).is_empty());
        assert!(!slab(ray.with_limits(f32::NEG_INFINITY, -3.0)).is_empty());
    }
}
