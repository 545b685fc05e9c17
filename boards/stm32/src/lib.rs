//! What the boards with an STM32 share: their UARTs, by interrupt into rings.
#![no_std]

use core::cell::RefCell;

use beamfix_app::ring::Ring;
use critical_section::Mutex;
use embedded_hal_nb::{
    nb,
    serial::{Read, Write},
};

/// Place of a UART's receiving half, for its interrupt.
pub struct Line<U>(Mutex<RefCell<Option<U>>>);

impl<U: Read<u8>> Line<U> {
    /// Without a UART: its interrupt does nothing.
    #[allow(clippy::new_without_default, reason = "for statics")]
    pub const fn new() -> Self {
        Self(Mutex::new(RefCell::new(None)))
    }

    /// Gives the interrupt its UART, which listens already.
    pub fn set(&self, uart: U) {
        critical_section::with(|cs| self.0.borrow_ref_mut(cs).replace(uart));
    }

    /// Moves what the UART holds to the ring: what its interrupt does.
    pub fn drain<const B: usize>(&self, ring: &Ring<B>) {
        critical_section::with(|cs| {
            let mut uart = self.0.borrow_ref_mut(cs);
            let Some(uart) = uart.as_mut() else { return };
            loop {
                match uart.read() {
                    Ok(byte) => ring.push(byte),
                    Err(nb::Error::Other(_)) => ring.lose(1),
                    Err(nb::Error::WouldBlock) => return,
                }
            }
        });
    }
}

/// Sends bytes, waiting as long as it takes.
pub fn send(uart: &mut impl Write<u8>, bytes: &[u8]) {
    for &byte in bytes {
        let _ = nb::block!(uart.write(byte));
    }
}

/// The same, until the last one has left.
pub fn send_all_out(uart: &mut impl Write<u8>, bytes: &[u8]) {
    send(uart, bytes);
    let _ = nb::block!(uart.flush());
}

/// What a UART with a clock of so many Hz writes into its register `BRR` for so many bits a second, as the HALs reckon it where the
/// clock is at least 16 times as fast.
#[must_use]
pub const fn divisor(clock: u32, baud: u32) -> u16 {
    ((clock + baud / 2) / baud) as u16
}
