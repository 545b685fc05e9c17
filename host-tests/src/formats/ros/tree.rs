//! Where the lidar sits on the robot, by the static transforms of a recording.

use beamfix::geometry::Pose;
use beamfix::scan::Mount;

use super::message::Transform;

/// A rotation matrix and a place: `outer_from_inner`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Rigid {
    rotation: [[f64; 3]; 3],
    place: [f64; 3],
}

impl Rigid {
    const IDENTITY: Self = Self {
        rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        place: [0.0; 3],
    };

    fn of(transform: &Transform) -> Self {
        let [x, y, z, w] = transform.rotation;
        Self {
            rotation: [
                [
                    1.0 - 2.0 * (y * y + z * z),
                    2.0 * (x * y - z * w),
                    2.0 * (x * z + y * w),
                ],
                [
                    2.0 * (x * y + z * w),
                    1.0 - 2.0 * (x * x + z * z),
                    2.0 * (y * z - x * w),
                ],
                [
                    2.0 * (x * z - y * w),
                    2.0 * (y * z + x * w),
                    1.0 - 2.0 * (x * x + y * y),
                ],
            ],
            place: transform.translation,
        }
    }

    fn then(self, inner: Self) -> Self {
        let mut product = self;
        for (row, line) in self.rotation.iter().enumerate() {
            for column in 0..3 {
                product.rotation[row][column] =
                    (0..3).map(|k| line[k] * inner.rotation[k][column]).sum();
            }
            let moved: f64 = (0..3).map(|k| line[k] * inner.place[k]).sum();
            product.place[row] += moved;
        }
        product
    }

    fn inverse(self) -> Self {
        let mut inverse = Self::IDENTITY;
        for row in 0..3 {
            for column in 0..3 {
                inverse.rotation[row][column] = self.rotation[column][row];
            }
            inverse.place[row] = -(0..3)
                .map(|k| self.rotation[k][row] * self.place[k])
                .sum::<f64>();
        }
        inverse
    }

    /// The mount of a lidar there, and how far its axis is from the vertical (rad).
    fn mount(self) -> (Mount, f64) {
        let up = self.rotation[2][2];
        let [x, y, _] = self.place;
        let theta = libm::atan2(self.rotation[1][0], self.rotation[0][0]);
        let mount = Mount {
            robot_from_lidar: Pose::new(x as f32, y as f32, theta as f32),
            upside_down: up < 0.0,
        };
        (mount, libm::acos(up.abs().min(1.0)))
    }
}

/// The static transforms of a recording; of two to the same frame the last counts.
#[derive(Debug, Clone, Default)]
pub struct Tree(Vec<Transform>);

impl Tree {
    /// Takes more of them.
    pub fn take(&mut self, transforms: Vec<Transform>) {
        for transform in transforms {
            self.0.retain(|known| known.child != transform.child);
            self.0.push(transform);
        }
    }

    /// The robot's frame, where no odometry names it: the usual name that is there, else the root above `lidar`.
    #[must_use]
    pub fn base(&self, lidar: &str) -> String {
        let is_there = |name: &&str| {
            let mut all = self.0.iter();
            all.any(|known| known.parent == *name || known.child == *name)
        };
        let usual = ["base_link", "base_footprint"];
        if let Some(name) = usual.iter().find(|name| is_there(name)) {
            return (*name).to_owned();
        }
        let mut frame = lidar;
        // A frame has one parent; a circle ends after as many steps as there are transforms.
        for _ in 0..self.0.len() {
            match self.0.iter().find(|known| known.child == frame) {
                Some(known) => frame = &known.parent,
                None => break,
            }
        }
        frame.to_owned()
    }

    /// Pose of `frame` in the root of its tree, and the root's name.
    fn to_root<'a>(&'a self, frame: &'a str) -> (Rigid, &'a str) {
        let (mut pose, mut name) = (Rigid::IDENTITY, frame);
        for _ in 0..self.0.len() {
            let Some(known) = self.0.iter().find(|known| known.child == name) else {
                break;
            };
            pose = Rigid::of(known).then(pose);
            name = &known.parent;
        }
        (pose, name)
    }

    /// How the lidar's frame sits in the robot's, and the tilt of its axis (rad); `None` where nothing joins the two.
    #[must_use]
    pub fn mount(&self, base: &str, lidar: &str) -> Option<(Mount, f64)> {
        let (root_from_base, base_root) = self.to_root(base);
        let (root_from_lidar, lidar_root) = self.to_root(lidar);
        (base_root == lidar_root).then(|| root_from_base.inverse().then(root_from_lidar).mount())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::{FRAC_PI_2, PI};

    /// A transform by roll, pitch and yaw (rad).
    fn transform(parent: &str, child: &str, place: [f64; 3], [r, p, y]: [f64; 3]) -> Transform {
        let half = |angle: f64| (libm::sin(0.5 * angle), libm::cos(0.5 * angle));
        let ((sr, cr), (sp, cp), (sy, cy)) = (half(r), half(p), half(y));
        Transform {
            parent: parent.into(),
            child: child.into(),
            translation: place,
            rotation: [
                sr * cp * cy - cr * sp * sy,
                cr * sp * cy + sr * cp * sy,
                cr * cp * sy - sr * sp * cy,
                cr * cp * cy + sr * sp * sy,
            ],
        }
    }

    #[test]
    fn mounts_follow_the_transforms_between_robot_and_lidar() {
        //   attitude of the lidar            heading, head down, tilt
        for (attitude, heading, upside_down, tilt) in [
            ([0.0, 0.0, 0.0], 0.0, false, 0.0),
            ([0.0, 0.0, PI], PI, false, 0.0),
            ([PI, 0.0, 0.0], 0.0, true, 0.0),
            ([PI, 0.0, FRAC_PI_2], FRAC_PI_2, true, 0.0),
            ([0.0, PI, 0.0], PI, true, 0.0),
            ([0.0, 0.3, 0.0], 0.0, false, 0.3),
        ] {
            let mut tree = Tree::default();
            tree.take(vec![
                transform("base_link", "laser", [9.0; 3], [0.0; 3]),
                transform("base_footprint", "base_link", [0.0, 0.0, 0.1], [0.0; 3]),
                transform("base_link", "plate", [0.1, 0.0, 0.0], [0.0, 0.0, FRAC_PI_2]),
                transform("plate", "laser", [0.0, 0.05, 0.2], attitude),
            ]);
            assert_eq!(tree.base("laser"), "base_link");
            for base in ["base_link", "base_footprint"] {
                let (mount, tilted) = tree.mount(base, "laser").expect("joined");
                let at = mount.robot_from_lidar;
                let turned = f64::from(at.theta) - (heading + FRAC_PI_2);
                assert!(
                    (at.x - 0.05).abs() < 1e-6 && at.y.abs() < 1e-6,
                    "{attitude:?}: {at:?}"
                );
                assert!(libm::sin(0.5 * turned).abs() < 1e-6, "{attitude:?}: {at:?}");
                assert_eq!(mount.upside_down, upside_down, "{attitude:?}");
                assert!((tilted - tilt).abs() < 1e-6, "{attitude:?}: {tilted}");
            }
            assert_eq!(tree.mount("base_link", "camera"), None);
        }
    }
}
