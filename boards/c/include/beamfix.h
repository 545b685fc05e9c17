/* beamfix: bytes of a cheap laser rangefinder to a trustworthy pose, on a microcontroller, without heap.
 *
 * Made by cbindgen from boards/c/src. Do not edit: `UPDATE_EXPECT=1 cargo test --release -p host-tests --test boards c::header`
 * renews it.
 *
 * Frames and units: x forward, y left, headings counter-clockwise seen from above; metres, radians, seconds. Times are
 * microseconds of one clock, the caller's, and may wrap after 2^32.
 *
 * Memory: all of it is the caller's, one block an object, aligned to BEAMFIX_ALIGN bytes; its size is a constant. An object
 * stays where it was made: never copy or move its memory. Nothing is freed: forget the object and use the memory again.
 *
 * Threads: no function waits, and none uses anything but what it is given. One object belongs to one thread; never call it from
 * an interrupt: keep the bytes there, in a ring, and give them from the main loop.
 *
 * Errors: every function that can fail gives a beamfix_status; negative ones are errors, and then nothing was changed.
 */


#ifndef BEAMFIX_H
#define BEAMFIX_H



#include <stddef.h>
#include <stdint.h>

/* Bytes beyond BEAMFIX_LOCALIZATION_BYTES that a map of so many cells takes. */
#define BEAMFIX_MAP_BYTES(width, height) \
    ((((size_t)(width) + 3) / 4 + 1) * (((size_t)(height) + 3) / 4 + 1) + \
     (((size_t)(width) + 15) / 16 + 1) * (((size_t)(height) + 15) / 16 + 1))


// A budget for beamfix_work on mapping, between two revolutions: two million instructions.
#define BEAMFIX_MAPPING_BUDGET 20000

// A byte of a drawn map: nothing is there.
#define BEAMFIX_CELL_FREE 2

// A byte of a drawn map: not seen, or contradicted.
#define BEAMFIX_CELL_UNKNOWN 128

// A byte of a drawn map: something is there.
#define BEAMFIX_CELL_OCCUPIED 254

// Version of this interface: of the functions, types and constants of this header. It changes with each of them.
#define BEAMFIX_VERSION 2

// Alignment of the memory that every object is made in (bytes).
#define BEAMFIX_ALIGN 8

// Most beams of a revolution; further ones are refused and counted.
#define BEAMFIX_BEAMS 1100

// The same for objects of the functions whose names end in `_small`, for a microcontroller with 16 KB of RAM: of an LD06's 450
// beams the last 66, or 53 degrees, are given up, so that the stack fits too.
#define BEAMFIX_SMALL_BEAMS 384

// Memory for odometry with any lidar (bytes).
#define BEAMFIX_ODOMETRY_BYTES 36600

// Memory for odometry with BEAMFIX_SMALL_BEAMS (bytes), with any lidar.
#define BEAMFIX_SMALL_ODOMETRY_BYTES 17600

// The same with one of LDROBOT's lidars (LD06, LD19, STL-19P, ...), whose packets are short.
#define BEAMFIX_LDROBOT_SMALL_ODOMETRY_BYTES 12120

// Memory for localization (bytes), with any lidar; a map takes BEAMFIX_MAP_BYTES(width, height) more.
#define BEAMFIX_LOCALIZATION_BYTES 28600

// The same with BEAMFIX_SMALL_BEAMS (bytes).
#define BEAMFIX_SMALL_LOCALIZATION_BYTES 17600

// Memory for mapping (bytes), with any lidar.
#define BEAMFIX_MAPPING_BYTES 208000

// Memory for a lidar's start-up (bytes).
#define BEAMFIX_STARTUP_BYTES 400

// Most bytes of a beamfix_action.
#define BEAMFIX_ACTION_BYTES 24

