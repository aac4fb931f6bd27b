//! A task of blocks in a loop: its outputs are commands of motors, or signals for others.

use std::sync::{Arc, OnceLock};

use kardan_rt::Health;

use super::{Block, Clock, Frozen, Kinks, Law, LinearLaw, LinearTask, Observation, Plant, Reference};
use crate::analysis::OutputSignal;
use crate::equations::Measured;
use crate::expr::{
    Direction, Graph, Interval, Linear, Place, Side, SidesOf, Surd, Surds, Symbol, bending, exactly, forward, kinked,
    slopes_at,
};
use crate::num::{Float, Matrix, Rational, Scalar, SparseRow, StateArchive, rational_from_f64, rational_to_f64};
use crate::plan::Plan;
use crate::program::{Read, Task};
use crate::reduce::Reduced;
use crate::results::{ControllerData, DataMatrix, Design, Physical, ReadSignal};

/// The source of an input of a task.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Comes {
    Angle(usize),
    Speed(usize),
    /// The last good reading of a sensor.
    Reading(usize),
    /// Its output, a number or none.
    AsRead(usize),
    Reference(usize),
    Time,
}

/// The name of the law where a task only has outputs.
const BLOCKS: &str = "blocks";

/// What an ideal sensor reads: rows over angles and speeds, and its reading at zero angles; for a signal the reference that supplies it.
#[derive(Debug, Clone, Default)]
struct Ideal {
    angles: Vec<(usize, f64)>,
    speeds: Vec<(usize, f64)>,
    /// The same before rounding.
    exact: [SparseRow; 2],
    offset: f64,
    reference: Option<usize>,
}

impl Ideal {
    fn new(measured: &Measured, reduced: &Reduced) -> Self {
        let coordinate = |name: &String| reduced.coordinate(name).expect("a sensor names a coordinate");
        match measured {
            Measured::Angle(name) => Self::of_rows([vec![(coordinate(name), Rational::ONE)], SparseRow::new()], 0.0),
            Measured::Speed(name) => Self::of_rows([SparseRow::new(), vec![(coordinate(name), Rational::ONE)]], 0.0),
            Measured::SpringTorque(element) => {
                let (mut row, mut offset) = (SparseRow::new(), 0.0);
                for spring in reduced.equations.springs.iter().filter(|spring| spring.element == *element) {
                    let stiffness = spring.value.stiffness.to_rational();
                    row.extend(spring.row.iter().map(|(shaft, x)| (*shaft, &stiffness * x)));
                    offset -= spring.value.stiffness.to_f64() * spring.value.rest.to_f64();
                }
                Self::of_rows([row, SparseRow::new()], offset)
            }
            // Its spring and its damper read it in a run; it has no effect on small motions. A signal is an input.
            Measured::ComplianceTorque(..)
            | Measured::ConstraintTorque(..)
            | Measured::NetTorque(_)
            | Measured::Signal(_) => Self::default(),
        }
    }

    fn of_rows(exact: [SparseRow; 2], offset: f64) -> Self {
        let rounded = |row: &SparseRow| row.iter().map(|(k, x)| (*k, rational_to_f64(x))).collect();
        let [angles, speeds] = exact.each_ref().map(rounded);
        Self { angles, speeds, exact, offset, reference: None }
    }

    fn read(&self, observation: &Observation<'_>) -> f64 {
        let row_dot = |row: &[(usize, f64)], x: &[f64]| -> f64 { row.iter().map(|(k, c)| c * x[*k]).sum() };
        let reference = self.reference.map_or(0.0, |k| observation.references[k]);
        row_dot(&self.angles, observation.angles) + row_dot(&self.speeds, observation.speeds) + reference + self.offset
    }
}

/// A task as a law: its outputs take the place of commands.
pub struct TaskLaw {
    task: Arc<Task>,
    law: &'static str,
    outputs: Vec<String>,
    references: Vec<Reference>,
    sensors: Vec<OutputSignal>,
    ideal: Vec<Ideal>,
    comes: Vec<Comes>,
    shafts: usize,
    clock: Option<Clock>,
    affine: bool,
    /// Outputs, then next states, from inputs, then states.
    plan: Arc<Plan>,
    /// The inputs, then the states, of its linearisation; `None`: zero inputs, and the states after the first samples there.
    point: Option<Vec<f64>>,
    /// A note on that point.
    point_note: Option<String>,
    /// The side of a kink on which it is linearised.
    side: Side,
    /// Slopes of some rows alone; `None`: of all.
    slopes_of_rows: Option<Vec<usize>>,
    sides_at_design_point: OnceLock<Vec<SidesOf>>,
    /// The linear part at the design point.
    at_design_point: OnceLock<LinearLaw>,
    exact_at_design_point: OnceLock<Option<Arc<LinearLaw<Rational>>>>,
}

