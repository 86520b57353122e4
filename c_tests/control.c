// The caller's floating-point state. Whatever it is, every call gives the bits it gives under the
// default state, no trap fires, and the state is afterwards what it was: control bits always, sticky
// flags too unless the control bits are the default ones, and then no flag is taken away.

#define _GNU_SOURCE
#include "check.h"
#include "control_scenes.h"

#include <fenv.h>
#if defined(__SSE2__)
#include <xmmintrin.h>
#endif

#if defined(__GLIBC__)
#define TRAPS() fegetexcept()
#else
#define TRAPS() 0
#endif

// What the program can see of the state. On x86 the first member is MXCSR as it stands.
typedef struct State {
    unsigned control, flags;
    int rounding, traps;
} State;

static State state(void) {
    State now = {0, 0, 0, 0};
#if defined(__SSE2__)
    now.control = _mm_getcsr() & ~0x3Fu;
    now.flags = _mm_getcsr() & 0x3Fu;
#else
    now.flags = (unsigned)fetestexcept(FE_ALL_EXCEPT);
#endif
    now.rounding = fegetround();
    now.traps = TRAPS();
    return now;
}

static State usual;
static unsigned long calls;

// Makes one call and looks at the state before and after it.
#define KEEP(call)                                                                       \
    do {                                                                                 \
        State before = state();                                                          \
        call;                                                                            \
        State after = state();                                                           \
        bool is_usual = before.control == usual.control && before.traps == usual.traps   \
                        && before.rounding == usual.rounding;                            \
        CHECK(after.control == before.control && after.rounding == before.rounding);     \
        CHECK(after.traps == before.traps);                                              \
        CHECK(is_usual ? (after.flags & before.flags) == before.flags                    \
                       : after.flags == before.flags);                                   \
        calls++;                                                                         \
    } while (0)

#define PRECISIONS 2

// All answers about one structure, without padding between the bits that matter.
typedef struct Answers {
    RtMemory need;
    RtInfo info;
    RtHit plain[RAYS], batch[RAYS], with[PRECISIONS][RAYS], batch_with[PRECISIONS][RAYS];
    RtSurface surface[RAYS];
    uint8_t occluded[RAYS], occluded_batch[RAYS];
    uint8_t occluded_with[PRECISIONS][RAYS], occluded_batch_with[PRECISIONS][RAYS];
    RtStatus located[RAYS];
    size_t size;
} Answers;

enum { LIST, GRID, BVH, STRUCTURES };

static Subject subjects[SCENES];
static Answers expected[SCENES][STRUCTURES], answers;
static unsigned char *expected_blocks[SCENES][STRUCTURES];

// Builds into `memory`, or into new memory when there is none.
static const RtAccel *build(const Subject *s, int structure, unsigned char *memory) {
    RtBuildOptions options = {0};
    options.struct_size = sizeof options;
    options.plain_list = structure == LIST ? RT_PLAIN_LIST_ALWAYS : RT_PLAIN_LIST_NEVER;
    RtStatus status;
    const RtAccel *accel = NULL;
    KEEP(status = (structure == GRID ? rt_grid_needs : rt_bvh_needs)(&s->scene, &options, &answers.need));
    CHECK(status == RT_OK);
    if (memory == NULL) memory = aligned(answers.need.size);
    KEEP(status = (structure == GRID ? rt_build_grid : rt_build_bvh)(&s->scene, &options, memory,
                                                                     answers.need.size, &accel));
    CHECK(status == RT_OK);
    KEEP(answers.size = rt_accel_size(accel));
    return accel;
}

