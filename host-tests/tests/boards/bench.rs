//! One match on the emulated boards: the host's bits, and no more instructions than before. What is not chosen costs no flash.

use std::{collections::BTreeSet, fs, path::Path};

use crate::common::figures::Risen;
use host_tests::board::{
    Board,
    bench::{self, Figures, Outcome},
};
use object::{Object as _, ObjectSymbol as _};

fn poses(outcomes: &[Outcome]) -> Vec<(bool, [u32; 3])> {
    outcomes
        .iter()
        .map(|o| {
            (
                o.found,
                [o.pose.x, o.pose.y, o.pose.theta].map(f32::to_bits),
            )
        })
        .collect()
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the boards' programs are always release builds"
)]
fn pairs_are_matched_to_the_same_bits_at_no_higher_cost() {
    let golden: Vec<Figures> =
        serde_json::from_str(include_str!("../../golden/bench.json")).expect("a list of figures");
    let list = bench::simulated();
    let mut risen = Risen::default();
    for (name, which) in bench::ALL {
        let board = Board::named(name).expect("a board");
        let (outcomes, stack) = bench::on_board(board, &list, which)
            .unwrap_or_else(|error| panic!("{name}: {error:#}"));
        assert_eq!(
            poses(&outcomes),
            poses(&bench::on_host(&list, which)),
            "{name} {which:?}"
        );
        assert!(outcomes.iter().all(|o| o.found), "{name} {which:?}");
        let now = Figures::new(board, which, &outcomes, stack);
        println!("{now:?}");
        let before = golden
            .iter()
            .find(|before| (before.board.as_str(), before.matcher) == (name, which))
            .unwrap_or_else(|| panic!("golden/bench.json has no {name} {which:?}"));
        for (what, before, now) in [
            ("prepare", before.prepare, now.prepare),
            ("matched", before.matched, now.matched),
            ("matched_max", before.matched_max, now.matched_max),
            ("stack_bytes", before.stack_bytes, now.stack_bytes),
        ] {
            let name = format!("{name} {which:?}: {what}");
            risen.compare(&name, before.into(), now.into());
        }
    }
    risen.expect_none("bench");
}

/// The rooms of `src/matching/` of which a function is in a program.
fn rooms(elf: &Path) -> BTreeSet<&'static str> {
    const ROOMS: [&str; 4] = ["projective", "modular", "selection", "virtual_scan"];
    let bytes = fs::read(elf).expect("an ELF file");
    let file = object::File::parse(&*bytes).expect("an ELF file");
    let names: Vec<&str> = file.symbols().filter_map(|s| s.name().ok()).collect();
    // In a mangled name each part has its length before it.
    let has = |room: &&str| {
        let part = format!("{}{room}", room.len());
        names.iter().any(|name| name.contains(&part))
    };
    ROOMS.into_iter().filter(has).collect()
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the boards' programs are always release builds"
)]
fn what_is_not_chosen_costs_no_flash() {
    let board = Board::named("m4f").expect("a board");
    // The fused matcher, one choice a stage, and every choice with the virtual scan.
    let [fused, one, every] = ["bench", "staged", "stages"].map(|program| {
        let elf = board
            .build(program)
            .unwrap_or_else(|error| panic!("{error:#}"));
        println!("{program}: {:?}", rooms(&elf));
        rooms(&elf)
    });
    assert_eq!(fused, BTreeSet::from(["projective"]));
    assert_eq!(one, BTreeSet::from(["modular"]));
    // The same look finds what is there.
    assert_eq!(
        every,
        BTreeSet::from(["modular", "selection", "virtual_scan"])
    );
}
