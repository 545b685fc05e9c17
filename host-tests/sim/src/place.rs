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

use crate::lidar::Ranging;
use crate::pose::TruePose;
use crate::robot::{Steering, WheelErrors};
use crate::scenes;
use crate::spaces;
use crate::world::{Surface, World};

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
}

/// What a place makes of a robot and its lidar: nothing by default.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Nature {
    /// The robot's wheels.
    pub steering: Steering,
    /// Slips a second, and the least and the largest, as shares of what a wheel rolls.
    pub slip: Option<[f64; 3]>,
    /// As [`Ranging`] has them: bias, growth of the noise with the range and where faces are grazed, width of a beam.
    pub bias: f64,
    /// See there.
    pub sigma_share: f64,
    /// See there.
    pub grazing: f64,
    /// See there.
    pub width: f64,
    /// The motor is faster and slower by this share of its speed.
    pub sway: f64,
    /// Messages of the wheels a second; `None`: one for each revolution of the lidar.
    pub wheels_per_s: Option<f64>,
    /// Bias and noise of a gyroscope (rad/s), where there is one.
    pub gyro: Option<[f64; 2]>,
    /// When (s) the lidar is knocked, and by how much it is turned (rad).
    pub knock: Option<[f64; 2]>,
}

/// A leaf that opens by a quarter turn about where its face starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Door {
    /// Which of the world's straight faces it is.
    face: usize,
    /// Its edge while it is shut.
    shut: [f64; 2],
    /// When it begins to open, and when it is open (s).
    between: [f64; 2],
}

/// Somebody who walks straight on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Person {
    /// Which of the world's round faces it is.
    face: usize,
    /// Where at the start, and how fast (m, m/s).
    start: [f64; 2],
    velocity: [f64; 2],
}

/// What of a place moves.
#[derive(Debug, Clone, Default)]
pub struct Moving {
    doors: Vec<Door>,
    people: Vec<Person>,
}

impl Moving {
    /// Puts all into `world` as it is at a time (s).
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

impl Nature {
    /// A lidar's ranging there.
    #[must_use]
    pub fn ranging(&self, ranging: Ranging) -> Ranging {
        Ranging {
            bias: ranging.bias + self.bias,
            sigma_share: ranging.sigma_share.max(self.sigma_share),
            grazing: ranging.grazing.max(self.grazing),
            width: ranging.width.max(self.width),
            ..ranging
        }
    }

    /// What wheels get wrong there.
    #[must_use]
    pub fn wheels(&self, wheels: WheelErrors) -> WheelErrors {
        match self.slip {
            None => wheels,
            Some([slips_per_s, least, most]) => WheelErrors {
                slips_per_s,
                slip: [least, most],
                ..wheels
            },
        }
    }

