//! Mapping over a recording in the memory of a tier; see `beamfix_emulated::slam`.
#![no_std]
#![no_main]

use beamfix::{
    odometry::OdometryConfig,
    pipeline::{Mapper, Tracker},
    slam::SlamConfig,
};
use beamfix_emulated::{finish, slam, stack::Stack};
use qemu_m4f::clock::Timer;

#[cfg(not(feature = "tier-512k"))]
type Tier = beamfix::pipeline::Mapper192k;
#[cfg(not(feature = "tier-512k"))]
const BEAMS: usize = 720;
#[cfg(feature = "tier-512k")]
type Tier = beamfix::pipeline::Mapper512k;
#[cfg(feature = "tier-512k")]
const BEAMS: usize = 1024;

#[cortex_m_rt::entry]
fn main() -> ! {
    static mut TRACKER: Tracker<Tier, BEAMS> =
        Tracker::new(Mapper::new(OdometryConfig::DEFAULT, SlamConfig::DEFAULT));
    finish(slam::run(TRACKER, &mut Timer, &Stack::paint()))
}
