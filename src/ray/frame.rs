//! A ray in a frame of its own, in which `f32` neither over- nor underflows.

use super::Ray;
use crate::exact::Line;
use crate::math::float::{narrow_power_of_two, power_of_two};
use crate::math::rounding::{f32_above, f32_below};
use crate::simd::{Lanes, Scalar, Width};

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
    /// The frame's exponent: scene and origin lie below 2^exponent, unless that is above 126.
    pub exponent: i32,
    /// The fourth lane of these three means nothing: four are one vector on most machines.
    pub origin: [f32; 4],
    pub direction: [f32; 4],
    /// The reciprocals of the sizes of its components, of slow ones that of [`SLOWEST`].
    pub inverse: [f32; 4],
    /// A bound on every coordinate of scene and origin in the frame.
    pub reach: f32,
    /// From given `t` to the frame's, a power of two.
    pub t_scale: f64,
    /// Below all `t` of interest, in the frame.
    pub t_min: f32,
    /// Above all `t` of interest, in the frame: the given limit, or the largest float.
    pub t_max: f32,
    /// Within all `t` of interest: the limits rounded inwards.
    pub t_inside: [f32; 2],
    pub shear: Shear,
}

/// What the triangle test needs: the axis along which the ray moves most becomes the depth, and the
/// others are sheared so that the ray runs along it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shear {
    /// The axes x, y and depth of the sheared space, an even permutation.
    pub axes: [usize; 3],
    /// The direction's x and y for each unit of depth: at most 1 in size, but for rounding.
    pub slope: [f32; 2],
    /// The greater size of the two.
    pub steepness: f32,
    /// 1 or -1: depth grows along the ray.
    pub depth_sign: f32,
    /// Depth for each unit of `t` in the frame, between 1 and 2.
    pub depth_rate: f32,
}

/// A component below this, against one of at least 1, moves the ray by less than what boxes are padded by:
/// it counts as this much, so that its reciprocal is finite.
const SLOWEST: f32 = 1.0 / (1u64 << 62) as f32;

/// The bits of the largest absolute value: floats without a sign are in the order of their bits, with
/// infinities and NaN above the others.
#[inline(always)]
fn largest_bits(v: [f32; 3]) -> u32 {
    let [x, y, z] = v.map(|x| x.to_bits() & !(1 << 31));
    x.max(y).max(z)
}

/// The exponent `e` with `|x| < 2^e` by the bits of `|x|`, at least -126; 129 for infinity.
#[inline(always)]
fn exponent_above(bits: u32) -> i32 {
    (bits >> 23) as i32 - 126
}

/// The floats around `t * scale`, the scale a power of two: not above it, and not below. Mostly both are the
/// product.
#[inline(always)]
fn floats_around(t: f32, scale: f64) -> [f32; 2] {
    if t == f32::MAX && scale > 1.0 {
        // The limit of most rays.
        return [f32::MAX, f32::INFINITY];
    }
    // With a scale that is no normal `f32` this is an infinity, a NaN, or too small.
    let product = t * scale as f32;
    if product.is_normal() {
        [product; 2]
    } else if t == 0.0 {
        [t; 2]
    } else {
        rounded_around(f64::from(t) * scale)
    }
}

#[cold]
#[inline(never)]
fn rounded_around(x: f64) -> [f32; 2] {
    [f32_below(x), f32_above(x)]
}

const INFINITY_BITS: u32 = f32::INFINITY.to_bits();

impl Ray {
    /// What traversal needs, or `None` for a ray that hits nothing by definition. `reach` is the
    /// largest coordinate of the scene, infinite if it is not representable.
    pub(crate) fn prepare(&self, reach: f32) -> Option<PreparedRay> {
        self.prepare_with(Scalar, reach)
    }

