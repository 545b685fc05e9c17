//! The main loop of every board with interrupts.

use embedded_hal::pwm::{ErrorType, SetDutyCycle};

use crate::{
    App, AppConfig,
    ring::Ring,
    supervisor::{self, Supervisor},
    telemetry::Reset,
};

/// Most bytes that are taken from a ring at a time: what an LD06 sends in 1.4 ms.
const PIECE: usize = 32;

/// What the loop needs of a board besides its interrupts, which fill the two rings.
pub trait Hardware {
    /// Why the board has started.
    fn reset(&mut self) -> Reset {
        Reset::Other
    }

    /// Time since the start (µs, wrapping).
    fn now_us(&mut self) -> u32;

    /// Sends bytes, waiting as long as it takes.
    fn send(&mut self, bytes: &[u8]);

    /// Keeps the board from being reset; called only while something goes on.
    fn feed_watchdog(&mut self);

    /// Sleeps until an interrupt is pending. Called with interrupts masked; must not unmask them.
    fn wait(&mut self);

    /// Something was sent; `pose` is where the robot is.
    fn log(&mut self, pose: beamfix::geometry::Pose) {
        let _ = pose;
    }

    /// Where the lidar is simulated on the board: puts the bytes that it has sent until now (µs, wrapping) into its ring.
    fn simulate<const L: usize>(&mut self, now_us: u32, lidar: &Ring<L>) {
        let _ = (now_us, lidar);
    }

    /// Where it is simulated: the true pose of the robot at a time of the lidar's clock (µs, wrapping).
    #[cfg(feature = "truth")]
    fn truth(&mut self, time_us: u32) -> Option<beamfix::geometry::Pose> {
        let _ = time_us;
        None
    }
}

/// Runs the application for ever.
///
/// The board must wake up by itself now and then (a timer's interrupt), or a silent lidar would look like a hang.
pub fn run<const N: usize, const L: usize, const C: usize>(
    app: &mut App<N>,
    config: &AppConfig,
    (lidar, commands): (&Ring<L>, &Ring<C>),
    mut hardware: impl Hardware,
    pwm: impl SetDutyCycle,
) -> ! {
    let mut supervisor = Supervisor::new(pwm, config.motor, hardware.now_us());
    let reset = hardware.reset();
    hardware.send(app.ready(reset));
    loop {
        let now_us = hardware.now_us();
        app.set_time(now_us);
        hardware.simulate(now_us, lidar);
        if supervisor.is_due(now_us) {
            let care = supervisor.look(now_us, app.seen());
            app.set_care(care);
            if care.progress {
                hardware.feed_watchdog();
            }
            let due = app.tick();
            if !due.is_empty() {
                hardware.send(due);
            }
        }
        app.set_bytes_lost(lidar.lost());
        // A piece of each in turn, the lidar's first: a flood of commands takes no more than its share of the time.
        let mut idle = true;
        for is_lidar in [true, false] {
            let mut bytes = [0; PIECE];
            let count = match is_lidar {
                true => lidar.read(&mut bytes),
                false => commands.read(&mut bytes),
            };
            idle &= count == 0;
            let mut rest = bytes.get(..count).unwrap_or_default();
            while !rest.is_empty() {
                let (taken, sent) = match is_lidar {
                    true => app.lidar(rest),
                    false => app.command(rest),
                };
                rest = rest.get(taken..).unwrap_or_default();
                if !sent.is_empty() {
                    hardware.send(sent);
                    hardware.log(app.pose());
                    #[cfg(feature = "truth")]
                    {
                        let error = app.truth(|time_us| hardware.truth(time_us));
                        hardware.send(error);
                    }
                }
            }
        }
        if idle {
            // Looked at once more with interrupts masked: a byte that came just now would not wake the sleeper.
            // A masked interrupt that is pending does.
            critical_section::with(|_| {
                if lidar.is_empty() && commands.is_empty() {
                    hardware.wait();
                }
            });
        }
    }
}

/// For a motor whose PWM line is not connected.
#[derive(Debug, Clone, Copy)]
pub struct NoPwm;

impl ErrorType for NoPwm {
    type Error = core::convert::Infallible;
}

impl SetDutyCycle for NoPwm {
    fn max_duty_cycle(&self) -> u16 {
        u16::MAX
    }

    fn set_duty_cycle(&mut self, _: u16) -> Result<(), Self::Error> {
        Ok(())
    }
}

/// How often the loop must come round for [`Supervisor`] (µs): let the timer wake the board so often.
pub const TICK_US: u32 = supervisor::LOOK_US;
