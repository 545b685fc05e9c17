//! Every lidar's driver on one board, chosen by the first byte. Linked with `prove-no-panic`, it is the proof that no
//! byte on the line can make any of them panic; run, it tells each beam's range.
#![no_std]
#![no_main]

use beamfix::lidar::{
    Model, Packet as _, Protocol,
    choice::{WithParser, with_parser},
    identify::identify,
    startup::{Action, StartConfig, Startup},
};
use qemu_m0::uart;

/// The next byte of the line.
fn received() -> u8 {
    loop {
        if let Some(byte) = uart::received() {
            return byte;
        }
    }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    uart::enable();
    loop {
        let model = match Model::ALL.get(usize::from(received())) {
            Some(model) => model,
            None => listened(),
        };
        start(model);
        with_parser(model, Stream);
    }
}

/// Which model it is, by its bytes.
#[inline(never)]
fn listened() -> &'static Model {
    let mut heard = [0; 256];
    loop {
        heard.fill_with(received);
        if let Some(found) = identify(&heard) {
            return found.model;
        }
    }
}

/// Time passes by the bytes that come.
#[inline(never)]
fn start(model: &Model) {
    let mut startup = Startup::new(model, StartConfig::DEFAULT);
    let mut now_us = 0u32;
    loop {
        match startup.poll(now_us) {
            Action::Send(bytes) => uart::send(&bytes),
            Action::Ready(_) | Action::Failed(_) => return,
            _ => {}
        }
        startup.push(received());
        now_us = now_us.wrapping_add(10_000);
    }
}

/// Beams until the line is silent for good, which it never is.
struct Stream;

impl WithParser for Stream {
    type Output = ();

    #[inline(never)]
    fn run<P: Protocol>(self, mut parser: P) {
        let mut now_us = 0u32;
        while parser.counters().revolutions != u32::MAX {
            parser.arrived(now_us);
            now_us = now_us.wrapping_add(87);
            let packet = parser.push(received()).or_else(|| parser.pull());
            let Some(packet) = packet else { continue };
            let start = packet.revolution_start();
            for (k, beam) in packet.beams().enumerate() {
                let [low, high] = beam.range.mm().unwrap_or(0).to_le_bytes();
                uart::send(&[low, high, u8::from(start == Some(k)), beam.quality]);
                uart::send(&beam.time_us.to_le_bytes());
            }
            let rpm = packet.speed_rpm().unwrap_or(0.0);
            uart::send(&rpm.to_le_bytes());
        }
    }
}
