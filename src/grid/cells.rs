//! A ray in the coordinates of a grid: cells are the units, and walls lie at whole numbers.

use super::DILATION;
use super::steps::Real;
use crate::block::cells::GridHead;
use crate::ray::PreparedRay;

/// The ray as `origin + t * direction` in cells, `t` that of the ray's frame.
///
/// Both are within a few units of `f64` of the real ones: a difference and a quotient of exact
/// numbers, and a quotient and a power of two.
pub(super) struct CellRay {
    pub origin: [f64; 3],
    pub direction: [f64; 3],
    pub resolution: [u32; 3],
}

impl CellRay {
    pub fn new(head: &GridHead, ray: &PreparedRay) -> Self {
        let given = &ray.given;
        CellRay {
            origin: [0, 1, 2].map(|k| (f64::from(given.origin[k]) - head.lower[k]) / head.cell[k]),
            direction: [0, 1, 2]
                .map(|k| f64::from(given.direction[k]) / ray.t_scale / head.cell[k]),
            resolution: head.resolution,
        }
    }

    /// The largest number that a step computes with: how far the origin and any wall are from the
    /// corner of the grid, and from each other.
    pub fn extent(&self) -> f64 {
        let along = |k: usize| self.origin[k].abs() + f64::from(self.resolution[k]);
        along(0).max(along(1)).max(along(2)) + 1.0
    }

    /// Whether steps in `F` err by less than the dilation.
    ///
    /// With `C` the extent, a coordinate of the walk is off by at most `6 u C`, see [`Steps`](super::steps::Steps).
    /// Granted are 8, for what inserting in `f64` is off.
    pub fn steps_safely<F: Real>(&self) -> bool {
        8.0 * F::UNIT * self.extent() <= DILATION
            && self.direction[self.major()].abs() <= F::FASTEST
    }

    /// The fastest axis.
    pub fn major(&self) -> usize {
        let [x, y, z] = self.direction.map(f64::abs);
        if x >= y && x >= z { 0 } else { usize::from(z > y) + 1 }
    }
}
