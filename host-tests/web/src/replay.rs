//! A recording that was dropped on the page.

use anyhow::{Result, bail};
use beamfix::lidar::Model;
use host_tests::formats::capture::{Piece, pieces};
use host_tests::formats::{self, Log, Options, Recorded, bytes};
use host_tests::size;

use crate::twin::BEAMS;

/// A recording, and how much of it was replayed.
pub struct Replay {
    pub log: Log,
    /// Remarks of one line each.
    pub remarks: Vec<String>,
    /// As the tool takes them.
    pub directions: usize,
    /// Of a capture: an instance has one, which stays until its end.
    pieces: Vec<Piece<'static>>,
    next: usize,
}

/// What comes next.
pub enum Next<'a> {
    Piece(Piece<'a>),
    Scan(&'a Recorded),
}

impl Replay {
    /// Reads a log, a bag or a capture as the tool does.
    pub fn open(name: &str, lidar: &str, file: Vec<u8>) -> Result<Self> {
        let content = bytes::unpack(name, file)?;
        let options = Options {
            lidar: (lidar != "auto" && !lidar.is_empty()).then(|| lidar.to_owned()),
            ..Options::default()
        };
        // A capture without a name for its lidar is told by its frames where it is nothing else.
        let or_bytes = Options {
            lidar: Some("auto".into()),
            ..Options::default()
        };
        let mut log =
            formats::parse(name.to_owned(), content.clone(), &options).or_else(|why| {
                if options.lidar.is_some() {
                    return Err(why);
                }
                formats::parse(name.to_owned(), content, &or_bytes).map_err(|_| why)
            })?;
        let scans = || log.scans.iter().map(|scan| &scan.beams[..]);
        if size::beam_width(scans()).is_some() {
            bail!("{name}: a ring of rangers, which `beamfix replay` follows");
        }
        let directions = size::fitting(scans());
        let mut remarks = vec![log.source.clone()];
        let thinned = log.thin(directions.min(BEAMS));
        if thinned > 0 {
            remarks.push(format!(
                "{thinned} beams are left out, evenly over the directions"
            ));
        }
        remarks.extend(log.remarks());
        remarks.extend(log.cut.clone());
        let pieces = match &mut log.capture {
            Some(capture) => pieces(std::mem::take(&mut capture.bytes).leak()),
            None => Vec::new(),
        };
        Ok(Self {
            log,
            remarks,
            directions,
            pieces,
            next: 0,
        })
    }

    /// The lidar of a capture.
    pub fn model(&self) -> &'static Model {
        let capture = self.log.capture.as_ref();
        capture.map_or(&Model::LDROBOT_LD06, |capture| capture.model)
    }

    /// Hands on what comes next for as long as `take` wants more; true where something is left.
    pub fn go_on(&mut self, take: &mut dyn FnMut(Next<'_>) -> bool) -> bool {
        let scans = match &self.log.capture {
            Some(_) => &[],
            None => &self.log.scans[..],
        };
        let pieces = self.pieces.iter().map(|piece| Next::Piece(*piece));
        for next in pieces.chain(scans.iter().map(Next::Scan)).skip(self.next) {
            self.next += 1;
            if !take(next) {
                return true;
            }
        }
        false
    }
}
