//! Files that were damaged: an error or a log, never a panic. `./test fuzz` tries more where `FUZZ_SECONDS` is given.

use std::sync::LazyLock;

use proptest::prelude::*;

use super::common::files::{self, Damage};

static WHOLE: LazyLock<[Vec<u8>; 6]> = LazyLock::new(files::whole);

#[test]
fn whole_files_are_read() {
    for (kind, file) in WHOLE.iter().enumerate() {
        assert_eq!(files::read(kind, file.clone()), !file.is_empty(), "{kind}");
    }
}

fn damage() -> impl Strategy<Value = Damage> {
    let flips = prop::collection::vec(any::<(u16, u8)>(), 0..6);
    let insert = (any::<u16>(), prop::collection::vec(any::<u8>(), 0..6));
    let end = prop::option::weighted(0.3, any::<u16>());
    (flips, insert, end).prop_map(|(flips, insert, end)| Damage { flips, insert, end })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, cases: 2000, ..ProptestConfig::default() })]

    #[test]
    fn damaged_files_are_errors_or_logs(kind in 0..5usize, damage in damage()) {
        let mut file = WHOLE[kind].clone();
        damage.hit(&mut file);
        files::read(kind, file);
    }
}
