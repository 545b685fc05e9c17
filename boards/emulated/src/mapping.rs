//! Everything that maps, linked once so that `prove-no-panic` sees it.
//!
//! No file, no measurement: beams come from outside, and what is found goes there.

use core::hint::black_box;

use beamfix::{
    geometry::Pose,
    grid::{Grid, Shape, occupancy::UpdateConfig},
    odometry::OdometryConfig,
    pipeline::{Estimator as _, Mapper, RollingMapper, Tracker},
    scan::{Beam, Bearing, Range},
    slam::{SLICE, SlamConfig},
};
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

/// Beams of a revolution.
const BEAMS: usize = 64;

/// The memory that it needs.
pub struct Mapping {
    tracker: Tracker<Mapper<BEAMS, 8, 16, 32, 48, 64>, BEAMS>,
    rolling: Tracker<RollingMapper<BEAMS, 8, 48, 64>, BEAMS>,
    cells: [u8; 256],
}

impl Mapping {
    /// Nothing in it.
    #[allow(clippy::new_without_default, reason = "for statics")]
    pub const fn new() -> Self {
        Self {
            tracker: Tracker::new(Mapper::new(OdometryConfig::DEFAULT, SlamConfig::DEFAULT)),
            rolling: Tracker::new(RollingMapper::new(OdometryConfig::DEFAULT)),
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
        self.rolling.push_scan(beams.clone(), |revolution| {
            black_box(revolution.step.pose);
        });
        self.rolling.estimator_mut().work(SLICE);
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
        slam.save(&mut Nowhere, 0..range).ok()?;
        slam.load(&mut Nowhere, 0..range).ok()?;
        let slot = slam.least_informative()?;
        Some(slam.remove(slot)?.motion.x)
    }
}

/// A flash of which the compiler does not know what it holds.
struct Nowhere;

#[derive(Debug)]
struct Failed;

impl NorFlashError for Failed {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl ErrorType for Nowhere {
    type Error = Failed;
}

impl ReadNorFlash for Nowhere {
    const READ_SIZE: usize = 4;

    fn read(&mut self, _: u32, bytes: &mut [u8]) -> Result<(), Failed> {
        bytes.fill(black_box(0));
        black_box(Ok(()))
    }

    fn capacity(&self) -> usize {
        black_box(0)
    }
}

impl NorFlash for Nowhere {
    const WRITE_SIZE: usize = 8;
    const ERASE_SIZE: usize = 4096;

    fn erase(&mut self, _: u32, _: u32) -> Result<(), Failed> {
        black_box(Ok(()))
    }

    fn write(&mut self, _: u32, bytes: &[u8]) -> Result<(), Failed> {
        black_box(bytes);
        black_box(Ok(()))
    }
}
