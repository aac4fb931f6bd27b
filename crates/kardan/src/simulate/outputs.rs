//! The columns of a run: which signals there are and how they are read from the machine.

use super::Machine;
use super::sampler::{Compliance, Sampler, stiffness};
use super::scenario::{Scenario, Source, SourceTarget};
use crate::assemble::Along;
use crate::equations::{Domain, InputKind, Measured};
use crate::num::{Keeper, dot, rational_to_f64};
use crate::reduce::{Multipliers, Reduced};
use crate::results::{Physical, Signal};

#[derive(Debug, Clone)]
enum Read {
    Angle(usize),
    Speed(usize),
    Torque(usize),
    Command(usize),
    Ripple(usize),
    Multiplier(usize),
    /// Shaft and its own inertia, kg m².
    NetTorque(usize, f64),
    ConstraintTorque(usize, usize),
    /// Sum of multipliers, each times a number.
    Potentials(Vec<(usize, f64)>),
    SpringDamper {
        springs: Vec<usize>,
        dampers: Vec<usize>,
    },
    Compliance(Compliance),
    Friction(usize),
    Source(usize),
    Sensor(usize),
}

/// Names and kinds of all signals of a run, in the order of the columns.
pub fn signal_names(reduced: &Reduced, scenario: &Scenario) -> Vec<(String, Physical)> {
    Outputs::new(reduced, scenario).signals.into_iter().map(|signal| (signal.name, signal.physical)).collect()
}

/// Reads all signals of a run.
pub(super) struct Outputs {
    reads: Vec<Read>,
    /// The signals, filled row by row.
    pub signals: Vec<Signal>,
    /// What each sensor reads, and the sensor.
    samplers: Vec<(Read, Sampler)>,
    multipliers: Multipliers,
    needs_multipliers: bool,
    lambda: Vec<f64>,
    constraint_force: Vec<f64>,
}

