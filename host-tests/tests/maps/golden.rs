//! The bits of fields, localization, particles, presence, sensor models and SLAM, as they are kept.

use super::fields::local_map;
use super::localization::{drive, place, scan};
use super::presence as presence_of;
use super::slam::drive::{drive as follow, path};
use crate::common::{kept::Kept, points_from};
use beamfix::{
    geometry::{Point, Pose},
    grid::{
        Grid, Shape,
        cast::{self, Skipping},
        distance,
        occupancy::{self, UpdateConfig},
    },
    localization::{
        Localizer, LocalizerConfig,
        particles::{Motion, ParticleConfig, ParticleFilter, Proposal, Weighting},
        presence::{self, PresenceConfig},
    },
    matching::{
        correlative::{Correlator, pyramid::Pyramid},
        field::{self, FieldConfig},
        map::{self, Kernel, MapConfig},
    },
    scan::Bearing,
    sensor_model::{
        BeamModel,
        beam_model::{BeamTable, learning::Learner},
        likelihood_field::{
            Field as _, FieldModel, Profile,
            draw::{self, DrawConfig},
            tiles::Tiles,
        },
    },
    slam::{Slam, SlamConfig},
};
use beamfix_sim::{home, noise::Noise, pose::TruePose, scenes};
use host_tests::mapping::building::{ROUND, ring};

#[test]
fn sensor_models_give_the_bits_that_are_kept() {
    let mut kept = Kept::of("sensor models");
    let model = BeamModel::DEFAULT;
    let table = BeamTable::new(&model);
    let mut learner = Learner::new(model);
    for step in 1..60u16 {
        let expected = 200 * step;
        for range in [
            None,
            Some(expected / 2),
            Some(expected - 10),
            Some(expected + 40),
            Some(11_900),
        ] {
            let metres = range.map(|mm| f32::from(mm) * 1e-3);
            kept.push(
                "beam model",
                model.likelihood(metres, f32::from(expected) * 1e-3),
            );
            kept.push("beam table", table.log_likelihood(range, expected));
            learner.add(metres, f32::from(expected) * 1e-3);
        }
    }
    kept.push(
        "learner",
        (
            learner.mean_log_likelihood(),
            learner.beams(),
            learner.model(),
        ),
    );
    learner.forget(0.3);
    kept.push("learner forgets", (learner.beams(), learner.model()));
    let field = FieldModel::DEFAULT;
    let profile = Profile::new(&field);
    for step in 0..60u16 {
        let metres = 0.01 * f32::from(step);
        kept.push(
            "field model",
            (
                field.log_likelihood(metres),
                profile.byte(u32::from(step).pow(4)),
            ),
        );
    }
    kept.check();
}

