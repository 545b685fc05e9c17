//! The tests that a board's owner runs with a probe, in emulators: `boards/*/tests/on_target.rs`.

use std::{fs, path::Path};

use beamfix_app::{App, BEAMS, CONFIG};
use beamfix_selftest::demo::{Demo, FIRST_POSES};
use host_tests::board::{
    STM32F4,
    emulator::run_test,
    rp2040js::{self, PICO},
};
use object::{Object as _, ObjectSection as _, ObjectSymbol as _};
use serde_json::Value;

#[test]
fn the_poses_that_a_board_proves_itself_by_are_the_hosts() {
    let mut app = Box::new(App::<BEAMS>::new(CONFIG));
    let found = FIRST_POSES.find(&mut app, &mut Demo::new());
    assert_eq!(
        found, FIRST_POSES.hash,
        "{found:#x}: if poses changed on purpose, `FIRST_POSES` in boards/selftest/src/demo.rs"
    );
}

/// Name and address of each test in an ELF file made with embedded-test.
fn tests(elf: &Path) -> Vec<(String, u32)> {
    let bytes = fs::read(elf).expect("it was just built");
    let file = object::File::parse(&*bytes).expect("an ELF file");
    // embedded-test's table: a symbol whose name is JSON, and there the function's address.
    let table = file
        .section_by_name(".embedded_test")
        .expect("made by embedded-test");
    let data = table.data().expect("in the file");
    let of = |symbol: object::Symbol| {
        let test: Value = serde_json::from_str(symbol.name().ok()?).ok()?;
        let name = test.as_object()?.get("name")?.as_str()?.to_owned();
        let at = (symbol.address() - table.address()) as usize;
        let address = data[at..at + 4].try_into().expect("four bytes");
        Some((name, u32::from_le_bytes(address)))
    };
    let tests: Vec<_> = file.symbols().filter_map(of).collect();
    assert!(tests.len() >= 4, "{tests:?}");
    tests
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn every_test_for_the_nucleo_passes_in_qemu() {
    let elf = STM32F4
        .build_test("on_target")
        .unwrap_or_else(|error| panic!("{error:#}"));
    for (name, address) in tests(&elf) {
        let status = run_test(&STM32F4, &elf, address);
        let status = status.unwrap_or_else(|error| panic!("{error:#}"));
        println!("{name}: {status}");
        assert_eq!(status, 0, "{name}");
    }
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the firmware is always a release build"
)]
fn every_test_for_the_pico_passes_in_rp2040js() {
    let elf = PICO
        .build_test("on_target")
        .unwrap_or_else(|error| panic!("{error:#}"));
    for (name, address) in tests(&elf) {
        let status = rp2040js::run_test(&elf, address);
        let Some(status) = status.unwrap_or_else(|error| panic!("{error:#}")) else {
            return;
        };
        println!("{name}: {status}");
        assert_eq!(status, 0, "{name}");
    }
}