impl Outputs {
    /// Lists the signals of a model.
    pub fn new(reduced: &Reduced, scenario: &Scenario) -> Self {
        let equations = &reduced.equations;
        let multipliers = Multipliers::new(reduced);
        let mut columns: Vec<(String, Physical, String, Read)> = Vec::new();
        let mut add =
            |name: String, physical, description: String, read| columns.push((name, physical, description, read));
        for (k, shaft) in equations.shafts.iter().enumerate() {
            if equations.domain(k) == Domain::Charge {
                add(format!("{shaft}.q"), Physical::Charge, format!("charge through {shaft}"), Read::Angle(k));
                add(format!("{shaft}.i"), Physical::Current, format!("current through {shaft}"), Read::Speed(k));
                // A source shows its own voltage.
                if equations.inputs.iter().all(|input| input.row.iter().all(|(charge, _)| *charge != k)) {
                    let share = |(row, along): (usize, &Along<_>)| {
                        let share = along.row_f64().into_iter().find(|(charge, _)| *charge == k);
                        share.filter(|_| equations.node(row).is_some()).map(|(_, x)| (row, x))
                    };
                    let shares = equations.constraints.iter().enumerate().filter_map(share).collect();
                    add(
                        format!("{shaft}.v"),
                        Physical::Voltage,
                        format!("voltage across {shaft}"),
                        Read::Potentials(shares),
                    );
                }
                continue;
            }
            add(format!("{shaft}.phi"), Physical::Angle, format!("angle of shaft {shaft}"), Read::Angle(k));
            add(format!("{shaft}.w"), Physical::Speed, format!("angular velocity of shaft {shaft}"), Read::Speed(k));
        }
        for (k, input) in equations.inputs.iter().enumerate() {
            let name = &input.element;
            if equations.domain_of(input) == Domain::Charge {
                add(format!("{name}.v"), Physical::Voltage, format!("voltage of {name}"), Read::Torque(k));
            } else if let InputKind::Motor(motor) = &input.value {
                add(format!("{name}.tau"), Physical::Torque, format!("torque of {name}"), Read::Torque(k));
                if motor.torque_limit.is_some() || motor.rate_limit.is_some() || motor.lag.is_some() {
                    let description = format!("torque asked of {name}, before limits and lag");
                    add(format!("{name}.command"), Physical::Torque, description, Read::Command(k));
                }
                if motor.ripple.is_some() {
                    let description = format!("torque that {name} adds to what it reports");
                    add(format!("{name}.ripple"), Physical::Torque, description, Read::Ripple(k));
                }
            }
        }
        for (k, element) in multipliers.elements.iter().enumerate() {
            if equations.node(k).is_some() {
                add(
                    format!("{element}.v"),
                    Physical::Voltage,
                    format!("potential of node {element}"),
                    Read::Multiplier(k),
                );
                continue;
            }
            // The torques of a transformer are the voltages of its windings, which are there already.
            if equations.constraints.get(k).is_some_and(|row| equations.domain_of(row) == Domain::Charge) {
                continue;
            }
            let description = format!("constraint multiplier of {element}");
            add(format!("{element}.tau"), Physical::Torque, description, Read::Multiplier(k));
            let shafts: Vec<usize> = match equations.constraints.get(k) {
                Some(constraint) => constraint.row.iter().map(|(shaft, _)| *shaft).collect(),
                None => {
                    let transmission = &equations.transmissions[k - equations.constraints.len()];
                    vec![transmission.driven, transmission.driving]
                }
            };
            for shaft in shafts {
                let name = &equations.shafts[shaft];
                let description = format!("constraint torque of {element} on shaft {name}");
                add(format!("{element}.{name}.tau"), Physical::Torque, description, Read::ConstraintTorque(k, shaft));
            }
        }
        for compliance in &equations.compliances {
            let element = &compliance.element;
            let torque = |shaft| Read::Compliance(Compliance::new(reduced, element, shaft).expect("a compliance"));
            let description = format!("torque of {element} in place of a constraint multiplier");
            add(format!("{element}.tau"), Physical::Torque, description, torque(None));
            for (shaft, _) in &compliance.row {
                let name = &equations.shafts[*shaft];
                let description = format!("torque of {element} on shaft {name}");
                add(format!("{element}.{name}.tau"), Physical::Torque, description, torque(Some(*shaft)));
            }
        }
        let numbered = |name: &str, elements: Vec<&str>| -> Vec<usize> {
            elements.iter().enumerate().filter(|(_, element)| **element == name).map(|(k, _)| k).collect()
        };
        let springs_of = |name: &str| numbered(name, equations.springs.iter().map(|s| s.element.as_str()).collect());
        let dampers_of = |name: &str| numbered(name, equations.dampers.iter().map(|d| d.element.as_str()).collect());
        let is_rotation = |spring: &&Along<_>| equations.domain_of(spring) == Domain::Rotation;
        let mut couplings: Vec<&str> =
            equations.springs.iter().filter(is_rotation).map(|s| s.element.as_str()).collect();
        couplings.extend(equations.dampers.iter().map(|d| d.element.as_str()).filter(|e| reduced.shaft(e).is_none()));
        couplings.sort_unstable();
        couplings.dedup();
        couplings.retain(|element| equations.compliances.iter().all(|compliance| compliance.element != *element));
        for element in couplings {
            let read = Read::SpringDamper { springs: springs_of(element), dampers: dampers_of(element) };
            add(format!("{element}.tau"), Physical::Torque, format!("spring and damper torque of {element}"), read);
        }
        for (k, friction) in equations.frictions.iter().enumerate() {
            let name = &friction.element;
            add(format!("{name}.friction"), Physical::Torque, format!("friction torque of {name}"), Read::Friction(k));
        }
        for (k, Source { name, physical, description, target }) in scenario.sources.iter().enumerate() {
            // The command of a motor without a law is that motor's torque, which is there already.
            if let SourceTarget::Input(input) = target
                && matches!(equations.inputs[*input].value, InputKind::Motor(_))
            {
                continue;
            }
            add(name.clone(), *physical, description.clone(), Read::Source(k));
        }
        let mut samplers = Vec::new();
        for (name, sensor) in &equations.sensors {
            let measured = &sensor.measured;
            let shaft = |name: &str| reduced.shaft(name).expect("a sensor names a shaft");
            let (suffix, physical, quantity) = match measured {
                Measured::Angle(s) => ("phi", Physical::Angle, Read::Angle(shaft(s))),
                Measured::Speed(s) => ("w", Physical::Speed, Read::Speed(shaft(s))),
                Measured::SpringTorque(element) => {
                    let read = Read::SpringDamper { springs: springs_of(element), dampers: Vec::new() };
                    ("tau", Physical::Torque, read)
                }
                Measured::NetTorque(s) => (
                    "tau",
                    Physical::Torque,
                    Read::NetTorque(shaft(s), rational_to_f64(&equations.own_inertia(shaft(s)))),
                ),
                Measured::ComplianceTorque(element, s) => {
                    let torque = Compliance::new(reduced, element, Some(shaft(s)));
                    ("tau", Physical::Torque, Read::Compliance(torque.expect("a sensor names a compliance")))
                }
                Measured::ConstraintTorque(element, s) => {
                    let k =
                        multipliers.elements.iter().position(|e| e == element).expect("a sensor names a constraint");
                    ("tau", Physical::Torque, Read::ConstraintTorque(k, shaft(s)))
                }
            };
            let quantity = match (measured, Sampler::differentiates(sensor)) {
                (Measured::Speed(name), true) => Read::Angle(shaft(name)),
                _ => quantity,
            };
            add(
                format!("{name}.{suffix}"),
                physical,
                format!("reading of sensor {name}"),
                Read::Sensor(samplers.len()),
            );
            samplers.push((quantity, Sampler::new(name, sensor, stiffness(reduced, measured), scenario.seed)));
        }
        let (mut reads, mut signals) = (Vec::new(), Vec::new());
        let wanted = |name: &String| scenario.recorded.as_ref().is_none_or(|names| names.contains(name));
        for (name, physical, description, read) in columns.into_iter().filter(|(name, ..)| wanted(name)) {
            reads.push(read);
            signals.push(Signal { name, physical, description, values: Vec::with_capacity(scenario.times.len()) });
        }
        let (constraints, shafts) = (multipliers.elements.len(), equations.shafts.len());
        let constrained =
            |read: &Read| matches!(read, Read::Multiplier(_) | Read::ConstraintTorque(..) | Read::Potentials(_));
        let used = |k: usize| reads.iter().any(|read| matches!(read, Read::Sensor(number) if *number == k));
        let sampled = samplers.iter().enumerate().any(|(k, (read, _))| used(k) && constrained(read));
        Self {
            needs_multipliers: sampled || reads.iter().any(constrained),
            reads,
            signals,
            samplers,
            multipliers,
            lambda: vec![0.0; constraints],
            constraint_force: vec![0.0; shafts],
        }
    }