// Asks everything that can be asked about the accel.
static void ask(const Subject *s, const RtAccel *accel) {
    RtStatus status;
    const RtAccel *opened = NULL;
    bool found;
    KEEP(status = rt_accel_open(accel, answers.size, &opened));
    CHECK(status == RT_OK && opened == accel);
    answers.info.struct_size = sizeof answers.info;
    KEEP(status = rt_accel_info(accel, &answers.info));
    CHECK(status == RT_OK);
    for (uint32_t i = 0; i < RAYS; i++) {
        const RtRay *ray = &s->rays[i];
        KEEP(found = rt_intersect(accel, ray, &answers.plain[i]));
        CHECK(found == (answers.plain[i].prim != RT_NONE));
        KEEP(answers.occluded[i] = rt_occluded(accel, ray));
        answers.surface[i].struct_size = sizeof(RtSurface);
        KEEP(answers.located[i] = rt_hit_surface(accel, ray, &answers.plain[i], &answers.surface[i]));
        CHECK(answers.located[i] == (found ? RT_OK : RT_ERROR_NOT_FOUND));
    }
    KEEP(rt_intersect_batch(accel, s->rays, answers.batch, RAYS));
    KEEP(rt_occluded_batch(accel, s->rays, answers.occluded_batch, RAYS));
    for (uint32_t p = 0; p < PRECISIONS; p++) {
        RtQuery query = {0};
        query.struct_size = sizeof query;
        query.precision = p;
        KEEP(status = rt_query_check(&query));
        CHECK(status == RT_OK);
        for (uint32_t i = 0; i < RAYS; i++) {
            KEEP(found = rt_intersect_with(accel, &s->rays[i], &query, &answers.with[p][i]));
            KEEP(answers.occluded_with[p][i] = rt_occluded_with(accel, &s->rays[i], &query));
            CHECK(found == answers.occluded_with[p][i]);
            if (p != RT_PRECISION_WATERTIGHT) continue;
            // The same by the calls that link nothing else.
            RtHit hit;
            bool met, hidden;
            KEEP(met = rt_intersect_watertight(accel, &s->rays[i], &hit));
            KEEP(hidden = rt_occluded_watertight(accel, &s->rays[i]));
            CHECK(met == found && hidden == found);
            CHECK(memcmp(&hit, &answers.with[p][i], sizeof hit) == 0);
        }
        KEEP(status = rt_intersect_batch_with(accel, s->rays, 0, &query, answers.batch_with[p], 0, RAYS));
        CHECK(status == RT_OK);
        KEEP(status = rt_occluded_batch_with(accel, s->rays, 0, &query, answers.occluded_batch_with[p], 0, RAYS));
        CHECK(status == RT_OK);
    }
}

// The first run: what is compared with. Exact answers do not depend on the structure or the call.
static void learn(void) {
    uint32_t hits = 0, ties = 0;
    for (int k = 0; k < SCENES; k++) {
        for (int structure = 0; structure < STRUCTURES; structure++) {
            memset(&answers, 0, sizeof answers);
            const RtAccel *accel = build(&subjects[k], structure, NULL);
            ask(&subjects[k], accel);
            CHECK(memcmp(answers.plain, answers.with[0], sizeof answers.plain) == 0);
            CHECK(memcmp(answers.plain, answers.batch, sizeof answers.plain) == 0);
            CHECK(memcmp(answers.plain, answers.batch_with[0], sizeof answers.plain) == 0);
            CHECK(memcmp(answers.plain, expected[k][0].plain, sizeof answers.plain) == 0 || structure == 0);
            expected_blocks[k][structure] = (unsigned char *)accel;
            expected[k][structure] = answers;
        }
        for (int i = 0; i < RAYS; i++) {
            const RtHit *hit = &expected[k][LIST].plain[i];
            hits += hit->prim != RT_NONE;
            // The same ray without the triangle that was hit: its double is hit at the same t.
            RtQuery query = {sizeof query, 0, 0, 0, 1, hit->prim, hit->geometry, RT_NONE};
            RtHit other;
            bool more = rt_intersect_with((const RtAccel *)expected_blocks[k][BVH], &subjects[k].rays[i],
                                          &query, &other);
            ties += hit->prim != RT_NONE && more && memcmp(&other.t, &hit->t, sizeof other.t) == 0;
        }
    }
    CHECK(hits > SCENES * RAYS / 3 && ties > SCENES * RAYS / 5);
}

