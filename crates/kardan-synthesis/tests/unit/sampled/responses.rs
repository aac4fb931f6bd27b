//! Tests of `src/sampled/responses.rs`.

use super::*;
use kardan_math::num::Random;

/// States that are not driven, not observed, or neither, change no response.
#[test]
fn uncontrollable_and_unobservable_states_change_no_response() {
    let mut random = Random::new(9);
    let mut excluded = 0;
    for n in 3..12 {
        for period in [None, Some(0.1)] {
            let mut sparse = |share: f64| if random.unit() < share { random.unit() - 0.5 } else { 0.0 };
            let a = Matrix::from_fn(n, n, |i, j| {
                let own = if period.is_some() { 0.3 } else { -2.0 };
                sparse(1.5 / n as f64) + if i == j { own } else { 0.0 }
            });
            let b = Matrix::from_fn(n, 2, |_, _| sparse(1.5 / n as f64));
            let c = Matrix::from_fn(2, n, |_, _| sparse(1.5 / n as f64));
            let d = Matrix::from_fn(2, 2, |_, _| sparse(0.5));
            let states = between(&a, &b, &c);
            excluded += n - states.len();
            let whole = Response::state_space([&a, &b, &c, &d], period).expect("finite");
            let found = response_excluding_free(&a, None, [&b, &c, &d], period).expect("finite");
            for frequency in [0.0, 0.7, 3.0, 20.0] {
                let (whole, found) = (whole.at_frequency(frequency), found.at_frequency(frequency));
                let error = (&whole - &found).norm_l2();
                assert!(error < 1e-12 * (1.0 + whole.norm_l2()), "{n} {period:?} {frequency}: {error:e}");
            }
        }
    }
    assert!(excluded > 40, "{excluded}");
}
