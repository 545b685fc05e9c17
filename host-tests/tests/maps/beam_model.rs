//! Learning a beam model: from data of which the parameters are known.

use beamfix::sensor_model::{
    BeamModel,
    beam_model::learning::{ByIncidence, Learner},
};
use beamfix_sim::noise::Noise;

/// A range that `model` gives where `expected` is.
fn draw(model: &BeamModel, expected: f64, noise: &mut Noise) -> Option<f32> {
    let longest = f64::from(model.range_max);
    let cause = noise.even(0.0, 1.0) as f32;
    let range = if cause < model.z_hit {
        loop {
            let range = expected + noise.normal(f64::from(model.sigma));
            if (0.0..longest).contains(&range) {
                break range;
            }
        }
    } else if cause < model.z_hit + model.z_short {
        let lambda = f64::from(model.lambda);
        let cut = 1.0 - libm::exp(-lambda * expected);
        -libm::log(1.0 - noise.even(0.0, 1.0) * cut) / lambda
    } else if cause < model.z_hit + model.z_short + model.z_max {
        return None;
    } else {
        noise.even(0.0, longest)
    };
    Some(range as f32)
}

fn close(got: &BeamModel, made: &BeamModel, share: f32) {
    for (name, got, made) in [
        ("z_hit", got.z_hit, made.z_hit),
        ("z_short", got.z_short, made.z_short),
        ("z_max", got.z_max, made.z_max),
        ("z_rand", got.z_rand, made.z_rand),
        ("sigma", got.sigma, made.sigma),
        ("lambda", got.lambda, made.lambda),
    ] {
        println!("{name}: {got:.4}, made with {made:.4}");
        assert!(
            (got - made).abs() <= share * made,
            "{name}: {got}, made with {made}"
        );
    }
}

const MADE: BeamModel = BeamModel {
    z_hit: 0.75,
    z_short: 0.12,
    z_max: 0.05,
    z_rand: 0.08,
    sigma: 0.03,
    lambda: 0.7,
    range_max: 12.0,
};

#[test]
fn learned_parameters_are_those_that_the_data_were_made_with() {
    let mut noise = Noise::new(1, 1);
    let data: Vec<(Option<f32>, f32)> = (0..300_000)
        .map(|_| {
            let expected = noise.even(1.0, 10.0);
            (draw(&MADE, expected, &mut noise), expected as f32)
        })
        .collect();
    let mut learner = Learner::new(BeamModel::DEFAULT);
    let mut before = f32::NEG_INFINITY;
    let mut steps = 0;
    loop {
        learner.clear();
        for &(range, expected) in &data {
            learner.add(range, expected);
        }
        let mean = learner.mean_log_likelihood();
        assert!(mean >= before, "step {steps}: {mean} after {before}");
        steps += 1;
        learner.model();
        if mean - before < 1e-5 || steps == 60 {
            break;
        }
        before = mean;
    }
    println!("{steps} steps");
    close(&learner.model(), &MADE, 0.05);
}

#[test]
fn streaming_finds_them_too_and_follows_a_change() {
    let mut noise = Noise::new(2, 1);
    let mut learner = Learner::new(BeamModel::DEFAULT);
    let mut stream = |learner: &mut Learner, made: &BeamModel| {
        for scan in 0..6000 {
            for _ in 0..60 {
                let expected = noise.even(1.0, 10.0);
                learner.add(draw(made, expected, &mut noise), expected as f32);
            }
            learner.forget(0.999);
            if scan % 20 == 19 {
                learner.model();
            }
        }
    };
    stream(&mut learner, &MADE);
    // 1000 scans of 60 beams are remembered: 4800 random ones and 7200 short ones, known to 2 to 3 %.
    close(&learner.model(), &MADE, 0.10);
    let glass = BeamModel {
        z_hit: 0.60,
        z_max: 0.20,
        sigma: 0.06,
        ..MADE
    };
    stream(&mut learner, &glass);
    close(&learner.model(), &glass, 0.10);
}

#[test]
fn incidence_separates_what_one_model_mixes() {
    let mut noise = Noise::new(3, 1);
    let mut learners = ByIncidence {
        bins: [(); 4].map(|()| Learner::new(BeamModel::DEFAULT)),
    };
    let data: Vec<(Option<f32>, f32, f32)> = (0..100_000)
        .map(|_| {
            let expected = noise.even(1.0, 10.0);
            let cosine = libm::cos(noise.even(0.0, 1.5));
            let made = BeamModel {
                sigma: (0.01 / cosine.max(0.1)) as f32,
                ..MADE
            };
            (
                draw(&made, expected, &mut noise),
                expected as f32,
                cosine as f32,
            )
        })
        .collect();
    for _ in 0..25 {
        learners.bins.iter_mut().for_each(Learner::clear);
        for &(range, expected, cosine) in &data {
            learners.of(cosine).add(range, expected);
        }
        for learner in &mut learners.bins {
            learner.model();
        }
    }
    let sigmas = learners
        .bins
        .each_mut()
        .map(|learner| learner.model().sigma);
    println!("{sigmas:?}");
    // 1/cos over each bin, mean square: 1.05, 1.45, 3.2, 8 times 1 cm.
    for (sigma, expected) in sigmas.into_iter().zip([0.0105, 0.0147, 0.032, 0.08]) {
        assert!(
            (sigma - expected).abs() < 0.2 * expected,
            "{sigma} {expected}"
        );
    }
}
