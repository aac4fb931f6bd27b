//! `kardan safety`: every fault of a list in every variant and at every value, against the same run without it.

mod judged;

use std::collections::BTreeSet;

use rayon::prelude::*;

use judged::{Traces, judge};

use crate::study::progress::Counted;
use crate::study::read::variant_diagnostics::without_errors;
use crate::study::run::runs::run_variant;
use crate::study::{Part, Prepared, PreparedVariant, Progress, Project, SafetySpec, Settings};
use kardan_math::units::format_quantity;
use kardan_results::{EffectMeasured, MonitorOutcome, Outcome, Safety, SafetyRow, SafetyValue, SafetyVerdict};
use kardan_schema::diagnostics::{Diagnostic, quoted};
use kardan_schema::entries::RawValue;

/// Most rows of a table.
const MOST_ROWS: usize = 20_000;

/// Settings of the table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SafetySettings {
    /// Name of the model in the commands that run a row again: `my.toml`.
    pub origin: String,
    /// Changed values, in the form of `--set` there.
    pub changes: Vec<String>,
}

impl Project {
    /// Runs every fault of `[safety]` in every variant and at every value, each beside the run without it, and judges the detection and
    /// the effects. Each row is one run of [`Project::run`] with [`Settings::faults`].
    ///
    /// ```
    /// use kardan::project::Project;
    /// use kardan::study::Silent;
    ///
    /// let project = Project::open(
    ///     "[shaft.a]\ninertia = \"2 kg m^2\"\n[motor.m]\nshaft = \"a\"\n\
    ///      [scenario]\n[[scenario.event]]\nsignal = \"m.tau\"\nat = \"0 s\"\nto = \"4 N m\"\n\
    ///      [fault.dead]\nmotor = \"m\"\nat = \"0.5 s\"\n\
    ///      [safety]\n[[safety.effect]]\nname = \"turn\"\nsignal = \"a.phi\"\nbelow = \"10 deg\"\n",
    /// );
    /// let table = project.safety(&Default::default(), &Silent).unwrap();
    /// // 1 rad/s² are missing for half a second: ½ · 2 · ½² rad.
    /// let missing = table.rows[1].effects[0].measured.unwrap();
    /// assert!((missing - 0.25).abs() < 1e-12 && table.rows[1].verdict.to_string() == "not detected and harmful");
    /// ```
    ///
    /// # Errors
    /// All errors (warnings do not count), and a file without faults.
    pub fn safety(&self, settings: &SafetySettings, progress: &dyn Progress) -> Result<Safety, Vec<Diagnostic>> {
        let (prepared, diagnostics) = (self.prepared(), self.diagnostics());
        without_errors(diagnostics)?;
        let spec = tried(prepared).map_err(|diagnostic| vec![diagnostic])?;
        let variants = chosen(prepared, spec).map_err(|diagnostic| vec![diagnostic])?;
        let lists = self.lists(spec);
        let (cases, omitted) = cases(spec, prepared, &variants);
        let combinations = lists.iter().fold(1, |all: usize, list| all.saturating_mul(list.len()));
        let all = combinations.saturating_mul(variants.len() * (1 + cases.len()));
        if all > MOST_ROWS {
            let message = format!("the table would have {all} rows, more than {MOST_ROWS}");
            let help = "try fewer faults, variants or values at a time, or no pairs";
            return Err(vec![Diagnostic::error("safety::rows", message).help(help)]);
        }
        let grid = combined(&lists);
        let monitors = spec.monitors.iter().map(|name| MonitorOutcome { name: name.clone(), ..Default::default() });
        let mut out = Safety {
            model: prepared.name.clone(),
            description: prepared.description.clone(),
            detected: spec.detected.clone(),
            detection_time_limit: spec.detection_time_limit,
            effects: spec.effects.iter().map(|effect| effect.definition.clone()).collect(),
            rows: Vec::with_capacity(all),
            missing: all,
            monitors: monitors.collect(),
            notes: omitted.into_iter().collect(),
            warnings: diagnostics.iter().map(ToString::to_string).collect(),
        };
        out.notes.extend(always(prepared));
        let counted = Counted::new(progress, 0, all);
        for values in &grid {
            if progress.stop().is_some() {
                break;
            }
            let table = Table { settings, cases: &cases, values, several: prepared.variants.len() > 1 };
            let found = self.at_values(values, &variants, &table, &counted);
            for (rows, monitors) in found {
                out.rows.extend(rows);
                add_outcomes(&mut out.monitors, monitors);
            }
            out.missing = all - out.rows.len();
            progress.store_partial(&|| Part::Safety(Box::new(finished(out.clone(), None))));
        }
        let why = progress.stop();
        progress.release();
        Ok(finished(out, why))
    }

