//! Tests for the board itself: `cargo test --release` with the board's probe attached. CI runs the same file in QEMU.
#![no_std]
#![no_main]

// The start-up code, the chip's interrupts, the log.
use cortex_m_rt as _;
use defmt_rtt as _;
use stm32f4xx_hal as _;

#[embedded_test::tests]
mod tests {
    use beamfix_app::{Board, CONFIG};
    use beamfix_selftest::checks;

    fn app() -> &'static mut Board {
        cortex_m::singleton!(: Board = Board::new(CONFIG)).expect("the first to take it")
    }

    #[test]
    fn poses_have_the_same_bits_as_everywhere() {
        checks::poses_have_the_same_bits_as_everywhere(app());
    }

    #[test]
    fn frames_come_back_and_damage_is_counted() {
        checks::frames_come_back_and_damage_is_counted();
    }

    #[test]
    fn a_ring_counts_what_it_has_no_room_for() {
        checks::a_ring_counts_what_it_has_no_room_for();
    }

    #[test]
    fn health_is_told_when_asked_for() {
        checks::health_is_told_when_asked_for(app());
    }
}
