/* Embree 4 for src/embree4.rs, loaded while the program runs, since it may stand beside Embree 3.
 *
 * Its rays lie in memory as those of Embree 3, and so do the numbers of its enums that are used here; only queries take
 * other arguments. One ray at a time, in a device of one thread, with flush-to-zero as it asks.
 */
#ifndef BENCH_EMBREE4_H
#define BENCH_EMBREE4_H

#include "embree.h"

typedef struct BenchEmbree4 BenchEmbree4;

/* A scene on the library at `path`; null if it cannot be had. `quality` and `flags` as in embree.h. */
BenchEmbree4 *bench_embree4_new(const char *path, int quality, int flags);
/* Copies a mesh. Zero on success. */
int bench_embree4_mesh(BenchEmbree4 *, const float *vertices, size_t vertex_count,
                       const uint32_t *indices, size_t triangle_count);
/* Copies spheres, each x y z radius. */
int bench_embree4_spheres(BenchEmbree4 *, const float *spheres, size_t count);
/* The build. */
int bench_embree4_commit(BenchEmbree4 *);
/* Bytes that the device has allocated. */
size_t bench_embree4_bytes(const BenchEmbree4 *);
void bench_embree4_free(BenchEmbree4 *);
void bench_embree4_closest(BenchEmbree4 *, const BenchRay *, BenchHit *, size_t count);
void bench_embree4_any(BenchEmbree4 *, const BenchRay *, uint8_t *occluded, size_t count);

#endif
