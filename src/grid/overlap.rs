//! Which cells of a grid a triangle comes near to.

use super::space::Space;
use crate::prim::Shape;

/// A triangle against boxes of one size: cells, dilated.
///
/// A cell is left out only if one of these parts it from the triangle: the plane, or in one of three projections the line of
/// an edge. (The axes are the ranges that the caller goes through.) Computed in `f64` from coordinates below
/// 2^30 cells, the sides of edges are off by less than 2^-20 of a cell, which the dilation has to spare. The plane of a sliver is
/// off by as much as the products of its edges are rounded, and that is added.
///
/// Source: \[SS10\].
pub(super) struct Overlap {
    /// For each projection and edge `x` and `y` of the inward normal, and its least distance.
    edges: [[[f64; 3]; 3]; 3],
    normal: [f64; 3],
    /// The plane's distance from a cell's corner lies between these if it crosses the cell.
    plane: [f64; 2],
}

/// A coordinate above this, in cells, is not computed with.
const MOST: f64 = (1u64 << 30) as f64;

/// The axes onto which is projected, for each axis along which is.
pub(super) const ACROSS: [[usize; 2]; 3] = [[1, 2], [2, 0], [0, 1]];

impl Overlap {
    /// The triangle with these corners in cells; `None` when that is too large to tell.
    #[inline]
    pub fn new(corners: &[[f64; 3]; 3], dilation: [f64; 3]) -> Option<Self> {
        let edge = |i: usize, k: usize| corners[(i + 1) % 3][k] - corners[i][k];
        let mut size = 0.0;
        for corner in corners {
            for x in corner {
                size = if x.abs() > size { x.abs() } else { size };
            }
        }
        // Written so that a NaN is too large.
        if !(size < MOST) {
            return None;
        }
        let mut overlap = Overlap { edges: [[[0.0; 3]; 3]; 3], normal: [0.0; 3], plane: [0.0; 2] };
        let mut sizes = [0.0; 2];
        for (k, [x, y]) in ACROSS.into_iter().enumerate() {
            overlap.normal[k] = edge(0, x) * edge(1, y) - edge(0, y) * edge(1, x);
            for (i, size) in sizes.iter_mut().enumerate() {
                *size += edge(i, k).abs();
            }
            let side = if overlap.normal[k] < 0.0 { -1.0 } else { 1.0 };
            for (i, corner) in corners.iter().enumerate() {
                let (nx, ny) = (-edge(i, y) * side, edge(i, x) * side);
                let widths = [1.0 + 2.0 * dilation[x], 1.0 + 2.0 * dilation[y]];
                let reach = nx.max(0.0) * widths[0] + ny.max(0.0) * widths[1];
                let from = [corner[x] + dilation[x], corner[y] + dilation[y]];
                overlap.edges[k][i] = [nx, ny, reach - nx * from[0] - ny * from[1]];
            }
        }
        let rounding = sizes[0] * sizes[1] * (size + 1.0) / (1u64 << 48) as f64;
        let (mut least, mut most) = (-rounding, rounding);
        for k in 0..3 {
            let n = overlap.normal[k];
            let from = corners[0][k] + dilation[k];
            let width = n * (1.0 + 2.0 * dilation[k]);
            least += n * from - width.max(0.0);
            most += n * from - width.min(0.0);
        }
        overlap.plane = [least, most];
        Some(overlap)
    }

    /// Whether it may come near a cell, by the cell's lower corner.
    #[inline(always)]
    pub fn with(&self, corner: [f64; 3]) -> bool {
        let [a, b, c] = self.normal;
        let at = a * corner[0] + b * corner[1] + c * corner[2];
        let mut apart = (at < self.plane[0]) | (at > self.plane[1]);
        for ([x, y], edges) in ACROSS.into_iter().zip(&self.edges) {
            for [nx, ny, least] in edges {
                apart |= nx * corner[x] + ny * corner[y] + least < 0.0;
            }
        }
        !apart
    }
}

/// Calls `f` with the number of each cell that a primitive comes near, and returns how many cells were looked at.
#[inline(always)]
pub(super) fn cells_near(space: &Space, shape: &Shape, mut f: impl FnMut(usize)) -> u64 {
    let (range, overlap) = match *shape {
        Shape::Triangle([a, b, c]) => {
            let corners = [space.point(a), space.point(b), space.point(c)];
            let range = space.range_around(&corners);
            let overlap =
                if range.is_straight() { None } else { Overlap::new(&corners, space.dilation) };
            (range, overlap)
        }
        Shape::Sphere { .. } | Shape::Box(_) => (space.range_of(&shape.aabb()), None),
    };
    for z in range.first[2]..=range.last[2] {
        for y in range.first[1]..=range.last[1] {
            for x in range.first[0]..=range.last[0] {
                let corner = [f64::from(x), f64::from(y), f64::from(z)];
                if overlap.as_ref().is_none_or(|overlap| overlap.with(corner)) {
                    f(space.number([x, y, z]));
                }
            }
        }
    }
    range.cell_count()
}
