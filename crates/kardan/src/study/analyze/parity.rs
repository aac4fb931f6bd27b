//! `kardan analyze --parity`: which faults the sensors of a model can detect and isolate, and by which relations between them.

use std::collections::BTreeSet;

use crate::study::analyze::sensitivity::Varied;
use crate::study::analyze::thresholds::{Part, Reading, pulse, readings, threshold};
use crate::study::operating_point::working_point::{AnalyzeSettings, ParitySettings, WorkingPoint};
use crate::study::{Prepared, PreparedVariant};
use kardan_analysis::{
    Broken, ConstrainedSystem, Goal, LinearSystem, OutputSignal, ParitySignal, Relation, Transfer,
    constant_is_detectable, linear_system, multiplier_constraint_classes, relation_is_satisfied, relations,
    smallest_sets, static_relations,
};
use kardan_math::num::{Rational, rational_to_f64};
use kardan_mechanics::assemble::DirectionalTerm;
use kardan_mechanics::equations::Measured;
use kardan_mechanics::reduce::Kinematics;
use kardan_model::Document;
use kardan_results::signal_name::{Quantity, SignalName};
use kardan_results::{FaultPlace, FaultVerdict, Parity, ParityTerm, Residual, SensorSets, Threshold};
use kardan_schema::diagnostics::Diagnostic;
use kardan_simulate::signal_names;

/// The options and the model.
struct Subject<'a> {
    variant: &'a PreparedVariant,
    at: WorkingPoint,
    /// The outputs of the sensors, then those of candidate locations.
    outputs: Vec<OutputSignal>,
    sensors: usize,
    /// With all inputs, and last the torques of friction.
    system: ConstrainedSystem,
    commanded: Vec<usize>,
    unknown: Vec<usize>,
    frictions: Vec<usize>,
    /// The model at the ends of the tolerances of its parameters, one by one.
    ends: Vec<[Option<ConstrainedSystem>; 2]>,
}

/// Default time constant of the filter of a residual in time, in samples.
const FILTER: f64 = 10.0;

/// Largest such time constant, in samples.
const MOST_SAMPLES: f64 = 10_000.0;

/// Properties of the readings, and the options of residuals.
struct ResidualContext<'a> {
    readings: &'a [Reading],
    /// The sensors of the model at the ends of its tolerances.
    corners: &'a [[Option<LinearSystem>; 2]],
    options: &'a ParitySettings,
    /// The shortest sample time of a controller or of blocks, s: the sampling of signals that are read at every instant.
    otherwise: Option<f64>,
}

impl ResidualContext<'_> {
    fn reading(&self, signal: ParitySignal) -> Option<&Reading> {
        match signal {
            ParitySignal::Output(k) => Some(&self.readings[k]),
            ParitySignal::Input(_) => None,
        }
    }
}

/// Whether two relations have the same derivatives of the same signals.
fn same_terms(one: &Relation, other: &Relation) -> bool {
    let keys =
        |relation: &Relation| relation.terms.iter().map(|(signal, order, _)| (*signal, *order)).collect::<Vec<_>>();
    keys(one) == keys(other)
}

/// Adds the change of the coefficients of a relation by one parameter within its tolerance: `moved`, at the ends of it.
fn add_tolerances(terms: &mut [ParityTerm], relation: &Relation, moved: &[Relation]) {
    for (k, term) in terms.iter_mut().enumerate() {
        let nominal = rational_to_f64(&relation.terms[k].2);
        let away = |moved: &Relation| (rational_to_f64(&moved.terms[k].2) - nominal).abs();
        term.tolerance += moved.iter().map(away).fold(0.0, f64::max);
    }
}

