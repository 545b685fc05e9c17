/* An emulated board: bytes from input.bin, text to standard output, through semihosting. No C library is needed. With SHOW_STACK the
 * program ends with a line that says how many bytes of the stack were never touched. */
#include "../examples/platform.h"

enum { SYS_OPEN = 1, SYS_WRITE0 = 4, SYS_READ = 6, SYS_EXIT = 0x18, SYS_EXIT_EXTENDED = 0x20 };

static uintptr_t semihost(uintptr_t operation, const void *arguments) {
#if defined(__riscv)
    register uintptr_t a0 __asm__("a0") = operation;
    register const void *a1 __asm__("a1") = arguments;
    /* The three instructions must lie in one page, uncompressed. */
    __asm__ volatile(".option push\n.option norvc\n.balign 16\nslli x0, x0, 0x1f\nebreak\nsrai x0, x0, 7\n.option pop"
                     : "+r"(a0) : "r"(a1) : "memory");
    return a0;
#else
    register uintptr_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = arguments;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
#endif
}

size_t platform_read(uint8_t *bytes, size_t most) {
    static uintptr_t file;
    uintptr_t arguments[3];
    if (file == 0) {
        static const char name[] = "input.bin";
        arguments[0] = (uintptr_t)name;
        arguments[1] = 1; /* binary */
        arguments[2] = sizeof name - 1;
        file = semihost(SYS_OPEN, arguments);
    }
    arguments[0] = file;
    arguments[1] = (uintptr_t)bytes;
    arguments[2] = most;
    return most - semihost(SYS_READ, arguments);
}

uint32_t platform_now_us(void) {
    return 0;
}

void platform_print(const char *text) {
    semihost(SYS_WRITE0, text);
}

extern uint32_t data_start[], data_end[], data_load[], bss_start[], bss_end[], stack_top[];

#if defined(SHOW_STACK)
enum { PAINT = 0xc5c5c5c5 };

/* Paints what is free below the caller's frame. */
static void paint_stack(void) {
    volatile uint32_t here = 0;
    volatile uint32_t *word;
    for (word = bss_end; word + 16 < &here; word++) {
        *word = PAINT;
    }
}

static void show_stack(void) {
    static char line[] = "stack left: 00000000\n";
    const volatile uint32_t *word;
    uint32_t left = 0;
    int k;
    for (word = bss_end; word < stack_top && *word == PAINT; word++) {
        left += sizeof *word;
    }
    for (k = 0; k < 8; k++) {
        line[12 + k] = "0123456789abcdef"[(left >> (28 - 4 * k)) & 15];
    }
    platform_print(line);
}
#endif

static void leave(int status) {
    static uintptr_t arguments[2] = {0x20026, 0}; /* the application's own exit */
    arguments[1] = (uintptr_t)status;
#if defined(SHOW_STACK)
    show_stack();
#endif
    semihost(SYS_EXIT_EXTENDED, arguments);
    for (;;) {
    }
}

int main(void);

/* Where the machine starts, once it has a stack. */
void start(void) {
    uint32_t *to;
    const uint32_t *from = data_load;
    for (to = data_start; to < data_end;) {
        *to++ = *from++;
    }
    for (to = bss_start; to < bss_end;) {
        *to++ = 0;
    }
#if defined(SHOW_STACK)
    paint_stack();
#endif
#if defined(__ARM_FP)
    /* The floating-point unit on: CPACR. */
    *(volatile uint32_t *)0xe000ed88 |= 0xfu << 20;
    __asm__ volatile("dsb\nisb");
#endif
    leave(main());
}

#if defined(__riscv)
__asm__(".section .vectors,\"ax\"\n.globl entry\nentry:\nla sp, stack_top\nj start\n");
#else
static void fault(void) {
    leave(99);
}
__attribute__((section(".vectors"), used)) static const uintptr_t vectors[16] = {
    (uintptr_t)stack_top, (uintptr_t)start, (uintptr_t)fault, (uintptr_t)fault,
};
#endif