// What became of a call. Errors are negative.
enum beamfix_status
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // Done.
    BEAMFIX_STATUS_OK = 0,
    // Done, and a revolution is complete: the step was written.
    BEAMFIX_STATUS_STEP = 1,
    // A pointer is null.
    BEAMFIX_STATUS_NULL_POINTER = -1,
    // The memory is too small: see the constants of this header.
    BEAMFIX_STATUS_STORAGE_TOO_SMALL = -2,
    // The memory is not aligned to BEAMFIX_ALIGN bytes.
    BEAMFIX_STATUS_MISALIGNED = -3,
    // The object was not made, or its memory was overwritten or moved since.
    BEAMFIX_STATUS_NOT_MADE = -4,
    // A setting is out of its range, or not a number.
    BEAMFIX_STATUS_BAD_CONFIG = -5,
    // The table is no field that `beamfix field` wrote, or it is cut off.
    BEAMFIX_STATUS_BAD_FIELD = -6,
    // A number is infinite or not a number.
    BEAMFIX_STATUS_NOT_A_NUMBER = -7,
    // The object does another task: only mapping has a map to be drawn, and only localization is told where it starts.
    BEAMFIX_STATUS_OTHER_TASK = -8,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum beamfix_status beamfix_status;
#else
typedef int32_t beamfix_status;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// How a pose was found.
enum beamfix_verdict
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // By matching the scan: rely on it.
    BEAMFIX_VERDICT_MEASURED = 0,
    // By the motion since the last measured one: the scan did not fit, and the reason says why. Drive slowly, or stop.
    BEAMFIX_VERDICT_PREDICTED = 1,
    // Not at all: there is no pose.
    BEAMFIX_VERDICT_UNKNOWN = 2,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum beamfix_verdict beamfix_verdict;
#else
typedef int32_t beamfix_verdict;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// Why a pose is not measured.
enum beamfix_reason
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // It is measured.
    BEAMFIX_REASON_NONE = 0,
    // The first revolution: there is nothing to match it against.
    BEAMFIX_REASON_FIRST_SCAN = 1,
    // The revolution has too few beams with a range: the lidar is covered, or in a void.
    BEAMFIX_REASON_TOO_FEW_BEAMS = 2,
    // What it was matched against has too few surfaces.
    BEAMFIX_REASON_TOO_FEW_LINES = 3,
    // Too few beams found a surface that they could belong to.
    BEAMFIX_REASON_TOO_FEW_CORRESPONDENCES = 4,
    // The geometry leaves a direction undetermined, as a long corridor does.
    BEAMFIX_REASON_DEGENERATE = 5,
    // The iteration limit came first.
    BEAMFIX_REASON_NOT_CONVERGED = 6,
    // Two poses explain the revolution equally well.
    BEAMFIX_REASON_AMBIGUOUS = 7,
    // No pose that was tried reaches the least score.
    BEAMFIX_REASON_NOTHING_FOUND = 8,
    // The best pose explains the revolution badly.
    BEAMFIX_REASON_UNLIKELY = 9,
    // The match is too far from the prediction to be believed.
    BEAMFIX_REASON_TOO_FAR = 10,
    // The prediction is not a number, or farther away than the matcher can reckon.
    BEAMFIX_REASON_BAD_GUESS = 11,
    // Localization: the scan fits the map badly, or so that the pose may be another.
    BEAMFIX_REASON_DOUBTFUL = 12,
    // Localization: the pose is being searched; call beamfix_work between the revolutions.
    BEAMFIX_REASON_SEARCHING = 13,
    // Localization: several poses are left, and more scans will tell them apart.
    BEAMFIX_REASON_CHOOSING = 14,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum beamfix_reason beamfix_reason;
#else
typedef int32_t beamfix_reason;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// What a start-up wants done.
enum beamfix_action_kind
#if defined(__cplusplus) || __STDC_VERSION__ >= 202311L
  : int32_t
#endif // defined(__cplusplus) || __STDC_VERSION__ >= 202311L
 {
    // Nothing; ask again within 10 ms.
    BEAMFIX_ACTION_KIND_WAIT = 0,
    // Send the bytes to the lidar.
    BEAMFIX_ACTION_KIND_SEND = 1,
    // Set the UART to `baud` bits/s, once all that was to be sent has left it.
    BEAMFIX_ACTION_KIND_SET_BAUD = 2,
    // Switch the motor on, where the board does that.
    BEAMFIX_ACTION_KIND_MOTOR_ON = 3,
    // Measurements come: call beamfix_use_startup once, and give the bytes to beamfix_push_lidar from now on.
    BEAMFIX_ACTION_KIND_READY = 4,
    // The lidar does not answer, or says that it is broken: start over after a while.
    BEAMFIX_ACTION_KIND_FAILED = 5,
};
#ifndef __cplusplus
#if __STDC_VERSION__ >= 202311L
typedef enum beamfix_action_kind beamfix_action_kind;
#else
typedef int32_t beamfix_action_kind;
#endif // __STDC_VERSION__ >= 202311L
#endif // __cplusplus

