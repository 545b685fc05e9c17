//! Simulated buildings: a loop closed, a full memory, two rooms that look alike.

use beamfix::{
    pipeline::{Mapper64k, Mapper192k, Mapper512k, Tracker},
    slam::{Slam, Slam192k, SlamConfig},
};

use super::drive::{drive, path};
use host_tests::mapping::building::{ROUND, TWINS, ring, twins};

#[test]
fn a_loop_is_closed() {
    let truth = path(&ROUND, 2);
    let mut slam = Box::new(Slam192k::new(SlamConfig::DEFAULT));
    // 1.7 degrees in 10 m: after a round of 75 m odometry is off by metres.
    let driven = drive(&mut slam, &ring(), &truth, 0.003, 1);
    let (mapped, odometry) = driven.errors(&truth);
    let counters = slam.counters();
    assert!(odometry > 2.0, "{odometry} m");
    // Along the bare middle of a corridor of 20 m nothing but the odometry tells: its error, spread over the round.
    assert!(
        mapped < 0.35,
        "{mapped} m, by odometry {odometry} m: {counters:?}"
    );
    assert!(counters.loops > 20 && counters.no_room == 0, "{counters:?}");
}

#[test]
fn a_full_memory_goes_on() {
    let truth = path(&ROUND, 4);
    let mut slam = Box::new(Slam::<100, 200, 400, 144, 360>::new(SlamConfig::DEFAULT));
    let driven = drive(&mut slam, &ring(), &truth, 0.002, 2);
    let (mapped, odometry) = driven.errors(&truth);
    let counters = slam.counters();
    assert!(counters.pruned > 100, "{counters:?}");
    assert!(slam.graph().len() <= 100 && slam.graph().edges().len() <= 200);
    assert!(
        mapped < 0.5 && odometry > 2.0,
        "{mapped} m, by odometry {odometry} m: {counters:?}"
    );
}

#[test]
fn two_rooms_alike_are_not_closed_into_one() {
    let w = twins();
    let truth = path(&TWINS, 2);
    for seed in 0..20 {
        let drift = [0.0, 0.004, -0.004][seed as usize % 3];
        let mut slam = Box::new(Slam192k::new(SlamConfig::DEFAULT));
        let driven = drive(&mut slam, &w, &truth, drift, seed);
        let (mapped, odometry) = driven.errors(&truth);
        // A wrong loop would bring the rooms together: 9 m.
        assert!(
            mapped < 0.3,
            "seed {seed}, drift {drift}: {mapped} m, by odometry {odometry} m: {:?}",
            slam.counters()
        );
    }
}

#[test]
fn tiers_leave_room_for_the_stack() {
    // The deepest stack measured is 8.5 KB: `beamfix card --tier 192k` proves it on a core with just that RAM.
    const STACK: usize = 10 << 10;
    for (name, bytes, there_are) in [
        ("64k", size_of::<Tracker<Mapper64k, 512>>(), 64 << 10),
        ("192k", size_of::<Tracker<Mapper192k, 720>>(), 192 << 10),
        ("512k", size_of::<Tracker<Mapper512k, 1024>>(), 512 << 10),
    ] {
        println!("{name}: {bytes} bytes");
        assert!(bytes + STACK <= there_are, "{name}: {bytes} bytes");
        // And the tier is used up: more keyframes would find room otherwise.
        assert!(bytes + 4 * STACK > there_are, "{name}: {bytes} bytes");
    }
}

#[test]
fn ten_rounds_at_fixed_capacity_stay_as_good_as_the_first() {
    const ROUNDS: usize = 10;
    let truth = path(&ROUND, ROUNDS);
    // A round has 76 keyframes: from the second on one goes for each that comes.
    let mut slam = Box::new(Slam::<90, 200, 400, 144, 360>::new(SlamConfig::DEFAULT));
    let driven = drive(&mut slam, &ring(), &truth, 0.002, 5);
    let round = truth.len() / ROUNDS;
    let error = |range: std::ops::Range<usize>| {
        let poses = driven.mapped[range.clone()].iter().zip(&truth[range]);
        let squares = poses.map(|(pose, truth)| {
            (f64::from(pose.x) - truth.x).powi(2) + (f64::from(pose.y) - truth.y).powi(2)
        });
        (squares.sum::<f64>() / round as f64).sqrt()
    };
    let (first, last) = (error(0..round), error((ROUNDS - 1) * round..ROUNDS * round));
    let counters = slam.counters();
    println!("first round {first:.3} m, last {last:.3} m: {counters:?}");
    assert!(
        counters.pruned > 500 && counters.no_room == 0,
        "{counters:?}"
    );
    // And 1 cm, which is what a range tells.
    assert!(
        last <= 1.2 * first + 0.01,
        "first round {first} m, last {last} m: {counters:?}"
    );
}
