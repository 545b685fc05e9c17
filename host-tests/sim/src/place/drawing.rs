//! A place that was drawn with letters.

use crate::pose::TruePose;
use crate::world::World;

/// A world that was drawn, the first row on top.
pub struct Drawn<'a> {
    rows: &'a [&'a str],
    cell: f64,
    pub start: Option<TruePose>,
    pub way: Vec<[f64; 2]>,
}

impl<'a> Drawn<'a> {
    pub fn new(rows: &'a [&'a str], cell: f64) -> Result<Self, String> {
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

    pub fn world(&self) -> World {
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
    use crate::place::Place;

    fn parse(text: &str) -> Result<Place, String> {
        Place::parse(text, &mut |name| Err(format!("{name} is not there")))
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
}
