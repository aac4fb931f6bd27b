//! The columns of a run: which signals there are and how they are read from the machine.

use std::collections::{HashMap, HashSet};

use super::failing_sensor::FailingSensor;
use super::machine::{Found, Machine};
use super::readings::Readings;
use super::sampler::{Compliance, Read, Sampler, stiffness};
use super::scenario::{Scenario, Source, SourceTarget};
use kardan_expr::expr::Expr;
use kardan_math::num::{StateArchive, rational_to_f64};
use kardan_mechanics::assemble::DirectionalTerm;
use kardan_mechanics::equations::{Domain, InputKind, UnilateralConstraint};
use kardan_mechanics::reduce::{Motion, Reduced};
use kardan_results::signal_name::Quantity;
use kardan_results::{Physical, Signal};

/// Names and kinds of all signals of a run, in the order of the columns.
pub fn signal_names(reduced: &Reduced, scenario: &Scenario) -> Vec<(String, Physical)> {
    Outputs::new(reduced, scenario).signals.into_iter().map(|signal| (signal.name, signal.physical)).collect()
}

/// The columns of a run, as they are listed, with where their values come from.
struct Columns<'a> {
    reduced: &'a Reduced,
    list: Vec<(Signal, Read)>,
}

impl Columns<'_> {
    fn add(&mut self, name: String, physical: Physical, description: String, read: Read) {
        self.list.push((Signal { name, physical, description, values: Vec::new() }, read));
    }

    /// A quantity of an element.
    fn add_of(&mut self, quantity: Quantity, element: &str, description: String, read: Read) {
        self.add(quantity.of(element), quantity.physical(), description, read);
    }

    /// The effort in an element: its torque, force or voltage.
    fn add_effort(&mut self, effort: Quantity, element: &str, read: Read) {
        self.add_of(effort, element, format!("{} of {element}", effort.physical().word()), read);
    }

    /// Angles and speeds; charges, currents and voltages of branches.
    fn add_shafts(&mut self) {
        let equations = &self.reduced.equations;
        for (k, shaft) in equations.coordinates.iter().enumerate() {
            let domain = equations.domain(k);
            let through = domain == Domain::Charge;
            let place = if through { "through".into() } else { format!("of {}", domain.carrier()) };
            for (quantity, read) in domain.motion().into_iter().zip([Read::Angle(k), Read::Speed(k)]) {
                self.add_of(quantity, shaft, format!("{} {place} {shaft}", quantity.physical().word()), read);
            }
            // A source has its own voltage.
            if through && equations.inputs.iter().all(|input| input.row.iter().all(|(charge, _)| *charge != k)) {
                // A current source counts it as the voltage that supplies power.
                let own = equations.multiplier_constraints.iter().map(|constraint| &constraint.element);
                let is_prescribed = equations.moving.keys().chain(own).any(|element| element == shaft);
                let sign = if is_prescribed { -1.0 } else { 1.0 };
                let share = |(row, directional): (usize, &DirectionalTerm<_>)| {
                    let share = directional.row_f64().into_iter().find(|(charge, _)| *charge == k);
                    share.filter(|_| equations.node(row).is_some()).map(|(_, x)| (row, sign * x))
                };
                let shares = equations.constraints.iter().enumerate().filter_map(share).collect();
                self.add_of(Quantity::Voltage, shaft, format!("voltage across {shaft}"), Read::Potentials(shares));
            }
        }
    }

    /// Torques of motors, voltages of sources.
    fn add_inputs(&mut self) {
        let equations = &self.reduced.equations;
        for (k, input) in equations.inputs.iter().enumerate() {
            let name = &input.element;
            let effort = equations.domain_of(input).effort();
            let (physical, word) = (effort.physical(), effort.physical().word());
            let InputKind::Motor(motor) = &input.value else { continue };
            self.add_effort(effort, name, Read::Torque(k));
            if motor.torque_limit.is_some() || motor.rate_limit.is_some() || motor.lag.is_some() {
                let description = format!("commanded {word} of {name}, before limits and lag");
                self.add(Quantity::Command.of(name), physical, description, Read::Command(k));
            }
            if motor.ripple.is_some() {
                let description = format!("{word} that {name} adds to its reported value");
                self.add(Quantity::Ripple.of(name), physical, description, Read::Ripple(k));
            }
        }
    }

    /// Multipliers and their torques on shafts; potentials of nodes.
    fn add_constraints(&mut self) {
        let equations = &self.reduced.equations;
        for (k, element) in self.reduced.constraint_elements().into_iter().enumerate() {
            if equations.node(k).is_some() {
                let description = format!("potential of node {element}");
                self.add_of(Quantity::Voltage, element, description, Read::Multiplier(k));
                continue;
            }
            // The torques of a transformer are the voltages of its windings, which are listed already.
            if equations.is_equilibrium(k) {
                continue;
            }
            let linear = self.reduced.linear_constraint(k);
            if linear.is_some_and(|row| equations.domain_of(row) == Domain::Charge) {
                continue;
            }
            let own = || linear.map_or(Domain::Rotation, |row| equations.domain_of(row));
            let effort = equations.measures.get(element).copied().unwrap_or_else(own).effort();
            self.add_of(effort, element, format!("constraint multiplier of {element}"), Read::Multiplier(k));
            let shafts: Vec<usize> = match linear {
                Some(constraint) => constraint.row.iter().map(|(shaft, _)| *shaft).collect(),
                None => {
                    let transmission = &equations.transmissions[k - equations.constraints.len()];
                    vec![transmission.driven, transmission.driving]
                }
            };
            // An angle behind backlash has the name of its element.
            for shaft in shafts.into_iter().filter(|shaft| equations.coordinates[*shaft] != *element) {
                self.on_body(element, shaft, "constraint ", Read::ConstraintTorque(k, shaft));
            }
        }
    }

    /// Multipliers of multiplier constraints, and of those that follow from them, and their torques on shafts.
    fn add_multipliers(&mut self) {
        let equations = &self.reduced.equations;
        let first = equations.set_valued().count();
        let number =
            |name: &str| equations.multiplier_constraints.iter().position(|constraint| constraint.element == *name);
        let own =
            equations.multiplier_constraints.iter().enumerate().map(|(k, constraint)| (constraint, vec![(k, 1.0)]));
        let again = equations.dependent_constraints.iter().map(|again| {
            let parts = again.shares.iter().filter_map(|(name, x)| Some((number(name)?, rational_to_f64(x))));
            (&again.row, parts.collect())
        });
        for ((constraint, parts), shares) in own.chain(again).zip(self.reduced.split_multipliers()) {
            if equations.domain_of_multiplier(constraint) == Some(Domain::Charge) {
                continue;
            }
            // The sign of a multiplier is opposite to that of a friction torque.
            let shares: Vec<(usize, f64)> = shares.iter().map(|(k, x)| (first + k, -rational_to_f64(x))).collect();
            let element = &constraint.element;
            let (multiplier, physical) = equations.multiplier_quantity(constraint);
            let description = format!("constraint multiplier of {element}");
            self.add(multiplier.of(element), physical, description, Read::Frictions(shares.clone()));
            for shaft in equations.shafts_of(&constraint.law) {
                let parts: Vec<(usize, f64)> = Vec::clone(&parts);
                self.on_body(element, shaft, "constraint ", Read::MultiplierOn(parts, shares.clone(), shaft));
            }
        }
    }

    fn add_compliances(&mut self) {
        let reduced = self.reduced;
        for compliance in &reduced.equations.compliances {
            let element = &compliance.element;
            let torque = |shaft| Read::Compliance(Compliance::new(reduced, element, shaft).expect("a compliance"));
            let effort = reduced.equations.domain_of(compliance).effort();
            let description = format!("{} of {element} in place of a constraint multiplier", effort.physical().word());
            self.add_of(effort, element, description, torque(None));
            for (shaft, _) in &compliance.row {
                self.on_body(element, *shaft, "", torque(Some(*shaft)));
            }
        }
    }

    /// Springs and dampers between shafts.
    fn add_couplings(&mut self) {
        let (reduced, equations) = (self.reduced, &self.reduced.equations);
        let is_rotation = |spring: &&DirectionalTerm<_>| equations.domain_of(spring) != Domain::Charge;
        let mut couplings: Vec<&str> =
            equations.springs.iter().filter(is_rotation).map(|s| s.element.as_str()).collect();
        couplings
            .extend(equations.dampers.iter().map(|d| d.element.as_str()).filter(|e| reduced.coordinate(e).is_none()));
        couplings.sort_unstable();
        couplings.dedup();
        let compliances: HashSet<&str> = equations.compliances.iter().map(|one| one.element.as_str()).collect();
        let (of_springs, of_dampers) = (by_element(&equations.springs), by_element(&equations.dampers));
        for element in couplings.into_iter().filter(|element| !compliances.contains(element)) {
            let numbers = |all: &HashMap<&str, Vec<usize>>| all.get(element).cloned().unwrap_or_default();
            let (springs, dampers) = (numbers(&of_springs), numbers(&of_dampers));
            let spring = springs.first().map(|k| equations.domain_of(&equations.springs[*k]));
            let damper = dampers.first().map(|k| equations.domain_of(&equations.dampers[*k]));
            let effort = spring.or(damper).unwrap_or_default().effort();
            let read = Read::SpringDamper { springs, dampers };
            let description = format!("spring and damper {} of {element}", effort.physical().word());
            self.add_of(effort, element, description, read);
        }
    }

    /// Clutches, stops and locks: for each element its torque, summed over both ends.
    fn add_unilaterals(&mut self) {
        let equations = &self.reduced.equations;
        let (first, unilaterals) = (equations.frictions.len(), &equations.unilaterals);
        let is_loss = |one: &DirectionalTerm<_>| matches!(one.value, UnilateralConstraint::GearLoss(_));
        let mut of_elements = by_element(unilaterals);
        of_elements.values_mut().for_each(|numbers| numbers.retain(|k| !is_loss(&unilaterals[*k])));
        let transmissions: HashSet<&str> = equations.transmissions.iter().map(|one| one.element.as_str()).collect();
        for (k, unilateral) in unilaterals.iter().enumerate() {
            if is_loss(unilateral) {
                let physical = equations.domain_of_unilateral(unilateral).effort().physical();
                let description = format!("gear loss of {}", unilateral.element);
                self.add(Quantity::Friction.of(&unilateral.element), physical, description, Read::Friction(first + k));
                continue;
            }
            let numbers = &of_elements[unilateral.element.as_str()];
            if numbers[0] != k {
                continue;
            }
            let own: Vec<_> = numbers.iter().map(|other| (*other, &unilaterals[*other])).collect();
            let bent = transmissions.contains(unilateral.element.as_str());
            // For a nonlinear transmission the multiplier is that torque.
            if !bent {
                let shares =
                    own.iter().map(|(other, one)| (first + other, if one.value.is_upper() { -1.0 } else { 1.0 }));
                let effort = equations.domain_of(unilateral).effort();
                self.add_effort(effort, &unilateral.element, Read::Frictions(shares.collect()));
            }
            let differ = || unilateral.row_f64().iter().any(|(_, x)| x.abs() != 1.0);
            if bent || equations.measures.contains_key(&unilateral.element) || differ() {
                self.add_backlash(&own, first);
            }
        }
    }

    /// The torques of the backlash sides of a transmission on its bodies, in units of these.
    fn add_backlash(&mut self, own: &[(usize, &DirectionalTerm<UnilateralConstraint>)], first: usize) {
        let element = &own[0].1.element;
        let bodies = own[0].1.row.iter().map(|(body, _)| *body);
        let bodies: Vec<usize> = bodies.filter(|body| self.reduced.equations.coordinates[*body] != *element).collect();
        for body in bodies {
            let share = |directional: &DirectionalTerm<UnilateralConstraint>| {
                directional.row_f64().iter().find(|(k, _)| *k == body).map_or(0.0, |(_, x)| -x)
            };
            let shares = own.iter().map(|(k, directional)| (first + k, share(directional))).collect();
            self.on_body(element, body, "constraint ", Read::Frictions(shares));
        }
    }

    /// Torques that expressions give.
    fn add_laws(&mut self) {
        let equations = &self.reduced.equations;
        for (k, law) in equations.laws.iter().enumerate() {
            let (element, effort) = (&law.element, equations.domain_of(law).effort());
            if effort == Quantity::Voltage {
                // The voltage of the branch is that of its ends.
                let emf = effort.of(&format!("{element}.emf"));
                self.add(emf, effort.physical(), format!("back-emf of {element}"), Read::Law(k));
                continue;
            }
            self.add_effort(effort, element, Read::Law(k));
        }
    }

    fn add_sources(&mut self, sources: &[Source]) {
        for (k, Source { name, physical, description, target }) in sources.iter().enumerate() {
            // The command of a motor without a law is that motor's torque, which is listed already.
            if let SourceTarget::Input(input) = target
                && matches!(self.reduced.equations.inputs[*input].value, InputKind::Motor(_))
            {
                continue;
            }
            self.add(name.clone(), *physical, description.clone(), Read::Source(k));
        }
    }

    /// The measured quantity of each sensor, and the sensor.
    fn add_sensors(&mut self, scenario: &Scenario) -> Vec<SensorColumn> {
        let reduced = self.reduced;
        let mut samplers = Vec::new();
        let all = reduced.equations.sensors.iter().chain(&reduced.equations.signal_sensors);
        for (name, sensor) in all {
            let measured = &sensor.measured;
            // In a file with an error a signal may be missing.
            let Some(read) = Read::of(measured, reduced, Sampler::differentiates(sensor), |name| scenario.source(name))
            else {
                continue;
            };
            let (shown, physical) = match read {
                Read::Source(source) => (name.clone(), scenario.sources[source].physical),
                _ => (reduced.equations.reading(measured).of(name), reduced.equations.reading(measured).physical()),
            };
            let description = format!("reading of sensor {name}");
            self.add(shown, physical, description, Read::Sensor(samplers.len()));
            let sampler = Sampler::new(name, sensor, stiffness(reduced, measured), scenario.seed);
            let failing = FailingSensor::new(sampler, name, name, scenario);
            samplers.push(SensorColumn { read, failing, shown: 0.0 });
        }
        samplers
    }

    /// The torque of an element on one of its bodies.
    fn on_body(&mut self, element: &str, body: usize, kind: &str, read: Read) {
        let equations = &self.reduced.equations;
        let (name, domain) = (&equations.coordinates[body], equations.domain(body));
        let (effort, physical) = (domain.effort(), domain.effort().physical());
        let description = format!("{kind}{} of {element} on {} {name}", physical.word(), domain.carrier());
        self.add(format!("{element}.{}", effort.of(name)), physical, description, read);
    }
}

