//! Parameters from measured logs: what the file asks for, the logs read, the samples fitted, and what was found said.

mod asked;
mod channels;
mod reading;
mod told;

use std::sync::Arc;
use std::sync::atomic::Ordering;

use asked::{Asked, CandidateSpec, asked, coefficients, extra_columns, with_terms};
use channels::{OpenLog, Quantity, log_error, open_log, quantity_of, recordings};
use reading::{Counted, Recording, read as read_logs, usual_window};

use super::Progress;
use super::prepare::is_error;
use crate::assemble::{CoefficientKind as Kind, Equations, assemble};
use crate::diagnostics::{Diagnostic, nearest, quoted};
use crate::equations::Term;
use crate::identify::{
    Coefficient, Excitation, Extra, FitOptions, Motion, Reading, Regressor, Samples, Steadiness, Variances, Where,
    cross_validate, fit, steady_segments, undetermined,
};
use crate::log::Bytes;
use crate::model::{Document, Model, Setting, read};
use crate::num::{Matrix, Rational, dot, echelon, rational_to_f64};
use crate::reduce::{Kinematics, Reduced, linearise, reduce};
use crate::results::{Candidate, Identification, LogRead, WindowCount};
use crate::units::Exact;

/// A log to be read.
pub struct LogFile {
    /// What to call it.
    pub name: String,
    /// What is in it.
    pub bytes: Arc<dyn Bytes>,
}

/// How parameters are identified; what is left out is as the model file says.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct IdentifySettings {
    /// Variant of the model; the first if not given.
    pub variant: Option<String>,
    /// What is to be found.
    pub parameters: Vec<String>,
    /// `steady` or `dynamic`.
    pub method: Option<String>,
    /// Width of the windows, s.
    pub window: Option<f64>,
    /// `squares`, `huber` or `bisquare`.
    pub loss: Option<String>,
    /// Confidence of the intervals.
    pub confidence: Option<f64>,
    /// Whether candidates are compared.
    pub compare: bool,
}

/// Noise that any sensor has, as a part of its largest reading.
const FLOOR: f64 = 1e-7;
/// Steady segments are taken unasked where they have so many rows for each parameter, and at least this part of the windows.
const PLENTY: usize = 3;
const RARE: usize = 5;
/// Folds of the cross-validation.
const FOLDS: usize = 5;
/// Blocks of windows that stay together in it, for each fold.
const BLOCKS: usize = 20;

/// A plant whose motion was measured, ready for rows.
struct Plant {
    reduced: Reduced,
    model: Model,
    /// Places of the coordinates among the slots: angle, speed.
    sensors: Vec<(Option<usize>, Option<usize>)>,
    /// Places of the inputs among the slots.
    torques: Vec<Option<usize>>,
    /// Inputs that nobody measured.
    unmeasured: Vec<usize>,
    /// Step of the sensor of each slot, rad.
    steps: Vec<Option<f64>>,
}

/// What is fitted: columns and what they mean.
struct Columns {
    asked: Vec<Coefficient>,
    /// Those of them that are columns; each with what else enters its value: `(number, factor)`.
    kept: Vec<(usize, Vec<(usize, f64)>)>,
    structural: Vec<Vec<Rational>>,
    extras: Vec<Extra>,
}