    fn take(&mut self, word: &str, rest: &str) -> Result<(), String> {
        let (name, rest) = match word {
            "slip" | "wheels" | "gyro" | "knock" => (word, rest),
            _ => rest.trim().split_once(' ').unwrap_or((rest.trim(), "")),
        };
        let numbers = numbers(rest)?;
        match (word, name, &numbers[..]) {
            ("drive", "differential", []) => self.steering = Steering::Differential,
            ("drive", "omni", []) => self.steering = Steering::Omni,
            ("drive", "ackermann", [radius]) if *radius > 0.0 => {
                self.steering = Steering::Ackermann(*radius);
            }
            ("slip", _, [often, least, most])
                if *often >= 0.0
                    && (0.0..=100.0).contains(least)
                    && (*least..=100.0).contains(most) =>
            {
                self.slip = Some([*often, 0.01 * least, 0.01 * most]);
            }
            ("wheels", _, [rate]) if *rate > 0.0 => self.wheels_per_s = Some(*rate),
            ("gyro", _, [bias, noise]) if *noise >= 0.0 => {
                self.gyro = Some([bias.to_radians(), noise.to_radians()]);
            }
            ("knock", _, [seconds, degrees]) => self.knock = Some([*seconds, degrees.to_radians()]),
            ("lidar", "bias", [bias]) => self.bias = *bias,
            ("lidar", "distance", [share]) if *share >= 0.0 => self.sigma_share = *share,
            ("lidar", "grazing", [times]) if *times >= 0.0 => self.grazing = *times,
            ("lidar", "width", [degrees]) if *degrees >= 0.0 => self.width = degrees.to_radians(),
            ("lidar", "sway", [share]) if (0.0..0.5).contains(share) => self.sway = *share,
            _ => {
                return Err(format!(
                    "{word} cannot be made of: {} {}",
                    name,
                    rest.trim()
                ));
            }
        }
        Ok(())
    }
}

/// Names of the built-in places, and what each is.
pub const NAMES: [(&str, &str); 9] = [
    ("flat", "four furnished rooms, a round of 39 m"),
    ("room", "an empty room of 5 m by 4 m"),
    ("corridor", "25 m with niches of doors, there and back"),
    (
        "office",
        "a corridor of 40 m with rooms on both sides, there and back",
    ),
    ("hall", "60 m by 40 m with two rows of pillars"),
    ("aisles", "a warehouse with rows of shelves that look alike"),
    ("yard", "buildings 10 to 60 m away, trees, hedges, cars"),
    ("maze", "passages 1.2 m wide"),
    ("dock", "a charging station in a corner, driven to"),
];

/// What a description may name to be read: `ros-map`.
pub type ReadMap<'a> = dyn FnMut(&str) -> Result<World, String> + 'a;

impl Place {
    /// The built-in place of this name, or an empty room by its sides, `6x4` (m); `None` if there is none. What is random in it
    /// comes from `seed`.
    #[must_use]
    pub fn named(name: &str, seed: u64) -> Option<Self> {
        let along = |world: World, end: f64| Self {
            world,
            start: TruePose::new(1.2, 0.0, 0.0),
            way: vec![[end, 0.0], [1.2, 0.0]],
            ..Self::default()
        };
        Some(match name {
            "flat" => {
                let (start, way) = scenes::flat_round();
                Self {
                    world: scenes::flat(),
                    start,
                    way,
                    ..Self::default()
                }
            }
            "room" => Self::built_in(include_str!("../worlds/room.txt")),
            "corridor" => along(spaces::niches(25.0, seed), 23.5),
            "office" => along(spaces::floor(40.0, seed), 38.0),
            "hall" => Self {
                world: spaces::hall(),
                start: TruePose::new(-20.0, 0.0, 0.0),
                way: vec![
                    [20.0, 0.0],
                    [20.0, 13.0],
                    [-18.0, 13.0],
                    [-18.0, -13.0],
                    [10.0, -13.0],
                    [10.0, 0.0],
                    [-20.0, 0.0],
                ],
                ..Self::default()
            },
            "aisles" => Self::built_in(include_str!("../worlds/aisles.txt")),
            "yard" => {
                // Trees stand anywhere: the first yard whose way is free.
                let yards = (0..100).map(|k| Self {
                    world: spaces::yard(seed + 1000 * k),
                    start: TruePose::default(),
                    way: vec![
                        [6.0, 0.0],
                        [6.0, 5.0],
                        [-5.0, 5.0],
                        [-5.0, -4.0],
                        [4.0, -4.0],
                        [0.0, 0.0],
                    ],
                    ..Self::default()
                });
                yards.into_iter().find(|yard| yard.check().is_ok())?
            }
            "maze" => Self::built_in(include_str!("../worlds/maze.txt")),
            "dock" => Self::built_in(include_str!("../worlds/dock.txt")),
            _ => return Self::rectangle(name),
        })
    }

    /// An empty room by its sides, `6x4`, driven around half-way between its middle and its walls.
    fn rectangle(name: &str) -> Option<Self> {
        let (length, width) = name.split_once('x')?;
        let sides: [f64; 2] = [length.parse().ok()?, width.parse().ok()?];
        if !sides.iter().all(|side| (1.0..1000.0).contains(side)) {
            return None;
        }
        let [x, y] = sides.map(|side| 0.25 * side);
        let mut world = World::default();
        world.block([-2.0 * x, -2.0 * y], [2.0 * x, 2.0 * y]);
        Some(Self {
            world,
            start: TruePose::new(-x, -y, 0.0),
            way: vec![[x, -y], [x, y], [-x, y], [-x, -y]],
            ..Self::default()
        })
    }