/// A sensor that has a column.
struct SensorColumn {
    /// The measured quantity.
    read: Read,
    failing: FailingSensor,
    /// The value of its column: its output, and where that is not a number, its previous output.
    shown: f64,
}

impl SensorColumn {
    /// Reads if it is due, with its faults.
    fn sample(&mut self, time: f64, exact: impl FnOnce() -> f64) {
        if self.failing.sampler.next_time().is_some_and(|next| next > time) {
            return;
        }
        let reading = self.failing.read(time, exact);
        if reading.is_finite() || !self.failing.fails() {
            self.shown = reading;
        }
    }
}

/// Sensors that change the measured value; the columns of the others become those of the measured quantity.
fn resolve(sensors: Vec<SensorColumn>, columns: &mut [(Signal, Read)]) -> Vec<SensorColumn> {
    let mut real_sensors = Vec::new();
    let places: Vec<Read> = sensors
        .into_iter()
        .map(|sensor| {
            if sensor.failing.sampler.is_ideal() && !sensor.failing.fails() {
                return sensor.read;
            }
            real_sensors.push(sensor);
            Read::Sensor(real_sensors.len() - 1)
        })
        .collect();
    for (_, read) in columns {
        if let Read::Sensor(k) = read {
            *read = places[*k].clone();
        }
    }
    real_sensors
}

