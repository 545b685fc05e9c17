//! Any bytes where a sensor's answers are expected, and where nobody knows yet what is on the line: no panic.
#![no_main]

use beamfix::lidar::{
    Model, Protocol as _,
    identify::{hints, identify},
    ld06,
    ring::Ring,
    rplidar::command::{self, Answers, Health, Info},
    scip::command::{Parameters, Part, Replies},
    startup::{Action, StartConfig, Startup},
};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: &[u8]| {
    let Some((&choice, bytes)) = input.split_first() else {
        return;
    };
    let model = &Model::ALL[usize::from(choice) % Model::ALL.len()];
    match choice % 5 {
        0 => unknown(model, bytes),
        1 => answers(bytes),
        2 => replies(bytes),
        3 => startup(model, bytes),
        _ => ring(bytes),
    }
});

fn unknown(model: &Model, bytes: &[u8]) {
    if let Some(found) = identify(bytes) {
        assert!(found.survey.frames > 0);
        assert!(found.survey.covered_bytes as usize <= bytes.len() + 1);
    }
    for hint in hints(model, bytes) {
        assert!(!hint.to_string().is_empty());
    }
}

fn answers(bytes: &[u8]) {
    let mut answers = Answers::new();
    for &byte in bytes {
        if let Some(answer) = answers.push(byte) {
            Info::from_answer(&answer);
            Health::from_answer(&answer);
            command::conf(&answer);
        }
    }
    if let Some(request) = command::request(bytes.first().copied().unwrap_or(0), bytes) {
        assert_eq!(request.first(), Some(&0xa5));
    }
}

fn replies(bytes: &[u8]) {
    let (mut replies, mut parameters) = (Replies::new(), Parameters::default());
    for &byte in bytes {
        if let Some(Part::Field { name, value }) = replies.push(byte) {
            parameters.take(name, value);
        }
    }
    for pair in bytes.chunks(2) {
        let (name, value) = pair.split_at(1);
        parameters.take(name, value);
        parameters.take(b"ARES", pair);
        parameters.take(b"AMAX", bytes);
    }
    assert!(
        parameters
            .steps()
            .is_none_or(|steps| steps.per_revolution > 0)
    );
}

/// Time passes and bytes come as the input has it; an end stays one.
fn startup(model: &Model, bytes: &[u8]) {
    let mut startup = Startup::new(model, StartConfig::DEFAULT);
    let mut now_us = 0u32;
    for &byte in bytes {
        match startup.poll(now_us) {
            Action::Send(bytes) => assert!(!bytes.is_empty()),
            Action::Failed(error) => {
                assert!(!error.to_string().is_empty());
                assert_eq!(startup.poll(now_us), Action::Failed(error));
            }
            _ => {}
        }
        match byte & 3 {
            0 => now_us = now_us.wrapping_add(u32::from(byte) << 14),
            1 => startup.packet_arrived(now_us),
            _ => startup.push(byte),
        }
        startup.push(byte);
        startup.info();
        startup.parameters();
    }
}

/// A DMA's ring that is read at any time.
fn ring(bytes: &[u8]) {
    let (mut memory, mut written) = ([0; 64], 0u32);
    let mut ring = Ring::new(ld06::Parser::new());
    for (k, &byte) in bytes.iter().enumerate() {
        memory[written as usize % 64] = byte;
        written = written.wrapping_add(1);
        if byte % 7 == 0 || k + 1 == bytes.len() {
            ring.drain(&memory, written, |_| ());
        }
    }
    let counters = ring.parser().counters();
    let seen = counters.packets * ld06::FRAME as u32 + counters.skipped_bytes;
    let pending = ring.parser().pending_bytes() as u32;
    assert_eq!(seen + pending + ring.overrun_bytes(), written);
}