/// Most states of a task whose slopes are computed before rounding.
const MOST_EXACT: usize = 32;
/// In how many directions places are left at which too many guards vanish.
const DIRECTIONS: usize = 8;
/// By how much values or slopes differ there that are not the same, relative to their size or to one.
const ROUGH: f64 = 1e-5;
/// The relative rounding of values that a task reads.
const ROUNDED: f64 = 4.0 * f64::EPSILON;

/// The parts of a direction in which a place is left: no sum of these with fractions is zero, so that guards with these stay away from it.
fn probe_slope(k: usize) -> f64 {
    1.0 / (k as f64 + std::f64::consts::PI)
}

/// Inputs and states of a task at a point.
struct Inputs<'a> {
    law: &'a TaskLaw,
    symbols: &'a [Symbol],
    values: &'a [f64],
}

impl Place for Inputs<'_> {
    fn place(&self, symbol: Symbol) -> Option<usize> {
        self.symbols.iter().position(|own| *own == symbol)
    }

    fn exact(&self, symbol: Symbol) -> Option<Surd> {
        Some(Surd::rational(rational_from_f64(self.value(symbol))?))
    }

    fn value(&self, symbol: Symbol) -> f64 {
        self.place(symbol).map_or(0.0, |place| self.values[place])
    }

    fn enclosure(&self, symbol: Symbol) -> Interval {
        let value = self.value(symbol);
        let half_width = ROUNDED * value.abs();
        Interval { low: value - half_width, high: value + half_width }
    }

    /// Sensors move with what they measure, all other signals by themselves.
    fn moves(&self, symbol: Symbol) -> SparseRow {
        let (law, Some(place)) = (self.law, self.place(symbol)) else { return SparseRow::new() };
        if !law.task.moving.contains(&symbol) {
            return SparseRow::new();
        }
        let row: SparseRow = match law.comes.get(place) {
            Some(Comes::Angle(shaft)) => vec![(*shaft, Rational::ONE)],
            Some(Comes::Speed(shaft)) => vec![(law.shafts + shaft, Rational::ONE)],
            Some(Comes::Reading(sensor) | Comes::AsRead(sensor)) => {
                let [angles, speeds] = law.ideal[*sensor].exact.clone();
                angles.into_iter().chain(speeds.into_iter().map(|(shaft, x)| (law.shafts + shaft, x))).collect()
            }
            _ => SparseRow::new(),
        };
        if row.is_empty() { vec![(2 * law.shafts + place, Rational::ONE)] } else { row }
    }
}

impl TaskLaw {
    /// A task at its samples, in a model.
    ///
    /// # Panics
    /// If it names what the model does not have (the model layer checks that before).
    pub fn new(task: &Arc<Task>, reduced: &Reduced) -> Self {
        let clock = task.period.as_ref().map(|period| Clock { period: period.to_f64(), delay: 0.0, single: false });
        Self::with(task, reduced, (BLOCKS, clock))
    }

