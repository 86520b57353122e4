// raykern: where rays meet triangles and spheres. MIT or Apache-2.0.
// Written by build.rs from src/capi; edit those.
//
// Memory    The library never allocates. `rt_*_needs` says how much a build wants; the caller passes
//           it in and keeps it. A built accel without instances, or a packed one, is one block
//           without pointers: it may be copied, written to a file or placed in ROM, and opened
//           again. There is nothing to free.
// Pointers  None may be null unless its comment says so. All are checked for null and alignment.
//           During a call nobody writes to what it reads, nor between elements that lie apart.
// Results   Every call that can fail returns an `RtStatus`. Outputs are written on RT_OK only.
// Threads   None are started. Calls that take `const RtAccel *` may run at the same time on the same
//           accel; nobody may write to its block meanwhile.
// Versions  Most structs begin with `struct_size`; set it to `sizeof` of the struct, outputs
//           included, and everything you do not use to zero: zero always means the default. A larger
//           struct than the library knows is accepted while the rest of it is zero.
// Floats    Rounding modes, flushed subnormal numbers and enabled traps neither change an answer nor
//           are changed; sticky exception flags may be raised when none of these is in use. Callbacks of
//           a build run in the default state.
//
// RtScene scene = {0};                                Then: memory of `need.size` bytes at a multiple
// scene.struct_size = sizeof scene;                   of `need.alignment`, and
// scene.mesh_count = 1;
// scene.meshes = &mesh;                               const RtAccel *accel;
// RtMemory need;                                      rt_build_bvh(&scene, NULL, memory, need.size,
// rt_bvh_needs(&scene, NULL, &need);                               &accel);
//                                                     RtHit hit;
//                                                     if (rt_intersect(accel, &ray, &hit)) ...

#ifndef RAYKERN_H
#define RAYKERN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// The version of this header: major, minor and patch, a byte each. `rt_version` says the same of the
// library.
#define RT_RAYKERN_VERSION 0x000100u

// "No primitive", "no geometry", "not in an instance".
#define RT_NONE 0xFFFFFFFFu

// `RtBuildOptions.quality`, for a BVH: surface area heuristic over 16 bins on each axis, for large
// nodes by samples.
#define RT_QUALITY_BALANCED 0
// For a structure that is built often: leaves are runs of triangles along a curve.
#define RT_QUALITY_FAST 1
// For a structure that is built once: 32 bins, every primitive in them.
#define RT_QUALITY_BEST 2

// `RtBuildOptions.layout`: bundles of 16, or as compact in a library built without them. The block says how it is read, not the
// machine: every machine reads every layout for which its library was built (else RT_ERROR_LAYOUT).
#define RT_LAYOUT_AUTOMATIC 0
// Binary nodes of 32 bytes: the least stack and the least code, for small machines. Of closed meshes bundles take fewer bytes, of
// loose triangles these nodes.
#define RT_LAYOUT_COMPACT 1
// Bundles of 4 boxes over whole leaf blocks. With little memory the layout may become compact after all.
#define RT_LAYOUT_WIDE_4 4
// Bundles of 8 boxes over whole leaf blocks.
#define RT_LAYOUT_WIDE_8 8
// Bundles of 16 boxes over whole leaf blocks.
#define RT_LAYOUT_WIDE_16 16

// `RtBuildOptions.plain_list`: for a handful of primitives, which no structure makes faster.
#define RT_PLAIN_LIST_AUTOMATIC 0
// Build the structure even over one primitive.
#define RT_PLAIN_LIST_NEVER 1
// Test every ray against every leaf block.
#define RT_PLAIN_LIST_ALWAYS 2

// `RtBuildOptions.grid_kind`: a coarse grid whose full cells hold finer ones.
#define RT_GRID_NESTED 0
// Cells of one size.
#define RT_GRID_UNIFORM 1
// Two cells along each axis, and again two in each that is full.
#define RT_GRID_OCTREE 2

