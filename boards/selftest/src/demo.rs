//! A lidar that is not there: a robot stands for a second, then drives in a circle through a room, and the bytes of its
//! LD06 come out.
//!
//! In integers, so that a board without a floating point unit keeps up with it, and everywhere the same bytes.

use beamfix::{
    geometry::Pose,
    lidar::ld06::{FRAME, POINTS, check_code},
    math,
    scan::Bearing,
};
use beamfix_app::App;

use crate::hash::PoseHash;

/// A wall along x or y (mm): what a robot meets between `from` and `to`.
struct Wall {
    /// Its place on the other axis.
    at: i32,
    from: i32,
    to: i32,
}

/// Walls along y, at some x.
const ALONG_Y: [Wall; 9] = [
    wall(-3100, -2300, 2600),
    wall(3900, -2300, 900),
    wall(4700, 900, 2600),
    wall(1900, -2300, -1800),
    wall(2500, -2300, -1800),
    wall(-250, -220, 190),
    wall(160, -220, 190),
    wall(-2300, 1900, 2600),
    wall(-1500, 1900, 2600),
];
/// Walls along x, at some y.
const ALONG_X: [Wall; 8] = [
    wall(-2300, -3100, 3900),
    wall(2600, -3100, 4700),
    wall(900, 3900, 4700),
    wall(-1800, 1900, 2500),
    wall(-220, -250, 160),
    wall(190, -250, 160),
    wall(1900, -2300, -1500),
    wall(-2299, 0, 900),
];

const fn wall(at: i32, from: i32, to: i32) -> Wall {
    Wall { at, from, to }
}

/// Radius of the circle (mm).
const RADIUS: i32 = 1250;
/// Time for one round (µs): 0.39 m/s, 18°/s.
const ROUND_US: u64 = 20_000_000;
/// So long it stands at the start, so long it takes to its speed (µs).
const STANDS_US: u64 = 1_000_000;
const STARTS_US: u64 = 2_000_000;
/// Time between two beams (µs), 450 a revolution.
const BEAM_US: u64 = 222;
/// Bearing between two beams (1/65 536 turn).
const BEAMS: u32 = 450;
/// The sensor's clock starts over after so long (ms).
const WRAP_MS: u64 = 30_000;
/// Half the width of the ranges' error (mm).
const NOISE_MM: i32 = 10;

/// See the module.
pub struct Demo {
    /// Beams measured so far.
    beams: u32,
    /// Time of the next one since the start (µs).
    beam_us: u64,
    /// When the clock was at 0.
    start_us: Option<u32>,
    /// Robot at the first pose, in the room.
    origin: Option<Pose>,
    random: u32,
}

impl Demo {
    /// At the start of the circle.
    #[must_use]
    #[allow(clippy::new_without_default, reason = "it is no value but a start")]
    pub const fn new() -> Self {
        Self {
            beams: 0,
            beam_us: 0,
            start_us: None,
            origin: None,
            random: 1,
        }
    }

    /// Gives the bytes that the lidar has sent until now (µs, wrapping).
    pub fn advance(&mut self, now_us: u32, mut byte: impl FnMut(u8)) {
        let start_us = *self.start_us.get_or_insert(now_us);
        let passed_us = now_us.wrapping_sub(start_us);
        let packet_us = BEAM_US as u32 * POINTS as u32;
        // As signed, so that the clock may wrap. One packet at most: the others when this comes round again.
        if passed_us.wrapping_sub(self.beam_us as u32) as i32 >= packet_us as i32 {
            self.packet().into_iter().for_each(&mut byte);
        }
    }

    /// The next packet, whatever the time is.
    #[inline(never)]
    pub fn packet(&mut self) -> [u8; FRAME] {
        let mut packet = [0; FRAME];
        let [s0, s1, v0, v1, a0, a1, points @ .., b0, b1, t0, t1, check] = &mut packet;
        [*s0, *s1] = [0x54, 0x2c];
        [*v0, *v1] = 3600u16.to_le_bytes();
        [*a0, *a1] = self.cdeg().to_le_bytes();
        let first_ms = self.beam_us / 1000 % WRAP_MS;
        let mut end = [0; 2];
        for point in points.chunks_exact_mut(3) {
            end = self.cdeg().to_le_bytes();
            let mm = self.range_mm();
            if let [low, high, intensity] = point {
                [*low, *high] = mm.to_le_bytes();
                *intensity = if mm == 0 { 0 } else { 200 };
            }
            self.beams = self.beams.wrapping_add(1);
            self.beam_us += BEAM_US;
        }
        [*b0, *b1] = end;
        [*t0, *t1] = (first_ms as u16).to_le_bytes();
        *check = 0;
        let [body @ .., _] = &packet;
        let code = check_code(body);
        let [.., check] = &mut packet;
        *check = code;
        packet
    }