/// Fields drawn from scans, in tiles; matches on them; local maps matched with maps; beams cast.
#[test]
fn fields_give_the_bits_that_are_kept() {
    let mut kept = Kept::of("fields");
    let world = scenes::flat();
    let profile = Profile::new(&FieldModel::DEFAULT);
    for seed in 0..6 {
        let mut noise = Noise::new(seed, 41);
        let middle = Point::new(4.0, 4.0);
        let mut tiles =
            Box::new(Tiles::<420, 1600>::new(0.05, middle, *profile.scale()).expect("a window"));
        let truth = TruePose::new(
            noise.even(2.8, 3.3),
            noise.even(2.5, 2.9),
            noise.even(-3.0, 3.0),
        );
        for _ in 0..2 {
            let near = truth.then(TruePose::new(
                noise.even(-0.2, 0.2),
                0.0,
                noise.even(-0.5, 0.5),
            ));
            let points = points_from(&world, near, 300, &mut noise);
            draw::scan(
                &mut *tiles,
                &points,
                near.into(),
                &profile,
                &DrawConfig::DEFAULT,
            );
        }
        let points = points_from(&world, truth, 360, &mut noise);
        for off in [0.02, 0.1, 0.3] {
            let guess = Pose::from(truth) * Pose::new(off, -off, 0.4 * off);
            kept.push(
                "field",
                field::align(&*tiles, &points, guess, &FieldConfig::DEFAULT),
            );
        }
        tiles.roll(Point::new(5.0, 4.5)).expect("a window");
        let shape = *tiles.shape();
        let bytes = (0..u32::from(shape.height()))
            .flat_map(|y| (0..u32::from(shape.width())).map(move |x| (x, y)));
        kept.push(
            "tiles",
            bytes.map(|(x, y)| tiles.byte(x, y)).collect::<Vec<u8>>(),
        );

        let whole = local_map(&world, truth, 300, &mut noise);
        let part = local_map(
            &world,
            truth.then(TruePose::new(0.2, 0.1, 0.1)),
            300,
            &mut noise,
        );
        kept.push("occupancy", whole.cells());
        let (mut smooth, mut finer) = (whole.clone(), part);
        map::smooth(&mut smooth, Kernel::Five);
        map::smooth(&mut finer, Kernel::Five);
        let guess = Pose::new(0.23, 0.05, 0.12);
        kept.push(
            "map",
            map::align(
                &smooth.as_slice(),
                &finer.as_slice(),
                guess,
                &MapConfig::DEFAULT,
            ),
        );
        let distances = distances(&whole);
        for k in 0..64u16 {
            let bearing = Bearing(k * 1021);
            let from = Pose::new(0.1, 0.2, 0.3);
            let exact = cast::exact(&whole, from, bearing, 6000, occupancy::is_occupied);
            kept.push("cast", exact);
            let skipping = Skipping::new(whole.as_slice(), &distances).expect("as large");
            kept.push("cast in leaps", skipping.cast(from, bearing, 6000));
        }
    }
    // A corridor is weak along itself.
    let world = scenes::corridor();
    let mut noise = Noise::new(1, 42);
    let at = TruePose::new(0.0, 0.1, 0.4);
    let points = points_from(&world, at, 360, &mut noise);
    let field = crate::common::field_of(&points, 0.05, &FieldModel::DEFAULT);
    let guess = Pose::new(0.05, -0.03, 0.02);
    kept.push(
        "field, corridor",
        field::align(&field.as_slice(), &points, guess, &FieldConfig::DEFAULT),
    );
    kept.check();
}

/// From each cell to the nearest occupied one, in cells.
fn distances(grid: &Grid<Vec<u8>>) -> Vec<u8> {
    let shape = grid.shape();
    let (mut squares, mut roots) = (vec![0; shape.len()], vec![0; shape.len()]);
    let mut scratch = Box::new(distance::Scratch::<160>::new());
    let occupied = occupancy::is_occupied;
    distance::squared(shape, grid.cells(), occupied, &mut squares, &mut scratch).expect("room");
    distance::roots(&squares, &mut roots);
    roots
}

/// Two robots that start without a pose, drive, and are carried elsewhere.
#[test]
fn localization_gives_the_bits_that_are_kept() {
    let mut kept = Kept::of("localization");
    let place = place();
    let mut buffer = vec![0; Pyramid::bytes(place.field.grid().shape())];
    let pyramid = Pyramid::new(place.field.as_slice(), &mut buffer).expect("fits");
    for seed in 0..2 {
        let mut noise = Noise::new(seed, 43);
        let mut robot = Localizer::<96>::new(pyramid, LocalizerConfig::DEFAULT);
        let mut wheels = Pose::IDENTITY;
        for _ in 0..2 {
            let mut pose = home::home_place(&place.world, &place.map, 0.25, &mut noise);
            for _ in 0..6 {
                let points = scan(&place.world, pose, &mut noise);
                kept.push("verdicts", robot.update(&points, wheels));
                let mut steps = 0;
                while !robot.step(200_000) {
                    steps += 1;
                }
                kept.push("counters", (steps, robot.counters(), robot.pose()));
                (pose, wheels) = drive(&place, pose, &mut noise);
            }
        }
    }
    kept.check();
}

