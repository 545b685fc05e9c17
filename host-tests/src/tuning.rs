//! The constants that decide what the matchers, the odometry and the localization believe: found in the library's source,
//! described by their doc comments, and tried with other values in a copy of the source.

mod constants;
mod copy;

pub use constants::{Constant, all, named};
pub use copy::Copy;

use std::{collections::BTreeMap, fmt::Write as _};

/// Rooms of `src/` whose constants are listed, each with what is judged there.
const ROOMS: &[(&str, &str)] = &[
    ("matching/icp/projective", "Projective ICP"),
    ("matching/icp/modular", "ICP with every stage a choice"),
    ("matching/field", "Newton on a likelihood field"),
    ("matching/correlative", "Correlative matcher"),
    ("matching", "What the matchers share"),
    ("odometry", "Odometry"),
    ("localization", "Localization"),
    ("sensor_model", "Sensor models"),
    ("slam", "Mapping with loops"),
];

/// The page `docs/constants.md`: a table for each room.
#[must_use]
pub fn page(constants: &[Constant]) -> String {
    let mut page = String::from(
        "# The constants that decide\n\n\
         What a matcher believes is a matter of a few numbers. These are all that stand in `src/` with a name, by room; settings of the\n\
         public interface are in the documentation of their types. `beamfix tune NAME --from A --to B` prints what other values of one do\n\
         to accuracy and cost (`beamfix tune --help`). `beamfix tune --table` prints this page; a test compares the two.\n",
    );
    let mut rooms: BTreeMap<usize, Vec<&Constant>> = BTreeMap::new();
    for constant in constants {
        let inside = |room: &str| {
            constant.file.starts_with(&format!("{room}/")) || constant.file == format!("{room}.rs")
        };
        if let Some(k) = ROOMS.iter().position(|(room, _)| inside(room)) {
            rooms.entry(k).or_default().push(constant);
        }
    }
    for (k, constants) in rooms {
        let (room, title) = ROOMS[k];
        let _ = write!(
            page,
            "\n## {title} (`{room}`)\n\n| constant | value | what it decides |\n|---|---|---|\n"
        );
        for constant in constants {
            let file = constant.file.trim_start_matches(room);
            let file = file.trim_start_matches('/');
            let place = if file == ".rs" { "" } else { file };
            let _ = writeln!(
                page,
                "| `{}` {place} | {} | {} |",
                constant.name,
                constant.text,
                constant.about.replace('|', "\\|")
            );
        }
    }
    page
}
