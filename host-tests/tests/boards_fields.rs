//! What matching against fields costs on the emulated boards, and that it gives the host's bits.

use host_tests::board::{BOARDS, fields};

#[test]
fn loops_cost_what_they_may_and_give_the_same_bits() {
    for board in BOARDS {
        let costs = fields::measure(board).unwrap_or_else(|error| panic!("{error:#}"));
        println!("{costs:?}");
    }
}
