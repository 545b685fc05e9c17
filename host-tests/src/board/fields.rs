//! A scan against a likelihood field on an emulated board: what the loops cost, and the same bits as here.

use anyhow::{Context as _, Result, ensure};
use beamfix::{
    geometry::Pose,
    grid::Shape,
    matching::{
        correlative::{CorrelativeConfig, Correlator, pyramid::Pyramid, sum_four},
        field::{self, FieldConfig},
    },
    scan::ScanPoint,
    sensor_model::likelihood_field::{
        Field as _, FieldModel, LikelihoodField, Profile, draw::Canvas as _, stored,
    },
};
use serde::{Deserialize, Serialize};

use super::{
    Board,
    emulator::{self, Count},
};
use beamfix_sim::{Noise, Still, TruePose, scenes};

/// Beams of the scan.
pub const BEAMS: usize = 360;
/// What the board's program has room for: `boards/emulated/src/fields.rs`.
const FIELD: usize = stored::HEADER + 64 * 64;
const SEARCH: CorrelativeConfig = CorrelativeConfig {
    position_range: 0.7,
    heading_range: 0.2094,
    ..CorrelativeConfig::DEFAULT
};
const NEWTON: FieldConfig = FieldConfig {
    coarse_stride: 1,
    ..FieldConfig::DEFAULT
};

/// What the loops cost on a board.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Costs {
    /// As the command line has it.
    pub board: String,
    /// Instructions a beam to score a scan.
    pub score_per_beam: f32,
    /// Instructions a beam and pass of Newton's method, with all that a pass takes beside its beams.
    pub newton_per_beam: f32,
    /// Instructions of the whole match, and its passes.
    pub newton: u32,
    /// Passes over the beams.
    pub passes: u32,
    /// Instructions a byte looked up in the search's inner loop.
    pub inner_per_lookup: f32,
    /// Instructions a byte looked up by branch and bound, with all that a search takes beside them.
    pub search_per_lookup: f32,
    /// Instructions of the whole search: ±0.7 m, ±12°.
    pub search: u32,
    /// Bytes looked up.
    pub lookups: u32,
    /// Deepest stack (bytes).
    pub stack_bytes: u32,
}

/// The scene: a room's field in cells of 0.1 m, a scan from inside, a guess a little off.
struct Scene {
    field: LikelihoodField<Vec<u8>>,
    points: Vec<ScanPoint>,
    guess: Pose,
}

fn scene() -> Result<Scene> {
    let mut world = scenes::room();
    world.block([0.8, 0.9], [1.6, 1.5]);
    world.column([-1.2, -0.9], 0.25);
    world.turned_block([1.5, -1.2], [0.7, 0.4], 0.6);
    let shape = Shape::new(60, 50, 0.1, Pose::new(-3.0, -2.5, 0.0))?;
    let profile = Profile::new(&FieldModel::new(0.9, 0.1, 12.0, 0.15)?);
    let mut field = LikelihoodField::unexplored(shape, vec![0; shape.len()], *profile.scale())?;
    for y in 0..50 {
        for x in 0..60 {
            let middle = shape.middle_of(x, y);
            let mm = 1000.0 * world.clearance([f64::from(middle.x), f64::from(middle.y)]);
            field.raise(x, y, profile.byte((mm * mm) as u32));
        }
    }
    let truth = TruePose::new(-0.3, 0.2, 0.4);
    let beams = Still::full_turn(BEAMS).scan(&world, truth, &mut Noise::new(1, 41));
    let points = beams
        .iter()
        .filter_map(|beam| Some(ScanPoint::at(beam.bearing, beam.range.mm().ok()?)))
        .collect();
    Ok(Scene {
        field,
        points,
        guess: Pose::from(truth) * Pose::new(0.05, -0.04, 0.03),
    })
}

/// Measures on a board; fails where one bit of a result differs from the host's.
pub fn measure(board: &Board) -> Result<Costs> {
    let scene = scene()?;
    let elf = board.build("fields")?;
    let output = emulator::run(board, &elf, &input(&scene), Count::Exact)?;
    let words: Vec<u32> = output
        .chunks_exact(4)
        .map(|word| u32::from_le_bytes(word.try_into().expect("four bytes")))
        .collect();
    let [
        sum,
        score,
        fours,
        inner,
        x,
        y,
        theta,
        newton,
        passes,
        sx,
        sy,
        stheta,
        search,
        lookups,
        stack_bytes,
    ] = words[..]
    else {
        anyhow::bail!("{}: {} words came back, not 15", board.name, words.len());
    };
    let here = on_host(&scene)?;
    ensure!(
        [sum, fours, x, y, theta, sx, sy, stheta] == here,
        "{}: {:x?} is not what the host finds: {here:x?}",
        board.name,
        [sum, fours, x, y, theta, sx, sy, stheta]
    );
    ensure!(
        passes > 0 && lookups > 0,
        "{}: no match was found",
        board.name
    );
    let beams = scene.points.len() as f32;
    Ok(Costs {
        board: board.name.into(),
        score_per_beam: score as f32 / beams,
        newton_per_beam: newton as f32 / (beams * passes as f32),
        newton,
        passes,
        inner_per_lookup: inner as f32 / (4.0 * beams),
        search_per_lookup: search as f32 / lookups as f32,
        search,
        lookups,
        stack_bytes,
    })
}

fn on_host(scene: &Scene) -> Result<[u32; 8]> {
    let field = scene.field.as_slice();
    let score = field.score(&scene.points, scene.guess);
    let newton = field::align(&field, &scene.points, scene.guess, &NEWTON)
        .context("Newton's method, here")?;
    let mut buffer = vec![0; Pyramid::bytes(field.grid().shape())];
    let pyramid = Pyramid::new(field, &mut buffer)?;
    let mut correlator = Correlator::<96>::new();
    let search = correlator
        .align(&pyramid.local(), &scene.points, scene.guess, &SEARCH)
        .context("the search, here")?;
    let [x, y, t] = [newton.pose.x, newton.pose.y, newton.pose.theta].map(f32::to_bits);
    let [sx, sy, st] = [search.pose.x, search.pose.y, search.pose.theta].map(f32::to_bits);
    let indices: Vec<u32> = scene
        .points
        .iter()
        .map(|point| (u32::from(point.bearing().0) * 3000) >> 16)
        .collect();
    let fours = sum_four(field.grid().cells(), &indices).iter().sum();
    Ok([score.sum, fours, x, y, t, sx, sy, st])
}

fn input(scene: &Scene) -> Vec<u8> {
    let field = scene.field.as_slice();
    let mut bytes = stored::header(&field).to_vec();
    bytes.extend(field.grid().cells());
    bytes.resize(FIELD, 0);
    let Pose { x, y, theta } = scene.guess;
    bytes.extend([x, y, theta].into_iter().flat_map(f32::to_le_bytes));
    bytes.extend((scene.points.len() as u32).to_le_bytes());
    for point in &scene.points {
        bytes.extend(point.bearing().0.to_le_bytes());
        bytes.extend(point.range().to_le_bytes());
    }
    bytes
}
