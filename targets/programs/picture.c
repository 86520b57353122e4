// A picture of a scene that lies in flash, traced with nothing but the stack. The bytes it prints are the same everywhere.

#include "board.h"
#include "raykern.h"
#include "scene.h"
#include "stack.h"
#include "text.h"

enum { WIDTH = 48, HEIGHT = 32 };

static const float eye[3] = {2.6f, -3.4f, 2.4f}, light[3] = {1.5f, -0.5f, 3.0f};
// Where the eye looks, and from the middle of the picture to its right and upper edges.
static const float ahead[3] = {-2.5f, 3.25f, -1.875f}, right[3] = {1.25f, 0.9375f, 0}, up[3] = {-0.375f, 0.5f, 0.75f};

// FNV-1a.
static void add(uint32_t *hash, uint32_t word) {
    for (int i = 0; i < 4; i++, word >>= 8) *hash = (*hash ^ (word & 255)) * 0x01000193u;
}

static uint32_t bits(float x) {
    union {
        float number;
        uint32_t bits;
    } u = {x};
    return u.bits;
}

typedef struct Cost {
    uint64_t instructions;
    uint32_t rays, most;
} Cost;

static void count(Cost *cost, uint32_t from, uint32_t to) {
    uint32_t spent = board_instructions(from, to);
    cost->instructions += spent;
    cost->rays++;
    if (spent > cost->most) cost->most = spent;
}

static void print_cost(const char *average, const char *most, const Cost *cost) {
    print_measured(average, (uint32_t)(cost->instructions / cost->rays));
    print_measured(most, cost->most);
}

// From the eye through a pixel.
static RtRay primary(int x, int y) {
    float s = (float)(2 * x + 1 - WIDTH) / WIDTH, t = (float)(HEIGHT - 2 * y - 1) / HEIGHT;
    RtRay ray = {{eye[0], eye[1], eye[2]}, 0, {0}, 1e30f};
    for (int k = 0; k < 3; k++) ray.direction[k] = ahead[k] + (s * right[k] + t * up[k]);
    return ray;
}

// From just before a hit to the light.
static RtRay shadow(const RtRay *ray, const RtHit *hit) {
    RtRay to_light = {{0}, 0, {0}, 1};
    float t = hit->t - 0.0009765625f;
    for (int k = 0; k < 3; k++) {
        to_light.origin[k] = ray->origin[k] + t * ray->direction[k];
        to_light.direction[k] = light[k] - to_light.origin[k];
    }
    return to_light;
}

// The brightness of a pixel, between 0 and 255.
static uint32_t pixel(const RtAccel *accel, int x, int y, uint32_t *hash, Cost *closest, Cost *any) {
    RtRay ray = primary(x, y);
    RtHit hit;
    uint32_t from = board_clock();
    bool is_hit = rt_intersect(accel, &ray, &hit);
    count(closest, from, board_clock());
    add(hash, bits(hit.t)), add(hash, bits(hit.u)), add(hash, bits(hit.v)), add(hash, hit.prim);
    if (!is_hit) return 200 + (uint32_t)y;
    RtRay to_light = shadow(&ray, &hit);
    from = board_clock();
    bool is_dark = rt_occluded(accel, &to_light);
    count(any, from, board_clock());
    // Each triangle has a grey of its own.
    uint32_t grey = 80 + (hit.prim * 2654435761u >> 25);
    return is_dark ? grey / 3 : grey;
}

int main(void) {
    const RtAccel *accel;
    RtStatus status = rt_accel_open(scene, (size_t)(scene_end - scene), &accel);
    if (status != RT_OK) {
        board_print("refused: ");
        board_print(rt_status_message(status));
        board_print("\n");
        return status != RT_ERROR_BYTE_ORDER;
    }
    uint32_t hash = 0x811C9DC5u;
    Cost closest = {0}, any = {0};
    Stack stack = paint_stack();
    for (int y = 0; y < HEIGHT; y++) {
        for (int x = 0; x < WIDTH; x++) {
            uint32_t grey = pixel(accel, x, y, &hash, &closest, &any);
            print_hex(grey, 2);
            add(&hash, grey);
        }
        board_print("\n");
    }
    board_print("hash ");
    print_hex(hash, 8);
    board_print("\n");
    print_measured("stack", used_stack(stack));
    print_cost("closest", "closest-most", &closest);
    print_cost("any", "any-most", &any);
    return 0;
}
