//! Arm's CMSDK UART: a receive and a transmit register, one byte each.

/// One of the board's five.
pub struct Uart {
    base: *mut u32,
    /// Number of its receive interrupt; the transmit interrupt is the next.
    interrupt: i16,
}

const STATE: usize = 1;
const CTRL: usize = 2;
const INT_CLEAR: usize = 3;
const BAUD_DIV: usize = 4;

const STATE_TX_FULL: u32 = 1;
const STATE_RX_FULL: u32 = 2;
const CTRL_TX: u32 = 1;
const CTRL_RX: u32 = 2;
const CTRL_RX_INTERRUPT: u32 = 8;

impl Uart {
    /// Where the lidar sends.
    pub const LIDAR: Self = Self::at(0x4000_4000, 0);
    /// Where the frames leave.
    pub const TELEMETRY: Self = Self::at(0x4000_5000, 2);
    /// Where the commands come in.
    pub const COMMANDS: Self = Self::at(0x4000_6000, 4);
    /// Where the motor's duty is told.
    pub const MOTOR: Self = Self::at(0x4000_7000, 6);

    const fn at(base: usize, interrupt: i16) -> Self {
        Self {
            base: core::ptr::without_provenance_mut(base),
            interrupt,
        }
    }

    /// Transmits and receives, with an interrupt for each byte that arrives.
    pub fn enable(&self) {
        // 25 MHz / 108 = 230 400 baud within 0.5 %.
        self.write(BAUD_DIV, 108);
        self.write(CTRL, CTRL_TX | CTRL_RX | CTRL_RX_INTERRUPT);
        self.listen();
    }

    /// Lets its interrupt through.
    pub fn listen(&self) {
        const ENABLE_INTERRUPTS: *mut u32 = core::ptr::without_provenance_mut(0xe000_e100);
        // SAFETY: the NVIC's register; 0 bits leave the others as they are. Nobody masks by priority.
        unsafe { ENABLE_INTERRUPTS.write_volatile(1 << self.interrupt) };
    }

    /// Keeps its interrupt waiting, and with it the bytes: until [`Uart::listen`].
    pub fn pause(&self) {
        const DISABLE_INTERRUPTS: *mut u32 = core::ptr::without_provenance_mut(0xe000_e180);
        // SAFETY: as in `listen`.
        unsafe { DISABLE_INTERRUPTS.write_volatile(1 << self.interrupt) };
    }

    /// The byte received, if `interrupt` is this UART's.
    pub fn received(&self, interrupt: i16) -> Option<u8> {
        if interrupt != self.interrupt {
            return None;
        }
        self.write(INT_CLEAR, 2);
        (self.read(STATE) & STATE_RX_FULL != 0).then(|| self.read(0) as u8)
    }

    /// Sends a byte where the last one has left; `false` where it has not.
    pub fn try_send(&self, byte: u8) -> bool {
        let is_free = self.read(STATE) & STATE_TX_FULL == 0;
        if is_free {
            self.write(0, u32::from(byte));
        }
        is_free
    }

    /// Sends bytes, waiting for each.
    pub fn send(&self, bytes: &[u8]) {
        for &byte in bytes {
            while !self.try_send(byte) {}
        }
    }

    fn read(&self, register: usize) -> u32 {
        // SAFETY: one of the five registers of a UART that this machine has.
        unsafe { self.base.wrapping_add(register).read_volatile() }
    }

    fn write(&self, register: usize, value: u32) {
        // SAFETY: as in `read`.
        unsafe { self.base.wrapping_add(register).write_volatile(value) };
    }
}
