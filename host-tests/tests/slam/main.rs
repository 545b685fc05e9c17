//! SLAM: its solver against one in doubles, and whole drives through simulated buildings.

mod building;
#[path = "../common/mod.rs"]
mod common;
mod drive;
mod nonsense;
mod solver;
