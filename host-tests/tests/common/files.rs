//! A file of each kind that the tool reads, and what comes of it when it is damaged.

use beamfix::lidar::Model;
use beamfix_sim::{Settings, TruePose, drive, encoder::ld06::Sensor};
use host_tests::formats::{
    self, Options,
    bytes::{self, Content},
    capture, carmen,
    ros_map::{header::Header, picture::Picture},
};

use super::bag::{Bag, Scanner};

/// Recording, CARMEN log, ROS 2 bag, a map's picture and header, as this project writes them, and nothing.
pub fn whole() -> [Vec<u8>; 6] {
    let settings = Settings {
        seconds: 0.6,
        mount: TruePose::new(0.1, 0.0, 0.0),
        ..Settings::DEFAULT
    };
    let run = drive(&settings, &mut Sensor::ld06());
    let (recording, ..) =
        capture::simulated::capture(&run, settings.mount, &Model::LDROBOT_LD06).expect("a drive");
    let content = Content {
        bytes: recording.clone(),
        cut: None,
    };
    let log = formats::parse("whole".into(), content, &Options::default()).expect("it is read");
    let mut bag = Bag::default();
    let scanner = Scanner {
        frame: "laser",
        first: -3.0,
        step: 0.1,
        time_step: 0.001,
        scan_time: 0.1,
        nearest: 0.1,
        farthest: 10.0,
    };
    for k in 0..3 {
        bag.laser("/scan", 1.0 + 0.1 * f64::from(k), &scanner, &[1.5; 60]);
    }
    let mut picture = b"P5\n# a map\n20 12\n255\n".to_vec();
    picture.extend((0..240u8).map(|k| if k % 7 == 0 { 0 } else { 254 }));
    let header = "image: map.pgm\nmode: trinary\nresolution: 0.05\norigin: [-1.0, -2.0, 0.0]\n\
                  negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n";
    [
        recording,
        carmen::written(&log).into_bytes(),
        bag.mcap(None),
        picture,
        header.into(),
        Vec::new(),
    ]
}

/// Damage to a file: bytes that are other than written, bytes that come in, and where it ends.
#[derive(Debug, Clone)]
pub struct Damage {
    pub flips: Vec<(u16, u8)>,
    pub insert: (u16, Vec<u8>),
    pub end: Option<u16>,
}

impl Damage {
    pub fn hit(&self, file: &mut Vec<u8>) {
        let len = file.len().max(1);
        for &(at, by) in &self.flips {
            if let Some(byte) = file.get_mut(usize::from(at) * 7 % len) {
                *byte ^= by;
            }
        }
        let at = (usize::from(self.insert.0) % len).min(file.len());
        file.splice(at..at, self.insert.1.iter().copied());
        if let Some(end) = self.end {
            file.truncate(usize::from(end));
        }
    }
}

/// Reads a file of this kind; whether there was anything in it.
///
/// # Panics
/// Where what is read is not what a log or a picture promises.
pub fn read(kind: usize, file: Vec<u8>) -> bool {
    match kind {
        3 => Picture::parse(&file).is_ok_and(|picture| {
            let last = (picture.width() - 1, picture.height() - 1);
            let _ = picture.pixel(last.0, last.1);
            true
        }),
        4 => Header::parse(&String::from_utf8_lossy(&file)).is_ok(),
        _ => bytes::unpack("damaged", file)
            .and_then(|content| formats::parse("damaged".into(), content, &Options::default()))
            .is_ok_and(|log| {
                assert!(!log.scans.is_empty(), "a log without a scan is an error");
                let beams = log.scans.iter().map(|scan| scan.beams.len());
                assert!(beams.sum::<usize>() > 0, "a log without a beam is an error");
                true
            }),
    }
}
