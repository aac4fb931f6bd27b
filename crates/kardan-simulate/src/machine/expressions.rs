//! The loop as expressions of its state and of its inputs at an instant: forces, commands, rates and powers in one plan
//! with the motion.

use std::ops::Range;

use super::connected_law::{Computer, ConnectedLaw};
use super::contact_expressions::UnilateralTerms;
use super::flow::{Flow, task_outputs};
use super::gear_loss_terms::GearLossTerms;
use crate::compiled_plan::{exact, sum};
use crate::drive::Drive;
use crate::faults::{MotorFault, MotorFaultKind, in_steps};
use crate::scenario::{SourceSignal, SourceTarget};
use kardan_expr::expr::{Expr, Function, OfTime, Symbol};
use kardan_math::num::{Matrix, Rational, rational_from_f64};
use kardan_math::units::Dimension;
use kardan_mechanics::assemble::FrictionLaw;
use kardan_mechanics::reduce::{Dynamics, Extension, MasslessDynamics, Motion, Reduced, Work};

/// The indices of the loop's inputs and outputs among those of the [`Extension`].
#[derive(Debug, Clone, Default)]
pub(super) struct Places {
    /// Input: the states behind angles and speeds.
    pub states: Range<usize>,
    /// Input: values of the sources.
    pub sources: Range<usize>,
    /// Input: commands of laws with their own code, for each input.
    pub zoh_output: Range<usize>,
    /// Input: for each motor the effect of its torque limit on the command, a factor and an addend.
    pub limits: Range<usize>,
    /// Input: for each motor whether its torque follows the command (1) or the rate limiter's state (0).
    pub follows: Range<usize>,
    /// Input: for each motor the rate of its rate limiter's state.
    pub limiter_rates: Range<usize>,
    /// Input: the sense of each friction direction's motion.
    pub senses: Range<usize>,
    /// Input: for sliders that springs couple, the mutual slip factors.
    pub couplings: Range<usize>,
    /// Input: for each motor with a stuck-torque fault in the run that torque, zero without the fault.
    pub stuck: Range<usize>,
    /// Input at the start of a run: coefficients of the equations.
    pub run_parameters: Range<usize>,
    /// Time-dependent input: for each source with a function of time whether it follows that (1) or is set from outside
    /// (0), parts of functions, the time itself.
    pub timed: Range<usize>,
    pub follows_signal: Range<usize>,
    /// Output, where laws have their own code: the sources, which these read.
    pub read_sources: Range<usize>,
    /// Output: commands, reported torques, applied torques, of each motor.
    pub commands: Range<usize>,
    pub torques: Range<usize>,
    pub applied: Range<usize>,
    /// Output: forces without the torques of sticking frictions.
    pub forces: Range<usize>,
    /// Output: rates of the states behind angles and speeds; zero for laws with their own code.
    pub rates: Range<usize>,
    /// Output: speeds in friction directions.
    pub friction_speeds: Range<usize>,
    /// Output: for each unilateral constraint its torque where it is not active, and two numbers that its modes depend
    /// on.
    pub unilateral_torques: Range<usize>,
    pub unilaterals: Range<usize>,
    /// Output: for each gear loss the load without accelerations and without active constraints, its coefficient for
    /// each acceleration, and for the torque of each friction and unilateral constraint.
    pub gear_loads: Range<usize>,
    pub gear_load_by_acceleration: Range<usize>,
    pub gear_load_by_torque: Range<usize>,
    /// Output: the power of the inputs, and the loss.
    pub powers: Range<usize>,
    /// Output, where constraints prescribe speeds: the coefficients of the power of these constraints for each
    /// acceleration, and for the torque of each sticking friction.
    pub power_of_accelerations: Range<usize>,
    pub power_of_holding: Range<usize>,
    /// Output: for each multiplier constraint the residuals of the angles and of the speeds.
    pub multiplier_positions: Range<usize>,
    pub multiplier_speeds: Range<usize>,
    /// Output: for each slider the torque of its springs, and the speed that it would slip with alone.
    pub jenkins_torques: Range<usize>,
    pub jenkins_speeds: Range<usize>,
    /// Output: numbers that vanish where the loop has a jump or kink by the state.
    pub kinks: Range<usize>,
    /// Output: further requested expressions.
    pub also: Range<usize>,
}

