//! The README's figures are those that commands print and sources have.

use beamfix::lidar::parsers::Ldrobot;
use beamfix::matching::icp::{IcpConfig, Search};
use beamfix::odometry::Odometry;
use beamfix::pipeline::Pipeline;
use host_tests::board::{card::Card, real_card::RealCard};
use host_tests::formats::pairs::{self, Pairs};
use host_tests::matcher::Matcher;
use host_tests::report::score::{self, Score, mean};
use host_tests::{shared, size, sized};

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

const README: &str = include_str!("../../../README.md");

fn has(text: &str) {
    // Lines are broken anywhere.
    let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        words(README).contains(&words(text)),
        "README.md does not say: {text}"
    );
}

/// Whether a source still says what the README takes from it.
fn says(source: &str, line: &str) {
    assert!(source.contains(line), "no longer there: {line}");
}

#[test]
fn releases_and_sizes_are_those_of_the_manifest_and_the_compiler() {
    let manifest = include_str!("../../../Cargo.toml");
    says(manifest, "rust-version = \"1.88\"");
    has("Rust 1.88 or newer");
    says(manifest, "embedded-io = { version = \"0.7\"");
    says(manifest, "embedded-io-async = { version = \"0.7\"");
    says(manifest, "embedded-hal-nb = { version = \"1\"");
    has("`embedded-io` 0.7 (blocking), `embedded-io-async` 0.7, `embedded-hal-nb` 1.");
    type Robot = Pipeline<Ldrobot, Odometry<456>, 456>;
    let kilobytes = (size_of::<Robot>() as f64 / 1024.0).round();
    has(&format!(
        "type Robot = Pipeline<Ldrobot, Odometry<456>, 456>; // give it a place in a static: {kilobytes} KB"
    ));
}

#[test]
fn assumptions_are_those_that_the_cards_are_reckoned_with() {
    let real = include_str!("../../src/board/real.rs");
    says(real, "const CORTEX_M4: f64 = 1.25;");
    says(real, "const CORTEX_M0: f64 = 1.5;");
    has(
        "takes 1.25 of them for each on a Cortex-M4F, a Cortex-M33 and an RV32, 1.5 on a Cortex-M0+",
    );
    says(real, "const RATE: f64 = 10.0;");
    says(real, "const BYTE: f64 = 600.0;");
    says(real, "const BYTE_BY_AWAIT: f64 = 1250.0;");
    has(
        "for 10 revolutions a second and includes 600 instructions for each byte received, with embassy 1250",
    );
    says(include_str!("../../src/board/card.rs"), "seconds: 20.0,");
    has("over a simulated drive of 20 s");
    says(
        include_str!("../common/figures.rs"),
        "const ALLOWED: f64 = 1.02;",
    );
    has("a rise by more than 2 % fails the tests");
    let slam = include_str!("../../src/board/slam.rs");
    says(slam, "ram_bytes: 64 << 10,");
    says(slam, "ram_bytes: 192 << 10,");
    says(slam, "ram_bytes: 512 << 10,");
    has("an emulated core with 64, 192 or 512 KB of RAM");
    assert_eq!(beamfix_sim::place::NAMES.len(), 9);
    has("`simulate --world maze` drives elsewhere (nine places,");
}

#[test]
fn the_buffer_of_a_uart_is_that_of_the_longest_match() {
    let boards: Vec<RealCard> =
        serde_json::from_str(include_str!("../../golden/boards.json")).expect("a list of cards");
    // Ten bits a byte.
    let rate = beamfix_app::LIDAR_BAUD / 10;
    let during = |name: &str| {
        let board = boards.iter().find(|board| board.board == name);
        let ms = board.expect("a card").longest_ms;
        // As the table has it.
        (ms * 10.0).round() / 10.0 * 1e-3 * f64::from(rate)
    };
    has(&format!(
        "its {rate} bytes a second (LD06, 230 400 baud) over the longest match below are {:.0} bytes on a Pico, {:.0} on a \
         NUCLEO-F446",
        during("pico"),
        during("nucleo-f446")
    ));
    says(include_str!("../../../boards/rp/src/lib.rs"), "Ring<4096>");
    has("`boards/` have rings of 4096 bytes");
}

/// Figures of the README's text, in order, and which test holds each down. Rows of tables and code have tests of their own here, in
/// `tiers` and in `maps::slam::recorded`.
const FIGURES: [(&str, &str); 14] = [
    ("2", "a kit's name: Pico 2"),
    (
        "1.0 0.7 0.7 1",
        "releases_and_sizes_are_those_of_the_manifest_and_the_compiler",
    ),
    (
        "23040 230 400 968 267 4096",
        "the_buffer_of_a_uart_is_that_of_the_longest_match",
    ),
    (
        "20 2",
        "assumptions_are_those_that_the_cards_are_reckoned_with",
    ),
    (
        "1.25 1.5 10 600 1250",
        "assumptions_are_those_that_the_cards_are_reckoned_with",
    ),
    ("1024", "a unit"),
    ("64k", "an option"),
    ("2009", "a year"),
    ("64k", "an option"),
    (
        "5 5° 10 15° 20 30° 40 45° 5 1°",
        "the_table_of_accuracy_is_of_these_guesses",
    ),
    ("2026", "a year"),
    ("2", "a name: ROS 2"),
    (
        "0",
        "tool::recordings::a_replay_without_a_pose_is_no_success_and_marks_its_guesses",
    ),
    ("6x4", "an option"),
];