/// Numbers of the terms of each element.
fn by_element<T>(terms: &[DirectionalTerm<T>]) -> HashMap<&str, Vec<usize>> {
    let mut found: HashMap<&str, Vec<usize>> = HashMap::new();
    terms.iter().enumerate().for_each(|(k, term)| found.entry(&term.element).or_default().push(k));
    found
}

/// Signals by their source.
pub(super) struct SplitSignals {
    pub signals: Vec<Signal>,
    /// The expressions of the first ones.
    pub direct: Vec<Expr>,
    /// The readings of those behind them, in their order.
    pub machine_readings: Option<Readings>,
}

/// Reads all signals of a run.
pub(super) struct Outputs {
    reads: Vec<Read>,
    /// The signals, filled row by row.
    pub signals: Vec<Signal>,
    /// The measured quantity of each sensor, and the sensor.
    samplers: Vec<SensorColumn>,
    /// Values of signals, then of measured quantities; `None` until they are compiled.
    readings: Option<Readings>,
    /// The series of each signal, if all of them have one.
    series: Vec<usize>,
    /// Whether rows must have the same bits as with all signals recorded.
    as_all: bool,
}

impl Outputs {
    /// Lists the signals of a model.
    pub fn new(reduced: &Reduced, scenario: &Scenario) -> Self {
        let equations = &reduced.equations;
        let mut columns = Columns { reduced, list: Vec::new() };
        columns.add_shafts();
        columns.add_inputs();
        columns.add_constraints();
        columns.add_multipliers();
        columns.add_compliances();
        columns.add_couplings();
        columns.add_laws();
        for (k, friction) in equations.frictions.iter().enumerate() {
            let name = &friction.element;
            let physical = equations.domain_of(friction).effort().physical();
            let description = format!("friction {} of {name}", physical.word());
            columns.add(Quantity::Friction.of(name), physical, description, Read::Friction(k));
        }
        columns.add_unilaterals();
        columns.add_sources(&scenario.sources);
        let sensors = columns.add_sensors(scenario);
        let samplers = resolve(sensors, &mut columns.list);
        let recorded = scenario.recorded.as_ref();
        let is_recorded = |(signal, _): &(Signal, Read)| recorded.is_none_or(|all| all.names.contains(&signal.name));
        let (mut signals, reads): (Vec<Signal>, Vec<Read>) = columns.list.into_iter().filter(is_recorded).unzip();
        signals.iter_mut().for_each(|signal| signal.values.reserve_exact(scenario.times.len()));
        let as_all = recorded.is_some_and(|recorded| recorded.as_all);
        Self { reads, signals, samplers, readings: None, series: Vec::new(), as_all }
    }

