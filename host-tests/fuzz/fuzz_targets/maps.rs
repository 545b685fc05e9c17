//! Any scan, any pose and any table in what matches against maps: no panic, and what is called a pose is one.
#![no_main]

use arbitrary::Arbitrary;
use beamfix::{
    Grid, LikelihoodField, Localizer, LocalizerConfig, Pose,
    grid::{
        Shape, distance,
        occupancy::{self, UpdateConfig},
    },
    localization::Verdict,
    matching::{
        correlative::{CorrelativeConfig, Correlator, Pyramid},
        field::{self, FieldConfig},
    },
    scan::{Bearing, ScanPoint},
    sensor_model::likelihood_field::{FieldModel, Profile, stored},
};
use libfuzzer_sys::fuzz_target;

const WIDTH: u32 = 48;
const HEIGHT: u32 = 40;

#[derive(Arbitrary, Debug)]
struct Input {
    /// What may be a table of a field.
    table: Vec<u8>,
    /// Bytes of a whole table that are other than written.
    flips: Vec<(u16, u8)>,
    walls: Vec<(u8, u8, u8, bool)>,
    origin: [f32; 3],
    scan: Vec<(u16, u16)>,
    guess: [f32; 3],
    start: Option<[f32; 3]>,
    motions: Vec<[f32; 3]>,
    budget: u16,
}

fn pose([x, y, theta]: [f32; 3]) -> Pose {
    Pose { x, y, theta }
}

fn match_in(field: &LikelihoodField<&[u8]>, points: &[ScanPoint], input: &Input) {
    let guess = pose(input.guess);
    if let Ok(found) = field::align(field, points, guess, &FieldConfig::DEFAULT) {
        assert!(found.pose.is_finite() && found.residual.is_finite());
    }
    let mut buffer = vec![0; Pyramid::bytes(field.grid().shape())];
    let Ok(pyramid) = Pyramid::new(field.as_slice(), &mut buffer) else {
        return;
    };
    let mut correlator = Correlator::<64>::new();
    if let Ok(found) = correlator.align(&pyramid, points, guess, &CorrelativeConfig::DEFAULT) {
        assert!(found.pose.is_finite() && found.residual.is_finite());
    }
    let mut localizer = Localizer::<64>::new(pyramid, LocalizerConfig::DEFAULT);
    if let Some(start) = input.start {
        localizer.start_at(pose(start));
    }
    for &motion in input.motions.iter().take(4) {
        if let Verdict::Tracking(found, _) = localizer.update(points, pose(motion)) {
            assert!(found.pose.is_finite());
        }
        for _ in 0..2 {
            if localizer.step(input.budget.into()) {
                break;
            }
        }
        assert!(localizer.pose().is_none_or(|pose| pose.is_finite()));
    }
}

fuzz_target!(|input: Input| {
    let points: heapless::Vec<ScanPoint, 96> = (input.scan.iter().take(96))
        .map(|&(bearing, mm)| ScanPoint::at(Bearing(bearing), mm % 32_001))
        .collect();
    if let Ok(field) = stored::parse(&input.table) {
        match_in(&field, &points, &input);
    }
    let Ok(shape) = Shape::new(WIDTH, HEIGHT, 0.1, pose(input.origin)) else {
        return;
    };
    let mut cells = vec![occupancy::FREE; shape.len()];
    for &(x, y, length, upright) in &input.walls {
        for k in 0..i32::from(length % 48) {
            let (x, y) = (i32::from(x % 48), i32::from(y % 40));
            let (x, y) = if upright { (x, y + k) } else { (x + k, y) };
            if let Some(cell) = shape.index(x, y).and_then(|index| cells.get_mut(index)) {
                *cell = occupancy::OCCUPIED;
            }
        }
    }
    let mut grid = Grid::new(shape, &mut cells[..]).expect("a byte a cell");
    occupancy::update(
        &mut grid,
        pose(input.guess),
        &points,
        &UpdateConfig::DEFAULT,
    );
    occupancy::decide(&mut cells);
    let mut squares = vec![0; shape.len()];
    let mut scratch = distance::Scratch::<48>::new();
    distance::squared(
        &shape,
        &cells,
        occupancy::is_occupied,
        &mut squares,
        &mut scratch,
    )
    .expect("sizes agree");
    let map = Grid::new(shape, &cells[..]).expect("a byte a cell");
    let profile = Profile::new(&FieldModel::DEFAULT);
    let field = LikelihoodField::from_map(&map, &squares, &profile, vec![0; shape.len()])
        .expect("sizes agree");
    match_in(&field.as_slice(), &points, &input);
    let mut table = stored::header(&field.as_slice()).to_vec();
    table.extend_from_slice(field.grid().cells());
    for &(at, flip) in &input.flips {
        let length = table.len();
        table[usize::from(at) % length] ^= flip;
    }
    match stored::parse(&table) {
        Ok(field) => match_in(&field, &points, &input),
        Err(_) => assert!(!input.flips.is_empty()),
    }
});
