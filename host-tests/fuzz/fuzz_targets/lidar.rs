//! Any bytes to any driver: no panic, every byte accounted for; and any content of a frame, whatever its check code says.
#![no_main]

use beamfix::{
    lidar::{
        Counters, Family, Format, Model, Packet, Parser, Protocol, Verdict, camsense,
        choice::{WithParser, with_parser},
        delta, ld06, lds01, lds006, lslidar, rplidar, scip, sick,
        timing::Pace,
        xv11, ydlidar,
    },
    scan::Assembler,
};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: &[u8]| {
    let Some((&choice, bytes)) = input.split_first() else {
        return;
    };
    let model = &Model::ALL[usize::from(choice) % Model::ALL.len()];
    match model.family {
        Family::RplidarScan => framed(rplidar::Parser::for_model(model), bytes),
        Family::RplidarExpress => framed(rplidar::capsule::Parser::for_model(model), bytes),
        Family::RplidarDense => framed(rplidar::capsule::Parser::for_model(model), bytes),
        Family::RplidarUltra => framed(rplidar::ultra::UltraParser::for_model(model), bytes),
        Family::RplidarUltraDense => {
            framed(rplidar::ultra::UltraDenseParser::for_model(model), bytes);
        }
        Family::RplidarHq => framed(rplidar::hq::Parser::for_model(model), bytes),
        Family::Ydlidar(_) => framed(ydlidar::Parser::for_model(model), bytes),
        Family::Lds01 => framed(lds01::Parser::for_model(model), bytes),
        Family::Xv11 => framed(xv11::Parser::for_model(model), bytes),
        Family::Xv11Early => framed(xv11::early::Parser::for_model(model), bytes),
        Family::Delta(_) => framed(delta::Parser::for_model(model), bytes),
        Family::Camsense(_) => framed(camsense::Parser::for_model(model), bytes),
        Family::Lds006 => framed(lds006::Parser::for_model(model), bytes),
        Family::Lslidar(_) => framed(lslidar::Parser::for_model(model), bytes),
        Family::Sick => framed(sick::Parser::for_model(model), bytes),
        Family::Scip(_) => {
            stream(scip::Parser::for_model(model), bytes);
            stream(
                scip::Parser::for_model(model),
                &with_check_characters(bytes),
            );
        }
        Family::Ldrobot(_) => framed(ld06::Parser::for_model(model), bytes),
        family => panic!("{family:?} is new: its frames are to be made here"),
    }
    // The parser that firmware gets for this model, whatever its family.
    with_parser(model, Stream(bytes));
});

struct Stream<'a>(&'a [u8]);

impl WithParser for Stream<'_> {
    type Output = ();

    fn run<P: Protocol>(self, parser: P) {
        stream(parser, self.0);
    }
}

/// A protocol with frames: as a stream, and each piece of it as a frame.
fn framed<F: Format + Clone, const L: usize>(parser: Parser<F, L>, bytes: &[u8]) {
    let mut format = parser.format().clone();
    let (counters, unused) = stream(parser, bytes);
    let is_nothing = counters.packets == 0 && counters.answers == 0;
    assert!(!is_nothing || unused == bytes.len(), "{counters:?}");
    // A fuzzer does not guess check codes: whatever has a frame's head and length is taken for one.
    let mut pace = Pace::new(115_200);
    let mut rest = bytes;
    while let [first, after @ ..] = rest {
        let Some(frame) = whole_frame(&format, rest) else {
            rest = after;
            continue;
        };
        if first & 1 == 1 {
            pace.arrived(u32::from(*first) << 24);
        }
        rest = &rest[frame.len()..];
        if let Some(packet) = format.packet(frame, rest.len() % 5 > 0, &mut pace) {
            look(&packet);
        }
    }
}

/// The frame that these bytes start with, its check code right or wrong.
fn whole_frame<'a>(format: &impl Format, bytes: &'a [u8]) -> Option<&'a [u8]> {
    let mut length = 1;
    loop {
        let start = bytes.get(..length)?;
        match format.judge(start) {
            Verdict::Need(more) if more > length => length = more,
            Verdict::Frame(_) | Verdict::Doubtful(_) | Verdict::CheckFailed => return Some(start),
            _ => return None,
        }
    }
}

/// What was seen, and how many bytes were not part of it.
fn stream<P: Protocol>(mut parser: P, bytes: &[u8]) -> (Counters, usize) {
    let mut assembler = Assembler::<64>::new();
    let mut take = |packet: P::Packet| {
        look(&packet);
        let start = packet.revolution_start();
        for (k, beam) in packet.beams().enumerate() {
            if assembler.push(beam, start == Some(k)) {
                assert!(assembler.scan().len() <= 64);
            }
        }
    };
    for &byte in bytes {
        if let Some(packet) = parser.push(byte) {
            take(packet);
        }
    }
    while let Some(packet) = parser.pull() {
        take(packet);
    }
    let counters = parser.counters();
    let unused = counters.skipped_bytes as usize + parser.pending_bytes();
    assert!(unused <= bytes.len(), "{counters:?}");
    (counters, unused)
}

fn look(packet: &impl Packet) {
    let beams = packet.beams().count();
    assert_eq!(beams, packet.samples().count());
    assert!(packet.revolution_start().is_none_or(|start| start < beams));
    for sample in packet.samples() {
        assert!((0.0..360.0).contains(&sample.angle_deg), "{sample:?}");
        assert!(sample.range_mm.is_none_or(|mm| mm > 0.0), "{sample:?}");
    }
    packet.speed_rpm();
}

/// Lines of text with their check characters.
fn with_check_characters(bytes: &[u8]) -> Vec<u8> {
    let mut text = Vec::new();
    for (k, line) in bytes.split(|byte| *byte == b'\n').enumerate() {
        text.extend(line);
        if k > 0 && !line.is_empty() {
            text.push(scip::check_character(line));
        }
        text.push(b'\n');
    }
    text
}
