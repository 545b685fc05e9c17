//! What matching against fields costs on the emulated boards must not rise unnoticed, and it gives the host's bits.

use crate::common::figures::Risen;
use host_tests::board::{BOARDS, Board, maps};

#[test]
fn fields_give_the_same_bits_and_cost_no_more_than_they_did() {
    let golden: maps::Card =
        serde_json::from_str(include_str!("../../golden/maps.json")).expect("figures");
    let now = maps::measure(&BOARDS.iter().collect::<Vec<&Board>>())
        .unwrap_or_else(|error| panic!("{error:#}"));
    println!("{}", now.table());
    let mut risen = Risen::default();
    let (before, now) = (golden.figures(), now.figures());
    for (name, now) in now {
        let (_, before) = before
            .iter()
            .find(|(other, _)| *other == name)
            .unwrap_or_else(|| panic!("golden/maps.json has no {name}"));
        risen.compare(&name, *before, now);
    }
    risen.expect_none("card");
}
