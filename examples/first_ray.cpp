// The first hit from C++17. Build: c++ -std=c++17 first_ray.cpp $(pkg-config --cflags --libs raykern)

#include <raykern.h>

#include <cstdio>
#include <new>
#include <vector>

int main() {
    std::vector<float> vertices{0, 0, 0, 1, 0, 0, 0, 1, 0};
    RtMesh mesh{};
    mesh.vertices = vertices.data();
    mesh.vertex_count = 3;
    mesh.triangle_count = 1;
    RtScene scene{};
    scene.struct_size = sizeof scene;
    scene.mesh_count = 1;
    scene.meshes = &mesh;
    RtMemory need;
    if (rt_bvh_needs(&scene, nullptr, &need) != RT_OK) return 1;
    void *memory = ::operator new(need.size, std::align_val_t(need.alignment));
    const RtAccel *accel;
    if (rt_build_bvh(&scene, nullptr, memory, need.size, &accel) != RT_OK) return 1;

    RtRay ray{{0.25f, 0.25f, 2}, 0, {0, 0, -1}, 1e30f};
    RtHit hit;
    if (!rt_intersect(accel, &ray, &hit) || hit.t != 2) return 1;
    std::printf("triangle %u at t = %g\n", static_cast<unsigned>(hit.prim), static_cast<double>(hit.t));

    ::operator delete(memory, std::align_val_t(need.alignment));
    return 0;
}
