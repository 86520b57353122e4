//! How finely to divide, and whether to.

use crate::block::cells::MOST_CELLS;
use crate::grid::options::{GridKind, GridOptions};
use crate::grid::space::{Place, Space, cubes, proportions};
use crate::math::Aabb;
use crate::math::float::cube_root;

/// Cells for each primitive in the outermost grid, and in those within cells.
const OUTER_DENSITY: f64 = 0.02;
const INNER_DENSITY: f64 = 0.2;
/// The latter where no more than a part of what is listed can be listed again: else the first of the cells would take all of the memory, and
/// those after them would stay whole, however much they hold.
const SCARCE_DENSITY: f64 = 1.0 / 220.0;
const SCARCE: u64 = 4;
/// How much coarser the outermost grid becomes along each axis at a time while it is too fine: less than by half, as half may leave an
/// eighth of the cells for which there is room.
const COARSER: f64 = 0.7;
/// A cell with no more than this many primitives is not divided: by the rule it never pays below 49, and hardly ever below this.
pub(super) const FULL: u32 = 96;
/// The most cells along an axis of a grid within a cell.
const MOST_INNER: f64 = 64.0;

/// Costs in steps from cell to cell: a leaf block, how many primitives of a cell one holds, and coming into a grid.
const BLOCK: f64 = 2.0;
const IN_A_BLOCK: u32 = 12;
const ENTRY: f64 = 4.0;

/// The same of listing as many primitives again as a cell holds: for the memory, and for the time to build it.
const TWICE: f64 = 12.0;

/// The resolution of the outermost grid over `count` primitives, made coarser so many times.
pub(super) fn outer(bounds: &Aabb, options: &GridOptions, count: u32, coarser: u32) -> [u32; 3] {
    let proportions = proportions(bounds);
    let cells = match options.kind {
        GridKind::Octree => [2.0; 3],
        _ => cubes(proportions, f64::from(count) * options.density().unwrap_or(OUTER_DENSITY)),
    };
    let part = (0..coarser).fold(1.0, |part, _| part * COARSER);
    // A flat axis has one cell whatever is asked for.
    cells.map(|n| ((n * part + 0.5) as u32).clamp(1, MOST_CELLS))
}

/// Cells for each primitive in grids within cells that list `listed` numbers, when `left` more may be listed.
pub(super) fn inner_density(listed: u64, left: u64) -> f64 {
    if left < listed / SCARCE { SCARCE_DENSITY } else { INNER_DENSITY }
}

/// The resolution of a grid in a cell with `count` primitives, `density` cells for each, halved so many times along each axis; `None`
/// when one cell would be all of it.
pub(super) fn inner(
    space: &Space,
    cell: &Place,
    options: &GridOptions,
    count: u32,
    density: f64,
    coarser: u32,
) -> Option<[u32; 3]> {
    let parts = match options.kind {
        GridKind::Octree => [2.0; 3],
        _ => cubes(space.edges(cell), f64::from(count) * density),
    };
    let most = space.most_parts(cell);
    let resolution =
        [0, 1, 2].map(|k| ((parts[k] + 0.5).min(MOST_INNER).min(most[k]) as u32 >> coarser).max(1));
    (resolution != [1; 3]).then_some(resolution)
}

/// What a cell with `count` primitives costs a ray.
fn of_cell(count: u32) -> f64 {
    BLOCK * f64::from(count.div_ceil(IN_A_BLOCK))
}

/// Whether a cell with `count` primitives had better be divided into cells with `counts`: a ray goes through as many of
/// them as there are along an edge, and meets each as often as its share of the surface says. What is in several of them is listed again.
pub(super) fn is_worth_it(count: u32, counts: &[u32]) -> bool {
    let along = cube_root(counts.len() as f64);
    let (mut blocks, mut listed) = (0.0, 0.0);
    for count in counts {
        blocks += of_cell(*count);
        listed += f64::from(*count);
    }
    let again = listed / f64::from(count) - 1.0;
    ENTRY + along + blocks / (along * along) + TWICE * again < of_cell(count)
}
