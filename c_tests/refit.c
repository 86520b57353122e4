// A refitted block answers as one that is built anew; what cannot be refitted is left as it is.

#include "check.h"

#include <math.h>

#define N 40
#define RAYS 3000

// The mesh with every vertex elsewhere: `step` counts the frames. In odd frames some are nowhere.
static RtMesh moved(const RtMesh *mesh, uint32_t step) {
    float *vertices = malloc(3 * sizeof(float) * mesh->vertex_count);
    CHECK(vertices != NULL);
    for (uint32_t i = 0; i < mesh->vertex_count; i++) {
        float *to = vertices + 3 * i;
        memcpy(to, mesh->vertices + 3 * i, 3 * sizeof(float));
        to[2] += (float)(i * step % 7u) / 3.0f;
        if (step % 2 == 1 && i % 11 == 0) to[0] = NAN;
    }
    RtMesh other = *mesh;
    other.vertices = vertices;
    return other;
}

static RtInfo info_of(const RtAccel *accel) {
    RtInfo info = {0};
    info.struct_size = sizeof info;
    CHECK(rt_accel_info(accel, &info) == RT_OK);
    return info;
}

static void same_answers(const RtAccel *a, const RtAccel *b) {
    for (uint32_t i = 0; i < RAYS; i++) {
        RtRay ray = ray_over(N, i);
        RtHit first, second;
        CHECK(rt_intersect(a, &ray, &first) == rt_intersect(b, &ray, &second));
        CHECK(memcmp(&first, &second, sizeof first) == 0);
        CHECK(rt_occluded(a, &ray) == rt_occluded(b, &ray));
    }
}

// Two halves, each on this thread.
static uint32_t ran;
static void parallel_for(void *user, uint32_t count, RtTask task, void *context) {
    (void)user;
    for (uint32_t i = count; i-- > 0; ran++) task(context, i);
}

static void check_frames(const RtMesh *mesh, RtBuildOptions *options) {
    RtScene scene = scene_of(mesh, 1, NULL, 0);
    const RtAccel *accel = built(&scene, false, options);
    size_t size = rt_accel_size(accel);
    // The block may be copied, and opened elsewhere.
    unsigned char *memory = aligned(size), *original = aligned(size);
    memcpy(original, accel, size);
    memcpy(memory, accel, size);
    CHECK(rt_accel_open(memory, size, &accel) == RT_OK && (const void *)accel == memory);
    CHECK(info_of(accel).refit == 1 && info_of(accel).cost_growth == 1.0f);
    for (uint32_t step = 0; step < 4; step++) {
        RtMesh other = moved(mesh, step);
        RtScene after = scene_of(&other, 1, NULL, 0);
        CHECK(rt_accel_refit(memory, size, &after) == RT_OK);
        const RtAccel *anew = built(&after, false, NULL);
        RtInfo found = info_of(accel), expected = info_of(anew);
        CHECK(memcmp(found.lower, expected.lower, sizeof found.lower) == 0);
        CHECK(memcmp(found.upper, expected.upper, sizeof found.upper) == 0);
        CHECK(found.triangle_count == expected.triangle_count);
        CHECK(found.ignored_count == expected.ignored_count);
        CHECK((step % 2 == 1) == (found.ignored_count > 0));
        CHECK(found.cost_growth > 0.0f && expected.refit == 0 && expected.cost_growth == 0.0f);
        same_answers(accel, anew);
        CHECK(rt_accel_refit(memory, size, &scene) == RT_OK);
        CHECK(memcmp(memory, original, size) == 0);
    }
    options->parallel_for = parallel_for;
    options->worker_count = 2;
    ran = 0;
    RtMesh other = moved(mesh, 3);
    RtScene after = scene_of(&other, 1, NULL, 0);
    CHECK(rt_accel_refit_with(memory, size, &after, options) == RT_OK && ran > 0);
    CHECK(rt_accel_refit(original, size, &after) == RT_OK);
    CHECK(memcmp(memory, original, size) == 0);
}

// The call is refused and the block as before.
static void refused(RtStatus status, const RtAccel *accel, const RtScene *scene) {
    size_t size = rt_accel_size(accel);
    unsigned char *memory = aligned(size);
    memcpy(memory, accel, size);
    CHECK(rt_accel_refit(memory, size, scene) == status);
    CHECK(memcmp(memory, accel, size) == 0);
}

int main(void) {
    RtMesh mesh = sheet(N);
    RtScene scene = scene_of(&mesh, 1, NULL, 0);
    const uint32_t layouts[] = {RT_LAYOUT_COMPACT, RT_LAYOUT_WIDE_4, RT_LAYOUT_WIDE_8, RT_LAYOUT_WIDE_16};
    for (int i = 0; i < 4; i++) {
        RtBuildOptions options = {0};
        options.struct_size = sizeof options;
        options.layout = layouts[i];
        options.refit = 1;
        check_frames(&mesh, &options);
    }
    RtBuildOptions options = {0};
    options.struct_size = sizeof options;
    refused(RT_ERROR_NOT_REFITTABLE, built(&scene, false, &options), &scene);
    options.refit = 1;
    refused(RT_ERROR_NOT_REFITTABLE, built(&scene, true, &options), &scene);
    const RtAccel *accel = built(&scene, false, &options);
    RtMesh other = mesh;
    other.triangle_count--;
    RtScene others = scene_of(&other, 1, NULL, 0);
    refused(RT_ERROR_OTHER_SCENE, accel, &others);
    other = mesh;
    other.vertex_count = 5;
    refused(RT_ERROR_OTHER_SCENE, accel, &others);
    refused(RT_ERROR_NULL_POINTER, accel, NULL);
    CHECK(rt_accel_refit(NULL, 0, &scene) == RT_ERROR_NULL_POINTER);
    unsigned char *memory = aligned(rt_accel_size(accel));
    memcpy(memory, accel, rt_accel_size(accel));
    CHECK(rt_accel_refit(memory, rt_accel_size(accel) - 1, &scene) == RT_ERROR_TRUNCATED);
    CHECK(rt_accel_refit(memory + 4, 4096, &scene) == RT_ERROR_MISALIGNED);
    memset(memory, 0, 64);
    CHECK(rt_accel_refit(memory, rt_accel_size(accel), &scene) == RT_ERROR_NOT_A_BLOCK);
    return 0;
}
