//! From a ray as it is given to one that is prepared, in two steps: boxes can be tested before primitives.

use super::exponents::{
    EXPONENT, ORDINARY, exponent_above, largest_bits, powers, reciprocals, rounded, scales_below,
};
use super::frame::{PreparedRay, SLOWEST, Shear, TINY};
use super::slab::{NarrowSlab, Scales};
use super::{Axis, Ray};
use crate::exact::Line;
use crate::math::Extent;
use crate::math::float::{narrow_power_of_two, power_of_two};
use crate::math::rounding::Round;
use crate::simd::{Lanes, SMALL, Scalar, Simd, Width};

impl Ray {
    /// The line on which it lies.
    #[inline(always)]
    pub(crate) fn line(&self) -> Line {
        Line { origin: self.origin, direction: self.direction }
    }

    /// The lower limit: the largest float for what is beyond.
    #[inline(always)]
    fn least(&self) -> f32 {
        if self.t_min < -f32::MAX { -f32::MAX } else { self.t_min }
    }

    /// The upper limit, likewise.
    #[inline(always)]
    fn most(&self) -> f32 {
        if self.t_max > f32::MAX { f32::MAX } else { self.t_max }
    }

    /// What boxes need of an ordinary ray, and what the rest follows from. `None` for a ray that hits nothing by
    /// definition, for those at the ends of the floats, and for those that begin [far outside](Extent).
    ///
    /// What all rays wait for is the way over the reciprocals to the first boxes; so division waits for nothing, the frame is
    /// found meanwhile, and both meet behind it. All is done in vectors, also what is one number, and
    /// all doubts are one question: every ray comes here, and many only to find that it hits nothing.
    #[inline(always)]
    pub(crate) fn set_out<S: Simd>(
        &self,
        s: S,
        extent: Extent,
    ) -> Option<(LateRay<S>, NarrowSlab)> {
        let splat = |x: f32| Width::<4>::splat(s, x);
        let [from, along] = self.rows();
        // Not the reciprocal of a limit, which may be a subnormal number: that takes some processors very long.
        let speed = s.three(Width::<4>::load(s, &along).abs());
        let inverse = splat(1.0).div(speed);
        // Limits that are no floats become the largest ones. A NaN stays, wherever it is; what else is infinite is no ordinary ray.
        let o = splat(-f32::MAX).max(Width::<4>::load(s, &from));
        let d = splat(f32::MAX).min(Width::<4>::load(s, &along));
        let distance = o.abs();
        let fastest = s.largest_of_three(speed);
        let most = splat(ORDINARY);
        let near = splat(extent.near).min(most);
        let reach = s.largest_of_three(distance).max(splat(extent.scene));
        // These comparisons refuse a NaN, which may have been lost above.
        let least = splat(1.0 / ORDINARY).less_or_equal(fastest.min(reach));
        let sound = distance.less_or_equal(near) & speed.less(most) & reach.less(most) & least;
        if !(sound & 7 == 7 && o.less_or_equal(d) & 8 != 0) {
            return None;
        }
        // 2^-e with 2^e above all coordinates, and 2^l below the fastest component.
        let space = scales_below(s, reach);
        let length = powers(s, fastest);
        let inverse = inverse.min(reciprocals(s, length).mul(splat(1.0 / SLOWEST)));
        let scales = Scales { t: length.mul(space), space, reach };
        let [t_scale, ..] = array::<S>(scales.t);
        let [.., t_min] = array::<S>(o.mul(splat(t_scale)));
        let [.., t_max] = array::<S>(d.mul(splat(t_scale)));
        let [t_min, t_max] = framed([t_min, t_max]);
        let slab = NarrowSlab::new(s, [o, d, inverse], &scales, t_min);
        let fastest = fastest.less_or_equal(speed);
        Some((LateRay { s, o, d, inverse, space, length, t_scale, t_min, t_max, fastest }, slab))
    }

    /// The same with all that traversal needs.
    #[inline(always)]
    pub(crate) fn prepare_with<S: Simd>(
        &self,
        s: S,
        extent: Extent,
    ) -> Option<(PreparedRay, NarrowSlab)> {
        let (ray, slab) = self.set_out(s, extent)?;
        Some((ray.prepare(), slab))
    }

    /// The same without boxes, of any ray that can hit something.
    pub(crate) fn prepare(&self, extent: Extent) -> Option<PreparedRay> {
        if SMALL {
            return self.prepare_any(extent.scene);
        }
        match self.prepare_with(Scalar, extent) {
            Some((ray, _)) => Some(ray),
            None => self.prepare_any(extent.scene),
        }
    }

    /// The axis of the largest component of the direction, the last of equal ones: of these bits, but for the sign.
    fn depth_axis(&self, longest: u32) -> Axis {
        let [_, y, z] = &self.direction;
        match () {
            () if z.abs().to_bits() == longest => Axis::Z,
            () if y.abs().to_bits() == longest => Axis::Y,
            () => Axis::X,
        }
    }

