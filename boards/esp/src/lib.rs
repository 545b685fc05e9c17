//! What the ESP32-C3 and the ESP32-C6 share: the lidar's bytes in and requests to it out at UART 1, frames out and commands in at UART 0
//! (the board's USB bridge), the motor's PWM; poses on the probe's log too. The pins are in [`start`], and in each board's README.
#![no_std]

use core::{cell::RefCell, marker::PhantomData};

use beamfix::geometry::Pose;
use beamfix_app::{
    AppConfig, Firmware, Lidar, TELEMETRY_BAUD,
    ring::Ring,
    run::{Hardware, TICK_US, run},
    task::Task,
    telemetry::Reset,
};
use critical_section::Mutex;
use embedded_io::Write as _;
use esp_hal::{
    Blocking,
    gpio::DriveMode,
    handler,
    ledc::{
        LSGlobalClkSource, Ledc, LowSpeed,
        channel::{self, ChannelIFace as _},
        timer::{self, TimerIFace as _},
    },
    peripherals::{TIMG0, UART0},
    rtc_cntl::{SocResetReason, reset_reason},
    system::Cpu,
    time::{Duration, Instant, Rate},
    timer::{
        PeriodicTimer,
        systimer::SystemTimer,
        timg::{MwdtStage, TimerGroup, Wdt},
    },
    uart::{Config, RxConfig, Uart, UartInterrupt, UartRx, UartTx},
};

/// Nothing goes on for so long: reset.
const PATIENCE: Duration = Duration::from_secs(1);
/// An interrupt for so many bytes of the 128 that the UART holds: 88 remain for what delays it, 3.8 ms of an LD06.
const BYTES: u16 = 40;

static LIDAR_UART: Mutex<RefCell<Option<Uart<'static, Blocking>>>> = Mutex::new(RefCell::new(None));
static COMMAND_UART: Mutex<RefCell<Option<UartRx<'static, Blocking>>>> =
    Mutex::new(RefCell::new(None));
static TICK: Mutex<RefCell<Option<PeriodicTimer<'static, Blocking>>>> =
    Mutex::new(RefCell::new(None));
/// What arrives while a match is computed: 178 ms of an LD06.
static LIDAR: Ring<4096> = Ring::new();
static COMMANDS: Ring<1024> = Ring::new();

struct Board<L> {
    lidar: PhantomData<L>,
    telemetry: UartTx<'static, Blocking>,
    watchdog: Wdt<TIMG0<'static>>,
}

impl<L: Lidar> Hardware for Board<L> {
    const ASKS: bool = L::ASKS;

    fn reset(&mut self) -> Reset {
        match reset_reason(Cpu::ProCpu) {
            Some(SocResetReason::ChipPowerOn | SocResetReason::SysBrownOut) => Reset::Power,
            Some(SocResetReason::CoreMwdt0 | SocResetReason::Cpu0Mwdt0) => Reset::Watchdog,
            _ => Reset::Other,
        }
    }

    fn now_us(&mut self) -> u32 {
        Instant::now().duration_since_epoch().as_micros() as u32
    }

    fn send(&mut self, bytes: &[u8]) {
        let _ = self.telemetry.write_all(bytes);
    }

    fn send_to_lidar(&mut self, bytes: &[u8]) {
        // One at a time: interrupts wait for no more than that.
        for &byte in bytes {
            with_lidar(|uart| {
                let _ = uart.write_all(&[byte]);
                let _ = uart.flush();
            });
        }
    }

    fn set_lidar_baud(&mut self, baud: u32) {
        with_lidar(|uart| uart.apply_config(&uart_at(baud)));
    }

    fn feed_watchdog(&mut self) {
        self.watchdog.feed();
    }

    fn wait(&mut self) {
        // SAFETY: an instruction that waits; a pending interrupt ends it though all are masked.
        unsafe { core::arch::asm!("wfi") };
    }

    fn log(&mut self, pose: Pose) {
        defmt::info!("x {} m, y {} m, heading {} rad", pose.x, pose.y, pose.theta);
    }
}

