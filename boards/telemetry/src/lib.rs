//! The wire between a board and whoever listens to it or steers it, apart from the firmware.
//!
//! ```text
//! telemetry   what a board sends        command   what it understands
//!        └──────────── link ────────────┘         postcard, CRC-16, COBS, a zero byte
//! ```
//!
//! `docs/telemetry.md` has the format byte by byte and what is promised of it; `beamfix_link.py` beside this crate reads and writes the
//! same in Python.
#![no_std]

pub mod command;
pub mod link;
pub mod telemetry;

/// Version of [`telemetry`] and [`command`]: changes whenever one of their messages does.
pub const VERSION: u8 = 8;
