/* A YDLIDAR that keeps the angle of its own zero: started, then its bytes from standard input to poses, every bit of them printed.
 * With an argument, the zero that it told is left out. The unit at the other end of the line is in this file. */
#include "beamfix.h"

#include <stdio.h>
#include <string.h>

static uint64_t storage[BEAMFIX_ODOMETRY_BYTES / 8];
static uint64_t start[BEAMFIX_STARTUP_BYTES / 8];

/* What the unit answers: its model, that it is healthy, that its zero is 37 quarters of a degree back, that it measures. */
static const uint8_t info[] = {0xa5, 0x5a, 20, 0, 0, 0, 4, 100, 1, 2, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
static const uint8_t health[] = {0xa5, 0x5a, 3, 0, 0, 0, 6, 0, 0, 0};
static const uint8_t zero[] = {0xa5, 0x5a, 4, 0, 0, 0, 4, 0xdb, 0xff, 0xff, 0xff};
static const uint8_t scan[] = {0xa5, 0x5a, 5, 0, 0, 0x40, 0x81};

static void answer(beamfix_startup *startup, const beamfix_action *action) {
    if (action->count != 2 || action->bytes[0] != 0xa5) {
        return;
    }
    switch (action->bytes[1]) {
    case 0x90: beamfix_push_startup(startup, info, sizeof info); break;
    case 0x91: beamfix_push_startup(startup, health, sizeof health); break;
    case 0x93: beamfix_push_startup(startup, zero, sizeof zero); break;
    case 0x60: beamfix_push_startup(startup, scan, sizeof scan); break;
    }
}

int main(int arguments, char **unused) {
    const beamfix_lidar *lidar = &BEAMFIX_YDLIDAR_G2;
    beamfix *robot;
    beamfix_startup *startup;
    beamfix_action action;
    beamfix_step step;
    uint32_t now_us = 0, words[3];
    uint8_t bytes[256];
    size_t count;
    (void)unused;
    if (beamfix_make_odometry(storage, sizeof storage, lidar, NULL, &robot) != BEAMFIX_STATUS_OK ||
        beamfix_make_startup(start, sizeof start, lidar, &startup) != BEAMFIX_STATUS_OK) {
        return 1;
    }
    do {
        beamfix_poll_startup(startup, now_us, &action);
        if (action.kind == BEAMFIX_ACTION_KIND_SEND) {
            answer(startup, &action);
        }
        now_us += 10000;
    } while (action.kind != BEAMFIX_ACTION_KIND_READY && action.kind != BEAMFIX_ACTION_KIND_FAILED);
    if (action.kind != BEAMFIX_ACTION_KIND_READY) {
        return 2;
    }
    if (arguments == 1 && beamfix_use_startup(robot, startup) != BEAMFIX_STATUS_OK) {
        return 3;
    }
    memset(start, 0xff, sizeof start);
    now_us = 0;
    while ((count = fread(bytes, 1, sizeof bytes, stdin)) > 0) {
        size_t at = 0, taken;
        now_us += 15677; /* this lidar has no clock: 97 972 bytes took 6 s */
        while (at < count) {
            if (beamfix_push_lidar(robot, now_us, bytes + at, count - at, &taken, &step) == BEAMFIX_STATUS_STEP) {
                memcpy(&words[0], &step.x, 4);
                memcpy(&words[1], &step.y, 4);
                memcpy(&words[2], &step.theta, 4);
                printf("%08x %08x %08x\n", (unsigned)words[0], (unsigned)words[1], (unsigned)words[2]);
            }
            at += taken;
        }
    }
    return 0;
}
