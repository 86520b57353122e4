// The caller's memory: enough is enough, less is refused, nothing outside is touched; blocks can be
// moved, saved, cut and damaged.

#include "check.h"

static const RtAccel *ask_all(const RtAccel *accel, RtHit *hits) {
    for (uint32_t i = 0; i < 200; i++) {
        RtRay ray = ray_over(12, i);
        rt_intersect(accel, &ray, &hits[i]);
    }
    return accel;
}

static void check(bool grid) {
    RtMesh mesh = sheet(12);
    float balls[8] = {3, 3, 2, 0.5f, 7, 8, 1, 0.75f};
    RtSphereSet set = {balls, 2, 0, 0, 0};
    RtScene scene = scene_of(&mesh, 1, &set, 1);
    RtMemory need;
    CHECK((grid ? rt_grid_needs : rt_bvh_needs)(&scene, NULL, &need) == RT_OK);
    static RtHit hits[200], again[200];

    size_t sizes[3] = {need.minimum, (need.minimum + need.size) / 2, need.size};
    const RtAccel *accel = NULL;
    for (int i = 0; i < 3; i++) {
        unsigned char *memory = aligned(sizes[i] + 128) + 64;
        memset(memory - 64, 0xA5, sizes[i] + 128);
        RtStatus less = (grid ? rt_build_grid : rt_build_bvh)(&scene, NULL, memory, need.minimum - 1, &accel);
        CHECK(less == RT_ERROR_OUT_OF_MEMORY);
        for (size_t k = 0; k < sizes[i]; k++) CHECK(memory[k] == 0xA5);
        CHECK((grid ? rt_build_grid : rt_build_bvh)(&scene, NULL, memory, sizes[i], &accel) == RT_OK);
        for (size_t k = 0; k < 64; k++) CHECK(memory[-64 + (long)k] == 0xA5 && memory[sizes[i] + k] == 0xA5);
        ask_all(accel, i == 0 ? hits : again);
        if (i > 0) CHECK(memcmp(hits, again, sizeof hits) == 0);
    }

    // Elsewhere, while the original is gone.
    size_t size = rt_accel_size(accel);
    unsigned char *copy = aligned(size), *block = aligned(size);
    memcpy(copy, accel, size);
    memset((void *)accel, 0xFF, size);
    ask_all((const RtAccel *)copy, again);
    CHECK(memcmp(hits, again, sizeof hits) == 0);

    // From a file.
    FILE *file = tmpfile();
    CHECK(file != NULL && fwrite(copy, 1, size, file) == size);
    rewind(file);
    CHECK(fread(block, 1, size, file) == size && fclose(file) == 0);
    CHECK(rt_accel_open(block, size, &accel) == RT_OK);
    ask_all(accel, again);
    CHECK(memcmp(hits, again, sizeof hits) == 0);

    // Cut at every length: the bytes behind do not exist.
    for (size_t cut = 0; cut < size; cut++) {
        unsigned char *shorter = aligned(cut);
        memcpy(shorter, copy, cut);
        const RtAccel *out = NULL;
        CHECK(rt_accel_open(shorter, cut, &out) != RT_OK && out == NULL);
        if (cut > 4096) cut += 61;
    }

    // Damaged: refused, or harmless.
    uint32_t state = 1, refused = 0;
    for (int i = 0; i < 6000; i++) {
        memcpy(block, copy, size);
        for (int k = 0; k <= i % 3; k++) {
            state = state * 1664525u + 1013904223u;
            size_t at = i % 2 ? (state >> 8) % size : (state >> 8) % (size < 1024 ? size : 1024);
            block[at] ^= (unsigned char)(1u << (state >> 5) % 8);
        }
        const RtAccel *out = NULL;
        if (rt_accel_open(block, size, &out) == RT_OK) ask_all(out, again);
        else refused++;
    }
    CHECK(refused > 100);
}

int main(void) {
    check(false);
    check(true);
    return 0;
}
