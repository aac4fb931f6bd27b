//! The relative tolerance of runs, as the scenario gives it.

use super::read_values::{key_error, quantity};
use kardan_math::units::Dimension;
use kardan_model::{Document, TableReader};
use kardan_schema::diagnostics::Diagnostic;
use kardan_schema::schema::Sign;
use kardan_simulate::Tolerance;

/// Sensible relative tolerances: below the first only rounding remains.
pub const TOLERANCES: std::ops::RangeInclusive<f64> = 1e-13..=1e-3;

pub(in crate::study) fn tolerance(document: &Document, out: &mut Vec<Diagnostic>) -> Tolerance {
    let reader = TableReader::new(document, &[]);
    let expected = (Dimension::NONE, Sign::Positive);
    let relative = quantity(&reader, &document.scenario, "relative_tolerance", expected, "`[scenario]`", out);
    let Some(relative) = relative.map(|x| x.to_f64()) else { return Tolerance::default() };
    if !TOLERANCES.contains(&relative) {
        let message = format!("a relative tolerance of {relative:e} is out of range");
        let at = (&document.scenario, "relative_tolerance", "from 1e-13 to 1e-3");
        let help = "leave it out for 1e-10, which suits almost every study";
        out.push(key_error("scenario::tolerance", message, at, help));
    }
    Tolerance::relative(relative)
}
