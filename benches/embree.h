/* A narrow face of Embree 3 for src/embree.rs: one scene of triangles, three ways to ask.
 *
 * Every call that traces sets flush-to-zero and denormals-are-zero, as Embree asks, and restores
 * the caller's state. Rays must be finite but for `t_max`.
 */
#ifndef BENCH_EMBREE_H
#define BENCH_EMBREE_H

#include <stddef.h>
#include <stdint.h>

/* As `raykern::Ray` and `raykern::Hit`. */
typedef struct { float origin[3], t_min, direction[3], t_max; } BenchRay;
typedef struct { float t, u, v; uint32_t prim, geometry, instance; } BenchHit;

typedef struct BenchEmbree BenchEmbree;
typedef struct BenchBatch BenchBatch;

/* The version whose header this was compiled with, such as 31305. */
int bench_embree_version(void);
/* A device of one thread. `config` is appended to its settings; `quality` is 0 low, 1 medium,
 * 2 high; `flags` are those of a scene. Null when the device cannot be had. */
BenchEmbree *bench_embree_new(const char *config, int quality, int flags);
/* Copies a mesh into buffers of Embree's own, padded as its loads need. */
int bench_embree_mesh(BenchEmbree *, const float *vertices, size_t vertex_count,
                      const uint32_t *indices, size_t triangle_count);
/* Copies spheres, each x y z radius. */
int bench_embree_spheres(BenchEmbree *, const float *spheres, size_t count);
/* Before the mesh: it will move, and is followed by refitting or by building anew. */
void bench_embree_moving(BenchEmbree *, int refit);
/* Copies other places for the vertices of the first mesh. */
void bench_embree_move(BenchEmbree *, const float *vertices, size_t vertex_count);
/* The build. Zero on success. */
int bench_embree_commit(BenchEmbree *);
/* After the build: the scene becomes one of so many instances of itself, each with a map of three rows of four. */
int bench_embree_instance(BenchEmbree *, const float *maps, size_t count);
/* Other maps for these. */
void bench_embree_place(BenchEmbree *, const float *maps, size_t count);
/* Bytes that the device has allocated, the copied meshes included. */
size_t bench_embree_bytes(const BenchEmbree *);
void bench_embree_free(BenchEmbree *);

/* One ray at a time: rtcIntersect1 and rtcOccluded1. */
void bench_embree_closest(BenchEmbree *, const BenchRay *, BenchHit *, size_t count);
void bench_embree_any(BenchEmbree *, const BenchRay *, uint8_t *occluded, size_t count);

/* The closest triangle of each point by rtcPointQuery: its distance is the `t` of a hit. */
void bench_embree_points(BenchEmbree *, const float *points, BenchHit *, size_t count);

/* Many rays in Embree's own layout. `width` is 8 or 16 for packets, 1 for a stream. */
BenchBatch *bench_batch_new(const BenchRay *, size_t count, int width, int any);
void bench_batch_run(BenchEmbree *, BenchBatch *, int coherent);
void bench_batch_hits(const BenchBatch *, BenchHit *);
void bench_batch_occluded(const BenchBatch *, uint8_t *);
void bench_batch_free(BenchBatch *);

#endif
