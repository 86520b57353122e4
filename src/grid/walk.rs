//! The walk of a ray through the cells.

use super::ray::CellRay;
use super::steps::{Level, Sides};
use crate::block::cells::{
    Cell, CellBox, EMPTY, GridHead, MOST_DEPTH, Run, SIDES, cell, resolution, side_ahead,
};
use crate::math::rounding::{f32_above, f32_below};
use crate::prim::Leaves;
use crate::query::{Erased, Query, Watch};
use crate::ray::{PreparedRay, Slab, WideSlab};
use crate::simd::{SMALL, Scalar, Simd, Width};

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
        if walk_grid(s, cells, head, ray, slab, query) {
            return true;
        }
    }
    false
}

/// The same for one outermost grid.
#[inline(always)]
fn walk_grid<S: Simd, Q: Query>(
    s: S,
    cells: &Cells,
    head: &GridHead,
    ray: &PreparedRay,
    slab: &impl Slab,
    query: &mut Q,
) -> bool {
    let part = slab.part(&head.bounds, query.t_bound());
    let first = head.first_word as usize;
    let Some(n) = cells.words.get(first).map(|word| resolution(*word)) else { return false };
    if part.is_empty() {
        return false;
    }
    if n == [1; 3] {
        // What lists a few large primitives is seen faster than where the ray is in it.
        query.watch().step();
        let word = cells.words.get(first + 1).copied().unwrap_or(EMPTY);
        if let Cell::Run(run) = cell(word) {
            return visit(s, cells, (run, EVER), ray, slab, query);
        }
    }
    let cell_ray = CellRay::new(head, n, ray);
    if !cell_ray.is_near(head.finest) {
        return from_afar(cells, ray, query);
    }
    let mut part = [f64::from(part.near), f64::from(part.far)];
    if !cell_ray.holds(cell_ray.at(part[0])) {
        part = cell_ray.part(part);
        // Written so that a NaN, from foreign bytes, ends it.
        if !(part[0] <= part[1]) {
            return false;
        }
    }
    let [start, exit] = part;
    let (from, exit) = (cell_ray.at(start), time_above(exit, start));
    let level = Level::outermost(s, &cell_ray, head.first_word, from, exit);
    follow(s, cells, level, (start, cell_ray.turned), ray, slab, query)
}

/// The time from `start` to `t`, rounded up if it is not negative. Finite, as walls that are never passed are beyond it.
#[inline(always)]
pub(super) fn time_above(t: f64, start: f64) -> f32 {
    let time = ((t - start) * (1.0 + 1.0 / (1u64 << 22) as f64)) as f32;
    if time < f32::MAX { time } else { f32::MAX }
}

/// A bound as a time from `start`.
#[inline(always)]
fn bound_of<S: Simd>(s: S, t_bound: f32, start: f64) -> <S as Width<4>>::V {
    Width::<4>::splat(s, time_above(f64::from(t_bound), start))
}

/// For a ray from so far away that not even `f64` tells its cells apart: every block is tested through its box.
#[cold]
#[inline(never)]
fn from_afar<Q: Query>(cells: &Cells, ray: &PreparedRay, query: &mut Q) -> bool {
    let (leaves, slab) = (&cells.leaves, &WideSlab::new(ray));
    // Instances are not handed on by pointers.
    if SMALL || Q::OF_INDEX {
        leaves.intersect_all(Scalar, ray, slab, query)
    } else {
        all_of(leaves, ray, slab, Erased(query))
    }
}

/// The same for queries of any type.
#[inline(never)]
fn all_of(leaves: &Leaves, ray: &PreparedRay, slab: &WideSlab, mut query: Erased<true>) -> bool {
    leaves.intersect_all(Scalar, ray, slab, &mut query)
}

