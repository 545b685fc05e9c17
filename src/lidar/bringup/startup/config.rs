//! How long a start-up waits for what, and why it can fail.

use core::fmt;

use crate::lidar::sensors::rplidar::command::Health;

/// How long to wait for what.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StartConfig {
    /// Silence after a stop command (ms). Default 100, as the makers do.
    pub drain_ms: u32,
    /// For an answer (ms). Default 500.
    pub answer_ms: u32,
    /// Times that a request is sent. Default 3.
    pub tries: u8,
    /// After a restart (ms). Default 2000.
    pub reset_ms: u32,
    /// For the motor (ms). Default 1000.
    pub spin_up_ms: u32,
    /// Longest silence of a stream (ms). Default 5000: some sensors send nothing before they spin steadily.
    pub stall_ms: u32,
}

impl StartConfig {
    /// The defaults above.
    pub const DEFAULT: Self = Self {
        drain_ms: 100,
        answer_ms: 500,
        tries: 3,
        reset_ms: 2000,
        spin_up_ms: 1000,
        stall_ms: 5000,
    };
}

impl Default for StartConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Why a sensor does not start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum StartError {
    /// A request stayed without an answer, however often it was sent.
    NoAnswer {
        /// The request's command.
        request: u8,
    },
    /// The sensor reports an error, even after a restart.
    Unhealthy(Health),
    /// No measurements for so long (ms): the motor stands, or the line is broken.
    Stalled {
        /// How long (ms).
        silent_ms: u32,
    },
}

impl fmt::Display for StartError {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::NoAnswer { request } => write!(f, "no answer to request {request:#04x}"),
            Self::Unhealthy(health) => write!(
                f,
                "the sensor reports status {} and error code {:#06x}",
                health.status, health.code
            ),
            Self::Stalled { silent_ms } => write!(f, "no measurement for {silent_ms} ms"),
        }
    }
}

impl core::error::Error for StartError {}
