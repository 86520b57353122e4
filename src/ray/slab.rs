//! A ray against boxes.

use glam::DVec3;

use super::{Interval, PreparedRay};
use crate::math::rounding::{UNIT32, f32_above, f32_below, gamma};
use crate::math::{Aabb, wide};
use crate::simd::{Lanes, SMALL, Simd, Width, mul_add};

/// A ray made ready for boxes.
///
/// Conservative: if a point of the ray with `t_min <= t <= t_bound` lies, in real arithmetic, in the
/// closed box, the part is not empty and holds that `t`. A box that is only nearly touched may be
/// reported too. All `t` are those of the frame.
///
/// A zero component of the direction is allowed: the walls are chosen by its sign bit.
pub(crate) trait Slab: Copy {
    /// The part of the ray inside the box between two corners, lent where they are.
    fn part(&self, corners: [&[f32; 3]; 2], t_bound: f32) -> Interval<f32>;

    /// The same by a backend's vectors of an axis a lane: the same bits.
    #[inline(always)]
    fn part_by<S: Simd>(&self, _: S, aabb: &Aabb, t_bound: f32) -> Interval<f32> {
        self.part(aabb.corners(), t_bound)
    }

    /// The same for `N` boxes at once.
    fn wide<'a, S: Width<N> + 'a, const N: usize>(&'a self, s: S) -> impl WideBoxes<S, N> + 'a;
}

/// A [`Slab`] in the vectors of a backend.
pub(crate) trait WideBoxes<S: Width<N>, const N: usize> {
    /// The lanes whose boxes the ray enters up to `t_bound`, the same in each lane, and where.
    /// `walls` are lower x y z, then upper x y z.
    fn entered<const FUSED: bool>(&self, walls: &[[f32; N]; 6], t_bound: S::V) -> (u32, S::V);
}

/// Boxes in `f32`, for ordinary rays.
///
/// With `r` the scaled reciprocal of a component, the distance to a wall is `wall * r + shift`, where
/// `shift` holds `-origin * r` and all that rounding may add. `docs/METHODS.md` derives the padding.
#[derive(Clone, Copy)]
pub(crate) struct NarrowSlab {
    /// Each with the sign bit of the direction, by which the ray runs from the lower wall to the upper one or back.
    pub(super) reciprocal: [f32; 4],
    pub(super) near_shift: [f32; 4],
    pub(super) far_shift: [f32; 4],
    pub(super) t_min: f32,
}

/// The padding of walls: of the origin's coordinate, of the reach in the direction's length, and of the reach.
pub(super) const RELATIVE_PAD: f32 = 6.0 * UNIT32;
pub(super) const NEGLIGIBLE: f32 = 1.0 / (1u64 << 57) as f32;
pub(super) const CONSTANT_PAD: f32 = 12.0 * UNIT32;

/// From given numbers to the frame's, powers of two, and what is to be brought there; the same in each lane.
#[derive(Clone, Copy)]
pub(super) struct Scales<V> {
    /// Of `t`.
    pub t: V,
    /// Of coordinates.
    pub space: V,
    /// The largest coordinate of the scene and the origin, as given.
    pub reach: V,
}

impl NarrowSlab {
    /// Nothing in particular.
    pub const BLANK: Self =
        NarrowSlab { reciprocal: [0.0; 4], near_shift: [0.0; 4], far_shift: [0.0; 4], t_min: 0.0 };

    /// The ray from `origin` along `direction`, as given. `inverse` are the reciprocals of the sizes of the direction's
    /// components, and `t_min` is the frame's.
    #[inline(always)]
    pub(super) fn new<S: Width<4>>(
        s: S,
        [origin, direction, inverse]: [S::V; 3],
        scales: &Scales<S::V>,
        t_min: f32,
    ) -> Self {
        let mut slab = NarrowSlab { t_min, ..Self::BLANK };
        let [reciprocal, near_shift, far_shift] =
            walls::<S, 4>(s, [origin, direction, inverse], scales);
        reciprocal.store(&mut slab.reciprocal);
        near_shift.store(&mut slab.near_shift);
        far_shift.store(&mut slab.far_shift);
        slab
    }

    /// In the vectors of a backend.
    #[inline(always)]
    pub fn boxes<S: Width<N>, const N: usize>(&self, s: S) -> NarrowBoxes<S, S::V> {
        NarrowBoxes {
            reciprocal: splat(s, self.reciprocal),
            near_shift: splat(s, self.near_shift),
            far_shift: splat(s, self.far_shift),
            t_min: s.splat(self.t_min),
            first: [0, 1, 2].map(|k| {
                // All ones if the ray runs back: a mask, and numbers of floats, are the least that each bundle can do with.
                let back = (self.reciprocal[k].to_bits() as i32 >> 31) as usize;
                k * N + ((3 * N) & back)
            }),
            s,
        }
    }

