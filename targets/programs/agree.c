// Runs the crate `agree` and prints its number.

#include "board.h"
#include "text.h"

#include <stddef.h>

size_t agree_room(void);
uint32_t agree(void *room, uint32_t rays);

static unsigned char room[2200000] __attribute__((aligned(64)));

int main(void) {
    if (agree_room() > sizeof room) return 1;
    board_print("answers ");
    uint32_t answers = agree(room, 400);
    print_hex(answers, 8);
    board_print("\n");
    return answers < 16;
}
