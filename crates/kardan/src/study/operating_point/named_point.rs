//! The operating point of the loop of a variant, at which its laws are designed.

use super::design_in_motion::MotionRequest;
use super::working_point::no_slope;
use crate::study::check::equilibrium::{format_currents, format_position};
use crate::study::check::stop_checks::is_or_are;
use crate::study::read::locations::place_of_value;
use crate::study::read::read_values::read_word;
use crate::study::requests::analysis_spec::operating_point;
use kardan_expr::expr::Side;
use kardan_mechanics::equations::InputKind;
use kardan_mechanics::reduce::{
    OperatingPoint, Reduced, StartValues, Trim, is_linear_law, law_slopes_at, laws_are_linear, start_on_rows, trim,
};
use kardan_model::{ControlSpec, Document, Setting, TableReader};
use kardan_schema::diagnostics::Diagnostic;
use kardan_schema::entries::Place;
use kardan_schema::schema::LawKeys;
use kardan_synthesis::Program;

/// The operating point that the controllers of a variant name together.
pub(in crate::study) struct NamedPoint {
    /// Coordinates with their angles, rad, and their spans.
    named: Vec<(usize, f64, Place)>,
    /// Numbers of the inputs that the controllers command.
    inputs: Vec<usize>,
    /// Positions of coordinates that are not named: zero, or with multiplier constraints those at the start of the run.
    start: Vec<f64>,
    /// The motion that is named in place of an equilibrium.
    pub motion: Option<MotionRequest>,
}

/// An operating point, and the notes on it.
pub(in crate::study) struct Found {
    pub point: OperatingPoint,
    /// The multiplier of each multiplier constraint there, N m.
    pub multipliers: Vec<f64>,
    /// Its position as text, and which properties are proven; empty if there is nothing to report.
    pub point_note: Option<String>,
    /// Why the motors do not balance it, if it was not named.
    pub no_equilibrium: Option<String>,
}

impl NamedPoint {
    /// The value of `at` of the controllers; errors are reported.
    pub fn of(
        document: &Document,
        (reduced, start): (&Reduced, &[f64]),
        controls: &[ControlSpec],
        settings: &[Setting],
        out: &mut Vec<Diagnostic>,
    ) -> Option<Self> {
        let (reader, names) = (TableReader::new(document, settings), reduced.coordinate_names());
        let (before, mut named) = (out.len(), Vec::<(usize, f64, Place)>::new());
        let mut motion = None;
        for control in controls {
            let Some(own) = document.controls.iter().find(|own| own.place == control.place) else { continue };
            let what = format!("control `{}`", control.name);
            let place = own.table.place_of("at").clone();
            let (at, conditions) =
                operating_point((&own.table, &what), (document, &reduced.equations), Some(&names), &reader, out);
            if conditions.moves() {
                add_motion(control, MotionRequest { at, conditions, place }, &mut motion, out);
                continue;
            }
            for (shaft, angle) in at {
                let Some(k) = names.iter().position(|name| *name == shaft) else { continue };
                match named.iter().find(|(other, _, _)| *other == k) {
                    Some((_, other, first)) if *other != angle => {
                        let message = format!("`at` of {what}: another controller has another value of `{shaft}`");
                        out.push(two_points(message, place.clone(), first));
                    }
                    Some(_) => {}
                    None => named.push((k, angle, place.clone())),
                }
            }
        }
        check_start(document, motion.as_ref(), out);
        let start = match reduced.equations.multiplier_constraints.is_empty() {
            true => vec![0.0; start.len()],
            false => start.to_vec(),
        };
        let named_point = Self { named, inputs: commanded(reduced, controls), start, motion };
        (out.len() == before).then_some(named_point)
    }

    /// At zero angles of a model, by the motors of one controller.
    pub fn anywhere(reduced: &Reduced, control: &ControlSpec) -> Self {
        let start = vec![0.0; reduced.degrees_of_freedom()];
        Self { named: Vec::new(), inputs: commanded(reduced, std::slice::from_ref(control)), start, motion: None }
    }

    /// Whether a controller names a point.
    pub fn is_named(document: &Document, control: &ControlSpec) -> bool {
        let own = document.controls.iter().find(|own| own.place == control.place);
        own.is_some_and(|own| own.table.values.contains_key("at"))
    }

    /// The error that the motors do not balance the named point.
    pub fn refusal(&self, document: &Document, controls: &[ControlSpec], why: &str) -> Diagnostic {
        let named = controls.iter().find(|control| Self::is_named(document, control)).or(controls.first());
        let name = named.map_or("", |control| control.name.as_str());
        let place = self.named.first().map(|(_, _, place)| place.clone()).unwrap_or_default();
        Diagnostic::error("control::operating-point", format!("`at` of control `{name}` is no equilibrium: {why}"))
            .at(place, "the motors do not balance it there")
            .help("name fewer coordinates, so that kardan can find the others, or name another position")
    }

