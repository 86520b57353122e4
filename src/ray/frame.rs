//! A ray in a frame of its own, in which `f32` neither over- nor underflows.

use super::slab::{NarrowSlab, Scales};
use super::{Axis, Ray};
use crate::exact::Line;
use crate::math::float::{narrow_power_of_two, power_of_two};
use crate::math::rounding::{Round, UNIT32, f32_above, f32_below, scaled_by};
use crate::simd::{Lanes, SMALL, Scalar, Simd, Width};

/// A ray that can hit something, with what every box and primitive test needs of it.
///
/// The *frame* is the given space scaled by a power of two, so that the scene and the origin lie
/// within 4 of zero, and the direction is scaled by another, so that its largest component is between
/// 1 and 2. Scaling by powers of two is exact but for what falls below 2^-149, far below everything
/// that the tests grant. So one set of bounds holds for scenes of 1e-44 and of 1e38 and for directions
/// of any length. `t` counts in lengths of the scaled direction there: `t * t_scale`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PreparedRay {
    /// The ray as it was given.
    pub given: Ray,
    /// From given coordinates to the frame's: a power of two between 2^-126 and 2^126.
    pub scale: f32,
    /// The fourth lane of these two means nothing: four are one vector on most machines.
    pub origin: [f32; 4],
    pub direction: [f32; 4],
    /// From given `t` to the frame's, a power of two.
    pub t_scale: f64,
    /// Below all `t` of interest, in the frame.
    pub t_min: f32,
    /// Above all `t` of interest, in the frame: the given limit, or the largest float.
    pub t_max: f32,
    pub shear: Shear,
}

/// What the triangle test needs: the axis along which the ray moves most becomes the depth, and the
/// others are sheared so that the ray runs along it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shear {
    /// The axes x, y and depth of the sheared space, an even permutation.
    pub axes: [Axis; 3],
    /// The direction's x and y for each unit of depth: at most 1 in size, but for rounding.
    pub slope: [f32; 2],
    /// What x and y of a sheared vertex may be off for each unit of depth, whatever they are.
    pub blur: f32,
    /// From given coordinates along that axis to depths, which grow along the ray: the frame's scale or minus that.
    pub depth_scale: f32,
    /// The depth of the ray's origin.
    pub origin_depth: f32,
    /// Depth from there for each unit of `t` in the frame, between 1 and 2.
    pub depth_rate: f32,
    /// Below the depth of all `t` of interest, from the origin.
    pub low: f32,
}

/// Far below every bound on coordinates and squares in the frame, and far above what underflow can take
/// away.
pub(crate) const TINY: f32 = 1.0 / (1u128 << 100) as f32;

/// What depths that are computed from limits are widened by, for one rounding and for what the scaling of vertices took
/// below the frame's least float.
#[inline(always)]
fn depth_slack(depth: f32) -> f32 {
    // Infinite depths stay as they are.
    let size = if depth.abs() < f32::MAX { depth.abs() } else { f32::MAX };
    size * DEPTH_SLACK + TINY
}

pub(super) const DEPTH_SLACK: f32 = 4.0 * UNIT32;

/// What x and y of a sheared vertex may be off for each unit of depth and of the larger slope.
pub(super) const BLUR: f32 = 5.5 * UNIT32;

impl Shear {
    /// Above the depth of all `t` up to `t_bound`, from the origin.
    #[inline(always)]
    pub fn high(&self, t_bound: f32) -> f32 {
        let depth = t_bound * self.depth_rate;
        depth + depth_slack(depth)
    }
}

/// A component below this part of the largest moves the ray by less than what boxes are padded by: it counts
/// as this much, so that its reciprocal is finite.
pub(super) const SLOWEST: f32 = 1.0 / (1u64 << 62) as f32;

/// Ordinary scenes, origins and directions are smaller than this, and not all smaller than its reciprocal.
pub(super) const ORDINARY: f32 = (1u64 << 60) as f32;

#[inline(always)]
pub(super) fn is_ordinary(x: f32) -> bool {
    (1.0 / ORDINARY..ORDINARY).contains(&x)
}

const EXPONENT: u32 = f32::INFINITY.to_bits();

/// `2^n` by the bits of a float: its exponent.
#[inline(always)]
fn exponent_bits(x: f32) -> u32 {
    x.to_bits() & EXPONENT
}

/// The power of two that brings an ordinary number, and all that are not larger, below 1.
#[inline(always)]
pub(super) fn scale_below(x: f32) -> f32 {
    f32::from_bits((253 << 23) - exponent_bits(x))
}

/// The bits of the largest absolute value: floats without a sign are in the order of their bits, with
/// infinities and NaN above the others.
#[cfg_attr(target_os = "none", inline(never))]
pub(super) fn largest_bits(v: &[f32; 3]) -> u32 {
    v.iter().fold(0, |most, x| most.max(x.abs().to_bits()))
}

/// The exponent `e` with `|x| < 2^e` by the bits of `|x|`, at least -126; 129 for infinity.
fn exponent_above(bits: u32) -> i32 {
    (bits >> 23) as i32 - 126
}

/// `t * scale`, the scale a power of two, unless it is neither zero nor a normal float, but also when it is infinite.
#[inline(always)]
fn scaled(t: f32, scale: f32) -> Option<f32> {
    let product = t * scale;
    (product.abs() >= f32::MIN_POSITIVE || t == 0.0).then_some(product)
}