    /// The same as a law of a keyword, with its clock.
    ///
    /// # Panics
    /// As [`Self::new`].
    pub fn with(task: &Arc<Task>, reduced: &Reduced, (law, clock): (&'static str, Option<Clock>)) -> Self {
        let (mut references, mut sensors, mut comes): (Vec<Reference>, Vec<OutputSignal>, Vec<Comes>) =
            Default::default();
        let mut ideal = Vec::new();
        let coordinate = |name: &String| reduced.coordinate(name).expect("a task reads coordinates of its model");
        for (symbol, read) in &task.reads {
            let reference = |name: &String| {
                let (_, dimension) = task.graph.name(*symbol);
                let description = format!("read by {}", task.name);
                Reference { name: name.clone(), physical: Physical::of_unit(&dimension.si()), description }
            };
            comes.push(match read {
                Read::Position(name) => Comes::Angle(coordinate(name)),
                Read::Rate(name) => Comes::Speed(coordinate(name)),
                Read::Time => Comes::Time,
                Read::Source(name) => {
                    references.push(reference(name));
                    Comes::Reference(references.len() - 1)
                }
                Read::Sensor(name) | Read::AsRead(name) => {
                    let number = sensors.iter().position(|sensor| sensor.name == *name).unwrap_or_else(|| {
                        let measured =
                            &reduced.equations.sensor(name).expect("a task reads sensors of its model").measured;
                        let mut of = Ideal::new(measured, reduced);
                        if matches!(measured, Measured::Signal(_)) {
                            of.reference = Some(references.len());
                            references.push(reference(name));
                        }
                        sensors.push(OutputSignal { name: name.clone(), measured: measured.clone() });
                        ideal.push(of);
                        sensors.len() - 1
                    });
                    if matches!(read, Read::Sensor(_)) { Comes::Reading(number) } else { Comes::AsRead(number) }
                }
            });
        }
        let affine = task.graph.affine();
        Self {
            law,
            outputs: task.outputs.iter().map(|answer| answer.name.clone()).collect(),
            references,
            sensors,
            ideal,
            comes,
            shafts: reduced.equations.coordinates.len(),
            clock,
            affine: task.outputs().iter().all(|(_, expr)| affine(*expr)),
            plan: Arc::clone(task.plan()),
            task: Arc::clone(task),
            point: None,
            point_note: None,
            side: Side::default(),
            sides_at_design_point: OnceLock::new(),
            at_design_point: OnceLock::new(),
            exact_at_design_point: OnceLock::new(),
            slopes_of_rows: None,
        }
    }

    /// The same, linearised on one side of its kinks.
    #[must_use]
    pub fn on(self, side: &Side) -> Self {
        Self {
            side: side.clone(),
            sides_at_design_point: OnceLock::new(),
            at_design_point: OnceLock::new(),
            exact_at_design_point: OnceLock::new(),
            ..self
        }
    }

    /// The same with slopes of some rows only, outputs, then states; others are taken as zero.
    #[must_use]
    pub fn with_slopes_among(self, rows: &[usize]) -> Self {
        Self { slopes_of_rows: Some(rows.to_vec()), ..self }
    }

    /// Its forms on the sides of its design point, to first order: empty where no guard vanishes there.
    fn sides(&self) -> &[SidesOf] {
        self.sides_at_design_point.get_or_init(|| self.sides_among(&self.all_rows(), &self.design_point()))
    }

    fn all_rows(&self) -> Vec<usize> {
        (0..self.outputs.len() + self.task.memory.len()).collect()
    }

    /// The same of some outputs, then states, at a point.
    fn sides_among(&self, rows: &[usize], inputs: &[f64]) -> Vec<SidesOf> {
        let (mut graph, symbols) = (self.task.graph.clone(), self.task.inputs());
        let outputs = self.task.outputs();
        let exprs: Vec<_> = rows.iter().map(|row| outputs[*row].1).collect();
        let place = Inputs { law: self, symbols: &symbols, values: inputs };
        let sense = if self.side.below.is_empty() { 1.0 } else { -1.0 };
        let mut found = kinked(&mut graph, &exprs, &place, &|k| sense * probe_slope(k));
        found.iter_mut().flat_map(|sides| &mut sides.exprs).for_each(|row| *row = rows[*row]);
        found
    }

    /// Derivatives where no guard vanishes: of some outputs and states, with respect to inputs or states.
    fn plain_slopes(&self, rows: &[usize], inputs: &[f64], put: &mut dyn FnMut(usize, usize, f64)) {
        let (outputs, symbols) = (self.task.outputs(), self.task.inputs());
        let exprs: Vec<_> = rows.iter().map(|row| outputs[*row].1).collect();
        for (row, slopes) in rows.iter().zip(slopes_at(&self.task.graph, &exprs, (&symbols, inputs))) {
            slopes.into_iter().for_each(|(column, slope)| put(*row, column, slope));
        }
    }

    /// A point next to another one, in a direction in which this may be left.
    fn beside(&self, inputs: &[f64], direction: Direction<'_>) -> Vec<f64> {
        let symbols = self.task.inputs();
        let place = Inputs { law: self, symbols: &symbols, values: inputs };
        symbols.iter().map(|symbol| place.beside(*symbol, direction)).collect()
    }

    /// Which of some rows with many sides have other slopes next to a point, and which other values, in some directions.
    fn rough_among(&self, rows: &[usize], inputs: &[f64]) -> [Vec<usize>; 2] {
        let columns = inputs.len();
        let beside: Vec<(Vec<f64>, Vec<f64>)> = (0..DIRECTIONS)
            .map(|number| {
                // The selected side, the opposite one, and others with signs in the order of a binary number.
                let sign = |k: usize| match number {
                    0 => 1.0,
                    1 => -1.0,
                    _ => [1.0, -1.0][(number >> (k % 4)) & 1],
                };
                let at = self.beside(inputs, &|k| sign(k) * probe_slope(k));
                let mut slopes = vec![0.0; columns * (self.outputs.len() + self.task.memory.len())];
                self.plain_slopes(rows, &at, &mut |row, column, slope| slopes[row * columns + column] = slope);
                let mut memory = self.plan.memory();
                memory[..columns].copy_from_slice(&at);
                let _ = self.plan.block().evaluate(&mut memory);
                let values = (0..self.outputs.len() + self.task.memory.len()).map(|row| memory[self.plan.place(row)]);
                (slopes, values.collect())
            })
            .collect();
        let differ = |one: f64, other: f64| (one - other).abs() > ROUGH * one.abs().max(other.abs()).max(1.0);
        let (first_slopes, first) = &beside[0];
        let jumps = |row: &usize| beside.iter().any(|(_, values)| differ(values[*row], first[*row]));
        let has_kink = |row: &usize| {
            let own = row * columns..(row + 1) * columns;
            beside.iter().any(|(slopes, _)| own.clone().any(|k| differ(slopes[k], first_slopes[k])))
        };
        let (jumping, rest): (Vec<usize>, Vec<usize>) = rows.iter().copied().partition(|row| jumps(row));
        [rest.into_iter().filter(|row| has_kink(row)).collect(), jumping]
    }

    /// For each output, then for each state, its kinks and its jumps at a point.
    fn kinks_among(&self, inputs: &[f64], sides: &[SidesOf]) -> Kinks {
        let mut out = vec![[Vec::new(), Vec::new()]; self.outputs.len() + self.task.memory.len()];
        for SidesOf { exprs, guards, sides, all } in sides {
            if !all {
                let [kinks, jumps] = self.rough_among(exprs, inputs);
                kinks.into_iter().for_each(|row| out[row][0].clone_from(guards));
                jumps.into_iter().for_each(|row| out[row][1].clone_from(guards));
                continue;
            }
            for (place, &row) in exprs.iter().enumerate() {
                let only: Vec<Linear> = sides.iter().map(|side| side.of(&[place])).collect();
                let jumps = bending(&only, &Linear::same_values);
                let slope_kinks = if jumps.is_empty() { bending(&only, &Linear::same_slopes) } else { Vec::new() };
                out[row] = [slope_kinks, jumps];
            }
        }
        out
    }

    /// The same, linearised at the operating point of a plant: it reads the actual values there, and signals at their initial values.
    #[must_use]
    pub fn at_operating_point(mut self, plant: &Plant) -> Self {
        let (angles, speeds) = (plant.true_angles(), plant.speeds_at_rest());
        let signal = |reference: &Reference| plant.signals.get(&reference.name).copied().unwrap_or(0.0);
        let references: Vec<f64> = self.references.iter().map(signal).collect();
        let (angles, speeds, references) = (&angles[..], &speeds[..], &references[..]);
        let observation =
            Observation { time: 0.0, angles, speeds, disturbances: &[], references, readings: &[], states: &[] };
        let read: Vec<f64> = (0..self.comes.len()).map(|k| self.value(k, &observation)).collect();
        let remembered = self.settled(&read);
        let point = [read, remembered].concat();
        let mut memory = self.plan.memory();
        memory[..point.len()].copy_from_slice(&point);
        let _ = self.plan.block().evaluate(&mut memory);
        let beside = |(k, name): (usize, &String)| {
            let (commanded, trim) = (memory[self.plan.place(k)], plant.trim_torque(name));
            let unit = plant.effort_of(name).unit;
            ((commanded - trim).abs() > SAME * trim.abs().max(1.0)).then(|| {
                format!(
                    "the law commands `{name}` with {commanded:.6} {unit} there, and equilibrium needs {trim:.6} {unit}"
                )
            })
        };
        let beside: Vec<String> = self.outputs.iter().enumerate().filter_map(beside).collect();
        self.point_note = (!beside.is_empty())
            .then(|| format!("The operating point is not an equilibrium of the closed loop: {}.", beside.join("; ")));
        self.point = Some(point);
        self
    }

    /// Its inputs of a kind, as sensors without errors read them.
    fn value(&self, read: usize, observation: &Observation<'_>) -> f64 {
        match self.comes[read] {
            Comes::Angle(shaft) => observation.angles[shaft],
            Comes::Speed(shaft) => observation.speeds[shaft],
            Comes::Reading(sensor) | Comes::AsRead(sensor) => self.ideal[sensor].read(observation),
            Comes::Reference(reference) => observation.references[reference],
            Comes::Time => observation.time,
        }
    }

    /// The states after the first samples, at which blocks have no earlier one, with these inputs.
    fn settled(&self, read: &[f64]) -> Vec<f64> {
        let mut remembered: Vec<f64> = self.task.memory.iter().map(|entry| entry.start).collect();
        let mut memory = self.plan.memory();
        for _ in 0..if self.clock.is_some() { FIRST } else { 0 } {
            memory[..self.comes.len()].copy_from_slice(read);
            memory[self.comes.len()..][..remembered.len()].copy_from_slice(&remembered);
            let _ = self.plan.block().evaluate(&mut memory);
            for (k, value) in remembered.iter_mut().enumerate() {
                *value = memory[self.plan.place(self.outputs.len() + k)];
            }
        }
        remembered
    }

    /// The point of its linearisation: its operating point, or zero inputs and the states after the first samples there.
    fn design_point(&self) -> Vec<f64> {
        self.point.clone().unwrap_or_else(|| {
            let nothing = vec![0.0; self.comes.len()];
            let remembered = self.settled(&nothing);
            [nothing, remembered].concat()
        })
    }

    /// Slopes at these inputs, then states.
    fn slopes_among(&self, inputs: &[f64], of_sides: &[SidesOf]) -> LinearLaw {
        let mut slopes = vec![vec![0.0; self.outputs.len() + self.task.memory.len()]; inputs.len()];
        let all = self.slopes_of_rows.clone().unwrap_or_else(|| self.all_rows());
        self.plain_slopes(&all, inputs, &mut |row, column, slope| slopes[column][row] = slope);
        for SidesOf { exprs, sides, .. } in of_sides {
            let Some(side) = sides.iter().find(|side| side.is_on(&self.side)).or(sides.first()) else { continue };
            for (&row, of) in exprs.iter().zip(&side.slopes) {
                slopes.iter_mut().for_each(|column| column[row] = 0.0);
                for (column, slope) in of {
                    slopes[*column][row] = slope.exact.as_ref().map_or(slope.value, rational_to_f64);
                }
            }
        }
        self.law_of(&slopes)
    }

    /// The same before rounding; `None` if a slope is not known to be a fraction.
    fn exact_slopes_among(&self, rows: &[usize], inputs: &[f64], of_sides: &[SidesOf]) -> Option<LinearLaw<Rational>> {
        let (mut graph, symbols) = (self.task.graph.clone(), self.task.inputs());
        let place = Inputs { law: self, symbols: &symbols, values: inputs };
        let count = self.outputs.len() + self.task.memory.len();
        let mut slopes = vec![vec![Rational::ZERO; count]; inputs.len()];
        let is_plain = |row: &usize| !of_sides.iter().any(|sides| sides.exprs.contains(row));
        let plain: Vec<usize> = rows.iter().copied().filter(is_plain).collect();
        let outputs = self.task.outputs();
        let exprs: Vec<_> = plain.iter().map(|row| outputs[*row].1).collect();
        let found = forward(&graph, &exprs, Surds, |symbol| (place.exact(symbol), place.place(symbol)));
        for ((row, expr), found) in plain.iter().zip(&exprs).zip(found) {
            for (column, slope) in &*found.slopes {
                let rational = slope.as_ref().and_then(Surd::to_rational);
                // An unknown intermediate value may not be in the derivative.
                let from_graph = |graph: &mut Graph| {
                    let derivative = graph.derivative(*expr, symbols[*column]);
                    exactly(graph, &[derivative], &place).swap_remove(0)
                };
                slopes[*column][*row] = rational.or_else(|| from_graph(&mut graph))?;
            }
        }
        for SidesOf { exprs, sides, .. } in of_sides {
            let side = sides.iter().find(|side| side.is_on(&self.side)).or(sides.first())?;
            for (&row, of) in exprs.iter().zip(&side.slopes) {
                for (column, slope) in of {
                    slopes[*column][row] = slope.exact.clone()?;
                }
            }
        }
        Some(self.law_of(&slopes))
    }

    /// The same of a task that computes at every instant, with few states; `None` of others.
    fn exact_slopes_of(
        &self,
        rows: &[usize],
        inputs: &[f64],
        of_sides: &[SidesOf],
    ) -> Option<Arc<LinearLaw<Rational>>> {
        let is_small = self.clock.is_none() && self.task.memory.len() <= MOST_EXACT;
        Some(Arc::new(is_small.then(|| self.exact_slopes_among(rows, inputs, of_sides))??))
    }

    /// A law with these slopes, of each input over outputs, then over next states.
    fn law_of<S: Scalar>(&self, slopes: &[Vec<S>]) -> LinearLaw<S> {
        let (outputs, states, reads) = (self.outputs.len(), self.task.memory.len(), self.comes.len());
        // Rows of outputs and of states over the inputs of a kind.
        let over = |first: usize, rows: usize, columns: usize, of: &dyn Fn(usize) -> SparseRow| {
            let mut out = Matrix::<S>::zeros(rows, columns);
            for (k, slopes) in slopes[..reads].iter().enumerate() {
                for (column, share) in of(k) {
                    let share = S::from_rational(&share);
                    (0..rows).for_each(|i| out[(i, column)] = out[(i, column)].plus(&share.times(&slopes[first + i])));
                }
            }
            out
        };
        let one = |k: usize| vec![(k, Rational::ONE)];
        let angles = |k: usize| match self.comes[k] {
            Comes::Angle(shaft) => one(shaft),
            Comes::Reading(sensor) | Comes::AsRead(sensor) => self.ideal[sensor].exact[0].clone(),
            _ => SparseRow::new(),
        };
        let speeds = |k: usize| match self.comes[k] {
            Comes::Speed(shaft) => one(shaft),
            Comes::Reading(sensor) | Comes::AsRead(sensor) => self.ideal[sensor].exact[1].clone(),
            _ => SparseRow::new(),
        };
        let references = |k: usize| match self.comes[k] {
            Comes::Reference(k) => one(k),
            Comes::Reading(sensor) | Comes::AsRead(sensor) => {
                self.ideal[sensor].reference.map_or_else(SparseRow::new, one)
            }
            _ => SparseRow::new(),
        };
        let errors = |k: usize| match self.comes[k] {
            Comes::Reading(k) | Comes::AsRead(k) => one(k),
            _ => SparseRow::new(),
        };
        let remembered =
            |first: usize, rows: usize| Matrix::from_fn(rows, states, |i, j| slopes[reads + j][first + i].clone());
        let (shafts, reference_count, sensors) = (self.shafts, self.references.len(), self.sensors.len());
        LinearLaw {
            states: remembered(outputs, states),
            angles: over(outputs, states, shafts, &angles),
            speeds: over(outputs, states, shafts, &speeds),
            disturbances: Matrix::zeros(states, 0),
            torques: Matrix::zeros(states, outputs),
            on_states: remembered(0, outputs),
            on_angles: over(0, outputs, shafts, &angles),
            on_speeds: over(0, outputs, shafts, &speeds),
            on_disturbances: Matrix::zeros(outputs, 0),
            references: over(outputs, states, reference_count, &references),
            on_references: over(0, outputs, reference_count, &references),
            errors: over(outputs, states, sensors, &errors),
            on_errors: over(0, outputs, sensors, &errors),
            flowing: false,
        }
    }

    /// The task around its inputs there. There is no search for kinks of rows other than these, outputs, then states.
    pub fn linearised(&self, observation: &Observation<'_>, rows: &[usize]) -> LinearTask {
        let inputs: Vec<f64> = (0..self.comes.len())
            .map(|k| self.value(k, observation))
            .chain(observation.states.iter().copied())
            .collect();
        let sides = self.sides_among(rows, &inputs);
        LinearTask {
            kinks: self.kinks_among(&inputs, &sides),
            linear: self.slopes_among(&inputs, &sides),
            exact: self.exact_slopes_of(rows, &inputs, &sides),
            clock: self.clock,
            outputs: self.outputs.clone(),
            references: self.references.iter().map(|reference| reference.name.clone()).collect(),
            sensors: self.sensors.clone(),
        }
    }

    fn block_of<T: Float>(&self) -> TaskBlock<T> {
        let mut memory = vec![T::ZERO; self.plan.block().memory()];
        let (constants, numbers) = (T::list(self.plan.constants()), T::list(self.plan.numbers()));
        self.plan.block_of(&constants, &numbers).begin(&mut memory);
        TaskBlock {
            memory,
            constants,
            numbers,
            plan: Arc::clone(&self.plan),
            comes: self.comes.clone(),
            ideal: self.ideal.clone(),
            outputs: vec![0.0; self.outputs.len()],
            next: vec![0.0; self.task.memory.len()],
            good: vec![f64::NAN; self.sensors.len()],
            sampled: self.clock.is_some(),
            frozen: 0,
            bad_readings: 0,
        }
    }
}

/// Part of a torque, or of 1 N m, that counts as none.
const SAME: f64 = 1e-9;
/// Number of samples after which no block takes a sample as its first.
const FIRST: usize = 2;

/// A task at its samples, or at every instant.
struct TaskBlock<T> {
    plan: Arc<Plan>,
    constants: Vec<T>,
    numbers: Vec<T>,
    comes: Vec<Comes>,
    ideal: Vec<Ideal>,
    memory: Vec<T>,
    /// The last valid outputs, and the next states.
    outputs: Vec<f64>,
    next: Vec<f64>,
    /// The last good readings; no numbers before the first.
    good: Vec<f64>,
    sampled: bool,
    /// Outputs and states of the last sample.
    frozen: usize,
    bad_readings: usize,
}

impl<T: Float> TaskBlock<T> {
    fn evaluate(&mut self, observation: Observation<'_>) {
        let good = self.good.iter_mut().zip(observation.readings).filter(|(_, reading)| reading.is_finite());
        good.for_each(|(good, reading)| *good = *reading);
        for (place, comes) in self.memory.iter_mut().zip(&self.comes) {
            *place = T::from_f64(match *comes {
                Comes::Angle(k) => observation.angles[k],
                Comes::Speed(k) => observation.speeds[k],
                // At every instant sensors are ideal.
                Comes::Reading(k) | Comes::AsRead(k) if observation.readings.is_empty() => {
                    self.ideal[k].read(&observation)
                }
                Comes::Reading(k) => self.good[k],
                Comes::AsRead(k) => observation.readings[k],
                Comes::Reference(k) => observation.references[k],
                Comes::Time => observation.time,
            });
        }
        let first = self.comes.len();
        T::narrow(observation.states, &mut self.memory[first..]);
        // A value that is not a number is detected where it is used.
        let _ = self.plan.block_of(&self.constants, &self.numbers).evaluate(&mut self.memory);
    }