// `RtQuery.precision`: hit or miss, which primitive and which order as in real arithmetic; the
// same answer from every structure; `t` is the nearest float.
#define RT_PRECISION_EXACT 0
// In single precision. Nothing is missed: if the ray meets a triangle or a sphere within its limits
// in real arithmetic, the answer is a hit, for any finite input. More may be hit than is there, but
// only what the ray passes within a few roundings; a ray in a triangle's plane counts as meeting it.
// `t` is within the limits and, for a triangle, within the depths of its vertices;
// docs/METHODS.md states all bounds. One block gives the same bits on every processor; different
// structures may differ. The side of a triangle seen edge-on is a guess, which RT_FACING_FRONT and
// RT_FACING_BACK may then miss; likewise which root of a sphere is skipped when both are equally
// near.
#define RT_PRECISION_WATERTIGHT 1

// `RtQuery.facing`: both sides of every surface.
#define RT_FACING_BOTH 0
// Only the side from which a triangle's vertices run counter-clockwise, in an instance before its map, which may mirror; the
// outside of spheres.
#define RT_FACING_FRONT 1
// Only the other side.
#define RT_FACING_BACK 2

// `RtInfo.kind`: leaf blocks alone.
#define RT_KIND_LIST 1
// A regular grid.
#define RT_KIND_GRID 2
// A bounding volume hierarchy.
#define RT_KIND_BVH 3

// A built structure: the first bytes of a block in the caller's memory.
typedef struct RtAccel RtAccel;

// Success is zero, everything else says why a call was refused. A number keeps its meaning for
// ever; `rt_status_message` puts it in words.
typedef int32_t RtStatus;

// Triangles over vertices.
typedef struct RtMesh {
    // x y z of each vertex.
    const float *vertices;
    // Three vertex numbers a triangle; or null: then the vertices stand in threes.
    const uint32_t *indices;
    uint32_t vertex_count;
    uint32_t triangle_count;
    // Bytes from one vertex to the next, a multiple of 4; 0 means 12.
    uint32_t vertex_stride;
    // Bytes from one triangle's indices to the next, a multiple of 4; 0 means 12.
    uint32_t index_stride;
    // Seen by queries whose mask shares a bit with this one; 0: by all.
    uint32_t mask;
    uint32_t reserved;
} RtMesh;

// Spheres.
typedef struct RtSphereSet {
    // x y z radius of each.
    const float *spheres;
    uint32_t sphere_count;
    // Bytes from one sphere to the next, a multiple of 4; 0 means 16.
    uint32_t sphere_stride;
    // Seen by queries whose mask shares a bit with this one; 0: by all.
    uint32_t mask;
    uint32_t reserved;
} RtSphereSet;

// A built structure at another place: any map that has an inverse, mirroring, uneven scaling and shear included.
//
// The built scene refers to `accel`, which must stay where it is as long as that is used, unless `rt_accel_pack` makes
// one block of both. `accel` has no instances itself; of its block only the first bytes are looked at, so what was not built
// here is opened by `rt_accel_open` first.
typedef struct RtInstance {
    const RtAccel *accel;
    // Three rows of four, for points as columns: x of the world is `m[0] x + m[1] y + m[2] z + m[3]`. RT_ERROR_SINGULAR if it is not
    // finite, or has no inverse.
    float object_to_world[12];
    // Seen by queries whose mask shares a bit with this one, of what is in it only what shares one too; 0: by all.
    uint32_t mask;
    // Zero, as all fields of this name.
    uint32_t reserved;
} RtInstance;

// Everything that can be hit. Geometries are numbered: the meshes first, then the sphere sets.
//
// Never hit, though numbered: triangles without area, spheres without a positive radius, and
// whatever is not finite. `rt_accel_info` counts them.
typedef struct RtScene {
    uint32_t struct_size;
    uint32_t mesh_count;
    uint32_t sphere_set_count;
    uint32_t instance_count;
    // `sizeof(RtMesh)` as the caller compiled it; 0 means as in this library. The next two alike.
    uint32_t mesh_size;
    uint32_t sphere_set_size;
    uint32_t instance_size;
    uint32_t reserved;
    // May be null when the count is 0. The next two alike.
    const RtMesh *meshes;
    const RtSphereSet *sphere_sets;
    const RtInstance *instances;
} RtScene;

