//! Matchers: what they find, what they refuse, and what a match costs.

mod algebra;
#[path = "../common/mod.rs"]
mod common;
mod converged;
mod correlative;
mod degenerate;
mod every_match;
mod exhaustive;
mod extremes;
mod field;
mod golden;
mod host_cost;
mod staged;
mod staged_search;
mod virtual_scan;
