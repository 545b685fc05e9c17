//! What every driver costs on the emulated Cortex-M0, and that it finds the host's beams there; what the firmware costs besides matches.

use host_tests::board::bytes;
use host_tests::board::drivers::{PROMISES, measure_all, table};

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn drivers_on_the_cortex_m0() {
    let costs = measure_all(|| ()).unwrap_or_else(|error| panic!("{error:#}"));
    println!("{}", table(&costs));
    for (lidar, mhz, core, bar) in PROMISES {
        let cost = costs
            .iter()
            .find(|cost| cost.lidar == lidar)
            .expect("measured");
        // Counted in instructions, of which a Cortex-M0 does two in three cycles of such code.
        let cycles = 1.5 * cost.full_line_share(mhz);
        assert!(cycles <= bar, "{lidar}: {cycles} % of a {core}");
    }
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn the_firmware_besides_matches_on_the_cortex_m0() {
    let costs = bytes::measure().unwrap_or_else(|error| panic!("{error:#}"));
    println!("{}", bytes::text(&costs));
    assert_eq!(costs.len(), bytes::MOST.len());
    for (cost, (piece, most)) in costs.iter().zip(bytes::MOST) {
        assert!(cost.piece == piece && cost.instructions <= most, "{cost:?}");
    }
}
