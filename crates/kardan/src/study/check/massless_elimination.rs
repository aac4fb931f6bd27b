//! Motions without inertia, eliminated for an analysis.

use crate::study::PreparedVariant;
use crate::study::read::state_names::{NonAngleDomains, state_name};
use kardan_analysis::{
    ConstrainedSystem, Eliminated, LinearSystem, MasslessError, OutputSignal, Side, eliminate_massless, linear_system,
    massless_direction, plain_combination,
};
use kardan_math::num::{Definiteness, Matrix, Rational, definiteness, echelon};
use kardan_results::{Definition, Elimination};
use kardan_schema::diagnostics::Diagnostic;

/// The equations `H q̈ + D q̇ + S q = F u` and their outputs, read from the blocks of a pencil that may have a singular E.
pub(in crate::study) struct Mechanical {
    pencil: LinearSystem,
    /// Names of the coordinates.
    pub coordinates: Vec<String>,
    /// The motion of all shafts over that of the coordinates.
    pub basis: Matrix<Rational>,
}

impl Mechanical {
    /// The equations of a system in coordinates: as many of the preferred ones as are independent, then others.
    ///
    /// # Errors
    /// If no motion is possible.
    pub(in crate::study) fn of(
        system: &ConstrainedSystem,
        preferred: &[usize],
        outputs: &[OutputSignal],
    ) -> Result<Self, Diagnostic> {
        let (coordinates, basis) = system.explicit_basis(preferred);
        if coordinates.is_empty() {
            let message = "with this friction stuck no motion is possible";
            let help = "let some of the elements in `stuck` slide";
            return Err(Diagnostic::error("analysis::no-motion", message).help(help));
        }
        let pencil = linear_system(system, &coordinates, &basis, outputs);
        let coordinates = coordinates.iter().map(|&shaft| system.coordinates[shaft].clone()).collect();
        Ok(Self { pencil, coordinates, basis })
    }

    /// The remaining system, with motions without inertia eliminated, and whether there were any.
    pub(in crate::study) fn settled(self) -> Result<(LinearSystem, bool), MasslessError> {
        match self.is_regular() {
            true => Ok((self.pencil, false)),
            false => Ok((self.eliminate()?.system, true)),
        }
    }

    pub(in crate::study) fn into_pencil(self) -> LinearSystem {
        self.pencil
    }

    fn inertia(&self) -> Matrix<Rational> {
        let r = self.coordinates.len();
        Matrix::from_fn(r, r, |i, j| self.pencil.e[(r + i, r + j)].clone())
    }

    pub(in crate::study) fn is_regular(&self) -> bool {
        definiteness(&self.inertia()) == Definiteness::Positive
    }

    /// The remaining system.
    pub(in crate::study) fn eliminate(&self) -> Result<Eliminated, MasslessError> {
        eliminate_massless(&self.coordinates, &self.pencil)
    }

    /// The remaining system with these columns of B as inputs and no output, or with these rows of C as outputs and no input.
    pub(in crate::study) fn eliminate_for(
        &self,
        side: Side,
        columns: &[Vec<Rational>],
    ) -> Result<Eliminated, MasslessError> {
        let (r, count) = (self.coordinates.len(), columns.len());
        let names: Vec<String> = (1..=count).map(|k| k.to_string()).collect();
        let (inputs, outputs) = if side == Side::Inputs { (names, Vec::new()) } else { (Vec::new(), names) };
        let force = |i: usize, j: usize| if i < r { Rational::ZERO } else { columns[j][i].clone() };
        let pencil = LinearSystem {
            b: Matrix::from_fn(2 * r, inputs.len(), force),
            c: Matrix::from_fn(outputs.len(), 2 * r, |i, j| columns[i][j].clone()),
            d: Matrix::zeros(outputs.len(), inputs.len()),
            inputs,
            outputs,
            ..self.pencil.clone()
        };
        eliminate_massless(&self.coordinates, &pencil)
    }

    /// The eliminated motions as text.
    pub(in crate::study) fn elimination(
        &self,
        eliminated: &Eliminated,
        non_angle_domains: &NonAngleDomains,
    ) -> Elimination {
        let (r, inertia) = (self.coordinates.len(), self.inertia());
        let direction = massless_direction(&self.coordinates, &inertia).unwrap_or_default();
        let named = |name: &String| state_name(name, non_angle_domains);
        let term = |(name, factor): &(String, Rational)| (named(name), factor.clone());
        Elimination {
            motions: r - echelon(&inertia, &(0..r).collect::<Vec<_>>()).rank(),
            direction: plain_combination(&direction),
            removed: eliminated.removed.iter().map(named).collect(),
            definitions: eliminated
                .definitions
                .iter()
                .map(|(name, terms)| Definition {
                    state: name.clone(),
                    expression: plain_combination(&terms.iter().map(term).collect::<Vec<_>>()),
                })
                .collect(),
        }
    }
}

/// Why the elimination failed; `non_angle_domains` are coordinates that are no angles.
pub(in crate::study) fn not_eliminated(
    error: MasslessError,
    non_angle_domains: &NonAngleDomains,
    variant: &PreparedVariant,
) -> Diagnostic {
    let rename = |direction: Vec<(String, Rational)>| -> Vec<(String, Rational)> {
        direction.into_iter().map(|(name, factor)| (state_name(&name, non_angle_domains), factor)).collect()
    };
    let (error, help) = match error {
        MasslessError::Undetermined { direction } => (
            MasslessError::Undetermined { direction: rename(direction) },
            "give one of them an inertia, a damping, or a spring to a shaft that has one",
        ),
        MasslessError::InputDerivative { output, input, order, direction } => (
            MasslessError::InputDerivative { output, input, order, direction: rename(direction) },
            "leave out this output or this input (`--outputs`, `--inputs`), or give what it moves an inertia or a damping",
        ),
        MasslessError::Static => (MasslessError::Static, "give one of the shafts an inertia or a damping"),
    };
    let mut diagnostic = Diagnostic::error("analysis::massless", error.to_string()).help(help);
    if let Some(massless) = variant.massless.first() {
        diagnostic.labels.clone_from(&massless.labels);
    }
    diagnostic
}
