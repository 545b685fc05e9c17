//! Things that move while the robot drives: people who walk along, followers, crowds, the robot's own mast.

use super::course::Course;
use super::noise::Noise;
use super::pose::TruePose;
use super::world::World;

/// A thing that moves: its shape in a frame of its own, and where that frame is.
#[derive(Debug, Clone)]
pub struct Thing {
    /// Faces in the thing's frame.
    pub shape: Shape,
    /// Where the thing's frame is.
    pub moves: Moves,
}

/// What a thing looks like.
#[derive(Debug, Clone)]
pub enum Shape {
    /// A person's body: a circle of this radius (m).
    Body(f64),
    /// A person's two legs, 20 cm apart, that swing by 20 cm once a second while walking.
    Legs,
    /// A flat board across the direction of view, so wide (m).
    Board(f64),
}

/// How a thing moves.
#[derive(Debug, Clone)]
pub enum Moves {
    /// With the robot, at this place in its frame.
    Fixed(TruePose),
    /// With the robot at this place in its frame, swaying along by so much (m) with every step.
    Along(TruePose, f64),
    /// On the robot's own way, so many seconds behind (negative: ahead).
    Trailing(f64),
    /// On a straight line: pose at the start and speed along its heading (m/s).
    Straight(TruePose, f64),
}

impl Thing {
    /// Adds the thing to `world` as it stands at `time` (s).
    pub fn place(&self, course: &Course, time: f64, world: &mut World) {
        /// Steps a second of somebody who walks.
        const STEPS: f64 = 1.9;
        let phase = core::f64::consts::TAU * STEPS * time;
        let robot = course.truth(time);
        let at = match self.moves {
            Moves::Fixed(offset) => robot.then(offset),
            Moves::Along(offset, sway) => {
                let step = sway * libm::sin(0.7 * phase);
                robot.then(TruePose {
                    x: offset.x + step,
                    ..offset
                })
            }
            Moves::Trailing(seconds) => course.truth(time - seconds),
            Moves::Straight(start, speed) => start.then(TruePose::new(speed * time, 0.0, 0.0)),
        };
        match self.shape {
            Shape::Body(radius) => world.column([at.x, at.y], radius),
            Shape::Legs => {
                for (side, swing) in [(0.1, 1.0), (-0.1, -1.0)] {
                    let leg = at.then(TruePose::new(
                        0.2 * swing * libm::sin(0.5 * phase),
                        side,
                        0.0,
                    ));
                    world.column([leg.x, leg.y], 0.06);
                }
            }
            Shape::Board(wide) => {
                let end = |side: f64| {
                    let end = at.then(TruePose::new(0.0, side * wide, 0.0));
                    [end.x, end.y]
                };
                world.line(end(-0.5), end(0.5));
            }
        }
    }

    /// The same thing in a mirror that lies along the x axis.
    #[must_use]
    pub fn mirrored(self) -> Self {
        let moves = match self.moves {
            Moves::Fixed(pose) => Moves::Fixed(pose.mirrored()),
            Moves::Along(pose, sway) => Moves::Along(pose.mirrored(), sway),
            Moves::Trailing(seconds) => Moves::Trailing(seconds),
            Moves::Straight(pose, speed) => Moves::Straight(pose.mirrored(), speed),
        };
        Self { moves, ..self }
    }
}

/// `count` people at random places inside `low`..`high` who all walk along `heading` (rad) at `speed` (m/s).
pub fn crowd(
    count: usize,
    (low, high): ([f64; 2], [f64; 2]),
    heading: f64,
    speed: f64,
    noise: &mut Noise,
) -> Vec<Thing> {
    (0..count)
        .map(|_| Thing {
            shape: Shape::Body(0.2),
            moves: Moves::Straight(
                TruePose::new(
                    noise.even(low[0], high[0]),
                    noise.even(low[1], high[1]),
                    heading,
                ),
                speed * noise.even(0.9, 1.1),
            ),
        })
        .collect()
}
