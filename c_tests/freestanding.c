// No libc, no libm, no start-up files: Linux on x86-64 ends by a system call. Memory is static.

#include "raykern.h"

static unsigned char memory[4096] __attribute__((aligned(64)));

static int run(void) {
    static const float vertices[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    RtMesh mesh = {.vertices = vertices, .vertex_count = 3, .triangle_count = 1};
    RtScene scene = {.struct_size = sizeof scene, .mesh_count = 1, .meshes = &mesh};
    RtRay ray = {{0.25f, 0.25f, 2}, 0, {0, 0, -1}, 1e30f};
    RtHit hit;
    const RtAccel *accel;
    if (rt_build_bvh(&scene, 0, memory, sizeof memory, &accel) != RT_OK) return 1;
    if (!rt_intersect(accel, &ray, &hit) || hit.t != 2) return 2;
    if (rt_build_grid(&scene, 0, memory, sizeof memory, &accel) != RT_OK) return 3;
    return !rt_occluded(accel, &ray);
}

// What every compiler may call without being asked.
void *memcpy(void *to, const void *from, size_t n) {
    for (size_t i = 0; i < n; i++) ((volatile char *)to)[i] = ((const char *)from)[i];
    return to;
}
void *memmove(void *to, const void *from, size_t n) {
    if ((size_t)to <= (size_t)from) return memcpy(to, from, n);
    while (n-- > 0) ((volatile char *)to)[n] = ((const char *)from)[n];
    return to;
}
void *memset(void *to, int c, size_t n) {
    for (size_t i = 0; i < n; i++) ((volatile char *)to)[i] = (char)c;
    return to;
}
int memcmp(const void *a, const void *b, size_t n) {
    const unsigned char *x = a, *y = b;
    for (size_t i = 0; i < n; i++)
        if (x[i] != y[i]) return x[i] - y[i];
    return 0;
}
int bcmp(const void *a, const void *b, size_t n) { return memcmp(a, b, n); }

__attribute__((force_align_arg_pointer)) void _start(void) {
    long status = run();
    __asm__ volatile("syscall" : : "a"(60L), "D"(status) : "rcx", "r11", "memory");
    for (;;) {}
}
