//! The face of a built structure.

use core::mem::MaybeUninit;

use crate::error::{BuildError, OpenError};
use crate::query::QueryOptions;
use crate::ray::{Hit, Ray};
use crate::scene::Scene;

/// Every block starts at a multiple of this many bytes.
pub const ALIGNMENT: usize = 64;

/// How much memory a build wants.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Memory {
    /// Enough for all the options ask, scratch included; a multiple of `alignment`.
    pub size: usize,
    /// The least that is accepted; below it the build is refused.
    pub minimum: usize,
    /// 64.
    pub alignment: usize,
}

/// How much time a build may take for the sake of the rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Quality {
    /// Binned SAH.
    #[default]
    Balanced,
    /// For a structure that is built every frame. Not in this version.
    Fast,
    /// For a structure that is built once. Not in this version.
    Best,
}

/// How the nodes of a BVH lie in memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layout {
    /// What suits this machine.
    #[default]
    Automatic,
    /// Binary nodes of 32 bytes: the least memory.
    Compact,
    /// Bundles of 4, 8 or 16 records. Not in this version.
    Wide(u32),
}

/// Whether a plain list may stand for the structure asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PlainList {
    /// For a handful of primitives, which no structure makes faster.
    #[default]
    Automatic,
    /// Never: build the structure even over one primitive.
    Never,
    /// Always: every ray is tested against every leaf block.
    Always,
}

/// What a build may choose. The default in every field suits most scenes.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BuildOptions {
    /// Time spent on building.
    pub quality: Quality,
    /// The layout of a BVH.
    pub layout: Layout,
    /// Whether the block must stay refittable. Not in this version.
    pub refit: bool,
    /// Whether a plain list may stand in.
    pub plain_list: PlainList,
}

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

/// What a block holds, in numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Info {
    /// The structure.
    pub kind: Kind,
    /// Lower corner of the box around everything that can be hit.
    pub lower: [f32; 3],
    /// Upper corner; below `lower` when nothing can be hit.
    pub upper: [f32; 3],
    /// Triangles that can be hit.
    pub triangle_count: u32,
    /// Spheres that can be hit.
    pub sphere_count: u32,
    /// Triangles without area, spheres without radius, and whatever is not finite.
    pub ignored_count: u32,
    /// Cells along each axis of a grid, zero otherwise.
    pub resolution: [u32; 3],
    /// The bytes of the whole block.
    pub size: usize,
    /// Bytes of nodes (BVH), or of cell words and runs (grid).
    pub structure_size: usize,
    /// Bytes of leaf blocks: the primitives themselves.
    pub leaf_size: usize,
    /// Bytes of primitive ids.
    pub id_size: usize,
}

/// What a query did, for charts and heat maps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Boxes of BVH nodes, or cells of a grid, looked at.
    pub steps: u64,
    /// Leaf blocks opened.
    pub blocks: u64,
    /// Triangles and spheres tested.
    pub tests: u64,
}

/// The surface at a hit, in world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// The point of the hit, rounded.
    pub position: [f32; 3],
    /// Bound on the distance of `position` from the surface, along each axis.
    pub position_error: f32,
    /// Unit normal: `(v1 - v0) x (v2 - v0)`, or outward on spheres; never flipped to the ray.
    pub normal: [f32; 3],
    /// `position` moved off the surface to the side of the normal.
    pub front_origin: [f32; 3],
    /// `position` moved off the surface to the other side.
    pub back_origin: [f32; 3],
}

/// A built structure: a view of one block in the caller's memory.
#[derive(Clone, Copy)]
pub struct Accel<'m> {
    block: &'m [u8],
}

/// The memory [`build_bvh`] needs for `scene`.
pub fn bvh_needs(scene: &Scene, options: &BuildOptions) -> Result<Memory, BuildError> {
    todo!()
}

/// The memory [`build_grid`] needs for `scene`.
pub fn grid_needs(scene: &Scene, options: &BuildOptions) -> Result<Memory, BuildError> {
    todo!()
}

/// Builds a BVH over `scene` at the front of `memory`, which must be aligned to 64 bytes.
pub fn build_bvh<'m>(
    scene: &Scene,
    options: &BuildOptions,
    memory: &'m mut [MaybeUninit<u8>],
) -> Result<Accel<'m>, BuildError> {
    todo!()
}

/// Builds a regular grid over `scene` at the front of `memory`, which must be aligned to 64 bytes.
pub fn build_grid<'m>(
    scene: &Scene,
    options: &BuildOptions,
    memory: &'m mut [MaybeUninit<u8>],
) -> Result<Accel<'m>, BuildError> {
    todo!()
}

impl<'m> Accel<'m> {
    /// Opens a block that was built earlier, after checking it from end to end; nothing is copied.
    pub fn open(block: &'m [u8]) -> Result<Self, OpenError> {
        todo!()
    }

    /// The block: what to copy, save or place in ROM.
    pub fn block(&self) -> &'m [u8] {
        self.block
    }

    /// What the block holds.
    pub fn info(&self) -> Info {
        todo!()
    }

    /// The closest hit.
    pub fn intersect(&self, ray: &Ray) -> Option<Hit> {
        todo!()
    }

    /// Whether anything is hit.
    pub fn occluded(&self, ray: &Ray) -> bool {
        todo!()
    }

    /// The closest hit among what `options` leaves.
    pub fn intersect_with(&self, ray: &Ray, options: &QueryOptions) -> Option<Hit> {
        todo!()
    }

    /// Whether anything that `options` leaves is hit.
    pub fn occluded_with(&self, ray: &Ray, options: &QueryOptions) -> bool {
        todo!()
    }

    /// [`intersect`](Self::intersect) that adds what it did to `counts`.
    pub fn intersect_counted(&self, ray: &Ray, counts: &mut Counts) -> Option<Hit> {
        todo!()
    }

    /// [`occluded`](Self::occluded) that adds what it did to `counts`.
    pub fn occluded_counted(&self, ray: &Ray, counts: &mut Counts) -> bool {
        todo!()
    }

    /// The surface at `hit`, which an intersect call on this accel returned for `ray`; `None` when
    /// no such hit exists.
    pub fn surface(&self, ray: &Ray, hit: &Hit) -> Option<Surface> {
        todo!()
    }
}

/// A structure in memory of its own.
#[cfg(feature = "alloc")]
pub struct OwnedAccel {}

#[cfg(feature = "alloc")]
impl OwnedAccel {
    /// Builds a BVH.
    pub fn bvh(scene: &Scene, options: &BuildOptions) -> Result<Self, BuildError> {
        todo!()
    }

    /// Builds a grid.
    pub fn grid(scene: &Scene, options: &BuildOptions) -> Result<Self, BuildError> {
        todo!()
    }

    /// The structure.
    pub fn accel(&self) -> Accel<'_> {
        todo!()
    }
}
