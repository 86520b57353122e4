// Every status but RT_ERROR_INTERNAL (a Rust test stops a panic) and RT_ERROR_CANCELLED (builds.c), with
// outputs left as they were.

#include "check.h"

#include <math.h>

static float vertices[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
static uint32_t indices[4] = {0, 1, 2, 0};
static RtMesh mesh;
static RtScene scene;
static RtBuildOptions options;
static bool seen[RT_ERROR_LINKED + 1];

static void reset(void) {
    memset(&mesh, 0, sizeof mesh);
    mesh.vertices = vertices;
    mesh.indices = indices;
    mesh.vertex_count = 3;
    mesh.triangle_count = 1;
    scene = scene_of(&mesh, 1, NULL, 0);
    memset(&options, 0, sizeof options);
    options.struct_size = sizeof options;
}

// Both needs and both builds say `status` and write nothing.
static void refused(RtStatus status, int line) {
    RtMemory need, same;
    memset(&need, 0x55, sizeof need);
    same = need;
    const RtAccel *mark = (const RtAccel *)&need, *out = mark;
    static unsigned char *memory = NULL;
    if (memory == NULL) memory = aligned(8192);
    memset(memory, 0x55, 8192);
    RtStatus got[4] = {
        rt_bvh_needs(&scene, &options, &need), rt_grid_needs(&scene, &options, &need),
        rt_build_bvh(&scene, &options, memory, 8192, &out),
        rt_build_grid(&scene, &options, memory, 8192, &out)};
    for (int i = 0; i < 4; i++)
        if (got[i] != status) {
            fprintf(stderr, "line %d, call %d: %d, not %d\n", line, i, (int)got[i], (int)status);
            exit(1);
        }
    CHECK(memcmp(&need, &same, sizeof need) == 0 && out == mark);
    for (int i = 0; i < 8192; i++) CHECK(memory[i] == 0x55);
    seen[status] = true;
    reset();
}

#define REFUSED(status, change) (change, refused(status, __LINE__))

static void check_instances(void) {
    reset();
    const RtAccel *child = built(&scene, false, NULL);
    const RtInstance good = {child, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0}, 0, 0};
    RtInstance instance = good;
    RtScene nesting = scene_of(NULL, 0, NULL, 0);
    nesting.instance_count = 1;
    nesting.instances = &good;
    const RtAccel *nested = built(&nesting, false, NULL);
#define WITH(change) (scene.instance_count = 1, scene.instances = &instance, instance = good, change)
    REFUSED(RT_ERROR_NULL_POINTER, WITH(instance.accel = NULL));
    REFUSED(RT_ERROR_INVALID_ARGUMENT, WITH(instance.reserved = 1));
    REFUSED(RT_ERROR_SINGULAR, WITH(instance.object_to_world[5] = 0));
    REFUSED(RT_ERROR_SINGULAR, WITH(instance.object_to_world[3] = 1e38f * 100));
    REFUSED(RT_ERROR_NESTED, WITH(instance.accel = nested));
    REFUSED(RT_ERROR_INVALID_ARGUMENT, WITH(scene.instance_size = sizeof instance - 8));
    const RtAccel *out = NULL;
    CHECK(rt_accel_open(nested, rt_accel_size(nested), &out) == RT_ERROR_LINKED && out == NULL);
    seen[RT_ERROR_LINKED] = true;
}

