//! The README's figures are those that `card` prints.

use host_tests::board::{card::Card, real_card::RealCard};

#[test]
fn the_cost_table_is_that_of_the_golden_cards() {
    let readme = include_str!("../../../README.md");
    let cards: Vec<Card> =
        serde_json::from_str(include_str!("../../golden/card.json")).expect("a list of cards");
    for card in cards {
        let row = card.markdown();
        assert!(readme.contains(&row), "README.md lacks the row\n{row}");
    }
}

#[test]
fn the_table_of_boards_is_what_was_measured() {
    let readme = include_str!("../../../README.md");
    let boards: Vec<RealCard> =
        serde_json::from_str(include_str!("../../golden/boards.json")).expect("a list of cards");
    let cards: Vec<Card> =
        serde_json::from_str(include_str!("../../golden/card.json")).expect("a list of cards");
    for board in boards {
        let row = board.markdown();
        assert!(readme.contains(&row), "README.md lacks the row\n{row}");
        // What was measured on the emulated core is that core's present figure.
        let core = cards.iter().find(|card| card.board == board.emulated);
        let core = core.expect("each core has a card");
        assert_eq!(
            (core.instructions, core.stack_bytes),
            (board.instructions, board.stack_bytes),
            "{}: cargo run --release -- card --bless",
            board.board
        );
    }
}
