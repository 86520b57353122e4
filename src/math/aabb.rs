//! Axis-aligned boxes.

/// A closed box; empty when a lower coordinate is above its upper one.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub(crate) struct Aabb {
    pub lower: [f32; 3],
    pub upper: [f32; 3],
}
