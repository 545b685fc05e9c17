//! Everything that matches against maps, linked once so that `prove-no-panic` sees it.
//!
//! No file, no measurement: bytes and points come from outside, and what is found goes there.

use core::hint::black_box;

use beamfix::{
    geometry::{Point, Pose},
    grid::{Grid, Shape, cast, distance, occupancy},
    localization::{
        Localizer, LocalizerConfig,
        particles::{Motion, ParticleConfig, ParticleFilter, Weighting},
        presence,
    },
    matching::{
        correlative::{Correlator, pyramid::Pyramid},
        field, map,
    },
    scan::{Bearing, ScanPoint},
    sensor_model::{
        BeamModel,
        beam_model::{BeamTable, learning::Learner},
        likelihood_field::{
            Field as _, FieldModel, LikelihoodField, Profile, draw::Canvas as _, stored,
            tiles::Tiles,
        },
    },
};

/// Points of a scan that are used.
const POINTS: usize = 16;

/// The memory that it needs.
pub struct Maps {
    cells: [u8; 256],
    other: [u8; 256],
    squares: [u16; 256],
    pyramid: [u8; 256],
    tiles: Option<Tiles<4, 16>>,
    correlator: Correlator<POINTS>,
}

impl Maps {
    /// Nothing in it.
    #[allow(clippy::new_without_default, reason = "for statics")]
    pub const fn new() -> Self {
        Self {
            cells: [0; 256],
            other: [0; 256],
            squares: [0; 256],
            pyramid: [0; 256],
            tiles: None,
            correlator: Correlator::new(),
        }
    }

    /// Calls every function for ever, with what the compiler does not know.
    pub fn forever(&mut self) -> ! {
        let points = black_box([ScanPoint::default(); POINTS]);
        let (flash, pose) = (black_box([0u8; 300]), black_box(Pose::IDENTITY));
        loop {
            let points = points.get(..black_box(POINTS)).unwrap_or(&[]);
            black_box(self.run(&flash, points, pose));
        }
    }

    /// Calls every function once; `None` as soon as one refuses.
    fn run(&mut self, flash: &[u8], points: &[ScanPoint], pose: Pose) -> Option<f32> {
        let shape = Shape::new(16, 16, 0.1, pose).ok()?;
        let model = FieldModel::new(0.9, 0.1, pose.x, pose.y).ok()?;
        let profile = Profile::new(&model);
        let mut sum = self.grids(shape, points, pose)?;
        {
            let grid = Grid::new(shape, &self.cells[..]).ok()?;
            let made =
                LikelihoodField::from_map(&grid, &self.squares, &profile, &mut self.other[..]);
            sum += made
                .ok()?
                .as_slice()
                .score(points, pose)
                .nats(profile.scale());
        }
        let stored = stored::parse(flash).ok()?;
        let pyramid = Pyramid::new(stored, &mut self.pyramid).ok()?;
        let mut robot = Localizer::<POINTS>::new(pyramid, LocalizerConfig::DEFAULT);
        robot.start_at(pose);
        robot.update(points, pose);
        while !robot.step(1000) {}
        sum += robot.pose().map_or(0.0, |pose| pose.x);
        sum += particles(stored, points, pose);
        let faces = [Point::new(pose.x, pose.y); 3];
        let found = presence::find(
            &mut self.correlator,
            &pyramid.local(),
            &faces,
            points,
            pose,
            &presence::PresenceConfig::DEFAULT,
        );
        sum += found.map_or(0.0, |found| found.cover);
        let tiles = Tiles::new(0.1, Point::new(pose.x, pose.y), *profile.scale()).ok()?;
        let tiles = self.tiles.insert(tiles);
        tiles.raise(points.len() as i32, 3, 200);
        tiles.roll(Point::new(pose.y, pose.x)).ok()?;
        sum += tiles.score(points, pose).share();
        let matched = field::align(tiles, points, pose, &field::FieldConfig::DEFAULT);
        sum += matched.map_or(0.0, |found| found.score);
        tiles.clear();
        Some(sum + beams(points, pose))
    }

    /// Occupancy, distances, rays, map against map.
    fn grids(&mut self, shape: Shape, points: &[ScanPoint], pose: Pose) -> Option<f32> {
        let mut grid = Grid::new(shape, &mut self.cells[..]).ok()?;
        occupancy::update(&mut grid, pose, points, &occupancy::UpdateConfig::DEFAULT);
        occupancy::decide(grid.cells_mut());
        map::smooth(&mut grid, map::Kernel::Five);
        let occupied = Grid::new(shape, &self.cells[..]).ok()?;
        let hit = cast::exact(&occupied, pose, Bearing(0), 3000, occupancy::is_occupied);
        let other = Grid::new(shape, &self.other[..]).ok()?;
        let found = map::align(&occupied, &other, pose, &map::MapConfig::DEFAULT);
        distance::roots(&self.squares, &mut self.pyramid);
        let hits = f32::from(u8::from(hit.is_some()));
        Some(hits + found.map_or(0.0, |found| found.correlation.common))
    }
}

/// A particle filter that is told a pose, and one that is not, weighed by either sensor model.
fn particles(field: LikelihoodField<&[u8]>, points: &[ScanPoint], pose: Pose) -> f32 {
    let table = BeamTable::new(&BeamModel::DEFAULT);
    let mut sum = 0.0;
    for weighting in [Weighting::LikelihoodField, Weighting::BeamModel(&table)] {
        let filter = ParticleFilter::<8, POINTS>::new(field, ParticleConfig::DEFAULT);
        let mut filter = filter.weighed_by(weighting);
        sum += filter.update(points).fit;
        filter.start_at(pose, (pose.x, pose.y));
        filter.moved(&Motion::by_wheels(pose, pose.x));
        filter.moved(&Motion::unknown(pose.y));
        sum += filter.update(points).pose.x;
        sum += filter.particles().map(|(_, weight)| weight).sum::<f32>();
    }
    sum
}

/// The beam model and its learning.
fn beams(points: &[ScanPoint], pose: Pose) -> f32 {
    let Ok(model) = (BeamModel {
        sigma: pose.x,
        ..BeamModel::DEFAULT
    })
    .checked() else {
        return 0.0;
    };
    let table = BeamTable::new(&model);
    let mut learner = Learner::new(model);
    let mut sum = 0;
    for point in points {
        sum += table.log_likelihood(Some(point.range()), 1000);
        learner.add(Some(f32::from(point.range()) * 1e-3), pose.y);
    }
    learner.forget(0.5);
    sum as f32 + learner.model().likelihood(None, pose.y)
}
