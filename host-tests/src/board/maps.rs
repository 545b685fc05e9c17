//! What everything that matches against maps takes on the emulated boards.

use anyhow::Result;
use serde::{Deserialize, Serialize};

use super::{Board, card::keep, fields, fields::Costs, start, start::StartCosts};

/// The board that starts without a pose are measured on: the map and the search are too large for the smaller ones.
const STARTS_ON: &str = "m4f";

/// The figures.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Card {
    /// Scan against field, each board.
    pub fields: Vec<Costs>,
    /// Finding oneself.
    pub starts: Vec<StartCosts>,
}

/// Measures on these boards.
pub fn measure(boards: &[&Board]) -> Result<Card> {
    let mut card = Card {
        fields: Vec::new(),
        starts: Vec::new(),
    };
    for board in boards {
        card.fields.push(fields::measure(board)?);
        if board.name == STARTS_ON {
            card.starts.push(start::measure(board)?);
        }
    }
    Ok(card)
}

impl Card {
    /// For people.
    #[must_use]
    pub fn table(&self) -> String {
        let mut text = String::from(
            "board  scan and field, instructions: score a beam  Newton a beam and pass  byte looked up  correlative, all  stack B",
        );
        for costs in &self.fields {
            text += &format!(
                "\n{:<5} {:>44.1} {:>23.1} {:>15.2} {:>17} {:>8}",
                costs.board,
                costs.score_per_beam,
                costs.newton_per_beam,
                costs.inner_per_lookup,
                costs.search,
                costs.stack_bytes
            );
        }
        for costs in &self.starts {
            text += &format!(
                "\n\n{}: finding oneself in a flat of 20 m by 16 m: {:.1} M instructions and {} scans, {:.1} M at most in a step of {} \
                 bytes; field {} B of flash, localizer {} B of RAM",
                costs.board,
                f64::from(costs.instructions) / 1e6,
                costs.scans,
                f64::from(costs.step_instructions) / 1e6,
                costs.step_budget,
                costs.field_bytes,
                costs.ram_bytes
            );
            text += &format!(
                "\n{}: 16 particles, a scan that they are weighed with: {:.2} M instructions drawn from the wheels, {:.2} M from wheels \
                 and match; filter {} B of RAM",
                costs.board,
                f64::from(costs.by_motion) / 1e6,
                f64::from(costs.improved) / 1e6,
                costs.filter_bytes
            );
        }
        text
    }

    /// Every figure under a name.
    #[must_use]
    pub fn figures(&self) -> Vec<(String, f64)> {
        let mut figures = Vec::new();
        for costs in &self.fields {
            figures.extend(
                [
                    ("score", costs.score_per_beam.into()),
                    ("Newton", costs.newton_per_beam.into()),
                    ("byte looked up", costs.inner_per_lookup.into()),
                    ("correlative", costs.search.into()),
                    ("stack", costs.stack_bytes.into()),
                ]
                .map(|(what, value)| (format!("{}: {what}", costs.board), value)),
            );
        }
        for costs in &self.starts {
            figures.extend(
                [
                    ("start", costs.instructions),
                    ("step", costs.step_instructions),
                    ("field", costs.field_bytes),
                    ("localizer", costs.ram_bytes),
                    ("stack of a start", costs.stack_bytes),
                    ("particles by motion", costs.by_motion),
                    ("particles by match", costs.improved),
                    ("particle filter", costs.filter_bytes),
                ]
                .map(|(what, value)| (format!("{}: {what}", costs.board), value.into())),
            );
        }
        figures
    }

    /// Makes these the golden figures: `host-tests/golden/maps.json`.
    pub fn bless(&self) -> Result<()> {
        keep("maps.json", self)
    }
}
