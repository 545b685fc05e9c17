//! Fields from rolling tiles, local maps matched with maps, and map files good and bad.

use std::{fs, path::PathBuf};

use crate::common::points_from;
use beamfix::{
    geometry::{Point, Pose},
    grid::{
        Grid, Shape,
        occupancy::{self, Cell, UpdateConfig},
    },
    matching::{
        field::{self, FieldConfig},
        map::{self, Kernel, MapConfig},
    },
    sensor_model::likelihood_field::{
        Field, FieldModel, LikelihoodField, Profile,
        draw::{self, DrawConfig},
        tiles::Tiles,
    },
};
use beamfix_sim::{home, noise::Noise, pose::TruePose, scenes, world::World};
use host_tests::formats::ros_map;

#[test]
fn tiles_hold_what_one_table_holds() {
    let world = scenes::flat();
    let mut noise = Noise::new(1, 31);
    let profile = Profile::new(&FieldModel::DEFAULT);
    let middle = Point::new(4.0, 4.0);
    let mut tiles =
        Box::new(Tiles::<420, 1600>::new(0.05, middle, *profile.scale()).expect("a window"));
    let shape = *Field::shape(&*tiles);
    let mut table =
        LikelihoodField::unexplored(shape, vec![0; shape.len()], *profile.scale()).expect("fits");
    for place in [[3.0, 2.7], [3.05, 4.15], [4.8, 4.3], [7.6, 5.9]] {
        let pose = TruePose::new(place[0], place[1], noise.even(-3.0, 3.0));
        let points = points_from(&world, pose, 450, &mut noise);
        draw::scan(
            &mut *tiles,
            &points,
            pose.into(),
            &profile,
            &DrawConfig::DEFAULT,
        );
        draw::scan(
            &mut table,
            &points,
            pose.into(),
            &profile,
            &DrawConfig::DEFAULT,
        );
    }
    assert_eq!(tiles.dropped(), 0);
    println!(
        "{} tiles for the flat: {} bytes of cells",
        tiles.in_use(),
        64 * u32::from(tiles.in_use())
    );
    let table = table.as_slice();
    for y in 0..u32::from(shape.height()) {
        for x in 0..u32::from(shape.width()) {
            assert_eq!(tiles.byte(x, y), table.byte(x, y), "cell ({x}, {y})");
        }
    }
    // The same match on both, bit for bit.
    let truth = TruePose::new(3.4, 4.1, 0.4);
    let points = points_from(&world, truth, 450, &mut noise);
    let guess = Pose::from(truth) * Pose::new(0.04, -0.03, 0.02);
    let on_tiles = field::align(&*tiles, &points, guess, &FieldConfig::DEFAULT).expect("a match");
    let on_table = field::align(&table, &points, guess, &FieldConfig::DEFAULT).expect("a match");
    assert_eq!(on_tiles, on_table);
    let off = truth.between(on_tiles.pose.into());
    assert!(off.distance() < 0.01 && off.theta.abs() < 0.002, "{off:?}");
}

/// A local map of 8 m around `pose`, from scans along a short way, in the frame of `pose`.
pub fn local_map(world: &World, pose: TruePose, beams: usize, noise: &mut Noise) -> Grid<Vec<u8>> {
    let shape = Shape::new(160, 160, 0.05, Pose::new(-4.0, -4.0, 0.0)).expect("good");
    let mut local = Grid::new(shape, vec![occupancy::UNKNOWN; shape.len()]).expect("fits");
    for step in 0..5 {
        let way = TruePose::new(0.05 * f64::from(step), 0.0, 0.05 * f64::from(step));
        let points = points_from(world, pose.then(way), beams, noise);
        occupancy::update(&mut local, way.into(), &points, &UpdateConfig::DEFAULT);
    }
    occupancy::decide(local.cells_mut());
    local
}

