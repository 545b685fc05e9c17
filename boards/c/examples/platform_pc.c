/* A PC: bytes from standard input, text to standard output. The clock stands, as the replay of a capture without times has it. */
#include "platform.h"

#include <stdio.h>

size_t platform_read(uint8_t *bytes, size_t most) {
    return fread(bytes, 1, most, stdin);
}

uint32_t platform_now_us(void) {
    return 0;
}

void platform_print(const char *text) {
    fputs(text, stdout);
}
