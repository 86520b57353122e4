//! The point of an ellipsoid that is closest to a given one.

use glam::DVec3;

use super::shape::Foot;
use crate::math::float::sqrt;

/// The principal axes of a symmetric matrix `B^T B`, of which the columns of `B` are given.
///
/// Source: Jacobi's rotations, a fixed number of them, so that the same input gives the same bits.
pub(super) struct Frame {
    values: [f64; 3],
    /// The axis of each value.
    axes: [DVec3; 3],
}

/// Sweeps over the three pairs of axes. Each squares what is left beside the diagonal.
const SWEEPS: usize = 12;

impl Frame {
    /// Of the matrix with these columns.
    pub fn of(columns: [DVec3; 3]) -> Frame {
        // One-sided: columns are turned until they are at right angles, and then are as long as the roots of the values.
        let [x, y, z] = columns;
        let (mut x, mut y, mut z) = ([x, DVec3::X], [y, DVec3::Y], [z, DVec3::Z]);
        for _ in 0..SWEEPS {
            turn(&mut x, &mut y);
            turn(&mut x, &mut z);
            turn(&mut y, &mut z);
        }
        let ([x, first], [y, second], [z, third]) = (x, y, z);
        let values = [x, y, z].map(DVec3::length_squared);
        Frame { values, axes: [first, second, third] }
    }

    /// The root of the largest value: how far the matrix stretches at most.
    pub fn largest(&self) -> f64 {
        let [x, y, z] = self.values;
        sqrt(x.max(y).max(z))
    }
}

/// Turns two columns, and the axes that they began at, until the columns are at right angles.
fn turn(p: &mut [DVec3; 2], q: &mut [DVec3; 2]) {
    let (along, across) = (p[0].dot(q[0]), q[0].length_squared() - p[0].length_squared());
    if along == 0.0 {
        return;
    }
    let slope = across / (2.0 * along);
    let tangent = 1f64.copysign(slope) / (slope.abs() + sqrt(1.0 + slope * slope));
    let cosine = 1.0 / sqrt(1.0 + tangent * tangent);
    let sine = cosine * tangent;
    for (p, q) in p.iter_mut().zip(q) {
        (*p, *q) = (cosine * *p - sine * *q, sine * *p + cosine * *q);
    }
}

/// Steps of a bisection, by which an interval of any floats becomes one of neighbours.
const STEPS: usize = 1100;

/// So much a square of one may lack by rounding alone.
const ROUNDING: f64 = 1.0 / (1u64 << 40) as f64;

/// The closest point of the ellipsoid around `centre` to which `axes` map the unit sphere.
///
/// It is the image of a unit vector `n` that is `-(B^T B + l)^-1 B^T q`, `q` the centre from the point, with the `l` that makes it
/// as long as one; and of all such `l` the largest, for which what is in brackets has no negative value. In principal axes
/// its length is a sum of three terms that all fall with `l`. Where the point is on the plane across the shortest axis there
/// may be no such `l` beyond minus the least value: then that axis makes up for what is missing.
///
/// Whatever is lost on the way to `n`, the point is one of the ellipsoid but for the rounding of its image, so it is not
/// closer than the closest one.
pub(super) fn on_ellipsoid(point: DVec3, centre: DVec3, axes: [DVec3; 3]) -> Foot {
    let q = centre - point;
    let Frame { values, axes: principal } = Frame::of(axes);
    let image = |n: DVec3| axes[0] * n.x + axes[1] * n.y + axes[2] * n.z;
    let pull = principal.map(|axis| -image(axis).dot(q));
    let least = values[0].min(values[1]).min(values[2]);
    // Above minus the least value by this: there the terms are finite, unless nothing pulls along that axis.
    let length = |above: f64| {
        let term = |k: usize| {
            let part = pull[k] / ((values[k] - least) + above);
            if pull[k] == 0.0 { 0.0 } else { part * part }
        };
        (term(0) + term(1)) + term(2)
    };
    let mut low = 0.0;
    let mut high = pull.iter().fold(f64::MIN_POSITIVE, |sum, pull| sum + pull.abs());
    for _ in 0..STEPS {
        let middle = if low == 0.0 { 0.5 * high } else { sqrt(low) * sqrt(high) };
        if !(low < middle && middle < high) {
            break;
        }
        if length(middle) > 1.0 { low = middle } else { high = middle }
    }
    let mut n = DVec3::ZERO;
    let mut shortest = DVec3::ZERO;
    for k in 0..3 {
        let along = (values[k] - least) + high;
        n += if along > 0.0 { pull[k] / along } else { 0.0 } * principal[k];
        shortest = if values[k] == least { principal[k] } else { shortest };
    }
    let missing = 1.0 - n.length_squared();
    if missing > ROUNDING {
        n += sqrt(missing) * shortest;
    }
    let at = image(n / sqrt(n.length_squared()));
    Foot { square: (q + at).length_squared(), weights: [0.0; 2], point: centre + at }
}