// Everything again under the state that is set; no float arithmetic of our own.
static void check_state(bool builds) {
    static unsigned char *memory, *copy;
    for (int k = 0; k < SCENES; k++) {
        for (int structure = 0; structure < STRUCTURES; structure++) {
            const Answers *right = &expected[k][structure];
            memset(&answers, 0, sizeof answers);
            answers.need = right->need;
            answers.size = right->size;
            const RtAccel *accel = (const RtAccel *)expected_blocks[k][structure];
            if (builds) {
                if (memory == NULL) memory = aligned(1 << 20), copy = aligned(1 << 20);
                CHECK(right->need.size <= 1 << 20);
                memset(memory, 0xA5, right->need.size);
                accel = build(&subjects[k], structure, memory);
                CHECK(answers.size == right->size);
                CHECK(memcmp(accel, expected_blocks[k][structure], right->size) == 0);
                const RtAccel *packed = NULL;
                RtStatus status;
                KEEP(status = rt_accel_pack(accel, copy, 1 << 20, &packed));
                CHECK(status == RT_OK && memcmp(packed, accel, right->size) == 0);
            }
            ask(&subjects[k], accel);
            CHECK(memcmp(&answers, right, sizeof answers) == 0);
        }
    }
}

#if defined(__SSE2__)
// MXCSR: rounding, FTZ and DAZ in all combinations with all traps and with none, sticky flags set in
// every second one; and each trap alone.
static void check_mxcsr(void) {
    unsigned before = _mm_getcsr();
    for (unsigned i = 0; i < 4 * 2 * 2 * 8; i++) {
        unsigned rounding = i % 4, flush = i / 4 % 2, daz = i / 8 % 2, traps = i / 16;
        unsigned flags = (rounding + flush + daz + traps) % 2;
        // Each trap alone in two combinations only: enough to see it fire.
        if (traps > 1 && (rounding != 0 || flush != daz)) continue;
        unsigned enabled = traps == 0 ? 0 : traps == 1 ? 0x3F : 1u << (traps - 2);
        unsigned bits = rounding << 13 | flush << 15 | daz << 6 | (flags ? 0x3F : 0) | (0x3F & ~enabled) << 7;
        _mm_setcsr(bits);
        check_state(traps < 2);
        unsigned after = _mm_getcsr();
        _mm_setcsr(before);
        bool is_usual = (bits & ~0x3Fu) == 0x1F80;
        CHECK(is_usual ? (after & ~0x3Fu) == 0x1F80 && (after & bits) == bits : after == bits);
    }
}
#endif

// What <fenv.h> can set, on any processor: rounding, sticky flags, and with glibc traps.
static void check_fenv(void) {
    static const int modes[4] = {FE_TONEAREST, FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO};
    static const int raised[3] = {0, FE_ALL_EXCEPT, FE_OVERFLOW | FE_INEXACT};
    for (int i = 0; i < 4 * 3 + 4; i++) {
        // No flags with traps: a flag of the x87 that is set traps as soon as its trap is enabled.
        int mode = modes[i % 4], flags = i < 12 ? raised[i / 4] : 0;
        feclearexcept(FE_ALL_EXCEPT);
        feraiseexcept(flags);
        CHECK(fesetround(mode) == 0);
        int had = fetestexcept(FE_ALL_EXCEPT);
#if defined(__GLIBC__)
        // Where the processor has no traps, this is refused and nothing changes.
        if (i >= 12) feenableexcept(FE_ALL_EXCEPT);
#endif
        int traps = TRAPS();
        check_state(i % 5 == 0);
        int round_after = fegetround(), traps_after = TRAPS(), has = fetestexcept(FE_ALL_EXCEPT);
#if defined(__GLIBC__)
        fedisableexcept(FE_ALL_EXCEPT);
#endif
        fesetround(FE_TONEAREST);
        feclearexcept(FE_ALL_EXCEPT);
        CHECK(round_after == mode && traps_after == traps);
        CHECK(mode == FE_TONEAREST && traps == 0 ? (has & had) == had : has == had);
    }
}

int main(void) {
    make_subjects(subjects);
    usual = state();
    learn();
    check_fenv();
#if defined(__SSE2__)
    check_mxcsr();
#endif
    // At the end the default state again: nothing of the rest has stuck.
    check_state(true);
    printf("%lu calls\n", calls);
    return 0;
}
