//! How fine the grid is, and how much memory that takes.

use core::ops::Range;

use super::pack::most_blocks;
use crate::block::cells::{MOST_CELLS, VALUE, cell_count};
use crate::block::leaf::{SPHERES, TRIANGLES_AT_LEAST};
use crate::block::{Census, Counts};
use crate::caller::Caller;
use crate::error::BuildError;
use crate::grid::narrow::{Axis, Narrow};
use crate::grid::options::GridOptions;
use crate::grid::sixteen::{Sixteen, ends, for_each_sixteen};
use crate::grid::space::{Range as Cells, Space, cubes, proportions};
use crate::math::float::cube_root;
use crate::prim::{GRAIN, Survey, for_each_named_in, packed};
use crate::scene::Scene;
use crate::simd::{Kernel, Lanes, Simd, Width, dispatch};

/// References from cells to primitives, for each primitive, above which a grid is made coarser. A
/// scene of large primitives would otherwise fill each cell with all of them.
const REFERENCES_PER_PRIM: u64 = 32;
/// A scene of few primitives may have this many references in any case.
const REFERENCES_AT_LEAST: u64 = 4096;

/// A grid that was not built yet.
#[derive(Clone, Copy)]
pub(crate) struct Plan {
    pub space: Space,
    /// Sizes of the parts, with room for the most triangle blocks and runs there can be.
    pub counts: Counts,
    /// The bytes they take.
    pub size: usize,
}

/// How fine a grid is meant to be: cells along each axis, in fractions of one.
///
/// The cube root of the number of primitives, along each axis; or, if a density is given, cubes.
fn wanted(census: &Census, options: &GridOptions) -> [f64; 3] {
    let count = f64::from(census.hittable());
    match options.density() {
        None => [cube_root(count); 3],
        Some(density) => cubes(proportions(&census.bounds), count * density),
    }
}

/// The resolution nearest to what is wanted.
fn rounded(cells: [f64; 3]) -> [u32; 3] {
    cells.map(|n| ((n + 0.5) as u32).clamp(1, MOST_CELLS))
}

impl Plan {
    /// The plan with this resolution, or `None` when it refers to primitives too often.
    fn with(
        scene: &Scene,
        survey: &Survey,
        census: &Census,
        caller: &Caller,
        resolution: [u32; 3],
    ) -> Option<Plan> {
        let space = Space::over(&census.bounds, resolution);
        let cells = cell_count(space.resolution);
        let prims = u64::from(census.hittable());
        let most = (REFERENCES_PER_PRIM * prims).max(REFERENCES_AT_LEAST).min(u64::from(VALUE));
        // In a single cell everything is once.
        let references = if cells == 1 { prims } else { references(scene, census, &space, caller) };
        if references > most && cells > 1 {
            return None;
        }
        let sphere_blocks = most_blocks(census.sphere_count as usize, SPHERES) as u32;
        let triangles = census.triangle_count as usize;
        let triangle_blocks = most_blocks(triangles, TRIANGLES_AT_LEAST) as u32;
        // No block is twice in a run.
        let blocks = u64::from(sphere_blocks) + u64::from(triangle_blocks);
        let runs = references.min(blocks * cells);
        let counts = Counts {
            geometries: survey.geometry_count,
            prim_ids: census.hittable(),
            grids: 1,
            words: u32::try_from(1 + cells).ok()?,
            sphere_blocks,
            triangle_blocks,
            runs: u32::try_from(runs).ok()?,
            ..Counts::default()
        };
        Some(Plan { space, counts, size: counts.offsets()?.end })
    }

    /// The finest plan that takes at most `limit` bytes: as the rule says, and a fifth less along each axis at each further try,
    /// down to a single cell.
    pub fn finest(
        scene: &Scene,
        survey: &Survey,
        census: &Census,
        options: &GridOptions,
        caller: &Caller,
        limit: usize,
    ) -> Result<Plan, BuildError> {
        let mut cells = wanted(census, options);
        loop {
            let resolution = rounded(cells);
            let is_one = resolution == [1; 3];
            match Plan::with(scene, survey, census, caller, resolution) {
                Some(plan) if plan.size <= limit => return Ok(plan),
                Some(plan) if is_one => {
                    return Err(BuildError::OutOfMemory { minimum: plan.size });
                }
                None if is_one => return Err(BuildError::TooLarge),
                _ => cells = cells.map(|n| n * 0.8),
            }
        }
    }

    /// The plan that takes the least memory: one cell.
    pub fn coarsest(
        scene: &Scene,
        survey: &Survey,
        census: &Census,
        caller: &Caller,
    ) -> Result<Plan, BuildError> {
        Plan::with(scene, survey, census, caller, [1; 3]).ok_or(BuildError::TooLarge)
    }
}

/// How often cells refer to primitives: a bound on the entries of all runs.
fn references(scene: &Scene, census: &Census, space: &Space, caller: &Caller) -> u64 {
    let (limit, sound) = (census.prim_limit as usize, census.ignored_count == 0);
    let narrow = Narrow::new(space);
    let in_part = |ids: Range<usize>| {
        let mut sum = 0u64;
        // Leaf blocks hold balls around boxes, and the cells of these are what runs list.
        if scene.boxes().is_some() {
            let ids = ids.start as u32..ids.end as u32;
            for_each_named_in(scene, ids, false, |prim, _| {
                let Cells { first, last } = narrow.range_of(&packed(prim.shape).aabb());
                let along = |k: usize| u64::from(last[k] - first[k]) + 1;
                sum = sum.saturating_add(along(0) * along(1) * along(2));
            });
            return sum;
        }
        for_each_sixteen(scene, ids, sound, |sixteen| {
            sum = sum.saturating_add(cells_of(&narrow, sixteen));
        });
        sum
    };
    let mut all = 0u64;
    caller.for_parts(limit, caller.part_size(limit, GRAIN), in_part, |sum| {
        all = all.saturating_add(sum);
    });
    all
}

/// How many cells primitives reach.
fn cells_of(narrow: &Narrow, sixteen: &Sixteen) -> u64 {
    let counts = dispatch(CellCounts { narrow, sixteen });
    counts[..sixteen.count.min(16)].iter().map(|count| *count as u64).sum()
}

/// Counts the cells that each of sixteen primitives reaches, or a few more.
struct CellCounts<'a> {
    narrow: &'a Narrow,
    sixteen: &'a Sixteen,
}

impl Kernel for CellCounts<'_> {
    type Output = [f32; 16];

    #[inline(always)]
    fn run<S: Simd>(self, s: S) -> [f32; 16] {
        let one = Width::<16>::splat(s, 1.0);
        // Two products are rounded, each by less than what that grants.
        let mut count = Width::<16>::splat(s, 1.0 + 1.0 / (1u32 << 22) as f32);
        for k in 0..3 {
            let axis: Axis<_> = self.narrow.axis::<S, 16>(s, k);
            let [least, largest] = ends(self.sixteen.along(s, k));
            count = count.mul(axis.last(axis.at(largest)).sub(axis.first(axis.at(least))).add(one));
        }
        let mut counts = [0.0; 16];
        count.store(&mut counts);
        counts
    }
}