/// Two maps of a corridor without ends slide along each other (D8): the guess is kept along it, and the covariance says
/// that only the guess is known.
#[test]
fn maps_of_a_corridor_keep_the_guess_along_it() {
    let world = scenes::corridor();
    let mut noise = Noise::new(1, 33);
    let [mut whole, mut local] = [0.0, 0.3].map(|x| {
        let place = TruePose::new(x, 0.1, 0.0);
        local_map(&world, place, 450, &mut noise)
    });
    map::smooth(&mut whole, Kernel::Five);
    map::smooth(&mut local, Kernel::Five);
    // The local map lies 0.3 m on; the guess is off by 0.12 m along the corridor and 0.06 m across.
    let guess = Pose::new(0.42, 0.06, 0.01);
    let found = map::align(
        &whole.as_slice(),
        &local.as_slice(),
        guess,
        &MapConfig::DEFAULT,
    )
    .expect("a match");
    let open = found.degenerate_direction.expect("open along the corridor");
    assert!(open.direction[0].abs() > 0.99, "{found:?}");
    // Directions are found to a hundredth: 1 mm of the 6 cm across.
    assert!((found.pose.x - guess.x).abs() < 0.005, "{found:?}");
    // Half a cell.
    assert!(found.pose.y.abs() < 0.025, "{found:?}");
    assert!(found.covariance.0.xx > 0.2 * 0.2, "{found:?}");
}

#[test]
fn local_maps_are_found_in_the_map_and_elsewhere_they_do_not_correlate() {
    let world = home::home();
    let (low, high) = home::EXTENT;
    let mut whole = ros_map::of_world(&world, low, high, 0.05, home::INSIDE).expect("a map");
    map::smooth(&mut whole, Kernel::Five);
    let (mut worst, mut elsewhere) = ((0.0f64, 0.0f64), -1.0f32);
    for seed in 0..8 {
        let mut noise = Noise::new(seed, 32);
        let rough = ros_map::of_world(&world, low, high, 0.05, home::INSIDE).expect("a map");
        let truth = home::home_place(&world, &rough, 0.4, &mut noise);
        let mut local = local_map(&world, truth, 450, &mut noise);
        map::smooth(&mut local, Kernel::Five);
        let guess = Pose::from(truth)
            * Pose::new(
                noise.even(-0.15, 0.15) as f32,
                noise.even(-0.15, 0.15) as f32,
                noise.even(-0.06, 0.06) as f32,
            );
        let found = map::align(
            &whole.as_slice(),
            &local.as_slice(),
            guess,
            &MapConfig::DEFAULT,
        )
        .expect("a match");
        let off = truth.between(found.pose.into());
        worst = (worst.0.max(off.distance()), worst.1.max(off.theta.abs()));
        let right = map::correlate(&whole.as_slice(), &local.as_slice(), found.pose);
        assert!(
            right.common > 0.6 && right.ordinary > 0.6,
            "seed {seed}: {right:?}"
        );
        let other = home::home_place(&world, &rough, 0.4, &mut noise);
        let wrong = map::correlate(&whole.as_slice(), &local.as_slice(), other.into());
        if truth.between(other).distance() > 1.0 {
            elsewhere = beamfix::math::max(elsewhere, wrong.common);
        }
    }
    println!(
        "local maps: worst {:.1} mm, {:.2} deg; best correlation elsewhere {elsewhere:.2}",
        1000.0 * worst.0,
        worst.1.to_degrees()
    );
    assert!(worst.0 < 0.05 && worst.1 < 0.0175 && elsewhere < 0.5);
}

/// A folder for one test's files.
fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(&folder).expect("a folder");
    folder
}

#[test]
fn a_written_map_is_read_back() {
    let folder = folder("maps-written");
    let (low, high) = home::EXTENT;
    let map = ros_map::of_world(&home::home(), low, high, 0.05, home::INSIDE).expect("a map");
    let path = folder.join("home.yaml");
    ros_map::write(&map, &path).expect("written");
    let back = ros_map::read(&path).expect("read");
    assert_eq!(back.shape(), map.shape());
    assert_eq!(back.cells(), map.cells());
}