    fn found(&self, output: usize) -> f64 {
        self.memory[self.plan.place(output)].to_f64()
    }
}

impl<T: Float> Block for TaskBlock<T> {
    fn command(&mut self, observation: Observation<'_>, out: &mut [f64]) -> bool {
        self.evaluate(observation);
        if !self.sampled {
            out.iter_mut().enumerate().for_each(|(k, out)| *out = self.found(k));
            return out.iter().all(|x| x.is_finite());
        }
        self.bad_readings = observation.readings.iter().filter(|reading| !reading.is_finite()).count();
        // A state that is not a number keeps its last value, each for itself.
        self.next.copy_from_slice(observation.states);
        self.frozen = 0;
        for k in 0..self.outputs.len() + self.next.len() {
            let new = self.found(k);
            let old = match k.checked_sub(self.outputs.len()) {
                Some(entry) => &mut self.next[entry],
                None => &mut self.outputs[k],
            };
            if new.is_finite() {
                *old = new;
            } else {
                self.frozen += 1;
            }
        }
        out.copy_from_slice(&self.outputs);
        true
    }

    fn states(&mut self, observation: Observation<'_>, _: &[f64], out: &mut [f64]) -> bool {
        if self.sampled {
            out.copy_from_slice(&self.next);
            return true;
        }
        self.evaluate(observation);
        let first = self.outputs.len();
        out.iter_mut().enumerate().for_each(|(k, out)| *out = self.found(first + k));
        out.iter().all(|x| x.is_finite())
    }