// A lidar: how its bytes are read, at what speed they come, how it is started.
typedef struct beamfix_lidar beamfix_lidar;

// A pipeline with its estimator: bytes of a lidar in, steps out.
typedef struct beamfix beamfix;

// Start-up of one lidar: polled until it says that measurements come.
typedef struct beamfix_startup beamfix_startup;

// Settings: how the lidar sits on the robot, and which ranges count. beamfix_default_config fills them in for a lidar.
typedef struct {
    // Place of the lidar on the robot: forward of its centre (m).
    float mount_x;
    // Left of its centre (m).
    float mount_y;
    // Direction in which the lidar's zero looks, counter-clockwise from forward (rad).
    float mount_theta;
    // Whether the lidar hangs head down: 0 or 1.
    uint8_t upside_down;
    // Shorter ranges are left out (m): the robot's own body. 0 to 32.
    float min_range;
    // Longer ranges are left out (m). min_range to 32.
    float max_range;
} beamfix_config;

// What a map covers, in the frame in which the robot started.
typedef struct {
    // Smallest coordinate forward (m).
    float min_x;
    // Smallest coordinate to the left (m).
    float min_y;
    // Largest coordinate forward (m).
    float max_x;
    // Largest coordinate to the left (m).
    float max_y;
} beamfix_extent;

// Where the robot is after a revolution of the lidar, and how well that is known.
typedef struct {
    // Robot at the revolution's end: forward (m), in the frame in which it started, or in the map.
    float x;
    // Left (m).
    float y;
    // Heading, in [-pi, pi) (rad).
    float theta;
    // Covariance of the three in the same frame: xx, xy, yy (m^2), x-theta, y-theta (m rad), theta-theta (rad^2). Of odometry
    // since the start; all 0 where has_covariance is 0.
    float covariance[6];
    // End of the revolution by the lidar's clock, where it has one, else by the caller's (us, wrapping).
    uint32_t time_us;
    // Counts revolutions from 0, wrapping.
    uint32_t sequence;
    // Times that what scans are matched against was given up, or a map's loop closed, wrapping: when it grows, the pose may have jumped.
    uint32_t lost;
    // How the pose was found.
    beamfix_verdict verdict;
    // Why it is not measured.
    beamfix_reason reason;
    // Whether the covariance is known: 0 or 1.
    uint8_t has_covariance;
} beamfix_step;

// Takes a place that a beam of a revolution hit, in the robot's frame at the revolution's end, not corrected for the robot's motion
// during it (m). `user` is what was given with the callback.
typedef void (*beamfix_point_callback)(void *user, float x, float y);

// Counters since the object was made; all wrap.
typedef struct {
    // Packets that passed every check.
    uint32_t packets;
    // Packets that failed their check code.
    uint32_t check_errors;
    // Bytes that belong to no packet.
    uint32_t skipped_bytes;
    // Beams that a revolution had no room for, and those of interrupted revolutions.
    uint32_t beams_refused;
    // Revolutions matched.
    uint32_t revolutions;
    // Revolutions whose pose was not measured, the first one left out.
    uint32_t refused;
    // Times that what scans are matched against was given up.
    uint32_t lost;
} beamfix_health;

// What a start-up wants done, and with what.
typedef struct {
    // What to do.
    beamfix_action_kind kind;
    // Speed of the line to set (bits/s).
    uint32_t baud;
    // How many of the bytes are to be sent.
    uint8_t count;
    // The bytes to send.
    uint8_t bytes[BEAMFIX_ACTION_BYTES];
} beamfix_action;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// LDROBOT LD06. 230400 bits/s, up to 520 beams a revolution.
extern const beamfix_lidar BEAMFIX_LDROBOT_LD06;

// LDROBOT LD19. 230400 bits/s, up to 520 beams a revolution.
extern const beamfix_lidar BEAMFIX_LDROBOT_LD19;

