//! The linear part of a task at its operating point or at any inputs, in floating point and before rounding.

use std::sync::Arc;

use crate::{LinearLaw, LinearTask, Observation, Plant, Reference};
use kardan_expr::expr::{Graph, Intervals, Place, SidesOf, Surd, Surds, exactly, forward};
use kardan_math::num::{Matrix, Rational, Scalar, SparseRow, rational_to_f64};

use super::TaskLaw;
use super::sides::Inputs;
use super::task_inputs::Comes;

/// Most states of a task whose slopes are computed before rounding.
const MOST_EXACT: usize = 32;

impl TaskLaw {
    /// The same, linearised at the operating point of a plant: it reads the actual values there, and signals at their initial values.
    #[must_use]
    pub fn at_operating_point(mut self, plant: &Plant) -> Self {
        let (angles, speeds) = (plant.true_angles(), plant.speeds_at_rest());
        let signal = |reference: &Reference| plant.signals.get(&reference.name).copied().unwrap_or(0.0);
        let references: Vec<f64> = self.references.iter().map(signal).collect();
        let (angles, speeds, references) = (&angles[..], &speeds[..], &references[..]);
        let observation = Observation { angles, speeds, references, ..Observation::default() };
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

    /// Rows over the angles and over the speeds of all shafts that an input follows.
    pub(super) fn motion_rows(&self, read: usize) -> [SparseRow; 2] {
        match self.comes[read] {
            Comes::Angle(shaft) => [vec![(shaft, Rational::ONE)], SparseRow::new()],
            Comes::Speed(shaft) => [SparseRow::new(), vec![(shaft, Rational::ONE)]],
            Comes::Reading(sensor) | Comes::AsRead(sensor) => self.ideal[sensor].exact.clone(),
            Comes::Reference(_) | Comes::Time => Default::default(),
        }
    }

    /// The states after the first samples, at which blocks have no earlier one, with these inputs.
    fn settled(&self, read: &[f64]) -> Vec<f64> {
        let mut remembered: Vec<f64> = self.task.states.iter().map(|entry| entry.start).collect();
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
    pub(super) fn design_point(&self) -> Vec<f64> {
        self.point.clone().unwrap_or_else(|| {
            let nothing = vec![0.0; self.comes.len()];
            let remembered = self.settled(&nothing);
            [nothing, remembered].concat()
        })
    }

    /// Slopes at these inputs, then states.
    pub(super) fn slopes_among(&self, inputs: &[f64], of_sides: &[SidesOf]) -> LinearLaw {
        let mut slopes = vec![vec![0.0; self.outputs.len() + self.task.states.len()]; inputs.len()];
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
        self.law_of(&slopes, &rational_to_f64)
    }

    /// The same before rounding; `None` if a slope is not known to be a fraction.
    fn exact_slopes_among(&self, rows: &[usize], inputs: &[f64], of_sides: &[SidesOf]) -> Option<LinearLaw<Rational>> {
        let (mut graph, symbols) = (self.task.graph.clone(), self.task.inputs());
        let place = Inputs { law: self, symbols: &symbols, values: inputs };
        let count = self.outputs.len() + self.task.states.len();
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
        Some(self.law_of(&slopes, &Rational::clone))
    }

    /// The same of a task that computes at every instant, with few states; `None` of others.
    pub(super) fn exact_slopes_of(
        &self,
        rows: &[usize],
        inputs: &[f64],
        of_sides: &[SidesOf],
    ) -> Option<Arc<LinearLaw<Rational>>> {
        let is_small = self.clock.is_none() && self.task.states.len() <= MOST_EXACT;
        Some(Arc::new(is_small.then(|| self.exact_slopes_among(rows, inputs, of_sides))??))
    }

    /// By how much rounding may have moved these slopes, where that is more than their last digits.
    pub(super) fn slope_rounding(
        &self,
        rows: &[usize],
        inputs: &[f64],
        of_sides: &[SidesOf],
        linear: &LinearLaw,
    ) -> Option<Arc<LinearLaw>> {
        let symbols = self.task.inputs();
        let place = Inputs { law: self, symbols: &symbols, values: inputs };
        let count = self.outputs.len() + self.task.states.len();
        let mut rounding = vec![vec![0.0; count]; inputs.len()];
        let outputs = self.task.outputs();
        let exprs: Vec<_> = rows.iter().map(|row| outputs[*row].1).collect();
        let found =
            forward(&self.task.graph, &exprs, Intervals, |symbol| (place.enclosure(symbol), place.place(symbol)));
        for (row, found) in rows.iter().zip(found) {
            for (column, slope) in &*found.slopes {
                let width = slope.high - slope.low;
                rounding[*column][*row] = if width.is_finite() { width } else { 0.0 };
            }
        }
        for SidesOf { exprs, sides, .. } in of_sides {
            let side = sides.iter().find(|side| side.is_on(&self.side)).or(sides.first())?;
            for (&row, of) in exprs.iter().zip(&side.slopes) {
                rounding.iter_mut().for_each(|column| column[row] = 0.0);
                of.iter().for_each(|(column, slope)| rounding[*column][row] = slope.rounding());
            }
        }
        let of_each = self.law_of(&rounding, &|share: &Rational| rational_to_f64(share).abs());
        of_each.beyond_last_digits(linear).map(Arc::new)
    }

    /// A law with these slopes, of each input over outputs, then over next states.
    fn law_of<S: Scalar>(&self, slopes: &[Vec<S>], share_of: &dyn Fn(&Rational) -> S) -> LinearLaw<S> {
        let (outputs, states, reads) = (self.outputs.len(), self.task.states.len(), self.comes.len());
        // Rows of outputs and of states over the inputs of a kind.
        let over = |first: usize, rows: usize, columns: usize, of: &dyn Fn(usize) -> SparseRow| {
            let mut out = Matrix::<S>::zeros(rows, columns);
            for (k, slopes) in slopes[..reads].iter().enumerate() {
                for (column, share) in of(k) {
                    let share = share_of(&share);
                    (0..rows).for_each(|i| out[(i, column)] = out[(i, column)].plus(&share.times(&slopes[first + i])));
                }
            }
            out
        };
        let one = |k: usize| vec![(k, Rational::ONE)];
        let [angles, speeds] = [0, 1].map(|rate| move |k: usize| self.motion_rows(k)[rate].clone());
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
        let linear = self.slopes_among(&inputs, &sides);
        let exact = self.exact_slopes_of(rows, &inputs, &sides);
        let rounding = if exact.is_none() { self.slope_rounding(rows, &inputs, &sides, &linear) } else { None };
        LinearTask {
            kinks: self.kinks_among(&inputs, &sides),
            linear,
            exact,
            rounding,
            clock: self.clock,
            outputs: self.outputs.clone(),
            references: self.references.iter().map(|reference| reference.name.clone()).collect(),
            sensors: self.sensors.clone(),
        }
    }
}

/// Part of a torque, or of 1 N m, that counts as none.
const SAME: f64 = 1e-9;
/// Number of samples after which no block takes a sample as its first.
const FIRST: usize = 2;