    fn archive_state(&mut self, archive: &mut StateArchive<'_>) {
        archive.numbers(&mut self.outputs);
        archive.numbers(&mut self.good);
        archive.count(&mut self.frozen);
        archive.count(&mut self.bad_readings);
    }

    fn health(&self) -> Health {
        Health { invalid_readings: self.bad_readings, estimate_frozen: self.frozen > 0, ..Health::default() }
    }
}

impl Law for TaskLaw {
    fn inputs(&self) -> &[String] {
        &self.outputs
    }

    fn references(&self) -> &[Reference] {
        &self.references
    }

    fn states(&self) -> Vec<String> {
        self.task.memory.iter().map(|entry| entry.name.clone()).collect()
    }

    fn start(&self, _: &[f64], _: &[f64], out: &mut [f64]) {
        out.iter_mut().zip(&self.task.memory).for_each(|(out, entry)| *out = entry.start);
    }

    fn block(&self, clock: Option<Clock>) -> Option<Box<dyn Block>> {
        let own = self.clock.map(|clock| clock.period);
        if clock.is_some_and(|clock| own.is_some_and(|own| own != clock.period)) {
            return None;
        }
        match clock {
            Some(clock) if clock.single => Some(Box::new(self.block_of::<f32>())),
            _ => Some(Box::new(self.block_of::<f64>())),
        }
    }

