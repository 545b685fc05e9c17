//! Any bytes, and frames whose check code is right: no panic, every byte accounted for.
#![no_main]

use arbitrary::Arbitrary;
use beamfix::{
    lidar::{Packet as _, Protocol as _, ld06},
    scan::Assembler,
};
use libfuzzer_sys::fuzz_target;

/// A fuzzer does not guess check codes: frames get theirs.
#[derive(Arbitrary, Debug)]
enum Piece {
    Noise(Vec<u8>),
    Frame([u8; ld06::FRAME - 3]),
}

fuzz_target!(|pieces: Vec<Piece>| {
    let mut bytes = Vec::new();
    for piece in &pieces {
        match piece {
            Piece::Noise(noise) => bytes.extend(noise),
            Piece::Frame(body) => {
                let mut frame = vec![0x54, 0x2c];
                frame.extend(body);
                frame.push(ld06::check_code(&frame));
                bytes.extend(frame);
            }
        }
    }

    let mut parser = ld06::Parser::new();
    let mut assembler = Assembler::<64>::new();
    let mut beams = 0u32;
    let mut look = |packet: ld06::Packet| {
        let start = packet.turn_start();
        for (k, beam) in packet.beams().enumerate() {
            beams += 1;
            if assembler.push(beam, start == Some(k)) {
                assert!(assembler.scan().len() <= 64);
            }
        }
    };
    for &byte in &bytes {
        if let Some(packet) = parser.push(byte) {
            look(packet);
        }
    }
    while let Some(packet) = parser.pull() {
        look(packet);
    }
    let counters = parser.counters();
    assert_eq!(beams, counters.packets * ld06::POINTS as u32);
    let known = counters.packets as usize * ld06::FRAME + counters.skipped_bytes as usize;
    assert_eq!(known + parser.pending_bytes(), bytes.len());
});
