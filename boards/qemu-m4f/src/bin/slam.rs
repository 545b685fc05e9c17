//! Mapping over a recording in the memory of a tier; see `beamfix_emulated::slam`.
#![no_std]
#![no_main]

use beamfix::{odometry::OdometryConfig, pipeline::Tracker};
#[cfg(any(not(feature = "tier-64k"), feature = "tier-512k"))]
use beamfix::{pipeline::Mapper, slam::SlamConfig};
use beamfix_emulated::{finish, slam, stack::Stack};
use qemu_m4f::clock::Timer;

#[cfg(all(feature = "tier-64k", not(feature = "tier-512k")))]
type Tier = beamfix::pipeline::Mapper64k;
#[cfg(all(feature = "tier-64k", not(feature = "tier-512k")))]
const BEAMS: usize = 512;
#[cfg(all(feature = "tier-64k", not(feature = "tier-512k")))]
const NEW: Tier = Tier::new(OdometryConfig::DEFAULT);

#[cfg(not(any(feature = "tier-64k", feature = "tier-512k")))]
type Tier = beamfix::pipeline::Mapper192k;
#[cfg(not(any(feature = "tier-64k", feature = "tier-512k")))]
const BEAMS: usize = 720;
#[cfg(feature = "tier-512k")]
type Tier = beamfix::pipeline::Mapper512k;
#[cfg(feature = "tier-512k")]
const BEAMS: usize = 1024;
#[cfg(any(not(feature = "tier-64k"), feature = "tier-512k"))]
const NEW: Tier = Mapper::new(OdometryConfig::DEFAULT, SlamConfig::DEFAULT);

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut TRACKER: Tracker<Tier, BEAMS> = Tracker::new(NEW);
    finish(slam::run(TRACKER, &mut Timer, &Stack::paint()))
}