// LDROBOT STL-19P, D500 kit; also STL-06P and STL-26. 230400 bits/s, up to 570 beams a revolution.
extern const beamfix_lidar BEAMFIX_LDROBOT_STL19P;

// LDROBOT STL-27L. 921600 bits/s, up to 2300 beams a revolution.
extern const beamfix_lidar BEAMFIX_LDROBOT_STL27L;

// LDROBOT LD14. 115200 bits/s, up to 430 beams a revolution.
extern const beamfix_lidar BEAMFIX_LDROBOT_LD14;

// LDROBOT LD14P. 230400 bits/s, up to 730 beams a revolution.
extern const beamfix_lidar BEAMFIX_LDROBOT_LD14P;

// LDROBOT LD14P in its variant with 2300 measurements a second; on the line it looks as an LD14. 230400 bits/s, up to 430 beams a revolution.
extern const beamfix_lidar BEAMFIX_LDROBOT_LD14P_2300;

// LDS-02 (HLS-LFCD3, LD08). 115200 bits/s, up to 510 beams a revolution.
extern const beamfix_lidar BEAMFIX_LDROBOT_LDS02;

// Oradar MS200: the LD06's frames. 230400 bits/s, up to 520 beams a revolution.
extern const beamfix_lidar BEAMFIX_ORADAR_MS200;

// RPLIDAR A1 or A2 in standard scan. 115200 bits/s, up to 400 beams a revolution.
extern const beamfix_lidar BEAMFIX_RPLIDAR_SCAN;

// RPLIDAR A1 or A2 in legacy express scan. 115200 bits/s, up to 800 beams a revolution.
extern const beamfix_lidar BEAMFIX_RPLIDAR_EXPRESS;

// RPLIDAR S2 in dense scan. 1000000 bits/s, up to 3400 beams a revolution.
extern const beamfix_lidar BEAMFIX_RPLIDAR_DENSE;

// RPLIDAR C1. 460800 bits/s, up to 540 beams a revolution.
extern const beamfix_lidar BEAMFIX_RPLIDAR_C1;

// RPLIDAR C1 in standard scan. 460800 bits/s, up to 540 beams a revolution.
extern const beamfix_lidar BEAMFIX_RPLIDAR_C1_SCAN;

// RPLIDAR A3 in boost scan. 256000 bits/s, up to 1700 beams a revolution.
extern const beamfix_lidar BEAMFIX_RPLIDAR_ULTRA;

// RPLIDAR S3 in ultra-dense scan. 1000000 bits/s, up to 3400 beams a revolution.
extern const beamfix_lidar BEAMFIX_RPLIDAR_ULTRADENSE;

// RPLIDAR in HQ scan; 8 bytes a point, so only on a fast line. 1000000 bits/s, up to 1100 beams a revolution.
extern const beamfix_lidar BEAMFIX_RPLIDAR_HQ;

// YDLIDAR X4. 128000 bits/s, up to 900 beams a revolution.
extern const beamfix_lidar BEAMFIX_YDLIDAR_X4;

// YDLIDAR X2, X2L, X3. 115200 bits/s, up to 700 beams a revolution.
extern const beamfix_lidar BEAMFIX_YDLIDAR_X2;

// YDLIDAR G4. 230400 bits/s, up to 1500 beams a revolution.
extern const beamfix_lidar BEAMFIX_YDLIDAR_G4;

// YDLIDAR G6, G7. 512000 bits/s, up to 3000 beams a revolution.
extern const beamfix_lidar BEAMFIX_YDLIDAR_G6;

// YDLIDAR TG15, TG30, TG50: time of flight. 512000 bits/s, up to 2300 beams a revolution.
extern const beamfix_lidar BEAMFIX_YDLIDAR_TG;

// YDLIDAR T-mini Pro and Plus. 230400 bits/s, up to 750 beams a revolution.
extern const beamfix_lidar BEAMFIX_YDLIDAR_TMINI;

// YDLIDAR G2 and others with an intensity byte. 230400 bits/s, up to 900 beams a revolution.
extern const beamfix_lidar BEAMFIX_YDLIDAR_G2;

