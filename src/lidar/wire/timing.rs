//! When beams were measured: by the sensor's own clock, or by when their bytes arrived.

/// Times of the beams of a sensor without a clock.
///
/// The beams are taken to follow each other at the sensor's own pace; arrivals set the phase. A beam cannot be
/// measured after its bytes have arrived, while a busy processor can make them seem late: early arrivals are believed
/// at once, late ones to a 64th.
#[derive(Debug, Clone)]
pub struct Pace {
    /// Time of one byte on the line (µs/256).
    byte_q8: u32,
    /// When the next beam is due (µs).
    next_us: u32,
    fraction_q8: u32,
    arrival_us: Option<u32>,
    /// Whether an arrival has set the phase.
    is_set: bool,
}

impl Pace {
    /// Behind a line of `baud` bits per second; 0 is taken as 1200.
    #[must_use]
    pub const fn new(baud: u32) -> Self {
        let baud = if baud < 1200 { 1200 } else { baud };
        Self {
            byte_q8: 2_560_000_000 / baud,
            next_us: 0,
            fraction_q8: 0,
            arrival_us: None,
            is_set: false,
        }
    }

    /// Notes when the next bytes arrived (µs).
    pub fn arrived(&mut self, now_us: u32) {
        self.arrival_us = Some(now_us);
    }

    /// Time (µs) of the first of so many beams, `period_q8` (µs/256) apart, in a frame of so many bytes.
    pub fn first_us(&mut self, beams: u16, period_q8: u32, frame_bytes: u16) -> u32 {
        /// A beam this much later than expected comes after a gap (µs).
        const GAP: i32 = 30_000;

        let duration_q8 = period_q8
            .saturating_mul(beams.into())
            .saturating_add(self.fraction_q8);
        let mut first_us = self.next_us;
        if let Some(now_us) = self.arrival_us.take() {
            let on_line_us = (self.byte_q8 * u32::from(frame_bytes)) >> 8;
            let seen_us = now_us
                .wrapping_sub(on_line_us)
                .wrapping_sub(duration_q8 >> 8);
            let late = seen_us.wrapping_sub(first_us) as i32;
            first_us = if !self.is_set || !(0..=GAP).contains(&late) {
                seen_us
            } else {
                first_us.wrapping_add_signed(late >> 6)
            };
            self.is_set = true;
        }
        self.next_us = first_us.wrapping_add(duration_q8 >> 8);
        self.fraction_q8 = duration_q8 & 0xff;
        first_us
    }
}

/// Milliseconds of a sensor's clock without their wraps, and finer.
///
/// A stamp says which millisecond a frame's first beam was measured in, and the frames come at the steady pace of a
/// crystal: an alpha-beta filter (1/16, about 1/1365: critically damped) learns pace and phase. Times never go back.
#[derive(Debug, Clone)]
pub struct Stamps {
    wrap_ms: u16,
    beams: u8,
    /// Time from beam to beam (µs/256), as learnt.
    period_q8: u32,
    /// The same by the data sheet.
    nominal_q8: u32,
    stamp_ms: Option<u16>,
    /// Middle of the stamp's millisecond.
    stamp_us: u32,
    first_us: u32,
    fraction_q8: u32,
}

impl Stamps {
    /// Stamps of frames of so many beams, `period_q8` (µs/256) apart, that wrap at `wrap_ms`.
    #[must_use]
    pub const fn new(wrap_ms: u16, beams: u8, period_q8: u32) -> Self {
        // At most 10 ms, so that the sums below stay within 32 bits.
        let nominal_q8 = if period_q8 > 2_560_000 {
            2_560_000
        } else {
            period_q8
        };
        Self {
            wrap_ms,
            beams,
            period_q8: nominal_q8,
            nominal_q8,
            stamp_ms: None,
            stamp_us: 0,
            first_us: 0,
            fraction_q8: 0,
        }
    }

    /// Time from beam to beam (µs/256), as learnt from the stamps.
    #[must_use]
    pub fn period_q8(&self) -> u32 {
        self.period_q8
    }

    /// Whether a frame with this stamp can follow the last one, after a short gap at most.
    #[must_use]
    pub fn is_due(&self, stamp_ms: u16) -> bool {
        /// Dozens of frames (ms).
        const SHORT: u32 = 100;

        self.stamp_ms
            .is_none_or(|previous| self.elapsed_ms(previous, stamp_ms) <= SHORT)
    }

