//! Grids against their obvious twins: distances by brute force, beams in leaps against beams cell by cell.

use beamfix::{
    geometry::Pose,
    grid::{
        Grid, Shape,
        cast::{self, Skipping},
        distance::{self, FAR, Scratch},
        occupancy::{self, Cell, UpdateConfig},
    },
    scan::{Bearing, ScanPoint},
};
use beamfix_sim::noise::Noise;

/// A grid with about `share` of its cells occupied.
fn random_cells(noise: &mut Noise, len: usize, share: f64) -> Vec<u8> {
    (0..len)
        .map(|_| u8::from(noise.even(0.0, 1.0) < share))
        .collect()
}

#[test]
fn distances_are_those_of_brute_force() {
    for seed in 0..300 {
        let mut noise = Noise::new(seed, 1);
        let (width, height) = (noise.even(1.0, 40.0) as u32, noise.even(1.0, 40.0) as u32);
        let shape = Shape::new(width, height, 0.05, Pose::IDENTITY).expect("good");
        let share = noise.even(0.0, 0.1);
        let cells = random_cells(&mut noise, shape.len(), share);
        let mut squares = vec![0; shape.len()];
        distance::squared(
            &shape,
            &cells,
            |c| c == 1,
            &mut squares,
            &mut Scratch::<40>::new(),
        )
        .expect("fits");
        let (w, h) = (width as i32, height as i32);
        for y in 0..h {
            for x in 0..w {
                let nearest = (0..h)
                    .flat_map(|v| (0..w).map(move |u| (u, v)))
                    .filter(|&(u, v)| cells[(v * w + u) as usize] == 1)
                    .map(|(u, v)| (u - x) * (u - x) + (v - y) * (v - y))
                    .min();
                let expected = nearest.map_or(FAR, |d| d as u16);
                assert_eq!(
                    squares[(y * w + x) as usize],
                    expected,
                    "seed {seed}, cell ({x}, {y})"
                );
            }
        }
    }
}

#[test]
fn distances_saturate_beyond_255_cells() {
    let shape = Shape::new(700, 3, 0.05, Pose::IDENTITY).expect("good");
    let mut cells = vec![0; shape.len()];
    cells[0] = 1;
    let mut squares = vec![0; shape.len()];
    distance::squared(
        &shape,
        &cells,
        |c| c == 1,
        &mut squares,
        &mut Scratch::<700>::new(),
    )
    .expect("fits");
    assert_eq!(squares[255], 255 * 255);
    assert_eq!(squares[700 + 255], 255 * 255 + 1);
    assert_eq!(squares[256], FAR);
    assert_eq!(squares[699], FAR);
}

#[test]
fn beams_in_leaps_meet_what_beams_cell_by_cell_meet() {
    let (mut met, mut missed) = (0, 0);
    for seed in 0..200 {
        let mut noise = Noise::new(seed, 2);
        let (width, height) = (noise.even(1.0, 120.0) as u32, noise.even(1.0, 120.0) as u32);
        let origin = Pose::new(
            noise.even(-9.0, 9.0) as f32,
            noise.even(-9.0, 9.0) as f32,
            noise.even(-4.0, 4.0) as f32,
        );
        let shape = Shape::new(width, height, 0.05, origin).expect("good");
        let share = noise.even(0.0, 0.02);
        let cells = random_cells(&mut noise, shape.len(), share);
        let mut squares = vec![0; shape.len()];
        distance::squared(
            &shape,
            &cells,
            |c| c == 1,
            &mut squares,
            &mut Scratch::<120>::new(),
        )
        .expect("fits");
        let mut roots = vec![0; shape.len()];
        distance::roots(&squares, &mut roots);
        let grid = Grid::new(shape, cells.as_slice()).expect("fits");
        let leaping = Skipping::new(grid, &roots).expect("fits");
        for _ in 0..200 {
            let place = shape.middle_of(
                noise.even(0.0, f64::from(width)) as i32,
                noise.even(0.0, f64::from(height)) as i32,
            );
            let pose = Pose::new(
                place.x + noise.even(-0.024, 0.024) as f32,
                place.y + noise.even(-0.024, 0.024) as f32,
                noise.even(-3.0, 3.0) as f32,
            );
            // Axes and diagonals of the grid come up too.
            let bearing = match noise.even(0.0, 4.0) as u32 {
                0 => Bearing::from_radians(
                    noise.even(0.0, 8.0).floor() as f32 * core::f32::consts::FRAC_PI_4 - pose.theta
                        + origin.theta,
                ),
                _ => Bearing(noise.even(0.0, 65536.0) as u16),
            };
            let range = noise.even(0.0, 7000.0) as u16;
            let exact = cast::exact(&grid, pose, bearing, range, |c| c == 1);
            let leapt = leaping.cast(pose, bearing, range);
            assert_eq!(exact, leapt, "seed {seed}: {pose:?} {bearing:?} {range}");
            if exact.is_some() {
                met += 1
            } else {
                missed += 1
            }
        }
    }
    assert!(
        met > 4000 && missed > 4000,
        "{met} beams met something, {missed} nothing"
    );
}

