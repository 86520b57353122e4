//! The first look at the primitives of a leaf block, in `f32`: it only rejects.

mod areas;
#[cfg(test)]
mod bounds;
mod detail;
mod meetings;
mod sphere;
mod triangle;
mod vector;

pub(crate) use detail::detail;
pub(crate) use sphere::{SphereDetail, sphere};
pub(crate) use triangle::{Triangles, triangles};

/// Far below every bound on coordinates and squares in the frame, and far above what underflow can take
/// away.
const TINY: f32 = 1.0 / (1u128 << 100) as f32;
