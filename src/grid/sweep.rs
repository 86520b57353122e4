//! Every cell that a ray can touch, for origins so far away that steps would err.

use super::cells::CellRay;
use super::walk::{Cells, visit};
use crate::math::rounding::UNIT;
use crate::query::Query;
use crate::ray::{Interval, PreparedRay, WideSlab};
use crate::simd::Scalar;

/// Offers `query` what is listed in each cell that the ray comes near, layer by layer along its fastest
/// axis; true when that ended the search.
///
/// From an origin `C` cells away a coordinate at a computed `t`, and the coordinate at which a wall is
/// passed, are off by at most `6 u C` cells as in [`Steps`](super::steps::Steps). The ray is therefore taken
/// as `16 u C` cells thick, which may be many; when it is thicker than half the grid every block is
/// tested through its box instead.
pub(super) fn sweep<Q: Query>(
    cells: &Cells,
    cell_ray: &CellRay,
    part: Interval<f64>,
    ray: &PreparedRay,
    query: &mut Q,
) -> bool {
    let resolution = cell_ray.resolution;
    let pad = 16.0 * UNIT * cell_ray.extent() + super::DILATION;
    let widest = resolution[0].max(resolution[1]).max(resolution[2]);
    // Written so that a NaN or an infinity comes here.
    if !(2.0 * pad < f64::from(widest)) {
        return cells.leaves.intersect_all(Scalar, &mut { *ray }, &WideSlab::new(ray), query);
    }
    let major = cell_ray.major();
    let layers = resolution[major];
    let forwards = cell_ray.direction[major] > 0.0;
    for step in 0..layers {
        let layer = if forwards { step } else { layers - 1 - step };
        let times = times_in(cell_ray, major, layer, pad);
        let times = Interval { near: times.near.max(part.near), far: times.far.min(part.far) };
        if times.near > f64::from(query.t_bound()) {
            return false;
        }
        if times.is_empty() {
            continue;
        }
        let mut ranges = [0, 1, 2].map(|k| cells_at(cell_ray, k, times, pad));
        ranges[major] = [layer, layer];
        if visit_all(cells, ranges, ray, query) {
            return true;
        }
    }
    false
}

/// The `t` at which the thick ray is in a layer.
fn times_in(ray: &CellRay, axis: usize, layer: u32, pad: f64) -> Interval<f64> {
    let (o, d) = (ray.origin[axis], ray.direction[axis]);
    let walls = [f64::from(layer) - pad, f64::from(layer) + 1.0 + pad].map(|wall| (wall - o) / d);
    Interval { near: walls[0].min(walls[1]), far: walls[0].max(walls[1]) }
}

/// The first and the last cell on an axis that the thick ray reaches during `times`.
fn cells_at(ray: &CellRay, axis: usize, times: Interval<f64>, pad: f64) -> [u32; 2] {
    let (o, d) = (ray.origin[axis], ray.direction[axis]);
    let [a, b] = [times.near, times.far].map(|t| o + t * d);
    let last = ray.resolution[axis].saturating_sub(1);
    // The casts saturate.
    [((a.min(b) - pad) as u32).min(last), ((a.max(b) + pad) as u32).min(last)]
}

fn visit_all<Q: Query>(
    cells: &Cells,
    [x, y, z]: [[u32; 2]; 3],
    ray: &PreparedRay,
    query: &mut Q,
) -> bool {
    for k in z[0]..=z[1] {
        for j in y[0]..=y[1] {
            for i in x[0]..=x[1] {
                if visit(Scalar, cells, [i, j, k], ray, query) {
                    return true;
                }
            }
        }
    }
    false
}
