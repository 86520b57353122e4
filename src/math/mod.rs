//! Floats, integers and boxes; nothing here knows of rays.

pub(crate) mod aabb;
pub(crate) mod binary;
mod bits;
pub(crate) mod error_free;
mod extent;
#[cfg(any(test, not(target_pointer_width = "64")))]
pub(crate) mod fixed;
pub(crate) mod float;
pub(crate) mod integer;
pub(crate) mod rounding;
mod sort;
pub(crate) mod wide;

pub(crate) use aabb::Aabb;
pub(crate) use bits::Bits;
pub(crate) use extent::Extent;
pub(crate) use sort::heap_sort;
pub(crate) use wide::{sum_abs, wide};