// One of the tasks that `parallel_for` runs.
typedef void (*RtTask)(void *context, uint32_t index);

// The caller's threads: calls `task(context, i)` for each `i` below `count`, in any order and on
// any thread, and returns when all are done; `context` is dead then. Tasks never block and never
// nest. What is called twice runs once, what is left out is run by the build. The block has the same bytes with any number of
// threads. Neither this function nor `progress` may throw an exception or leave by longjmp.
typedef void (*RtParallelFor)(void *user, uint32_t count, RtTask task, void *context);

// How far a build is, from 0 to 1; false cancels it: RT_ERROR_CANCELLED. Called on the thread that
// builds, a few times a build, the last time with 1.
typedef bool (*RtProgress)(void *user, float done);

// What a build may choose. Zero in every field but the first suits most scenes. A build gets the options for which its memory was
// asked; how many threads there are does not matter to that.
typedef struct RtBuildOptions {
    uint32_t struct_size;
    // One of `RT_QUALITY_`. `rt_build` takes fast for balanced where rays are few.
    uint32_t quality;
    // One of `RT_LAYOUT_`, for a BVH.
    uint32_t layout;
    // 1: the block can be refitted when vertices move, unless it is a grid or has instances: see `rt_accel_refit`, and `RtInfo.refit`
    // for what came of it. `rt_build` then makes no grid.
    uint32_t refit;
    // One of `RT_PLAIN_LIST_`.
    uint32_t plain_list;
    // How many tasks of `parallel_for` may run at once; with less than two it is not called.
    uint32_t worker_count;
    // Handed to the two calls below.
    void *user;
    // Or null: all is done on the calling thread. Speeds up builds of BVHs and grids, and the check of their scene.
    RtParallelFor parallel_for;
    // Or null.
    RtProgress progress;
    // One of `RT_GRID_`, for a grid.
    uint32_t grid_kind;
    // Cells for each primitive, of the outermost grid if they are nested, from 0 to 64. 0: for a uniform grid the cube
    // root of the number of primitives along each axis, otherwise a fiftieth.
    float grid_density;
    // How deep grids may be nested, the outermost counted, up to 8; 0: 8.
    uint32_t grid_depth;
    // For `rt_build`, how many rays for each primitive will be traced before the next build; not negative. 0: many. Below 6:
    // few.
    float rays_per_prim;
} RtBuildOptions;

// How much memory a build wants, in bytes.
typedef struct RtMemory {
    // Enough for all the options ask, scratch included; a multiple of `alignment`.
    size_t size;
    // Less is refused; in between, the structure is coarser.
    size_t minimum;
    // 64.
    size_t alignment;
} RtMemory;

// What a block holds.
typedef struct RtInfo {
    uint32_t struct_size;
    // One of `RT_KIND_`.
    uint32_t kind;
    // One of `RT_LAYOUT_`, never automatic; of lists and grids it means nothing.
    uint32_t layout;
    // The box around everything that can be hit; `lower > upper` when nothing can.
    float lower[3];
    float upper[3];
    // Triangles that can be hit.
    uint32_t triangle_count;
    // Spheres that can be hit.
    uint32_t sphere_count;
    // What they show is in no other count.
    uint32_t instance_count;
    // Triangles and spheres that never are hit: see `RtScene`.
    uint32_t ignored_count;
    // Cells along each axis of a grid; 0 in other kinds.
    uint32_t resolution[3];
    // Bytes of the block, as from `rt_accel_size`.
    size_t size;
    // Bytes of nodes or cells.
    size_t structure_size;
    // Bytes of triangles and spheres.
    size_t leaf_size;
    // Bytes of primitive numbers.
    size_t id_size;
    // 1 if the block can be refitted.
    uint32_t refit;
    // What a ray costs by the surface area heuristic, over that when the block was built: from about 2 on a new build is
    // likely to pay. 0 if the block cannot be refitted.
    float cost_growth;
} RtInfo;

