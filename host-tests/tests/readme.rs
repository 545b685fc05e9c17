//! The README's figures are those that `card` prints.

use host_tests::board::card::Card;

#[test]
fn the_cost_table_is_that_of_the_golden_cards() {
    let readme = include_str!("../../README.md");
    let cards: Vec<Card> =
        serde_json::from_str(include_str!("../golden/card.json")).expect("a list of cards");
    for card in cards {
        let row = card.markdown();
        assert!(readme.contains(&row), "README.md lacks the row\n{row}");
    }
}
