// An LD06's data line at Serial1's RX pin (230400 baud), poses on Serial.
#include <beamfix.h>

static uint64_t storage[(BEAMFIX_LDROBOT_SMALL_ODOMETRY_BYTES + 7) / 8];
static beamfix *robot;

void setup() {
    Serial.begin(115200);
    // What comes while a revolution is matched must fit the core's buffer, 2 KB or more: set it where the core lets you, before begin.
    Serial1.begin(beamfix_lidar_baud(&BEAMFIX_LDROBOT_LD06));
    if (beamfix_make_odometry_small(storage, sizeof storage, &BEAMFIX_LDROBOT_LD06, nullptr, &robot) != BEAMFIX_STATUS_OK) {
        Serial.println("no odometry");
    }
}

void loop() {
    uint8_t bytes[64];
    size_t count = 0;
    while (count < sizeof bytes && Serial1.available() > 0) {
        bytes[count++] = static_cast<uint8_t>(Serial1.read());
    }
    uint32_t now_us = micros();
    for (size_t at = 0; at < count;) {
        size_t taken = 0;
        beamfix_step step;
        beamfix_status status = beamfix_push_lidar(robot, now_us, bytes + at, count - at, &taken, &step);
        if (status < 0) {
            return;
        }
        at += taken;
        if (status == BEAMFIX_STATUS_STEP) {
            Serial.print(step.x, 3);
            Serial.print(' ');
            Serial.print(step.y, 3);
            Serial.print(' ');
            Serial.print(step.theta, 4);
            Serial.println(step.verdict == BEAMFIX_VERDICT_MEASURED ? " measured" : " predicted");
        }
    }
}
