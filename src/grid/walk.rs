//! The walk of a ray through the cells.

use super::ray::CellRay;
use super::steps::{Level, Part};
use crate::block::cells::{
    Cell, EMPTY, GridHead, MOST_DEPTH, Run, SIDES, cell, resolution, side_ahead,
};
use crate::prim::Leaves;
use crate::query::{Query, Watch};
use crate::ray::{PreparedRay, Slab, WideSlab};
use crate::simd::{Scalar, Simd, Width};

/// The parts of a block that a walk reads.
#[derive(Clone, Copy)]
pub(crate) struct Cells<'m> {
    pub grids: &'m [GridHead],
    pub words: &'m [u32],
    pub runs: &'m [Run],
    pub leaves: Leaves<'m>,
}

/// Offers `query` everything the ray meets, near cells of each grid first; true when it ended the search.
///
/// Whatever the ray meets at `t` is in the list of a cell that the walk is in at `t`: primitives are listed in every cell
/// that they come nearer to than stepping errs. The hit need not lie in that cell, and nothing here asks it to.
#[inline(always)]
pub(crate) fn walk<S: Simd, Q: Query>(
    s: S,
    cells: &Cells,
    ray: &PreparedRay,
    slab: &impl Slab,
    query: &mut Q,
) -> bool {
    for head in cells.grids {
        let first = head.first_word as usize;
        let Some(n) = cells.words.get(first).map(|word| resolution(*word)) else { continue };
        if n == [1; 3] {
            // What lists a few large primitives is seen faster than where the ray is in it.
            query.watch().step();
            let word = cells.words.get(first + 1).copied().unwrap_or(EMPTY);
            if let Cell::Run(run) = cell(word) {
                if visit(s, cells, run, ray, slab, query) {
                    return true;
                }
                continue;
            }
        }
        let cell_ray = CellRay::new(head, n, ray);
        if !cell_ray.is_near(head.finest) {
            return from_afar(cells, ray, query);
        }
        let [enter, exit] = cell_ray.times();
        let t_min = f64::from(ray.t_min);
        let start = if t_min > enter { t_min } else { enter };
        let t_bound = query.t_bound();
        if !(start <= exit && start <= f64::from(t_bound)) {
            continue;
        }
        let part = Part { start, exit };
        let level = Level::outermost(s, &cell_ray, head.first_word, part, t_bound);
        if walk_one(s, cells, level, cell_ray.turned, ray, slab, query) {
            return true;
        }
    }
    false
}

/// For a ray from so far away that not even `f64` tells its cells apart: every block is tested through its box.
#[cold]
#[inline(never)]
fn from_afar<Q: Query>(cells: &Cells, ray: &PreparedRay, query: &mut Q) -> bool {
    cells.leaves.intersect_all(Scalar, ray, &WideSlab::new(ray), query)
}

/// From cell to cell until the ray leaves the grid or the bound; true when `query` ended the search.
#[inline(always)]
fn walk_one<S: Simd, Q: Query>(
    s: S,
    cells: &Cells,
    mut level: Level<<S as Width<4>>::V>,
    turned: [u32; 3],
    ray: &PreparedRay,
    slab: &impl Slab,
    query: &mut Q,
) -> bool {
    let octant = turned[0] & 1 | turned[1] & 2 | turned[2] & 4;
    let mut outer = [level; MOST_DEPTH - 1];
    let mut depth = 0;
    loop {
        query.watch().step();
        let word = cells.words.get(level.place as usize).copied().unwrap_or(EMPTY);
        let mut goes_on = true;
        match cell(word) {
            Cell::Empty => {
                let side = side_ahead(word, octant);
                goes_on = if side > 0 { level.jump(s, SIDES[side]) } else { level.step(s) };
            }
            Cell::Run(first) => {
                if visit(s, cells, first, ray, slab, query) {
                    return true;
                }
                level.look_up_to(s, query.t_bound());
                goes_on = level.step(s);
            }
            Cell::Grid(first) => {
                // A sound block has neither grids outside the words nor deeper ones.
                let n = cells.words.get(first).map(|word| resolution(*word));
                if let (Some(n), Some(place)) = (n, outer.get_mut(depth)) {
                    *place = level;
                    depth += 1;
                    level = level.inner(s, (first as u32, n), turned, query.t_bound());
                }
            }
            Cell::Unknown => return false,
        }
        while !goes_on {
            if depth == 0 || level.ends_before_exit(query.t_bound()) {
                return false;
            }
            depth -= 1;
            level = outer[depth];
            level.look_up_to(s, query.t_bound());
            goes_on = level.step(s);
        }
    }
}

/// Offers `query` what the ray meets among the primitives of a run, block by block if it comes into their boxes: in a cell's corner
/// there may be little of it.
#[inline(always)]
fn visit<S: Simd, Q: Query>(
    s: S,
    cells: &Cells,
    first: usize,
    ray: &PreparedRay,
    slab: &impl Slab,
    query: &mut Q,
) -> bool {
    for run in cells.runs.get(first..).unwrap_or(&[]) {
        let leaf = run.leaf();
        let aabb = cells.leaves.aabb((leaf.kind(), leaf.number()));
        if !slab.part(&aabb, query.t_bound()).is_empty()
            && cells.leaves.intersect(s, leaf, ray, query)
        {
            return true;
        }
        if run.is_last() {
            break;
        }
    }
    false
}