    /// The values of each parameter, as source text.
    fn lists(&self, spec: &SafetySpec) -> Vec<Vec<SafetyValue>> {
        let tables = self.entries().table("safety").and_then(|safety| safety.table("values"));
        let text = |value: &RawValue| match value {
            RawValue::Text(text) | RawValue::Number(text) => Some(text.clone()),
            RawValue::Quantity(value, dimension) => Some(format_quantity(value, *dimension)),
            _ => None,
        };
        let list = |name: &String| {
            let texts: Vec<String> = match tables.and_then(|table| table.get(name)) {
                Some(RawValue::List(list)) => list.iter().filter_map(|entry| text(&entry.value)).collect(),
                Some(one) => text(one).into_iter().collect(),
                None => Vec::new(),
            };
            texts.into_iter().map(|value| SafetyValue { name: name.clone(), value }).collect()
        };
        spec.values.iter().map(list).collect()
    }

    /// The rows of all variants at some values.
    fn at_values(
        &self,
        values: &[SafetyValue],
        variants: &[String],
        table: &Table<'_>,
        counted: &Counted<'_>,
    ) -> Vec<Found> {
        let texts: Vec<String> = values.iter().map(|one| format!("{}={}", one.name, one.value)).collect();
        let changed = (!texts.is_empty()).then(|| self.with(&texts));
        let changed_project = match &changed {
            None => Ok(self),
            Some(Ok((project, _))) => Ok(project),
            Some(Err(diagnostic)) => Err(diagnostic.to_string()),
        };
        let ready = changed_project.and_then(|project| {
            let found = project.diagnostics().iter().find(|diagnostic| diagnostic.is_error());
            found.map_or(Ok(project.prepared()), |diagnostic| Err(diagnostic.to_string()))
        });
        let one = |name: &String| match &ready {
            Ok(prepared) => table.variant(prepared, name, counted),
            Err(why) => table.refused(name, why, counted),
        };
        variants.par_iter().map(one).collect()
    }
}

/// Every combination of values; one empty combination for no values.
fn combined(lists: &[Vec<SafetyValue>]) -> Vec<Vec<SafetyValue>> {
    lists.iter().fold(vec![Vec::new()], |all, list| {
        let with = |one: &Vec<SafetyValue>| {
            list.iter().map(|value| [one.clone(), vec![value.clone()]].concat()).collect::<Vec<_>>()
        };
        all.iter().flat_map(with).collect()
    })
}

/// Rows, and the alarms of monitors in them: the number of the monitor, the fault that raised it or none, and the variant.
type Found = (Vec<SafetyRow>, Vec<(usize, Option<String>, String)>);

/// The request; a file without one is rejected.
fn tried(prepared: &Prepared) -> Result<&SafetySpec, Diagnostic> {
    let help = "write faults, `[fault.encoder_lost]` with `sensor = \"encoder\"` and `at = \"0.5 s\"`, and a table `[safety]`; \
                `kardan elements safety` shows one";
    let Some(spec) = prepared.safety.as_ref().filter(|spec| !spec.faults.is_empty()) else {
        return Err(Diagnostic::error("safety::faults", "the file has no faults to analyse").help(help));
    };
    if spec.detected.is_none() && spec.effects.is_empty() {
        let message = "`[safety]` defines neither a detection condition nor unwanted effects";
        let help = "add `detected = \"MONITOR\"`, or an effect: `[[safety.effect]]` with `signal` and `below`";
        return Err(Diagnostic::error("safety::no-criterion", message).help(help));
    }
    Ok(spec)
}

/// The variants of the runs.
fn chosen(prepared: &Prepared, spec: &SafetySpec) -> Result<Vec<String>, Diagnostic> {
    let all = prepared.all().filter(|variant| match spec.variants.is_empty() {
        true => variant.own.faults.is_empty(),
        false => spec.variants.contains(&variant.name),
    });
    let all: Vec<&PreparedVariant> = all.collect();
    if let Some(own) = all.iter().find(|variant| !variant.own.faults.is_empty()) {
        let message = format!("the variant `{}` has faults of its own, so no run of it is without a fault", own.name);
        return Err(Diagnostic::error("safety::variant", message).help("name a variant without `faults`"));
    }
    let names: Vec<String> = all.into_iter().map(|variant| variant.name.clone()).collect();
    if names.is_empty() {
        let message = "every variant has faults of its own: no fault-free run exists for comparison";
        return Err(Diagnostic::error("safety::variant", message).help("add a variant without `faults`"));
    }
    Ok(names)
}

