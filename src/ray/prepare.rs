//! From a ray as it is given to one that is prepared, in two steps: boxes can be tested before primitives.

use super::exponents::{
    EXPONENT, ORDINARY, above, below, exponent_above, exponent_bits, is_ordinary, largest_bits,
    rounded, scale_below,
};
use super::frame::{PreparedRay, SLOWEST, Shear};
use super::slab::{NarrowSlab, Scales};
use super::{Axis, Ray};
use crate::exact::Line;
use crate::math::float::{narrow_power_of_two, power_of_two};
use crate::math::rounding::Round;
use crate::simd::{Lanes, SMALL, Scalar, Simd, Width};

impl Ray {
    /// The line on which it lies.
    #[inline(always)]
    pub(crate) fn line(&self) -> Line {
        Line { origin: self.origin, direction: self.direction }
    }

    /// The limits, with the largest floats for what is beyond.
    #[inline(always)]
    fn finite_limits(&self) -> [f32; 2] {
        let t_min = if self.t_min < -f32::MAX { -f32::MAX } else { self.t_min };
        let t_max = if self.t_max > f32::MAX { f32::MAX } else { self.t_max };
        [t_min, t_max]
    }

    /// What boxes need of an ordinary ray, and what the rest follows from. `None` for a ray that hits nothing by
    /// definition, and for those at the ends of the floats. `reach` is the largest coordinate of the scene,
    /// infinite if it is not representable.
    ///
    /// What all rays wait for is the way from the largest component over the reciprocals to the first boxes; so
    /// division does not wait for the frame, and both meet behind it.
    #[inline(always)]
    pub(crate) fn set_out<S: Simd>(&self, s: S, reach: f32) -> Option<(LateRay<S>, NarrowSlab)> {
        let splat = |x: f32| Width::<4>::splat(s, x);
        let [from, along] = self.rows();
        let (o, d) = (Width::<4>::load(s, &from), Width::<4>::load(s, &along));
        let (distance, speed) = (o.abs(), d.abs());
        let fastest = s.largest_of_three(speed);
        let inverse = splat(1.0).div(speed.max(fastest.mul(splat(SLOWEST))));
        let depth = match fastest.less_or_equal(speed) & 7 {
            4.. => Axis::Z,
            2.. => Axis::Y,
            _ => Axis::X,
        };
        let [fastest, ..] = array::<S>(fastest);
        let [farthest, ..] = array::<S>(s.largest_of_three(distance));
        let reach = if farthest > reach { farthest } else { reach };
        let [t_min, t_max] = self.finite_limits();
        // These comparisons refuse a NaN, which may have been lost above.
        let within = splat(ORDINARY);
        let finite = distance.less(within) & speed.less(within) & 7 == 7 && t_min <= t_max;
        if !(finite && is_ordinary(fastest) && is_ordinary(reach)) {
            return None;
        }
        // 2^e above all coordinates and 2^l below the fastest component: by exponents, whose zero is 127.
        let (e, l) = (exponent_bits(reach), exponent_bits(fastest));
        let scale = scale_below(reach);
        let t_scale = f32::from_bits((126 << 23) + l - e);
        let (t_min_below, t_max_above) = (below(t_min, t_scale), above(t_max, t_scale));
        let scales = Scales { t: t_scale, space: scale };
        let backwards = self.direction.map(f32::is_sign_negative);
        let slab = NarrowSlab::new(s, [o, d, inverse], scales, reach, t_min_below, backwards);
        let ray = LateRay {
            given: Ray { t_min, t_max, ..*self },
            origin: o.mul(splat(scale)),
            direction: d.mul(splat(f32::from_bits((254 << 23) - l))),
            scales,
            t_min: t_min_below,
            t_max: t_max_above,
            depth,
        };
        Some((ray, slab))
    }

