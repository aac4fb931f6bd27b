//! Every reader and every command of kardan under bytes that nobody meant for it.
//!
//! A target takes any bytes and must come back: no panic, no overflow, no endless loop, no memory without bound. Where more is
//! known than that (two readers of one number, a file written and read again), it is asserted too. Work is bounded by the size
//! of what is asked, never by a clock, so that a target does the same on every machine.
//!
//! `fuzz/run` drives the targets with libFuzzer; the test `the_stored_corpus_holds` sends the stored corpus through them.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use kardan::diagnostics::{Diagnostic, plain};
use kardan::results::{Plot, Run, Study};
use kardan::simulate::{Setup, Tolerance, simulate};
use kardan::study::{self, EquationsForm, Progress, Silent};
use kardan::tables::read::{Block, Bytes, CsvOptions, LogError, in_memory, open};
use kardan::{export, model, units};
use kardan_report as report;

/// A target: its name and what it does with bytes.
pub type Target = (&'static str, fn(&[u8]));

/// All targets: first the readers, then the commands.
pub const TARGETS: [Target; 15] = [
    ("number", number),
    ("toml", toml),
    ("state_space", state_space),
    ("csv", csv),
    ("mat", mat),
    ("mdf", mdf),
    ("parquet", parquet),
    ("check", check),
    ("equations", equations),
    ("run", run),
    ("analyze", analyze),
    ("design", design),
    ("identify", identify),
    ("bench", bench),
    ("safety", safety),
];

/// The longest model that a command is asked for, bytes: beyond it mutations do more in less time elsewhere.
const MODEL_LIMIT: usize = 6000;
/// Tables of elements and controllers in it.
const MOST_ELEMENTS: usize = 14;
/// Variants in it.
const MOST_RUNS: usize = 3;
/// Steps of the integrator in one run.
const MOST_STEPS: usize = 1000;
/// Output rows of one run.
const MOST_ROWS: usize = 4000;
/// Rows of a table of faults.
const MOST_TABLE_ROWS: usize = 12;
/// Rows read of one log.
const MOST_LOG_ROWS: usize = 4_000_000;
/// What stands between a model and a log in the bytes of `identify`.
pub const BETWEEN: &str = "\n# ---- log ----\n";

fn text(bytes: &[u8]) -> Option<&str> {
    std::str::from_utf8(bytes).ok()
}

/// Every mistake can be printed with its place.
fn reported(source: &str, diagnostics: &[Diagnostic]) {
    let text = plain(source, diagnostics);
    assert!(diagnostics.iter().all(|d| !d.message.is_empty()), "a mistake without words: {text}");
}

/// Numbers, quantities, lists, poles, tolerances.
pub fn number(bytes: &[u8]) {
    let Some(text) = text(bytes) else { return };
    let quantity = units::parse_quantity(text);
    if let Ok((value, dimension)) = &quantity {
        assert!(value.to_f64().is_finite(), "{text:?} is no finite number");
        // A value in the SI unit of its dimension is the value again.
        let again = units::parse_quantity(&format!("{:e} {}", value.to_f64(), dimension.si()));
        if let Ok((again, same)) = again {
            assert_eq!((again.to_f64(), same), (value.to_f64(), *dimension), "{text:?}");
        }
    }
    if let (Ok(number), Ok((value, _))) = (units::parse_number(text), &quantity) {
        assert_eq!(number, *value, "{text:?} is two numbers");
    }
    // What both read is one number, rounded alike.
    if let (Ok(number), Ok(float)) = (units::parse_number(text), text.trim().parse::<f64>()) {
        assert_eq!(number.to_f64(), float, "{text:?}");
    }
    let _ = units::parse_quantity_list(text);
    let _ = units::parse_poles(text);
    let _ = units::parse_tolerated(text);
}

/// The reader of model files.
pub fn toml(bytes: &[u8]) {
    let Some(source) = text(bytes) else { return };
    let (document, out) = model::read(source);
    reported(source, &out);
    if document.runs() <= MOST_RUNS {
        for variant in document.variant_settings() {
            let (_, out) = document.model_with(&variant.settings, variant.controls.as_deref());
            reported(source, &out);
        }
    }
}

/// State spaces in JSON and MAT files.
pub fn state_space(bytes: &[u8]) {
    match model::read_state_space(bytes) {
        Ok(model::StateSpace { system, .. }) => {
            let n = system.states.len();
            assert_eq!((system.a.rows(), system.a.columns(), system.b.rows()), (n, n, n));
            assert_eq!((system.c.rows(), system.c.columns()), (system.outputs.len(), n));
        }
        Err(out) => {
            assert!(!out.is_empty());
            reported(text(bytes).unwrap_or_default(), &out);
        }
    }
}

fn read_log(bytes: Arc<dyn Bytes>, options: &CsvOptions) -> Result<(), LogError> {
    let mut log = open(bytes, options)?;
    let groups = log.groups().to_vec();
    assert!(!groups.is_empty() && groups.iter().all(|group| !group.channels.is_empty()), "a log without channels");
    let all: Vec<(usize, usize)> =
        groups.iter().enumerate().flat_map(|(g, group)| (0..group.channels.len()).map(move |c| (g, c))).collect();
    // A few of very many channels: each may be as long as the file says.
    let wanted = &all[..all.len().min(64)];
    log.choose(wanted)?;
    let (mut block, mut rows, mut errors) = (Block::default(), 0, 0);
    while rows < MOST_LOG_ROWS {
        match log.next(&mut block) {
            Ok(true) => {
                assert!(block.rows > 0 && block.rows <= kardan::tables::read::BLOCK_ROWS);
                assert!(block.columns.iter().all(|column| column.len() == block.rows), "columns of two lengths");
                rows += block.rows;
            }
            Ok(false) => break,
            Err(error) => {
                assert!(!error.to_string().is_empty());
                errors += 1;
                assert!(errors < 10_000, "errors without end: {error}");
            }
        }
    }
    drop(log.notes());
    Ok(())
}

fn log(bytes: &[u8], options: &CsvOptions) {
    if let Err(error) = read_log(in_memory(bytes), options) {
        assert!(!error.to_string().is_empty());
    }
}

/// Logs as text; one cell is read as the standard library reads it.
pub fn csv(bytes: &[u8]) {
    log(bytes, &CsvOptions::default());
    let options =
        CsvOptions { delimiter: Some(b';'), decimal_comma: Some(true), first_row: Some(2), ..CsvOptions::default() };
    log(bytes, &options);
    let cell = text(bytes).filter(|text| text.len() <= 40 && text.bytes().all(|c| b"0123456789.eE+-".contains(&c)));
    if let Some(expected) = cell.and_then(|text| text.parse::<f64>().ok()).filter(|x| x.is_finite()) {
        let whole = format!("t,x\n0,{0}\n1,{0}\n2,{0}\n", cell.unwrap_or_default());
        let options = CsvOptions {
            delimiter: Some(b','),
            decimal_comma: Some(false),
            names_row: Some(1),
            units_row: None,
            first_row: Some(2),
        };
        let Ok(mut log) = open(in_memory(whole.into_bytes()), &options) else { return };
        let mut block = Block::default();
        if log.choose(&[(0, 1)]).is_ok() && log.next(&mut block) == Ok(true) {
            assert!(
                block.columns[0].iter().all(|x| *x == expected || x.is_nan()),
                "{cell:?} is {:?}",
                block.columns[0]
            );
        }
    }
}

/// MAT files of version 5, as logs and as state spaces.
pub fn mat(bytes: &[u8]) {
    let mut whole = bytes.to_vec();
    if whole.len() >= 128 && !whole.starts_with(b"MATLAB") {
        whole[124..128].copy_from_slice(b"\0\x01IM");
    }
    log(&whole, &CsvOptions::default());
    state_space(&whole);
}

/// ASAM MDF 4.
pub fn mdf(bytes: &[u8]) {
    log(bytes, &CsvOptions::default());
}

/// Parquet.
pub fn parquet(bytes: &[u8]) {
    log(bytes, &CsvOptions::default());
}

/// A model of a size that commands answer at once; whether it is right is left open.
fn small(bytes: &[u8]) -> Option<&str> {
    let source = text(bytes).filter(|source| source.len() <= MODEL_LIMIT)?;
    let (document, _) = model::read(source);
    (document.elements.len() + document.controls.len() <= MOST_ELEMENTS && document.runs() <= MOST_RUNS)
        .then_some(source)
}

/// `kardan check`.
pub fn check(bytes: &[u8]) {
    if let Some(source) = small(bytes) {
        reported(source, &study::check(source));
    }
}

/// `kardan equations`.
pub fn equations(bytes: &[u8]) {
    let Some(source) = small(bytes) else { return };
    for form in [EquationsForm::Text, EquationsForm::Latex] {
        match study::equations(source, form) {
            Ok((text, out)) => {
                assert!(!text.is_empty());
                reported(source, &out);
            }
            Err(out) => reported(source, &out),
        }
    }
}

/// A page in every way it can be shown.
fn shown(page: &report::Page) -> [String; 3] {
    [page.html(), page.text("fuzz"), page.markdown()]
}

/// `kardan run`: the runs with few steps, every format, the report.
pub fn run(bytes: &[u8]) {
    let Some(source) = small(bytes) else { return };
    let (prepared, out) = study::prepare(source);
    reported(source, &out);
    if out.iter().any(|d| d.severity == kardan::diagnostics::Severity::Error) {
        return;
    }
    let tolerance = Tolerance { most_steps: MOST_STEPS, ..prepared.tolerance };
    let mut runs = Vec::new();
    for variant in &prepared.variants {
        if variant.scenario.times.len() > MOST_ROWS {
            return;
        }
        let setup = Setup { reduced: &variant.reduced, laws: &variant.implemented, scenario: &variant.scenario };
        let result = simulate(setup, tolerance, &mut |_| None);
        let parameters = variant.model.parameters.clone();
        let run = Run { name: variant.name.clone(), parameters, ..result };
        let rows = run.series.time.len();
        assert!(run.series.signals.iter().all(|signal| signal.values.len() == rows), "columns of two lengths");
        // What is written comes back.
        for bytes in [
            Some(export::csv(&run)),
            export::parquet(&prepared.name, &run).ok(),
            export::mat(&run.series),
            Some(export::mdf(&[(&run.name, &run.series)])),
        ] {
            if let (Some(bytes), true) = (bytes, rows > 2) {
                let read = read_log(in_memory(bytes), &CsvOptions::default());
                assert_eq!(read, Ok(()), "what was written cannot be read");
            }
        }
        runs.push(run);
    }
    let plots: Vec<Plot> = prepared.plots.clone();
    let study = Study { runs, plots, ..Study::default() };
    drop((report::plots(&study), shown(&report::study(&study)), export::json(&study, &export::Files::default())));
}

/// `kardan analyze`, of a model or of plain matrices.
pub fn analyze(bytes: &[u8]) {
    let settings =
        study::AnalyzeSettings { certify: !bytes.len().is_multiple_of(2), ..study::AnalyzeSettings::default() };
    let found = if bytes.starts_with(b"{") {
        // Few states: exact numbers of any length stand in the file.
        match model::read_state_space(bytes) {
            Ok(found) if found.system.states.len() > 5 => return,
            _ => study::analyze_state_space(bytes, &settings, &Silent),
        }
    } else {
        let Some(source) = small(bytes) else { return };
        study::analyze(source, &settings, &Silent)
    };
    match found {
        Ok(analysis) => drop((export::analysis_json(&analysis), shown(&report::analysis(&analysis)))),
        Err(out) => reported(text(bytes).unwrap_or_default(), &out),
    }
}

/// `kardan design`, without its runs.
pub fn design(bytes: &[u8]) {
    let Some(source) = small(bytes) else { return };
    let settings = study::DesignSettings { force: !bytes.len().is_multiple_of(2), ..study::DesignSettings::default() };
    match study::design(source, &settings, &Silent) {
        Ok(design) => {
            drop((export::design_json(&design), export::controller_json(&design), shown(&report::design(&design))));
        }
        Err(out) => reported(source, &out),
    }
}

/// `kardan identify`: a model, [`BETWEEN`], a log.
pub fn identify(bytes: &[u8]) {
    let at = bytes.windows(BETWEEN.len()).position(|window| window == BETWEEN.as_bytes());
    let Some((source, log)) = at.map(|at| (&bytes[..at], &bytes[at + BETWEEN.len()..])) else { return };
    let Some(source) = small(source) else { return };
    let compare = log.len().is_multiple_of(5);
    let method = ["steady", "dynamic"].get(log.len() % 3).map(ToString::to_string);
    let settings = study::IdentifySettings { compare, method, ..study::IdentifySettings::default() };
    let files = vec![study::LogFile { name: "log".into(), bytes: in_memory(log) }];
    match study::identify(source, files, &settings, &Silent) {
        Ok(found) => {
            drop((export::identification_json(&found), shown(&report::identification(&found))));
            match study::write_values(source, &found) {
                Ok((write_values, _)) => drop(model::read(&write_values)),
                Err(out) => reported(source, &out),
            }
        }
        Err(out) => reported(source, &out),
    }
}

/// `kardan bench`: the plan; its log where that is short.
pub fn bench(bytes: &[u8]) {
    let Some(source) = small(bytes) else { return };
    match study::prepare_bench(&study::Project::open(source), &study::BenchSettings::default()) {
        Ok(bench) => {
            drop(export::truth_toml(bench.truth()));
        }
        Err(out) => reported(source, &out),
    }
}

/// Ends a table of runs after so many rows, whatever time they took, and each run after few steps.
struct FewRows(AtomicUsize);

impl Progress for FewRows {
    fn advance(&self, _: usize, _: &str, _: f64) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }

    fn stop(&self) -> Option<String> {
        (self.0.load(Ordering::Relaxed) >= MOST_TABLE_ROWS).then(|| "enough rows".into())
    }

    fn most_steps(&self) -> usize {
        MOST_STEPS
    }
}

