//! The request of `[sweep]` of a model file, with its errors.

use super::correlated::correlated;
use super::distribution::Distribution;
use super::sample_space::SampleSpace;
use super::sampling_method::{SOBOL_AXES, SamplingMethod};
use super::varied::{SWEEP, Varied, add, parameter};
use crate::study::measure::selected_variants::selected_variants;
use crate::study::read::read_values::{key_error, of_dimension, quantity, read_word};
use crate::study::read::scenario::whole;
use crate::study::read::signal_table::SignalContext;
use kardan_identify::two_sided_normal;
use kardan_math::units::Exact;
use kardan_model::{Document, Parameter, TableReader};
use kardan_schema::diagnostics::{Diagnostic, shortened};
use kardan_schema::schema::{Sign, Table};

/// Most samples.
pub(in crate::study) const MOST_SAMPLES: u64 = 10_000_000;
/// Default levels of a grid.
const LEVELS: u64 = 5;
/// An end of a normal distribution is at most this many deviations on the other side of its mean.
const MOST_DEVIATIONS: f64 = 6.0;
/// Fraction of an interval by which rounding may make its sides uneven.
const EVEN: f64 = 1e-12;

/// The sweep request.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepSpec {
    /// Number of samples.
    pub samples: u64,
    /// The seed of the samples.
    pub seed: u64,
    /// The variants; empty: all.
    pub variants: Vec<String>,
    /// What varies, and how samples are chosen.
    pub(in crate::study) space: SampleSpace,
}

/// Reads it; without a table `[sweep]` all tolerances of the file vary.
pub(in crate::study) fn sweep_spec(
    context: &SignalContext<'_>,
    variants: &[String],
    out: &mut Vec<Diagnostic>,
) -> SweepSpec {
    let (document, table) = (context.document, &context.document.sweep);
    let reader = TableReader::new(document, &[]);
    let samples = whole(&reader, table, "samples", SWEEP, out).unwrap_or(1000);
    if samples > MOST_SAMPLES {
        let message = format!("{SWEEP}: {samples} samples are more than {MOST_SAMPLES}");
        out.push(key_error("sweep::samples", message, (table, "samples", "too many"), "request fewer"));
    }
    let mut varied: Vec<Varied> = Vec::new();
    for table in table.tables("vary") {
        add(&mut varied, vary(&reader, document, table, out), table, out);
    }
    lists(&reader, document, &mut varied, out);
    let of_tolerances = !table.values.contains_key("vary") && !table.values.contains_key("lists");
    if of_tolerances {
        varied = tolerances(document);
    }
    let correlated = correlated(document, &mut varied, of_tolerances, out);
    let levels = whole(&reader, table, "levels", SWEEP, out).unwrap_or(LEVELS);
    let sampling = SamplingMethod::named(read_word(table, "points").unwrap_or_default(), levels.max(2));
    check_points(table, sampling, (levels, &varied, correlated.is_empty()), out);
    SweepSpec {
        samples,
        seed: whole(&reader, table, "seed", SWEEP, out).unwrap_or_default(),
        variants: selected_variants(table, variants, context, SWEEP, out),
        space: SampleSpace { varied, correlated, sampling },
    }
}