#[test]
fn a_beams_cells_are_those_that_small_steps_along_it_touch() {
    for seed in 0..100 {
        let mut noise = Noise::new(seed, 3);
        let shape = Shape::new(60, 60, 0.1, Pose::IDENTITY).expect("good");
        let pose = Pose::new(
            noise.even(0.1, 5.9) as f32,
            noise.even(0.1, 5.9) as f32,
            0.0,
        );
        let bearing = Bearing(noise.even(0.0, 65536.0) as u16);
        let mut ray = cast::Ray::new(&shape, pose, bearing).expect("inside");
        let walked: Vec<_> = ray.cells(4000).collect();
        for pair in walked.windows(2) {
            let step = (pair[1].0 - pair[0].0).abs() + (pair[1].1 - pair[0].1).abs();
            assert_eq!(step, 1, "seed {seed}: from {:?} to {:?}", pair[0], pair[1]);
        }
        let angle = f64::from(bearing.0) * core::f64::consts::TAU / 65536.0;
        for k in 0..3500 {
            let way = f64::from(k) * 0.001;
            let place = [
                (f64::from(pose.x) + way * angle.cos()) / 0.1,
                (f64::from(pose.y) + way * angle.sin()) / 0.1,
            ];
            // Within a hundredth of a cell of an edge either side will do: the start is rounded to 1/1024.
            let clear = place
                .iter()
                .all(|p| (0.01..0.99).contains(&(p - p.floor())));
            if clear {
                let cell = (place[0].floor() as i32, place[1].floor() as i32);
                assert!(walked.contains(&cell), "seed {seed}: {cell:?} is missing");
            }
        }
    }
}

#[test]
fn a_wall_along_the_beams_stays_in_the_map() {
    // A lidar 12 cm beside a long wall: most beams graze it.
    let shape = Shape::new(200, 40, 0.05, Pose::IDENTITY).expect("good");
    let mut grid = Grid::new(shape, vec![occupancy::UNKNOWN; shape.len()]).expect("fits");
    let mut noise = Noise::new(1, 4);
    for step in 0..20 {
        let pose = Pose::new(0.5 + 0.1 * step as f32, 1.12, 0.0);
        let points: Vec<ScanPoint> = (0..400)
            .filter_map(|k| {
                let bearing = Bearing((k as u16).wrapping_mul(40));
                let sine = f64::from(bearing.0) * core::f64::consts::TAU / 65536.0;
                let range = 0.355 / sine.sin() + noise.normal(0.01);
                (range > 0.0 && range < 8.0)
                    .then(|| ScanPoint::at(bearing, (range * 1000.0) as u16))
            })
            .collect();
        occupancy::update(&mut grid, pose, &points, &UpdateConfig::DEFAULT);
    }
    // From 1 to 4 m: beyond, the beams are less than 5 degrees from the wall and cross 8 of its cells before they end.
    let row = |y: i32| {
        (20..80)
            .map(|x| occupancy::cell(grid.get(x, y).expect("on the grid")))
            .collect::<Vec<_>>()
    };
    let wall = row(29).iter().filter(|&&c| c == Cell::Occupied).count();
    let floor = row(26).iter().filter(|&&c| c == Cell::Free).count();
    assert!(wall == 60, "{wall} of 60 cells of the wall");
    assert!(floor == 60, "{floor} of 60 cells of the floor");
    assert!(grid.cells().iter().all(|b| b % 2 == 0), "marks are left");
}