// YDLIDAR G4B: 10 bits of intensity. 512000 bits/s, up to 1500 beams a revolution.
extern const beamfix_lidar BEAMFIX_YDLIDAR_G4B;

// YDLIDAR S4B: 8 bits of intensity. 153600 bits/s, up to 750 beams a revolution.
extern const beamfix_lidar BEAMFIX_YDLIDAR_S4B;

// COIN-D4, also sold as TurtleBot3's LDS-03: by its frames alone it looks like a T-mini. 230400 bits/s, up to 750 beams a revolution.
extern const beamfix_lidar BEAMFIX_COIN_D4;

// YDLIDAR T-mini Plus SH: four bytes a sample; not verified on a unit. 230400 bits/s, up to 750 beams a revolution.
extern const beamfix_lidar BEAMFIX_YDLIDAR_TMINI_SH;

// LDS-01 (HLS-LFCD2). 230400 bits/s, up to 360 beams a revolution.
extern const beamfix_lidar BEAMFIX_HLS_LDS01;

// Neato XV-11, firmware 2.4 and later. 115200 bits/s, up to 360 beams a revolution.
extern const beamfix_lidar BEAMFIX_NEATO_XV11;

// Xiaomi LDS02RR: the XV-11's frames, clockwise by the one source there is. 115200 bits/s, up to 360 beams a revolution.
extern const beamfix_lidar BEAMFIX_XIAOMI_LDS02RR;

// Neato XV-11, early firmware. 115200 bits/s, up to 360 beams a revolution.
extern const beamfix_lidar BEAMFIX_NEATO_XV11_EARLY;

// LDS-006. 115200 bits/s, up to 360 beams a revolution.
extern const beamfix_lidar BEAMFIX_LDS006;

// Camsense X1. 115200 bits/s, up to 440 beams a revolution.
extern const beamfix_lidar BEAMFIX_CAMSENSE_X1;

// Camsense X2. No source tells its pace: it is taken as the X1's. 115200 bits/s, up to 440 beams a revolution.
extern const beamfix_lidar BEAMFIX_CAMSENSE_X2;

// LDS08RR: the Camsense frame with 16-bit quality. No source says that its angles are to be corrected. 115200 bits/s, up to 440 beams a revolution.
extern const beamfix_lidar BEAMFIX_CAMSENSE_LDS08RR;

// "Mystery 360": a nameless time-of-flight sensor of 2024 with 16 points in a frame. 230400 bits/s, up to 640 beams a revolution.
extern const beamfix_lidar BEAMFIX_MYSTERY_360;

// Camsense T2, T200: time of flight. No source tells a pace that its line carries: it is taken as the X1's. 115200 bits/s, up to 440 beams a revolution.
extern const beamfix_lidar BEAMFIX_CAMSENSE_T2;

// 3irobotix Delta-1A, 2A, 2B. 230400 bits/s, up to 960 beams a revolution.
extern const beamfix_lidar BEAMFIX_DELTA_2A;

// 3irobotix Delta-2G. 115200 bits/s, up to 900 beams a revolution.
extern const beamfix_lidar BEAMFIX_DELTA_2G;

// LSLIDAR N10, L10. 230400 bits/s, up to 520 beams a revolution.
extern const beamfix_lidar BEAMFIX_LSLIDAR_N10;

// LSLIDAR N10P. 460800 bits/s, up to 620 beams a revolution.
extern const beamfix_lidar BEAMFIX_LSLIDAR_N10P;

// Hokuyo URG-04LX: 19 200 baud after power-on; a slower line than this does not carry every scan. 750000 bits/s, up to 726 beams a revolution.
extern const beamfix_lidar BEAMFIX_HOKUYO_URG04LX;

// Hokuyo UTM-30LX: over USB, where the speed of the line only has to be enough for 40 scans a second. 2000000 bits/s, up to 1081 beams a revolution.
extern const beamfix_lidar BEAMFIX_HOKUYO_UTM30LX;

// Hokuyo UST-10LX, UST-20LX: over Ethernet, with the same commands. 2000000 bits/s, up to 1081 beams a revolution.
extern const beamfix_lidar BEAMFIX_HOKUYO_UST10LX;

// SICK LMS200, LMS291: 9600 baud after power-on; only 500 000 carries every scan. 500000 bits/s, up to 401 beams a revolution.
extern const beamfix_lidar BEAMFIX_SICK_LMS200;

