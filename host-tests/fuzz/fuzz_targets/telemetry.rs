//! Any bytes where telemetry or commands are expected, and any command sent: no panic, and what is sent is read as it was.
#![no_main]

use arbitrary::Arbitrary;
use beamfix_telemetry::{
    command::{self, BEAMS, Command, LIDAR},
    link::{self, Receiver},
    telemetry::Telemetry,
};
use libfuzzer_sys::fuzz_target;

#[derive(Arbitrary, Debug)]
enum Piece {
    Noise(Vec<u8>),
    Wheels(f32, f32, f32),
    Lidar(Vec<u8>),
    Beams(bool, Vec<u8>),
    Gyro(f32),
    Health,
    Send(bool, bool, bool),
}

impl Piece {
    fn command(&self) -> Option<Command<'_>> {
        Some(match *self {
            Self::Noise(_) => return None,
            Self::Wheels(x, y, theta) => Command::Wheels { x, y, theta },
            Self::Lidar(ref bytes) => Command::Lidar(bytes.get(..LIDAR).unwrap_or(bytes)),
            Self::Beams(turn_starts, ref bytes) => Command::Beams {
                turn_starts,
                beams: bytes.get(..9 * BEAMS).unwrap_or(bytes),
            },
            Self::Gyro(rate) => Command::Gyro { rate },
            Self::Health => Command::Health,
            Self::Send(raw, scans, quality) => Command::Send {
                raw,
                scans,
                quality,
            },
        })
    }
}

fuzz_target!(|pieces: Vec<Piece>| {
    let mut telemetry = Receiver::new();
    let mut commands = Receiver::new();
    for piece in &pieces {
        let Some(sent) = piece.command() else {
            let Piece::Noise(bytes) = piece else { return };
            for &byte in bytes {
                let _ = telemetry.push::<Telemetry>(byte);
                if let Some(Command::Beams { beams, .. }) = commands.push::<Command>(byte) {
                    assert_eq!(command::beams(beams).count(), beams.len() / 9);
                }
            }
            continue;
        };
        // What came before is at an end with a zero byte.
        let _ = commands.push::<Command>(0);
        let mut bytes = heapless::Vec::<u8, 256>::new();
        assert!(link::append(&sent, &mut bytes), "no room for {sent:?}");
        let mut read = 0;
        for &byte in &bytes {
            if let Some(got) = commands.push::<Command>(byte) {
                // NaN is unlike itself.
                assert_eq!(format!("{got:?}"), format!("{sent:?}"));
                read += 1;
            }
            let _ = telemetry.push::<Telemetry>(byte);
        }
        assert_eq!(read, 1);
    }
});