    /// Where the robot really is at this time of the lidar's clock (µs), from where it was when this was first asked:
    /// at the first pose, which is the origin.
    #[must_use]
    pub fn truth(&mut self, time_us: u32) -> Pose {
        // Its upper half: the pose was some time before the next beam.
        let ago_us = (self.beam_us as u32).wrapping_sub(time_us);
        let now = place(self.beam_us.saturating_sub(ago_us.into()));
        self.origin.get_or_insert(now).between(now)
    }

    /// Clockwise direction of the next beam (0.01°).
    fn cdeg(&self) -> u16 {
        (self.beams % BEAMS * (36_000 / BEAMS)) as u16
    }

    fn range_mm(&mut self) -> u16 {
        let at = place(self.beam_us);
        let clockwise = self.beams % BEAMS * 65_536 / BEAMS;
        let heading = Bearing::from_radians(at.theta).0;
        let (sin, cos) = math::sin_cos_q15(heading.wrapping_sub(clockwise as u16));
        let (x, y) = (
            math::round_to_i32(1000.0 * at.x),
            math::round_to_i32(1000.0 * at.y),
        );
        let nearest =
            nearest((x, cos), (y, sin), &ALONG_Y).min(nearest((y, sin), (x, cos), &ALONG_X));
        match u16::try_from(nearest + self.noise_mm()) {
            Ok(mm) if mm <= 12_000 => mm,
            _ => 0,
        }
    }

    /// Of four equal ones: nearly Gaussian, 6 mm.
    fn noise_mm(&mut self) -> i32 {
        let mut sum = 0;
        for _ in 0..4 {
            self.random = self
                .random
                .wrapping_mul(1_664_525)
                .wrapping_add(1_013_904_223);
            sum += ((self.random >> 16) as i32 * (2 * NOISE_MM + 1)) >> 16;
        }
        sum / 2 - 2 * NOISE_MM
    }
}

/// The first poses of the demo as one number: what a board can prove itself by.
pub struct FirstPoses {
    /// How many.
    pub count: u32,
    /// Their [`PoseHash`].
    pub hash: u64,
}

/// What every machine finds; the host's tests have found it too.
pub const FIRST_POSES: FirstPoses = FirstPoses {
    count: 30,
    hash: 0x2d10_deda_93b6_c1f9,
};

impl FirstPoses {
    /// What this machine finds.
    pub fn find<const N: usize>(&self, app: &mut App<N>, demo: &mut Demo) -> u64 {
        let mut hash = PoseHash::new();
        let mut seen = 0;
        while seen < self.count {
            app.lidar_all(&demo.packet(), |_| ());
            if app.seen().turns != seen {
                seen = app.seen().turns;
                hash.push(app.pose());
            }
        }
        hash.value()
    }
}

/// The robot at a time (µs), in the room.
fn place(time_us: u64) -> Pose {
    // Like a stone that is let go, from standing to its speed; from then on as if it had always had it.
    let falling_us = time_us.saturating_sub(STANDS_US);
    let along_us = match falling_us < STARTS_US {
        true => {
            let seconds = falling_us as f32 * 1e-6;
            seconds * seconds * (0.5e12 / STARTS_US as f32)
        }
        false => ((falling_us - STARTS_US / 2) % ROUND_US) as f32,
    };
    let angle = along_us * (core::f32::consts::TAU / ROUND_US as f32);
    let (sin, cos) = math::sin_cos(angle);
    let radius = RADIUS as f32 / 1000.0;
    let quarter = core::f32::consts::FRAC_PI_2;
    Pose::new(radius * cos, radius * sin, angle + quarter)
}

/// Distance (mm) to the nearest of the walls that stand across `ahead`: place (mm) and direction (Q15) on either axis.
fn nearest(ahead: (i32, i32), aside: (i32, i32), walls: &[Wall]) -> i32 {
    let mut nearest = i32::MAX / 2;
    for wall in walls {
        // Below 2³¹: the room is less than 65 m wide.
        let Some(distance) = ((wall.at - ahead.0) << 15).checked_div(ahead.1) else {
            continue;
        };
        if (1..nearest.min(32_000)).contains(&distance) {
            let met = aside.0 + ((distance * aside.1) >> 15);
            if (wall.from..=wall.to).contains(&met) {
                nearest = distance;
            }
        }
    }
    nearest
}
