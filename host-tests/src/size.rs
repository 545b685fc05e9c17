//! Memory configurations that are compiled into the tool: how many beams a revolution has room for.
//!
//! A reference keeps a line for each of N directions, so N is best what the lidar measures in a revolution.

use beamfix::lidar::Model;
use beamfix::scan::Beam;

/// Beams a revolution, smallest first.
pub const SIZES: [usize; 5] = [360, 456, 512, 720, 1024];

/// Most beams of a scan by a ring of rangers.
pub const SPARSE: usize = 64;

/// Scans of a ring of rangers that the next one is matched against.
pub const GATHERED: usize = 64;

/// Width of a beam (rad) where scans are those of a ring of rangers: few beams, and too far apart for neighbours to show
/// surfaces.
#[must_use]
pub fn beam_width<'a>(mut scans: impl Iterator<Item = &'a [Beam]>) -> Option<f32> {
    let mut finest = 0;
    let is_sparse = scans.all(|scan| {
        if scan.len() > 2 {
            finest = finest.max(per_revolution(scan));
        }
        scan.len() <= SPARSE
    });
    // 5.1° apart: a lidar that turns is finer.
    (is_sparse && (16..=70).contains(&finest)).then(|| core::f32::consts::TAU / finest as f32)
}

/// The smallest of [`SIZES`] with room for the usual one of these scans, the largest where none has.
#[must_use]
pub fn fitting<'a>(scans: impl Iterator<Item = &'a [Beam]>) -> usize {
    let mut lengths = Vec::new();
    let mut finest = 0;
    for scan in scans {
        lengths.push(scan.len());
        if finest == 0 && scan.len() > 2 {
            finest = per_revolution(scan);
        }
    }
    // The median: a revolution whose start was lost in a damaged frame is twice as long as any other.
    lengths.sort_unstable();
    let usual = lengths.get(lengths.len() / 2).copied().unwrap_or(0);
    let needed = usual.max(finest);
    let largest = SIZES[SIZES.len() - 1];
    SIZES
        .into_iter()
        .find(|&size| size >= needed)
        .unwrap_or(largest)
}

/// Beams of a revolution of this lidar at its usual speed.
#[must_use]
pub fn beams_of(model: &Model) -> usize {
    (10 * model.points_per_s / u32::from(model.revolutions_per_10s.max(1))) as usize
}

/// What [`fitting`] gives for scans of this lidar at its usual speed; more than the largest of [`SIZES`] where none has room.
#[must_use]
pub fn of_model(model: &Model) -> usize {
    let beams = beams_of(model);
    SIZES
        .into_iter()
        .find(|&size| size >= beams)
        .unwrap_or(beams)
}

/// Beams that a revolution would have, by the median step between two of a scan.
fn per_revolution(scan: &[Beam]) -> usize {
    let step =
        |pair: &[Beam]| (pair[1].bearing.0.wrapping_sub(pair[0].bearing.0) as i16).unsigned_abs();
    let mut steps: Vec<u16> = scan.windows(2).map(step).collect();
    steps.sort_unstable();
    let median = usize::from(steps[steps.len() / 2].max(1));
    (65_536 + median / 2) / median
}

/// Calls a function that is generic over N with the N that is `size`, one of [`SIZES`].
#[macro_export]
macro_rules! sized {
    ($size:expr, $function:ident($($argument:expr),*)) => {
        match $size {
            ..=360 => $function::<360>($($argument),*),
            361..=456 => $function::<456>($($argument),*),
            457..=512 => $function::<512>($($argument),*),
            513..=720 => $function::<720>($($argument),*),
            _ => $function::<1024>($($argument),*),
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use beamfix::scan::{Bearing, Range};

    #[test]
    fn sizes_follow_the_step_between_beams() {
        for (beams, degrees, expected) in [
            (180, 1.0f32, 360),
            (361, 0.5, 720),
            (450, 0.8, 456),
            (500, 0.72, 512),
            (682, 0.351_562_5, 1024),
            (2000, 0.18, 1024),
        ] {
            let beam = |k: usize| Beam {
                bearing: Bearing::from_radians((k as f32 * degrees).to_radians()),
                range: Range::from_mm(1000),
                time_us: 0,
                quality: 0,
            };
            let scan: Vec<Beam> = (0..beams).map(beam).collect();
            assert_eq!(
                fitting([&scan[..]].into_iter()),
                expected,
                "{beams} beams of {degrees}°"
            );
        }
        assert_eq!(fitting(std::iter::empty()), 360);
    }
}
