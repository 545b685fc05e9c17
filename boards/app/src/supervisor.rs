//! Watches whether anything goes on: tells what the lidar does, keeps its motor turning, and says when the watchdog may
//! be fed.
//!
//! How long that takes follows from the lidar's row in the table of models.

use beamfix::lidar::{
    Start,
    motor::{self, Motor},
};
use embedded_hal::pwm::SetDutyCycle;

use crate::{
    AppConfig,
    telemetry::{LidarState, MotorState},
};

/// Time between two looks (µs).
pub const LOOK_US: u32 = 20_000;
/// A lidar without a byte for so long is silent.
const SILENT_US: u32 = 500_000;
/// Bytes without a packet for so long are noise.
const NOISE_US: u32 = 1_000_000;
/// Packets without a revolution for so many turns at its usual speed: it stands. Two at a tenth of that speed.
const STANDING_TURNS: u32 = 20;
/// Revolutions in a row without enough beams to match: the lidar is blind.
const BLIND_TURNS: u8 = 5;
/// The longest that a motor which nobody here drives takes to its speed, and the longest start-up by commands of a lidar that is
/// well: on any of the models it takes less than this.
const SPIN_UP_US: u32 = 5_000_000;
/// Bytes that lead to nothing for so long after two spin-ups and start-ups: a reset is worth trying.
const HOPELESS_US: u32 = 5_000_000;
/// A motor that was switched off, and a lidar that did not start, are started again after so long.
pub(crate) const PAUSE_US: u32 = 2_000_000;

/// What the application has seen so far; all wrap.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Seen {
    /// Bytes of the lidar taken, or lost on their way: a line that is not read is not silent.
    pub bytes: u32,
    /// Packets that passed their check.
    pub packets: u32,
    /// Revolutions that went through the matcher.
    pub turns: u32,
    /// The motor's speed.
    pub rpm: f32,
    /// Whether every packet tells it; else it is known after a revolution.
    pub tells_rpm: bool,
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
    /// Whether packets came since the last look.
    pub packets: bool,
    /// Whether revolutions come.
    pub turns: bool,
    /// Whether the watchdog may be fed: bytes become revolutions, or there are none.
    pub progress: bool,
}

impl Care {
    /// Nobody has looked.
    pub const NONE: Self = Self {
        lidar: LidarState::Unknown,
        motor: MotorState::Free,
        motor_restarts: 0,
        packets: false,
        turns: false,
        progress: false,
    };
}

/// See the module.
pub struct Supervisor<P> {
    standing_us: u32,
    hopeless_us: u32,
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
    #[inline(always)]
    pub fn new(mut pwm: P, config: &AppConfig, now_us: u32) -> Self {
        let turn_us = 10_000_000 / u32::from(config.lidar.revolutions_per_10s.max(1));
        let spin_up_us = match config.motor {
            Some(motor) => motor.spin_up_ms.saturating_mul(1000),
            None => SPIN_UP_US,
        };
        let attempt_us = match config.lidar.start {
            Start::Listen => spin_up_us,
            _ => spin_up_us.saturating_add(SPIN_UP_US),
        };
        let motor = match config.motor {
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
            standing_us: (STANDING_TURNS * turn_us).max(NOISE_US),
            hopeless_us: attempt_us.saturating_mul(2).saturating_add(HOPELESS_US),
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
        } else if self.fruitless_us >= self.standing_us {
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
            packets: self.packets.us == 0,
            turns: self.turns.us < self.standing_us,
            progress: self.fruitless_us < self.hopeless_us,
        }
    }

    fn motor(&mut self, now_us: u32, seen: Seen) -> MotorState {
        let Some(motor) = &mut self.motor else {
            return MotorState::Free;
        };
        let told = match seen.tells_rpm {
            true => &self.packets,
            false => &self.turns,
        };
        if told.us == 0 {
            let _ = motor.report(now_us, seen.rpm);
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
