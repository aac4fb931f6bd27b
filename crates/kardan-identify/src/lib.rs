//! Identification: the torque balance is linear in the coefficients of the terms, so each of them is a column of a regressor, for any
//! model.
//!
//! Begin with [`Regressor`], [`LeastSquares`] and [`Fit`].
//!
//! ```
//! // A quarter of a normal distribution lies above 0.674 standard deviations.
//! assert!((kardan_identify::normal_quantile(0.25) - 0.674_489_750_196).abs() < 1e-9);
//! ```
#![deny(clippy::disallowed_methods)]

mod corrected;
mod determined;
mod distribution;
mod excitation;
mod extra;
mod fit;
mod least_squares;
mod regressor;
mod samples;
mod teeth;
mod window;

pub use determined::{Excitation, undetermined};
pub use distribution::{normal_quantile, student_quantile, two_sided_normal};
pub use excitation::{Selection, d_optimal, expected_errors, information};
pub use extra::{Extra, ExtraFriction};
pub use fit::{Fit, FitOptions, Loss, Shape, Test, TestKind, cross_validate, fit, residual_statistics};
pub use least_squares::{Estimate, LeastSquares};
pub use regressor::{Motion, OpenLaws, Regressor, RegressorOptions};
pub use samples::{Errors, Room, Samples, Steadiness, Where, steady_segments};
pub use teeth::Teeth;
pub use window::{Reading, Windows};

use kardan_mechanics::assemble::{CoefficientKind, TermCoefficient};
use kardan_mechanics::reduce::Reduced;

/// A coefficient of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Coefficient {
    /// `fs.damping`
    pub name: String,
    /// Its kind.
    pub kind: CoefficientKind,
    /// Numbers of its terms among those of its kind in the equations: an element with several has one coefficient for all.
    pub terms: Vec<usize>,
    /// Its value in the model, SI.
    pub value: f64,
}

/// All coefficients of a model: inertias, dampings, stiffnesses, Coulomb torques. Terms of one element and kind that have the same
/// value are one coefficient.
///
/// ```
/// use kardan_mechanics::assemble::assemble;
/// use kardan_identify::coefficients;
/// use kardan_mechanics::reduce::reduce;
/// let (document, _) = kardan_model::read(kardan_model::builtin("harmonic-drive").unwrap().source);
/// let (drive, _) = document.model(&[]);
/// let reduced = reduce(assemble(&drive.all_coordinates, &drive.terms), None).unwrap();
/// let found = coefficients(&reduced);
/// assert!(found.iter().any(|one| one.name == "wg.damping" && (one.value - 251.0 / 510_000.0).abs() < 1e-18));
/// ```
pub fn coefficients(reduced: &Reduced) -> Vec<Coefficient> {
    let mut out: Vec<Coefficient> = Vec::new();
    for TermCoefficient { name, kind, term, value, .. } in reduced.equations.coefficients() {
        match out.iter_mut().find(|one| one.name == name && one.value == value) {
            Some(one) => one.terms.push(term),
            None => out.push(Coefficient { name, kind, terms: vec![term], value }),
        }
    }
    out
}
