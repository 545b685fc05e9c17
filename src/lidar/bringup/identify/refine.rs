//! Which of a family's models is it, by what its frames say?

use crate::lidar::model::{Family, Model, Sector};
use crate::lidar::sensors::{delta, ld06, rplidar, scip, ydlidar};
use crate::lidar::wire::packet::Packet as _;
use crate::lidar::wire::protocol::Protocol;

/// What the bytes say of a model's pace.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) enum Told {
    /// Nothing.
    Nothing,
    /// The model itself.
    Model,
    /// Measurements a second.
    PointsPerSecond(u32),
    /// Measurements of a revolution.
    PerRevolution(u32),
}

impl Told {
    /// Whether bytes that were taken for `model`'s may as well be from `other`: the same frames, the pace off by at most an
    /// eighth (a quarter by revolutions, which sensors make at any speed).
    pub(super) fn suits(self, model: &Model, other: &Model) -> bool {
        let near = |told: u32, of: u32, parts: u32| told.abs_diff(of) <= told / parts;
        let same = match (model.family, other.family) {
            (Family::Ldrobot(parallax), Family::Ldrobot(others)) => {
                parallax == others || model.points_per_s == other.points_per_s
            }
            (Family::Ydlidar(_), Family::Ydlidar(_)) => model.family.frames_as(other.family),
            (family, other) => family == other,
        };
        same && match self {
            Self::Nothing => true,
            Self::Model => false,
            Self::PointsPerSecond(points) => near(points, other.points_per_s, 8),
            Self::PerRevolution(points) => near(points, per_revolution(other), 4),
        }
    }
}

/// Measurements of a revolution by the data sheet.
fn per_revolution(model: &Model) -> u32 {
    let tenfold = model.points_per_s.saturating_mul(10);
    tenfold
        .checked_div(model.revolutions_per_10s.into())
        .unwrap_or(0)
}

/// The model of a family by what its frames say.
pub(super) fn refine(model: &'static Model, bytes: &[u8]) -> (&'static Model, Told) {
    let holds = |head: &[u8]| bytes.windows(head.len()).any(|window| window == head);
    match model.family {
        Family::Ldrobot(_) => ldrobot_by_pace(bytes),
        Family::Delta(_) => (delta_by_sector(bytes), Told::Nothing),
        Family::Ydlidar(_) if holds(&ydlidar::command::COIN_D4_ANSWER) => {
            (&Model::COIN_D4, Told::Model)
        }
        Family::Camsense(_) if holds(&[0x55, 0xaa, 0x07, 0x0c]) => {
            (&Model::CAMSENSE_LDS08RR, Told::Model)
        }
        Family::Camsense(_) if holds(&[0x55, 0xaa, 0x23, 0x10]) => {
            (&Model::MYSTERY_360, Told::Model)
        }
        Family::Scip(_) => (scip_by_steps(bytes), Told::Nothing),
        Family::RplidarScan => by_revolution(
            rplidar::Parser::for_model(model),
            bytes,
            &[&Model::RPLIDAR_SCAN, &Model::RPLIDAR_C1_SCAN],
        ),
        Family::RplidarExpress | Family::RplidarDense => {
            let parser = rplidar::capsule::Parser::for_model;
            let smooth = |model| smooth_steps(parser(model), bytes);
            if smooth(&Model::RPLIDAR_EXPRESS) >= smooth(&Model::RPLIDAR_DENSE) {
                (&Model::RPLIDAR_EXPRESS, Told::Nothing)
            } else {
                let models = [&Model::RPLIDAR_DENSE, &Model::RPLIDAR_C1];
                by_revolution(parser(&Model::RPLIDAR_DENSE), bytes, &models)
            }
        }
        _ => (model, Told::Nothing),
    }
}