/// Identifies parameters of a model from logs.
///
/// The rows are those of the torque balance at the middle of windows ([`crate::identify::Regressor`],
/// [`crate::identify::Windows`]), or their means over segments of constant speed \[diss. 6.1.4\]; see [`crate::identify::fit`].
///
/// ```
/// use kardan::{log::in_memory, study};
/// let source = "[shaft.a]\ninertia = \"1 kg m^2\"\ndamping = \"1 N m s/rad\"\n[motor.m]\nshaft = \"a\"\n";
/// // Torques of 2 N m s/rad times the speed.
/// let mut log = String::from("time,a.w,m.tau\ns,rad/s,N m\n");
/// for k in 0..4000 {
///     let speed = f64::from(1 + k / 500);
///     log += &format!("{},{speed},{}\n", 0.001 * f64::from(k), 2.0 * speed + 1e-3 * f64::from(k % 7));
/// }
/// let files = vec![study::LogFile { name: "log.csv".into(), bytes: in_memory(log.into_bytes()) }];
/// let found = study::identify(source, files, &study::IdentifySettings::default(), &study::Silent).unwrap();
/// assert!((found.parameters[0].value - 2.0).abs() < 1e-3);
/// ```
///
/// # Errors
/// Mistakes of the file and of what is asked for; logs that cannot be read, or hold too little.
pub fn identify(
    source: &str,
    files: Vec<LogFile>,
    settings: &IdentifySettings,
    progress: &dyn Progress,
) -> Result<Identification, Vec<Diagnostic>> {
    let (document, mut out) = read(source);
    out.retain(is_error);
    if !out.is_empty() {
        return Err(out);
    }
    if files.is_empty() {
        return Err(vec![
            Diagnostic::error("log::none", "there is no log to read")
                .help("name one or more behind the model: `kardan identify my.toml bench.mf4`"),
        ]);
    }
    let set = variant(&document, settings.variant.as_deref())?;
    let (model, mistakes) = document.model_with(&set, Some(&[]));
    out.extend(mistakes.into_iter().filter(is_error));
    let asked = asked(&document, &model, &set, settings, &mut out);
    if !out.is_empty() {
        return Err(out);
    }
    // Logs: opened, wired.
    let mut experiments: Vec<Vec<OpenLog>> = Vec::new();
    let mut total = 0;
    let mut counters = Vec::new();
    for group in recordings(&document, files)? {
        let mut opened = Vec::new();
        for file in group {
            let (counted, count) = Counted::new(Arc::clone(&file.bytes));
            if let Ok(mut bytes) = file.bytes.open() {
                total += std::io::Seek::seek(&mut *bytes, std::io::SeekFrom::End(0)).unwrap_or(0);
            }
            let file = LogFile { name: file.name, bytes: counted };
            opened.extend(open_log(&document, &model, &file, &mut out));
            counters.push(count);
        }
        experiments.push(opened);
    }
    if !out.is_empty() {
        return Err(out);
    }
    let slots = slots(&experiments)?;
    let plant = plant(&document, &set, &asked, &slots, &model)?;
    let columns = |excitation: Excitation, asked: &Asked| columns(&plant, asked, excitation);
    let failed = |(name, error): (String, _)| vec![log_error(&name, &error)];
    let window = match asked.window {
        Some(window) => window,
        None => {
            let mut widest = 0.0_f64;
            for logs in &mut experiments {
                widest = widest.max(usual_window(logs).map_err(failed)?);
            }
            widest
        }
    };
    let part = || {
        let read: u64 = counters.iter().map(|count| count.load(Ordering::Relaxed)).sum();
        if total > 0 { (read as f64 / total as f64).min(0.999) } else { 0.0 }
    };
    let mut recorded = Vec::new();
    for logs in experiments {
        let heard = |part: f64| progress.advance(0, "logs", part);
        recorded.push(read_logs(logs, &slots, window, &part, &heard).map_err(failed)?);
    }
    progress.advance(0, "logs", 1.0);

    // Rows, once with all columns of everything asked for.
    let kinds: Vec<Kind> = asked.wanted.iter().map(|one| one.keys[0].1).collect();
    let inertial = kinds.iter().any(|kind| matches!(kind, Kind::Inertia | Kind::Stiffness));
    let wish = asked.method.clone();
    let steady_first = wish.as_deref() == Some("steady") || (wish.is_none() && !inertial);
    let mut method = if steady_first { "steady" } else { "dynamic" };
    let mut excitation = if steady_first { Excitation::Steady } else { Excitation::Free };
    let mut found = columns(excitation, &asked);
    let mut notes = Vec::new();
    let mut built = rows(&plant, &asked, &found, &recorded, &slots, window);
    let mut samples = if steady_first { settled(&built, &asked, window) } else { built.samples.clone() };
    let needed = found.kept.len() + asked.extras.len() * 2;
    let enough = |samples: &Samples| samples.len() * samples.rows > needed;
    let plenty = samples.len() * samples.rows >= PLENTY * needed
        && samples.windows.iter().sum::<usize>() >= built.samples.len() / RARE;
    if steady_first && wish.is_none() && !plenty && enough(&built.samples) {
        notes.push(format!(
            "the logs have {} segments of constant speed, few for {needed} parameters: everything is used, with filtered \
             derivatives (`--method steady` takes the segments alone)",
            samples.len()
        ));
        (method, excitation) = ("dynamic", Excitation::Free);
        found = columns(excitation, &asked);
        built = rows(&plant, &asked, &found, &recorded, &slots, window);
        samples = built.samples.clone();
    }
    let count = WindowCount {
        moving: if method == "steady" { built.samples.len() - samples.windows.iter().sum::<usize>() } else { 0 },
        used: samples.windows.iter().sum(),
        ..built.count
    };
    if found.kept.is_empty() && asked.extras.is_empty() {
        let message = "none of the parameters asked for can be told by a log of this kind";
        let help = match excitation {
            Excitation::Steady => "at constant speed nothing accelerates: use `--method dynamic`",
            Excitation::Free => "they do not enter the torque balance of what moves",
        };
        return Err(vec![Diagnostic::error("identify::structure", message).help(help)]);
    }
    if !enough(&samples) {
        return Err(vec![too_little(&samples, needed, &count, method, window)]);
    }
    let options = fit_options(&asked, &found, method);
    let chosen: Vec<usize> = (0..samples.len()).collect();
    let Some(best) = fit(&samples, &chosen, &options) else {
        return Err(vec![
            Diagnostic::error("identify::numbers", "the logs hold numbers too large to compute with")
                .help("check units and factors of the channels"),
        ]);
    };
    let folds = folds(&samples, method == "steady");
    let unseen = cross_validate(&samples, &chosen, &folds, &options);
    let candidates = if settings.compare {
        compare(&plant, &asked, &document, &set, &recorded, &slots, (window, method, &built), progress)?
    } else {
        Vec::new()
    };
    let story = told::Story {
        plant: &plant,
        asked: &asked,
        columns: &found,
        samples: &samples,
        all: &built.samples,
        fit: &best,
        unseen: unseen.as_deref(),
        method,
        window,
        acceleration_noise: &built.noise,
    };
    let mut out = told::told(&story);
    out.logs = recorded.into_iter().flat_map(|recording| logs_told(recording, &slots)).collect();
    out.windows = count;
    out.candidates = candidates;
    out.notes.splice(0..0, notes);
    Ok(out)
}