    /// Compiles the expressions of signals and sensors.
    pub fn compile(&mut self, motion: &mut Motion, reduced: &Reduced, found: &Found) {
        let reads: Vec<&Read> = self.reads.iter().chain(self.samplers.iter().map(|sensor| &sensor.read)).collect();
        self.readings = Some(Readings::new(motion, reduced, found, &reads));
    }

    /// The signals, first those that follow from the state and from the inputs ([`Readings::direct`]), with their
    /// expressions, then the others, with their readings. None where one is the reading of a sensor.
    pub fn split_signals(self, motion: &mut Motion, reduced: &Reduced, found: &Found) -> Option<SplitSignals> {
        if self.reads.iter().any(|read| matches!(read, Read::Sensor(_))) {
            return None;
        }
        let mut out = SplitSignals { signals: Vec::new(), direct: Vec::new(), machine_readings: None };
        let (mut signals, mut reads) = (Vec::new(), Vec::new());
        let direct = Readings::direct(motion, reduced, found, &self.reads);
        for ((signal, read), direct) in self.signals.into_iter().zip(&self.reads).zip(direct) {
            match direct {
                Some(expr) => {
                    out.signals.push(signal);
                    out.direct.push(expr);
                }
                None => {
                    signals.push(signal);
                    reads.push(read);
                }
            }
        }
        out.signals.extend(signals);
        out.machine_readings = (!reads.is_empty()).then(|| Readings::new(motion, reduced, found, &reads));
        Some(out)
    }

