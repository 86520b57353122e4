// All hits in order, against brute force in whole numbers: what is met, in which order, each once, whatever the
// capacity.

#include "check.h"

#define TRIANGLES 60
#define MOST 64

static uint32_t state = 1;

// A whole number from -3 to 3.
static int number(void) {
    state = state * 1664525u + 1013904223u;
    return (int)(state >> 16) % 7 - 3;
}

// What the line meets, at `above / below` with `below` positive.
typedef struct Met {
    int64_t above, below;
    uint32_t prim;
} Met;

static int64_t volume(const int64_t d[3], const int64_t p[3], const int64_t q[3]) {
    return d[0] * (p[1] * q[2] - p[2] * q[1]) + d[1] * (p[2] * q[0] - p[0] * q[2]) +
           d[2] * (p[0] * q[1] - p[1] * q[0]);
}

// Whether the line meets the closed triangle, and where: by signs of volumes, without rounding.
static bool meet(int corners[3][3], const int origin[3], const int direction[3], Met *met) {
    int64_t p[3][3], d[3];
    for (int k = 0; k < 3; k++) {
        d[k] = direction[k];
        for (int i = 0; i < 3; i++) p[i][k] = corners[i][k] - origin[k];
    }
    int64_t u = volume(d, p[2], p[0]), v = volume(d, p[0], p[1]), w = volume(d, p[1], p[2]);
    bool negative = u < 0 || v < 0 || w < 0, positive = u > 0 || v > 0 || w > 0;
    if (negative == positive) return false;
    // `d . n` is the sum of the volumes, and the distance times that is the volume of the corners.
    met->below = u + v + w;
    met->above = volume(p[0], p[1], p[2]);
    if (met->below < 0) {
        met->below = -met->below;
        met->above = -met->above;
    }
    return met->above >= 0;
}

static int in_order(const void *a, const void *b) {
    const Met *p = a, *q = b;
    int64_t left = p->above * q->below, right = q->above * p->below;
    if (left != right) return left < right ? -1 : 1;
    return p->prim < q->prim ? -1 : p->prim > q->prim;
}

// The list, so many at a time; nothing behind those returned is looked at.
static size_t listed(const RtAccel *accel, const RtRay *ray, size_t capacity, RtHit *out) {
    RtCursor cursor = {0};
    cursor.struct_size = sizeof cursor;
    RtHit room[MOST];
    size_t sum = 0;
    for (;;) {
        size_t count = rt_all_hits(accel, ray, NULL, &cursor, room, capacity);
        CHECK(count <= capacity && sum + count <= MOST);
        memcpy(out + sum, room, count * sizeof *room);
        sum += count;
        if (count < capacity) return sum;
    }
}

static void check_triangles(void) {
    static int corners[TRIANGLES][3][3];
    static float vertices[TRIANGLES][3][3];
    for (int i = 0; i < TRIANGLES; i++)
        for (int k = 0; k < 9; k++) {
            corners[i][k / 3][k % 3] = i > 0 && i % 5 == 0 ? corners[i - 1][k / 3][k % 3] : number();
            vertices[i][k / 3][k % 3] = (float)corners[i][k / 3][k % 3];
        }
    RtMesh mesh = {0};
    mesh.vertices = &vertices[0][0][0];
    mesh.vertex_count = 3 * TRIANGLES;
    mesh.triangle_count = TRIANGLES;
    RtScene scene = scene_of(&mesh, 1, NULL, 0);
    RtBuildOptions options = {0};
    options.struct_size = sizeof options;
    options.quality = RT_QUALITY_BEST;
    const RtAccel *accels[3] = {built(&scene, false, &options), built(&scene, true, &options), NULL};
    options.layout = RT_LAYOUT_COMPACT;
    accels[2] = built(&scene, false, &options);
    size_t hits = 0, ties = 0;
    for (int r = 0; r < 2000; r++) {
        int origin[3], direction[3];
        RtRay ray = {{0}, 0, {0}, 1e30f};
        for (int k = 0; k < 3; k++) {
            ray.origin[k] = (float)(origin[k] = 2 * number());
            ray.direction[k] = (float)(direction[k] = number());
        }
        Met mets[TRIANGLES];
        size_t count = 0;
        for (uint32_t i = 0; i < TRIANGLES; i++)
            if (meet(corners[i], origin, direction, &mets[count])) mets[count++].prim = i;
        qsort(mets, count, sizeof *mets, in_order);
        for (int a = 0; a < 3; a++) {
            const size_t capacities[4] = {1, 2, 3, 16};
            RtHit found[MOST];
            CHECK(listed(accels[a], &ray, capacities[(a + r) % 4], found) == count);
            for (size_t i = 0; i < count; i++) {
                CHECK(found[i].prim == mets[i].prim && found[i].geometry == 0);
                CHECK(found[i].t == (float)((double)mets[i].above / (double)mets[i].below));
            }
            RtHit nearest[2];
            size_t two = rt_all_hits(accels[a], &ray, NULL, NULL, nearest, 2);
            CHECK(two == (count < 2 ? count : 2) && memcmp(nearest, found, two * sizeof *found) == 0);
        }
        hits += count;
        for (size_t i = 1; i < count; i++) ties += mets[i].above * mets[i - 1].below == mets[i - 1].above * mets[i].below;
    }
    CHECK(hits > 1500 && ties > 400);
}

