//! Tolerances of parameters, and whether the model is valid within them.

mod divisions;

use super::document::{Document, Setting, Tolerance, keys_of, shown};
use super::table_reader::TableReader;
use divisions::check_divisions;
use kardan_schema::diagnostics::Diagnostic;
use kardan_schema::schema::{Kind, Placed, SHORTEST_PERIOD, Scalar, Sign, Table, Value};

impl Document {
    /// All tolerances, by name. Around a value that a setting replaces, `± …` moves with it; an interval does not.
    pub fn tolerances(&self, settings: &[Setting]) -> Vec<Tolerance> {
        let mut out: Vec<Tolerance> = self
            .all_parameters()
            .filter_map(|parameter| {
                let spread = parameter.spread.as_ref()?;
                let set = settings.iter().find(|set| set.name == parameter.name);
                let nominal = set.map_or(&parameter.value, |set| &set.value);
                let (lower, upper) = spread.limits_at(nominal);
                // A percentage of zero in a variant is no tolerance.
                (lower.to_f64() < upper.to_f64()).then(|| Tolerance {
                    parameter: parameter.name.clone(),
                    nominal: nominal.clone(),
                    lower,
                    upper,
                    confidence: spread.confidence().cloned(),
                    dimension: parameter.dimension,
                    place: parameter.place.clone(),
                })
            })
            .collect();
        out.sort_by(|a, b| a.parameter.cmp(&b.parameter));
        out
    }

    /// Those that the model itself depends on, regardless of initial values and events of runs.
    pub(super) fn tolerances_of_model(&self, settings: &[Setting]) -> Vec<Tolerance> {
        let mut out = self.tolerances(settings);
        out.retain(|one| self.of_runs.iter().all(|candidate| candidate.name != one.parameter));
        out
    }

    /// Reports tolerances that reach values which the model cannot take.
    pub fn check_tolerances(&self, settings: &[Setting], out: &mut Vec<Diagnostic>) {
        for tolerance in self.tolerances(settings) {
            let before = out.len();
            self.check_inside(&tolerance, settings, out);
            let faults = self.faults.iter().map(|(name, table)| ("fault", name.value.as_str(), table));
            let named = self.model_tables().chain(faults);
            let named = named.map(|(keyword, name, table)| (format!("{keyword} `{name}`"), table));
            for (what, table) in named.chain([("`[scenario]`".to_string(), &self.scenario)]) {
                // The first violated key suffices.
                if out.len() == before {
                    check_signs(&tolerance, table, &what, out);
                }
            }
            if out.len() == before {
                self.check_ends(&tolerance, settings, out);
            }
            if out.len() == before {
                check_divisions(self, &tolerance, settings, out);
            }
        }
    }

    /// The value of a variant must lie in the interval too.
    fn check_inside(&self, tolerance: &Tolerance, settings: &[Setting], out: &mut Vec<Diagnostic>) {
        let Tolerance { parameter, nominal, lower, upper, place, .. } = tolerance;
        let Some(set) = settings.iter().find(|set| set.name == *parameter) else { return };
        if nominal.is_below(lower) || upper.is_below(nominal) {
            let message = format!("`{parameter}` = {} lies outside the interval of its value", set.text);
            let varied = self.variants.iter().find(|varied| varied.parameter.value == *parameter);
            let diagnostic = Diagnostic::error("tolerance::bounds", message)
                .at(place, "this interval")
                .at_optional(varied.map(|varied| &varied.parameter.place), "varied here");
            out.push(diagnostic.help("write `± ...` after the value: it moves with the variants"));
        }
    }

