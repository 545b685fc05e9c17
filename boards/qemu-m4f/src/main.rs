//! Lidar bytes in at UART 0, commands at UART 2, frames out at UART 1, the motor's duty at UART 3.
#![no_std]
#![no_main]

use beamfix_app::{
    AppConfig, Board, CONFIG, Place,
    ring::Ring,
    run::{Hardware, TICK_US, run},
};
use beamfix_emulated::Machine as _;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::{entry, exception};
use qemu_m4f::{clock::Timer, motor::Line, uart::Uart};

static LIDAR: Ring<2048> = Ring::new();
static COMMANDS: Ring<2048> = Ring::new();

/// The machine's own time, which has nothing to do with the lidar's.
#[derive(Default)]
struct Mps2 {
    /// Seen so far: 25 a microsecond.
    ticks: u32,
    us: u32,
}

impl Hardware for Mps2 {
    fn now_us(&mut self) -> u32 {
        let us = Timer.ticks().wrapping_sub(self.ticks) / 25;
        self.ticks = self.ticks.wrapping_add(25 * us);
        self.us = self.us.wrapping_add(us);
        self.us
    }

    fn send(&mut self, bytes: &[u8]) {
        Uart::TELEMETRY.send(bytes);
    }

    fn feed_watchdog(&mut self) {}

    fn wait(&mut self) {
        Uart::LIDAR.listen();
        Uart::COMMANDS.listen();
        cortex_m::asm::wfi();
    }
}

/// As this crate's features want it.
const HERE: AppConfig = CONFIG.for_features(cfg!(feature = "demo"), cfg!(feature = "mavlink"));

#[entry]
fn main() -> ! {
    static mut APP: Place<Board> = Place::EMPTY;

    Uart::TELEMETRY.enable();
    Uart::LIDAR.enable();
    Uart::COMMANDS.enable();
    Uart::MOTOR.enable();
    Timer.restart();
    wake_now_and_then();
    let board = Mps2::default();
    #[cfg(feature = "demo")]
    let board = beamfix_selftest::simulated::Simulated::new(board);
    run(APP.app(&HERE), &HERE, (&LIDAR, &COMMANDS), board, Line::LOW)
}

/// For the loop's look; the interrupt itself does nothing.
fn wake_now_and_then() {
    /// The core's clock (Hz).
    const CLOCK: u32 = 25_000_000;
    let Some(mut core) = cortex_m::Peripherals::take() else {
        return;
    };
    core.SYST.set_reload(CLOCK / (1_000_000 / TICK_US) - 1);
    core.SYST.set_clock_source(SystClkSource::Core);
    core.SYST.clear_current();
    core.SYST.enable_interrupt();
    core.SYST.enable_counter();
}

/// Every interrupt; of the machine's, only the UARTs' are enabled.
#[exception]
unsafe fn DefaultHandler(interrupt: i16) {
    for (uart, ring) in [(Uart::LIDAR, &LIDAR), (Uart::COMMANDS, &COMMANDS)] {
        loop {
            // Where the computer is busy the emulator stands now and then, and the lidar's bytes come in a bunch
            // afterwards, as from no lidar. Its UART holds them back: an emulated board loses none.
            if ring.is_full() {
                uart.pause();
                break;
            }
            let Some(byte) = uart.received(interrupt) else {
                break;
            };
            ring.push(byte);
        }
    }
}
