//! Reads a place's description.

use super::Place;
use super::drawing::Drawn;
use crate::pose::TruePose;
use crate::world::{Circle, Surface, World};

/// What a description may name to be read: `ros-map`.
pub type ReadMap<'a> = dyn FnMut(&str) -> Result<World, String> + 'a;

impl Place {
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
                    let Self { moving, world, .. } = &mut place;
                    moving.door(world, ([*x, *y], [*u, *v]), [*begin, *end]);
                }
                ("person", [x, y, degrees, speed]) => {
                    let towards = degrees.to_radians();
                    let velocity = [speed * libm::cos(towards), speed * libm::sin(towards)];
                    let Self { moving, world, .. } = &mut place;
                    moving.person(world, [*x, *y], velocity);
                }
                ("follower", [behind]) if *behind > 0.0 => {
                    place.moving.follower(&mut place.world, *behind);
                }
                ("post", [x, y, radius]) if *radius > 0.0 => {
                    place.posts.push(Circle {
                        centre: [*x, *y],
                        radius: *radius,
                    });
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
                    | "person" | "follower" | "post" | "map" | "start" | "way",
                    _,
                ) => {
                    return Err(at(format!("{word} cannot be made of: {}", rest.trim())));
                }
                _ => {
                    return Err(at(format!(
                        "{word}? wall, glass, mirror, black, rectangle, box, column, door, person, follower, post, map, ros-map, start, way, drive, wheels, slip, gyro, knock and lidar are known"
                    )));
                }
            }
        }
        place.way.extend(marks);
        place.start = start.ok_or("no start: `start X Y DEGREES`, or an S in a drawing")?;
        place.check()?;
        Ok(place)
    }
}

/// The numbers of a line.
pub(super) fn numbers(text: &str) -> Result<Vec<f64>, String> {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Place, String> {
        Place::parse(text, &mut |name| Err(format!("{name} is not there")))
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
