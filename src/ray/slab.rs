//! A ray against boxes.

use glam::DVec3;

use super::{Interval, PreparedRay};
use crate::math::rounding::{UNIT32, f32_above, f32_below, gamma};
use crate::math::{Aabb, wide};
use crate::simd::{Lanes, Width, mul_sub};

/// A ray made ready for boxes.
///
/// Conservative: if a point of the ray with `t_min <= t <= t_bound` lies, in real arithmetic, in the
/// closed box, the part is not empty and holds that `t`. A box that is only nearly touched may be
/// reported too. All `t` are those of the frame.
///
/// A zero component of the direction is allowed: the walls are chosen by its sign bit.
pub(crate) trait Slab {
    /// The part of the ray inside the box.
    fn part(&self, aabb: &Aabb, t_bound: f32) -> Interval<f32>;

    /// The same for `N` boxes at once.
    fn wide<'a, S: Width<N> + 'a, const N: usize>(&'a self, s: S) -> impl WideBoxes<S, N> + 'a;
}

/// A [`Slab`] in the vectors of a backend.
pub(crate) trait WideBoxes<S: Width<N>, const N: usize> {
    /// The lanes whose boxes the ray enters up to `t_bound`, the same in each lane, and where.
    /// `walls` are lower x y z, then upper x y z.
    fn entered<const FUSED: bool>(&self, walls: &[[f32; N]; 6], t_bound: S::V) -> (u32, S::V);
}

/// Boxes in `f32`, for frames whose exponent is between -60 and 120.
///
/// With `r` the scaled reciprocal of a component, the distance to a wall is `wall * r - shift`, where
/// `shift` holds `origin * r` and all that rounding may add. `docs/METHODS.md` derives the padding.
pub(crate) struct NarrowSlab {
    pub(super) reciprocal: [f32; 4],
    pub(super) near_shift: [f32; 4],
    pub(super) far_shift: [f32; 4],
    t_min: f32,
    /// Whether the ray runs from the upper wall to the lower one, for each axis.
    backwards: [bool; 3],
}

impl NarrowSlab {
    /// Nothing in particular.
    pub const BLANK: Self = NarrowSlab {
        reciprocal: [0.0; 4],
        near_shift: [0.0; 4],
        far_shift: [0.0; 4],
        t_min: 0.0,
        backwards: [false; 3],
    };

    /// The ray for boxes, if its frame is neither too small nor too large for them.
    #[inline(always)]
    pub fn new<S: Width<4>>(s: S, ray: &PreparedRay) -> Option<Self> {
        const NEGLIGIBLE: f32 = 1.0 / (1u64 << 57) as f32;
        if !(-60..=120).contains(&ray.exponent) {
            return None;
        }
        let (origin, size) = (s.load(&ray.origin), s.load(&ray.inverse));
        let inverse = size.with_sign_of(s.load(&ray.direction));
        let relative = origin.abs().mul(s.splat(6.0 * UNIT32)).add(s.splat(NEGLIGIBLE * ray.reach));
        let pad = size.mul(relative).add(s.splat(12.0 * UNIT32 * ray.reach));
        let middle = origin.mul(inverse);
        let mut slab = NarrowSlab {
            reciprocal: [0.0; 4],
            near_shift: [0.0; 4],
            far_shift: [0.0; 4],
            t_min: ray.t_min,
            backwards: [0, 1, 2].map(|k| ray.direction[k].is_sign_negative()),
        };
        inverse.mul(s.splat(ray.scale)).store(&mut slab.reciprocal);
        middle.add(pad).store(&mut slab.near_shift);
        middle.sub(pad).store(&mut slab.far_shift);
        Some(slab)
    }
}

impl Slab for NarrowSlab {
    /// No division, no branch.
    fn part(&self, aabb: &Aabb, t_bound: f32) -> Interval<f32> {
        let (mut near, mut far) = (self.t_min, t_bound);
        for k in 0..3 {
            let r = self.reciprocal[k];
            let (lower, upper) = (aabb.lower[k], aabb.upper[k]);
            let (first, last) = if self.backwards[k] { (upper, lower) } else { (lower, upper) };
            let enter = first * r - self.near_shift[k];
            let leave = last * r - self.far_shift[k];
            near = if enter > near { enter } else { near };
            far = if leave < far { leave } else { far };
        }
        Interval { near, far }
    }

