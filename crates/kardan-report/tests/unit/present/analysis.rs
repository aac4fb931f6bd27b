//! Tests of `src/present/analysis.rs`.

use super::*;
use kardan::results::{Counting, Structure};

/// A charge without effect is distinguished from an uncontrollable motion, and is not an error.
#[test]
fn the_headline_names_charges_that_only_count() {
    let headline = |ranks: [usize; 2], counting: Option<[bool; 2]>| {
        let structure = Structure {
            states: ["M.q", "a.phi", "M.i", "a.w"].map(String::from).to_vec(),
            controllable_rank: ranks[0],
            observable_rank: ranks[1],
            ..Structure::default()
        };
        let counting = counting.map(|[remaining_controllable, remaining_observable]| Counting {
            charges: vec!["M.q".into()],
            remaining_controllable,
            remaining_observable,
        });
        let verdict = rank_verdict(&Analysis { structure, counting, ..Analysis::default() }).unwrap();
        (verdict.sound, verdict.text)
    };
    for (ranks, counting, sound, text) in [
        ([3, 4], None, false, "Not controllable: rank 3 of 4; observable."),
        (
            [3, 4],
            Some([true, false]),
            true,
            "Controllable except M.q, a charge without effect: all motions are; observable.",
        ),
        (
            [3, 3],
            Some([true, true]),
            true,
            "Controllable and observable except M.q, a charge without effect: all motions are.",
        ),
        ([4, 3], Some([false, true]), true, "Controllable; observable except M.q, which is a charge without effect."),
        // Other unobservable states stay an error.
        ([3, 2], Some([true, false]), false, "Neither controllable (rank 3 of 4) nor observable (rank 2 of 4)."),
    ] {
        assert_eq!(headline(ranks, counting), (sound, text.to_string()));
    }
}
