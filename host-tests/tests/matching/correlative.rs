//! Branch and bound against trying every pose; how far off a guess may be; what is ambiguous or undetermined.

use crate::common::{field_of, over_pairs, points_from};
use beamfix::{
    config::ConfigError,
    geometry::Pose,
    grid::{Grid, Shape},
    matching::{
        MatchError,
        correlative::{CorrelativeConfig, Correlator, Window, pyramid::Pyramid},
        field::{self, FieldConfig},
    },
    scan::{Bearing, ScanPoint},
    sensor_model::likelihood_field::{Field, FieldModel, LikelihoodField},
};
use beamfix_sim::{noise::Noise, pose::TruePose, scenes};

/// A field with smooth bumps, what is unexplored, and noise.
fn random_field(noise: &mut Noise) -> LikelihoodField<Vec<u8>> {
    let (width, height) = (noise.even(5.0, 90.0) as u32, noise.even(5.0, 90.0) as u32);
    let origin = Pose::new(
        noise.even(-3.0, 3.0) as f32,
        noise.even(-3.0, 3.0) as f32,
        noise.even(-3.0, 3.0) as f32,
    );
    let shape = Shape::new(width, height, 0.05, origin).expect("good");
    let scale = FieldModel::DEFAULT.scale();
    let bumps: Vec<[f64; 2]> = (0..12)
        .map(|_| {
            [
                noise.even(0.0, f64::from(width)),
                noise.even(0.0, f64::from(height)),
            ]
        })
        .collect();
    let cells = (0..shape.len())
        .map(|k| {
            if noise.even(0.0, 1.0) < 0.2 {
                return scale.unexplored;
            }
            let (x, y) = ((k as u32 % width) as f64, (k as u32 / width) as f64);
            let near = bumps
                .iter()
                .map(|b| (b[0] - x).powi(2) + (b[1] - y).powi(2))
                .fold(1e9, f64::min);
            (1.0 + 200.0 * (-near / 8.0).exp() + noise.even(0.0, 50.0)) as u8
        })
        .collect();
    LikelihoodField::new(Grid::new(shape, cells).expect("fits"), scale).expect("small")
}

#[test]
fn branch_and_bound_finds_what_trying_everything_finds() {
    let (mut looked, mut all) = (0, 0);
    for seed in 0..60 {
        let mut noise = Noise::new(seed, 1);
        let field = random_field(&mut noise);
        let shape = *field.grid().shape();
        let mut buffer = vec![0; Pyramid::bytes(&shape)];
        let pyramid = Pyramid::new(field.as_slice(), &mut buffer).expect("fits");
        let pyramid = if seed % 2 == 0 {
            pyramid
        } else {
            pyramid.local()
        };
        let points: Vec<ScanPoint> = (0..40)
            .map(|_| {
                ScanPoint::at(
                    Bearing(noise.even(0.0, 65536.0) as u16),
                    noise.even(100.0, 3000.0) as u16,
                )
            })
            .collect();
        let guess = shape.middle_of(
            noise.even(-8.0, f64::from(shape.width()) + 8.0) as i32,
            noise.even(-8.0, f64::from(shape.height()) + 8.0) as i32,
        );
        let guess = Pose::new(guess.x, guess.y, noise.even(-3.0, 3.0) as f32);
        let reach = if seed % 2 == 0 { 1.5 } else { 0.4 };
        let config = CorrelativeConfig {
            position_range: reach,
            heading_range: 0.1,
            ..CorrelativeConfig::DEFAULT
        };
        let window = Window::new(&pyramid, &points, guess, &config).expect("fits");
        let mut correlator = Correlator::<40>::new();
        let best = correlator
            .search(&pyramid, &points, &window, 0, None)
            .expect("something");
        looked += correlator.lookups();
        all += 40
            * u64::from(window.headings.unsigned_abs())
            * u64::from(window.side.unsigned_abs()).pow(2);
        let pose = window.pose(best.x, best.y, best.heading);
        let there = field.as_slice().score(&points, pose);
        // Rounding of the pose may put a point or two into the next cell.
        assert!(
            best.sum.abs_diff(there.sum) <= 500,
            "seed {seed}: {} and {}",
            best.sum,
            there.sum
        );
        let exhaustive = exhaustive(&field, &points, &window);
        assert_eq!(best.sum, exhaustive, "seed {seed}");
    }
    println!("{looked} lookups instead of {all}");
}

