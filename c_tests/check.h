// What the C tests share: a check that says where it failed, aligned memory, and a scene.

#ifndef CHECK_H
#define CHECK_H

#include "raykern.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define CHECK(condition)                                                        \
    do {                                                                        \
        if (!(condition)) {                                                     \
            fprintf(stderr, "%s:%d: not so: %s\n", __FILE__, __LINE__, #condition); \
            exit(1);                                                            \
        }                                                                       \
    } while (0)

// `size` bytes at a multiple of 64. Never freed: the programs are short.
static inline unsigned char *aligned(size_t size) {
    unsigned char *memory = malloc(size + 64);
    CHECK(memory != NULL);
    return memory + (64 - (size_t)memory % 64) % 64;
}

static inline RtScene scene_of(const RtMesh *meshes, uint32_t mesh_count, const RtSphereSet *sets,
                               uint32_t set_count) {
    RtScene scene = {0};
    scene.struct_size = sizeof scene;
    scene.meshes = meshes;
    scene.mesh_count = mesh_count;
    scene.sphere_sets = sets;
    scene.sphere_set_count = set_count;
    return scene;
}

// A bumpy sheet of 2 * n * n triangles over [0, n] x [0, n], as an indexed mesh.
static inline RtMesh sheet(uint32_t n) {
    float *vertices = malloc(3 * sizeof(float) * (n + 1) * (n + 1));
    uint32_t *indices = malloc(6 * sizeof(uint32_t) * n * n);
    CHECK(vertices != NULL && indices != NULL);
    for (uint32_t i = 0; i < (n + 1) * (n + 1); i++) {
        vertices[3 * i] = (float)(i % (n + 1));
        vertices[3 * i + 1] = (float)(i / (n + 1));
        vertices[3 * i + 2] = (float)(i * 7919u % 101u) / 101.0f;
    }
    for (uint32_t i = 0; i < n * n; i++) {
        uint32_t a = i / n * (n + 1) + i % n;
        uint32_t quad[6] = {a, a + 1, a + n + 1, a + n + 2, a + n + 1, a + 1};
        memcpy(indices + 6 * i, quad, sizeof quad);
    }
    RtMesh mesh = {0};
    mesh.vertices = vertices;
    mesh.indices = indices;
    mesh.vertex_count = (n + 1) * (n + 1);
    mesh.triangle_count = 2 * n * n;
    return mesh;
}

// Ray `i` of a sequence over and under a sheet of size `n`, some of them misses.
static inline RtRay ray_over(uint32_t n, uint32_t i) {
    RtRay ray = {{0}, 0, {0}, 1e30f};
    ray.origin[0] = (float)(i * 2654435761u >> 16) / 65536.0f * (float)n;
    ray.origin[1] = (float)(i * 2246822519u >> 16) / 65536.0f * (float)n;
    ray.origin[2] = i % 2 ? 3.0f : -3.0f;
    ray.direction[0] = (float)(i % 13) / 13.0f - 0.5f;
    ray.direction[1] = (float)(i % 17) / 17.0f - 0.5f;
    ray.direction[2] = i % 2 ? -1.0f : 1.0f;
    return ray;
}

static inline const RtAccel *built(const RtScene *scene, bool grid, RtBuildOptions *options) {
    RtMemory need;
    CHECK((grid ? rt_grid_needs : rt_bvh_needs)(scene, options, &need) == RT_OK);
    CHECK(need.alignment == 64 && need.size % 64 == 0 && need.minimum <= need.size);
    const RtAccel *accel = NULL;
    void *memory = aligned(need.size);
    CHECK((grid ? rt_build_grid : rt_build_bvh)(scene, options, memory, need.size, &accel) == RT_OK);
    CHECK((const void *)accel == memory && rt_accel_size(accel) <= need.size);
    return accel;
}

#endif
