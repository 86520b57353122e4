// The first hit from C. Build: cc first_ray.c $(pkg-config --cflags --libs raykern)

#include <raykern.h>
#include <stdio.h>
#include <stdlib.h>

int main(void) {
    const float vertices[] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    RtMesh mesh = {.vertices = vertices, .vertex_count = 3, .triangle_count = 1};
    RtScene scene = {.struct_size = sizeof scene, .mesh_count = 1, .meshes = &mesh};
    RtMemory need;
    if (rt_bvh_needs(&scene, NULL, &need) != RT_OK) return 1;
    void *memory = aligned_alloc(need.alignment, need.size);
    const RtAccel *accel;
    if (!memory || rt_build_bvh(&scene, NULL, memory, need.size, &accel) != RT_OK) return 1;

    RtRay ray = {.origin = {0.25f, 0.25f, 2}, .direction = {0, 0, -1}, .t_max = 1e30f};
    RtHit hit;
    if (!rt_intersect(accel, &ray, &hit) || hit.t != 2) return 1;
    printf("triangle %u at t = %g\n", (unsigned)hit.prim, (double)hit.t);
    free(memory);
    return 0;
}
