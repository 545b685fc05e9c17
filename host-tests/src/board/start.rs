//! Finding oneself in the simulated home on an emulated Cortex-M4F: what it costs, and the host's bits.

use anyhow::{Context as _, Result, ensure};
use beamfix::{
    geometry::Pose,
    localization::{
        Localizer, LocalizerConfig,
        particles::{Motion, ParticleConfig, ParticleFilter, Proposal},
    },
    matching::correlative::pyramid::Pyramid,
    scan::ScanPoint,
    sensor_model::likelihood_field::{Field as _, FieldModel, LikelihoodField, Profile, stored},
};
use serde::{Deserialize, Serialize};

use super::{
    Board,
    emulator::{self, Count},
};
use crate::formats::ros_map;
use beamfix_sim::{Noise, Still, TruePose, home};

/// Bytes that a step may look up: 20 ms at 168 MHz or so.
const BUDGET: u32 = 500_000;
/// As the board's program has it: `boards/emulated/src/start.rs`.
const POINTS: usize = 96;
const BEAMS: usize = 450;
const PARTICLES: usize = 16;
/// Scans that there are.
const SCANS: usize = 5;

/// What a start without a pose takes.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StartCosts {
    /// As the command line has it.
    pub board: String,
    /// The field in flash (bytes).
    pub field_bytes: u32,
    /// The localizer's memory, with the pyramid's (bytes); the scan is not in it.
    pub ram_bytes: u32,
    /// Deepest stack (bytes).
    pub stack_bytes: u32,
    /// Scans until the pose was known.
    pub scans: u32,
    /// Instructions until then, all calls together.
    pub instructions: u32,
    /// Of the longest call of `step`, with a budget of so many bytes looked up.
    pub step_instructions: u32,
    /// That budget.
    pub step_budget: u32,
    /// Bytes looked up in all.
    pub lookups: u32,
    /// Instructions of a scan that 16 particles are weighed with, drawn from the motion.
    pub by_motion: u32,
    /// The same, drawn from motion and match.
    pub improved: u32,
    /// Bytes of the particle filter.
    pub filter_bytes: u32,
}

/// The home's field, and scans of a robot that turns on the spot.
struct Scene {
    field: LikelihoodField<Vec<u8>>,
    scans: Vec<(Pose, Vec<ScanPoint>)>,
    truth: Vec<TruePose>,
}

fn scene() -> Result<Scene> {
    let world = home::home();
    let (low, high) = home::EXTENT;
    let map = ros_map::of_world(&world, low, high, 0.05, home::INSIDE)?;
    let squares = ros_map::squares(&map, beamfix::grid::occupancy::is_occupied);
    let profile = Profile::new(&FieldModel::DEFAULT);
    let cells = vec![0; map.shape().len()];
    let field = LikelihoodField::from_map(&map.as_slice(), &squares, &profile, cells)?;
    let mut noise = Noise::new(1, 15);
    let start = home::home_place(&world, &map, 0.25, &mut noise);
    let turn = TruePose::new(0.0, 0.0, 0.4);
    let mut truth = vec![start];
    while truth.len() < SCANS {
        truth.extend(truth.last().map(|pose| pose.then(turn)));
    }
    let scans = truth
        .iter()
        .map(|&pose| {
            let beams = Still::full_turn(BEAMS).scan(&world, pose, &mut noise);
            let points = beams
                .iter()
                .filter_map(|beam| Some(ScanPoint::at(beam.bearing, beam.range.mm().ok()?)))
                .collect();
            (Pose::from(turn), points)
        })
        .collect();
    Ok(Scene {
        field,
        scans,
        truth,
    })
}

