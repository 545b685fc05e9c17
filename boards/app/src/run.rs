//! The main loop of every board with interrupts.

use beamfix::{geometry::Pose, lidar::Protocol};
use embedded_hal::pwm::{ErrorType, SetDutyCycle};

use crate::{
    AppConfig, Firmware,
    ring::Ring,
    starter::{Starter, Wanted},
    supervisor::{self, Supervisor},
    task::Task,
    telemetry::Reset,
};

/// Bytes of the map that are looked up at a time in a search, about: 100 000 to 200 000 instructions, a few milliseconds.
pub const WORK: u32 = 10_000;
/// Most bytes that are taken from a ring at a time: what an LD06 sends in 1.4 ms.
const PIECE: usize = 32;

/// What the loop needs of a board besides its interrupts, which fill the two rings.
pub trait Hardware {
    /// Whether the board has a line to the lidar, and starts one that must be asked. Without it, no code for that is linked.
    const ASKS: bool = false;

    /// Why the board has started.
    fn reset(&mut self) -> Reset {
        Reset::Other
    }

    /// Time since the start (µs, wrapping).
    fn now_us(&mut self) -> u32;

    /// Sends bytes, waiting as long as it takes.
    fn send(&mut self, bytes: &[u8]);

    /// Sends bytes to the lidar, waiting until the last one has left; where the board [`Hardware::ASKS`].
    fn send_to_lidar(&mut self, bytes: &[u8]) {
        let _ = bytes;
    }

    /// Sets the lidar's line to so many bits a second; at the start it is at that of the lidar's model. Where the board
    /// [`Hardware::ASKS`].
    fn set_lidar_baud(&mut self, baud: u32) {
        let _ = baud;
    }

    /// Keeps the board from being reset; called only while something goes on.
    fn feed_watchdog(&mut self);

    /// Sleeps until an interrupt is pending. Called with interrupts masked; must not unmask them.
    fn wait(&mut self);

    /// Something was sent; `pose` is where the robot is.
    fn log(&mut self, pose: Pose) {
        let _ = pose;
    }

    /// Where the lidar is simulated on the board: puts the bytes that it has sent until now (µs, wrapping) into its ring.
    fn simulate<const L: usize>(&mut self, now_us: u32, lidar: &Ring<L>) {
        let _ = (now_us, lidar);
    }

    /// Where it is simulated: the true pose of the robot at a time of the lidar's clock (µs, wrapping).
    #[cfg(feature = "truth")]
    fn truth(&mut self, time_us: u32) -> Option<Pose> {
        let _ = time_us;
        None
    }
}

/// Runs the application for ever.
///
/// The board must wake up by itself now and then (a timer's interrupt), or a silent lidar would look like a hang.
pub fn run<P: Protocol, E: Task<N>, const N: usize, const L: usize, const C: usize>(
    app: &mut Firmware<P, E, N>,
    config: &AppConfig,
    rings: (&Ring<L>, &Ring<C>),
    mut hardware: impl Hardware,
    pwm: impl SetDutyCycle,
) -> ! {
    let mut supervisor = Supervisor::new(pwm, config, hardware.now_us());
    let mut starter = Starter::new(config.lidar);
    let reset = hardware.reset();
    hardware.send(app.ready(reset));
    loop {
        go_round(app, rings, &mut hardware, &mut supervisor, &mut starter);
    }
}

/// Runs the application for ever with whichever lidar a command chooses; with the settings' until then. How the lidar sits and how
/// the motor's line is wired stays as the settings have it.
#[cfg(feature = "any-lidar")]
pub fn run_any<const N: usize, const L: usize, const C: usize>(
    app: &mut crate::any::AnyLidar<N>,
    config: &AppConfig,
    rings: (&Ring<L>, &Ring<C>),
    mut hardware: impl Hardware,
    mut pwm: impl SetDutyCycle,
) -> ! {
    let mut config = *config;
    let reset = hardware.reset();
    hardware.send(app.ready(reset));
    loop {
        let mut supervisor = Supervisor::new(&mut pwm, &config, hardware.now_us());
        let mut starter = Starter::new(config.lidar);
        let chosen = loop {
            go_round(app, rings, &mut hardware, &mut supervisor, &mut starter);
            if let Some(chosen) = app.chosen() {
                break chosen;
            }
        };
        let mount = config.odometry.points.mount;
        let motor = config.motor.is_some();
        config = AppConfig {
            lidar: chosen,
            ..config
        };
        let other = AppConfig::for_model(chosen);
        config.odometry = other.odometry;
        config.odometry.points.mount = mount;
        config.motor = other.motor.filter(|_| motor);
        app.choose(&config);
        hardware.set_lidar_baud(chosen.baud);
        // What came at another speed.
        let mut bytes = [0; PIECE];
        while rings.0.read(&mut bytes) > 0 {}
        hardware.send(app.ready(Reset::Asked));
    }
}

/// Once through everything that can be due.
#[inline(always)]
fn go_round<
    H: Hardware,
    P: Protocol,
    E: Task<N>,
    const N: usize,
    const L: usize,
    const C: usize,
>(
    app: &mut Firmware<P, E, N>,
    (lidar, commands): (&Ring<L>, &Ring<C>),
    hardware: &mut H,
    supervisor: &mut Supervisor<impl SetDutyCycle>,
    starter: &mut Starter,
) {
    let now_us = hardware.now_us();
    app.set_time(now_us);
    hardware.simulate(now_us, lidar);
    if supervisor.is_due(now_us) {
        app.set_bytes_lost(lidar.lost());
        let mut care = supervisor.look(now_us, app.seen());
        if H::ASKS {
            starter.look(now_us, &mut care);
        }
        app.set_care(care);
        if care.progress {
            hardware.feed_watchdog();
        }
        let due = app.tick();
        if !due.is_empty() {
            hardware.send(due);
        }
        while H::ASKS
            && let Some(wanted) = starter.wants(now_us)
        {
            match wanted {
                Wanted::Send(request) => hardware.send_to_lidar(&request),
                Wanted::SetBaud(baud) => hardware.set_lidar_baud(baud),
            }
        }
        if H::ASKS
            && let Some(zero_cdeg) = starter.zero_cdeg()
        {
            let due = app.set_zero(zero_cdeg);
            if !due.is_empty() {
                hardware.send(due);
            }
        }
    }
    // A piece of each in turn, the lidar's first: a flood of commands takes no more than its share of the time.
    let mut drained = true;
    let mut bytes = [0; PIECE];
    for is_lidar in [true, false] {
        let count = match is_lidar {
            true => lidar.read(&mut bytes),
            false => commands.read(&mut bytes),
        };
        drained &= count < PIECE;
        let mut rest = bytes.get(..count).unwrap_or_default();
        if H::ASKS && is_lidar {
            starter.heard(rest);
        }
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
    // A search in a map goes on where nothing else is to be done.
    if drained && app.work(WORK) {
        // Looked at once more with interrupts masked: a byte that came just now would not wake the sleeper.
        // A masked interrupt that is pending does.
        critical_section::with(|_| {
            if lidar.is_empty() && commands.is_empty() {
                hardware.wait();
            }
        });
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