#[test]
fn particles_give_the_bits_that_are_kept() {
    let mut kept = Kept::of("particles");
    let place = place();
    let table = BeamTable::new(&BeamModel::DEFAULT);
    for (name, weighting, proposal, particles) in [
        ("wheels", Weighting::LikelihoodField, Proposal::Motion, 120),
        ("match", Weighting::LikelihoodField, Proposal::Improved, 8),
        (
            "beam model",
            Weighting::BeamModel(&table),
            Proposal::Improved,
            8,
        ),
    ] {
        let mut noise = Noise::new(7, 44);
        let mut pose = home::home_place(&place.world, &place.map, 0.25, &mut noise);
        let config = ParticleConfig {
            proposal,
            particles,
            seed: 5,
            ..ParticleConfig::DEFAULT
        };
        let mut filter = ParticleFilter::<'_, 2000, 96>::new(place.field.as_slice(), config)
            .weighed_by(weighting);
        filter.start_at(pose.into(), (0.05, 0.05));
        for turn in 0..24 {
            let wheels;
            (pose, wheels) = drive(&place, pose, &mut noise);
            if turn == 16 {
                pose = home::home_place(&place.world, &place.map, 0.25, &mut noise);
            }
            filter.moved(&Motion::by_wheels(wheels, 0.1));
            kept.push(name, filter.update(&scan(&place.world, pose, &mut noise)));
            kept.push(name, filter.counts());
        }
        kept.push(name, filter.particles().collect::<Vec<_>>());
    }
    kept.check();
}

/// A dock in front of the lidar, and guesses where none is.
#[test]
fn presence_gives_the_bits_that_are_kept() {
    let mut kept = Kept::of("presence");
    let field = presence_of::field();
    let mut buffer = vec![0; Pyramid::bytes(field.grid().shape())];
    let pyramid = Pyramid::new(field.as_slice(), &mut buffer).expect("fits");
    let mut correlator = Correlator::<120>::new();
    for seed in 0..12 {
        let mut noise = Noise::new(seed, 45);
        let mut world = home::home();
        let at = TruePose::new(2.0, 2.0, noise.even(-3.0, 3.0));
        let truth = TruePose::new(1.2, noise.even(-0.3, 0.3), 2.9 + noise.even(-0.2, 0.2));
        presence_of::dock(&mut world, at.then(truth));
        let points = points_from(&world, at, 450, &mut noise);
        let [x, y, turn] = [0.2, 0.2, 0.15].map(|most| noise.even(-most, most));
        for guess in [
            truth.then(TruePose::new(x, y, turn)),
            TruePose::new(-1.0, 0.5, 1.0),
        ] {
            let found = presence::find(
                &mut correlator,
                &pyramid,
                &presence_of::faces(),
                &points,
                guess.into(),
                &PresenceConfig::DEFAULT,
            );
            kept.push("presence", found);
        }
    }
    kept.check();
}

/// A round and a half about a building with a memory that is too small for it.
#[test]
fn slam_gives_the_bits_that_are_kept() {
    let mut kept = Kept::of("slam");
    let truth = path(&ROUND, 2);
    let mut slam = Box::new(Slam::<48, 96, 400, 144, 360>::new(SlamConfig::DEFAULT));
    let driven = follow(&mut slam, &ring(), &truth[..truth.len() * 3 / 4], 0.002, 3);
    kept.push("poses", &driven.mapped);
    kept.push("in map", (&driven.in_map, &driven.located));
    kept.push("counters", slam.counters());
    kept.push("graph", slam.graph().edges());
    kept.push("keyframes", slam.keyframes().collect::<Vec<_>>());
    let extent = slam.extent(8.0);
    kept.push("extent", extent);
    let shape = Shape::new(300, 300, 0.1, Pose::new(-5.0, -5.0, 0.0)).expect("good");
    let mut grid = Grid::new(shape, vec![occupancy::UNKNOWN; shape.len()]).expect("fits");
    for (slot, ..) in slam
        .graph()
        .nodes()
        .map(|(slot, node)| (slot, node.pose))
        .collect::<Vec<_>>()
    {
        slam.draw(slot, &mut grid, &UpdateConfig::DEFAULT);
    }
    kept.push("map", grid.cells());
    kept.check();
}