/// The detectable faults of the sensors.
pub(in crate::study) fn parity(
    document: &Document,
    prepared: &Prepared,
    variant: &PreparedVariant,
    settings: &AnalyzeSettings,
    notes: &mut Vec<String>,
) -> Result<Option<Parity>, Vec<Diagnostic>> {
    let Some(options) = &settings.parity else { return Ok(None) };
    let mut subject = Subject::of(variant, settings)?;
    if subject.sensors == 0 {
        notes.push("parity: the model has no sensor".into());
        return Ok(None);
    }
    // With multiplier constraints the model belongs to the operating point of the variant, which other values would move.
    if variant.unfrozen.is_none() && subject.at.motion.is_empty() {
        subject.ends = Varied::of(document, prepared, variant, &subject.at).ends(&subject.at.inputs);
    }
    let all = subject.pencil(&subject.system, &subject.outputs);
    let Some(transfer) = Transfer::new(&all) else {
        let message = "a motion has neither inertia nor damping nor spring, so the model does not determine it";
        let help = "give its shaft an inertia or a damping, or leave `--parity` out";
        return Err(Diagnostic::error("analysis::parity", message).help(help).into());
    };
    let own = subject.pencil(&subject.system, &subject.outputs[..subject.sensors]);
    let found = static_relations(&own, &subject.commanded);
    let (readings, corners) = (readings(variant, &subject.outputs[..subject.sensors]), subject.corners());
    let tasks = variant.scenario.tasks.iter().filter_map(|task| Some(task.period.as_ref()?.to_f64()));
    let laws = variant.implemented.iter().filter_map(|law| Some(law.clock()?.period));
    let otherwise = tasks.chain(laws).reduce(f64::min);
    let context = ResidualContext { readings: &readings, corners: &corners, options, otherwise };
    let shortest =
        readings.iter().filter_map(|reading| reading.sample_time).chain(otherwise).fold(f64::INFINITY, f64::min);
    if let Some(filter) = options.filter.filter(|filter| *filter > MOST_SAMPLES * shortest) {
        let message = format!(
            "a filter of {filter} s is longer than {MOST_SAMPLES} samples of {shortest} s: no threshold is computed for that"
        );
        let help = format!("choose at most {} s, or leave `--filter` out: ten samples", MOST_SAMPLES * shortest);
        return Err(Diagnostic::error("analysis::filter", message).help(help).into());
    }
    let conditions = subject.conditions();
    let name = |k: &usize| subject.system.inputs[*k].element.clone();
    Ok(Some(Parity {
        sensors: own.outputs.clone(),
        commands: subject.commanded.iter().map(name).collect(),
        unknown: subject.unknown.iter().map(name).collect(),
        independent: found.independent,
        exhaustive: found.all,
        residuals: found.relations.iter().map(|one| subject.residual(one, &conditions, &context)).collect(),
        exact: transfer.is_exact(),
        faults: subject.verdicts(&own, &transfer, &context),
        sets: subject.sets(&transfer),
    }))
}

impl<'a> Subject<'a> {
    fn of(variant: &'a PreparedVariant, settings: &AnalyzeSettings) -> Result<Self, Vec<Diagnostic>> {
        let equations = &variant.reduced.equations;
        let mut settings = settings.clone();
        if settings.outputs.is_empty() {
            settings.outputs = equations.sensors.iter().map(|(name, _)| name.clone()).collect();
        }
        let commanded_names = WorkingPoint::of(variant, &settings, &mut Vec::new())?.inputs;
        settings.inputs = equations.inputs.iter().map(|input| input.element.clone()).collect();
        let at = WorkingPoint::of(variant, &settings, &mut Vec::new())?;
        let mut outputs = at.outputs.clone();
        let sensors = outputs.len();
        for place in &variant.analysis.sensors {
            let rate = SignalName::new(&place.signal).is_rate();
            let measured = if rate { Measured::Speed } else { Measured::Angle }(place.shaft.clone());
            if outputs.iter().all(|candidate| candidate.measured != measured && candidate.name != place.signal) {
                outputs.push(OutputSignal { name: place.signal.clone(), measured });
            }
        }
        let inputs = at.inputs.len();
        let (commanded, unknown) = (0..inputs).partition(|&k| commanded_names.contains(&at.inputs[k]));
        let mut system = at.system.clone();
        let sliding = equations.frictions.iter().map(|one| (&one.element, &one.row));
        let sliding =
            sliding.chain(equations.gear_losses().map(|(unilateral, _)| (&unilateral.element, &unilateral.row)));
        let free = sliding.filter(|(element, _)| !at.stuck.contains(*element));
        let rows = free.map(|(element, row)| DirectionalTerm { element: element.clone(), row: row.clone(), value: () });
        system.inputs.extend(rows);
        let frictions = (inputs..system.inputs.len()).collect();
        Ok(Self { variant, at, outputs, sensors, system, commanded, unknown, frictions, ends: Vec::new() })
    }

