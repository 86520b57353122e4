/* See embree.h. */
#include "embree.h"

#include <embree3/rtcore.h>
#include <math.h>
#include <pmmintrin.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <xmmintrin.h>

/* A stream is handed over in parts that stay in the cache. */
#define STREAM 1024

struct BenchEmbree {
    RTCDevice device;
    RTCScene scene;
    enum RTCBuildQuality quality;
    size_t bytes;
};

static void on_error(void *user, enum RTCError code, const char *message)
{
    (void)user;
    fprintf(stderr, "Embree: error %d: %s\n", (int)code, message);
}

static bool on_memory(void *user, ssize_t bytes, bool post)
{
    (void)post;
    *(size_t *)user += (size_t)bytes;
    return true;
}

int bench_embree_version(void) { return RTC_VERSION; }

BenchEmbree *bench_embree_new(const char *config, int quality, int flags)
{
    BenchEmbree *e = calloc(1, sizeof *e);
    if (!e) return NULL;
    char settings[128];
    snprintf(settings, sizeof settings, "threads=1,start_threads=0%s%s", *config ? "," : "", config);
    e->device = rtcNewDevice(settings);
    if (!e->device) {
        free(e);
        return NULL;
    }
    rtcSetDeviceErrorFunction(e->device, on_error, NULL);
    rtcSetDeviceMemoryMonitorFunction(e->device, on_memory, &e->bytes);
    e->quality = quality == 0   ? RTC_BUILD_QUALITY_LOW
                 : quality == 1 ? RTC_BUILD_QUALITY_MEDIUM
                                : RTC_BUILD_QUALITY_HIGH;
    e->scene = rtcNewScene(e->device);
    rtcSetSceneBuildQuality(e->scene, e->quality);
    rtcSetSceneFlags(e->scene, (enum RTCSceneFlags)flags);
    return e;
}

int bench_embree_mesh(BenchEmbree *e, const float *vertices, size_t vertex_count,
                      const uint32_t *indices, size_t triangle_count)
{
    RTCGeometry mesh = rtcNewGeometry(e->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    void *v = rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12,
                                      vertex_count);
    void *i = rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12,
                                      triangle_count);
    if (vertex_count) memcpy(v, vertices, 12 * vertex_count);
    if (triangle_count) memcpy(i, indices, 12 * triangle_count);
    rtcSetGeometryBuildQuality(mesh, e->quality);
    rtcCommitGeometry(mesh);
    rtcAttachGeometry(e->scene, mesh);
    rtcReleaseGeometry(mesh);
    return rtcGetDeviceError(e->device) != RTC_ERROR_NONE;
}

int bench_embree_spheres(BenchEmbree *e, const float *spheres, size_t count)
{
    RTCGeometry set = rtcNewGeometry(e->device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
    void *v = rtcSetNewGeometryBuffer(set, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4, 16, count);
    if (count) memcpy(v, spheres, 16 * count);
    rtcSetGeometryBuildQuality(set, e->quality);
    rtcCommitGeometry(set);
    rtcAttachGeometry(e->scene, set);
    rtcReleaseGeometry(set);
    return rtcGetDeviceError(e->device) != RTC_ERROR_NONE;
}

void bench_embree_moving(BenchEmbree *e, int refit)
{
    e->quality = refit ? RTC_BUILD_QUALITY_REFIT : RTC_BUILD_QUALITY_LOW;
    rtcSetSceneFlags(e->scene, RTC_SCENE_FLAG_DYNAMIC);
}

void bench_embree_move(BenchEmbree *e, const float *vertices, size_t vertex_count)
{
    RTCGeometry mesh = rtcGetGeometry(e->scene, 0);
    memcpy(rtcGetGeometryBufferData(mesh, RTC_BUFFER_TYPE_VERTEX, 0), vertices, 12 * vertex_count);
    rtcUpdateGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0);
    rtcCommitGeometry(mesh);
}

int bench_embree_instance(BenchEmbree *e, const float *maps, size_t count)
{
    RTCScene top = rtcNewScene(e->device);
    rtcSetSceneBuildQuality(top, e->quality);
    rtcSetSceneFlags(top, rtcGetSceneFlags(e->scene));
    for (size_t i = 0; i < count; i++) {
        RTCGeometry instance = rtcNewGeometry(e->device, RTC_GEOMETRY_TYPE_INSTANCE);
        rtcSetGeometryInstancedScene(instance, e->scene);
        rtcAttachGeometryByID(top, instance, (unsigned)i);
        rtcReleaseGeometry(instance);
    }
    rtcReleaseScene(e->scene);
    e->scene = top;
    bench_embree_place(e, maps, count);
    return rtcGetDeviceError(e->device) != RTC_ERROR_NONE;
}

