//! Where the cells of a grid lie, for those who build one.

use super::{FINEST, dilation};
use crate::block::cells::GridHead;
use crate::math::float::{cube_root, sqrt};
use crate::math::{Aabb, wide};
use glam::DVec3;

/// An axis whose extent is less than this part of the widest one is not divided: so thin a cell would be all edge.
const FLAT: f64 = 1.0 / 4096.0;

/// The least thickness of a flat axis, as a part of its coordinate: less than a unit of `f32`, much more than one of `f64`.
const THICK: f64 = 1.0 / (1u64 << 32) as f64;

/// How far the walls are from the contents, in cells.
const MARGIN: f64 = 1.0 / 512.0;

/// The cells of one grid: coordinates in which they have the size one.
///
/// A cell of a grid in a cell is found through the coordinates of the outermost grid, `(outermost - corner) * scale`: so what
/// rounding takes does not add up from grid to grid.
#[derive(Clone, Copy, Debug)]
pub(super) struct Space {
    /// The box that the outermost grid is over.
    bounds: Aabb,
    lower: [f64; 3],
    per_length: [f64; 3],
    /// The cells of the outermost grid.
    outermost: [f64; 3],
    place: Place,
    pub resolution: [u32; 3],
    /// How far around a cell primitives are listed in it, in cells.
    pub dilation: [f64; 3],
}

/// Where a cell or a grid lies in the outermost grid, whose cells are the units.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub corner: [f64; 3],
    /// How many such cells, or cells of such a grid, there are to the outermost grid's.
    pub scale: [f64; 3],
}

/// What a bounding box comes to in a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Range {
    pub first: [u32; 3],
    pub last: [u32; 3],
}

impl Range {
    /// Whether there is more than one cell along one axis at most: then what reaches from end to end comes near each.
    #[inline(always)]
    pub fn is_straight(&self) -> bool {
        (0..3).filter(|k| self.first[*k] != self.last[*k]).count() <= 1
    }

    pub fn cell_count(&self) -> u64 {
        (0..3).map(|k| u64::from(self.last[k] - self.first[k]) + 1).product()
    }
}

/// Bounds that are finite, and the axes along which they are flat.
fn extents(bounds: &Aabb) -> (DVec3, DVec3) {
    // Beyond all that can be hit, and finite where the box of a huge sphere is not.
    let most = DVec3::splat(1e39);
    let lower = wide(bounds.lower).max(-most);
    (lower, wide(bounds.upper).min(most) - lower)
}

/// The extent of `bounds` along each axis as parts of the widest, zero along an axis that is not to be divided.
pub(super) fn proportions(bounds: &Aabb) -> [f64; 3] {
    let (_, extent) = extents(bounds);
    let widest = extent.max_element();
    [0, 1, 2].map(|k| if extent[k] < widest * FLAT { 0.0 } else { extent[k] / widest })
}

/// How many cubes an axis takes when about `count` fill a box with these edges, of which those that are zero do not
/// count: fractions of a cube, and at least one.
pub(super) fn cubes(edges: [f64; 3], count: f64) -> [f64; 3] {
    let longest = edges[0].max(edges[1]).max(edges[2]);
    let mut share = count;
    let mut axes = 0;
    for edge in edges.into_iter().filter(|edge| *edge > 0.0) {
        share *= longest / edge;
        axes += 1;
    }
    // Along the longest edge.
    let most = match axes {
        3 => cube_root(share),
        2 => sqrt(share),
        _ => share,
    };
    edges.map(|edge| (edge / longest * most).max(1.0))
}

impl Space {
    /// A grid over `bounds` with this many cells along each axis, one along an axis in which they are flat.
    ///
    /// It is a little larger than the bounds, so that what lies in their faces is inside.
    pub fn over(bounds: &Aabb, resolution: [u32; 3]) -> Self {
        let (lower, extent) = extents(bounds);
        let proportions = proportions(bounds);
        let widest = extent.max_element();
        let mut space = Space {
            bounds: *bounds,
            lower: [0.0; 3],
            per_length: [0.0; 3],
            outermost: [1.0; 3],
            place: Place { corner: [0.0; 3], scale: [1.0; 3] },
            resolution,
            dilation: [0.0; 3],
        };
        for (k, n) in resolution.into_iter().map(f64::from).enumerate() {
            let flat = proportions[k] == 0.0;
            let cells = if flat { 1.0 } else { n };
            // Far from zero a flat axis is made so thick that rounding its walls takes nothing of note.
            let flat_cell = (widest / n).max(lower[k].abs() * THICK);
            let cell = if flat { flat_cell } else { extent[k] / cells };
            let margin = if flat { cell / 2.0 } else { MARGIN * cell };
            space.lower[k] = lower[k] - margin;
            space.per_length[k] = cells / (extent[k] + 2.0 * margin);
            space.resolution[k] = cells as u32;
            space.outermost[k] = cells;
            space.dilation[k] = dilation(cells);
        }
        space
    }

