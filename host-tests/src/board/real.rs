//! The real boards: what their firmware takes of the chip.
//!
//! Flash and statics are the firmware's own. Nobody has one of these boards here: stack and instructions are those of
//! the emulated board with the same instruction set, and cycles are a model.

use anyhow::Result;

use super::{
    card::{Card, sizes},
    firmware::Firmware,
    real_card::{RealCard, Verdict},
};

/// A board that people have.
#[derive(Debug)]
pub struct Real {
    /// What it is called.
    pub name: &'static str,
    /// Its firmware.
    pub firmware: Firmware,
    /// The emulated board that executes the same instructions.
    pub emulated: &'static str,
    /// As the firmware sets it.
    clock_mhz: u32,
    /// Cycles an instruction: zero wait states, Arm's published tables; RISC-V as the M4.
    cycles: f64,
    /// Instructions that a byte of the lidar takes.
    byte: f64,
    flash_bytes: u64,
    /// All the RAM there is.
    ram_bytes: u64,
    /// Where the chip shows it: begin and end.
    ram: &'static [(u64, u64)],
    /// How long its ring holds what an LD06 sends (ms).
    ring_ms: f64,
}

const CORTEX_M0: f64 = 1.5;
const CORTEX_M4: f64 = 1.25;
/// Few instructions of a Cortex-M3 take longer than those of a Cortex-M4; it needs fewer than the Cortex-M0 that is emulated.
const CORTEX_M3: f64 = 1.25;
const RAM_2000: &[(u64, u64)] = &[(0x2000_0000, 0x2010_0000)];

/// All there are.
pub const REAL: &[Real] = &[
    Real {
        name: "nucleo-f446",
        firmware: Firmware::new("nucleo-f446", "thumbv7em-none-eabihf"),
        emulated: "m4f",
        clock_mhz: 168,
        cycles: CORTEX_M4,
        byte: BYTE,
        flash_bytes: 512 << 10,
        ram_bytes: 128 << 10,
        ram: RAM_2000,
        ring_ms: 178.0,
    },
    Real {
        name: "pico",
        firmware: Firmware::new("pico", "thumbv6m-none-eabi"),
        emulated: "m0",
        clock_mhz: 125,
        cycles: CORTEX_M0,
        byte: BYTE,
        flash_bytes: 2 << 20,
        ram_bytes: 264 << 10,
        ram: RAM_2000,
        ring_ms: 178.0,
    },
    Real {
        name: "pico-embassy",
        firmware: Firmware::new("pico-embassy", "thumbv6m-none-eabi"),
        emulated: "m0",
        clock_mhz: 125,
        cycles: CORTEX_M0,
        byte: BYTE_BY_AWAIT,
        flash_bytes: 2 << 20,
        ram_bytes: 264 << 10,
        ram: RAM_2000,
        ring_ms: 178.0,
    },
    Real {
        name: "pico2",
        firmware: Firmware::new("pico2", "thumbv8m.main-none-eabihf"),
        emulated: "m4f",
        clock_mhz: 150,
        cycles: CORTEX_M4,
        byte: BYTE,
        flash_bytes: 4 << 20,
        ram_bytes: 520 << 10,
        ram: RAM_2000,
        ring_ms: 178.0,
    },
    Real {
        name: "nrf52840-dk",
        firmware: Firmware::new("nrf52840-dk", "thumbv7em-none-eabihf"),
        emulated: "m4f",
        clock_mhz: 64,
        cycles: CORTEX_M4,
        // By await too, but a match takes a Cortex-M4F less than half of what it takes a Cortex-M0, and so may a byte.
        byte: BYTE,
        flash_bytes: 1 << 20,
        ram_bytes: 256 << 10,
        ram: RAM_2000,
        ring_ms: 178.0,
    },
    Real {
        name: "esp32-c3",
        firmware: Firmware::new("esp32-c3", "riscv32imc-unknown-none-elf"),
        emulated: "rv32",
        clock_mhz: 160,
        cycles: CORTEX_M4,
        byte: BYTE,
        flash_bytes: 4 << 20,
        ram_bytes: 400 << 10,
        ram: &[(0x3fc8_0000, 0x3fd0_0000), (0x4037_0000, 0x4040_0000)],
        ring_ms: 178.0,
    },
    Real {
        name: "esp32-c6",
        firmware: Firmware::new("esp32-c6", "riscv32imac-unknown-none-elf"),
        emulated: "rv32",
        clock_mhz: 160,
        cycles: CORTEX_M4,
        byte: BYTE,
        flash_bytes: 4 << 20,
        ram_bytes: 512 << 10,
        ram: &[(0x4080_0000, 0x4088_0000)],
        ring_ms: 178.0,
    },
    Real {
        name: "bluepill",
        firmware: Firmware::new("bluepill", "thumbv7m-none-eabi"),
        emulated: "m0z",
        clock_mhz: 72,
        cycles: CORTEX_M3,
        byte: BYTE,
        flash_bytes: 64 << 10,
        ram_bytes: 20 << 10,
        ram: RAM_2000,
        ring_ms: 89.0,
    },
];

/// Revolutions a second of an LD06.
const RATE: f64 = 10.0;
/// Bytes a second that it sends.
const BYTES: f64 = 17_625.0;
/// Instructions that a byte takes besides the median match: interrupt, ring, parser, telemetry, and its share of the longer
/// matches. So many are left of the cycles that the Pico is awake in rp2040js (25 % in `host-tests/tests/boards/uart.rs`).
const BYTE: f64 = 600.0;
/// The same with embassy, whose task is woken for each byte or two (38 % there).
const BYTE_BY_AWAIT: f64 = 1250.0;

impl Real {
    /// The board of this name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        REAL.iter().find(|board| board.name == name)
    }

    /// Builds the firmware and measures it, with what its core costs as emulated.
    pub fn measure(&self, core: &Card) -> Result<RealCard> {
        let (flash_bytes, ram_bytes) = sizes(&self.firmware.build("")?, self.ram)?;
        let ms = |instructions: f64| instructions * self.cycles / f64::from(1000 * self.clock_mhz);
        let busy_ms = RATE * ms(core.instructions as f64) + ms(BYTES * self.byte);
        let share_percent = busy_ms / 10.0;
        let longest_ms = ms(core.instructions_max as f64);
        let fits = ram_bytes + core.stack_bytes < self.ram_bytes && flash_bytes < self.flash_bytes;
        let verdict = if !fits || share_percent > 90.0 || longest_ms > self.ring_ms {
            Verdict::No
        } else if share_percent > 50.0 || longest_ms > 1000.0 / RATE {
            Verdict::Marginal
        } else {
            Verdict::Yes
        };
        Ok(RealCard {
            board: self.name.into(),
            configuration: core.configuration.clone(),
            flash_bytes,
            flash_of: self.flash_bytes,
            ram_bytes,
            ram_of: self.ram_bytes,
            stack_bytes: core.stack_bytes,
            instructions: core.instructions,
            instructions_max: core.instructions_max,
            emulated: self.emulated.into(),
            clock_mhz: self.clock_mhz,
            share_percent: (10.0 * share_percent).round() / 10.0,
            longest_ms: (10.0 * longest_ms).round() / 10.0,
            verdict,
        })
    }
}
