//! Lidar bytes in at the UART, frames out at the same UART.
#![no_std]
#![no_main]

use beamfix::odometry::OdometryConfig;
use beamfix_app::App;
use qemu_m0::uart;

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut APP: App<480> = App::new(OdometryConfig::DEFAULT);

    uart::enable();
    uart::send(APP.ready());
    loop {
        if let Some(byte) = uart::received() {
            uart::send(APP.lidar(byte));
        }
    }
}
