//! The NS16550 UART, polled: QEMU holds a byte back until the last one was read, so none is lost.

const BASE: *mut u8 = core::ptr::without_provenance_mut(0x1000_0000);

const DATA: usize = 0;
const FIFO_CONTROL: usize = 2;
const LINE_CONTROL: usize = 3;
const LINE_STATUS: usize = 5;

/// Transmits and receives.
pub fn enable() {
    // 8 bits, no parity; FIFOs on and empty.
    write(LINE_CONTROL, 3);
    write(FIFO_CONTROL, 7);
}

/// The byte received, if there is one.
pub fn received() -> Option<u8> {
    (read(LINE_STATUS) & 1 != 0).then(|| read(DATA))
}

/// Sends bytes, waiting for each.
pub fn send(bytes: &[u8]) {
    for &byte in bytes {
        while read(LINE_STATUS) & 0x20 == 0 {}
        write(DATA, byte);
    }
}

fn read(register: usize) -> u8 {
    // SAFETY: one of the UART's registers above.
    unsafe { BASE.wrapping_add(register).read_volatile() }
}

fn write(register: usize, value: u8) {
    // SAFETY: as in `read`.
    unsafe { BASE.wrapping_add(register).write_volatile(value) };
}
