//! How far parameters may be from their values, and whether the model still has a meaning there.

use std::ops::Range;

use super::document::{Document, Parameter};
use super::resolve::{Setting, TableReader};
use crate::diagnostics::Diagnostic;
use crate::schema::{Field, Kind, Scalar, Sign, Spanned, Table, Value};
use crate::units::{Dimension, Exact};

/// A parameter with the interval that it may lie in; `lower <= nominal <= upper` and `lower < upper`.
#[derive(Debug, Clone, PartialEq)]
pub struct Tolerance {
    /// The parameter: an entry of `[parameters]`, or `<element>.<key>` for a key written with a tolerance.
    pub parameter: String,
    /// Its value, SI.
    pub nominal: Exact,
    /// Lower end, SI.
    pub lower: Exact,
    /// Upper end, SI.
    pub upper: Exact,
    /// The confidence of the interval (0.95 for `95 %`), if it is given.
    pub confidence: Option<Exact>,
    /// The dimension of all of them.
    pub dimension: Dimension,
    /// Place of the value in the file.
    pub span: Range<usize>,
}

impl Document {
    /// The entries of `[parameters]` and the implicit parameters.
    pub(super) fn all_parameters(&self) -> impl Iterator<Item = &Parameter> {
        self.parameters.iter().chain(&self.implicit)
    }

    /// All tolerances, by name. Around a value that a setting replaces, `± …` moves along; an interval stays where it is.
    pub fn tolerances(&self, settings: &[Setting]) -> Vec<Tolerance> {
        let mut out: Vec<Tolerance> = self
            .all_parameters()
            .filter_map(|parameter| {
                let spread = parameter.spread.as_ref()?;
                let set = settings.iter().find(|set| set.name == parameter.name);
                let nominal = set.map_or(&parameter.value, |set| &set.value);
                let (lower, upper) = spread.around(nominal);
                // A percentage of a variant's zero leaves nothing to vary.
                (lower.to_f64() < upper.to_f64()).then(|| Tolerance {
                    parameter: parameter.name.clone(),
                    nominal: nominal.clone(),
                    lower,
                    upper,
                    confidence: spread.confidence().cloned(),
                    dimension: parameter.dimension,
                    span: parameter.span.clone(),
                })
            })
            .collect();
        out.sort_by(|a, b| a.parameter.cmp(&b.parameter));
        out
    }

    /// Reports tolerances that reach values which the model cannot take.
    pub fn check_tolerances(&self, settings: &[Setting], out: &mut Vec<Diagnostic>) {
        for tolerance in self.tolerances(settings) {
            let before = out.len();
            self.check_inside(&tolerance, settings, out);
            let elements = self.elements.iter().map(|e| (e.kind.keyword, &e.name, e.kind.fields, &e.table));
            let controls = self.controls.iter().map(|c| ("control", &c.name, c.law.fields, &c.table));
            for (keyword, name, fields, table) in elements.chain(controls) {
                // The first key that it breaks says enough.
                if out.len() == before {
                    check_signs(&tolerance, fields, table, &format!("{keyword} `{name}`"), out);
                }
            }
            if out.len() == before {
                self.check_ends(&tolerance, settings, out);
            }
        }
    }

    /// The value of a variant must lie in the interval too.
    fn check_inside(&self, tolerance: &Tolerance, settings: &[Setting], out: &mut Vec<Diagnostic>) {
        let Tolerance { parameter, nominal, lower, upper, span, .. } = tolerance;
        let Some(set) = settings.iter().find(|set| set.name == *parameter) else { return };
        if nominal.is_below(lower) || upper.is_below(nominal) {
            let message = format!("`{parameter}` = {} lies outside the interval of its value", set.text);
            let varied = self.variants.iter().find(|varied| varied.parameter.value == *parameter);
            let mut mistake = Diagnostic::error("tolerance::bounds", message).at(span.clone(), "this interval");
            if let Some(varied) = varied {
                mistake = mistake.at(varied.parameter.span.clone(), "varied here");
            }
            out.push(mistake.help("write `± ...` behind the value: it moves along with the variants"));
        }
    }