    /// What traversal needs of any ray, or `None` for one that hits nothing by definition. Ordinary rays get the same as from
    /// [`prepare_with`](Self::prepare_with), by longer ways.
    #[inline(never)]
    pub(crate) fn prepare_any(&self, reach: f32) -> Option<PreparedRay> {
        let (farthest, longest) = (largest_bits(&self.origin), largest_bits(&self.direction));
        let (t_min, t_max) = (self.least(), self.most());
        let finite = farthest < EXPONENT && longest < EXPONENT;
        if !(finite && longest > 0 && t_min <= t_max) {
            return None;
        }
        let reach = farthest.max(reach.to_bits());
        let exponent = exponent_above(reach).clamp(-126, 126);
        let scale = narrow_power_of_two(-exponent);
        // Subnormal components have no exponent of their own: a first step brings them up.
        let lift = if longest < f32::MIN_POSITIVE.to_bits() { 24 } else { 0 };
        let up = narrow_power_of_two(lift);
        let length = exponent_above((f32::from_bits(longest) * up).to_bits()) - 1;
        let down = narrow_power_of_two(-length);
        let (mut origin, mut direction) = ([0.0; 4], [0.0; 4]);
        for k in 0..3 {
            origin[k] = self.origin[k] * scale;
            direction[k] = self.direction[k] * up * down;
        }
        let depth = self.depth_axis(longest);
        let pace = 1.0 / direction[depth as usize].abs();
        let t_exponent = length - lift - exponent;
        let below = rounded(t_min, t_exponent, Round::Below);
        let above = rounded(t_max, t_exponent, Round::Above);
        let [below, above] = framed([below, above]);
        Some(PreparedRay {
            given: Ray { t_min, t_max, ..*self },
            scale,
            origin,
            direction,
            t_scale: power_of_two(t_exponent),
            t_min: below,
            t_max: above,
            shear: Shear::new(Scalar, (depth, pace), &origin, &direction, scale, below),
        })
    }
}

/// Limits in the frame, from such that underflow has moved, at most by the least normal number: outwards by far more than that, and by
/// far less than half of what depths of meetings are off by at least.
#[inline(always)]
fn framed([t_min, t_max]: [f32; 2]) -> [f32; 2] {
    [t_min - TINY / 8.0, t_max + TINY / 8.0]
}

/// An ordinary ray. Until it is prepared only boxes can be tested, which is all that rays beside the scene need.
pub(crate) struct LateRay<S: Simd> {
    s: S,
    /// Origin and direction as they were given, each with a limit behind it.
    o: <S as Width<4>>::V,
    d: <S as Width<4>>::V,
    /// The reciprocals of the sizes of the direction's components.
    inverse: <S as Width<4>>::V,
    /// From given coordinates to the frame's.
    space: <S as Width<4>>::V,
    /// The length of the direction by which it is scaled, a power of two.
    length: <S as Width<4>>::V,
    t_scale: f32,
    t_min: f32,
    pub t_max: f32,
    /// The lanes with the largest component of the direction.
    fastest: u32,
}

impl<S: Simd> LateRay<S> {
    /// From given `t` to the frame's, a power of two.
    #[inline(always)]
    pub fn t_scale(&self) -> f64 {
        f64::from(self.t_scale)
    }

    /// The axis of the largest component of the direction, the last of equal ones.
    #[inline(always)]
    fn depth(&self) -> Axis {
        match self.fastest & 7 {
            4.. => Axis::Z,
            2.. => Axis::Y,
            _ => Axis::X,
        }
    }
}

/// A ray that is prepared when that is needed. What comes of it is kept elsewhere: it is lent to what is out of line, and
/// must be in memory for that, but this can stay in registers.
pub(crate) trait Late {
    fn prepare(&self) -> PreparedRay;
}

impl<S: Simd> Late for LateRay<S> {
    #[inline(always)]
    fn prepare(&self) -> PreparedRay {
        let LateRay { s, o, d, inverse, space, length, t_min, t_max, .. } = *self;
        let origin = array::<S>(o.mul(space));
        let direction = array::<S>(d.mul(reciprocals(s, length)));
        let (depth, [scale, ..]) = (self.depth(), array::<S>(space));
        let pace = array::<S>(inverse.mul(length))[depth as usize];
        PreparedRay {
            given: Ray::of_rows([array::<S>(o), array::<S>(d)]),
            scale,
            origin,
            direction,
            t_scale: self.t_scale(),
            t_min,
            t_max,
            shear: Shear::new(s, (depth, pace), &origin, &direction, scale, t_min),
        }
    }
}

/// Of a ray that is prepared already, who is not asked.
pub(crate) struct Early;

impl Late for Early {
    #[inline(always)]
    fn prepare(&self) -> PreparedRay {
        PreparedRay::BLANK
    }
}