    fn pencil(&self, system: &ConstrainedSystem, outputs: &[OutputSignal]) -> LinearSystem {
        let (coordinates, basis) = system.explicit_basis(&self.variant.reduced.coordinates);
        linear_system(system, &coordinates, &basis, outputs)
    }

    fn terms(&self, relation: &Relation) -> Vec<ParityTerm> {
        let term = |(signal, derivative, coefficient): &(ParitySignal, usize, Rational)| ParityTerm {
            signal: match signal {
                ParitySignal::Output(k) => self.outputs[*k].name.clone(),
                ParitySignal::Input(k) => format!("{}.tau", self.system.inputs[*k].element),
            },
            derivative: *derivative,
            coefficient: coefficient.to_string(),
            value: rational_to_f64(coefficient),
            tolerance: 0.0,
        };
        relation.terms.iter().map(term).collect()
    }

    /// The sensors of the model at the ends of its tolerances.
    fn corners(&self) -> Vec<[Option<LinearSystem>; 2]> {
        let end = |end: &Option<ConstrainedSystem>| {
            let system = ConstrainedSystem { inputs: self.system.inputs.clone(), ..end.clone()? };
            Some(self.pencil(&system, &self.outputs[..self.sensors]))
        };
        self.ends.iter().map(|[a, b]| [end(a), end(b)]).collect()
    }

    fn residual(
        &self,
        relation: &Relation,
        conditions: &[(String, LinearSystem)],
        context: &ResidualContext<'_>,
    ) -> Residual {
        let mut terms = self.terms(relation);
        for ends in context.corners {
            let moved = |end: &LinearSystem| {
                let moved =
                    (!relation_is_satisfied(end, relation)).then(|| static_relations(end, &self.commanded).relations);
                moved.into_iter().flatten().find(|candidate| same_terms(candidate, relation))
            };
            let moved: Vec<Relation> = ends.iter().flatten().filter_map(moved).collect();
            add_tolerances(&mut terms, relation, &moved);
        }
        let measured = |signal: &ParitySignal| match signal {
            ParitySignal::Output(k) => Some(&self.outputs[*k].measured),
            ParitySignal::Input(_) => None,
        };
        let kinds: Vec<Option<&Measured>> = relation.terms.iter().map(|(signal, ..)| measured(signal)).collect();
        let up_to_constant =
            kinds.iter().any(|kind| matches!(kind, Some(Measured::Angle(_) | Measured::SpringTorque(_))));
        let broken = conditions.iter().filter(|(_, excluding)| !relation_is_satisfied(excluding, relation));
        let has_command = relation.terms.iter().any(|(signal, ..)| matches!(signal, ParitySignal::Input(_)));
        let parts: Vec<Part<'_>> = relation
            .terms
            .iter()
            .map(|(signal, _, x)| Part { reading: context.reading(*signal), pulse: vec![rational_to_f64(x)] })
            .collect();
        let all: Vec<usize> = (0..parts.len()).collect();
        Residual {
            terms,
            unit: match relation.terms.first() {
                Some((ParitySignal::Output(k), ..)) => context.readings[*k].unit.clone(),
                _ => String::new(),
            },
            linearised_at: broken.map(|(element, _)| element.clone()).collect::<BTreeSet<_>>().into_iter().collect(),
            up_to_constant,
            constant: self.constant(relation, &kinds),
            threshold: if has_command { None } else { threshold(&parts, &all, context.options, None) },
        }
    }

    /// The threshold of a relation in time that a fault breaks, filtered.
    fn filtered(&self, relation: &Relation, fault: ParitySignal, context: &ResidualContext<'_>) -> Option<Threshold> {
        let mut signals: Vec<ParitySignal> = relation.terms.iter().map(|(signal, ..)| *signal).collect();
        signals.dedup();
        let place = signals.iter().position(|signal| *signal == fault)?;
        let times = signals.iter().filter_map(|signal| context.reading(*signal)?.sample_time);
        let own = times.fold(0.0, f64::max);
        let sample_time = if own > 0.0 { own } else { context.otherwise? };
        if relation.order() == 0 {
            return None;
        }
        let filter = context.options.filter.unwrap_or(FILTER * sample_time);
        let part = |signal: &ParitySignal| {
            let terms = relation.terms.iter().filter(|(candidate, ..)| candidate == signal);
            let terms: Vec<(usize, f64)> = terms.map(|(_, derivative, x)| (*derivative, rational_to_f64(x))).collect();
            Part { reading: context.reading(*signal), pulse: pulse(&terms, relation.order(), filter, sample_time) }
        };
        let parts: Vec<Part<'_>> = signals.iter().map(part).collect();
        threshold(&parts, &[place], context.options, Some((filter, sample_time)))
    }

