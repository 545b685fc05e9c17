//! Lidar bytes in at the UART, frames out at the same UART.
#![no_std]
#![no_main]

use beamfix_app::{CONFIG, SmallBoard, telemetry::Reset};
use qemu_m0::uart;

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut APP: SmallBoard = SmallBoard::new(CONFIG);

    uart::enable();
    uart::send(APP.ready(Reset::Other));
    loop {
        if let Some(byte) = uart::received() {
            uart::send(APP.lidar(&[byte]).1);
        }
    }
}
