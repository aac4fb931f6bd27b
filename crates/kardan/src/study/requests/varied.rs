//! Varied parameters with their distributions, as text.

use super::distribution::Distribution;
use crate::study::measure::requirement_verdict::{in_15_digits, in_digits};
use crate::study::read::read_values::key_error;
use kardan_math::units::Dimension;
use kardan_model::{Document, Parameter};
use kardan_schema::diagnostics::{Diagnostic, nearest, quoted, shortened};
use kardan_schema::entries::Place;
use kardan_schema::schema::Table;

/// The table in messages.
pub(in crate::study) const SWEEP: &str = "`[sweep]`";

/// A varied parameter.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::study) struct Varied {
    pub name: String,
    pub dimension: Dimension,
    pub distribution: Distribution,
    /// As text, with units.
    pub text: String,
    /// The laws in which it occurs, if it occurs in laws only.
    pub laws: Vec<String>,
}

impl Varied {
    /// A parameter with a distribution.
    pub fn new(name: &str, dimension: Dimension, distribution: Distribution) -> Self {
        let text = format_distribution(&distribution, dimension);
        Self { name: name.to_string(), dimension, distribution, text, laws: Vec::new() }
    }
}

/// Reports parameters with more than one distribution.
pub(in crate::study) fn add(varied: &mut Vec<Varied>, found: Option<Varied>, table: &Table, out: &mut Vec<Diagnostic>) {
    let Some(found) = found else { return };
    if varied.iter().any(|candidate| candidate.name == found.name) {
        let message = format!("{SWEEP}: `{}` has two distributions", shortened(&found.name));
        let key = if table.values.contains_key("file") { "file" } else { "parameter" };
        out.push(key_error("name::duplicate", message, (table, key, "again here"), "remove one of them"));
        return;
    }
    varied.push(found);
}

/// The parameter of a name, which no variant sets.
pub(in crate::study) fn parameter<'d>(
    document: &'d Document,
    name: &str,
    (place, label): (&Place, &str),
    out: &mut Vec<Diagnostic>,
) -> Option<&'d Parameter> {
    let Some(parameter) = document.declared(name) else {
        if let Some(found) = document.untoleranced_value(name) {
            out.push(no_tolerance(&found, name, label).at(place, "no tolerance"));
        } else if !document.suppressed.has_key(name) {
            let names = || document.all_parameters().map(|parameter| parameter.name.as_str());
            let help = match nearest(name, names()) {
                Some(near) => format!("did you mean `{near}`?"),
                None if names().next().is_none() => {
                    "declare it under `[parameters]`, or write a tolerance after the value of a key: \"100 N m/rad ± 10 %\"".into()
                }
                None => format!("there are {}; a key of an element, of `[scenario]` or of a fault needs a tolerance: `± 10 %`", quoted(names())),
            };
            out.push(Diagnostic::no_such(label, "parameter", name, place).help(help));
        }
        return None;
    };
    if document.is_varied(name) {
        let message =
            format!("{label}: `{name}` differs between the variants, so that a value here would change nothing");
        let help = "remove it here, or from the variants";
        out.push(Diagnostic::error("sweep::set-by-variant", message).at(place, "a varied parameter").help(help));
        return None;
    }
    if parameter.expression.is_some() {
        let message = format!("{label}: `{name}` is computed from other parameters");
        let help = "vary those, or replace it by a value";
        out.push(Diagnostic::error("sweep::dependent-parameter", message).at(place, "no value of its own").help(help));
        return None;
    }
    Some(parameter)
}

/// An existing key that cannot vary without a tolerance.
fn no_tolerance(found: &Result<String, String>, name: &str, label: &str) -> Diagnostic {
    let message = |why: &str| format!("{label}: `{}` {why}", shortened(name));
    let (message, help) = match found {
        Ok(text) => (
            message("exists, but a key varies only with a tolerance after its value"),
            format!("write one there; `[sweep]` may replace it: \"{text}\""),
        ),
        Err(other) => (
            message(&format!("is computed from `{}`", shortened(other))),
            "vary the parameters in it, or replace it by a value with a tolerance".to_string(),
        ),
    };
    Diagnostic::error("sweep::tolerance", message).help(help)
}

/// A distribution with its unit.
fn format_distribution(distribution: &Distribution, dimension: Dimension) -> String {
    let unit = dimension.si();
    let with = |text: String| if unit.is_empty() { text } else { format!("{text} {unit}") };
    let digits = |value: &f64| in_digits(in_15_digits(*value));
    let cut = |from: &f64, to: &f64| match (from.is_finite(), to.is_finite()) {
        (false, false) => String::new(),
        (true, false) => format!(", above {}", digits(from)),
        (false, true) => format!(", below {}", digits(to)),
        (true, true) => format!(", between {} and {}", digits(from), digits(to)),
    };
    match distribution {
        Distribution::Uniform { from, to } => with(format!("uniform from {} to {}", digits(from), digits(to))),
        Distribution::Normal { mean, deviation, from, to } => {
            with(format!("normal, mean {}, deviation {}{}", digits(mean), digits(deviation), cut(from, to)))
        }
        Distribution::Halves { peak, below, above, from, to } => {
            let [peak, below, above] = [peak, below, above].map(digits);
            with(format!("split normal, peak {peak}, deviation {below} to below and {above} to above{}", cut(from, to)))
        }
        Distribution::Triangular { from, peak, to } => {
            with(format!("triangular from {} by {} to {}", digits(from), digits(peak), digits(to)))
        }
        Distribution::Listed(values) => with(values.iter().map(digits).collect::<Vec<_>>().join(", ")),
    }
}
