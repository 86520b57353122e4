//! A bounding volume hierarchy over the leaf blocks, in two forms: a binary tree of 32-byte nodes, or a
//! tree of bundles.

mod bins;
mod branch;
mod budget;
mod choose;
mod clip;
mod collapse;
mod compact;
mod curve;
mod emit;
mod fill;
mod fits;
mod lanes;
mod order;
mod places;
mod plan;
mod refit;
mod refs;
mod reinsert;
mod runs;
mod search;
mod shared;
mod spatial;
mod split;
mod spread;
mod stack;
mod sweep;
mod task;
mod traverse;
mod tree;
mod validate;
mod wide;
mod wide_build;

use crate::caller::Caller;

pub(crate) use bins::Effort;
pub(crate) use compact::{build, needs};
pub(crate) use refit::{Cost, refit_bundles, refit_nodes};
pub(crate) use search::{search, search_wide};
pub(crate) use shared::SharedStack;
pub(crate) use stack::Columns;
pub(crate) use traverse::traverse;
pub(crate) use validate::{bundles_are_sound, tree_is_sound};
pub(crate) use wide::{ENOUGH_ROOM, Walk, fetch, traverse_wide};
pub(crate) use wide_build::{build_wide, needs_wide};

/// No path from the root is longer, whatever the scene, so a stack of this many entries suffices.
///
/// SAH splits are allowed as long as the rest could still be halved down to leaves within this
/// depth; `2^30` primitives halve 28 times to leaves of five, and one level parts kinds. A bundle
/// takes the place of one binary node at least, so a tree of bundles is no deeper.
const MAX_DEPTH: usize = 64;

/// How a tree is built.
pub(crate) struct How<'a> {
    pub effort: Effort,
    pub caller: &'a Caller<'a>,
}
