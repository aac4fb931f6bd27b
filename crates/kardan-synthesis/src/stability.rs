//! The stability of a polynomial in one word.

use kardan_analysis::{Plane, stability_of_roots};
use kardan_math::num::Polynomial;
use kardan_results::Stability;

/// Where the roots of a polynomial in s lie, in one word; not decided where a root on the axis is one several times
/// ([`stability_of_roots`]).
///
/// # Panics
/// If the polynomial is zero.
pub fn stability(polynomial: &Polynomial) -> Stability {
    stability_of_roots(polynomial, Plane::Continuous).word
}

#[cfg(test)]
#[path = "../tests/unit/stability.rs"]
mod tests;