/// The data for readings of the loop.
#[derive(Debug, Clone)]
pub struct Found {
    /// The inputs of the loop; which of them are the sources, and which depend on the time.
    pub inputs: Vec<Symbol>,
    pub sources: Range<usize>,
    pub timed: Range<usize>,
    pub source_values: Vec<Expr>,
    /// Commands, reported torques, applied torques, of each motor.
    pub commands: Vec<Expr>,
    pub torques: Vec<Expr>,
    pub applied: Vec<Expr>,
}

impl Found {
    pub(super) fn new(extension: &Extension, places: &Places, source_values: Vec<Expr>) -> Self {
        let outputs = |places: &Range<usize>| extension.outputs[places.clone()].iter().map(|(_, expr)| *expr).collect();
        Self {
            inputs: extension.inputs.clone(),
            sources: places.sources.clone(),
            timed: places.timed.clone(),
            source_values,
            commands: outputs(&places.commands),
            torques: outputs(&places.torques),
            applied: outputs(&places.applied),
        }
    }
}

/// The loop in the making.
struct Loop<'a> {
    motion: &'a mut Motion,
    reduced: &'a Reduced,
    drives: &'a [Drive],
    laws: &'a [ConnectedLaw],
    inputs: Vec<Symbol>,
    outputs: Vec<(String, Expr)>,
    places: Places,
    /// The states behind angles and speeds, and the place of the first one in the state.
    states: Vec<Expr>,
    first_state: usize,
}

impl Loop<'_> {
    fn run_parameters(&mut self, names: impl Iterator<Item = String>) -> (Range<usize>, Vec<Expr>) {
        let first = self.inputs.len();
        let symbol = |name: String| {
            let symbol = self.motion.graph.new_symbol(name, Dimension::NONE);
            self.inputs.extend(self.motion.graph.symbol_of(symbol));
            symbol
        };
        let symbols = names.map(symbol).collect();
        (first..self.inputs.len(), symbols)
    }

    /// The time-dependent inputs of the expressions are behind all others.
    fn give_time(&mut self) {
        self.inputs.extend(self.motion.timed.symbols(&self.motion.graph));
        self.places.timed.end = self.inputs.len();
    }

    fn found(&mut self, name: &str, exprs: Vec<Expr>) -> Range<usize> {
        let first = self.outputs.len();
        self.outputs.extend(exprs.into_iter().enumerate().map(|(k, expr)| (format!("{name}.{k}"), expr)));
        first..self.outputs.len()
    }

    fn sum(&mut self, terms: &[Expr]) -> Expr {
        sum(&mut self.motion.graph, terms.iter().copied())
    }

    fn float(&mut self, value: f64) -> Expr {
        self.motion.graph.number(exact(value))
    }
}

/// `Σ M_row,j x_j` as terms.
fn row(matrix: &Matrix<f64>, row: usize, x: &[Expr]) -> Vec<(Expr, Rational)> {
    let entry = |(j, x): (usize, &Expr)| Some((*x, rational_from_f64(matrix[(row, j)]).filter(|c| !c.is_zero())?));
    x.iter().enumerate().filter_map(entry).collect()
}

/// The parts of a loop besides its plant.
pub(super) struct Parts<'a> {
    pub drives: &'a [Drive],
    pub laws: &'a [ConnectedLaw],
    pub targets: &'a [SourceTarget],
    pub signals: &'a [SourceSignal],
    pub flow: Option<&'a Flow>,
}

