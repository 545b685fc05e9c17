//! A room to try things in: what a lidar in it would measure, without a lidar.
#![allow(dead_code)]

use beamfix::scan::{Bearing, Range};
use beamfix::{Beam, Pose, Scan};

/// Walls as segments (m): a room of 6 x 4 m with a niche, and a cupboard in it.
pub const WALLS: &[[f32; 4]] = &[
    [0.0, 0.0, 6.0, 0.0],
    [6.0, 0.0, 6.0, 4.0],
    [6.0, 4.0, 2.5, 4.0],
    [2.5, 4.0, 2.5, 3.2],
    [2.5, 3.2, 0.0, 3.2],
    [0.0, 3.2, 0.0, 0.0],
    [4.6, 1.0, 5.4, 1.0],
    [5.4, 1.0, 5.4, 1.5],
    [5.4, 1.5, 4.6, 1.5],
    [4.6, 1.5, 4.6, 1.0],
];

/// Distance (m) from `x`, `y` to the first of `walls` in `direction` (rad).
pub fn range(walls: &[[f32; 4]], x: f32, y: f32, direction: f32) -> Option<f32> {
    let (dy, dx) = direction.sin_cos();
    let hits = walls.iter().filter_map(|&[x0, y0, x1, y1]| {
        let (ex, ey) = (x1 - x0, y1 - y0);
        let cross = dx * ey - dy * ex;
        let along_ray = ((x0 - x) * ey - (y0 - y) * ex) / cross;
        let along_wall = ((x0 - x) * dy - (y0 - y) * dx) / cross;
        (along_ray > 0.0 && (0.0..=1.0).contains(&along_wall)).then_some(along_ray)
    });
    hits.min_by(f32::total_cmp)
}

/// A scan of `walls` by a lidar that stands at `map_from_lidar`: a beam a degree, all at one moment.
pub fn scan(walls: &[[f32; 4]], map_from_lidar: Pose) -> Scan<360> {
    let mut scan = Scan::new();
    for degree in 0..360u16 {
        let bearing = f32::from(degree).to_radians();
        let at = map_from_lidar;
        let beam = Beam {
            bearing: Bearing::from_radians(bearing),
            range: range(walls, at.x, at.y, at.theta + bearing).map_or(
                Range::none(beamfix::scan::NoReturn::Nothing),
                Range::from_metres,
            ),
            time_us: 0,
            quality: 200,
        };
        scan.push(beam).expect("360 beams have room");
    }
    scan
}

/// Frames of an LD06 at `map_from_lidar(seconds)`, clockwise as it measures, for so many revolutions at 10 Hz.
pub fn ld06(map_from_lidar: impl Fn(f32) -> Pose, revolutions: u32) -> Vec<u8> {
    const FRAMES: u32 = 38; // of 12 points: 456 a revolution
    let mut bytes = Vec::new();
    for frame in 0..FRAMES * revolutions {
        let seconds = frame as f32 * 0.1 / FRAMES as f32;
        let cdeg = |point: u32| (frame * 12 + point) * 36_000 / (FRAMES * 12) % 36_000;
        let mut body = vec![0x54, 0x2c];
        body.extend(3600u16.to_le_bytes()); // deg/s
        body.extend((cdeg(0) as u16).to_le_bytes());
        for point in 0..12 {
            let at = map_from_lidar(seconds);
            let direction = at.theta - (cdeg(point) as f32 / 100.0).to_radians();
            let metres = range(WALLS, at.x, at.y, direction).unwrap_or(0.0);
            body.extend(((metres * 1000.0).round() as u16).to_le_bytes());
            body.push(200); // intensity
        }
        body.extend((cdeg(11) as u16).to_le_bytes());
        body.extend((((seconds * 1000.0) as u32 % 30_000) as u16).to_le_bytes());
        let crc = body.iter().fold(0u8, |crc, &byte| {
            (0..8).fold(crc ^ byte, |crc, _| {
                (crc << 1) ^ if crc & 0x80 == 0 { 0 } else { 0x4d }
            })
        });
        body.push(crc);
        bytes.extend(body);
    }
    bytes
}
