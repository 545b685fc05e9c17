/* An LD06's data line at GPIO 4 of an ESP32-C3 or C6 (UART 1, 230400 baud), poses on the console. */
#include <stdio.h>

#include "beamfix.h"
#include "driver/uart.h"
#include "esp_timer.h"

static uint64_t storage[BEAMFIX_ODOMETRY_BYTES / 8];

/* A match takes 3 KB of stack: more than the main task's default of 3584 bytes leaves. */
static void run(void *unused) {
    static uint8_t bytes[256];
    beamfix *robot;
    beamfix_step step;
    (void)unused;
    ESP_ERROR_CHECK(beamfix_make_odometry(storage, sizeof storage, &BEAMFIX_LDROBOT_LD06, NULL, &robot) == BEAMFIX_STATUS_OK ? ESP_OK : ESP_FAIL);
    for (;;) {
        int count = uart_read_bytes(UART_NUM_1, bytes, sizeof bytes, pdMS_TO_TICKS(10));
        uint32_t now_us = (uint32_t)esp_timer_get_time();
        for (size_t at = 0; count > 0 && at < (size_t)count;) {
            size_t taken;
            beamfix_status status = beamfix_push_lidar(robot, now_us, bytes + at, (size_t)count - at, &taken, &step);
            at += taken;
            if (status == BEAMFIX_STATUS_STEP) {
                printf("%.3f %.3f %.4f %s\n", step.x, step.y, step.theta,
                       step.verdict == BEAMFIX_VERDICT_MEASURED ? "measured" : "predicted");
            }
        }
    }
}

void app_main(void) {
    uart_config_t line = {
        .baud_rate = (int)beamfix_lidar_baud(&BEAMFIX_LDROBOT_LD06),
        .data_bits = UART_DATA_8_BITS,
        .parity = UART_PARITY_DISABLE,
        .stop_bits = UART_STOP_BITS_1,
    };
    ESP_ERROR_CHECK(uart_driver_install(UART_NUM_1, 4096, 0, 0, NULL, 0));
    ESP_ERROR_CHECK(uart_param_config(UART_NUM_1, &line));
    ESP_ERROR_CHECK(uart_set_pin(UART_NUM_1, UART_PIN_NO_CHANGE, 4, UART_PIN_NO_CHANGE, UART_PIN_NO_CHANGE));
    xTaskCreate(run, "pose", 6144, NULL, 5, NULL);
}
