//! Writes bundles and the ids of leaf blocks from what the collapse chose.
//!
//! The bundles below one follow each other, and so do their leaf blocks and ids. Those below each child of the root's children are
//! a part that is counted and written by itself, so that threads can share them.
//!
//! ```text
//! root | its children a b | children of a | below the first, the second .. of these | children of b | below ..
//! ```

use super::MAX_DEPTH;
use super::lanes::{Chosen, Lane, Lanes};
use crate::block::bundle::{Bundle, ChildRef};
use crate::block::leaf::{KIND_SPHERES, KIND_TRIANGLES};
use crate::caller::Caller;

/// Marks, among the ids, the first one of a leaf block until the blocks are packed.
pub(crate) const BEGINS: u32 = 1 << 31;

/// How much there will be.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Sizes {
    pub bundles: u32,
    pub triangle_blocks: u32,
    pub sphere_blocks: u32,
}

/// Parts at most: sixteen children of sixteen children.
const MOST: usize = 256;

/// How much there will be, of each part and of all.
pub(crate) struct Outline {
    pub sizes: Sizes,
    parts: [Part; MOST],
}

/// How much there will be of a bundle and all below.
#[derive(Clone, Copy, Default)]
struct Part {
    /// Without the one.
    bundles: u32,
    /// Of triangles and of spheres.
    blocks: [u32; 2],
    ids: [usize; 2],
}

impl Part {
    /// Counts the children of a bundle.
    fn add<const W: usize>(&mut self, chosen: &Chosen, lanes: &Lanes<W>) -> Option<()> {
        self.bundles += lanes.inner().len() as u32;
        for lane in lanes.all().iter().filter(|lane| lane.is_leaf) {
            let content = chosen.content(lane.node)?;
            let kind = usize::from(content.is_sphere);
            self.blocks[kind] += 1;
            self.ids[kind] += content.end - content.first;
        }
        Some(())
    }
}

/// Where the ids of leaf blocks go, and the number of the next block: of triangles and of spheres.
#[derive(Default)]
struct Blocks<'i> {
    ids: [&'i mut [u32]; 2],
    next: [u32; 2],
}

impl<'i> Blocks<'i> {
    /// What a part takes from the front.
    fn of(&mut self, part: &Part) -> Option<Blocks<'i>> {
        let mut blocks = Blocks::default();
        for kind in 0..2 {
            let free = core::mem::take(&mut self.ids[kind]);
            (blocks.ids[kind], self.ids[kind]) = free.split_at_mut_checked(part.ids[kind])?;
            blocks.next[kind] = self.next[kind];
            self.next[kind] += part.blocks[kind];
        }
        Some(blocks)
    }

    /// Adds a block of these ids, the first of which is [marked](BEGINS).
    fn push(&mut self, kind: usize, ids: &[u32]) -> Option<ChildRef> {
        let free = core::mem::take(&mut self.ids[kind]);
        let (own, rest) = free.split_at_mut_checked(ids.len())?;
        own.copy_from_slice(ids);
        *own.first_mut()? |= BEGINS;
        self.ids[kind] = rest;
        let number = self.next[kind];
        self.next[kind] += 1;
        Some(ChildRef::leaf([KIND_TRIANGLES, KIND_SPHERES][kind], number))
    }
}

/// The bundles of a part, and what they need.
struct Job<'b, const W: usize> {
    node: u32,
    /// The bundle of that node, and those below it.
    bundle: &'b mut Bundle<W>,
    below: &'b mut [Bundle<W>],
    /// The number of the first one below.
    first: u32,
    blocks: Blocks<'b>,
    written: Option<()>,
}

