//! What mapping costs on the emulated Cortex-M4F with just the RAM of a tier is what the README's table says.

use host_tests::board::slam;
use host_tests::mapping::{Tier, building};

/// A figure may be off by so much of itself before the table is wrong: 2 %, as the cards.
const ALLOWED: f64 = 0.02;

/// Numbers of a cell: `47464 + 4244`, `1.15 M, 3.11 M, 1.49 M`.
fn numbers(cell: &str) -> Vec<f64> {
    let words = cell.split(|c: char| !c.is_ascii_digit() && c != '.');
    words.filter_map(|word| word.parse().ok()).collect()
}

#[test]
#[cfg_attr(
    debug_assertions,
    ignore = "once is enough: the boards' programs are always release builds"
)]
fn each_tier_takes_what_the_readme_says() {
    let readme = include_str!("../../../README.md");
    let (log, _) = building::log(2, 1);
    for (ram, tier) in [
        ("64 KB", Tier::Of64k),
        ("192 KB", Tier::Of192k),
        ("512 KB", Tier::Of512k),
    ] {
        let row = readme
            .lines()
            .find(|line| line.starts_with(&format!("| {ram} |")));
        let cells: Vec<&str> = row.expect("a row").split('|').collect();
        let told = [numbers(cells[3]), numbers(cells[4])].concat();
        let costs = slam::measure(tier, &log, usize::MAX)
            .unwrap_or_else(|error| panic!("{ram}: {error:#}"));
        println!("{}", costs.text(ram));
        let [update, slice] = costs.longest.map(|count| f64::from(count) / 1e6);
        let now = [
            costs.static_bytes as f64,
            f64::from(costs.stack_bytes),
            costs.mean / 1e6,
            update,
            slice,
        ];
        assert_eq!(told.len(), now.len(), "{row:?}");
        for (told, now) in told.iter().zip(now) {
            assert!(
                (now - told).abs() <= ALLOWED * told,
                "{ram}: README.md says {told}, it is {now}: cargo run --release -- card --tier"
            );
        }
    }
}
