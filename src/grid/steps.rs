//! Steps from cell to cell.

use super::cells::CellRay;
use crate::ray::Interval;

/// The numbers in which steps are computed.
pub(super) trait Real: Copy + PartialOrd {
    /// The unit roundoff.
    const UNIT: f64;
    /// A component this much slower than the fastest one stands still: it moves the ray by less than
    /// a rounding while it crosses the grid.
    const STANDSTILL: f64;
    /// A ray that crosses more cells than this in one `t` does not step: its `t` would underflow.
    const FASTEST: f64;
    const INFINITY: Self;

    /// The nearest number.
    fn near(x: f64) -> Self;
    /// A number that is not below.
    fn above(x: f32) -> Self;
    /// `origin + t * direction`, as a cell of `0 .. resolution`.
    fn cell(origin: Self, t: Self, direction: Self, resolution: u32) -> u32;
    /// `(wall - origin) * inverse`.
    fn reach(wall: u32, origin: Self, inverse: Self) -> Self;
    fn inverse(self) -> Self;
    fn is_zero(self) -> bool;
    fn is_positive(self) -> bool;
}

macro_rules! real {
    ($float:ty, $standstill:expr, $fastest:expr) => {
        impl Real for $float {
            const UNIT: f64 = <$float>::EPSILON as f64 / 2.0;
            const STANDSTILL: f64 = $standstill;
            const FASTEST: f64 = $fastest;
            const INFINITY: Self = <$float>::INFINITY;

            fn near(x: f64) -> Self {
                x as $float
            }

            fn above(x: f32) -> Self {
                <$float>::from(x)
            }

            fn cell(origin: Self, t: Self, direction: Self, resolution: u32) -> u32 {
                // The cast saturates, and NaN goes to cell 0.
                ((origin + t * direction) as u32).min(resolution.saturating_sub(1))
            }

            fn reach(wall: u32, origin: Self, inverse: Self) -> Self {
                (wall as $float - origin) * inverse
            }

            fn inverse(self) -> Self {
                1.0 / self
            }

            fn is_zero(self) -> bool {
                self == 0.0
            }

            fn is_positive(self) -> bool {
                self > 0.0
            }
        }
    };
}

real!(f32, 1.0 / (1u64 << 40) as f64, (1u128 << 100) as f64);
real!(f64, 1.0 / (1u64 << 62) as f64, f64::MAX);

/// Where the walk is.
///
/// The `t` of a wall comes from its number, `(i - origin) / direction`, and never from adding up steps, so
/// errors do not grow along the ray. At each real `t` the walk is in the cell whose walls have been
/// passed by their computed `t`. With `C` the [extent](CellRay::extent) and `u` the unit: rounding the
/// origin moves the ray by `u C`, in `f64` by `2 u C`; a wall's `t` carries four roundings (component,
/// reciprocal, difference, product), which move the point where it is passed by `4 u C`; and the cell
/// at the start carries origin, component, `t`, product and sum. So a coordinate of the ray is off
/// the cell of the walk by at most `6 u C`.
///
/// Source: \[AW87\], in the form that takes `t` from the index.
pub(super) struct Steps<F> {
    pub cell: [u32; 3],
    origin: [F; 3],
    /// Infinite on axes along which the ray stands still.
    inverse: [F; 3],
    forwards: [bool; 3],
    resolution: [u32; 3],
    /// The `t` of the next wall on each axis.
    pub t_next: [F; 3],
    /// Where the ray leaves the grid, or the bound at the start.
    far: F,
}

impl<F: Real> Steps<F> {
    /// The walk from `part.near` on; the ray steps safely in `F`.
    pub fn new(ray: &CellRay, part: Interval<f64>) -> Self {
        let fastest = ray.direction[ray.major()].abs();
        let direction = ray
            .direction
            .map(|d| F::near(if d.abs() <= fastest * F::STANDSTILL { 0.0 } else { d }));
        let origin = ray.origin.map(F::near);
        let start = F::near(part.near);
        let cell = [0, 1, 2].map(|k| F::cell(origin[k], start, direction[k], ray.resolution[k]));
        let mut steps = Steps {
            cell,
            origin,
            inverse: direction.map(|d| if d.is_zero() { F::INFINITY } else { d.inverse() }),
            forwards: direction.map(F::is_positive),
            resolution: ray.resolution,
            t_next: [F::INFINITY; 3],
            // Rounding the exit may cut off less than a step's error, which the margin of the
            // grid around its contents covers.
            far: F::near(part.far),
        };
        for (k, d) in direction.into_iter().enumerate() {
            if !d.is_zero() {
                steps.t_next[k] = steps.next_wall(k);
            }
        }
        steps
    }

    /// The `t` of the wall ahead on axis `k`.
    fn next_wall(&self, k: usize) -> F {
        F::reach(self.cell[k] + u32::from(self.forwards[k]), self.origin[k], self.inverse[k])
    }

    /// Goes through the nearest wall; false when it is beyond `t_bound` or the grid ends there.
    pub fn advance(&mut self, t_bound: F) -> bool {
        let [x, y, z] = self.t_next;
        let k = if x <= y && x <= z {
            0
        } else if y <= z {
            1
        } else {
            2
        };
        // Written so that a NaN ends the walk.
        if !(self.t_next[k] <= t_bound && self.t_next[k] <= self.far) {
            return false;
        }
        let cell = if self.forwards[k] {
            self.cell[k].checked_add(1).filter(|i| *i < self.resolution[k])
        } else {
            self.cell[k].checked_sub(1)
        };
        let Some(cell) = cell else { return false };
        self.cell[k] = cell;
        self.t_next[k] = self.next_wall(k);
        true
    }
}
