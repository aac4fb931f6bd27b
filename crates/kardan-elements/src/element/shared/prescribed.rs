//! Right-hand sides that may be functions of time.

use kardan_math::num::rational_from_f64;
use kardan_math::units::Exact;
use kardan_mechanics::equations::Term;
use kardan_schema::schema::Values;

/// A right-hand side, or its value at time zero if it is a function of time; and that function as a term.
pub(in crate::element) fn right_side(values: &Values, key: &str) -> (Exact, Option<Term>) {
    match values.of_time(key) {
        Some(function) => {
            let begin = rational_from_f64(function.value(0.0)).unwrap_or_default();
            (Exact::new(begin, 0), Some(Term::Moving(std::sync::Arc::clone(function))))
        }
        None => (values.exact_or_default(key), None),
    }
}
