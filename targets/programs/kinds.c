// Spheres, and instances of them, built and asked without a C library; and the stack that each takes.

#include "board.h"
#include "check.h"
#include "raykern.h"
#include "stack.h"
#include "text.h"

// Two that touch where x is 1, one in the first, and 20 small ones in a row behind them.
static float spheres[23][4] = {{0, 0, 4, 1}, {2, 0, 4, 1}, {0, 0, 4, 0.5f}};
static unsigned char own[8192] __attribute__((aligned(64)));
static unsigned char all[8192] __attribute__((aligned(64)));

static RtRay ahead(float x, float y) {
    RtRay ray = {{x, y, 0}, 0, {0, 0, 1}, 100};
    return ray;
}

static const RtAccel *build(const RtScene *scene, unsigned char *memory, size_t size) {
    RtBuildOptions options = {0};
    options.struct_size = sizeof options;
    options.layout = RT_LAYOUT_COMPACT;
    options.plain_list = RT_PLAIN_LIST_NEVER;
    RtMemory need;
    CHECK(rt_bvh_needs(scene, &options, &need) == RT_OK && need.size <= size);
    const RtAccel *accel = NULL;
    CHECK(rt_build_bvh(scene, &options, memory, need.size, &accel) == RT_OK);
    return accel;
}

static const RtAccel *build_spheres(void) {
    for (int i = 3; i < 23; i++) {
        const float sphere[4] = {(float)i, 0, 20, 0.25f};
        for (int k = 0; k < 4; k++) spheres[i][k] = sphere[k];
    }
    RtSphereSet set = {0};
    set.spheres = spheres[0];
    set.sphere_count = 23;
    RtScene scene = {0};
    scene.struct_size = sizeof scene;
    scene.sphere_set_count = 1;
    scene.sphere_sets = &set;
    return build(&scene, own, sizeof own);
}

static void check_spheres(const RtAccel *accel, uint32_t instance, float scale) {
    RtHit hit;
    RtRay ray = ahead(0, 0);
    CHECK(rt_intersect(accel, &ray, &hit) && hit.t == 3 * scale && hit.prim == 0 && hit.instance == instance);
    // Between the outer and the inner one.
    ray.t_min = 3.25f * scale;
    CHECK(rt_intersect(accel, &ray, &hit) && hit.t == 3.5f * scale && hit.prim == 2);
    // Where two touch in one point, which takes real arithmetic: the first of them.
    ray = ahead(scale, 0);
    CHECK(rt_intersect(accel, &ray, &hit) && hit.t == 4 * scale && hit.prim == 0 && rt_occluded(accel, &ray));
    ray = ahead(scale * 1.25f, scale);
    CHECK(!rt_intersect(accel, &ray, &hit) && !rt_occluded(accel, &ray));
    ray = ahead(7.125f * scale, 0);
    CHECK(rt_intersect(accel, &ray, &hit) && hit.prim == 7 && hit.t > 19.7f * scale && hit.t < 19.8f * scale);
}

// The spheres twice: as they are but farther away than the same twice as large, which hide them.
static const RtAccel *build_instances(const RtAccel *accel) {
    RtInstance instances[2] = {{accel, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 200}, 0, 0},
                               {accel, {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0}, 0, 0}};
    RtScene scene = {0};
    scene.struct_size = sizeof scene;
    scene.instance_count = 2;
    scene.instances = instances;
    return build(&scene, all, sizeof all);
}

int main(void) {
    Stack stack = paint_stack();
    const RtAccel *accel = build_spheres();
    print_measured("build-spheres-stack", used_stack(stack));
    stack = paint_stack();
    check_spheres(accel, RT_NONE, 1);
    print_measured("spheres-stack", used_stack(stack));
    stack = paint_stack();
    const RtAccel *both = build_instances(accel);
    print_measured("build-instances-stack", used_stack(stack));
    stack = paint_stack();
    check_spheres(both, 1, 2);
    print_measured("instances-stack", used_stack(stack));
    board_print("passed\n");
    return 0;
}
