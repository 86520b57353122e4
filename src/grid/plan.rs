//! How fine the grid is, and how much memory that takes.

use glam::DVec3;

use super::DILATION;
use crate::block::cells::{GridHead, VALUE};
use crate::block::leaf::{SPHERES, TRIANGLES_AT_LEAST};
use crate::block::{Census, Counts};
use crate::error::BuildError;
use crate::math::{Aabb, wide};
use crate::prim::{Survey, for_each_prim};
use crate::scene::Scene;

/// References from cells to primitives, for each primitive, above which a grid is made coarser. A
/// scene of large primitives would otherwise fill each cell with all of them.
const REFERENCES_PER_PRIM: u64 = 32;
/// A scene of few primitives may have this many references in any case.
const REFERENCES_AT_LEAST: u64 = 4096;

/// An axis whose extent is less than this part of the widest one is not divided: cells so thin
/// would make stepping unsafe for rays that start a few thousand widths away.
const FLAT: f64 = 1.0 / 4096.0;

/// The least thickness of a flat axis, as a part of its coordinate: less than a unit of `f32`, much
/// more than one of `f64`. Cells of other axes are never smaller than 2^-34 of theirs.
const THICK: f64 = 1.0 / (1u64 << 32) as f64;

/// A grid that was not built yet.
pub(crate) struct Plan {
    pub head: GridHead,
    /// Sizes of the parts, with room for the most triangle blocks and runs there can be.
    pub counts: Counts,
    /// The bytes they take.
    pub size: usize,
}

/// The number nearest to the cube root of `n`: the cells an axis of the plain uniform grid.
fn cube_root(n: u32) -> u32 {
    let above = |root: u32| (2 * u64::from(root) + 1).pow(3) > 8 * u64::from(n);
    let mut root = 1;
    while !above(root) {
        root += 1;
    }
    root
}

impl GridHead {
    /// `n` cells along each axis of `bounds`; one along an axis in which the scene is flat.
    ///
    /// The grid is a little larger than the bounds, so that what lies in their faces is inside.
    pub fn new(bounds: &Aabb, n: u32) -> Self {
        // Beyond all that can be hit, and finite where the box of a huge sphere is not.
        let most = DVec3::splat(1e39);
        let lower = wide(bounds.lower).max(-most);
        let extent = wide(bounds.upper).min(most) - lower;
        let widest = extent.max_element();
        let mut head =
            GridHead { lower: [0.0; 3], cell: [0.0; 3], resolution: [n; 3], first_word: 0 };
        for k in 0..3 {
            let flat = extent[k] < widest * FLAT;
            let cells = if flat { 1 } else { n };
            // Far from zero a flat axis is made so thick that rounding its walls takes nothing of note.
            let flat_cell = (widest / f64::from(n)).max(lower[k].abs() * THICK);
            let cell = if flat { flat_cell } else { extent[k] / f64::from(n) };
            let margin = if flat { cell / 2.0 } else { 2.0 * DILATION * cell };
            head.lower[k] = lower[k] - margin;
            head.cell[k] = (extent[k] + 2.0 * margin) / f64::from(cells);
            head.resolution[k] = cells;
        }
        head
    }
}

impl Plan {
    /// The plan with `n` cells an axis, or `None` when it refers to primitives too often.
    fn with(scene: &Scene, survey: &Survey, census: &Census, n: u32) -> Option<Plan> {
        let head = GridHead::new(&census.bounds, n);
        let prims = u64::from(census.hittable());
        let most = (REFERENCES_PER_PRIM * prims).max(REFERENCES_AT_LEAST).min(u64::from(VALUE));
        // In a single cell everything is once.
        let references = if n == 1 { prims } else { references(scene, &head) };
        if references > most && n > 1 {
            return None;
        }
        let sphere_blocks = census.sphere_count.div_ceil(SPHERES as u32);
        let triangle_blocks = census.triangle_count.div_ceil(TRIANGLES_AT_LEAST as u32);
        // No block is twice in a run.
        let blocks = u64::from(sphere_blocks) + u64::from(triangle_blocks);
        let runs = references.min(blocks * head.cell_count());
        let counts = Counts {
            geometries: survey.geometry_count,
            prim_ids: census.hittable(),
            grids: 1,
            words: u32::try_from(head.cell_count()).ok()?,
            sphere_blocks,
            triangle_blocks,
            runs: u32::try_from(runs).ok()?,
            ..Counts::default()
        };
        Some(Plan { head, counts, size: counts.offsets()?.end })
    }

    /// The finest plan that takes at most `limit` bytes: the cube root of the number of primitives
    /// along each axis, and a fifth less at each further try, down to a single cell.
    pub fn finest(
        scene: &Scene,
        survey: &Survey,
        census: &Census,
        limit: usize,
    ) -> Result<Plan, BuildError> {
        let mut n = cube_root(census.hittable());
        loop {
            let plan = Plan::with(scene, survey, census, n);
            match plan {
                Some(plan) if plan.size <= limit => return Ok(plan),
                Some(plan) if n == 1 => {
                    return Err(BuildError::OutOfMemory { minimum: plan.size });
                }
                None if n == 1 => return Err(BuildError::TooLarge),
                _ => n = (n * 4 / 5).max(1),
            }
        }
    }

    /// The plan that takes the least memory: one cell.
    pub fn coarsest(scene: &Scene, survey: &Survey, census: &Census) -> Result<Plan, BuildError> {
        Plan::with(scene, survey, census, 1).ok_or(BuildError::TooLarge)
    }
}

/// How often cells refer to primitives: a bound on the entries of all runs.
fn references(scene: &Scene, head: &GridHead) -> u64 {
    let mut sum = 0u64;
    for_each_prim(scene, |prim| {
        let cells = head.cells_of(&prim.shape.aabb());
        let product: u64 = cells.iter().map(|[a, b]| u64::from(b - a) + 1).product();
        sum = sum.saturating_add(product);
    });
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cube_roots_are_rounded_to_nearest() {
        let roots = [1, 2, 3, 4, 8, 27, 967, 7_842_728, 1 << 30].map(cube_root);
        assert_eq!(roots, [1, 1, 1, 2, 2, 3, 10, 199, 1024]);
    }

    #[test]
    fn bounds_lie_inside_the_walls() {
        let bounds = Aabb { lower: [-1.0, 5.0, 0.0], upper: [3.0, 5.0, 1e-3] };
        let head = GridHead::new(&bounds, 7);
        assert_eq!(head.resolution, [7, 1, 7]);
        for k in 0..3 {
            let dilation = head.cell[k] * DILATION;
            assert!(head.lower[k] + dilation < f64::from(bounds.lower[k]));
            assert!(head.wall(k, head.resolution[k]) - dilation > f64::from(bounds.upper[k]));
        }
        let huge = Aabb { lower: [f32::NEG_INFINITY; 3], upper: [f32::INFINITY; 3] };
        assert!(GridHead::new(&huge, 4).cell.iter().all(|c| c.is_finite() && *c > 0.0));
    }
}
