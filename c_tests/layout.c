// Strides, indexed and plain meshes, several geometries, masks, facing, skipping, ids, batches.

#include "check.h"

static RtHit hit_from(const RtAccel *accel, float x, float y, float z, float dz, const RtQuery *query) {
    RtRay ray = {{x, y, z}, 0, {0, 0, dz}, 1e30f};
    RtHit hit;
    bool found = rt_intersect_with(accel, &ray, query, &hit);
    CHECK(found == (hit.prim != RT_NONE) && found == rt_occluded_with(accel, &ray, query));
    if (!found) CHECK(hit.t > 3e38f && hit.geometry == RT_NONE && hit.u == 0 && hit.v == 0);
    return hit;
}

static void check(bool grid, uint32_t plain_list) {
    // Interleaved with a word that must not be read as a coordinate.
    float loose[12] = {0, 0, 0, 9, 1, 0, 0, 9, 0, 1, 0, 9};
    uint32_t indices[8] = {0, 1, 2, 77, 0, 1, 2, 77};
    float plain[9] = {0, 0, 1, 1, 0, 1, 0, 1, 1};
    float spheres[10] = {5, 5, 0, 1, 8, 10, 10, 0, 1, 8};
    RtMesh meshes[3] = {{0}};
    meshes[0].vertices = loose;
    meshes[0].indices = indices;
    meshes[0].vertex_count = 3;
    meshes[0].triangle_count = 2;
    meshes[0].vertex_stride = 16;
    meshes[0].index_stride = 16;
    meshes[0].mask = 1;
    meshes[2].vertices = plain;
    meshes[2].vertex_count = 3;
    meshes[2].triangle_count = 1;
    meshes[2].mask = 2;
    RtSphereSet sets[2] = {{0}};
    sets[1].spheres = spheres;
    sets[1].sphere_count = 2;
    sets[1].sphere_stride = 20;
    RtScene scene = scene_of(meshes, 3, sets, 2);
    RtBuildOptions options = {0};
    options.struct_size = sizeof options;
    options.plain_list = plain_list;
    const RtAccel *accel = built(&scene, grid, &options);

    RtInfo info = {0};
    info.struct_size = sizeof info;
    CHECK(rt_accel_info(accel, &info) == RT_OK && info.struct_size == sizeof info);
    CHECK(info.triangle_count == 3 && info.sphere_count == 2 && info.ignored_count == 0);
    CHECK(info.size == rt_accel_size(accel));
    // Boxes of spheres are a rounding step larger than need be.
    CHECK(info.upper[0] >= 11 && info.upper[0] < 11.001f);
    CHECK(info.lower[2] <= -1 && info.lower[2] > -1.001f);
    uint32_t kind = grid ? RT_KIND_GRID : RT_KIND_BVH;
    CHECK(info.kind == (plain_list == RT_PLAIN_LIST_NEVER ? kind : RT_KIND_LIST));

    RtQuery query = {0};
    query.struct_size = sizeof query;
    RtHit hit = hit_from(accel, 0.25f, 0.5f, 3, -1, NULL);
    CHECK(hit.geometry == 2 && hit.prim == 0 && hit.t == 2 && hit.u == 0.25f && hit.v == 0.5f);
    CHECK(hit.instance == RT_NONE);
    query.mask = 1;
    hit = hit_from(accel, 0.25f, 0.5f, 3, -1, &query);
    CHECK(hit.geometry == 0 && hit.prim == 0 && hit.t == 3);
    query.skip = 1;
    query.skip_instance = RT_NONE;
    hit = hit_from(accel, 0.25f, 0.5f, 3, -1, &query);
    CHECK(hit.geometry == 0 && hit.prim == 1 && hit.t == 3);
    query.skip = 0;
    query.mask = 4;
    CHECK(hit_from(accel, 0.25f, 0.5f, 3, -1, &query).prim == RT_NONE);
    CHECK(hit_from(accel, 10, 10, 3, -1, &query).geometry == 4);
    query.mask = 0;
    query.facing = RT_FACING_BACK;
    CHECK(hit_from(accel, 0.25f, 0.5f, 3, -1, &query).prim == RT_NONE);
    CHECK(hit_from(accel, 0.25f, 0.5f, -3, 1, &query).geometry == 0);
    query.facing = RT_FACING_FRONT;
    CHECK(hit_from(accel, 0.25f, 0.5f, -3, 1, &query).prim == RT_NONE);
    hit = hit_from(accel, 10, 10, 3, -1, NULL);
    CHECK(hit.geometry == 4 && hit.prim == 1 && hit.t == 2);

    RtRay ray = {{5, 5, 3}, 0, {0, 0, -1}, 1e30f};
    CHECK(rt_intersect(accel, &ray, &hit));
    RtSurface surface = {0};
    surface.struct_size = sizeof surface;
    CHECK(rt_hit_surface(accel, &ray, &hit, &surface) == RT_OK);
    CHECK(surface.normal[2] == 1 && surface.front_origin[2] > 1 && surface.back_origin[2] < 1);

    // Rays and hits inside larger structs of the caller.
    struct { RtRay ray; float weight; } rays[3];
    struct { uint32_t before; RtHit hit; uint32_t after; } hits[3];
    uint8_t occluded[6];
    memset(hits, 0x55, sizeof hits);
    memset(occluded, 0x55, sizeof occluded);
    for (int i = 0; i < 3; i++) {
        rays[i].ray = ray;
        rays[i].ray.origin[0] = 5.0f * (float)i + 0.25f;
        rays[i].ray.origin[1] = 5.0f * (float)i + 0.25f;
    }
    rays[1].ray.origin[0] = 100;
    CHECK(rt_intersect_batch_with(accel, &rays[0].ray, sizeof rays[0], NULL, &hits[0].hit,
                                  sizeof hits[0], 3) == RT_OK);
    CHECK(hits[0].hit.geometry == 2 && hits[1].hit.prim == RT_NONE && hits[2].hit.prim == 1);
    for (int i = 0; i < 3; i++) CHECK(hits[i].before == 0x55555555 && hits[i].after == 0x55555555);
    CHECK(rt_occluded_batch_with(accel, &rays[0].ray, sizeof rays[0], NULL, occluded, 2, 3) == RT_OK);
    CHECK(occluded[0] == 1 && occluded[2] == 0 && occluded[4] == 1 && occluded[1] == 0x55);
    RtHit packed[2];
    RtRay two[2] = {rays[0].ray, rays[1].ray};
    rt_intersect_batch(accel, two, packed, 2);
    CHECK(memcmp(&packed[0], &hits[0].hit, sizeof(RtHit)) == 0);
    rt_occluded_batch(accel, two, occluded, 2);
    CHECK(occluded[0] == 1 && occluded[1] == 0);
}

int main(void) {
    for (uint32_t list = RT_PLAIN_LIST_AUTOMATIC; list <= RT_PLAIN_LIST_ALWAYS; list++) {
        check(false, list);
        check(true, list);
    }
    return 0;
}
