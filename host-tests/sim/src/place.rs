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
//! start 0.5 0.5  90
//! way 1 1  2 3                corners of the robot's way, in any number of lines
//! ```

use crate::pose::TruePose;
use crate::scenes;
use crate::spaces;
use crate::world::World;

/// Where a robot drives, and how.
#[derive(Debug, Clone, Default)]
pub struct Place {
    /// What stands around.
    pub world: World,
    /// Where it starts.
    pub start: TruePose,
    /// Corners of its way; it stops at the last one.
    pub way: Vec<[f64; 2]>,
}

/// Names of the built-in places, and what each is.
pub const NAMES: [(&str, &str); 8] = [
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
];

/// What a description may name to be read: `ros-map`.
pub type ReadMap<'a> = dyn FnMut(&str) -> Result<World, String> + 'a;

impl Place {
    /// The built-in place of this name; `None` if there is none. What is random in it comes from `seed`.
    #[must_use]
    pub fn named(name: &str, seed: u64) -> Option<Self> {
        let along = |world: World, end: f64| Self {
            world,
            start: TruePose::new(1.2, 0.0, 0.0),
            way: vec![[end, 0.0], [1.2, 0.0]],
        };
        Some(match name {
            "flat" => {
                let (start, way) = scenes::flat_round();
                Self {
                    world: scenes::flat(),
                    start,
                    way,
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
                });
                yards.into_iter().find(|yard| yard.check().is_ok())?
            }
            "maze" => Self::built_in(include_str!("../worlds/maze.txt")),
            _ => return None,
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
            let numbers = numbers(rest).map_err(at)?;
            match (word, &numbers[..]) {
                ("wall", [_, _, _, _, ..]) if numbers.len() % 2 == 0 => {
                    let points = points(&numbers);
                    for pair in points.windows(2) {
                        place.world.line(pair[0], pair[1]);
                    }
                }
                ("box", [x, y, u, v]) => place
                    .world
                    .block([x.min(*u), y.min(*v)], [x.max(*u), y.max(*v)]),
                ("box", [x, y, u, v, degrees]) => place.world.turned_block(
                    [0.5 * (x + u), 0.5 * (y + v)],
                    [(u - x).abs(), (v - y).abs()],
                    degrees.to_radians(),
                ),
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
                ("wall" | "box" | "column" | "map" | "start" | "way", _) => {
                    return Err(at(format!("{word} cannot be made of: {}", rest.trim())));
                }
                _ => {
                    return Err(at(format!(
                        "{word}? wall, box, column, map, ros-map, start and way are known"
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
        if self.way.is_empty() {
            return Err("no way: `way X Y ...`, or letters in a drawing".into());
        }
        let mut from = [self.start.x, self.start.y];
        for &to in &self.way {
            for k in 0..=20 {
                let share = f64::from(k) / 20.0;
                let place = [0, 1].map(|axis: usize| from[axis] + share * (to[axis] - from[axis]));
                let near = self.world.clearance(place);
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
        assert!(Place::named("moon", 1).is_none());
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
