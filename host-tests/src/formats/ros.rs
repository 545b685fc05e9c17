//! ROS recordings: `sensor_msgs/LaserScan` and `nav_msgs/Odometry` of one topic each, and the static transforms.
//!
//! Read are MCAP files, SQLite bags, and rosbag2's folders, packed or not. Odometry is the last message up to a scan's
//! last beam.

pub mod bag;
pub mod decoder;
pub mod message;
mod tree;

use anyhow::{Result, bail};
use beamfix::scan::{Beam, Bearing};

use self::bag::{Bag, Topic};
use self::message::{Kind, Laser, Odometry, Transform};
use self::tree::Tree;
use super::no_return::{Limits, Rule};
use super::order::{self, Timing};
use super::{Log, Options, Recorded, clock::Clock};

/// Reads the scans of one laser topic.
pub fn parse(bag: Bag, options: &Options) -> Result<Log> {
    let mut log = Log {
        cut: bag.cut.clone(),
        ..Log::default()
    };
    let lasers = Choice::of(&bag, Kind::Laser, "scan", options.scan_topic.as_deref())?;
    let odometries = Choice::of(&bag, Kind::Odometry, "odom", options.odom_topic.as_deref())?;
    let Some(taken) = lasers.taken else {
        if log.cut.is_none() {
            log.cut = Some(nothing(&bag));
        }
        return Ok(log);
    };
    let mut tree = Tree::default();
    let mut wheels: Vec<Odometry> = Vec::new();
    // Each scan, and how many wheel poses came before it.
    let mut scans: Vec<(Laser, usize)> = Vec::new();
    for (number, message) in bag.messages.iter().enumerate() {
        let topic = &bag.topics[message.topic];
        let (data, layout) = (&message.data[..], topic.layout);
        let result = match topic.kind {
            Kind::Static => Transform::read_all(data, layout).map(|all| tree.take(all)),
            Kind::Odometry if odometries.taken == Some(message.topic) => {
                Odometry::read(data, layout).map(|odometry| wheels.push(odometry))
            }
            Kind::Laser if taken == message.topic => {
                Laser::read(data, layout).map(|laser| scans.push((laser, wheels.len())))
            }
            _ => Ok(()),
        };
        if let Err(error) = result {
            log.skip(
                format!("message {number} ({})", topic.name),
                format!("{error:#}"),
            );
        }
    }
    let Some((first, _)) = scans.first() else {
        return Ok(log);
    };
    let mut source = format!("ROS bag, scans {}", lasers.said(&bag));
    source += &match odometries.taken {
        Some(_) => format!(", wheels {}", odometries.said(&bag)),
        None => ", no wheels".into(),
    };
    let mut scans_of_limits: Vec<Limits> = Vec::new();
    for (laser, _) in &scans {
        scans_of_limits.push(Limits::stated(laser.nearest, laser.farthest));
    }
    if Limits::is_impossible(first.nearest, first.farthest) {
        source += &format!(", range_max {} m is not believed", first.farthest);
    }
    let base = wheels.first().map(|odometry| &odometry.child[..]);
    source += &mounted(&mut log, &tree, base, &first.header.frame);
    let limits = |k: usize| scans_of_limits[k];
    let readings = scans.iter().enumerate();
    let rule = Rule::of(readings.map(|(k, (laser, _))| (&laser.ranges[..], limits(k))));
    let mut clock = Clock::new();
    let times: Vec<u32> = scans
        .iter()
        .map(|(laser, _)| clock.at(laser.header.seconds()))
        .collect();
    let mount = options.mount.unwrap_or(log.mount);
    let beams = |k: usize, timing: &Timing| {
        let mut beams = beams(&scans[k].0, rule, limits(k));
        timing.apply(&mut beams, times[k], mount.upside_down);
        beams
    };
    let (timing, how) = timing(first, options, |candidates| {
        order::fitting(candidates, scans.len(), mount, beams)
    });
    source += &how;
    let history = History::of(
        &wheels,
        scans.iter().map(|(laser, _)| laser.header.seconds()),
    );
    for (k, (laser, before)) in scans.iter().enumerate() {
        log.odd.count(&laser.ranges);
        let end = laser.header.seconds() + timing.end(laser.ranges.len());
        log.scans.push(Recorded {
            stamp: format!("{}.{:09}", laser.header.sec, laser.header.nanosec),
            wheels: history
                .at(end, *before)
                .map(|odometry| odometry.pose.into()),
            beams: beams(k, &timing),
        });
    }
    log.lidar = Some(bag.topics[taken].name.clone());
    log.source = source;
    Ok(log)
}

/// Wheel odometry over time.
struct History<'a> {
    /// In the order of the file.
    all: &'a [Odometry],
    /// In the order of their stamps, where these are of the same clock as the scans'.
    by_stamp: Option<Vec<&'a Odometry>>,
}

impl<'a> History<'a> {
    fn of(all: &'a [Odometry], scans: impl Iterator<Item = f64>) -> Self {
        let mut sorted: Vec<&Odometry> = all.iter().collect();
        sorted.sort_by(|a, b| a.header.seconds().total_cmp(&b.header.seconds()));
        let mut stamps: Vec<f64> = scans.collect();
        stamps.sort_by(f64::total_cmp);
        let middle = stamps.get(stamps.len() / 2).copied().unwrap_or(0.0);
        let ends = [sorted.first(), sorted.last()].map(|end| end.map(|end| end.header.seconds()));
        let is_same_clock =
            matches!(ends, [Some(first), Some(last)] if first <= middle && middle <= last);
        Self {
            all,
            by_stamp: is_same_clock.then_some(sorted),
        }
    }

