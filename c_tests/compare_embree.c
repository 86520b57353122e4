/* Traces rays through grid and BVH of raykern and through Embree 3, and writes where they disagree,
 * for harness/tests/compare_embree.rs.
 *
 *     compare_embree SCENE RAYS STRIDE OUTPUT
 *
 * The BVH and Embree get all rays, the grid each STRIDE-th. All files are sequences of 4-byte words
 * in the machine's byte order.
 *
 *   SCENE   mesh_count; then for each mesh vertex_count, triangle_count,
 *           x y z of each vertex (float), three vertex numbers of each triangle (uint32)
 *   RAYS    for each ray an RtRay, finite but t_max
 *   OUTPUT  four counts: rays, rays of the grid, rays on which grid and BVH differ in any byte,
 *           rays that follow; then for each ray that is answered differently its number, the RtHit
 *           of the grid (that of the BVH where the grid was not asked), the RtHit of the BVH, and
 *           of Embree t, prim and geometry (infinity, RT_NONE and RT_NONE on a miss)
 *
 * Embree: default flags, medium build quality, one ray at a time. Exits with 1 on any error.
 */
#include <embree3/rtcore.h>
#include <math.h>
#include <pmmintrin.h>
#include <raykern.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <xmmintrin.h>

/* Two right primitives with `t` this close count as agreement. */
#define ULPS 64

typedef struct { float t; uint32_t prim, geometry; } Answer;
typedef struct { uint32_t ray; RtHit grid, bvh; Answer embree; } Disagreement;
typedef struct { uint32_t rays, grid_rays, differences, disagreements; } Counts;

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

static void *allocate(size_t size)
{
    void *memory = malloc(size + 64);
    if (!memory) fail("no memory");
    return (unsigned char *)memory + (64 - (uintptr_t)memory % 64) % 64;
}

static void check(RtStatus status)
{
    if (status != RT_OK) fail(rt_status_message(status));
}

static RtMesh read_mesh(FILE *file)
{
    uint32_t counts[2];
    read_words(file, counts, 2);
    float *vertices = allocate(12 * (size_t)counts[0]);
    uint32_t *indices = allocate(12 * (size_t)counts[1]);
    read_words(file, vertices, 3 * (size_t)counts[0]);
    read_words(file, indices, 3 * (size_t)counts[1]);
    RtMesh mesh;
    memset(&mesh, 0, sizeof mesh);
    mesh.vertices = vertices;
    mesh.indices = indices;
    mesh.vertex_count = counts[0];
    mesh.triangle_count = counts[1];
    return mesh;
}

/* The structure itself, never a plain list. */
static const RtAccel *built(const RtScene *scene, int grid)
{
    RtBuildOptions options;
    memset(&options, 0, sizeof options);
    options.struct_size = sizeof options;
    options.plain_list = RT_PLAIN_LIST_NEVER;
    RtMemory need;
    check((grid ? rt_grid_needs : rt_bvh_needs)(scene, &options, &need));
    const RtAccel *accel;
    void *memory = allocate(need.size);
    check((grid ? rt_build_grid : rt_build_bvh)(scene, &options, memory, need.size, &accel));
    RtInfo info;
    memset(&info, 0, sizeof info);
    info.struct_size = sizeof info;
    check(rt_accel_info(accel, &info));
    if (info.kind != (grid ? RT_KIND_GRID : RT_KIND_BVH)) fail("another structure was built");
    return accel;
}

/* Embree owns the buffers, and pads them as its vector loads need. */
static void add_mesh(RTCDevice device, RTCScene scene, const RtMesh *from, uint32_t number)
{
    RTCGeometry mesh = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    void *vertices = rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                             12, from->vertex_count);
    void *indices = rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12,
                                            from->triangle_count);
    memcpy(vertices, from->vertices, 12 * (size_t)from->vertex_count);
    memcpy(indices, from->indices, 12 * (size_t)from->triangle_count);
    rtcSetGeometryBuildQuality(mesh, RTC_BUILD_QUALITY_MEDIUM);
    rtcCommitGeometry(mesh);
    rtcAttachGeometryByID(scene, mesh, number);
    rtcReleaseGeometry(mesh);
}

static Answer trace(RTCScene scene, const RtRay *ray)
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

/* The place of a float among all floats, so that neighbours differ by one. */
static int64_t place(float x)
{
    int32_t bits;
    memcpy(&bits, &x, 4);
    return bits < 0 ? -(int64_t)(bits & 0x7FFFFFFF) : bits;
}

static int agree(const RtHit *ours, const Answer *embree)
{
    if (ours->prim != embree->prim || ours->geometry != embree->geometry) return 0;
    if (ours->prim == RT_NONE) return 1;
    int64_t apart = place(ours->t) - place(embree->t);
    return apart <= ULPS && -apart <= ULPS;
}

int main(int argc, char **argv)
{
    if (argc != 5) fail("SCENE RAYS STRIDE OUTPUT");
    FILE *scene_file = fopen(argv[1], "rb");
    FILE *ray_file = fopen(argv[2], "rb");
    unsigned long stride = strtoul(argv[3], NULL, 10);
    FILE *output = fopen(argv[4], "wb");
    if (!scene_file || !ray_file || !output || stride == 0) fail("bad arguments");

    /* Embree asks its caller for these; raykern must not mind. */
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);

    RTCDevice device = rtcNewDevice(NULL);
    if (!device) fail("no device");
    rtcSetDeviceErrorFunction(device, on_error, NULL);
    RTCScene embree = rtcNewScene(device);
    rtcSetSceneBuildQuality(embree, RTC_BUILD_QUALITY_MEDIUM);
    uint32_t mesh_count;
    read_words(scene_file, &mesh_count, 1);
    RtMesh *meshes = allocate(mesh_count * sizeof *meshes);
    for (uint32_t i = 0; i < mesh_count; i++) {
        meshes[i] = read_mesh(scene_file);
        add_mesh(device, embree, &meshes[i], i);
    }
    rtcCommitScene(embree);
    RtScene scene;
    memset(&scene, 0, sizeof scene);
    scene.struct_size = sizeof scene;
    scene.mesh_count = mesh_count;
    scene.meshes = meshes;
    const RtAccel *grid = built(&scene, 1), *bvh = built(&scene, 0);

    Counts counts = { 0, 0, 0, 0 };
    if (fwrite(&counts, sizeof counts, 1, output) != 1) fail("cannot write");
    RtRay ray;
    for (; fread(&ray, sizeof ray, 1, ray_file) == 1; counts.rays++) {
        Disagreement found;
        found.ray = counts.rays;
        found.embree = trace(embree, &ray);
        rt_intersect(bvh, &ray, &found.bvh);
        found.grid = found.bvh;
        if (counts.rays % stride == 0) {
            rt_intersect(grid, &ray, &found.grid);
            counts.grid_rays++;
        }
        int differ = memcmp(&found.grid, &found.bvh, sizeof found.bvh) != 0;
        counts.differences += differ ? 1 : 0;
        if (!differ && agree(&found.bvh, &found.embree)) continue;
        counts.disagreements++;
        if (fwrite(&found, sizeof found, 1, output) != 1) fail("cannot write");
    }
    rewind(output);
    if (fwrite(&counts, sizeof counts, 1, output) != 1) fail("cannot write");
    if (fclose(output) != 0) fail("cannot write");
    rtcReleaseScene(embree);
    rtcReleaseDevice(device);
    return 0;
}
