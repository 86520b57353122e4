// Instances, masks and closest points against Embree 3: the same sheet at the same places.
//
// Answers may differ where Embree rounds: in `t` by a little, and for a few rays that pass an edge in what is met.

#include "check.h"

#include <embree3/rtcore.h>
#include <math.h>

#define SIZE 12
#define COUNT 24
#define RAYS 6000
#define POINTS 1000

static RtMesh mesh;
static float maps[COUNT][12];

// Turned, mirrored and stretched, but not flattened.
static void place(uint32_t i) {
    float x = (float)(i % 5) * 9.0f, y = (float)(i / 5) * 9.0f, s = 0.5f + (float)(i % 7) / 8.0f;
    float map[12] = {s, 0.25f, 0, x, -0.25f, i % 2 ? -1.0f : 1.0f, 0.5f, y, 0, 0, 1.5f, (float)i / 4};
    memcpy(maps[i], map, sizeof map);
}

static uint32_t mask_of(uint32_t i) { return 1u << i % 3; }

static RTCScene embree_scene(RTCDevice device) {
    RTCGeometry sheet = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    size_t vertices = 12u * (size_t)mesh.vertex_count, indices = 12u * (size_t)mesh.triangle_count;
    memcpy(rtcSetNewGeometryBuffer(sheet, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, mesh.vertex_count),
           mesh.vertices, vertices);
    memcpy(rtcSetNewGeometryBuffer(sheet, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, mesh.triangle_count),
           mesh.indices, indices);
    rtcSetGeometryMask(sheet, ~0u);
    rtcCommitGeometry(sheet);
    RTCScene child = rtcNewScene(device), top = rtcNewScene(device);
    rtcAttachGeometry(child, sheet);
    rtcSetSceneFlags(child, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneFlags(top, RTC_SCENE_FLAG_ROBUST);
    rtcCommitScene(child);
    for (uint32_t i = 0; i < COUNT; i++) {
        RTCGeometry instance = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
        rtcSetGeometryInstancedScene(instance, child);
        rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, maps[i]);
        rtcSetGeometryMask(instance, mask_of(i));
        rtcCommitGeometry(instance);
        rtcAttachGeometryByID(top, instance, i);
        rtcReleaseGeometry(instance);
    }
    rtcCommitScene(top);
    CHECK(rtcGetDeviceError(device) == RTC_ERROR_NONE);
    return top;
}

static RtHit embree_hit(RTCScene scene, const RtRay *ray, uint32_t mask) {
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    struct RTCRayHit q = {0};
    q.ray.org_x = ray->origin[0], q.ray.org_y = ray->origin[1], q.ray.org_z = ray->origin[2];
    q.ray.dir_x = ray->direction[0], q.ray.dir_y = ray->direction[1], q.ray.dir_z = ray->direction[2];
    q.ray.tnear = ray->t_min;
    q.ray.tfar = ray->t_max;
    q.ray.mask = mask;
    q.hit.geomID = q.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene, &context, &q);
    RtHit miss = {INFINITY, 0, 0, RT_NONE, RT_NONE, RT_NONE};
    RtHit hit = {q.ray.tfar, q.hit.u, q.hit.v, q.hit.primID, q.hit.geomID, q.hit.instID[0]};
    return q.hit.geomID == RTC_INVALID_GEOMETRY_ID ? miss : hit;
}

static void compare_rays(const RtAccel *accel, RTCScene scene, uint32_t mask) {
    uint32_t met = 0, other = 0;
    RtQuery query;
    memset(&query, 0, sizeof query);
    query.struct_size = sizeof query;
    query.mask = mask;
    for (uint32_t i = 0; i < RAYS; i++) {
        RtRay ray = ray_over(45, i);
        ray.origin[2] *= 8.0f;
        RtHit ours, theirs = embree_hit(scene, &ray, mask ? mask : ~0u);
        bool found = rt_intersect_with(accel, &ray, &query, &ours);
        met += found;
        bool same = ours.prim == theirs.prim && ours.instance == theirs.instance;
        bool near = !found || fabsf(ours.t - theirs.t) <= 1e-4f * ours.t;
        CHECK(found == (theirs.geometry != RT_NONE) || other < RAYS / 500);
        other += !(same && near);
        if (found) CHECK(mask == 0 || mask_of(ours.instance) & mask);
    }
    printf("mask %u: %u hits, %u of them others\n", mask, met, other);
    CHECK(met > RAYS / 20 && other < RAYS / 500);
}

static void sub(const double *a, const double *b, double *c) {
    for (int k = 0; k < 3; k++) c[k] = a[k] - b[k];
}

static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static double clamped(double x) { return x < 0 ? 0 : x > 1 ? 1 : x; }

