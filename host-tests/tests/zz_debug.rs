use beamfix::{geometry::Pose, matching::field::{self, FieldConfig}};
#[test]
fn dbg() {
    let (field, points, guess) = host_tests::board::fields::debug_scene();
    let mut p = guess;
    for it in 1..=20 {
        let c = FieldConfig { coarse_stride: 1, max_iterations: it, translation_tolerance: -1.0, rotation_tolerance: -1.0, ..FieldConfig::DEFAULT };
        let r = field::align(&field.as_slice(), &points, guess, &c);
        println!("{it} {r:?}");
    }
    let _ = &mut p;
}
