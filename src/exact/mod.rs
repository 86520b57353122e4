//! Where a ray meets a primitive, in real arithmetic: what `f64` could not decide.
//!
//! Everything here is a polynomial in the given floats, evaluated without error \[She97\]. Volumes are of
//! third degree, discriminants of fourth, comparisons of two triangles of sixth; all of these hold
//! for every finite input. Comparisons with a sphere that reach the eighth degree are exact while
//! every coordinate is zero or between 2^-110 and 2^120 in size. A few microseconds each, on the
//! stack.

mod sphere;
mod triangle;

use core::cmp::Ordering;

pub(crate) use sphere::Roots;
pub(crate) use triangle::{faces, has_area, volumes};

use crate::math::expansion::Expansion;
use sphere::Root;
use triangle::Quotient;

/// A line, as the floats that describe it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    pub origin: [f32; 3],
    pub direction: [f32; 3],
}

/// What a ray meets.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Meeting {
    Triangle([[f32; 3]; 3]),
    /// `root` 0 where the line enters, 1 where it leaves.
    Sphere {
        centre: [f32; 3],
        radius: f32,
        root: usize,
    },
}

impl Meeting {
    /// Whether the real `t` of both is equal for a reason that takes no arithmetic: the same vertices,
    /// one axis-parallel plane, or one sphere.
    pub fn surely_equal(&self, other: &Meeting) -> bool {
        match (self, other) {
            (Meeting::Triangle(a), Meeting::Triangle(b)) => {
                let same = a.iter().all(|p| b.contains(p)) && b.iter().all(|p| a.contains(p));
                let flat = |k: usize| a.iter().chain(b).all(|p| p[k] == a[0][k]);
                same || (0..3).any(flat)
            }
            (
                Meeting::Sphere { centre: c, radius: r, root: i },
                Meeting::Sphere { centre: d, radius: s, root: j },
            ) => c == d && r == s && i == j,
            _ => false,
        }
    }
}

/// The real `t` of a meeting.
#[expect(clippy::large_enum_variant, reason = "there is no allocator to make them equal")]
pub(crate) enum Distance {
    Quotient(Quotient),
    Root(Root),
}

impl Distance {
    /// The distance of something that the ray's line meets; `None` when it does not.
    pub fn new(ray: &Line, meeting: &Meeting) -> Option<Self> {
        match *meeting {
            Meeting::Triangle(corners) => Quotient::new(ray, corners).map(Distance::Quotient),
            Meeting::Sphere { centre, radius, root } => {
                let roots = Roots::new(ray, centre, radius)?;
                Some(Distance::Root(Root::new(roots, root)))
            }
        }
    }

    /// The distance in `f64`, and a bound on its error.
    pub fn approximate(&self) -> (f64, f64) {
        match self {
            Distance::Quotient(t) => t.approximate(),
            Distance::Root(t) => t.approximate(),
        }
    }

    /// The order of two distances.
    pub fn compare(&self, other: &Distance) -> Ordering {
        match (self, other) {
            (Distance::Quotient(p), Distance::Quotient(q)) => p.compare(q),
            (Distance::Root(p), Distance::Quotient(q)) => p.compare_with_quotient(q),
            (Distance::Quotient(p), Distance::Root(q)) => q.compare_with_quotient(p).reverse(),
            (Distance::Root(p), Distance::Root(q)) => p.compare(q),
        }
    }

    /// The order against a float.
    pub fn compare_with(&self, x: f32) -> Ordering {
        self.compare_with_wide(f64::from(x))
    }

    /// The order against a float of at most 48 bits.
    fn compare_with_wide(&self, x: f64) -> Ordering {
        match self {
            Distance::Quotient(t) => t.compare_with(x),
            Distance::Root(t) => t.compare_with(x),
        }
    }

    /// The nearest `f32`, ties to even.
    pub fn round(&self) -> f32 {
        // Right but for the last step, since the approximation is.
        let near = self.approximate().0 as f32;
        let is_odd = near.to_bits() & 1 == 1;
        let below = self.compare_with_wide(midpoint(near.next_down(), near));
        let above = self.compare_with_wide(midpoint(near, near.next_up()));
        if below == Ordering::Less || (below == Ordering::Equal && is_odd) {
            near.next_down()
        } else if above == Ordering::Greater || (above == Ordering::Equal && is_odd) {
            near.next_up()
        } else {
            near
        }
    }
}

/// The middle of two neighbours; beyond the largest float, where its next neighbour would be.
fn midpoint(a: f32, b: f32) -> f64 {
    const BEYOND: f64 = 2.0 * (1u128 << 127) as f64;
    let finite = |x: f32| {
        if x.is_finite() { f64::from(x) } else { BEYOND.copysign(f64::from(x)) }
    };
    (finite(a) + finite(b)) / 2.0
}

type Vector = [Expansion; 3];

fn difference(p: [f32; 3], q: [f32; 3]) -> Vector {
    [0, 1, 2].map(|k| Expansion::difference(f64::from(p[k]), f64::from(q[k])))
}

fn cross(p: &Vector, q: &Vector) -> Vector {
    [(1, 2), (2, 0), (0, 1)].map(|(i, j)| Expansion::cross(&p[i], &q[j], &p[j], &q[i]))
}

fn dot(p: &Vector, q: &Vector) -> Expansion {
    let mut sum = Expansion::ZERO;
    for k in 0..3 {
        sum.add_product(&p[k], &q[k]);
    }
    sum
}

/// Origin and direction as the floats they were given as.
fn given(ray: &Line) -> ([f32; 3], Vector) {
    (ray.origin, difference(ray.direction, [0.0; 3]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quotient_of(ray: &Line, corners: [[f32; 3]; 3]) -> Distance {
        Distance::new(ray, &Meeting::Triangle(corners)).expect("not parallel")
    }

    fn quotient(z: f32, slope: f32) -> Distance {
        let triangle = [[0.0, 0.0, z], [1.0, 0.0, z + slope], [0.0, 1.0, z]];
        let ray = Line { origin: [0.0; 3], direction: [0.0, 0.0, 3.0] };
        quotient_of(&ray, triangle)
    }

    #[test]
    fn thirds_are_ordered_and_rounded() {
        let third = quotient(1.0, 0.0);
        assert_eq!(third.compare(&quotient(1.0, 0.5)), Ordering::Equal);
        assert_eq!(third.compare(&quotient(1.0f32.next_up(), 0.5)), Ordering::Less);
        assert_eq!(third.compare_with_wide(1.0 / 3.0), Ordering::Greater);
        assert_eq!(third.round(), 1.0 / 3.0);
    }

    #[test]
    fn midpoints_go_to_even() {
        // 3 t = z, with t in the middle of two floats.
        let t = 1.0 + f64::from(f32::EPSILON) / 2.0;
        let ray = Line { origin: [0.0; 3], direction: [0.0, 0.0, 1.0] };
        let far = Line { origin: [0.0, 0.0, -1.0], ..ray };
        let z = (t - 1.0) as f32;
        let triangle = [[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]];
        assert_eq!(quotient_of(&far, triangle).compare_with_wide(t), Ordering::Equal);
        assert_eq!(quotient_of(&far, triangle).round(), 1.0);
        assert_eq!(quotient_of(&ray, triangle).round(), z);
        let beside = triangle.map(|[x, y, z]| [x, y, z.next_up()]);
        assert_eq!(quotient_of(&far, beside).round(), 1.0f32.next_up());
    }
}
