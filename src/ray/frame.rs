//! A ray in a frame of its own, in which `f32` neither over- nor underflows.

use super::Ray;
use crate::exact::Line;
use crate::math::float::{narrow_power_of_two, power_of_two};
use crate::math::rounding::{f32_above, f32_below};

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
    pub origin: [f32; 3],
    pub direction: [f32; 3],
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

/// The exponent `e` with `|x| < 2^e`, at least -126; 129 for infinity.
fn exponent_above(x: f32) -> i32 {
    (x.to_bits() >> 23 & 0xff) as i32 - 126
}

/// `x * 2^n` for `|n| <= 252`, rounded at most where it becomes subnormal.
fn scaled(x: f32, n: i32) -> f32 {
    let half = n / 2;
    x * narrow_power_of_two(half) * narrow_power_of_two(n - half)
}

fn largest(v: [f32; 3]) -> f32 {
    v[0].abs().max(v[1].abs()).max(v[2].abs())
}

impl Ray {
    /// What traversal needs, or `None` for a ray that hits nothing by definition. `reach` is the
    /// largest coordinate of the scene, infinite if it is not representable.
    pub(crate) fn prepare(&self, reach: f32) -> Option<PreparedRay> {
        let finite = |v: [f32; 3]| v.iter().all(|x| x.is_finite());
        let longest = largest(self.direction);
        let t_min = self.t_min.max(-f32::MAX);
        let t_max = self.t_max.min(f32::MAX);
        // `max` and `min` drop a NaN, so it is looked for in the limits as given.
        let limits = self.t_min <= self.t_max && t_min <= t_max;
        if !(finite(self.origin) && finite(self.direction) && longest > 0.0 && limits) {
            return None;
        }
        let reach = largest(self.origin).max(reach);
        let exponent = exponent_above(reach).clamp(-126, 126);
        let scale = narrow_power_of_two(-exponent);
        // Subnormal components have no exponent of their own: two steps bring them up.
        let lift = if longest < f32::MIN_POSITIVE { 24 } else { 0 };
        let length = exponent_above(scaled(longest, lift)) - 1 - lift;
        let direction = self.direction.map(|x| scaled(x, -length));
        let t_exponent = length - exponent;
        let t_scale = power_of_two(t_exponent);
        let in_frame = |t: f32| f64::from(t) * t_scale;
        Some(PreparedRay {
            given: Ray { t_min, t_max, ..*self },
            scale,
            exponent,
            origin: self.origin.map(|x| x * scale),
            direction,
            reach: (reach * scale).min(4.0),
            t_scale,
            t_min: f32_below(in_frame(t_min)),
            t_max: f32_above(in_frame(t_max)),
            t_inside: [f32_above(in_frame(t_min)), f32_below(in_frame(t_max))],
            shear: Shear::new(direction),
        })
    }
}

impl Shear {
    fn new(direction: [f32; 3]) -> Self {
        let [x, y, z] = direction.map(f32::abs);
        let depth = if z >= x && z >= y { 2 } else { usize::from(y >= x) };
        let axes = [(depth + 1) % 3, (depth + 2) % 3, depth];
        let depth_rate = direction[depth].abs();
        let inverse = 1.0 / depth_rate;
        let slope = [axes[0], axes[1]].map(|axis| direction[axis] * inverse);
        Shear {
            axes,
            slope,
            steepness: slope[0].abs().max(slope[1].abs()),
            depth_sign: 1f32.copysign(direction[depth]),
            depth_rate,
        }
    }
}

impl PreparedRay {
    /// The line on which the ray lies.
    #[inline(always)]
    pub fn line(&self) -> Line {
        Line { origin: self.given.origin, direction: self.given.direction }
    }

    /// A float that is not below the frame's value of the given `t`.
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

    #[test]
    fn the_frame_holds_everything_whatever_the_scale() {
        let sizes = [1e-45, 1e-44, 3e-39, 1e-20, 0.3, 1.0, 7e5, 3e38, f32::MAX];
        for origin in sizes {
            for reach in sizes.into_iter().chain([0.0, f32::INFINITY]) {
                for length in sizes {
                    let ray = Ray::new([origin, 0.0, -origin], [length, -length / 3.0, 0.0]);
                    let ray = ray.prepare(reach).expect("a valid ray");
                    let longest = largest(ray.direction);
                    assert!((1.0..2.0).contains(&longest), "{length} {longest}");
                    assert!(largest(ray.origin) <= ray.reach && ray.reach <= 4.0);
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