#[test]
fn no_figure_of_the_text_is_without_a_test() {
    let mut is_code = false;
    let text = README.lines().filter(|line| {
        let is_fence = line.starts_with("```");
        is_code ^= is_fence;
        !(is_code || is_fence || line.starts_with('|') || line.starts_with("<!--"))
    });
    let found: Vec<&str> = text
        .flat_map(|line| line.split(|c: char| c.is_whitespace() || "/()[],;`:".contains(c)))
        .map(|word| word.trim_matches(['.', '±']))
        .filter(|word| word.starts_with(|c: char| c.is_ascii_digit()))
        .collect();
    let known: Vec<&str> = FIGURES
        .iter()
        .flat_map(|(figures, _)| figures.split(' '))
        .collect();
    assert_eq!(
        found, known,
        "a figure wants a test, and a place in FIGURES"
    );
    let own = include_str!("readme.rs");
    for (_, test) in FIGURES {
        assert!(
            test.contains([' ', ':']) || own.contains(&format!("fn {test}(")),
            "{test}"
        );
    }
}

/// The traits that a HAL's UART has, by the lock file of a firmware with it.
fn traits_of(lock: &str, hal: &str) -> (String, [Vec<String>; 3]) {
    let package = |name: &str| {
        let head = format!("name = \"{name}\"\n");
        let packages = lock.split("[[package]]").filter(move |p| p.contains(&head));
        packages.map(str::to_owned).collect::<Vec<_>>()
    };
    let release = |package: &str| {
        let version = package.split("version = \"").nth(1).expect("a version");
        let mut parts = version.split(['.', '"']);
        let [major, minor] = [(); 2].map(|()| parts.next().expect("a number"));
        format!("{major}.{minor}")
    };
    let [own] = &package(hal)[..] else {
        panic!("one {hal}");
    };
    let needs = |name: &str| {
        let all = package(name);
        let mut found: Vec<String> = all
            .iter()
            .filter(|one| {
                let version = one.split("version = \"").nth(1).unwrap_or_default();
                let version = version.split('"').next().unwrap_or_default();
                own.contains(&format!("\"{name} {version}\""))
                    || own.contains(&format!("\"{name}\""))
            })
            .map(|one| release(one))
            .collect();
        found.sort();
        found
    };
    (
        release(own),
        ["embedded-io", "embedded-io-async", "embedded-hal-nb"].map(needs),
    )
}

#[test]
fn hals_have_the_traits_that_the_table_says() {
    let locks = [
        (
            "rp2040-hal",
            include_str!("../../../boards/pico/Cargo.lock"),
        ),
        (
            "rp235x-hal",
            include_str!("../../../boards/pico2/Cargo.lock"),
        ),
        (
            "embassy-rp",
            include_str!("../../../boards/pico-embassy/Cargo.lock"),
        ),
        (
            "embassy-nrf",
            include_str!("../../../boards/nrf52840-dk/Cargo.lock"),
        ),
        (
            "esp-hal",
            include_str!("../../../boards/esp32-c3/Cargo.lock"),
        ),
        (
            "stm32f4xx-hal",
            include_str!("../../../boards/nucleo-f446/Cargo.lock"),
        ),
    ];
    for (hal, lock) in locks {
        let (version, traits) = traits_of(lock, hal);
        let name = format!("{hal} {version}");
        let row = README
            .lines()
            .find(|line| line.starts_with('|') && line.contains(&name));
        let row = row.unwrap_or_else(|| panic!("README.md has no row of {name}"));
        let cells: Vec<&str> = row.split('|').skip(2).take(3).collect();
        let names = ["embedded-io", "embedded-io-async", "embedded-hal-nb"];
        for ((cell, name), releases) in cells.iter().zip(names).zip(&traits) {
            let wanted = match releases.is_empty() {
                true => String::new(),
                false => format!("`{name}` {}", releases.join(" and ")),
            };
            let told = cell.trim().split(':').next().unwrap_or_default();
            assert_eq!(told, wanted, "{hal}: {row}");
        }
    }
}

