//! The virtual test bench: a plant with values unknown to its model, excited for maximum information in the log, or under the file's controllers.

mod closed_loop;
mod inverse;
mod plan;
mod servo;

pub use closed_loop::{bench_controller, closed_loop};

use std::sync::Arc;

use rayon::prelude::*;

use crate::study::check::model_checks::{check_matrices, reduce_diagnostics};
use crate::study::prepare::document::file_stem;
use crate::study::read::locations::no_such_name;
use crate::study::requests::bench_spec::BenchSpec;
use crate::study::requests::bench_truth::Truth;
use crate::study::{Prepared, PreparedVariant, Progress, Project};
use kardan_identify::coefficients;
use kardan_math::names::unknown_name;
use kardan_math::num::Random;
use kardan_mechanics::assemble::assemble;
use kardan_mechanics::equations::{InputKind, Measured};
use kardan_mechanics::reduce::{Kinematics, Reduced, reduce};
use kardan_model::parse::value;
use kardan_model::tables::ExcitationPlan;
use kardan_model::{Document, Setting};
use kardan_results::signal_name;
use kardan_results::{Bench, BenchPlan, Run, Series, Signal, TrueValue};
use kardan_schema::diagnostics::{Diagnostic, quoted, shortened};
use kardan_schema::entries::Entry;
use kardan_schema::file::syntax;
use kardan_schema::schema::{EntryValue, Kind, Named, Quantity, Value};
use kardan_simulate::{Recorded, Scenario, Setup, Tolerance, signal_names, simulate};
use kardan_synthesis::Law;
use plan::{MotionSequence, Planner, Refusal};
use servo::{Servo, encoders};

/// The mode of a bench.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum BenchRun {
    /// The designed excitation, executed by servo loops.
    #[default]
    Excitation,
    /// The scenario of the file under the controllers of the first variant with this one in the loop, designed on the model.
    Control(String),
}

/// Settings of a bench.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct BenchSettings {
    /// Seed, instead of the file's.
    pub seed: Option<u64>,
    /// Logs to write, with seeds from the first one on; 0 counts as 1.
    pub repetitions: usize,
    /// Plan, instead of the file's.
    pub plan: Option<String>,
    /// Text of a file with `[bench.truth]`, instead of the model's.
    pub truth: Option<Named>,
    /// The variant whose parameter values apply; the first if not given.
    pub variant: Option<String>,
    /// The mode.
    pub run: BenchRun,
}

/// Relative tolerance of the integrator on a bench: its errors stay far below the resolution of encoders.
const TOLERANCE: f64 = 1e-8;

/// Runs the virtual bench of a model file.
///
/// ```
/// use kardan::model;
/// use kardan::study;
/// let source = model::builtin("harmonic-drive-bench").unwrap().source;
/// let settings = study::BenchSettings { plan: Some("multisine".into()), ..Default::default() };
/// let bench = study::prepare_bench(&study::Project::open(source), &settings).unwrap();
/// // The parameters of the plan, and their expected errors.
/// let plan = bench.plan().unwrap();
/// assert!(plan.parameters.iter().all(|one| one.standard_error.is_some()) && plan.gain > 1.0);
/// ```
///
/// # Errors
/// All errors of the file and of the truth; the reason if no plan satisfies the limits.
pub fn bench(source: &str, settings: &BenchSettings, progress: &dyn Progress) -> Result<Bench, Vec<Diagnostic>> {
    let bench = prepare_bench(&Project::open(source), settings)?;
    let logs = bench.logs(0..settings.repetitions.max(1) as u64, progress);
    let PreparedBench { model, truth, plan, notes, .. } = bench;
    Ok(Bench { model, truth, plan, logs, notes })
}

/// A bench ready for any number of runs, from several threads.
pub struct PreparedBench {
    model: String,
    /// Names of logs, before their seed.
    label: String,
    nominal: Arc<PreparedVariant>,
    plant: Reduced,
    truth: Vec<TrueValue>,
    plan: Option<BenchPlan>,
    sequence: Option<MotionSequence>,
    motors: Vec<usize>,
    scenario: Scenario,
    columns: Vec<Column>,
    spec: BenchSpec,
    /// Whether a plan may start at any angle.
    free: bool,
    tolerance: Tolerance,
    notes: Vec<String>,
    /// Whether controllers run in continuous time, independent of their sample time.
    continuous: bool,
}

