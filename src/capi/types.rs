//! The structs and constants of the interface, as C sees them.

use core::ffi::c_void;

use super::versioned::{Growing, Versioned};

/// `RtBuildOptions.quality`, for a BVH: surface area heuristic over 16 bins on each axis, for large
/// nodes by samples.
pub const RT_QUALITY_BALANCED: u32 = 0;
/// For a structure that is built often: leaves are runs of triangles along a curve.
pub const RT_QUALITY_FAST: u32 = 1;
/// For a structure that is built once: 32 bins, every primitive in them.
pub const RT_QUALITY_BEST: u32 = 2;

/// `RtBuildOptions.layout`: bundles of 16, or as compact in a library built without them. The block says how it is read, not the
/// machine: every machine reads every layout for which its library was built (else RT_ERROR_LAYOUT).
pub const RT_LAYOUT_AUTOMATIC: u32 = 0;
/// Binary nodes of 32 bytes: the least stack and the least code, for small machines. Of closed meshes bundles take fewer bytes, of
/// loose triangles these nodes.
pub const RT_LAYOUT_COMPACT: u32 = 1;
/// Bundles of 4 boxes over whole leaf blocks. With little memory the layout may become compact after all.
pub const RT_LAYOUT_WIDE_4: u32 = 4;
/// Bundles of 8 boxes over whole leaf blocks.
pub const RT_LAYOUT_WIDE_8: u32 = 8;
/// Bundles of 16 boxes over whole leaf blocks.
pub const RT_LAYOUT_WIDE_16: u32 = 16;

/// `RtBuildOptions.plain_list`: for a handful of primitives, which no structure makes faster.
pub const RT_PLAIN_LIST_AUTOMATIC: u32 = 0;
/// Build the structure even over one primitive.
pub const RT_PLAIN_LIST_NEVER: u32 = 1;
/// Test every ray against every leaf block.
pub const RT_PLAIN_LIST_ALWAYS: u32 = 2;

/// `RtBuildOptions.grid_kind`: a coarse grid whose full cells hold finer ones.
pub const RT_GRID_NESTED: u32 = 0;
/// Cells of one size.
pub const RT_GRID_UNIFORM: u32 = 1;
/// Two cells along each axis, and again two in each that is full.
pub const RT_GRID_OCTREE: u32 = 2;

/// `RtQuery.precision`: hit or miss, which primitive and which order as in real arithmetic; the
/// same answer from every structure; `t` is the nearest float.
pub const RT_PRECISION_EXACT: u32 = 0;
/// In single precision. Nothing is missed: if the ray meets a triangle or a sphere within its limits
/// in real arithmetic, the answer is a hit, for any finite input. More may be hit than is there, but
/// only what the ray passes within a few roundings; a ray in a triangle's plane counts as meeting it.
/// `t` is within the limits and, for a triangle, within the depths of its vertices;
/// docs/METHODS.md states all bounds. One block gives the same bits on every processor; different
/// structures may differ. The side of a triangle seen edge-on is a guess, which RT_FACING_FRONT and
/// RT_FACING_BACK may then miss; likewise which root of a sphere is skipped when both are equally
/// near.
pub const RT_PRECISION_WATERTIGHT: u32 = 1;

/// `RtQuery.facing`: both sides of every surface.
pub const RT_FACING_BOTH: u32 = 0;
/// Only the side from which a triangle's vertices run counter-clockwise, in an instance before its map, which may mirror; the
/// outside of spheres.
pub const RT_FACING_FRONT: u32 = 1;
/// Only the other side.
pub const RT_FACING_BACK: u32 = 2;

/// `RtInfo.kind`: leaf blocks alone.
pub const RT_KIND_LIST: u32 = 1;
/// A regular grid.
pub const RT_KIND_GRID: u32 = 2;
/// A bounding volume hierarchy.
pub const RT_KIND_BVH: u32 = 3;

/// A built structure: the first bytes of a block in the caller's memory.
pub struct RtAccel {
    _opaque: [u8; 0],
}

/// The points `origin + t * direction` with `t_min <= t <= t_max`, both ends included.
///
/// `direction` need not have length one; `t` counts in its lengths. The limits may be infinite and
/// `t_min` negative. A ray with a NaN or an infinity in `origin` or `direction`, a zero direction, a
/// NaN limit or `t_min > t_max` hits nothing.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct RtRay {
    pub origin: [f32; 3],
    pub t_min: f32,
    pub direction: [f32; 3],
    pub t_max: f32,
}

