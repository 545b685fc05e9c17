//! Captures: a lidar's bytes with the times at which they came in, and where the wheels said the robot was.
//!
//! Replayed, the drivers see bit for bit what they saw on the robot. A board's own frames become such a capture by
//! [`telemetry`], and [`log`] reads one as a log of scans.
//!
//! | bytes | |
//! | --- | --- |
//! | 8 | `BYTES+T2` |
//! | | then pieces: |
//! | 8 | time (µs), `u64` |
//! | 1 | what it is |
//! | 4 | length of the rest, `u32` |
//! | … | the rest |
//!
//! | what | the rest |
//! | --- | --- |
//! | 0 bytes of the lidar | as they came |
//! | 1 wheels | x, y (m), heading (rad) as three `f32` |
//! | 2 the lidar's model | its name as text |
//! | 3 the lidar on the robot | x, y (m), heading (rad) as three `f32`; 1 if it hangs head down, else 0, or nothing |
//! | 4 gyroscope | rate of turn (rad/s) as `f32` |
//! | 5 the lidar's own angle that looks forward, where the unit told another than its model's | 0.01° as `u16` |
//!
//! All little-endian, on one clock. Pieces of other kinds are skipped. A file
//! without this start is bytes of the lidar alone.

pub mod log;
pub mod simulated;
pub mod telemetry;

use std::borrow::Cow;
use std::io::{self, Write};

use beamfix::geometry::Pose;
use beamfix::scan::Mount;

/// How such a file starts.
pub const MAGIC: &[u8; 8] = b"BYTES+T2";

/// What came in together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece<'a> {
    /// When (µs); `None` where nobody wrote it down.
    pub time_us: Option<u64>,
    /// What.
    pub content: Content<'a>,
}

/// What a piece holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Content<'a> {
    /// Bytes of the lidar.
    Bytes(&'a [u8]),
    /// The robot's pose by its wheels, in a frame of their own.
    Wheels(Pose),
    /// The robot's rate of turn by a gyroscope, counter-clockwise (rad/s).
    Gyro(f32),
    /// Which lidar it is.
    Lidar(&'a str),
    /// How the lidar sits on the robot.
    Mount(Mount),
    /// The lidar's own angle that looks forward (0.01°), where the unit told another than its model's.
    Zero(u16),
}

/// Writes a capture piece by piece.
#[derive(Debug)]
pub struct Recorder<W> {
    output: W,
}

impl<W: Write> Recorder<W> {
    /// Starts a capture.
    pub fn new(mut output: W) -> io::Result<Self> {
        output.write_all(MAGIC)?;
        Ok(Self { output })
    }

    /// Appends what came in at this time (µs).
    pub fn push(&mut self, time_us: u64, content: Content) -> io::Result<()> {
        let pose = |pose: Pose| -> Vec<u8> {
            let numbers = [pose.x, pose.y, pose.theta];
            numbers.into_iter().flat_map(f32::to_le_bytes).collect()
        };
        let (kind, payload): (u8, Cow<[u8]>) = match content {
            Content::Bytes(bytes) => (0, Cow::Borrowed(bytes)),
            Content::Wheels(wheels) => (1, Cow::Owned(pose(wheels))),
            Content::Lidar(name) => (2, Cow::Borrowed(name.as_bytes())),
            Content::Mount(mount) => {
                let mut bytes = pose(mount.robot_from_lidar);
                bytes.push(mount.upside_down.into());
                (3, Cow::Owned(bytes))
            }
            Content::Gyro(rate) => (4, Cow::Owned(rate.to_le_bytes().to_vec())),
            Content::Zero(zero_cdeg) => (5, Cow::Owned(zero_cdeg.to_le_bytes().to_vec())),
        };
        let length = u32::try_from(payload.len()).map_err(io::Error::other)?;
        self.output.write_all(&time_us.to_le_bytes())?;
        self.output.write_all(&[kind])?;
        self.output.write_all(&length.to_le_bytes())?;
        self.output.write_all(&payload)
    }

    /// What was written so far.
    pub fn written(&self) -> &W {
        &self.output
    }

    /// Hands on what was pushed so far.
    pub fn flush(&mut self) -> io::Result<()> {
        self.output.flush()
    }

    /// Ends the capture.
    pub fn finish(mut self) -> io::Result<W> {
        self.output.flush()?;
        Ok(self.output)
    }
}

/// The pieces of a file; a last one that was cut off is as long as it is, or left out.
#[must_use]
pub fn pieces(file: &[u8]) -> Vec<Piece<'_>> {
    let Some(mut rest) = file.strip_prefix(MAGIC) else {
        return vec![Piece {
            time_us: None,
            content: Content::Bytes(file),
        }];
    };
    let mut pieces = Vec::new();
    while let Some((time, after)) = rest.split_first_chunk::<8>() {
        let Some((&[kind, l0, l1, l2, l3], after)) = after.split_first_chunk::<5>() else {
            break;
        };
        let length = (u32::from_le_bytes([l0, l1, l2, l3]) as usize).min(after.len());
        let (payload, after) = after.split_at(length);
        rest = after;
        let content = match kind {
            0 => Some(Content::Bytes(payload)),
            1 => pose(payload).map(Content::Wheels),
            2 => std::str::from_utf8(payload).ok().map(Content::Lidar),
            3 => mount(payload).map(Content::Mount),
            4 => rate(payload).map(Content::Gyro),
            5 => zero(payload).map(Content::Zero),
            _ => None,
        };
        pieces.extend(content.map(|content| Piece {
            time_us: Some(u64::from_le_bytes(*time)),
            content,
        }));
    }
    pieces
}