/// A column of a log and the signal of the run that it shows.
#[derive(Debug, Clone)]
struct Column {
    name: String,
    signal: String,
    /// A description other than that of the signal.
    description: Option<String>,
    noise: f64,
}

impl PreparedBench {
    /// Name of the model.
    pub fn name(&self) -> &str {
        &self.model
    }

    /// The excitation; `None` where the file's own controllers run.
    pub fn plan(&self) -> Option<&BenchPlan> {
        self.plan.as_ref()
    }

    /// Values of the plant that are unknown to the model.
    pub fn truth(&self) -> &[TrueValue] {
        &self.truth
    }

    /// The model in explicit form.
    pub fn model(&self) -> &Reduced {
        &self.nominal.reduced
    }

    /// The plant in explicit form.
    pub fn plant(&self) -> &Reduced {
        &self.plant
    }

    /// Notes for the reader.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// The name of the log of a repetition.
    pub fn log_name(&self, repetition: u64) -> String {
        format!("{}-{}", self.label, self.spec.seed.wrapping_add(repetition))
    }

    /// The logs of several repetitions, made in parallel.
    pub fn logs(&self, repetitions: std::ops::Range<u64>, progress: &dyn Progress) -> Vec<Run> {
        let numbers: Vec<u64> = repetitions.collect();
        let log = |&k: &u64| self.shown_log(k, usize::try_from(k).unwrap_or(usize::MAX), &self.log_name(k), progress);
        numbers.par_iter().map(log).collect()
    }

    /// The log of a repetition, with its progress under a number and a label.
    fn shown_log(&self, repetition: u64, number: usize, label: &str, progress: &dyn Progress) -> Run {
        progress.advance(number, label, 0.0);
        let report_fraction = &mut |fraction| {
            progress.advance(number, label, fraction);
            progress.stop()
        };
        let log = self.log_limited(repetition, progress.most_steps(), report_fraction);
        progress.advance(number, label, 1.0);
        log
    }

    /// The log of a repetition, which is that of the seed plus its number: noise and the angles of the start differ from one to the
    /// next (the latter if no spring constrains the shafts and all ratios are constant), and how long constant speeds last after their
    /// dwell; the plant and the set points do not. The same bits for the same number, on any thread.
    ///
    /// `progress` receives the completed fraction, and returns a reason to stop the run.
    pub fn log(&self, repetition: u64, progress: &mut dyn FnMut(f64) -> Option<String>) -> Run {
        self.log_limited(repetition, self.tolerance.most_steps, progress)
    }

    fn log_limited(&self, repetition: u64, most_steps: usize, progress: &mut dyn FnMut(f64) -> Option<String>) -> Run {
        let (seed, period) = (self.spec.seed.wrapping_add(repetition), self.spec.period);
        let mut scenario = Scenario { seed, ..self.scenario.clone() };
        let trajectory = self.sequence.as_ref().map(|sequence| Arc::new(sequence.trajectory(seed).0));
        if let Some(trajectory) = &trajectory {
            let (samples, rate) = (trajectory.samples(), (1.0 / period).round());
            let whole = 1.0 / rate == period;
            let time = |k: usize| if whole { k as f64 / rate } else { k as f64 * period };
            (scenario.duration, scenario.times) = (time(samples - 1), (0..samples).map(time).collect());
        }
        if self.free && trajectory.is_some() {
            let model = &self.nominal.reduced;
            let mut random = Random::named(seed, "start");
            let start: Vec<f64> = model.coordinates.iter().map(|_| std::f64::consts::TAU * random.unit()).collect();
            scenario.position = angles_at(model, &start, &self.plant);
        }
        let servo = trajectory.map(|trajectory| -> Arc<dyn Law> {
            let model = &self.nominal.reduced;
            Arc::new(Servo::new(model, &self.motors, trajectory, period, self.spec.bandwidth).0)
        });
        let laws = match &servo {
            Some(servo) => std::slice::from_ref(servo),
            None if self.continuous => &self.nominal.designed[..],
            None => &self.nominal.implemented,
        };
        let tolerance = Tolerance { most_steps, ..self.tolerance };
        let run = simulate(Setup { reduced: &self.plant, laws, scenario: &scenario }, tolerance, progress);
        let signals = self.columns.iter().filter_map(|column| {
            let found = run.series.signal(&column.signal)?;
            let mut values = found.values.clone();
            if column.noise > 0.0 {
                let mut random = Random::named(seed, &column.name);
                values.iter_mut().for_each(|x| *x += column.noise * random.normal());
            }
            let description = column.description.as_ref().unwrap_or(&found.description).clone();
            Some(Signal { name: column.name.clone(), physical: found.physical, description, values })
        });
        let signals = signals.collect();
        Run {
            name: self.log_name(repetition),
            parameters: self.nominal.model.parameters.clone(),
            series: Series { signals, time: run.series.time },
            ..run
        }
    }
}