    /// The operating point of a model: if it is named, kardan solves for the other coordinates and the torques of motors; else zero angles, with the
    /// torques that balance it.
    ///
    /// # Errors
    /// Why the motors do not balance the model at the named point.
    pub fn find(&self, reduced: &Reduced) -> Result<Found, String> {
        let multiplier_constraints = &reduced.equations.multiplier_constraints;
        let default = OperatingPoint::unloaded(&self.start);
        let nothing = |point_note, no_equilibrium| Found {
            point: default.clone(),
            multipliers: vec![0.0; multiplier_constraints.len()],
            point_note,
            no_equilibrium,
        };
        let laws = &reduced.equations.laws;
        let plain = reduced.equations.transmissions.is_empty() && laws_are_linear(reduced);
        if self.motion.is_some() {
            return Ok(nothing(None, None));
        }
        if self.named.is_empty() && (laws.is_empty() || plain && multiplier_constraints.is_empty()) {
            let begins = || format!("where the run begins: {}", format_position(reduced, &self.start));
            return Ok(nothing((!multiplier_constraints.is_empty()).then(begins), None));
        }
        let mut start = self.start.clone();
        if self.named.is_empty() && !multiplier_constraints.is_empty() {
            // The design values may have multiplier constraints of their own.
            let still = vec![0.0; start.len()];
            start =
                start_on_rows(reduced, &StartValues::default(), &start, &still).map_or(start, |found| found.position);
        }
        self.named.iter().for_each(|(k, angle, _)| start[*k] = *angle);
        let fixed: Vec<usize> = match self.named.is_empty() {
            true => (0..start.len()).collect(),
            false => self.named.iter().map(|(k, _, _)| *k).collect(),
        };
        let found = trim(reduced, &start, &fixed, &self.inputs);
        let why = match found.at_rest {
            true => self.beyond_limits(reduced, &found),
            false => Some(describe_residual(reduced, &found)),
        };
        if let Some(why) = why {
            return if self.named.is_empty() { Ok(nothing(None, Some(why))) } else { Err(why) };
        }
        let point_note = Some(self.point_note(reduced, &found));
        if found.position.iter().chain(&found.rates).chain(&found.torques).chain(&found.multipliers).all(|x| *x == 0.0)
        {
            return Ok(nothing(point_note, None));
        }
        let mut torques = vec![0.0; reduced.equations.inputs.len()];
        self.inputs.iter().zip(&found.torques).for_each(|(input, torque)| torques[*input] = *torque);
        let point = OperatingPoint {
            position: found.position,
            rates: found.rates,
            torques: Some(torques),
            side: Side::default(),
        };
        Ok(Found { point, multipliers: found.multipliers, point_note, no_equilibrium: None })
    }

    fn beyond_limits(&self, reduced: &Reduced, found: &Trim) -> Option<String> {
        self.inputs.iter().zip(&found.torques).find_map(|(&number, torque)| {
            let input = &reduced.equations.inputs[number];
            let InputKind::Motor(motor) = &input.value else { return None };
            let limit = motor.torque_limit.as_ref()?.to_f64();
            let unit = reduced.equations.domain_of(input).effort().unit();
            let (name, size) = (&input.element, torque.abs());
            (size >= limit)
                .then(|| format!("`{name}` would have to give {size:.6} {unit}, and its limit is {limit} {unit}"))
        })
    }

    fn point_note(&self, reduced: &Reduced, found: &Trim) -> String {
        let holding =
            self.inputs.iter().zip(&found.torques).filter(|(_, torque)| **torque != 0.0).map(|(&k, torque)| {
                let input = &reduced.equations.inputs[k];
                format!("{} = {torque:.6} {}", input.element, reduced.equations.domain_of(input).effort().unit())
            });
        let holding: Vec<String> = holding.collect();
        let holding: Vec<String> = holding.into_iter().chain(format_currents(reduced, &found.rates)).collect();
        let by = match holding.is_empty() {
            true => "at rest without torques of motors".to_string(),
            false => format!("balanced by {}", holding.join(", ")),
        };
        let proven = match found.radius {
            Some(0.0) => "proven: the residual torque is exactly zero".into(),
            Some(radius) => {
                format!("proven: there is exactly one within {radius:e} of it, relative to its size or to one")
            }
            None => "to rounding, not proven".to_string(),
        };
        let bent: Vec<&str> = (0..reduced.equations.laws.len())
            .filter(|law| !is_linear_law(reduced, *law))
            .map(|law| reduced.equations.laws[law].element.as_str())
            .collect();
        let local = match bent.is_empty() {
            true => String::new(),
            false => {
                format!(
                    "; {} taken as linear there: design and proofs are for small motions around it",
                    is_or_are(bent)
                )
            }
        };
        format!("{}, {by}; {proven}{local}", format_position(reduced, &found.position))
    }
}

