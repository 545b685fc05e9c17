//! Scenes that do not determine a pose, or deceive: each test says which verdict is expected.

use crate::common::{points_from, points_of};
use beamfix::{
    geometry::Pose,
    matching::{
        DegenerateDirection, Match, MatchError,
        icp::{self, IcpConfig, Reference, Search},
    },
    scan::{Beam, Range, ScanPoint},
};
use beamfix_sim::{Noise, Still, TruePose, World, scenes};

const BEAMS: usize = 360;
const SEEDS: u64 = 50;

fn align(
    reference: &[ScanPoint],
    points: &[ScanPoint],
    guess: Pose,
    search: Search,
) -> Result<Match, MatchError> {
    let mut lines = Reference::<BEAMS>::new();
    lines.assign(reference);
    let config = IcpConfig {
        search,
        ..IcpConfig::DEFAULT
    };
    icp::align(&lines, points, guess, &config)
}

/// A motion between two scans, and a guess of it that is off by up to 10 cm and 5 degrees.
fn motion_and_guess(noise: &mut Noise) -> (TruePose, TruePose) {
    let mut draw = |most: f64| noise.even(-most, most);
    let motion = TruePose::new(draw(0.15), draw(0.15), draw(0.15));
    let guess = TruePose::new(
        motion.x + draw(0.1),
        motion.y + draw(0.1),
        motion.theta + draw(0.087),
    );
    (motion, guess)
}

/// A pair of scans of `world`: reference, current, motion, guess.
fn pair(
    world: &World,
    place: TruePose,
    noise: &mut Noise,
) -> (Vec<ScanPoint>, Vec<ScanPoint>, TruePose, TruePose) {
    let (motion, guess) = motion_and_guess(noise);
    let reference = points_from(world, place, BEAMS, noise);
    let current = points_from(world, place.then(motion), BEAMS, noise);
    (reference, current, motion, guess)
}

/// How far `found` is from `truth`: metres and degrees.
fn error(truth: TruePose, found: Pose) -> (f64, f64) {
    let off = truth.between(found.into());
    (off.distance(), off.theta.to_degrees().abs())
}

/// Right: within 5 cm and 1 degree.
fn right(truth: TruePose, found: Pose) -> bool {
    let (metres, degrees) = error(truth, found);
    metres < 0.05 && degrees < 1.0
}

/// Cosine between a weak direction and another one.
fn alike(weak: &DegenerateDirection, other: [f64; 3]) -> f64 {
    let norm = libm::sqrt(other.iter().map(|v| v * v).sum());
    let product: f64 = weak
        .direction
        .iter()
        .zip(other)
        .map(|(a, b)| f64::from(*a) * b)
        .sum();
    (product / norm).abs()
}

/// What matches along a surface without ends came to: how many of [`SEEDS`], and the worst.
#[derive(Debug, Default)]
struct Slides {
    refused: u32,
    /// Accepted as if all directions were known.
    not_weak: u32,
    /// Least cosine between the weak direction and the surface.
    cosine: f64,
    /// Farthest from the guess along the surface, from the truth across it (m), from the true heading (degrees).
    along: f64,
    across: f64,
    turned: f64,
    /// Least standard deviation along the surface by the covariance (m).
    sigma: f64,
}

