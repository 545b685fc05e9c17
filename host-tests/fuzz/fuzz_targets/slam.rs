//! Any drive into SLAM, with storage that is small, damaged or cut off: no panic, what stands in the graph is finite, and
//! what was saved is loaded or refused.
#![no_main]

use arbitrary::Arbitrary;
use beamfix::{
    Covariance, Grid, Pose,
    grid::{
        Shape,
        occupancy::{self, UpdateConfig},
    },
    linalg::Sym3,
    scan::{Bearing, ScanPoint},
    slam::{Slam, SlamConfig},
};
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use libfuzzer_sys::fuzz_target;

type Small = Slam<12, 16, 40, 48, 90>;

const SIZE: usize = 8 * 1024;

#[derive(Arbitrary, Debug)]
struct Input {
    rooms: Vec<Vec<(u16, u16)>>,
    scans: Vec<Scan>,
    cut: u8,
    flips: Vec<(u16, u8)>,
    mount: [f32; 3],
}

#[derive(Arbitrary, Debug)]
struct Scan {
    room: u8,
    /// Steps of a quarter metre and of 15 degrees, or anything.
    step: (i8, i8, i8),
    pose: Option<[f32; 3]>,
    variances: [f32; 3],
    budget: u16,
}

struct Flash {
    bytes: Vec<u8>,
    left: u8,
}

#[derive(Debug)]
struct Dead;

impl NorFlashError for Dead {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl Flash {
    fn spend(&mut self) -> Result<(), Dead> {
        self.left = self.left.checked_sub(1).ok_or(Dead)?;
        Ok(())
    }
}

impl ErrorType for Flash {
    type Error = Dead;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 4;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Dead> {
        bytes.copy_from_slice(&self.bytes[offset as usize..][..bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        SIZE
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 8;
    const ERASE_SIZE: usize = 1024;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Dead> {
        self.spend()?;
        self.bytes[from as usize..to as usize].fill(0xff);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Dead> {
        self.spend()?;
        self.bytes[offset as usize..][..bytes.len()].copy_from_slice(bytes);
        Ok(())
    }
}

fn pose([x, y, theta]: [f32; 3]) -> Pose {
    Pose { x, y, theta }
}

/// Whether all of the graph can be reckoned with.
fn is_sound(slam: &Small) -> bool {
    let graph = slam.graph();
    graph.nodes().all(|(_, node)| node.pose.is_finite())
        && (graph.edges().iter())
            .all(|edge| graph.node(edge.from).is_some() && graph.node(edge.to).is_some())
}

fn drive(slam: &mut Small, input: &Input) {
    let mut robot = Pose::IDENTITY;
    for scan in input.scans.iter().take(40) {
        let room = (input
            .rooms
            .get(usize::from(scan.room) % input.rooms.len().max(1)))
        .map_or(&[][..], |room| room);
        let points: heapless::Vec<ScanPoint, 96> = (room.iter().take(96))
            .map(|&(bearing, mm)| ScanPoint::at(Bearing(bearing), mm % 32_001))
            .collect();
        let (x, y, theta) = scan.step;
        let step = Pose::new(
            0.25 * f32::from(x),
            0.25 * f32::from(y),
            0.26 * f32::from(theta),
        );
        robot = scan.pose.map_or(robot * step, pose);
        let [xx, yy, tt] = scan.variances;
        let covariance = Covariance(Sym3 {
            xx,
            yy,
            tt,
            xy: 0.0,
            xt: 0.0,
            yt: 0.0,
        });
        if let Some(placed) = slam.update(robot, &covariance, pose(input.mount), &points) {
            assert!(slam.pose(&placed).is_none_or(|pose| pose.is_finite()));
        }
        slam.step(scan.budget.into());
        slam.take_merged();
        if !robot.is_finite() {
            robot = Pose::IDENTITY;
        }
    }
}

fuzz_target!(|input: Input| {
    let mut slam = Box::new(Small::new(SlamConfig::DEFAULT));
    drive(&mut slam, &input);
    for _ in 0..200 {
        if slam.step(2000) {
            break;
        }
    }
    assert!(is_sound(&slam));
    if let Some((low, high)) = slam.extent(32.0) {
        assert!(low.x <= high.x && low.y <= high.y);
    }
    let shape = Shape::new(40, 40, 0.2, Pose::new(-4.0, -4.0, 0.0)).expect("8 x 8 m");
    let mut cells = vec![0; shape.len()];
    let mut grid = Grid::new(shape, &mut cells[..]).expect("a byte a cell");
    for slot in 0..12 {
        slam.draw(slot, &mut grid, &UpdateConfig::DEFAULT);
    }
    occupancy::decide(&mut cells);

    let mut flash = Flash {
        bytes: vec![0xff; SIZE],
        left: 255,
    };
    slam.save(&mut flash, 0..SIZE as u32)
        .expect("room for the whole map");
    let whole = flash.bytes.clone();
    drive(&mut slam, &input);
    flash.left = input.cut;
    let second = slam.save(&mut flash, 0..SIZE as u32);
    let mut loaded = Box::new(Small::new(SlamConfig::DEFAULT));
    flash.left = 255;
    loaded
        .load(&mut flash, 0..SIZE as u32)
        .expect("one of both is whole");
    let there = loaded.graph().nodes().count();
    if second.is_ok() {
        assert_eq!(there, slam.graph().nodes().count());
    }
    assert!(is_sound(&loaded));

    // Damaged: loaded as it was or refused.
    flash.bytes = whole;
    for &(at, flip) in &input.flips {
        flash.bytes[usize::from(at) % SIZE] ^= flip;
    }
    let _ = loaded.load(&mut flash, 0..SIZE as u32);
    assert!(is_sound(&loaded));
    drive(&mut loaded, &input);
});