/// The largest sum over the window, each beam in the cell that it has at the window's corner, moved by whole cells.
fn exhaustive(field: &LikelihoodField<Vec<u8>>, points: &[ScanPoint], window: &Window) -> u32 {
    use beamfix::sensor_model::likelihood_field::placement::Placement;
    let shape = field.grid().shape();
    let unexplored = Field::scale(&field.as_slice()).unexplored;
    let mut largest = 0;
    for heading in 0..window.headings {
        let corner = Placement::new(shape, window.pose(0, 0, heading)).expect("near");
        let cells: Vec<(i32, i32)> = points
            .iter()
            .map(|point| {
                let (x, y) = corner.place(point);
                ((x as i32) >> corner.shift, (y as i32) >> corner.shift)
            })
            .collect();
        for y in 0..i32::from(window.side) {
            for x in 0..i32::from(window.side) {
                let bytes = cells
                    .iter()
                    .map(|c| u32::from(field.grid().get(c.0 + x, c.1 + y).unwrap_or(unexplored)));
                largest = largest.max(bytes.sum());
            }
        }
    }
    largest
}

#[test]
fn captures_from_a_quarter_metre_and_twelve_degrees() {
    let Some([count, right, mm, degrees]) = over_pairs(1, |pair, reference, current| {
        let mut noise = Noise::new(pair.id as u64, 2);
        let mut even = |limit: f64| noise.even(-limit, limit) as f32;
        let guess = pair.truth * Pose::new(even(0.25), even(0.25), even(12f64.to_radians()));
        let field = field_of(reference, 0.05, &FieldModel::DEFAULT);
        let mut buffer = vec![0; Pyramid::bytes(field.grid().shape())];
        let pyramid = Pyramid::new(field.as_slice(), &mut buffer)
            .expect("fits")
            .local();
        // A corner of the window lies 0.35 m from its middle.
        let config = CorrelativeConfig {
            position_range: 0.36,
            ..CorrelativeConfig::DEFAULT
        };
        let first = Correlator::<120>::new()
            .align(&pyramid, current, guess, &config)
            .ok()?;
        let found = field::align(
            &field.as_slice(),
            current,
            first.pose,
            &FieldConfig::DEFAULT,
        )
        .ok()?;
        Some(found.pose)
    }) else {
        return;
    };
    println!(
        "sim, off by up to 0.25 m and 12 deg: {right} of {count} right, {mm:.2} mm, {degrees:.4} deg"
    );
    assert!(right >= 0.995 * count && mm <= 2.5 && degrees <= 0.04);
}

