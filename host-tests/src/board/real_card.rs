//! What the firmware of a real board takes: one row of the README's table.

use serde::{Deserialize, Serialize};

/// One row of the table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RealCard {
    /// What it is called.
    pub board: String,
    /// What runs.
    pub configuration: String,
    /// Bytes in flash, and how many there are.
    pub flash_bytes: u64,
    /// The same.
    pub flash_of: u64,
    /// Statics, and how much RAM there is (bytes).
    pub ram_bytes: u64,
    /// The same.
    pub ram_of: u64,
    /// Deepest stack, as emulated (bytes); interrupts come on top.
    pub stack_bytes: u64,
    /// From the byte that completes a revolution to its pose, as emulated: median, most.
    pub instructions: u64,
    /// The same.
    pub instructions_max: u64,
    /// Where that was.
    pub emulated: String,
    /// The core's clock.
    pub clock_mhz: u32,
    /// Share of the core's time at 10 revolutions a second (%).
    pub share_percent: f64,
    /// The longest match (ms).
    pub longest_ms: f64,
    /// Whether that is good enough.
    pub verdict: Verdict,
}

/// Whether a board is good enough.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Verdict {
    /// Half the core is left, and bytes never wait for more than a revolution.
    Yes,
    /// It goes, with nothing else beside it.
    Marginal,
    /// The core, the memory or the ring does not suffice.
    No,
}

impl Verdict {
    /// As a word.
    #[must_use]
    pub fn word(self) -> &'static str {
        match self {
            Self::Yes => "yes",
            Self::Marginal => "marginal",
            Self::No => "no",
        }
    }
}

impl RealCard {
    /// A row of the README's table.
    #[must_use]
    pub fn markdown(&self) -> String {
        format!(
            "| {} | {} MHz | {} of {} | {:.1} of {} | {} | {} | {:.1} % | {:.1} ms | {} |",
            self.board,
            self.clock_mhz,
            self.flash_bytes >> 10,
            self.flash_of >> 10,
            self.ram_bytes as f64 / 1024.0,
            self.ram_of >> 10,
            self.stack_bytes,
            self.instructions,
            self.share_percent,
            self.longest_ms,
            self.verdict.word()
        )
    }
}
