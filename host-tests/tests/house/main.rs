//! What must hold of the code itself, and the figures that its pages state.

mod math;
mod plan;
mod public_api;
mod readme;
mod source;
