//! From near cells to far ones around a point.

use super::walk::Cells;
use crate::block::cells::{Cell, EMPTY, GridHead, MOST_DEPTH, cell, resolution};
use crate::point::Seek;

/// No first sphere is smaller than this part of the way to the farthest cell: grids have less than 2^10 cells along an axis.
const LEAST_STEP: f64 = 1.0 / 4096.0;

/// Offers `nearest` what the cells list, in wider and wider spheres around the point.
///
/// The closest point of a primitive lies in a cell that lists it. A sphere twice as wide has eight times as many cells, so that the last
/// one takes most of the time, although each begins anew.
pub(crate) fn search(cells: &Cells, nearest: &mut impl Seek) {
    let point = nearest.around().point.to_array();
    let outermost = |head: &GridHead| {
        let first = head.first_word as usize;
        let n = cells.words.get(first).map(|word| resolution(*word))?;
        let edges = head.per_length.map(|per_length| 1.0 / per_length);
        Some(Level::new(first, n, head.lower, edges, point))
    };
    let levels = || cells.grids.iter().filter_map(outermost);
    // From the nearest grid on, by its cells; grids of one cell are looked into at once.
    let [mut near, mut step, mut farthest] = [f64::INFINITY, f64::INFINITY, 0.0f64];
    for level in levels() {
        farthest = farthest.max(level.farthest());
        if level.n != [1; 3] {
            near = near.min(level.distance());
            step = step.min(level.longest_edge());
        }
    }
    step = step.max(farthest * LEAST_STEP);
    loop {
        let distance = near + step;
        nearest.look_up_to(distance);
        levels().for_each(|level| search_one(cells, level, point, nearest));
        // Written so that a NaN, from foreign bytes, ends it.
        if nearest.is_settled_within(distance) || !(distance < farthest) {
            return;
        }
        step *= 2.0;
    }
}

/// Offers `nearest` what one grid and the grids in its cells list within its bound.
fn search_one(cells: &Cells, outermost: Level, point: [f64; 3], nearest: &mut impl Seek) {
    let mut levels = [outermost; MOST_DEPTH];
    let mut depth = 0;
    loop {
        let Some(level) = levels.get_mut(depth) else { return };
        let Some((word, at)) = level.next(nearest) else {
            let Some(above) = depth.checked_sub(1) else { return };
            depth = above;
            continue;
        };
        match cell(cells.words.get(word).copied().unwrap_or(EMPTY)) {
            Cell::Run(first) => visit(cells, first, nearest),
            Cell::Grid(first) => {
                let n = cells.words.get(first).map(|word| resolution(*word));
                let inner = n.map(|n| level.inner(first, n, at, point));
                if let (Some(inner), Some(place)) = (inner, levels.get_mut(depth + 1)) {
                    *place = inner;
                    depth += 1;
                }
            }
            Cell::Boxed(first) => visit(cells, first + 1, nearest),
            Cell::Empty => {}
        }
    }
}

fn visit(cells: &Cells, first: usize, nearest: &mut impl Seek) {
    for run in cells.runs.get(first..).unwrap_or(&[]) {
        nearest.leaf(run.leaf());
        if run.is_last() {
            break;
        }
    }
}

/// A grid around or beside a point, and how far its cells are visited: planes, rows and cells, each near ones first.
#[derive(Clone, Copy)]
struct Level {
    /// The word of its resolution.
    first: usize,
    n: [u32; 3],
    /// Nothing of these is visited.
    axes: [Outward; 3],
    /// The cells of the row at hand, the rows of its plane, and the planes.
    x: Outward,
    y: Outward,
    z: Outward,
    /// Row and plane, and the squares of their distances.
    row: (u32, f64),
    plane: (u32, f64),
}