/// Note on faults that occur in all runs.
fn always(prepared: &Prepared) -> Option<String> {
    let some = prepared.all().any(|variant| variant.own.faults.is_empty() && !variant.scenario.faults.is_empty());
    some.then(|| "The faults of `[[scenario.fault]]` occur in all runs, also in the runs counted as fault-free.".into())
}

/// The faults of the rows: single ones, then possible pairs; and a note on pairs that are omitted.
fn cases(spec: &SafetySpec, prepared: &Prepared, variants: &[String]) -> (Vec<Vec<String>>, Option<String>) {
    let mut list: Vec<Vec<String>> = spec.faults.iter().map(|name| vec![name.clone()]).collect();
    let tried: Vec<_> = prepared.all().filter(|variant| variants.contains(&variant.name)).collect();
    let mut omitted = Vec::new();
    for (k, one) in spec.faults.iter().enumerate().filter(|_| spec.pairs) {
        for second in &spec.faults[k + 1..] {
            let pair = vec![one.clone(), second.clone()];
            // At other values other times may apply: the row reports an impossible pair.
            let values = !spec.values.is_empty();
            match tried.iter().all(|variant| variant.failing(&pair).is_err()) && !values && !tried.is_empty() {
                true => omitted.push(format!("{one} with {second}")),
                false => list.push(pair),
            }
        }
    }
    let all = omitted.join(", ");
    let note = format!("kardan omits pairs of faults of one part at the same time: {all}.");
    (list, (!omitted.is_empty()).then_some(note))
}

/// Data for the rows at some values.
struct Table<'a> {
    settings: &'a SafetySettings,
    /// The faults of the rows.
    cases: &'a [Vec<String>],
    values: &'a [SafetyValue],
    /// Whether a command must name its variant.
    several: bool,
}

impl Table<'_> {
    /// The run without a fault, then all others, in parallel; without those that an early stop of the command interrupts.
    fn variant(&self, prepared: &Prepared, name: &str, counted: &Counted<'_>) -> Found {
        let (Some(spec), Some(variant)) = (&prepared.safety, prepared.all().find(|variant| variant.name == name))
        else {
            return self.refused(name, "the variant does not exist at these values", counted);
        };
        let run = |faults: &[String]| {
            let settings = Settings { faults: faults.to_vec(), runs_only: true, ..Settings::default() };
            let (run, _) = run_variant(0, variant, (prepared, &settings), counted, false);
            // An early stop of the command is no result about the model.
            let whole = !matches!(run.outcome, Outcome::Failed { .. }) || counted.stop().is_none();
            counted.count(1);
            whole.then(|| Traces::of(run, spec))
        };
        let Some(free) = run(&[]) else { return Found::default() };
        let mut rows = vec![self.free(spec, name, &free)];
        let mut monitors: Vec<_> = free.raised().map(|number| (number, None, name.to_string())).collect();
        let one = |faults: &Vec<String>| {
            if counted.stop().is_some() {
                return None;
            }
            let not_run = |verdict: SafetyVerdict, note: String| {
                counted.count(1);
                Some((self.row(name, faults, verdict, Some(note)), Vec::new()))
            };
            let Some(begins) = begin(variant, faults) else {
                let note = "no part of the loop of this variant reads or computes the failing part";
                return not_run(SafetyVerdict::Absent, note.into());
            };
            if variant.failing(faults).is_err() {
                return not_run(SafetyVerdict::Failed, "these faults affect one part at the same time".into());
            }
            let (at, end) = (begins[1], variant.scenario.duration);
            if at >= end {
                let note = format!("it would begin at {at} s, and the run ends at {end} s");
                return not_run(SafetyVerdict::Failed, note);
            }
            let traces = run(faults)?;
            let raised = traces.raised_beside(&free, begins[0]);
            let raised = raised.into_iter().map(|number| (number, Some(faults.join("+")), name.to_string()));
            let row = judge(spec, &traces, &free, begins, self.row(name, faults, SafetyVerdict::Failed, None));
            Some((row, raised.collect::<Vec<_>>()))
        };
        let found: Vec<_> = self.cases.par_iter().map(one).collect();
        for (row, raised) in found.into_iter().flatten() {
            rows.push(row);
            monitors.extend(raised);
        }
        (rows, monitors)
    }

    /// The row of the run without a fault.
    fn free(&self, spec: &SafetySpec, name: &str, free: &Traces) -> SafetyRow {
        let alarm = free.alarm();
        let verdict = match (&free.failed, alarm) {
            (Some(_), _) => SafetyVerdict::Failed,
            (None, Some(_)) => SafetyVerdict::FalseAlarm,
            (None, None) => SafetyVerdict::NoAlarm,
        };
        let row = self.row(name, &[], verdict, free.failed.clone());
        let effects = vec![EffectMeasured::default(); spec.effects.len()];
        SafetyRow { detection_time: alarm.map(|row| free.time[row]), effects, ..row }
    }

    /// Rows that cannot be run, with the reason.
    fn refused(&self, name: &str, why: &str, counted: &Counted<'_>) -> Found {
        let all = std::iter::once(&[][..]).chain(self.cases.iter().map(Vec::as_slice));
        let failed = |faults: &[String]| self.row(name, faults, SafetyVerdict::Failed, Some(why.to_string()));
        let rows: Vec<SafetyRow> = all.map(failed).collect();
        counted.count(rows.len());
        (rows, Vec::new())
    }

    fn row(&self, variant: &str, faults: &[String], verdict: SafetyVerdict, note: Option<String>) -> SafetyRow {
        SafetyRow {
            faults: faults.to_vec(),
            variant: variant.to_string(),
            values: self.values.to_vec(),
            verdict,
            note,
            command: self.command(variant, faults),
            ..SafetyRow::default()
        }
    }

    /// The command that repeats the run of a row.
    fn command(&self, variant: &str, faults: &[String]) -> String {
        let mut out = format!("kardan run {}", in_shell(&self.settings.origin));
        if self.several {
            out += &format!(" --variant {}", in_shell(variant));
        }
        for change in &self.settings.changes {
            out += &format!(" --set {}", in_shell(change));
        }
        for SafetyValue { name, value } in self.values {
            out += &format!(" --set {}", in_shell(&format!("{name}={value}")));
        }
        if !faults.is_empty() {
            out += &format!(" --fault {}", faults.join(","));
        }
        out
    }
}