    fn is_nonlinear(&self) -> bool {
        !self.affine
    }

    /// Slopes at its operating point; without one at zero inputs and the states after the first samples there.
    fn linear(&self) -> LinearLaw {
        let linear = || {
            let inputs = self.design_point();
            self.slopes_among(&inputs, self.sides())
        };
        self.at_design_point.get_or_init(linear).clone()
    }

    fn linear_exact(&self) -> Option<Arc<LinearLaw<Rational>>> {
        let exact = || {
            let inputs = self.design_point();
            self.exact_slopes_of(&self.all_rows(), &inputs, self.sides())
        };
        self.exact_at_design_point.get_or_init(exact).clone()
    }

    fn kinks(&self) -> Kinks {
        let inputs = self.design_point();
        self.kinks_among(&inputs, self.sides())
    }

    fn on_side(&self, side: &Side) -> Option<Arc<dyn Law>> {
        let task = &self.task;
        let (outputs, references, sensors) = (self.outputs.clone(), self.references.clone(), self.sensors.clone());
        let (ideal, comes, plan) = (self.ideal.clone(), self.comes.clone(), Arc::clone(&self.plan));
        let (task, at_design_point, side) = (Arc::clone(task), OnceLock::new(), side.clone());
        let (point, point_note) = (self.point.clone(), self.point_note.clone());
        let law = Self {
            outputs,
            references,
            sensors,
            ideal,
            comes,
            plan,
            task,
            sides_at_design_point: OnceLock::new(),
            at_design_point,
            exact_at_design_point: OnceLock::new(),
            slopes_of_rows: self.slopes_of_rows.clone(),
            side,
            point,
            point_note,
            ..*self
        };
        Some(Arc::new(law))
    }