/// Reports keys that the points do not use, distributions without ends, and points that do not support this many axes, or parameters
/// that vary together.
fn check_points(
    table: &Table,
    sampling: SamplingMethod,
    (levels, varied, apart): (u64, &[Varied], bool),
    out: &mut Vec<Diagnostic>,
) {
    let mut refuse = |key: &str, message: String, help: &str| {
        out.push(key_error("sweep::points", format!("{SWEEP}: {message}"), (table, key, "here"), help));
    };
    let here = |key: &str| table.values.contains_key(key);
    let word = sampling.word();
    if here("levels") && read_word(table, "points") != Some("grid") {
        refuse("levels", "`levels` applies to `points = \"grid\"` only".into(), "remove it, or choose a grid");
    } else if levels < 2 {
        refuse("levels", format!("a grid has {levels} level"), "a grid needs at least two levels");
    }
    if matches!(sampling, SamplingMethod::Levels(_)) {
        for key in ["samples", "seed"].into_iter().filter(|key| here(key)) {
            refuse(key, format!("`{key}`: the samples of `points = \"{word}\"` are all combinations"), "remove it");
        }
        for one in varied.iter().filter(|one| one.distribution.is_open().contains(&true)) {
            let message = format!("`{}` has no minimum or no maximum: {}", one.name, one.text);
            refuse("points", message, "give it `from` and `to` in `[[sweep.vary]]`, or choose other points");
        }
    }
    let axes = varied.len();
    let most = match sampling {
        SamplingMethod::Sobol => SOBOL_AXES,
        SamplingMethod::Saltelli => SOBOL_AXES / 2,
        _ => usize::MAX,
    };
    if axes > most {
        let message = format!("`points = \"{word}\"` supports at most {most} parameters, and {axes} vary");
        refuse("points", message, "choose other points");
    }
    if !apart && matches!(sampling, SamplingMethod::Levels(_) | SamplingMethod::Morris) {
        let message =
            format!("samples of `points = \"{word}\"` change one parameter at a time, and some vary together");
        refuse("points", message, "choose other points, or remove `[[sweep.correlated]]`");
    }
}

/// A `[[sweep.vary]]`.
fn vary(reader: &TableReader<'_>, document: &Document, table: &Table, out: &mut Vec<Diagnostic>) -> Option<Varied> {
    let name = read_word(table, "parameter")?;
    let place = table.place_of("parameter");
    let what = format!("`[[sweep.vary]]` of `{}`", shortened(name));
    let parameter = parameter(document, name, (place, &what), out)?;
    let before = out.len();
    let value = |key: &str, out: &mut Vec<Diagnostic>| {
        quantity(reader, table, key, (parameter.dimension, Sign::Any), &what, out).map(|x| x.to_f64())
    };
    let ends = parameter.spread.as_ref().map(|spread| spread.limits_at(&parameter.value));
    let [from, to] = ["from", "to"].map(|key| value(key, out));
    let nominal = parameter.value.to_f64();
    let word = read_word(table, "distribution").unwrap_or("uniform");
    let unused_keys: &[&str] = match word {
        "normal" => &["peak"],
        "triangular" => &["mean", "deviation"],
        _ => &["mean", "deviation", "peak"],
    };
    for key in unused_keys.iter().filter(|key| table.values.contains_key(**key)) {
        let message = format!("{what}: a {word} distribution has no `{key}`");
        let help = "remove it, or name another distribution";
        out.push(key_error("sweep::distribution", message, (table, key, "not used"), help));
    }
    let refuse = |key: &str, message: &str, help: &str, out: &mut Vec<Diagnostic>| {
        let place = if table.values.contains_key(key) { table.place_of(key) } else { place };
        out.push(Diagnostic::error("sweep::distribution", format!("{what}: {message}")).at(place, "here").help(help));
    };
    let (low, high) = match (word, &ends) {
        ("normal", _) => (from.unwrap_or(f64::NEG_INFINITY), to.unwrap_or(f64::INFINITY)),
        (_, Some((low, high))) => (from.unwrap_or(low.to_f64()), to.unwrap_or(high.to_f64())),
        (_, None) => (from.unwrap_or(f64::NAN), to.unwrap_or(f64::NAN)),
    };
    if low.is_nan() || high.is_nan() {
        let (key, other) = if low.is_nan() { ("from", "least") } else { ("to", "largest") };
        let message = format!("`{key}` is missing, and the value in the file has no tolerance");
        refuse(key, &message, &format!("add `{key}`, the {other} value"), out);
    } else if low >= high {
        refuse("from", "no value lies between `from` and `to`", "`from` must be the smaller one", out);
    }
    let [mean, peak, deviation] = ["mean", "peak", "deviation"].map(|key| value(key, out));
    // Errors of a value itself were reported.
    let deviation = deviation.or_else(|| table.values.contains_key("deviation").then_some(f64::NAN));
    match shape(word, (low, high, nominal), [mean, peak, deviation]) {
        Ok(distribution) => {
            (out.len() == before).then(|| Varied::new(&parameter.name, parameter.dimension, distribution))
        }
        Err((key, message, help)) => {
            refuse(key, message, help, out);
            None
        }
    }
}

