//! A tree in any order brought into that of a depth-first walk.

use super::MAX_DEPTH;
use super::tree::Grown;
use crate::block::BvhNode;

/// Brings pairs of children into the order in which a depth-first walk meets their parents, and the ids
/// of leaves into that of the leaves. `pairs` holds a word for each pair.
pub(super) fn put_in_order(
    nodes: &mut [BvhNode],
    pairs: &mut [u32],
    ids: &[u32],
    ordered: &mut [u32],
) -> Option<()> {
    let mut stack = [0u32; MAX_DEPTH];
    let (mut pending, mut next, mut next_id) = (0, 1, 0);
    let mut at = 0u32;
    loop {
        let node = nodes.get_mut(at as usize)?;
        let first = node.first as usize;
        if !node.is_leaf() {
            // Children are met where they still are, and named where they will be.
            *pairs.get_mut(next)? = node.first / 2;
            node.first = 2 * next as u32;
            next += 1;
            *stack.get_mut(pending)? = first as u32 + 1;
            pending += 1;
            at = first as u32;
            continue;
        }
        let end = next_id + Grown::of(node).0;
        node.first = next_id as u32;
        let own = ids.get(first..first + end - next_id)?;
        ordered.get_mut(next_id..end)?.copy_from_slice(own);
        next_id = end;
        if pending == 0 {
            return permute(nodes, pairs.get_mut(..next)?);
        }
        pending -= 1;
        at = stack[pending];
    }
}

/// Moves to each place from 1 on the pair that `pairs` names for it, along cycles.
fn permute(nodes: &mut [BvhNode], pairs: &mut [u32]) -> Option<()> {
    for start in 1..pairs.len() {
        let saved: [BvhNode; 2] = nodes.get(2 * start..2 * start + 2)?.try_into().ok()?;
        let mut place = start;
        loop {
            let from = core::mem::replace(pairs.get_mut(place)?, place as u32) as usize;
            if from == start {
                nodes.get_mut(2 * place..2 * place + 2)?.copy_from_slice(&saved);
                break;
            }
            nodes.get(2 * from..2 * from + 2)?;
            nodes.copy_within(2 * from..2 * from + 2, 2 * place);
            place = from;
        }
    }
    Some(())
}
