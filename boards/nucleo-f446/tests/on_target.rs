//! Tests for the board itself: `cargo test --release` with the board's probe attached. CI runs the same file in QEMU.
#![no_std]
#![no_main]

// The start-up code, the chip's interrupts, the log.
use cortex_m_rt as _;
use defmt_rtt as _;
use stm32f4xx_hal as _;

#[embedded_test::tests]
mod tests {
    use beamfix_app::{
        Board, CONFIG, command::Command, demo::Demo, demo::FIRST_POSES, link, ring::Ring,
        telemetry::Telemetry,
    };
    use heapless::Vec;

    /// The simulated lidar's bytes through the whole firmware: the poses have the bits that every machine finds.
    #[test]
    fn poses_have_the_same_bits_as_everywhere() {
        let app = cortex_m::singleton!(: Board = Board::new(CONFIG)).expect("the first to take it");
        let found = FIRST_POSES.find(app, &mut Demo::new());
        assert_eq!(found, FIRST_POSES.hash);
    }

    #[test]
    fn frames_come_back_and_damage_is_counted() {
        let wheels = Command::Wheels {
            x: 1.5,
            y: 0.0,
            theta: -0.25,
        };
        let mut frame = Vec::<u8, { link::FRAME }>::new();
        assert!(link::append(&wheels, &mut frame));
        let mut receiver = link::Receiver::new();
        let mut came = 0;
        for byte in &frame {
            came += u32::from(receiver.push::<Command>(*byte) == Some(wheels));
        }
        frame[3] ^= 4;
        for byte in &frame {
            came += u32::from(receiver.push::<Command>(*byte).is_some());
        }
        assert_eq!((came, receiver.counters().errors), (1, 1));
    }

    #[test]
    fn a_ring_counts_what_it_has_no_room_for() {
        static RING: Ring<16> = Ring::new();
        (0..20).for_each(|byte| RING.push(byte));
        RING.lose(3);
        assert_eq!(RING.lost(), 7);
        assert!((0..16).all(|byte| RING.pop() == Some(byte)));
        assert!(RING.is_empty());
    }

    #[test]
    fn health_is_told_when_asked_for() {
        let app = cortex_m::singleton!(: Board = Board::new(CONFIG)).expect("the first to take it");
        let mut ask = Vec::<u8, 16>::new();
        assert!(link::append(&Command::Health, &mut ask));
        let mut receiver = link::Receiver::new();
        let mut answers = 0;
        for byte in ask {
            for sent in app.command(byte) {
                let message = receiver.push::<Telemetry>(*sent);
                answers += u32::from(
                    matches!(message, Some(Telemetry::Health(health)) if health.commands == 1),
                );
            }
        }
        assert_eq!(answers, 1);
    }
}
