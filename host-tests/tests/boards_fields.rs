//! What matching against fields costs on the emulated boards must not rise unnoticed, and it gives the host's bits.

use host_tests::board::{BOARDS, Board, maps};

/// A rise by more than this fails: 2 %.
const ALLOWED: f64 = 1.02;

#[test]
fn fields_give_the_same_bits_and_cost_no_more_than_they_did() {
    let golden: maps::Card =
        serde_json::from_str(include_str!("../golden/maps.json")).expect("figures");
    let now = maps::measure(&BOARDS.iter().collect::<Vec<&Board>>())
        .unwrap_or_else(|error| panic!("{error:#}"));
    println!("{}", now.table());
    let mut risen = Vec::new();
    let (before, now) = (golden.figures(), now.figures());
    for (name, now) in now {
        let (_, before) = before
            .iter()
            .find(|(other, _)| *other == name)
            .unwrap_or_else(|| panic!("golden/maps.json has no {name}"));
        if now > before * ALLOWED {
            risen.push(format!("{name} was {before}, is {now}"));
        } else if now < before / ALLOWED {
            println!("{name} fell from {before} to {now}");
        }
    }
    assert!(
        risen.is_empty(),
        "{}\nIf it must be: cargo run --release -- card --bless, with the reason in the commit's message",
        risen.join("\n")
    );
}