/// Measures on a board; fails where the pose is not the host's, bit for bit, or wrong.
pub fn measure(board: &Board) -> Result<StartCosts> {
    let scene = scene()?;
    let elf = board.build("start")?;
    let output = emulator::run(board, &elf, &input(&scene), Count::Exact)?;
    let words: Vec<u32> = output
        .chunks_exact(4)
        .map(|word| u32::from_le_bytes(word.try_into().expect("four bytes")))
        .collect();
    let (scans, last) = words.as_chunks::<8>();
    // Eight words a scan, and 13 at the end.
    let Some((rest, scans)) = scans.split_last() else {
        anyhow::bail!("{}: {} words came back", board.name, words.len());
    };
    let [
        lookups,
        localizer,
        pyramid,
        stack_bytes,
        by_motion,
        mx,
        my,
        mt,
    ] = *rest;
    let [improved, ix, iy, it, filter_bytes] = *last else {
        anyhow::bail!("{}: {} words came back", board.name, words.len());
    };
    let Some(&[known, x, y, theta, ..]) = scans.last() else {
        anyhow::bail!("{}: no scan was taken", board.name);
    };
    ensure!(known == 1, "{}: the pose was not found", board.name);
    let here = on_host(&scene)?;
    ensure!(
        [x, y, theta] == [here.x, here.y, here.theta].map(f32::to_bits),
        "{}: {:?} is not what the host finds: {here:?}",
        board.name,
        [x, y, theta].map(f32::from_bits)
    );
    let particles = particles(&scene, here, scans.len());
    ensure!(
        [[mx, my, mt], [ix, iy, it]] == particles,
        "{}: the particles are not the host's",
        board.name
    );
    let off = scene.truth[scans.len() - 1].between(here.into());
    ensure!(
        off.distance() < 0.1 && off.theta.abs() < 0.035,
        "{}: off by {off:?}",
        board.name
    );
    Ok(StartCosts {
        board: board.name.into(),
        field_bytes: (stored::HEADER + scene.field.grid().cells().len()) as u32,
        ram_bytes: localizer + pyramid,
        stack_bytes,
        scans: scans.len() as u32,
        instructions: scans.iter().map(|scan| scan[4] + scan[7]).sum(),
        step_instructions: scans.iter().map(|scan| scan[6]).max().unwrap_or(0),
        step_budget: BUDGET,
        lookups,
        by_motion,
        improved,
        filter_bytes,
    })
}

fn on_host(scene: &Scene) -> Result<Pose> {
    let field = scene.field.as_slice();
    let mut buffer = vec![0; Pyramid::bytes(field.shape())];
    let pyramid = Pyramid::new(field, &mut buffer)?;
    let mut robot = Localizer::<POINTS>::new(pyramid, LocalizerConfig::DEFAULT);
    for (motion, points) in &scene.scans {
        robot.update(points, *motion);
        while !robot.step(BUDGET) {}
        if let Some(pose) = robot.pose() {
            return Ok(pose);
        }
    }
    None.context("the pose was not found, here")
}

/// The poses by particles that start at a pose with the last one of so many scans, as the board's program has it.
fn particles(scene: &Scene, pose: Pose, scans: usize) -> [[u32; 3]; 2] {
    [Proposal::Motion, Proposal::Improved].map(|proposal| {
        let config = ParticleConfig {
            proposal,
            ..ParticleConfig::DEFAULT
        };
        let mut filter = ParticleFilter::<PARTICLES, POINTS>::new(scene.field.as_slice(), config);
        filter.start_at(pose, (0.05, 0.05));
        filter.moved(&Motion::by_wheels(Pose::new(0.0, 0.0, 0.05), 0.2));
        let belief = filter.update(&scene.scans[scans - 1].1);
        [belief.pose.x, belief.pose.y, belief.pose.theta].map(f32::to_bits)
    })
}

fn input(scene: &Scene) -> Vec<u8> {
    let field = scene.field.as_slice();
    let cells = field.grid().cells();
    let mut bytes = ((stored::HEADER + cells.len()) as u32)
        .to_le_bytes()
        .to_vec();
    bytes.extend(stored::header(&field));
    bytes.extend(cells);
    bytes.extend(BUDGET.to_le_bytes());
    for (motion, points) in &scene.scans {
        let Pose { x, y, theta } = *motion;
        bytes.extend([x, y, theta].into_iter().flat_map(f32::to_le_bytes));
        bytes.extend((points.len() as u32).to_le_bytes());
        for point in points {
            bytes.extend(point.bearing().0.to_le_bytes());
            bytes.extend(point.range().to_le_bytes());
        }
    }
    bytes
}