// The points `origin + t * direction` with `t_min <= t <= t_max`, both ends included.
//
// `direction` need not have length one; `t` counts in its lengths. The limits may be infinite and
// `t_min` negative. A ray with a NaN or an infinity in `origin` or `direction`, a zero direction, a
// NaN limit or `t_min > t_max` hits nothing.
typedef struct RtRay {
    float origin[3];
    float t_min;
    float direction[3];
    float t_max;
} RtRay;

// Where a ray meets a scene. After a miss `t` is +infinity, `u` and `v` are 0, the rest RT_NONE.
typedef struct RtHit {
    // In lengths of the ray's direction.
    float t;
    // The weight of the triangle's second vertex, from 0 to 1 and, if exact, within 2^-23 of the real one; 0 on
    // spheres.
    float u;
    // The same of the third vertex.
    float v;
    // The number of the triangle or sphere within its geometry.
    uint32_t prim;
    // The number of the mesh, or `mesh_count` plus the number of the sphere set; in an instance those of the scene that it shows.
    uint32_t geometry;
    // The number of the instance, RT_NONE outside instances.
    uint32_t instance;
} RtHit;

// What a query leaves out. Zero in every field but the first leaves out nothing.
typedef struct RtQuery {
    uint32_t struct_size;
    // One of `RT_PRECISION_`.
    uint32_t precision;
    // A geometry is seen when its mask and this one share a bit, or when either is 0.
    uint32_t mask;
    // One of `RT_FACING_`.
    uint32_t facing;
    // 1: leave out the primitive that the next three name, as in an `RtHit`; 0: ignore them. Of a
    // sphere only the hit nearest to `t = 0` is left out: a ray refracted into it still leaves it.
    uint32_t skip;
    uint32_t skip_prim;
    uint32_t skip_geometry;
    // RT_NONE outside instances: 0 is the first instance.
    uint32_t skip_instance;
} RtQuery;

// The surface at a hit.
typedef struct RtSurface {
    uint32_t struct_size;
    // The point of the hit, rounded.
    float position[3];
    // How far `position` may be off the surface, along each axis.
    float position_error;
    // Of length one: (v1 - v0) x (v2 - v0), or outward on spheres; never flipped to the ray. In an instance that of its object, by
    // the inverse transpose of the map: where the map mirrors, vertices run the other way around it.
    float normal[3];
    // `position` moved off the surface to the side of `normal`: where a reflected ray starts.
    float front_origin[3];
    // `position` moved off the surface to the other side.
    float back_origin[3];
} RtSurface;

// Where a list of hits stands. Zero in every field but the first: before the first hit.
typedef struct RtCursor {
    uint32_t struct_size;
    // 1: after the hit that the rest names; 0: the rest is ignored.
    uint32_t begun;
    // 0 for triangles and where the ray enters a sphere, 1 where it leaves one.
    uint32_t root;
    // As in its `RtHit`, like the next three.
    float t;
    uint32_t prim;
    uint32_t geometry;
    uint32_t instance;
} RtCursor;

// The point of a scene closest to another. If there is none `distance` is +infinity, the rest 0 or RT_NONE.
typedef struct RtPointHit {
    // How far it is, rounded to nearest.
    float distance;
    // Where it is, rounded to nearest.
    float point[3];
    // The weight of the triangle's second vertex; 0 on spheres.
    float u;
    // The weight of the triangle's third vertex; 0 on spheres.
    float v;
    // The number of the triangle or sphere within its geometry.
    uint32_t prim;
    // The number of the mesh, or `mesh_count` plus the number of the sphere set.
    uint32_t geometry;
    // As in an `RtHit`.
    uint32_t instance;
} RtPointHit;

// Done.
#define RT_OK 0