/// Reads and checks everything, and makes the plan.
///
/// # Errors
/// As [`bench()`].
pub fn prepare_bench(project: &Project, settings: &BenchSettings) -> Result<PreparedBench, Vec<Diagnostic>> {
    prepare_excluding(project, settings, &[])
}

/// The same with a plant in which the values of these names are those of the model.
fn prepare_excluding(
    project: &Project,
    settings: &BenchSettings,
    removed: &[String],
) -> Result<PreparedBench, Vec<Diagnostic>> {
    let (document, prepared, mut out) = (project.read().0, project.prepared(), project.diagnostics().to_vec());
    let fails = |out: &Vec<Diagnostic>| out.iter().any(Diagnostic::is_error);
    if fails(&out) {
        return Err(out);
    }
    let chosen = choose(prepared, settings)?;
    let number = prepared.all().position(|variant| std::ptr::eq(variant, chosen)).expect("it is one of them");
    let nominal = Arc::clone(&prepared.variants[number]);
    let own = document.variant_settings().swap_remove(number).settings;
    let mut spec = BenchSpec::read(document, &own, &mut out);
    spec.seed = settings.seed.unwrap_or(spec.seed);
    if spec.seed.checked_add(settings.repetitions as u64).is_none() {
        let message = format!("the requested seeds from {} on exceed the largest seed", spec.seed);
        out.push(Diagnostic::error("bench::seed", message).help("begin with a smaller seed"));
    }
    if let Some(plan) = &settings.plan {
        match ExcitationPlan::of(plan) {
            Some(plan) => spec.plan = plan,
            None => {
                let names = ExcitationPlan::NAMES.iter().copied();
                out.push(no_such_name(("bench::plan", "plan"), plan, names, ""));
            }
        }
    }
    let mut notes = Vec::new();
    let truth = Truth::new(document, removed);
    let truth = true_values(truth, document, &own, &spec, settings, &mut notes, &mut out);
    let plant = if fails(&out) { None } else { true_plant(&truth, &own, &nominal.reduced, &mut out) };
    let Some(plant) = plant.filter(|_| !fails(&out)) else { return Err(out) };
    let is_motor = |k: &usize| matches!(nominal.reduced.equations.inputs[*k].value, InputKind::Motor(_));
    let motors: Vec<usize> = (0..nominal.reduced.equations.inputs.len()).filter(is_motor).collect();
    let tolerance = prepared.tolerance;
    let mut bench = PreparedBench {
        // An excitation uses no part of the scenario of a variant.
        label: match (&settings.run, &settings.variant) {
            (BenchRun::Excitation, None) => file_stem(&prepared.name),
            _ => nominal.name.clone(),
        },
        model: prepared.name.clone(),
        truth: truth.values,
        plan: None,
        sequence: None,
        scenario: nominal.scenario.clone(),
        columns: Vec::new(),
        free: Kinematics::new(&nominal.reduced).is_constant()
            && nominal.reduced.equations.springs.is_empty()
            && nominal.reduced.equations.laws.is_empty(),
        spec,
        continuous: false,
        tolerance,
        notes,
        motors,
        plant,
        nominal,
    };
    match &settings.run {
        BenchRun::Excitation => bench.excite(document, &mut out),
        BenchRun::Control(_) => bench.control(),
    }
    if !fails(&out) {
        bench.choose_columns(document, settings.run == BenchRun::Excitation, &mut out);
    }
    if fails(&out) { Err(out) } else { Ok(bench) }
}

/// The selected variant.
fn choose<'a>(prepared: &'a Prepared, settings: &BenchSettings) -> Result<&'a PreparedVariant, Vec<Diagnostic>> {
    match (&settings.variant, &settings.run) {
        (None, BenchRun::Control(name)) => with_control(prepared.variants.iter(), name),
        (name, _) => prepared.variant(name.as_deref()),
    }
}

