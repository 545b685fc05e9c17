//! What the Pico and the Pico 2 share: the lidar's bytes in at GP5 and requests to it out at GP4, commands at GP1, frames out at
//! GP0, the motor's PWM at GP6; poses on the probe's log too.
#![no_std]

use core::{cell::RefCell, marker::PhantomData};

use beamfix::geometry::Pose;
use beamfix_app::{
    AppConfig, Firmware, Lidar, TELEMETRY_BAUD,
    ring::Ring,
    run::{self, Hardware, run},
    task::Task,
    telemetry::Reset,
};
use critical_section::Mutex;
use embedded_io::Write as _;
use hal::{
    Clock as _, Sio, Timer, Watchdog,
    clocks::init_clocks_and_plls,
    fugit::{ExtU32 as _, HertzU32, RateExtU32 as _},
    gpio::{
        FunctionPwm, FunctionUart, Pin, Pins, PullDown,
        bank0::{Gpio0, Gpio1, Gpio4, Gpio5},
    },
    pac::{self, interrupt},
    pwm::Slices,
    uart::{
        DataBits, Reader, StopBits, UartConfig, UartDevice, UartPeripheral, ValidUartPinout, Writer,
    },
};

/// Of the board's crystal (Hz).
const CRYSTAL: u32 = 12_000_000;
/// Nothing goes on for so long: reset (µs).
const WATCHDOG_US: u32 = 1_000_000;
/// Frequency of the motor's PWM (Hz): an LD06 takes 20 to 50 kHz.
const PWM_HZ: u32 = 30_000;

type Uart<P> = Pin<P, FunctionUart, PullDown>;
type LidarPins = (Uart<Gpio4>, Uart<Gpio5>);
type LidarUart = Reader<pac::UART1, LidarPins>;
type OtherPins = (Uart<Gpio0>, Uart<Gpio1>);

static LIDAR_UART: Mutex<RefCell<Option<LidarUart>>> = Mutex::new(RefCell::new(None));
static COMMAND_UART: Mutex<RefCell<Option<Reader<pac::UART0, OtherPins>>>> =
    Mutex::new(RefCell::new(None));
/// What arrives while a match is computed: 178 ms of an LD06.
static LIDAR: Ring<4096> = Ring::new();
static COMMANDS: Ring<1024> = Ring::new();

struct Board<L> {
    lidar: PhantomData<L>,
    /// `None` only while its speed is changed.
    to_lidar: Option<Writer<pac::UART1, LidarPins>>,
    /// Of the UARTs.
    clock: HertzU32,
    telemetry: Writer<pac::UART0, OtherPins>,
    #[cfg(target_arch = "arm")]
    timer: TheTimer,
    watchdog: Watchdog,
    reset: Reset,
}

#[cfg(target_abi = "eabihf")]
type TheTimer = Timer<hal::timer::CopyableTimer0>;
#[cfg(not(target_abi = "eabihf"))]
type TheTimer = Timer;

impl<L: Lidar> Hardware for Board<L> {
    const ASKS: bool = L::ASKS;

    fn reset(&mut self) -> Reset {
        self.reset
    }

    fn now_us(&mut self) -> u32 {
        self.timer.get_counter_low()
    }

    fn send(&mut self, bytes: &[u8]) {
        let _ = self.telemetry.write_all(bytes);
    }

    fn send_to_lidar(&mut self, bytes: &[u8]) {
        if let Some(line) = &mut self.to_lidar {
            let _ = line.write_all(bytes);
            let _ = line.flush();
        }
    }

