//! Expected number of steps of a run, and its main cause.

use std::sync::Arc;

use kardan_rt::functions::{exp, ln, powi};

use crate::study::PreparedVariant;
use crate::study::read::locations::place_of;
use kardan_math::num::Random;
use kardan_mechanics::assemble::Equations;
use kardan_mechanics::equations::InputKind;
use kardan_mechanics::program::Task;
use kardan_mechanics::reduce::{Dynamics, Work, linearise};
use kardan_model::Document;
use kardan_schema::diagnostics::Diagnostic;
use kardan_simulate::{Setup, UNJAM, locking_gears};
use kardan_synthesis::closed_loop_poles;

/// States of laws and blocks up to which a loop is examined before a run.
pub(in crate::study) const MOST_STATES: usize = 200;
/// Number of steps above which kardan warns.
pub const MANY_STEPS: f64 = 1e7;
/// Length of a step in time constants of the limiting motion: a damped one up to the stability limit, an oscillating one
/// up to the limit of the usual accuracy.
const DAMPED_STEP: f64 = 6.0;
const SWINGING_STEP: f64 = 1.0;
/// Products with the state matrix after which its fastest motion dominates; more separate motions of similar speed.
const PRODUCTS: usize = 300;
const SEED: u64 = 1;

/// The expected cost of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Effort {
    /// Upper estimate of the steps of an explicit method: a motion at rest costs less.
    pub steps: f64,
    /// Fastest rate of the loop at its initial position, 1/s.
    pub rate: f64,
    /// The element that causes it, with its key; none if a controller or samples do.
    pub element: Option<(String, &'static str)>,
    /// The cause as text.
    pub cause: String,
}

impl Effort {
    /// Names instants of controllers, blocks or sensors as the cause, if they are more than the steps so far.
    fn blame(&mut self, instants: f64, cause: impl Fn() -> String) {
        if instants > self.steps {
            (self.element, self.cause) = (None, cause());
        }
    }
}

/// Estimates the steps of a run: the length of the scenario times the fastest rate of the linear model at the start, and the
/// samples of its controllers.
///
/// The rate is the spectral radius of `[0, I; −H⁻¹S, −H⁻¹D]`, from products with a vector; with controllers in continuous time
/// the largest pole of the loop. Nonlinearity in the angles and slipping are not included.
///
/// ```
/// use kardan::model;
/// use kardan::study;
/// let source = model::builtin("two-bodies").unwrap().source;
/// let (prepared, _) = study::prepare(source);
/// assert!(study::expected_effort(&prepared.variants[0]).steps < 1e5);
/// ```
pub fn expected_effort(variant: &PreparedVariant) -> Effort {
    let duration = variant.scenario.duration;
    let mut found = fastest(variant);
    let mut swings = matches!(found.element, Some((_, "stiffness")));
    let laws = &variant.implemented;
    let clocks: Vec<_> = laws.iter().filter_map(|law| law.clock()).collect();
    let states: usize = laws.iter().map(|law| law.states().len()).sum();
    if !laws.is_empty() && clocks.is_empty() && states <= MOST_STATES {
        let at = variant.in_loop();
        let linear = linearise(&at.reduced, &at.scenario.position);
        let poles = closed_loop_poles(&linear, laws).unwrap_or_default();
        let largest = poles.iter().map(|pole| pole.abs()).fold(0.0, f64::max);
        if largest > 1.5 * found.rate {
            let names: Vec<String> = laws.iter().map(|law| format!("`{}`", law.describe().controller)).collect();
            found.element = None;
            found.cause = format!("the loop of control {} has a pole of {} 1/s", names.join(", "), short(largest));
        }
        swings |= largest > found.rate;
        found.rate = found.rate.max(largest);
    }
    for input in &variant.reduced.equations.inputs {
        let InputKind::Motor(motor) = &input.value else { continue };
        let rate = motor.lag.as_ref().map_or(0.0, |lag| 1.0 / lag.to_f64());
        if rate > found.rate {
            swings = false;
            found.rate = rate;
            found.element = Some((input.element.clone(), "lag"));
            found.cause = format!("`{}` has a lag of only {} s", input.element, short(1.0 / rate));
        }
    }
    found.steps = duration * found.rate / if swings { SWINGING_STEP } else { DAMPED_STEP };
    let instants = |delay: f64| if delay > 0.0 { 2.0 } else { 1.0 };
    let samples: f64 = clocks.iter().map(|clock| duration / clock.period * instants(clock.delay)).sum();
    found.blame(samples, || format!("its controllers take {} samples, each of which ends a step", short(samples)));
    found.steps += samples;
    let periods = |task: &Arc<Task>| task.period.as_ref().map(|period| duration / period.to_f64());
    let computed: f64 = variant.model.programs.tasks.iter().filter_map(periods).sum();
    found.blame(computed, || format!("its blocks compute {} times, each of which ends a step", short(computed)));
    found.steps += computed;
    let equations = &variant.reduced.equations;
    let sensors = equations.sensors.iter().chain(&equations.signal_sensors);
    let times = sensors.filter_map(|(_, sensor)| sensor.sample_time.as_ref());
    let readings: f64 = times.map(|time| duration / time.to_f64()).sum();
    found.blame(readings, || format!("its sensors are read {} times", short(readings)));
    found.steps = found.steps.max(readings);
    found
}