// The lidar of a name, such as "ld06": `beamfix lidars` lists them. Null where there is none.
//
// It has the code of every protocol: a program that knows its lidar names its constant instead.
const beamfix_lidar *beamfix_lidar_named(const char *name);

// Speed of the lidar's line (bits/s), 8 data bits, no parity, one stop bit; 0 for null.
uint32_t beamfix_lidar_baud(const beamfix_lidar *lidar);

// Most beams of a revolution of the lidar; 0 for null.
uint16_t beamfix_lidar_beams(const beamfix_lidar *lidar);

// Makes mapping in `storage`: odometry, and a map of 224 keyframes whose loops are closed. A step's pose is in that map, in the frame
// in which the robot started; it has no covariance.
//
// `storage`: BEAMFIX_MAPPING_BYTES bytes aligned to BEAMFIX_ALIGN. `config`: null for the lidar's defaults. Call beamfix_work between
// the revolutions, with BEAMFIX_MAPPING_BUDGET. A program that names this function takes about as many bytes of flash more, for how the
// memory begins.
beamfix_status beamfix_make_mapping(void *storage,
                                    size_t bytes,
                                    const beamfix_lidar *lidar,
                                    const beamfix_config *config,
                                    beamfix **object);

// Tells what the map covers, of all that was seen no farther than `max_range` (m) away. An object without a map, as odometry and
// localization are, is refused; all zeros while there is nothing in it.
beamfix_status beamfix_get_extent(beamfix *object,
                                  float max_range,
                                  beamfix_extent *extent);

// Draws the map into `cells`, a byte each: BEAMFIX_CELL_FREE, BEAMFIX_CELL_OCCUPIED or BEAMFIX_CELL_UNKNOWN. What they held is lost.
//
// There are `width` times `height` cells of `cell` metres; the first lies at `min_x`, `min_y`, the next ones after it along x, and rows
// along y. BEAMFIX_STATUS_BAD_CONFIG where such a grid cannot be, BEAMFIX_STATUS_STORAGE_TOO_SMALL where `bytes` are fewer than its
// cells. Keyframes that lie outside are left out. It takes a while: some hundred thousand instructions for each keyframe.
beamfix_status beamfix_draw_map(beamfix *object,
                                uint8_t *cells,
                                size_t bytes,
                                uint16_t width,
                                uint16_t height,
                                float cell,
                                float min_x,
                                float min_y);

// Fills in the settings for a lidar at the robot's centre, upright, looking forward, with that lidar's ranges.
//
// Null for either pointer gives an error.
beamfix_status beamfix_default_config(const beamfix_lidar *lidar,
                                      beamfix_config *config);

// Makes odometry in `storage`: the robot's pose since the start, by its scans alone and what wheels and gyroscope tell.
//
// `storage`: BEAMFIX_ODOMETRY_BYTES bytes aligned to BEAMFIX_ALIGN. `config`: null for the lidar's defaults. The object stands at
// the start of the memory, and `object` receives its address. What the memory held before is lost.
beamfix_status beamfix_make_odometry(void *storage,
                                     size_t bytes,
                                     const beamfix_lidar *lidar,
                                     const beamfix_config *config,
                                     beamfix **object);

// The same with BEAMFIX_SMALL_BEAMS, in BEAMFIX_SMALL_ODOMETRY_BYTES.
beamfix_status beamfix_make_odometry_small(void *storage,
                                           size_t bytes,
                                           const beamfix_lidar *lidar,
                                           const beamfix_config *config,
                                           beamfix **object);

// Makes localization in `storage`: the robot's pose in a known map, found anew where it is lost.
//
// `storage`: BEAMFIX_LOCALIZATION_BYTES + BEAMFIX_MAP_BYTES(width, height) bytes aligned to BEAMFIX_ALIGN. `table`: the bytes that
// `beamfix field MAP.yaml --out FILE` wrote, which stay where they are, in flash, as long as the object is used; the command tells
// the map's width and height. `config`: null for the lidar's defaults.
beamfix_status beamfix_make_localization(void *storage,
                                         size_t bytes,
                                         const beamfix_lidar *lidar,
                                         const beamfix_config *config,
                                         const uint8_t *table,
                                         size_t table_bytes,
                                         beamfix **object);