// A pointer is null that must not be.
#define RT_ERROR_NULL_POINTER 1
// A value is outside its range: an option that no constant names, a stride that is too small or no
// multiple of four, a `struct_size` that is too small, a `reserved` field that is not zero.
#define RT_ERROR_INVALID_ARGUMENT 2
// A struct is larger than this library knows, and the part it does not know is not zero.
#define RT_ERROR_VERSION 3
// A triangle names a vertex that its mesh does not have.
#define RT_ERROR_INDEX_OUT_OF_RANGE 5
// The memory is smaller than the `minimum` of `rt_*_needs`.
#define RT_ERROR_OUT_OF_MEMORY 6
// A pointer is not aligned: blocks to 64 bytes, everything else as its C type.
#define RT_ERROR_MISALIGNED 7
// An array, or the memory a build needs, is larger than this machine can address, or the scene has
// more primitives than can be numbered.
#define RT_ERROR_TOO_LARGE 8
// The bytes do not begin as a block does.
#define RT_ERROR_NOT_A_BLOCK 9
// The block was written on a machine of the other byte order.
#define RT_ERROR_BYTE_ORDER 10
// The block is of another version of the format.
#define RT_ERROR_BLOCK_VERSION 11
// There are fewer bytes than the block has.
#define RT_ERROR_TRUNCATED 12
// The block contradicts itself.
#define RT_ERROR_CORRUPT 13
// The block, the scene or the options ask for something that this build of the library leaves out.
#define RT_ERROR_LAYOUT 14
// The ray has no such hit.
#define RT_ERROR_NOT_FOUND 15
// A fault of the library, which was stopped before it reached the caller. Please report it.
#define RT_ERROR_INTERNAL 16
// `progress` returned false. The memory holds no structure and may be used again.
#define RT_ERROR_CANCELLED 17
// The block was not built with `RtBuildOptions.refit`, or it is a grid, which is built anew instead.
#define RT_ERROR_NOT_REFITTABLE 18
// Meshes, sphere sets, counts or vertex numbers are not those of the build.
#define RT_ERROR_OTHER_SCENE 19
// The map of an instance is not finite, or flattens space and has no inverse.
#define RT_ERROR_SINGULAR 20
// The accel of an instance has instances itself: there are two levels.
#define RT_ERROR_NESTED 21
// The block refers to other blocks by address: `rt_accel_pack` makes one of them that can be copied and saved.
#define RT_ERROR_LINKED 22

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// A sentence for `status`, also for numbers that are no status. It need not be freed.
const char *rt_status_message(RtStatus status);

// The version of the library, in the form of RT_RAYKERN_VERSION.
uint32_t rt_version(void);

// Writes to `*out` the memory that `rt_build_bvh` needs for `scene`. `options` may be null.
RtStatus rt_bvh_needs(const RtScene *scene,
                      const RtBuildOptions *options,
                      RtMemory *out);

// Writes to `*out` the memory that `rt_build_grid` needs for `scene`. `options` may be null.
RtStatus rt_grid_needs(const RtScene *scene,
                       const RtBuildOptions *options,
                       RtMemory *out);

// Writes to `*out` the memory that `rt_build` needs for `scene`. `options` may be null.
RtStatus rt_needs(const RtScene *scene,
                  const RtBuildOptions *options,
                  RtMemory *out);

// Builds a bounding volume hierarchy over `scene` in `memory`, which has `size` bytes and starts at
// a multiple of 64. `options` may be null.
//
// When refused, nothing is written; when cancelled, `memory` holds no structure.
//
// With less than the `size` of `rt_bvh_needs` leaf blocks are fewer and fuller, and in the last
// resort the layout is compact; `rt_accel_info` says which it is.
//
// The finished block lies at the front of `memory`, and `*out` is its first byte; what lies behind
// `rt_accel_size` bytes may be used again. The scene is copied and no longer needed.
RtStatus rt_build_bvh(const RtScene *scene,
                      const RtBuildOptions *options,
                      void *memory,
                      size_t size,
                      const RtAccel **out);

// Builds what is likely to take the least time, building it and tracing `options->rays_per_prim` rays for each primitive: a
// list, a grid or a BVH; `rt_accel_info` says which it is. All else as `rt_build_bvh`.
RtStatus rt_build(const RtScene *scene,
                  const RtBuildOptions *options,
                  void *memory,
                  size_t size,
                  const RtAccel **out);

