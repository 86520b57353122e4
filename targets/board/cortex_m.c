// A Cortex-M with semihosting: vector table, reset, console, and SysTick as a counter.

#include "board.h"
#include "start.h"

static uint32_t semihosting(uint32_t call, const void *argument) {
    register uint32_t r0 __asm__("r0") = call;
    register const void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

void board_print(const char *text) { semihosting(SEMIHOSTING_WRITE0, text); }

void board_exit(int status) {
    semihosting(SEMIHOSTING_EXIT, (const void *)(status == 0 ? STOPPED : FAILED));
    for (;;) {}
}

uint32_t *board_stack_limit(void) { return stack_limit; }

// SysTick counts down in 24 bits. One instruction takes a nanosecond of the emulated time, one tick TICK of them.
#define SYSTICK ((volatile uint32_t *)0xE000E010u)
enum { CONTROL, RELOAD, VALUE };

static void start_counter(void) {
    SYSTICK[RELOAD] = 0xFFFFFF;
    SYSTICK[VALUE] = 0;
    SYSTICK[CONTROL] = 5;
}

uint32_t board_clock(void) { return SYSTICK[VALUE]; }
uint32_t board_instructions(uint32_t from, uint32_t to) { return ((from - to) & 0xFFFFFF) * TICK; }

void reset(void);

void reset(void) {
#if defined(__ARM_FP)
    // Gives access to the FPU, which nobody has after a reset.
    *(volatile uint32_t *)0xE000ED88u |= 0xFu << 20;
    __asm__ volatile("dsb\n\tisb");
#endif
    copy_variables();
    start_counter();
    board_exit(main());
}

static void fault(void) {
    board_print("fault\n");
    board_exit(1);
}

typedef void (*Vector)(void);

__attribute__((section(".vectors"), used)) static const Vector vectors[16] = {
    (Vector)stack_top, reset, fault, fault, fault, fault, fault, 0, 0, 0, 0, fault, fault, 0, fault, fault,
};
