//! Floats, integers and boxes; nothing here knows of rays.

pub(crate) mod aabb;
pub(crate) mod binary;
mod bits;
pub(crate) mod error_free;
pub(crate) mod float;
pub(crate) mod integer;
pub(crate) mod rounding;

pub(crate) use aabb::{Aabb, sum_abs, wide};
pub(crate) use bits::Bits;
