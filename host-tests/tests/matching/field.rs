//! Matching against likelihood fields: accuracy on pairs with known motion.

use crate::common::{field_of, over_pairs};
use beamfix::{
    matching::field::{self, FieldConfig},
    sensor_model::likelihood_field::FieldModel,
};

#[test]
fn scan_to_field_is_as_exact_as_the_scans_allow() {
    // Coarse to fine: cells of 20 cm and σ 0.3 m reach 0.7 m, cells of 5 cm and σ 0.075 m have the accuracy.
    let coarse_model = FieldModel::new(0.9, 0.1, 12.0, 0.3).expect("good");
    let loose = FieldConfig {
        translation_tolerance: 0.2,
        rotation_tolerance: 0.06,
        max_inlier_distance: 0.6,
        min_inlier_share: 0.1,
        ..FieldConfig::DEFAULT
    };
    let Some([count, right, mm, degrees]) = over_pairs(1, |pair, reference, current| {
        let coarse = field_of(reference, 0.2, &coarse_model);
        let fine = field_of(reference, 0.05, &FieldModel::DEFAULT);
        let first = field::align(&coarse.as_slice(), current, pair.guess, &loose);
        let guess = first.map_or(pair.guess, |found| found.pose);
        let found = field::align(&fine.as_slice(), current, guess, &FieldConfig::DEFAULT);
        found.ok().map(|found| found.pose)
    }) else {
        return;
    };
    println!("sim level 1, coarse to fine: {right} of {count} right, {mm:.2} mm, {degrees:.4} deg");
    assert!(right >= 0.985 * count && mm <= 2.5 && degrees <= 0.04);
}