/// The first of these variants with a controller in the loop.
fn with_control<'a>(
    mut variants: impl Iterator<Item = &'a Arc<PreparedVariant>> + Clone,
    name: &str,
) -> Result<&'a PreparedVariant, Vec<Diagnostic>> {
    let has = |variant: &&Arc<PreparedVariant>| variant.model.controls.iter().any(|control| control.name == name);
    let all = variants.clone();
    variants.find(has).map(|variant| &**variant).ok_or_else(|| {
        let mut all: Vec<&str> = all.flat_map(|v| v.model.controls.iter().map(|c| c.name.as_str())).collect();
        all.sort_unstable();
        all.dedup();
        no_such_name(("control::unknown", "controller"), name, all, "the file has no `[control.NAME]`").into()
    })
}

fn true_values(
    truth: Truth,
    document: &Document,
    own: &[Setting],
    spec: &BenchSpec,
    settings: &BenchSettings,
    notes: &mut Vec<String>,
    out: &mut Vec<Diagnostic>,
) -> Truth {
    let Some(requested_truth) = &settings.truth else {
        return match &spec.truth {
            Some(entries) => truth.with_values(document, own, entries, out),
            None => {
                notes.push(format!(
                    "The file has no true values: kardan drew each inertia, damping and friction within {} % of its value.",
                    100.0 * spec.spread
                ));
                truth.drawn(document, own, spec.spread, spec.seed)
            }
        };
    };
    let mut diagnostics = Vec::new();
    let read = value(&Kind::Overrides, "the true values", &Entry::from(requested_truth.raw()), &mut diagnostics);
    let entries = match read.map(|read| read.value) {
        Some(Value::Map(entries)) => entries,
        _ => Vec::new(),
    };
    let truth = truth.with_values(document, own, &entries, &mut diagnostics);
    out.extend(diagnostics.into_iter().map(|diagnostic| Diagnostic {
        message: format!("the given true values: {}", diagnostic.message),
        labels: Vec::new(),
        ..diagnostic
    }));
    truth
}

/// The true values that a file has in its table `[bench.truth]`.
///
/// ```
/// let truth = kardan::study::read_truth("[bench.truth]\n\"wg.damping\" = \"0.5 N m s/rad\"\n").unwrap();
/// assert_eq!(truth, [("wg.damping", "0.5 N m s/rad")].into());
/// ```
///
/// # Errors
/// Text that is not TOML, no such table, or values other than quantities in it; positions refer to this text.
pub fn read_truth(text: &str) -> Result<Named, Vec<Diagnostic>> {
    let (entries, diagnostics) = syntax(text);
    if !diagnostics.is_empty() {
        let of = |d: Diagnostic| Diagnostic { message: format!("the file with the true values: {}", d.message), ..d };
        return Err(diagnostics.into_iter().map(of).collect());
    }
    let table = entries.table("bench").and_then(|bench| bench.get("truth"));
    table.and_then(Named::read).ok_or_else(|| {
        let message = "the file with the true values has no table `[bench.truth]` of quantities";
        let help = "write `[bench.truth]` with lines such as `\"wg.damping\" = \"0.001 N m s/rad\"`";
        vec![Diagnostic::error("bench::truth", message).help(help)]
    })
}

/// True values of a bench as input of another.
pub fn truth_table(values: &[TrueValue]) -> Named {
    let one = |value: &TrueValue| {
        (value.name.clone(), Quantity::from(format!("{:?} {}", value.value, value.unit).trim_end().to_string()))
    };
    Named(values.iter().map(one).collect())
}

/// The plant in explicit form, with the coordinates of the model as far as they exist.
fn true_plant(truth: &Truth, own: &[Setting], model: &Reduced, out: &mut Vec<Diagnostic>) -> Option<Reduced> {
    let (plant, diagnostics) = truth.document.model_with(&truth.settings(own), Some(&[]));
    let mut wrong: Vec<Diagnostic> = diagnostics.into_iter().filter(Diagnostic::is_error).collect();
    let mut found = None;
    if wrong.is_empty() {
        let equations = assemble(&plant.all_coordinates, &plant.terms);
        let reduced = reduce(equations.clone(), None).map(|free| {
            let mut names = model.coordinate_names();
            let more = free.degrees_of_freedom().saturating_sub(names.len());
            let missing: Vec<String> =
                equations.coordinates.iter().filter(|name| !names.contains(name)).cloned().collect();
            // A spring that replaces a constraint frees one shaft after the other.
            for name in missing {
                if names.len() == model.degrees_of_freedom() + more {
                    break;
                }
                names.push(name);
            }
            reduce(equations, Some(&names)).unwrap_or(free)
        });
        match reduced {
            Ok(reduced) => {
                let mut massless = Vec::new();
                if check_matrices(&truth.document, &reduced, &mut wrong, &mut massless) {
                    found = Some(reduced);
                }
                wrong.retain(Diagnostic::is_error);
                wrong.append(&mut massless);
            }
            Err(error) => wrong.extend(reduce_diagnostics(&truth.document, &plant, &error)),
        }
    }
    let good = wrong.is_empty();
    out.extend(wrong.into_iter().map(|diagnostic| Diagnostic {
        message: format!("the plant with its true values: {}", diagnostic.message),
        ..diagnostic
    }));
    found.filter(|_| good)
}

