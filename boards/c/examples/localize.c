/* Bytes of an LD06 to poses in a known map, whose table is linked into flash: prints the hash of all known poses, their number, the
 * times that the pose was lost, and whether it is known at the end.
 *
 * On a PC: cc localize.c table.S platform_pc.c -Iinclude libbeamfix.a -o localize && ./localize < capture.bin
 */
#include "beamfix.h"
#include "platform.h"

/* The largest map that there is room for: 400 by 320 cells, 20 by 16 m at 5 cm. */
#define BYTES (BEAMFIX_LOCALIZATION_BYTES + BEAMFIX_MAP_BYTES(400, 320))
static uint64_t storage[(BYTES + 7) / 8];

/* What `beamfix field` wrote: table.S. */
extern const uint8_t table_start[], table_end[];

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

static char line[] = "0000000000000000 00000000 00000000 0\n";

static void write_number(char *to, uint64_t number, int digits) {
    while (digits-- > 0) {
        to[digits] = "0123456789abcdef"[number & 15];
        number >>= 4;
    }
}

int main(void) {
    beamfix *robot;
    beamfix_step step;
    uint8_t bytes[64], done;
    uint32_t poses = 0, lost = 0;
    int known = 0;
    size_t count;
    beamfix_status made = beamfix_make_localization(storage, sizeof storage, &BEAMFIX_LDROBOT_LD06, NULL, table_start,
                                                    (size_t)(table_end - table_start), &robot);
    if (made != BEAMFIX_STATUS_OK) {
        platform_print("no localization\n");
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
            if (status != BEAMFIX_STATUS_STEP) {
                continue;
            }
            known = step.verdict == BEAMFIX_VERDICT_MEASURED;
            lost = step.lost;
            if (known) {
                hash_in(step.x);
                hash_in(step.y);
                hash_in(step.theta);
                poses++;
            }
            /* A pose that is not known is searched between two revolutions, here to the end. */
            do {
                beamfix_work(robot, 500000, &done);
            } while (!done);
        }
    }
    write_number(line, hash, 16);
    write_number(line + 17, poses, 8);
    write_number(line + 26, lost, 8);
    line[35] = known ? '1' : '0';
    platform_print(line);
    return 0;
}