/// Matches in a world whose faces all run the same way, from a guess off by up to 10 cm and 5 degrees.
fn slide(world: &World) -> Slides {
    let mut slides = Slides {
        cosine: 1.0,
        sigma: f64::INFINITY,
        ..Slides::default()
    };
    for seed in 0..SEEDS {
        let mut noise = Noise::new(seed, 1);
        let place = TruePose::new(
            noise.even(-0.4, 0.4),
            noise.even(-0.4, 0.4),
            noise.even(-3.1, 3.1),
        );
        let (reference, current, motion, guess) = pair(world, place, &mut noise);
        let found = match align(&reference, &current, guess.into(), Search::Local) {
            Ok(found) => found,
            Err(e) => {
                println!("{seed}: {e}");
                slides.refused += 1;
                continue;
            }
        };
        // `place` says how the reference is turned against the face.
        let face = world.segments[0];
        let (dx, dy) = (face.to[0] - face.from[0], face.to[1] - face.from[1]);
        let along = libm::atan2(dy, dx) - place.theta;
        let (s, c) = (libm::sin(along), libm::cos(along));
        match found.degenerate_direction {
            Some(weak) => slides.cosine = slides.cosine.min(alike(&weak, [c, s, 0.0])),
            None => slides.not_weak += 1,
        }
        let moved = TruePose::from(found.pose);
        let kept = (moved.x - guess.x) * c + (moved.y - guess.y) * s;
        let across = (moved.y - motion.y) * c - (moved.x - motion.x) * s;
        slides.along = slides.along.max(kept.abs());
        slides.across = slides.across.max(across.abs());
        let turned = (moved.theta - motion.theta).to_degrees();
        slides.turned = slides.turned.max(turned.abs());
        let v = [c as f32, s as f32, 0.0];
        let variance = f64::from(found.covariance.0.quadratic(v));
        slides.sigma = slides.sigma.min(libm::sqrt(variance));
    }
    slides
}

/// Verdict: `Ok`, weak along the surface, the guess kept along it, the rest right.
fn slides_along(world: &World, name: &str) {
    let slides = slide(world);
    println!("{name}: {slides:?}");
    assert_eq!(slides.refused, 0, "{name}: {slides:?}");
    assert_eq!(slides.not_weak, 0, "{name}: {slides:?}");
    // 0.98 is 11 degrees, part of which is heading: a direction over (x, y, heading).
    assert!(slides.cosine > 0.98, "{name}: {slides:?}");
    assert!(slides.along < 0.01, "{name}: {slides:?}");
    assert!(slides.across < 0.01, "{name}: {slides:?}");
    assert!(slides.turned < 0.2, "{name}: {slides:?}");
}

#[test]
fn a_corridor_without_ends_is_weak_along_it() {
    slides_along(&scenes::corridor(), "corridor");
}

#[test]
fn a_single_wall_is_weak_along_it() {
    slides_along(&scenes::wall(), "wall");
}

/// Verdict: where the guess is kept, the covariance says that the scan knows nothing.
#[test]
fn the_covariance_is_wide_along_a_weak_direction() {
    for (name, world) in [("corridor", scenes::corridor()), ("wall", scenes::wall())] {
        let slides = slide(&world);
        println!("{name}: {slides:?}");
        // The guesses are off by up to 10 cm.
        assert!(slides.sigma > 0.1, "{name}: {slides:?}");
    }
}

/// Verdict: `Ok`, weak about the drum's centre, and the distance from the centre right.
#[test]
fn a_circle_is_weak_about_its_centre() {
    let world = scenes::circle();
    for seed in 0..SEEDS {
        let mut noise = Noise::new(seed, 1);
        let place = TruePose::new(
            noise.even(-1.0, 1.0),
            noise.even(-1.0, 1.0),
            noise.even(-3.1, 3.1),
        );
        let (reference, current, motion, guess) = pair(&world, place, &mut noise);
        let found = align(&reference, &current, guess.into(), Search::Local)
            .unwrap_or_else(|e| panic!("{seed}: {e}"));
        let weak = found
            .degenerate_direction
            .unwrap_or_else(|| panic!("{seed}: not weak"));
        // Turning about the centre by a little moves the lidar across its arm.
        let centre = place.between(TruePose::default());
        let arm = [motion.x - centre.x, motion.y - centre.y];
        let cosine = alike(&weak, [-arm[1], arm[0], f64::from(weak.lever)]);
        assert!(cosine > 0.98, "{seed}: {weak:?}, {cosine} about the centre");
        let seen = place.then(found.pose.into());
        let truth = place.then(motion);
        let off = seen.distance() - truth.distance();
        assert!(off.abs() < 0.01, "{seed}: {off} m off the arc");
    }
}

