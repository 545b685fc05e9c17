//! The firmware's own loop under a flood of questions: the lidar loses nothing, and every revolution gets its pose.
//!
//! The lidar is the demo's, simulated by the board's clock.

use std::panic::{AssertUnwindSafe, catch_unwind};

use beamfix_app::{
    App, BEAMS, CONFIG,
    link::Receiver,
    ring::Ring,
    run::{Hardware, NoPwm, run},
    telemetry::Telemetry,
};
use beamfix_selftest::simulated::Simulated;
use host_tests::board::commands::Commands;

/// What leaves, and what commands come in at: 92 bytes a millisecond.
const LINE_BYTES_MS: usize = 92;
/// Rounds of the loop in a millisecond, each with up to 32 bytes of either line.
const ROUNDS_A_MS: u32 = 8;
/// How long it is watched (ms).
const WATCHED_MS: u32 = 5000;

/// A board whose time passes by the rounds of the loop and by what it sends.
struct Board<'a> {
    us: u32,
    commands: &'a Ring<2048>,
    questions: Vec<u8>,
    asked: usize,
    arrived_ms: u32,
    sent: &'a mut Vec<u8>,
    fed: &'a mut u32,
}

/// How the loop, which never ends, is left.
struct Over;

impl Board<'_> {
    /// Lets the lines carry what has come by now.
    fn arrive(&mut self) {
        while self.arrived_ms < self.us / 1000 {
            self.arrived_ms += 1;
            if self.arrived_ms == WATCHED_MS {
                std::panic::resume_unwind(Box::new(Over));
            }
            for _ in 0..LINE_BYTES_MS {
                self.commands
                    .push(self.questions[self.asked % self.questions.len()]);
                self.asked += 1;
            }
        }
    }
}

impl Hardware for Board<'_> {
    fn now_us(&mut self) -> u32 {
        self.us += 1000 / ROUNDS_A_MS;
        self.arrive();
        self.us
    }

    fn send(&mut self, bytes: &[u8]) {
        self.sent.extend_from_slice(bytes);
        // The line's own time; meanwhile more comes in.
        self.us += (1000 * bytes.len() / LINE_BYTES_MS) as u32;
        self.arrive();
    }

    fn feed_watchdog(&mut self) {
        *self.fed += 1;
    }

    fn wait(&mut self) {}
}

#[test]
fn a_flood_of_questions_costs_no_pose() {
    let (mut health, mut ready) = (Commands::new(), Commands::new());
    health.ask_health();
    ready.ask_ready();
    let mut found = Vec::new();
    for questions in [health.bytes(), ready.bytes(), &[0]].map(<[u8]>::to_vec) {
        let (lidar, commands) = (Ring::<2048>::new(), Ring::<2048>::new());
        let (mut sent, mut fed) = (Vec::new(), 0);
        let board = Simulated::new(Board {
            us: 0,
            commands: &commands,
            questions,
            asked: 0,
            arrived_ms: 0,
            sent: &mut sent,
            fed: &mut fed,
        });
        let mut app = Box::new(App::<BEAMS>::new(CONFIG));
        let over = catch_unwind(AssertUnwindSafe(|| {
            run(&mut *app, &CONFIG, (&lidar, &commands), board, NoPwm)
        }));
        assert!(over.is_err_and(|over| over.is::<Over>()));
        let mut receiver = Receiver::new();
        let messages: Vec<Telemetry> = sent
            .iter()
            .filter_map(|&byte| receiver.push(byte))
            .collect();
        let poses = messages
            .iter()
            .filter(|message| matches!(message, Telemetry::Pose(_)))
            .count();
        let answers = messages
            .iter()
            .filter(|message| matches!(message, Telemetry::Health(_) | Telemetry::Ready(_)))
            .count();
        println!(
            "{poses} poses, {answers} answers, {} bytes lost, fed {fed} times",
            lidar.lost()
        );
        assert_eq!(lidar.lost(), 0);
        found.push((poses, answers));
    }
    let Some((&(quiet, unasked), flooded)) = found.split_last() else {
        unreachable!("three runs");
    };
    assert!(quiet >= 47, "{quiet} poses of 50");
    for &(poses, answers) in flooded {
        assert_eq!(poses, quiet);
        assert!(
            answers > unasked + 50,
            "questions are answered, as far as there is time: {answers}"
        );
    }
}