static void check_builds(void) {
    reset();
    REFUSED(RT_ERROR_INVALID_ARGUMENT, scene.struct_size = 0);
    REFUSED(RT_ERROR_INVALID_ARGUMENT, scene.struct_size = sizeof scene - 1);
    REFUSED(RT_ERROR_VERSION, scene.struct_size = 100000);
    REFUSED(RT_ERROR_INVALID_ARGUMENT, scene.reserved = 1);
    REFUSED(RT_ERROR_NULL_POINTER, scene.meshes = NULL);
    REFUSED(RT_ERROR_NULL_POINTER, scene.sphere_set_count = 1);
    REFUSED(RT_ERROR_NULL_POINTER, scene.instance_count = 1);
    REFUSED(RT_ERROR_MISALIGNED, scene.meshes = (const RtMesh *)((const char *)&mesh + 1));
    REFUSED(RT_ERROR_INVALID_ARGUMENT, scene.mesh_size = sizeof mesh - 4);
    REFUSED(RT_ERROR_INVALID_ARGUMENT, scene.mesh_size = sizeof mesh + 1);
    check_instances();
    REFUSED(RT_ERROR_INVALID_ARGUMENT, mesh.reserved = 1);
    REFUSED(RT_ERROR_NULL_POINTER, mesh.vertices = NULL);
    REFUSED(RT_ERROR_MISALIGNED, mesh.vertices = (const float *)((const char *)vertices + 1));
    REFUSED(RT_ERROR_MISALIGNED, mesh.indices = (const uint32_t *)((const char *)indices + 2));
    REFUSED(RT_ERROR_INVALID_ARGUMENT, mesh.vertex_stride = 8);
    REFUSED(RT_ERROR_INVALID_ARGUMENT, mesh.vertex_stride = 14);
    REFUSED(RT_ERROR_INVALID_ARGUMENT, (mesh.triangle_count = 2, mesh.index_stride = 4));
    REFUSED(RT_ERROR_TOO_LARGE, (mesh.vertex_count = 0xFFFFFFFFu, mesh.vertex_stride = 0xFFFFFFFCu));
    REFUSED(RT_ERROR_INDEX_OUT_OF_RANGE, mesh.vertex_count = 2);
    REFUSED(RT_ERROR_INDEX_OUT_OF_RANGE, (mesh.indices = NULL, mesh.triangle_count = 2));
    REFUSED(RT_ERROR_INVALID_ARGUMENT, options.struct_size = 0);
    REFUSED(RT_ERROR_INVALID_ARGUMENT, options.quality = 3);
    REFUSED(RT_ERROR_INVALID_ARGUMENT, options.layout = 2);
    REFUSED(RT_ERROR_INVALID_ARGUMENT, options.refit = 2);
    REFUSED(RT_ERROR_INVALID_ARGUMENT, options.plain_list = 3);
    REFUSED(RT_ERROR_INVALID_ARGUMENT, options.layout = 12);
    REFUSED(RT_ERROR_INVALID_ARGUMENT, options.struct_size = offsetof(RtBuildOptions, grid_kind) - 1);
    REFUSED(RT_ERROR_INVALID_ARGUMENT, options.grid_kind = 3);
    REFUSED(RT_ERROR_INVALID_ARGUMENT, options.grid_density = -1.0f);
    REFUSED(RT_ERROR_INVALID_ARGUMENT, options.grid_density = 64.5f);
    REFUSED(RT_ERROR_INVALID_ARGUMENT, options.grid_density = (float)NAN);
    REFUSED(RT_ERROR_INVALID_ARGUMENT, options.grid_depth = 9);
    REFUSED(RT_ERROR_INVALID_ARGUMENT, options.rays_per_prim = -1.0f);

    // A newer caller: accepted while what we do not know is zero, alone and in arrays.
    struct { RtScene scene; uint64_t more; } newer = {scene, 0};
    struct { RtMesh mesh; uint64_t more; } newer_meshes[2] = {{mesh, 0}, {mesh, 0}};
    newer.scene.struct_size = sizeof newer;
    newer.scene.meshes = &newer_meshes[0].mesh;
    newer.scene.mesh_count = 2;
    newer.scene.mesh_size = sizeof newer_meshes[0];
    RtMemory need;
    CHECK(rt_bvh_needs(&newer.scene, NULL, &need) == RT_OK);
    newer.more = 1;
    CHECK(rt_bvh_needs(&newer.scene, NULL, &need) == RT_ERROR_VERSION);
    newer.more = 0;
    newer_meshes[1].more = 1;
    CHECK(rt_bvh_needs(&newer.scene, NULL, &need) == RT_ERROR_VERSION);
    CHECK(rt_bvh_needs(NULL, NULL, &need) == RT_ERROR_NULL_POINTER);
    CHECK(rt_bvh_needs(&scene, NULL, NULL) == RT_ERROR_NULL_POINTER);
    RtScene empty = scene_of(NULL, 0, NULL, 0);
    CHECK(rt_grid_needs(&empty, NULL, &need) == RT_OK);
}

