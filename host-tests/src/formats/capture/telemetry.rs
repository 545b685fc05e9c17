//! A board's telemetry as a capture: its frames with the lidar's bytes, where it was told to send them.

use beamfix_app::link::Receiver;
use beamfix_app::telemetry::Telemetry;

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
    let (mut time_us, mut is_any) = (0u64, false);
    for &byte in file {
        let Some(Telemetry::Raw(raw)) = receiver.push::<Telemetry>(byte) else {
            continue;
        };
        let passed = raw.time_us.wrapping_sub(time_us as u32);
        // Nothing is sent out of order: what seems to be is the first one.
        time_us += u64::from(passed);
        recorder.push(time_us, Content::Bytes(&raw.bytes)).ok()?;
        is_any = true;
    }
    // A check code of 16 bits holds once by chance; a board's frames fail it now and then.
    let counters = receiver.counters();
    (is_any && counters.frames > counters.errors).then(|| recorder.finish().ok())?
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
        for &byte in &ask {
            sent.extend_from_slice(app.command(byte));
        }
        let line: Vec<u8> = (0..2000u32).map(|k| ((k * k) >> 3) as u8).collect();
        let start = u32::MAX - 40_000;
        for (k, &byte) in line.iter().enumerate() {
            app.set_time(start.wrapping_add(43 * k as u32));
            sent.extend_from_slice(app.lidar(byte));
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
