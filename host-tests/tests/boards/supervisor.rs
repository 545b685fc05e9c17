//! Watching over the lidar: told states, a motor that stalls, and a watchdog that only progress feeds.

use beamfix::lidar::motor::MotorConfig;
use beamfix_app::{
    AppConfig, CONFIG,
    run::NoPwm,
    supervisor::{Care, LOOK_US, Seen, Supervisor},
    telemetry::{LidarState, MotorState},
};
use core::cell::Cell;
use core::convert::Infallible;
use embedded_hal::pwm::SetDutyCycle;

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

/// Looks for some seconds at a lidar that sends so much in every look; a revolution every 100 ms.
fn watch<P: SetDutyCycle>(
    supervisor: &mut Supervisor<P>,
    seen: &mut Seen,
    now_us: &mut u32,
    (bytes, packets, turns): (u32, u32, bool),
    ms: u32,
) -> Care {
    let mut care = Care::NONE;
    for k in 0..ms / 20 {
        *now_us = now_us.wrapping_add(LOOK_US);
        assert!(supervisor.is_due(*now_us));
        seen.bytes = seen.bytes.wrapping_add(bytes);
        seen.packets = seen.packets.wrapping_add(packets);
        seen.turns += u32::from(turns && k % 5 == 0);
        care = supervisor.look(*now_us, *seen);
    }
    care
}

#[test]
fn each_state_is_told_and_only_bytes_that_lead_nowhere_starve_the_watchdog() {
    use LidarState::{Noise, Silent, Standing, Turning};
    let config = AppConfig {
        motor: None,
        ..CONFIG
    };
    let mut supervisor = Supervisor::new(NoPwm, &config, 0);
    // The clock and the counters wrap on the way.
    let (mut seen, mut now_us) = (Seen::default(), u32::MAX - 30_000_000);
    seen.bytes = u32::MAX - 1000;
    //   what comes in a look      for (ms)  state     fed
    for (comes, ms, state, fed) in [
        ((0, 0, false), 60_000, Silent, true),
        ((352, 7, true), 1000, Turning, true),
        ((352, 7, false), 1500, Turning, true),
        ((352, 7, false), 2000, Standing, true),
        ((352, 7, false), 20_000, Standing, false),
        ((352, 7, true), 200, Turning, true),
        ((352, 0, false), 1200, Noise, true),
        ((352, 0, false), 20_000, Noise, false),
        ((0, 0, false), 5_000_000, Silent, true),
        ((352, 7, true), 1000, Turning, true),
    ] {
        let care = watch(&mut supervisor, &mut seen, &mut now_us, comes, ms);
        assert_eq!((care.lidar, care.progress), (state, fed), "{comes:?} {ms}");
        assert_eq!(care.motor, MotorState::Free);
    }
}

#[test]
fn a_motor_that_stalls_is_started_again() {
    let duty = Cell::new(7);
    let config = AppConfig {
        motor: Some(MotorConfig {
            initial_duty: 0.5,
            ..MotorConfig::LDROBOT_LD06
        }),
        ..CONFIG
    };
    let mut supervisor = Supervisor::new(Pwm(&duty), &config, 0);
    assert_eq!(duty.get(), 500);
    let (mut seen, mut now_us) = (Seen::default(), 0);
    (seen.rpm, seen.tells_rpm) = (600.0, true);
    let turning = (352, 7, true);
    let care = watch(&mut supervisor, &mut seen, &mut now_us, turning, 2000);
    assert_eq!((care.motor, care.motor_restarts), (MotorState::Steady, 0));
    let care = watch(&mut supervisor, &mut seen, &mut now_us, (0, 0, false), 3000);
    assert_eq!((care.motor, duty.get()), (MotorState::Off, 0));
    let care = watch(&mut supervisor, &mut seen, &mut now_us, (0, 0, false), 2000);
    assert_eq!(care.motor, MotorState::SpinningUp);
    assert_eq!((care.motor_restarts, duty.get()), (1, 500));
    let care = watch(&mut supervisor, &mut seen, &mut now_us, turning, 200);
    assert_eq!(care.motor, MotorState::Steady);
}

#[test]
fn without_a_motor_the_line_is_low() {
    let duty = Cell::new(7);
    let config = AppConfig {
        motor: None,
        ..CONFIG
    };
    let _ = Supervisor::new(Pwm(&duty), &config, 0);
    assert_eq!(duty.get(), 0);
}
