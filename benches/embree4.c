/* See embree4.h. */
#define _GNU_SOURCE
#include "embree4.h"

#include <dlfcn.h>
#include <embree3/rtcore.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <xmmintrin.h>

/* Embree 4 writes an instance's number more behind the hit of Embree 3. */
typedef union {
    struct RTCRayHit q;
    struct RTCRay ray;
    _Alignas(64) unsigned char room[128];
} Query;

typedef RTCDevice NewDevice(const char *);
typedef void ReleaseDevice(RTCDevice);
typedef enum RTCError GetError(RTCDevice);
typedef void SetMemoryMonitor(RTCDevice, RTCMemoryMonitorFunction, void *);
typedef RTCScene NewScene(RTCDevice);
typedef void SetSceneQuality(RTCScene, enum RTCBuildQuality);
typedef void SetSceneFlags(RTCScene, enum RTCSceneFlags);
typedef RTCGeometry NewGeometry(RTCDevice, enum RTCGeometryType);
typedef void *NewBuffer(RTCGeometry, enum RTCBufferType, unsigned, enum RTCFormat, size_t, size_t);
typedef void SetGeometryQuality(RTCGeometry, enum RTCBuildQuality);
typedef void GeometryCall(RTCGeometry);
typedef unsigned Attach(RTCScene, RTCGeometry);
typedef void SceneCall(RTCScene);
typedef void Intersect(RTCScene, struct RTCRayHit *, void *arguments);
typedef void Occluded(RTCScene, struct RTCRay *, void *arguments);

struct BenchEmbree4 {
    void *library;
    RTCDevice device;
    RTCScene scene;
    enum RTCBuildQuality quality;
    size_t bytes;
    ReleaseDevice *release_device;
    GetError *get_error;
    NewGeometry *new_geometry;
    NewBuffer *new_buffer;
    SetGeometryQuality *set_geometry_quality;
    GeometryCall *commit_geometry, *release_geometry;
    Attach *attach;
    SceneCall *commit_scene, *release_scene;
    Intersect *intersect;
    Occluded *occluded;
};

static bool on_memory(void *user, ssize_t bytes, bool post)
{
    (void)post;
    *(size_t *)user += (size_t)bytes;
    return true;
}

/* Pointers to functions are had from dlsym by way of their bytes: C has no conversion. */
static bool find(void *library, const char *name, void *to)
{
    void *found = dlsym(library, name);
    memcpy(to, &found, sizeof found);
    return found != NULL;
}

static bool find_all(BenchEmbree4 *e)
{
    void *l = e->library;
    return find(l, "rtcReleaseDevice", &e->release_device) &&
           find(l, "rtcGetDeviceError", &e->get_error) &&
           find(l, "rtcNewGeometry", &e->new_geometry) &&
           find(l, "rtcSetNewGeometryBuffer", &e->new_buffer) &&
           find(l, "rtcSetGeometryBuildQuality", &e->set_geometry_quality) &&
           find(l, "rtcCommitGeometry", &e->commit_geometry) &&
           find(l, "rtcReleaseGeometry", &e->release_geometry) &&
           find(l, "rtcAttachGeometry", &e->attach) &&
           find(l, "rtcCommitScene", &e->commit_scene) &&
           find(l, "rtcReleaseScene", &e->release_scene) &&
           find(l, "rtcIntersect1", &e->intersect) && find(l, "rtcOccluded1", &e->occluded);
}

BenchEmbree4 *bench_embree4_new(const char *path, int quality, int flags)
{
    NewDevice *new_device;
    SetMemoryMonitor *set_memory_monitor;
    NewScene *new_scene;
    SetSceneQuality *set_scene_quality;
    SetSceneFlags *set_scene_flags;
    BenchEmbree4 *e = calloc(1, sizeof *e);
    if (!e) return NULL;
    /* Bound deeply: its names are also those of Embree 3, which is linked. */
    e->library = dlopen(path, RTLD_NOW | RTLD_LOCAL | RTLD_DEEPBIND);
    if (!e->library || !find_all(e) || !find(e->library, "rtcNewDevice", &new_device) ||
        !find(e->library, "rtcSetDeviceMemoryMonitorFunction", &set_memory_monitor) ||
        !find(e->library, "rtcNewScene", &new_scene) ||
        !find(e->library, "rtcSetSceneBuildQuality", &set_scene_quality) ||
        !find(e->library, "rtcSetSceneFlags", &set_scene_flags) ||
        !(e->device = new_device("threads=1,start_threads=0"))) {
        free(e);
        return NULL;
    }
    set_memory_monitor(e->device, on_memory, &e->bytes);
    e->quality = (enum RTCBuildQuality)quality;
    e->scene = new_scene(e->device);
    set_scene_quality(e->scene, e->quality);
    set_scene_flags(e->scene, (enum RTCSceneFlags)flags);
    return e;
}