// The same with BEAMFIX_SMALL_BEAMS, in BEAMFIX_SMALL_LOCALIZATION_BYTES + BEAMFIX_MAP_BYTES(width, height).
beamfix_status beamfix_make_localization_small(void *storage,
                                               size_t bytes,
                                               const beamfix_lidar *lidar,
                                               const beamfix_config *config,
                                               const uint8_t *table,
                                               size_t table_bytes,
                                               beamfix **object);

// Takes bytes of the lidar, in pieces of any size, until a revolution is complete or all are taken.
//
// `now_us`: when they came in (us, wrapping), for the rest of them the same again. `taken` receives how many were taken: give the rest again. BEAMFIX_STATUS_STEP says
// that a revolution is complete and `step` was written; this call has then matched it, which takes 4 to 60 ms on a microcontroller:
// a ring of 2 KB behind the UART keeps what comes meanwhile.
beamfix_status beamfix_push_lidar(beamfix *object,
                                  uint32_t now_us,
                                  const uint8_t *bytes,
                                  size_t count,
                                  size_t *taken,
                                  beamfix_step *step);

// Takes over what a start-up heard of the lidar: the angle of its own zero, which some YDLIDAR keep, in place of its model's.
//
// Call it once when the start-up says that the lidar is ready, also for lidars that keep none: nothing changes then. Without it,
// the poses of such a lidar are turned by that angle.
beamfix_status beamfix_use_startup(beamfix *object,
                                   const beamfix_startup *startup);

// Takes the robot's pose by its wheels at a time (us, wrapping): forward and left (m) and heading (rad), in a frame of their own.
//
// Any rate from two a second on will do. Numbers that are not finite are refused.
beamfix_status beamfix_push_wheels(beamfix *object,
                                   uint32_t time_us,
                                   float x,
                                   float y,
                                   float theta);

// Takes the robot's rate of turn by a gyroscope at a time (us, wrapping): counter-clockwise (rad/s), 20 times a second or more.
beamfix_status beamfix_push_gyro(beamfix *object,
                                 uint32_t time_us,
                                 float rate);

// Does a bounded part of what is put off: of localization's search for a lost pose about `budget` bytes of the map looked up, 10
// instructions each; of mapping about `budget` hundreds of instructions.
//
// Call it between the lidar's bytes. `done` receives 1 where nothing is left to do before the next revolution, as always in
// odometry and while a pose in a known map is known; else 0.
beamfix_status beamfix_work(beamfix *object,
                            uint32_t budget,
                            uint8_t *done);

// Tells localization where the robot is in the map: forward and left (m) and heading (rad) in the map's frame. Without it, or after
// it was wrong, the pose is searched.
beamfix_status beamfix_start_at(beamfix *object,
                                float x,
                                float y,
                                float theta);

// Calls `callback` for every place that a beam of a revolution hit, during the call of beamfix_push_lidar that completes it, before
// the match; null ends that.
//
// For obstacles: the places are in the robot's frame, the lidar's mount taken into account. The callback must not call anything on
// the same object.
beamfix_status beamfix_set_point_callback(beamfix *object,
                                          beamfix_point_callback callback,
                                          void *user);

// Tells how the parts are.
beamfix_status beamfix_get_health(beamfix *object, beamfix_health *health);

// Makes a lidar's start-up in `storage`: BEAMFIX_STARTUP_BYTES bytes aligned to BEAMFIX_ALIGN.
//
// Poll it with beamfix_poll_startup and give it what the lidar answers with beamfix_push_startup, until it says that the lidar is
// ready; give it to beamfix_use_startup then, and its memory is free.
beamfix_status beamfix_make_startup(void *storage,
                                    size_t bytes,
                                    const beamfix_lidar *lidar,
                                    beamfix_startup **startup);

// Tells what is to be done now (us, wrapping): do it, and ask again.
beamfix_status beamfix_poll_startup(beamfix_startup *startup, uint32_t now_us, beamfix_action *action);

// Takes bytes that the lidar answered.
beamfix_status beamfix_push_startup(beamfix_startup *startup, const uint8_t *bytes, size_t count);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* BEAMFIX_H */