    /// A description that a test has parsed.
    fn built_in(text: &str) -> Self {
        Self::parse(text, &mut |_| Err("no map here".into())).unwrap_or_default()
    }

    /// Reads a description.
    ///
    /// # Errors
    /// The line, and what is wrong with it; a way that leads through a wall.
    pub fn parse(text: &str, read_map: &mut ReadMap<'_>) -> Result<Self, String> {
        let mut place = Self::default();
        let (mut start, mut marks) = (None, Vec::new());
        let mut lines = text.lines().enumerate();
        while let Some((number, line)) = lines.next() {
            let bare = line.split('#').next().unwrap_or("").trim();
            let Some((word, rest)) = bare
                .split_once(' ')
                .or((!bare.is_empty()).then_some((bare, "")))
            else {
                continue;
            };
            let at = |why: String| format!("line {}: {why}", number + 1);
            if word == "ros-map" {
                place.world.add(read_map(rest.trim()).map_err(at)?);
                continue;
            }
            if let "drive" | "slip" | "lidar" | "wheels" | "gyro" | "knock" = word {
                place.nature.take(word, rest).map_err(at)?;
                continue;
            }
            let numbers = numbers(rest).map_err(at)?;
            match (word, &numbers[..]) {
                ("wall" | "glass" | "mirror" | "black", [_, _, _, _, ..])
                    if numbers.len() % 2 == 0 =>
                {
                    let surface = match word {
                        "glass" => Surface::Glass,
                        "mirror" => Surface::Mirror,
                        "black" => Surface::Black,
                        _ => Surface::Plain,
                    };
                    let points = points(&numbers);
                    for pair in points.windows(2) {
                        place.world.face(pair[0], pair[1], surface);
                    }
                }
                ("rectangle", [length, width]) if *length > 0.0 && *width > 0.0 => {
                    let corner = [0.5 * length, 0.5 * width];
                    place.world.block(corner.map(|side| -side), corner);
                }
                ("box", [x, y, u, v]) => place
                    .world
                    .block([x.min(*u), y.min(*v)], [x.max(*u), y.max(*v)]),
                ("box", [x, y, u, v, degrees]) => place.world.turned_block(
                    [0.5 * (x + u), 0.5 * (y + v)],
                    [(u - x).abs(), (v - y).abs()],
                    degrees.to_radians(),
                ),
                ("door", [x, y, u, v, begin, end]) if begin < end => {
                    let shut = [*u, *v];
                    place.moving.doors.push(Door {
                        face: place.world.segments.len(),
                        shut,
                        between: [*begin, *end],
                    });
                    place.world.line([*x, *y], shut);
                }
                ("person", [x, y, degrees, speed]) => {
                    /// Of a body (m).
                    const RADIUS: f64 = 0.2;
                    let (start, towards) = ([*x, *y], degrees.to_radians());
                    place.moving.people.push(Person {
                        face: place.world.circles.len(),
                        start,
                        velocity: [speed * libm::cos(towards), speed * libm::sin(towards)],
                    });
                    place.world.column(start, RADIUS);
                }
                ("column", [x, y, radius]) if *radius > 0.0 => {
                    place.world.column([*x, *y], *radius)
                }
                ("map", [cell]) if *cell > 0.0 => {
                    let rows: Vec<&str> = lines
                        .by_ref()
                        .map(|(_, row)| row.trim_end())
                        .take_while(|row| *row != "end")
                        .collect();
                    let drawn = Drawn::new(&rows, *cell).map_err(at)?;
                    place.world.add(drawn.world());
                    start = start.or(drawn.start);
                    marks.extend(drawn.way);
                }
                ("start", [x, y, degrees]) => {
                    start = Some(TruePose::new(*x, *y, degrees.to_radians()))
                }
                ("way", [_, _, ..]) if numbers.len() % 2 == 0 => place.way.extend(points(&numbers)),
                (
                    "wall" | "glass" | "mirror" | "black" | "rectangle" | "box" | "column" | "door"
                    | "person" | "map" | "start" | "way",
                    _,
                ) => {
                    return Err(at(format!("{word} cannot be made of: {}", rest.trim())));
                }
                _ => {
                    return Err(at(format!(
                        "{word}? wall, glass, mirror, black, rectangle, box, column, door, person, map, ros-map, start, way, drive, wheels, slip, gyro, knock and lidar are known"
                    )));
                }
            }
        }
        place.way.extend(marks);
        place.start = start.ok_or("no start: `start X Y DEGREES`, or an S in a drawing")?;
        place.check()?;
        Ok(place)
    }

