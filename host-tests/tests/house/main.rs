//! What must hold of the code itself, and the figures that its pages state.

mod math;
mod readme;
