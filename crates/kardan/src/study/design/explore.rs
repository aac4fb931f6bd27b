//! Alternatives to the design of the file: interaction against torque, rate, bandwidth and sensors.

use rayon::prelude::*;

use crate::study::loops::stepped_loop::{NO_PERIOD_MAP, Shown, Subject, subject, window};
use crate::study::{PreparedVariant, Progress};
use kardan_math::num::{Rational, rational_from_f64};
use kardan_math::units::Exact;
use kardan_mechanics::equations::Measured;
use kardan_results::{Alternative, Exploration, Stability, WithSensor};
use kardan_schema::schema::{Resolved, Values};
use kardan_synthesis::{Clock, Plant, VariedPlant, clock, design_law, implemented, reading_variance};

/// Factors to try.
const EFFORTS: [f64; 5] = [1.0, 0.125, 0.35, 3.0, 8.0];
const BANDWIDTHS: [f64; 4] = [1.0, 0.5, 1.5, 2.0];
/// Factors of the rate: the sample time is divided by them.
const RATES: [f64; 4] = [1.0, 0.5, 2.0, 4.0];

/// A change of the file's design.
#[derive(Debug, Clone, PartialEq)]
struct Change {
    rate: f64,
    bandwidth: f64,
    effort: f64,
    sensors: Sensors,
}

#[derive(Debug, Clone, PartialEq)]
enum Sensors {
    AsInTheFile,
    AndAlso(String),
    /// All angles and speeds.
    All,
}

/// A design that was tried: the responses of its loop, the noise of its torques (N m), its sensors.
type Tried = (Shown, Vec<f64>, String);

/// Why a design failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Failure {
    /// No stable design exists.
    NotStable,
    /// The loop has no map.
    NotJudged,
}

/// Alternatives to the design of a controller; the reason if there is nothing to explore.
pub(in crate::study) fn explore(
    variant: &PreparedVariant,
    number: usize,
    progress: &dyn Progress,
) -> Result<Exploration, String> {
    let control = &variant.model.controls[number];
    if !control.law.samples {
        return Err(format!(
            "the law `{}` has one design only; `law = \"sampled_noninteracting\"` trades interaction against torque, rate and \
             sensors",
            control.law.keyword
        ));
    }
    let Some(base) = clock(&control.values).ok().flatten() else { return Err("it has no sample time".into()) };
    if variant.leaves_out(number) {
        return Err("its design leaves elements out; kardan tries no alternatives to such a design".into());
    }
    let plant = &variant.design_models[number];
    let changes = changes(plant, &control.values);
    let subject = alternative(variant, number, &changes[0], base)?.0;
    let done = std::sync::atomic::AtomicUsize::new(0);
    let attempt_counted = |change: &Change| {
        if progress.stop().is_some() {
            return Err(Failure::NotJudged);
        }
        let tried = attempt(variant, number, change, base);
        let count = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
        progress.advance(0, "designs", count as f64 / changes.len() as f64);
        tried
    };
    let tried: Vec<Result<Tried, Failure>> = changes.par_iter().map(attempt_counted).collect();
    if let Some(why) = progress.stop() {
        return Err(why);
    }
    let first = match &tried[0] {
        Ok((first, ..)) => first,
        Err(Failure::NotStable) => return Err("the design of the file is not stable".into()),
        Err(Failure::NotJudged) => return Err(NO_PERIOD_MAP.into()),
    };
    let scale = Scale::new(&subject, first, plant, base).ok_or("no channel could disturb another")?;
    let failed = |failure| tried.iter().filter(|one| one.as_ref().err() == Some(&failure)).count();
    let (step, watched) = (&subject.steps[scale.pair.0], &subject.watched[scale.pair.1]);
    let mut out = Exploration {
        interaction: format!("{} after a step of {} by {} {}", watched.name, step.name, step.size, step.unit),
        unit: watched.unit.into(),
        relative_to_limits: scale.limited,
        failed: failed(Failure::NotStable),
        not_evaluated: failed(Failure::NotJudged),
        ..Exploration::default()
    };
    for (change, tried) in changes.iter().zip(&tried) {
        let Ok(tried) = tried else { continue };
        let design = scale.alternative(change, tried);
        match &change.sensors {
            Sensors::AndAlso(name) => out.sensors.push(WithSensor { name: name.clone(), design }),
            _ => out.designs.push(design),
        }
    }
    mark_best(&mut out.designs);
    // The benefit of a sensor must exceed its harm.
    let own = out.designs.first().cloned().unwrap_or_default();
    let worth = |one: &Alternative| (one.noise / own.noise).max(one.interaction / own.interaction);
    out.sensors.sort_by(|a, b| worth(&a.design).total_cmp(&worth(&b.design)));
    out.advice = advice(&out);
    Ok(out)
}

