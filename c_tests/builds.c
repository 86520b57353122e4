// Builds in every quality and of every kind of grid, on the caller's threads, watched and cancelled: the same bytes each time.

#include "check.h"

#include <fenv.h>
#include <pthread.h>

#define WORKERS 8

// A build's tasks, and who takes the next one.
typedef struct Crew {
    RtTask task;
    void *context;
    uint32_t workers, count, next, ran;
    pthread_mutex_t lock;
} Crew;

static void *work(void *user) {
    Crew *crew = user;
    // Threads of a renderer have any floating-point state.
    CHECK(fesetround(FE_UPWARD) == 0);
    for (;;) {
        pthread_mutex_lock(&crew->lock);
        uint32_t i = crew->next++;
        pthread_mutex_unlock(&crew->lock);
        if (i >= crew->count) break;
        crew->task(crew->context, i);
        CHECK(fegetround() == FE_UPWARD);
    }
    return NULL;
}

static void parallel_for(void *user, uint32_t count, RtTask task, void *context) {
    Crew *crew = user;
    crew->task = task;
    crew->context = context;
    crew->count = count;
    crew->next = 0;
    crew->ran += count;
    pthread_t threads[WORKERS];
    for (uint32_t i = 0; i < crew->workers; i++) CHECK(pthread_create(&threads[i], NULL, work, crew) == 0);
    for (uint32_t i = 0; i < crew->workers; i++) CHECK(pthread_join(threads[i], NULL) == 0);
}

static uint32_t calls, allowed;
static float told;

static bool progress(void *user, float done) {
    CHECK(user != NULL && done >= told && done <= 1.0f);
    told = done;
    return ++calls <= allowed;
}

// Every kind of grid, from options of today's size and of the first published one, answers as the BVH does.
static void check_grids(const RtScene *scene) {
    RtBuildOptions options = {0};
    options.struct_size = sizeof options;
    const RtAccel *bvh = built(scene, false, &options);
    for (uint32_t kind = RT_GRID_NESTED; kind <= RT_GRID_OCTREE; kind++) {
        options.grid_kind = kind;
        options.grid_density = kind == RT_GRID_UNIFORM ? 0.5f : 0.0f;
        options.grid_depth = 3;
        const RtAccel *grid = built(scene, true, &options);
        RtInfo info = {0};
        info.struct_size = sizeof info;
        CHECK(rt_accel_info(grid, &info) == RT_OK && info.kind == RT_KIND_GRID);
        CHECK((kind == RT_GRID_OCTREE) == (info.resolution[0] == 2));
        double cells = (double)info.resolution[0] * info.resolution[1] * info.resolution[2];
        bool half = cells > 0.3 * info.triangle_count && cells < 0.7 * info.triangle_count;
        CHECK((kind == RT_GRID_UNIFORM) == half);
        // Nothing is worth dividing here but the cells of an octree.
        options.grid_depth = 1;
        bool same = rt_accel_size(built(scene, true, &options)) == rt_accel_size(grid);
        CHECK(same == (kind != RT_GRID_OCTREE));
        for (int i = 0; i < 100; i++) {
            RtRay ray = {{(float)(i % 10) / 7, (float)i / 70, 3}, 0, {0.01f, 0.02f, -1}, 9};
            RtHit a, b;
            CHECK(rt_intersect(grid, &ray, &a) == rt_intersect(bvh, &ray, &b));
            CHECK(memcmp(&a, &b, sizeof a) == 0);
        }
    }
    // A caller of the first version has no fields for grids, whatever stands behind its struct.
    options.struct_size = (uint32_t)offsetof(RtBuildOptions, grid_kind);
    options.grid_kind = 77;
    RtInfo info = {0};
    info.struct_size = sizeof info;
    CHECK(rt_accel_info(built(scene, true, &options), &info) == RT_OK && info.resolution[0] != 2);
}