    /// The unit of a fault's amount.
    fn fault_unit(&self, fault: ParitySignal, context: &ResidualContext<'_>) -> String {
        let input = match fault {
            ParitySignal::Output(k) => return context.readings[k].unit.clone(),
            ParitySignal::Input(k) => &self.system.inputs[k].element,
        };
        let signals = signal_names(&self.variant.reduced, &self.variant.scenario);
        let efforts =
            [Quantity::Torque, Quantity::Force, Quantity::Voltage, Quantity::Current].map(|one| one.of(input));
        let own = signals.iter().find(|(name, _)| efforts.contains(name));
        own.map_or_else(String::new, |(_, physical)| physical.unit().into())
    }

    /// The unit of a relation, that of its first term.
    fn unit(&self, relation: &Relation, context: &ResidualContext<'_>) -> String {
        let Some((ParitySignal::Output(k), derivative, _)) = relation.terms.first() else { return String::new() };
        let own = &context.readings[*k].unit;
        let (own, more) = own.strip_suffix("/s").map_or((own.as_str(), 0), |own| (own, 1));
        match derivative + more {
            0 => own.into(),
            1 => format!("{own}/s"),
            power => format!("{own}/s^{power}"),
        }
    }

    /// The model without one element that is linear only at the operating point: a relation that needs it is valid only there.
    fn conditions(&self) -> Vec<(String, LinearSystem)> {
        let equations = &self.variant.reduced.equations;
        let classes = self.variant.unfrozen.iter().flat_map(|unfrozen| multiplier_constraint_classes(unfrozen));
        let mut elements: BTreeSet<String> = classes.map(|(class, _)| class.element).collect();
        elements.extend(equations.transmissions.iter().map(|one| one.element.clone()));
        elements.extend(self.at.stuck.iter().cloned());
        elements.extend(self.system.loads.iter().map(|load| load.element.clone()));
        let excluding = |element: &String| {
            let mut system = self.system.clone();
            system.constraints.retain(|one| one.element != *element);
            system.loads.retain(|one| one.element != *element);
            let pencil = self.pencil(&system, &self.outputs[..self.sensors]);
            (element.clone(), pencil)
        };
        elements.iter().map(excluding).collect()
    }

    /// The value of a residual of angles, speeds and spring torques in the model at rest.
    fn constant(&self, relation: &Relation, kinds: &[Option<&Measured>]) -> Option<f64> {
        if self.variant.unfrozen.is_some() {
            return None;
        }
        let reduced = &self.variant.reduced;
        let kinematics = Kinematics::at_rest(reduced, &self.at.position);
        let angle = |name: &String| {
            let shaft = reduced.equations.coordinates.iter().position(|shaft| shaft == name);
            shaft.map_or(0.0, |shaft| kinematics.angles[shaft])
        };
        let (mut sum, mut size) = (0.0, 0.0);
        for ((.., x), kind) in relation.terms.iter().zip(kinds) {
            let value = match kind {
                Some(Measured::Angle(name)) => angle(name),
                Some(Measured::Speed(_)) => 0.0,
                Some(Measured::SpringTorque(element)) => {
                    let own = reduced.equations.springs.iter().filter(|spring| spring.element == *element);
                    let twist =
                        |row: Vec<(usize, f64)>| row.iter().map(|(k, x)| x * kinematics.angles[*k]).sum::<f64>();
                    own.map(|one| one.value.stiffness.to_f64() * (twist(one.row_f64()) - one.value.rest.to_f64())).sum()
                }
                _ => return None,
            };
            let term: f64 = rational_to_f64(x) * value;
            (sum, size) = (sum + term, size + term.abs());
        }
        // Rounding residues count as zero.
        Some(if f64::abs(sum) <= 1e-12 * size { 0.0 } else { sum })
    }

