//! Lidar bytes in at GP5, requests to it out at GP4, commands at GP1, frames out at GP0, the motor's PWM at GP6, all by await; poses on the probe's
//! log too.
#![no_std]
#![no_main]

use beamfix_app::{
    AppConfig, Lidar as _, OdometryWith, Place, Row, TELEMETRY_BAUD, chosen, telemetry::Reset,
};
use beamfix_embassy::{Buffers, Lines, run};
use defmt_rtt as _;
use embassy_executor::Spawner;
use embassy_rp::{
    bind_interrupts,
    clocks::clk_sys_freq,
    peripherals::{UART0, UART1},
    pwm::{self, Pwm},
    uart::{BufferedInterruptHandler, BufferedUart, Config},
    watchdog::{ResetReason, Watchdog},
};
use embassy_time::Duration;
use panic_probe as _;
use static_cell::ConstStaticCell;

/// Nothing goes on for so long: reset.
const PATIENCE: Duration = Duration::from_secs(1);
/// Frequency of the motor's PWM (Hz): an LD06 takes 20 to 50 kHz.
const PWM_HZ: u32 = 30_000;

bind_interrupts!(struct Interrupts {
    UART0_IRQ => BufferedInterruptHandler<UART0>;
    UART1_IRQ => BufferedInterruptHandler<UART1>;
});

/// The lidar: a name of `beamfix lidars`; BEAMFIX_LIDAR=NAME builds for another.
type Lidar = Row<{ chosen("ld06") }>;
/// The task, and the most beams of a revolution.
type Robot = OdometryWith<Lidar, { Lidar::BEAMS }>;

/// As this crate's features want it.
const HERE: AppConfig = Lidar::CONFIG
    .for_features(cfg!(feature = "demo"), cfg!(feature = "mavlink"))
    .checked();

static APP: ConstStaticCell<Place<Robot>> = ConstStaticCell::new(Place::EMPTY);
static BUFFERS: ConstStaticCell<Buffers> = ConstStaticCell::new(Buffers::EMPTY);

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let p = embassy_rp::init(Default::default());
    let buffers = BUFFERS.take();
    let uart = |baud| {
        let mut config = Config::default();
        config.baudrate = baud;
        config
    };
    let lidar = BufferedUart::new(
        p.UART1,
        p.PIN_4,
        p.PIN_5,
        Interrupts,
        &mut buffers.to_lidar,
        &mut buffers.lidar,
        uart(Lidar::MODEL.baud),
    );
    let (telemetry, commands) = BufferedUart::new(
        p.UART0,
        p.PIN_0,
        p.PIN_1,
        Interrupts,
        &mut buffers.telemetry,
        &mut buffers.commands,
        uart(TELEMETRY_BAUD),
    )
    .split();
    let mut config = pwm::Config::default();
    config.top = (clk_sys_freq() / PWM_HZ) as u16 - 1;
    let motor = Pwm::new_output_a(p.PWM_SLICE3, p.PIN_6, config);

    let mut watchdog = Watchdog::new(p.WATCHDOG);
    let reset = match watchdog.reset_reason() {
        Some(ResetReason::TimedOut) => Reset::Watchdog,
        Some(_) => Reset::Other,
        None => Reset::Power,
    };
    watchdog.start(PATIENCE);
    let lines = Lines {
        lidar,
        set_lidar_baud,
        commands,
        telemetry,
    };
    let app = APP.take().odometry::<Lidar>(&HERE);
    let feed = || watchdog.feed(PATIENCE);
    run::<Lidar, _, _, _>(app, &HERE, reset, lines, motor, feed).await
}

fn set_lidar_baud(uart: &mut BufferedUart, baud: u32) {
    // The last byte is still on its way.
    while uart.busy() {}
    uart.set_baudrate(baud);
}
