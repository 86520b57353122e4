// The scene of the picture, as it was baked, in flash.

#ifndef SCENE_H
#define SCENE_H

// Read by the assembler, which takes less time than an array of numbers. Names that are not global would be one in the
// tables of addresses of AArch64.
__asm__(".section .rodata.scene, \"a\"\n\t"
        ".globl scene, scene_end\n\t"
        ".balign 64\n"
        "scene:\n\t"
        ".incbin \"scene.block\"\n"
        "scene_end:\n\t"
        ".section .note.GNU-stack, \"\", %progbits\n\t"
        ".text\n");
extern const unsigned char scene[], scene_end[];

#endif