#[test]
fn modes_negation_and_yaw_are_read() {
    let folder = folder("maps-modes");
    // Two columns, two rows: the picture's first row is the map's upper one.
    fs::write(
        folder.join("m.pgm"),
        b"P5\n# a comment\n2 2\n255\n\x00\xfe\xcd\x80",
    )
    .expect("written");
    let cells = |text: &str| {
        let path = folder.join("m.yaml");
        fs::write(&path, text).expect("written");
        let map = ros_map::read(&path).expect("read");
        (map.cells().to_vec(), *map.shape())
    };
    let head = "image: m.pgm\nresolution: 0.1 # metres\norigin: [1.0, -2.0, 0.5]\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
    let (trinary, shape) = cells(&format!("{head}negate: 0\n"));
    assert_eq!(
        trinary,
        [
            occupancy::UNKNOWN,
            occupancy::UNKNOWN,
            occupancy::OCCUPIED,
            occupancy::FREE
        ]
    );
    assert_eq!(
        (shape.origin(), shape.resolution()),
        (Pose::new(1.0, -2.0, 0.5), 0.1)
    );
    let (negated, _) = cells(&format!("{head}negate: 1\nmode: trinary\n"));
    assert_eq!(negated[2..], [occupancy::FREE, occupancy::OCCUPIED]);
    let (scale, _) = cells(&format!("{head}negate: 0\nmode: scale\n"));
    // 205 is p = 0.196: as good as free. 128 is p = 0.498, two thirds of the way between the thresholds.
    assert_eq!(occupancy::cell(scale[0]), Cell::Free);
    assert!(
        scale[1] > 128 && occupancy::cell(scale[1]) == Cell::Occupied,
        "{scale:?}"
    );
    let (raw, _) = cells(&format!("{head}negate: 0\nmode: raw\n"));
    let raw: Vec<Cell> = raw.into_iter().map(occupancy::cell).collect();
    assert_eq!(
        raw,
        [Cell::Unknown, Cell::Unknown, Cell::Free, Cell::Unknown]
    );
    fs::write(folder.join("m.pgm"), "P2 2 2 100  100 0 50 100").expect("written");
    let (plain, _) = cells(&format!("{head}negate: 0\n"));
    assert_eq!(
        plain,
        [
            occupancy::UNKNOWN,
            occupancy::FREE,
            occupancy::FREE,
            occupancy::OCCUPIED
        ]
    );
}

#[test]
fn bad_maps_are_refused_with_a_line_that_says_why() {
    let folder = folder("maps-bad");
    let picture = b"P5 4 3 255\n0123456789ab".to_vec();
    let yaml = "image: m.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
    let swap = |from: &str, to: &str| yaml.replace(from, to);
    for (yaml, picture, says) in [
        (yaml.to_owned(), picture[..15].to_vec(), "cut off"),
        (yaml.to_owned(), b"GIF89a".to_vec(), "not a PGM"),
        (yaml.to_owned(), b"".to_vec(), "empty"),
        (yaml.to_owned(), b"P5 4".to_vec(), "cannot be read"),
        (yaml.to_owned(), b"P5 0 3 255\n".to_vec(), "0 x 3"),
        (yaml.to_owned(), b"P5 99999 3 255\n".to_vec(), "99999 x 3"),
        (yaml.to_owned(), b"P5 4 3 0\n".to_vec(), "cannot be read"),
        (yaml.to_owned(), b"P5 4 x 255\n".to_vec(), "cannot be read"),
        (swap("0, 0, 0", "0, nan, 0"), picture.clone(), "not finite"),
        (swap("0, 0, 0", "0, 0"), picture.clone(), "2 numbers"),
        (swap("0.05", "zero"), picture.clone(), "no number"),
        (swap("0.05", "-1"), picture.clone(), "-1 m"),
        (
            swap("resolution", "rezolution"),
            picture.clone(),
            "resolution",
        ),
        (format!("{yaml}mode: colour\n"), picture.clone(), "colour"),
        (swap("negate: 0", "negate: 2"), picture.clone(), "negate"),
        (
            swap("free_thresh: 0.196", "free_thresh: 0.9"),
            picture.clone(),
            "thresholds",
        ),
        (swap("m.pgm", "none.pgm"), picture.clone(), "none.pgm"),
        (swap("m.pgm", "/dev/zero"), picture.clone(), "not a file"),
    ] {
        let path = folder.join("m.yaml");
        fs::write(&path, &yaml).expect("written");
        fs::write(folder.join("m.pgm"), &picture).expect("written");
        let error = format!("{:#}", ros_map::read(&path).expect_err(&yaml));
        assert!(error.contains(says), "{error:?} does not say {says:?}");
        assert!(!error.contains('\n'), "{error:?} is more than a line");
    }
}
