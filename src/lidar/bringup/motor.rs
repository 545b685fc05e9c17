//! Speed control of a motor that the host drives: XV-11, Delta, RPLIDAR A1, X2, LD06 where wanted.

use core::fmt;

use embedded_hal::pwm::SetDutyCycle;

use crate::math;

/// Speed, gains and time limits of a motor's control.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct MotorConfig {
    /// Speed to keep (rpm).
    pub target_rpm: f32,
    /// Duty (0…1) that the motor starts with.
    pub initial_duty: f32,
    /// Least and largest duty: less does not spin the motor, more harms it.
    pub duty_range: (f32, f32),
    /// Duty per rpm of error.
    pub proportional: f32,
    /// Duty per rpm of error and second.
    pub integral: f32,
    /// How far from the target still counts as steady (rpm).
    pub tolerance_rpm: f32,
    /// Longest time to a steady speed (ms).
    pub spin_up_ms: u32,
    /// Longest time without a report of the speed (ms).
    pub silence_ms: u32,
}

impl MotorConfig {
    /// Neato XV-11, LDS02RR: 300 rpm; gains as commonly used, 0.003 and 0.001 every 20 ms.
    pub const NEATO_XV11: Self = Self {
        target_rpm: 300.0,
        initial_duty: 0.55,
        duty_range: (0.2, 1.0),
        proportional: 0.003,
        integral: 0.005,
        tolerance_rpm: 15.0,
        spin_up_ms: 10_000,
        silence_ms: 2000,
    };
    /// 3irobotix Delta-1A, 2A, 2B: 360 rpm.
    pub const DELTA_2A: Self = Self {
        target_rpm: 360.0,
        ..Self::NEATO_XV11
    };
    /// RPLIDAR A1: 330 rpm. The standard scan does not tell the speed; the times of its revolutions do.
    pub const RPLIDAR_A1: Self = Self {
        target_rpm: 330.0,
        ..Self::NEATO_XV11
    };
    /// YDLIDAR X2: 420 rpm.
    pub const YDLIDAR_X2: Self = Self {
        target_rpm: 420.0,
        ..Self::NEATO_XV11
    };
    /// LD06: 600 rpm at about 40 % duty.
    pub const LDROBOT_LD06: Self = Self {
        target_rpm: 600.0,
        initial_duty: 0.4,
        proportional: 0.0005,
        integral: 0.001,
        tolerance_rpm: 30.0,
        ..Self::NEATO_XV11
    };
}

/// State of a motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum MotorState {
    /// On its way to its speed.
    SpinningUp,
    /// At its speed.
    Steady,
    /// Switched off here.
    Off,
}

/// Why the motor was switched off.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum MotorError<E> {
    /// The speed was not steady in time.
    SpinUp {
        /// What it was last (rpm), 0 where nothing was reported.
        last_rpm: f32,
    },
    /// Nothing was heard of it for so long (ms): it stands, or the line is broken.
    Silent {
        /// How long (ms).
        silent_ms: u32,
    },
    /// The PWM channel's own.
    Pwm(E),
}

impl<E: fmt::Debug> fmt::Display for MotorError<E> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::SpinUp { last_rpm } => write!(f, "no steady speed in time; last {last_rpm} rpm"),
            Self::Silent { silent_ms } => write!(f, "no speed was reported for {silent_ms} ms"),
            Self::Pwm(error) => write!(f, "the motor's PWM failed: {error:?}"),
        }
    }
}

impl<E: fmt::Debug> core::error::Error for MotorError<E> {}

/// PI control of a motor. 60 bytes and the PWM channel.
#[derive(Debug)]
pub struct Motor<P> {
    pwm: P,
    config: MotorConfig,
    state: MotorState,
    /// Duty without the proportional part.
    integral: f32,
    started_us: u32,
    heard_us: u32,
    last_rpm: f32,
}

impl<P: SetDutyCycle> Motor<P> {
    /// Off until [`Motor::start`].
    pub const fn new(pwm: P, config: MotorConfig) -> Self {
        Self {
            pwm,
            config,
            state: MotorState::Off,
            integral: 0.0,
            started_us: 0,
            heard_us: 0,
            last_rpm: 0.0,
        }
    }