    /// The place of one of its cells.
    pub fn place_of(&self, cell: [u32; 3]) -> Place {
        let Place { mut corner, scale } = self.place;
        for k in 0..3 {
            corner[k] += f64::from(cell[k]) / scale[k];
        }
        Place { corner, scale }
    }

    /// A grid in the cell at a place.
    pub fn within(&self, cell: Place, resolution: [u32; 3]) -> Self {
        let mut space = Space { resolution, place: cell, ..*self };
        for (k, n) in resolution.into_iter().map(f64::from).enumerate() {
            space.place.scale[k] *= n;
            space.dilation[k] = dilation(self.outermost[k] * space.place.scale[k]);
        }
        space
    }

    /// The most parts into which the cell at a place may be divided along each axis.
    pub fn most_parts(&self, cell: &Place) -> [f64; 3] {
        [0, 1, 2].map(|k| f64::from(FINEST) / (self.outermost[k] * cell.scale[k]))
    }

    /// The edges of the cell at a place, in unlike units for no two axes.
    pub fn edges(&self, cell: &Place) -> [f64; 3] {
        [0, 1, 2].map(|k| 1.0 / (self.per_length[k] * cell.scale[k]))
    }

    /// Its lower corner, and its cells per length.
    pub fn lines(&self) -> ([f64; 3], [f64; 3]) {
        let Place { corner, scale } = self.place;
        let lower = [0, 1, 2].map(|k| self.lower[k] + corner[k] / self.per_length[k]);
        (lower, [0, 1, 2].map(|k| self.per_length[k] * scale[k]))
    }

    /// What a block keeps of it, if it is an outermost grid.
    pub fn head(&self, first_word: u32, finest: u32) -> GridHead {
        let Space { lower, per_length, bounds, .. } = *self;
        GridHead { lower, per_length, finest, first_word, bounds, reserved: [0; 12] }
    }

    /// A point in cells.
    #[inline(always)]
    pub fn point(&self, p: [f32; 3]) -> [f64; 3] {
        let mut point = [0.0; 3];
        for k in 0..3 {
            let outermost = (f64::from(p[k]) - self.lower[k]) * self.per_length[k];
            point[k] = (outermost - self.place.corner[k]) * self.place.scale[k];
        }
        point
    }

    /// The cell with coordinate `x` on axis `k`, or the one nearest to it. The cast saturates, and
    /// NaN goes to cell 0.
    #[inline(always)]
    fn cell_at(&self, k: usize, x: f64) -> u32 {
        (x as u32).min(self.resolution[k] - 1)
    }

    /// The cells that a box in cells, dilated, reaches, or the nearest ones.
    #[inline(always)]
    pub fn range(&self, lower: [f64; 3], upper: [f64; 3]) -> Range {
        let mut range = Range { first: [0; 3], last: [0; 3] };
        for k in 0..3 {
            range.first[k] = self.cell_at(k, lower[k] - self.dilation[k]);
            range.last[k] = self.cell_at(k, upper[k] + self.dilation[k]);
        }
        range
    }

    /// The cells that the box around points in cells reaches.
    #[inline(always)]
    pub fn range_around(&self, points: &[[f64; 3]; 3]) -> Range {
        let [mut lower, mut upper] = [points[0]; 2];
        for point in &points[1..] {
            for k in 0..3 {
                lower[k] = if point[k] < lower[k] { point[k] } else { lower[k] };
                upper[k] = if point[k] > upper[k] { point[k] } else { upper[k] };
            }
        }
        self.range(lower, upper)
    }

    /// Into how many parts the outermost grid's cells are divided by its cells.
    pub fn parts(&self) -> [f64; 3] {
        self.place.scale
    }

    /// The cells that a box reaches.
    #[inline]
    pub fn range_of(&self, aabb: &Aabb) -> Range {
        self.range(self.point(aabb.lower), self.point(aabb.upper))
    }

    /// The number of a cell.
    #[inline(always)]
    pub fn number(&self, [i, j, k]: [u32; 3]) -> usize {
        let [nx, ny, _] = self.resolution.map(|n| n as usize);
        i as usize + nx * (j as usize + ny * k as usize)
    }

    /// The cell with a number.
    pub fn cell(&self, number: u32) -> [u32; 3] {
        let [nx, ny, _] = self.resolution;
        [number % nx, number / nx % ny, number / (nx * ny)]
    }
}
