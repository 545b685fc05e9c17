//! A board's telemetry as a capture: its frames with the lidar's bytes, where it was told to send them.

use beamfix::geometry::Pose;
use beamfix_app::link::Receiver;
use beamfix_app::telemetry::{Ready, Telemetry};

use crate::formats::capture::{Content, MAGIC, Recorder};

/// A file of a board's frames as a capture ([`super`]); `None` for any other file.
///
/// The board's clock wraps after 71 minutes; here it goes on. Other frames are left out, damaged ones too.
#[must_use]
pub fn capture(file: &[u8]) -> Option<Vec<u8>> {
    if file.starts_with(MAGIC) {
        return None;
    }
    let mut receiver = Receiver::new();
    let mut recorder = Recorder::new(Vec::new()).ok()?;
    let (mut clock, mut is_any, mut is_set_up) = (Clock::default(), false, false);
    for &byte in file {
        let Some(message) = receiver.push::<Telemetry>(byte) else {
            continue;
        };
        if let Telemetry::Ready(ready) = &message
            && !is_set_up
        {
            for content in setup(ready) {
                recorder.push(0, content).ok()?;
            }
            is_set_up = true;
        }
        if let Some((time_us, content)) = content(&message) {
            recorder.push(clock.after(time_us), content).ok()?;
            is_any |= matches!(content, Content::Bytes(_));
        }
    }
    // A check code of 16 bits holds once by chance; a board's frames fail it now and then.
    let counters = receiver.counters();
    (is_any && counters.frames > counters.errors).then(|| recorder.finish().ok())?
}

/// What a capture needs to know of a board besides what comes in later: its lidar, where it tells which, and its mount.
pub fn setup(ready: &Ready) -> impl Iterator<Item = Content<'_>> {
    let lidar = Some(ready.lidar.as_str()).filter(|name| !name.is_empty());
    let mount = Content::Mount(ready.mount.mount());
    lidar.map(Content::Lidar).into_iter().chain([mount])
}

/// What a board's message adds to a capture, and when it came in (µs, the board's clock, wrapping).
#[must_use]
pub fn content(message: &Telemetry) -> Option<(u32, Content<'_>)> {
    match message {
        Telemetry::Raw(raw) => Some((raw.time_us, Content::Bytes(&raw.bytes))),
        Telemetry::Wheels(wheels) => {
            let [x, y, theta] = wheels.pose;
            Some((wheels.time_us, Content::Wheels(Pose { x, y, theta })))
        }
        Telemetry::Gyro(gyro) => Some((gyro.time_us, Content::Gyro(gyro.rate))),
        Telemetry::Zero(zero) => Some((zero.time_us, Content::Zero(zero.zero_cdeg))),
        _ => None,
    }
}

/// A board's clock, which wraps after 71 minutes, going on.
#[derive(Debug, Default)]
pub struct Clock {
    last_us: Option<u64>,
}

impl Clock {
    /// The time of the next message (µs).
    pub fn after(&mut self, time_us: u32) -> u64 {
        // Nothing is sent out of order.
        let last_us = self.last_us.unwrap_or(time_us.into());
        let now_us = last_us + u64::from(time_us.wrapping_sub(last_us as u32));
        self.last_us = Some(now_us);
        now_us
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::formats::capture::{pieces, plain};
    use beamfix_app::{App, CONFIG, command::Command, link};

    #[test]
    fn a_boards_frames_are_a_recording() {
        let mut app = App::<64>::new(CONFIG);
        let mut sent = Vec::new();
        let mut ask = heapless::Vec::<u8, 64>::new();
        let send = Command::Send {
            raw: true,
            scans: true,
            quality: true,
        };
        assert!(link::append(&send, &mut ask) && link::append(&Command::Health, &mut ask));
        app.command_all(&ask, |out| sent.extend_from_slice(out));
        let line: Vec<u8> = (0..2000u32).map(|k| ((k * k) >> 3) as u8).collect();
        let start = u32::MAX - 40_000;
        for (k, &byte) in line.iter().enumerate() {
            app.set_time(start.wrapping_add(43 * k as u32));
            app.lidar_all(&[byte], |out| sent.extend_from_slice(out));
        }
        let file = capture(&sent).expect("a board's frames");
        let back = plain(&file);
        // The last piece waits for more.
        assert!(
            back.len() > 1900 && line.starts_with(&back),
            "{}",
            back.len()
        );
        let times: Vec<_> = pieces(&file).iter().map(|piece| piece.time_us).collect();
        let whole: u64 = 43 * (times.len() as u64 - 1) * 47;
        assert!(times.is_sorted());
        let (first, last) = (
            times[0].expect("time"),
            times[times.len() - 1].expect("time"),
        );
        assert!((last - first).abs_diff(whole) < 3000, "{first} {last}");
        // A damaged frame costs its piece only.
        sent[1000] ^= 4;
        let damaged = capture(&sent).expect("still a board's frames");
        assert!(plain(&damaged).len() + 100 > back.len());
        assert_eq!(capture(&line), None);
        assert_eq!(capture(&file), None);
    }
}
