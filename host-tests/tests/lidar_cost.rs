//! What every driver costs on the emulated Cortex-M0, and that it finds the host's beams there.

use beamfix::lidar::Model;
use host_tests::board::{Board, drivers::measure};

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn drivers_on_the_cortex_m0() {
    let board = Board::named("m0").expect("there");
    println!(
        "instructions a byte; their share of 48 MHz at the rate the sensor sends, and on a full line; memory"
    );
    for model in Model::ALL {
        let cost = measure(board, model).unwrap_or_else(|error| panic!("{error:#}"));
        let full_line = cost.per_byte * f64::from(model.baud) / 10.0;
        println!(
            "{:<18} {:>6.1} {:>5.1} % {:>5.1} %  parser {:>4} B, packet {:>4} B, stack {:>5} B",
            model.name,
            cost.per_byte,
            cost.per_byte * cost.bytes_per_s / 48e4,
            full_line / 48e4,
            cost.parser_bytes,
            cost.packet_bytes,
            cost.stack_bytes
        );
        // Counted in instructions, of which a Cortex-M0 does two in three cycles of such code.
        match model.name {
            "ld06" => assert!(full_line <= 0.05 * 48e6, "LD06: {full_line} a second"),
            "rplidar-dense" => assert!(full_line <= 0.15 * 133e6, "S2: {full_line} a second"),
            _ => {}
        }
    }
}
