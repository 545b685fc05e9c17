//! RPLIDAR HQ packets: 781 bytes, 96 points.
//!
//! Source: as [`super`].
//!
//! | offset | field | unit |
//! | --- | --- | --- |
//! | 0 | `0xA5` | sync |
//! | 1 | time | the sensor's clock, `u64` LE |
//! | 9 + 8k | angle | 360°/65536, `u16` LE |
//! | 11 + 8k | distance, 0 for none | mm/4, `u32` LE |
//! | 15 + 8k | quality; bit 0: first of a revolution | `u8`; `u8` |
//! | 777 | CRC-32 of all before and three zeros | `u32` LE |

use crc::{CRC_32_ISO_HDLC, Crc, Table};

use crate::lidar::wire::answer;
use crate::lidar::wire::framing::Verdict;
use crate::lidar::wire::layout::{Context, Layout, Plain};
use crate::lidar::wire::packet::{self, Reading, View};
use crate::lidar::wire::parser;

/// Bytes of a packet.
pub const FRAME: usize = 781;
const POINTS: usize = 96;
const CRC: Crc<u32, Table<1>> = Crc::<u32, Table<1>>::new(&CRC_32_ISO_HDLC);

/// Push parser of HQ packets. About 900 bytes.
pub type Parser = parser::Parser<Plain<Frames>, FRAME>;

/// HQ packets.
#[derive(Debug, Clone)]
#[doc(hidden)]
pub struct Frames;

impl Layout for Frames {
    type Packet = Packet;

    fn judge(bytes: &[u8]) -> Verdict {
        judge(bytes)
    }

    fn packet(frame: &[u8], context: Context<'_>) -> Option<Packet> {
        let base = context.base;
        let frame: &[u8; FRAME] = frame.try_into().ok()?;
        let &[
            _,
            t0,
            t1,
            t2,
            t3,
            t4,
            t5,
            t6,
            t7,
            ref points @ ..,
            _,
            _,
            _,
            _,
        ] = frame;
        let mut packet = Packet {
            device_time: u64::from_le_bytes([t0, t1, t2, t3, t4, t5, t6, t7]),
            view: View {
                first_us: context
                    .pace
                    .first_us(POINTS as u16, base.period_q8, FRAME as u16),
                ..base
            },
            points: *points,
        };
        let starts = packet.points().position(|&[.., flag]| flag & 1 == 1);
        packet.view.revolution_start = starts.map(|k| k as u16);
        Some(packet)
    }
}

/// Judges bytes that may begin a frame.
fn judge(bytes: &[u8]) -> Verdict {
    match *bytes {
        [0xa5] => Verdict::Need(7),
        [0xa5, 0x5a, ..] if !matches!(answer::judge(bytes), Verdict::No) => answer::judge(bytes),
        [0xa5, ..] => Verdict::on(bytes, FRAME, |frame| {
            frame.split_last_chunk::<4>().is_some_and(|(body, code)| {
                let mut digest = CRC.digest();
                digest.update(body);
                digest.update(&[0; 3]);
                digest.finalize() == u32::from_le_bytes(*code)
            })
        }),
        _ => Verdict::No,
    }
}

/// 96 points.
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Packet {
    /// The sensor's clock, in its own unit.
    pub device_time: u64,
    view: View,
    points: [u8; 8 * POINTS],
}

impl Packet {
    fn points(&self) -> impl Iterator<Item = &[u8; 8]> + '_ {
        self.points
            .chunks_exact(8)
            .filter_map(|point| point.try_into().ok())
    }
}

impl packet::Packet for Packet {
    fn view(&self) -> &View {
        &self.view
    }

    fn readings(&self) -> impl Iterator<Item = Reading> + '_ {
        self.points()
            .map(|&[a0, a1, d0, d1, d2, d3, quality, _]| Reading {
                angle: u32::from_le_bytes([0, 0, a0, a1]),
                range: Reading::range_q2(u32::from_le_bytes([d0, d1, d2, d3])),
                quality: u16::from(quality),
            })
    }
}
