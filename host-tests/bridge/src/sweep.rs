//! Beams of a revolution as the array of a `LaserScan`.
//!
//! Bearings rise, as most of ROS's readers want them. A lidar that turns clockwise measures them from the last to the first:
//! the stamp is then the end of the revolution, when the array's first beam was measured, and the time from one beam to the
//! next is negative. The array is as long for every revolution, for readers keep the length of the first: as long as a turn at
//! the first revolution's distance from beam to beam, whatever was lost of it.

use beamfix_app::telemetry::Piece;

/// Bearings of a turn.
const TURN: i64 = 65_536;

/// A step so many times as long as the middle one is a gap: fewer beams are in no packet.
const GAP: i64 = 4;

/// What the beams of a revolution are sorted into.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Grid {
    /// Where a revolution begins (1/65 536 turn).
    start: u16,
    count: usize,
    is_clockwise: bool,
}

/// Bearings, ranges and the order of measurement of a revolution.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Bearing of the first range, from -π (rad).
    pub first: f32,
    /// From one bearing to the next (rad), positive.
    pub step: f32,
    /// Whether the last range was measured first.
    pub is_clockwise: bool,
    /// Ranges (m): infinite where nothing came back, NaN where nothing was measured.
    pub ranges: Vec<f32>,
}

/// Collects the beams of a revolution.
#[derive(Debug, Default)]
pub struct Sweep {
    /// Bearings and ranges (mm, 0 for none).
    beams: Vec<(u16, u16)>,
    /// Whether the revolution in progress was heard from its start.
    is_whole: bool,
    grid: Option<Grid>,
}

impl Sweep {
    /// Takes beams; where one of them begins a revolution, gives the one before, if it was heard from its start.
    pub fn push(&mut self, piece: &Piece) -> Option<Array> {
        let mut done = None;
        for (k, (bearing, mm)) in piece.beams().enumerate() {
            if piece.turn_start == Some(k as u8) {
                let beams = std::mem::take(&mut self.beams);
                if std::mem::replace(&mut self.is_whole, true) {
                    done = self.sorted(&beams);
                }
            }
            // Whoever sends beams without an end fills no memory.
            if self.is_whole && self.beams.len() < TURN as usize {
                self.beams.push((bearing.0, mm));
            }
        }
        done
    }

    /// Forgets the revolution in progress: the board has started again.
    pub fn interrupt(&mut self) {
        self.beams.clear();
        self.is_whole = false;
    }

    fn sorted(&mut self, beams: &[(u16, u16)]) -> Option<Array> {
        // The start of the second of two was lost.
        if steps(beams).sum::<i64>().abs() > TURN * 3 / 2 {
            return None;
        }
        let grid = match self.grid {
            Some(grid) => grid,
            None => *self.grid.insert(Grid::of(beams)?),
        };
        let mut ranges = vec![f32::NAN; grid.count];
        for &(bearing, mm) in beams {
            let range = match mm {
                0 => f32::INFINITY,
                mm => f32::from(mm) / 1000.0,
            };
            let kept = &mut ranges[grid.place(bearing)];
            // Of two in one place the nearer one.
            if kept.is_nan() || range < *kept {
                *kept = range;
            }
        }
        let step = std::f32::consts::TAU / grid.count as f32;
        let start = f32::from(grid.start as i16) / TURN as f32 * std::f32::consts::TAU;
        // A clockwise revolution ends one step above where it began.
        let first = if grid.is_clockwise {
            start + step
        } else {
            start
        };
        Some(Array {
            first: if first < std::f32::consts::PI {
                first
            } else {
                first - std::f32::consts::TAU
            },
            step,
            is_clockwise: grid.is_clockwise,
            ranges,
        })
    }
}

