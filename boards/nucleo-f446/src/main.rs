//! LD06 bytes in at PA10, frames out and commands in over the ST-Link's USB; poses on the probe's log too.
#![no_std]
#![no_main]

use core::cell::RefCell;

use beamfix_app::{Board, CONFIG, ring::Ring};
use cortex_m_rt::entry;
use critical_section::Mutex;
use defmt_rtt as _;
use embedded_hal_nb::{nb, serial::Read};
use embedded_io::Write as _;
use panic_probe as _;
use stm32f4xx_hal::{
    pac::{self, interrupt},
    prelude::*,
    rcc::Config,
    serial::{self, Rx},
    watchdog::IndependentWatchdog,
};

/// An LD06 sends at 230 400 baud, and nothing speaks against the same for the rest.
const BAUD: u32 = 230_400;

static LIDAR_UART: Mutex<RefCell<Option<Rx<pac::USART1>>>> = Mutex::new(RefCell::new(None));
static COMMAND_UART: Mutex<RefCell<Option<Rx<pac::USART2>>>> = Mutex::new(RefCell::new(None));
static LIDAR: Ring<4096> = Ring::new();
static COMMANDS: Ring<1024> = Ring::new();

#[entry]
fn main() -> ! {
    static mut APP: Board = Board::new(CONFIG);

    let p = pac::Peripherals::take().expect("the first to take them");
    // The fastest that USB's clock allows too.
    let mut rcc = p.RCC.freeze(Config::hsi().sysclk(168.MHz()));
    let gpioa = p.GPIOA.split(&mut rcc);
    let config = || serial::config::Config::default().baudrate(BAUD.bps());

    let mut lidar: Rx<_> = p
        .USART1
        .rx(gpioa.pa10, config(), &mut rcc)
        .expect("a possible baud rate");
    let (mut telemetry, mut commands) = p
        .USART2
        .serial::<u8>((gpioa.pa2, gpioa.pa3), config(), &mut rcc)
        .expect("a possible baud rate")
        .split();
    lidar.listen();
    commands.listen();
    critical_section::with(|cs| {
        LIDAR_UART.borrow(cs).replace(Some(lidar));
        COMMAND_UART.borrow(cs).replace(Some(commands));
    });
    // SAFETY: nothing relies on these being masked.
    unsafe {
        cortex_m::peripheral::NVIC::unmask(pac::Interrupt::USART1);
        cortex_m::peripheral::NVIC::unmask(pac::Interrupt::USART2);
    }

    let _ = telemetry.write_all(APP.ready());
    defmt::info!("beamfix listens for an LD06 at {} baud", BAUD);
    // Fed by this loop, never by a timer: what hangs is started again. What waits for a lidar is not.
    let mut watchdog = IndependentWatchdog::new(p.IWDG);
    watchdog.start(1.secs());
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
fn USART1() {
    critical_section::with(|cs| {
        if let Some(uart) = LIDAR_UART.borrow_ref_mut(cs).as_mut() {
            drain(uart, &LIDAR);
        }
    });
}

#[interrupt]
fn USART2() {
    critical_section::with(|cs| {
        if let Some(uart) = COMMAND_UART.borrow_ref_mut(cs).as_mut() {
            drain(uart, &COMMANDS);
        }
    });
}

/// Moves what the UART holds to the ring.
fn drain<const B: usize>(uart: &mut impl Read<u8>, ring: &Ring<B>) {
    loop {
        match uart.read() {
            Ok(byte) => ring.push(byte),
            Err(nb::Error::Other(_)) => ring.lose(1),
            Err(nb::Error::WouldBlock) => return,
        }
    }
}
