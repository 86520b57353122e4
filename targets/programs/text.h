// Texts without a C library.

#ifndef TEXT_H
#define TEXT_H

#include "board.h"

static inline void print_hex(uint32_t x, int digits) {
    char text[9];
    text[digits] = 0;
    for (int i = digits; i-- > 0; x >>= 4) text[i] = "0123456789abcdef"[x & 15];
    board_print(text);
}

static inline void print_number(uint32_t x) {
    char text[11], *at = text + 10;
    *at = 0;
    do *--at = (char)('0' + x % 10);
    while ((x /= 10) != 0);
    board_print(at);
}

// A line that the host need not repeat: a measurement.
static inline void print_measured(const char *name, uint32_t x) {
    board_print("# ");
    board_print(name);
    board_print(" ");
    print_number(x);
    board_print("\n");
}

#endif