void bench_embree_place(BenchEmbree *e, const float *maps, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        RTCGeometry instance = rtcGetGeometry(e->scene, (unsigned)i);
        rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, maps + 12 * i);
        rtcCommitGeometry(instance);
    }
}

int bench_embree_commit(BenchEmbree *e)
{
    rtcCommitScene(e->scene);
    return rtcGetDeviceError(e->device) != RTC_ERROR_NONE;
}

size_t bench_embree_bytes(const BenchEmbree *e) { return e->bytes; }

void bench_embree_free(BenchEmbree *e)
{
    if (!e) return;
    rtcReleaseScene(e->scene);
    rtcReleaseDevice(e->device);
    free(e);
}

/* Flush-to-zero and denormals-are-zero on; what was. */
static unsigned enter(void)
{
    unsigned before = _mm_getcsr();
    _mm_setcsr(before | 0x8040u);
    return before;
}

static void fill_ray(struct RTCRay *to, const BenchRay *from)
{
    to->org_x = from->origin[0];
    to->org_y = from->origin[1];
    to->org_z = from->origin[2];
    to->tnear = from->t_min;
    to->dir_x = from->direction[0];
    to->dir_y = from->direction[1];
    to->dir_z = from->direction[2];
    to->tfar = from->t_max;
    to->time = 0;
    to->mask = ~0u;
    to->flags = 0;
}

static void fill(struct RTCRayHit *to, const BenchRay *from)
{
    fill_ray(&to->ray, from);
    to->hit.geomID = RTC_INVALID_GEOMETRY_ID;
    to->hit.primID = RTC_INVALID_GEOMETRY_ID;
    to->hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
}

static BenchHit hit(float t, float u, float v, unsigned prim, unsigned geometry, unsigned instance)
{
    BenchHit miss = {INFINITY, 0, 0, ~0u, ~0u, ~0u}, met = {t, u, v, prim, geometry, instance};
    return geometry == RTC_INVALID_GEOMETRY_ID ? miss : met;
}

void bench_embree_closest(BenchEmbree *e, const BenchRay *rays, BenchHit *hits, size_t count)
{
    unsigned before = enter();
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (size_t i = 0; i < count; i++) {
        struct RTCRayHit q;
        fill(&q, &rays[i]);
        rtcIntersect1(e->scene, &context, &q);
        hits[i] = hit(q.ray.tfar, q.hit.u, q.hit.v, q.hit.primID, q.hit.geomID, q.hit.instID[0]);
    }
    _mm_setcsr(before);
}

/* A triangle scene as a point query sees it, and what was found. */
typedef struct {
    RTCScene scene;
    unsigned prim, geometry;
} PointSearch;

typedef struct { float x, y, z; } Vec;

static Vec from_to(Vec a, Vec b) { return (Vec){b.x - a.x, b.y - a.y, b.z - a.z}; }
static float dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static Vec along(Vec a, float t, Vec d) { return (Vec){a.x + t * d.x, a.y + t * d.y, a.z + t * d.z}; }

/* By which corner, edge or face is closest: Ericson, Real-Time Collision Detection, 5.1.5, as in Embree's tutorial. */
static Vec closest_on_triangle(Vec p, Vec a, Vec b, Vec c)
{
    Vec ab = from_to(a, b), ac = from_to(a, c), ap = from_to(a, p);
    float d1 = dot(ab, ap), d2 = dot(ac, ap);
    if (d1 <= 0 && d2 <= 0) return a;
    Vec bp = from_to(b, p);
    float d3 = dot(ab, bp), d4 = dot(ac, bp);
    if (d3 >= 0 && d4 <= d3) return b;
    Vec cp = from_to(c, p);
    float d5 = dot(ab, cp), d6 = dot(ac, cp);
    if (d6 >= 0 && d5 <= d6) return c;
    float vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return along(a, d1 / (d1 - d3), ab);
    float vb = d5 * d2 - d1 * d6;
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return along(a, d2 / (d2 - d6), ac);
    float va = d3 * d6 - d5 * d4;
    if (va <= 0 && d4 >= d3 && d5 >= d6)
        return along(b, (d4 - d3) / (d4 - d3 + (d5 - d6)), from_to(b, c));
    float sum = va + vb + vc;
    return along(along(a, vb / sum, ab), vc / sum, ac);
}