/// All equations between plant, motors, linear laws and scenario, written into the expressions of the motion; with the
/// sources, and with the numbers that vanish where the loop has a jump or kink by the time alone.
pub(super) fn extend(
    motion: &mut Motion,
    reduced: &Reduced,
    Parts { drives, laws, targets, signals, flow }: Parts<'_>,
    more_states: Range<usize>,
) -> (Extension, Places, Vec<Expr>, Vec<Expr>) {
    let equations = &reduced.equations;
    let mut all = Loop {
        motion,
        reduced,
        drives,
        laws,
        inputs: Vec::new(),
        outputs: Vec::new(),
        places: Places::default(),
        states: Vec::new(),
        first_state: more_states.start,
    };
    let (sources, zoh_output, limits, follows, limiter_rates, senses, couplings, stuck);
    let of_inputs = |what: &'static str| equations.inputs.iter().map(move |input| format!("{}.{what}", input.element));
    let of_source = |(k, target): (usize, &SourceTarget)| match target {
        SourceTarget::Input(input) => equations.inputs[*input].element.clone(),
        SourceTarget::Reference | SourceTarget::Block => format!("reference.{k}"),
    };
    let limits_of = |name: String| [format!("{name}_factor"), name];
    (all.places.states, all.states) = all.run_parameters(more_states.clone().map(|k| format!("state.{k}")));
    (all.places.sources, sources) = all.run_parameters(targets.iter().enumerate().map(of_source));
    (all.places.zoh_output, zoh_output) = all.run_parameters(of_inputs("held"));
    (all.places.limits, limits) = all.run_parameters(of_inputs("limit").flat_map(limits_of));
    (all.places.follows, follows) = all.run_parameters(of_inputs("follows"));
    (all.places.limiter_rates, limiter_rates) = all.run_parameters(of_inputs("limiter_rate"));
    (all.places.senses, senses) =
        all.run_parameters(equations.set_valued().enumerate().map(|(k, (element, _))| format!("{element}.sense.{k}")));
    let coupled = reduced.massless.iter().flat_map(MasslessDynamics::coupled_slips);
    (all.places.couplings, couplings) = all.run_parameters(coupled.map(|(i, j)| format!("coupling.{i}.{j}")));
    let sticking = equations.inputs.iter().zip(drives).filter(|(_, drive)| drive.sticks());
    (all.places.stuck, stuck) = all.run_parameters(sticking.map(|(input, _)| format!("{}.stuck", input.element)));
    all.places.run_parameters = all.inputs.len()..all.inputs.len() + all.motion.run_parameters.len();
    let run_parameters = all.motion.run_parameters.iter().filter_map(|(_, symbol)| all.motion.graph.symbol_of(*symbol));
    all.inputs.extend(run_parameters);
    let mut sources = with_signals(&mut all, sources, signals);
    let zero = all.motion.graph.integer(0);
    let mut rates = vec![zero; more_states.len()];
    if let Some(flow) = flow {
        let own = flow.states.start - all.first_state..flow.states.end - all.first_state;
        let found = flow.write_into(all.motion, reduced, &mut sources, &all.states[own.clone()]);
        rates[own].copy_from_slice(&found);
    }
    let commands = commands(&mut all, targets, &sources, &zoh_output);
    let run_parameters = (&commands[..], &limits[..], &follows[..], &limiter_rates[..]);
    let drive_efforts = driven(&mut all, run_parameters, &mut rates);
    law_rates(&mut all, &drive_efforts, &sources, &mut rates);
    let torques = failing(&mut all, &drive_efforts, &stuck);
    let applied = rippled(&mut all, &torques);
    let (friction, mut speeds, unilaterals) = set_valued(&mut all, &senses);
    let mut forces = forces(&mut all, &applied, &friction);
    let jenkins = massless_rates(&mut all, &mut forces, (&senses, &couplings), &mut speeds);
    let gear_losses = GearLossTerms::new(all.motion, reduced, &applied, &friction);
    let mut powers = powers(&mut all, &applied, (&friction, &speeds, &unilaterals));
    let sliding = sliding_frictions(&mut all, &friction, &senses, &jenkins);
    find_multipliers(&mut all, &applied, &sliding, &mut powers[0]);
    if laws.iter().any(ConnectedLaw::is_own) {
        all.places.read_sources = all.found("source", sources.clone());
    }
    all.places.commands = all.found("command", commands);
    all.places.torques = all.found("torque", torques);
    all.places.applied = all.found("applied", applied);
    all.places.forces = all.found("force", forces);
    all.places.rates = all.found("rate", rates);
    all.places.friction_speeds = all.found("friction_speed", speeds);
    all.places.unilateral_torques = all.found("hold", unilaterals.iter().map(|terms| terms.torque).collect());
    all.places.unilaterals = all.found("told", unilaterals.iter().flat_map(|terms| terms.mode_inputs).collect());
    all.places.gear_loads = all.found("carried", gear_losses.now);
    all.places.gear_load_by_acceleration = all.found("carried_by_acceleration", gear_losses.by_acceleration);
    all.places.gear_load_by_torque = all.found("carried_by_torque", gear_losses.by_torque);
    all.places.powers = all.found("power", powers.to_vec());
    let discontinuities = add_kinks(&mut all);
    all.give_time();
    (Extension { inputs: all.inputs, outputs: all.outputs }, all.places, sources, discontinuities)
}