/// The designs to try, that of the file first.
fn changes(plant: &Plant, values: &Values) -> Vec<Change> {
    let observed = values.table("observer").is_some();
    let mut out = Vec::new();
    for &rate in &RATES {
        for &bandwidth in &BANDWIDTHS {
            for &effort in &EFFORTS {
                let change = |sensors| Change { rate, bandwidth, effort, sensors };
                out.push(change(Sensors::AsInTheFile));
                if observed {
                    out.push(change(Sensors::All));
                }
            }
        }
    }
    let candidates = if observed { candidates(plant, values) } else { Vec::new() };
    let change = |name| Change { rate: 1.0, bandwidth: 1.0, effort: 1.0, sensors: Sensors::AndAlso(name) };
    out.extend(candidates.into_iter().map(change));
    out
}

/// The scale of the alternatives.
struct Scale {
    base: Clock,
    /// The interaction that matters, the largest relative to the acceptable one: its step and the watched signal.
    pair: (usize, usize),
    /// Torque limits of the motors, N m; one where no motor has any.
    limits: Vec<f64>,
    limited: bool,
}

impl Scale {
    /// Nothing if no channel could disturb another.
    fn new(subject: &Subject, first: &Shown, plant: &Plant, base: Clock) -> Option<Self> {
        let pairs = (0..subject.steps.len()).flat_map(|i| (0..subject.watched.len()).map(move |j| (i, j)));
        let crossing = pairs.filter(|&(i, j)| subject.watched[j].reference != subject.steps[i].name);
        let share = |(i, j): (usize, usize)| first.sizes[i][j] / subject.watched[j].acceptable;
        let pair = crossing.max_by(|a, b| share(*a).total_cmp(&share(*b)))?;
        let limits = limits(plant, &subject.inputs);
        let limited = limits.is_some();
        Some(Self { base, pair, limits: limits.unwrap_or_else(|| vec![1.0; subject.inputs.len()]), limited })
    }

    fn alternative(&self, change: &Change, (shown, noise, sensors): &Tried) -> Alternative {
        let over =
            |values: &[f64]| values.iter().zip(&self.limits).map(|(value, limit)| value / limit).fold(0.0, f64::max);
        Alternative {
            sample_time: self.base.period / change.rate,
            delay: self.base.delay / change.rate,
            bandwidth: change.bandwidth,
            effort: change.effort,
            sensors: sensors.clone(),
            interaction: shown.sizes[self.pair.0][self.pair.1],
            torque: shown.peaks.iter().map(|peaks| over(peaks)).fold(0.0, f64::max),
            noise: over(noise),
            spectral_radius: shown.radius,
            best: false,
        }
    }
}

/// A design is best if none with the same sensors, at no higher rate and no smaller bandwidth, is better in both interaction
/// and torque.
fn mark_best(designs: &mut [Alternative]) {
    let all = designs.to_vec();
    for one in designs {
        let better = |rival: &Alternative| {
            rival.sensors == one.sensors
                && rival.sample_time >= one.sample_time
                && rival.bandwidth >= one.bandwidth
                && rival.interaction <= one.interaction
                && rival.torque <= one.torque
                && (rival.interaction < one.interaction || rival.torque < one.torque)
        };
        one.best = !all.iter().any(better);
    }
}

