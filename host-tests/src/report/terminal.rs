//! A map in the terminal: points and paths as Braille dots, a line of figures below. Works over SSH; nothing is left of it where the
//! output is no terminal.

use std::io::{self, IsTerminal as _, Stderr, Write as _};

use ratatui::backend::CrosstermBackend;
use ratatui::layout::{Constraint, Layout};
use ratatui::style::Color;
use ratatui::symbols::Marker;
use ratatui::widgets::canvas::{Canvas, Points};
use ratatui::widgets::{Block, Paragraph, Wrap};
use ratatui::{Frame, Terminal, TerminalOptions, Viewport};

use super::picture::colour;
use super::picture::map::Map;

/// Rows of the picture, its frame and its line.
const ROWS: u16 = 24;
/// A cell of a terminal is about twice as high as it is wide.
const CELL: f64 = 2.0;

/// A place in a terminal that is drawn again and again.
pub struct View {
    terminal: Terminal<CrosstermBackend<Stderr>>,
}

impl View {
    /// Takes the next rows of the terminal on standard error; `None` where that is no terminal.
    #[must_use]
    pub fn open() -> Option<Self> {
        if !io::stderr().is_terminal() {
            return None;
        }
        let backend = CrosstermBackend::new(io::stderr());
        let options = TerminalOptions {
            viewport: Viewport::Inline(ROWS),
        };
        let terminal = Terminal::with_options(backend, options).ok()?;
        Some(Self { terminal })
    }

    /// Draws the map over what was drawn before.
    pub fn draw(&mut self, map: &Map) -> io::Result<()> {
        self.terminal.draw(|frame| draw(frame, map))?;
        Ok(())
    }

    /// Leaves the last picture where it is, with the cursor below.
    pub fn close(mut self) {
        let _ = self.terminal.show_cursor();
        let _ = writeln!(io::stderr());
    }
}

/// Draws a map into a frame: walls that are known, measured points, paths; its caption below.
pub fn draw(frame: &mut Frame<'_>, map: &Map) {
    let [picture, words] =
        Layout::vertical([Constraint::Min(4), Constraint::Length(3)]).areas(frame.area());
    let (mut low, mut high) = map.limits();
    // As many metres a column as half a row has: circles stay round.
    let (columns, rows) = (
        f64::from(picture.width.saturating_sub(2).max(1)),
        f64::from(picture.height.saturating_sub(2).max(1)),
    );
    let scale = ((high[0] - low[0]) / columns).max((high[1] - low[1]) / (rows * CELL));
    for (axis, cells) in [(0, columns), (1, rows * CELL)] {
        let spare = 0.5 * (scale * cells - (high[axis] - low[axis]));
        (low[axis], high[axis]) = (low[axis] - spare, high[axis] + spare);
    }
    let title = format!(" {} ({:.0} m across) ", map.title, high[0] - low[0]);
    let canvas = Canvas::default()
        .block(Block::bordered().title(title))
        .marker(Marker::Braille)
        .x_bounds([low[0], high[0]])
        .y_bounds([low[1], high[1]])
        .paint(|context| {
            let mut dots = |places: &[[f64; 2]], colour| {
                let coords: Vec<(f64, f64)> = places.iter().map(|[x, y]| (*x, *y)).collect();
                context.draw(&Points {
                    coords: &coords,
                    color: colour,
                });
                context.layer();
            };
            dots(&map.points, of(colour::POINTS));
            for path in &map.paths {
                dots(&path.places, of(path.colour));
            }
        });
    frame.render_widget(canvas, picture);
    let caption = Paragraph::new(map.caption.clone());
    frame.render_widget(caption.wrap(Wrap { trim: true }), words);
}

const fn of(colour: colour::Colour) -> Color {
    Color::Rgb(colour.0, colour.1, colour.2)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::picture::map::Path;
    use ratatui::backend::TestBackend;

    /// What a terminal of this size shows.
    fn shown(map: &Map, width: u16, height: u16) -> Vec<String> {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).expect("a terminal");
        terminal.draw(|frame| draw(frame, map)).expect("drawn");
        let buffer = terminal.backend().buffer().clone();
        let row = |y| (0..width).map(|x| buffer[(x, y)].symbol()).collect();
        (0..height).map(row).collect()
    }

    #[test]
    fn a_square_of_points_is_a_square_of_dots() {
        let side: Vec<f64> = (0..=100).map(|k| 0.04 * f64::from(k)).collect();
        let points = side
            .iter()
            .flat_map(|&s| [[s, 0.0], [s, 4.0], [0.0, s], [4.0, s]])
            .collect();
        let map = Map {
            title: "a room".into(),
            caption: "12 poses".into(),
            points,
            paths: vec![Path {
                name: "path".into(),
                colour: colour::RED,
                width: 1,
                places: vec![[2.0, 2.0]],
            }],
            ..Map::default()
        };
        let rows = shown(&map, 60, 20);
        assert!(rows[0].contains("a room"), "{rows:#?}");
        assert!(rows[17].contains("12 poses"), "{rows:#?}");
        let inside = |row: &String| row.chars().skip(1).take(58).collect::<String>();
        let is_dot = |c: char| ('\u{2801}'..='\u{28ff}').contains(&c);
        let top = inside(&rows[1]).chars().filter(|&c| is_dot(c)).count();
        // 15 rows of twice a column's height: 30 columns wide, less the border around the limits.
        assert!((24..=31).contains(&top), "{top}: {rows:#?}");
        // The walls at both sides, and the robot in the middle.
        let middle = inside(&rows[8]);
        assert_eq!(
            middle.chars().filter(|&c| is_dot(c)).count(),
            3,
            "{rows:#?}"
        );
    }

    #[test]
    fn nothing_to_draw_and_no_room_are_no_trouble() {
        for (width, height) in [(60, 20), (3, 3), (1, 1)] {
            shown(&Map::default(), width, height);
        }
    }
}