static void check_memory(void) {
    RtMemory need;
    const RtAccel *out = NULL;
    CHECK(rt_build_bvh(&scene, NULL, NULL, 8192, &out) == RT_ERROR_NULL_POINTER);
    CHECK(rt_bvh_needs(&scene, NULL, &need) == RT_OK);
    unsigned char *memory = aligned(need.size + 64);
    CHECK(rt_build_bvh(&scene, NULL, memory, need.size, NULL) == RT_ERROR_NULL_POINTER);
    CHECK(rt_build_bvh(&scene, NULL, memory + 4, need.size, &out) == RT_ERROR_MISALIGNED);
    CHECK(rt_build_bvh(&scene, NULL, memory, need.minimum - 1, &out) == RT_ERROR_OUT_OF_MEMORY);
    CHECK(out == NULL);
    seen[RT_ERROR_OUT_OF_MEMORY] = true;
}

// Opens the block with `value` over the byte at `offset`.
static void open_with(RtStatus status, const RtAccel *accel, size_t offset, unsigned char value) {
    size_t size = rt_accel_size(accel);
    unsigned char *block = aligned(size);
    memcpy(block, accel, size);
    block[offset] = value;
    const RtAccel *out = NULL;
    CHECK(rt_accel_open(block, size, &out) == status && out == NULL);
    seen[status] = true;
}

// Of the options of a refit only the threads are read.
static void check_refit_options(unsigned char *memory, size_t size) {
    options.quality = 99;
    options.grid_density = -1.0f;
    CHECK(rt_accel_refit_with(memory, size, &scene, &options) == RT_OK);
    options.struct_size = 1;
    CHECK(rt_accel_refit_with(memory, size, &scene, &options) == RT_ERROR_INVALID_ARGUMENT);
}

static void check_refit(void) {
    RtMemory need;
    const RtAccel *out;
    for (uint32_t refit = 0; refit < 2; refit++) {
        reset();
        options.refit = refit;
        CHECK(rt_bvh_needs(&scene, &options, &need) == RT_OK);
        unsigned char *memory = aligned(need.size);
        CHECK(rt_build_bvh(&scene, &options, memory, need.size, &out) == RT_OK);
        RtScene empty = scene_of(NULL, 0, NULL, 0);
        const RtStatus status = refit ? RT_ERROR_OTHER_SCENE : RT_ERROR_NOT_REFITTABLE;
        CHECK(rt_accel_refit(memory, need.size, &empty) == status);
        seen[status] = true;
        if (refit) check_refit_options(memory, need.size);
    }
}

