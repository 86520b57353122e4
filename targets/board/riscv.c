// A 32-bit RISC-V in machine mode with semihosting: reset, traps, console and the counter of instructions.

#include "board.h"
#include "start.h"

// Control registers are an extension that every such processor has, and compilers have to be told of.
#define WITH_CONTROL(instructions) ".option push\n\t.option arch, +zicsr\n\t" instructions "\n\t.option pop\n\t"

// The three instructions by which a debugger knows the call.
static uint32_t semihosting(uint32_t call, const void *argument) {
    register uint32_t a0 __asm__("a0") = call;
    register const void *a1 __asm__("a1") = argument;
    __asm__ volatile(".balign 16\n\t.option push\n\t.option norvc\n\t"
                     "slli x0, x0, 0x1f\n\tebreak\n\tsrai x0, x0, 7\n\t.option pop"
                     : "+r"(a0) : "r"(a1) : "memory");
    return a0;
}

void board_print(const char *text) { semihosting(SEMIHOSTING_WRITE0, text); }

void board_exit(int status) {
    semihosting(SEMIHOSTING_EXIT, (const void *)(status == 0 ? STOPPED : FAILED));
    for (;;) {}
}

uint32_t *board_stack_limit(void) { return stack_limit; }

uint32_t board_clock(void) {
    uint32_t count;
    __asm__ volatile(WITH_CONTROL("csrr %0, minstret") : "=r"(count));
    return count;
}

uint32_t board_instructions(uint32_t from, uint32_t to) { return to - from; }

__attribute__((used, aligned(4))) static void trap(void) {
    board_print("trap\n");
    board_exit(1);
}

__attribute__((used)) static void start(void) {
#if defined(__riscv_flen)
    // Switches the FPU on, in bits 13 and 14 of mstatus.
    __asm__ volatile(WITH_CONTROL("csrs mstatus, %0\n\tcsrw fcsr, x0") : : "r"(1u << 13));
#endif
    copy_variables();
    board_exit(main());
}

__asm__(".section .vectors, \"ax\"\n"
        ".globl reset\n"
        "reset:\n\t"
        "la sp, stack_top\n\t"
        "la t0, trap\n\t"
        WITH_CONTROL("csrw mtvec, t0")
        "j start\n\t"
        ".text\n");
