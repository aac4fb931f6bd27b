//! Tests of `src/progress.rs`.

use super::*;

/// Runs of an earlier command count as done but not in the rate; before the first new run there is no rate.
#[test]
fn runs_are_counted_with_their_rate() {
    let ago = |seconds| Instant::now() - Duration::from_secs(seconds);
    assert_eq!(counted(500, 1000, (ago(10), 500)), "500 of 1000 runs");
    assert_eq!(counted(900, 1000, (ago(10), 500)), "900 of 1000 runs, 40/s");
    assert_eq!(counted(505, 1000, (ago(10), 500)), "505 of 1000 runs, 0.5/s");
}