/// The settings of a variant.
fn variant(document: &Document, name: Option<&str>) -> Result<Vec<Setting>, Vec<Diagnostic>> {
    let all = document.variant_settings();
    let Some(name) = name else { return Ok(all.into_iter().next().map(|one| one.settings).unwrap_or_default()) };
    let names: Vec<String> = all.iter().map(|one| one.name.clone()).collect();
    match all.into_iter().find(|one| one.name == name) {
        Some(found) => Ok(found.settings),
        None => {
            let help = match nearest(name, names.iter().map(String::as_str)) {
                Some(near) => format!("did you mean `{near}`?"),
                None if names.iter().all(String::is_empty) => "the model has no variants".into(),
                None => format!("there are {}", quoted(names.iter().map(String::as_str))),
            };
            let message = format!("there is no variant `{name}`");
            Err(vec![Diagnostic::error("variant::unknown", message).help(help)])
        }
    }
}

/// The quantities that the logs hold: the same in all that were recorded apart, or those that all have.
fn slots(experiments: &[Vec<OpenLog>]) -> Result<Vec<Quantity>, Vec<Diagnostic>> {
    let mut of: Vec<Vec<Quantity>> = Vec::new();
    for logs in experiments {
        let mut own: Vec<Quantity> = Vec::new();
        for one in logs.iter().flat_map(|log| &log.wired) {
            if own.contains(&one.quantity) {
                let message = format!("`{}` is in the logs twice", one.quantity.signal());
                return Err(vec![
                    Diagnostic::error("log::twice", message)
                        .help("keep one channel for each signal in the `[log.NAME]` tables"),
                ]);
            }
            own.push(one.quantity.clone());
        }
        of.push(own);
    }
    let first = of.first().cloned().unwrap_or_default();
    for (k, own) in of.iter().enumerate().skip(1) {
        let missing: Vec<String> = first.iter().filter(|one| !own.contains(one)).map(Quantity::signal).collect();
        let more: Vec<String> = own.iter().filter(|one| !first.contains(one)).map(Quantity::signal).collect();
        if !missing.is_empty() || !more.is_empty() {
            let name = experiments[k].first().map_or("", |log| log.name.as_str());
            let message = format!("`{name}` holds other signals than the first log");
            let help = format!(
                "it lacks {}, it has {} besides; logs of one identification hold the same",
                if missing.is_empty() { "nothing".into() } else { quoted(missing.iter().map(String::as_str)) },
                if more.is_empty() { "nothing".into() } else { quoted(more.iter().map(String::as_str)) }
            );
            return Err(vec![Diagnostic::error("log::differ", message).help(help)]);
        }
    }
    Ok(first)
}

