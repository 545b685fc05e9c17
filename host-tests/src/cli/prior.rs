//! Where the guess for each match comes from.

use clap::ValueEnum;

/// What `--prior` says.
#[derive(Clone, Copy, PartialEq, ValueEnum)]
pub enum Prior {
    Odometry,
    None,
}

impl Prior {
    /// What the odometry gets of the wheels' poses.
    pub fn of<T>(self, wheels: Option<T>) -> Option<T> {
        wheels.filter(|_| self == Self::Odometry)
    }
}
