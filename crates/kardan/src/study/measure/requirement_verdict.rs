//! A bound on a signal, and whether a run satisfies it.

use crate::study::measure::measures::{Band, Measured, Window, measured};
use crate::study::measure::measures_over_input::measured_over;
use kardan_math::units::Dimension;
use kardan_model::tables::Measure;
use kardan_results::signal_name::{Quantity, SignalName};
use kardan_results::{DisplayUnit, Event, FigureResult, MotorLoad, RequirementResult, Series};

/// A bound on a signal, or on a figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Requirement {
    /// Signal, or an expression of signals.
    pub signal: String,
    /// The measure of it.
    pub measure: Measure,
    /// The figure to judge instead.
    pub figure: Option<String>,
    /// The signal on the horizontal axis of the measure.
    pub over: Option<String>,
    /// The time of the measure, s.
    pub at: Option<f64>,
    /// The frequency of the measure, Hz.
    pub frequency: Option<f64>,
    /// The quantity of the signal.
    pub dimension: Dimension,
    /// The SI unit of the measure.
    pub unit: String,
    /// The target of the signal, SI.
    pub target: Option<f64>,
    /// The tolerance around the target.
    pub band: Option<Band>,
    /// The unit of its bounds in the file, if it is not the SI unit.
    pub display: Option<DisplayUnit>,
    /// Upper bound, SI.
    pub below: Option<f64>,
    /// Lower bound, SI.
    pub above: Option<f64>,
    /// Window, s.
    pub from: f64,
    /// Window, s.
    pub until: f64,
    /// Variants that it applies to; empty: all.
    pub variants: Vec<String>,
}

impl Default for Requirement {
    fn default() -> Self {
        Self {
            signal: String::new(),
            measure: Measure::Final,
            figure: None,
            over: None,
            at: None,
            frequency: None,
            dimension: Dimension::NONE,
            unit: String::new(),
            target: None,
            band: None,
            display: None,
            below: None,
            above: None,
            from: 0.0,
            until: f64::INFINITY,
            variants: Vec::new(),
        }
    }
}

/// A judged requirement, and warnings about the verdict.
pub(in crate::study) struct Judged {
    pub(in crate::study) result: RequirementResult,
    pub(in crate::study) note: Option<String>,
}

/// Motors, events and end of a run; empty before any.
#[derive(Default)]
pub(in crate::study) struct Ran<'a> {
    pub(in crate::study) motor_loads: &'a [MotorLoad],
    pub(in crate::study) events: &'a [Event],
    pub(in crate::study) completed: bool,
}

impl Ran<'_> {
    /// The load of the motor whose torque a signal is.
    fn motor_load(&self, signal: &str) -> Option<&MotorLoad> {
        self.motor_loads.iter().find(|motor_load| motor_of(signal) == Some(motor_load.motor.as_str()))
    }
}

/// The measure of a requirement in a run.
fn measure_of<'s>(
    requirement: &Requirement,
    series: &'s Series,
    ran: &Ran<'_>,
    figures: &[FigureResult],
) -> Result<Measured, &'static str> {
    let Requirement { signal, measure, target, band, from, until, .. } = requirement;
    let exact = |value: f64| Measured { value, grid: 0.0 };
    if let Some(name) = &requirement.figure {
        let found = figures.iter().find(|figure| figure.name == *name).and_then(|figure| figure.value);
        return found.map(exact).ok_or("the figure has none in this run");
    }
    let column = |name: &str| series.signal(name).map(|signal| signal.values.as_slice()).unwrap_or_default();
    // Times increase, so the rows of a window are contiguous.
    let [first, behind] =
        [series.time.partition_point(|time| time < from), series.time.partition_point(|time| time <= until)];
    let inside = |values: &'s [f64]| {
        let behind = behind.min(values.len());
        &values[first.min(behind)..behind]
    };
    let (times, values) = (inside(&series.time), inside(column(signal)));
    let window = Window { times: &times[..values.len()], values };
    match measure {
        _ if values.is_empty() => Err("no row lies in its window"),
        Measure::At => value_at(&series.time, column(signal), requirement.at.unwrap_or(f64::NAN)),
        Measure::TimeAtLimit => {
            let motor_load = ran.motor_load(signal).ok_or("the motor has no limit")?;
            Ok(exact(motor_load.seconds_at_limit(*from, *until)))
        }
        Measure::Events => {
            let element = SignalName::new(signal).element;
            let of_element = |event: &&Event| {
                signal == "t"
                    || event.description.split(' ').next().is_some_and(|name| SignalName::new(name).element == element)
            };
            let inside = ran.events.iter().filter(|event| (*from..=*until).contains(&event.time));
            Ok(exact(inside.filter(of_element).count() as f64))
        }
        _ => match &requirement.over {
            Some(over) => measured_over(*measure, window, inside(column(over)), requirement.frequency),
            None => measured(*measure, window, *target, *band),
        },
    }
}

