// The core set of the C tests, without a C library: builds in static memory, queries, and what is refused.

#include "board.h"
#include "check.h"
#include "raykern.h"
#include "stack.h"
#include "text.h"

// Two squares across z, of two triangles each, the second one twice as far, and a single triangle behind them.
static const float vertices[] = {0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1, 0, 0, 2, 1, 0, 2, 0, 1, 2, 1, 1, 2, 0, 0, 3, 1, 0, 3, 0, 1, 3};
static const uint32_t indices[] = {0, 1, 2, 3, 2, 1, 4, 5, 6, 7, 6, 5, 8, 9, 10};
static unsigned char memory[4096] __attribute__((aligned(64)));
static unsigned char copy[4096] __attribute__((aligned(64)));

static RtRay down(float x, float y) {
    RtRay ray = {{x, y, -1}, 0, {0, 0, 1}, 100};
    return ray;
}

static void copy_block(const RtAccel *accel) {
    for (size_t i = 0; i < rt_accel_size(accel); i++) copy[i] = ((const unsigned char *)accel)[i];
}

static void check_answers(const RtAccel *accel) {
    RtHit hit;
    RtRay ray = down(0.25f, 0.25f);
    CHECK(rt_intersect(accel, &ray, &hit) && rt_occluded(accel, &ray));
    CHECK(hit.t == 2 && hit.u == 0.25f && hit.v == 0.25f && hit.prim == 0 && hit.geometry == 0 && hit.instance == RT_NONE);
    // On an edge that two triangles share, the first of them.
    ray = down(0.5f, 0.5f);
    CHECK(rt_intersect(accel, &ray, &hit) && hit.t == 2 && hit.prim == 0);
    // In a vertex of the second square, beyond the first.
    ray = down(1, 1);
    ray.t_min = 2.5f;
    CHECK(rt_intersect(accel, &ray, &hit) && hit.t == 3 && hit.prim == 3);
    ray = down(1.0000001f, 0.5f);
    CHECK(!rt_intersect(accel, &ray, &hit) && !rt_occluded(accel, &ray) && hit.prim == RT_NONE);
    ray = down(0.25f, 0.25f);
    ray.direction[0] = __builtin_nanf("");
    CHECK(!rt_intersect(accel, &ray, &hit));
}

static void check_choices(const RtAccel *accel) {
    RtHit hit;
    RtRay ray = down(0.75f, 0.5f);
    RtQuery query = {0};
    query.struct_size = sizeof query;
    query.precision = RT_PRECISION_WATERTIGHT;
    CHECK(rt_intersect_with(accel, &ray, &query, &hit) && hit.prim == 1 && hit.t > 1.9999f && hit.t < 2.0001f);
    query.precision = RT_PRECISION_EXACT;
    query.skip = 1;
    query.skip_prim = 1;
    query.skip_instance = RT_NONE;
    CHECK(rt_intersect_with(accel, &ray, &query, &hit) && hit.prim == 3 && hit.t == 3);
    query.skip = 0;
    query.facing = RT_FACING_FRONT;
    CHECK(!rt_occluded_with(accel, &ray, &query));
    query.facing = 7;
    CHECK(rt_query_check(&query) == RT_ERROR_INVALID_ARGUMENT);
    RtRay rays[2] = {down(0.25f, 0.25f), down(5, 5)};
    RtHit hits[2];
    rt_intersect_batch(accel, rays, hits, 2);
    CHECK(hits[0].t == 2 && hits[1].prim == RT_NONE);
}

static void check_refusals(const RtAccel *accel) {
    const RtAccel *out = accel;
    size_t size = rt_accel_size(accel);
    copy_block(accel);
    CHECK(rt_accel_open(copy, sizeof copy, &out) == RT_OK && (const void *)out == copy);
    check_answers(out);
    out = accel;
    CHECK(rt_accel_open(NULL, size, &out) == RT_ERROR_NULL_POINTER);
    CHECK(rt_accel_open(copy + 4, size, &out) == RT_ERROR_MISALIGNED);
    CHECK(rt_accel_open(copy, size - 1, &out) == RT_ERROR_TRUNCATED);
    // The byte order follows eight letters.
    for (int i = 0; i < 4; i++) copy[8 + i] = ((const unsigned char *)accel)[11 - i];
    CHECK(rt_accel_open(copy, size, &out) == RT_ERROR_BYTE_ORDER);
    copy_block(accel);
    copy[12] ^= 1, copy[15] ^= 1;
    CHECK(rt_accel_open(copy, size, &out) == RT_ERROR_BLOCK_VERSION);
    copy_block(accel);
    // The number of something in a part.
    copy[90] ^= 1;
    CHECK(rt_accel_open(copy, size, &out) != RT_OK);
    copy[0] = 'R';
    CHECK(rt_accel_open(copy, size, &out) == RT_ERROR_NOT_A_BLOCK && out == accel);
}

// The most stack that a build has taken.
static uint32_t build_stack;

static RtStatus build(const RtScene *scene, const RtBuildOptions *options, size_t size, const RtAccel **out) {
    Stack stack = paint_stack();
    RtStatus status = rt_build_bvh(scene, options, memory, size, out);
    uint32_t used = used_stack(stack);
    if (used > build_stack) build_stack = used;
    return status;
}

static void check_build(uint32_t plain_list, uint32_t kind) {
    RtMesh mesh = {0};
    mesh.vertices = vertices;
    mesh.indices = indices;
    mesh.vertex_count = 11;
    mesh.triangle_count = 5;
    RtScene scene = {0};
    scene.struct_size = sizeof scene;
    scene.mesh_count = 1;
    scene.meshes = &mesh;
    RtBuildOptions options = {0};
    options.struct_size = sizeof options;
    options.layout = RT_LAYOUT_COMPACT;
    options.plain_list = plain_list;
    RtMemory need;
    CHECK(rt_bvh_needs(&scene, &options, &need) == RT_OK && need.size <= sizeof memory);
    const RtAccel *accel = NULL;
    CHECK(build(&scene, &options, need.minimum - 1, &accel) == RT_ERROR_OUT_OF_MEMORY && accel == NULL);
    CHECK(build(&scene, &options, need.size, &accel) == RT_OK && (const void *)accel == memory);
    RtInfo info = {0};
    info.struct_size = sizeof info;
    CHECK(rt_accel_info(accel, &info) == RT_OK && info.kind == kind && info.triangle_count == 5);
    check_answers(accel);
    check_choices(accel);
    check_refusals(accel);
    mesh.vertex_count = 10;
    CHECK(build(&scene, &options, need.size, &accel) == RT_ERROR_INDEX_OUT_OF_RANGE);
}

int main(void) {
    CHECK(rt_version() == RT_RAYKERN_VERSION);
    check_build(RT_PLAIN_LIST_ALWAYS, RT_KIND_LIST);
    check_build(RT_PLAIN_LIST_NEVER, RT_KIND_BVH);
    print_measured("build-stack", build_stack);
    board_print("passed\n");
    return 0;
}