/// Where a ray meets a scene. After a miss `t` is +infinity, `u` and `v` are 0, the rest RT_NONE.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct RtHit {
    /// In lengths of the ray's direction.
    pub t: f32,
    /// The weight of the triangle's second vertex, from 0 to 1 and, if exact, within 2^-23 of the real one; 0 on
    /// spheres.
    pub u: f32,
    /// The same of the third vertex.
    pub v: f32,
    /// The number of the triangle or sphere within its geometry.
    pub prim: u32,
    /// The number of the mesh, or `mesh_count` plus the number of the sphere set; in an instance those of the scene that it shows.
    pub geometry: u32,
    /// The number of the instance, RT_NONE outside instances.
    pub instance: u32,
}

/// Triangles over vertices.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct RtMesh {
    /// x y z of each vertex.
    pub vertices: *const f32,
    /// Three vertex numbers a triangle; or null: then the vertices stand in threes.
    pub indices: *const u32,
    pub vertex_count: u32,
    pub triangle_count: u32,
    /// Bytes from one vertex to the next, a multiple of 4; 0 means 12.
    pub vertex_stride: u32,
    /// Bytes from one triangle's indices to the next, a multiple of 4; 0 means 12.
    pub index_stride: u32,
    /// Seen by queries whose mask shares a bit with this one; 0: by all.
    pub mask: u32,
    pub reserved: u32,
}

/// Spheres.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct RtSphereSet {
    /// x y z radius of each.
    pub spheres: *const f32,
    pub sphere_count: u32,
    /// Bytes from one sphere to the next, a multiple of 4; 0 means 16.
    pub sphere_stride: u32,
    /// Seen by queries whose mask shares a bit with this one; 0: by all.
    pub mask: u32,
    pub reserved: u32,
}

/// A built structure at another place: any map that has an inverse, mirroring, uneven scaling and shear included.
///
/// The built scene refers to `accel`, which must stay where it is as long as that is used, unless `rt_accel_pack` makes
/// one block of both. `accel` has no instances itself; of its block only the first bytes are looked at, so what was not built
/// here is opened by `rt_accel_open` first.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct RtInstance {
    pub accel: *const RtAccel,
    /// Three rows of four, for points as columns: x of the world is `m[0] x + m[1] y + m[2] z + m[3]`. RT_ERROR_SINGULAR if it is not
    /// finite, or has no inverse.
    pub object_to_world: [f32; 12],
    /// Seen by queries whose mask shares a bit with this one, of what is in it only what shares one too; 0: by all.
    pub mask: u32,
    /// Zero, as all fields of this name.
    pub reserved: u32,
}

/// Everything that can be hit. Geometries are numbered: the meshes first, then the sphere sets.
///
/// Never hit, though numbered: triangles without area, spheres without a positive radius, and
/// whatever is not finite. `rt_accel_info` counts them.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct RtScene {
    pub struct_size: u32,
    pub mesh_count: u32,
    pub sphere_set_count: u32,
    pub instance_count: u32,
    /// `sizeof(RtMesh)` as the caller compiled it; 0 means as in this library. The next two alike.
    pub mesh_size: u32,
    pub sphere_set_size: u32,
    pub instance_size: u32,
    pub reserved: u32,
    /// May be null when the count is 0. The next two alike.
    pub meshes: *const RtMesh,
    pub sphere_sets: *const RtSphereSet,
    pub instances: *const RtInstance,
}

/// One of the tasks that `parallel_for` runs.
pub type RtTask = Option<unsafe extern "C" fn(context: *mut c_void, index: u32)>;

/// The caller's threads: calls `task(context, i)` for each `i` below `count`, in any order and on
/// any thread, and returns when all are done; `context` is dead then. Tasks never block and never
/// nest. What is called twice runs once, what is left out is run by the build. The block has the same bytes with any number of
/// threads. Neither this function nor `progress` may throw an exception or leave by longjmp.
pub type RtParallelFor =
    Option<unsafe extern "C" fn(user: *mut c_void, count: u32, task: RtTask, context: *mut c_void)>;

/// How far a build is, from 0 to 1; false cancels it: RT_ERROR_CANCELLED. Called on the thread that
/// builds, a few times a build, the last time with 1.
pub type RtProgress = Option<unsafe extern "C" fn(user: *mut c_void, done: f32) -> bool>;

