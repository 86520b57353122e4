//! Where lines meet the planes of triangles: one of each, or eight side by side, by the same operations.

use crate::math::rounding::{UNIT, gamma};
use crate::simd::{Doubles, Quad, Simd};

/// A vector for each lane.
pub(crate) type Vector<D> = [D; 3];

/// The meeting of a line with a triangle's plane.
pub(crate) struct PlaneMeeting<D> {
    pub t: D,
    /// What `t` may be off, where that is `clear`.
    pub t_error: D,
    /// The weights of the second and the third vertex, not yet between 0 and 1, where that is `clear`.
    pub weights: [D; 2],
    /// The line's direction along the normal: negative where it meets the front.
    pub along: D,
    /// One bit for each lane in which `t` is within `t_error`, and the weights are within 2^-25 if the line passes between the
    /// edges: unless the plane is nearly parallel to the line, the triangle thin or the line's origin far away.
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
        let t = dot(to_plane, n).div(along);
        let sizes = [sum_abs(direction), sum_abs(to_plane), sum_abs(e1), sum_abs(e2)];
        let (t_error, clear) = error(t, along, sizes);
        let aside = cross(to_plane, direction);
        let weights = [dot(e2, aside).div(along), dot(e1, aside).neg().div(along)];
        PlaneMeeting { t, t_error, weights, along, clear }
    }
}

impl PlaneMeeting<f64> {
    /// The same of one line and one triangle by vectors of a backend: the same bits.
    #[inline(always)]
    pub fn by<S: Simd>(
        s: S,
        [origin, direction]: &[[f32; 4]; 2],
        [a, b, c]: &[[f32; 4]; 3],
    ) -> Self {
        let (a, direction) = (s.quad(a), s.quad(direction));
        let to_plane = a.sub(s.quad(origin));
        let (e1, e2) = (s.quad(b).sub(a), s.quad(c).sub(a));
        let (n, aside) = (turned_cross(e1, e2), turned_cross(to_plane, direction));
        let products = Quad::turned_sums([
            direction.turned().mul(n),
            to_plane.turned().mul(n),
            e2.turned().mul(aside),
            e1.turned().mul(aside),
        ]);
        let sizes = Quad::sums([direction.abs(), to_plane.abs(), e1.abs(), e2.abs()]);
        let [along, ..] = products.array();
        let [_, t, u, v] = products.div(products.first()).array();
        let (t_error, clear) = error(t, along, sizes.array());
        PlaneMeeting { t, t_error, weights: [u, -v], along, clear }
    }
}

/// One over what weights may be off: half a unit of roundoff of `f32`, so that its rounding and `1 - u` stay within 2^-23.
const WEIGHTS: f64 = (1u64 << 25) as f64;

/// What `t` may be off, and whether that and the weights are clear, one bit a lane; from the sums of absolute coordinates of the direction, of the
/// way to the plane and of both edges.
#[inline(always)]
fn error<D: Doubles>(t: D, along: D, [direction, to_plane, e1, e2]: [D; 4]) -> (D, u32) {
    // Four roundings in the normal, one in the way to the plane, three in either dot product. In a weight's dividend there are
    // as many, of an edge and the way to the plane; the sum of both edges stands for the longer one.
    let size = e1.mul(e2);
    let weight = to_plane.mul(e1.add(e2)).add(size);
    let clear = direction.mul(weight).times(gamma(8) * WEIGHTS).less(along.abs());
    // A hundredth for the divisor's own error, and the roundings of the quotient. What does not wait for `t` is divided
    // beside it.
    let part = size.times(1.01 * gamma(8)).div(along.abs());
    let reach = to_plane.add(t.abs().mul(direction));
    (reach.mul(part).add(t.abs().times(3.0 * UNIT)), clear)
}

/// `a x b`, [turned](Quad::turned), by the operations of [`cross`]: to turn it back would take longer than to turn what it meets.
#[inline(always)]
fn turned_cross<Q: Quad>(a: Q, b: Q) -> Q {
    let (back_a, back_b) = (a.turned_back(), b.turned_back());
    back_a.mul(b).sub(back_b.mul(a))
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
