//! Places to drive in: a world, where the robot starts, and its way; built in, or described by a text.
//!
//! ```text
//! # Metres and degrees; what follows a number sign is a remark.
//! wall 0 0  5 0  5 4          straight faces from point to point
//! box 1 1  2 1.5  30          two opposite corners, and an angle if it is turned
//! column 3 2  0.2             centre and radius
//! ros-map flat.yaml           the walls of a map
//! map 0.5                     a drawing, the first cell's corner at 0 0: # is a wall, S the start, letters the way in their order
//! ####
//! #Sa#
//! ####
//! end
//! glass 0 0  1 0              a face of glass; mirror and black are others
//! rectangle 5 4               walls around the middle, so long and so wide
//! start 0.5 0.5  90
//! way 1 1  2 3                corners of the robot's way, in any number of lines
//! drive omni                  it rolls to all sides; ackermann 0.6: it drives no smaller circle
//! door 1 0  2 0  5 8          a leaf from its hinge to its edge, which opens by a quarter turn from 5 s to 8 s
//! person 1 2  90 0.8          somebody who walks on from there (degrees, m/s)
//! follower 0.9                somebody who walks so far behind the robot on its own way
//! post -0.1 0.05  0.01        a post of the robot itself, at this place in its frame, that its lidar sees
//! wheels 7                    the wheels tell where they are so many times a second, not with each revolution
//! gyro 0.5 0.2                a gyroscope with so much bias and noise (deg/s), a hundred times a second
//! knock 10 5                  after 10 s the lidar sits turned by 5 degrees in its mount
//! slip 2  30 100              so many slips a second, each by 30 to 100 % of what a wheel rolls
//! lidar bias 0.02             what the lidar gets wrong: ranges are too long (m), noise by range (share of it),
//! lidar distance 0.01         and where a face is grazed, the width of a beam (degrees), which mixes what lies at an edge,
//! lidar grazing 1             and the motor's speed, which sways by a share of it
//! lidar width 0.3
//! lidar sway 0.05
//! ```

mod built_in;
mod drawing;
mod moving;
mod nature;
mod text;

pub use built_in::NAMES;
pub use moving::Moving;
pub use nature::Nature;
pub use text::ReadMap;

use crate::pose::TruePose;
use crate::world::{Circle, World};

/// Where a robot drives, and how.
#[derive(Debug, Clone, Default)]
pub struct Place {
    /// What stands around.
    pub world: World,
    /// Where it starts.
    pub start: TruePose,
    /// Corners of its way; it stops at the last one.
    pub way: Vec<[f64; 2]>,
    /// What robot and lidar are like there.
    pub nature: Nature,
    /// What moves there.
    pub moving: Moving,
    /// Posts of the robot itself, in its frame.
    pub posts: Vec<Circle>,
}

impl Place {
    /// Refuses a way that comes nearer to anything than a robot is wide.
    pub(crate) fn check(&self) -> Result<(), String> {
        /// Half the width of the robot (m).
        const NEAREST: f64 = 0.12;
        // Doors open, people pass and follow: what moves is met or not.
        let mut world = self.world.clone();
        self.moving.leave(&mut world);
        if self.way.is_empty() {
            return Err("no way: `way X Y ...`, or letters in a drawing".into());
        }
        let mut from = [self.start.x, self.start.y];
        for &to in &self.way {
            for k in 0..=20 {
                let share = f64::from(k) / 20.0;
                let place = [0, 1].map(|axis: usize| from[axis] + share * (to[axis] - from[axis]));
                let near = world.clearance(place);
                if near < NEAREST {
                    return Err(format!(
                        "the way from {:.2} {:.2} to {:.2} {:.2} comes within {near:.2} m of something at {:.2} {:.2}",
                        from[0], from[1], to[0], to[1], place[0], place[1]
                    ));
                }
            }
            from = to;
        }
        Ok(())
    }
}