/// The fastest motion of the model without its laws, and the element that causes it.
fn fastest(variant: &PreparedVariant) -> Effort {
    let reduced = &variant.reduced;
    let r = reduced.degrees_of_freedom();
    let mut out = Effort { steps: 0.0, rate: 0.0, element: None, cause: "the model has no dynamics of its own".into() };
    if reduced.massless.is_some() {
        out.cause = "motions without inertia are not analysed".into();
        return out;
    }
    let (dynamics, mut work) = Dynamics::new(reduced);
    if r == 0 || !dynamics.update(&variant.scenario.position, &vec![0.0; r], &mut work) {
        return out;
    }
    let terms = Terms::at(&reduced.equations, &work);
    if let Some(motion) = terms.fastest_motion(&work) {
        out.rate = motion.rate;
        if let Some((element, cause)) = terms.cause(&reduced.equations, &motion) {
            (out.element, out.cause) = (Some(element), cause);
        }
    }
    out
}

/// A row over the coordinates, without its zeros.
type Row = Vec<(usize, f64)>;

/// The elements of a model at a position: each with its row over the coordinates and its value.
struct Terms {
    dampers: Vec<(Row, f64)>,
    springs: Vec<(Row, f64)>,
    inertias: Vec<(Row, f64)>,
}

fn row_dot(row: &Row, x: &[f64]) -> f64 {
    row.iter().map(|(j, factor)| factor * x[*j]).sum()
}

/// The motion of the largest eigenvalue.
struct Motion {
    /// 1/s
    rate: f64,
    /// Speeds of the coordinates.
    speed: Vec<f64>,
    /// Their angles: the speeds of the previous product.
    angle: Vec<f64>,
}

impl Terms {
    fn at(equations: &Equations, work: &Work) -> Self {
        let project = |row: Vec<(usize, f64)>| -> Row {
            let mut out = vec![0.0; work.kinematics.row(0).len()];
            work.kinematics.project(&row, &mut out);
            out.into_iter().enumerate().filter(|(_, x)| *x != 0.0).collect()
        };
        Self {
            dampers: equations.dampers.iter().map(|d| (project(d.row_f64()), d.value.to_f64())).collect(),
            springs: equations.springs.iter().map(|s| (project(s.row_f64()), s.value.stiffness.to_f64())).collect(),
            inertias: equations.inertias.iter().map(|j| (project(j.row_f64()), j.value.to_f64())).collect(),
        }
    }

    /// The motion that products of a vector with the state matrix tend to; nothing if they vanish.
    fn fastest_motion(&self, work: &Work) -> Option<Motion> {
        let r = work.kinematics.row(0).len();
        let mut random = Random::new(SEED);
        let mut draw = || (0..r).map(|_| random.unit() - 0.5).collect::<Vec<f64>>();
        let (mut angle, mut speed) = (draw(), draw());
        let size =
            |x: &[f64]| self.inertias.iter().map(|(row, j)| j * row_dot(row, x) * row_dot(row, x)).sum::<f64>().sqrt();
        let mut logarithm = 0.0;
        for k in 0..PRODUCTS {
            let mut next = vec![0.0; r];
            for (terms, x) in [(&self.dampers, &speed), (&self.springs, &angle)] {
                for (row, value) in terms {
                    let torque = value * row_dot(row, x);
                    row.iter().for_each(|(j, g)| next[*j] -= torque * g);
                }
            }
            work.factor.solve(&mut next);
            let (before, after) = (size(&speed), size(&next));
            if !(after > 0.0 && before > 0.0 && after.is_finite()) {
                return None;
            }
            if k >= PRODUCTS / 2 {
                logarithm += ln(after / before);
            }
            angle = speed.iter().map(|x| x / after).collect();
            speed = next.iter().map(|x| x / after).collect();
        }
        Some(Motion { rate: exp(logarithm / (PRODUCTS - PRODUCTS / 2) as f64), speed, angle })
    }