/// Torques of the inputs from their commands, with the rates of their states.
fn driven(
    all: &mut Loop<'_>,
    (commands, limits, follows, limiter_rates): (&[Expr], &[Expr], &[Expr], &[Expr]),
    rates: &mut [Expr],
) -> Vec<Expr> {
    let Loop { motion, drives, states, first_state, .. } = all;
    let (graph, state) = (&mut motion.graph, |place: usize| states[place - *first_state]);
    let mut torques = Vec::new();
    for (k, drive) in drives.iter().enumerate() {
        let mut torque = commands[k];
        if drive.limit.is_some() {
            let free = graph.multiply(limits[2 * k], torque);
            torque = graph.add(free, limits[2 * k + 1]);
        }
        if let Some(place) = drive.rate_state {
            let follows = follows[k];
            let free = graph.multiply(follows, torque);
            let bound = graph.sum(Rational::ONE, &[(follows, Rational::from(-1))]);
            let bound = graph.multiply(bound, state(place));
            torque = graph.add(free, bound);
            rates[place - *first_state] = limiter_rates[k];
        }
        if let (Some(place), Some(lag)) = (drive.lag_state, drive.lag) {
            let late = graph.subtract(torque, state(place));
            let late = graph.group(late);
            let lag = graph.number(exact(lag));
            rates[place - *first_state] = graph.divide(late, lag);
            torque = state(place);
        }
        torques.push(torque);
    }
    torques
}

/// The torques of motors with faults.
fn failing(all: &mut Loop<'_>, torques: &[Expr], stuck: &[Expr]) -> Vec<Expr> {
    let mut out = torques.to_vec();
    let mut stuck = stuck.iter();
    for ((torque, input), drive) in out.iter_mut().zip(&all.reduced.equations.inputs).zip(all.drives) {
        let faults = &drive.faults;
        let scaled = fault_part(faults, "share", &|kind| match kind {
            MotorFaultKind::Scaled(part) => part - 1.0,
            MotorFaultKind::Braking(_) => -1.0,
            MotorFaultKind::Undervoltage(_) => 0.0,
            MotorFaultKind::Stuck => -1.0,
        });
        let braking = |kind| if let MotorFaultKind::Braking(damping) = kind { damping } else { 0.0 };
        let braked = fault_part(faults, "braking", &braking);
        let [scaled, braked] = [scaled, braked].map(|part| part.map(|part| all.motion.of_time(&part)));
        if let Some(more) = scaled {
            let factor = all.motion.graph.sum(Rational::ONE, &[(more, Rational::ONE)]);
            *torque = all.motion.graph.multiply(factor, *torque);
        }
        if let Some(stuck) = drive.sticks().then(|| stuck.next()).flatten() {
            *torque = all.motion.graph.add(*torque, *stuck);
        }
        if let Some(damping) = braked {
            let speed = row_speed(all, &input.row);
            let braking = all.motion.graph.multiply(damping, speed);
            *torque = all.motion.graph.subtract(*torque, braking);
        }
        if scaled.is_some() || braked.is_some() || drive.sticks() {
            *torque = all.motion.graph.group(*torque);
        }
    }
    out
}