/// The value at a time, on the straight line between the adjacent rows.
fn value_at(times: &[f64], values: &[f64], at: f64) -> Result<Measured, &'static str> {
    let behind = times.iter().position(|time| *time >= at).ok_or("the run ended before it")?;
    let line = |a: usize, b: usize| {
        if a == b { values[b] } else { values[a] + (at - times[a]) / (times[b] - times[a]) * (values[b] - values[a]) }
    };
    let before = if times[behind] == at { behind } else { behind.saturating_sub(1) };
    let value = line(before, behind);
    // The estimate from the next rows on both sides.
    let wider = line(before.saturating_sub(1), (behind + 1).min(times.len() - 1));
    let grid = if before == behind { 0.0 } else { (value - wider).abs() };
    if value.is_finite() { Ok(Measured { value, grid }) } else { Err("the expression is no number there") }
}

/// A number as in a file: digits, or a power of ten in place of many zeros.
pub(in crate::study) fn in_digits(number: f64) -> String {
    if number == 0.0 || (1e-4..1e7).contains(&number.abs()) { number.to_string() } else { format!("{number:e}") }
}

/// The target of a measure in the unit of the signal, and its band; empty if it has none.
fn aim(requirement: &Requirement, unit: &str) -> String {
    let Requirement { measure, target, band, .. } = requirement;
    let with_unit = |value: f64| format!("{} {unit}", in_digits(in_15_digits(value))).trim_end().to_string();
    let target = match (measure, target) {
        (Measure::Overshoot | Measure::RiseTime | Measure::SettlingTime | Measure::Iae, Some(target)) => {
            with_unit(*target)
        }
        (Measure::Overshoot | Measure::RiseTime | Measure::SettlingTime, None) => "its last value".to_string(),
        (Measure::Iae, None) => "0".to_string(),
        _ => return String::new(),
    };
    let band = match band.filter(|_| matches!(measure, Measure::RiseTime | Measure::SettlingTime)) {
        None => String::new(),
        Some(Band::Size(size)) => format!(" ± {}", with_unit(size)),
        Some(Band::Part(part)) => format!(" ± {} % of the way", in_digits(in_15_digits(100.0 * part))),
    };
    format!(" (to {target}{band})")
}

/// The measure, as text.
fn described(requirement: &Requirement, series: &Series, ran: &Ran<'_>) -> String {
    let Requirement { signal, measure, figure, over, at, frequency, from, until, .. } = requirement;
    if let Some(figure) = figure {
        return figure.clone();
    }
    let over = over.as_ref().map(|over| format!(" over {over}")).unwrap_or_default();
    let name = match (measure, at, frequency) {
        (Measure::MaxAbs, ..) => format!("max |{signal}|"),
        (Measure::At, Some(at), _) => format!("{signal} at {at} s"),
        (Measure::Events, ..) if signal == "t" => "events".to_string(),
        (Measure::TimeAtLimit, ..) => {
            let what = ran.motor_load(signal).map_or("torque", MotorLoad::effort);
            format!("time of {} at its {what} limit", motor_of(signal).unwrap_or(signal))
        }
        (_, _, Some(frequency)) => format!("{} {signal}{over} at {frequency} Hz", measure.word()),
        _ => {
            let own = series.signal(signal).map_or("", |found| found.physical.unit());
            format!("{} {signal}{over}{}", measure.word(), aim(requirement, own))
        }
    };
    if *from == 0.0 && until.is_infinite() {
        return name;
    }
    let end = if until.is_finite() { format!("{until} s") } else { "the end".to_string() };
    format!("{name} from {from} s to {end}")
}

