//! Signals of a run, as expressions of the loop, its accelerations and its friction torques: one plan for all columns
//! and sensors.

use super::compiled_plan::{CompiledPlan, exact, sum, symbols};
use super::machine::{Found, Machine};
use super::sampler::{Compliance, Read};
use kardan_expr::expr::{Expr, Symbol};
use kardan_math::num::Rational;
use kardan_mechanics::reduce::{Acting, Motion, Reduced};

/// The plan of all readings.
pub(super) struct Readings {
    compiled: CompiledPlan<f64>,
    /// The arguments: the inputs of the loop, accelerations, friction torques.
    counts: [usize; 3],
    /// The indices of the sources among the inputs of the loop, and the terms that depend on time.
    sources: usize,
    timed: usize,
    /// Whether any reading depends on more than angles, speeds and sources.
    needs_forces: bool,
}

/// Expressions that several readings share.
struct Shared<'a> {
    motion: &'a mut Motion,
    reduced: &'a Reduced,
    found: &'a Found,
    accelerations: Vec<Expr>,
    frictions: Vec<Expr>,
    /// Multipliers, where they are requested.
    multipliers: Option<Vec<Expr>>,
}

impl Readings {
    /// The plan of readings of a loop; those of sensors are zero in it.
    pub(super) fn new(motion: &mut Motion, reduced: &Reduced, found: &Found, reads: &[&Read]) -> Self {
        let mut inputs: Vec<Symbol> = motion.symbols.iter().chain(&found.inputs).copied().collect();
        let (loop_inputs, first) = (inputs.len(), motion.symbols.len());
        let (sources, timed) = (first + found.sources.start, first + found.timed.start);
        let own = [0..first, sources..first + found.sources.end, timed..first + found.timed.end];
        let motion_inputs: Vec<Symbol> = own.into_iter().flat_map(|places| inputs[places].to_vec()).collect();
        let motion_rows = motion.frictions.len();
        let accelerations = symbols(&mut motion.graph, "acceleration", reduced.degrees_of_freedom());
        let frictions = symbols(&mut motion.graph, "friction", motion_rows);
        let more = accelerations.iter().chain(&frictions);
        inputs.extend(more.filter_map(|symbol| motion.graph.symbol_of(*symbol)));
        let counts = [loop_inputs, accelerations.len(), frictions.len()];
        let mut shared = Shared { motion, reduced, found, accelerations, frictions, multipliers: None };
        let exprs: Vec<Expr> = reads.iter().map(|read| shared.expression(read)).collect();
        let graph = &shared.motion.graph;
        let needs_forces = graph.symbols(&exprs).iter().any(|symbol| !motion_inputs.contains(symbol));
        let outputs: Vec<(String, Expr)> =
            exprs.into_iter().enumerate().map(|(k, expr)| (format!("reading.{k}"), expr)).collect();
        Self { compiled: CompiledPlan::new(graph, &inputs, &outputs), counts, sources, timed, needs_forces }
    }

    /// The same as expressions of the loop alone; `None` for those that need accelerations or friction torques, or are
    /// a sensor's.
    pub(super) fn direct(motion: &mut Motion, reduced: &Reduced, found: &Found, reads: &[Read]) -> Vec<Option<Expr>> {
        let mut shared =
            Shared { motion, reduced, found, accelerations: Vec::new(), frictions: Vec::new(), multipliers: None };
        let one = |read: &Read| match read {
            Read::Angle(_) | Read::Speed(_) | Read::Torque(_) | Read::Command(_) | Read::Ripple(_) => {
                Some(shared.expression(read))
            }
            Read::SpringDamper { .. } | Read::Compliance(_) | Read::Law(_) | Read::Source(_) => {
                Some(shared.expression(read))
            }
            _ => None,
        };
        reads.iter().map(one).collect()
    }

    /// Evaluates a machine at a point, and all readings there.
    pub(super) fn observe(&mut self, machine: &mut Machine, time: f64, state: &[f64]) {
        if self.needs_forces {
            machine.evaluate(time, state);
            return self.observe_here(machine);
        }
        let (memory, motion) = (&mut self.compiled.memory, 2 * self.counts[1]);
        machine.set_sources(time);
        memory[..motion].copy_from_slice(&state[..motion]);
        memory[self.sources..][..machine.sources.len()].copy_from_slice(&machine.sources);
        let timed = machine.timed.at(time);
        memory[self.timed..][..timed.len()].copy_from_slice(timed);
        self.compiled.evaluate();
    }

