//! Lidar bytes in at PA10, requests to it out at PA9, frames out and commands in over the ST-Link's USB, the motor's PWM at PB6; poses on the probe's
//! log too.
#![no_std]
#![no_main]

use beamfix::geometry::Pose;
use beamfix_app::{
    AppConfig, Lidar as _, Place, Row, TELEMETRY_BAUD, chosen,
    ring::Ring,
    run::{self, Hardware, TICK_US},
    telemetry::Reset,
};
use beamfix_stm32::{Line, divisor, send, send_all_out};
use cortex_m_rt::{entry, exception};
use defmt_rtt as _;
use panic_probe as _;
use stm32f4xx_hal::{
    pac::{self, interrupt},
    prelude::*,
    rcc::Config,
    serial::{self, Rx, Tx},
    timer::Counter,
    watchdog::IndependentWatchdog,
};

static LIDAR_UART: Line<Rx<pac::USART1>> = Line::new();
static COMMAND_UART: Line<Rx<pac::USART2>> = Line::new();
/// What arrives while a match is computed: 178 ms of an LD06.
static LIDAR: Ring<4096> = Ring::new();
static COMMANDS: Ring<1024> = Ring::new();

/// The lidar: a name of `beamfix lidars`; BEAMFIX_LIDAR=NAME builds for another.
type Lidar = Row<{ chosen("ld06") }>;
/// The task, and the most beams of a revolution.
#[cfg(not(feature = "any-lidar"))]
type Robot = beamfix_app::OdometryWith<Lidar, { Lidar::BEAMS }>;
#[cfg(feature = "any-lidar")]
type Robot = beamfix_app::any::AnyLidar<1100>;

struct Board {
    to_lidar: Tx<pac::USART1>,
    /// Of the lidar's UART (Hz).
    lidar_clock: u32,
    telemetry: Tx<pac::USART2>,
    clock: Counter<pac::TIM2, 1_000_000>,
    watchdog: IndependentWatchdog,
    reset: Reset,
    #[cfg(feature = "qemu")]
    qemu: Qemu,
}

/// The time in QEMU, whose timers count 62.5 where the chip's count 1.
#[cfg(feature = "qemu")]
#[derive(Default)]
struct Qemu {
    ticks: u32,
    us: u32,
}

#[cfg(feature = "qemu")]
impl Qemu {
    fn us(&mut self, ticks: u32) -> u32 {
        let steps = ticks.wrapping_sub(self.ticks) / 125;
        self.ticks = self.ticks.wrapping_add(125 * steps);
        self.us = self.us.wrapping_add(2 * steps);
        self.us
    }
}

impl Hardware for Board {
    const ASKS: bool = Lidar::ASKS || cfg!(feature = "any-lidar");

    fn reset(&mut self) -> Reset {
        self.reset
    }

    fn now_us(&mut self) -> u32 {
        let us = self.clock.now().ticks();
        #[cfg(feature = "qemu")]
        let us = self.qemu.us(us);
        us
    }

    fn send(&mut self, bytes: &[u8]) {
        send(&mut self.telemetry, bytes);
    }

    fn send_to_lidar(&mut self, bytes: &[u8]) {
        send_all_out(&mut self.to_lidar, bytes);
    }

    fn set_lidar_baud(&mut self, baud: u32) {
        let divisor = divisor(self.lidar_clock, baud);
        // SAFETY: nothing else writes this register after the start.
        unsafe { (*pac::USART1::ptr()).brr().write(|w| w.bits(divisor)) };
    }

    fn feed_watchdog(&mut self) {
        self.watchdog.feed();
    }

    fn wait(&mut self) {
        cortex_m::asm::wfi();
    }

    fn log(&mut self, pose: Pose) {
        defmt::info!("x {} m, y {} m, heading {} rad", pose.x, pose.y, pose.theta);
    }
}

/// As this crate's features want it.
const HERE: AppConfig = Lidar::CONFIG
    .for_features(cfg!(feature = "demo"), cfg!(feature = "mavlink"))
    .checked();

