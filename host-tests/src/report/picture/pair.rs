//! A pair of scans before and after the match, and the estimate's way there.

use anyhow::Result;
use beamfix::geometry::Pose;
use beamfix::linalg::Covariance;
use beamfix::matching::icp::Reference;
use beamfix::scan::{Points, ScanPoint};
use plotters::coord::Shift;
use plotters::prelude::*;

use super::axes::{bounds, dots, ellipse, header, line, metres};
use super::{Drawing, colour};
use crate::matcher::{correspondence, metres_of};
use crate::report::score::{error, quantile};

/// A current point in the reference's frame, with the place on the reference's line that it is drawn to.
#[derive(Debug, Clone, Copy)]
struct Placed {
    at: [f64; 2],
    /// `None`: rejected.
    foot: Option<[f64; 2]>,
}

/// What to draw.
#[derive(Debug, Clone)]
pub struct PairPicture {
    title: String,
    caption: String,
    reference: Vec<[f64; 2]>,
    before: Vec<Placed>,
    after: Vec<Placed>,
    guess: Pose,
    truth: Pose,
    found: Option<(Pose, Covariance)>,
    path: Vec<Pose>,
    /// The current points by each pose of the path.
    passes: Vec<Vec<Placed>>,
    truth_name: String,
}

/// A moment of a match: the current scan where a pass has put it.
pub struct Frame<'a> {
    pair: &'a PairPicture,
    pass: usize,
}

/// Gate of the matcher's first pass (mm): a point farther from its line has no say.
const FIRST_GATE: f64 = 1024.0;
/// Gate of its last pass (mm).
const LAST_GATE: f64 = 128.0;

/// Gate of a pass (mm), for its picture: halved from pass to pass.
fn gate_of(pass: usize) -> f64 {
    (FIRST_GATE / f64::from(1u32 << pass.min(16))).max(LAST_GATE)
}

const FRAME: (u32, u32) = (720, 760);
const SIZE: (u32, u32) = (1800, 1640);
const HEADER: u32 = 120;
const SCANS: u32 = 800;

impl PairPicture {
    /// A match from `guess` that showed the poses `path` on its way and found `found`, or nothing.
    #[must_use]
    pub fn new<const N: usize>(
        (title, caption): (String, String),
        (reference, lines): (&Points<N>, &Reference<N>),
        current: &Points<N>,
        (guess, truth): (Pose, Pose),
        found: Option<(Pose, Covariance)>,
        path: Vec<Pose>,
    ) -> Self {
        let end = found
            .map(|(pose, _)| pose)
            .or(path.last().copied())
            .unwrap_or(guess);
        let place = |pose: Pose, gate: f64| {
            current
                .as_slice()
                .iter()
                .map(|point| placed(lines, pose, point, gate))
                .collect()
        };
        let at_guess: Vec<Placed> = place(guess, FIRST_GATE);
        let passes = path
            .iter()
            .enumerate()
            .map(|(pass, pose)| place(*pose, gate_of(pass + 1)));
        let passes = [at_guess.clone()].into_iter().chain(passes).collect();
        Self {
            title,
            caption,
            passes,
            truth_name: "truth".into(),
            reference: reference
                .as_slice()
                .iter()
                .map(|p| metres_of(p.x(), p.y()))
                .collect(),
            before: at_guess,
            after: place(end, LAST_GATE),
            guess,
            truth,
            found,
            path,
        }
    }

    /// The same, where what is drawn as the truth is something else.
    #[must_use]
    pub fn with_truth_named(self, name: &str) -> Self {
        Self {
            truth_name: name.into(),
            ..self
        }
    }

