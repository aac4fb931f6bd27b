//! A fit with its data.

use super::backlashes::Backlash;
use super::compare::Whole;
use super::plant::{Columns, Plant};
use super::request::FitRequest;
use kardan_identify::{Coefficient, Fit, Samples};
use kardan_mechanics::assemble::CoefficientKind as Kind;

pub(super) struct Fitted<'a> {
    pub whole: &'a Whole<'a>,
    pub plant: &'a Plant,
    pub request: &'a FitRequest,
    pub columns: &'a Columns,
    /// The samples of the fit.
    pub samples: &'a Samples,
    pub fit: &'a Fit,
    /// Cross-validated predictions, sample by sample, row by row.
    pub cross_validated: Option<&'a [f64]>,
    pub backlashes: &'a [Backlash],
}

impl Fitted<'_> {
    /// Names of the columns of the fit, then of the Stribeck speeds.
    pub fn column_names(&self) -> Vec<String> {
        let identifiable = self.columns.identifiable.iter().map(|(k, _)| self.columns.coefficients[*k].name.clone());
        let extras = self.request.extras.iter().map(|extra| extra.name.clone());
        let speeds = self.request.extras.iter().filter(|extra| extra.shape().is_some());
        identifiable.chain(extras).chain(speeds.map(|extra| format!("{}.stribeck_speed", extra.element))).collect()
    }

    /// The unit of a row of the balance by its name.
    pub fn row_unit(&self, row: &str) -> &'static str {
        self.plant.domain_of_coordinate(row).effort().unit()
    }

    /// Names of the rows of the balance.
    pub fn row_names(&self) -> Vec<String> {
        self.plant.row_names(self.samples.rows)
    }
}

/// The column of the stiffness of a spring, if it has one, and its value in a fit, or else in the file; NaN without it.
pub(super) fn stiffness(plant: &Plant, columns: &Columns, fit: &Fit, element: &str) -> (Option<usize>, f64) {
    let springs = &plant.reduced.equations.springs;
    let Some(number) = springs.iter().position(|term| term.element == element) else { return (None, f64::NAN) };
    let of_spring = |one: &Coefficient| one.kind == Kind::Stiffness && one.terms.contains(&number);
    let column = columns.identifiable.iter().position(|(k, _)| of_spring(&columns.coefficients[*k]));
    (column, column.map_or_else(|| springs[number].value.stiffness.to_f64(), |column| fit.values[column]))
}