impl Grid {
    /// As the first revolution has it; `None` of fewer than three beams.
    fn of(beams: &[(u16, u16)]) -> Option<Self> {
        let [(start, _), _, _, ..] = beams else {
            return None;
        };
        let is_clockwise = steps(beams).sum::<i64>() < 0;
        let along = |step: i64| if is_clockwise { -step } else { step };
        let mut sorted: Vec<i64> = steps(beams).map(along).collect();
        sorted.sort_unstable();
        let longest = GAP * sorted[sorted.len() / 2].max(1);
        let usual = sorted.partition_point(|&step| step <= longest);
        let turned: i64 = sorted[..usual].iter().sum();
        // At most a beam for each bearing; rounded.
        let count = match turned {
            1.. => (TURN * usual as i64 + turned / 2) / turned,
            _ => beams.len() as i64,
        };
        Some(Self {
            start: *start,
            count: count.clamp(1, TURN) as usize,
            is_clockwise,
        })
    }

    /// Index of a bearing in the array.
    fn place(&self, bearing: u16) -> usize {
        let along = if self.is_clockwise {
            self.start.wrapping_sub(bearing)
        } else {
            bearing.wrapping_sub(self.start)
        };
        let count = self.count as i64;
        let slot = (i64::from(along) * count + TURN / 2) / TURN % count;
        let index = if self.is_clockwise {
            count - 1 - slot
        } else {
            slot
        };
        index as usize
    }
}

/// From each bearing to the next, the shorter way (1/65 536 turn).
fn steps(beams: &[(u16, u16)]) -> impl Iterator<Item = i64> + '_ {
    beams.windows(2).map(|pair| match pair {
        [(one, _), (next, _)] => i64::from(next.wrapping_sub(*one) as i16),
        _ => 0,
    })
}

#[cfg(test)]
mod tests {
    use std::f32::consts::{PI, TAU};

    use super::*;

    /// Revolutions of four beams; each begins a quarter of a step after the bearing `start` (turns).
    fn revolutions(start: f32, clockwise: bool, ranges_mm: &[[u16; 4]]) -> Vec<Array> {
        let mut sweep = Sweep::default();
        let quarter = if clockwise { -16_384 } else { 16_384i32 };
        let mut arrays = Vec::new();
        // One more, whose start ends the last.
        for mm in ranges_mm.iter().chain([&[1; 4]]) {
            for (k, &mm) in (0..).zip(mm) {
                let bearing = ((start * 65_536.0) as i32 + quarter * k) as u16;
                let piece = Piece {
                    turn_start: (k == 0).then_some(0),
                    first: bearing,
                    last: bearing,
                    ranges_mm: [mm].into_iter().collect(),
                };
                arrays.extend(sweep.push(&piece));
            }
        }
        arrays
    }

    fn at(array: &Array, k: usize) -> f32 {
        array.first + array.step * k as f32
    }

    #[test]
    fn a_clockwise_lidar_fills_the_array_from_its_end() {
        // Forward, right, behind, left.
        let array = &revolutions(0.0, true, &[[1000, 2000, 3000, 4000]])[0];
        assert_eq!(array.ranges, [4.0, 3.0, 2.0, 1.0]);
        assert!(array.is_clockwise);
        // Left, behind, right, forward.
        for (k, bearing) in [0.25, 0.5, 0.75, 1.0].into_iter().enumerate() {
            assert!((at(array, k) - bearing * TAU).abs() < 1e-6, "{array:?}");
        }
    }

    #[test]
    fn a_counter_clockwise_lidar_fills_it_from_its_start() {
        let array = &revolutions(0.5, false, &[[1000, 2000, 3000, 4000]])[0];
        assert_eq!(array.ranges, [1.0, 2.0, 3.0, 4.0]);
        assert!(!array.is_clockwise);
        assert!((array.first + PI).abs() < 1e-6 && (array.step - TAU / 4.0).abs() < 1e-6);
    }