// A sheet without bumps: most of its triangles lie in a cell or two of a grid.
static RtMesh level_sheet(uint32_t n) {
    RtMesh mesh = sheet(n);
    float *vertices = malloc(3 * sizeof(float) * mesh.vertex_count);
    CHECK(vertices != NULL);
    for (uint32_t i = 0; i < 3 * mesh.vertex_count; i++) vertices[i] = i % 3 == 2 ? 0 : mesh.vertices[i];
    mesh.vertices = vertices;
    return mesh;
}

// What the library takes by itself: a BVH for many rays, a grid for few, a list for a handful.
static void check_choice(void) {
    RtMesh many = level_sheet(100), one = sheet(1);
    RtScene scene = scene_of(&many, 1, NULL, 0);
    RtScene handful = scene_of(&one, 1, NULL, 0);
    const RtScene *scenes[3] = {&scene, &scene, &handful};
    const float rays[3] = {0, 0.05f, 0};
    const uint32_t kinds[3] = {RT_KIND_BVH, RT_KIND_GRID, RT_KIND_LIST};
    for (int i = 0; i < 3; i++) {
        RtBuildOptions options = {0};
        options.struct_size = sizeof options;
        options.rays_per_prim = rays[i];
        RtMemory need;
        CHECK(rt_needs(scenes[i], &options, &need) == RT_OK);
        const RtAccel *accel;
        CHECK(rt_build(scenes[i], &options, aligned(need.size), need.size, &accel) == RT_OK);
        RtInfo info = {0};
        info.struct_size = sizeof info;
        CHECK(rt_accel_info(accel, &info) == RT_OK && info.kind == kinds[i]);
    }
}

int main(void) {
    RtMesh mesh = sheet(100);
    RtScene scene = scene_of(&mesh, 1, NULL, 0);
    check_grids(&scene);
    check_choice();
    const uint32_t qualities[3] = {RT_QUALITY_FAST, RT_QUALITY_BALANCED, RT_QUALITY_BEST};
    Crew crew = {.lock = PTHREAD_MUTEX_INITIALIZER};
    for (int i = 0; i < 9; i++) {
        bool grid = i >= 6;
        RtBuildOptions options = {0};
        options.struct_size = sizeof options;
        options.quality = qualities[i / 2 % 3];
        options.refit = !grid && i % 2;
        options.grid_kind = (uint32_t)i % 3;
        const RtAccel *alone = built(&scene, grid, &options);
        options.user = &crew;
        options.parallel_for = parallel_for;
        options.worker_count = 1;
        crew.ran = 0;
        built(&scene, grid, &options);
        CHECK(crew.ran == 0);
        for (crew.workers = 2; crew.workers <= WORKERS; crew.workers += 3) {
            options.worker_count = crew.workers;
            crew.ran = 0;
            const RtAccel *together = built(&scene, grid, &options);
            CHECK(crew.ran > 4);
            CHECK(rt_accel_size(alone) == rt_accel_size(together));
            CHECK(memcmp(alone, together, rt_accel_size(alone)) == 0);
        }
        crew.workers = options.worker_count = 3;

        // Cancelled at each call, in the same memory, which then takes a build.
        options.progress = progress;
        RtMemory need;
        CHECK((grid ? rt_grid_needs : rt_bvh_needs)(&scene, &options, &need) == RT_OK);
        unsigned char *memory = aligned(need.size);
        const RtAccel *out = NULL;
        for (allowed = 0;; allowed++) {
            calls = 0;
            told = 0.0f;
            RtStatus status = (grid ? rt_build_grid : rt_build_bvh)(&scene, &options, memory, need.size, &out);
            CHECK(calls >= 1);
            if (status == RT_OK) break;
            CHECK(status == RT_ERROR_CANCELLED && calls == allowed + 1 && out == NULL);
            // Not even one that was finished is left.
            CHECK(rt_accel_open(memory, need.size, &out) == RT_ERROR_NOT_A_BLOCK && out == NULL);
        }
        CHECK(told == 1.0f && allowed >= 3);
        CHECK(memcmp(alone, out, rt_accel_size(alone)) == 0);
    }
    return 0;
}
