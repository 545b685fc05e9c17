//! QEMU's virt with a 32-bit core: its UART and its clock, without a HAL.
#![no_std]

pub mod clock;
pub mod uart;
