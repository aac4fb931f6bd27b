//! Tests of `src/names/mod.rs`.

use super::*;

/// No near candidate is missed.
#[test]
fn what_is_left_out_is_never_near() {
    let samples = [
        "inertia",
        "inerta",
        "damping",
        "dampng",
        "Δφ_1",
        "Δω_2",
        "abc",
        "cba",
        "",
        "a",
        "stiffness",
        "Tiffness_",
        "İ",
    ];
    for one in samples {
        for other in samples {
            let distance = strsim::damerau_levenshtein(&one.to_lowercase(), &other.to_lowercase());
            assert!(least_distance(letters(one), letters(other)) <= distance, "{one} {other}");
        }
    }
}
