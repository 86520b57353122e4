//! A bounding volume hierarchy: a binary tree of 32-byte nodes over the leaf blocks.

mod build;
mod stack;
mod traverse;
mod tree;
mod validate;
mod wide;

pub(crate) use build::{build, needs};
pub(crate) use traverse::traverse;
pub(crate) use validate::tree_is_sound;
pub(crate) use wide::traverse_wide;

/// No path from the root is longer, whatever the scene, so a stack of this many entries suffices.
///
/// SAH splits are allowed as long as the rest could still be halved down to leaves within this
/// depth; `2^30` primitives halve 28 times to leaves of six, and one level parts kinds.
const MAX_DEPTH: usize = 64;

/// Primitives of a leaf at most. Six triangles never need more than the rest of one block and a
/// second one.
const LEAF_MAX: usize = 6;