    fn elapsed_ms(&self, previous: u16, stamp_ms: u16) -> u32 {
        let wrap = if stamp_ms < previous { self.wrap_ms } else { 0 };
        (u32::from(stamp_ms) + u32::from(wrap)).saturating_sub(previous.into())
    }

    /// Time (µs) of the first beam of the frame that has this stamp.
    ///
    /// Of a gap longer than the stamps' wrap only the remainder is seen.
    pub fn first_us(&mut self, stamp_ms: u16) -> u32 {
        /// Stamp and pace differ by more only where frames are missing (µs).
        const GAP: i32 = 1500;

        let Some(previous) = self.stamp_ms.replace(stamp_ms) else {
            self.stamp_us = u32::from(stamp_ms) * 1000 + 500;
            self.first_us = self.stamp_us;
            return self.first_us;
        };
        let elapsed_ms = self.elapsed_ms(previous, stamp_ms);
        self.stamp_us = self.stamp_us.wrapping_add(elapsed_ms * 1000);

        let steady_q8 = self.fraction_q8 + u32::from(self.beams) * self.period_q8;
        self.fraction_q8 = steady_q8 & 0xff;
        let steady_us = self.first_us.wrapping_add(steady_q8 >> 8);
        let late = self.stamp_us.wrapping_sub(steady_us) as i32;
        if late > GAP {
            self.first_us = self.stamp_us;
            return self.first_us;
        }
        let late = late.max(-GAP);
        let quarter = self.nominal_q8 / 4;
        self.period_q8 = self
            .period_q8
            .saturating_add_signed(late >> 6)
            // Not `clamp`, which panics where its limits are the wrong way round.
            .max(self.nominal_q8 - quarter)
            .min(self.nominal_q8 + quarter);
        // Half a beam at most: the first beam of a frame stays behind the last of the one before.
        let back = -((self.period_q8 >> 9) as i32);
        self.first_us = steady_us.wrapping_add_signed((late >> 4).max(back));
        self.first_us
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamped_time_goes_on_over_wraps_and_through_gaps() {
        // Sensors that are faster and slower than their data sheet; ten frames are missing in the middle.
        for frame_us in [2666.67, 2600.0, 2410.0, 2800.0] {
            let mut stamps = Stamps::new(30_000, 12, 256_000_000 / 4500);
            let mut last = 0u32;
            for k in (0..2000u32).chain(2010..40_000) {
                let truth_us = 29_000_000 + (f64::from(k) * frame_us) as u32;
                let time = stamps.first_us((truth_us / 1000 % 30_000) as u16);
                let off = time.abs_diff(truth_us);
                let allowed = if k < 1500 { 20_000 } else { 800 };
                assert!(off < allowed, "{frame_us} {k}: {time} {truth_us}");
                let beams_us = 11 * stamps.period_q8() / 256;
                assert!(k == 0 || time > last + beams_us, "{frame_us} {k}");
                last = time;
            }
            // Without gaps the milliseconds average out.
            assert!(last.abs_diff(29_000_000 + (39_999.0 * frame_us) as u32) < 150);
        }
    }

    #[test]
    fn arrivals_set_the_phase_and_late_ones_hardly_move_it() {
        let mut pace = Pace::new(115_200);
        let period_q8 = 500 << 8;
        let (mut worst, start_us) = (0, 7_000_000u32);
        for k in 0..2000u32 {
            // Five bytes on the line take 434 µs; every third frame is picked up late.
            let measured_us = start_us.wrapping_add(500 * k);
            let busy_us = if k % 3 == 0 { 2000 } else { 40 };
            pace.arrived(measured_us + 500 + 434 + busy_us);
            let off = pace.first_us(1, period_q8, 5).abs_diff(measured_us);
            if k > 10 {
                worst = worst.max(off);
            }
        }
        assert!(worst < 100, "{worst}");
        // Without arrivals it goes on at the nominal pace.
        let next = pace.first_us(4, period_q8, 5);
        assert_eq!(pace.first_us(1, period_q8, 5), next + 2000);
    }
}