/// The model with terms for all that is asked for, in coordinates that were measured.
fn plant(
    document: &Document,
    set: &[Setting],
    asked: &Asked,
    slots: &[Quantity],
    plain: &Model,
) -> Result<Plant, Vec<Diagnostic>> {
    let (document, set) = with_terms(document, set, &asked.wanted, &asked.declared);
    let (model, mistakes) = document.model_with(&set, Some(&[]));
    let mistakes: Vec<_> = mistakes.into_iter().filter(is_error).collect();
    if !mistakes.is_empty() {
        return Err(mistakes);
    }
    let wrong = |message: String, help: String| vec![Diagnostic::error("identify::motion", message).help(help)];
    let equations = assemble(&model.shafts, &model.terms);
    let failed = |error: &dyn std::fmt::Display| {
        wrong(format!("the model cannot be reduced: {error}"), "`kardan check` says more".into())
    };
    let free = reduce(equations.clone(), None).map_err(|error| failed(&error))?;
    let mut measured: Vec<String> = Vec::new();
    for slot in slots {
        if let Quantity::Angle(shaft) | Quantity::Speed(shaft) = slot
            && !measured.contains(shaft)
        {
            measured.push(shaft.clone());
        }
    }
    // The coordinates of the file first, where they were measured.
    let preferred: Vec<String> = model.coordinates.clone().unwrap_or_default();
    measured.sort_by_key(|shaft| preferred.iter().position(|name| name == shaft).unwrap_or(usize::MAX));
    let basis = linearise(&free, &vec![0.0; free.freedoms()]).basis;
    let rows: Vec<usize> = measured.iter().filter_map(|shaft| free.shaft(shaft)).collect();
    let transposed = Matrix::from_fn(basis.columns(), rows.len(), |i, j| basis[(rows[j], i)].clone());
    let pivots = echelon(&transposed, &(0..rows.len()).collect::<Vec<_>>()).pivots;
    if pivots.len() < free.freedoms() {
        let others: Vec<&str> = free
            .equations
            .shafts
            .iter()
            .map(String::as_str)
            .filter(|shaft| !measured.iter().any(|m| m == shaft))
            .collect();
        let message =
            format!("the model has {} degrees of freedom, and the logs tell {} of them", free.freedoms(), pivots.len());
        let help = if measured.is_empty() {
            "no angle and no speed of a shaft is in the logs; say in `[log.NAME]` which column is which".to_string()
        } else {
            format!(
                "measured are {}; log the motion of one of {} too",
                quoted(measured.iter().map(String::as_str)),
                quoted(others.into_iter())
            )
        };
        return Err(wrong(message, help));
    }
    let coordinates: Vec<String> = pivots.iter().map(|&k| measured[k].clone()).collect();
    let reduced = reduce(equations, Some(&coordinates)).map_err(|error| failed(&error))?;
    let names = reduced.coordinate_names();
    let place = |quantity: &Quantity| slots.iter().position(|slot| slot == quantity);
    let sensors: Vec<_> = names
        .iter()
        .map(|shaft| (place(&Quantity::Angle(shaft.clone())), place(&Quantity::Speed(shaft.clone()))))
        .collect();
    let position_matters = !Kinematics::new(&reduced).is_constant() || !reduced.equations.springs.is_empty();
    let blind: Vec<&str> =
        names.iter().zip(&sensors).filter(|(_, (angle, _))| angle.is_none()).map(|(name, _)| name.as_str()).collect();
    if position_matters && !blind.is_empty() {
        return Err(wrong(
            format!(
                "the torques depend on angles, but of {} only the speed is in the logs",
                quoted(blind.iter().copied())
            ),
            "log the angles too: springs and universal joints need them".into(),
        ));
    }
    let inputs = &reduced.equations.inputs;
    let torques: Vec<_> = inputs.iter().map(|input| place(&Quantity::Torque(input.element.clone()))).collect();
    let unmeasured: Vec<usize> =
        (0..inputs.len()).filter(|&k| torques[k].is_none() && !asked.absent.contains(&inputs[k].element)).collect();
    if torques.iter().all(Option::is_none) {
        let names = quoted(inputs.iter().map(|input| input.element.as_str()));
        return Err(wrong(
            "no torque of an input is in the logs: without one only ratios of parameters could be told".into(),
            format!("log the torque of one of {names}"),
        ));
    }
    let steps = slots
        .iter()
        .map(|slot| {
            plain.terms.iter().filter(|named| matches!(named.term, Term::Output(_))).find_map(|named| {
                let (quantity, step) = quantity_of(&named.element, plain)?;
                (quantity == *slot).then_some(step).flatten()
            })
        })
        .collect();
    let out = Plant { reduced, model, sensors, torques, unmeasured, steps };
    let regressor = Regressor::new(&out.reduced, &[], &out.unmeasured, 0.0);
    if regressor.rows() == 0 {
        let names: Vec<&str> =
            out.unmeasured.iter().map(|&k| out.reduced.equations.inputs[k].element.as_str()).collect();
        return Err(wrong(
            format!("nothing is left to compare: the torques of {} are not in the logs", quoted(names.iter().copied())),
            "log them, or name those that did nothing under `absent` in `[identification]`".into(),
        ));
    }
    Ok(out)
}