/// Sets the board up and runs the application with the lidar L, which is the settings' one.
pub fn start<L: Lidar, E: Task<N>, const N: usize>(
    app: &mut Firmware<L::Parser, E, N>,
    config: &AppConfig,
) -> ! {
    let clocks = esp_hal::Config::default().with_cpu_clock(esp_hal::clock::CpuClock::max());
    let p = esp_hal::init(clocks);
    // The C6 has atomic instructions.
    #[cfg(not(target_feature = "a"))]
    let (from_lidar, to_lidar, from_host, to_host, pwm) =
        (p.GPIO4, p.GPIO5, p.GPIO20, p.GPIO21, p.GPIO6);
    #[cfg(target_feature = "a")]
    let (from_lidar, to_lidar, from_host, to_host, pwm) =
        (p.GPIO10, p.GPIO11, p.GPIO17, p.GPIO16, p.GPIO18);
    let mut lidar = Uart::new(p.UART1, uart_at(config.lidar.baud))
        .expect("a possible baud rate")
        .with_rx(from_lidar)
        .with_tx(to_lidar);
    let mut other = Uart::new(p.UART0, uart_at(TELEMETRY_BAUD))
        .expect("a possible baud rate")
        .with_rx(from_host)
        .with_tx(to_host);
    let events = UartInterrupt::RxFifoFull | UartInterrupt::RxTimeout;
    lidar.set_interrupt_handler(lidar_bytes);
    other.set_interrupt_handler(command_bytes);
    let mut tick = PeriodicTimer::new(SystemTimer::new(p.SYSTIMER).alarm0);
    tick.set_interrupt_handler(wake);
    lidar.listen(events);
    other.listen(events);
    let (commands, telemetry) = other.split();
    tick.listen();
    tick.start(Duration::from_micros(TICK_US.into()))
        .expect("a period that the timer has");
    critical_section::with(|cs| {
        LIDAR_UART.borrow_ref_mut(cs).replace(lidar);
        COMMAND_UART.borrow_ref_mut(cs).replace(commands);
        TICK.borrow_ref_mut(cs).replace(tick);
    });

    let mut ledc = Ledc::new(p.LEDC);
    ledc.set_global_slow_clock(LSGlobalClkSource::APBClk);
    let mut clock = ledc.timer::<LowSpeed>(timer::Number::Timer0);
    // An LD06 takes 20 to 50 kHz.
    clock
        .configure(timer::config::Config {
            duty: timer::config::Duty::Duty10Bit,
            clock_source: timer::LSClockSource::APBClk,
            frequency: Rate::from_khz(30),
        })
        .expect("a frequency that the timer has");
    let mut motor = ledc.channel(channel::Number::Channel0, pwm);
    motor
        .configure(channel::config::Config {
            timer: &clock,
            duty_pct: 0,
            drive_mode: DriveMode::PushPull,
        })
        .expect("a duty that the channel has");

    let (name, baud) = (config.lidar.name, config.lidar.baud);
    defmt::info!("beamfix listens for {} at {} baud", name, baud);
    let mut watchdog = TimerGroup::new(p.TIMG0).wdt;
    watchdog.set_timeout(MwdtStage::Stage0, PATIENCE);
    watchdog.enable();
    let board = Board {
        lidar: PhantomData::<L>,
        telemetry,
        watchdog,
    };
    #[cfg(feature = "demo")]
    let board = beamfix_selftest::simulated::Simulated::new(board);
    run(app, config, (&LIDAR, &COMMANDS), board, motor)
}

fn uart_at(baud: u32) -> Config {
    let rx = RxConfig::default().with_fifo_full_threshold(BYTES);
    Config::default().with_baudrate(baud).with_rx(rx)
}

/// Does something with the lidar's UART, once there is one.
fn with_lidar<R>(f: impl FnOnce(&mut Uart<'static, Blocking>) -> R) -> Option<R> {
    critical_section::with(|cs| LIDAR_UART.borrow_ref_mut(cs).as_mut().map(f))
}

/// Wakes the loop up: nothing else to do.
#[handler]
fn wake() {
    critical_section::with(|cs| {
        if let Some(tick) = TICK.borrow_ref_mut(cs).as_mut() {
            tick.clear_interrupt();
        }
    });
}

#[handler]
fn lidar_bytes() {
    with_lidar(|uart| {
        drain(|bytes| uart.read_buffered(bytes), &LIDAR);
        uart.clear_interrupts(UartInterrupt::RxFifoFull | UartInterrupt::RxTimeout);
    });
}

#[handler]
fn command_bytes() {
    critical_section::with(|cs| {
        if let Some(uart) = COMMAND_UART.borrow_ref_mut(cs).as_mut() {
            drain(|bytes| uart.read_buffered(bytes), &COMMANDS);
            // This half of a UART has no function for it.
            UART0::regs().int_clr().write(|w| {
                w.rxfifo_full().clear_bit_by_one();
                w.rxfifo_tout().clear_bit_by_one()
            });
        }
    });
}

/// Moves what the UART holds to the ring.
fn drain<E, const B: usize>(mut read: impl FnMut(&mut [u8]) -> Result<usize, E>, ring: &Ring<B>) {
    let mut bytes = [0; 32];
    loop {
        match read(&mut bytes) {
            Ok(0) => return,
            Ok(n) => ring.extend(bytes.get(..n).unwrap_or_default()),
            // The driver then empties the UART: how many bytes that was, nobody knows.
            Err(_) => ring.lose(1),
        }
    }
}