    /// Checks of an element over several keys must pass at both ends, and computed values must exist there.
    fn check_ends(&self, tolerance: &Tolerance, settings: &[Setting], out: &mut Vec<Diagnostic>) {
        let mut following = vec![tolerance.parameter.as_str()];
        for parameter in self.in_order() {
            if parameter.expression.as_ref().is_some_and(|one| one.names().iter().any(|name| following.contains(name)))
            {
                following.push(&parameter.name);
            }
        }
        let elements = self
            .elements
            .iter()
            .map(|e| (e.kind.keyword, &e.name, &e.table, e.kind.fields.to_vec(), Some(e.kind.check)));
        let controls = self.controls.iter().map(|c| ("control", &c.name, &c.table, keys_of(c.kind), None));
        let users = elements.chain(controls).filter(|(_, _, table, ..)| {
            table.unread.is_empty() && table.values.values().any(|entry| uses(entry, &following))
        });
        for (keyword, name, table, fields, check) in users {
            let diagnostics = |settings: &[Setting]| -> Vec<(String, String)> {
                let mut silent = Vec::new();
                let reader = TableReader::new(self, settings);
                let what = format!("{keyword} `{name}`");
                let values = reader.values(&fields, table, &what, &mut silent);
                if !silent.is_empty() {
                    return silent.into_iter().map(|one| (one.message, one.help.unwrap_or_default())).collect();
                }
                let checked = check.map(|check| check(&values)).unwrap_or_default();
                checked.into_iter().map(|one| (one.message, one.help)).collect()
            };
            if !diagnostics(settings).is_empty() {
                continue; // Reported of the model itself.
            }
            for (end, value) in [("lower", &tolerance.lower), ("upper", &tolerance.upper)] {
                let set = Setting { name: tolerance.parameter.clone(), value: value.clone(), text: String::new() };
                let mut settings: Vec<Setting> = settings.iter().filter(|s| s.name != set.name).cloned().collect();
                settings.push(set);
                for (message, help) in diagnostics(&settings) {
                    let message = format!(
                        "{keyword} `{name}`, at the {end} end of the tolerance of `{}` ({}): {}",
                        tolerance.parameter,
                        shown(value, tolerance.dimension),
                        message
                    );
                    out.push(
                        Diagnostic::error("element::invalid", message)
                            .at(&tolerance.place, "with this tolerance")
                            .help(format!("narrow the tolerance, or: {help}")),
                    );
                }
            }
        }
    }
}

/// Whether a value of a table is one of these parameters, or computed from one.
fn uses(entry: &Placed<Value>, parameters: &[&str]) -> bool {
    let uses = |scalar: &Scalar| match scalar {
        Scalar::Parameter(name) => parameters.contains(&name.as_str()),
        Scalar::Expression(expression) => expression.names().iter().any(|name| parameters.contains(name)),
        Scalar::Literal(..) | Scalar::Tolerated(_) => false,
    };
    entry.value.scalars().into_iter().any(uses)
}

/// Reports an interval that violates the rule of a key.
fn check_signs(tolerance: &Tolerance, table: &Table, what: &str, out: &mut Vec<Diagnostic>) {
    for (field, entry) in table.fields.iter().filter_map(|field| Some((field, table.values.get(field.name)?))) {
        let sign = match (&field.kind.for_translation(table.translational), &entry.value) {
            (_, Value::Tables(tables)) => {
                for (i, table) in tables.iter().enumerate() {
                    let what = format!("entry {} of `{}` of {what}", i + 1, field.name);
                    check_signs(tolerance, table, &what, out);
                }
                continue;
            }
            (Kind::Quantity(_, sign) | Kind::Number(sign), Value::Scalar(Scalar::Parameter(name)))
                if *name == tolerance.parameter =>
            {
                *sign
            }
            _ => continue,
        };
        let Tolerance { nominal, lower, upper, .. } = tolerance;
        let (reaches, rule) = match sign {
            // A value that violates the rule itself is reported elsewhere.
            Sign::Positive if lower.signum() <= 0 && nominal.signum() > 0 => {
                (if lower.is_zero() { "zero" } else { "zero and below" }, "be above zero")
            }
            Sign::Period if lower.to_f64() < SHORTEST_PERIOD && nominal.to_f64() >= SHORTEST_PERIOD => {
                ("below 1 us", "be at least 1 us")
            }
            Sign::NonNegative if lower.signum() < 0 && nominal.signum() >= 0 => ("below zero", "not be negative"),
            Sign::NonZero if lower.signum() * upper.signum() <= 0 && !nominal.is_zero() => ("zero", "not be zero"),
            _ => continue,
        };
        let is_own_place = tolerance.place == entry.place;
        let whose =
            if is_own_place { "its tolerance".into() } else { format!("the tolerance of `{}`", tolerance.parameter) };
        let message =
            format!("`{}` of {what} must {rule}, but {whose} reaches {reaches}: {}", field.name, tolerance.shown());
        let diagnostic = Diagnostic::error("number::sign", message)
            .at(&tolerance.place, format!("reaches {reaches}"))
            .at_optional((!is_own_place).then_some(&entry.place), "used here");
        let help = "narrow the tolerance, or write bounds of your own after the value: \"2 N m [0.5, 6]\"";
        out.push(diagnostic.help(help));
        return;
    }
}

#[cfg(test)]
#[path = "../../tests/unit/tolerance.rs"]
mod tests;