/// The lanes of a vector.
#[inline(always)]
fn array<S: Simd>(v: <S as Width<4>>::V) -> [f32; 4] {
    let mut lanes = [0.0; 4];
    v.store(&mut lanes);
    lanes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rounding::UNIT32;
    use crate::simd::{Kernel, dispatch};
    use std::format;
    use std::string::String;

    /// Prepares a ray by vectors.
    struct ByVectors(Ray);

    impl Kernel for ByVectors {
        type Output = Option<PreparedRay>;

        fn run<S: Simd>(self, s: S) -> Self::Output {
            self.0.prepare_with(s, Extent::new(3.0, 1)).map(|(ray, _)| ray)
        }
    }

    /// What is said of a prepared ray, without the lanes that mean nothing.
    fn said(ray: PreparedRay) -> String {
        let three = |[x, y, z, _]: [f32; 4]| [x, y, z, 0.0];
        let (origin, direction) = (three(ray.origin), three(ray.direction));
        format!("{:?}", PreparedRay { origin, direction, ..ray })
    }

    #[test]
    fn vectors_prepare_a_ray_as_the_longer_way_does() {
        let least = [f32::NEG_INFINITY, f32::MIN, -7e9, -1.0, 0.0, 1e-4, 2.5, f32::INFINITY];
        let most = [f32::NEG_INFINITY, -1.0, 0.0, 2.5, 7e9, f32::MAX, f32::INFINITY];
        for (t_min, t_max) in least.into_iter().flat_map(|a| most.map(|b| (a, b))) {
            for direction in [[1.0, 0.5, -0.25], [-3e-3, 1e-3, 2e-3], [5e8, -1.0, 5e8]] {
                let ray = Ray::new([0.5, -2.0, 40.0], direction).with_limits(t_min, t_max);
                let (long, short) = (ray.prepare_any(3.0), dispatch(ByVectors(ray)));
                assert_eq!(short.map(said), long.map(said), "{ray:?}");
            }
        }
    }

    #[test]
    fn rays_that_hit_nothing_are_not_prepared() {
        let good = Ray::new([0.0; 3], [0.0, 0.0, 1.0]);
        assert!(good.prepare(Extent::new(1.0, 1)).is_some());
        for bad in [
            Ray { origin: [f32::NAN, 0.0, 0.0], ..good },
            Ray { origin: [0.0, f32::INFINITY, 0.0], ..good },
            Ray { direction: [0.0, -0.0, 0.0], ..good },
            Ray { direction: [0.0, f32::NEG_INFINITY, 0.0], ..good },
            Ray { direction: [0.0, f32::NAN, 1.0], ..good },
            good.with_limits(f32::NAN, 1.0),
            good.with_limits(0.0, f32::NAN),
            good.with_limits(2.0, 1.0),
            good.with_limits(f32::INFINITY, f32::INFINITY),
        ] {
            assert!(bad.prepare(Extent::new(1.0, 1)).is_none(), "{bad:?}");
        }
        assert!(good.with_limits(1.0, 1.0).prepare(Extent::new(1.0, 1)).is_some());
        assert!(
            good.with_limits(f32::NEG_INFINITY, f32::INFINITY)
                .prepare(Extent::new(1.0, 1))
                .is_some()
        );
    }

    fn three([x, y, z, _]: [f32; 4]) -> [f32; 3] {
        [x, y, z]
    }

    #[test]
    fn the_frame_holds_everything_whatever_the_scale() {
        let sizes = [1e-45, 1e-44, 3e-39, 1e-20, 0.3, 1.0, 7e5, 3e38, f32::MAX];
        for origin in sizes {
            for reach in sizes.into_iter().chain([0.0, f32::INFINITY]) {
                for length in sizes {
                    let ray = Ray::new([origin, 0.0, -origin], [length, -length / 3.0, 0.0]);
                    let ray = ray.prepare(Extent::new(reach, 1)).expect("a valid ray");
                    let longest = f32::from_bits(largest_bits(&three(ray.direction)));
                    assert!((1.0..2.0).contains(&longest), "{length} {longest}");
                    let size = origin.max(reach);
                    let reach = size.min(f32::MAX) * ray.scale;
                    assert!(largest_bits(&three(ray.origin)) <= reach.to_bits() && reach <= 4.0);
                    if size >= 1e-37 {
                        assert!(reach >= 0.5, "{size} {reach}");
                    }
                    // The same point from both descriptions.
                    let given = f64::from(length) * f64::from(ray.scale);
                    assert_eq!(given, f64::from(ray.direction[0]) * ray.t_scale);
                    assert!((-TINY..=0.0).contains(&ray.t_min));
                }
            }
        }
    }

    #[test]
    fn depth_is_the_axis_of_the_longest_component() {
        for (direction, axes, sign) in [
            ([0.0, 1.0, -3.0], [0, 1, 2], -1.0),
            ([0.0, 4.0, -3.0], [2, 0, 1], 1.0),
            ([-5.0, 4.0, -3.0], [1, 2, 0], -1.0),
            ([2.0, 2.0, 2.0], [0, 1, 2], 1.0),
        ] {
            let shear =
                Ray::new([0.0; 3], direction).prepare(Extent::new(1.0, 1)).expect("a ray").shear;
            assert_eq!(
                (shear.axes.map(|axis| axis as usize), shear.depth_scale.signum()),
                (axes, sign),
                "{direction:?}"
            );
            assert!(shear.blur() <= 6.0 * UNIT32 && (1.0..2.0).contains(&shear.depth_rate));
        }
    }
}