/// A number over the time that is zero except in the windows of faults; `None` if it is zero in all of them.
fn fault_part(faults: &[MotorFault], what: &str, of: &dyn Fn(MotorFaultKind) -> f64) -> Option<OfTime> {
    let mut windows: Vec<[f64; 3]> = faults.iter().map(|fault| [fault.at, fault.until, of(fault.kind)]).collect();
    windows.retain(|[.., value]| *value != 0.0);
    windows.sort_by(|a, b| a[0].total_cmp(&b[0]));
    if windows.is_empty() {
        return None;
    }
    // Where one ends when the next begins, the latter counts.
    let ends = windows.iter().flat_map(|[at, until, value]| [(*at, *value), (*until, 0.0)]);
    let steps = ends.filter(|(at, _)| at.is_finite());
    in_steps(format!("{}.{what}", faults.first()?.name), steps)
}

/// Torques with their ripples.
fn rippled(all: &mut Loop<'_>, torques: &[Expr]) -> Vec<Expr> {
    let mut out = torques.to_vec();
    for ((torque, input), drive) in out.iter_mut().zip(&all.reduced.equations.inputs).zip(all.drives) {
        let Some((size, order)) = drive.ripple else { continue };
        let angle = all.motion.sum(&input.row, |motion, shaft| motion.angles[shaft]);
        let angle = all.motion.graph.group(angle);
        let (size, order) = (all.float(size), all.float(order));
        let graph = &mut all.motion.graph;
        let argument = graph.multiply(order, angle);
        let wave = graph.apply(Function::Sin, argument);
        let ripple = graph.multiply(size, wave);
        let both = graph.add(*torque, ripple);
        *torque = graph.group(both);
    }
    out
}

/// The sources with the functions of time that are added to them.
fn with_signals(all: &mut Loop<'_>, mut sources: Vec<Expr>, signals: &[SourceSignal]) -> Vec<Expr> {
    let names = signals.iter().map(|signal| format!("follows.{}", signal.source));
    let (places, follows) = all.run_parameters(names);
    (all.places.timed, all.places.follows_signal) = (places.clone(), places);
    for (signal, follows) in signals.iter().zip(follows) {
        let value = all.motion.of_time(&signal.function);
        let value = all.motion.graph.multiply(follows, value);
        let value = all.motion.graph.add(sources[signal.source], value);
        sources[signal.source] = all.motion.graph.group(value);
    }
    sources
}

/// Sources, linear laws, and the commands of other laws, added up for each input.
fn commands(all: &mut Loop<'_>, targets: &[SourceTarget], sources: &[Expr], zoh_output: &[Expr]) -> Vec<Expr> {
    let first = all.first_state;
    let mut commands: Vec<Vec<Expr>> = vec![Vec::new(); zoh_output.len()];
    for (target, source) in targets.iter().zip(sources) {
        if let SourceTarget::Input(input) = target {
            commands[*input].push(*source);
        }
    }
    for ConnectedLaw { computer, inputs, references, states, .. } in all.laws {
        match computer {
            Computer::Linear(law) => {
                let own = &all.states[states.start - first..states.end - first];
                let references: Vec<Expr> = references.iter().map(|&source| sources[source]).collect();
                for (i, &input) in inputs.iter().enumerate() {
                    let mut terms = row(&law.on_states, i, own);
                    terms.extend(row(&law.on_angles, i, &all.motion.angles));
                    terms.extend(row(&law.on_speeds, i, &all.motion.speeds));
                    terms.extend(row(&law.on_references, i, &references));
                    commands[input].push(all.motion.graph.sum(Rational::ZERO, &terms));
                }
            }
            Computer::Inlined(task) => {
                let (outputs, _) = task_outputs(task, references, all.motion, all.reduced, (sources, &[]));
                inputs.iter().zip(outputs).for_each(|(&input, output)| commands[input].push(output));
            }
            Computer::Continuous(_) | Computer::SampledRuntime(_) => {
                for &input in inputs {
                    if !commands[input].contains(&zoh_output[input]) {
                        commands[input].push(zoh_output[input]);
                    }
                }
            }
        }
    }
    let total = |terms: Vec<Expr>| {
        let command = all.sum(&terms);
        all.motion.graph.group(command)
    };
    commands.into_iter().map(total).collect()
}

