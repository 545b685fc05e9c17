//! Everything that maps, linked once so that `prove-no-panic` sees it.
//!
//! No file, no measurement: beams come from outside, and what is found goes there.

use core::hint::black_box;

use beamfix::{
    geometry::Pose,
    grid::{Grid, Shape, occupancy::UpdateConfig},
    odometry::OdometryConfig,
    pipeline::{Estimator as _, Mapper, Tracker},
    scan::{Beam, Bearing, Range},
    slam::{SLICE, SlamConfig},
};

/// Beams of a revolution.
const BEAMS: usize = 64;

/// The memory that it needs.
pub struct Mapping {
    tracker: Tracker<Mapper<BEAMS, 8, 16, 32, 48, 64>, BEAMS>,
    cells: [u8; 256],
}

impl Mapping {
    /// Nothing in it.
    #[allow(clippy::new_without_default, reason = "for statics")]
    pub const fn new() -> Self {
        Self {
            tracker: Tracker::new(Mapper::new(OdometryConfig::DEFAULT, SlamConfig::DEFAULT)),
            cells: [0; 256],
        }
    }

    /// Calls every function for ever, with what the compiler does not know.
    pub fn forever(&mut self) -> ! {
        loop {
            let (range, pose) = (black_box(1000), black_box(Pose::IDENTITY));
            black_box(self.run(range, pose));
        }
    }

    fn run(&mut self, range: u32, pose: Pose) -> Option<f32> {
        let beams = (0..BEAMS as u16).map(|k| Beam {
            bearing: Bearing(k << 10),
            range: Range::from_mm(range),
            time_us: range,
            quality: 0,
        });
        self.tracker.push_wheels(range, pose);
        let mut x = 0.0;
        self.tracker
            .push_scan(beams, |revolution| x = revolution.step.pose.x);
        let mapper = self.tracker.estimator_mut();
        mapper.work(SLICE);
        let slam = mapper.slam_mut();
        let (low, high) = slam.extent(x)?;
        let shape = Shape::new(16, 16, 0.1, Pose::new(low.x, high.y, 0.0)).ok()?;
        let mut grid = Grid::new(shape, &mut self.cells[..]).ok()?;
        for slot in 0..8 {
            slam.draw(slot, &mut grid, &UpdateConfig::DEFAULT);
        }
        let slot = slam.least_informative()?;
        Some(slam.remove(slot)?.motion.x)
    }
}