/// Numbers of the inputs that controllers command.
fn commanded(reduced: &Reduced, controls: &[ControlSpec]) -> Vec<usize> {
    let inputs = controls.iter().flat_map(|control| (control.law.inputs)(&control.values));
    let number = |name: String| reduced.equations.inputs.iter().position(|input| input.element == name);
    inputs.filter_map(number).collect()
}

/// The residual torques and their coordinates.
fn describe_residual(reduced: &Reduced, found: &Trim) -> String {
    if let Some((row, off)) = found.unmet.first() {
        let constraint = &reduced.equations.multiplier_constraints[*row];
        let unit = match reduced.equations.domain_of_multiplier(constraint) {
            Some(domain) => domain.motion()[0].unit().to_string(),
            None => reduced.equations.dimension_of_multiplier(constraint).si(),
        };
        return format!(
            "no position was found that satisfies `{}`: the smallest error is {off:.6} {unit}",
            constraint.element
        );
    }
    let Some((k, torque)) = found.residual_torque else { return "a residual torque remains".into() };
    let (name, domain) = (&reduced.coordinate_names()[k], reduced.equations.domain(reduced.coordinates[k]));
    let equations = &reduced.equations;
    let besides = match equations.unilaterals.is_empty() {
        true => "",
        false => "; torques of stops, backlash, clutches and locks are not searched for",
    };
    format!("{torque:.6} {} on `{name}` that no motor of its controllers can balance{besides}", domain.effort().unit())
}

/// Rejects a run that is to begin at an operating point in motion.
fn check_start(document: &Document, motion: Option<&MotionRequest>, out: &mut Vec<Diagnostic>) {
    let Some(motion) = motion else { return };
    if read_word(&document.scenario, "start") == Some("operating_point") {
        let message = "`start = \"operating_point\"` of `[scenario]`: a run begins there at rest, but a controller \
                       names a motion";
        out.push(
            Diagnostic::error("control::operating-point", message)
                .at(document.scenario.place_of("start"), "at rest")
                .at(&motion.place, "this is in motion")
                .help("leave out `start`, and give the speeds that the run begins with by `initial`"),
        );
    }
}

/// The error of a second operating point.
fn two_points(message: String, second: Place, first: &Place) -> Diagnostic {
    Diagnostic::error("control::operating-point", message)
        .at(second, "another one here")
        .at(first, "here first")
        .help("the loop of a variant has one operating point: name the same one, or name it once")
}

/// Adds a motion that a controller names as its operating point to those of others.
fn add_motion(
    control: &ControlSpec,
    request: MotionRequest,
    motion: &mut Option<MotionRequest>,
    out: &mut Vec<Diagnostic>,
) {
    let name = &control.name;
    if control.law.keyword != Program::KEYWORD {
        let message = format!("`at` of control `{name}`: kardan designs a law of this kind at an equilibrium");
        out.push(
            Diagnostic::error("control::operating-point", message)
                .at(request.place, "a speed, a torque or a time")
                .help("give only angles and positions; speeds, torques and `t` are for `law = \"program\"`"),
        );
        return;
    }
    match motion {
        Some(first) if (&first.at, &first.conditions) != (&request.at, &request.conditions) => {
            let message = format!("`at` of control `{name}`: another controller names another motion");
            out.push(two_points(message, request.place, &first.place));
        }
        Some(_) => {}
        None => *motion = Some(request),
    }
}

/// Reports laws of torque that have no slope at the operating point of a controller.
pub(in crate::study) fn check_smooth(
    document: &Document,
    control: &ControlSpec,
    (reduced, point): (&Reduced, &OperatingPoint),
    out: &mut Vec<Diagnostic>,
) -> bool {
    let before = out.len();
    for slopes in law_slopes_at(reduced, point).iter().filter(|slopes| !slopes.undefined.is_empty()) {
        let element = &slopes.element;
        let message = format!("control `{}`: {}", control.name, no_slope(slopes));
        out.push(
            Diagnostic::error("control::not-differentiable", message)
                .at(place_of_value(document, element, "law"), "it has no derivative there")
                .at(&control.place, "this controller")
                .help(format!(
                    "it is linearised at {}: name another point with `at`, or make the expression smooth there",
                    format_position(reduced, &point.position)
                )),
        );
    }
    out.len() == before
}

/// The warning that nothing balances the default point.
pub(in crate::study) fn no_equilibrium(control: &ControlSpec, at: &str, why: &str) -> Diagnostic {
    let message =
        format!("control `{}` is designed at {at}, which is no equilibrium of the model: {why}", control.name);
    Diagnostic::warning("control::operating-point", message)
        .at(&control.place, "this controller")
        .help("name the operating point with `at`; otherwise the residual torque disturbs the loop")
}