/// Rates of the states of linear laws.
fn law_rates(all: &mut Loop<'_>, torques: &[Expr], sources: &[Expr], rates: &mut [Expr]) {
    for ConnectedLaw { computer, inputs, references, states, .. } in all.laws {
        let Computer::Linear(law) = computer else { continue };
        let own = states.start - all.first_state..states.end - all.first_state;
        let references: Vec<Expr> = references.iter().map(|&source| sources[source]).collect();
        let torques: Vec<Expr> = inputs.iter().map(|&input| torques[input]).collect();
        for (i, rate) in rates[own.clone()].iter_mut().enumerate() {
            let mut terms = row(&law.states, i, &all.states[own.clone()]);
            terms.extend(row(&law.angles, i, &all.motion.angles));
            terms.extend(row(&law.speeds, i, &all.motion.speeds));
            terms.extend(row(&law.torques, i, &torques));
            terms.extend(row(&law.references, i, &references));
            *rate = all.motion.graph.sum(Rational::ZERO, &terms);
        }
    }
}

/// Frictions, then unilateral constraints: their torques where they do not stick, against the motion, and their speeds;
/// and the latter themselves.
fn set_valued(all: &mut Loop<'_>, senses: &[Expr]) -> (Vec<Expr>, Vec<Expr>, Vec<UnilateralTerms>) {
    let (mut torques, mut speeds) = sliding(all, senses);
    let reduced = all.reduced;
    let unilaterals = reduced.equations.unilaterals.iter().zip(&senses[torques.len()..]);
    let unilaterals: Vec<UnilateralTerms> =
        unilaterals.map(|(unilateral, sense)| UnilateralTerms::new(all.motion, reduced, unilateral, *sense)).collect();
    torques.extend(unilaterals.iter().map(|unilateral| unilateral.torque));
    speeds.extend(unilaterals.iter().map(|unilateral| unilateral.speed));
    (torques, speeds, unilaterals)
}

/// The numbers that vanish where forces, rates, or active constraints have a jump or kink; returns those of the time
/// alone.
fn add_kinks(all: &mut Loop<'_>) -> Vec<Expr> {
    let Places { forces, rates, commands, unilateral_torques, unilaterals, .. } = &all.places;
    let outputs = [forces, rates, commands, unilateral_torques, unilaterals].into_iter().cloned().flatten();
    let mut time_symbols = all.inputs[all.places.sources.clone()].to_vec();
    time_symbols.extend_from_slice(&all.inputs[all.places.follows_signal.clone()]);
    time_symbols.extend(all.motion.timed.symbols(&all.motion.graph));
    let graph = &mut all.motion.graph;
    let mut kinks: Vec<Expr> = outputs.flat_map(|output| graph.kinks(all.outputs[output].1)).collect();
    kinks.sort();
    kinks.dedup();
    kinks.retain(|kink| !graph.symbols(&[*kink]).is_empty());
    let is_of_time = |kink: &Expr| graph.symbols(&[*kink]).iter().all(|symbol| time_symbols.contains(symbol));
    let (of_time, of_state) = kinks.into_iter().partition(is_of_time);
    all.places.kinks = all.found("bend", of_state);
    of_time
}

fn row_speed(all: &mut Loop<'_>, row: &[(usize, Rational)]) -> Expr {
    let speed = all.motion.sum(row, |motion, shaft| motion.speeds[shaft]);
    all.motion.graph.group(speed)
}

/// Torques of slipping directions, in the sense of their directions' motion, and speeds in all of them.
fn sliding(all: &mut Loop<'_>, senses: &[Expr]) -> (Vec<Expr>, Vec<Expr>) {
    let (mut torques, mut speeds) = (Vec::new(), Vec::new());
    for (term, sense) in all.reduced.equations.frictions.iter().zip(senses) {
        let speed = row_speed(all, &term.row);
        let FrictionLaw { torque, stribeck } = &term.value;
        let mut size = all.motion.exact(torque);
        if let Some(stribeck) = stribeck {
            let (most, scale) = (all.motion.exact(&stribeck.breakaway), all.motion.exact(&stribeck.speed));
            let graph = &mut all.motion.graph;
            let more = graph.subtract(most, size);
            let square = graph.product(&[(speed, 2), (scale, -2)]);
            let square = graph.negate(square);
            let fading = graph.apply(Function::Exp, square);
            let more = graph.multiply(more, fading);
            size = graph.add(size, more);
        }
        torques.push(all.motion.graph.multiply(*sense, size));
        speeds.push(speed);
    }
    (torques, speeds)
}