    fn set_lidar_baud(&mut self, baud: u32) {
        let Some(line) = self.to_lidar.take() else {
            return;
        };
        self.to_lidar = critical_section::with(|cs| {
            let mut uart = LIDAR_UART.borrow_ref_mut(cs);
            let both = UartPeripheral::join(uart.take()?, line).disable();
            let (mut lidar, line) = both.enable(uart_at(baud), self.clock).ok()?.split();
            lidar.enable_rx_interrupt();
            uart.replace(lidar);
            Some(line)
        });
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

/// Sets the board up and runs the application with the lidar L, which is the settings' one.
pub fn start<L: Lidar, E: Task<N>, const N: usize>(
    app: &mut Firmware<L::Parser, E, N>,
    config: &AppConfig,
) -> ! {
    let mut p = pac::Peripherals::take().expect("the first to take them");
    let mut core = cortex_m::Peripherals::take().expect("the first to take them");
    let reset = reset(&p.WATCHDOG);
    let mut watchdog = Watchdog::new(p.WATCHDOG);
    let Ok(clocks) = init_clocks_and_plls(
        CRYSTAL,
        p.XOSC,
        p.CLOCKS,
        p.PLL_SYS,
        p.PLL_USB,
        &mut p.RESETS,
        &mut watchdog,
    ) else {
        panic!("the crystal does not run");
    };
    #[cfg(target_abi = "eabihf")]
    let timer = Timer::new_timer0(p.TIMER0, &mut p.RESETS, &clocks);
    #[cfg(not(target_abi = "eabihf"))]
    let timer = Timer::new(p.TIMER, &mut p.RESETS, &clocks);
    let sio = Sio::new(p.SIO);
    let pins = Pins::new(p.IO_BANK0, p.PADS_BANK0, sio.gpio_bank0, &mut p.RESETS);
    let clock = clocks.peripheral_clock.freq();

    let lidar_pins = (pins.gpio4.into_function(), pins.gpio5.into_function());
    let (mut lidar, to_lidar) = UartPeripheral::new(p.UART1, lidar_pins, &mut p.RESETS)
        .enable(uart_at(config.lidar.baud), clock)
        .expect("a possible baud rate")
        .split();
    let other_pins = (pins.gpio0.into_function(), pins.gpio1.into_function());
    let (mut commands, telemetry) = UartPeripheral::new(p.UART0, other_pins, &mut p.RESETS)
        .enable(uart_at(TELEMETRY_BAUD), clock)
        .expect("a possible baud rate")
        .split();
    lidar.enable_rx_interrupt();
    commands.enable_rx_interrupt();
    critical_section::with(|cs| {
        LIDAR_UART.borrow(cs).replace(Some(lidar));
        COMMAND_UART.borrow(cs).replace(Some(commands));
    });
    // SAFETY: nothing relies on these being masked.
    unsafe {
        cortex_m::peripheral::NVIC::unmask(pac::Interrupt::UART0_IRQ);
        cortex_m::peripheral::NVIC::unmask(pac::Interrupt::UART1_IRQ);
    }
    // Wakes the loop up in time for its look.
    let system_hz = clocks.system_clock.freq().to_Hz();
    let ticks = system_hz / (1_000_000 / run::TICK_US) - 1;
    core.SYST.set_reload(ticks.min(0x00ff_ffff));
    core.SYST
        .set_clock_source(cortex_m::peripheral::syst::SystClkSource::Core);
    core.SYST.clear_current();
    core.SYST.enable_interrupt();
    core.SYST.enable_counter();

    let mut pwm = Slices::new(p.PWM, &mut p.RESETS).pwm3;
    pwm.set_top((system_hz / PWM_HZ) as u16 - 1);
    pwm.enable();
    let mut motor = pwm.channel_a;
    let _: Pin<_, FunctionPwm, _> = motor.output_to(pins.gpio6);

    let (name, baud) = (config.lidar.name, config.lidar.baud);
    defmt::info!("beamfix listens for {} at {} baud", name, baud);
    watchdog.start(WATCHDOG_US.micros());
    let board = Board {
        lidar: PhantomData::<L>,
        to_lidar: Some(to_lidar),
        clock,
        telemetry,
        timer,
        watchdog,
        reset,
    };
    #[cfg(feature = "demo")]
    let board = beamfix_selftest::simulated::Simulated::new(board);
    run(app, config, (&LIDAR, &COMMANDS), board, motor)
}

fn uart_at(baud: u32) -> UartConfig {
    UartConfig::new(baud.Hz(), DataBits::Eight, None, StopBits::One)
}

fn reset(watchdog: &pac::WATCHDOG) -> Reset {
    let reason = watchdog.reason().read();
    match reason.timer().bit_is_set() {
        true => Reset::Watchdog,
        // The chip clears the reason when its supply was away.
        false => Reset::Power,
    }
}

#[interrupt]
fn UART1_IRQ() {
    critical_section::with(|cs| {
        if let Some(uart) = LIDAR_UART.borrow_ref(cs).as_ref() {
            drain(uart, &LIDAR);
        }
    });
}

#[interrupt]
fn UART0_IRQ() {
    critical_section::with(|cs| {
        if let Some(uart) = COMMAND_UART.borrow_ref(cs).as_ref() {
            drain(uart, &COMMANDS);
        }
    });
}

/// Moves what the UART holds, at most 32 bytes, to the ring.
fn drain<D: UartDevice, P: ValidUartPinout<D>, const B: usize>(
    uart: &Reader<D, P>,
    ring: &Ring<B>,
) {
    let mut bytes = [0; 32];
    loop {
        match uart.read_raw(&mut bytes) {
            Ok(n) => ring.extend(bytes.get(..n).unwrap_or_default()),
            // The byte with the error is gone, those before it are good.
            Err(nb::Error::Other(error)) => {
                ring.extend(error.discarded);
                ring.lose(1);
            }
            Err(nb::Error::WouldBlock) => return,
        }
    }
}
