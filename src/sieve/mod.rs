//! The first look at the primitives of a leaf block, in `f32`: it only rejects.

mod abreast;
#[cfg(test)]
mod abreast_bounds;
mod areas;
mod beside;
#[cfg(test)]
mod bounds;
mod detail;
mod meetings;
mod sphere;
mod triangle;
mod vector;

pub(crate) use abreast::{Aim, Found, Opened, Sheared};
pub(crate) use detail::detail;
pub(crate) use sphere::{SphereDetail, sphere};
pub(crate) use triangle::{Single, Triangles, triangles};
