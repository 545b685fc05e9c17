/* Bytes of an LD06 to poses: reads them to their end, prints a line for the last pose and the hash of all.
 *
 * On a PC:        cc replay.c -Iinclude libbeamfix.a -o replay && ./replay < capture.bin
 * On a board:     the same, with the functions of platform.h over its UART
 */
#include "beamfix.h"
#include "platform.h"

/* The library's memory, aligned by its type: odometry for an LD06 in 12 KB. */
#define BYTES BEAMFIX_LDROBOT_SMALL_ODOMETRY_BYTES
static uint64_t storage[(BYTES + 7) / 8];

/* FNV-1a over the bits of x, y and theta of every pose: equal only where every bit is. */
static uint64_t hash = UINT64_C(0xcbf29ce484222325);

static void hash_in(float number) {
    union {
        float number;
        uint32_t bits;
    } word;
    int k;
    word.number = number;
    for (k = 0; k < 4; k++) {
        hash = (hash ^ (word.bits & 0xff)) * UINT64_C(0x00000100000001b3);
        word.bits >>= 8;
    }
}

static void print_hash(uint32_t poses) {
    static const char digits[] = "0123456789abcdef";
    static char line[] = "0000000000000000 00000000\n";
    int k;
    for (k = 0; k < 16; k++) {
        line[k] = digits[(hash >> (60 - 4 * k)) & 15];
    }
    for (k = 0; k < 8; k++) {
        line[17 + k] = digits[(poses >> (28 - 4 * k)) & 15];
    }
    platform_print(line);
}

int main(void) {
    beamfix *robot;
    beamfix_step step;
    beamfix_health health;
    uint8_t bytes[16]; /* Small: on a board of 16 KB the stack has 4.1 KB. */
    uint32_t poses = 0;
    size_t count;
    if (beamfix_make_odometry_small(storage, sizeof storage, &BEAMFIX_LDROBOT_LD06, NULL, &robot) != BEAMFIX_STATUS_OK) {
        platform_print("no odometry\n");
        return 1;
    }
    while ((count = platform_read(bytes, sizeof bytes)) > 0) {
        size_t at = 0;
        uint32_t now_us = platform_now_us();
        while (at < count) {
            size_t taken;
            beamfix_status status = beamfix_push_lidar(robot, now_us, bytes + at, count - at, &taken, &step);
            if (status < 0) {
                platform_print("an error\n");
                return 1;
            }
            at += taken;
            if (status == BEAMFIX_STATUS_STEP) {
                hash_in(step.x);
                hash_in(step.y);
                hash_in(step.theta);
                poses++;
            }
        }
    }
    if (beamfix_get_health(robot, &health) != BEAMFIX_STATUS_OK || health.revolutions != poses) {
        platform_print("poses are missing\n");
        return 1;
    }
    print_hash(poses);
    return 0;
}
