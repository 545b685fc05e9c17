/* Bytes of an LD06 to a map: reads them to their end, prints the hash of all poses, their number, the map's hash, and how many of its
 * cells hold something. For a controller with 300 KB of RAM. */
#include "beamfix.h"
#include "platform.h"

enum { WIDTH = 200, HEIGHT = 200 };

static uint64_t storage[(BEAMFIX_MAPPING_BYTES + 7) / 8];
static uint8_t cells[WIDTH * HEIGHT];

/* FNV-1a. */
static uint64_t hashed(uint64_t hash, uint8_t byte) {
    return (hash ^ byte) * UINT64_C(0x00000100000001b3);
}

static uint64_t hashed_number(uint64_t hash, float number) {
    union {
        float number;
        uint32_t bits;
    } word;
    int k;
    word.number = number;
    for (k = 0; k < 4; k++) {
        hash = hashed(hash, (uint8_t)(word.bits >> (8 * k)));
    }
    return hash;
}

static void write_number(char *to, uint64_t number, int digits) {
    while (digits-- > 0) {
        to[digits] = "0123456789abcdef"[number & 15];
        number >>= 4;
    }
}

int main(void) {
    static char line[] = "0000000000000000 00000000 0000000000000000 00000000\n";
    beamfix *robot;
    beamfix_step step;
    beamfix_extent extent;
    uint8_t bytes[16], done;
    uint64_t poses_hash = UINT64_C(0xcbf29ce484222325), map_hash = poses_hash;
    uint32_t poses = 0, occupied = 0;
    size_t count, k;
    if (beamfix_make_mapping(storage, sizeof storage, &BEAMFIX_LDROBOT_LD06, NULL, &robot) != BEAMFIX_STATUS_OK) {
        platform_print("no mapping\n");
        return 1;
    }
    while ((count = platform_read(bytes, sizeof bytes)) > 0) {
        size_t at = 0;
        uint32_t now_us = platform_now_us();
        while (at < count) {
            size_t taken;
            if (beamfix_push_lidar(robot, now_us, bytes + at, count - at, &taken, &step) == BEAMFIX_STATUS_STEP) {
                poses_hash = hashed_number(hashed_number(hashed_number(poses_hash, step.x), step.y), step.theta);
                poses++;
                /* A part of what can wait. */
                beamfix_work(robot, BEAMFIX_MAPPING_BUDGET, &done);
            }
            at += taken;
        }
    }
    do {
        beamfix_work(robot, BEAMFIX_MAPPING_BUDGET, &done);
    } while (!done);
    if (beamfix_get_extent(robot, 12, &extent) != BEAMFIX_STATUS_OK ||
        beamfix_draw_map(robot, cells, sizeof cells, WIDTH, HEIGHT, 0.1f, extent.min_x - 0.2f, extent.min_y - 0.2f) != BEAMFIX_STATUS_OK) {
        platform_print("no map\n");
        return 1;
    }
    for (k = 0; k < sizeof cells; k++) {
        map_hash = hashed(map_hash, cells[k]);
        occupied += cells[k] == BEAMFIX_CELL_OCCUPIED;
    }
    write_number(line, poses_hash, 16);
    write_number(line + 17, poses, 8);
    write_number(line + 26, map_hash, 16);
    write_number(line + 43, occupied, 8);
    platform_print(line);
    return 0;
}
