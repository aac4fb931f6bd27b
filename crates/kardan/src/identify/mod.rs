//! Identification: the torque balance is linear in the coefficients of the terms, so each of them is a column of a regressor, for
//! any model.

mod determined;
mod least_squares;
mod regressor;

pub use determined::{Excitation, undetermined};
pub use least_squares::{Estimate, LeastSquares};
pub use regressor::{Motion, Regressor};

use crate::reduce::Reduced;

/// The kind of a coefficient.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// kg m²
    Inertia,
    /// N m s/rad
    Damping,
    /// N m/rad
    Stiffness,
    /// Coulomb torque, N m.
    Friction,
}

impl Kind {
    /// The key under which elements give it.
    pub fn key(self) -> &'static str {
        match self {
            Self::Inertia => "inertia",
            Self::Damping => "damping",
            Self::Stiffness => "stiffness",
            Self::Friction => "friction",
        }
    }

    /// Its SI unit.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Inertia => "kg m^2",
            Self::Damping => "N m s/rad",
            Self::Stiffness => "N m/rad",
            Self::Friction => "N m",
        }
    }
}

/// A coefficient of a model.
#[derive(Debug, Clone, PartialEq)]
pub struct Coefficient {
    /// `fs.damping`
    pub name: String,
    /// What it is.
    pub kind: Kind,
    /// Numbers of its terms among those of its kind in the equations: an element with several has one coefficient for all.
    pub terms: Vec<usize>,
    /// Its value in the model, SI.
    pub value: f64,
}

/// All coefficients of a model: inertias, dampings, stiffnesses, Coulomb torques. Terms of one element and kind that have the same
/// value are one coefficient.
///
/// ```
/// use kardan::{assemble::assemble, identify::coefficients, model, reduce::reduce};
/// let (document, _) = model::read(model::builtin("harmonic-drive").unwrap().source);
/// let (drive, _) = document.model(&[]);
/// let reduced = reduce(assemble(&drive.shafts, &drive.terms), None).unwrap();
/// let found = coefficients(&reduced);
/// assert!(found.iter().any(|one| one.name == "wg.damping" && (one.value - 251.0 / 510_000.0).abs() < 1e-18));
/// ```
pub fn coefficients(reduced: &Reduced) -> Vec<Coefficient> {
    let equations = &reduced.equations;
    let mut out: Vec<Coefficient> = Vec::new();
    let mut add = |element: &str, kind: Kind, term: usize, value: f64| {
        let name = format!("{element}.{}", kind.key());
        match out.iter_mut().find(|one| one.name == name && one.value == value) {
            Some(one) => one.terms.push(term),
            None => out.push(Coefficient { name, kind, terms: vec![term], value }),
        }
    };
    for (k, term) in equations.inertias.iter().enumerate() {
        add(&term.element, Kind::Inertia, k, term.value.to_f64());
    }
    for (k, term) in equations.dampers.iter().enumerate() {
        add(&term.element, Kind::Damping, k, term.value.to_f64());
    }
    for (k, term) in equations.springs.iter().enumerate() {
        add(&term.element, Kind::Stiffness, k, term.value.stiffness.to_f64());
    }
    for (k, term) in equations.frictions.iter().enumerate() {
        add(&term.element, Kind::Friction, k, term.value.to_f64());
    }
    out
}
