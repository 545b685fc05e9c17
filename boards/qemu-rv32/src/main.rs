//! Lidar bytes in at the UART, frames out at the same UART.
#![no_std]
#![no_main]

use beamfix_app::{Board, CONFIG, Place, telemetry::Reset};
use qemu_rv32::uart;

#[riscv_rt::entry]
fn main() -> ! {
    static mut APP: Place<Board> = Place::EMPTY;
    let app = &raw mut APP;
    // SAFETY: only the start-up code calls `main`, once.
    let app = unsafe { &mut *app }.app(&CONFIG);

    uart::enable();
    uart::send(app.ready(Reset::Other));
    loop {
        if let Some(byte) = uart::received() {
            uart::send(app.lidar(&[byte]).1);
        }
    }
}
