//! Figures must not rise unnoticed above those that are kept in `host-tests/golden/`.

/// A rise by more than this fails: 2 %.
const ALLOWED: f64 = 1.02;

/// What has risen.
#[derive(Debug, Default)]
pub struct Risen(Vec<String>);

impl Risen {
    /// Compares a figure with the one that is kept.
    pub fn compare(&mut self, name: &str, before: f64, now: f64) {
        if now > before * ALLOWED {
            self.0.push(format!("{name} was {before}, is {now}"));
        } else if now < before / ALLOWED {
            println!("{name} fell from {before} to {now}");
        }
    }

    /// Fails if any has; `command` is what keeps the new ones.
    pub fn expect_none(self, command: &str) {
        assert!(
            self.0.is_empty(),
            "{}\nIf it must be: cargo run --release -- {command} --bless, with the reason in the commit's message",
            self.0.join("\n")
        );
    }
}