    fn verdicts(&self, own: &LinearSystem, transfer: &Transfer, context: &ResidualContext<'_>) -> Vec<FaultVerdict> {
        let sensors: Vec<usize> = (0..self.sensors).collect();
        let of_inputs = self.commanded.iter().map(|&k| ParitySignal::Input(k));
        let faults: Vec<ParitySignal> = sensors.iter().map(|&k| ParitySignal::Output(k)).chain(of_inputs).collect();
        let name = |fault: &ParitySignal| match fault {
            ParitySignal::Output(k) => own.outputs[*k].clone(),
            ParitySignal::Input(k) => self.system.inputs[*k].element.clone(),
        };
        let (groups, silent) = transfer.groups(&sensors, &faults, &self.unknown);
        let found = relations(own, &faults, &self.commanded, &self.unknown);
        let of_end = |end: &LinearSystem| relations(end, &faults, &self.commanded, &self.unknown);
        let corners: Vec<[Option<Vec<Option<Broken>>>; 2]> =
            context.corners.iter().map(|ends| ends.each_ref().map(|end| end.as_ref().map(of_end))).collect();
        let rubbed: Vec<usize> = self.unknown.iter().chain(&self.frictions).copied().collect();
        let verdict = |(k, found): (usize, Option<Broken>)| {
            let fault = faults[k];
            let shown = !silent.contains(&k);
            let same_group = groups.iter().find(|group| group.contains(&k)).into_iter().flatten();
            let found = found.unwrap_or_default();
            let friction: BTreeSet<&String> = found.moved_by.iter().map(|j| &self.system.inputs[*j].element).collect();
            let relation = (!found.relation.terms.is_empty()).then_some(&found.relation);
            let mut terms = relation.map(|one| self.terms(one)).unwrap_or_default();
            for ends in &corners {
                let moved = |end: &Vec<Option<Broken>>| Some(end[k].as_ref()?.relation.clone());
                let moved = ends.iter().flatten().filter_map(moved).filter(|other| same_terms(other, &found.relation));
                add_tolerances(&mut terms, &found.relation, &moved.collect::<Vec<_>>());
            }
            FaultVerdict {
                fault: name(&fault),
                location: if matches!(fault, ParitySignal::Output(_)) { FaultPlace::Sensor } else { FaultPlace::Input },
                detectable: shown,
                strongly_detectable: if shown {
                    constant_is_detectable(own, fault, &self.unknown)
                } else {
                    Some(false)
                },
                detectable_despite_friction: (!self.frictions.is_empty())
                    .then(|| transfer.detects(&sensors, fault, &rubbed)),
                not_isolable_from: same_group.filter(|&&other| other != k).map(|&other| name(&faults[other])).collect(),
                order: relation.map(Relation::order),
                friction_in_relation: friction.into_iter().cloned().collect(),
                unit: relation.map(|one| self.unit(one, context)).unwrap_or_default(),
                fault_unit: self.fault_unit(fault, context),
                threshold: relation.and_then(|one| self.filtered(one, fault, context)),
                relation: terms,
            }
        };
        found.into_iter().enumerate().map(verdict).collect()
    }

    fn sets(&self, transfer: &Transfer) -> Vec<SensorSets> {
        let candidates: Vec<String> = self.outputs.iter().map(|output| output.name.clone()).collect();
        let goals = self
            .commanded
            .iter()
            .map(|&k| (format!("detect a fault of {}", self.system.inputs[k].element), Goal::Shows(k)));
        let every = [
            ("detect every fault, also of the set's own sensors", Goal::ShowsAll),
            ("detect every fault and isolate it from all others", Goal::Isolates),
        ];
        let goals = goals.chain(every.map(|(text, goal)| (text.to_string(), goal)));
        let search = |(goal, goal_kind)| {
            let found = smallest_sets(transfer, goal_kind, &self.commanded, &self.unknown);
            let names = |set: Vec<usize>| set.into_iter().map(|k| candidates[k].clone()).collect();
            let sets = found.sets.into_iter().map(names).collect();
            SensorSets { goal, candidates: candidates.clone(), sets, exhaustive: found.all }
        };
        goals.map(search).collect()
    }
}