    /// What an element checks over several keys must hold at both ends.
    fn check_ends(&self, tolerance: &Tolerance, settings: &[Setting], out: &mut Vec<Diagnostic>) {
        let users = self.elements.iter().filter(|instance| {
            instance.table.unread.is_empty() && instance.table.values.values().any(|given| names(given, tolerance))
        });
        for instance in users {
            let mistakes = |settings: &[Setting]| {
                let mut silent = Vec::new();
                let reader = TableReader::new(self, settings);
                let values = reader.values(instance.kind.fields, &instance.table, "", &mut silent);
                if silent.is_empty() { (instance.kind.check)(&values) } else { Vec::new() }
            };
            if !mistakes(settings).is_empty() {
                continue; // Reported of the model itself.
            }
            for (end, value) in [("lower", &tolerance.lower), ("upper", &tolerance.upper)] {
                let set = Setting { name: tolerance.parameter.clone(), value: value.clone(), text: String::new() };
                let mut settings: Vec<Setting> = settings.iter().filter(|s| s.name != set.name).cloned().collect();
                settings.push(set);
                for mistake in mistakes(&settings) {
                    let message = format!(
                        "{} `{}`, at the {end} end of the tolerance of `{}` ({}): {}",
                        instance.kind.keyword,
                        instance.name,
                        tolerance.parameter,
                        shown(value, tolerance.dimension),
                        mistake.message
                    );
                    out.push(
                        Diagnostic::error("element::check", message)
                            .at(tolerance.span.clone(), "with this tolerance")
                            .help(format!("narrow the tolerance, or: {}", mistake.help)),
                    );
                }
            }
        }
    }
}

/// Whether a value of a table is this parameter.
fn names(given: &Spanned<Value>, tolerance: &Tolerance) -> bool {
    let is = |scalar: &Scalar| matches!(scalar, Scalar::Parameter(name) if *name == tolerance.parameter);
    match &given.value {
        Value::Scalar(scalar) => is(scalar),
        Value::Map(entries) => entries.iter().any(|(_, scalar)| is(&scalar.value)),
        _ => false,
    }
}

/// Reports an interval that breaks the rule of a key.
fn check_signs(tolerance: &Tolerance, fields: &[Field], table: &Table, what: &str, out: &mut Vec<Diagnostic>) {
    for (field, given) in fields.iter().filter_map(|field| Some((field, table.values.get(field.name)?))) {
        let sign = match (&field.kind, &given.value) {
            (Kind::Tables(inner), Value::Tables(tables)) => {
                for (i, table) in tables.iter().enumerate() {
                    let what = format!("entry {} of `{}` of {what}", i + 1, field.name);
                    check_signs(tolerance, inner, table, &what, out);
                }
                continue;
            }
            (Kind::Quantity(_, sign) | Kind::Number(sign), Value::Scalar(_)) if names(given, tolerance) => sign,
            _ => continue,
        };
        let Tolerance { nominal, lower, upper, .. } = tolerance;
        let (reaches, rule) = match sign {
            // A value that breaks the rule itself is reported elsewhere.
            Sign::Positive if lower.signum() <= 0 && nominal.signum() > 0 => {
                (if lower.is_zero() { "zero" } else { "zero and below" }, "be above zero")
            }
            Sign::NonNegative if lower.signum() < 0 && nominal.signum() >= 0 => ("below zero", "not be negative"),
            Sign::NonZero if lower.signum() * upper.signum() <= 0 && !nominal.is_zero() => ("zero", "not be zero"),
            _ => continue,
        };
        let interval = format!("[{}, {}]", shown(lower, tolerance.dimension), shown(upper, tolerance.dimension));
        let written_here = tolerance.span == given.span;
        let whose =
            if written_here { "its tolerance".into() } else { format!("the tolerance of `{}`", tolerance.parameter) };
        let message = format!("`{}` of {what} must {rule}, but {whose} reaches {reaches}: {interval}", field.name);
        let mut mistake =
            Diagnostic::error("number::sign", message).at(tolerance.span.clone(), format!("reaches {reaches}"));
        if !written_here {
            mistake = mistake.at(given.span.clone(), "used here");
        }
        let help = "narrow the tolerance, or write bounds of your own behind the value: \"2 N m [0.5, 6]\"";
        out.push(mistake.help(help));
        return;
    }
}

/// A value for a message; angles in degrees.
fn shown(value: &Exact, dimension: Dimension) -> String {
    let (value, unit) = match dimension {
        Dimension::ANGLE => (value.to_f64().to_degrees(), "deg".to_string()),
        _ => (value.to_f64(), dimension.si()),
    };
    let rounded: f64 = format!("{value:.6e}").parse().unwrap_or(value);
    let size = rounded.abs();
    let number =
        if size != 0.0 && !(1e-5..1e16).contains(&size) { format!("{rounded:e}") } else { rounded.to_string() };
    format!("{number} {unit}").trim_end().to_string()
}
