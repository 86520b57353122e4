// What holds in a program, without a C library.

#ifndef CHECK_H
#define CHECK_H

#include "board.h"
#include "text.h"

#define CHECK(condition)                      \
    do {                                      \
        if (!(condition)) {                   \
            board_print("not so, line ");     \
            print_number(__LINE__);           \
            board_print(": " #condition "\n"); \
            board_exit(1);                    \
        }                                     \
    } while (0)

#endif