/// The one of some models that has about as many measurements in a revolution; the first where no revolution is whole.
fn by_revolution(
    mut parser: impl Protocol,
    bytes: &[u8],
    models: &[&'static Model],
) -> (&'static Model, Told) {
    let first = models.first().copied().unwrap_or(&Model::RPLIDAR_SCAN);
    let (mut points, mut revolutions, mut before) = (0u32, 0u32, 0u32);
    let mut has_begun = false;
    for packet in bytes.iter().filter_map(|&byte| parser.push(byte)) {
        let count = packet.beams().count() as u32;
        match packet.revolution_start() {
            Some(start) => {
                let ahead = (start as u32).min(count);
                if has_begun {
                    points += before + ahead;
                    revolutions += 1;
                }
                has_begun = true;
                before = count - ahead;
            }
            None => before += count,
        }
    }
    let Some(found) = points.checked_div(revolutions) else {
        return (first, Told::Nothing);
    };
    let off = |model: &&&Model| found.abs_diff(per_revolution(model));
    let model = models.iter().min_by_key(off).copied().unwrap_or(first);
    (model, Told::PerRevolution(found))
}

/// Which Hokuyo counts steps as these scans do.
fn scip_by_steps(bytes: &[u8]) -> &'static Model {
    let mut parser = scip::Parser::for_model(&Model::HOKUYO_URG04LX);
    for &byte in bytes {
        parser.push(byte);
    }
    let per_revolution = |model: &Model| match model.family {
        Family::Scip(steps) => steps.per_revolution,
        _ => 0,
    };
    let counted = parser.steps().per_revolution;
    let mut models = [&Model::HOKUYO_URG04LX, &Model::HOKUYO_UTM30LX].into_iter();
    models
        .find(|model| per_revolution(model) == counted)
        .unwrap_or(&Model::HOKUYO_URG04LX)
}

/// Which LDROBOT sensor measures as often as the time stamps say.
fn ldrobot_by_pace(bytes: &[u8]) -> (&'static Model, Told) {
    let mut parser = ld06::Parser::new();
    let (mut frames, mut elapsed_ms, mut previous, mut speed) = (0u32, 0u32, None::<u16>, 0);
    for packet in bytes.iter().filter_map(|&byte| parser.push(byte)) {
        if let Some(previous) = previous.replace(packet.stamp_ms) {
            let passed = u32::from(packet.stamp_ms) + 30_000 - u32::from(previous);
            let passed = if passed >= 30_000 {
                passed - 30_000
            } else {
                passed
            };
            // Frames that follow each other, not those on both sides of a gap.
            if passed <= 7 {
                frames += 1;
                elapsed_ms += passed;
            }
        }
        speed = packet.speed_deg_per_s;
    }
    let pace = frames.saturating_mul(12_000).checked_div(elapsed_ms);
    let model = match pace.unwrap_or(4500) {
        0..=3200 if speed < 2000 => &Model::LDROBOT_LDS02,
        0..=3200 => &Model::LDROBOT_LD14,
        3201..=4250 => &Model::LDROBOT_LD14P,
        4251..=4750 => &Model::LDROBOT_LD06,
        4751..=10_000 => &Model::LDROBOT_STL19P,
        _ => &Model::LDROBOT_STL27L,
    };
    (model, pace.map_or(Told::Nothing, Told::PointsPerSecond))
}

/// Which Delta has frames as far apart as these.
fn delta_by_sector(bytes: &[u8]) -> &'static Model {
    let mut parser = delta::Parser::for_model(&Model::DELTA_2A);
    for &byte in bytes {
        parser.push(byte);
    }
    match parser.format().sector() {
        Sector::Sixteenth => &Model::DELTA_2A,
        Sector::Fifteenth => &Model::DELTA_2G,
    }
}

/// Share of neighbours that differ by less than a 16th (1/1000): walls are smooth, misread bytes are not.
fn smooth_steps(mut parser: impl Protocol, bytes: &[u8]) -> u32 {
    let (mut smooth, mut all) = (0u32, 1u32);
    for &byte in bytes {
        let Some(packet) = parser.push(byte) else {
            continue;
        };
        let mut previous = None;
        for mm in packet.beams().filter_map(|beam| beam.range.mm().ok()) {
            if let Some(previous) = previous.replace(mm) {
                all += 1;
                smooth += u32::from(mm.abs_diff(previous) < mm / 16);
            }
        }
    }
    smooth.saturating_mul(1000).checked_div(all).unwrap_or(0)
}
