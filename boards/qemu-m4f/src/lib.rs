//! QEMU's mps2-an386: its UARTs and its clock, without a HAL.
#![no_std]

pub mod clock;
pub mod ring;
pub mod uart;

use beamfix_emulated::stack::Stack;

/// Paints the stack, once at the start.
pub fn stack() -> Stack {
    unsafe extern "C" {
        static mut __sheap: u32;
        static mut _stack_start: u32;
    }
    // SAFETY: cortex-m-rt's symbols: the end of the statics and the start of the stack. There is no heap.
    unsafe { Stack::paint(&raw mut __sheap, &raw mut _stack_start) }
}

/// What a panic does: nothing more. With `prove-no-panic`, one that can be reached fails to link.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    #[cfg(feature = "prove-no-panic")]
    {
        unsafe extern "C" {
            fn a_panic_can_be_reached() -> !;
        }
        // SAFETY: never linked.
        unsafe { a_panic_can_be_reached() }
    }
    #[cfg(not(feature = "prove-no-panic"))]
    loop {
        cortex_m::asm::bkpt();
    }
}
