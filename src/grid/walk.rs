//! The walk of a ray through the cells.

use super::way::{Entry, Listed, Outer, Way};
use crate::block::cells::{Cell, GridHead, Run, cell};
use crate::prim::Leaves;
use crate::query::{Erased, Query, Watch};
use crate::ray::{PreparedRay, Slab, WideSlab};
use crate::simd::{SMALL, Scalar, Simd};

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
        let ended = match Way::into(s, cells, head, ray, slab, query.t_bound()) {
            Entry::Beside => false,
            Entry::Listed(listed) => {
                // What lists a few large primitives is seen faster than where the ray is in it.
                query.watch().step();
                visit(s, cells, listed, ray, slab, query)
            }
            Entry::Afar => return from_afar(cells, ray, query),
            Entry::Way(way) => follow(s, cells, way, ray, slab, query),
        };
        if ended {
            return true;
        }
    }
    false
}

/// For a ray from so far away that not even `f64` tells its cells apart: every block is tested through its box.
#[cold]
#[inline(never)]
pub(crate) fn from_afar<Q: Query>(cells: &Cells, ray: &PreparedRay, query: &mut Q) -> bool {
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

/// From cell to cell until the ray leaves the grid or the bound; true when `query` ended the search.
#[inline(always)]
fn follow<S: Simd, Q: Query>(
    s: S,
    cells: &Cells,
    mut way: Way<S>,
    ray: &PreparedRay,
    slab: &impl Slab,
    query: &mut Q,
) -> bool {
    let mut outer = Outer::<S>::NONE;
    loop {
        query.watch().step();
        let word = way.word(cells);
        let goes_on = match cell(word) {
            Cell::Empty => way.pass(s, word),
            Cell::Grid(first) => {
                way.enter(s, cells, first, &mut outer);
                true
            }
            Cell::Run(_) | Cell::Boxed(_) => {
                let listed = match cell(word) {
                    Cell::Boxed(first) => way.listed(s, cells, first),
                    Cell::Run(first) => Some(Listed::always(first)),
                    _ => None,
                };
                if let Some(listed) = listed {
                    if visit(s, cells, listed, ray, slab, query) {
                        return true;
                    }
                    way.heed(s, query.t_bound());
                }
                way.step(s)
            }
        };
        if !goes_on && !way.leave(&mut outer) {
            return false;
        }
    }
}

/// Offers `query` what the ray meets among the primitives of a run, block by block if it comes into their boxes in a part of
/// it: in a cell's corner there may be little of a block.
#[inline(always)]
pub(crate) fn visit<S: Simd, Q: Query>(
    s: S,
    cells: &Cells,
    Listed { first, begin, end }: Listed,
    ray: &PreparedRay,
    slab: &impl Slab,
    query: &mut Q,
) -> bool {
    for run in cells.runs.get(first..).unwrap_or(&[]) {
        let leaf = run.leaf();
        let aabb = cells.leaves.aabb((leaf.kind(), leaf.number()));
        let t_bound = query.t_bound();
        let part = slab.part_by(s, &aabb, if end < t_bound { end } else { t_bound });
        if !(part.is_empty() || part.far < begin) && cells.leaves.intersect(s, leaf, ray, query) {
            return true;
        }
        if run.is_last() {
            break;
        }
    }
    false
}