    /// Whether sensors read at times of their own.
    pub fn samples(&self) -> bool {
        !self.samplers.is_empty()
    }

    /// The shafts whose angles, and those whose speeds, make a row, where all signals are angles and speeds.
    pub fn shafts(&self) -> Option<[Vec<usize>; 2]> {
        let mut shafts = [Vec::new(), Vec::new()];
        for read in &self.reads {
            match read {
                Read::Angle(shaft) => shafts[0].push(*shaft),
                Read::Speed(shaft) => shafts[1].push(*shaft),
                _ => return None,
            }
        }
        (!self.samples() && !self.as_all).then_some(shafts)
    }

    /// Prepares rows from the series of a machine: where all signals are angles and speeds, and need not have the same
    /// bits as among others.
    pub fn prepare_series(&mut self, machine: &Machine) {
        let of = |read: &Read| match read {
            Read::Angle(shaft) => Some(machine.shaft_series(*shaft)?[0]),
            Read::Speed(shaft) => Some(machine.shaft_series(*shaft)?[1]),
            _ => None,
        };
        let series = if self.samples() || self.as_all { None } else { self.reads.iter().map(of).collect() };
        self.series = series.unwrap_or_default();
    }

    /// Whether rows follow from the series of the motion.
    pub fn has_series(&self) -> bool {
        !self.series.is_empty()
    }

