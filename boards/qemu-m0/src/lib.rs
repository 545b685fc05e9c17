//! QEMU's microbit: its UART and its clock, without a HAL.
#![no_std]

pub mod clock;
pub mod uart;
