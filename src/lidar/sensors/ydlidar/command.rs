//! Commands of YDLIDAR sensors, and COIN-D4's.
//!
//! Source: development manuals; the maker's SDK. Each goes behind `0xA5`, as
//! [`request`](super::super::rplidar::command::request) writes it, and is answered as there.

/// Starts the scan.
pub const SCAN: u8 = 0x60;
/// Starts it whatever the motor does.
pub const FORCE_SCAN: u8 = 0x61;
/// Ends it.
pub const STOP: u8 = 0x65;
/// Restarts the sensor.
pub const RESET: u8 = 0x80;
/// Asks for model, firmware, serial number.
pub const GET_INFO: u8 = 0x90;
/// Asks for the health, by the manuals.
pub const GET_HEALTH: u8 = 0x91;
/// Asks for the health, by the maker's software.
pub const GET_HEALTH_TOO: u8 = 0x92;
/// A tenth of a revolution a second faster.
pub const FASTER: u8 = 0x09;
/// A tenth of a revolution a second slower.
pub const SLOWER: u8 = 0x0a;
/// A revolution a second faster.
pub const MUCH_FASTER: u8 = 0x0b;
/// A revolution a second slower.
pub const MUCH_SLOWER: u8 = 0x0c;
/// Asks for the speed.
pub const GET_SPEED: u8 = 0x0d;
/// Asks for the angle of the unit's own zero: G1, G2, R2, TG. One source for the command: the maker's driver.
pub const GET_ZERO_ANGLE: u8 = 0x93;

/// Starts a COIN-D4's motor and stream.
pub const COIN_D4_START: [u8; 4] = [0xaa, 0x55, 0xf0, 0x0f];
/// Stops them.
pub const COIN_D4_STOP: [u8; 4] = [0xaa, 0x55, 0xf5, 0x0a];
/// First bytes of a COIN-D4's answer to who it is.
pub(crate) const COIN_D4_ANSWER: [u8; 5] = [0xa5, 0x5a, 0x14, 0x00, 0xe3];