static bool consider(struct RTCPointQueryFunctionArguments *args)
{
    PointSearch *search = args->userPtr;
    RTCGeometry mesh = rtcGetGeometry(search->scene, args->geomID);
    const Vec *vertices = rtcGetGeometryBufferData(mesh, RTC_BUFFER_TYPE_VERTEX, 0);
    const uint32_t *corner = rtcGetGeometryBufferData(mesh, RTC_BUFFER_TYPE_INDEX, 0);
    corner += 3 * (size_t)args->primID;
    Vec p = {args->query->x, args->query->y, args->query->z};
    Vec a = vertices[corner[0]], b = vertices[corner[1]], c = vertices[corner[2]];
    Vec away = from_to(p, closest_on_triangle(p, a, b, c));
    float distance = sqrtf(dot(away, away));
    if (!(distance < args->query->radius)) return false;
    args->query->radius = distance;
    search->prim = args->primID;
    search->geometry = args->geomID;
    return true;
}

void bench_embree_points(BenchEmbree *e, const float *points, BenchHit *found, size_t count)
{
    unsigned before = enter();
    for (size_t i = 0; i < count; i++) {
        const float *p = points + 3 * i;
        struct RTCPointQuery query = {p[0], p[1], p[2], 0, INFINITY};
        struct RTCPointQueryContext context;
        rtcInitPointQueryContext(&context);
        PointSearch search = {e->scene, ~0u, RTC_INVALID_GEOMETRY_ID};
        rtcPointQuery(e->scene, &query, &context, consider, &search);
        found[i] = hit(query.radius, 0, 0, search.prim, search.geometry, ~0u);
    }
    _mm_setcsr(before);
}

void bench_embree_any(BenchEmbree *e, const BenchRay *rays, uint8_t *occluded, size_t count)
{
    unsigned before = enter();
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (size_t i = 0; i < count; i++) {
        struct RTCRay q;
        fill_ray(&q, &rays[i]);
        rtcOccluded1(e->scene, &context, &q);
        occluded[i] = q.tfar < 0;
    }
    _mm_setcsr(before);
}

struct BenchBatch {
    size_t count, stride;
    int width, any;
    unsigned char *memory; /* packets, or the rays of a stream */
};

/* Both packet types and both kinds of query, which differ only in their names. */
#define PACKET(N)                                                                                  \
    static void fill_ray_##N(struct RTCRay##N *to, int lane, const BenchRay *from)                 \
    {                                                                                              \
        to->org_x[lane] = from->origin[0];                                                         \
        to->org_y[lane] = from->origin[1];                                                         \
        to->org_z[lane] = from->origin[2];                                                         \
        to->tnear[lane] = from->t_min;                                                             \
        to->dir_x[lane] = from->direction[0];                                                      \
        to->dir_y[lane] = from->direction[1];                                                      \
        to->dir_z[lane] = from->direction[2];                                                      \
        to->tfar[lane] = from->t_max;                                                              \
        to->time[lane] = 0;                                                                        \
        to->mask[lane] = ~0u;                                                                      \
        to->flags[lane] = 0;                                                                       \
    }                                                                                              \
    static void fill_##N(unsigned char *packet, int any, int lane, const BenchRay *from)           \
    {                                                                                              \
        struct RTCRayHit##N *q = (struct RTCRayHit##N *)packet;                                    \
        fill_ray_##N(&q->ray, lane, from);                                                         \
        if (any) return;                                                                           \
        q->hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;                                             \
        q->hit.primID[lane] = RTC_INVALID_GEOMETRY_ID;                                             \
        q->hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;                                          \
    }                                                                                              \
    static BenchHit hit_##N(const unsigned char *packet, int lane)                                 \
    {                                                                                              \
        const struct RTCRayHit##N *q = (const struct RTCRayHit##N *)packet;                        \
        return hit(q->ray.tfar[lane], q->hit.u[lane], q->hit.v[lane], q->hit.primID[lane],         \
                   q->hit.geomID[lane], q->hit.instID[0][lane]);                                   \
    }                                                                                              \
    static void run_##N(RTCScene scene, struct RTCIntersectContext *context, const BenchBatch *b)  \
    {                                                                                              \
        _Alignas(64) int valid[N];                                                                 \
        for (size_t first = 0; first < b->count; first += N) {                                     \
            unsigned char *packet = b->memory + first / N * b->stride;                             \
            for (size_t i = 0; i < N; i++) valid[i] = first + i < b->count ? -1 : 0;               \
            if (b->any) rtcOccluded##N(valid, scene, context, (struct RTCRay##N *)packet);         \
            else rtcIntersect##N(valid, scene, context, (struct RTCRayHit##N *)packet);            \
        }                                                                                          \
    }