impl Level {
    fn new(first: usize, n: [u32; 3], lower: [f64; 3], edges: [f64; 3], point: [f64; 3]) -> Self {
        let axes = [0, 1, 2].map(|k| Outward::new(n[k], lower[k], edges[k], point[k]));
        let [x, y, z] = axes;
        // No row of no plane is visited before the first of each.
        let (x, y) = (x.ended(), y.ended());
        Level { first, n, axes, x, y, z, row: (0, 0.0), plane: (0, 0.0) }
    }

    /// The grid in a cell of this one.
    fn inner(&self, first: usize, n: [u32; 3], at: [u32; 3], point: [f64; 3]) -> Self {
        let lower = [0, 1, 2].map(|k| self.axes[k].wall(at[k]));
        let edges = [0, 1, 2].map(|k| self.axes[k].edge / f64::from(n[k]));
        Level::new(first, n, lower, edges, point)
    }

    /// The word and the place of the next cell that comes within the bound.
    fn next(&mut self, nearest: &impl Seek) -> Option<(usize, [u32; 3])> {
        loop {
            let (row, plane) = (self.row, self.plane);
            if let Some((x, _)) = self.x.next(plane.1 + row.1, nearest) {
                let [nx, ny, _] = self.n.map(|n| n as usize);
                let number = x as usize + nx * (row.0 as usize + ny * plane.0 as usize);
                return Some((self.first + 1 + number, [x, row.0, plane.0]));
            }
            if let Some(row) = self.y.next(plane.1, nearest) {
                self.row = row;
            } else {
                self.plane = self.z.next(0.0, nearest)?;
                self.y = self.axes[1];
                self.row = self.y.next(self.plane.1, nearest)?;
            }
            self.x = self.axes[0];
        }
    }

    fn longest_edge(&self) -> f64 {
        self.axes.iter().fold(0.0, |longest, axis| axis.edge.max(longest))
    }

    /// How far the point is from the grid, along the axis of which that is most.
    fn distance(&self) -> f64 {
        self.axes.iter().fold(0.0, |most, axis| axis.distance().max(most))
    }

    /// Nothing in it is farther than this.
    fn farthest(&self) -> f64 {
        self.axes.iter().map(Outward::farthest).sum()
    }
}

/// The cells along one axis from a point on, near ones first, to both sides.
#[derive(Clone, Copy)]
struct Outward {
    n: u32,
    /// The lower wall of the first cell, and the size of each.
    lower: f64,
    edge: f64,
    point: f64,
    /// So many of the first cells are still to be visited below, and from this one on above.
    below: u32,
    above: u32,
}

impl Outward {
    fn new(n: u32, lower: f64, edge: f64, point: f64) -> Self {
        // The cast saturates, and NaN goes to cell 0.
        let at = (((point - lower) / edge) as u32).min(n);
        Outward { n, lower, edge, point, below: at, above: at }
    }

    /// None of them is still to be visited.
    fn ended(self) -> Self {
        Outward { below: 0, above: self.n, ..self }
    }

    fn wall(&self, i: u32) -> f64 {
        self.lower + f64::from(i) * self.edge
    }

    /// The next cell and the square of its distance along this axis, if that and `square` come within the bound.
    fn next(&mut self, square: f64, nearest: &impl Seek) -> Option<(u32, f64)> {
        let gap = |gap: f64| if gap > 0.0 { gap * gap } else { 0.0 };
        let [below, above] = [self.below > 0, self.above < self.n];
        let down = if below { gap(self.point - self.wall(self.below)) } else { f64::INFINITY };
        let up = if above { gap(self.wall(self.above) - self.point) } else { f64::INFINITY };
        let least = if down < up { down } else { up };
        if !(below || above) || !nearest.around().is_within(square + least) {
            return None;
        }
        if above && !(down < up) {
            self.above += 1;
            return Some((self.above - 1, up));
        }
        self.below -= 1;
        Some((self.below, down))
    }

    fn distance(&self) -> f64 {
        (self.lower - self.point).max(self.point - self.wall(self.n)).max(0.0)
    }

    fn farthest(&self) -> f64 {
        (self.lower - self.point).abs().max((self.wall(self.n) - self.point).abs())
    }
}
