//! One number for a whole run: equal only where every bit of every pose is.

use beamfix::geometry::Pose;

/// FNV-1a, 64 bits, over the little-endian bits of `x`, `y`, `theta` (f32) of every pose in order.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PoseHash(u64);

impl PoseHash {
    /// Of no pose.
    #[must_use]
    pub const fn new() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }

    /// Takes the next pose in.
    pub fn push(&mut self, pose: Pose) {
        for byte in [pose.x, pose.y, pose.theta]
            .into_iter()
            .flat_map(f32::to_le_bytes)
        {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
        }
    }
}

impl Default for PoseHash {
    fn default() -> Self {
        Self::new()
    }
}

impl std::fmt::Display for PoseHash {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:016x}", self.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeros_hash_to_the_published_value() {
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
