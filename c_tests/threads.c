// Many threads on one accel get identical bits.

#include "check.h"

#include <pthread.h>

#define THREADS 8
#define RAYS 20000

static const RtAccel *accel;
static RtHit hits[THREADS][RAYS];

static void *ask(void *result) {
    RtHit *out = result;
    for (uint32_t i = 0; i < RAYS; i++) {
        RtRay ray = ray_over(40, i);
        bool found = rt_intersect(accel, &ray, &out[i]);
        CHECK(found == rt_occluded(accel, &ray));
    }
    return NULL;
}

int main(void) {
    RtMesh mesh = sheet(40);
    RtScene scene = scene_of(&mesh, 1, NULL, 0);
    static RtHit first[RAYS];
    for (int grid = 0; grid < 2; grid++) {
        accel = built(&scene, grid != 0, NULL);
        pthread_t threads[THREADS];
        for (int i = 0; i < THREADS; i++) CHECK(pthread_create(&threads[i], NULL, ask, hits[i]) == 0);
        for (int i = 0; i < THREADS; i++) CHECK(pthread_join(threads[i], NULL) == 0);
        if (grid == 0) memcpy(first, hits[0], sizeof first);
        for (int i = 0; i < THREADS; i++) CHECK(memcmp(first, hits[i], sizeof first) == 0);
    }
    uint32_t found = 0;
    for (int i = 0; i < RAYS; i++) found += first[i].prim != RT_NONE;
    CHECK(found > RAYS / 4 && found < RAYS);
    return 0;
}
