//! One number for a whole run: equal only where every bit of every pose is.

use core::fmt;

use beamfix::geometry::Pose;

/// FNV-1a, 64 bits, over bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Fnv1a(pub u64);

impl Fnv1a {
    /// Of no byte.
    pub const EMPTY: Self = Self(0xcbf2_9ce4_8422_2325);

    /// Takes the next bytes in.
    pub fn push(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}

/// [`Fnv1a`] over the little-endian bits of `x`, `y`, `theta` (f32) of every pose in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PoseHash(Fnv1a);

impl PoseHash {
    /// Of no pose.
    #[must_use]
    pub const fn new() -> Self {
        Self(Fnv1a::EMPTY)
    }

    /// Takes the next pose in.
    pub fn push(&mut self, pose: Pose) {
        for number in [pose.x, pose.y, pose.theta] {
            self.0.push(&number.to_le_bytes());
        }
    }

    /// The number.
    #[must_use]
    pub const fn value(self) -> u64 {
        self.0.0
    }
}

impl Default for PoseHash {
    fn default() -> Self {
        Self::new()
    }
}

impl fmt::Display for PoseHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:016x}", self.value())
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::{format, string::ToString as _};

    #[test]
    fn zeros_hash_to_the_published_value() {
        // From FNV's own list of test vectors.
        let mut hash = Fnv1a::EMPTY;
        hash.push(b"foobar");
        assert_eq!(hash.0, 0x8594_4171_f739_67e8);
        assert_eq!(PoseHash::new().to_string(), "cbf29ce484222325");
        let mut hash = PoseHash::new();
        hash.push(Pose::IDENTITY);
        // Twelve zero bytes only multiply: offset · prime^12.
        let expected = (0..12).fold(0xcbf2_9ce4_8422_2325u64, |h, _| {
            h.wrapping_mul(0x0100_0000_01b3)
        });
        assert_eq!(hash.to_string(), format!("{expected:016x}"));
    }
}
