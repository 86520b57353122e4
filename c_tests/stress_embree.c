/* Traces blocks of scenes and rays through Embree 3, default and robust, for harness/src/stress.
 *
 *     stress_embree < BLOCKS > ANSWERS
 *
 * Sequences of 4-byte words in the machine's byte order, until the input ends between two blocks.
 *
 *   BLOCK    mesh_count, sphere_set_count, ray_count;
 *            for each mesh vertex_count, triangle_count, x y z of each vertex (float), three vertex
 *            numbers of each triangle (uint32); for each sphere set sphere_count, x y z radius;
 *            for each ray an RtRay. All floats but t_max finite and at most 1.8e18 in size, no
 *            negative t_min: Embree aborts on others.
 *   ANSWER   for each ray t, prim and geometry of the default scene, then of the robust one
 *            (infinity and twice RTC_INVALID_GEOMETRY_ID on a miss)
 *
 * The answers to a block are written when all of it has been read. Medium build quality, one ray at a
 * time. Exits with 1 on any error.
 */
#include <embree3/rtcore.h>
#include <math.h>
#include <pmmintrin.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <xmmintrin.h>

typedef struct { float t; uint32_t prim, geometry; } Answer;
typedef struct { float origin[3], t_min, direction[3], t_max; } Ray;
enum { DEFAULT, ROBUST, SCENES };

static void fail(const char *what)
{
    fprintf(stderr, "stress_embree: %s\n", what);
    exit(1);
}

static void on_error(void *user, enum RTCError code, const char *message)
{
    (void)user;
    (void)code;
    fail(message);
}

static void read_words(void *words, size_t count)
{
    if (fread(words, 4, count, stdin) != count) fail("the block ends early");
}

static void attach(RTCScene scenes[SCENES], RTCGeometry geometry, uint32_t number)
{
    rtcSetGeometryBuildQuality(geometry, RTC_BUILD_QUALITY_MEDIUM);
    rtcCommitGeometry(geometry);
    for (int i = 0; i < SCENES; i++) rtcAttachGeometryByID(scenes[i], geometry, number);
    rtcReleaseGeometry(geometry);
}

/* Embree owns the buffers, and pads them as its vector loads need. */
static void read_mesh(RTCDevice device, RTCScene scenes[SCENES], uint32_t number)
{
    uint32_t counts[2];
    read_words(counts, 2);
    RTCGeometry mesh = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    if (counts[0] > 0 && counts[1] > 0) {
        read_words(rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12,
                                           counts[0]), 3 * (size_t)counts[0]);
        read_words(rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12,
                                           counts[1]), 3 * (size_t)counts[1]);
    } else {
        float unused;
        for (size_t i = 0; i < 3 * ((size_t)counts[0] + counts[1]); i++) read_words(&unused, 1);
    }
    attach(scenes, mesh, number);
}

static void read_spheres(RTCDevice device, RTCScene scenes[SCENES], uint32_t number)
{
    uint32_t count;
    read_words(&count, 1);
    RTCGeometry spheres = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_SPHERE_POINT);
    if (count > 0)
        read_words(rtcSetNewGeometryBuffer(spheres, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT4,
                                           16, count), 4 * (size_t)count);
    attach(scenes, spheres, number);
}

static Answer trace(RTCScene scene, const Ray *ray)
{
    struct RTCRayHit query;
    struct RTCIntersectContext context;
    memset(&query, 0, sizeof query);
    query.ray.org_x = ray->origin[0];
    query.ray.org_y = ray->origin[1];
    query.ray.org_z = ray->origin[2];
    query.ray.dir_x = ray->direction[0];
    query.ray.dir_y = ray->direction[1];
    query.ray.dir_z = ray->direction[2];
    query.ray.tnear = ray->t_min;
    query.ray.tfar = ray->t_max;
    query.ray.mask = 0xFFFFFFFFu;
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    query.hit.primID = RTC_INVALID_GEOMETRY_ID;
    rtcInitIntersectContext(&context);
    rtcIntersect1(scene, &context, &query);
    Answer answer = { INFINITY, RTC_INVALID_GEOMETRY_ID, RTC_INVALID_GEOMETRY_ID };
    if (query.hit.geomID != RTC_INVALID_GEOMETRY_ID) {
        answer.t = query.ray.tfar;
        answer.prim = query.hit.primID;
        answer.geometry = query.hit.geomID;
    }
    return answer;
}

static void answer_block(RTCDevice device, const uint32_t counts[3])
{
    RTCScene scenes[SCENES] = { rtcNewScene(device), rtcNewScene(device) };
    rtcSetSceneFlags(scenes[ROBUST], RTC_SCENE_FLAG_ROBUST);
    for (uint32_t i = 0; i < counts[0]; i++) read_mesh(device, scenes, i);
    for (uint32_t i = 0; i < counts[1]; i++) read_spheres(device, scenes, counts[0] + i);
    Ray *rays = malloc((size_t)counts[2] * sizeof *rays + 1);
    if (!rays) fail("no memory");
    read_words(rays, (size_t)counts[2] * (sizeof *rays / 4));
    for (int i = 0; i < SCENES; i++) {
        rtcSetSceneBuildQuality(scenes[i], RTC_BUILD_QUALITY_MEDIUM);
        rtcCommitScene(scenes[i]);
    }
    for (uint32_t i = 0; i < counts[2]; i++) {
        Answer answers[SCENES];
        for (int j = 0; j < SCENES; j++) answers[j] = trace(scenes[j], &rays[i]);
        if (fwrite(answers, sizeof answers, 1, stdout) != 1) fail("cannot write");
    }
    if (fflush(stdout) != 0) fail("cannot write");
    free(rays);
    for (int i = 0; i < SCENES; i++) rtcReleaseScene(scenes[i]);
}

int main(void)
{
    /* Embree asks its caller for these. */
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);

    RTCDevice device = rtcNewDevice("threads=1");
    if (!device) fail("no device");
    rtcSetDeviceErrorFunction(device, on_error, NULL);
    uint32_t counts[3];
    while (fread(counts, 4, 3, stdin) == 3) answer_block(device, counts);
    rtcReleaseDevice(device);
    return 0;
}