/// Torque limits of the motors, N m; `None` where no motor has any.
fn limits(plant: &Plant, inputs: &[usize]) -> Option<Vec<f64>> {
    let limits: Vec<Option<f64>> = inputs.iter().map(|input| plant.torque_limit(*input)).collect();
    let any = limits.iter().any(Option::is_some);
    any.then(|| limits.into_iter().map(|limit| limit.unwrap_or(f64::INFINITY)).collect())
}

/// Sensors that the file has or could have: its other sensors that an observer can read, then angles of shafts without a
/// sensor.
fn candidates(plant: &Plant, values: &Values) -> Vec<String> {
    let used = values.table("observer").and_then(|observer| observer.names("sensors")).unwrap_or_default();
    let used: Vec<String> = used.iter().filter_map(|name| Some(plant.output(name).ok()?.name)).collect();
    let equations = &plant.reduced.equations;
    let mut out = Vec::new();
    let mut measured: Vec<&String> = Vec::new();
    for (name, sensor) in &equations.sensors {
        match &sensor.measured {
            Measured::Angle(shaft) => measured.push(shaft),
            Measured::Speed(_) | Measured::SpringTorque(_) => {}
            _ => continue,
        }
        let full = equations.reading(&sensor.measured).of(name);
        if !used.contains(&full) {
            out.push(full);
        }
    }
    let names = plant.coordinates().iter().enumerate().filter(|(_, shaft)| !measured.contains(shaft));
    let names = names.map(|(k, shaft)| equations.domain(k).motion()[0].of(shaft));
    out.extend(names.filter(|name| !used.contains(name)));
    out
}

/// The loop with a change, and the law.
fn alternative(
    variant: &PreparedVariant,
    number: usize,
    change: &Change,
    base: Clock,
) -> Result<(Subject, Vec<f64>, String), String> {
    let (values, sensors) = changed(variant, number, change).ok_or("a number overflows")?;
    let control = &variant.model.controls[number];
    let plant = &variant.design_models[number];
    let law = design_law(control.law, &control.name, &values, plant).and_then(|law| implemented(law, &values));
    let law = law.map_err(|error| error.to_string())?;
    let noise = values.table("observer").and_then(|observer| observer.number("sensor_noise"));
    let variances =
        law.sensors().iter().map(|signal| reading_variance(plant, noise, signal, base.period / change.rate)).collect();
    let mut laws = variant.implemented.clone();
    laws[number] = law;
    let varied = VariedPlant::new(&variant.reduced, &variant.linear_model(), &plant.lags());
    Ok((subject(variant, number, &laws, varied)?, variances, sensors))
}

/// The keys of the controller with a change, and its sensors as text; `None` if a number overflows.
fn changed(variant: &PreparedVariant, number: usize, change: &Change) -> Option<(Values, String)> {
    let control = &variant.model.controls[number];
    let mut values = control.values.clone();
    let exact = |x: f64| Some(Resolved::Exact(Exact::new(rational_from_f64(x)?, 0)));
    let divided = |key: &str| {
        let value = control.values.exact(key)?.to_rational();
        let rate: Rational = rational_from_f64(change.rate)?;
        Some(Resolved::Exact(Exact::new(value / rate, 0)))
    };
    values.insert("sample_time", divided("sample_time")?);
    if let Some(delay) = divided("delay") {
        values.insert("delay", delay);
    }
    // The loop is evaluated straight ahead.
    values.insert("schedule", exact(1.0)?);
    values.insert("effort", exact(change.effort * control.values.number_or_default("effort"))?);
    let channels = control.values.tables("channels").unwrap_or_default().iter().map(|channel| {
        let mut channel = channel.clone();
        channel.insert("bandwidth", exact(change.bandwidth * channel.number_or_default("bandwidth"))?);
        Some(channel)
    });
    values.insert("channels", Resolved::Tables(channels.collect::<Option<_>>()?));
    let sensors = match (&change.sensors, values.table("observer")) {
        (Sensors::AndAlso(name), Some(observer)) => {
            let mut observer = observer.clone();
            let mut all = observer.names("sensors").unwrap_or_default().to_vec();
            all.push(name.clone());
            let joined = all.join(", ");
            observer.insert("sensors", Resolved::Names(all));
            values.insert("observer", Resolved::Tables(vec![observer]));
            joined
        }
        (Sensors::AsInTheFile, Some(observer)) => observer.names("sensors").unwrap_or_default().join(", "),
        _ => {
            values.remove("observer");
            "all angles and speeds".into()
        }
    };
    Some((values, sensors))
}

