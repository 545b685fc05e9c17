//! Stamps that step back or repeat, made into a clock that runs forward.

/// Turns a log's stamps (s) into the driver's clock (µs, wrapping).
///
/// The order of the lines is the order in time; where a stamp does not follow the one before it, the last good
/// step is taken once more.
#[derive(Debug, Clone)]
pub struct Clock {
    last: Option<f64>,
    step: f64,
    now: f64,
}

impl Clock {
    /// At zero, with a tenth of a second for the first step.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            last: None,
            step: 0.1,
            now: 0.0,
        }
    }

    /// The time of a scan with this stamp (s).
    pub fn at(&mut self, stamp: f64) -> u32 {
        if let Some(last) = self.last {
            let step = stamp - last;
            if step > 0.0 {
                self.step = step;
            }
            self.now += self.step;
        }
        self.last = Some(stamp);
        (self.now * 1e6 + 0.5) as u64 as u32
    }
}

impl Default for Clock {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_runs_forward() {
        let mut clock = Clock::new();
        let times = [5.0, 5.2, 5.1, 5.3, 5.3].map(|stamp| clock.at(stamp));
        let steps: Vec<u32> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
        for (step, expected) in steps.iter().zip([200_000, 200_000, 200_000, 200_000]) {
            assert!(step.abs_diff(expected) <= 1, "{steps:?}");
        }
    }
}
