//! Whether a known object, such as a charging dock, stands where it may stand, and exactly where.
//!
//! Its likelihood field is the map: all cells around it explored, so that beams that end in its shape's hollows or
//! go through its faces speak against it. Measured in `host-tests/tests/maps/presence.rs`, in the simulated home
//! with a dock of 0.7 m looked for from 0.6 to 2 m: no alarm in 3000 scans without one (a rate below 0.1 % at 95 %
//! confidence), and 212 of 220 docks found, all within 3 cm.

use crate::{
    config::{self, ConfigError},
    geometry::{Point, Pose},
    matching::{
        Match, MatchError,
        correlative::{CorrelativeConfig, Correlator, pyramid::Pyramid},
        field::{self, FieldConfig},
    },
    math,
    scan::{ScanPoint, thinning},
    sensor_model::likelihood_field::{Field, placement::Placement},
};

/// Where to look, and when to believe.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PresenceConfig {
    /// Farthest distance of the object from the guess, along each axis (m). Default 0.5.
    pub position_range: f32,
    /// Largest rotation of the object from the guess (rad). Default 0.35: 20°.
    pub heading_range: f32,
    /// Fewest beams on it. Default 15.
    pub min_beams: u16,
    /// Least share of the beams that meet its cells and end on its faces, the others being beside them or going through.
    /// Default 0.9.
    pub min_share: f32,
    /// Least share of its faces' directions, seen from here, in which a beam ends on it. Default 0.8.
    pub min_cover: f32,
    /// Largest angle between the object's x axis and the direction from which it is seen (rad): it is only known from its
    /// front. Default 1.05: 60°.
    pub max_view_angle: f32,
    /// Largest root mean square distance of its beams from its faces (m). Default 0.02.
    pub max_residual: f32,
}

impl PresenceConfig {
    /// For lidars with 1 cm of noise and objects of half a metre to two.
    pub const DEFAULT: Self = Self {
        position_range: 0.5,
        heading_range: 0.35,
        min_beams: 15,
        min_share: 0.9,
        min_cover: 0.8,
        max_view_angle: 1.05,
        max_residual: 0.02,
    };

    /// The same, if every setting is within its range; usable in a `const`.
    ///
    /// # Errors
    /// [`ConfigError`] names the first setting that is not.
    pub const fn checked(self) -> Result<Self, ConfigError> {
        let checks = [
            config::within("position_range", self.position_range, 0.0, 10.0),
            config::within("heading_range", self.heading_range, 0.0, 3.15),
            config::within("min_beams", self.min_beams as f32, 3.0, 65535.0),
            config::within("min_share", self.min_share, 0.0, 1.0),
            config::within("min_cover", self.min_cover, 0.0, 1.0),
            config::within("max_view_angle", self.max_view_angle, 0.0, 3.15),
            config::within("max_residual", self.max_residual, 0.0, 1.0),
        ];
        match config::all(&checks) {
            Ok(()) => Ok(self),
            Err(error) => Err(error),
        }
    }
}

impl Default for PresenceConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// What speaks for the object and against it, at the pose where it fits best.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Presence {
    /// The verdict.
    pub present: bool,
    /// The object in the lidar's frame.
    pub lidar_from_object: Pose,
    /// The match of the lidar in the object's frame, with its covariance.
    pub found: Match,
    /// Beams that end on its faces.
    pub on: u16,
    /// Beams that end within its cells, but on no face.
    pub beside: u16,
    /// Beams that go through its faces and end behind its cells.
    pub through: u16,
    /// Share of its faces' directions in which a beam ends on it.
    pub cover: f32,
}

/// Looks for the object whose field lies under `pyramid`, near `lidar_from_object`.
///
/// `faces` are a few dozen points along what the object shows to the front, in its own frame. The object is where
/// [`Presence::present`] says so; the rest is the evidence.
///
/// # Errors
/// [`MatchError`] where nothing near the guess could be the object: take it as absent, but for [`MatchError::BadGuess`] and
/// [`MatchError::BadConfig`], which are the caller's.
pub fn find<const N: usize>(
    correlator: &mut Correlator<N>,
    pyramid: &Pyramid<'_>,
    faces: &[Point],
    points: &[ScanPoint],
    lidar_from_object: Pose,
    config: &PresenceConfig,
) -> Result<Presence, MatchError> {
    if !lidar_from_object.is_finite() {
        return Err(MatchError::BadGuess);
    }
    let field = pyramid.field();
    let near = nearby::<N>(field, points, lidar_from_object, config);
    let found = near.len() as u16;
    if found < config.min_beams {
        return Err(MatchError::TooFewBeams {
            found,
            needed: config.min_beams,
        });
    }
    let around = CorrelativeConfig {
        position_range: config.position_range,
        heading_range: config.heading_range,
        min_score: 0.0,
        ..CorrelativeConfig::DEFAULT
    };
    let coarse = correlator.best(pyramid, &near, lidar_from_object.inverse(), &around)?;
    let fine = FieldConfig {
        min_inliers: config.min_beams,
        min_inlier_share: 0.0,
        coarse_stride: 1,
        ..FieldConfig::DEFAULT
    };
    let found = field::align(field, &near, coarse, &fine)?;
    let object_from_lidar = found.pose;
    let placement = Placement::new(field.shape(), object_from_lidar).ok_or(MatchError::BadGuess)?;
    let (mut on, mut beside, mut through) = (0u16, 0u16, 0u16);
    let face = field.scale().byte_at(1.5);
    let unexplored = field.scale().unexplored;
    let (middle, radius) = extent(field, object_from_lidar.inverse());
    let distance = middle.norm();
    for point in points {
        let (x, y) = placement.cell(point);
        let byte = field.byte(x, y);
        if byte == unexplored {
            through += u16::from(crosses(field, &placement, point, distance, radius));
        } else if byte >= face {
            on += 1;
        } else {
            beside += 1;
        }
    }
    let lidar_from_object = object_from_lidar.inverse();
    let cover = cover(field, &placement, faces, points, lidar_from_object, face);
    let against = f32::from(beside) + f32::from(through);
    let share = f32::from(on) / math::max(f32::from(on) + against, 1.0);
    let seen_from = math::abs(math::atan2(object_from_lidar.y, object_from_lidar.x));
    Ok(Presence {
        present: seen_from <= config.max_view_angle
            && on >= config.min_beams
            && share >= config.min_share
            && cover >= config.min_cover
            && found.residual <= config.max_residual,
        lidar_from_object,
        found,
        on,
        beside,
        through,
        cover,
    })
}

