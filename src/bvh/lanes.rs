//! What the collapse chose to be the lanes of a bundle, and what lies below them.

use super::collapse::choice_of;
use super::tree::Grown;
use crate::block::BvhNode;

/// The binary tree and what becomes of it.
#[derive(Clone, Copy)]
pub(crate) struct Chosen<'a> {
    pub nodes: &'a [BvhNode],
    pub choices: &'a [u64],
    /// The ids in the order of the tree's leaves.
    pub ids: &'a [u32],
}

/// A lane of a bundle: a node, and whether all below it is one leaf block.
#[derive(Clone, Copy, Default)]
pub(super) struct Lane {
    pub node: u32,
    pub is_leaf: bool,
}

/// The lanes of a bundle: those that are bundles, then leaves.
#[derive(Clone, Copy)]
pub(super) struct Lanes<const W: usize> {
    lanes: [Lane; W],
    inner: usize,
    count: usize,
}

impl<const W: usize> Lanes<W> {
    pub fn all(&self) -> &[Lane] {
        self.lanes.get(..self.count).unwrap_or_default()
    }

    /// The nodes that bundles stand for.
    pub fn inner(&self) -> impl DoubleEndedIterator<Item = u32> + ExactSizeIterator {
        self.lanes.iter().take(self.inner).map(|lane| lane.node)
    }
}

/// The ids `first .. end` of one leaf block.
pub(super) struct Content {
    pub first: usize,
    pub end: usize,
    pub is_sphere: bool,
}

impl Chosen<'_> {
    /// The lanes of the bundle that stands for `node`, left before right but leaves last: what is pushed last is taken
    /// first, and any hit is found sooner in a leaf.
    pub fn lanes_of<const W: usize>(&self, node: u32) -> Option<Lanes<W>> {
        let mut lanes = [Lane::default(); W];
        let mut stack = [(0u32, 0usize); W];
        stack[0] = (node, W);
        let (mut pending, mut count) = (1, 0);
        let (mut leaves, mut leaf_count) = ([Lane::default(); W], 0);
        while pending > 0 {
            pending -= 1;
            let (at, slots) = stack[pending];
            let node_at = self.nodes.get(at as usize)?;
            let choice = if node_at.is_leaf() { None } else { choice_of(self.choices, node_at) };
            let is_leaf = choice.is_none_or(|choice| choice.is_leaf());
            let splits = match choice {
                // A bundle's own node is split, unless it is the root and all is one leaf.
                Some(_) if at == node => at != 0 || !is_leaf,
                Some(choice) => slots > 1 && !choice.takes_one(slots),
                None => false,
            };
            match choice.filter(|_| splits) {
                Some(choice) => {
                    let left = choice.left_of(slots);
                    *stack.get_mut(pending)? = (node_at.first + 1, slots.checked_sub(left)?);
                    *stack.get_mut(pending + 1)? = (node_at.first, left);
                    pending += 2;
                }
                None if is_leaf => {
                    *leaves.get_mut(leaf_count)? = Lane { node: at, is_leaf };
                    leaf_count += 1;
                }
                None => {
                    *lanes.get_mut(count)? = Lane { node: at, is_leaf };
                    count += 1;
                }
            }
        }
        lanes.get_mut(count..count + leaf_count)?.copy_from_slice(leaves.get(..leaf_count)?);
        Some(Lanes { lanes, inner: count, count: count + leaf_count })
    }

    /// What lies below a node that is a leaf.
    pub fn content(&self, node: u32) -> Option<Content> {
        let (mut left, mut right) = (node, node);
        while let Some(inner) = self.nodes.get(left as usize).filter(|n| !n.is_leaf()) {
            left = inner.first;
        }
        while let Some(inner) = self.nodes.get(right as usize).filter(|n| !n.is_leaf()) {
            right = inner.first + 1;
        }
        let (left, right) = (self.nodes.get(left as usize)?, self.nodes.get(right as usize)?);
        let (count, is_sphere) = Grown::of(right);
        Some(Content { first: left.first as usize, end: right.first as usize + count, is_sphere })
    }
}
