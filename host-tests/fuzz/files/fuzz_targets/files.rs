//! Any file of a recording or a map that the tool reads, and whole ones of each kind that were damaged: an error or a log, in bounded
//! memory.
#![no_main]

use std::sync::LazyLock;

use arbitrary::Arbitrary;
use libfuzzer_sys::fuzz_target;

#[allow(dead_code)]
#[path = "../../../tests/common/bag.rs"]
mod bag;
#[path = "../../../tests/common/files.rs"]
mod files;

#[derive(Arbitrary, Debug)]
struct Input {
    kind: u8,
    flips: Vec<(u16, u8)>,
    insert: (u16, Vec<u8>),
    end: Option<u16>,
    /// All of it, instead of a whole file.
    raw: Option<Vec<u8>>,
}

static WHOLE: LazyLock<[Vec<u8>; 6]> = LazyLock::new(files::whole);

fuzz_target!(|input: Input| {
    let kind = usize::from(input.kind) % WHOLE.len();
    let mut file = input.raw.unwrap_or_else(|| WHOLE[kind].clone());
    let Input {
        flips, insert, end, ..
    } = input;
    files::Damage { flips, insert, end }.hit(&mut file);
    files::read(kind, file);
});
