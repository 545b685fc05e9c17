//! The part of a world that the next beams can meet: a few of its faces, where a lidar turns on by a little from beam to beam.

use super::pose::{TruePose, wrap};
use super::world::{Surface, World};

/// A wedge of a world, as seen from one place in one direction. What lies in it is met as in the whole world, bit for bit.
#[derive(Debug, Clone, Default)]
pub struct View {
    /// The faces that reach into the wedge, in their order in the world.
    part: World,
    /// The wedge; `None`: of a world with mirrors, or none yet.
    wedge: Option<Wedge>,
    /// The last beam's direction (rad).
    last: f64,
}

/// Where beams start, and where they look.
#[derive(Debug, Clone, Copy)]
struct Wedge {
    from: [f64; 2],
    /// Its middle (rad).
    direction: f64,
}

/// Half the width of the wedge (rad).
const HALF: f64 = 0.35;
/// So far from the wedge's own corner (m) a beam may start.
const NEAR: f64 = 0.05;
/// More than rounding makes of any of these.
const ROUNDING: f64 = 1e-6;

impl View {
    /// Forgets what it holds: the world has changed.
    pub fn forget(&mut self) {
        self.wedge = None;
    }

    /// What a beam from `sensor` in `direction` (rad), and so wide (rad), can meet of `world`.
    pub fn towards<'a>(
        &'a mut self,
        world: &'a World,
        sensor: TruePose,
        direction: f64,
        width: f64,
    ) -> &'a World {
        let is_seen = self
            .wedge
            .is_some_and(|wedge| wedge.holds(sensor, direction, width));
        let before = std::mem::replace(&mut self.last, direction);
        if is_seen {
            return &self.part;
        }
        let ahead = HALF - 0.5 * width - 0.02;
        if ahead < 0.0 {
            return world;
        }
        // The wedge lies ahead: where the lidar turns to.
        let turned = wrap(direction - before);
        let wedge = Wedge {
            from: [sensor.x, sensor.y],
            direction: direction + ahead.copysign(turned),
        };
        if wedge.cut(world, &mut self.part) {
            self.wedge = Some(wedge);
            &self.part
        } else {
            self.wedge = None;
            world
        }
    }
}

impl Wedge {
    /// Whether a beam stays in it.
    fn holds(&self, sensor: TruePose, direction: f64, width: f64) -> bool {
        let near = |off: f64| off.abs() + 0.5 * width < HALF - ROUNDING;
        let off = [sensor.x - self.from[0], sensor.y - self.from[1]];
        off[0] * off[0] + off[1] * off[1] < (NEAR - ROUNDING) * (NEAR - ROUNDING)
            && (near(direction - self.direction) || near(wrap(direction - self.direction)))
    }

    /// Puts the faces that reach into it, or nearly, into `part`; `false` where there is a mirror, which shows all others.
    fn cut(&self, world: &World, part: &mut World) -> bool {
        part.segments.clear();
        part.circles.clear();
        let towards = |angle: f64| [libm::cos(angle), libm::sin(angle)];
        let [left, right] = [HALF, -HALF].map(|side| towards(self.direction + side));
        // What is farther than [`NEAR`] from the corner to one of these sides is met by none of the beams.
        let sides = [
            [-left[1], left[0]],
            [right[1], -right[0]],
            towards(self.direction + core::f64::consts::PI),
        ];
        let off = |side: &[f64; 2], place: [f64; 2]| {
            side[0] * (place[0] - self.from[0]) + side[1] * (place[1] - self.from[1])
        };
        for segment in &world.segments {
            if segment.surface == Surface::Mirror {
                return false;
            }
            let is_outside = |side| off(side, segment.from).min(off(side, segment.to)) > NEAR;
            if !sides.iter().any(is_outside) {
                part.segments.push(*segment);
            }
        }
        for circle in &world.circles {
            let is_outside = |side| off(side, circle.centre) - circle.radius > NEAR;
            if !sides.iter().any(is_outside) {
                part.circles.push(*circle);
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::place::{NAMES, Place};

    /// Beams as a lidar measures them on the way, and some from elsewhere.
    #[test]
    fn what_a_view_shows_is_what_the_world_shows() {
        let (mut beams, mut hits, mut faces) = (0, 0, [0, 0]);
        for (name, _) in NAMES {
            let Place { world, start, .. } = Place::named(name, 1).expect(name);
            for (step, width) in [(0.014, 0.0), (-0.014, 0.01), (2.5, 0.0), (-0.3, 0.3)] {
                let mut view = View::default();
                for k in 0..2000 {
                    let k = f64::from(k);
                    let sensor = start.then(TruePose::new(0.0003 * k, 0.0001 * k, 0.001 * k));
                    let direction = sensor.theta + step * k;
                    let part = view.towards(&world, sensor, direction, width);
                    beams += 1;
                    faces[0] += part.segments.len() + part.circles.len();
                    faces[1] += world.segments.len() + world.circles.len();
                    for side in [0.0, -0.5, 0.5] {
                        let towards = direction + side * width;
                        let towards = [libm::cos(towards), libm::sin(towards)];
                        let from = [sensor.x, sensor.y];
                        let hit = world.hit(from, towards);
                        assert_eq!(part.hit(from, towards), hit, "{name}: beam {k}");
                        hits += usize::from(hit.is_some());
                    }
                }
            }
        }
        assert!(hits > beams, "{hits} hits, {beams} beams");
        assert!(2 * faces[0] < faces[1], "{faces:?}");
    }

    #[test]
    fn mirrors_are_seen_whole() {
        let mut world = World::default();
        world.face([2.0, -1.0], [2.0, 1.0], Surface::Mirror);
        world.line([-3.0, -5.0], [-3.0, 5.0]);
        let mut view = View::default();
        let part = view.towards(&world, TruePose::default(), 0.0, 0.0);
        assert_eq!(part.segments.len(), 2);
    }
}