/// What a build may choose. Zero in every field but the first suits most scenes. A build gets the options for which its memory was
/// asked; how many threads there are does not matter to that.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct RtBuildOptions {
    pub struct_size: u32,
    /// One of `RT_QUALITY_`. `rt_build` takes fast for balanced where rays are few.
    pub quality: u32,
    /// One of `RT_LAYOUT_`, for a BVH.
    pub layout: u32,
    /// 1: the block can be refitted when vertices move, unless it is a grid or has instances: see `rt_accel_refit`, and `RtInfo.refit`
    /// for what came of it. `rt_build` then makes no grid.
    pub refit: u32,
    /// One of `RT_PLAIN_LIST_`.
    pub plain_list: u32,
    /// How many tasks of `parallel_for` may run at once; with less than two it is not called.
    pub worker_count: u32,
    /// Handed to the two calls below.
    pub user: *mut c_void,
    /// Or null: all is done on the calling thread. Speeds up builds of BVHs and grids, and the check of their scene.
    pub parallel_for: RtParallelFor,
    /// Or null.
    pub progress: RtProgress,
    /// One of `RT_GRID_`, for a grid.
    pub grid_kind: u32,
    /// Cells for each primitive, of the outermost grid if they are nested, from 0 to 64. 0: for a uniform grid the cube
    /// root of the number of primitives along each axis, otherwise a fiftieth.
    pub grid_density: f32,
    /// How deep grids may be nested, the outermost counted, up to 8; 0: 8.
    pub grid_depth: u32,
    /// For `rt_build`, how many rays for each primitive will be traced before the next build; not negative. 0: many. Below 6:
    /// few.
    pub rays_per_prim: f32,
}

/// What a query leaves out. Zero in every field but the first leaves out nothing.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct RtQuery {
    pub struct_size: u32,
    /// One of `RT_PRECISION_`.
    pub precision: u32,
    /// A geometry is seen when its mask and this one share a bit, or when either is 0.
    pub mask: u32,
    /// One of `RT_FACING_`.
    pub facing: u32,
    /// 1: leave out the primitive that the next three name, as in an `RtHit`; 0: ignore them. Of a
    /// sphere only the hit nearest to `t = 0` is left out: a ray refracted into it still leaves it.
    pub skip: u32,
    pub skip_prim: u32,
    pub skip_geometry: u32,
    /// RT_NONE outside instances: 0 is the first instance.
    pub skip_instance: u32,
}

/// Where a list of hits stands. Zero in every field but the first: before the first hit.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct RtCursor {
    pub struct_size: u32,
    /// 1: after the hit that the rest names; 0: the rest is ignored.
    pub begun: u32,
    /// 0 for triangles and where the ray enters a sphere, 1 where it leaves one.
    pub root: u32,
    /// As in its `RtHit`, like the next three.
    pub t: f32,
    pub prim: u32,
    pub geometry: u32,
    pub instance: u32,
}

/// The point of a scene closest to another. If there is none `distance` is +infinity, the rest 0 or RT_NONE.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct RtPointHit {
    /// How far it is, rounded to nearest.
    pub distance: f32,
    /// Where it is, rounded to nearest.
    pub point: [f32; 3],
    /// The weight of the triangle's second vertex; 0 on spheres.
    pub u: f32,
    /// The weight of the triangle's third vertex; 0 on spheres.
    pub v: f32,
    /// The number of the triangle or sphere within its geometry.
    pub prim: u32,
    /// The number of the mesh, or `mesh_count` plus the number of the sphere set.
    pub geometry: u32,
    /// As in an `RtHit`.
    pub instance: u32,
}

/// How much memory a build wants, in bytes.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct RtMemory {
    /// Enough for all the options ask, scratch included; a multiple of `alignment`.
    pub size: usize,
    /// Less is refused; in between, the structure is coarser.
    pub minimum: usize,
    /// 64.
    pub alignment: usize,
}

/// The surface at a hit.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct RtSurface {
    pub struct_size: u32,
    /// The point of the hit, rounded.
    pub position: [f32; 3],
    /// How far `position` may be off the surface, along each axis.
    pub position_error: f32,
    /// Of length one: (v1 - v0) x (v2 - v0), or outward on spheres; never flipped to the ray. In an instance that of its object, by
    /// the inverse transpose of the map: where the map mirrors, vertices run the other way around it.
    pub normal: [f32; 3],
    /// `position` moved off the surface to the side of `normal`: where a reflected ray starts.
    pub front_origin: [f32; 3],
    /// `position` moved off the surface to the other side.
    pub back_origin: [f32; 3],
}

