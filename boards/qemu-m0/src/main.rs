//! Lidar bytes in at the UART, frames out at the same UART.
#![no_std]
#![no_main]

use beamfix_app::{CONFIG, Place, SmallBoard, telemetry::Reset};
use qemu_m0::uart;

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut APP: Place<SmallBoard> = Place::EMPTY;
    let app = APP.app(&CONFIG);

    uart::enable();
    uart::send(app.ready(Reset::Other));
    loop {
        if let Some(byte) = uart::received() {
            uart::send(app.lidar(&[byte]).1);
        }
    }
}
