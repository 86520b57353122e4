// What a program for a microcontroller asks of its board. host.c gives the same to a program on the host.

#ifndef BOARD_H
#define BOARD_H

#include <stdint.h>

// Prints a text.
void board_print(const char *text);

// Ends the program; 0 is success.
void board_exit(int status) __attribute__((noreturn));

// A clock, and how many instructions were run from one reading to a later one, less than half a thousand million. Under
// `-icount shift=0`; on the host it stands still.
uint32_t board_clock(void);
uint32_t board_instructions(uint32_t from, uint32_t to);

// The lowest address that the stack may have. Null on the host, where nobody measures it.
uint32_t *board_stack_limit(void);

#endif