/// What a block holds.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct RtInfo {
    pub struct_size: u32,
    /// One of `RT_KIND_`.
    pub kind: u32,
    /// One of `RT_LAYOUT_`, never automatic; of lists and grids it means nothing.
    pub layout: u32,
    /// The box around everything that can be hit; `lower > upper` when nothing can.
    pub lower: [f32; 3],
    pub upper: [f32; 3],
    /// Triangles that can be hit.
    pub triangle_count: u32,
    /// Spheres that can be hit.
    pub sphere_count: u32,
    /// What they show is in no other count.
    pub instance_count: u32,
    /// Triangles and spheres that never are hit: see `RtScene`.
    pub ignored_count: u32,
    /// Cells along each axis of a grid; 0 in other kinds.
    pub resolution: [u32; 3],
    /// Bytes of the block, as from `rt_accel_size`.
    pub size: usize,
    /// Bytes of nodes or cells.
    pub structure_size: usize,
    /// Bytes of triangles and spheres.
    pub leaf_size: usize,
    /// Bytes of primitive numbers.
    pub id_size: usize,
    /// 1 if the block can be refitted.
    pub refit: u32,
    /// What a ray costs by the surface area heuristic, over that when the block was built: from about 2 on a new build is
    /// likely to pay. 0 if the block cannot be refitted.
    pub cost_growth: f32,
}

/// Layouts with `P` for the size of a pointer or a `size_t`, in bytes:
///
/// ```text
/// RtMesh          0 vertices | P indices | 2P vertex_count .. reserved | 2P + 24
/// RtSphereSet     0 spheres | P sphere_count .. reserved | P + 16
/// RtInstance      0 accel | P object_to_world | P + 48 mask reserved | P + 56
/// RtScene         0 struct_size .. reserved | 32 meshes sphere_sets instances | 32 + 3P
/// RtBuildOptions  0 struct_size .. worker_count | 24 user parallel_for progress | 24 + 3P grid_kind .. rays_per_prim |
///                 40 + 3P
/// RtInfo          0 struct_size kind layout | 12 lower upper | 36 counts | 52 resolution |
///                 64 size structure_size leaf_size id_size | 64 + 4P refit cost_growth | 72 + 4P
/// ```
const _: () = {
    const P: usize = size_of::<usize>();
    assert!(size_of::<RtRay>() == 32 && size_of::<RtHit>() == 24);
    assert!(size_of::<RtMesh>() == 2 * P + 24 && size_of::<RtSphereSet>() == P + 16);
    assert!(size_of::<RtInstance>() == P + 56 && size_of::<RtScene>() == 3 * P + 32);
    assert!(size_of::<RtBuildOptions>() == 3 * P + 40 && size_of::<RtQuery>() == 32);
    assert!(size_of::<RtMemory>() == 3 * P && size_of::<RtSurface>() == 56);
    assert!(size_of::<RtCursor>() == 28 && size_of::<RtPointHit>() == 36);
    assert!(size_of::<RtInfo>() == 4 * P + 72);
    assert!(core::mem::offset_of!(RtScene, meshes) == 32);
    assert!(core::mem::offset_of!(RtBuildOptions, user) == 24);
    assert!(core::mem::offset_of!(RtInfo, size) == 64);
};

// SAFETY (of all of these): numbers, null-able pointers and nothing else, so zeros are a value; the
// sizes above leave no room for padding.
// SAFETY: as above.
unsafe impl Growing for RtMesh {}
// SAFETY: as above.
unsafe impl Growing for RtSphereSet {}
// SAFETY: as above.
unsafe impl Growing for RtInstance {}
// SAFETY: as above.
unsafe impl Growing for RtScene {}
// SAFETY: as above.
unsafe impl Growing for RtBuildOptions {
    /// Up to `progress`.
    const FIRST_SIZE: usize = 24 + 3 * size_of::<usize>();
}
// SAFETY: as above.
unsafe impl Growing for RtQuery {}
// SAFETY: as above.
unsafe impl Growing for RtCursor {}
// SAFETY: as above.
unsafe impl Growing for RtSurface {}
// SAFETY: as above.
unsafe impl Growing for RtInfo {
    /// Up to `id_size`.
    const FIRST_SIZE: usize = 64 + 4 * size_of::<usize>();
}

// SAFETY: it begins with `struct_size`.
unsafe impl Versioned for RtScene {}
// SAFETY: it begins with `struct_size`.
unsafe impl Versioned for RtBuildOptions {}
// SAFETY: it begins with `struct_size`.
unsafe impl Versioned for RtQuery {}
// SAFETY: it begins with `struct_size`.
unsafe impl Versioned for RtCursor {}
// SAFETY: it begins with `struct_size`.
unsafe impl Versioned for RtSurface {}
// SAFETY: it begins with `struct_size`.
unsafe impl Versioned for RtInfo {}