    /// What the next readings of the sensors depend on.
    pub fn keep(&mut self, keeper: &mut Keeper<'_>) {
        self.samplers.iter_mut().for_each(|(_, sampler)| sampler.keep(keeper));
    }

    /// The value of a signal at the point that the machine has observed last.
    pub fn value(&self, signal: usize, machine: &Machine) -> f64 {
        self.read(&self.reads[signal], machine)
    }

    /// The next time at which a sampled sensor reads, s.
    pub fn next_sample(&self) -> f64 {
        self.samplers.iter().filter_map(|(_, sampler)| sampler.next_time()).fold(f64::INFINITY, f64::min)
    }

    /// Finds the constraint torques at the point that the machine has observed; before `sample` and `record`.
    pub fn solve_multipliers(&mut self, machine: &Machine) {
        if !self.needs_multipliers {
            return;
        }
        machine.dynamics.constraint_force(
            &machine.work,
            &machine.acceleration,
            &machine.applied,
            &machine.friction_torques,
            &mut self.constraint_force,
        );
        self.multipliers.solve(&machine.work.kinematics, &self.constraint_force, &mut self.lambda);
    }

    fn read(&self, read: &Read, machine: &Machine) -> f64 {
        let kinematics = &machine.work.kinematics;
        match read {
            Read::Angle(shaft) => kinematics.angles[*shaft],
            Read::Speed(shaft) => kinematics.speeds[*shaft],
            Read::Torque(input) => machine.torques[*input],
            Read::Command(input) => machine.commands[*input],
            Read::Ripple(input) => machine.applied[*input] - machine.torques[*input],
            Read::Multiplier(constraint) => self.lambda[*constraint],
            Read::NetTorque(shaft, inertia) => {
                inertia * (dot(kinematics.row(*shaft), &machine.acceleration) + kinematics.bias[*shaft])
            }
            Read::ConstraintTorque(constraint, shaft) => {
                self.lambda[*constraint] * self.multipliers.coefficient(*constraint, *shaft, kinematics)
            }
            Read::Potentials(shares) => shares.iter().map(|(row, x)| x * self.lambda[*row]).sum(),
            Read::SpringDamper { springs, dampers } => {
                let springs = springs.iter().map(|&k| machine.dynamics.spring_torque(k, &machine.work));
                let dampers = dampers.iter().map(|&k| machine.dynamics.damper_torque(k, &machine.work));
                springs.chain(dampers).sum()
            }
            Read::Compliance(compliance) => compliance.read(&machine.dynamics, &machine.work),
            Read::Friction(k) => machine.friction_torques[*k],
            Read::Source(k) => machine.sources[*k],
            Read::Sensor(k) => self.samplers[*k].1.held,
        }
    }

    /// Lets the sensors read that are due at this time. The constraint torques must be those of this point.
    pub fn sample(&mut self, time: f64, machine: &Machine) {
        let mut samplers = std::mem::take(&mut self.samplers);
        for (quantity, sampler) in &mut samplers {
            sampler.sample(time, || self.read(quantity, machine));
        }
        self.samplers = samplers;
    }

    /// Appends one row. The constraint torques must be those of this point.
    pub fn record(&mut self, machine: &Machine) {
        for k in 0..self.reads.len() {
            let value = self.read(&self.reads[k], machine);
            self.signals[k].values.push(value);
        }
    }
}
