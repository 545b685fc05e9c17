//! Errors of `beamfix::math` against `f64`, over each function's whole domain: the table in `src/math.rs`.
//!
//! Every 509th float is tried; `BEAMFIX_LONG=1` tries every one (minutes, in release).

use core::f64::consts::TAU;

use beamfix::math;
use beamfix_sim::Noise;

/// Floats from `low` to `high`, both of one sign, by their bits.
fn floats(low: f32, high: f32) -> impl Iterator<Item = f32> {
    let step = if std::env::var_os("BEAMFIX_LONG").is_some() {
        1
    } else {
        509
    };
    let (a, b) = (low.to_bits(), high.to_bits());
    let (first, last) = if a < b { (a, b) } else { (b, a) };
    (first..=last)
        .step_by(step)
        .chain([last])
        .map(f32::from_bits)
}

/// Largest of `errors`, with the argument it belongs to; NaN counts as largest.
fn worst(errors: impl Iterator<Item = (f32, f64)>) -> (f32, f64) {
    errors.fold((0.0, 0.0), |worst, now| {
        if now.1.abs() <= worst.1 {
            worst
        } else {
            (now.0, now.1.abs())
        }
    })
}

fn check(name: &str, found: (f32, f64), stated: f64) {
    println!(
        "{name}: {:.3e} at {:?}, stated {stated:.1e}",
        found.1, found.0
    );
    assert!(
        found.1 <= stated,
        "{name}: error {:.4e} at {:?}, stated {stated:.1e}",
        found.1,
        found.0
    );
}

#[test]
fn sqrt_is_correctly_rounded() {
    // A square root in f64 rounded to f32 is the correctly rounded one: 53 bits are more than 2·24 + 1.
    for x in floats(0.0, f32::MAX) {
        assert_eq!(
            math::sqrt(x).to_bits(),
            (f64::from(x).sqrt() as f32).to_bits(),
            "{x}"
        );
    }
    assert!(math::sqrt(-1.0).is_nan() && math::sqrt(f32::NAN).is_nan());
    assert_eq!(math::sqrt(f32::INFINITY), f32::INFINITY);
}

#[test]
fn sin_cos() {
    let angles = || floats(0.0, 100.0).chain(floats(-0.0, -100.0));
    let sine = worst(angles().map(|x| (x, f64::from(math::sin_cos(x).0) - f64::from(x).sin())));
    let cosine = worst(angles().map(|x| (x, f64::from(math::sin_cos(x).1) - f64::from(x).cos())));
    check("sin_cos, sine", sine, 1.5e-7);
    check("sin_cos, cosine", cosine, 1.5e-7);
}

#[test]
fn atan2() {
    // Each direction at each scale, and the axes.
    let scales = [1e-30f64, 1e-3, 1.0, 1e4, 1e30];
    let places = (0..400_000).flat_map(|k| {
        let angle = TAU * (f64::from(k) + 0.37) / 400_000.0;
        scales.map(|r| ((r * angle.sin()) as f32, (r * angle.cos()) as f32))
    });
    let found = worst(places.map(|(y, x)| {
        (
            y / x,
            f64::from(math::atan2(y, x)) - f64::from(y).atan2(f64::from(x)),
        )
    }));
    check("atan2", found, 4e-7);
    assert_eq!(math::atan2(0.0, 0.0), 0.0);
    assert!((math::atan2(0.0, -1.0) - core::f32::consts::PI).abs() < 1e-7);
}

#[test]
fn exp() {
    let values = floats(0.0, 88.0).chain(floats(-0.0, -87.0));
    check(
        "exp",
        worst(values.map(|x| (x, f64::from(math::exp(x)) / f64::from(x).exp() - 1.0))),
        1.5e-7,
    );
}

#[test]
fn ln() {
    let error = |x: f32| {
        let true_ln = f64::from(x).ln();
        (
            x,
            (f64::from(math::ln(x)) - true_ln) / true_ln.abs().max(1.0),
        )
    };
    check(
        "ln",
        worst(floats(f32::MIN_POSITIVE, f32::MAX).map(error)),
        1e-7,
    );
    assert_eq!(math::ln(0.0), f32::NEG_INFINITY);
    assert!(math::ln(-1.0).is_nan());
}

#[test]
fn weight_exp() {
    let error = |x: f32| (x, f64::from(math::weight_exp(x)) / f64::from(x).exp() - 1.0);
    check("weight_exp", worst(floats(-0.0, -80.0).map(error)), 2.5e-3);
    assert_eq!(math::weight_exp(-1000.0), 0.0);
}

#[test]
fn sin_cos_q15_at_every_bearing() {
    let mut largest = 0.0f64;
    for turn in 0..=u16::MAX {
        let angle = TAU * f64::from(turn) / 65536.0;
        let (s, c) = math::sin_cos_q15(turn);
        for (found, exact) in [(s, angle.sin()), (c, angle.cos())] {
            let error = (f64::from(found) - 32767.0 * exact).abs();
            largest = largest.max(error);
            assert!(error <= 1.3, "{turn}: {found}, exactly {}", 32767.0 * exact);
        }
    }
    println!("sin_cos_q15: {largest:.3} of the last place, stated 1.3");
}