#[test]
fn tiers_hold_what_the_table_says() {
    let rolling = include_str!("../../../src/pipeline/rolling.rs");
    says(rolling, "pub type Mapper64k = RollingMapper<512, 36, ");
    has("`Mapper64k`: a map that rolls with the robot, 36 keyframes");
    let mapper = include_str!("../../../src/pipeline/mapper.rs");
    says(mapper, "pub type Mapper192k = Mapper<720, 224, ");
    has("`Mapper192k`: loops closed, 224 keyframes");
    says(mapper, "pub type Mapper512k = Mapper<1024, 560, ");
    has("`Mapper512k`: 560 keyframes");
    let cards: Vec<Card> =
        serde_json::from_str(include_str!("../../golden/card.json")).expect("a list of cards");
    let small = cards
        .iter()
        .find(|card| card.board == "m0")
        .expect("a card");
    has(&format!(
        "| 16 KB | odometry (`Odometry<{}>` on an M0) | {} + {} |",
        beamfix_app::SMALL_BEAMS,
        small.ram_bytes,
        small.stack_bytes
    ));
}

/// Of each hundred, to a tenth; all of them without.
fn percent(part: usize, of: usize) -> String {
    match 100.0 * part as f64 / of as f64 {
        100.0 => "100".to_owned(),
        share => format!("{share:.1}"),
    }
}

/// The disturbed guesses of a list.
fn scored<const N: usize>(list: &Pairs, config: &IcpConfig) -> Score {
    let mut matcher = Matcher::<N>::new();
    let mut score = Score::default();
    for pair in list.pairs.iter().filter(|pair| pair.level > 0) {
        let found = matcher.run(list, pair, config, |_| ());
        let pose = found.as_ref().map_or(pair.guess, |found| found.pose);
        score.push(pair.level, pose, pair.truth, found.is_ok());
    }
    score
}

/// By how much (cm, degrees) the guesses of the levels from 1 on are off at most, in each direction.
const DISTURBED: [(f64, f64); 4] = [(5.0, 5.0), (10.0, 15.0), (20.0, 30.0), (40.0, 45.0)];

/// The largest disturbance of a level in a direction (m) and of the heading (degrees).
fn most_disturbed(list: &Pairs, level: i32) -> (f64, f64) {
    let mut most: (f64, f64) = (0.0, 0.0);
    for pair in list.pairs.iter().filter(|pair| pair.level == level) {
        let (_, degrees) = score::error(pair.guess, pair.truth);
        let off = [pair.guess.x - pair.truth.x, pair.guess.y - pair.truth.y];
        most.0 = off
            .iter()
            .fold(most.0, |most, off| most.max(f64::from(off.abs())));
        most.1 = most.1.max(degrees);
    }
    most
}

#[test]
fn the_table_of_accuracy_is_of_these_guesses() {
    let levels: Vec<String> = DISTURBED
        .iter()
        .map(|(cm, degrees)| format!("{cm} cm and {degrees}°"))
        .collect();
    has(&format!(
        "off by up to {}",
        levels.join(" / ").replacen(" /", " in each direction /", 1)
    ));
    assert!(score::is_right((0.0499, 0.999)));
    assert!(!score::is_right((0.05, 0.0)) && !score::is_right((0.0, 1.0)));
    has("How many matches (%) are right within 5 cm and 1°");
}

#[test]
fn the_table_of_accuracy_is_what_the_lists_give() {
    // As the command `pairs` has it.
    let config = IcpConfig {
        search: Search::Local,
        ..IcpConfig::DEFAULT
    };
    let mut row = "| beamfix |".to_owned();
    let mut error = String::new();
    for (scans, list) in [
        ("intel", "intel_cons"),
        ("fr079", "fr079_cons"),
        ("sim", "sim_consec"),
    ] {
        let (Some(scans), Some(list)) = (
            shared::file(&format!("pairs/host/scans_{scans}.txt.gz")),
            shared::file(&format!("pairs/host/pairs_{list}.csv.gz")),
        ) else {
            return;
        };
        let list = pairs::read(&scans, &list).expect("a list of pairs");
        for (level, (cm, degrees)) in (1..).zip(DISTURBED) {
            let most = most_disturbed(&list, level);
            assert!(
                (0.95..=1.001).contains(&(100.0 * most.0 / cm))
                    && (0.95..=1.001).contains(&(most.1 / degrees)),
                "level {level}: {most:?}"
            );
        }
        let size = size::fitting(list.scans.iter().map(|scan| &scan[..]));
        let score = sized!(size, scored(&list, &config));
        let levels = score.0.values();
        let right: Vec<String> = levels.map(|of| percent(of.right, of.pairs)).collect();
        row += &format!(" {} |", right.join(" / "));
        let first = &score.0[&1];
        let (mm, degrees) = (1e3 * mean(&first.metres), mean(&first.degrees));
        error = format!(" {mm:.1} mm, {degrees:.3}° |");
    }
    has(&(row + &error));
    // The others' figures, as they were measured.
    let Some(peers) = shared::file("PEERS.md") else {
        return;
    };
    let peers = std::fs::read_to_string(peers)
        .expect("text")
        .replace(" deg", "°");
    let rows = ["CSM, point to line", "Karto,", "Hector,"];
    for row in README.lines().filter(|line| {
        rows.iter()
            .any(|name| line.starts_with(&format!("| {name}")))
    }) {
        for cell in row.split('|').skip(2).map(str::trim) {
            assert!(peers.contains(cell), "{cell}: {row}");
        }
    }
}
