//! A fit with its data.

use super::backlashes::Backlash;
use super::plant::{Columns, Plant};
use super::request::FitRequest;
use kardan_identify::{Fit, Samples};

pub(super) struct Fitted<'a> {
    pub plant: &'a Plant,
    pub request: &'a FitRequest,
    pub columns: &'a Columns,
    /// The samples of the fit.
    pub samples: &'a Samples,
    pub fit: &'a Fit,
    /// Cross-validated predictions, sample by sample, row by row.
    pub cross_validated: Option<&'a [f64]>,
    pub method: &'a str,
    pub window: f64,
    /// Standard deviations of a window's angles, speeds and accelerations.
    pub noise: &'a [Vec<f64>; 3],
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

/// At most six digits.
pub(super) fn short(x: f64) -> String {
    let text = format!("{x:.6}");
    if x != 0.0 && (x.abs() < 1e-3 || x.abs() >= 1e6) {
        return format!("{x:.4e}");
    }
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}