/// The columns for a kind of excitation: what is dependent by structure is left out.
fn columns(plant: &Plant, asked: &Asked, excitation: Excitation) -> Columns {
    let all = coefficients(&plant.reduced.equations, &asked.wanted);
    let structural = undetermined(&plant.reduced, &all, excitation);
    // Of each dependent combination the last parameter is the free one.
    let free: Vec<usize> = structural
        .iter()
        .map(|row| (0..row.len()).rev().find(|&k| row[k] != Rational::ZERO).expect("a combination is not zero"))
        .collect();
    let kept = (0..all.len())
        .filter(|k| !free.contains(k))
        .map(|k| {
            let with = structural.iter().zip(&free).filter_map(|(row, &f)| {
                let factor = -rational_to_f64(&row[k]) / rational_to_f64(&row[f]);
                (factor != 0.0).then_some((f, factor))
            });
            (k, with.collect())
        })
        .collect();
    Columns { kept, structural, extras: extra_columns(&plant.reduced.equations, &asked.extras), asked: all }
}

/// Rows of all windows.
struct Built {
    samples: Samples,
    count: WindowCount,
    /// Standard deviations of the accelerations of the coordinates, rad/s².
    noise: Vec<f64>,
}

/// Rows of the torque balance in every window that tells one.
fn rows(
    plant: &Plant,
    asked: &Asked,
    columns: &Columns,
    recorded: &[Recording],
    slots: &[Quantity],
    window: f64,
) -> Built {
    let mut reduced = plant.reduced.clone();
    // What enters a combination is found with it, not known.
    for &(free, _) in columns.kept.iter().flat_map(|(_, with)| with) {
        silence(&mut reduced.equations, &columns.asked[free]);
    }
    let reduced = &reduced;
    let (r, m) = (reduced.freedoms(), reduced.equations.inputs.len());
    let wanted: Vec<Coefficient> = columns.kept.iter().map(|(k, _)| columns.asked[*k].clone()).collect();
    // Noise of a sample in each slot, over all recordings; an encoder has at least that of its step, any sensor a little.
    let noise: Vec<f64> = (0..slots.len())
        .map(|slot| {
            let seen = recorded.iter().map(|one| one.noise[slot].0).fold(0.0, f64::max);
            let stated = recorded.iter().any(|one| one.noise[slot].1);
            let readings = || recorded.iter().flat_map(|one| one.windows.values()).map(|row| row[slot].value.abs());
            let largest = readings().filter(|x| x.is_finite()).fold(0.0, f64::max);
            if stated {
                seen
            } else {
                seen.max(plant.steps[slot].unwrap_or(0.0) / 12.0_f64.sqrt()).max(FLOOR * largest)
            }
        })
        .collect();
    // The largest speed along each friction, and what noise hides of it.
    let basis = linearise(reduced, &vec![0.0; r]).basis;
    let frictions: Vec<Vec<f64>> = reduced
        .equations
        .frictions
        .iter()
        .map(|term| {
            (0..r)
                .map(|j| term.row.iter().map(|(s, a)| rational_to_f64(a) * rational_to_f64(&basis[(*s, j)])).sum())
                .collect()
        })
        .collect();
    let mut motion = Moving::new(r, m);
    let mut largest = vec![0.0_f64; frictions.len()];
    let mut hidden = vec![0.0_f64; frictions.len()];
    for row in recorded.iter().flat_map(|one| one.windows.values()) {
        if motion.take(plant, row, &noise, window) {
            for (k, g) in frictions.iter().enumerate() {
                largest[k] = largest[k].max(dot(g, &motion.speed).abs());
                let spread: f64 = g.iter().zip(&motion.speed_variance).map(|(g, v)| g * g * v).sum();
                hidden[k] = hidden[k].max(spread.sqrt());
            }
        }
    }
    let rest: Vec<f64> = largest
        .iter()
        .zip(&hidden)
        .map(|(largest, hidden)| asked.rest_speed.unwrap_or((0.01 * largest).max(3.0 * hidden)))
        .collect();
    let mut regressor = Regressor::new(reduced, &wanted, &plant.unmeasured, 0.0)
        .with_extras(&columns.extras)
        .with_window(window)
        .with_rest_speeds(&rest);
    let mut samples = Samples::new(regressor.rows(), regressor.columns(), columns.extras.len(), r, m);
    let mut count = WindowCount::default();
    let mut accelerations = vec![0.0; r];
    for (log, recording) in recorded.iter().enumerate() {
        for ((_, number), row) in &recording.windows {
            count.all += 1;
            if !motion.take(plant, row, &noise, window) {
                count.incomplete += 1;
                continue;
            }
            let place = Where { log, time: recording.origin + (*number as f64 + 0.5) * window, duration: window };
            let room = samples.push(place, [&motion.position, &motion.speed, &motion.acceleration], &motion.torques);
            let at = Motion { position: &motion.position, speed: &motion.speed, acceleration: &motion.acceleration };
            let variances = Variances {
                torques: &motion.torque_variance,
                position: &motion.position_variance,
                speed: &motion.speed_variance,
                acceleration: &motion.acceleration_variance,
            };
            let known = regressor.fill_weighted(
                at,
                &motion.torques,
                variances,
                (room.x, room.y),
                (room.covariance, room.speeds),
            );
            let finite = samples.x(samples.len() - 1).iter().chain(samples.y(samples.len() - 1)).all(|x| x.is_finite());
            if !known || !finite {
                samples.pop();
                count.resting += 1;
                continue;
            }
            accelerations.iter_mut().zip(&motion.acceleration_variance).for_each(|(a, v)| *a = v.sqrt().max(*a));
        }
    }
    Built { samples, count, noise: accelerations }
}