impl PreparedBench {
    /// The scenario of the file, from the same angles and speeds of the shafts.
    fn control(&mut self) {
        let kinematics = Kinematics::at(&self.nominal.reduced, &self.scenario.position, &self.scenario.speed);
        let of = |values: &[f64]| self.plant.coordinates.iter().map(|&shaft| values[shaft]).collect();
        (self.scenario.position, self.scenario.speed) = (of(&kinematics.angles), of(&kinematics.speeds));
    }

    /// The plan and a scenario of the same length.
    fn excite(&mut self, document: &Document, out: &mut Vec<Diagnostic>) {
        let (model, spec) = (&self.nominal.reduced, &self.spec);
        let all = coefficients(model);
        let mut planner = Planner { reduced: model, motors: &self.motors, spec, coefficients: Vec::new() };
        let determinable = planner.determinable(&all);
        for name in &spec.parameters {
            let found: Vec<_> = all.iter().filter(|one| one.name == name.value).cloned().collect();
            if found.is_empty() {
                let names = || all.iter().map(|one| one.name.as_str());
                let help = unknown_name(&name.value, names());
                let message =
                    format!("`parameters` of `[bench]`: the model has no coefficient `{}`", shortened(&name.value));
                out.push(Diagnostic::error("name::unknown", message).at(&name.place, "unknown").help(help));
            }
            planner.coefficients.extend(found);
        }
        if out.iter().any(Diagnostic::is_error) {
            return;
        }
        match planner.plan(&all) {
            Ok((plan, sequence)) => {
                self.scenario = Scenario {
                    duration: plan.duration,
                    seed: spec.seed,
                    position: angles_at(model, &vec![0.0; model.degrees_of_freedom()], &self.plant),
                    speed: vec![0.0; self.plant.degrees_of_freedom()],
                    ..Scenario::default()
                };
                let trajectory = Arc::new(sequence.trajectory(spec.seed).0);
                let (_, complete) = Servo::new(model, &self.motors, trajectory, spec.period, spec.bandwidth);
                if !complete {
                    let note = "The encoders do not determine all coordinates: the servo loops read the exact angles.";
                    self.notes.push(note.into());
                }
                (self.plan, self.sequence) = (Some(plan), Some(sequence));
                self.tolerance.relative = self.tolerance.relative.max(TOLERANCE);
                self.tolerance.absolute = self.tolerance.absolute.max(1e-2 * TOLERANCE);
            }
            Err(refusal) => {
                let names = determinable.iter().map(|one| one.name.as_str());
                out.push(why(refusal, document, spec, &quoted(names)));
            }
        }
    }

