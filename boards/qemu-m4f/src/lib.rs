//! QEMU's mps2-an386: its UARTs and its clock, without a HAL.
#![no_std]

pub mod clock;
pub mod motor;
pub mod uart;