    /// The same where the rates were computed last.
    pub(super) fn observe_here(&mut self, machine: &mut Machine) {
        machine.find_friction_torques();
        let [inputs, accelerations, frictions] = self.counts;
        let (loop_inputs, later) = self.compiled.memory.split_at_mut(inputs);
        loop_inputs.copy_from_slice(&machine.work.values()[..inputs]);
        later[..accelerations].copy_from_slice(&machine.acceleration);
        later[accelerations..][..frictions].copy_from_slice(&machine.friction_torques);
        self.compiled.evaluate();
    }

    /// A reading at the point observed last.
    pub(super) fn value(&self, reading: usize) -> f64 {
        *self.compiled.output(reading)
    }
}

impl Shared<'_> {
    fn expression(&mut self, read: &Read) -> Expr {
        match read {
            Read::Angle(shaft) => self.motion.angles[*shaft],
            Read::Speed(shaft) => self.motion.speeds[*shaft],
            Read::Torque(input) => self.found.torques[*input],
            Read::Command(input) => self.found.commands[*input],
            Read::Ripple(input) => {
                let Found { applied, torques, .. } = self.found;
                self.motion.graph.subtract(applied[*input], torques[*input])
            }
            Read::Multiplier(constraint) => self.multiplier(*constraint),
            Read::NetTorque(shaft) => {
                let inertia = self.reduced.equations.own_inertia(*shaft);
                let acceleration = self.motion.shaft_accelerations(&self.accelerations)[*shaft];
                self.motion.graph.scale(inertia, acceleration)
            }
            Read::ConstraintTorque(constraint, shaft) => {
                let multiplier = self.multiplier(*constraint);
                let row = self.motion.constraint_row(self.reduced, *constraint);
                let own = row.into_iter().find(|(candidate, _)| candidate == shaft);
                let zero = self.motion.graph.integer(0);
                own.map_or(zero, |(_, coefficient)| self.motion.graph.multiply(coefficient, multiplier))
            }
            Read::Potentials(shares) => {
                let terms: Vec<_> = shares.iter().map(|(row, x)| (self.multiplier(*row), exact(*x))).collect();
                self.motion.graph.sum(Rational::ZERO, &terms)
            }
            Read::SpringDamper { springs, dampers } => self.torques(springs, dampers),
            Read::Compliance(Compliance { springs, dampers, factor }) => {
                let torque = self.torques(springs, dampers);
                self.motion.graph.scale(exact(*factor), torque)
            }
            Read::Friction(k) => self.frictions[*k],
            Read::Frictions(shares) => self.friction_torques(shares),
            Read::MultiplierOn(parts, shares, shaft) => {
                let multiplier = self.friction_torques(shares);
                let rows = &self.motion.multiplier_constraints;
                let entry = |k: usize| rows[k].row.iter().find(|(candidate, _)| candidate == shaft);
                let entries: Vec<_> = parts.iter().filter_map(|(k, x)| Some((entry(*k)?.1, exact(*x)))).collect();
                let entry = self.motion.graph.sum(Rational::ZERO, &entries);
                self.motion.graph.multiply(entry, multiplier)
            }
            Read::Law(k) => self.motion.laws[*k],
            Read::Source(k) => self.found.source_values[*k],
            Read::Sensor(_) => self.motion.graph.integer(0),
        }
    }

    /// The sum of the torques of directions, each times a number.
    fn friction_torques(&mut self, shares: &[(usize, f64)]) -> Expr {
        let terms: Vec<_> = shares.iter().map(|(k, x)| (self.frictions[*k], exact(*x))).collect();
        self.motion.graph.sum(Rational::ZERO, &terms)
    }

    fn torques(&mut self, springs: &[usize], dampers: &[usize]) -> Expr {
        let mut terms: Vec<Expr> = springs.iter().map(|&k| self.motion.spring_torque(self.reduced, k)).collect();
        terms.extend(dampers.iter().map(|&k| self.motion.damper_torque(self.reduced, k)));
        sum(&mut self.motion.graph, terms)
    }

    fn multiplier(&mut self, constraint: usize) -> Expr {
        let Self { motion, reduced, found, accelerations, frictions, multipliers } = self;
        let all = multipliers.get_or_insert_with(|| {
            motion.multipliers(reduced, Acting { accelerations, inputs: &found.applied, frictions })
        });
        all[constraint]
    }
}