    fn choose_columns(&mut self, document: &Document, excited: bool, out: &mut Vec<Diagnostic>) {
        let spec = &self.spec;
        let declared = signal_names(&self.plant, &self.scenario);
        let equations = &self.plant.equations;
        let angle_of = |name: &String| signal_name::Quantity::Angle.of(name);
        let torque_of = |name: &String| signal_name::Quantity::Torque.of(name);
        let readings = encoders(&self.plant).into_iter();
        let readings: Vec<(String, String)> =
            readings.map(|(sensor, shaft)| (angle_of(&equations.coordinates[shaft]), angle_of(&sensor))).collect();
        let motor = |k: usize| torque_of(&equations.inputs[k].element);
        let mut names: Vec<String> = spec.signals.iter().map(|name| name.value.clone()).collect();
        if names.is_empty() && !excited {
            names = declared.iter().map(|(name, _)| name.clone()).collect();
        }
        if names.is_empty() {
            names = readings.iter().map(|(angle, _)| angle.clone()).collect();
            if names.is_empty() {
                names = self.plant.coordinate_names().iter().map(angle_of).collect();
            }
            names.extend(self.motors.iter().map(|&k| motor(k)));
            let torque = |(_, sensor): &&(String, kardan_mechanics::equations::Sensor)| {
                !matches!(sensor.measured, Measured::Angle(_) | Measured::Speed(_))
            };
            names.extend(equations.sensors.iter().filter(torque).map(|(name, _)| torque_of(name)));
            names.dedup();
        }
        for name in names {
            let reading = readings.iter().find(|(angle, _)| excited && *angle == name);
            let signal = reading.map_or(&name, |(_, reading)| reading);
            if declared.iter().all(|(declared, _)| declared != signal) {
                let names = || declared.iter().map(|(name, _)| name.as_str());
                let help = unknown_name(&name, names());
                let place = spec.signals.iter().find(|declared| declared.value == name);
                let place = place.map_or(document.bench.place_of("signals"), |declared| &declared.place);
                let message = format!("`signals` of `[bench]`: there is no signal `{}`", shortened(&name));
                out.push(Diagnostic::error("name::unknown", message).at(place, "not a signal").help(help));
                continue;
            }
            let noisy = excited && self.motors.iter().any(|&k| motor(k) == name);
            let description = match reading {
                Some((_, reading)) => Some(format!("reading {reading}")),
                None => noisy.then(|| "torque that the drive reports".to_string()),
            };
            let noise = if noisy { spec.torque_noise } else { 0.0 };
            self.columns.push(Column { signal: signal.clone(), name, description, noise });
        }
        let names = self.columns.iter().map(|column| column.signal.clone()).collect();
        self.scenario.recorded = Some(Recorded { names, as_all: false });
    }
}

/// The coordinates of the plant at the position of the model.
fn angles_at(model: &Reduced, position: &[f64], plant: &Reduced) -> Vec<f64> {
    let kinematics = Kinematics::at_rest(model, position);
    plant.coordinates.iter().map(|&shaft| kinematics.angles[shaft]).collect()
}

/// The diagnostic of a missing plan.
fn why(refusal: Refusal, document: &Document, spec: &BenchSpec, determinable: &str) -> Diagnostic {
    let (key, message, help) = match refusal {
        Refusal::NotDriven => (
            "plan",
            "the motors cannot drive every motion of the model, so they cannot execute a plan".to_string(),
            "the bench needs a motor for each degree of freedom: make the model rigid (compliance belongs in `truth`), or add \
             motors"
                .to_string(),
        ),
        Refusal::NoLimit(shaft) => (
            "speed_limit",
            format!("the coordinate `{shaft}` has no speed limit"),
            format!("add it: `speed_limit = {{ {shaft} = \"60 rad/s\" }}`, of a mass in m/s"),
        ),
        Refusal::TooMany(looked) => (
            "levels",
            format!("the speeds of all coordinates have {looked} combinations"),
            "choose fewer levels, or sines or steps".to_string(),
        ),
        Refusal::NotEnough { candidates, looked, count } => (
            "points",
            format!(
                "of {looked} set points only {candidates} satisfy the limits of speeds and torques, and the plan needs {count}"
            ),
            "raise `levels`, lower `speed_limit`, `least_speed` or `points`, or give the motors more torque".to_string(),
        ),
        Refusal::Undetermined(mixed) if mixed.is_empty() => (
            "plan",
            "this kind of motion identifies no coefficient of the model".to_string(),
            "give the model an inertia, damping or friction to identify, or choose another plan".to_string(),
        ),
        Refusal::Undetermined(mixed) => (
            "parameters",
            format!("no log of this kind of motion can distinguish {}", quoted(mixed.iter().map(String::as_str))),
            if determinable.is_empty() { "choose another plan".into() } else { format!("this kind of motion can identify {determinable}") },
        ),
        Refusal::Singular => (
            "points",
            "so few points do not determine all parameters to identify".to_string(),
            "raise `points`, list more `speeds`, or request fewer parameters".to_string(),
        ),
        Refusal::TooLong(time) => (
            "duration",
            format!("the plan takes {time:.1} s or more, but the limit is {} s", spec.duration),
            "choose fewer points, a shorter dwell, or a longer duration".to_string(),
        ),
    };
    Diagnostic::error("bench::plan", format!("the bench has no plan: {message}"))
        .at(document.bench.place_of(key), "")
        .help(help)
}
