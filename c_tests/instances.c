// Instances from C: hits, batches, masks, skip, surface, every structure over every other, a rebuild of the top, and packing.

#include "check.h"

#define SIZE 12
#define COUNT 9

#define RAYS 2000

static RtHit hits[RAYS];

// Instance `i` of a sheet, turned, mirrored and stretched.
static RtInstance placed(const RtAccel *child, uint32_t i) {
    float x = (float)(i % 3) * 14.0f, y = (float)(i / 3) * 14.0f, s = 0.5f + (float)i / 8.0f;
    RtInstance instance = {child, {s, 0.25f, 0, x, -0.25f, i % 2 ? -1.0f : 1.0f, 0.5f, y, 0, 0, 1.5f, (float)i / 4}, 0, 0};
    return instance;
}

static RtRay ray_at(uint32_t i) {
    RtRay ray = ray_over(40, i);
    ray.origin[2] *= 8.0f;
    return ray;
}

// Batches give the bits of single calls.
static void ask_together(const RtAccel *top) {
    static RtRay rays[RAYS];
    static RtHit together[RAYS];
    static uint8_t occluded[RAYS];
    for (uint32_t i = 0; i < RAYS; i++) rays[i] = ray_at(i);
    rt_intersect_batch(top, rays, together, RAYS);
    rt_occluded_batch(top, rays, occluded, RAYS);
    CHECK(memcmp(together, hits, sizeof hits) == 0);
    for (uint32_t i = 0; i < RAYS; i++) CHECK(occluded[i] == (hits[i].prim != RT_NONE));
}

int main(void) {
    RtMesh mesh = sheet(SIZE);
    float ball[4] = {6, 6, 3, 2};
    RtSphereSet set;
    memset(&set, 0, sizeof set);
    set.spheres = ball;
    set.sphere_count = 1;
    RtScene child_scene = scene_of(&mesh, 1, &set, 1);
    RtMesh floor_mesh = sheet(3);
    RtScene scene = scene_of(&floor_mesh, 1, NULL, 0);
    RtInstance instances[COUNT];
    scene.instances = instances;
    scene.instance_count = COUNT;

    uint32_t met = 0;
    const RtAccel *top = NULL;
    for (int way = 0; way < 4; way++) {
        const RtAccel *child = built(&child_scene, way & 1, NULL);
        for (uint32_t i = 0; i < COUNT; i++) instances[i] = placed(child, i);
        top = built(&scene, way >> 1, NULL);
        RtInfo info;
        memset(&info, 0, sizeof info);
        info.struct_size = sizeof info;
        CHECK(rt_accel_info(top, &info) == RT_OK && info.instance_count == COUNT);
        for (uint32_t i = 0; i < RAYS; i++) {
            RtRay ray = ray_at(i);
            RtHit hit;
            bool found = rt_intersect(top, &ray, &hit);
            CHECK(found == rt_occluded(top, &ray));
            if (way == 0) hits[i] = hit;
            CHECK(memcmp(&hit, &hits[i], sizeof hit) == 0);
            if (!found || hit.instance == RT_NONE) continue;
            met++;
            CHECK(hit.instance < COUNT && hit.geometry < 2);
            RtSurface surface;
            memset(&surface, 0, sizeof surface);
            surface.struct_size = sizeof surface;
            CHECK(rt_hit_surface(top, &ray, &hit, &surface) == RT_OK);
            for (int k = 0; k < 3; k++) {
                float off = ray.origin[k] + hit.t * ray.direction[k] - surface.position[k];
                CHECK(off < 1e-3f && off > -1e-3f);
            }
            RtQuery query;
            memset(&query, 0, sizeof query);
            query.struct_size = sizeof query;
            query.skip = 1;
            query.skip_prim = hit.prim;
            query.skip_geometry = hit.geometry;
            query.skip_instance = hit.instance;
            RtHit other;
            if (rt_intersect_with(top, &ray, &query, &other)) CHECK(other.t >= hit.t);
            CHECK(memcmp(&other, &hit, sizeof hit) != 0);
        }
        ask_together(top);
    }
    CHECK(met > RAYS);

    // Masks, and the top level once more in the same memory.
    for (uint32_t i = 0; i < COUNT; i++) instances[i].mask = 1u << i;
    RtMemory need;
    CHECK(rt_bvh_needs(&scene, NULL, &need) == RT_OK);
    void *memory = aligned(need.size);
    CHECK(rt_build_bvh(&scene, NULL, memory, need.size, &top) == RT_OK);
    RtQuery query;
    memset(&query, 0, sizeof query);
    query.struct_size = sizeof query;
    query.mask = 1 << 4;
    for (uint32_t i = 0; i < RAYS; i++) {
        RtRay ray = ray_at(i);
        RtHit hit;
        if (rt_intersect_with(top, &ray, &query, &hit))
            CHECK(hit.instance == 4 || hit.instance == RT_NONE);
    }

    // Packed: one block with one child, which answers as before wherever it is.
    CHECK(rt_accel_pack_needs(top, &need) == RT_OK);
    CHECK(need.size == rt_accel_size(top) + rt_accel_size(instances[0].accel));
    unsigned char *packed = aligned(need.size), *copy = aligned(need.size);
    const RtAccel *accel = NULL, *opened = NULL;
    CHECK(rt_accel_pack(top, packed, need.size - 1, &accel) == RT_ERROR_OUT_OF_MEMORY && !accel);
    CHECK(rt_accel_pack(top, packed, need.size, &accel) == RT_OK);
    CHECK(rt_accel_size(accel) == need.size);
    memcpy(copy, packed, need.size);
    memset(packed, 0, need.size);
    CHECK(rt_accel_open(copy, need.size, &opened) == RT_OK);
    for (uint32_t i = 0; i < RAYS; i++) {
        RtRay ray = ray_at(i);
        RtHit hit;
        rt_intersect(opened, &ray, &hit);
        CHECK(memcmp(&hit, &hits[i], sizeof hit) == 0);
    }
    ask_together(opened);
    return 0;
}
