//! A run has the same bits on every machine: sums of the bits of all its rows, for loops whose laws are designed exactly.
//!
//! A sum that changes tells that results have changed, if only in their last bits: on another target that is a mistake; after a change
//! of the equations, of a method or of a model it is to be written down anew.

use kardan::results::Run;
use kardan::simulate::Method;
use kardan::study::{Settings, Silent};

use super::common::runs_only;

/// FNV-1a over the bits of times and values, signal by signal.
fn sum(runs: &[Run]) -> u64 {
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut take = |values: &[f64]| {
        for byte in values.iter().flat_map(|value| value.to_bits().to_le_bytes()) {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    };
    for run in runs {
        take(&run.series.time);
        run.series.signals.iter().for_each(|signal| take(&signal.values));
        run.events.iter().for_each(|event| take(&[event.time]));
    }
    hash
}

#[test]
fn built_in_runs_have_the_bits_that_are_written_down() {
    let expected = [
        ("sia-steering", Method::Taylor, 8436598411289923273),
        ("sia-steering", Method::Dop853, 14044860431822882646),
        ("two-bodies", Method::Taylor, 16782384805019828241),
        ("rlc-ladder", Method::Taylor, 5781537973682513750),
        ("harmonic-drive-spring", Method::Taylor, 11488256794334443760),
    ];
    let found = expected.map(|(model, method, _)| {
        let source = kardan::model::builtin(model).unwrap().source;
        let study = crate::common::project(source).run(&Settings { method, ..runs_only() }, &Silent).expect("built in");
        (model, method, sum(&study.runs))
    });
    assert_eq!(found, expected, "found on the left, written down on the right");
}