// Builds a grid, of the kind that the options name: all else as `rt_build_bvh`. With less memory it is coarser, in the last
// resort one cell.
RtStatus rt_build_grid(const RtScene *scene,
                       const RtBuildOptions *options,
                       void *memory,
                       size_t size,
                       const RtAccel **out);

// The bytes of the block that begins at `accel`: what to copy or save, unless it refers to others. 0 for null, and for what is no
// block.
size_t rt_accel_size(const RtAccel *accel);

// Writes to `*out` what the block holds. `out->struct_size` must be set.
RtStatus rt_accel_info(const RtAccel *accel, RtInfo *out);

// Opens a block that was built earlier, perhaps elsewhere, after checking it from end to end. It
// stays where it is, at a multiple of 64 bytes; `size` may be larger than the block.
//
// Whatever is accepted can be queried safely; whether it still describes the scene is not known.
RtStatus rt_accel_open(const void *block, size_t size, const RtAccel **out);

// Writes to `*out` the memory that `rt_accel_pack` needs.
RtStatus rt_accel_pack_needs(const RtAccel *accel, RtMemory *out);

// Writes the accel, with everything it refers to, as one block into `memory`, which has `size`
// bytes and starts at a multiple of 64: the accel of each instance once, however many show it. A block that refers to
// nothing is copied.
//
// `memory` may overlap an accel that refers to nothing, for example to move it to a tighter place; the old one is then
// gone. It must not overlap one that refers to others, nor these.
RtStatus rt_accel_pack(const RtAccel *accel,
                       void *memory,
                       size_t size,
                       const RtAccel **out);

// Lets the block at the front of `memory` follow `moved`: the scene that was built, with other vertices, spheres or masks.
// The block was built with `RtBuildOptions.refit`, or opened, in these `size` bytes or copied to them; its accel stays valid.
//
// Meshes, sphere sets, counts and vertex numbers must be the same. Where things are does not matter: what ceases to be
// finite or to have an area is ignored, and what was ignored may become visible. Answers are those of a structure that is
// built anew; `RtInfo.cost_growth` says when building anew is likely to pay. Needs no memory beyond the block, which is
// untouched unless the status is RT_OK. Nobody traces rays through the block during the call.
RtStatus rt_accel_refit(void *memory,
                        size_t size,
                        const RtScene *moved);

// The same on the threads that `options` lend; all else in them but `struct_size` is ignored. `options` may be null. The bytes do
// not depend on the number of threads.
RtStatus rt_accel_refit_with(void *memory,
                             size_t size,
                             const RtScene *moved,
                             const RtBuildOptions *options);

// The closest hit: the least `t`, and at equal `t` the first by instance, geometry and primitive.
//
// Returns whether there is one, and writes it, or the miss, to `*hit`. When a pointer is null:
// false, and nothing is written.
bool rt_intersect(const RtAccel *accel, const RtRay *ray, RtHit *hit);

// Whether the ray hits anything: true exactly when `rt_intersect` is. False when a pointer is null.
bool rt_occluded(const RtAccel *accel, const RtRay *ray);

// `rt_intersect` with RT_PRECISION_WATERTIGHT: no code of the exact answer is linked for it.
bool rt_intersect_watertight(const RtAccel *accel,
                             const RtRay *ray,
                             RtHit *hit);

// `rt_occluded` with RT_PRECISION_WATERTIGHT: true exactly when `rt_intersect_watertight` is.
bool rt_occluded_watertight(const RtAccel *accel, const RtRay *ray);

// `rt_intersect` for what `query` leaves; null leaves everything. When the query is refused, for a
// reason that `rt_query_check` tells: false, and nothing is written.
bool rt_intersect_with(const RtAccel *accel,
                       const RtRay *ray,
                       const RtQuery *query,
                       RtHit *hit);