/// The largest float that is not above `t * scale`.
#[inline(always)]
fn below(t: f32, scale: f32) -> f32 {
    match scaled(t, scale) {
        Some(product) if product > f32::MAX => f32::MAX,
        Some(product) => product,
        None => rarely(f32_below, t, scale),
    }
}

/// The smallest float that is not below `t * scale`.
#[inline(always)]
fn above(t: f32, scale: f32) -> f32 {
    match scaled(t, scale) {
        Some(product) if product < -f32::MAX => -f32::MAX,
        Some(product) => product,
        None => rarely(f32_above, t, scale),
    }
}

/// `t * 2^n` of a finite `t`, which is a float unless it is not a normal one. Out of line, and without `f64`.
#[cfg_attr(target_os = "none", inline(always))]
#[cfg_attr(not(target_os = "none"), inline(never))]
fn rounded(t: f32, n: i32, round: Round) -> f32 {
    let in_floats = !SMALL && (-126..=127).contains(&n);
    let exact = if in_floats { scaled(t, narrow_power_of_two(n)) } else { None };
    match exact {
        Some(product) if product.abs() <= f32::MAX => product,
        _ => scaled_by(t, n, round),
    }
}

#[cold]
#[inline(never)]
fn rarely(round: fn(f64) -> f32, t: f32, scale: f32) -> f32 {
    round(f64::from(t) * f64::from(scale))
}

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

impl Shear {
    #[inline(always)]
    fn new(depth: Axis, origin: &[f32; 4], direction: &[f32; 4], scale: f32, t_min: f32) -> Self {
        let axes = depth.as_depth();
        let [kx, ky, depth] = axes.map(|axis| axis as usize);
        let depth_rate = direction[depth].abs();
        let inverse = 1.0 / depth_rate;
        let slope = [direction[kx] * inverse, direction[ky] * inverse];
        let [a, b] = [slope[0].abs(), slope[1].abs()];
        let sign = direction[depth].to_bits() & 1 << 31;
        let signed = |x: f32| f32::from_bits(x.to_bits() ^ sign);
        let low = t_min * depth_rate;
        Shear {
            axes,
            slope,
            blur: BLUR * if a > b { a } else { b },
            depth_scale: signed(scale),
            origin_depth: signed(origin[depth]),
            depth_rate,
            low: low - depth_slack(low),
        }
    }
}

impl PreparedRay {
    /// Nothing in particular.
    pub const BLANK: Self = PreparedRay {
        given: Ray::new([0.0; 3], [0.0; 3]),
        scale: 0.0,
        origin: [0.0; 4],
        direction: [0.0; 4],
        t_scale: 0.0,
        t_min: 0.0,
        t_max: 0.0,
        shear: Shear {
            axes: [Axis::X, Axis::Y, Axis::Z],
            slope: [0.0; 2],
            blur: 0.0,
            depth_scale: 0.0,
            origin_depth: 0.0,
            depth_rate: 0.0,
            low: 0.0,
        },
    };

    /// The line on which the ray lies.
    #[inline(always)]
    pub fn line(&self) -> Line {
        self.given.line()
    }

    /// Within all `t` of interest: the limits rounded inwards.
    #[inline(always)]
    pub fn t_inside(&self) -> [f32; 2] {
        let Ray { t_min, t_max, .. } = self.given;
        if SMALL {
            let n = self.t_exponent();
            return [rounded(t_min, n, Round::Above), rounded(t_max, n, Round::Below)];
        }
        [f32_above(f64::from(t_min) * self.t_scale), f32_below(f64::from(t_max) * self.t_scale)]
    }

    /// The nearest given `t` to a finite one of the frame.
    pub fn given_t(&self, t: f32) -> f32 {
        rounded(t, -self.t_exponent(), Round::Nearest)
    }

    /// `t_scale` is `2^n`, which is normal.
    fn t_exponent(&self) -> i32 {
        (self.t_scale.to_bits() >> 52) as i32 - 1023
    }

    /// What lies between these depths, from the origin, surely is of interest.
    #[inline(always)]
    pub fn inner_depths(&self) -> [f32; 2] {
        let [t_min, t_max] = self.t_inside();
        let (low, high) = (t_min * self.shear.depth_rate, t_max * self.shear.depth_rate);
        [low + depth_slack(low), high - depth_slack(high)]
    }

    /// A float of the frame that is not below the given `t` plus its `error`, and not far above.
    #[inline(always)]
    pub fn t_above(&self, t: f64, error: f64) -> f32 {
        // All boxes that are left wait for this, so mostly it does not wait for the error.
        let nearest = (t * self.t_scale) as f32;
        if nearest.abs() >= f32::MIN_POSITIVE && error <= t.abs() * f64::from(UNIT32) {
            // Off by `u` from rounding, and by `u` from the error: less than `3 u` of what it is now.
            nearest + nearest.abs() * (4.0 * UNIT32)
        } else {
            f32_above((t + error) * self.t_scale)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
                    assert_eq!((ray.t_min, ray.t_inside()[0]), (0.0, 0.0));
                    assert!(ray.t_max >= ray.t_inside()[1]);
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