    /// Refuses a way that comes nearer to anything than a robot is wide.
    fn check(&self) -> Result<(), String> {
        /// Half the width of the robot (m).
        const NEAREST: f64 = 0.12;
        // Doors open and people pass: what moves is met or not.
        let mut world = self.world.clone();
        self.moving.place(1e9, &mut world);
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

fn numbers(text: &str) -> Result<Vec<f64>, String> {
    text.split_whitespace()
        .map(|word| {
            let number = word.parse().ok().filter(|v: &f64| v.abs() < 1e6);
            number.ok_or_else(|| format!("{word} is no number of metres or degrees"))
        })
        .collect()
}

fn points(numbers: &[f64]) -> Vec<[f64; 2]> {
    numbers
        .chunks_exact(2)
        .map(|pair| [pair[0], pair[1]])
        .collect()
}

/// A world that was drawn, the first row on top.
struct Drawn<'a> {
    rows: &'a [&'a str],
    cell: f64,
    start: Option<TruePose>,
    way: Vec<[f64; 2]>,
}

impl<'a> Drawn<'a> {
    fn new(rows: &'a [&'a str], cell: f64) -> Result<Self, String> {
        let (mut start, mut marks) = (None, Vec::new());
        for (row, line) in rows.iter().rev().enumerate() {
            for (column, letter) in line.chars().enumerate() {
                let middle = [column, row].map(|k| (k as f64 + 0.5) * cell);
                match letter {
                    '#' | '.' | ' ' => {}
                    'S' => start = Some(TruePose::new(middle[0], middle[1], 0.0)),
                    'a'..='z' | '1'..='9' => marks.push((letter, middle)),
                    other => {
                        return Err(format!(
                            "{other} in a drawing: #, ., S and letters are known"
                        ));
                    }
                }
            }
        }
        marks.sort_by_key(|(letter, _)| *letter);
        Ok(Self {
            rows,
            cell,
            start,
            way: marks.into_iter().map(|(_, middle)| middle).collect(),
        })
    }