/// A distribution by its name, between its ends; else the wrong key, the message, and help.
fn shape(
    word: &str,
    (low, high, nominal): (f64, f64, f64),
    [mean, peak, deviation]: [Option<f64>; 3],
) -> Result<Distribution, (&'static str, &'static str, &'static str)> {
    match word {
        "normal" => {
            let mean = mean.unwrap_or(nominal);
            let needed = ("deviation", "a normal distribution needs its standard deviation", "add `deviation`");
            let deviation = deviation.ok_or(needed)?;
            if deviation <= 0.0 {
                return Err(("deviation", "the standard deviation has to be positive", "write a value above zero"));
            }
            if low > mean + MOST_DEVIATIONS * deviation || high < mean - MOST_DEVIATIONS * deviation {
                let why = "almost no value of the distribution lies between its ends";
                return Err(("from", why, "move them towards the mean"));
            }
            Ok(Distribution::Normal { mean, deviation, from: low, to: high })
        }
        "triangular" => {
            let peak = peak.unwrap_or(nominal);
            if !(low..=high).contains(&peak) && low < high {
                return Err(("peak", "the peak lies outside the ends", "put it between `from` and `to`"));
            }
            Ok(Distribution::Triangular { from: low, peak, to: high })
        }
        _ => Ok(Distribution::Uniform { from: low, to: high }),
    }
}

/// `lists`.
fn lists(reader: &TableReader<'_>, document: &Document, varied: &mut Vec<Varied>, out: &mut Vec<Diagnostic>) {
    let table = &document.sweep;
    let mut found: Vec<(&Parameter, Vec<f64>)> = Vec::new();
    for (name, scalar) in table.map("lists").unwrap_or_default() {
        let label = format!("`{}` of `lists` of {SWEEP}", shortened(&name.value));
        let position = found.iter().position(|(parameter, _)| parameter.name == name.value);
        let number = match position {
            Some(number) => number,
            None => {
                let Some(parameter) = parameter(document, &name.value, (&name.place, &label), out) else { continue };
                found.push((parameter, Vec::new()));
                found.len() - 1
            }
        };
        let dimension = (found[number].0.dimension, Sign::Any);
        let value = of_dimension(reader, scalar, dimension, &label, out);
        found[number].1.extend(value.map(|x| x.to_f64()));
    }
    for (parameter, values) in found.into_iter().filter(|(_, values)| !values.is_empty()) {
        let one = Varied::new(&parameter.name, parameter.dimension, Distribution::Listed(values));
        add(varied, Some(one), table, out);
    }
}

/// All tolerances: uniform within them, normal with those that have a confidence.
fn tolerances(document: &Document) -> Vec<Varied> {
    let varied = document.tolerances(&[]).into_iter().map(|one| {
        let [nominal, from, to] = [&one.nominal, &one.lower, &one.upper].map(Exact::to_f64);
        let distribution = match &one.confidence {
            None => Distribution::Uniform { from, to },
            Some(confidence) => {
                let deviations = two_sided_normal(1.0 - confidence.to_f64());
                let [below, above] = [nominal - from, to - nominal].map(|far| far / deviations);
                // No value changes its sign.
                let [low, high] = match () {
                    () if nominal > 0.0 => [0.0, f64::INFINITY],
                    () if nominal < 0.0 => [f64::NEG_INFINITY, 0.0],
                    () => [f64::NEG_INFINITY, f64::INFINITY],
                };
                // Each side of an uneven interval has its own half: the probability outside is the stated one.
                match (below - above).abs() <= EVEN * (below + above) {
                    true => {
                        let deviation = 0.5 * (below + above);
                        Distribution::Normal { mean: nominal, deviation, from: low, to: high }
                    }
                    false => Distribution::Halves { peak: nominal, below, above, from: low, to: high },
                }
            }
        };
        Varied::new(&one.parameter, one.dimension, distribution)
    });
    varied.filter(|one| !document.is_varied(&one.name)).collect()
}