    /// The element with the largest power in a motion, with its key and a description.
    fn cause(&self, equations: &Equations, motion: &Motion) -> Option<((String, &'static str), String)> {
        let Motion { rate, speed, angle } = motion;
        let largest = |terms: &[(Row, f64)], weight: f64| -> Option<(usize, f64)> {
            let power = |(row, value): &(Row, f64)| {
                weight * value * (powi(row_dot(row, speed), 2) + powi(rate * row_dot(row, angle), 2))
            };
            terms.iter().map(power).enumerate().max_by(|a, b| a.1.total_cmp(&b.1))
        };
        let damper = largest(&self.dampers, 1.0);
        let spring =
            largest(&self.springs, 1.0 / rate).filter(|(_, power)| damper.is_none_or(|(_, loss)| *power > loss));
        let of = largest(&self.inertias, *rate).map_or(String::new(), |(k, _)| {
            let term = &equations.inertias[k];
            let unit = equations.domain_of(term).units()[0];
            format!(" of `{}` ({} {unit})", term.element, short(self.inertias[k].1))
        });
        if let Some((k, _)) = spring {
            let term = &equations.springs[k];
            let unit = equations.domain_of(term).units()[2];
            let cause = format!(
                "the stiffness of `{}` ({} {unit}) lets the inertia{of} oscillate at {} rad/s",
                term.element,
                short(self.springs[k].1),
                short(*rate)
            );
            return Some(((term.element.clone(), "stiffness"), cause));
        }
        let term = &equations.dampers[damper?.0];
        let unit = equations.domain_of(term).units()[1];
        let cause = format!(
            "the damping of `{}` ({} {unit}) brakes the inertia{of} with a time constant of {} s",
            term.element,
            short(self.dampers[damper?.0].1),
            short(1.0 / rate)
        );
        Some(((term.element.clone(), "damping"), cause))
    }
}

/// Three digits.
fn short(value: f64) -> String {
    if (1e-2..1e4).contains(&value.abs()) {
        let text = format!("{value:.2}");
        return text.trim_end_matches('0').trim_end_matches('.').to_string();
    }
    let text = format!("{value:.2e}");
    let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    format!("{}e{exponent}", digits.trim_end_matches('0').trim_end_matches('.'))
}

/// Warns of gears that jam whenever their load drives them.
fn check_teeth(document: &Document, variant: &PreparedVariant, out: &mut Vec<Diagnostic>) {
    if variant.reduced.equations.gear_losses().next().is_none() {
        return;
    }
    let setup = Setup { reduced: &variant.reduced, laws: &variant.implemented, scenario: &variant.scenario };
    for element in locking_gears(setup) {
        let message = format!(
            "the gear `{element}` is self-locking against the inertia of its load: whenever the load drives the \
             rotating gear, it jams (Painlevé), and kardan ends a run that stays jammed"
        );
        let warning = Diagnostic::warning("gear::jamming", message).at(place_of(document, &element), "jams");
        out.push(warning.help(UNJAM.replacen("Give", "give", 1)));
    }
}

/// Warns of a run that takes very long, or that may end because a gear jams.
pub(in crate::study) fn check_effort(document: &Document, variant: &PreparedVariant, out: &mut Vec<Diagnostic>) {
    check_teeth(document, variant, out);
    let Effort { steps, element, cause, .. } = expected_effort(variant);
    if !(steps > MANY_STEPS) {
        return;
    }
    let duration = variant.scenario.duration;
    let place = element.as_ref().and_then(|(name, key)| Some(document.elements.get(name)?.table.place_of(key)));
    let message = format!(
        "the run of {} s may take about {} steps of an explicit method: {cause}",
        short(duration),
        short(steps)
    );
    let (place, label) = match place {
        Some(place) => (place, "the fastest motion comes from here"),
        None => (document.scenario.place_of("duration"), "this duration"),
    };
    out.push(Diagnostic::warning("run::steps", message).at(place, label).help(
        "check this number and its unit; remove so fast a motion (by a rigid connection, or no inertia of its own), \
         or shorten `duration`. Where that motion is damped, `--method radau` (which `--method automatic` takes \
         then) needs no such steps; with gear losses, or with laws that compute at every instant, that method is not \
         available. `kardan run` takes `--max-steps N` and `--time-limit SECONDS`, and keeps the results so far when \
         they are reached",
    ));
}