impl Requirement {
    /// Whether more rows can only add to its measure.
    pub(in crate::study) fn is_extreme(&self) -> bool {
        use Measure::{Max, MaxAbs, Min, Overshoot, PeakToPeak};
        self.figure.is_none() && matches!(self.measure, Max | Min | MaxAbs | Overshoot | PeakToPeak)
    }

    /// The bounds, as text, before any run.
    pub(in crate::study) fn describe(&self) -> String {
        judge(self, &Series::default(), &Ran::default(), &[]).result.text
    }

    /// The measure, as text, before any run.
    pub(in crate::study) fn describe_measure(&self) -> String {
        described(self, &Series::default(), &Ran::default())
    }
}

pub(in crate::study) fn judge(
    requirement: &Requirement,
    series: &Series,
    ran: &Ran<'_>,
    figures: &[FigureResult],
) -> Judged {
    let Requirement { unit, display, below, above, until, .. } = requirement;
    let completed = ran.completed;
    let found = measure_of(requirement, series, ran, figures);
    let measured = found.ok().map(|found| found.value);
    // A run that ended inside the window cannot pass: the rest is unknown.
    let until = requirement.at.unwrap_or(*until);
    let complete = completed || series.time.last().is_some_and(|last| *last >= until);
    let passed = complete
        && below.is_none_or(|bound| measured.is_some_and(|measured| measured < bound))
        && above.is_none_or(|bound| measured.is_some_and(|measured| measured > bound));
    let name = described(requirement, series, ran);
    let display_unit = display.as_ref().map_or(unit.as_str(), |display| &display.unit);
    // In the unit of the file, without the digits that the conversion of units rounded.
    let converted = |bound: f64| display.as_ref().map_or(bound, |unit| in_15_digits(unit.of(bound)));
    let bound = |bound: &Option<f64>| bound.map(|bound| in_digits(converted(bound)));
    let text = match (bound(above), bound(below)) {
        (Some(above), Some(below)) => format!("{above} < {name} < {below} {display_unit}"),
        (Some(above), None) => format!("{name} > {above} {display_unit}"),
        (None, Some(below)) => format!("{name} < {below} {display_unit}"),
        (None, None) => name,
    };
    let text = text.trim_end().to_string();
    let note = match found {
        Err(why) if complete => Some(format!("`{text}` has no value: {why}")),
        Ok(Measured { value, grid }) if [below, above].iter().any(|bound| near(**bound, value, grid)) => {
            let size = display.as_ref().map_or(grid, |unit| unit.of(grid));
            Some(format!(
                "`{text}` is closer to its bound than the resolution of the rows of the run, about {size:.1e} \
                 {display_unit}: a smaller `output_step` resolves it"
            ))
        }
        _ => None,
    };
    let (unit, display) = (unit.clone(), display.clone());
    Judged { result: RequirementResult { text, measured, unit, display, passed }, note }
}

/// Whether a bound is closer to a measure than the error of the grid of rows.
fn near(bound: Option<f64>, value: f64, grid: f64) -> bool {
    bound.is_some_and(|bound| grid > 0.0 && (value - bound).abs() <= grid)
}

pub(in crate::study) fn in_15_digits(value: f64) -> f64 {
    format!("{value:.14e}").parse().unwrap_or(value)
}

/// The motor whose torque the signal is, or the source of a voltage.
pub(in crate::study) fn motor_of(signal: &str) -> Option<&str> {
    use Quantity::{Command, Force, Torque, Velocity, Voltage};
    let name = SignalName::new(signal);
    // `.v` is a speed of a mass, and a voltage of a source.
    name.unqualified().filter(|_| matches!(name.quantity(), Some(Torque | Force | Command | Velocity | Voltage)))
}
