//! Any ray against boxes in `f32`, also one that begins far outside.

use super::exponents::{is_ordinary, largest_bits};
use super::frame::{SLOWEST, TINY};
use super::slab::{Scales, Slab, WideBoxes, walls, wider};
use super::{Interval, PreparedRay};
use crate::math::Extent;
use crate::math::float::less;
use crate::math::rounding::{UNIT, UNIT32, f32_above, f32_below};
use crate::simd::{SMALL, Scalar, Width};

/// Boxes in `f32` for any ray: in the ray's frame, to which they are scaled unless they are ordinary.
///
/// What a wall loses by that is below 2^-149 of what it is padded by. A wall that is infinite stays so.
///
/// A ray that begins [far outside](Extent) is followed from near the scene on, or all of that would be within what a wall is padded by.
#[derive(Clone, Copy)]
pub(crate) struct FrameSlab {
    /// Of each axis the reciprocal, with the sign of the direction, and the shifts of near and far walls: see
    /// [`NarrowSlab`](super::NarrowSlab).
    axes: [[f32; 3]; 3],
    t_min: f32,
    scale: Option<f32>,
    /// Where it is followed from, and what of `t_min` is left from there, if that is not its origin.
    start: Option<(f64, f32)>,
}

impl FrameSlab {
    /// For boxes within `extent`, of which infinity says nothing.
    #[inline(never)]
    pub fn new(ray: &PreparedRay, extent: Extent) -> Self {
        let PreparedRay { given, scale, direction, t_min, .. } = ray;
        let scene = if extent.scene < f32::MAX { larger(0.0, extent.scene) } else { f32::MAX };
        let farthest = f32::from_bits(largest_bits(&given.origin));
        let is_far = !SMALL && farthest > extent.near;
        let reach = larger(scene, farthest);
        let is_ordinary = is_ordinary(reach);
        let near =
            if is_far { Nearer::new(ray, scene) } else { Nearer::origin(ray, reach * scale) };
        let scales = Scales { t: [1.0], space: [1.0], reach: [near.reach] };
        let ahead = if is_ordinary { *scale } else { 1.0 };
        let mut axes = [[SLOWEST; 3]; 3];
        for (k, axis) in axes.iter_mut().enumerate() {
            let (o, d) = (near.from[k], direction[k]);
            let lines = [[o], [d], [1.0 / larger(d.abs(), SLOWEST)]];
            let [[reciprocal], [near_shift], [far_shift]] = walls::<_, 1>(Scalar, lines, &scales);
            let [near_shift, far_shift] = match is_far {
                true => wider([reciprocal, near_shift, far_shift], near.off[k]),
                false => [near_shift, far_shift],
            };
            // Nothing is lost if boxes are scaled by this.
            *axis = [reciprocal * ahead, near_shift, far_shift];
        }
        let start = is_far.then(|| (near.t, f32_below(f64::from(*t_min) - near.t)));
        FrameSlab { axes, t_min: *t_min, scale: (!is_ordinary).then_some(*scale), start }
    }

    /// What lies between the walls of a box and these limits.
    #[inline(always)]
    fn between(&self, [lower, upper]: [&[f32; 3]; 2], [t_min, t_bound]: [f32; 2]) -> Interval<f32> {
        let (mut near, mut far) = (t_min, t_bound);
        for k in 0..3 {
            let [r, near_shift, far_shift] = self.axes[k];
            let (lower, upper) = match self.scale {
                None => (lower[k], upper[k]),
                Some(scale) => (lower[k] * scale, upper[k] * scale),
            };
            let (first, last) = if r.is_sign_negative() { (upper, lower) } else { (lower, upper) };
            let enter = first * r + near_shift;
            let leave = last * r + far_shift;
            near = if less(near, enter) { enter } else { near };
            far = if less(leave, far) { leave } else { far };
            if less(far, near) {
                break;
            }
        }
        Interval { near, far }
    }
}

/// A point of a ray, in the frame.
struct Nearer {
    /// Its `t`, without an error: the point is what is in doubt.
    t: f64,
    /// About its coordinates, and what these may be off.
    from: [f32; 3],
    off: [f32; 3],
    /// None of these and of the scene's are larger.
    reach: f32,
}

impl Nearer {
    /// The origin, within `reach`.
    fn origin(ray: &PreparedRay, reach: f32) -> Self {
        let [x, y, z, _] = ray.origin;
        Nearer { t: 0.0, from: [x, y, z], off: [0.0; 3], reach }
    }

    /// About the nearest to the middle of a scene within a `reach`, in given coordinates.
    ///
    /// A coordinate rounds to `f32` once; before that its product and its sum round in `f64`.
    fn new(ray: &PreparedRay, reach: f32) -> Self {
        let (mut ahead, mut square) = (0.0, 0.0);
        for k in 0..3 {
            let (o, d) = (f64::from(ray.origin[k]), f64::from(ray.direction[k]));
            (ahead, square) = (ahead + o * d, square + d * d);
        }
        let t = -ahead / square;
        let mut near = Nearer { t, from: [0.0; 3], off: [0.0; 3], reach: reach * ray.scale };
        for k in 0..3 {
            let step = t * f64::from(ray.direction[k]);
            let from = (f64::from(ray.origin[k]) + step) as f32;
            let off = f64::from(from.abs()) * (2.0 * f64::from(UNIT32)) + step.abs() * (8.0 * UNIT);
            (near.from[k], near.off[k]) = (from, off as f32 + TINY);
            near.reach = larger(near.reach, from.abs());
        }
        near
    }
}

fn larger(x: f32, y: f32) -> f32 {
    if x > y { x } else { y }
}

impl Slab for FrameSlab {
    /// Ends early, and compares as is cheapest: this is also for processors on which each operation takes long.
    fn part(&self, corners: [&[f32; 3]; 2], t_bound: f32) -> Interval<f32> {
        let Some((start, t_min)) = self.start.filter(|_| !SMALL) else {
            return self.between(corners, [self.t_min, t_bound]);
        };
        let t_bound = f32_above(f64::from(t_bound) - start);
        let part = self.between(corners, [t_min, t_bound]);
        if part.is_empty() {
            // Seen from the origin all of the scene may be within one float of `t`, and the part would not be empty any more.
            return Interval { near: f32::INFINITY, far: f32::NEG_INFINITY };
        }
        let there = |t: f32| f64::from(t) + start;
        Interval { near: f32_below(there(part.near)), far: f32_above(there(part.far)) }
    }

    #[inline(always)]
    fn wide<'a, S: Width<N> + 'a, const N: usize>(&'a self, s: S) -> impl WideBoxes<S, N> + 'a {
        (self, s)
    }
}