/// The motion and the torques in a window, with their variances.
struct Moving {
    position: Vec<f64>,
    speed: Vec<f64>,
    acceleration: Vec<f64>,
    torques: Vec<f64>,
    position_variance: Vec<f64>,
    speed_variance: Vec<f64>,
    acceleration_variance: Vec<f64>,
    torque_variance: Vec<f64>,
}

impl Moving {
    fn new(r: usize, m: usize) -> Self {
        let zero = || vec![0.0; r];
        Self {
            position: zero(),
            speed: zero(),
            acceleration: zero(),
            torques: vec![0.0; m],
            position_variance: zero(),
            speed_variance: zero(),
            acceleration_variance: zero(),
            torque_variance: vec![0.0; m],
        }
    }

    /// Takes the readings of a window; false if one is missing.
    fn take(&mut self, plant: &Plant, row: &[Reading], noise: &[f64], window: f64) -> bool {
        let mut whole = true;
        let mut reading = |slot: usize| {
            let found = row[slot];
            whole &= found.value.is_finite();
            (found, noise[slot] * noise[slot] / found.samples.max(1) as f64)
        };
        for (k, (angle, speed)) in plant.sensors.iter().enumerate() {
            if let Some(slot) = angle {
                let (found, variance) = reading(*slot);
                self.position[k] = found.value;
                self.position_variance[k] = variance * Reading::VALUE_GAIN;
                (self.speed[k], self.acceleration[k]) = (found.first, found.second);
                self.speed_variance[k] = variance * Reading::FIRST_GAIN / window.powi(2);
                self.acceleration_variance[k] = variance * Reading::SECOND_GAIN / window.powi(4);
            }
            if let Some(slot) = speed {
                let (found, variance) = reading(*slot);
                (self.speed[k], self.acceleration[k]) = (found.value, found.first);
                self.speed_variance[k] = variance * Reading::VALUE_GAIN;
                self.acceleration_variance[k] = variance * Reading::FIRST_GAIN / window.powi(2);
            }
        }
        for (k, slot) in plant.torques.iter().enumerate() {
            if let Some(slot) = slot {
                let (found, variance) = reading(*slot);
                self.torques[k] = found.value;
                self.torque_variance[k] = variance * Reading::VALUE_GAIN;
            }
        }
        whole
    }
}

/// The steady segments of all windows, each a sample.
fn settled(built: &Built, asked: &Asked, window: f64) -> Samples {
    let mut steadiness: Steadiness = asked.steadiness;
    if let Some(shortest) = asked.shortest {
        steadiness.windows = (shortest / window).ceil().max(1.0) as usize;
    }
    built.samples.averaged(&steady_segments(&built.samples, &built.noise, steadiness))
}

fn fit_options(asked: &Asked, columns: &Columns, method: &str) -> FitOptions {
    let nonnegative = |name: &String| asked.nonnegative.contains(name);
    let kept = columns.kept.iter().map(|(k, _)| nonnegative(&columns.asked[*k].name));
    FitOptions {
        loss: asked.loss,
        nonnegative: kept.chain(asked.extras.iter().map(|extra| nonnegative(&extra.name))).collect(),
        shapes: asked.extras.iter().map(|extra| extra.shape).collect(),
        speeds: asked.extras.iter().map(|extra| extra.speed).collect(),
        serial: method == "dynamic",
    }
}

/// The fold of each sample: segments in turn, or blocks of windows that follow each other.
fn folds(samples: &Samples, steady: bool) -> Vec<usize> {
    let n = samples.len();
    let folds = FOLDS.min(n);
    (0..n).map(|k| if steady { k % folds } else { (k * folds * BLOCKS / n.max(1)) % folds }).collect()
}

