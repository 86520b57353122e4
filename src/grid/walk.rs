//! The walk of a ray through the cells.

use super::DILATION;
use crate::block::cells::{EMPTY, GridHead, Run, run_start};
use crate::math::rounding::UNIT;
use crate::prim::Leaves;
use crate::query::Query;
use crate::ray::PreparedRay;

/// Offers `query` everything the ray meets, near cells first; true when it ended the search.
///
/// The `t` of a wall comes from the wall's number, `(wall(i) - origin) * inverse`, and never from
/// adding up steps, so errors do not grow along the ray. At each real `t` the walk is in the cell
/// whose walls have been passed by their computed `t`; a coordinate of the ray is then off that
/// cell by less than the error of one wall, see [`steps_safely`]. Primitives are listed in every
/// cell within [`DILATION`] of their box, so whatever the ray meets at `t` is in the list of the cell
/// in which the walk is at `t`. The hit need not lie in that cell, and nothing here asks it to.
///
/// Source: \[AW87\], in the form that takes `t` from the index.
pub(crate) fn walk<Q: Query>(
    head: &GridHead,
    words: &[u32],
    runs: &[Run],
    leaves: &Leaves,
    ray: &PreparedRay,
    query: &mut Q,
) -> bool {
    let (lower, upper) = head.corners();
    let part = ray.clip(lower, upper, query.t_bound());
    if part.is_empty() {
        return false;
    }
    if !steps_safely(head, ray) {
        return leaves.intersect_all(ray, query);
    }
    let mut steps = Steps::new(head, ray, part.near);
    loop {
        query.saw_step();
        let word = words.get(head.word(steps.cell)).copied().unwrap_or(EMPTY);
        if let Some(first) = run_start(word) {
            for run in runs.get(first..).unwrap_or(&[]) {
                if leaves.intersect(run.leaf(), ray, query) {
                    return true;
                }
                if run.is_last() {
                    break;
                }
            }
        }
        if !steps.advance(head, ray, query.t_bound().min(part.far)) {
            return false;
        }
    }
}

/// Whether the walk errs by less than [`DILATION`] on every axis.
///
/// With `size = |origin| + |lower| + |upper|` along an axis: a wall is off by at most `2 u size`
/// (a product and a sum), its `t` by three roundings, which move the point where the ray meets it by
/// `4 u size` (the distance to the wall is at most `size`); the cell at the start comes from
/// `origin + t * direction`, off by `3 u size`, and a quotient, off by `3 u size`. The sum is below
/// `16 u size`, and the test itself is granted as much again.
fn steps_safely(head: &GridHead, ray: &PreparedRay) -> bool {
    let (lower, upper) = head.corners();
    let size = ray.origin.abs() + lower.abs() + upper.abs();
    (0..3).all(|k| 32.0 * UNIT * size[k] <= DILATION * head.cell[k])
}

/// Where the walk is.
struct Steps {
    cell: [u32; 3],
    /// The `t` of the next wall on each axis.
    t_next: [f64; 3],
}

impl Steps {
    fn new(head: &GridHead, ray: &PreparedRay, t: f64) -> Self {
        let at = ray.origin + t * ray.direction;
        let cell = [0, 1, 2].map(|k| head.cell_at(k, at[k]));
        let mut steps = Steps { cell, t_next: [f64::INFINITY; 3] };
        for k in 0..3 {
            steps.t_next[k] = steps.next_wall(head, ray, k);
        }
        steps
    }

    /// The `t` of the wall ahead on axis `k`; infinite where the ray does not move.
    fn next_wall(&self, head: &GridHead, ray: &PreparedRay, k: usize) -> f64 {
        let d = ray.direction[k];
        if d == 0.0 {
            return f64::INFINITY;
        }
        let wall = head.wall(k, self.cell[k] + u32::from(d > 0.0));
        (wall - ray.origin[k]) * ray.inverse[k]
    }

    /// Goes through the nearest wall; false when it is beyond `t_bound` or the grid ends there.
    fn advance(&mut self, head: &GridHead, ray: &PreparedRay, t_bound: f64) -> bool {
        let [x, y, z] = self.t_next;
        let k = if x <= y && x <= z {
            0
        } else if y <= z {
            1
        } else {
            2
        };
        // Written so that a NaN ends the walk.
        if !(self.t_next[k] <= t_bound) {
            return false;
        }
        let cell = if ray.direction[k] > 0.0 {
            self.cell[k].checked_add(1).filter(|i| *i < head.resolution[k])
        } else {
            self.cell[k].checked_sub(1)
        };
        let Some(cell) = cell else { return false };
        self.cell[k] = cell;
        self.t_next[k] = self.next_wall(head, ray, k);
        true
    }
}
