//! The `beamfix` tool.
fn main() {}
