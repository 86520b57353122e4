//! What a build of a grid may choose.

use crate::block::cells::MOST_DEPTH;

/// Cells for each primitive at most.
const MOST_DENSE: f32 = 64.0;

/// How a grid divides space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum GridKind {
    /// A coarse grid whose full cells hold finer ones: follows the scene where it is uneven.
    #[default]
    Nested,
    /// Cells of one size.
    Uniform,
    /// Two cells along each axis, and again two in each that is full.
    Octree,
}

/// What a build of a grid may choose. Zero and the default kind suit most scenes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GridOptions {
    /// How space is divided.
    pub kind: GridKind,
    /// Cells for each primitive, of the outermost grid if they are nested; at most 64, which more count as. Zero, or whatever is not
    /// above it: for a uniform grid the cube root of the number of primitives along each axis, otherwise a fiftieth.
    pub density: f32,
    /// How deep grids may be nested, the outermost counted, up to 8; zero means that, as does more.
    pub depth: u32,
}

impl GridOptions {
    /// Whether all are what they may be: what is not counts as the nearest that is.
    #[cfg(feature = "capi")]
    pub(crate) fn are_in_range(&self) -> bool {
        // A NaN is in no range.
        (0.0..=MOST_DENSE).contains(&self.density) && self.depth as usize <= MOST_DEPTH
    }

    /// The density asked for.
    pub(super) fn density(&self) -> Option<f64> {
        (self.density > 0.0).then(|| f64::from(self.density.min(MOST_DENSE)))
    }

    /// The depth to stay within.
    pub(super) fn most_depth(&self) -> usize {
        match self.depth as usize {
            0 => MOST_DEPTH,
            depth => depth.min(MOST_DEPTH),
        }
    }
}
