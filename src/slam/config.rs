//! Settings of SLAM.

/// Settings of [`Slam`](super::Slam): one set for every building and lidar it was tried with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlamConfig {
    /// A keyframe is kept this far from the last one (m). Default 1.0: a lidar that sees to one side only still sees half of
    /// what it saw.
    pub keyframe_distance: f32,
    /// And this much rotated from it (rad). Default 0.8.
    pub keyframe_rotation: f32,
    /// Least error of odometry from one keyframe to the next, beside what it tells: position (m). Default 0.01.
    pub min_chain_sigma: f32,
    /// And heading (rad). Default 0.0052: 0.3°.
    pub min_chain_heading_sigma: f32,
    /// Odometry's variances may be so many times what it tells before a loop counts as impossible. Default 16: errors of
    /// keyframes one after the other are not independent, as their sum takes them to be.
    pub max_drift_factor: f32,
    /// Least error of a match, beside what it tells (m). Default 0.01.
    pub min_loop_sigma: f32,
    /// And its heading (rad). Default 0.0052: 0.3°.
    pub min_loop_heading_sigma: f32,
    /// Keyframes at most this far away see the same place (m). Default 3.
    pub reach: f32,
    /// Farther ones are looked at where the graph tells no better, up to this distance (m). Default 8.
    pub max_reach: f32,
    /// Keyframes of a lidar that does not see all around must face alike to this angle (rad). Default 0.9.
    pub max_rotation: f32,
    /// Keyframes fewer than this apart are no loop. Default 8.
    pub min_apart: u32,
    /// Most loops that start at a keyframe before it is not looked at again. Default 3: more cost room in the solver.
    pub max_loops: u8,
    /// Least score of a match (see [`Match::score`](crate::matching::Match::score)). Default 0.45.
    pub min_score: f32,
    /// Least share of the beams that meet what the earlier keyframes saw. Default 0.5.
    pub min_overlap: f32,
    /// Largest score of another pose, as a share of the match's. Default 0.9.
    pub max_rival: f32,
    /// Two loops contradict each other where they miss closing a cycle by more (m). Default 0.25.
    pub max_gap: f32,
    /// And by more in heading (rad). Default 0.06.
    pub max_heading_gap: f32,
    /// Loops that must close a cycle with a new one where the graph cannot tell whether it is right. Default 2.
    pub min_votes: u8,
    /// A robot that was carried knows where it is in the map once keyframes so far apart agree (m). Default 6: a room that looks
    /// like another one is left before.
    pub min_spread: f32,
}

impl SlamConfig {
    /// For buildings and a lidar of 5 to 15 revolutions a second.
    pub const DEFAULT: Self = Self {
        keyframe_distance: 1.0,
        keyframe_rotation: 0.8,
        min_chain_sigma: 0.01,
        min_chain_heading_sigma: 0.0052,
        max_drift_factor: 16.0,
        min_loop_sigma: 0.01,
        min_loop_heading_sigma: 0.0052,
        reach: 3.0,
        max_reach: 8.0,
        max_rotation: 0.9,
        min_apart: 8,
        max_loops: 3,
        min_score: 0.45,
        min_overlap: 0.5,
        max_rival: 0.9,
        max_gap: 0.25,
        max_heading_gap: 0.06,
        min_votes: 2,
        min_spread: 6.0,
    };
}

impl Default for SlamConfig {
    fn default() -> Self {
        Self::DEFAULT
    }
}
