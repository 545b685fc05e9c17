/* An LD06's data line at GP1 (UART 0, 230400 baud), poses on USB. */
#include <stdio.h>

#include "beamfix.h"
#include "hardware/irq.h"
#include "hardware/uart.h"
#include "pico/stdlib.h"

static uint64_t storage[BEAMFIX_ODOMETRY_BYTES / 8];

/* What comes while a revolution is matched: 4 KB are 180 ms of the line. */
static uint8_t ring[4096];
static volatile uint32_t written;
static uint32_t taken;

static void received(void) {
    while (uart_is_readable(uart0)) {
        ring[written % sizeof ring] = (uint8_t)uart_getc(uart0);
        written++;
    }
}

int main(void) {
    beamfix *robot;
    beamfix_step step;
    stdio_init_all();
    uart_init(uart0, beamfix_lidar_baud(&BEAMFIX_LDROBOT_LD06));
    gpio_set_function(1, GPIO_FUNC_UART);
    irq_set_exclusive_handler(UART0_IRQ, received);
    irq_set_enabled(UART0_IRQ, true);
    uart_set_irq_enables(uart0, true, false);
    if (beamfix_make_odometry(storage, sizeof storage, &BEAMFIX_LDROBOT_LD06, NULL, &robot) != BEAMFIX_STATUS_OK) {
        panic("no odometry");
    }
    for (;;) {
        uint32_t there = written - taken;
        size_t count = there, done = 0;
        if (there > sizeof ring) { /* bytes were overwritten */
            taken = written;
            continue;
        }
        if (count > sizeof ring - taken % sizeof ring) {
            count = sizeof ring - taken % sizeof ring;
        }
        if (beamfix_push_lidar(robot, time_us_32(), ring + taken % sizeof ring, count, &done, &step) == BEAMFIX_STATUS_STEP) {
            printf("%.3f %.3f %.4f %s\n", step.x, step.y, step.theta,
                   step.verdict == BEAMFIX_VERDICT_MEASURED ? "measured" : "predicted");
        }
        taken += done;
    }
}
