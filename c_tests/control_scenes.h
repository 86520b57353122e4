// Scenes whose answers a changed floating-point state would change, and rays for each. All of it is
// computed once, before any state is set: the numbers of this program depend on the state as well.

#ifndef CONTROL_SCENES_H
#define CONTROL_SCENES_H

#include "check.h"

#include <math.h>

#define SCENES 5
#define RAYS 32
#define MESHES 3

typedef struct Subject {
    RtMesh meshes[MESHES];
    float spheres[8][4];
    RtSphereSet set;
    RtScene scene;
    RtRay rays[RAYS];
} Subject;

// A raster of n * n squares of two triangles, `step` apart in x and y, at height `z`. Each triangle is
// there twice: every hit is a tie.
static inline RtMesh doubled_raster(uint32_t n, float step, float z) {
    RtMesh mesh = sheet(n);
    float *vertices = malloc(3 * sizeof(float) * mesh.vertex_count);
    uint32_t *indices = malloc(6 * sizeof(uint32_t) * mesh.triangle_count);
    CHECK(vertices != NULL && indices != NULL);
    for (uint32_t i = 0; i < mesh.vertex_count; i++) {
        vertices[3 * i] = mesh.vertices[3 * i] * step;
        vertices[3 * i + 1] = mesh.vertices[3 * i + 1] * step;
        vertices[3 * i + 2] = z;
    }
    memcpy(indices, mesh.indices, 3 * sizeof(uint32_t) * mesh.triangle_count);
    memcpy(indices + 3 * mesh.triangle_count, mesh.indices, 3 * sizeof(uint32_t) * mesh.triangle_count);
    mesh.vertices = vertices;
    mesh.indices = indices;
    mesh.triangle_count *= 2;
    return mesh;
}

static inline void set_sphere(Subject *s, float x, float y, float z, float radius) {
    float *sphere = s->spheres[s->set.sphere_count++];
    sphere[0] = x, sphere[1] = y, sphere[2] = z, sphere[3] = radius;
}

static inline RtRay ray_of(float x, float y, float z, float dx, float dy, float dz) {
    RtRay ray = {{0}, 0, {0}, INFINITY};
    ray.origin[0] = x, ray.origin[1] = y, ray.origin[2] = z;
    ray.direction[0] = dx, ray.direction[1] = dy, ray.direction[2] = dz;
    return ray;
}

// Triangles 1000 times, 2^12 times, ... as long as wide, that share an edge in twos.
static inline RtMesh needles(void) {
    static float vertices[40][3];
    static uint32_t indices[20][3];
    for (uint32_t i = 0; i < 10; i++) {
        float x = (float)i / 3.0f, thin = ldexpf(1.1f, -3 * (int)i - 10);
        float corners[4][3] = {{x, 0, 0}, {x + 0.1f, 10, 0.3f}, {x + thin, 0, thin}, {x - thin, 0, thin}};
        memcpy(vertices[4 * i], corners, sizeof corners);
        uint32_t pair[2][3] = {{4 * i, 4 * i + 1, 4 * i + 2}, {4 * i, 4 * i + 1, 4 * i + 3}};
        memcpy(indices[2 * i], pair, sizeof pair);
    }
    RtMesh mesh = {0};
    mesh.vertices = &vertices[0][0];
    mesh.indices = &indices[0][0];
    mesh.vertex_count = 40;
    mesh.triangle_count = 20;
    return mesh;
}

// Ray `i` at a doubled raster with this step: through a vertex, an edge, a middle or a rounded point,
// from above or below, straight or slanted, with a direction as long as the step or of length one.
static inline RtRay raster_ray(uint32_t i, float step, float height) {
    float x = step * (float)(i % 5), y = step * (float)(i / 2 % 5);
    if (i % 4 == 1) x += step * 0.5f;
    if (i % 4 == 2) x += step * 0.5f, y += step * 0.25f;
    if (i % 4 == 3) x += step * 0.3f, y += step * 0.7f;
    float up = i % 8 < 4 ? 1.0f : -1.0f, length = i % 3 ? 1.0f : step;
    float slant = i % 7 < 3 ? 0.0f : (float)(i % 11) / 11.0f;
    return ray_of(x, y, up * height, slant * length, slant * 0.5f * length, -up * length);
}

static inline void make_subjects(Subject subjects[SCENES]) {
    static const float steps[SCENES] = {1, 0x1p-140f, 0x1p124f, 1.0f / 3.0f, 1};
    memset(subjects, 0, SCENES * sizeof *subjects);
    for (int k = 0; k < SCENES; k++) {
        Subject *s = &subjects[k];
        float step = steps[k];
        s->meshes[0] = k == 0 ? sheet(12) : k == 4 ? needles() : doubled_raster(4, step, 0);
        s->meshes[1] = k == 0 || k == 4 ? doubled_raster(3, 3e-40f, 2) : doubled_raster(4, step, step);
        s->meshes[2] = doubled_raster(2, step * 2, step * 2);
        // Around vertices, touching each other and the rasters; one is never hit.
        set_sphere(s, step, step, step, step);
        set_sphere(s, step * 3, step, step, step);
        set_sphere(s, step, step, step, step);
        set_sphere(s, step * 2, step * 2, step * 2.5f, step * 0.7f);
        set_sphere(s, step, step * 3, step, step * 1e-3f);
        set_sphere(s, step, step * 3, step, -step);
        for (uint32_t i = 0; i < RAYS; i++) {
            s->rays[i] = k == 0 && i % 2 ? ray_over(12, i) : raster_ray(i, step, step * 4);
            if (i % 6 == 5) s->rays[i].t_max = 3, s->rays[i].t_min = -2;
        }
        // Onto the subnormal raster, along a needle, and from a vertex.
        s->rays[0] = ray_of(1.5e-40f, 3e-40f, 30, 0, 0, -1);
        s->rays[1] = ray_of(0, 0, 5, 0.01f, 1, -0.5f);
        s->rays[2] = ray_of(step, step, 0, 0.1f, -0.2f, 0.3f);
    }
    for (int k = 0; k < SCENES; k++) {
        Subject *s = &subjects[k];
        s->set.spheres = &s->spheres[0][0];
        s->scene = scene_of(s->meshes, MESHES, &s->set, 1);
    }
}

#endif
