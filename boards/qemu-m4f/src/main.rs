//! Lidar bytes in at UART 0, commands at UART 2, frames out at UART 1.
#![no_std]
#![no_main]

use beamfix_app::{Board, CONFIG, ring::Ring};
use cortex_m::interrupt;
use cortex_m_rt::{entry, exception};
use qemu_m4f::uart::Uart;

static LIDAR: Ring<2048> = Ring::new();
static COMMANDS: Ring<2048> = Ring::new();

#[entry]
fn main() -> ! {
    static mut APP: Board = Board::new(CONFIG);

    Uart::TELEMETRY.enable();
    Uart::LIDAR.enable();
    Uart::COMMANDS.enable();
    Uart::TELEMETRY.send(APP.ready());
    loop {
        if let Some(byte) = COMMANDS.pop() {
            Uart::TELEMETRY.send(APP.command(byte));
        } else if let Some(byte) = LIDAR.pop() {
            APP.set_bytes_lost(LIDAR.lost());
            Uart::TELEMETRY.send(APP.lidar(byte));
        } else {
            // Looked at once more with interrupts masked: a byte that came just now would not wake the sleeper.
            // A masked interrupt that is pending does.
            interrupt::free(|_| {
                if LIDAR.is_empty() && COMMANDS.is_empty() {
                    cortex_m::asm::wfi();
                }
            });
        }
    }
}

/// Every interrupt; only the UARTs' are enabled.
#[exception]
unsafe fn DefaultHandler(interrupt: i16) {
    for (uart, ring) in [(Uart::LIDAR, &LIDAR), (Uart::COMMANDS, &COMMANDS)] {
        while let Some(byte) = uart.received(interrupt) {
            ring.push(byte);
        }
    }
}
