//! Any bytes on both of the firmware's lines, and commands that make sense: no panic, and every frame it sends can be
//! read.
#![no_main]

use arbitrary::Arbitrary;
use beamfix::scan::{Beam, Bearing, Range};
use beamfix_app::{
    App, CONFIG,
    command::{Command, beam_bytes},
    link::{self, Receiver},
    telemetry::{Reset, Telemetry},
};
use libfuzzer_sys::fuzz_target;

#[derive(Arbitrary, Debug)]
enum Piece {
    Lidar(Vec<u8>),
    Commands(Vec<u8>),
    Wheels(f32, f32, f32),
    Gyro(f32),
    Time(u32),
    /// A revolution in a round room.
    Turn {
        mm: u16,
        growth: i8,
        interval_us: u16,
    },
    Health,
    /// Also the lidar's bytes and beams.
    Send {
        raw: bool,
        scans: bool,
        quality: bool,
    },
}

fuzz_target!(|pieces: Vec<Piece>| {
    let mut app = App::<64>::new(CONFIG);
    let mut receiver = Receiver::new();
    let mut messages = 0;
    let mut read = |sent: &[u8]| {
        for &byte in sent {
            messages += u32::from(receiver.push::<Telemetry>(byte).is_some());
        }
        let counters = receiver.counters();
        assert_eq!((counters.errors, counters.frames), (0, messages));
    };
    read(app.ready(Reset::Other));
    for piece in &pieces {
        let mut commands = heapless::Vec::<u8, 2048>::new();
        match *piece {
            Piece::Lidar(ref bytes) => {
                app.lidar_all(bytes, &mut read);
            }
            Piece::Commands(ref bytes) => {
                app.command_all(bytes, &mut read);
            }
            Piece::Wheels(x, y, theta) => {
                assert!(link::append(
                    &Command::Wheels { x, y, theta },
                    &mut commands
                ));
            }
            Piece::Gyro(rate) => {
                assert!(link::append(&Command::Gyro { rate }, &mut commands));
            }
            Piece::Time(now_us) => app.set_time(now_us),
            Piece::Turn {
                mm,
                growth,
                interval_us,
            } => {
                for k in 0..6u32 {
                    let beams: Vec<u8> = (0..10)
                        .flat_map(|j| {
                            let k = k * 10 + j;
                            let mm = i32::from(mm) + i32::from(growth) * k as i32;
                            beam_bytes(&Beam {
                                bearing: Bearing(1092u16.wrapping_mul(k as u16)),
                                range: Range::from_mm(mm.max(0) as u32),
                                time_us: u32::from(interval_us) * k,
                                quality: 0,
                            })
                        })
                        .collect();
                    let command = Command::Beams {
                        turn_starts: k == 0,
                        beams: &beams,
                    };
                    assert!(link::append(&command, &mut commands));
                }
            }
            Piece::Send {
                raw,
                scans,
                quality,
            } => {
                let send = Command::Send {
                    raw,
                    scans,
                    quality,
                };
                assert!(link::append(&send, &mut commands));
            }
            Piece::Health => assert!(link::append(&Command::Health, &mut commands)),
        }
        app.command_all(&commands, &mut read);
    }
});