static double square_to_edge(const double *p, const double *a, const double *b) {
    double edge[3], to[3], off[3];
    sub(b, a, edge);
    sub(p, a, to);
    double along = clamped(dot(to, edge) / dot(edge, edge));
    for (int k = 0; k < 3; k++) off[k] = to[k] - along * edge[k];
    return dot(off, off);
}

static double square_to_triangle(const double *p, double v[3][3]) {
    double least = INFINITY, e[3], f[3], to[3];
    for (int k = 0; k < 3; k++) {
        double square = square_to_edge(p, v[k], v[(k + 1) % 3]);
        if (square < least) least = square;
    }
    sub(v[1], v[0], e);
    sub(v[2], v[0], f);
    sub(p, v[0], to);
    double ee = dot(e, e), ef = dot(e, f), ff = dot(f, f), pe = dot(to, e), pf = dot(to, f);
    double det = ee * ff - ef * ef, s = (ff * pe - ef * pf) / det, t = (ee * pf - ef * pe) / det;
    if (s < 0 || t < 0 || s + t > 1) return least;
    for (int k = 0; k < 3; k++) to[k] -= s * e[k] + t * f[k];
    return dot(to, to) < least ? dot(to, to) : least;
}

typedef struct { double point[3], least; uint32_t calls; } Closest;

// Called for each triangle of each instance that may be close enough; distances are those in the world.
static bool closer(struct RTCPointQueryFunctionArguments *args) {
    Closest *closest = args->userPtr;
    closest->calls++;
    const float *map = maps[args->context->instID[args->context->instStackSize - 1]];
    double v[3][3];
    for (int i = 0; i < 3; i++) {
        const float *p = mesh.vertices + 3 * mesh.indices[3 * args->primID + (uint32_t)i];
        for (int k = 0; k < 3; k++)
            v[i][k] = (double)map[4 * k] * p[0] + (double)map[4 * k + 1] * p[1] + (double)map[4 * k + 2] * p[2] +
                      map[4 * k + 3];
    }
    double distance = sqrt(square_to_triangle(closest->point, v));
    if (distance >= closest->least) return false;
    closest->least = distance;
    // Maps here are no similarities: the query is one of the world.
    args->query->radius = (float)(distance * 1.0001);
    return true;
}

static void compare_points(const RtAccel *accel, RTCScene scene) {
    uint32_t found = 0;
    for (uint32_t i = 0; i < POINTS; i++) {
        RtRay ray = ray_over(45, i);
        float radius = i % 3 == 0 ? 2.0f : INFINITY;
        Closest closest = {{ray.origin[0], ray.origin[1], ray.origin[2]}, INFINITY, 0};
        struct RTCPointQuery query = {ray.origin[0], ray.origin[1], ray.origin[2], 0, radius};
        struct RTCPointQueryContext context;
        rtcInitPointQueryContext(&context);
        rtcPointQuery(scene, &query, &context, closer, &closest);
        RtPointHit hit;
        bool any = rt_closest_point(accel, ray.origin, radius, NULL, &hit);
        CHECK(any == (closest.least <= (double)radius));
        if (!any) continue;
        found++;
        CHECK(fabs((double)hit.distance - closest.least) <= 1e-6 * closest.least + 1e-6);
    }
    printf("%u closest points\n", found);
    CHECK(found > POINTS / 2 && found < POINTS);
}

int main(void) {
    mesh = sheet(SIZE);
    for (uint32_t i = 0; i < COUNT; i++) place(i);
    RTCDevice device = rtcNewDevice("threads=1");
    CHECK(device != NULL);
    RTCScene theirs = embree_scene(device);
    bool masks = rtcGetDeviceProperty(device, RTC_DEVICE_PROPERTY_RAY_MASK_SUPPORTED) != 0;
    if (!masks) printf("this Embree has no masks\n");
    RtScene child_scene = scene_of(&mesh, 1, NULL, 0), scene = scene_of(NULL, 0, NULL, 0);
    RtInstance instances[COUNT];
    scene.instances = instances;
    scene.instance_count = COUNT;
    for (int way = 0; way < 4; way++) {
        const RtAccel *child = built(&child_scene, way & 1, NULL);
        for (uint32_t i = 0; i < COUNT; i++) {
            RtInstance instance = {child, {0}, mask_of(i), 0};
            memcpy(instance.object_to_world, maps[i], sizeof maps[i]);
            instances[i] = instance;
        }
        const RtAccel *ours = built(&scene, way >> 1, NULL);
        compare_rays(ours, theirs, 0);
        for (uint32_t mask = 1; masks && mask < 8; mask += 2) compare_rays(ours, theirs, mask);
        compare_points(ours, theirs);
    }
    rtcReleaseScene(theirs);
    rtcReleaseDevice(device);
    return 0;
}
