//! Writes bundles and the ids of leaf blocks from what the collapse chose.

use super::MAX_DEPTH;
use super::collapse::choice_of;
use super::tree::Grown;
use crate::block::BvhNode;
use crate::block::bundle::{Bundle, ChildRef};
use crate::block::leaf::{KIND_SPHERES, KIND_TRIANGLES};

/// Marks, among the ids, the first one of a leaf block until the blocks are packed.
pub(crate) const BEGINS: u32 = 1 << 31;

/// The binary tree and what becomes of it.
#[derive(Clone, Copy)]
pub(crate) struct Chosen<'a> {
    pub nodes: &'a [BvhNode],
    pub choices: &'a [u64],
    /// The ids in the order of the tree's leaves.
    pub ids: &'a [u32],
}

/// How much there will be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Sizes {
    pub bundles: u32,
    pub triangle_blocks: u32,
    pub sphere_blocks: u32,
}

/// A lane of a bundle: a node, and whether all below it is one leaf block.
#[derive(Clone, Copy, Default)]
struct Lane {
    node: u32,
    is_leaf: bool,
}

impl Chosen<'_> {
    /// Counts the parts of the tree of bundles.
    pub fn sizes<const W: usize>(&self) -> Option<Sizes> {
        let mut sizes = Sizes { bundles: 1, ..Sizes::default() };
        self.for_each_bundle::<W>(|_, lanes| {
            for lane in lanes {
                if !lane.is_leaf {
                    sizes.bundles += 1;
                } else if self.content(lane.node)?.is_sphere {
                    sizes.sphere_blocks += 1;
                } else {
                    sizes.triangle_blocks += 1;
                }
            }
            Some(())
        })?;
        Some(sizes)
    }

    /// Writes the bundles, and the ids in the order of the leaf blocks: those of triangles first,
    /// those of spheres from `first_sphere`. The first id of each block is [marked](BEGINS).
    ///
    /// The order is the one that [`bundles_are_sound`](super::bundles_are_sound) expects.
    pub fn emit<const W: usize>(
        &self,
        bundles: &mut [Bundle<W>],
        ids: &mut [u32],
        first_sphere: usize,
    ) -> Option<()> {
        let (triangles, spheres) = ids.split_at_mut_checked(first_sphere)?;
        let mut kinds = [(KIND_TRIANGLES, triangles, 0), (KIND_SPHERES, spheres, 0)];
        self.for_each_bundle::<W>(|numbers, lanes| {
            let (number, mut next_child) = numbers;
            let bundle = bundles.get_mut(number as usize)?;
            *bundle = Bundle::EMPTY;
            for (i, lane) in lanes.iter().enumerate() {
                let aabb = self.nodes.get(lane.node as usize)?.aabb();
                for k in 0..3 {
                    bundle.walls[k][i] = aabb.lower[k];
                    bundle.walls[3 + k][i] = aabb.upper[k];
                }
                bundle.refs[i] = if lane.is_leaf {
                    let content = self.content(lane.node)?;
                    let (kind, free, blocks) = &mut kinds[usize::from(content.is_sphere)];
                    let (own, rest) =
                        core::mem::take(free).split_at_mut_checked(content.end - content.first)?;
                    own.copy_from_slice(self.ids.get(content.first..content.end)?);
                    *own.first_mut()? |= BEGINS;
                    *free = rest;
                    *blocks += 1;
                    ChildRef::leaf(*kind, *blocks - 1)
                } else {
                    next_child += 1;
                    ChildRef::bundle(next_child - 1)
                };
            }
            Some(())
        })
    }

    /// Calls `f` with the number of each bundle, the number of its first inner child, and its lanes,
    /// parents before children and subtree after subtree.
    fn for_each_bundle<const W: usize>(
        &self,
        mut f: impl FnMut((u32, u32), &[Lane]) -> Option<()>,
    ) -> Option<()> {
        // Nodes with the numbers of their bundles; each level leaves at most all lanes but one behind.
        let mut stack = [(0u32, 0u32); MAX_DEPTH * 15 + 1];
        let (mut pending, mut next) = (1, 1);
        while pending > 0 {
            pending -= 1;
            let (node, number) = stack[pending];
            let mut lanes = [Lane::default(); W];
            let count = self.lanes_of(node, &mut lanes)?;
            let lanes = lanes.get(..count)?;
            f((number, next), lanes)?;
            let children = lanes.iter().filter(|lane| !lane.is_leaf);
            for (lane, number) in children.clone().zip(next..) {
                *stack.get_mut(pending)? = (lane.node, number);
                pending += 1;
            }
            let count = children.count();
            stack.get_mut(pending - count..pending)?.reverse();
            next += count as u32;
        }
        Some(())
    }

    /// The lanes of the bundle that stands for `node`, left before right but leaves last: what is pushed last is taken
    /// first, and any hit is found sooner in a leaf.
    fn lanes_of<const W: usize>(&self, node: u32, lanes: &mut [Lane; W]) -> Option<usize> {
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
        Some(count + leaf_count)
    }

    /// What lies below a node that is a leaf.
    fn content(&self, node: u32) -> Option<Content> {
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

/// The ids `first .. end` of one leaf block.
struct Content {
    first: usize,
    end: usize,
    is_sphere: bool,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::bins::Effort;
    use crate::bvh::branch::grow;
    use crate::bvh::choose::choose;
    use crate::bvh::collapse::{Grounds, LEAF};
    use crate::bvh::refs::PrimRef;
    use crate::bvh::split::Areas;
    use crate::bvh::tree::{Depth, Limits};
    use crate::caller::Caller;
    use crate::math::Aabb;
    use crate::prim::Source;
    use crate::scene::Scene;
    use std::vec::Vec;

    const LEAVES: usize = 7;
    const PRICE: f32 = 0.05;

    /// Cubes strewn by a generator of 16 bits, each a leaf that stands for `spheres` spheres.
    fn tree(seed: u32, spheres: u32) -> Vec<BvhNode> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(0x19660d).wrapping_add(0x3c6ef35f);
            (state >> 16) as f32 / 65536.0
        };
        let mut refs: Vec<_> = (0..LEAVES as u32)
            .map(|id| {
                let lower = [next(), next(), next()];
                let edge = 0.3 * next();
                PrimRef::new(id, &Aabb { lower, upper: lower.map(|x| x + edge) }, true)
            })
            .collect();
        let mut nodes = std::vec![BvhNode::inner(&Aabb::EMPTY, 0); 2 * LEAVES];
        let limits = Limits::new(LEAVES, 1, Depth::Deep, Effort::BALANCED);
        let caller = &Caller::new(None, None);
        let size = grow(&mut nodes, &mut refs, LEAVES, &limits, caller);
        assert_eq!(size.map(|size| size.nodes), Some(2 * LEAVES));
        for node in nodes.iter_mut().filter(|node| node.is_leaf()) {
            node.lanes = spheres | 1 << 8;
        }
        nodes
    }

    fn areas() -> Areas {
        Areas::new(&Aabb { lower: [0.0; 3], upper: [1.3; 3] })
    }

    /// What an inner node may become; all that are in reach of `W` lanes are tried below.
    #[derive(Clone, Copy, PartialEq)]
    enum Fate {
        Gone,
        Bundle,
        Leaf,
    }

    /// The nodes that stand for `node` in the bundle above it.
    fn lanes(nodes: &[BvhNode], fates: &[Fate], node: usize) -> Vec<usize> {
        let at = &nodes[node];
        if at.is_leaf() || fates[at.first as usize / 2 - 1] != Fate::Gone {
            return std::vec![node];
        }
        let first = at.first as usize;
        [lanes(nodes, fates, first), lanes(nodes, fates, first + 1)].concat()
    }

    /// The cost of a node as one lane, and the spheres below it.
    fn cost(nodes: &[BvhNode], fates: &[Fate], node: usize, width: usize) -> (f32, u32) {
        let at = &nodes[node];
        let area = areas().of(&at.aabb());
        if at.is_leaf() {
            return (LEAF * area + PRICE, at.lanes & 0xff);
        }
        let first = at.first as usize;
        let below = [lanes(nodes, fates, first), lanes(nodes, fates, first + 1)].concat();
        let mut sum = (0.0, 0);
        for lane in &below {
            let (cost, spheres) = cost(nodes, fates, *lane, width);
            sum = (sum.0 + cost, sum.1 + spheres);
        }
        let own = match fates[first / 2 - 1] {
            Fate::Leaf if sum.1 <= 15 => LEAF * area + PRICE,
            Fate::Bundle if below.len() <= width => {
                area + PRICE * (28 * width) as f32 / 256.0 + sum.0
            }
            _ => f32::INFINITY,
        };
        (own, sum.1)
    }

    /// The least cost of all trees there are.
    fn least(nodes: &[BvhNode], width: usize) -> f32 {
        let inner = LEAVES - 1;
        let all = (0..3usize.pow(inner as u32)).map(|code| {
            let fates: Vec<_> = (0..inner as u32)
                .map(|i| [Fate::Gone, Fate::Bundle, Fate::Leaf][code / 3usize.pow(i) % 3])
                .collect();
            cost(nodes, &fates, 0, width).0
        });
        all.fold(f32::INFINITY, f32::min)
    }

    fn chosen<const W: usize>(nodes: &[BvhNode]) -> f32 {
        let mut choices = [0; LEAVES - 1];
        let scene = Scene::new(&[], &[]);
        let grounds =
            Grounds { nodes, ids: &[], areas: areas(), price: PRICE, together: usize::MAX };
        let source = Source { scene: &scene, geometries: &[], named: false };
        choose::<W>(&grounds, source, &Caller::new(None, None), &mut choices).expect("a tree");
        let area = |node: u32| areas().of(&nodes[node as usize].aabb());
        let mut sum = area(0) + PRICE * (28 * W) as f32 / 256.0;
        Chosen { nodes, choices: &choices, ids: &[] }
            .for_each_bundle::<W>(|_, lanes| {
                assert!((1..=W).contains(&lanes.len()));
                for lane in lanes {
                    let (cost, bytes) = if lane.is_leaf { (LEAF, 256) } else { (1.0, 28 * W) };
                    sum += cost * area(lane.node) + PRICE * bytes as f32 / 256.0;
                }
                Some(())
            })
            .expect("a walk");
        sum
    }

    #[test]
    fn no_other_tree_of_bundles_costs_less() {
        for seed in 0..40 {
            // Two, three or five leaves of the binary tree fill a block.
            for spheres in [3, 5, 7] {
                let nodes = tree(seed, spheres);
                let (four, best) = (chosen::<4>(&nodes), least(&nodes, 4));
                assert!((four - best).abs() <= 1e-5 * best, "{seed} {spheres}: {four} {best}");
                let (eight, best) = (chosen::<8>(&nodes), least(&nodes, 8));
                assert!((eight - best).abs() <= 1e-5 * best, "{seed} {spheres}: {eight} {best}");
            }
        }
    }
}