    /// The same for boxes that are wider by `by`, in given coordinates, on all sides.
    pub fn widened(&self, by: f32) -> Self {
        let mut slab = NarrowSlab { ..*self };
        for k in 0..3 {
            let shifts = [self.reciprocal[k], self.near_shift[k], self.far_shift[k]];
            [slab.near_shift[k], slab.far_shift[k]] = wider(shifts, by);
        }
        slab
    }
}

/// The shifts of walls whose reciprocal comes first, for an origin that may be `off`.
///
/// Three roundings of a shift are granted, of which one sum and a product use two.
pub(super) fn wider([reciprocal, near_shift, far_shift]: [f32; 3], off: f32) -> [f32; 2] {
    let wider = reciprocal.abs() * (off * (1.0 + 8.0 * UNIT32));
    let (near, far) = (near_shift - wider, far_shift + wider);
    [near - near.abs() * (4.0 * UNIT32), far + far.abs() * (4.0 * UNIT32)]
}

impl Slab for NarrowSlab {
    /// No division, no branch.
    fn part(&self, [lower, upper]: [&[f32; 3]; 2], t_bound: f32) -> Interval<f32> {
        let (mut near, mut far) = (self.t_min, t_bound);
        for k in 0..3 {
            let r = self.reciprocal[k];
            let (lower, upper) = (lower[k], upper[k]);
            let (first, last) = if r.is_sign_negative() { (upper, lower) } else { (lower, upper) };
            let enter = first * r + self.near_shift[k];
            let leave = last * r + self.far_shift[k];
            near = if enter > near { enter } else { near };
            far = if leave < far { leave } else { far };
        }
        Interval { near, far }
    }

    /// The wall that comes first is the one whose product is less, as rounding keeps order.
    #[inline(always)]
    fn part_by<S: Simd>(&self, s: S, aabb: &Aabb, t_bound: f32) -> Interval<f32> {
        if SMALL {
            return self.part(aabb.corners(), t_bound);
        }
        let ([a, b, c], [x, y, z]) = (aabb.lower, aabb.upper);
        let r = Width::<4>::load(s, &self.reciprocal);
        let lower = Width::<4>::load(s, &[a, b, c, 0.0]).mul(r);
        let upper = Width::<4>::load(s, &[x, y, z, 0.0]).mul(r);
        let enter = lower.min(upper).add(Width::<4>::load(s, &self.near_shift));
        let leave = lower.max(upper).add(Width::<4>::load(s, &self.far_shift));
        let near = s.largest_of_three(enter).max(Width::<4>::splat(s, self.t_min));
        let far = s.least_of_three(leave).min(Width::<4>::splat(s, t_bound));
        let [mut first, mut last] = [[0.0; 4]; 2];
        near.store(&mut first);
        far.store(&mut last);
        Interval { near: first[0], far: last[0] }
    }

