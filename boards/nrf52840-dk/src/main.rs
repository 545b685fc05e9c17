//! Lidar bytes in at P1.01, requests to it out at P1.02, frames out and commands in over the probe's USB, the motor's PWM at P1.03, all by await; poses
//! on the probe's log too.
#![no_std]
#![no_main]

use core::convert::Infallible;

use beamfix_app::{AppConfig, Lidar as _, OdometryWith, Place, Row, chosen, telemetry::Reset};
use beamfix_embassy::{Buffers, Lines, run};
use defmt_rtt as _;
use embassy_executor::Spawner;
use embassy_nrf::{
    bind_interrupts,
    buffered_uarte::{BufferedUarte, InterruptHandler},
    pac,
    peripherals::{UARTE0, UARTE1},
    pwm::{DutyCycle, Prescaler, SimpleConfig, SimplePwm},
    uarte::{Baudrate, Config},
    wdt::{self, Watchdog, WatchdogHandle},
};
use embedded_hal::pwm::{ErrorType, SetDutyCycle};
use panic_probe as _;
use static_cell::ConstStaticCell;

/// Nothing goes on for so long: reset (1/32 768 s).
const PATIENCE: u32 = 32_768;
/// Steps of the motor's PWM: 30 kHz of 16 MHz. An LD06 takes 20 to 50 kHz.
const STEPS: u16 = 533;

bind_interrupts!(struct Interrupts {
    UARTE0 => InterruptHandler<UARTE0>;
    UARTE1 => InterruptHandler<UARTE1>;
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

/// The first channel, as embedded-hal has it.
struct Motor<'d>(SimplePwm<'d>);

impl ErrorType for Motor<'_> {
    type Error = Infallible;
}

impl SetDutyCycle for Motor<'_> {
    fn max_duty_cycle(&self) -> u16 {
        STEPS
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Infallible> {
        self.0.set_duty(0, DutyCycle::inverted(duty));
        Ok(())
    }
}

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let p = embassy_nrf::init(Default::default());
    let buffers = BUFFERS.take();
    let uart = |baudrate| {
        let mut config = Config::default();
        config.baudrate = baudrate;
        config
    };
    let lidar = BufferedUarte::new(
        p.UARTE0,
        p.TIMER1,
        p.PPI_CH0,
        p.PPI_CH1,
        p.PPI_GROUP0,
        p.P1_01,
        p.P1_02,
        Interrupts,
        uart(baudrate(Lidar::MODEL.baud)),
        &mut buffers.lidar,
        &mut buffers.to_lidar,
    );
    let (commands, telemetry) = BufferedUarte::new(
        p.UARTE1,
        p.TIMER2,
        p.PPI_CH2,
        p.PPI_CH3,
        p.PPI_GROUP1,
        p.P0_08,
        p.P0_06,
        Interrupts,
        uart(Baudrate::Baud921600),
        &mut buffers.commands,
        &mut buffers.telemetry,
    )
    .split();
    let mut config = SimpleConfig::default();
    config.prescaler = Prescaler::Div1;
    config.max_duty = STEPS;
    let motor = Motor(SimplePwm::new_1ch(p.PWM0, p.P1_03, &config));

    let reset = reset();
    let mut config = wdt::Config::default();
    config.timeout_ticks = PATIENCE;
    let Ok((_, [mut watchdog])) = Watchdog::try_new(p.WDT, config) else {
        panic!("the watchdog runs already, in another way");
    };
    let lines = Lines {
        lidar,
        set_lidar_baud: |uart, baud| uart.set_baudrate(baudrate(baud)),
        commands,
        telemetry,
    };
    let feed = || WatchdogHandle::pet(&mut watchdog);
    let app = APP.take().odometry::<Lidar>(&HERE);
    run::<Lidar, _, _, _>(app, &HERE, reset, lines, motor, feed).await
}

/// The UART's divisor: 16 MHz are 2³², of which it takes the upper 20 bits.
const fn baudrate(baud: u32) -> Baudrate {
    let bits = ((baud as u64) << 32) / 16_000_000;
    Baudrate::from_bits(((bits + 0x800) & 0xffff_f000) as u32)
}

/// Why the chip has started; forgets it, so that the next time tells itself.
fn reset() -> Reset {
    let reasons = pac::POWER.resetreas().read();
    // A 1 clears what it stands on.
    pac::POWER.resetreas().write_value(reasons);
    if reasons.dog() {
        Reset::Watchdog
    } else if reasons.0 == 0 {
        Reset::Power
    } else {
        Reset::Other
    }
}
