//! A fit with its data.

use super::backlashes::Backlash;
use super::compare::Whole;
use super::extra::ExtraTerm;
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
        let mut names = self.columns.names(self.request);
        let speeds = self.request.extras.iter().filter(|extra| extra.shape().is_some());
        names.extend(speeds.map(ExtraTerm::speed_name));
        names
    }

    /// Names and units of the rows of the balance, with their numbers.
    pub fn rows(&self) -> impl Iterator<Item = (usize, String, String)> {
        let names = self.plant.row_names(self.samples.rows).into_iter().enumerate();
        names.map(move |(row, name)| {
            let unit = self.plant.domain_of_coordinate(&name).effort().unit();
            (row, name, unit.into())
        })
    }

    /// The residual of a row of a sample.
    pub fn residual(&self, sample: usize, row: usize) -> f64 {
        self.samples.y(sample)[row] - self.fit.prediction(self.samples, sample, row)
    }
}

/// The column of the stiffness of a spring, if it has one, and its value in a fit, or else in the file; NaN without it.
pub(super) fn stiffness(plant: &Plant, columns: &Columns, fit: &Fit, element: &str) -> (Option<usize>, f64) {
    let springs = &plant.reduced.equations.springs;
    let Some(number) = springs.iter().position(|term| term.element == element) else { return (None, f64::NAN) };
    let of_spring = |one: &Coefficient| one.kind == Kind::Stiffness && one.terms.contains(&number);
    let column = columns.identified().position(of_spring);
    (column, column.map_or_else(|| springs[number].value.stiffness.to_f64(), |column| fit.values[column]))
}
