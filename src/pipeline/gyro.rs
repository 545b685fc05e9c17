//! Change of heading between the ends of two revolutions by a gyroscope.

/// Longest time between two messages, and from the last one to a revolution's end (µs).
const MAX_GAP_US: i32 = 100_000;

/// The rate of turn, integrated from the last revolution's end on. 20 bytes.
#[derive(Debug)]
pub(super) struct Gyro {
    time_us: u32,
    /// Rate of turn at that time (rad/s); not a number before the first message.
    rate: f32,
    /// Change of heading from the last revolution's end to that time (rad); not a number where that is unknown.
    rotation: f32,
    /// When the last revolution ended (µs).
    end_us: u32,
}

impl Gyro {
    pub const fn new() -> Self {
        Self {
            time_us: 0,
            rate: f32::NAN,
            rotation: f32::NAN,
            end_us: 0,
        }
    }

    /// Takes a rate of turn (rad/s) at a time (µs), unless it is not finite.
    pub fn push(&mut self, time_us: u32, rate: f32) {
        if !rate.is_finite() {
            return;
        }
        // The mean of both rates over the time between them.
        self.rotation += match self.seconds_since_last(time_us) {
            Some(seconds) => 0.5 * (self.rate + rate) * seconds,
            None => f32::NAN,
        };
        (self.time_us, self.rate) = (time_us, rate);
    }

    /// Change of heading from the last revolution's end to this one's (µs), counter-clockwise (rad); `None` where
    /// messages are missing.
    pub fn rotation_until(&mut self, end_us: u32) -> Option<f32> {
        let stands = end_us == self.end_us;
        self.end_us = end_us;
        // A message of after the end has told of the next revolution already: that part is left for it.
        let late_us = end_us.wrapping_sub(self.time_us).cast_signed();
        let since = if (-MAX_GAP_US..=MAX_GAP_US).contains(&late_us) {
            self.rate * (late_us as f32 * 1e-6)
        } else {
            f32::NAN
        };
        let rotation = self.rotation + since;
        self.rotation = match since {
            known if known.is_finite() && late_us >= 0 => 0.0,
            since => -since,
        };
        if late_us > 0 {
            self.time_us = end_us;
        }
        (!stands && rotation.is_finite()).then_some(rotation)
    }

    /// Time from the last message to this one (s), unless it is too long or negative.
    fn seconds_since_last(&self, time_us: u32) -> Option<f32> {
        let passed_us = time_us.wrapping_sub(self.time_us).cast_signed();
        (0..=MAX_GAP_US)
            .contains(&passed_us)
            .then_some(passed_us as f32 * 1e-6)
    }
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
