//! A regular grid in flat arrays: which cells a box reaches, and which a ray.

#[cfg(test)]
mod bounds;
mod build;
mod cells;
mod plan;
mod steps;
mod sweep;
mod validate;
mod walk;

pub(crate) use build::{build, needs};
pub(crate) use validate::grid_is_sound;
pub(crate) use walk::{Cells, walk};

use glam::DVec3;

use crate::block::cells::GridHead;
use crate::math::Aabb;

/// Primitives are put into every cell that their box comes nearer to than this part of a cell.
///
/// Stepping errs by less (see [`steps`]), so a ray never leaves the cells in which a primitive that
/// it meets is listed.
const DILATION: f64 = 1.0 / 1024.0;

impl GridHead {
    fn cell_count(&self) -> u64 {
        self.resolution.iter().map(|n| u64::from(*n)).product()
    }

    /// The `i`-th wall across axis `k`: the same arithmetic wherever a wall is needed.
    fn wall(&self, k: usize, i: u32) -> f64 {
        self.lower[k] + f64::from(i) * self.cell[k]
    }

    /// The corners of the whole grid.
    fn corners(&self) -> (DVec3, DVec3) {
        let upper = [0, 1, 2].map(|k| self.wall(k, self.resolution[k]));
        (self.lower.into(), upper.into())
    }

    /// The cell with coordinate `x` on axis `k`, or the one nearest to it. The cast saturates, and
    /// NaN goes to cell 0.
    fn cell_at(&self, k: usize, x: f64) -> u32 {
        let i = ((x - self.lower[k]) / self.cell[k]) as u32;
        i.min(self.resolution[k] - 1)
    }

    /// The first and the last cell on each axis that the box, dilated, reaches.
    fn cells_of(&self, aabb: &Aabb) -> [[u32; 2]; 3] {
        [0, 1, 2].map(|k| {
            let dilation = self.cell[k] * DILATION;
            [
                self.cell_at(k, f64::from(aabb.lower[k]) - dilation),
                self.cell_at(k, f64::from(aabb.upper[k]) + dilation),
            ]
        })
    }

    /// The number of the word of a cell.
    fn word(&self, cell: [u32; 3]) -> usize {
        let [i, j, k] = cell.map(|c| c as usize);
        let [nx, ny, _] = self.resolution.map(|n| n as usize);
        self.first_word as usize + i + nx * (j + ny * k)
    }
}
