//! Where lines meet the planes of triangles: one of each, or eight side by side, by the same operations.

use crate::math::rounding::{UNIT, gamma};
use crate::simd::Doubles;

/// A vector for each lane.
pub(crate) type Vector<D> = [D; 3];

/// The meeting of a line with a triangle's plane.
pub(crate) struct PlaneMeeting<D> {
    pub t: D,
    /// What `t` may be off, where that is `clear`.
    pub t_error: D,
    /// The weights of the second and the third vertex, not yet between 0 and 1; not finite where the plane is parallel.
    pub weights: [D; 2],
    /// The line's direction along the normal: negative where it meets the front.
    pub along: D,
    /// One bit for each lane, unless the plane is nearly parallel to the line.
    pub clear: u32,
}

impl<D: Doubles> PlaneMeeting<D> {
    /// Of a line from an origin along `direction` and a triangle: the way from there to its first vertex, and its edges
    /// from that one to the others.
    ///
    /// Source: \[MT97\] for the weights.
    #[inline(always)]
    pub fn new(direction: Vector<D>, to_plane: Vector<D>, [e1, e2]: [Vector<D>; 2]) -> Self {
        let n = cross(e1, e2);
        let along = dot(direction, n);
        // Four roundings in `n`, one in `to_plane`, three in either dot product.
        let size = sum_abs(e1).times(gamma(8)).mul(sum_abs(e2));
        let along_error = sum_abs(direction).mul(size);
        let clear = along_error.times(1024.0).less(along.abs());
        let t = dot(to_plane, n).div(along);
        // A hundredth for the divisor's own error, and the roundings of the quotient. What does not wait for `t` is divided
        // beside it.
        let fixed = sum_abs(to_plane).mul(size).times(1.01).div(along.abs());
        let by_t = along_error.times(1.01).div(along.abs());
        let t_error = fixed.add(t.abs().mul(by_t)).add(t.abs().times(3.0 * UNIT));
        let aside = cross(to_plane, direction);
        let weights = [dot(e2, aside).div(along), dot(e1, aside).neg().div(along)];
        PlaneMeeting { t, t_error, weights, along, clear }
    }
}

// On a processor of 32 bits each operation is a call, or many instructions: there these are calls as well.

#[cfg_attr(target_pointer_width = "64", inline(always))]
#[cfg_attr(not(target_pointer_width = "64"), inline(never))]
pub(crate) fn minus<D: Doubles>([ax, ay, az]: Vector<D>, [bx, by, bz]: Vector<D>) -> Vector<D> {
    [ax.sub(bx), ay.sub(by), az.sub(bz)]
}

#[cfg_attr(target_pointer_width = "64", inline(always))]
#[cfg_attr(not(target_pointer_width = "64"), inline(never))]
fn cross<D: Doubles>([ax, ay, az]: Vector<D>, [bx, by, bz]: Vector<D>) -> Vector<D> {
    [ay.mul(bz).sub(by.mul(az)), az.mul(bx).sub(bz.mul(ax)), ax.mul(by).sub(bx.mul(ay))]
}

#[cfg_attr(target_pointer_width = "64", inline(always))]
#[cfg_attr(not(target_pointer_width = "64"), inline(never))]
fn dot<D: Doubles>([ax, ay, az]: Vector<D>, [bx, by, bz]: Vector<D>) -> D {
    ax.mul(bx).add(ay.mul(by)).add(az.mul(bz))
}

#[cfg_attr(target_pointer_width = "64", inline(always))]
#[cfg_attr(not(target_pointer_width = "64"), inline(never))]
fn sum_abs<D: Doubles>([x, y, z]: Vector<D>) -> D {
    x.abs().add(y.abs()).add(z.abs())
}
