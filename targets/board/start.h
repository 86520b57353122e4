// What every board does before main: variables from flash to RAM.

#ifndef START_H
#define START_H

#include <stdint.h>

extern uint32_t data_in_flash[], data_start[], data_end[], bss_start[], bss_end[], stack_limit[], stack_top[];
int main(void);

static inline void copy_variables(void) {
    const uint32_t *from = data_in_flash;
    for (uint32_t *to = data_start; to < data_end;) *to++ = *from++;
    for (uint32_t *to = bss_start; to < bss_end;) *to++ = 0;
}

// Calls of semihosting, by which a debugger or an emulator serves a board.
enum { SEMIHOSTING_WRITE0 = 4, SEMIHOSTING_EXIT = 0x18, STOPPED = 0x20026, FAILED = 0x20023 };

#endif
