//! `tune`: constants are found in the source as they stand there, and one number of one of them is replaced.

use std::fs;
use std::path::Path;

use crate::common::tool::beamfix;
use host_tests::tuning;

fn source() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../src"))
}

#[test]
fn every_constant_is_found_with_its_meaning() {
    let constants = tuning::all(source()).expect("the library's source");
    assert!(constants.len() > 80, "{}", constants.len());
    let page = tuning::page(&constants);
    for (name, value) in [
        ("sensor_model/beam_model.rs:P", "0.231_641_9"),
        ("localization/search.rs:BLOCK", "4"),
        ("degeneracy.rs:GUESS_SIGMA", "0.3"),
    ] {
        let constant = tuning::named(&constants, name).expect(name);
        assert_eq!(constant.text, value, "{name}");
        assert!(constant.about.len() > 8, "{name}: {}", constant.about);
    }
    // What a reader of the page would have to look up in the source.
    let without: Vec<&str> = page.lines().filter(|line| line.ends_with("|  |")).collect();
    assert!(
        without.is_empty(),
        "constants without a meaning: {without:#?}"
    );
}

#[test]
fn the_page_of_constants_is_what_the_source_says() {
    let page = tuning::page(&tuning::all(source()).expect("the library's source"));
    let kept = source().join("../docs/constants.md");
    let kept = fs::read_to_string(kept).expect("docs/constants.md");
    assert!(
        page.trim() == kept.trim(),
        "docs/constants.md is old: cargo run --release -- tune --table > docs/constants.md"
    );
}

#[test]
fn one_number_is_replaced_and_nothing_else() {
    let constants = tuning::all(source()).expect("the library's source");
    let constant = tuning::named(&constants, "degeneracy.rs:GUESS_SIGMA").expect("a constant");
    let text = fs::read_to_string(source().join(&constant.file)).expect("its file");
    let changed = constant.replaced(&text, 0, 0.25).expect("a number");
    assert_eq!(changed.replacen("= 0.25;", "= 0.3;", 1), text);
    assert_ne!(changed, text);
    assert!(
        constant.replaced(&text, 1, 0.25).is_err(),
        "it has one number"
    );
}

#[test]
fn what_cannot_be_swept_is_said_before_anything_is_built() {
    for (arguments, word) in [
        (&["tune", "NO_SUCH"][..], "no constant NO_SUCH"),
        (&["tune", "GUESS_SIGMA"], "--from and --to"),
        (
            &["tune", "search.rs:BLOCK", "--from", "1.5", "--to", "2.5"],
            "integer",
        ),
    ] {
        let output = beamfix(arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(word), "{arguments:?}: {said}");
    }
}
