//! Where the guess for each match comes from.

use clap::ValueEnum;

/// What `--prior` says.
#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub enum Prior {
    Odometry,
    None,
}
