//! A match that was accepted has converged: matched again from its own answer, it stays.

use beamfix::matching::icp::IcpConfig;
use beamfix::math;
use host_tests::formats::pairs;
use host_tests::matcher::Matcher;
use host_tests::shared;

/// Lists of recorded and simulated pairs, and most of their matches (%) that may move by more than a standard deviation: of
/// points that changed to another line some lead to another minimum. Before fine passes went on until they had converged, it
/// was a quarter of all.
const LISTS: [(&str, &str, f64); 5] = [
    ("intel", "intel_cons", 1.0),
    ("fr079", "fr079_cons", 1.0),
    // Half of its beams have no range, the others clutter.
    ("tinyslam1", "tinyslam1", 8.0),
    ("slambot6aug", "slambot6aug", 1.0),
    ("sim", "sim_consec", 0.0),
];

/// Good guesses: the wheels', and the truth disturbed by up to 5 cm and 5 degrees.
const LEVELS: [i32; 2] = [0, 1];

#[test]
fn a_match_of_a_match_moves_nothing() {
    let mut matcher = Matcher::<1024>::new();
    for (scans, list, allowed) in LISTS {
        let (Some(scans), Some(list)) = (
            shared::file(&format!("pairs/host/scans_{scans}.txt.gz")),
            shared::file(&format!("pairs/host/pairs_{list}.csv.gz")),
        ) else {
            continue;
        };
        let pairs = pairs::read(&scans, &list).expect("a list of pairs");
        let (mut matches, mut moved) = (0, Vec::new());
        let good = |pair: &&pairs::Pair| LEVELS.contains(&pair.level);
        for pair in pairs.pairs.iter().filter(good) {
            let mut run = |guess| {
                let pair = pairs::Pair {
                    guess,
                    ..pair.clone()
                };
                matcher.run(&pairs, &pair, &IcpConfig::DEFAULT, |_| ())
            };
            let Ok(first) = run(pair.guess) else { continue };
            matches += 1;
            let covariance = first.covariance.0;
            let sigma = math::sqrt(math::max(covariance.xx, covariance.yy));
            let stays = run(first.pose)
                .is_ok_and(|again| first.pose.between(again.pose).distance() < sigma);
            if !stays {
                moved.push(pair.id);
            }
        }
        let share = 100.0 * moved.len() as f64 / f64::from(matches);
        let name = list.display();
        println!("{name}: {matches} matches, {share:.2} % moved: {moved:?}");
        assert!(matches > 200, "{name}: {matches}");
        assert!(share <= allowed, "{name}: {share:.2} % moved: {moved:?}");
    }
}
