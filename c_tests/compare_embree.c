/* Traces rays through Embree 3 and writes what it hits, for harness/tests/compare_embree.rs.
 *
 *     compare_embree SCENE RAYS HITS
 *
 * All files are sequences of 4-byte words in the machine's byte order.
 *
 *   SCENE  mesh_count; then for each mesh vertex_count, triangle_count,
 *          x y z of each vertex (float), three vertex numbers of each triangle (uint32)
 *   RAYS   for each ray the 32 bytes of an RtRay: origin, t_min, direction, t_max; finite but t_max
 *   HITS   for each ray t (float; infinity on a miss), prim, geometry (uint32; 0xFFFFFFFF on a miss)
 *
 * Default flags, medium build quality, one ray at a time. Exits with 1 on any error.
 */
#include <embree3/rtcore.h>
#include <math.h>
#include <pmmintrin.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <xmmintrin.h>

typedef struct { float origin[3], t_min, direction[3], t_max; } Ray;
typedef struct { float t; uint32_t prim, geometry; } Answer;

static void fail(const char *what)
{
    fprintf(stderr, "compare_embree: %s\n", what);
    exit(1);
}

static void on_error(void *user, enum RTCError code, const char *message)
{
    (void)user;
    (void)code;
    fail(message);
}

static void read_words(FILE *file, void *words, size_t count)
{
    if (fread(words, 4, count, file) != count) fail("the scene ends early");
}

/* Embree owns the buffers, and pads them as its vector loads need. */
static void add_mesh(RTCDevice device, RTCScene scene, FILE *file, uint32_t number)
{
    uint32_t counts[2];
    read_words(file, counts, 2);
    RTCGeometry mesh = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    void *vertices = rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                             12, counts[0]);
    void *indices = rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12,
                                            counts[1]);
    read_words(file, vertices, 3 * (size_t)counts[0]);
    read_words(file, indices, 3 * (size_t)counts[1]);
    rtcSetGeometryBuildQuality(mesh, RTC_BUILD_QUALITY_MEDIUM);
    rtcCommitGeometry(mesh);
    rtcAttachGeometryByID(scene, mesh, number);
    rtcReleaseGeometry(mesh);
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

int main(int argc, char **argv)
{
    if (argc != 4) fail("SCENE RAYS HITS");
    FILE *scene_file = fopen(argv[1], "rb");
    FILE *ray_file = fopen(argv[2], "rb");
    FILE *hit_file = fopen(argv[3], "wb");
    if (!scene_file || !ray_file || !hit_file) fail("cannot open a file");

    /* Embree asks its caller for these. */
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);

    RTCDevice device = rtcNewDevice(NULL);
    if (!device) fail("no device");
    rtcSetDeviceErrorFunction(device, on_error, NULL);
    RTCScene scene = rtcNewScene(device);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_MEDIUM);
    uint32_t mesh_count;
    read_words(scene_file, &mesh_count, 1);
    for (uint32_t i = 0; i < mesh_count; i++) add_mesh(device, scene, scene_file, i);
    rtcCommitScene(scene);

    Ray ray;
    while (fread(&ray, sizeof ray, 1, ray_file) == 1) {
        Answer answer = trace(scene, &ray);
        if (fwrite(&answer, sizeof answer, 1, hit_file) != 1) fail("cannot write");
    }
    if (fclose(hit_file) != 0) fail("cannot write");
    rtcReleaseScene(scene);
    rtcReleaseDevice(device);
    return 0;
}
