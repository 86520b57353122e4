//! What a block holds, in numbers.

use crate::block::cells::resolution;
use crate::block::{Block, Bundles, KIND_BVH, KIND_GRID, Motion};

/// What a block holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Leaf blocks alone.
    List,
    /// A regular grid.
    Grid,
    /// A bounding volume hierarchy.
    Bvh,
}

/// How the nodes of a BVH lie in memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layout {
    /// [`Wide(16)`](Self::Wide): the fastest on most machines. The block says how it is read, not
    /// the machine.
    #[default]
    Automatic,
    /// Binary nodes of 32 bytes: the least memory, and the least stack.
    Compact,
    /// Bundles of 4, 8 or 16 boxes, over leaves of a whole block each.
    Wide(u32),
}

/// What a block holds, in numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Info {
    /// The structure: that over the instances, if there are any.
    pub kind: Kind,
    /// How its nodes lie in memory; compact where there are none.
    pub layout: Layout,
    /// Lower corner of the box around everything that can be hit, instances included.
    pub lower: [f32; 3],
    /// Upper corner; below `lower` when nothing can be hit.
    pub upper: [f32; 3],
    /// Triangles that can be hit.
    pub triangle_count: u32,
    /// Spheres that can be hit.
    pub sphere_count: u32,
    /// Instances, which are not counted by what is in them.
    pub instance_count: u32,
    /// Triangles without area, spheres without radius, and whatever is not finite.
    pub ignored_count: u32,
    /// Cells along each axis of a grid, of the outermost one if they are nested; zero otherwise.
    pub resolution: [u32; 3],
    /// The bytes of the whole block.
    pub size: usize,
    /// Bytes of nodes (BVH), or of cell words and runs (grid); those over instances included.
    pub structure_size: usize,
    /// Bytes of leaf blocks, the primitives themselves, and of instances.
    pub leaf_size: usize,
    /// Bytes of primitive ids.
    pub id_size: usize,
    /// What a ray costs by the surface area heuristic, over that when the block was built; `None` if the block cannot be
    /// refitted. From about 2 on a new build is likely to pay.
    pub cost_growth: Option<f32>,
}

/// What a block holds outside instances.
pub(super) fn info_of(block: &Block) -> Info {
    let Block { whole, header, grids, nodes, bundles, words, runs, .. } = *block;
    Info {
        kind: match header.kind {
            KIND_GRID => Kind::Grid,
            KIND_BVH => Kind::Bvh,
            _ => Kind::List,
        },
        layout: match bundles {
            Bundles::None => Layout::Compact,
            _ => Layout::Wide(header.layout),
        },
        lower: header.bounds.lower,
        upper: header.bounds.upper,
        triangle_count: header.triangle_count,
        sphere_count: header.sphere_count,
        instance_count: 0,
        ignored_count: header.ignored_count,
        resolution: grids
            .last()
            .and_then(|grid| words.get(grid.first_word as usize))
            .map_or([0; 3], |word| resolution(*word)),
        size: whole.bytes().len(),
        structure_size: size_of_val(grids)
            + size_of_val(nodes)
            + bundles.size()
            + size_of_val(words)
            + size_of_val(runs),
        leaf_size: size_of_val(block.triangle_blocks) + size_of_val(block.sphere_blocks),
        id_size: size_of_val(block.prim_ids),
        cost_growth: whole.motion().map(Motion::growth),
    }
}
