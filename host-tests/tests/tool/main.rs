//! The command-line tool as scripts call it.

mod cli;
#[path = "../common/mod.rs"]
mod common;
mod damaged;
mod fields;
#[cfg(all(feature = "foxglove", unix))]
mod foxglove;
mod leave;
mod live;
mod places;
mod recordings;
mod regress;
mod scenes;
mod tuning;
mod watch;
mod worlds;