    /// Whether it is off, spinning up or steady.
    pub fn state(&self) -> MotorState {
        self.state
    }

    /// Switches the motor on at `now_us` (µs, wrapping).
    ///
    /// # Errors
    ///
    /// [`MotorError::Pwm`] where the PWM channel fails.
    pub fn start(&mut self, now_us: u32) -> Result<(), MotorError<P::Error>> {
        self.state = MotorState::SpinningUp;
        self.integral = self.config.initial_duty;
        (self.started_us, self.heard_us) = (now_us, now_us);
        self.last_rpm = 0.0;
        self.drive(self.integral)
    }

    /// Switches the motor off.
    ///
    /// # Errors
    ///
    /// [`MotorError::Pwm`] where the PWM channel fails.
    pub fn stop(&mut self) -> Result<(), MotorError<P::Error>> {
        self.state = MotorState::Off;
        self.pwm.set_duty_cycle_fully_off().map_err(MotorError::Pwm)
    }

    /// Takes a reported speed (rpm), only from frames that passed their check; sets the duty by it.
    ///
    /// # Errors
    ///
    /// [`MotorError::Pwm`] where the PWM channel fails.
    pub fn report(&mut self, now_us: u32, rpm: f32) -> Result<(), MotorError<P::Error>> {
        if self.state == MotorState::Off || !(0.0..10_000.0).contains(&rpm) {
            return Ok(());
        }
        // After a pause, only so much of it counts.
        let seconds = math::min(now_us.wrapping_sub(self.heard_us) as f32 * 1e-6, 0.1);
        (self.heard_us, self.last_rpm) = (now_us, rpm);
        let error = self.config.target_rpm - rpm;
        let (least, largest) = self.config.duty_range;
        let proportional = self.config.proportional * error;
        let integral = self.integral + self.config.integral * error * seconds;
        let duty = integral + proportional;
        // What the limits cut off is not integrated.
        if (least..=largest).contains(&duty) {
            self.integral = integral;
        }
        if math::abs(error) <= self.config.tolerance_rpm {
            self.state = MotorState::Steady;
        } else if self.state == MotorState::Steady && 2.0 * rpm < self.config.target_rpm {
            // Something holds it: it gets as much time as at its start.
            (self.state, self.started_us) = (MotorState::SpinningUp, now_us);
        }
        self.drive(duty)
    }

    /// Watches over the motor; to be called now and then. Between reports the duty stays as it is.
    ///
    /// # Errors
    ///
    /// [`MotorError::SpinUp`] where the speed was not steady in time, [`MotorError::Silent`] where nothing was reported of it,
    /// [`MotorError::Pwm`] where the channel fails. The first two have switched the motor off.
    pub fn poll(&mut self, now_us: u32) -> Result<MotorState, MotorError<P::Error>> {
        let silent_ms = now_us.wrapping_sub(self.heard_us) / 1000;
        let since_start_ms = now_us.wrapping_sub(self.started_us) / 1000;
        let error = match self.state {
            MotorState::SpinningUp if since_start_ms >= self.config.spin_up_ms => {
                MotorError::SpinUp {
                    last_rpm: self.last_rpm,
                }
            }
            MotorState::Steady if silent_ms >= self.config.silence_ms => {
                MotorError::Silent { silent_ms }
            }
            state => return Ok(state),
        };
        self.stop()?;
        Err(error)
    }

    fn drive(&mut self, duty: f32) -> Result<(), MotorError<P::Error>> {
        let (least, largest) = self.config.duty_range;
        let duty = math::max(least, math::min(duty, largest));
        let duty = math::max(0.0, math::min(duty, 1.0));
        let most = self.pwm.max_duty_cycle();
        let steps = (duty * f32::from(most)) as u16;
        self.pwm
            .set_duty_cycle(steps.min(most))
            .map_err(MotorError::Pwm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::cell::Cell;
    use core::convert::Infallible;

    struct Pwm<'a>(&'a Cell<u16>);

    impl embedded_hal::pwm::ErrorType for Pwm<'_> {
        type Error = Infallible;
    }

