//! Watches whether anything goes on: tells what the lidar does, keeps its motor turning, and says when the watchdog may
//! be fed.

use beamfix::lidar::motor::{self, Motor, MotorConfig};
use embedded_hal::pwm::SetDutyCycle;

use crate::telemetry::{LidarState, MotorState};

/// Time between two looks (µs).
pub const LOOK_US: u32 = 20_000;
/// A lidar without a byte for so long is silent.
const SILENT_US: u32 = 500_000;
/// Bytes without a packet for so long are noise.
const NOISE_US: u32 = 1_000_000;
/// Packets without a revolution for so long: it stands. Two turns at 1 Hz.
const STANDING_US: u32 = 2_000_000;
/// Revolutions in a row without enough beams to match: the lidar is blind.
const BLIND_TURNS: u8 = 5;
/// Bytes that lead to nothing for so long: a reset is worth trying.
const HOPELESS_US: u32 = 15_000_000;
/// A motor that was switched off is started again after so long.
const PAUSE_US: u32 = 2_000_000;

/// What the application has seen so far; all wrap.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Seen {
    /// Bytes of the lidar taken, or lost on their way: a line that is not read is not silent.
    pub bytes: u32,
    /// Packets that passed their check.
    pub packets: u32,
    /// Revolutions that went through the matcher.
    pub turns: u32,
    /// The motor's speed by the last packet.
    pub speed_deg_per_s: u16,
    /// Revolutions in a row, up to now, that had too few beams with a range to be matched; stays at the most.
    pub blind_turns: u8,
}

/// What a look found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Care {
    /// What the lidar does.
    pub lidar: LidarState,
    /// What its motor does.
    pub motor: MotorState,
    /// Times that the motor was started again; stays at the most.
    pub motor_restarts: u8,
    /// Whether the watchdog may be fed: bytes become revolutions, or there are none.
    pub progress: bool,
}

impl Care {
    /// Nobody has looked.
    pub const NONE: Self = Self {
        lidar: LidarState::Unknown,
        motor: MotorState::Free,
        motor_restarts: 0,
        progress: false,
    };
}

/// See the module.
pub struct Supervisor<P> {
    motor: Option<Motor<P>>,
    motor_off_us: u32,
    restarts: u8,
    last_us: u32,
    bytes: Idle,
    packets: Idle,
    turns: Idle,
    /// How long bytes have come without a revolution.
    fruitless_us: u32,
}

/// How long a counter has stood still.
struct Idle {
    count: u32,
    us: u32,
}

impl Idle {
    /// Long ago.
    const NEVER: Self = Self {
        count: 0,
        us: u32::MAX,
    };

    fn look(&mut self, count: u32, passed_us: u32) {
        self.us = match count == self.count {
            true => self.us.saturating_add(passed_us),
            false => 0,
        };
        self.count = count;
    }
}

impl<P: SetDutyCycle> Supervisor<P> {
    /// Starts the motor, or keeps its line low.
    pub fn new(mut pwm: P, motor: Option<MotorConfig>, now_us: u32) -> Self {
        let motor = match motor {
            Some(config) => {
                let mut motor = Motor::new(pwm, config);
                let _ = motor.start(now_us);
                Some(motor)
            }
            None => {
                let _ = pwm.set_duty_cycle_fully_off();
                None
            }
        };
        Self {
            motor,
            motor_off_us: 0,
            restarts: 0,
            last_us: now_us.wrapping_sub(LOOK_US),
            bytes: Idle::NEVER,
            packets: Idle::NEVER,
            turns: Idle::NEVER,
            fruitless_us: 0,
        }
    }

    /// Whether it is time for [`Supervisor::look`].
    pub fn is_due(&self, now_us: u32) -> bool {
        now_us.wrapping_sub(self.last_us) >= LOOK_US
    }

    /// Looks whether anything goes on, and after the motor.
    #[inline(never)]
    pub fn look(&mut self, now_us: u32, seen: Seen) -> Care {
        let passed_us = now_us.wrapping_sub(self.last_us);
        self.last_us = now_us;
        self.bytes.look(seen.bytes, passed_us);
        self.packets.look(seen.packets, passed_us);
        self.turns.look(seen.turns, passed_us);
        let silent = self.bytes.us >= SILENT_US;
        self.fruitless_us = match silent || self.turns.us == 0 {
            true => 0,
            false => self.fruitless_us.saturating_add(passed_us),
        };
        let lidar = if silent {
            LidarState::Silent
        } else if self.packets.us >= NOISE_US {
            LidarState::Noise
        } else if self.fruitless_us >= STANDING_US {
            LidarState::Standing
        } else if seen.blind_turns >= BLIND_TURNS {
            LidarState::Blind
        } else {
            LidarState::Turning
        };
        Care {
            lidar,
            motor: self.motor(now_us, seen),
            motor_restarts: self.restarts,
            progress: self.fruitless_us < HOPELESS_US,
        }
    }

    fn motor(&mut self, now_us: u32, seen: Seen) -> MotorState {
        let Some(motor) = &mut self.motor else {
            return MotorState::Free;
        };
        if self.packets.us == 0 {
            let _ = motor.report(now_us, f32::from(seen.speed_deg_per_s) / 6.0);
        }
        match motor.poll(now_us) {
            Ok(motor::MotorState::SpinningUp) => MotorState::SpinningUp,
            Ok(motor::MotorState::Steady) => MotorState::Steady,
            Ok(motor::MotorState::Off) => {
                if now_us.wrapping_sub(self.motor_off_us) >= PAUSE_US {
                    self.restarts = self.restarts.saturating_add(1);
                    let _ = motor.start(now_us);
                    return MotorState::SpinningUp;
                }
                MotorState::Off
            }
            Err(_) => {
                self.motor_off_us = now_us;
                MotorState::Off
            }
        }
    }
}
