//! What a panic would do, if one could be reached: call a function that there is none of. `build` looks that no archive asks for it,
//! so a C program needs no handler, and none is in it.

#[cfg(not(fuzzing))]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    unsafe extern "C" {
        fn beamfix_a_panic_can_be_reached() -> !;
    }
    // SAFETY: never linked.
    unsafe { beamfix_a_panic_can_be_reached() }
}