static int attach(BenchEmbree4 *e, RTCGeometry geometry)
{
    e->set_geometry_quality(geometry, e->quality);
    e->commit_geometry(geometry);
    e->attach(e->scene, geometry);
    e->release_geometry(geometry);
    return e->get_error(e->device) != RTC_ERROR_NONE;
}

int bench_embree4_mesh(BenchEmbree4 *e, const float *vertices, size_t vertex_count,
                       const uint32_t *indices, size_t triangle_count)
{
    RTCGeometry mesh = e->new_geometry(e->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    void *v = e->new_buffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, vertex_count);
    void *i = e->new_buffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, triangle_count);
    if (vertex_count) memcpy(v, vertices, 12 * vertex_count);
    if (triangle_count) memcpy(i, indices, 12 * triangle_count);
    return attach(e, mesh);
}

int bench_embree4_spheres(BenchEmbree4 *e, const float *spheres, size_t count)
{
    RTCGeometry set = e->new_geometry(e->device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
    void *v = e->new_buffer(set, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 16, count);
    if (count) memcpy(v, spheres, 16 * count);
    return attach(e, set);
}

int bench_embree4_commit(BenchEmbree4 *e)
{
    e->commit_scene(e->scene);
    return e->get_error(e->device) != RTC_ERROR_NONE;
}

size_t bench_embree4_bytes(const BenchEmbree4 *e) { return e->bytes; }

void bench_embree4_free(BenchEmbree4 *e)
{
    if (!e) return;
    e->release_scene(e->scene);
    e->release_device(e->device);
    /* The library stays: its threads may still be on their way out. */
    free(e);
}

static void fill(struct RTCRay *to, const BenchRay *from)
{
    *to = (struct RTCRay){.org_x = from->origin[0],
                          .org_y = from->origin[1],
                          .org_z = from->origin[2],
                          .tnear = from->t_min,
                          .dir_x = from->direction[0],
                          .dir_y = from->direction[1],
                          .dir_z = from->direction[2],
                          .tfar = from->t_max,
                          .mask = ~0u};
}

void bench_embree4_closest(BenchEmbree4 *e, const BenchRay *rays, BenchHit *hits, size_t count)
{
    unsigned before = _mm_getcsr();
    _mm_setcsr(before | 0x8040u);
    for (size_t i = 0; i < count; i++) {
        Query query;
        fill(&query.ray, &rays[i]);
        struct RTCHit *met = &query.q.hit;
        met->geomID = met->primID = met->instID[0] = RTC_INVALID_GEOMETRY_ID;
        e->intersect(e->scene, &query.q, NULL);
        hits[i] = (BenchHit){INFINITY, 0, 0, ~0u, ~0u, ~0u};
        if (met->geomID != RTC_INVALID_GEOMETRY_ID) {
            float t = query.ray.tfar;
            hits[i] = (BenchHit){t, met->u, met->v, met->primID, met->geomID, met->instID[0]};
        }
    }
    _mm_setcsr(before);
}

void bench_embree4_any(BenchEmbree4 *e, const BenchRay *rays, uint8_t *occluded, size_t count)
{
    unsigned before = _mm_getcsr();
    _mm_setcsr(before | 0x8040u);
    for (size_t i = 0; i < count; i++) {
        Query query;
        fill(&query.ray, &rays[i]);
        e->occluded(e->scene, &query.ray, NULL);
        occluded[i] = query.ray.tfar < 0;
    }
    _mm_setcsr(before);
}
