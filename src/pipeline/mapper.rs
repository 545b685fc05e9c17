//! Mapping as an estimator: odometry, and SLAM over its points, in the memory of one controller.

use super::estimator::{Estimate, Estimator, Verdict};
use crate::{
    geometry::{EgoMotion, Pose},
    linalg::Covariance,
    odometry::{Odometry, OdometryConfig, Step},
    scan::Scan,
    slam::{Placed, Slam, SlamConfig},
};

/// Mapping for a controller with 192 KB of RAM: 224 keyframes of 144 points, 720 beams a revolution.
pub type Mapper192k = Mapper<720, 224, 512, 880, 144, 360>;
/// Mapping for a controller with 512 KB of RAM: 560 keyframes of 180 points, 1024 beams a revolution.
pub type Mapper512k = Mapper<1024, 560, 1400, 2800, 180, 720>;

/// An [`Odometry`] of N beams a revolution, and a [`Slam`] of K keyframes, E edges, L blocks, B points and V directions: an
/// estimator for a [`Tracker`](super::Tracker) or a [`Pipeline`](super::Pipeline), best in a static.
///
/// A scan costs what the odometry does; all else is [`work`](Estimator::work), to be called between scans until it says that
/// nothing is left. The frame is the one in which the robot started.
///
/// ```
/// use beamfix::{
///     Beam, OdometryConfig, Tracker,
///     pipeline::{Estimator as _, Mapper192k},
///     scan::{Bearing, Range},
///     slam::{SLICE, SlamConfig},
/// };
/// let mapper = Mapper192k::new(OdometryConfig::DEFAULT, SlamConfig::DEFAULT);
/// let mut robot = Box::new(Tracker::<_, 720>::new(mapper)); // on a board a static
/// // A round room of 3 m, seen once a beam of 2 degrees.
/// let beams = (0..180).map(|k| Beam {
///     bearing: Bearing(k * 364),
///     range: Range::from_mm(3000),
///     time_us: u32::from(k),
///     quality: 0,
/// });
/// robot.push_scan(beams, |revolution| assert!(revolution.step.is_located));
/// while !robot.estimator_mut().work(SLICE) {}
/// let map = robot.estimator().slam();
/// assert_eq!(map.keyframes().count(), 1);
/// ```
#[derive(Debug, Clone)]
pub struct Mapper<
    const N: usize,
    const K: usize,
    const E: usize,
    const L: usize,
    const B: usize,
    const V: usize,
> {
    odometry: Odometry<N>,
    slam: Slam<K, E, L, B, V>,
    robot_from_lidar: Pose,
}

/// What is known of the robot in its map after a scan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mapped {
    /// Robot at the scan's end, in the map as it is now (m, rad); unless it is located, in a frame of its own.
    pub pose: Pose,
    /// Whether `pose` is in the map: not where the robot was carried, until it is known where to.
    pub is_located: bool,
    /// In which keyframe's frame the lidar is: this stays true when the map changes.
    pub placed: Option<Placed>,
    /// What odometry says, in its own frame.
    pub odometry: Step,
}

impl<const N: usize, const K: usize, const E: usize, const L: usize, const B: usize, const V: usize>
    Mapper<N, K, E, L, B, V>
{
    /// Waits for the first scan.
    #[must_use]
    pub const fn new(odometry: OdometryConfig, slam: SlamConfig) -> Self {
        Self {
            robot_from_lidar: odometry.points.mount.robot_from_lidar,
            odometry: Odometry::new(odometry),
            slam: Slam::new(slam),
        }
    }

    /// Gives one that has seen nothing other settings of its odometry, in its place: nothing large is on the stack meanwhile.
    #[cfg(feature = "internals")]
    pub fn set_up(&mut self, odometry: OdometryConfig) {
        self.robot_from_lidar = odometry.points.mount.robot_from_lidar;
        self.odometry.restart(odometry);
    }

    /// The map, for its keyframes and counters.
    #[must_use]
    pub const fn slam(&self) -> &Slam<K, E, L, B, V> {
        &self.slam
    }

    /// The map, for a caller that wants to know which keyframes are removed: between two scans it then calls
    /// [`Slam::step`] and [`Slam::take_merged`] itself instead of [`Estimator::work`].
    pub const fn slam_mut(&mut self) -> &mut Slam<K, E, L, B, V> {
        &mut self.slam
    }
}

impl<const N: usize, const K: usize, const E: usize, const L: usize, const B: usize, const V: usize>
    Estimator<N> for Mapper<N, K, E, L, B, V>
{
    type Step = Mapped;

    fn update(&mut self, scan: &Scan<N>, ego: EgoMotion) -> Mapped {
        let odometry = self.odometry.update(scan, ego);
        let points = self.odometry.points().as_slice();
        let mount = self.robot_from_lidar;
        let covariance = self.odometry.settled_covariance();
        let placed = self.slam.update(odometry.pose, covariance, mount, points);
        let lidar = placed.and_then(|placed| self.slam.pose(&placed));
        Mapped {
            pose: lidar.map_or(odometry.pose, |lidar| lidar * mount.inverse()),
            is_located: self.slam.is_located(),
            placed,
            odometry,
        }
    }

    /// The budget counts hundreds of instructions here: see [`Slam::step`] and [`SLICE`](crate::slam::SLICE).
    fn work(&mut self, budget: u32) -> bool {
        let more = self.slam.step(budget);
        // Where a keyframe went matters only to those who keep old poses.
        let removed = self.slam.take_merged();
        !more && removed.is_none()
    }
}

impl Estimate for Mapped {
    fn pose(&self) -> Option<Pose> {
        self.is_located.then_some(self.pose)
    }

    /// Not known: a graph's marginals are not computed. What odometry lost since the last keyframe is no bound.
    fn covariance(&self) -> Option<Covariance> {
        None
    }

    fn verdict(&self) -> Verdict {
        match self.is_located {
            true => self.odometry.verdict(),
            false => Verdict::Unknown,
        }
    }
}
