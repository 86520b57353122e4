//! Instances: where they are, and how they are written down.
//!
//! [`map`] holds the arithmetic, [`boxes`] what the index over instances is built of, [`write`] the parts of a block that
//! belong to them.

mod boxes;
mod map;
mod parts;
mod write;

pub(crate) use boxes::{Counted, Placed};
pub(crate) use map::Map;
pub(crate) use write::{fixed_size, write};