    impl SetDutyCycle for Pwm<'_> {
        fn max_duty_cycle(&self) -> u16 {
            1000
        }

        fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
            self.0.set(duty);
            Ok(())
        }
    }

    /// A motor that settles within half a second at a speed in proportion to its duty.
    fn run(
        config: MotorConfig,
        rpm_at_full: f32,
        seconds: u32,
    ) -> (Result<MotorState, MotorError<Infallible>>, f32) {
        let duty = Cell::new(0);
        let mut motor = Motor::new(Pwm(&duty), config);
        motor.start(0).expect("no errors");
        let (mut rpm, mut state) = (0.0f32, Ok(MotorState::Off));
        for step in 1..seconds * 50 {
            let now_us = step * 20_000;
            rpm += (rpm_at_full * f32::from(duty.get()) / 1000.0 - rpm) * 0.02 / 0.15;
            if rpm > 50.0 {
                motor.report(now_us, rpm).expect("no errors");
            }
            state = motor.poll(now_us);
            if state.is_err() {
                assert_eq!(duty.get(), 0, "not switched off");
                break;
            }
        }
        (state, rpm)
    }

    #[test]
    fn motors_strong_and_weak_reach_their_speed() {
        for (config, rpm_at_full) in [
            (MotorConfig::NEATO_XV11, 450.0),
            (MotorConfig::NEATO_XV11, 900.0),
            (MotorConfig::DELTA_2A, 600.0),
            (MotorConfig::RPLIDAR_A1, 700.0),
            (MotorConfig::YDLIDAR_X2, 700.0),
            (MotorConfig::LDROBOT_LD06, 1500.0),
            (MotorConfig::LDROBOT_LD06, 1100.0),
        ] {
            let (state, rpm) = run(config, rpm_at_full, 9);
            assert_eq!(state, Ok(MotorState::Steady), "{rpm_at_full}");
            assert!(
                (rpm - config.target_rpm).abs() < 5.0,
                "{rpm_at_full}: {rpm}"
            );
        }
    }

    #[test]
    fn a_motor_that_stands_or_is_too_weak_is_reported() {
        let stands = run(MotorConfig::NEATO_XV11, 0.0, 20).0;
        assert_eq!(stands, Err(MotorError::SpinUp { last_rpm: 0.0 }));
        let weak = run(MotorConfig::NEATO_XV11, 200.0, 20).0;
        assert!(matches!(weak, Err(MotorError::SpinUp { last_rpm }) if last_rpm > 150.0));
    }

    #[test]
    fn a_steady_motor_that_is_held_is_switched_off() {
        let duty = Cell::new(0);
        let mut motor = Motor::new(Pwm(&duty), MotorConfig::NEATO_XV11);
        motor.start(0).expect("no errors");
        motor.report(20_000, 300.0).expect("no errors");
        assert_eq!(motor.state(), MotorState::Steady);
        let mut ended = None;
        for now_us in (40_000..20_000_000).step_by(20_000) {
            motor.report(now_us, 12.0).expect("no errors");
            if let Err(error) = motor.poll(now_us) {
                ended = Some((now_us, error));
                break;
            }
        }
        let error = MotorError::SpinUp { last_rpm: 12.0 };
        assert_eq!(ended, Some((10_040_000, error)));
        assert_eq!(duty.get(), 0);
    }

    #[test]
    fn silence_switches_off() {
        let duty = Cell::new(0);
        let mut motor = Motor::new(Pwm(&duty), MotorConfig::NEATO_XV11);
        assert_eq!(motor.poll(0), Ok(MotorState::Off));
        motor.start(0).expect("no errors");
        motor.report(20_000, 300.0).expect("no errors");
        let held = duty.get();
        assert_eq!(motor.poll(1_900_000), Ok(MotorState::Steady));
        assert_eq!(duty.get(), held);
        let error = MotorError::Silent { silent_ms: 2000 };
        assert_eq!(motor.poll(2_020_000), Err(error));
        assert_eq!((duty.get(), motor.state()), (0, MotorState::Off));
    }
}