    /// At its own samples; without any, commands are sampled alone: its blocks have no sample time and go on at every instant.
    fn linear_sampled(&self, clock: Clock) -> Option<LinearLaw> {
        match self.clock {
            Some(own) => (own.period == clock.period).then(|| self.linear()),
            None => Some(LinearLaw { flowing: true, ..self.linear() }),
        }
    }

    fn sensors(&self) -> &[OutputSignal] {
        &self.sensors
    }

    fn task(&self) -> Option<&Arc<Task>> {
        use Measured::{Angle, Speed, SpringTorque};
        let of_motion = |sensor: &OutputSignal| matches!(sensor.measured, Angle(_) | Speed(_) | SpringTorque(_));
        let is_inline = self.clock.is_none() && self.task.memory.is_empty() && self.sensors.iter().all(of_motion);
        is_inline.then_some(&self.task)
    }

    fn clock(&self) -> Option<Clock> {
        self.clock
    }

    fn keeps(&self) -> Frozen {
        if self.law == BLOCKS { Frozen::Outputs } else { Frozen::Command }
    }

    fn describe(&self) -> Design {
        let task = &self.task;
        let reads = task.reads.iter().map(|(symbol, _)| {
            let (name, dimension) = task.graph.name(*symbol);
            ReadSignal::new(name, dimension.si())
        });
        let blocks: Vec<String> =
            task.order.iter().map(|step| format!("{} ({})", step.block, step.kind.replace('_', " "))).collect();
        let initial_state = ("initial_state", task.memory.iter().map(|entry| vec![entry.start]).collect());
        let mut notes = Vec::new();
        if !blocks.is_empty() {
            notes.push(format!("Its blocks compute in this order: {}.", blocks.join(", ")));
        }
        notes.push(format!(
            "One sample takes {} operations on {} state variables.",
            self.plan.operations(),
            task.memory.len()
        ));
        if !self.affine {
            let place = match self.point {
                Some(_) => "at the operating point, with signals at their initial values",
                None => "where all its inputs are zero",
            };
            notes.push(format!("Nonlinear law: the statements about its loop are those of its linearisation {place}."));
        }
        notes.extend(self.point_note.clone());
        Design {
            controller: task.name.clone(),
            law: self.law.into(),
            inputs: self.outputs.clone(),
            controller_data: ControllerData {
                block: "Plan".into(),
                reads: reads.collect(),
                writes: self.outputs.clone(),
                sample_time: self.clock.map(|clock| clock.period),
                single: self.clock.is_some_and(|clock| clock.single),
                matrices: self
                    .plan
                    .rows(self.plan.constants(), self.plan.numbers())
                    .into_iter()
                    .chain([initial_state])
                    .map(|(name, rows)| DataMatrix::new(name, rows))
                    .collect(),
                numbers: Vec::new(),
            },
            notes,
            ..Design::default()
        }
    }
}