/// From cell to cell until the ray leaves the grid or the bound; true when `query` ended the search. Times are counted from `start`.
#[inline(always)]
fn follow<S: Simd, Q: Query>(
    s: S,
    cells: &Cells,
    mut level: Level<<S as Width<4>>::V>,
    (start, turned): (f64, [u32; 3]),
    ray: &PreparedRay,
    slab: &impl Slab,
    query: &mut Q,
) -> bool {
    let octant = turned[0] & 1 | turned[1] & 2 | turned[2] & 4;
    let sides = Sides::new(s, turned);
    // Where to go on behind inner grids.
    let mut outer = [None; MOST_DEPTH - 1];
    let mut depth = 0;
    let mut t_bound = query.t_bound();
    let mut bound = bound_of(s, t_bound, start);
    loop {
        query.watch().step();
        let word = cells.words.get(level.place as usize).copied().unwrap_or(EMPTY);
        let goes_on = match cell(word) {
            Cell::Empty => {
                let side = side_ahead(word, octant);
                if side > 0 { level.jump(s, SIDES[side], bound) } else { level.step(s, bound) }
            }
            Cell::Grid(first) => {
                // A sound block has neither grids outside the words nor deeper ones.
                let n = cells.words.get(first).map_or([1; 3], |word| resolution(*word));
                let inner = level.inner(s, (first as u32, n), turned);
                if level.step(s, bound)
                    && let Some(place) = outer.get_mut(depth)
                {
                    *place = Some(level);
                    depth += 1;
                }
                level = inner;
                true
            }
            Cell::Run(_) | Cell::Boxed(_) => {
                let listed = match cell(word) {
                    Cell::Boxed(first) => match part_in(s, cells, &level, first, sides, bound) {
                        Some([near, far]) => {
                            let (near, far) = (f64::from(near), f64::from(far));
                            let part = [f32_below(start + near), f32_above(start + far)];
                            Some((first + 1, part))
                        }
                        None => None,
                    },
                    Cell::Run(first) => Some((first, EVER)),
                    _ => None,
                };
                if let Some(listed) = listed {
                    if visit(s, cells, listed, ray, slab, query) {
                        return true;
                    }
                    if query.t_bound() < t_bound {
                        t_bound = query.t_bound();
                        bound = bound_of(s, t_bound, start);
                    }
                }
                level.step(s, bound)
            }
        };
        if !goes_on {
            depth = depth.wrapping_sub(1);
            let Some(Some(next)) = outer.get(depth) else { return false };
            // Those before it on the stack come later still.
            if !next.begins_before(bound) {
                return false;
            }
            level = *next;
        }
    }
}

/// The times between which the ray is in the box of a cell, which is entry `first`; `None` if it is not up to the bound.
#[inline(always)]
fn part_in<S: Simd>(
    s: S,
    cells: &Cells,
    level: &Level<<S as Width<4>>::V>,
    first: usize,
    sides: Sides<<S as Width<4>>::V>,
    bound: <S as Width<4>>::V,
) -> Option<[f32; 2]> {
    let cell_box = cells.runs.get(first).map_or(CellBox::WHOLE, |run| run.cell_box());
    level.part_in(s, cell_box, sides, bound)
}

/// All of a ray.
const EVER: [f32; 2] = [f32::NEG_INFINITY, f32::INFINITY];

/// Offers `query` what the ray meets among the primitives of a run, block by block if it comes into their boxes in a part of
/// it: in a cell's corner there may be little of a block.
#[inline(always)]
fn visit<S: Simd, Q: Query>(
    s: S,
    cells: &Cells,
    (first, [begin, end]): (usize, [f32; 2]),
    ray: &PreparedRay,
    slab: &impl Slab,
    query: &mut Q,
) -> bool {
    for run in cells.runs.get(first..).unwrap_or(&[]) {
        let leaf = run.leaf();
        let aabb = cells.leaves.aabb((leaf.kind(), leaf.number()));
        let t_bound = query.t_bound();
        let part = slab.part(&aabb, if end < t_bound { end } else { t_bound });
        if !(part.is_empty() || part.far < begin) && cells.leaves.intersect(s, leaf, ray, query) {
            return true;
        }
        if run.is_last() {
            break;
        }
    }
    false
}
