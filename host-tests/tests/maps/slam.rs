//! SLAM: its solver against one in doubles, and whole drives through simulated buildings.

mod building;
mod carried;
pub mod drive;
mod nonsense;
mod recorded;
mod solver;
mod standing;
mod storage;