/// When the first and the last of some faults begin in a variant; `None` if none of them has an effect there.
fn begin(variant: &PreparedVariant, faults: &[String]) -> Option<[f64; 2]> {
    let own = variant.faults.iter().filter(|fault| faults.contains(&fault.name));
    let mut begins: Vec<f64> = own.map(crate::study::NamedFault::begins).filter(|begins| begins.is_finite()).collect();
    begins.sort_by(f64::total_cmp);
    Some([*begins.first()?, *begins.last()?])
}

/// A word of a command line, in quotes where it needs them.
fn in_shell(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.' | '/' | '=' | ':' | '+' | ',');
    match !word.is_empty() && word.chars().all(plain) {
        true => word.to_string(),
        false => format!("'{}'", word.replace('\'', "'\\''")),
    }
}

fn add_outcomes(all: &mut [MonitorOutcome], found: Vec<(usize, Option<String>, String)>) {
    for (number, fault, variant) in found {
        let (list, name) = match fault {
            Some(fault) => (&mut all[number].raised_by, fault),
            None => (&mut all[number].false_alarms, variant),
        };
        if !list.contains(&name) {
            list.push(name);
        }
    }
}

/// Adds the notes on the whole table.
fn finished(mut out: Safety, why: Option<String>) -> Safety {
    if out.missing > 0 {
        let why = why.unwrap_or_else(|| "ended early".into());
        out.warnings.push(format!("{why}: {} rows were not computed", out.missing));
        return out;
    }
    let faulty = || out.rows.iter().filter(|row| !row.faults.is_empty());
    if let Some(condition) = &out.detected
        && !faulty().any(|row| row.detection_time.is_some())
    {
        out.notes.push(format!("No fault of this list makes `{condition}` true."));
    }
    let false_alarms = out.rows.iter().filter(|row| row.verdict == SafetyVerdict::FalseAlarm);
    let alarms: BTreeSet<&str> = false_alarms.map(|row| row.variant.as_str()).collect();
    if !alarms.is_empty() {
        out.notes.push(format!("The detection condition is true without a fault in {}.", quoted(alarms)));
    }
    for monitor in &out.monitors {
        if monitor.raised_by.is_empty() {
            out.notes.push(format!("Monitor `{}`: no fault of this list raises it.", monitor.name));
        }
        if !monitor.false_alarms.is_empty() {
            let variants = quoted(monitor.false_alarms.iter().map(String::as_str));
            out.notes.push(format!("Monitor `{}`: it is raised without a fault in {variants}.", monitor.name));
        }
    }
    out
}