#[test]
fn a_corridor_is_weak_along_itself_and_two_equal_rooms_are_ambiguous() {
    let mut noise = Noise::new(1, 3);
    let corridor = scenes::corridor();
    let place = TruePose::new(0.0, 0.2, 0.3);
    let points = points_from(&corridor, place, 360, &mut noise);
    let field = field_of(&points, 0.05, &FieldModel::DEFAULT);
    let mut buffer = vec![0; Pyramid::bytes(field.grid().shape())];
    let pyramid = Pyramid::new(field.as_slice(), &mut buffer)
        .expect("fits")
        .local();
    let mut correlator = Correlator::<120>::new();
    let guess = Pose::new(0.11, 0.03, 0.01);
    let found = correlator
        .align(&pyramid, &points, guess, &CorrelativeConfig::DEFAULT)
        .expect("a match");
    let weak = found.degenerate_direction.expect("a weak direction");
    // The corridor runs along -0.3 rad in the lidar's frame.
    let (s, c) = beamfix::math::sin_cos(0.3);
    let along = weak.direction[0] * c - weak.direction[1] * s;
    assert!(along.abs() > 0.98, "{found:?}");
    // Along it the guess is kept (D8), across it the lidar is where it was: to a cell.
    let off = found.pose.between(guess);
    let [kept, across] = [off.x * c - off.y * s, found.pose.x * s + found.pose.y * c];
    assert!(kept.abs() < 0.01 && across.abs() < 0.05, "{found:?}");
    // And nobody claims to know it.
    let row = [c, -s, 0.0];
    assert!(found.covariance.0.quadratic(row) > 0.2 * 0.2, "{found:?}");
    let newton = field::align(
        &field.as_slice(),
        &points,
        Pose::new(0.02, 0.03, 0.01),
        &FieldConfig::DEFAULT,
    );
    let newton = newton.expect("a match");
    assert!(
        newton
            .degenerate_direction
            .is_some_and(|weak| weak.direction[2].abs() < 0.2),
        "{newton:?}"
    );

    // Two equal rooms side by side, seen from one of them.
    let mut rooms = beamfix_rooms();
    let place = TruePose::new(1.0, 1.2, 0.4);
    let points = points_from(&rooms, place, 360, &mut noise);
    let field =
        crate::common::field_of_world(&rooms, [-0.5, -0.5], [7.5, 3.5], 0.05, &FieldModel::DEFAULT);
    let mut buffer = vec![0; Pyramid::bytes(field.grid().shape())];
    let pyramid = Pyramid::new(field.as_slice(), &mut buffer).expect("fits");
    let config = CorrelativeConfig {
        position_range: 4.0,
        heading_range: 0.2,
        max_ambiguity: 0.9,
        ..CorrelativeConfig::DEFAULT
    };
    let guess = Pose::new(2.5, 1.4, 0.35);
    let refused = correlator.align(&pyramid, &points, guess, &config);
    assert!(
        matches!(refused, Err(MatchError::Ambiguous { ratio }) if ratio > 0.9),
        "{refused:?}"
    );
    // Two cupboards in the robot's own room tell them apart. (In the other one they would not: the field does not
    // know what a beam passes through.)
    rooms.block([2.0, 1.6], [2.6, 2.4]);
    rooms.block([2.2, 0.0], [2.6, 0.6]);
    let points = points_from(&rooms, place, 360, &mut noise);
    let field =
        crate::common::field_of_world(&rooms, [-0.5, -0.5], [7.5, 3.5], 0.05, &FieldModel::DEFAULT);
    let pyramid = Pyramid::new(field.as_slice(), &mut buffer).expect("fits");
    let found = correlator
        .align(&pyramid, &points, guess, &config)
        .expect("a match");
    let off = place.between(found.pose.into());
    // A cell, and two steps of the heading: 0.05 m at 2.4 m.
    assert!(off.distance() < 0.06 && off.theta.abs() < 0.042, "{off:?}");
}

fn beamfix_rooms() -> beamfix_sim::world::World {
    let mut rooms = beamfix_sim::world::World::default();
    rooms.block([0.0, 0.0], [3.0, 3.0]);
    rooms.block([3.2, 0.0], [6.2, 3.0]);
    for x in [0.0, 3.2] {
        rooms.block([x + 0.5, 2.4], [x + 1.3, 3.0]);
        rooms.block([x + 2.6, 0.6], [x + 3.0, 1.1]);
    }
    rooms
}

#[test]
fn too_few_beams_and_bad_guesses_are_refused() {
    let mut noise = Noise::new(1, 4);
    let points = points_from(
        &scenes::room(),
        TruePose::new(0.0, 0.0, 0.0),
        360,
        &mut noise,
    );
    let field = field_of(&points, 0.05, &FieldModel::DEFAULT);
    let mut buffer = vec![0; Pyramid::bytes(field.grid().shape())];
    let pyramid = Pyramid::new(field.as_slice(), &mut buffer).expect("fits");
    let mut correlator = Correlator::<120>::new();
    let config = CorrelativeConfig::DEFAULT;
    for (points, guess, expected) in [
        (
            &points[..9],
            Pose::IDENTITY,
            MatchError::TooFewBeams {
                found: 9,
                needed: 10,
            },
        ),
        (
            &points[..],
            Pose {
                x: f32::NAN,
                ..Pose::IDENTITY
            },
            MatchError::BadGuess,
        ),
    ] {
        assert_eq!(
            correlator.align(&pyramid, points, guess, &config),
            Err(expected)
        );
    }
    let wide = CorrelativeConfig {
        position_range: 40.0,
        ..config
    };
    // The window is what is wrong, not the guess.
    let refused = correlator.align(&pyramid, &points, Pose::IDENTITY, &wide);
    assert!(
        matches!(
            refused,
            Err(MatchError::BadConfig(ConfigError::OutOfRange {
                setting: "position_range",
                ..
            }))
        ),
        "{refused:?}"
    );
    let elsewhere = Pose::new(9.0, 9.0, 0.0);
    let refused = correlator.align(&pyramid, &points, elsewhere, &config);
    assert!(
        matches!(refused, Err(MatchError::NothingFound { min_score: 0.3 })),
        "{refused:?}"
    );
}