fn forces(all: &mut Loop<'_>, applied: &[Expr], friction: &[Expr]) -> Vec<Expr> {
    let motion = &mut *all.motion;
    let mut forces = motion.passive_terms.clone();
    for (rows, torques, sign) in [(&motion.inputs, applied, 1), (&motion.frictions, friction, -1)] {
        for (row, torque) in rows.iter().zip(torques) {
            forces.add(&mut motion.graph, row, *torque, &sign.into());
        }
    }
    forces.sums(&mut motion.graph)
}

/// Power of the inputs and of the torques that expressions give; loss in dampers and in slipping directions.
fn powers(
    all: &mut Loop<'_>,
    applied: &[Expr],
    (friction, speeds, unilaterals): (&[Expr], &[Expr], &[UnilateralTerms]),
) -> [Expr; 2] {
    let (equations, mut work, mut loss) = (&all.reduced.equations, Vec::new(), Vec::new());
    for (input, torque) in equations.inputs.iter().zip(applied) {
        let speed = row_speed(all, &input.row);
        work.push(all.motion.graph.multiply(*torque, speed));
    }
    for (law, torque) in equations.laws.iter().zip(all.motion.laws.clone()) {
        let speed = row_speed(all, &law.row);
        work.push(all.motion.graph.multiply(torque, speed));
    }
    for damper in &equations.dampers {
        let (speed, coefficient) = (row_speed(all, &damper.row), all.motion.exact(&damper.value));
        let lost = all.motion.graph.product(&[(coefficient, 1), (speed, 2)]);
        loss.push(all.motion.scaled_by_fault(all.reduced, &damper.element, lost));
    }
    for (torque, speed) in friction.iter().zip(speeds).take(friction.len() - unilaterals.len()) {
        loss.push(all.motion.graph.multiply(*torque, *speed));
    }
    loss.extend(unilaterals.iter().map(|unilateral| unilateral.loss));
    [all.sum(&work), all.sum(&loss)]
}

/// Speeds with motions without inertia, also in the frictions of those that slip in these modes; returns the torques of
/// sliders.
fn massless_rates(
    all: &mut Loop<'_>,
    forces: &mut [Expr],
    slipping: (&[Expr], &[Expr]),
    speeds: &mut [Expr],
) -> Vec<Expr> {
    let reduced = all.reduced;
    all.motion.massless_rates(reduced, forces, slipping);
    for slip in reduced.massless.iter().flat_map(|massless| &massless.slips) {
        speeds[slip.friction] = row_speed(all, &reduced.equations.frictions[slip.friction].row);
    }
    let [torques, slip_speeds] = all.motion.jenkins(reduced);
    all.places.jenkins_torques = all.found("slider", torques.clone());
    all.places.jenkins_speeds = all.found("slip", slip_speeds);
    torques
}

/// Torques of frictions where they slip, and those of sliders also where they stick.
fn sliding_frictions(all: &mut Loop<'_>, friction: &[Expr], senses: &[Expr], jenkins_torques: &[Expr]) -> Vec<Expr> {
    let mut sliding = friction.to_vec();
    let slips = all.reduced.massless.iter().flat_map(|massless| &massless.slips);
    for (slip, torque) in slips.zip(jenkins_torques) {
        let graph = &mut all.motion.graph;
        let slides = graph.product(&[(senses[slip.friction], 2)]);
        let sticks = graph.sum(Rational::ONE, &[(slides, Rational::from(-1))]);
        let torque = graph.multiply(sticks, *torque);
        sliding[slip.friction] = graph.add(friction[slip.friction], torque);
    }
    sliding
}