    /// The last pose that was measured up to `end` (s); by clocks that do not agree, the last one in the file before.
    fn at(&self, end: f64, before: usize) -> Option<&'a Odometry> {
        match &self.by_stamp {
            Some(sorted) => {
                // Stamps of one moment that went through floating point.
                let count = sorted.partition_point(|wheels| wheels.header.seconds() <= end + 1e-5);
                sorted[..count].last().copied()
            }
            None => self.all[..before].last(),
        }
    }
}

/// Why a bag gives no scan.
fn nothing(bag: &Bag) -> String {
    let mut names: Vec<&str> = bag.others.iter().map(String::as_str).collect();
    names.extend(bag.topics.iter().map(|topic| &topic.name[..]));
    names.sort_unstable();
    names.dedup();
    let shown = names.iter().take(10).copied().collect::<Vec<_>>().join(" ");
    let more = if names.len() > 10 { " …" } else { "" };
    format!("a ROS bag without a topic of sensor_msgs/msg/LaserScan; topics: {shown}{more}")
}

/// When the beams were measured, and a remark where that is not what the file says.
fn timing(
    first: &Laser,
    options: &Options,
    fitting: impl Fn(&[Timing]) -> order::Fit,
) -> (Timing, String) {
    let (step, scan_time) = (f64::from(first.time_step), f64::from(first.scan_time));
    if let Some(order) = options.beams {
        let timing = Timing::told(order, step, scan_time, first.ranges.len());
        let note = if timing.order == order {
            format!(", beams {order} as told")
        } else {
            format!(", beams at once: the file states no time, so none to be {order} in")
        };
        return (timing, note);
    }
    let candidates = Timing::candidates(step);
    let fit = fitting(&candidates);
    let timing = fit.timing.unwrap_or(candidates[0]);
    let note = if fit.gain > 0.0 {
        format!(
            ", beams {}: so their scans fit best (a match's score is {:.2} higher than by the file's time_increment {step} s)",
            timing.order, fit.gain
        )
    } else {
        format!(", beams {}", timing.order)
    };
    (timing, note)
}

/// Takes the mount from the static transforms; says where it is from.
fn mounted(log: &mut Log, tree: &Tree, base: Option<&str>, lidar: &str) -> String {
    let base = base.map_or_else(|| tree.base(lidar), str::to_owned);
    if base == lidar {
        return String::new();
    }
    match tree.mount(&base, lidar) {
        Some((mount, tilt)) => {
            log.mount = mount;
            log.is_mount_told = true;
            let tilt = tilt.to_degrees();
            let tilted = if tilt > 5.0 {
                format!(", tilted by {tilt:.0}° (taken as level)")
            } else {
                String::new()
            };
            format!(", mount of {lidar} on {base} by /tf_static{tilted}")
        }
        None => format!(", no static transform from {base} to {lidar}"),
    }
}

/// Beams in the order of the array, all at time 0.
fn beams(laser: &Laser, rule: Rule, limits: Limits) -> Vec<Beam> {
    let beam = |(k, &reading): (usize, &f32)| {
        let bearing = f64::from(laser.first) + f64::from(laser.step) * k as f64;
        Beam {
            bearing: Bearing::from_radians(bearing as f32),
            range: rule.range(reading, limits),
            time_us: 0,
            quality: 0,
        }
    };
    laser.ranges.iter().enumerate().map(beam).collect()
}

/// Which topic of a kind is read.
struct Choice {
    taken: Option<usize>,
    /// Others of the kind that have messages.
    others: Vec<usize>,
}

impl Choice {
    /// The topic called `wanted`; else the one with the usual name; else one that ends in it; else the one with the
    /// most messages.
    fn of(bag: &Bag, kind: Kind, usual: &str, wanted: Option<&str>) -> Result<Self> {
        let topics = bag.topics.iter().enumerate();
        let mut all: Vec<(usize, &Topic)> = topics
            .filter(|(_, topic)| topic.kind == kind && topic.count > 0)
            .collect();
        let plain = |name: &str| name.trim_start_matches('/').to_owned();
        if let Some(wanted) = wanted
            && !all
                .iter()
                .any(|(_, topic)| plain(&topic.name) == plain(wanted))
        {
            let names: Vec<&str> = all.iter().map(|(_, topic)| &topic.name[..]).collect();
            bail!(
                "no topic {wanted} of this kind; there are: {}",
                if names.is_empty() {
                    "none".into()
                } else {
                    names.join(" ")
                }
            );
        }
        // Stable: of equals the first in the file.
        all.sort_by_key(|(_, topic)| {
            let name = plain(&topic.name);
            let rank = match wanted {
                Some(wanted) => usize::from(name != plain(wanted)),
                None if name == usual => 0,
                None if name.rsplit('/').next() == Some(usual) => 1,
                None => 2,
            };
            (rank, usize::MAX - topic.count)
        });
        let mut numbers = all.into_iter().map(|(number, _)| number);
        Ok(Self {
            taken: numbers.next(),
            others: numbers.collect(),
        })
    }

    /// The name of what is taken, and of what is not.
    fn said(&self, bag: &Bag) -> String {
        let name = |&number: &usize| &bag.topics[number].name[..];
        let mut text = self.taken.as_ref().map_or("none", name).to_owned();
        if !self.others.is_empty() {
            let others: Vec<&str> = self.others.iter().map(name).collect();
            text += &format!(" (not {})", others.join(", "));
        }
        text
    }
}