PACKET(8)
PACKET(16)

static size_t stride_of(int width, int any)
{
    if (width == 8) return any ? sizeof(struct RTCRay8) : sizeof(struct RTCRayHit8);
    if (width == 16) return any ? sizeof(struct RTCRay16) : sizeof(struct RTCRayHit16);
    return any ? sizeof(struct RTCRay) : sizeof(struct RTCRayHit);
}

BenchBatch *bench_batch_new(const BenchRay *rays, size_t count, int width, int any)
{
    BenchBatch *b = malloc(sizeof *b);
    if (!b) return NULL;
    size_t stride = stride_of(width, any), parts = (count + (size_t)width - 1) / (size_t)width;
    size_t size = (stride * parts + 64) / 64 * 64;
    *b = (BenchBatch){count, stride, width, any, aligned_alloc(64, size)};
    if (!b->memory) {
        free(b);
        return NULL;
    }
    memset(b->memory, 0, size);
    for (size_t i = 0; i < count; i++) {
        unsigned char *at = b->memory + i / (size_t)width * stride;
        int lane = (int)(i % (size_t)width);
        if (width == 8) fill_8(at, any, lane, &rays[i]);
        else if (width == 16) fill_16(at, any, lane, &rays[i]);
        else if (any) fill_ray((struct RTCRay *)at, &rays[i]);
        else fill((struct RTCRayHit *)at, &rays[i]);
    }
    return b;
}

static void run_stream(RTCScene scene, struct RTCIntersectContext *context, const BenchBatch *b)
{
    for (size_t first = 0; first < b->count; first += STREAM) {
        unsigned char *at = b->memory + first * b->stride;
        unsigned m = (unsigned)(b->count - first < STREAM ? b->count - first : STREAM);
        if (b->any) rtcOccluded1M(scene, context, (struct RTCRay *)at, m, b->stride);
        else rtcIntersect1M(scene, context, (struct RTCRayHit *)at, m, b->stride);
    }
}

void bench_batch_run(BenchEmbree *e, BenchBatch *b, int coherent)
{
    unsigned before = enter();
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT
                             : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    if (b->width == 8) run_8(e->scene, &context, b);
    else if (b->width == 16) run_16(e->scene, &context, b);
    else run_stream(e->scene, &context, b);
    _mm_setcsr(before);
}

void bench_batch_hits(const BenchBatch *b, BenchHit *hits)
{
    for (size_t i = 0; i < b->count; i++) {
        const unsigned char *at = b->memory + i / (size_t)b->width * b->stride;
        int lane = (int)(i % (size_t)b->width);
        const struct RTCRayHit *q = (const struct RTCRayHit *)at;
        hits[i] = b->width == 8    ? hit_8(at, lane)
                  : b->width == 16 ? hit_16(at, lane)
                                   : hit(q->ray.tfar, q->hit.u, q->hit.v, q->hit.primID,
                                         q->hit.geomID, q->hit.instID[0]);
    }
}

void bench_batch_occluded(const BenchBatch *b, uint8_t *occluded)
{
    for (size_t i = 0; i < b->count; i++) {
        const unsigned char *at = b->memory + i / (size_t)b->width * b->stride;
        size_t lane = i % (size_t)b->width;
        float t = b->width == 8    ? ((const struct RTCRay8 *)at)->tfar[lane]
                  : b->width == 16 ? ((const struct RTCRay16 *)at)->tfar[lane]
                                   : ((const struct RTCRay *)at)->tfar;
        occluded[i] = t < 0;
    }
}

void bench_batch_free(BenchBatch *b)
{
    if (!b) return;
    free(b->memory);
    free(b);
}
