//! From bytes to poses: the one road that a board, a PC, C and a browser share.
//!
//! ```text
//! bytes ─▶ Protocol ─▶ beams ─▶ Assembler ─▶ revolution ─▶ Estimator ─▶ step
//! wheels, gyroscope ─▶ motion since the last revolution ───┘
//! ```
//!
//! [`Pipeline`] takes bytes of a lidar, [`Tracker`] below it takes beams or whole scans, for logs without bytes. Which
//! lidar and which estimator are types: [`Odometry`] needs nothing but scans,
//! [`MapLocalizer`] a map too.
//!
//! Wheels, gyroscope and bytes have a time (µs, wrapping) on the caller's clock: [`Pipeline::set_time`] says when the bytes
//! pushed next came in, wheels and gyroscope bring theirs. Beams have the lidar's own times where it has a clock. For wheels
//! and gyroscope a revolution ends when the bytes that complete it come in, up to a packet after its last beam. The pose by
//! the wheels there is interpolated, or extrapolated over up to three of their messages' intervals: messages may come at any
//! rate from two a second on, and one may be lost of those that come four times a second or more.
//!
//! An estimator that has work to do between two revolutions, such as [`MapLocalizer`]'s search for a lost pose or a map's
//! loops, does it in [`Estimator::work`], which nothing here calls: `pipeline.tracker_mut().estimator_mut().work(budget)`.

mod estimator;
mod gyro;
mod late;
mod map_localizer;
#[cfg(feature = "slam")]
mod mapper;
#[cfg(feature = "particles")]
mod particle_localizer;
#[cfg(feature = "slam")]
mod rolling;
mod seen;
mod tracker;
mod wheels;

pub use estimator::{Estimate, Estimator, Verdict};
pub use late::Late;
pub use map_localizer::{Located, MapLocalizer};
#[cfg(feature = "slam")]
pub use mapper::{Mapped, Mapper, Mapper192k, Mapper512k};
#[cfg(feature = "particles")]
pub use particle_localizer::ParticleLocalizer;
#[cfg(feature = "slam")]
pub use rolling::{Mapper64k, RollingMapper, RollingStep};
pub use tracker::{Revolution, Tracker};

use crate::{
    lidar::{Packet, Protocol},
    odometry::{Odometry, OdometryConfig},
};

/// A lidar's bytes, wheels and a gyroscope in, a step for each revolution out.
///
/// The parser, one packet, and a [`Tracker`]; N is the most beams of a revolution.
///
/// ```
/// use beamfix::lidar::parsers;
/// use beamfix::odometry::{Odometry, OdometryConfig};
/// use beamfix::pipeline::{Pipeline, Revolution};
///
/// let odometry = Odometry::<456>::new(OdometryConfig::DEFAULT);
/// let mut pipeline = Pipeline::new(parsers::Ldrobot::new(), odometry);
/// pipeline.set_time(20_000); // what the board's clock says (µs)
/// pipeline.push(&[0x54, 0x2c], &mut |revolution: Revolution<Odometry<456>, 456>| {
///     println!("{:?}", revolution.step.pose);
/// });
/// ```
#[derive(Debug)]
pub struct Pipeline<P: Protocol, E, const N: usize> {
    lidar: P,
    /// Here rather than on the stack, where it would lie below a match.
    packet: Late<P::Packet>,
    tracker: Tracker<E, N>,
}

