//! What matching against fields costs on the emulated boards, and that it gives the host's bits.

use host_tests::board::{BOARDS, fields};

#[test]
fn fields_give_the_same_bits_and_cost_no_more_than_they_did() {
    // Most instructions: a beam of a score, a beam and pass of Newton's method (the pass's algebra shared out), a byte
    // looked up in the search's inner loop. What was measured and a twentieth more; rustc's version changes it a little.
    for (name, score, newton, inner) in [
        ("m4f", 19.6, 118.7, 2.5),
        ("m0", 50.9, 236.5, 6.7),
        ("rv32", 28.0, 138.8, 5.9),
    ] {
        let board = BOARDS
            .iter()
            .find(|board| board.name == name)
            .expect("a board");
        let costs = fields::measure(board).unwrap_or_else(|error| panic!("{error:#}"));
        println!("{costs:?}");
        assert!(
            costs.score_per_beam <= score,
            "{name}: {} a beam scored",
            costs.score_per_beam
        );
        assert!(
            costs.newton_per_beam <= newton,
            "{name}: {} a beam and pass",
            costs.newton_per_beam
        );
        assert!(
            costs.inner_per_lookup <= inner,
            "{name}: {} a lookup",
            costs.inner_per_lookup
        );
    }
}
