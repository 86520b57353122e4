// The closest point, against brute force in double precision over a sheet and some balls.

#include "check.h"

#include <math.h>

#define BALLS 20

typedef struct Vector {
    double x, y, z;
} Vector;

static Vector minus(Vector a, Vector b) {
    Vector v = {a.x - b.x, a.y - b.y, a.z - b.z};
    return v;
}

static double dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

static Vector cross(Vector a, Vector b) {
    Vector v = {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
    return v;
}

static double to_edge(Vector p, Vector a, Vector b) {
    Vector edge = minus(b, a), away = minus(p, a);
    double s = fmin(fmax(dot(away, edge) / dot(edge, edge), 0), 1);
    Vector rest = {away.x - s * edge.x, away.y - s * edge.y, away.z - s * edge.z};
    return sqrt(dot(rest, rest));
}

// By another way than the library's: the plane where the foot is inside of all edges, the edges elsewhere.
static double to_triangle(Vector p, const Vector c[3]) {
    Vector n = cross(minus(c[1], c[0]), minus(c[2], c[0]));
    bool inside = true;
    double nearest = INFINITY;
    for (int i = 0; i < 3; i++) {
        Vector a = c[i], b = c[(i + 1) % 3];
        inside &= dot(cross(n, minus(b, a)), minus(p, a)) >= 0;
        nearest = fmin(nearest, to_edge(p, a, b));
    }
    return inside ? fabs(dot(n, minus(p, c[0]))) / sqrt(dot(n, n)) : nearest;
}

static Vector vertex(const RtMesh *mesh, uint32_t i) {
    const float *v = mesh->vertices + 3 * i;
    Vector p = {v[0], v[1], v[2]};
    return p;
}

static double distance_to(const RtMesh *mesh, float balls[][4], Vector p, uint32_t geometry, uint32_t i) {
    if (geometry == 0) {
        Vector corners[3];
        for (int k = 0; k < 3; k++) corners[k] = vertex(mesh, mesh->indices[3 * i + k]);
        return to_triangle(p, corners);
    }
    Vector centre = {balls[i][0], balls[i][1], balls[i][2]}, away = minus(p, centre);
    return fabs(sqrt(dot(away, away)) - balls[i][3]);
}

int main(void) {
    const uint32_t n = 20;
    RtMesh mesh = sheet(n);
    mesh.mask = 1;
    static float balls[BALLS][4];
    for (uint32_t i = 0; i < BALLS; i++) {
        balls[i][0] = (float)(i * 37u % 20u);
        balls[i][1] = (float)(i * 53u % 20u);
        balls[i][2] = 3.0f;
        balls[i][3] = 0.1f * (float)(1 + i % 7u);
    }
    RtSphereSet set = {0};
    set.spheres = &balls[0][0];
    set.sphere_count = BALLS;
    set.mask = 2;
    RtScene scene = scene_of(&mesh, 1, &set, 1);
    RtBuildOptions options = {0};
    options.struct_size = sizeof options;
    const RtAccel *accels[4] = {built(&scene, false, NULL), built(&scene, true, NULL), NULL, NULL};
    options.grid_kind = RT_GRID_UNIFORM;
    options.layout = RT_LAYOUT_COMPACT;
    accels[2] = built(&scene, false, &options);
    accels[3] = built(&scene, true, &options);
    uint32_t found = 0, of_balls = 0;
    for (uint32_t i = 0; i < 1000; i++) {
        float point[3] = {ray_over(n, i).origin[0], ray_over(n, i).origin[1], (float)(i % 50u) / 10.0f - 0.5f};
        float radius = i % 4u == 0 ? 0.5f : INFINITY;
        RtQuery query = {0};
        query.struct_size = sizeof query;
        query.mask = i % 3u;
        Vector p = {point[0], point[1], point[2]};
        double least = INFINITY;
        for (uint32_t k = 0; k < mesh.triangle_count && query.mask != 2; k++)
            least = fmin(least, distance_to(&mesh, balls, p, 0, k));
        for (uint32_t k = 0; k < BALLS && query.mask != 1; k++)
            least = fmin(least, distance_to(&mesh, balls, p, 1, k));
        RtPointHit hit, first;
        bool any = rt_closest_point(accels[0], point, radius, &query, &first);
        CHECK(any == (least <= radius));
        for (int a = 1; a < 4; a++) {
            CHECK(rt_closest_point(accels[a], point, radius, &query, &hit) == any);
            CHECK(memcmp(&hit, &first, sizeof hit) == 0);
        }
        if (!any) {
            CHECK(first.distance == INFINITY && first.prim == RT_NONE && first.geometry == RT_NONE);
            continue;
        }
        CHECK(fabs(distance_to(&mesh, balls, p, first.geometry, first.prim) - least) < 1e-12);
        CHECK(fabs(first.distance - least) <= 1e-7 * least && first.instance == RT_NONE);
        Vector there = {first.point[0], first.point[1], first.point[2]}, away = minus(there, p);
        CHECK(fabs(sqrt(dot(away, away)) - least) < 1e-5);

        // Without it something else is closest, and not closer.
        query.skip = 1;
        query.skip_prim = first.prim;
        query.skip_geometry = first.geometry;
        query.skip_instance = RT_NONE;
        CHECK(rt_closest_point(accels[i % 4u], point, INFINITY, &query, &hit) && hit.distance >= first.distance);
        CHECK(hit.prim != first.prim || hit.geometry != first.geometry);
        found++;
        of_balls += first.geometry;
    }
    CHECK(found > 700 && of_balls > 200 && of_balls < found - 200);

    // Refused: nothing is written.
    const float point[3] = {0, 0, 0};
    RtPointHit mark, hit;
    memset(&mark, 0x55, sizeof mark);
    hit = mark;
    RtQuery query = {0};
    CHECK(!rt_closest_point(accels[0], point, 1, &query, &hit));
    CHECK(!rt_closest_point(NULL, point, 1, NULL, &hit) && !rt_closest_point(accels[0], NULL, 1, NULL, &hit));
    CHECK(!rt_closest_point(accels[0], point, 1, NULL, NULL) && memcmp(&hit, &mark, sizeof hit) == 0);
    const float nowhere[3] = {NAN, 0, 0};
    CHECK(!rt_closest_point(accels[0], nowhere, INFINITY, NULL, &hit) && hit.prim == RT_NONE);
    CHECK(!rt_closest_point(accels[0], point, NAN, NULL, &hit) && !rt_closest_point(accels[0], point, -1, NULL, &hit));
    return 0;
}