// `rt_occluded` for what `query` leaves; null leaves everything. False when the query is refused.
bool rt_occluded_with(const RtAccel *accel,
                      const RtRay *ray,
                      const RtQuery *query);

// Why a query with these options would be refused, or RT_OK. Null is the default query.
RtStatus rt_query_check(const RtQuery *query);

// Writes to `*out` the surface at a hit that a query on this accel returned for this ray.
// `out->struct_size` must be set. Costs about as much as `rt_intersect`.
RtStatus rt_hit_surface(const RtAccel *accel,
                        const RtRay *ray,
                        const RtHit *hit,
                        RtSurface *out);

// All hits that `query` leaves, null leaves everything, in the order of their real `t`; at equal `t` by
// instance, geometry and primitive. Writes the first of them to `hits`, as many as `capacity`, and returns how
// many: the nearest few.
//
// With a cursor, which begins as zeros but for its `struct_size`, each call goes on after the last
// hit of the call before, and the cursor with it. Fewer hits than `capacity`: there are no more. Nothing is
// lost or given twice between two calls for the same accel, ray and query, even where several hits
// round to one `t`. `cursor` may be null: each call begins with the first hit.
//
// Each primitive of each instance is given at most once, but a sphere twice: where the ray enters and where it leaves,
// also when it only touches. At a shared edge or vertex all triangles that are met are given. Exact
// whatever `query->precision` is, and the first of all is that of `rt_intersect`. What is in `hits`
// behind those returned may be written too.
//
// 0, and nothing written, when another pointer is null, when query or cursor are refused, and when the cursor names a hit that the
// ray does not have: `rt_all_hits_checked` says which.
size_t rt_all_hits(const RtAccel *accel,
                   const RtRay *ray,
                   const RtQuery *query,
                   RtCursor *cursor,
                   RtHit *hits,
                   size_t capacity);

// `rt_all_hits` that says why it was refused, and else writes to `*count` how many hits it wrote. RT_ERROR_NOT_FOUND: the ray does
// not have the hit that the cursor names. When refused, nothing is written.
RtStatus rt_all_hits_checked(const RtAccel *accel,
                             const RtRay *ray,
                             const RtQuery *query,
                             RtCursor *cursor,
                             RtHit *hits,
                             size_t capacity,
                             size_t *count);

// The point closest to `point`, three floats, on the triangles and the surfaces of spheres within
// `radius`, ends included; of what the mask and `skip` of `query` leave, which may be null. `skip`
// leaves out all of a sphere here; `facing` and `precision` are not asked.
//
// Returns whether there is one, and writes it, or none, to `*out`. When another pointer is null or the query is
// refused: false, and nothing is written.
//
// Distances are computed in double precision, the same bits from every structure and on every machine,
// and of equal ones the first by instance, geometry and primitive wins. They are within 2^-46 of the distance plus the
// primitive's longest edge or diameter: nothing is closer by more than that.
//
// In instances they are those of the images of vertices, rounded to double precision, and of the ellipsoids that spheres
// become; if a map stretches by at most 2^10 times as much along one axis as along another, within 2^-40 of
// the distance and the longest axis.
//
// Nothing is within a radius that is negative or NaN, from a point that is not finite, or beyond FLT_MAX.
bool rt_closest_point(const RtAccel *accel,
                      const float *point,
                      float radius,
                      const RtQuery *query,
                      RtPointHit *out);

// `rt_intersect` for `count` rays, on the calling thread: parts of an array may be asked for at the same time. When a pointer is null or
// the arrays overlap, nothing is written; `rt_intersect_batch_with` says so.
void rt_intersect_batch(const RtAccel *accel,
                        const RtRay *rays,
                        RtHit *hits,
                        size_t count);

// `rt_occluded` for `count` rays: 1 for a hit, 0 for none. When a pointer is null or the arrays overlap, nothing is
// written.
void rt_occluded_batch(const RtAccel *accel,
                       const RtRay *rays,
                       uint8_t *occluded,
                       size_t count);

