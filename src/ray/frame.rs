//! A ray in a frame of its own, in which `f32` neither over- nor underflows.

use super::exponents::rounded;
use super::{Axis, Ray};
use crate::exact::Line;
use crate::math::rounding::{Round, UNIT32, f32_above};
use crate::simd::{Lanes, Width};

/// A ray that can hit something, with what every box and primitive test needs of it.
///
/// The *frame* is the given space scaled by a power of two, so that the scene and the origin lie
/// within 4 of zero, and the direction is scaled by another, so that its largest component is between
/// 1 and 2. Scaling by powers of two is exact but for what falls below 2^-149, far below everything
/// that the tests grant. So one set of bounds holds for scenes of 1e-44 and of 1e38 and for directions
/// of any length. `t` counts in lengths of the scaled direction there: `t * t_scale`.
///
/// In C's order, with what leaves read one by one within the last 64 bytes: of a number that lies further in front compilers
/// read a whole vector, which waits for all that was written there by parts.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct PreparedRay {
    /// The ray as it was given.
    pub given: Ray,
    /// The fourth lane of these two means nothing: four are one vector on most machines.
    pub origin: [f32; 4],
    pub direction: [f32; 4],
    /// From given `t` to the frame's, a power of two.
    pub t_scale: f64,
    pub shear: Shear,
    /// From given coordinates to the frame's: a power of two between 2^-126 and 2^126.
    pub scale: f32,
    /// Below all `t` of interest, in the frame.
    pub t_min: f32,
    /// Above all `t` of interest, in the frame: the given limit, or the largest float.
    pub t_max: f32,
}

const _: () = {
    let first = core::mem::offset_of!(PreparedRay, shear) + core::mem::offset_of!(Shear, per_depth);
    assert!(size_of::<PreparedRay>() - first < 64);
};

/// What the triangle test needs: the axis along which the ray moves most becomes the depth, and the
/// others are sheared so that the ray runs along it.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct Shear {
    /// The axes x, y and depth of the sheared space, an even permutation.
    pub axes: [Axis; 3],
    /// What each unit of depth takes: see [`slope`](Self::slope), [`pace`](Self::pace) and [`blur`](Self::blur). Side by side,
    /// as what is written by parts is slow to read in pairs.
    per_depth: [f32; 4],
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
/// below the frame's least float. An infinite depth stays so, or becomes a NaN with it, beyond which nothing is.
#[inline(always)]
fn depth_slack(depth: f32) -> f32 {
    depth.abs() * DEPTH_SLACK + TINY
}

pub(super) const DEPTH_SLACK: f32 = 4.0 * UNIT32;

/// What x and y of a sheared vertex may be off for each unit of depth and of the larger slope.
pub(super) const BLUR: f32 = 5.5 * UNIT32;

impl Shear {
    /// The direction's x and y for each unit of depth: at most 1 in size, but for rounding.
    #[inline(always)]
    pub fn slope(&self) -> [f32; 2] {
        let [x, y, ..] = self.per_depth;
        [x, y]
    }

    /// `t` for each unit of depth: the reciprocal of `depth_rate`.
    #[inline(always)]
    pub fn pace(&self) -> f32 {
        self.per_depth[2]
    }

    /// What x and y of a sheared vertex may be off for each unit of depth, whatever they are.
    #[inline(always)]
    pub fn blur(&self) -> f32 {
        self.per_depth[3]
    }

    /// Above the depth of all `t` up to `t_bound`, from the origin.
    #[inline(always)]
    pub fn high(&self, t_bound: f32) -> f32 {
        let depth = t_bound * self.depth_rate;
        depth + depth_slack(depth)
    }
}

/// A component of the scaled direction below this moves the ray by less than what boxes are padded by: it counts
/// as this much, so that its reciprocal is finite.
pub(super) const SLOWEST: f32 = 1.0 / (1u64 << 62) as f32;

impl Shear {
    /// For numbers of a prepared ray. `pace` is the reciprocal of the direction's size along `depth`.
    #[inline(always)]
    pub fn new(
        s: impl Width<4>,
        (depth, pace): (Axis, f32),
        origin: &[f32; 4],
        direction: &[f32; 4],
        scale: f32,
        t_min: f32,
    ) -> Self {
        let axes = depth.as_depth();
        let [kx, ky, depth] = axes.map(|axis| axis as usize);
        let depth_rate = direction[depth].abs();
        let (x, y) = (direction[kx] * pace, direction[ky] * pace);
        let [a, b] = [x.abs(), y.abs()];
        let mut per_depth = [0.0; 4];
        s.load(&[x, y, pace, BLUR * if a > b { a } else { b }]).store(&mut per_depth);
        let sign = direction[depth].to_bits() & 1 << 31;
        let signed = |x: f32| f32::from_bits(x.to_bits() ^ sign);
        let low = t_min * depth_rate;
        Shear {
            axes,
            per_depth,
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
            per_depth: [0.0; 4],
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

    /// The nearest given `t` to a finite one of the frame.
    pub fn given_t(&self, t: f32) -> f32 {
        rounded(t, -self.t_exponent(), Round::Nearest)
    }

    /// `t_scale` is `2^n`, which is normal.
    fn t_exponent(&self) -> i32 {
        (self.t_scale.to_bits() >> 52) as i32 - 1023
    }

    /// What lies between these depths, from the origin, surely is of interest.
    ///
    /// The frame's limits are less than an ulp or `TINY / 8` outside of the given ones, so twice the slack is enough.
    #[inline(always)]
    pub fn inner_depths<S: Width<4>>(&self, s: S) -> [f32; 2] {
        let limits = s.load(&[self.t_min, self.t_max, 0.0, 0.0]);
        let depths = limits.mul(s.splat(self.shear.depth_rate));
        // Less than infinite ones, of which nothing can be taken away.
        let depths = depths.max(s.splat(-f32::MAX)).min(s.splat(f32::MAX));
        let [slack, tiny] = [2.0 * DEPTH_SLACK, 2.0 * TINY];
        let (slack, tiny) = (s.load(&[slack, -slack, 0.0, 0.0]), s.load(&[tiny, -tiny, 0.0, 0.0]));
        let mut inner = [0.0; 4];
        depths.add(depths.abs().mul(slack).add(tiny)).store(&mut inner);
        [inner[0], inner[1]]
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