/// Verdict: right from a guess on the right side; a guess a quarter turn on finds the room a quarter turn on.
#[test]
fn a_square_room_is_determined_but_for_the_quarter_turn_that_the_guess_decides() {
    let mut world = World::default();
    world.block([-2.0, -2.0], [2.0, 2.0]);
    for seed in 0..SEEDS {
        let mut noise = Noise::new(seed, 1);
        let place = TruePose::new(
            noise.even(-1.2, 1.2),
            noise.even(-1.2, 1.2),
            noise.even(-3.1, 3.1),
        );
        let (reference, current, motion, guess) = pair(&world, place, &mut noise);
        let found = align(&reference, &current, guess.into(), Search::Local)
            .unwrap_or_else(|e| panic!("{seed}: {e}"));
        assert!(right(motion, found.pose), "{seed}: {found:?}");
        assert_eq!(found.degenerate_direction, None, "{seed}");
        // The room a quarter turn on, about its middle, is the same room.
        let quarter = TruePose::new(0.0, 0.0, core::f64::consts::FRAC_PI_2);
        let turned = |pose: TruePose| place.between(quarter.then(place.then(pose)));
        let found = align(&reference, &current, turned(guess).into(), Search::Local)
            .unwrap_or_else(|e| panic!("{seed}, turned: {e}"));
        assert!(
            right(turned(motion), found.pose),
            "{seed}, turned: {found:?}"
        );
    }
}

/// Verdict: halfway between two quarters a search without a good guess says `Ambiguous`, or takes one of the two.
#[test]
fn a_square_room_without_a_guess_is_ambiguous() {
    let mut world = World::default();
    world.block([-2.0, -2.0], [2.0, 2.0]);
    let mut ambiguous = 0;
    for seed in 0..SEEDS {
        let mut noise = Noise::new(seed, 1);
        // In the middle, where a quarter turn does not move the lidar.
        let place = TruePose::new(0.0, 0.0, noise.even(-3.1, 3.1));
        let reference = points_from(&world, place, BEAMS, &mut noise);
        let current = points_from(&world, place, BEAMS, &mut noise);
        let guess = Pose::new(0.0, 0.0, core::f32::consts::FRAC_PI_4);
        match align(&reference, &current, guess, Search::Global) {
            Err(MatchError::Ambiguous { .. }) => ambiguous += 1,
            Err(_) => {}
            Ok(found) => {
                let quarter = TruePose::new(0.0, 0.0, core::f64::consts::FRAC_PI_2);
                let either = right(TruePose::default(), found.pose) || right(quarter, found.pose);
                assert!(either, "{seed}: {found:?}");
            }
        }
    }
    println!("{ambiguous} of {SEEDS} ambiguous");
    assert!(ambiguous * 10 >= 9 * SEEDS, "{ambiguous} of {SEEDS}");
}

/// What happened over the seeds of a scene that deceives.
#[derive(Debug, Default)]
struct Tally {
    right: u32,
    refused: u32,
    wrong: Vec<(u64, f64, f64)>,
}

impl Tally {
    fn count(&mut self, seed: u64, truth: TruePose, found: Result<Match, MatchError>) {
        match found {
            Err(_) => self.refused += 1,
            Ok(found) if right(truth, found.pose) => self.right += 1,
            Ok(found) => {
                let (metres, degrees) = error(truth, found.pose);
                self.wrong.push((seed, metres, degrees));
            }
        }
    }
}

