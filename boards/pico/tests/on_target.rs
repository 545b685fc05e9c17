//! Tests for the board itself: `cargo test --release` with a probe attached. CI runs the same file in rp2040js.
#![no_std]
#![no_main]

// The chip's interrupts and critical sections, the start-up code, the log.
use beamfix_rp as _;
use cortex_m_rt as _;
use defmt_rtt as _;

/// The second stage of the boot: makes the flash readable as memory.
#[unsafe(link_section = ".boot2")]
#[used]
static BOOT2: [u8; 256] = rp2040_boot2::BOOT_LOADER_GENERIC_03H;

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
