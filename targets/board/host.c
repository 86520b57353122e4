// A program for a board, run on the host instead.

#include "board.h"

#include <stdio.h>
#include <stdlib.h>

void board_print(const char *text) { fputs(text, stdout); }
void board_exit(int status) { exit(status); }
uint32_t board_clock(void) { return 0; }
uint32_t board_instructions(uint32_t from, uint32_t to) { return to - from; }
uint32_t *board_stack_limit(void) { return NULL; }