fn too_little(samples: &Samples, needed: usize, count: &WindowCount, method: &str, window: f64) -> Diagnostic {
    let message = format!(
        "{} {} tell too little for {needed} parameters: of {} windows of {window} s, {} lack samples of a channel, in {} a \
         friction rests or its sign is not known",
        samples.len(),
        if method == "steady" { "segments of constant speed" } else { "windows" },
        count.all,
        count.incomplete,
        count.resting,
    );
    let help = if method == "steady" {
        "use `--method dynamic`, a wider `steady_tolerance`, or a shorter `--window`; or ask for fewer parameters"
    } else {
        "log longer, use a shorter `--window`, lower `rest_speed`, or ask for fewer parameters"
    };
    Diagnostic::error("identify::too-little", message).help(help)
}

/// Compares models by what they predict of segments that they have not seen.
#[allow(clippy::too_many_arguments)]
fn compare(
    plant: &Plant,
    asked: &Asked,
    document: &Document,
    set: &[Setting],
    recorded: &[Recording],
    slots: &[Quantity],
    (window, method, built): (f64, &str, &Built),
    progress: &dyn Progress,
) -> Result<Vec<Candidate>, Vec<Diagnostic>> {
    let names = |kinds: &[Kind]| -> Vec<String> {
        asked.wanted.iter().filter(|one| kinds.contains(&one.keys[0].1)).map(|one| one.name.clone()).collect()
    };
    let all: Vec<String> = asked.wanted.iter().map(|one| one.name.clone()).collect();
    let mut specs = asked.candidates.clone();
    if specs.is_empty() {
        let spec = |name: &str, parameters: Vec<String>, extras: Vec<String>| CandidateSpec {
            name: name.into(),
            parameters,
            extras,
        };
        specs.push(spec(
            "without Coulomb friction",
            names(&[Kind::Inertia, Kind::Damping, Kind::Stiffness]),
            Vec::new(),
        ));
        specs.push(spec("without damping", names(&[Kind::Inertia, Kind::Friction, Kind::Stiffness]), Vec::new()));
        specs.push(spec("as asked, no extra terms", all.clone(), Vec::new()));
        for extra in &asked.declared {
            specs.push(spec(&format!("with {}", extra.name), all.clone(), vec![extra.name.clone()]));
        }
        if asked.declared.len() > 1 {
            let every = asked.declared.iter().map(|extra| extra.name.clone()).collect();
            specs.push(spec("with all extra terms", all.clone(), every));
        }
        specs.retain(|spec| !spec.parameters.is_empty());
        let mut seen: Vec<(Vec<String>, Vec<String>)> = Vec::new();
        specs.retain(|spec| {
            let own = (spec.parameters.clone(), spec.extras.clone());
            let new = !seen.contains(&own);
            seen.push(own);
            new
        });
    }
    // The windows are those that the whole model uses, so that all predict the same.
    let chosen_places: Vec<Where> = built.samples.places.clone();
    let mut out = Vec::new();
    let count = specs.len();
    for (k, spec) in specs.into_iter().enumerate() {
        progress.advance(1, "candidates", k as f64 / count as f64);
        let mut mistakes = Vec::new();
        let given = IdentifySettings { parameters: spec.parameters.clone(), ..IdentifySettings::default() };
        let mut own = self::asked(document, &plant.model, set, &given, &mut mistakes);
        for name in &spec.extras {
            if !own.declared.iter().any(|extra| extra.name == *name) {
                mistakes.push(
                    Diagnostic::error(
                        "name::unknown",
                        format!("candidate `{}`: there is no extra term `{name}`", spec.name),
                    )
                    .help("declare it as `[[identification.extra]]`"),
                );
            }
        }
        if !mistakes.is_empty() {
            return Err(mistakes);
        }
        own.extras = own.declared.iter().filter(|extra| spec.extras.contains(&extra.name)).cloned().collect();
        own.loss = asked.loss;
        own.nonnegative.retain(|name| spec.parameters.contains(name) || spec.extras.contains(name));
        // What is not among its parameters is left out of the model, not taken from the file.
        let silent: Vec<&asked::Wanted> =
            asked.wanted.iter().filter(|one| !spec.parameters.contains(&one.name)).collect();
        let found = {
            let mut trial = plant_without(plant, &silent);
            trial.unmeasured.clone_from(&plant.unmeasured);
            let mut columns = columns_of(&trial, &own, method);
            columns.extras = extra_columns(&trial.reduced.equations, &own.extras);
            let mut built = rows(&trial, &own, &columns, recorded, slots, window);
            keep_places(&mut built.samples, &chosen_places);
            let samples = if method == "steady" { settled(&built, &own, window) } else { built.samples };
            let options = fit_options(&own, &columns, method);
            let chosen: Vec<usize> = (0..samples.len()).collect();
            let folds = folds(&samples, method == "steady");
            cross_validate(&samples, &chosen, &folds, &options)
                .map(|predicted| fold_errors(&samples, &folds, &predicted))
        };
        let mut candidate = Candidate {
            name: spec.name,
            parameters: spec.parameters.into_iter().chain(spec.extras).collect(),
            error: (f64::NAN, f64::NAN),
            ..Candidate::default()
        };
        match found {
            Some(error) => candidate.error = error,
            None => candidate.failure = "too few samples".into(),
        }
        out.push(candidate);
    }
    progress.advance(1, "candidates", 1.0);
    let best = out.iter().filter(|one| one.error.0.is_finite()).min_by(|a, b| a.error.0.total_cmp(&b.error.0));
    if let Some(limit) = best.map(|best| best.error.0 + best.error.1) {
        let simplest = (0..out.len()).filter(|&k| out[k].error.0 <= limit).min_by_key(|&k| out[k].parameters.len());
        if let Some(simplest) = simplest {
            out[simplest].chosen = true;
        }
    }
    Ok(out)
}