    /// Appends a row, from series of that order, at a time after the last expansion.
    pub fn record_series(&mut self, machine: &Machine, order: usize, later: f64) {
        for (signal, place) in self.signals.iter_mut().zip(&self.series) {
            signal.values.push(machine.series_at(*place, order, later));
        }
    }

    /// The state that the next readings of the sensors depend on.
    pub fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        for SensorColumn { failing, shown, .. } in &mut self.samplers {
            failing.archive_state(archive);
            archive.number(shown);
        }
    }

    /// The value of a signal at the point that was observed last.
    pub fn value(&self, signal: usize) -> f64 {
        match (&self.reads[signal], &self.readings) {
            (Read::Sensor(k), _) => self.samplers[*k].shown,
            (_, Some(readings)) => readings.value(signal),
            (_, None) => f64::NAN,
        }
    }

    /// The next time at which a sampled sensor reads, s.
    pub fn next_sample(&self) -> f64 {
        self.samplers.iter().filter_map(|sensor| sensor.failing.sampler.next_time()).fold(f64::INFINITY, f64::min)
    }

    /// Evaluates the sources of signals and sensors at a point; before `sample` and `record`.
    pub fn observe(&mut self, machine: &mut Machine, time: f64, state: &[f64]) {
        if let Some(readings) = &mut self.readings {
            readings.observe(machine, time, state);
        }
    }

    /// Sensors that are due at this time, which was observed last, read.
    pub fn sample(&mut self, time: f64) {
        let first = self.reads.len();
        let Self { samplers, readings, .. } = self;
        for (k, sensor) in samplers.iter_mut().enumerate() {
            sensor.sample(time, || readings.as_ref().map_or(f64::NAN, |readings| readings.value(first + k)));
        }
    }

    /// Appends the last row `count` times more.
    pub fn record_again(&mut self, count: usize) {
        for values in self.signals.iter_mut().map(|signal| &mut signal.values) {
            if let Some(&last) = values.last() {
                values.extend(std::iter::repeat_n(last, count));
            }
        }
    }

    /// Appends one row, at the point that was observed last.
    pub fn record(&mut self) {
        for k in 0..self.reads.len() {
            let value = self.value(k);
            self.signals[k].values.push(value);
        }
    }
}
