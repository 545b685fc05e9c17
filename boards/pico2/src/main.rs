//! LD06 bytes in at GP5, commands at GP1, frames out at GP0; poses on the probe's log too.
#![no_std]
#![no_main]

use core::cell::RefCell;

use beamfix_app::{Board, CONFIG, ring::Ring};
use critical_section::Mutex;
use defmt_rtt as _;
use embedded_io::Write as _;
use panic_probe as _;
use rp235x_hal::{
    Clock as _, Sio, Watchdog,
    block::ImageDef,
    clocks::init_clocks_and_plls,
    entry,
    fugit::{ExtU32 as _, RateExtU32 as _},
    gpio::{
        FunctionUart, Pin, Pins, PullDown,
        bank0::{Gpio0, Gpio1, Gpio4, Gpio5},
    },
    pac::{self, interrupt},
    uart::{DataBits, Reader, StopBits, UartConfig, UartDevice, UartPeripheral, ValidUartPinout},
};

/// What the boot ROM looks for: a secure program for the Arm cores.
#[unsafe(link_section = ".start_block")]
#[used]
static IMAGE_DEF: ImageDef = ImageDef::secure_exe();

/// Of the board's crystal (Hz).
const CRYSTAL: u32 = 12_000_000;
/// An LD06 sends at 230 400 baud, and nothing speaks against the same for the rest.
const BAUD: u32 = 230_400;

type Uart<P> = Pin<P, FunctionUart, PullDown>;
type LidarUart = Reader<pac::UART1, (Uart<Gpio4>, Uart<Gpio5>)>;
type CommandUart = Reader<pac::UART0, (Uart<Gpio0>, Uart<Gpio1>)>;

static LIDAR_UART: Mutex<RefCell<Option<LidarUart>>> = Mutex::new(RefCell::new(None));
static COMMAND_UART: Mutex<RefCell<Option<CommandUart>>> = Mutex::new(RefCell::new(None));
static LIDAR: Ring<4096> = Ring::new();
static COMMANDS: Ring<1024> = Ring::new();

#[entry]
fn main() -> ! {
    static mut APP: Board = Board::new(CONFIG);

    let mut p = pac::Peripherals::take().expect("the first to take them");
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
    let sio = Sio::new(p.SIO);
    let pins = Pins::new(p.IO_BANK0, p.PADS_BANK0, sio.gpio_bank0, &mut p.RESETS);
    let clock = clocks.peripheral_clock.freq();
    let config = || UartConfig::new(BAUD.Hz(), DataBits::Eight, None, StopBits::One);

    let lidar_pins = (pins.gpio4.into_function(), pins.gpio5.into_function());
    let (mut lidar, _) = UartPeripheral::new(p.UART1, lidar_pins, &mut p.RESETS)
        .enable(config(), clock)
        .expect("a possible baud rate")
        .split();
    let other_pins = (pins.gpio0.into_function(), pins.gpio1.into_function());
    let (mut commands, mut telemetry) = UartPeripheral::new(p.UART0, other_pins, &mut p.RESETS)
        .enable(config(), clock)
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

    let _ = telemetry.write_all(APP.ready());
    defmt::info!("beamfix listens for an LD06 at {} baud", BAUD);
    // Fed by this loop, never by a timer: what hangs is started again. What waits for a lidar is not.
    watchdog.start(1_000_000.micros());
    loop {
        watchdog.feed();
        let frames = if let Some(byte) = COMMANDS.pop() {
            APP.command(byte)
        } else if let Some(byte) = LIDAR.pop() {
            APP.set_bytes_lost(LIDAR.lost());
            APP.lidar(byte)
        } else {
            continue;
        };
        if !frames.is_empty() {
            let _ = telemetry.write_all(frames);
            let pose = APP.pose();
            defmt::info!("x {} m, y {} m, heading {} rad", pose.x, pose.y, pose.theta);
        }
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
            Ok(n) => bytes.iter().take(n).for_each(|&byte| ring.push(byte)),
            // The byte with the error is gone, those before it are good.
            Err(nb::Error::Other(error)) => {
                error.discarded.iter().for_each(|&byte| ring.push(byte));
                ring.lose(1);
            }
            Err(nb::Error::WouldBlock) => return,
        }
    }
}
