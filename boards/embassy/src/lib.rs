//! The main loop of the boards with embassy: everything waits by `await`, over `embedded-io-async`.
#![no_std]

use beamfix::lidar::Protocol;
use beamfix_app::{
    AppConfig, Firmware, Lidar,
    starter::{Starter, Wanted},
    supervisor::{LOOK_US, Supervisor},
    task::Task,
    telemetry::Reset,
};
use embassy_futures::select::{Either, select};
use embassy_time::{Duration, Instant, with_timeout};
use embedded_hal::pwm::SetDutyCycle;
use embedded_io_async::{Read, Write};

/// What the lines' buffers take, in a static of the board.
pub struct Buffers {
    /// What arrives while a match is computed: 178 ms of an LD06.
    pub lidar: [u8; 4096],
    /// Requests to it.
    pub to_lidar: [u8; 32],
    /// What comes in on the command line.
    pub commands: [u8; 1024],
    /// What is to leave on the telemetry line.
    pub telemetry: [u8; 256],
}

impl Buffers {
    /// Nothing in them.
    pub const EMPTY: Self = Self {
        lidar: [0; 4096],
        to_lidar: [0; 32],
        commands: [0; 1024],
        telemetry: [0; 256],
    };
}

/// The lines of a board.
pub struct Lines<L, C, T> {
    /// From and to the lidar; buffered, for bytes arrive while a match is computed.
    pub lidar: L,
    /// Sets its speed (bits/s), once all that was sent has left it.
    pub set_lidar_baud: fn(&mut L, u32),
    /// The command line: wheels, gyroscope, questions.
    pub commands: C,
    /// The telemetry line: poses and health.
    pub telemetry: T,
}

/// Runs the application with the lidar M, which is the settings' one, for ever; `feed` keeps the board from being reset and is
/// called only while something goes on.
pub async fn run<M: Lidar, E: Task<N>, const N: usize, L: Read + Write>(
    app: &mut Firmware<M::Parser, E, N>,
    config: &AppConfig,
    reset: Reset,
    mut lines: Lines<L, impl Read, impl Write>,
    pwm: impl SetDutyCycle,
    mut feed: impl FnMut(),
) -> ! {
    let mut supervisor = Supervisor::new(pwm, config, now_us());
    let mut starter = Starter::new(config.lidar);
    let _ = lines.telemetry.write_all(app.ready(reset)).await;
    let (name, baud) = (config.lidar.name, config.lidar.baud);
    defmt::info!("beamfix listens for {} at {} baud", name, baud);
    let mut overruns = 0u32;
    #[cfg(feature = "demo")]
    let mut demo = beamfix_selftest::demo::Demo::new();
    loop {
        let now_us = now_us();
        app.set_time(now_us);
        if supervisor.is_due(now_us) {
            let mut care = supervisor.look(now_us, app.seen());
            if M::ASKS {
                starter.look(now_us, &mut care);
            }
            app.set_care(care);
            if care.progress {
                feed();
            }
            let due = app.tick();
            if !due.is_empty() {
                let _ = lines.telemetry.write_all(due).await;
            }
            while M::ASKS
                && let Some(wanted) = starter.wants(now_us)
            {
                match wanted {
                    Wanted::Send(request) => {
                        let _ = lines.lidar.write_all(&request).await;
                        let _ = lines.lidar.flush().await;
                    }
                    Wanted::SetBaud(baud) => (lines.set_lidar_baud)(&mut lines.lidar, baud),
                }
            }
            if M::ASKS
                && let Some(zero_cdeg) = starter.zero_cdeg()
            {
                let due = app.set_zero(zero_cdeg);
                if !due.is_empty() {
                    let _ = lines.telemetry.write_all(due).await;
                }
            }
        }
        #[cfg(feature = "demo")]
        simulate(app, &mut demo, &mut lines.telemetry, now_us).await;
        let (mut lidar_bytes, mut command_bytes) = ([0; 64], [0; 64]);
        let read = select(
            lines.lidar.read(&mut lidar_bytes),
            lines.commands.read(&mut command_bytes),
        );
        let (bytes, is_lidar) = match with_timeout(SLEEP, read).await {
            Ok(Either::First(Ok(n))) => (lidar_bytes.get(..n), true),
            Ok(Either::Second(Ok(n))) => (command_bytes.get(..n), false),
            // An error stands for at least one byte.
            Ok(Either::First(Err(_))) => {
                overruns = overruns.wrapping_add(1);
                app.set_bytes_lost(overruns);
                continue;
            }
            Ok(Either::Second(Err(_))) | Err(_) => continue,
        };
        let mut rest = bytes.unwrap_or_default();
        if M::ASKS && is_lidar {
            starter.heard(rest);
        }
        while !rest.is_empty() {
            let (taken, sent) = if is_lidar {
                app.lidar(rest)
            } else {
                app.command(rest)
            };
            rest = rest.get(taken..).unwrap_or_default();
            if !sent.is_empty() {
                let _ = lines.telemetry.write_all(sent).await;
                log(app);
            }
        }
    }
}

/// Lets the simulated lidar send what it has measured until now.
#[cfg(feature = "demo")]
async fn simulate<P: Protocol, E: Task<N>, const N: usize>(
    app: &mut Firmware<P, E, N>,
    demo: &mut beamfix_selftest::demo::Demo,
    telemetry: &mut impl Write,
    now_us: u32,
) {
    // A packet at a time.
    let ring = beamfix_app::ring::Ring::<64>::new();
    loop {
        demo.advance(now_us, |byte| ring.push(byte));
        if ring.is_empty() {
            return;
        }
        let mut bytes = [0; 64];
        let count = ring.read(&mut bytes);
        let mut rest = bytes.get(..count).unwrap_or_default();
        while !rest.is_empty() {
            let (taken, sent) = app.lidar(rest);
            rest = rest.get(taken..).unwrap_or_default();
            if !sent.is_empty() {
                let _ = telemetry.write_all(sent).await;
                let _ = telemetry
                    .write_all(app.truth(|time_us| Some(demo.truth(time_us))))
                    .await;
                log(app);
            }
        }
    }
}

fn log<P: Protocol, E: Task<N>, const N: usize>(app: &Firmware<P, E, N>) {
    let pose = app.pose();
    defmt::info!("x {} m, y {} m, heading {} rad", pose.x, pose.y, pose.theta);
}

/// Longest sleep: so often the supervisor looks.
const SLEEP: Duration = Duration::from_micros(LOOK_US as u64);

fn now_us() -> u32 {
    Instant::now().as_micros() as u32
}