/// `kardan safety`: the first rows of its table, every format.
pub fn safety(bytes: &[u8]) {
    let Some(source) = small(bytes) else { return };
    let project = study::Project::open(source);
    if project.prepared().variants.iter().any(|variant| variant.scenario.times.len() > MOST_ROWS) {
        return;
    }
    let settings = study::SafetySettings { origin: "fuzz.toml".into(), ..study::SafetySettings::default() };
    match project.safety(&settings, &FewRows(AtomicUsize::new(0))) {
        Ok(table) => {
            assert!(table.rows.iter().all(|row| row.command.starts_with("kardan run ")), "a row without its command");
            drop((export::safety_json(&table), export::safety_csv(&table), shown(&report::safety(&table))));
        }
        Err(out) => reported(source, &out),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    /// The stored corpus of every target, findings of the past among it, goes through the target.
    #[test]
    fn the_stored_corpus_holds() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let lines: Vec<Vec<&str>> =
            include_str!("../targets").lines().map(|line| line.split_whitespace().collect()).collect();
        let listed: Vec<&str> = lines.iter().map(|line| line[0]).collect();
        assert_eq!(listed, TARGETS.map(|(name, _)| name), "fuzz/targets lists other targets than the code");
        for (line, (name, target)) in lines.iter().zip(TARGETS) {
            let longest: u64 = line[1].parse().expect("bytes");
            let mut sent = 0;
            for folder in &line[2..] {
                for file in std::fs::read_dir(root.join(folder)).expect(folder) {
                    let file = file.expect(folder);
                    // Models twice the size would take longer than all others.
                    if file.file_type().is_ok_and(|kind| kind.is_file())
                        && file.metadata().is_ok_and(|data| data.len() <= longest)
                    {
                        target(&std::fs::read(file.path()).expect(name));
                        sent += 1;
                    }
                }
            }
            assert!(sent > 1, "{name} has no corpus");
        }
    }
}
