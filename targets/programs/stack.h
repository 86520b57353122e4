// How deep the stack has been: what is free is painted, and what has lost its paint was used.

#ifndef STACK_H
#define STACK_H

#include "board.h"

#include <stddef.h>

enum { PAINT = 0x5A5AA5A5 };

typedef struct Stack {
    uint32_t *top, *bottom;
} Stack;

// Paints what is below the caller's frame.
__attribute__((noinline)) static Stack paint_stack(void) {
    Stack stack = {NULL, NULL};
    uint32_t *limit = board_stack_limit();
    if (limit == NULL) return stack;
    stack.top = (uint32_t *)__builtin_frame_address(0);
    stack.bottom = limit;
    // Not the frame of this function.
    for (volatile uint32_t *at = stack.bottom; at < stack.top - 16; at++) *at = PAINT;
    return stack;
}

// The bytes that were used since then; a little more, as this function has a frame too.
static inline uint32_t used_stack(Stack stack) {
    if (stack.top == NULL) return 0;
    const volatile uint32_t *at = stack.bottom;
    while (at < stack.top && *at == PAINT) at++;
    return (uint32_t)(stack.top - at) * 4;
}

#endif
