/* What the examples need of a board or a PC. */
#ifndef PLATFORM_H
#define PLATFORM_H

#include <stddef.h>
#include <stdint.h>

/* Bytes of the lidar: up to `most`; 0 at their end. */
size_t platform_read(uint8_t *bytes, size_t most);

/* The clock (us, wrapping). */
uint32_t platform_now_us(void);

/* Prints text. */
void platform_print(const char *text);

#endif
