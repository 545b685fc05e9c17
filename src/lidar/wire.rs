//! From bytes to beams, whatever the sensor: framing, parsers, packets, times.
//!
//! ```text
//! push(byte) ─▶ Framer ─▶ frame that passed its checks ─▶ Format or Layout ─▶ Packet ─▶ beams()
//! ```

pub(crate) mod angle;
pub(crate) mod answer;
pub(crate) mod counters;
pub mod framing;
#[cfg(any(
    feature = "embedded-io",
    feature = "embedded-io-async",
    feature = "embedded-hal-nb"
))]
pub mod io;
pub mod layout;
pub(crate) mod neato;
pub mod packet;
pub mod parser;
pub mod protocol;
pub mod request;
pub mod ring;
pub mod survey;
pub mod timing;
#[cfg(test)]
mod toy;
