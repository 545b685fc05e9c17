//! Lidar bytes in at PA3, requests to it out at PA2, frames out at PA9 and commands in at PA10, the motor's PWM at PB6. No log: RAM and
//! flash are full without.
#![no_std]
#![no_main]

use core::sync::atomic::{AtomicU32, Ordering};

use beamfix_app::{
    AppConfig, Lidar as _, OdometryWith, Place, Row, SMALL_BEAMS, TELEMETRY_BAUD, chosen,
    ring::Ring,
    run::{Hardware, TICK_US, run},
    telemetry::Reset,
};
use beamfix_stm32::{Line, divisor, send, send_all_out};
use cortex_m::peripheral::{SCB, SYST, syst::SystClkSource};
use cortex_m_rt::{entry, exception};
use stm32f1xx_hal::{
    pac::{self, interrupt},
    prelude::*,
    rcc::Config,
    serial::{self, Rx, Tx},
    timer::{Channel, Tim4NoRemap},
    watchdog::IndependentWatchdog,
};

static LIDAR_UART: Line<Rx<pac::USART2>> = Line::new();
static COMMAND_UART: Line<Rx<pac::USART1>> = Line::new();
/// What arrives while a match is computed: 89 ms of an LD06.
static LIDAR: Ring<2048> = Ring::new();
static COMMANDS: Ring<128> = Ring::new();
/// So many times [`TICK_US`] have passed.
static TICKS: AtomicU32 = AtomicU32::new(0);
/// The timer's steps from one to the next: 9 a microsecond, an eighth of the core's clock.
const STEPS: u32 = 9 * TICK_US;

/// The lidar: a name of `beamfix lidars`; BEAMFIX_LIDAR=NAME builds for another.
type Lidar = Row<{ chosen("ld06") }>;
/// The task, and the most beams of a revolution; more have no room here, those that come last are refused and counted.
type Robot = OdometryWith<Lidar, { beams(Lidar::BEAMS) }>;

const fn beams(all: usize) -> usize {
    if all < SMALL_BEAMS { all } else { SMALL_BEAMS }
}

struct Board {
    to_lidar: Tx<pac::USART2>,
    /// Of the lidar's UART (Hz).
    lidar_clock: u32,
    telemetry: Tx<pac::USART1>,
    watchdog: IndependentWatchdog,
    reset: Reset,
}

impl Hardware for Board {
    const ASKS: bool = Lidar::ASKS;

    fn reset(&mut self) -> Reset {
        self.reset
    }

    fn now_us(&mut self) -> u32 {
        loop {
            let ticks = TICKS.load(Ordering::Relaxed);
            let left = SYST::get_current();
            // Else the tick fell between the two.
            if !SCB::is_pendst_pending() && ticks == TICKS.load(Ordering::Relaxed) {
                let since = (STEPS - 1).saturating_sub(left) / 9;
                return ticks.wrapping_mul(TICK_US).wrapping_add(since);
            }
        }
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
        unsafe { (*pac::USART2::ptr()).brr().write(|w| w.bits(divisor)) };
    }

    fn feed_watchdog(&mut self) {
        self.watchdog.feed();
    }

    fn wait(&mut self) {
        cortex_m::asm::wfi();
    }
}

const HERE: AppConfig = Lidar::CONFIG.checked();

#[entry]
fn main() -> ! {
    static mut APP: Place<Robot> = Place::EMPTY;

    let (Some(p), Some(mut core)) = (pac::Peripherals::take(), cortex_m::Peripherals::take())
    else {
        SCB::sys_reset()
    };
    let reset = reset(&p.RCC);
    let mut flash = p.FLASH.constrain();
    // The fastest, from the board's crystal.
    let clocks = Config::hse(8.MHz()).sysclk(72.MHz()).pclk1(36.MHz());
    let mut rcc = p.RCC.freeze(clocks, &mut flash.acr);
    let mut afio = p.AFIO.constrain(&mut rcc);
    let mut gpioa = p.GPIOA.split(&mut rcc);
    let mut gpiob = p.GPIOB.split(&mut rcc);
    let config = |baud: u32| serial::Config::default().baudrate(baud.bps());

    let pins = (
        gpioa.pa2.into_alternate_push_pull(&mut gpioa.crl),
        gpioa.pa3,
    );
    let uart = p.USART2.serial(pins, config(HERE.lidar.baud), &mut rcc);
    let (to_lidar, mut lidar) = uart.split();
    let pins = (
        gpioa.pa9.into_alternate_push_pull(&mut gpioa.crh),
        gpioa.pa10,
    );
    let uart = p.USART1.serial(pins, config(TELEMETRY_BAUD), &mut rcc);
    let (telemetry, mut commands) = uart.split();
    lidar.listen();
    commands.listen();
    LIDAR_UART.set(lidar);
    COMMAND_UART.set(commands);
    // SAFETY: nothing relies on these being masked.
    unsafe {
        cortex_m::peripheral::NVIC::unmask(pac::Interrupt::USART1);
        cortex_m::peripheral::NVIC::unmask(pac::Interrupt::USART2);
    }
    // An LD06 takes 20 to 50 kHz.
    let pin = gpiob.pb6.into_alternate_push_pull(&mut gpiob.crl);
    let mut pwm = (p.TIM4).pwm_hz::<Tim4NoRemap, _, _>(pin, &mut afio.mapr, 30.kHz(), &mut rcc);
    pwm.enable(Channel::C1);
    let motor = pwm.split();
    // The clock, which also wakes the loop up in time for its look.
    core.SYST.set_reload(STEPS - 1);
    core.SYST.set_clock_source(SystClkSource::External);
    core.SYST.clear_current();
    core.SYST.enable_interrupt();
    core.SYST.enable_counter();

    let mut watchdog = IndependentWatchdog::new(p.IWDG);
    watchdog.start(1.secs());
    let board = Board {
        to_lidar,
        lidar_clock: rcc.clocks.pclk1().raw(),
        telemetry,
        watchdog,
        reset,
    };
    let app = APP.odometry::<Lidar>(&HERE);
    run(app, &HERE, (&LIDAR, &COMMANDS), board, motor)
}

/// Why the chip has started; forgets it, so that the next time tells itself.
fn reset(rcc: &pac::RCC) -> Reset {
    let cause = rcc.csr().read();
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    if cause.iwdgrstf().bit_is_set() {
        Reset::Watchdog
    } else if cause.porrstf().bit_is_set() {
        Reset::Power
    } else {
        Reset::Other
    }
}

#[exception]
fn SysTick() {
    TICKS.fetch_add(1, Ordering::Relaxed);
}

#[interrupt]
fn USART2() {
    LIDAR_UART.drain(&LIDAR);
}

#[interrupt]
fn USART1() {
    COMMAND_UART.drain(&COMMANDS);
}

/// Nobody reads a message here: the board starts anew.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    SCB::sys_reset()
}