// `rt_intersect_with` for `count` rays, `ray_stride` bytes apart, into hits `hit_stride` bytes
// apart. A stride of 0 means packed; others are multiples of 4 and no less than the struct.
// `query` may be null. When refused, nothing is written.
//
// The arrays do not overlap, or at equal strides each hit lies in the place of its own ray or between two rays; anything else is
// refused. So hits may take the place of rays, or stand beside them in one struct.
RtStatus rt_intersect_batch_with(const RtAccel *accel,
                                 const RtRay *rays,
                                 size_t ray_stride,
                                 const RtQuery *query,
                                 RtHit *hits,
                                 size_t hit_stride,
                                 size_t count);

// `rt_occluded_with` for `count` rays, `ray_stride` bytes apart, into bytes `occluded_stride` bytes
// apart. A stride of 0 means packed. `query` may be null. When refused, nothing is written. Arrays may overlap as above.
RtStatus rt_occluded_batch_with(const RtAccel *accel,
                                const RtRay *rays,
                                size_t ray_stride,
                                const RtQuery *query,
                                uint8_t *occluded,
                                size_t occluded_stride,
                                size_t count);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

// The layouts above, checked for the compiler at hand.
#if defined(__cplusplus)
#define RT_RAYKERN_ASSERT(name, condition) static_assert(condition, #name)
#elif defined(__STDC_VERSION__) && __STDC_VERSION__ >= 201112L
#define RT_RAYKERN_ASSERT(name, condition) _Static_assert(condition, #name)
#else
#define RT_RAYKERN_ASSERT(name, condition) typedef char rt_raykern_##name[(condition) ? 1 : -1]
#endif

RT_RAYKERN_ASSERT(size_of_ray, sizeof(RtRay) == 32);
RT_RAYKERN_ASSERT(ray_direction, offsetof(RtRay, direction) == 16);
RT_RAYKERN_ASSERT(size_of_hit, sizeof(RtHit) == 24);
RT_RAYKERN_ASSERT(hit_prim, offsetof(RtHit, prim) == 12);
RT_RAYKERN_ASSERT(size_of_mesh, sizeof(RtMesh) == 2 * sizeof(void *) + 24);
RT_RAYKERN_ASSERT(mesh_vertex_count, offsetof(RtMesh, vertex_count) == 2 * sizeof(void *));
RT_RAYKERN_ASSERT(size_of_sphere_set, sizeof(RtSphereSet) == sizeof(void *) + 16);
RT_RAYKERN_ASSERT(size_of_instance, sizeof(RtInstance) == sizeof(void *) + 56);
RT_RAYKERN_ASSERT(size_of_scene, sizeof(RtScene) == 3 * sizeof(void *) + 32);
RT_RAYKERN_ASSERT(scene_meshes, offsetof(RtScene, meshes) == 32);
RT_RAYKERN_ASSERT(size_of_options, sizeof(RtBuildOptions) == 3 * sizeof(void *) + 40);
RT_RAYKERN_ASSERT(options_grid_kind, offsetof(RtBuildOptions, grid_kind) == 3 * sizeof(void *) + 24);
RT_RAYKERN_ASSERT(options_user, offsetof(RtBuildOptions, user) == 24);
RT_RAYKERN_ASSERT(size_of_query, sizeof(RtQuery) == 32);
RT_RAYKERN_ASSERT(size_of_cursor, sizeof(RtCursor) == 28);
RT_RAYKERN_ASSERT(size_of_point_hit, sizeof(RtPointHit) == 36);
RT_RAYKERN_ASSERT(size_of_memory, sizeof(RtMemory) == 3 * sizeof(size_t));
RT_RAYKERN_ASSERT(size_of_surface, sizeof(RtSurface) == 56);
RT_RAYKERN_ASSERT(surface_normal, offsetof(RtSurface, normal) == 20);
RT_RAYKERN_ASSERT(size_of_info, sizeof(RtInfo) == 4 * sizeof(size_t) + 72);
RT_RAYKERN_ASSERT(info_size, offsetof(RtInfo, size) == 64);

#undef RT_RAYKERN_ASSERT

#endif // RAYKERN_H
