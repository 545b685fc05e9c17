//! Every choice of every stage, for `prove-no-panic`; see `beamfix_emulated::stages`.
#![no_std]
#![no_main]

use beamfix_emulated::stages::Choices;
use qemu_m4f as _;

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut CHOICES: Choices = Choices::new();
    CHOICES.forever()
}
