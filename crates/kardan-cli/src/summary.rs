//! A study in a few lines for the terminal.

use std::fmt::Write;

use kardan::export::{Files, extremes};
use kardan::results::{MotorStrain, Outcome, Run, Signal, Structure, Study};
use kardan_report::words;

use crate::render::visible;

/// Gives the summary: for each variant its outcome, the extremes of the plotted signals, energy, requirements and
/// files.
pub fn summary(study: &Study, files: &Files, origin: &str) -> String {
    let mut out = String::new();
    let variants = study.runs.len();
    let plural = if variants == 1 { "" } else { "s" };
    let _ = writeln!(out, "{} ({origin}): {variants} variant{plural}", study.model.name);
    for (index, run) in study.runs.iter().enumerate() {
        let plotted = plotted(study, run);
        variant(&mut out, run, &plotted, files.runs.get(index).map_or(&[], Vec::as_slice));
    }
    out.push('\n');
    for path in files.report.iter().chain(&files.plots) {
        let _ = writeln!(out, "wrote {path}");
    }
    if let Some(analysis) = &study.analysis {
        structure(&mut out, &analysis.structure);
    }
    let requirements: Vec<bool> = study.runs.iter().flat_map(|run| &run.requirements).map(|r| r.passed).collect();
    let strained = study.runs.iter().filter(|run| run.strains.iter().any(MotorStrain::strained)).count();
    if strained > 0 {
        let of = if strained == variants { "every variant" } else { &format!("{strained} of {variants} variants") };
        let _ = writeln!(out, "in {of} a motor is at its limit (see the notes)");
    }
    if !requirements.is_empty() {
        let passed = requirements.iter().filter(|&&passed| passed).count();
        let _ = writeln!(out, "{passed} of {} requirements hold", requirements.len());
    }
    visible(&out)
}

/// One line on what the inputs reach and the outputs show.
fn structure(out: &mut String, structure: &Structure) {
    let states = structure.states.len();
    let part = |holds: bool, what: &str, rank: usize, names: &[String]| {
        let names = if names.is_empty() { "nothing".into() } else { words::list(names, 4) };
        if holds { format!("{what} {names}") } else { format!("NOT {what} {names} (rank {rank} of {states})") }
    };
    let controllable =
        part(structure.controllable(), "controllable by", structure.controllable_rank, &structure.inputs);
    let observable = part(structure.observable(), "observable from", structure.observable_rank, &structure.outputs);
    let _ = writeln!(out, "structure: {controllable}; {observable}");
}

/// The signals that some plot shows for this run; all signals if there are no plots.
fn plotted<'a>(study: &Study, run: &'a Run) -> Vec<&'a Signal> {
    let shown = |signal: &&Signal| {
        study.plots.iter().any(|plot| {
            (plot.variants.is_empty() || plot.variants.contains(&run.name)) && plot.signals.contains(&signal.name)
        })
    };
    let all = run.series.signals.iter();
    if study.plots.is_empty() { all.collect() } else { all.filter(shown).collect() }
}

fn variant(out: &mut String, run: &Run, signals: &[&Signal], files: &[String]) {
    let effort = &run.effort;
    let done = match &run.outcome {
        Outcome::Completed => "completed".to_owned(),
        Outcome::Failed { time, cause } => format!("ENDED EARLY at {} s: {cause}", number(*time)),
    };
    let _ = writeln!(out, "\n{}: {done} (steps {}, events {})", run.name, effort.steps, effort.events);
    for parameter in &run.parameters {
        let _ = writeln!(out, "  {} = {}", parameter.name, parameter.text);
    }
    if !signals.is_empty() {
        let name = signals.iter().map(|signal| signal.name.chars().count()).max().unwrap_or(0).max(6);
        let row = |cells: [&str; 7]| {
            let [signal, unit, min, t_min, max, t_max, last] = cells;
            format!("  {signal:name$}  {unit:5}  {min:>11}  {t_min:>8}  {max:>11}  {t_max:>8}  {last:>11}\n")
        };
        out.push_str(&row(["signal", "unit", "min", "at s", "max", "at s", "final"]));
        for signal in signals {
            let e = extremes(&run.series.time, &signal.values);
            let [min, t_min, max, t_max, last] = [e.min, e.t_min, e.max, e.t_max, e.last].map(number);
            out.push_str(&row([&signal.name, signal.physical.unit(), &min, &t_min, &max, &t_max, &last]));
        }
    }
    let energy = [run.energy.input, run.energy.stored, run.energy.dissipated, run.energy.residual].map(number);
    let [input, stored, dissipated, residual] = &energy;
    let _ =
        writeln!(out, "  energy: input {input} J = stored {stored} + dissipated {dissipated} + residual {residual}");
    for requirement in &run.requirements {
        let verdict = if requirement.passed { "holds" } else { "FAILED" };
        let measured = number(requirement.measured.unwrap_or(f64::NAN));
        let _ = writeln!(out, "  {verdict}: {} (measured {measured} {})", requirement.text, requirement.unit);
    }
    for note in &run.notes {
        let _ = writeln!(out, "  note: {note}");
    }
    for path in files {
        let _ = writeln!(out, "  wrote {path}");
    }
}

/// Five significant digits, without zeros at the end.
fn number(value: f64) -> String {
    let count = 5;
    let trim = |text: &str| text.trim_end_matches('0').trim_end_matches('.').to_owned();
    let size = value.abs();
    if !value.is_finite() {
        "-".into()
    } else if size == 0.0 {
        "0".into()
    } else if (1e-3..99_999.5).contains(&size) {
        let last = count as f64 - 1.0;
        let decimals = (last - size.log10().floor()).clamp(0.0, last + 3.0) as usize;
        let text = format!("{value:.decimals$}");
        if text.contains('.') { trim(&text) } else { text }
    } else {
        let text = format!("{value:.*e}", count - 1);
        let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        format!("{}e{exponent}", trim(digits))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kardan::results::Plot;

    #[test]
    fn numbers_have_five_digits() {
        let cases = [
            (0.0, "0"),
            (-0.0, "0"),
            (std::f64::consts::PI, "3.1416"),
            (-1500.0, "-1500"),
            (12345.678, "12346"),
            (99999.9, "1e5"),
            (0.00123456, "0.0012346"),
            (-2.5e-9, "-2.5e-9"),
            (1e300, "1e300"),
            (f64::NAN, "-"),
        ];
        for (value, text) in cases {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn only_signals_plotted_for_the_variant_are_listed() {
        let signal = |name: &str| Signal {
            name: name.into(),
            physical: kardan::results::Physical::Angle,
            description: String::new(),
            values: vec![],
        };
        let plot = |signal: &str, variants: &[&str]| Plot {
            signals: vec![signal.into()],
            variants: variants.iter().map(|&name| name.into()).collect(),
            ..Plot::default()
        };
        let run = Run {
            name: "b".into(),
            parameters: vec![],
            series: kardan::results::Series { time: vec![], signals: vec![signal("x"), signal("y"), signal("z")] },
            energy: Default::default(),
            events: vec![],
            outcome: Outcome::Completed,
            requirements: vec![],
            notes: vec![],
            strains: vec![],
            effort: Default::default(),
        };
        let mut study = Study { plots: vec![plot("x", &["a"]), plot("y", &[])], ..Study::default() };
        let names = |study: &Study| plotted(study, &run).iter().map(|s| s.name.clone()).collect::<Vec<_>>();
        assert_eq!(names(&study), ["y"]);
        study.plots.clear();
        assert_eq!(names(&study), ["x", "y", "z"]);
    }
}
