//! What of a place moves: doors, people who pass, people who follow.

use crate::pose::TruePose;
use crate::world::World;

/// A leaf that opens by a quarter turn about where its face starts.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Door {
    /// Which of the world's straight faces it is.
    face: usize,
    /// Its edge while it is shut.
    shut: [f64; 2],
    /// When it begins to open, and when it is open (s).
    between: [f64; 2],
}

/// Somebody who walks straight on.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Person {
    /// Which of the world's round faces it is.
    face: usize,
    /// Where at the start, and how fast (m, m/s).
    start: [f64; 2],
    velocity: [f64; 2],
}

/// Somebody who walks behind the robot.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Follower {
    /// Which of the world's round faces it is.
    face: usize,
    /// How far behind on the robot's way (m).
    behind: f64,
}

/// What of a place moves.
#[derive(Debug, Clone, Default)]
pub struct Moving {
    doors: Vec<Door>,
    people: Vec<Person>,
    followers: Vec<Follower>,
    /// Where the robot was, and how far it had driven (m): a few centimetres apart.
    trail: Vec<([f64; 2], f64)>,
    /// The robot at its start.
    first: Option<TruePose>,
}

/// Radius of a body (m).
const BODY: f64 = 0.2;
/// Two places of the robot's trail are so far apart (m).
const TRAIL: f64 = 0.02;

impl Moving {
    /// Whether nothing moves.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.doors.is_empty() && self.people.is_empty() && self.followers.is_empty()
    }

    /// Adds a door, shut, from its hinge to its edge, which opens between two times (s).
    pub(super) fn door(
        &mut self,
        world: &mut World,
        (hinge, shut): ([f64; 2], [f64; 2]),
        between: [f64; 2],
    ) {
        self.doors.push(Door {
            face: world.segments.len(),
            shut,
            between,
        });
        world.line(hinge, shut);
    }

    /// Adds somebody who walks on from a place at a velocity (m/s).
    pub(super) fn person(&mut self, world: &mut World, start: [f64; 2], velocity: [f64; 2]) {
        self.people.push(Person {
            face: world.circles.len(),
            start,
            velocity,
        });
        world.column(start, BODY);
    }

    /// Adds somebody who walks so far (m) behind the robot.
    pub(super) fn follower(&mut self, world: &mut World, behind: f64) {
        self.followers.push(Follower {
            face: world.circles.len(),
            behind,
        });
        world.column([0.0; 2], BODY);
    }

    /// Puts all out of the way: doors are open, nobody is near.
    pub(super) fn leave(&self, world: &mut World) {
        self.place(1e9, world);
        for follower in &self.followers {
            world.circles[follower.face].centre = [1e9; 2];
        }
    }

    /// Puts those who follow into `world` behind the robot, which has driven so far (m).
    pub fn follow(&mut self, robot: TruePose, driven: f64, world: &mut World) {
        if self.followers.is_empty() {
            return;
        }
        let first = *self.first.get_or_insert(robot);
        let is_on = |(_, before): &([f64; 2], f64)| driven - before > TRAIL;
        if self.trail.last().is_none_or(is_on) {
            self.trail.push(([robot.x, robot.y], driven));
        }
        for follower in &self.followers {
            let wanted = driven - follower.behind;
            let at = match self.trail.iter().rev().find(|(_, then)| *then <= wanted) {
                Some((place, _)) => *place,
                // Before the way began: straight behind where the robot stood.
                None => {
                    let place = first.then(TruePose::new(wanted, 0.0, 0.0));
                    [place.x, place.y]
                }
            };
            world.circles[follower.face].centre = at;
        }
    }

    /// Puts doors and people into `world` as they are at a time (s).
    pub fn place(&self, time: f64, world: &mut World) {
        for door in &self.doors {
            let [begin, end] = door.between;
            let share = ((time - begin) / (end - begin).max(1e-3)).clamp(0.0, 1.0);
            let angle = share * core::f64::consts::FRAC_PI_2;
            let (s, c) = (libm::sin(angle), libm::cos(angle));
            let face = &mut world.segments[door.face];
            let along = [0, 1].map(|k| door.shut[k] - face.from[k]);
            face.to = [
                face.from[0] + c * along[0] - s * along[1],
                face.from[1] + s * along[0] + c * along[1],
            ];
        }
        for person in &self.people {
            let at = [0, 1].map(|k| person.start[k] + time * person.velocity[k]);
            world.circles[person.face].centre = at;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::place::Place;

    fn parse(text: &str) -> Result<Place, String> {
        Place::parse(text, &mut |name| Err(format!("{name} is not there")))
    }

    #[test]
    fn doors_open_and_people_walk() {
        let text = "rectangle 8 6\ndoor 1 -1 1 1 5 8\nperson 0 2 180 0.5\nstart -2 0 0\nway 2 0\nwheels 7\ngyro 1 0.5\nknock 10 5";
        let place = parse(text).expect("a place");
        let ahead = |seconds: f64| {
            let mut world = place.world.clone();
            place.moving.place(seconds, &mut world);
            [
                world.cast([0.0, 0.0], [1.0, 0.0]),
                world.cast([-1.0, 0.0], [0.0, 1.0]),
            ]
        };
        // Shut until 5 s; the person stands at the lidar's left after two seconds.
        assert_eq!(ahead(0.0), [Some(1.0), Some(3.0)]);
        let [door, person] = ahead(2.0);
        assert_eq!(door, Some(1.0));
        assert!(person.is_some_and(|range| (range - 1.8).abs() < 1e-9));
        assert_eq!(ahead(8.0), [Some(4.0), Some(3.0)]);
        assert_eq!(place.nature.wheels_per_s, Some(7.0));
        assert_eq!(place.nature.gyro, Some([1.0, 0.5].map(f64::to_radians)));
        assert_eq!(place.nature.knock, Some([10.0, 5.0f64.to_radians()]));
    }

    #[test]
    fn a_follower_walks_where_the_robot_drove() {
        let text = "rectangle 20 20\nfollower 1\nstart 0 0 90\nway 0 4 4 4";
        let mut place = parse(text).expect("a place");
        let mut world = place.world.clone();
        let mut at = |x: f64, y: f64, driven: f64| {
            let robot = TruePose::new(x, y, 0.0);
            place.moving.follow(robot, driven, &mut world);
            world.circles[0].centre
        };
        let near = |a: [f64; 2], b: [f64; 2]| libm::hypot(a[0] - b[0], a[1] - b[1]) < 0.03;
        // Its start looked along x here: a metre behind it.
        assert!(near(at(0.0, 0.0, 0.0), [-1.0, 0.0]));
        for k in 0..400 {
            at(0.0, 0.01 * f64::from(k), 0.01 * f64::from(k));
        }
        assert!(near(at(0.0, 4.0, 4.0), [0.0, 3.0]));
        for k in 0..200 {
            at(0.01 * f64::from(k), 4.0, 4.0 + 0.01 * f64::from(k));
        }
        assert!(near(at(2.0, 4.0, 6.0), [1.0, 4.0]));
    }
}
