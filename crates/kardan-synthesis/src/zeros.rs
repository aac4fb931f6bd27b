//! Rejects designs with unstable zero dynamics.

use super::decoupling::zero_dynamics;
use super::inversion::flat_parametrisation;
use super::{Stability, SynthesisError, stability};
use kardan_analysis::LinearSystem;
use kardan_math::num::Polynomial;
use kardan_results::{Complex, Pole};

/// Rejects outputs with unstable zero dynamics: the law would hide a motion that grows without bounds.
///
/// Zeros on the imaginary axis pass; the design warns of them.
pub(super) fn check_zeros(system: &LinearSystem, outputs: &[String]) -> Result<(), SynthesisError> {
    let polynomial = match zero_dynamics(system) {
        Ok(zeros) => zeros.polynomial,
        // Not for static feedback; the inverse has the same zeros.
        Err(_) => match flat_parametrisation(system) {
            Ok(inverse) => inverse.zeros,
            Err(_) => return Ok(()),
        },
    };
    check_stable(&polynomial, outputs)
}

/// Rejects zero dynamics that grow.
pub(super) fn check_stable(polynomial: &Polynomial, outputs: &[String]) -> Result<(), SynthesisError> {
    if stability(polynomial) != Stability::Unstable {
        return Ok(());
    }
    // A complex number as text: `3`, `3 ± 4 j`.
    let text = |Complex { re, im }: Pole| {
        if im == 0.0 { format!("{re:.6}") } else { format!("{re:.6} ± {:.6} j", im.abs()) }
    };
    let growing = roots(polynomial).into_iter().filter(|pole| pole.re > 0.0 && pole.im >= 0.0);
    let message = format!(
        "the zero dynamics are unstable: while the outputs are held constant, a motion grows with {} 1/s ({} = 0)",
        growing.map(text).collect::<Vec<_>>().join(", "),
        polynomial.primitive()
    );
    let help = "choose other outputs, add damping, or give up decoupling: `law = \"lqr\"`";
    Err(SynthesisError::of(message, outputs, "unstable zero dynamics", help))
}

/// All roots of a polynomial, with multiplicity, by size; conjugates next to each other.
pub fn roots(polynomial: &Polynomial) -> Vec<Pole> {
    let mut out = Pole::list(polynomial.roots());
    out.sort_by(|a, b| a.abs().total_cmp(&b.abs()).then(a.re.total_cmp(&b.re)).then(b.im.total_cmp(&a.im)));
    out
}