#[test]
fn atan2_turn_in_every_direction() {
    let mut largest = 0.0f64;
    let mut check = |y: i32, x: i32| {
        let exact = f64::from(y).atan2(f64::from(x)) / TAU * 65536.0;
        let off = (f64::from(math::atan2_turn(y, x)) - exact).rem_euclid(65536.0);
        let error = off.min(65536.0 - off);
        largest = largest.max(error);
        assert!(error <= 1.1, "({x}, {y}): off by {error} of 1/65536 turn");
    };
    // Every pair of small numbers, in all quadrants.
    for y in -700..=700 {
        for x in -700..=700 {
            if (x, y) != (0, 0) {
                check(y, x);
            }
        }
    }
    // Every ratio that the division can see (16 bits), on and off the octant's ends, then the largest magnitudes.
    for scale in [1i64 << 16, (1 << 20) + 12_345, 1 << 30] {
        for ratio in 0..=65_536i64 {
            let small = (scale * ratio / 65_536) as i32;
            let large = scale as i32;
            for (y, x) in [
                (small, large),
                (large, small),
                (-small, large),
                (large, -small),
                (-small, -large),
            ] {
                check(y, x);
            }
        }
    }
    // Just above a power of two, where the shift drops most: numbers that are no multiples of anything.
    let mut noise = Noise::new(1, 0);
    for k in 0..2_000_000 {
        let scale = 65_536.0 * f64::from(1u32 << (k % 14));
        let large = (scale * noise.even(1.0, 1.1)) as i32;
        let small = (f64::from(large) * noise.even(-1.0, 1.0)) as i32;
        check(small, large);
        check(-large, small);
    }
    println!("atan2_turn: {largest:.3} of 1/65536 turn, stated 1.1");
    assert_eq!(math::atan2_turn(0, 0), 0);
}

#[test]
fn isqrt_is_the_floor_at_every_step() {
    for root in 1..=u32::from(u16::MAX) {
        let square = root * root;
        assert_eq!(math::isqrt(square), root);
        assert_eq!(math::isqrt(square - 1), root - 1);
        assert_eq!(math::isqrt(square + root), root, "between two squares");
    }
    assert_eq!(math::isqrt(0), 0);
    assert_eq!(math::isqrt(u32::MAX), 65_535);
}

#[test]
fn wrap_angle_stays_in_the_half_open_turn() {
    let pi = core::f32::consts::PI;
    let error = |x: f32| {
        let wrapped = math::wrap_angle(x);
        assert!((-pi..pi).contains(&wrapped), "{x}: {wrapped}");
        let off = (f64::from(wrapped) - f64::from(x)).rem_euclid(TAU);
        (x, off.min(TAU - off))
    };
    // Ten turns; the error is that of the angle's own last place there.
    check(
        "wrap_angle",
        worst(floats(0.0, 63.0).chain(floats(-0.0, -63.0)).map(error)),
        4e-6,
    );
}

#[test]
fn rounding_takes_halves_away_from_zero_and_saturates() {
    for (x, expected) in [
        (0.49f32, 0),
        (0.5, 1),
        (-0.5, -1),
        (-0.49, 0),
        (1e20, i32::MAX),
        (-1e20, i32::MIN),
        (f32::NAN, 0),
        (f32::INFINITY, i32::MAX),
    ] {
        assert_eq!(math::round_to_i32(x), expected, "{x}");
    }
    for x in floats(0.0, 8e6).chain(floats(-0.0, -8e6)) {
        // Below half by one last place, the sum rounds up to 1: the one float where this is not the nearest.
        if x.abs() != 0.5f32.next_down() {
            assert_eq!(math::round_to_i32(x), f64::from(x).round() as i32, "{x}");
        }
    }
}

#[test]
fn abs_min_max() {
    assert_eq!(
        (math::abs(-2.0), math::abs(2.0), math::abs(-0.0)),
        (2.0, 2.0, 0.0)
    );
    assert_eq!((math::min(1.0, 2.0), math::min(2.0, 1.0)), (1.0, 1.0));
    assert_eq!((math::max(1.0, 2.0), math::max(2.0, 1.0)), (2.0, 2.0));
    assert_eq!(
        (math::min(f32::NAN, 1.0), math::max(f32::NAN, 1.0)),
        (1.0, 1.0)
    );
    assert!(math::min(1.0, f32::NAN).is_nan() && math::max(1.0, f32::NAN).is_nan());
}

#[test]
fn sin_cos_q15_fine_at_all_angles() {
    let mut largest = 0.0f64;
    for turn in (0..=u32::MAX).step_by(4001) {
        let angle = TAU * f64::from(turn) / 4_294_967_296.0;
        let (s, c) = math::sin_cos_q15_fine(turn);
        for (found, exact) in [(s, angle.sin()), (c, angle.cos())] {
            let error = (f64::from(found) - 32768.0 * exact).abs();
            largest = largest.max(error);
            assert!(error <= 1.7, "{turn}: {found}, exactly {}", 32768.0 * exact);
        }
    }
    println!("sin_cos_q15_fine: {largest:.3} of the last place, stated 1.7");
}

#[test]
fn reciprocal_and_rough_length() {
    let mut largest = 0.0f64;
    for x in 128..=32_767u32 {
        let error = f64::from(math::reciprocal(x)) * f64::from(x) / f64::from(1 << 24) - 1.0;
        largest = largest.max(error.abs());
    }
    println!("reciprocal: {:.3} %, stated 0.5", 100.0 * largest);
    assert!(largest <= 0.005, "reciprocal: {largest}");

    largest = 0.0;
    for scale in [1000.0, f64::from(1 << 16), f64::from(1 << 28)] {
        for k in 0..100_000 {
            let angle = TAU * f64::from(k) / 100_000.0;
            let (x, y) = ((scale * angle.cos()) as i32, (scale * angle.sin()) as i32);
            let exact = f64::from(x).hypot(f64::from(y));
            largest = largest.max((f64::from(math::rough_length(x, y)) / exact - 1.0).abs());
        }
    }
    println!("rough_length: {:.3} %, stated 3", 100.0 * largest);
    assert!(largest <= 0.03, "rough_length: {largest}");
}