    #[inline(always)]
    fn wide<'a, S: Width<N> + 'a, const N: usize>(&'a self, s: S) -> impl WideBoxes<S, N> + 'a {
        self.boxes(s)
    }
}

/// The scaled reciprocals, and the shifts of near and far walls: see [`NarrowSlab`].
#[inline(always)]
pub(super) fn walls<S: Width<N>, const N: usize>(
    s: S,
    [origin, direction, inverse]: [S::V; 3],
    Scales { t, space, reach }: &Scales<S::V>,
) -> [S::V; 3] {
    // What can be computed before the reciprocals and the frame are there, which takes the longest.
    let behind = s.splat(0.0).sub(origin).flipped_by(direction);
    let pad = origin.abs().mul(s.splat(RELATIVE_PAD)).add(reach.mul(s.splat(NEGLIGIBLE)));
    let constant = reach.mul(*space).mul(s.splat(CONSTANT_PAD));
    let inverse = inverse.mul(*t);
    [
        inverse.with_sign_of(direction),
        inverse.mul(behind.sub(pad)).sub(constant),
        inverse.mul(behind.add(pad)).add(constant),
    ]
}

#[inline(always)]
fn splat<S: Width<N>, const N: usize>(s: S, [x, y, z, _]: [f32; 4]) -> [S::V; 3] {
    [s.splat(x), s.splat(y), s.splat(z)]
}

/// A [`NarrowSlab`] with each number in all lanes.
pub(crate) struct NarrowBoxes<S, V> {
    s: S,
    reciprocal: [V; 3],
    near_shift: [V; 3],
    far_shift: [V; 3],
    t_min: V,
    /// Where the walls that the ray passes first begin, among the numbers of lower and upper ones.
    first: [usize; 3],
}

impl<S: Width<N>, const N: usize> WideBoxes<S, N> for NarrowBoxes<S, S::V> {
    #[inline(always)]
    fn entered<const FUSED: bool>(&self, walls: &[[f32; N]; 6], t_bound: S::V) -> (u32, S::V) {
        let Interval { near, far } = self.part::<FUSED, N>(walls, t_bound);
        (near.less_or_equal(far), near)
    }
}

impl<S, V: Copy> NarrowBoxes<S, V> {
    /// The parts inside the boxes, up to `t_bound`.
    #[inline(always)]
    pub fn part<const FUSED: bool, const N: usize>(
        &self,
        walls: &[[f32; N]; 6],
        t_bound: V,
    ) -> Interval<V>
    where
        S: Width<N, V = V>,
        V: Lanes<N>,
    {
        let [x, y, z] = [
            self.between::<FUSED, N>(walls, 0),
            self.between::<FUSED, N>(walls, 1),
            self.between::<FUSED, N>(walls, 2),
        ];
        // In pairs, so that they wait less for each other.
        let near = x.near.max(y.near).max(z.near.max(self.t_min));
        let far = x.far.min(y.far).min(z.far.min(t_bound));
        Interval { near, far }
    }

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
        let first = row(walls, self.first[k]);
        let last = row(walls, (2 * k + 3) * N - self.first[k]);
        let r = self.reciprocal[k];
        Interval {
            near: mul_add::<V, FUSED, N>(self.s.load(first), r, self.near_shift[k]),
            far: mul_add::<V, FUSED, N>(self.s.load(last), r, self.far_shift[k]),
        }
    }
}

/// The walls whose numbers begin `at`.
#[inline(always)]
fn row<const N: usize>(walls: &[[f32; N]; 6], at: usize) -> &[f32; N] {
    let rest = walls.as_flattened().get(at..);
    rest.and_then(|rest| rest.first_chunk()).unwrap_or(&walls[0])
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
#[derive(Clone, Copy)]
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
    fn part(&self, [lower, upper]: [&[f32; 3]; 2], t_bound: f32) -> Interval<f32> {
        let part = self.clip(wide(*lower), wide(*upper), f64::from(t_bound));
        Interval { near: f32_below(part.near), far: f32_above(part.far) }
    }

    #[inline(always)]
    fn wide<'a, S: Width<N> + 'a, const N: usize>(&'a self, s: S) -> impl WideBoxes<S, N> + 'a {
        (self, s)
    }
}

/// Lane by lane.
impl<L: Slab, S: Width<N>, const N: usize> WideBoxes<S, N> for (&L, S) {
    fn entered<const FUSED: bool>(&self, walls: &[[f32; N]; 6], t_bound: S::V) -> (u32, S::V) {
        let (mut mask, mut near, mut bounds) = (0, [0.0; N], [0.0; N]);
        t_bound.store(&mut bounds);
        for (lane, near) in near.iter_mut().enumerate() {
            let corner = |first: usize| [0, 1, 2].map(|k| walls[first + k][lane]);
            let (lower, upper) = (corner(0), corner(3));
            let part = self.0.part([&lower, &upper], bounds[lane]);
            // A lane without a child is an empty box with infinite walls.
            let entered = !part.is_empty() && lower[0] <= upper[0];
            mask |= u32::from(entered) << lane;
            *near = part.near;
        }
        (mask, self.1.load(&near))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Extent;
    use crate::ray::Ray;
    use crate::simd::Scalar;

    const UNIT_BOX: Aabb = Aabb { lower: [0.0; 3], upper: [1.0; 3] };

    fn parts(ray: Ray) -> [Interval<f32>; 2] {
        let ray = ray.prepare(Extent::new(1.0, 1)).expect("a valid ray");
        let (_, narrow) =
            ray.given.prepare_with(Scalar, Extent::new(1.0, 1)).expect("an ordinary ray");
        // In given units, as the frame's are twice as long or half.
        let corners = UNIT_BOX.corners();
        [narrow.part(corners, ray.t_max), WideSlab::new(&ray).part(corners, ray.t_max)].map(
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
    fn rays_at_the_ends_of_the_floats_take_wide_boxes() {
        for (size, narrow) in [(1e-30, false), (1e-17, true), (1e17, true), (3e38, false)] {
            for ray in [
                Ray::new([size, 0.0, 0.0], [1.0, 0.0, 0.0]),
                Ray::new([size, 0.0, 0.0], [0.0, size, 1e-3 * size]),
                Ray::new([0.0, 0.0, size], [0.0, size, size]),
            ] {
                assert!(ray.prepare(Extent::new(size, 1)).is_some());
                assert_eq!(
                    ray.prepare_with(Scalar, Extent::new(size, 1)).is_some(),
                    narrow,
                    "{size}"
                );
            }
        }
    }
}
