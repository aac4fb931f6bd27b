//! Tests of `src/study/requests/distribution.rs`.

use super::*;

/// Halves of an interval of 95 % hold that much in it and meet where they should; cut off at an end they keep their shape.
#[test]
fn halves_contain_what_their_interval_says() {
    let two_sided = 1.959_963_984_540_054;
    let halves = |from: f64| Distribution::Halves {
        peak: 100.0,
        below: 10.0 / two_sided,
        above: 30.0 / two_sided,
        from,
        to: f64::INFINITY,
    };
    let all = halves(f64::NEG_INFINITY);
    // A quarter of all lies below the peak: the tails are 2·1/4·2.5 % and 2·3/4·2.5 %.
    for (part, value) in [(0.0125, 90.0), (0.25, 100.0), (0.9625, 130.0)] {
        assert!((all.quantile(part) - value).abs() < 1e-9, "{part}: {}", all.quantile(part));
    }
    let [just_below, just_above] = [0.25 - 1e-9, 0.25 + 1e-9].map(|part| all.quantile(part));
    assert!(just_below < 100.0 && just_above > 100.0 && just_above - just_below < 1e-6);
    let cut = halves(90.0);
    assert!(cut.quantile(1e-15) >= 90.0 && (cut.quantile((0.25 - 0.0125) / (1.0 - 0.0125)) - 100.0).abs() < 1e-9);
}