/// Why a capture with times ends before it should: it breaks off inside a piece.
#[must_use]
pub fn cut(file: &[u8]) -> Option<String> {
    let mut rest = file.strip_prefix(MAGIC)?;
    let mut whole = 0usize;
    while !rest.is_empty() {
        let piece = match *rest {
            [_, _, _, _, _, _, _, _, _, l0, l1, l2, l3, ref payload @ ..] => {
                payload.get(u32::from_le_bytes([l0, l1, l2, l3]) as usize..)
            }
            _ => None,
        };
        let Some(after) = piece else {
            return Some(format!(
                "the capture breaks off inside a piece, after {whole} whole ones in {} bytes",
                file.len()
            ));
        };
        rest = after;
        whole += 1;
    }
    None
}

fn pose(payload: &[u8]) -> Option<Pose> {
    let (numbers, _) = payload.as_chunks::<4>();
    match *numbers {
        [x, y, theta] => {
            let [x, y, theta] = [x, y, theta].map(f32::from_le_bytes);
            [x, y, theta]
                .iter()
                .all(|number| number.is_finite())
                .then(|| Pose::new(x, y, theta))
        }
        _ => None,
    }
}

fn mount(payload: &[u8]) -> Option<Mount> {
    Some(Mount {
        robot_from_lidar: pose(payload)?,
        // A file from before this was written has only the pose.
        upside_down: payload.get(12) == Some(&1),
    })
}

fn zero(payload: &[u8]) -> Option<u16> {
    payload.try_into().ok().map(u16::from_le_bytes)
}

fn rate(payload: &[u8]) -> Option<f32> {
    let rate = f32::from_le_bytes(payload.try_into().ok()?);
    rate.is_finite().then_some(rate)
}

/// The lidar's bytes of a file with or without times.
#[must_use]
pub fn plain(file: &[u8]) -> Cow<'_, [u8]> {
    if !file.starts_with(MAGIC) {
        return Cow::Borrowed(file);
    }
    let mut plain = Vec::new();
    for piece in pieces(file) {
        if let Content::Bytes(bytes) = piece.content {
            plain.extend_from_slice(bytes);
        }
    }
    Cow::Owned(plain)
}

/// Which lidar a capture names.
#[must_use]
pub fn lidar(file: &[u8]) -> Option<&str> {
    pieces(file).iter().find_map(|piece| match piece.content {
        Content::Lidar(name) => Some(name),
        _ => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const MOUNT: Mount = Mount {
        robot_from_lidar: Pose {
            x: 0.1,
            y: -0.2,
            theta: 3.0,
        },
        upside_down: true,
    };

    /// Of files from before the head-down lidar, which end a byte earlier.
    #[test]
    fn a_mount_without_its_sense_is_upright() {
        let mut recorder = Recorder::new(Vec::new()).expect("memory");
        recorder.push(0, Content::Mount(MOUNT)).expect("memory");
        let mut file = recorder.finish().expect("memory");
        file.pop();
        file[17] -= 1;
        let upright = Mount {
            upside_down: false,
            ..MOUNT
        };
        assert!(
            matches!(pieces(&file)[..], [Piece { content: Content::Mount(mount), .. }] if mount == upright)
        );
    }

    #[test]
    fn what_is_recorded_comes_back() {
        let contents = [
            (0, Content::Lidar("xv11")),
            (0, Content::Mount(MOUNT)),
            (0, Content::Zero(35_850)),
            (5, Content::Bytes(&[1, 2, 3])),
            (1 << 40, Content::Bytes(&[])),
            (7, Content::Wheels(Pose::new(1.5, f32::MIN_POSITIVE, -3.1))),
            (8, Content::Gyro(-0.5)),
            (9, Content::Bytes(&[4])),
        ];
        let mut recorder = Recorder::new(Vec::new()).expect("memory");
        for (time_us, content) in contents {
            recorder.push(time_us, content).expect("memory");
        }
        let file = recorder.finish().expect("memory");
        let back: Vec<_> = pieces(&file)
            .iter()
            .map(|piece| (piece.time_us.expect("written"), piece.content))
            .collect();
        assert_eq!(back, contents);
        assert_eq!(plain(&file)[..], [1, 2, 3, 4]);
        assert_eq!(lidar(&file), Some("xv11"));
        // Cut anywhere: what is left is a start of it.
        for end in 0..file.len() {
            let cut = plain(&file[..end]);
            assert!(
                end < MAGIC.len() || [1, 2, 3, 4].starts_with(&cut),
                "{end}: {cut:?}"
            );
        }
        assert_eq!(plain(&[7, 8])[..], [7, 8]);
        assert!(cut(&file).is_none() && cut(&[7, 8]).is_none());
        for end in [MAGIC.len() + 1, MAGIC.len() + 12, file.len() - 1] {
            assert!(cut(&file[..end]).is_some(), "{end}");
        }
    }
}
