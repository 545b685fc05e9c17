//! What must hold of the code itself. A crate of its own, so that it takes seconds:
//! `cargo test --release -p beamfix-house -- --nocapture`.
#![cfg(test)]

mod math;
mod pages;
mod plan;
mod public_api;
mod rules;
mod source;
