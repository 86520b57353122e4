// Rounding modes, flushed subnormals and enabled traps: the same bits, no trap, and all of it as
// before afterwards.

#define _GNU_SOURCE
#include "check.h"

#include <fenv.h>
#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

#define RAYS 300

static RtRay rays[RAYS];
static RtHit hits[RAYS], expected[RAYS];
static unsigned char *block, *expected_block;
static size_t size;

// Builds and asks: coordinates of 1e-40 among them, which flushing would turn into zero.
static void run(void) {
    static float tiny[9] = {0, 0, 20, 3e-40f, 0, 20, 0, 3e-40f, 20};
    static RtMesh meshes[2];
    meshes[0] = sheet(12);
    meshes[1].vertices = tiny;
    meshes[1].vertex_count = 3;
    meshes[1].triangle_count = 1;
    RtScene scene = scene_of(meshes, 2, NULL, 0);
    const RtAccel *accel = built(&scene, false, NULL);
    size = rt_accel_size(accel);
    block = (unsigned char *)accel;
    for (uint32_t i = 0; i + 1 < RAYS; i++) rt_intersect(accel, &rays[i], &hits[i]);
    RtRay onto_tiny = {{0, 0, 30}, 0, {0, 0, -1}, 1e30f};
    uint32_t bits = 0x00011170; // 1e-40
    memcpy(&onto_tiny.origin[0], &bits, 4);
    memcpy(&onto_tiny.origin[1], &bits, 4);
    CHECK(rt_intersect(accel, &onto_tiny, &hits[RAYS - 1]));
    CHECK(hits[RAYS - 1].geometry == 1);
}

static void same_as_before(void) {
    CHECK(memcmp(hits, expected, sizeof hits) == 0);
    CHECK(memcmp(block, expected_block, size) == 0);
}

int main(void) {
    for (uint32_t i = 0; i < RAYS; i++) rays[i] = ray_over(12, i);
    run();
    memcpy(expected, hits, sizeof hits);
    expected_block = block;

    // The program's own quotients in `sheet` depend on the rounding mode, so the scene stays.
    int modes[4] = {FE_TONEAREST, FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO};
    for (int m = 0; m < 4; m++) {
        CHECK(fesetround(modes[m]) == 0);
        for (uint32_t i = 0; i + 1 < RAYS; i++)
            rt_intersect((const RtAccel *)expected_block, &rays[i], &hits[i]);
        CHECK(fegetround() == modes[m]);
        fesetround(FE_TONEAREST);
        same_as_before();
    }
#if defined(__SSE2__)
    unsigned state = _mm_getcsr();
    unsigned flushing = (state & ~0x3Fu) | 0x8040;
    _mm_setcsr(flushing);
    run();
    CHECK(_mm_getcsr() == flushing || (_mm_getcsr() & ~0x3Fu) == flushing);
    _mm_setcsr(state);
    same_as_before();
#endif
#if defined(__GLIBC__)
    feclearexcept(FE_ALL_EXCEPT);
    CHECK(feenableexcept(FE_ALL_EXCEPT) == 0);
    for (uint32_t i = 0; i + 1 < RAYS; i++)
        rt_intersect((const RtAccel *)expected_block, &rays[i], &hits[i]);
    int enabled = fegetexcept(), raised = fetestexcept(FE_ALL_EXCEPT);
    fedisableexcept(FE_ALL_EXCEPT);
    CHECK(enabled == FE_ALL_EXCEPT && raised == 0);
    same_as_before();
#endif
    return 0;
}
