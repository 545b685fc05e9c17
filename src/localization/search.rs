//! The search for the pose over the whole map: every heading, every block of 4 by 4 cells, in bounded steps.

use super::{
    config::LocalizerConfig,
    hypotheses::{Hypotheses, Hypothesis, MOST, alike},
    quality::Quality,
};
use crate::{
    geometry::{Point, Pose},
    matching::{
        correlative::{CorrelativeConfig, Correlator, pyramid::Pyramid, rotated::Rotated},
        field,
    },
    math,
    scan::{ScanPoint, thinning::thinned},
    sensor_model::likelihood_field::{Field, LikelihoodField},
};

/// Cells on a side of the squares that the map is searched in.
const SQUARE: i32 = 64;
/// The pyramid's level whose blocks are tried, and their cells.
const LEVEL: usize = 1;
const BLOCK: i32 = 4;
/// Blocks on a square's side.
const SIDE: usize = (SQUARE / BLOCK) as usize;
/// Beams that a block is tried with.
const BEAMS: usize = 48;

/// A search under way. 16·N + 500 bytes.
#[derive(Debug, Clone)]
pub(crate) struct Search<const N: usize> {
    points: heapless::Vec<ScanPoint, N>,
    few: heapless::Vec<ScanPoint, BEAMS>,
    rotated: Rotated<BEAMS>,
    /// What the robot moved since the scan.
    motion: Pose,
    stage: Stage,
    /// Blocks of the square in which a lidar can stand: a word a row, a bit a column.
    standing: [u16; SIDE],
    /// Blocks kept, to be looked at closely.
    blocks: Hypotheses,
    lookups: u64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stage {
    /// The next square and heading.
    Blocks { square: u16, heading: u16 },
    /// The next block to be looked at closely.
    Closely { next: usize },
}

impl<const N: usize> Search<N> {
    pub const fn new() -> Self {
        Self {
            points: heapless::Vec::new(),
            few: heapless::Vec::new(),
            rotated: Rotated::new(),
            motion: Pose::IDENTITY,
            stage: Stage::Closely { next: MOST },
            standing: [0; SIDE],
            blocks: Hypotheses::new(),
            lookups: 0,
        }
    }

    /// Starts with a scan; false where it has too few points.
    pub fn start(&mut self, points: &[ScanPoint]) -> bool {
        if points.len() < 20 {
            return false;
        }
        self.points.clear();
        self.few.clear();
        for point in thinned(points, N) {
            let _ = self.points.push(*point);
        }
        for point in thinned(points, BEAMS) {
            let _ = self.few.push(*point);
        }
        self.motion = Pose::IDENTITY;
        self.stage = Stage::Blocks {
            heading: 0,
            square: 0,
        };
        self.blocks.clear();
        true
    }

    pub fn moved(&mut self, motion: Pose) {
        self.motion = self.motion * motion;
    }

    pub fn motion(&self) -> Pose {
        self.motion
    }

    /// Bytes looked up so far.
    pub fn lookups(&self) -> u64 {
        self.lookups
    }

    /// The next square of blocks, or the next block closely; true where all is done.
    pub fn advance(
        &mut self,
        pyramid: &Pyramid<'_>,
        config: &LocalizerConfig,
        correlator: &mut Correlator<N>,
        found: &mut Hypotheses,
    ) -> bool {
        match self.stage {
            Stage::Blocks { heading, square } => {
                let shape = pyramid.field().shape();
                let columns = u16::div_ceil(shape.width(), SQUARE as u16);
                let rows = u16::div_ceil(shape.height(), SQUARE as u16);
                let step = math::max(config.heading_step, 0.01);
                let headings = math::round_to_i32(core::f32::consts::TAU / step).max(1);
                let x = i32::from(square % columns.max(1)) * SQUARE;
                let y = i32::from(square / columns.max(1)) * SQUARE;
                if heading == 0 {
                    self.floor(pyramid.field(), x, y);
                }
                let is_floor = self.standing != [0; SIDE];
                if is_floor {
                    let angle = core::f32::consts::TAU * f32::from(heading) / headings as f32;
                    self.square(pyramid, angle, x, y);
                }
                self.stage = if is_floor && i32::from(heading) + 1 < headings {
                    Stage::Blocks {
                        square,
                        heading: heading + 1,
                    }
                } else if square + 1 < columns * rows {
                    Stage::Blocks {
                        square: square + 1,
                        heading: 0,
                    }
                } else {
                    Stage::Closely { next: 0 }
                };
                false
            }
            Stage::Closely { next } => {
                let Some(block) = self.blocks.as_slice().get(next) else {
                    return true;
                };
                self.closely(pyramid, config, correlator, block.pose, found);
                self.stage = Stage::Closely { next: next + 1 };
                false
            }
        }
    }