impl Chosen<'_> {
    /// Counts the parts of the tree of bundles.
    pub fn outline<const W: usize>(&self, caller: &Caller) -> Option<Outline> {
        let (mut top, mut jobs) = (Part { bundles: 1, ..Part::default() }, [None; MOST]);
        let mut places = jobs.iter_mut();
        let root = self.lanes_of::<W>(0)?;
        top.add(self, &root)?;
        for node in root.inner() {
            let lanes = self.lanes_of::<W>(node)?;
            top.add(self, &lanes)?;
            for node in lanes.inner() {
                *places.next()? = Some((node, None));
            }
        }
        caller.for_each(&mut jobs, |job| {
            if let Some((node, part)) = job {
                let mut counted = Part::default();
                let done =
                    self.for_each_from::<W>((*node, 0), 0, |_, lanes| counted.add(self, lanes));
                *part = done.map(|()| counted);
            }
        });
        let mut sizes = Sizes::default();
        let mut add = |part: &Part| {
            let Part { bundles, blocks: [triangles, spheres], .. } = *part;
            sizes.bundles += bundles;
            sizes.triangle_blocks += triangles;
            sizes.sphere_blocks += spheres;
        };
        add(&top);
        let mut parts = [Part::default(); MOST];
        for (part, (_, counted)) in parts.iter_mut().zip(jobs.iter().flatten()) {
            *part = (*counted)?;
            add(part);
        }
        Some(Outline { sizes, parts })
    }

    /// Writes the bundles, and the ids in the order of the leaf blocks: those of triangles first,
    /// those of spheres from `first_sphere`. The first id of each block is [marked](BEGINS).
    ///
    /// The order is the one that [`bundles_are_sound`](super::bundles_are_sound) expects.
    pub fn emit<const W: usize>(
        &self,
        outline: &Outline,
        bundles: &mut [Bundle<W>],
        ids: &mut [u32],
        first_sphere: usize,
        caller: &Caller,
    ) -> Option<()> {
        let (triangles, spheres) = ids.split_at_mut_checked(first_sphere)?;
        let mut blocks = Blocks { ids: [triangles, spheres], next: [0; 2] };
        let mut jobs = [const { None::<Job<W>> }; MOST];
        let mut places = jobs.iter_mut().zip(&outline.parts);
        let mut free = Free { bundles, first: 0 };
        let root = self.lanes_of::<W>(0)?;
        let bundle = free.take(1)?.first_mut()?;
        self.fill(bundle, (root.all(), free.first), &mut blocks)?;
        let children = free.take(root.inner().len() as u32)?;
        for (node, bundle) in root.inner().zip(children) {
            let lanes = self.lanes_of::<W>(node)?;
            self.fill(bundle, (lanes.all(), free.first), &mut blocks)?;
            let children = free.take(lanes.inner().len() as u32)?;
            for (node, bundle) in lanes.inner().zip(children) {
                let (job, part) = places.next()?;
                let (first, blocks) = (free.first, blocks.of(part)?);
                let (below, written) = (free.take(part.bundles)?, None);
                *job = Some(Job { node, bundle, below, first, blocks, written });
            }
        }
        caller.for_each(&mut jobs, |job| {
            if let Some(job) = job {
                job.written = self.write(job);
            }
        });
        jobs.iter().flatten().try_for_each(|job| job.written)
    }

    /// Writes the bundles of a part.
    fn write<const W: usize>(&self, job: &mut Job<W>) -> Option<()> {
        let Job { node, bundle, below, first, blocks, .. } = job;
        // The part's own bundle has a number that none below has.
        self.for_each_from::<W>((*node, 0), *first, |(number, next), lanes| {
            let place = match number {
                0 => &mut **bundle,
                _ => below.get_mut((number - *first) as usize)?,
            };
            self.fill(place, (lanes.all(), next), blocks)
        })
    }

    /// Makes a bundle of lanes, of which those that are bundles have the numbers from `next` on.
    #[inline(always)]
    fn fill<const W: usize>(
        &self,
        bundle: &mut Bundle<W>,
        (lanes, mut next): (&[Lane], u32),
        blocks: &mut Blocks,
    ) -> Option<()> {
        *bundle = Bundle::EMPTY;
        for (i, lane) in lanes.iter().enumerate() {
            let aabb = self.nodes.get(lane.node as usize)?.aabb();
            for k in 0..3 {
                bundle.walls[k][i] = aabb.lower[k];
                bundle.walls[3 + k][i] = aabb.upper[k];
            }
            bundle.refs[i] = if lane.is_leaf {
                let content = self.content(lane.node)?;
                let ids = self.ids.get(content.first..content.end)?;
                blocks.push(usize::from(content.is_sphere), ids)?
            } else {
                next += 1;
                ChildRef::bundle(next - 1)
            };
        }
        Some(())
    }

    /// Calls `f` for a bundle and each below it, with its number, the number of its first inner child, and its lanes,
    /// parents before children and subtree after subtree. The first below has the number `next`.
    fn for_each_from<const W: usize>(
        &self,
        first: (u32, u32),
        mut next: u32,
        mut f: impl FnMut((u32, u32), &Lanes<W>) -> Option<()>,
    ) -> Option<()> {
        // Nodes with the numbers of their bundles; each level leaves at most all lanes but one behind.
        let mut stack = [(0u32, 0u32); MAX_DEPTH * 15 + 1];
        stack[0] = first;
        let mut pending = 1;
        while pending > 0 {
            pending -= 1;
            let (node, number) = stack[pending];
            let lanes = self.lanes_of(node)?;
            f((number, next), &lanes)?;
            let count = lanes.inner().len();
            // The first is taken next.
            let places = stack.get_mut(pending..pending + count)?;
            for (place, child) in
                places.iter_mut().zip(lanes.inner().zip(next..next + count as u32).rev())
            {
                *place = child;
            }
            pending += count;
            next += count as u32;
        }
        Some(())
    }
}

/// Bundles that are not written, and the number of the first.
struct Free<'b, const W: usize> {
    bundles: &'b mut [Bundle<W>],
    first: u32,
}

impl<'b, const W: usize> Free<'b, W> {
    fn take(&mut self, count: u32) -> Option<&'b mut [Bundle<W>]> {
        let free = core::mem::take(&mut self.bundles);
        let (taken, rest) = free.split_at_mut_checked(count as usize)?;
        self.bundles = rest;
        self.first += count;
        Some(taken)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block::BvhNode;
    use crate::bvh::bins::Effort;
    use crate::bvh::branch::grow;
    use crate::bvh::choose::choose;
    use crate::bvh::collapse::{Grounds, LEAF};
    use crate::bvh::refs::PrimRef;
    use crate::bvh::split::Areas;
    use crate::bvh::tree::{Depth, Limits};
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
            .for_each_from::<W>((0, 0), 1, |_, lanes| {
                assert!((1..=W).contains(&lanes.all().len()));
                for lane in lanes.all() {
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
