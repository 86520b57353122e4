//! The walk of a ray through the cells.

use super::cells::CellRay;
use super::steps::{Real, Steps};
use super::sweep::sweep;
use crate::block::cells::{EMPTY, GridHead, Run, run_start};
use crate::prim::Leaves;
use crate::query::{Query, Watch};
use crate::ray::{Interval, PreparedRay, WideSlab};
use crate::simd::{Scalar, Simd};

/// The parts of a block that a walk reads.
#[derive(Clone, Copy)]
pub(crate) struct Cells<'m> {
    pub head: &'m GridHead,
    pub words: &'m [u32],
    pub runs: &'m [Run],
    pub leaves: Leaves<'m>,
}

/// Offers `query` everything the ray meets, near cells first; true when it ended the search.
///
/// Steps in `f32` where the ray starts within some thousand cells of the grid, in `f64` up to 2^39 cells,
/// and beyond that sweeps over every cell that the ray can touch. Whichever it is, whatever the ray
/// meets at `t` is in the list of a cell that the walk is in at `t`: primitives are listed in every cell
/// within [`DILATION`](super::DILATION) of their box, and stepping errs by less. The hit need not lie in
/// that cell, and nothing here asks it to.
#[inline(always)]
pub(crate) fn walk<S: Simd, Q: Query>(
    s: S,
    cells: &Cells,
    ray: &PreparedRay,
    query: &mut Q,
) -> bool {
    let slab = WideSlab::new(ray);
    let (lower, upper) = cells.head.corners();
    let part = slab.clip(lower, upper, f64::from(query.t_bound()));
    if part.is_empty() {
        return false;
    }
    let cell_ray = CellRay::new(cells.head, ray);
    if cell_ray.steps_safely::<f32>() {
        step(s, cells, Steps::<f32>::new(&cell_ray, part), ray, query)
    } else {
        from_afar(cells, &cell_ray, part, ray, query)
    }
}

/// The walk of a ray from so far away that `f32` would err. They are so rare that portable code will do.
#[cold]
#[inline(never)]
fn from_afar<Q: Query>(
    cells: &Cells,
    cell_ray: &CellRay,
    part: Interval<f64>,
    ray: &PreparedRay,
    query: &mut Q,
) -> bool {
    if cell_ray.steps_safely::<f64>() {
        step(Scalar, cells, Steps::<f64>::new(cell_ray, part), ray, query)
    } else {
        sweep(cells, cell_ray, part, ray, query)
    }
}

/// From cell to cell until the ray leaves the grid or the bound.
#[inline(always)]
fn step<S: Simd, Q: Query, F: Real>(
    s: S,
    cells: &Cells,
    mut steps: Steps<F>,
    ray: &PreparedRay,
    query: &mut Q,
) -> bool {
    loop {
        if visit(s, cells, steps.cell, ray, query) {
            return true;
        }
        if !steps.advance(F::above(query.t_bound())) {
            return false;
        }
    }
}

/// Offers `query` what the ray meets among the primitives listed in a cell.
#[inline(always)]
pub(super) fn visit<S: Simd, Q: Query>(
    s: S,
    cells: &Cells,
    cell: [u32; 3],
    ray: &PreparedRay,
    query: &mut Q,
) -> bool {
    query.watch().step();
    let word = cells.words.get(cells.head.word(cell)).copied().unwrap_or(EMPTY);
    let Some(first) = run_start(word) else { return false };
    for run in cells.runs.get(first..).unwrap_or(&[]) {
        if cells.leaves.intersect(s, run.leaf(), ray, query) {
            return true;
        }
        if run.is_last() {
            break;
        }
    }
    false
}
