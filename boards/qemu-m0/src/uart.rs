//! The nRF51's UART, polled: QEMU holds a byte back until the last one was read, so none is lost.

const BASE: *mut u32 = core::ptr::without_provenance_mut(0x4000_2000);

const START_RX: usize = 0x000;
const START_TX: usize = 0x008;
const RX_READY: usize = 0x108;
const TX_READY: usize = 0x11c;
const ENABLE: usize = 0x500;
const RXD: usize = 0x518;
const TXD: usize = 0x51c;

/// Transmits and receives.
pub fn enable() {
    write(ENABLE, 4);
    write(START_RX, 1);
    write(START_TX, 1);
}

/// The byte received, if there is one.
pub fn received() -> Option<u8> {
    if read(RX_READY) == 0 {
        return None;
    }
    write(RX_READY, 0);
    Some(read(RXD) as u8)
}

/// Sends bytes, waiting for each.
pub fn send(bytes: &[u8]) {
    for &byte in bytes {
        write(TX_READY, 0);
        write(TXD, u32::from(byte));
        while read(TX_READY) == 0 {}
    }
}

fn read(offset: usize) -> u32 {
    // SAFETY: one of the UART's registers above.
    unsafe { BASE.byte_add(offset).read_volatile() }
}

fn write(offset: usize, value: u32) {
    // SAFETY: as in `read`.
    unsafe { BASE.byte_add(offset).write_volatile(value) };
}