    /// The same, by the instructions of a backend.
    #[inline(always)]
    pub(crate) fn prepare_with<S: Width<4>>(&self, s: S, reach: f32) -> Option<PreparedRay> {
        let (farthest, longest) = (largest_bits(self.origin), largest_bits(self.direction));
        let t_min = if self.t_min < -f32::MAX { -f32::MAX } else { self.t_min };
        let t_max = if self.t_max > f32::MAX { f32::MAX } else { self.t_max };
        let finite = farthest < INFINITY_BITS && longest < INFINITY_BITS;
        if !(finite && longest > 0 && t_min <= t_max) {
            return None;
        }
        let reach = farthest.max(reach.to_bits());
        let exponent = exponent_above(reach).clamp(-126, 126);
        let scale = narrow_power_of_two(-exponent);
        // Subnormal components have no exponent of their own: a first step brings them up.
        let lift = if longest < f32::MIN_POSITIVE.to_bits() { 24 } else { 0 };
        let lifted = narrow_power_of_two(lift);
        let length = exponent_above((f32::from_bits(longest) * lifted).to_bits()) - 1;
        let [x, y, z] = self.direction;
        let given = s.load(&[x, y, z, 0.0]).mul(s.splat(lifted));
        let direction = given.mul(s.splat(narrow_power_of_two(-length)));
        let [x, y, z] = self.origin;
        let origin = s.load(&[x, y, z, 0.0]).mul(s.splat(scale));
        let inverse = s.splat(1.0).div(direction.abs().max(s.splat(SLOWEST)));
        let t_scale = power_of_two(length - lift - exponent);
        let [t_min_below, t_min_above] = floats_around(t_min, t_scale);
        let [t_max_below, t_max_above] = floats_around(t_max, t_scale);
        let reach = f32::from_bits(reach) * scale;
        let array = |v: S::V| {
            let mut lanes = [0.0; 4];
            v.store(&mut lanes);
            lanes
        };
        let (direction, inverse) = (array(direction), array(inverse));
        Some(PreparedRay {
            given: Ray { t_min, t_max, ..*self },
            scale,
            exponent,
            origin: array(origin),
            direction,
            inverse,
            reach: if reach > 4.0 { 4.0 } else { reach },
            t_scale,
            t_min: t_min_below,
            t_max: t_max_above,
            t_inside: [t_min_above, t_max_below],
            shear: Shear::new(&direction, &inverse),
        })
    }
}

/// The axes x, y and depth, for each depth.
const AXES: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];

impl Shear {
    #[inline(always)]
    fn new(direction: &[f32; 4], inverse: &[f32; 4]) -> Self {
        let [x, y, z, _] = direction.map(|x| x.to_bits() & !(1 << 31));
        let depth = if z >= x && z >= y { 2 } else { usize::from(y >= x) };
        let axes = const { &AXES }[depth];
        let slope = [axes[0], axes[1]].map(|axis| direction[axis] * inverse[depth]);
        let depth_rate = direction[depth].abs();
        let [a, b] = slope.map(f32::abs);
        Shear {
            axes,
            slope,
            steepness: if a > b { a } else { b },
            depth_sign: 1f32.copysign(direction[depth]),
            depth_rate,
        }
    }
}

impl PreparedRay {
    /// Nothing in particular.
    pub const BLANK: Self = PreparedRay {
        given: Ray::new([0.0; 3], [0.0; 3]),
        scale: 0.0,
        exponent: 0,
        origin: [0.0; 4],
        direction: [0.0; 4],
        inverse: [0.0; 4],
        reach: 0.0,
        t_scale: 0.0,
        t_min: 0.0,
        t_max: 0.0,
        t_inside: [0.0; 2],
        shear: Shear {
            axes: AXES[2],
            slope: [0.0; 2],
            steepness: 0.0,
            depth_sign: 0.0,
            depth_rate: 0.0,
        },
    };

    /// The line on which the ray lies.
    #[inline(always)]
    pub fn line(&self) -> Line {
        Line { origin: self.given.origin, direction: self.given.direction }
    }

    /// A float that is not below the frame's value of the given `t`.
    #[inline(always)]
    pub fn t_above(&self, t: f64) -> f32 {
        f32_above(t * self.t_scale)
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
                    let longest = f32::from_bits(largest_bits(three(ray.direction)));
                    assert!((1.0..2.0).contains(&longest), "{length} {longest}");
                    assert!(
                        largest_bits(three(ray.origin)) <= ray.reach.to_bits() && ray.reach <= 4.0
                    );
                    let size = origin.max(reach);
                    if size >= 1e-37 {
                        assert!(ray.reach >= 0.5, "{size} {}", ray.reach);
                    }
                    assert_eq!(f64::from(ray.scale), power_of_two(-ray.exponent));
                    // The same point from both descriptions.
                    let given = f64::from(length) * f64::from(ray.scale);
                    assert_eq!(given, f64::from(ray.direction[0]) * ray.t_scale);
                    assert_eq!((ray.t_min, ray.t_inside[0]), (0.0, 0.0));
                    assert!(ray.t_max >= ray.t_inside[1]);
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
            assert_eq!((shear.axes, shear.depth_sign), (axes, sign), "{direction:?}");
            assert!(shear.steepness <= 1.0 && (1.0..2.0).contains(&shear.depth_rate));
        }
    }
}
