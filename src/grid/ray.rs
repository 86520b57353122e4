//! A ray in the coordinates of a grid.

use super::BEYOND;
use crate::block::cells::GridHead;
use crate::ray::PreparedRay;

/// The ray as `origin + t * direction` in cells, `t` that of the ray's frame, and turned so that no coordinate
/// falls: an axis along which the ray goes down is counted from the other end.
///
/// A point's coordinate is a difference and a product of exact numbers, and for a turned axis another difference: each
/// within three units of `f64` of the real one, relative to how far it is from the corner.
#[derive(Clone, Copy)]
pub(super) struct CellRay {
    pub origin: [f64; 3],
    /// At least [`SLOWEST`].
    pub direction: [f64; 3],
    /// All bits for an axis that is turned, otherwise none.
    pub turned: [u32; 3],
    pub resolution: [u32; 3],
}

/// A component below this counts as this much, which moves no point between the walls by more than that part of a cell: there `t`
/// in the frame is below 2^4.
const SLOWEST: f64 = 1.0 / (1u128 << 80) as f64;

/// A ray that crosses more cells than this in one `t` of the frame, along all axes together, is taken for one from too far away.
const FASTEST: f64 = (1u64 << 60) as f64;

/// The reciprocal of a power of two that is a normal number, as its own is.
#[inline(always)]
fn inverse_power_of_two(x: f64) -> f64 {
    f64::from_bits((2046 << 52) - x.to_bits())
}

impl CellRay {
    #[inline(always)]
    pub fn new(head: &GridHead, resolution: [u32; 3], ray: &PreparedRay) -> Self {
        let mut turned =
            CellRay { origin: [0.0; 3], direction: [0.0; 3], turned: [0; 3], resolution };
        let per_t = inverse_power_of_two(ray.t_scale);
        for k in 0..3 {
            let n = turned.resolution[k];
            let origin = (f64::from(ray.given.origin[k]) - head.lower[k]) * head.per_length[k];
            let direction = f64::from(ray.given.direction[k]) * (head.per_length[k] * per_t);
            let falls = direction < 0.0;
            turned.turned[k] = u32::from(falls).wrapping_neg();
            turned.origin[k] = if falls { f64::from(n) - origin } else { origin };
            let speed = direction.abs();
            turned.direction[k] = if speed < SLOWEST { SLOWEST } else { speed };
        }
        turned
    }

    /// Whether `f64` tells where the ray is to a small part of the finest cell.
    ///
    /// With `C` the largest number of cells that the origin is away from a wall, a point of the ray is off by at most `8 u C`
    /// cells: three units for the origin, four for component, `t` and product, one for the sum. No wall is further away than those of
    /// all axes together, which are easier to compare.
    #[inline(always)]
    pub fn is_near(&self, finest: u32) -> bool {
        let ([x, y, z], [dx, dy, dz], [nx, ny, nz]) =
            (self.origin, self.direction, self.resolution);
        let away = x.abs() + y.abs() + z.abs() + f64::from(nx + ny + nz);
        // Written so that a NaN is not near.
        (away * f64::from(finest) <= BEYOND) & (dx + dy + dz <= FASTEST)
    }

    /// Where the ray is at `t`.
    #[inline(always)]
    pub fn at(&self, t: f64) -> [f32; 3] {
        let ([x, y, z], [dx, dy, dz]) = (self.origin, self.direction);
        [(x + t * dx) as f32, (y + t * dy) as f32, (z + t * dz) as f32]
    }

    /// Whether a point is in the grid, or at most a sixteenth of a cell outside.
    #[inline(always)]
    pub fn holds(&self, at: [f32; 3]) -> bool {
        let mut holds = true;
        for (at, n) in at.into_iter().zip(self.resolution) {
            // Written so that a NaN is outside.
            holds &= (at >= -0.0625) & (at <= n as i32 as f32 + 0.0625);
        }
        holds
    }

    /// What of a part of the ray is between the walls, the first `t` above the second if nothing is: for rays from so far away that `f32`
    /// does not tell where they come into the box.
    ///
    /// Off by less than what the walls are away from the contents.
    #[cold]
    #[inline(never)]
    pub fn part(&self, [mut enter, mut leave]: [f64; 2]) -> [f64; 2] {
        for k in 0..3 {
            let inverse = 1.0 / self.direction[k];
            let near = -self.origin[k] * inverse;
            let far = (f64::from(self.resolution[k]) - self.origin[k]) * inverse;
            enter = if near > enter { near } else { enter };
            leave = if far < leave { far } else { leave };
        }
        [enter, leave]
    }
}