static void check_open_and_queries(void) {
    const RtAccel *accel = built(&scene, false, NULL), *out = NULL;
    size_t size = rt_accel_size(accel);
    open_with(RT_ERROR_NOT_A_BLOCK, accel, 0, 'x');
    uint32_t order;
    memcpy(&order, (const char *)accel + 8, 4);
    CHECK(order == 0x01020304);
    unsigned char *swapped = aligned(size);
    memcpy(swapped, accel, size);
    for (int i = 0; i < 4; i++) swapped[8 + i] = ((const unsigned char *)accel)[11 - i];
    CHECK(rt_accel_open(swapped, size, &out) == RT_ERROR_BYTE_ORDER);
    seen[RT_ERROR_BYTE_ORDER] = true;
    open_with(RT_ERROR_BLOCK_VERSION, accel, 12, 99);
    open_with(RT_ERROR_LAYOUT, accel, 28, 5);
    open_with(RT_ERROR_CORRUPT, accel, 24, 77);
    CHECK(rt_accel_open(accel, size - 1, &out) == RT_ERROR_TRUNCATED);
    seen[RT_ERROR_TRUNCATED] = true;
    CHECK(rt_accel_open((const char *)accel + 4, size - 4, &out) == RT_ERROR_MISALIGNED);
    CHECK(rt_accel_open(NULL, size, &out) == RT_ERROR_NULL_POINTER);
    CHECK(rt_accel_open(accel, size, NULL) == RT_ERROR_NULL_POINTER && out == NULL);

    RtRay ray = {{0.25f, 0.25f, 1}, 0, {0, 0, -1}, 1e30f};
    RtHit hit, mark;
    memset(&mark, 0x55, sizeof mark);
    hit = mark;
    RtQuery query = {0};
    CHECK(rt_query_check(NULL) == RT_OK && rt_query_check(&query) == RT_ERROR_INVALID_ARGUMENT);
    query.struct_size = sizeof query;
    CHECK(rt_query_check(&query) == RT_OK);
    query.precision = RT_PRECISION_WATERTIGHT;
    CHECK(rt_query_check(&query) == RT_OK);
    query.precision = 2;
    CHECK(rt_query_check(&query) == RT_ERROR_INVALID_ARGUMENT);
    CHECK(!rt_intersect_with(accel, &ray, &query, &hit) && !rt_occluded_with(accel, &ray, &query));
    CHECK(rt_intersect_batch_with(accel, &ray, 0, &query, &hit, 0, 1) == RT_ERROR_INVALID_ARGUMENT);
    query.precision = 0;
    query.facing = 3;
    CHECK(rt_query_check(&query) == RT_ERROR_INVALID_ARGUMENT);
    query.facing = 0;
    query.skip = 2;
    CHECK(rt_query_check(&query) == RT_ERROR_INVALID_ARGUMENT);
    CHECK(!rt_intersect(NULL, &ray, &hit) && !rt_intersect(accel, NULL, &hit));
    CHECK(!rt_intersect(accel, &ray, NULL) && !rt_occluded(NULL, &ray) && !rt_occluded(accel, NULL));
    CHECK(!rt_intersect_watertight(NULL, &ray, &hit) && !rt_intersect_watertight(accel, &ray, NULL));
    CHECK(!rt_occluded_watertight(NULL, &ray) && !rt_occluded_watertight(accel, NULL));
    rt_intersect_batch(NULL, &ray, &hit, 1);
    rt_intersect_batch(accel, NULL, &hit, 1);
    CHECK(rt_intersect_batch_with(accel, &ray, 30, NULL, &hit, 0, 1) == RT_ERROR_INVALID_ARGUMENT);
    CHECK(rt_intersect_batch_with(accel, &ray, 0, NULL, &hit, 20, 1) == RT_ERROR_INVALID_ARGUMENT);
    CHECK(rt_intersect_batch_with(accel, &ray, 0, NULL, &hit, 0, ((size_t)-1) / 8) == RT_ERROR_TOO_LARGE);
    CHECK(memcmp(&hit, &mark, sizeof hit) == 0 && rt_accel_size(NULL) == 0);

    RtInfo info = {0};
    CHECK(rt_accel_info(accel, &info) == RT_ERROR_INVALID_ARGUMENT && info.size == 0);
    struct { RtInfo info; uint64_t more; } newer = {info, 1};
    newer.info.struct_size = sizeof newer;
    CHECK(rt_accel_info(accel, &newer.info) == RT_ERROR_VERSION);
    newer.more = 0;
    CHECK(rt_accel_info(accel, &newer.info) == RT_OK && newer.info.size == size);

    RtSurface surface = {0};
    surface.struct_size = sizeof surface;
    CHECK(rt_intersect(accel, &ray, &hit));
    CHECK(rt_hit_surface(accel, &ray, &hit, &surface) == RT_OK);
    hit.prim = 7;
    memset(&surface, 0x55, sizeof surface);
    surface.struct_size = sizeof surface;
    RtSurface same = surface;
    CHECK(rt_hit_surface(accel, &ray, &hit, &surface) == RT_ERROR_NOT_FOUND);
    CHECK(memcmp(&same, &surface, sizeof same) == 0);
    seen[RT_ERROR_NOT_FOUND] = true;

    RtMemory need;
    CHECK(rt_accel_pack_needs(accel, &need) == RT_OK && need.size == size);
    unsigned char *memory = aligned(size);
    CHECK(rt_accel_pack(accel, memory, size - 1, &out) == RT_ERROR_OUT_OF_MEMORY);
    CHECK(rt_accel_pack(accel, memory, size, &out) == RT_OK && (const void *)out == memory);
    CHECK(memcmp(accel, out, size) == 0);
}

// A ray and its hit in one place, and side by side.
typedef union Slot { RtRay ray; RtHit hit; } Slot;
typedef struct Pair { RtHit hit; RtRay ray; } Pair;
#define RAYS 300