/// An office whose walls are glass for some of the beams: those see nothing, or what is behind.
fn through_glass(
    world: &World,
    place: TruePose,
    glass: &[(f64, f64)],
    noise: &mut Noise,
) -> Vec<ScanPoint> {
    let behind = {
        // The same place without its clutter: only the outer walls, three metres farther off.
        let mut w = World::default();
        w.block([-3.0, -3.0], [17.0, 12.0]);
        w
    };
    let still = Still::full_turn(BEAMS);
    let mut beams = still.scan(world, place, noise);
    let far = still.scan(&behind, place, noise);
    for (beam, far) in beams.iter_mut().zip(far) {
        let direction = place.theta + f64::from(beam.bearing.radians());
        // Panes stand in the world: they cover world directions, so both scans see the same ones.
        let turn = direction.rem_euclid(core::f64::consts::TAU);
        if glass.iter().any(|(from, to)| (*from..*to).contains(&turn)) {
            // Which of the three a beam does hangs on dirt and angle: from beam to beam.
            let chance = noise.even(0.0, 1.0);
            if chance < 0.4 {
                *beam = far;
            } else if chance < 0.8 {
                beam.range = Range::from_mm(0);
            }
        }
    }
    points_of(&beams)
}

/// Verdict: right or refused, and right nine times in ten.
#[test]
fn glass_that_beams_pass_or_miss_does_not_deceive() {
    use core::f64::consts::TAU;
    for share in [0.1, 0.2, 0.3] {
        let mut tally = Tally::default();
        for seed in 0..SEEDS {
            let world = scenes::office(seed);
            let mut noise = Noise::new(seed, 1);
            let place = scenes::office_place(&world, 0.5, &mut noise);
            // Four panes; of their beams four fifths are missing or pass.
            let wide = share / 0.8 * TAU / 4.0;
            let glass: Vec<(f64, f64)> = (0..4)
                .map(|k| {
                    let from = f64::from(k) * TAU / 4.0 + noise.even(0.0, TAU / 4.0 - wide);
                    (from, from + wide)
                })
                .collect();
            let (motion, guess) = motion_and_guess(&mut noise);
            let reference = through_glass(&world, place, &glass, &mut noise);
            let current = through_glass(&world, place.then(motion), &glass, &mut noise);
            tally.count(
                seed,
                motion,
                align(&reference, &current, guess.into(), Search::Local),
            );
        }
        println!("glass {share}: {tally:?}");
        assert!(tally.wrong.is_empty(), "glass {share}: {tally:?}");
        assert!(
            tally.right * 10 >= 9 * SEEDS as u32,
            "glass {share}: {tally:?}"
        );
    }
}

/// People around `place` that hide a share of it: round, 20 cm, 0.6 to 2.5 m away.
fn crowd(world: &World, place: TruePose, share: f64, noise: &mut Noise) -> Vec<[f64; 2]> {
    use core::f64::consts::PI;
    let mut people: Vec<[f64; 2]> = Vec::new();
    while covered(world, place, &people) < share {
        let (towards, away) = (noise.even(-PI, PI), noise.even(0.6, 2.5));
        people.push([
            place.x + away * libm::cos(towards),
            place.y + away * libm::sin(towards),
        ]);
    }
    people
}

fn with_people(world: &World, people: &[[f64; 2]]) -> World {
    let mut with = world.clone();
    for &person in people {
        with.column(person, 0.2);
    }
    with
}

/// Share of the beams that people end.
fn covered(world: &World, place: TruePose, people: &[[f64; 2]]) -> f64 {
    let with = with_people(world, people);
    let ends = (0..BEAMS).filter(|k| {
        let direction = *k as f64 * core::f64::consts::TAU / BEAMS as f64;
        let towards = [libm::cos(direction), libm::sin(direction)];
        let from = [place.x, place.y];
        with.cast(from, towards) < world.cast(from, towards)
    });
    ends.count() as f64 / BEAMS as f64
}

