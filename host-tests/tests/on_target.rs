//! The tests that a board's owner runs with a probe, in QEMU: `boards/nucleo-f446/tests/on_target.rs`.

use std::fs;

use beamfix_app::{App, BEAMS, CONFIG, demo::Demo, demo::FIRST_POSES};
use host_tests::board::{STM32F4, emulator::run_test};
use object::{Object as _, ObjectSection as _, ObjectSymbol as _};
use serde_json::Value;

#[test]
fn the_poses_that_a_board_proves_itself_by_are_the_hosts() {
    let mut app = Box::new(App::<BEAMS>::new(CONFIG));
    let found = FIRST_POSES.find(&mut app, &mut Demo::new());
    assert_eq!(
        found, FIRST_POSES.hash,
        "{found:#x}: if poses changed on purpose, `FIRST_POSES` in boards/app/src/demo.rs"
    );
}

#[test]
fn every_test_for_the_board_passes_in_the_emulator() {
    let elf = STM32F4
        .build_test("on_target")
        .unwrap_or_else(|error| panic!("{error:#}"));
    let bytes = fs::read(&elf).expect("it was just built");
    let file = object::File::parse(&*bytes).expect("an ELF file");
    // embedded-test's table: a symbol whose name is JSON, and there the function's address.
    let table = file
        .section_by_name(".embedded_test")
        .expect("made by embedded-test");
    let data = table.data().expect("in the file");
    let mut ran = 0;
    for symbol in file.symbols() {
        let Some(test) = symbol
            .name()
            .ok()
            .and_then(|name| serde_json::from_str::<Value>(name).ok())
            .filter(Value::is_object)
        else {
            continue;
        };
        let at = (symbol.address() - table.address()) as usize;
        let address = data[at..at + 4].try_into().expect("four bytes");
        let status = run_test(&STM32F4, &elf, u32::from_le_bytes(address));
        let status = status.unwrap_or_else(|error| panic!("{error:#}"));
        println!("{}: {status}", test["name"]);
        assert_eq!(status, 0, "{}", test["name"]);
        ran += 1;
    }
    assert!(ran >= 4, "{ran} tests");
}