    fn world(&self) -> World {
        let height = self.rows.len();
        let width = self.rows.iter().map(|row| row.chars().count()).max();
        let is_wall = |x: usize, y: usize| {
            let row = self.rows.get(height - 1 - y);
            row.and_then(|row| row.chars().nth(x)) == Some('#')
        };
        World::of_cells(
            (width.unwrap_or(0), height),
            self.cell,
            TruePose::default(),
            &is_wall,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Place, String> {
        Place::parse(text, &mut |name| Err(format!("{name} is not there")))
    }

    #[test]
    fn every_built_in_place_can_be_driven() {
        for text in [
            include_str!("../worlds/room.txt"),
            include_str!("../worlds/aisles.txt"),
            include_str!("../worlds/maze.txt"),
            include_str!("../worlds/dock.txt"),
        ] {
            parse(text).unwrap_or_else(|why| panic!("{why}:\n{text}"));
        }
        for (name, _) in NAMES {
            for seed in 1..6 {
                let place = Place::named(name, seed).expect(name);
                assert!(!place.way.is_empty(), "{name}");
                place
                    .check()
                    .unwrap_or_else(|why| panic!("{name}, seed {seed}: {why}"));
            }
        }
        let room = Place::named("6.5x4", 1).expect("a rectangle");
        assert_eq!(room.world.extent(), ([-3.25, -2.0], [3.25, 2.0]));
        room.check().expect("its way");
        for name in ["moon", "0x4", "4x", "infx2", "4x4x4"] {
            assert!(Place::named(name, 1).is_none(), "{name}");
        }
    }

    #[test]
    fn a_drawing_is_the_walls_between_free_and_full_cells() {
        let place = parse("map 2\n#####\n#S.a#\n#####\nend\n").expect("a place");
        assert_eq!((place.start.x, place.start.y), (3.0, 3.0));
        assert_eq!(place.way, [[7.0, 3.0]]);
        // The inner faces are 2 m, 2 m and 6 m, 6 m; the outer ones cannot be seen, but are there.
        let inner = |s: &&crate::world::Segment| {
            let inside = |p: [f64; 2]| (2.0..=8.0).contains(&p[0]) && (2.0..=4.0).contains(&p[1]);
            inside(s.from) && inside(s.to)
        };
        assert_eq!(place.world.segments.iter().filter(inner).count(), 4);
        let range = place.world.clearance([3.0, 3.0]);
        assert!((range - 1.0).abs() < 1e-9, "{range}");
    }

    #[test]
    fn a_description_says_what_faces_robot_and_lidar_are_like() {
        let text = "rectangle 8 6\nmirror -4 -1 -4 1\nglass 4 -1 4 1\nblack -1 3 1 3\nstart 0 0 0\nway 2 0\n\
                    drive ackermann 0.6\nslip 2 30 100\nlidar bias 0.02\nlidar distance 0.01\nlidar grazing 1\n\
                    lidar width 0.3\nlidar sway 0.05";
        let place = parse(text).expect("a place");
        let of = |surface| {
            let faces = place.world.segments.iter();
            faces.filter(|face| face.surface == surface).count()
        };
        let all = [
            Surface::Plain,
            Surface::Mirror,
            Surface::Glass,
            Surface::Black,
        ]
        .map(of);
        assert_eq!(all, [4, 1, 1, 1]);
        let Nature {
            steering,
            bias,
            sway,
            ..
        } = place.nature;
        assert_eq!(
            (steering, bias, sway),
            (Steering::Ackermann(0.6), 0.02, 0.05)
        );
        let ranging = place.nature.ranging(Ranging::DEFAULT);
        assert_eq!((ranging.bias, ranging.sigma_share), (0.02, 0.01));
        assert_eq!((ranging.grazing, ranging.width), (1.0, 0.3f64.to_radians()));
        let wheels = place.nature.wheels(WheelErrors::DEFAULT);
        assert_eq!((wheels.slips_per_s, wheels.slip), (2.0, [0.3, 1.0]));
        for line in [
            "drive sledge",
            "drive ackermann",
            "slip 1 50 20",
            "slip 1 50 120",
            "lidar",
            "lidar sway 2",
            "lidar colour 1",
            "rectangle 3",
            "glass 1 1",
        ] {
            let why = parse(&format!("{text}\n{line}")).expect_err(line);
            assert!(why.contains("line 14"), "{line}: {why}");
        }
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
    fn what_is_wrong_is_told_with_its_line() {
        let base = "wall 0 0 9 0\nstart 1 1 0\nway 5 1\n";
        parse(base).expect("a place");
        for (text, words) in [
            ("start 1 1 0\n", "no way"),
            ("way 1 1\n", "no start"),
            ("wall 0 0 1\nstart 1 1 0\nway 2 2", "line 1: wall"),
            ("start 1 1 0\nway 2 two", "line 2: two"),
            ("start 1 1 0\nhedge 2 2", "line 2: hedge?"),
            ("column 1 1 -2", "line 1: column"),
            ("ros-map x.yaml", "line 1: x.yaml is not there"),
            ("map 1\n#?#\nend", "line 1: ? in a drawing"),
            ("wall 3 0 3 9\nstart 1 1 0\nway 5 1", "comes within"),
            ("start 1 1 inf\nway 2 2", "line 1: inf"),
        ] {
            let why = parse(text).expect_err(text);
            assert!(why.contains(words), "{text}: {why}");
        }
    }
}
