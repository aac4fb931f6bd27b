//! Tests of `src/names/mod.rs`.

use super::*;

/// No near candidate is missed.
#[test]
fn the_distance_bound_excludes_no_near_name() {
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