#[entry]
fn main() -> ! {
    static mut APP: Place<Robot> = Place::EMPTY;

    let p = pac::Peripherals::take().expect("the first to take them");
    let mut core = cortex_m::Peripherals::take().expect("the first to take them");
    let reset = reset(&p.RCC);
    // The fastest that USB's clock allows too. QEMU has no PLL to wait for.
    let clocks = match cfg!(feature = "qemu") {
        true => Config::hsi(),
        false => Config::hsi().sysclk(168.MHz()),
    };
    let mut rcc = p.RCC.freeze(clocks);
    let gpioa = p.GPIOA.split(&mut rcc);
    let gpiob = p.GPIOB.split(&mut rcc);
    let config = |baud: u32| serial::config::Config::default().baudrate(baud.bps());

    let (to_lidar, mut lidar) = p
        .USART1
        .serial::<u8>((gpioa.pa9, gpioa.pa10), config(Lidar::MODEL.baud), &mut rcc)
        .expect("a possible baud rate")
        .split();
    let (telemetry, mut commands) = p
        .USART2
        .serial::<u8>((gpioa.pa2, gpioa.pa3), config(TELEMETRY_BAUD), &mut rcc)
        .expect("a possible baud rate")
        .split();
    lidar.listen();
    commands.listen();
    LIDAR_UART.set(lidar);
    COMMAND_UART.set(commands);
    // SAFETY: nothing relies on these being masked.
    unsafe {
        cortex_m::peripheral::NVIC::unmask(pac::Interrupt::USART1);
        cortex_m::peripheral::NVIC::unmask(pac::Interrupt::USART2);
    }
    let mut clock = p.TIM2.counter_us(&mut rcc);
    clock
        .start(u32::MAX.micros())
        .expect("a period that a timer of 32 bits has");
    // An LD06 takes 20 to 50 kHz.
    let (_, (motor, ..)) = p.TIM4.pwm_hz(30.kHz(), &mut rcc);
    let mut motor = motor.with(gpiob.pb6);
    motor.enable();
    // Wakes the loop up in time for its look.
    let ticks = rcc.clocks.sysclk().raw() / (1_000_000 / TICK_US) - 1;
    core.SYST.set_reload(ticks.min(0x00ff_ffff));
    core.SYST
        .set_clock_source(cortex_m::peripheral::syst::SystClkSource::Core);
    core.SYST.clear_current();
    core.SYST.enable_interrupt();
    core.SYST.enable_counter();

    let (name, baud) = (Lidar::MODEL.name, Lidar::MODEL.baud);
    defmt::info!("beamfix listens for {} at {} baud", name, baud);
    let mut watchdog = IndependentWatchdog::new(p.IWDG);
    watchdog.start(1.secs());
    let board = Board {
        to_lidar,
        lidar_clock: rcc.clocks.pclk2().raw(),
        telemetry,
        clock,
        watchdog,
        reset,
        #[cfg(feature = "qemu")]
        qemu: Qemu::default(),
    };
    #[cfg(feature = "demo")]
    let board = beamfix_selftest::simulated::Simulated::new(board);
    let rings = (&LIDAR, &COMMANDS);
    #[cfg(feature = "any-lidar")]
    run::run_any(APP.any(&HERE), &HERE, rings, board, motor);
    #[cfg(not(feature = "any-lidar"))]
    run::run(APP.odometry::<Lidar>(&HERE), &HERE, rings, board, motor)
}

/// Why the chip has started; forgets it, so that the next time tells itself.
fn reset(rcc: &pac::RCC) -> Reset {
    let cause = rcc.csr().read();
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    if cause.wdgrstf().bit_is_set() {
        Reset::Watchdog
    } else if cause.porrstf().bit_is_set() || cause.borrstf().bit_is_set() {
        Reset::Power
    } else {
        Reset::Other
    }
}

/// Wakes the loop up: nothing else to do.
#[exception]
fn SysTick() {}

#[interrupt]
fn USART1() {
    LIDAR_UART.drain(&LIDAR);
}

#[interrupt]
fn USART2() {
    COMMAND_UART.drain(&COMMANDS);
}