    #[inline(always)]
    fn wide<'a, S: Width<N> + 'a, const N: usize>(&'a self, s: S) -> impl WideBoxes<S, N> + 'a {
        NarrowBoxes {
            reciprocal: splat(s, self.reciprocal),
            near_shift: splat(s, self.near_shift),
            far_shift: splat(s, self.far_shift),
            t_min: s.splat(self.t_min),
            backwards: self.backwards,
            s,
        }
    }
}

#[inline(always)]
fn splat<S: Width<N>, const N: usize>(s: S, [x, y, z, _]: [f32; 4]) -> [S::V; 3] {
    [s.splat(x), s.splat(y), s.splat(z)]
}

/// A [`NarrowSlab`] with each number in all lanes.
struct NarrowBoxes<S, V> {
    s: S,
    reciprocal: [V; 3],
    near_shift: [V; 3],
    far_shift: [V; 3],
    t_min: V,
    backwards: [bool; 3],
}

impl<S: Width<N>, const N: usize> WideBoxes<S, N> for NarrowBoxes<S, S::V> {
    #[inline(always)]
    fn entered<const FUSED: bool>(&self, walls: &[[f32; N]; 6], t_bound: S::V) -> (u32, S::V) {
        let [x, y, z] = [
            self.between::<FUSED, N>(walls, 0),
            self.between::<FUSED, N>(walls, 1),
            self.between::<FUSED, N>(walls, 2),
        ];
        // In pairs, so that they wait less for each other.
        let near = x.near.max(y.near).max(z.near.max(self.t_min));
        let far = x.far.min(y.far).min(z.far.min(t_bound));
        (near.less_or_equal(far), near)
    }
}

impl<S, V: Copy> NarrowBoxes<S, V> {
    /// The parts between the two walls across an axis.
    #[inline(always)]
    fn between<const FUSED: bool, const N: usize>(
        &self,
        walls: &[[f32; N]; 6],
        k: usize,
    ) -> Interval<V>
    where
        S: Width<N, V = V>,
        V: Lanes<N>,
    {
        let (lower, upper) = (&walls[k], &walls[k + 3]);
        let (first, last) = if self.backwards[k] { (upper, lower) } else { (lower, upper) };
        let r = self.reciprocal[k];
        Interval {
            near: mul_sub::<V, FUSED, N>(self.s.load(first), r, self.near_shift[k]),
            far: mul_sub::<V, FUSED, N>(self.s.load(last), r, self.far_shift[k]),
        }
    }
}

/// Boxes in `f64`, for every ray and every box, infinite walls included.
///
/// The distance to a wall, `(wall - origin) * inverse`, carries three roundings, so it is within
/// `gamma(3)` of the real one. Widening the interval takes two more, and `gamma(6)` covers all
/// five; it is applied to magnitudes, so negative `t` are widened outwards as well. Nothing
/// underflows: differences of `f32` are at least 1e-45 and reciprocals at least 2e-39. The NaN of
/// `0 * infinity`, in the plane of a wall, loses both comparisons.
///
/// Source: \[Ize13\].
pub(crate) struct WideSlab {
    origin: DVec3,
    /// The reciprocal of the direction in the frame, from given coordinates.
    pub(super) inverse: DVec3,
    t_min: f64,
}

impl WideSlab {
    /// The part of a distance by which it is widened.
    pub(super) const PAD: f64 = gamma(6);

    pub fn new(ray: &PreparedRay) -> Self {
        WideSlab {
            origin: wide(ray.given.origin),
            inverse: 1.0 / wide(ray.given.direction) * ray.t_scale,
            t_min: f64::from(ray.t_min),
        }
    }

    /// The part of the ray inside `[lower, upper]` with `t <= t_bound`.
    pub fn clip(&self, lower: DVec3, upper: DVec3, t_bound: f64) -> Interval<f64> {
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
        near -= near.abs().min(f64::MAX) * Self::PAD;
        far += far.abs().min(f64::MAX) * Self::PAD;
        Interval {
            near: if near > self.t_min { near } else { self.t_min },
            far: if far < t_bound { far } else { t_bound },
        }
    }
}

impl Slab for WideSlab {
    fn part(&self, aabb: &Aabb, t_bound: f32) -> Interval<f32> {
        let part = self.clip(wide(aabb.lower), wide(aabb.upper), f64::from(t_bound));
        Interval { near: f32_below(part.near), far: f32_above(part.far) }
    }

