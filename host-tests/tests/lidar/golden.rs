//! The bits of every lidar's packets and revolutions, as they are kept: from a clean line, from a damaged one, and what is told of both.

use beamfix::lidar::{Model, Packet as _, Protocol, identify};
use beamfix::scan::Assembler;
use beamfix_sim::encoder::{self, Echo, damage};
use host_tests::decode::{WithParser, with_parser};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::common::kept::Kept;

#[test]
fn lidars_give_the_bits_that_are_kept() {
    let mut kept = Kept::of("lidar");
    for model in Model::ALL {
        let clean = stream(model, 3000);
        let mut damaged = clean.clone();
        damage::hit(
            &mut damaged,
            clean.len() / 400,
            &mut ChaCha8Rng::seed_from_u64(5),
        );
        for line in [&clean, &damaged] {
            with_parser(model, Into(model.name, line, &mut kept));
            kept.push("hints", identify::hints(model, line).collect::<Vec<_>>());
            let found = identify::identify(line).map(|finding| {
                (
                    finding.model.name,
                    finding
                        .alternatives()
                        .map(|other| other.name)
                        .collect::<Vec<_>>(),
                )
            });
            kept.push("identified", found);
        }
    }
    kept.check();
}

/// A room without symmetry, with a door, dark and bright walls.
fn stream(model: &Model, beams: usize) -> Vec<u8> {
    let mut sensor = encoder::for_model(model);
    let mut line = Vec::new();
    for _ in 0..beams {
        let mut look = |time_us: f64, bearing: f64| {
            let range_mm = 2000.0 + 900.0 * libm::sin(3.0 * bearing) + 400.0 * libm::cos(bearing);
            (libm::sin(bearing) > -0.98).then_some(Echo {
                range_mm: range_mm + 20.0 * libm::sin(1e-4 * time_us),
                intensity: (range_mm / 16.0) as u8,
            })
        };
        sensor.fire(&mut look, &mut line);
    }
    line
}

struct Into<'a>(&'static str, &'a [u8], &'a mut Kept);

impl WithParser for Into<'_> {
    type Output = ();

    fn run<P: Protocol>(self, mut parser: P) {
        let Self(name, line, kept) = self;
        let mut assembler = Box::new(Assembler::<1200>::new());
        for &byte in line {
            let Some(packet) = parser.push(byte) else {
                continue;
            };
            kept.push(name, (packet.speed_rpm(), packet.revolution_start()));
            let start = packet.revolution_start();
            for (k, beam) in packet.beams().enumerate() {
                kept.push(name, beam);
                if assembler.push(beam, start == Some(k)) {
                    kept.push(name, assembler.scan().beams().len());
                }
            }
        }
        kept.push(name, parser.counters());
    }
}