// Answers may come where they are in nobody's way; all else that overlaps is refused.
static void check_overlaps(void) {
    const RtAccel *accel = built(&scene, false, NULL);
    static RtRay rays[RAYS];
    static RtHit hits[RAYS];
    static Slot slots[RAYS + 1], same[RAYS + 1];
    static Pair pairs[RAYS];
    for (int i = 0; i < RAYS; i++) {
        RtRay ray = {{0.25f, 0.25f, (float)(1 + i)}, 0, {0, i % 3 ? -1.0f : 1.0f, -1}, 1e30f};
        rays[i] = slots[i].ray = pairs[i].ray = ray;
    }
    slots[RAYS] = slots[0];
    memcpy(same, slots, sizeof same);
    rt_intersect_batch(accel, rays, hits, RAYS);
    RtRay *first = &slots[0].ray;
    char *bytes = (char *)slots;
    const struct { size_t at, hit_stride; } refused[] = {
        {0, 0}, {0, 36}, {0, 24}, {sizeof(Slot), sizeof(Slot)}, {12, sizeof(Slot)}, {sizeof(Slot) - 4, sizeof(Slot)},
    };
    for (size_t i = 0; i < sizeof refused / sizeof refused[0]; i++) {
        RtHit *out = (RtHit *)(void *)(bytes + refused[i].at);
        CHECK(rt_intersect_batch_with(accel, first, 0, NULL, out, refused[i].hit_stride, RAYS) == RT_ERROR_INVALID_ARGUMENT);
    }
    CHECK(rt_occluded_batch_with(accel, first, 0, NULL, (uint8_t *)(bytes + 64), 0, RAYS) == RT_ERROR_INVALID_ARGUMENT);
    rt_intersect_batch(accel, first, (RtHit *)(void *)bytes, RAYS);
    CHECK(memcmp(slots, same, sizeof same) == 0);

    CHECK(rt_intersect_batch_with(accel, first, 0, NULL, (RtHit *)(void *)(bytes + 8), sizeof(Slot), RAYS) == RT_OK);
    for (int i = 0; i < RAYS; i++) CHECK(memcmp((char *)&slots[i] + 8, &hits[i], sizeof(RtHit)) == 0);
    memcpy(slots, same, sizeof same);
    CHECK(rt_intersect_batch_with(accel, first, 0, NULL, &slots[0].hit, sizeof(Slot), RAYS) == RT_OK);
    for (int i = 0; i < RAYS; i++) CHECK(memcmp(&slots[i].hit, &hits[i], sizeof(RtHit)) == 0);
    CHECK(rt_intersect_batch_with(accel, &pairs[0].ray, sizeof(Pair), NULL, &pairs[0].hit, sizeof(Pair), RAYS) == RT_OK);
    for (int i = 0; i < RAYS; i++) CHECK(memcmp(&pairs[i].hit, &hits[i], sizeof(RtHit)) == 0);
    memcpy(slots, same, sizeof same);
    CHECK(rt_occluded_batch_with(accel, first, 0, NULL, (uint8_t *)bytes + 31, sizeof(Slot), RAYS) == RT_OK);
    for (int i = 0; i < RAYS; i++) CHECK(((uint8_t *)&slots[i])[31] == (hits[i].prim != RT_NONE));
}

// Sentences are told apart by their place alone.
static void check_words(void) {
    const struct { RtStatus status; const char *word; } said[] = {
        {RT_OK, "done"}, {RT_ERROR_VERSION, "larger"}, {4, "unknown"}, {RT_ERROR_INDEX_OUT_OF_RANGE, "vertex"},
        {RT_ERROR_BYTE_ORDER, "byte order"}, {RT_ERROR_LAYOUT, "leaves that out"}, {RT_ERROR_CANCELLED, "cancelled"},
        {RT_ERROR_SINGULAR, "inverse"}, {RT_ERROR_LINKED, "packed"}, {RT_ERROR_LINKED + 1, "unknown"}, {-1, "unknown"},
    };
    for (size_t i = 0; i < sizeof said / sizeof said[0]; i++)
        CHECK(strstr(rt_status_message(said[i].status), said[i].word) != NULL);
}

int main(void) {
    check_words();
    check_builds();
    check_memory();
    check_refit();
    check_open_and_queries();
    check_overlaps();
    // 4 is no status.
    for (RtStatus i = RT_OK + 1; i < RT_ERROR_INTERNAL; i++) CHECK(seen[i] || i == 4);
    for (RtStatus i = RT_ERROR_NOT_REFITTABLE; i <= RT_ERROR_LINKED; i++) CHECK(seen[i]);
    return 0;
}
