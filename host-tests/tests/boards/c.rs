//! The static library for C: its header, its errors, its poses on the host and on the emulated boards.

mod cross;
mod header;
mod host;
mod localize;
mod map;
mod packages;
mod tools;
