/* Every mistake that a caller can make gives its error and changes nothing. Prints what differs; exit status 0 where all is right. */
#include "beamfix.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static uint64_t storage[BEAMFIX_ODOMETRY_BYTES / 8 + 1];
static uint64_t other[BEAMFIX_ODOMETRY_BYTES / 8 + 1];
static uint64_t mapping[BEAMFIX_MAPPING_BYTES / 8];
static uint64_t small[BEAMFIX_STARTUP_BYTES / 8];
static int wrong;

static void expect(const char *what, beamfix_status got, beamfix_status wanted) {
    if (got != wanted) {
        printf("%s: %d, not %d\n", what, (int)got, (int)wanted);
        wrong++;
    }
}

static void count_point(void *user, float x, float y) {
    (void)x;
    (void)y;
    ++*(unsigned *)user;
}

int main(void) {
    beamfix *robot = NULL;
    beamfix_config config;
    beamfix_step step;
    beamfix_health health;
    beamfix_startup *startup = NULL;
    beamfix_action action;
    beamfix_extent extent;
    const beamfix_lidar *lidar = &BEAMFIX_RPLIDAR_C1;
    uint8_t bytes[4] = {0}, done, field[64] = {0};
    unsigned points = 0;
    size_t taken, size = sizeof storage;

    expect("config without a lidar", beamfix_default_config(NULL, &config), BEAMFIX_STATUS_NULL_POINTER);
    expect("config without a place", beamfix_default_config(lidar, NULL), BEAMFIX_STATUS_NULL_POINTER);
    expect("config", beamfix_default_config(lidar, &config), BEAMFIX_STATUS_OK);

    expect("no storage", beamfix_make_odometry(NULL, size, lidar, &config, &robot), BEAMFIX_STATUS_NULL_POINTER);
    expect("no lidar", beamfix_make_odometry(storage, size, NULL, &config, &robot), BEAMFIX_STATUS_NULL_POINTER);
    expect("no place", beamfix_make_odometry(storage, size, lidar, &config, NULL), BEAMFIX_STATUS_NULL_POINTER);
    expect("short", beamfix_make_odometry(storage, 20000, lidar, &config, &robot), BEAMFIX_STATUS_STORAGE_TOO_SMALL);
    expect("nothing", beamfix_make_odometry(storage, 0, lidar, &config, &robot), BEAMFIX_STATUS_STORAGE_TOO_SMALL);
    expect("misaligned", beamfix_make_odometry((char *)storage + 4, size - 4, lidar, &config, &robot),
           BEAMFIX_STATUS_MISALIGNED);
    config.max_range = 40;
    expect("too far", beamfix_make_odometry(storage, size, lidar, &config, &robot), BEAMFIX_STATUS_BAD_CONFIG);
    config.max_range = NAN;
    expect("not a range", beamfix_make_odometry(storage, size, lidar, &config, &robot), BEAMFIX_STATUS_BAD_CONFIG);
    config.max_range = 12;
    config.mount_theta = INFINITY;
    expect("not a mount", beamfix_make_odometry(storage, size, lidar, &config, &robot), BEAMFIX_STATUS_BAD_CONFIG);
    config.mount_theta = 0;
    expect("no table", beamfix_make_localization(storage, size, lidar, NULL, NULL, 9, &robot), BEAMFIX_STATUS_NULL_POINTER);
    expect("bad table", beamfix_make_localization(storage, size, lidar, NULL, field, sizeof field, &robot),
           BEAMFIX_STATUS_BAD_FIELD);
    if (robot != NULL) {
        printf("a pointer was written\n");
        wrong++;
    }

    expect("not made: null", beamfix_push_wheels(NULL, 0, 0, 0, 0), BEAMFIX_STATUS_NULL_POINTER);
    expect("not made: bytes", beamfix_push_lidar((beamfix *)other, 0, bytes, 4, &taken, &step), BEAMFIX_STATUS_NOT_MADE);
    expect("not made: wheels", beamfix_push_wheels((beamfix *)other, 0, 0, 0, 0), BEAMFIX_STATUS_NOT_MADE);
    expect("not made: health", beamfix_get_health((beamfix *)other, &health), BEAMFIX_STATUS_NOT_MADE);
    expect("misplaced", beamfix_get_health((beamfix *)((char *)other + 2), &health), BEAMFIX_STATUS_MISALIGNED);

    expect("made", beamfix_make_odometry(storage, size, lidar, &config, &robot), BEAMFIX_STATUS_OK);
    expect("no bytes", beamfix_push_lidar(robot, 0, NULL, 0, &taken, &step), BEAMFIX_STATUS_OK);
    expect("null bytes", beamfix_push_lidar(robot, 0, NULL, 4, &taken, &step), BEAMFIX_STATUS_NULL_POINTER);
    expect("no count", beamfix_push_lidar(robot, 0, bytes, 4, NULL, &step), BEAMFIX_STATUS_NULL_POINTER);
    expect("no step", beamfix_push_lidar(robot, 0, bytes, 4, &taken, NULL), BEAMFIX_STATUS_NULL_POINTER);
    expect("bytes", beamfix_push_lidar(robot, 0, bytes, 4, &taken, &step), BEAMFIX_STATUS_OK);
    expect("wheels", beamfix_push_wheels(robot, 0, NAN, 0, 0), BEAMFIX_STATUS_NOT_A_NUMBER);
    expect("gyro", beamfix_push_gyro(robot, 0, INFINITY), BEAMFIX_STATUS_NOT_A_NUMBER);
    expect("gyro", beamfix_push_gyro(robot, 0, 0.1f), BEAMFIX_STATUS_OK);
    expect("no map to draw", beamfix_draw_map(robot, field, sizeof field, 8, 8, 0.1f, 0, 0), BEAMFIX_STATUS_OTHER_TASK);
    expect("no map to measure", beamfix_get_extent(robot, 12, &extent), BEAMFIX_STATUS_OTHER_TASK);
    expect("a start without a map", beamfix_start_at(robot, 0, 0, 0), BEAMFIX_STATUS_OTHER_TASK);
    expect("work", beamfix_work(robot, 100, &done), BEAMFIX_STATUS_OK);
    expect("work", beamfix_work(robot, 100, NULL), BEAMFIX_STATUS_NULL_POINTER);
    expect("points", beamfix_set_point_callback(robot, count_point, &points), BEAMFIX_STATUS_OK);
    expect("health", beamfix_get_health(robot, &health), BEAMFIX_STATUS_OK);
    if (health.packets != 0 || health.revolutions != 0 || !done) {
        printf("health is not that of four zeros\n");
        wrong++;
    }
    memcpy(other, storage, size);
    expect("moved", beamfix_push_wheels((beamfix *)other, 0, 0, 0, 0), BEAMFIX_STATUS_NOT_MADE);
    memset(storage, 0xa5, size);
    expect("overwritten", beamfix_push_wheels(robot, 0, 0, 0, 0), BEAMFIX_STATUS_NOT_MADE);

    expect("short", beamfix_make_mapping(mapping, 100000, lidar, &config, &robot), BEAMFIX_STATUS_STORAGE_TOO_SMALL);
    expect("mapping", beamfix_make_mapping(mapping, sizeof mapping, lidar, &config, &robot), BEAMFIX_STATUS_OK);
    expect("no extent", beamfix_get_extent(robot, 12, NULL), BEAMFIX_STATUS_NULL_POINTER);
    expect("not a range", beamfix_get_extent(robot, NAN, &extent), BEAMFIX_STATUS_NOT_A_NUMBER);
    expect("nothing seen", beamfix_get_extent(robot, 12, &extent), BEAMFIX_STATUS_OK);
    expect("no cells", beamfix_draw_map(robot, NULL, 64, 8, 8, 0.1f, 0, 0), BEAMFIX_STATUS_NULL_POINTER);
    expect("few cells", beamfix_draw_map(robot, field, 63, 8, 8, 0.1f, 0, 0), BEAMFIX_STATUS_STORAGE_TOO_SMALL);
    expect("no grid", beamfix_draw_map(robot, field, 64, 0, 8, 0.1f, 0, 0), BEAMFIX_STATUS_BAD_CONFIG);
    expect("no size", beamfix_draw_map(robot, field, 64, 8, 8, INFINITY, 0, 0), BEAMFIX_STATUS_NOT_A_NUMBER);
    expect("an empty map", beamfix_draw_map(robot, field, 64, 8, 8, 0.1f, 0, 0), BEAMFIX_STATUS_OK);
    if (extent.min_x != 0 || extent.max_y != 0 || field[0] != BEAMFIX_CELL_UNKNOWN || field[63] != BEAMFIX_CELL_UNKNOWN) {
        printf("an empty map has something in it\n");
        wrong++;
    }
    expect("odometry again", beamfix_make_odometry(storage, size, lidar, &config, &robot), BEAMFIX_STATUS_OK);
    memset(storage, 0xa5, size);

    expect("no start-up", beamfix_poll_startup((beamfix_startup *)other, 0, &action), BEAMFIX_STATUS_NOT_MADE);
    expect("short", beamfix_make_startup(small, 16, lidar, &startup), BEAMFIX_STATUS_STORAGE_TOO_SMALL);
    expect("misaligned", beamfix_make_startup((char *)small + 1, 399, lidar, &startup), BEAMFIX_STATUS_MISALIGNED);
    expect("made", beamfix_make_startup(small, sizeof small, lidar, &startup), BEAMFIX_STATUS_OK);
    expect("another object", beamfix_push_wheels((beamfix *)small, 0, 0, 0, 0), BEAMFIX_STATUS_NOT_MADE);
    expect("a start-up for none", beamfix_use_startup(NULL, startup), BEAMFIX_STATUS_NULL_POINTER);
    expect("a start-up for what was overwritten", beamfix_use_startup(robot, startup), BEAMFIX_STATUS_NOT_MADE);
    expect("made again", beamfix_make_odometry(storage, size, lidar, &config, &robot), BEAMFIX_STATUS_OK);
    expect("no start-up", beamfix_use_startup(robot, NULL), BEAMFIX_STATUS_NULL_POINTER);
    expect("no start-up yet", beamfix_use_startup(robot, (beamfix_startup *)other), BEAMFIX_STATUS_NOT_MADE);
    expect("nothing heard", beamfix_use_startup(robot, startup), BEAMFIX_STATUS_OK);
    expect("poll", beamfix_poll_startup(startup, 0, NULL), BEAMFIX_STATUS_NULL_POINTER);
    expect("poll", beamfix_poll_startup(startup, 0, &action), BEAMFIX_STATUS_OK);
    if (action.kind != BEAMFIX_ACTION_KIND_SEND || action.count != 2 || action.bytes[0] != 0xa5) {
        printf("an RPLIDAR is first told to stop: %d, %d bytes\n", (int)action.kind, (int)action.count);
        wrong++;
    }
    expect("answer", beamfix_push_startup(startup, bytes, 4), BEAMFIX_STATUS_OK);
    if (beamfix_lidar_named("rplidar-c1") != lidar || beamfix_lidar_named("none") || beamfix_lidar_named(NULL) ||
        beamfix_lidar_baud(lidar) != 460800 || beamfix_lidar_baud(NULL) != 0 || beamfix_lidar_beams(lidar) != 540) {
        printf("a lidar is not what it is called\n");
        wrong++;
    }
    return wrong != 0;
}