/// The outputs of constraints that prescribe speeds, and of multiplier constraints; adds the power of the former to
/// that of the inputs.
fn find_multipliers(all: &mut Loop<'_>, applied: &[Expr], friction: &[Expr], power: &mut Expr) {
    if all.reduced.equations.prescribes() {
        let [now, accelerations, holding] = prescribed_power(all, applied, friction);
        *power = all.sum(&[&[*power], now.as_slice()].concat());
        all.places.power_of_accelerations = all.found("power_of_acceleration", accelerations);
        all.places.power_of_holding = all.found("power_of_holding", holding);
    }
    let zero = all.motion.graph.integer(0);
    let rows = &all.motion.multiplier_constraints;
    let positions = rows.iter().map(|row| row.position.unwrap_or(zero)).collect();
    let speeds = rows.iter().map(|row| row.speed.unwrap_or(zero)).collect();
    all.places.multiplier_positions = all.found("kept_position", positions);
    all.places.multiplier_speeds = all.found("kept_speed", speeds);
}

/// The power of constraints that prescribe speeds, `uᵀτ_c` with
/// `τ_c = H (K q̈_r + k) + D q̇ + S q + friction − laws − F τ`: its part without accelerations and without sticking
/// friction, then its coefficient for each of these.
fn prescribed_power(all: &mut Loop<'_>, applied: &[Expr], friction: &[Expr]) -> [Vec<Expr>; 3] {
    let reduced = all.reduced;
    let (r, equations) = (reduced.degrees_of_freedom(), &reduced.equations);
    let (mut now, mut accelerations) = (Vec::new(), vec![Vec::new(); r]);
    let product = |all: &mut Loop<'_>, factors: &[Expr]| {
        all.motion.graph.product(&factors.iter().map(|factor| (*factor, 1)).collect::<Vec<_>>())
    };
    let carried = |all: &mut Loop<'_>, row: &[(usize, Rational)]| all.motion.sum(row, |motion, k| motion.carried[k]);
    for body in &equations.inertias {
        let (speed, inertia) = (carried(all, &body.row), all.motion.exact(&body.value));
        let bias = all.motion.sum(&body.row, |motion, k| motion.bias[k]);
        now.push(product(all, &[inertia, speed, bias]));
        for (i, entry) in all.motion.reduced_row(&body.row) {
            accelerations[i].push(product(all, &[inertia, speed, entry]));
        }
    }
    for (k, damper) in equations.dampers.iter().enumerate() {
        let (speed, torque) = (carried(all, &damper.row), all.motion.damper_torque(reduced, k));
        now.push(product(all, &[speed, torque]));
    }
    for (k, spring) in equations.springs.iter().enumerate() {
        let (speed, torque) = (carried(all, &spring.row), all.motion.spring_torque(reduced, k));
        now.push(product(all, &[speed, torque]));
    }
    let acting = equations.laws.iter().map(|law| &law.row).zip(all.motion.laws.clone());
    let acting = acting.chain(equations.inputs.iter().map(|input| &input.row).zip(applied.iter().copied()));
    for (row, torque) in acting {
        let speed = carried(all, row);
        let power = product(all, &[speed, torque]);
        now.push(all.motion.graph.negate(power));
    }
    let mut holding: Vec<Expr> = equations.set_valued().map(|(_, row)| carried(all, row)).collect();
    for (speed, torque) in holding.iter().zip(friction) {
        now.push(product(all, &[*speed, *torque]));
    }
    for k in 0..all.motion.multiplier_constraints.len() {
        let (speed, rate) = (
            all.motion.sum_over_multiplier(k, |motion, shaft| motion.carried[shaft]),
            all.motion.multiplier_constraints[k].rate,
        );
        holding.push(all.motion.graph.subtract(speed, rate));
    }
    [now, accelerations.iter().map(|terms| all.sum(terms)).collect(), holding]
}

/// Copies outputs of the loop.
pub(super) fn read(dynamics: &Dynamics, work: &Work, places: &Range<usize>, out: &mut [f64]) {
    out.iter_mut().zip(places.clone()).for_each(|(out, place)| *out = work.more(dynamics, place));
}
