//! What a panic does: says so and ends the emulator. With `prove-no-panic`, one that can be reached fails to link.

#[panic_handler]
fn panic(info: &core::panic::PanicInfo) -> ! {
    #[cfg(feature = "prove-no-panic")]
    {
        let _ = info;
        unsafe extern "C" {
            fn a_panic_can_be_reached() -> !;
        }
        // SAFETY: never linked.
        unsafe { a_panic_can_be_reached() }
    }
    #[cfg(not(feature = "prove-no-panic"))]
    {
        semihosting::eprintln!("{info}");
        semihosting::process::exit(101)
    }
}