/// What takes the results of a [`Pipeline`]. A closure over [`Revolution`] is one.
pub trait Sink<P, E: Estimator<N>, const N: usize> {
    /// A revolution went through the estimator.
    fn revolution(&mut self, revolution: Revolution<'_, E, N>);

    /// All beams of a packet were taken; the revolution that it completed was given before.
    fn packet(&mut self, packet: &P) {
        let _ = packet;
    }
}

impl<F, P, E: Estimator<N>, const N: usize> Sink<P, E, N> for F
where
    F: FnMut(Revolution<'_, E, N>),
{
    fn revolution(&mut self, revolution: Revolution<'_, E, N>) {
        self(revolution);
    }
}

impl<P: Protocol, E: Estimator<N>, const N: usize> Pipeline<P, E, N> {
    /// Waits for the first whole revolution.
    #[must_use]
    pub const fn new(lidar: P, estimator: E) -> Self {
        Self {
            lidar,
            packet: Late::Missing,
            tracker: Tracker::new(estimator),
        }
    }

    /// Says when the bytes and beams pushed next came in (µs, wrapping).
    pub fn set_time(&mut self, now_us: u32) {
        self.lidar.arrived(now_us);
        self.tracker.set_time(now_us);
    }

    /// Takes bytes of the lidar, in pieces of any size: the steps are the same.
    ///
    /// The byte that completes a revolution costs what the estimator's update does; a board must buffer what comes
    /// meanwhile.
    pub fn push(&mut self, bytes: &[u8], sink: &mut impl Sink<P::Packet, E, N>) {
        let mut rest = bytes;
        while !rest.is_empty() {
            let taken = self.push_packet(rest, sink);
            rest = rest.get(taken..).unwrap_or_default();
        }
    }

    /// Takes bytes of the lidar up to the end of a packet; gives their number. For who must send a packet's results
    /// before there is room for the next one's.
    pub fn push_packet(&mut self, bytes: &[u8], sink: &mut impl Sink<P::Packet, E, N>) -> usize {
        let taken = self.receive(bytes);
        self.pass_on(sink);
        taken
    }

    /// Takes the packets that the parser has held back: for the end of a recording.
    pub fn finish(&mut self, sink: &mut impl Sink<P::Packet, E, N>) {
        loop {
            let Some(packet) = self.lidar.pull() else {
                return;
            };
            self.packet = Late::Given(packet);
            self.pass_on(sink);
        }
    }

    /// Apart, so that what the parser needs is not on the stack during a match.
    #[inline(never)]
    fn receive(&mut self, bytes: &[u8]) -> usize {
        let mut taken = 0;
        // The last packet has been passed on: without bytes there is none.
        self.packet = Late::Missing;
        for &byte in bytes {
            taken += 1;
            if let Some(packet) = self.lidar.push(byte) {
                self.packet = Late::Given(packet);
                break;
            }
        }
        taken
    }

    fn pass_on(&mut self, sink: &mut impl Sink<P::Packet, E, N>) {
        if let Late::Given(packet) = &self.packet {
            let (beams, start) = (packet.beams(), packet.revolution_start());
            self.tracker
                .push_packet(beams, start, |revolution| sink.revolution(revolution));
            sink.packet(packet);
        }
    }

    /// The packet that the bytes pushed last have completed.
    #[cfg(feature = "internals")]
    pub const fn packet(&self) -> Option<&P::Packet> {
        self.packet.as_ref()
    }

    /// The parser, for its counters.
    pub const fn lidar(&self) -> &P {
        &self.lidar
    }

    /// The parser, to tell it what the lidar has said of itself.
    #[cfg(feature = "internals")]
    pub const fn lidar_mut(&mut self) -> &mut P {
        &mut self.lidar
    }

    /// What stands behind the parser, for its counters and poses.
    pub const fn tracker(&self) -> &Tracker<E, N> {
        &self.tracker
    }

    /// What stands behind the parser, to give it wheels, a gyroscope, or beams that came without bytes.
    pub const fn tracker_mut(&mut self) -> &mut Tracker<E, N> {
        &mut self.tracker
    }

    /// What stands behind the parser, at the end.
    #[cfg(feature = "internals")]
    #[must_use]
    pub fn into_tracker(self) -> Tracker<E, N> {
        self.tracker
    }
}

impl<P: Protocol, const N: usize> Pipeline<Late<P>, Odometry<N>, N> {
    /// All bytes zero: a static of it takes no flash. To be used after [`Pipeline::set_up`].
    ///
    /// ```
    /// use beamfix::{Odometry, OdometryConfig, Pipeline, lidar::parsers, pipeline::Late};
    ///
    /// type Robot = Pipeline<Late<parsers::Ldrobot>, Odometry<456>, 456>;
    ///
    /// fn start(robot: &mut Robot) {
    ///     robot.set_up(parsers::Ldrobot::new(), OdometryConfig::DEFAULT);
    /// }
    /// # start(&mut Box::new(Robot::ZERO));
    /// ```
    pub const ZERO: Self = Self {
        lidar: Late::Missing,
        packet: Late::Missing,
        tracker: Tracker::zero(Odometry::ZERO),
    };

    /// Begins anew with this parser and these settings, in its place: nothing large is on the stack meanwhile.
    pub fn set_up(&mut self, lidar: P, config: OdometryConfig) {
        self.lidar = Late::Given(lidar);
        self.packet = Late::Missing;
        self.tracker.restart();
        self.tracker.estimator_mut().restart(config);
    }
}
