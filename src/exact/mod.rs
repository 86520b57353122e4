//! Where a line meets a primitive, in real arithmetic: what floats could not decide.
//!
//! Everything here is the sign of a polynomial in the given floats, evaluated in integers without
//! error. Volumes are of third degree, comparisons of two triangles of sixth, of two spheres or of
//! a sphere and a triangle of eighth; all of them hold for every finite input. No allocation, no
//! recursion, and nothing that any bits could make panic or run on. Tens of nanoseconds where the
//! numbers fit 128 bits, as they do on lattices and on most scenes, else up to some microseconds.

#[cfg(test)]
mod against_oracle;
#[cfg(any(test, not(target_pointer_width = "64")))]
mod compact;
#[cfg(test)]
mod speed;
mod sphere;
#[cfg(test)]
mod tests;
#[cfg_attr(
    not(target_pointer_width = "64"),
    allow(dead_code, reason = "only spheres need it there")
)]
mod triangle;
mod two_roots;
mod units;

use core::cmp::Ordering;

#[cfg(not(target_pointer_width = "64"))]
use compact::{Quotient, Root};
#[cfg(not(target_pointer_width = "64"))]
pub(crate) use compact::{has_area, is_within, normal, order, to_plane, volumes};
pub(crate) use sphere::{Roots, from_centre};
#[cfg(target_pointer_width = "64")]
pub(crate) use triangle::{has_area, normal, volumes};
#[cfg(target_pointer_width = "64")]
use {sphere::Root, triangle::Quotient};

use crate::kinds::SPHERES;
use crate::math::binary::Binary;

/// The points `origin + t * direction`, in the floats that were given.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line {
    pub origin: [f32; 3],
    pub direction: [f32; 3],
}

type Triangle = [[f32; 3]; 3];

/// What a line meets.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Meeting {
    Triangle(Triangle),
    /// `root` 0 where the line enters, 1 where it leaves.
    Sphere {
        centre: [f32; 3],
        radius: f32,
        root: usize,
    },
}

impl Meeting {
    /// True only when a line that meets both, meets both at the same `t`: two triangles with the same
    /// vertices in any order, or in one plane across an axis, or the same root of equal spheres.
    ///
    /// The triangles have area. A few comparisons of floats; false says nothing.
    pub fn surely_equal(&self, other: &Meeting) -> bool {
        match (self, other) {
            (Meeting::Triangle(p), Meeting::Triangle(q)) => {
                let [first, ..] = p;
                let level = |k| p.iter().chain(q).all(|point| point.get(k) == first.get(k));
                p.iter().all(|vertex| q.contains(vertex)) || (0..3).any(level)
            }
            (
                Meeting::Sphere { centre, radius, root },
                Meeting::Sphere { centre: other_centre, radius: other_radius, root: other_root },
            ) => centre == other_centre && radius == other_radius && root == other_root,
            _ => false,
        }
    }
}

/// The real `t` of a meeting. Below 512 bytes; comparing two costs less than making one.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Distance {
    Quotient(Quotient),
    Root(Root),
}
const _: () = assert!(size_of::<Distance>() <= 512);

impl Distance {
    /// The distance of something that the line meets; `None` when it does not.
    pub fn new(line: &Line, meeting: &Meeting) -> Option<Self> {
        match *meeting {
            Meeting::Triangle(corners) => Quotient::new(line, corners).map(Distance::Quotient),
            Meeting::Sphere { .. } if !SPHERES => None,
            Meeting::Sphere { centre, radius, root } => {
                Root::new(line, centre, radius, root).map(Distance::Root)
            }
        }
    }

    /// The distance in `f64`, and a bound on its error of at most `5 UNIT` times its size.
    pub fn approximate(&self) -> (f64, f64) {
        match self {
            Distance::Quotient(t) => t.approximate(),
            // Nothing has such a distance.
            Distance::Root(_) if !SPHERES => (0.0, 0.0),
            Distance::Root(t) => t.approximate(),
        }
    }

    /// The order of two distances, on one line or on different ones.
    pub fn compare(&self, other: &Distance) -> Ordering {
        match (self, other) {
            (Distance::Quotient(p), Distance::Quotient(q)) => p.compare(q),
            _ if !SPHERES => Ordering::Equal,
            (Distance::Root(p), Distance::Quotient(q)) => p.compare_with(q),
            (Distance::Quotient(p), Distance::Root(q)) => q.compare_with(p).reverse(),
            (Distance::Root(p), Distance::Root(q)) => p.compare(q),
        }
    }

    /// The order against a limit, which may be infinite. NaN is in no order: any answer.
    #[cfg(test)]
    pub fn compare_with(&self, limit: f32) -> Ordering {
        order_with(limit, |x| self.compare_with_binary(x))
    }

    /// Whether it is within two limits.
    fn is_within(&self, limits: [f32; 2]) -> bool {
        between(limits, |limit| self.compare_with_binary(limit))
    }

    fn compare_with_binary(&self, x: Binary) -> Ordering {
        match self {
            Distance::Quotient(t) => t.compare_with_float(x),
            Distance::Root(_) if !SPHERES => Ordering::Equal,
            Distance::Root(t) => t.compare_with_float(x),
        }
    }

    /// The nearest `f32`, ties to even, and +0 for zero.
    pub fn round(&self) -> f32 {
        // Floats are so much further apart than the error that one middle at most lies within it.
        let (t, error) = self.approximate();
        let (below, above) = ((t - 2.0 * error) as f32, (t + 2.0 * error) as f32);
        let nearest = if below == above {
            below
        } else {
            match self.compare_with_binary(Binary::middle_above(below)) {
                Ordering::Less => below,
                Ordering::Greater => above,
                Ordering::Equal if below.to_bits() & 1 == 0 => below,
                Ordering::Equal => above,
            }
        };
        nearest + 0.0
    }
}

/// The order against a limit, which may be infinite, as `compare` says for those that are not. NaN is in no order: any answer.
#[inline]
fn order_with(limit: f32, compare: impl Fn(Binary) -> Ordering) -> Ordering {
    if limit.is_infinite() {
        return 0.0.partial_cmp(&limit).unwrap_or(Ordering::Equal);
    }
    compare(Binary::of(limit))
}

/// Whether what `compare` compares is within two limits.
#[inline]
fn between([t_min, t_max]: [f32; 2], compare: impl Fn(Binary) -> Ordering) -> bool {
    order_with(t_min, &compare) != Ordering::Less
        && order_with(t_max, &compare) != Ordering::Greater
}

/// The order of two meetings on one line; `None` when it does not meet both.
#[cfg(target_pointer_width = "64")]
pub(crate) fn order(line: &Line, one: &Meeting, other: &Meeting) -> Option<Ordering> {
    Some(Distance::new(line, one)?.compare(&Distance::new(line, other)?))
}

/// Whether the line meets it within two limits.
#[cfg(target_pointer_width = "64")]
pub(crate) fn is_within(line: &Line, meeting: &Meeting, limits: [f32; 2]) -> bool {
    Distance::new(line, meeting).is_some_and(|t| t.is_within(limits))
}

/// See [`Distance::approximate`]: of the plane of a triangle; `None` when the line is parallel to it.
#[cfg(target_pointer_width = "64")]
pub(crate) fn to_plane(line: &Line, triangle: &Triangle) -> Option<(f64, f64)> {
    Some(Quotient::new(line, *triangle)?.approximate())
}
