//! Tests of `src/pareto.rs`.

use super::*;

#[test]
fn every_design_has_a_mark_and_the_own_one_a_ring() {
    let one =
        |interaction, torque, best| Alternative { interaction, torque, best, sample_time: 1e-3, ..Default::default() };
    let found = Exploration {
        designs: vec![one(1e-3, 0.7, true), one(2e-2, 0.2, true), one(0.5, 0.9, false)],
        ..Default::default()
    };
    let page = pareto(&found).unwrap().drawing;
    assert_eq!(page.matches("<title>").count(), 3);
    assert_eq!(page.matches("class=\"own\"").count(), 1);
    assert_eq!(page.matches("class=\"front\"").count(), 2);
    assert!(!page.contains("NaN") && !page.contains("inf"));
}

#[test]
fn nothing_to_draw_gives_nothing() {
    assert_eq!(pareto(&Exploration::default()), None);
    let strange = Alternative { interaction: f64::NAN, torque: 0.0, ..Default::default() };
    assert_eq!(pareto(&Exploration { designs: vec![strange], ..Default::default() }), None);
}
