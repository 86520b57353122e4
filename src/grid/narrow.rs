//! The cells of boxes in `f32`: a few more than there are at times, never fewer, and many times faster than in `f64`.

use super::space::{Range, Space};
use crate::math::Aabb;
use crate::simd::{Lanes, Width};

/// The cells that one grid's builders look for.
///
/// `x` times a power of two lies in a grid about as wide as one. From there to cells it is two differences and a product,
/// `((x - high) - low) * per_length`, where `high + low` is the grid's lower corner. Each rounds by `u` of what it comes to, or not at all, as `x` and `high` are close together
/// then, and `per_length` is off by `u` of itself; so the result is, by `4 u` of itself. What `low` is off by, `u` of itself, is `2 u^2` of the corner. A reach
/// added and a number rounded take two roundings more. [`SLACK`] times `n + 2` is twice as much where it matters; beyond the grid's `n` cells nothing does.
#[derive(Clone, Copy, Debug)]
pub(super) struct Narrow {
    axes: [Axis<f32>; 3],
    /// How far around a cell all is near, in cells.
    pub reach: [f32; 3],
    pub resolution: [u32; 3],
}

/// One axis, or with a vector in place of a number several, or one for several numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axis<V> {
    scale: V,
    high: V,
    low: V,
    per_length: V,
    /// How far around a primitive cells count as near, and a half.
    before: V,
    /// The same less a half, to be added.
    behind: V,
    /// The number of the last cell.
    last: V,
    half: V,
    zero: V,
    rounder: V,
}

/// What rounding takes for each cell.
const SLACK: f64 = 12.0 / (1u64 << 24) as f64;

/// Numbers from here to twice that are whole.
const ROUNDER: f32 = (1u32 << 23) as f32;

impl Narrow {
    pub fn new(space: &Space) -> Self {
        let (lower, per_length) = space.lines();
        let mut reaches = [0.0; 3];
        let axes = [0, 1, 2].map(|k| {
            let n = f64::from(space.resolution[k]);
            let scale = power_near(n / per_length[k]);
            let lower = lower[k] * f64::from(scale);
            let per_length = per_length[k] / f64::from(scale);
            let high = lower as f32;
            let lost = lower.abs() * per_length / (1u64 << 46) as f64;
            let reach = space.dilation[k] + SLACK * (n + 2.0) + lost;
            reaches[k] = reach as f32;
            Axis {
                scale,
                high,
                low: (lower - f64::from(high)) as f32,
                per_length: per_length as f32,
                before: (reach + 0.5) as f32,
                behind: (reach - 0.5) as f32,
                last: (n - 1.0) as f32,
                half: 0.5,
                zero: 0.0,
                rounder: ROUNDER,
            }
        });
        Narrow { axes, reach: reaches, resolution: space.resolution }
    }

    /// One axis for as many numbers as there are lanes.
    #[inline(always)]
    pub fn axis<S: Width<N>, const N: usize>(&self, s: S, k: usize) -> Axis<S::V> {
        let Axis { scale, high, low, per_length, before, behind, last, half, zero, rounder } =
            self.axes[k % 3];
        Axis {
            scale: s.splat(scale),
            high: s.splat(high),
            low: s.splat(low),
            per_length: s.splat(per_length),
            before: s.splat(before),
            behind: s.splat(behind),
            last: s.splat(last),
            half: s.splat(half),
            zero: s.splat(zero),
            rounder: s.splat(rounder),
        }
    }

    /// All axes side by side.
    #[inline(always)]
    fn across(&self) -> Axis<[f32; 4]> {
        let [x, y, z] = self.axes;
        let four = |f: fn(&Axis<f32>) -> f32| [f(&x), f(&y), f(&z), f(&z)];
        Axis {
            scale: four(|axis| axis.scale),
            high: four(|axis| axis.high),
            low: four(|axis| axis.low),
            per_length: four(|axis| axis.per_length),
            before: four(|axis| axis.before),
            behind: four(|axis| axis.behind),
            last: four(|axis| axis.last),
            half: [0.5; 4],
            zero: [0.0; 4],
            rounder: [ROUNDER; 4],
        }
    }

    /// The cells that a box reaches, or the nearest ones.
    #[inline(always)]
    pub fn range_of(&self, aabb: &Aabb) -> Range {
        let [first, last] = self.ends(aabb);
        let three = |[x, y, z, _]: [f32; 4]| [x as u32, y as u32, z as u32];
        Range { first: three(first), last: three(last) }
    }

    #[inline(always)]
    fn ends(&self, aabb: &Aabb) -> [[f32; 4]; 2] {
        let axes = self.across();
        let four = |[x, y, z]: [f32; 3]| [x, y, z, z];
        [axes.first(axes.at(four(aabb.lower))), axes.last(axes.at(four(aabb.upper)))]
    }
}

impl<V: Copy> Axis<V> {
    /// Numbers in cells.
    #[inline(always)]
    pub fn at<const N: usize>(&self, x: V) -> V
    where
        V: Lanes<N>,
    {
        x.mul(self.scale).sub(self.high).sub(self.low).mul(self.per_length)
    }

    /// The first cell that is near, or the nearest one; NaN goes to cell 0.
    #[inline(always)]
    pub fn first<const N: usize>(&self, at: V) -> V
    where
        V: Lanes<N>,
    {
        self.rounded(at.sub(self.before))
    }

    /// The last one.
    #[inline(always)]
    pub fn last<const N: usize>(&self, at: V) -> V
    where
        V: Lanes<N>,
    {
        self.rounded(at.add(self.behind))
    }

    /// The cell that a number is in, or nearly.
    #[inline(always)]
    pub fn cell<const N: usize>(&self, at: V) -> V
    where
        V: Lanes<N>,
    {
        self.rounded(at.sub(self.half))
    }

    #[inline(always)]
    fn rounded<const N: usize>(&self, x: V) -> V
    where
        V: Lanes<N>,
    {
        x.max(self.zero).min(self.last).add(self.rounder).sub(self.rounder)
    }
}

/// A power of two by which a length comes near one, as far as `f32` has it.
fn power_near(length: f64) -> f32 {
    let exponent = (length.to_bits() >> 52) as i32 - 1023;
    f32::from_bits((127 - exponent.clamp(-126, 126)) as u32 * (1 << 23))
}