    /// The guess and the estimates after the passes, one picture each, for an animation: those that moved the scan by so much
    /// that one sees it, and the last.
    #[must_use]
    pub fn frames(&self) -> Vec<Frame<'_>> {
        /// A fifth of a pixel where a picture is ten metres wide (m), and as much five metres away (rad).
        const SEEN: (f32, f32) = (0.003, 0.0006);
        let mut shown = self.guess;
        let mut passes = vec![0];
        for (pass, &pose) in (1..self.passes.len()).zip(&self.path) {
            let motion = shown.between(pose);
            let is_last = pass + 1 == self.passes.len();
            if is_last || motion.distance() > SEEN.0 || motion.theta.abs() > SEEN.1 {
                passes.push(pass);
                shown = pose;
            }
        }
        let frame = |pass| Frame { pair: self, pass };
        passes.into_iter().map(frame).collect()
    }

    fn scans<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
        caption: &str,
        points: &[Placed],
    ) -> Result<()>
    where
        B::ErrorType: 'static,
    {
        let all = self
            .reference
            .iter()
            .copied()
            .chain(self.after.iter().map(|p| p.at));
        let range = |p: &[f64; 2]| p[0].hypot(p[1]);
        let ranges: Vec<f64> = all.clone().map(|p| range(&p)).collect();
        // A few far points would make the rest small.
        let most = 1.1 * quantile(&ranges, 0.92);
        let (low, high) = bounds(all.filter(|p| range(p) < most));
        let (mut chart, limits) = metres(area, low, high, caption)?;
        for point in points {
            if let Some(foot) = point.foot {
                line(
                    &mut chart,
                    &limits,
                    &[point.at, foot],
                    colour::GREEN.stroke_width(1),
                )?;
            }
        }
        dots(
            &mut chart,
            &limits,
            self.reference.iter().copied(),
            4,
            colour::BLUE.mix(0.45).filled(),
        )?;
        let (kept, rejected): (Vec<&Placed>, Vec<&Placed>) =
            points.iter().partition(|p| p.foot.is_some());
        dots(
            &mut chart,
            &limits,
            kept.iter().map(|p| p.at),
            2,
            colour::RED.filled(),
        )?;
        dots(
            &mut chart,
            &limits,
            rejected.iter().map(|p| p.at),
            3,
            colour::PURPLE.stroke_width(1),
        )?;
        dots(
            &mut chart,
            &limits,
            [[0.0; 2]].into_iter(),
            6,
            colour::INK.filled(),
        )
    }

    fn way<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
        caption: &str,
        near: bool,
    ) -> Result<()>
    where
        B::ErrorType: 'static,
    {
        let xy = |pose: Pose| [f64::from(pose.x), f64::from(pose.y)];
        let ellipse = self
            .found
            .map(|(pose, covariance)| ellipse(xy(pose), covariance, 1.0));
        let path: Vec<[f64; 2]> = [self.guess]
            .into_iter()
            .chain(self.path.iter().copied())
            .map(xy)
            .collect();
        let (low, high) = if near {
            // Around what was found, or where the search ended without finding anything.
            let end: Vec<[f64; 2]> = match &ellipse {
                Some(ellipse) => ellipse.iter().copied().chain([xy(self.truth)]).collect(),
                None => path.iter().rev().take(3).copied().collect(),
            };
            let (low, high) = bounds(end.into_iter());
            // At least a centimetre, so that nothing is drawn larger than it matters.
            (
                [low[0] - 0.002, low[1] - 0.002],
                [high[0].max(low[0] + 0.01), high[1].max(low[1] + 0.01)],
            )
        } else {
            let found = ellipse.iter().flatten().copied();
            bounds(path.iter().copied().chain([xy(self.truth)]).chain(found))
        };
        let (mut chart, limits) = metres(area, low, high, caption)?;
        // A long jump is another start of the search, not a step.
        for step in path
            .windows(2)
            .filter(|step| near || (step[1][0] - step[0][0]).hypot(step[1][1] - step[0][1]) < 0.35)
        {
            line(
                &mut chart,
                &limits,
                step,
                colour::INK.mix(0.45).stroke_width(1),
            )?;
        }
        dots(
            &mut chart,
            &limits,
            path.iter().copied(),
            3,
            colour::INK.mix(0.6).filled(),
        )?;
        if let Some(ellipse) = &ellipse {
            line(&mut chart, &limits, ellipse, colour::RED.stroke_width(2))?;
        }
        dots(
            &mut chart,
            &limits,
            [xy(self.guess)].into_iter(),
            7,
            colour::ORANGE.filled(),
        )?;
        dots(
            &mut chart,
            &limits,
            [xy(self.truth)].into_iter(),
            8,
            colour::GREEN.stroke_width(3),
        )?;
        let found = self.found.map(|(pose, _)| xy(pose));
        dots(
            &mut chart,
            &limits,
            found.into_iter(),
            5,
            colour::RED.filled(),
        )
    }
}

impl Drawing for PairPicture {
    fn size(&self) -> (u32, u32) {
        SIZE
    }

    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<()>
    where
        B::ErrorType: 'static,
    {
        let (top, body) = area.split_vertically(HEADER);
        let legend = [
            ("reference", colour::BLUE, 6),
            ("current, matched", colour::RED, 5),
            ("rejected", colour::PURPLE, 5),
            ("correspondence", colour::GREEN, 2),
            ("guess", colour::ORANGE, 6),
            ("passes", colour::INK, 3),
            ("found, with 95 % ellipse", colour::RED, 3),
            (self.truth_name.as_str(), colour::GREEN, 6),
        ];
        header(&top, 30, &self.title, &self.caption, &legend)?;
        let (scans, ways) = body.split_vertically(SCANS);
        let (left, right) = scans.split_horizontally(SIZE.0 / 2);
        let matched = self.after.iter().filter(|p| p.foot.is_some()).count();
        self.scans(&left, "at the guess", &self.before)?;
        let after = format!(
            "at the end: {matched} of {} points matched",
            self.after.len()
        );
        self.scans(&right, &after, &self.after)?;
        let (left, right) = ways.split_horizontally(SIZE.0 / 2);
        self.way(
            &left,
            "the estimate after each pass (x, y of the current lidar)",
            false,
        )?;
        self.way(&right, "the same, around the end", true)
    }
}

impl Drawing for Frame<'_> {
    fn size(&self) -> (u32, u32) {
        FRAME
    }

    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Result<()>
    where
        B::ErrorType: 'static,
    {
        let (top, body) = area.split_vertically(HEADER);
        let Self { pair, pass } = *self;
        let legend = [
            ("reference", colour::BLUE, 6),
            ("current", colour::RED, 5),
            ("rejected", colour::PURPLE, 5),
            ("correspondence", colour::GREEN, 2),
        ];
        let pose = pass.checked_sub(1).and_then(|k| pair.path.get(k));
        let (metres, degrees) = error(*pose.unwrap_or(&pair.guess), pair.truth);
        let caption = format!(
            "pass {pass} of {}: {:.1} mm and {degrees:.3}° from {}",
            pair.path.len(),
            1e3 * metres,
            pair.truth_name
        );
        header(&top, 30, "a match, pass by pass", &caption, &legend)?;
        let points = pair.passes.get(pass).map_or(&[][..], |points| points);
        pair.scans(&body, "", points)
    }
}

/// A point at `pose`, with its correspondence.
fn placed<const N: usize>(
    lines: &Reference<N>,
    pose: Pose,
    point: &ScanPoint,
    gate: f64,
) -> Placed {
    let (at, foot) = correspondence(lines, pose, point, gate);
    Placed { at, foot }
}
