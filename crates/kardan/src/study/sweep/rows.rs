//! Rows of a sweep: the settings of a sample, the results of a run, the difference of two rows.

use crate::study::measure::selected_variants::selects;
use crate::study::prepare::variants::prepare_sample;
use crate::study::requests::varied::Varied;
use crate::study::{Prepared, PreparedVariant};
use kardan_math::num::{Random, rational_from_f64};
use kardan_math::units::{Exact, format_quantity};
use kardan_model::{Document, Setting};
use kardan_results::{Run, SweepRow};
use kardan_schema::diagnostics::{Diagnostic, Severity};

/// The seed of the sensor noise in a sample, if that of the scenario is `own`.
pub(super) fn seed_of(own: u64, sample: u64) -> u64 {
    Random::named(own, &format!("sample {sample}")).next_u64()
}

/// A variant with the values of a sample, and with its sensor noise, if that is redrawn for the sample of a number. Its laws use the values in the file, and those of the sample for parameters that occur in laws only.
///
/// # Errors
/// The errors of these values.
pub(super) fn sampled(
    document: &Document,
    variant: &PreparedVariant,
    varied: &[Varied],
    (values, drawn): (&[f64], Option<u64>),
) -> Result<PreparedVariant, Vec<Diagnostic>> {
    let with = |only_of_laws: bool, designed: Option<&PreparedVariant>| {
        let mut own = variant.own.clone();
        for (varied, value) in varied.iter().zip(values).filter(|(one, _)| !only_of_laws || !one.laws.is_empty()) {
            // Every value is finite, as its distribution is.
            let value = Exact::new(rational_from_f64(*value).unwrap_or_default(), 0);
            own.settings.retain(|setting| setting.name != varied.name);
            let text = format_quantity(&value, varied.dimension);
            own.settings.push(Setting { name: varied.name.clone(), text, value });
        }
        let mut found = prepare_sample(document, (&variant.name, designed), &own)?;
        let seed = found.scenario.seed;
        found.scenario.seed = drawn.map_or(seed, |sample| seed_of(variant.scenario.seed, sample));
        Ok(found)
    };
    if varied.iter().all(|one| one.laws.is_empty()) {
        return with(false, Some(variant));
    }
    with(false, Some(&with(true, None)?))
}

/// A row before its run.
pub(super) fn blank(prepared: &Prepared, (sample, variant): (u64, usize), values: &[f64]) -> SweepRow {
    SweepRow {
        sample,
        variant,
        values: values.to_vec(),
        measured: vec![f64::NAN; prepared.requirements.len()],
        passed: vec![f64::NAN; prepared.requirements.len()],
        figures: vec![f64::NAN; prepared.figures.len()],
        ..SweepRow::default()
    }
}

/// Why a sample cannot run, from the errors of its values: code and message.
pub(super) fn refusal(diagnostics: &[Diagnostic]) -> String {
    let first = diagnostics.iter().find(|diagnostic| diagnostic.severity == Severity::Error);
    first.map_or_else(|| "kardan cannot prepare it".into(), |one| format!("{}: {}", one.code, one.message))
}

/// Whether a reason is that a sample cannot run, and not a result of its run: it begins with a code.
pub(super) fn is_refusal(reason: &str) -> bool {
    reason.split_once(": ").is_some_and(|(code, _)| code.contains("::") && !code.contains(' '))
}

/// The results of a run.
pub(super) fn fill(row: &mut SweepRow, prepared: &Prepared, run: &Run) {
    if let Some(cause) = run.outcome.cause() {
        row.reason = cause.into();
    }
    let requirements = prepared.requirements.iter().enumerate().filter(|(_, one)| selects(&one.variants, &run.name));
    for ((k, _), found) in requirements.zip(&run.requirements) {
        row.measured[k] = found.measured.unwrap_or(f64::NAN);
        row.passed[k] = if found.passed { 1.0 } else { 0.0 };
    }
    let figures = prepared.figures.iter().enumerate().filter(|(_, one)| selects(&one.variants, &run.name));
    for ((k, _), found) in figures.zip(&run.figures) {
        row.figures[k] = found.value.unwrap_or(f64::NAN);
    }
}

/// The differences of the numbers of two rows, relative to the larger ones, or to bounds that are larger.
pub(super) fn difference(prepared: &Prepared, row: &SweepRow, other: &SweepRow) -> f64 {
    let apart = |a: f64, b: f64, bounds: [Option<f64>; 2]| {
        let size = bounds.into_iter().flatten().fold(a.abs().max(b.abs()), |size, bound| size.max(bound.abs()));
        match (a.is_nan(), b.is_nan()) {
            (true, true) => 0.0,
            (false, false) if a == b => 0.0,
            (false, false) => (a - b).abs() / size,
            _ => f64::INFINITY,
        }
    };
    let measured = row.measured.iter().zip(&other.measured).zip(&prepared.requirements);
    let measured = measured.map(|((a, b), one)| apart(*a, *b, [one.below, one.above]));
    let figures = row.figures.iter().zip(&other.figures).map(|(a, b)| apart(*a, *b, [None; 2]));
    measured.chain(figures).fold(0.0, f64::max)
}
