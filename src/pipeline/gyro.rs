//! Change of heading between the ends of two revolutions by a gyroscope.

/// Longest time between two messages, and from the last one to a revolution's end (µs).
const MAX_GAP_US: i32 = 100_000;

/// The rate of turn, integrated from the last revolution's end on. 16 bytes.
#[derive(Debug)]
pub(super) struct Gyro {
    /// When the last message came in (µs).
    message_us: u32,
    /// Rate of turn by the last message (rad/s); not a number before the first one.
    rate: f32,
    /// Change of heading from the last revolution's end to the last message (rad); not a number where that is unknown.
    rotation: f32,
    /// When the last revolution ended (µs).
    end_us: u32,
}

impl Gyro {
    /// All bytes zero.
    pub const ZERO: Self = Self::of(0.0);

    pub const fn new() -> Self {
        Self::of(f32::NAN)
    }

    const fn of(rate: f32) -> Self {
        Self {
            message_us: 0,
            rate,
            rotation: rate,
            end_us: 0,
        }
    }

    /// Takes a rate of turn (rad/s) at a time (µs), unless it is not finite.
    pub fn push(&mut self, time_us: u32, rate: f32) {
        if !rate.is_finite() {
            return;
        }
        // The mean of both rates over the time between them.
        self.rotation += match after(self.message_us, time_us) {
            0..=MAX_GAP_US => 0.5 * (self.rate + rate) * self.seconds_until(time_us),
            _ => f32::NAN,
        };
        (self.message_us, self.rate) = (time_us, rate);
    }

    /// Change of heading from the last revolution's end to this one's (µs), counter-clockwise (rad); `None` where
    /// messages are missing.
    pub fn rotation_until(&mut self, end_us: u32) -> Option<f32> {
        let stands = end_us == self.end_us;
        let (since, next) = match after(self.message_us, end_us) {
            0..=MAX_GAP_US => (self.rate * self.seconds_until(end_us), 0.0),
            // A message of after the end has told of the next revolution already: that part is left for it.
            late_us if (-MAX_GAP_US..0).contains(&late_us) => {
                let rotation = self.rate * (late_us as f32 * 1e-6);
                (rotation, -rotation)
            }
            _ => (f32::NAN, f32::NAN),
        };
        let rotation = self.rotation + since;
        (self.rotation, self.end_us) = (next, end_us);
        (!stands && rotation.is_finite()).then_some(rotation)
    }

    /// Time from the last message, or from the last revolution's end if that was later, to a time (s); 0 for an earlier one.
    fn seconds_until(&self, time_us: u32) -> f32 {
        let since_message = after(self.message_us, time_us);
        let since_end = after(self.end_us, time_us);
        let since = if since_end < since_message {
            since_end
        } else {
            since_message
        };
        if since > 0 { since as f32 * 1e-6 } else { 0.0 }
    }
}

/// Time from `before` to `time` (µs), both wrapping.
fn after(before: u32, time: u32) -> i32 {
    time.wrapping_sub(before).cast_signed()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_is_integrated_from_end_to_end() {
        // Rates that grow by 1 rad/s in a second: their mean over a revolution times its 0.1 s.
        for every_us in [5_000, 10_000, 30_000, 90_000u32] {
            let mut gyro = Gyro::new();
            let (mut next_us, mut known) = (0, 0);
            for k in 1..40u32 {
                let end_us = 100_000 * k;
                while next_us <= end_us {
                    gyro.push(next_us, next_us as f32 * 1e-6);
                    next_us += every_us;
                }
                if let Some(rotation) = gyro.rotation_until(end_us) {
                    known += 1;
                    let wanted = 0.1 * (0.1 * k as f32 - 0.05);
                    // What the rate grows by within a gap is not seen at its end.
                    let allowed = 1e-6 * every_us as f32 * 0.1 + 1e-5;
                    assert!((rotation - wanted).abs() < allowed, "{k}: {rotation}");
                }
            }
            assert_eq!(known, 38, "{every_us}");
        }
    }

    #[test]
    fn over_a_gap_nothing_is_known_and_afterwards_all_is() {
        let mut gyro = Gyro::new();
        let told: heapless::Vec<bool, 16> = (1..12u32)
            .map(|k| {
                for j in 0..10 {
                    if !(4..6).contains(&k) {
                        gyro.push(100_000 * k + 10_000 * j - 90_000, 1.0);
                    }
                }
                gyro.push(100_000 * k, f32::NAN);
                gyro.rotation_until(100_000 * k).is_some()
            })
            .collect();
        let wanted = [
            false, true, true, true, false, false, true, true, true, true, true,
        ];
        assert_eq!(told, wanted);
        assert_eq!(gyro.rotation_until(1_100_000), None, "no time has passed");
    }
}