    /// The same with all that traversal needs.
    #[inline(always)]
    pub(crate) fn prepare_with<S: Simd>(
        &self,
        s: S,
        reach: f32,
    ) -> Option<(PreparedRay, NarrowSlab)> {
        let (ray, slab) = self.set_out(s, reach)?;
        Some((ray.prepare(), slab))
    }

    /// The same without boxes, of any ray that can hit something.
    pub(crate) fn prepare(&self, reach: f32) -> Option<PreparedRay> {
        if SMALL {
            return self.prepare_any(reach);
        }
        match self.prepare_with(Scalar, reach) {
            Some((ray, _)) => Some(ray),
            None => self.prepare_any(reach),
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
        let [t_min, t_max] = self.finite_limits();
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
        let t_exponent = length - lift - exponent;
        let t_min_below = rounded(t_min, t_exponent, Round::Below);
        Some(PreparedRay {
            given: Ray { t_min, t_max, ..*self },
            scale,
            origin,
            direction,
            t_scale: power_of_two(t_exponent),
            t_min: t_min_below,
            t_max: rounded(t_max, t_exponent, Round::Above),
            shear: Shear::new(depth, &origin, &direction, scale, t_min_below),
        })
    }
}

/// An ordinary ray. Until it is prepared only boxes can be tested, which is all that rays beside the scene need.
pub(crate) struct LateRay<S: Simd> {
    given: Ray,
    origin: <S as Width<4>>::V,
    direction: <S as Width<4>>::V,
    scales: Scales,
    t_min: f32,
    pub t_max: f32,
    depth: Axis,
}

impl<S: Simd> LateRay<S> {
    /// From given `t` to the frame's, a power of two.
    #[inline(always)]
    pub fn t_scale(&self) -> f64 {
        f64::from(self.scales.t)
    }
}

/// A ray that is prepared when that is needed. What comes of it is kept elsewhere: it is lent to what is out of line, and
/// must be in memory for that, but this can stay in registers.
pub(crate) trait Late {
    /// Whether to prepare it when it enters the first box, in the time that the next one takes to come from memory, or not before
    /// it comes to a leaf.
    const SOON: bool = true;

    fn prepare(&self) -> PreparedRay;
}

/// A ray that is likely to come to no leaf, as three of four that come to an instance.
pub(crate) struct Passing<L>(pub L);

impl<L: Late> Late for Passing<L> {
    const SOON: bool = false;

    #[inline(always)]
    fn prepare(&self) -> PreparedRay {
        self.0.prepare()
    }
}

impl<S: Simd> Late for LateRay<S> {
    #[inline(always)]
    fn prepare(&self) -> PreparedRay {
        let LateRay { given, scales: Scales { t, space }, t_min, t_max, depth, .. } = *self;
        let (origin, direction) = (array::<S>(self.origin), array::<S>(self.direction));
        PreparedRay {
            given,
            scale: space,
            origin,
            direction,
            t_scale: f64::from(t),
            t_min,
            t_max,
            shear: Shear::new(depth, &origin, &direction, space, t_min),
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

    #[test]
    fn rays_that_hit_nothing_are_not_prepared() {
        let good = Ray::new([0.0; 3], [0.0, 0.0, 1.0]);
        assert!(good.prepare(1.0).is_some());
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
            assert!(bad.prepare(1.0).is_none(), "{bad:?}");
        }
        assert!(good.with_limits(1.0, 1.0).prepare(1.0).is_some());
        assert!(good.with_limits(f32::NEG_INFINITY, f32::INFINITY).prepare(1.0).is_some());
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
                    let ray = ray.prepare(reach).expect("a valid ray");
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
                    assert_eq!(ray.t_min, 0.0);
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
            let shear = Ray::new([0.0; 3], direction).prepare(1.0).expect("a ray").shear;
            assert_eq!(
                (shear.axes.map(|axis| axis as usize), shear.depth_scale.signum()),
                (axes, sign),
                "{direction:?}"
            );
            assert!(shear.blur <= 6.0 * UNIT32 && (1.0..2.0).contains(&shear.depth_rate));
        }
    }
}
