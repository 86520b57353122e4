//! What a block that may be refitted keeps of its build.

#![allow(unsafe_code, reason = "a promise about the layout drawn here")]

use crate::storage::Plain;

/// What tells whether a scene is the one that was built, and how good the structure still is for it.
///
/// ```text
/// byte 0         8            12     16
///      | indices | cost built | cost |
/// ```
///
/// `indices` is a digest of all vertex numbers. Costs are those of the surface area heuristic, 1 at least.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(crate) struct Motion {
    pub indices: u64,
    pub cost_built: f32,
    pub cost: f32,
}
const _: () = assert!(size_of::<Motion>() == 16);

// SAFETY: numbers only; 8 + 4 + 4 = 16, so no padding.
unsafe impl Plain for Motion {}

impl Motion {
    /// The cost over that when it was built.
    pub fn growth(&self) -> f32 {
        self.cost / self.cost_built
    }
}