/// Middle of the object's cells in the lidar's frame, and the radius around it that holds them all (m).
fn extent(field: &impl Field, lidar_from_object: Pose) -> (Point, f32) {
    let shape = field.shape();
    let middle = shape.middle_of(i32::from(shape.width()) / 2, i32::from(shape.height()) / 2);
    let half = |side: u16| 0.5 * f32::from(side) * shape.resolution();
    let radius = Point::new(half(shape.width()), half(shape.height())).norm();
    (lidar_from_object * middle, radius)
}

/// The points within reach of the object's cells around the guess, evenly thinned to N.
fn nearby<const N: usize>(
    field: &impl Field,
    points: &[ScanPoint],
    lidar_from_object: Pose,
    config: &PresenceConfig,
) -> heapless::Vec<ScanPoint, N> {
    let shape = field.shape();
    let middle = lidar_from_object
        * shape.middle_of(i32::from(shape.width()) / 2, i32::from(shape.height()) / 2);
    let half = |side: u16| 0.5 * f32::from(side) * shape.resolution();
    let radius =
        Point::new(half(shape.width()), half(shape.height())).norm() + config.position_range;
    let within = |point: &&ScanPoint| {
        let off = Point::new(
            f32::from(point.x) * 1e-3 - middle.x,
            f32::from(point.y) * 1e-3 - middle.y,
        );
        off.norm() <= radius
    };
    let count = points.iter().filter(within).count();
    let stride = thinning::stride(count, N);
    let mut near = heapless::Vec::new();
    for &point in points.iter().filter(within).step_by(stride) {
        let _ = near.push(point);
    }
    near
}

/// Whether a beam that ends off the object's cells went through a face of it, `distance` ± `radius` from the lidar.
fn crosses(
    field: &impl Field,
    placement: &Placement,
    point: &ScanPoint,
    distance: f32,
    radius: f32,
) -> bool {
    // Within half a σ: beams that pass beside the object's edges are none. Steps of a σ miss no face.
    let face = field.scale().byte_at(0.5);
    let step = math::round_to_i32(1000.0 * field.scale().sigma).max(2);
    let steps = |metres: f32| math::round_to_i32(math::max(metres, 0.0) * 1000.0) / step;
    let last = steps(distance + radius).min(i32::from(point.range) / step);
    (steps(distance - radius)..=last).any(|k| {
        let part = |end: i16| {
            (i32::from(end) * k * step)
                .checked_div(i32::from(point.range))
                .unwrap_or(0) as i16
        };
        let (x, y) = placement.cell(&ScanPoint {
            x: part(point.x),
            y: part(point.y),
            ..*point
        });
        let byte = field.byte(x, y);
        byte != field.scale().unexplored && byte >= face
    })
}

/// Share of the faces' points in whose direction, within a degree and a half, some beam ends on the object.
fn cover(
    field: &impl Field,
    placement: &Placement,
    faces: &[Point],
    points: &[ScanPoint],
    lidar_from_object: Pose,
    face: u8,
) -> f32 {
    /// 1.5°, in 1/65536 turn.
    const NEAR: u16 = 273;
    if faces.is_empty() {
        return 1.0;
    }
    let mut seen = 0u16;
    for &point_of_face in faces {
        let place = lidar_from_object * point_of_face;
        let mm =
            |metres: f32| math::round_to_i32(math::min(math::max(metres, -32.0), 32.0) * 1000.0);
        let direction = math::atan2_turn(mm(place.y), mm(place.x));
        let met = points.iter().any(|point| {
            let apart = point.bearing.0.wrapping_sub(direction) as i16;
            let (x, y) = placement.cell(point);
            let byte = field.byte(x, y);
            apart.unsigned_abs() <= NEAR && byte >= face && byte != field.scale().unexplored
        });
        seen += u16::from(met);
    }
    f32::from(seen) / faces.len() as f32
}
