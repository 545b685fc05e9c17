//! What the firmware takes on the emulated boards must not rise unnoticed.

use crate::common::figures::Risen;
use host_tests::board::{
    BOARDS, SMALL,
    card::{Card, drive_commands, measure},
    real::REAL,
    real_card::RealCard,
};
use object::{Object as _, ObjectSection as _, SectionKind};

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn no_figure_rises() {
    let golden: Vec<Card> =
        serde_json::from_str(include_str!("../../golden/card.json")).expect("a list of cards");
    let commands = drive_commands();
    let mut risen = Risen::default();
    for board in BOARDS.iter().chain([&SMALL]) {
        let now = measure(board, &commands).unwrap_or_else(|error| panic!("{error:#}"));
        println!("{now:?}");
        let before = golden
            .iter()
            .find(|card| card.board == now.board && card.configuration == now.configuration)
            .unwrap_or_else(|| {
                panic!(
                    "golden/card.json has no {}: {}",
                    now.board, now.configuration
                )
            });
        for (what, before, now) in [
            ("flash_bytes", before.flash_bytes, now.flash_bytes),
            ("ram_bytes", before.ram_bytes, now.ram_bytes),
            ("stack_bytes", before.stack_bytes, now.stack_bytes),
            ("instructions", before.instructions, now.instructions),
            (
                "instructions_max",
                before.instructions_max,
                now.instructions_max,
            ),
        ] {
            risen.compare(
                &format!("{}: {what}", board.name),
                before as f64,
                now as f64,
            );
        }
        if before.rustc != now.rustc {
            println!("measured with rustc {}, now {}", before.rustc, now.rustc);
        }
    }
    risen.expect_none("card");
}

/// Flash and statics; what stands beside them in the table is reckoned from the cards above.
#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn no_firmware_of_a_real_board_grows() {
    let cores: Vec<Card> =
        serde_json::from_str(include_str!("../../golden/card.json")).expect("a list of cards");
    let golden: Vec<RealCard> =
        serde_json::from_str(include_str!("../../golden/boards.json")).expect("a list of cards");
    assert_eq!(golden.len(), REAL.len());
    let mut risen = Risen::default();
    for (board, before) in REAL.iter().zip(&golden) {
        let core = cores.iter().find(|card| card.board == board.emulated);
        let now = board
            .measure(core.expect("each core has a card"))
            .unwrap_or_else(|error| panic!("{error:#}"));
        println!("{now:?}");
        assert_eq!(board.name, before.board);
        for (what, before, now) in [
            ("flash_bytes", before.flash_bytes, now.flash_bytes),
            ("ram_bytes", before.ram_bytes, now.ram_bytes),
        ] {
            risen.compare(
                &format!("{}: {what}", board.name),
                before as f64,
                now as f64,
            );
        }
        // The rest follows from these and the core's figures.
        assert_eq!(
            (now.share_percent, now.longest_ms, now.verdict),
            (before.share_percent, before.longest_ms, before.verdict),
            "{}: cargo run --release -- card --bless",
            board.name
        );
    }
    risen.expect_none("card");
}

/// The application's place is all zeros: what lies in flash to be copied into RAM at the start is the HAL's alone.
#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn no_application_is_copied_from_flash() {
    let emulated = BOARDS.iter().map(|board| (&board.firmware, 0));
    let real = REAL.iter().map(|board| (&board.firmware, 2048));
    for (firmware, most) in emulated.chain(real) {
        let elf = firmware
            .build("")
            .unwrap_or_else(|error| panic!("{error:#}"));
        let bytes = std::fs::read(&elf).expect("the firmware");
        let file = object::File::parse(&*bytes).expect("an ELF file");
        let data: u64 = file
            .sections()
            .filter(|section| section.kind() == SectionKind::Data)
            .map(|section| section.size())
            .sum();
        println!("{}: {data} bytes of first values", firmware.package);
        assert!(
            data <= most,
            "{}: {data} bytes of first values",
            firmware.package
        );
    }
}