/// The responses of the loop with a change, the noise of its torques (N m), and its sensors.
fn attempt(variant: &PreparedVariant, number: usize, change: &Change, base: Clock) -> Result<Tried, Failure> {
    let found = alternative(variant, number, change, base).map_err(|_| Failure::NotStable)?;
    let (mut subject, variances, sensors) = found;
    let nominal = vec![1.0; subject.plant.names().len()];
    let first = subject.evaluate(&nominal).map_err(|_| Failure::NotJudged)?;
    if first.word != Stability::Stable {
        return Err(Failure::NotStable);
    }
    subject.window = window(&first, variant.scenario.duration);
    let shown = subject.evaluate(&nominal).map_err(|_| Failure::NotJudged)?;
    let noise = subject.noise(&nominal, &variances).ok_or(Failure::NotJudged)?;
    Ok((shown, noise, sensors))
}

/// Recommendations.
fn advice(found: &Exploration) -> Vec<String> {
    let Some(own) = found.designs.first() else { return Vec::new() };
    let of =
        if found.relative_to_limits { "of the torque of the most loaded motor" } else { "demanded of a motor at most" };
    let mut out = vec![format!(
        "The design of the file: {} {:.3e} {}, {} {of}, noise {} rms.",
        found.interaction,
        own.interaction,
        found.unit,
        found.amount(own.torque, 0),
        found.amount(own.noise, 1)
    )];
    let same = |one: &&Alternative| one.sample_time == own.sample_time && one.sensors == own.sensors;
    // Without limits the capability of a motor is unknown: not much more than it gives now.
    let most = if found.relative_to_limits { 1.0 } else { own.torque };
    let least = found
        .designs
        .iter()
        .filter(same)
        .filter(|one| one.bandwidth == own.bandwidth && one.torque <= 1.0001 * most)
        .min_by(|a, b| a.interaction.total_cmp(&b.interaction));
    if let Some(least) = least.filter(|least| least.interaction < 0.5 * own.interaction) {
        out.push(format!(
            "At this rate and bandwidth an effort {} times as large brings the interaction to {:.3e} {}, with {} {of} and a noise \
             of {}.",
            least.effort,
            least.interaction,
            found.unit,
            found.amount(least.torque, 0),
            found.amount(least.noise, 1)
        ));
    }
    let faster = found
        .designs
        .iter()
        .filter(|one| same(one) && one.torque <= 0.9 * most && one.bandwidth > own.bandwidth)
        .max_by(|a, b| a.bandwidth.total_cmp(&b.bandwidth).then(b.interaction.total_cmp(&a.interaction)));
    if let Some(faster) = faster {
        out.push(format!(
            "Within {} {of} the bandwidth can be {} times as large, with an interaction of {:.3e} {}.",
            found.amount(0.9 * most, 0),
            faster.bandwidth,
            faster.interaction,
            found.unit
        ));
    }
    match found.sensors.first() {
        Some(WithSensor { name, design: with })
            if with.noise < 0.95 * own.noise && with.interaction < 1.05 * own.interaction => out.push(format!(
            "The sensor to add first is {name}: the noise falls from {} to {}, the interaction goes from {:.3e} to {:.3e} {}.",
            found.amount(own.noise, 2),
            found.amount(with.noise, 2),
            own.interaction,
            with.interaction,
            found.unit
        )),
        Some(_) => out.push("No further sensor brings the noise of the torques down by 5 % without more interaction.".into()),
        None => {}
    }
    out
}