    /// Where in a square a lidar can stand.
    fn floor(&mut self, field: &LikelihoodField<&[u8]>, x: i32, y: i32) {
        let floor = Floor::of(field);
        for (row, word) in (0i32..).zip(&mut self.standing) {
            *word = 0;
            for column in 0..SIDE as i32 {
                let (cx, cy) = (x + BLOCK * column, y + BLOCK * row);
                let stands = [(1, 1), (3, 1), (1, 3), (3, 3)]
                    .into_iter()
                    .any(|(dx, dy)| floor.holds(field.byte((cx + dx) as u32, (cy + dy) as u32)));
                *word |= u16::from(stands) << column;
            }
        }
        self.lookups += 4 * (SIDE * SIDE) as u64;
    }

    /// Tries the blocks of a square with one heading.
    fn square(&mut self, pyramid: &Pyramid<'_>, heading: f32, x: i32, y: i32) {
        let field = pyramid.field();
        let shape = *field.shape();
        let corner = |x: i32, y: i32| {
            let place = shape.origin()
                * Point::new(x as f32 * shape.resolution(), y as f32 * shape.resolution());
            Pose::new(place.x, place.y, shape.origin().theta + heading)
        };
        // A hair inside the cell, so that rounding does not put the lidar into the one before.
        let inside = 0.01 * shape.resolution();
        let start =
            corner(x, y) * Pose::new(0.0, 0.0, -heading) * Pose::new(inside, inside, heading);
        if !self
            .rotated
            .assign(pyramid, &self.few, start, SQUARE as i16)
        {
            return;
        }
        let height = 1.0 / (255.0 * self.few.len() as f32);
        for (row, standing) in (0i32..).zip(self.standing) {
            for quad in 0..SIDE as i32 / 4 {
                let first = 4 * quad;
                let standing = [0, 1, 2, 3].map(|k| (standing >> (first + k)) & 1 == 1);
                if standing == [false; 4] {
                    continue;
                }
                let sums = self.rotated.row(pyramid, LEVEL, first as i16, row as i16);
                self.lookups += 4 * self.few.len() as u64;
                for ((sum, standing), column) in sums.into_iter().zip(standing).zip(first..) {
                    let score = sum as f32 * height;
                    if standing && score > self.blocks.worst() {
                        let middle =
                            corner(x + BLOCK * column + BLOCK / 2, y + BLOCK * row + BLOCK / 2);
                        let block = Hypothesis {
                            pose: middle,
                            sum: score,
                            last: score,
                            scans: 1,
                        };
                        self.blocks.offer(block, 0.45, 0.11);
                    }
                }
            }
        }
    }

    /// Finds the best pose in a block and keeps it as a candidate.
    fn closely(
        &mut self,
        pyramid: &Pyramid<'_>,
        config: &LocalizerConfig,
        correlator: &mut Correlator<N>,
        block: Pose,
        found: &mut Hypotheses,
    ) {
        let around = CorrelativeConfig {
            position_range: 2.5 * pyramid.field().shape().resolution(),
            heading_range: 1.2 * config.heading_step,
            min_score: 0.05,
            ..CorrelativeConfig::DEFAULT
        };
        let Ok(best) = correlator.best(&pyramid.local(), &self.points, block, &around) else {
            return;
        };
        let pose = match field::align(pyramid.field(), &self.points, best, &config.short()) {
            Ok(fine) if alike(fine.pose, best, 0.3, 0.1) => fine.pose,
            _ => best,
        };
        let quality = Quality::of(pyramid.field(), &self.points, pose, N).strict_value();
        let one = Hypothesis {
            pose,
            sum: quality,
            last: quality,
            scans: 1,
        };
        found.offer(one, 0.3, 0.2);
    }
}

/// Where a lidar can stand: what is explored, and not within 1.5σ of a surface.
struct Floor {
    surface: u8,
    unexplored: u8,
}

impl Floor {
    fn of<F: Field + ?Sized>(field: &F) -> Self {
        let scale = field.scale();
        Self {
            surface: 255 - math::round_to_i32(math::min(1.125 / scale.step, 200.0)) as u8,
            unexplored: scale.unexplored,
        }
    }

    fn holds(&self, byte: u8) -> bool {
        byte != self.unexplored && byte < self.surface
    }
}
