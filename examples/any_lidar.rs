//! Any lidar, named when the program starts: `cargo run --release --example any_lidar -- ld06`.
//!
//! On a board that knows its lidar, name the parser instead (`lidar::parsers`): this links all of them.

#![allow(clippy::disallowed_methods)] // The world around the lidar may use what std has.

mod room;

use beamfix::lidar::choice::{WithParser, with_parser};
use beamfix::lidar::{Model, Packet as _, Protocol, identify};
use beamfix::{Assembler, Pose};

/// Counts the revolutions and beams of some bytes.
struct Count<'a>(&'a [u8]);

impl WithParser for Count<'_> {
    type Output = (u32, usize);

    fn run<P: Protocol>(self, mut parser: P) -> (u32, usize) {
        let mut assembler = Assembler::<512>::new();
        let (mut revolutions, mut beams) = (0, 0);
        for &byte in self.0 {
            let Some(packet) = parser.push(byte) else {
                continue;
            };
            let start = packet.revolution_start();
            assembler.push_packet(packet.beams(), start, |scan| {
                revolutions += 1;
                beams = scan.len();
            });
        }
        (revolutions, beams)
    }
}

fn main() {
    let name = std::env::args().nth(1).unwrap_or_else(|| "ld06".into());
    let Some(model) = Model::named(&name) else {
        let names: Vec<&str> = Model::ALL.iter().map(|model| model.name).collect();
        eprintln!("no model {name}; there are {}", names.join(", "));
        std::process::exit(2);
    };
    // Bytes of an LD06: another family's parser finds nothing in them.
    let bytes = room::ld06(|_| Pose::new(1.5, 1.0, 0.3), 10);
    let (revolutions, beams) = with_parser(model, Count(&bytes));
    println!(
        "{name} at {} baud: {revolutions} revolutions, {beams} beams in the last",
        model.baud
    );
    if let Some(finding) = identify::identify(&bytes) {
        println!("by its bytes it is a {}", finding.model.name);
        // The first and the last revolution are not whole.
        assert!(name != finding.model.name || revolutions >= 8);
    }
}
