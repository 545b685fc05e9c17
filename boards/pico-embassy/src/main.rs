//! LD06 bytes in at GP5, commands at GP1, frames out at GP0, all by await; poses on the probe's log too.
#![no_std]
#![no_main]

use beamfix_app::{Board, CONFIG};
use defmt_rtt as _;
use embassy_executor::Spawner;
use embassy_futures::select::{Either, select};
use embassy_rp::{
    bind_interrupts,
    peripherals::{UART0, UART1},
    uart::{BufferedInterruptHandler, BufferedUart, BufferedUartRx, Config},
    watchdog::Watchdog,
};
use embassy_time::{Duration, with_timeout};
use embedded_io_async::{Read as _, Write as _};
use panic_probe as _;
use static_cell::ConstStaticCell;

/// An LD06 sends at 230 400 baud, and nothing speaks against the same for the rest.
const BAUD: u32 = 230_400;
/// Longest sleep without looking after the watchdog.
const LOOK: Duration = Duration::from_millis(300);

bind_interrupts!(struct Interrupts {
    UART0_IRQ => BufferedInterruptHandler<UART0>;
    UART1_IRQ => BufferedInterruptHandler<UART1>;
});

static APP: ConstStaticCell<Board> = ConstStaticCell::new(Board::new(CONFIG));
/// What arrives while a match is computed: 178 ms of an LD06.
static LIDAR: ConstStaticCell<[u8; 4096]> = ConstStaticCell::new([0; 4096]);
static COMMANDS: ConstStaticCell<[u8; 1024]> = ConstStaticCell::new([0; 1024]);
static TELEMETRY: ConstStaticCell<[u8; 256]> = ConstStaticCell::new([0; 256]);

#[embassy_executor::main]
async fn main(_spawner: Spawner) {
    let p = embassy_rp::init(Default::default());
    let app = APP.take();
    let mut config = Config::default();
    config.baudrate = BAUD;
    let mut lidar = BufferedUartRx::new(p.UART1, Interrupts, p.PIN_5, LIDAR.take(), config);
    let (pins, buffers) = ((p.PIN_0, p.PIN_1), (TELEMETRY.take(), COMMANDS.take()));
    let (mut telemetry, mut commands) = BufferedUart::new(
        p.UART0, pins.0, pins.1, Interrupts, buffers.0, buffers.1, config,
    )
    .split();

    let _ = telemetry.write_all(app.ready()).await;
    defmt::info!("beamfix listens for an LD06 at {} baud", BAUD);
    // Fed by this loop, never by a timer: what hangs is started again. What waits for a lidar is not.
    let mut watchdog = Watchdog::new(p.WATCHDOG);
    watchdog.start(Duration::from_secs(1));
    let mut overruns = 0u32;
    loop {
        watchdog.feed(Duration::from_secs(1));
        let (mut lidar_bytes, mut command_bytes) = ([0; 64], [0; 64]);
        let read = select(
            lidar.read(&mut lidar_bytes),
            commands.read(&mut command_bytes),
        );
        let (bytes, is_lidar) = match with_timeout(LOOK, read).await {
            Ok(Either::First(Ok(n))) => (lidar_bytes.get(..n), true),
            Ok(Either::Second(Ok(n))) => (command_bytes.get(..n), false),
            Ok(Either::First(Err(_)) | Either::Second(Err(_))) => {
                overruns = overruns.wrapping_add(1);
                app.set_bytes_lost(overruns);
                continue;
            }
            Err(_) => continue,
        };
        for &byte in bytes.unwrap_or_default() {
            let frames = if is_lidar {
                app.lidar(byte)
            } else {
                app.command(byte)
            };
            if !frames.is_empty() {
                let _ = telemetry.write_all(frames).await;
                let pose = app.pose();
                defmt::info!("x {} m, y {} m, heading {} rad", pose.x, pose.y, pose.theta);
            }
        }
    }
}