    #[test]
    fn no_return_is_infinite_and_no_beam_is_not_a_number() {
        let mut sweep = Sweep::default();
        let mut arrays = Vec::new();
        // Of the second revolution one beam is lost on the way, and two come for the third place.
        let revolutions: [&[(i32, u16)]; 3] = [
            &[(0, 1000), (1, 0), (2, 3000), (3, 4000)],
            &[(0, 1000), (2, 3000), (2, 2500), (3, 0)],
            &[(0, 1)],
        ];
        for beams in revolutions {
            for (n, &(k, mm)) in beams.iter().enumerate() {
                let bearing = (-16_384 * k) as u16;
                let piece = Piece {
                    turn_start: (n == 0).then_some(0),
                    first: bearing,
                    last: bearing,
                    ranges_mm: [mm].into_iter().collect(),
                };
                arrays.extend(sweep.push(&piece));
            }
        }
        let [one, two] = &arrays[..] else {
            panic!("{arrays:?}");
        };
        assert_eq!(one.ranges, [4.0, 3.0, f32::INFINITY, 1.0]);
        assert_eq!(two.ranges[..2], [f32::INFINITY, 2.5]);
        assert!(two.ranges[2].is_nan());
        assert_eq!(two.ranges[3], 1.0);
    }

    #[test]
    fn a_revolution_that_was_not_heard_from_its_start_is_left_out() {
        let mut sweep = Sweep::default();
        let piece = |turn_start, first: u16, step: u16| Piece {
            turn_start,
            first,
            last: first.wrapping_add(11 * step),
            ranges_mm: [1000; 12].into_iter().collect(),
        };
        // A third of a turn each.
        let step = 1820;
        assert_eq!(sweep.push(&piece(None, 0, step)), None);
        assert_eq!(sweep.push(&piece(Some(3), 12 * step, step)), None);
        assert_eq!(sweep.push(&piece(None, 24 * step, step)), None);
        assert_eq!(sweep.push(&piece(None, 0, step)), None);
        // Nine beams, two pieces and four beams of this one.
        let array = sweep.push(&piece(Some(4), 12 * step, step));
        assert_eq!(array.expect("a revolution").ranges.len(), 36);
    }

    /// Revolutions of 30 pieces of 12 beams, 1 m away, of which these are lost.
    fn without(lost: &[usize], clockwise: bool) -> Vec<Array> {
        let mut sweep = Sweep::default();
        let mut arrays = Vec::new();
        for k in (0..30 * 4 + 1).filter(|k| !lost.contains(k)) {
            let at = |beam: usize| {
                let along = (beam * 65_536 / 360) as u16;
                if clockwise {
                    along.wrapping_neg()
                } else {
                    along
                }
            };
            arrays.extend(sweep.push(&Piece {
                turn_start: k.is_multiple_of(30).then_some(0),
                first: at(12 * k),
                last: at(12 * k + 11),
                ranges_mm: [1000; 12].into_iter().collect(),
            }));
        }
        arrays
    }

    #[test]
    fn pieces_lost_of_the_first_revolution_do_not_shorten_the_array() {
        for clockwise in [true, false] {
            let arrays = without(&[3, 4, 17], clockwise);
            assert_eq!(arrays.len(), 4);
            for (array, missing) in arrays.iter().zip([36, 0, 0, 0]) {
                assert_eq!(array.ranges.len(), 360);
                let unmeasured = array.ranges.iter().filter(|range| range.is_nan());
                assert_eq!(unmeasured.count(), missing, "{clockwise}");
            }
        }
    }

    #[test]
    fn two_revolutions_without_a_start_between_them_are_no_array() {
        // The second revolution's start is lost.
        let arrays = without(&[30], true);
        assert_eq!(arrays.len(), 2);
        assert!(arrays.iter().all(|array| array.ranges.len() == 360));
        assert!(
            arrays
                .iter()
                .all(|array| array.ranges.iter().all(|range| !range.is_nan()))
        );
    }

    #[test]
    fn a_beam_a_little_before_the_start_stays_at_the_seam() {
        let grid = Grid {
            start: 10,
            count: 360,
            is_clockwise: true,
        };
        assert_eq!(grid.place(10), 359);
        // A step is 182; clockwise is downwards.
        assert_eq!(grid.place(15), 359);
        assert_eq!(grid.place(5), 359);
        assert_eq!(grid.place(10u16.wrapping_sub(182)), 358);
        assert_eq!(grid.place(10 + 182), 0);
    }
}
