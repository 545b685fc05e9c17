//! Lidar bytes in at the UART, frames out at the same UART.
#![no_std]
#![no_main]

use beamfix::odometry::OdometryConfig;
use beamfix_app::App;
use qemu_rv32::uart;

#[riscv_rt::entry]
fn main() -> ! {
    static mut APP: App<480> = App::new(OdometryConfig::DEFAULT);
    // SAFETY: only the start-up code calls `main`, once.
    let app = unsafe { &mut *(&raw mut APP) };

    uart::enable();
    uart::send(app.ready());
    loop {
        if let Some(byte) = uart::received() {
            uart::send(app.lidar(byte));
        }
    }
}
