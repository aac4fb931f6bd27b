//! Motions without inertia, eliminated for an analysis.

use crate::study::PreparedVariant;
use crate::study::read::state_names::{NonAngleDomains, state_name};
use kardan_analysis::{
    Eliminated, LinearSystem, MasslessError, Side, eliminate_massless, massless_direction, plain_combination,
};
use kardan_math::num::{Definiteness, Matrix, Rational, Scalar, definiteness, echelon};
use kardan_results::{Definition, Elimination};
use kardan_schema::diagnostics::Diagnostic;

/// The equations `H q̈ + D q̇ + S q = F u` and their outputs, read from the blocks of a pencil that may have a singular E.
pub(in crate::study) struct Mechanical {
    pencil: LinearSystem,
    /// Names of the coordinates.
    coordinates: Vec<String>,
}

impl Mechanical {
    pub(in crate::study) fn new(pencil: LinearSystem, coordinates: Vec<String>) -> Self {
        assert_eq!(pencil.states.len(), 2 * coordinates.len(), "a pencil in angles and speeds");
        Self { pencil, coordinates }
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

    fn block(&self, matrix: &Matrix<Rational>, column: usize, sign: i64) -> Matrix<Rational> {
        let r = self.coordinates.len();
        let sign = Rational::from(sign);
        Matrix::from_fn(r, r, |i, j| match &matrix[(r + i, column + j)] {
            zero if zero.is_zero() => Rational::ZERO,
            entry => entry.times(&sign),
        })
    }

    fn inertia(&self) -> Matrix<Rational> {
        self.block(&self.pencil.e, self.coordinates.len(), 1)
    }

    pub(in crate::study) fn is_regular(&self) -> bool {
        definiteness(&self.inertia()) == Definiteness::Positive
    }

    /// The equations with other forces and outputs: F, C₀ and C₁ beside each other, D₀.
    fn eliminate_with(
        &self,
        (inputs, f): (&[String], &Matrix<Rational>),
        (outputs, c, through): (&[String], &Matrix<Rational>, &Matrix<Rational>),
    ) -> Result<Eliminated, MasslessError> {
        let r = self.coordinates.len();
        let part = |first: usize| Matrix::from_fn(c.rows(), r, |i, j| c[(i, first + j)].clone());
        let (damping, stiffness) = (self.block(&self.pencil.a, r, -1), self.block(&self.pencil.a, 0, -1));
        eliminate_massless(
            &self.coordinates,
            inputs,
            outputs,
            &self.inertia(),
            &damping,
            &stiffness,
            f,
            &part(0),
            &part(r),
            through,
        )
    }

    /// The remaining system.
    pub(in crate::study) fn eliminate(&self) -> Result<Eliminated, MasslessError> {
        let (r, pencil) = (self.coordinates.len(), &self.pencil);
        let f = Matrix::from_fn(r, pencil.inputs.len(), |i, j| pencil.b[(r + i, j)].clone());
        self.eliminate_with((&pencil.inputs, &f), (&pencil.outputs, &pencil.c, &pencil.d))
    }

    /// The remaining system with these columns of B as inputs and no output, or with these rows of C as outputs and no input.
    pub(in crate::study) fn eliminate_for(
        &self,
        side: Side,
        columns: &[Vec<Rational>],
    ) -> Result<Eliminated, MasslessError> {
        let (r, count) = (self.coordinates.len(), columns.len());
        let names: Vec<String> = (1..=count).map(|k| k.to_string()).collect();
        match side {
            Side::Inputs => {
                let f = Matrix::from_fn(r, count, |i, j| columns[j][r + i].clone());
                self.eliminate_with((&names, &f), (&[], &Matrix::zeros(0, 2 * r), &Matrix::zeros(0, count)))
            }
            Side::Outputs => {
                let c = Matrix::from_fn(count, 2 * r, |i, j| columns[i][j].clone());
                self.eliminate_with((&[], &Matrix::zeros(r, 0)), (&names, &c, &Matrix::zeros(count, 0)))
            }
        }
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
) -> Vec<Diagnostic> {
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
    vec![diagnostic]
}