/// A plant in which some parameters are zero.
fn plant_without(plant: &Plant, silent: &[&asked::Wanted]) -> Plant {
    let mut reduced = plant.reduced.clone();
    for one in silent {
        for coefficient in coefficients(&reduced.equations, &[(*one).clone()]) {
            silence(&mut reduced.equations, &coefficient);
        }
    }
    Plant {
        reduced,
        model: plant.model.clone(),
        sensors: plant.sensors.clone(),
        torques: plant.torques.clone(),
        unmeasured: plant.unmeasured.clone(),
        steps: plant.steps.clone(),
    }
}

/// Sets a coefficient to zero.
fn silence(equations: &mut Equations, coefficient: &Coefficient) {
    for &term in &coefficient.terms {
        match coefficient.kind {
            Kind::Inertia => equations.inertias[term].value = Exact::zero(),
            Kind::Damping => equations.dampers[term].value = Exact::zero(),
            Kind::Stiffness => equations.springs[term].value.stiffness = Exact::zero(),
            Kind::Friction => equations.frictions[term].value.torque = Exact::zero(),
        }
    }
}

fn columns_of(plant: &Plant, asked: &Asked, method: &str) -> Columns {
    columns(plant, asked, if method == "steady" { Excitation::Steady } else { Excitation::Free })
}

/// Keeps the samples at some places, which are in order.
fn keep_places(samples: &mut Samples, places: &[Where]) {
    let mut kept = Vec::new();
    let mut from = 0;
    for (k, place) in samples.places.iter().enumerate() {
        let before = |other: &Where| (other.log, other.time) < (place.log, place.time);
        while places.get(from).is_some_and(before) {
            from += 1;
        }
        if places.get(from) == Some(place) {
            kept.push(k..k + 1);
        }
    }
    *samples = samples.averaged(&kept);
}

/// Root mean square of predictions' errors in standard deviations of the sensors, and its standard error over the folds.
fn fold_errors(samples: &Samples, folds: &[usize], predicted: &[f64]) -> (f64, f64) {
    let count = folds.iter().max().map_or(1, |most| most + 1);
    let mut sums = vec![(0.0, 0.0); count];
    for (sample, fold) in folds.iter().enumerate() {
        for row in 0..samples.rows {
            let error = samples.y(sample)[row] - predicted[sample * samples.rows + row];
            let variance = samples.covariance(sample)[row * (samples.rows + 1)];
            sums[*fold].0 += if variance > 0.0 { error * error / variance } else { error * error };
            sums[*fold].1 += 1.0;
        }
    }
    let each: Vec<f64> = sums.iter().filter(|sum| sum.1 > 0.0).map(|sum| sum.0 / sum.1).collect();
    let n = each.len() as f64;
    let mean = each.iter().sum::<f64>() / n;
    let spread = (each.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0) / n).sqrt();
    (mean.sqrt(), if mean > 0.0 { spread / (2.0 * mean.sqrt()) } else { 0.0 })
}

/// The logs of a recording, with the noise of their channels.
fn logs_told(recording: Recording, slots: &[Quantity]) -> Vec<LogRead> {
    let mut logs = recording.logs;
    for channel in logs.iter_mut().flat_map(|log| &mut log.channels) {
        if let Some(slot) = slots.iter().position(|slot| slot.signal() == channel.signal) {
            (channel.noise, channel.stated) = recording.noise[slot];
        }
    }
    logs
}
