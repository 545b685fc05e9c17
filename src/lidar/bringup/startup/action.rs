//! What a start-up asks its caller to do.

use super::config::StartError;
use crate::lidar::wire::request::Request;

/// What to do next.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Action {
    /// Send these bytes.
    Send(Request),
    /// Set the UART to so many bits a second, once all that was to be sent has left it.
    SetBaud(u32),
    /// Switch the motor on, where the host does that.
    MotorOn,
    /// Nothing; ask again soon.
    Wait,
    /// Measurements come, or will.
    Ready(Mode),
    /// It does not work.
    Failed(StartError),
}

/// How the sensor was started.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Mode {
    /// Type of the answers that stream in, by which the parser is chosen (`0x81` standard scan, `0x82` express, `0x84`
    /// ultra, `0x85` dense, `0x86` ultra-dense); 0 for sensors with one kind.
    pub answer: u8,
    /// Time from one measurement to the next (µs, Q8), where the sensor told.
    pub period_q8: Option<u32>,
}
