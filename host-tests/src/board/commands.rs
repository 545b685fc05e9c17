//! The bytes of a board's command line: commands in order, framed.

use beamfix::{geometry::Pose, scan::Beam};
use beamfix_app::{
    command::{self, Command},
    link,
};

use crate::formats::Recorded;
use crate::formats::capture::{self, Content};

/// Framed commands in the order in which a board receives them.
#[derive(Debug, Clone, Default)]
pub struct Commands {
    bytes: Vec<u8>,
}

impl Commands {
    /// Nothing yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// As sent.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Bytes of the lidar.
    pub fn lidar(&mut self, bytes: &[u8]) {
        for piece in bytes.chunks(command::LIDAR) {
            self.push(&Command::Lidar(piece));
        }
    }

    /// The robot's pose by its wheels; counts for the scan pushed last.
    pub fn wheels(&mut self, pose: Pose) {
        let Pose { x, y, theta } = pose;
        self.push(&Command::Wheels { x, y, theta });
    }

    /// Asks how the parts are.
    pub fn ask_health(&mut self) {
        self.push(&Command::Health);
    }

    /// Asks what the board is; one before version 7 counts a damaged command.
    pub fn ask_ready(&mut self) {
        self.push(&Command::Ready);
    }

    /// A whole scan. It is matched when the next one starts.
    pub fn scan(&mut self, beams: &[Beam]) {
        for (k, piece) in beams.chunks(command::BEAMS).enumerate() {
            let beams: Vec<u8> = piece.iter().flat_map(command::beam_bytes).collect();
            self.push(&Command::Beams {
                turn_starts: k == 0,
                beams: &beams,
            });
        }
    }

    /// Scans of a log, each with its wheel odometry.
    #[must_use]
    pub fn of_log(scans: &[Recorded]) -> Self {
        let mut commands = Self::new();
        for recorded in scans {
            commands.scan(&recorded.beams);
            if let Some(pose) = recorded.wheels {
                commands.wheels(pose);
            }
        }
        // The last one is complete when another begins.
        if let Some(next) = scans.last().and_then(|recorded| recorded.beams.first()) {
            commands.scan(&[*next]);
        }
        commands
    }

    /// A capture: its bytes, and its wheels between them.
    #[must_use]
    pub fn of_capture(capture: &[u8]) -> Self {
        let mut commands = Self::new();
        let mut bytes = Vec::new();
        for piece in capture::pieces(capture) {
            match piece.content {
                Content::Bytes(more) => bytes.extend_from_slice(more),
                Content::Wheels(pose) => {
                    commands.lidar(&std::mem::take(&mut bytes));
                    commands.wheels(pose);
                }
                _ => {}
            }
        }
        commands.lidar(&bytes);
        commands
    }

    /// Any command.
    pub fn send(&mut self, command: &Command) {
        self.push(command);
    }

    fn push(&mut self, command: &Command) {
        let mut frame = heapless::Vec::<u8, { link::FRAME }>::new();
        assert!(
            link::append(command, &mut frame),
            "a command always fits: {command:?}"
        );
        self.bytes.extend_from_slice(&frame);
    }
}
