//! From the bytes of a cheap laser rangefinder to a trustworthy pose, on a microcontroller.
//!
//! ```text
//! bytes ─▶ packet ─▶ beams ─▶ scan ─▶ points ─▶ match ─▶ pose
//!       lidar               scan               matching    odometry | localization | slam
//! └────────────────────────── pipeline ──────────────────────────┘
//! ```
//!
//! Most users need three types: the parser of their lidar ([`lidar`]), an estimator ([`Odometry`], or a [`Localizer`]
//! where there is a map), and the [`Pipeline`] that carries bytes from one to the other:
//!
//! ```
//! use beamfix::{Odometry, OdometryConfig, Pipeline, Revolution, lidar::parsers};
//!
//! let odometry = Odometry::<456>::new(OdometryConfig::DEFAULT);
//! let mut pipeline = Pipeline::new(parsers::Ldrobot::new(), odometry);
//! pipeline.set_time(20_000); // µs, by the board's clock
//! pipeline.push(&[0x54, 0x2c], &mut |revolution: Revolution<Odometry<456>, 456>| {
//!     let step = revolution.step;
//!     println!("{:?} ± {:?}: {:?}", step.pose, step.covariance, step.outcome);
//! });
//! ```
//!
//! Every arrow of the drawing is also a function that can be called alone: [`lidar`] gives beams from bytes, [`scan`] a scan
//! from beams, [`matching`] the motion between two scans or between a scan and a map, [`grid`] and [`sensor_model`] the maps.
//! Nothing here does I/O, allocates, waits, keeps a `static` or panics; the same source gives the same bits on a PC and on
//! a Cortex-M0.
//!
//! Frames and units: x forward, y left, angles counter-clockwise; metres, radians, seconds in `f32`. Times on a clock are
//! microseconds that wrap. A pose `a_from_b` places frame b in frame a.
//!
//! | feature | what it adds |
//! | --- | --- |
//! | `embedded-io`, `embedded-io-async`, `embedded-hal-nb` | a lidar read over that crate's UART trait |
//! | `embedded-storage` | with `slam`: a map saved in flash and loaded again |
//! | `defmt` | `defmt::Format` on the public types |
//! | `modular` | ICP with every stage a choice, for study: what the fast one does, step by step |
//! | `slam` | maps as estimators of the pipeline: `Mapper64k`, which rolls with the robot, and `Mapper192k` and `Mapper512k`, which close loops |
//! | `particles` | localization in a map by particles |
//! | `internals` | the workings, for this project's own tests; nothing in it is stable |
#![no_std]
#![forbid(unsafe_code)]
#![deny(missing_docs)]
// Some of what the rooms offer each other is used by tests and by boards that count, behind `internals`, alone.
#![cfg_attr(not(feature = "internals"), allow(dead_code, unused_imports))]

#[cfg(not(feature = "internals"))]
pub(crate) mod config;
#[cfg(feature = "internals")]
pub mod config;
pub mod geometry;
pub mod grid;
#[cfg(not(feature = "internals"))]
pub(crate) mod keyframe;
#[cfg(feature = "internals")]
pub mod keyframe;
pub mod lidar;
#[cfg(not(feature = "internals"))]
pub(crate) mod linalg;
#[cfg(feature = "internals")]
pub mod linalg;
pub mod localization;
pub mod matching;
#[cfg(not(feature = "internals"))]
pub(crate) mod math;
#[cfg(feature = "internals")]
pub mod math;
pub mod odometry;
pub mod pipeline;
pub mod scan;
pub mod sensor_model;
#[cfg(not(feature = "slam"))]
pub(crate) mod slam;
#[cfg(feature = "slam")]
pub mod slam;

pub use config::ConfigError;
pub use geometry::{EgoMotion, Point, Pose, Twist};
pub use grid::Grid;
pub use lidar::{Model, Protocol};
pub use linalg::{Covariance, Information};
pub use localization::{Localizer, LocalizerConfig};
pub use matching::{Match, MatchError};
pub use odometry::{Odometry, OdometryConfig, Refusal, Step};
pub use pipeline::{MapLocalizer, Pipeline, Revolution, Tracker};
pub use scan::{Assembler, Beam, Mount, Scan};
pub use sensor_model::LikelihoodField;

/// The README's example compiles.
#[cfg(all(doctest, feature = "embedded-io"))]
#[doc = include_str!("../README.md")]
struct Readme;
