//! Iterative closest point: the pose at which the points of a scan lie on the surfaces of another one.
//!
//! A point is paired with the surface that it seems to lie on, the scan is moved to where the pairs fit best, and both are
//! repeated until nothing moves. The distance that is made small is that *across* the surface (point to line), so that a
//! scan slides along a wall instead of sticking to the very points that the other scan happened to hit.
//!
//! There are two:
//!
//! - `projective` is the product: one fixed mixture of stages in integers, about 0.4 million instructions a match, with
//!   several starts for bad guesses. It pairs by *projection*: both scans come from the same lidar, so the surface in a
//!   point's direction is found in a table, without a search.
//! - `modular` (feature `modular`) is the textbook: every stage a type to choose, in `f32`. Take it to compare, to teach, or where a scene
//!   wants a stage that the fast one lacks.
//!
//! The second is the first one's specification: `modular::Stages::projective` are the choices that the first has built in,
//! and a test (`host-tests/tests/matching/staged.rs`) holds the two together. They share the judge of degenerate directions
//! and covariances, the question which beams lie on one surface, and [`Match`](super::Match).

#[cfg(not(feature = "modular"))]
pub(crate) mod modular;
#[cfg(feature = "modular")]
pub mod modular;
#[cfg(not(feature = "internals"))]
pub(crate) mod projective;
#[cfg(feature = "internals")]
pub mod projective;

pub(crate) use projective::{Guess, Rivals, align_from, remove_companions};
pub use projective::{IcpConfig, Reference, Search, align};
#[cfg(not(feature = "internals"))]
pub(crate) use projective::{Line, align_observed, smooth_towards};
#[cfg(feature = "internals")]
pub use projective::{Line, align_observed, smooth_towards};