    #[inline(always)]
    fn wide<'a, S: Width<N> + 'a, const N: usize>(&'a self, s: S) -> impl WideBoxes<S, N> + 'a {
        (self, s)
    }
}

/// Lane by lane.
impl<S: Width<N>, const N: usize> WideBoxes<S, N> for (&WideSlab, S) {
    fn entered<const FUSED: bool>(&self, walls: &[[f32; N]; 6], t_bound: S::V) -> (u32, S::V) {
        let (mut mask, mut near, mut bounds) = (0, [0.0; N], [0.0; N]);
        t_bound.store(&mut bounds);
        for (lane, near) in near.iter_mut().enumerate() {
            let corner = |first: usize| [0, 1, 2].map(|k| walls[first + k][lane]);
            let aabb = Aabb { lower: corner(0), upper: corner(3) };
            let part = self.0.part(&aabb, bounds[lane]);
            // A lane without a child is an empty box with infinite walls.
            let entered = !part.is_empty() && aabb.lower[0] <= aabb.upper[0];
            mask |= u32::from(entered) << lane;
            *near = part.near;
        }
        (mask, self.1.load(&near))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ray::Ray;
    use crate::simd::Scalar;

    const UNIT_BOX: Aabb = Aabb { lower: [0.0; 3], upper: [1.0; 3] };

    fn parts(ray: Ray) -> [Interval<f32>; 2] {
        let ray = ray.prepare(1.0).expect("a valid ray");
        let narrow = NarrowSlab::new(Scalar, &ray).expect("an ordinary frame");
        // In given units, as the frame's are twice as long or half.
        [narrow.part(&UNIT_BOX, ray.t_max), WideSlab::new(&ray).part(&UNIT_BOX, ray.t_max)].map(
            |part| {
                let given = |t: f32| (f64::from(t) / ray.t_scale) as f32;
                Interval { near: given(part.near), far: given(part.far) }
            },
        )
    }

    #[test]
    fn a_ray_in_a_wall_touches_the_box() {
        for x in [0.0, 1.0, -0.0] {
            for dz in [1.0, -1.0] {
                for part in parts(Ray::new([x, 0.5, 0.5 - dz], [0.0, -0.0, dz])) {
                    assert!(!part.is_empty() && part.near <= 0.5 && part.far >= 1.5, "{part:?}");
                }
            }
        }
        let [_, beside] = parts(Ray::new([1.0f32.next_up(), 0.5, -1.0], [0.0, 0.0, 1.0]));
        assert!(beside.is_empty());
        for part in parts(Ray::new([1.0 + 1e-5, 0.5, -1.0], [0.0, 0.0, 1.0])) {
            assert!(part.is_empty());
        }
    }

    #[test]
    fn limits_are_inclusive_and_may_be_negative() {
        let ray = Ray::new([0.5, 0.5, 3.0], [0.0, 0.0, 1.0]);
        assert!(parts(ray).iter().all(Interval::is_empty));
        for part in parts(ray.with_limits(-10.0, -2.0)) {
            assert!(!part.is_empty() && part.near <= -3.0 && part.far == -2.0);
        }
        assert!(parts(ray.with_limits(-1.9, 5.0)).iter().all(Interval::is_empty));
        for part in parts(ray.with_limits(f32::NEG_INFINITY, -3.0)) {
            assert!(!part.is_empty());
        }
    }

    #[test]
    fn frames_at_the_ends_of_the_range_take_wide_boxes() {
        for (size, narrow) in [(1e-30, false), (1e-17, true), (1e35, true), (3e38, false)] {
            let ray = Ray::new([size, 0.0, 0.0], [1.0, 0.0, 0.0]).prepare(size).expect("a ray");
            assert_eq!(NarrowSlab::new(Scalar, &ray).is_some(), narrow, "{size}");
        }
    }
}