// A ball in a ball: four hits, two of which a query without fronts leaves, and where a key of ids and root goes on.
static void check_spheres(void) {
    const float balls[2][4] = {{0, 0, 0, 2}, {0, 0, 0, 1}};
    RtSphereSet set = {0};
    set.spheres = &balls[0][0];
    set.sphere_count = 2;
    RtScene scene = scene_of(NULL, 0, &set, 1);
    const RtAccel *accel = built(&scene, false, NULL);
    RtRay ray = {{0, 0, -5}, 0, {0, 0, 1}, 1e30f};
    RtHit hits[8];
    CHECK(rt_all_hits(accel, &ray, NULL, NULL, hits, 8) == 4);
    const float t[4] = {3, 4, 6, 7};
    for (int i = 0; i < 4; i++) CHECK(hits[i].t == t[i] && hits[i].prim == (i == 1 || i == 2));
    RtQuery query = {0};
    query.struct_size = sizeof query;
    query.facing = RT_FACING_BACK;
    CHECK(rt_all_hits(accel, &ray, &query, NULL, hits, 8) == 2 && hits[0].t == 6);
    RtCursor cursor = {0};
    cursor.struct_size = sizeof cursor;
    cursor.begun = 1;
    cursor.t = 4;
    cursor.prim = 1;
    cursor.instance = RT_NONE;
    RtCursor other = cursor;
    CHECK(rt_all_hits(accel, &ray, NULL, &cursor, hits, 8) == 2 && hits[0].t == 6);
    size_t found = 0;
    CHECK(rt_all_hits_checked(accel, &ray, NULL, &other, hits, 8, &found) == RT_OK && found == 2);
    CHECK(memcmp(&other, &cursor, sizeof other) == 0 && hits[1].t == 7);
    CHECK(cursor.root == 1 && cursor.prim == 0 && cursor.t == 7);

    // Refused: nothing is written.
    RtHit mark = hits[0];
    RtCursor same = cursor;
    cursor.begun = same.begun = 2;
    CHECK(rt_all_hits(accel, &ray, NULL, &cursor, hits, 8) == 0);
    cursor.struct_size = same.struct_size = 1;
    CHECK(rt_all_hits(accel, &ray, NULL, &cursor, hits, 8) == 0);
    query.facing = 9;
    CHECK(rt_all_hits(accel, &ray, &query, NULL, hits, 8) == 0);
    CHECK(rt_all_hits(NULL, &ray, NULL, NULL, hits, 8) == 0);
    CHECK(rt_all_hits(accel, NULL, NULL, NULL, hits, 8) == 0);
    CHECK(rt_all_hits(accel, &ray, NULL, NULL, NULL, 8) == 0);
    CHECK(rt_all_hits(accel, &ray, NULL, NULL, hits, (size_t)-1) == 0);
    CHECK(rt_all_hits(accel, &ray, NULL, NULL, hits, 0) == 0);
    size_t count = 77;
    CHECK(rt_all_hits_checked(accel, &ray, NULL, NULL, hits, 8, NULL) == RT_ERROR_NULL_POINTER);
    CHECK(rt_all_hits_checked(accel, &ray, NULL, NULL, NULL, 8, &count) == RT_ERROR_NULL_POINTER);
    CHECK(rt_all_hits_checked(accel, &ray, &query, NULL, hits, 8, &count) == RT_ERROR_INVALID_ARGUMENT);
    CHECK(rt_all_hits_checked(accel, &ray, NULL, NULL, hits, (size_t)-1, &count) == RT_ERROR_TOO_LARGE);
    CHECK(rt_all_hits_checked(accel, &ray, NULL, &cursor, hits, 8, &count) == RT_ERROR_INVALID_ARGUMENT);
    CHECK(memcmp(&same, &cursor, sizeof same) == 0);
    cursor.struct_size = same.struct_size = sizeof cursor;
    cursor.begun = same.begun = 1;
    cursor.prim = same.prim = 5;
    CHECK(rt_all_hits_checked(accel, &ray, NULL, &cursor, hits, 8, &count) == RT_ERROR_NOT_FOUND && count == 77);
    CHECK(rt_all_hits(accel, &ray, NULL, &cursor, hits, 8) == 0);
    CHECK(memcmp(&mark, hits, sizeof mark) == 0 && memcmp(&same, &cursor, sizeof same) == 0);

    // After the last one, and with no room, there are none.
    cursor.prim = 0;
    CHECK(rt_all_hits_checked(accel, &ray, NULL, &cursor, hits, 0, &count) == RT_OK && count == 0);
    count = 77;
    CHECK(rt_all_hits_checked(accel, &ray, NULL, &cursor, hits, 8, &count) == RT_OK && count == 0);
}

int main(void) {
    check_triangles();
    check_spheres();
    return 0;
}