/// Matches among people who hide two fifths of the beams and take steps of `least` to `most` metres between the scans,
/// all the same way or each their own.
fn among_people(seeds: u64, steps: (f64, f64), together: bool, guess_off: f64) -> Tally {
    let mut tally = Tally::default();
    for seed in 0..seeds {
        let world = scenes::office(seed);
        let mut noise = Noise::new(seed, 1);
        let place = scenes::office_place(&world, 0.8, &mut noise);
        let (motion, _) = motion_and_guess(&mut noise);
        let before = crowd(&world, place, 0.4, &mut noise);
        let way = noise.even(-3.1, 3.1);
        let after: Vec<[f64; 2]> = before
            .iter()
            .map(|person| {
                let towards = if together { way } else { noise.even(-3.1, 3.1) };
                let step = noise.even(steps.0, steps.1);
                let (s, c) = (libm::sin(towards), libm::cos(towards));
                [person[0] + step * c, person[1] + step * s]
            })
            .collect();
        let (before, after) = (with_people(&world, &before), with_people(&world, &after));
        let reference = points_from(&before, place, BEAMS, &mut noise);
        let current = points_from(&after, place.then(motion), BEAMS, &mut noise);
        let mut off = || noise.even(-guess_off, guess_off);
        let guess = TruePose::new(motion.x + off(), motion.y + off(), motion.theta + off());
        let found = align(&reference, &current, guess.into(), Search::Local);
        tally.count(seed, motion, found);
    }
    tally
}

/// From one scan to the next at 10 turns a second nobody walks farther than this (m).
const ONE_TURN: (f64, f64) = (0.0, 0.15);
/// Between two keyframes they do.
const KEYFRAMES: (f64, f64) = (0.1, 0.3);

/// Verdict: right.
#[test]
fn a_crowd_that_hides_two_fifths_does_not_deceive() {
    for guess_off in [0.03, 0.1] {
        let tally = among_people(100, ONE_TURN, false, guess_off);
        println!("milling, guess off by {guess_off}: {tally:?}");
        assert!(tally.wrong.is_empty(), "{guess_off}: {tally:?}");
        assert!(tally.right >= 98, "{guess_off}: {tally:?}");
    }
}

/// Verdict: right or refused, also where they all walk the same way, or had time for a longer step.
///
/// What near people show in common outweighs the walls in one direction, and both poses explain about as many beams.
#[test]
#[ignore = "wrong and accepted of 200: 11 (same way), 8 (keyframes), 47 (both) with a guess off by 3 cm"]
fn a_crowd_that_walks_one_way_or_far_does_not_deceive() {
    let mut wrong = 0;
    for (name, steps, together) in [
        ("same way", ONE_TURN, true),
        ("milling, keyframes", KEYFRAMES, false),
        ("same way, keyframes", KEYFRAMES, true),
    ] {
        let tally = among_people(200, steps, together, 0.03);
        let (right, refused) = (tally.right, tally.refused);
        println!(
            "{name}: {right} right, {refused} refused, wrong (seed, m, degrees): {:?}",
            tally.wrong
        );
        wrong += tally.wrong.len();
    }
    assert_eq!(wrong, 0);
}

/// Verdict: refused, with the numbers.
#[test]
fn too_little_to_see_is_refused() {
    let mut noise = Noise::new(1, 1);
    let room = points_from(&scenes::room(), TruePose::default(), BEAMS, &mut noise);
    let empty: Vec<Beam> =
        Still::full_turn(BEAMS).scan(&scenes::empty(), TruePose::default(), &mut noise);
    let nothing = points_of(&empty);
    assert_eq!(
        align(&room, &nothing, Pose::IDENTITY, Search::Local).map(|m| m.pose),
        Err(MatchError::TooFewBeams {
            found: 0,
            needed: 30
        })
    );
    assert_eq!(
        align(&nothing, &room, Pose::IDENTITY, Search::Local).map(|m| m.pose),
        Err(MatchError::TooFewLines {
            found: 0,
            needed: 30
        })
    );
}
