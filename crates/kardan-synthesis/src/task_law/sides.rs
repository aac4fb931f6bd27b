//! The sides of kinks at a point of a task, and derivatives where no guard vanishes.

use crate::Kinks;
use kardan_expr::expr::{Direction, Interval, Linear, Place, SidesOf, Surd, Symbol, bending, kinked, slopes_at};
use kardan_math::num::{Rational, SparseRow};

use super::TaskLaw;

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
pub(super) struct Inputs<'a> {
    pub(super) law: &'a TaskLaw,
    pub(super) symbols: &'a [Symbol],
    pub(super) values: &'a [f64],
}

impl Place for Inputs<'_> {
    fn place(&self, symbol: Symbol) -> Option<usize> {
        self.symbols.iter().position(|own| *own == symbol)
    }

    fn exact(&self, symbol: Symbol) -> Option<Surd> {
        Surd::recognise_double(self.value(symbol))
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
        let [angles, speeds] = if place < law.comes.len() { law.motion_rows(place) } else { Default::default() };
        let speeds = speeds.into_iter().map(|(shaft, x)| (law.shafts + shaft, x));
        let row: SparseRow = angles.into_iter().chain(speeds).collect();
        if row.is_empty() { vec![(2 * law.shafts + place, Rational::ONE)] } else { row }
    }
}

impl TaskLaw {
    /// Its forms on the sides of its design point, to first order: empty where no guard vanishes there.
    pub(super) fn sides(&self) -> &[SidesOf] {
        self.sides_at_design_point.get_or_init(|| self.sides_among(&self.all_rows(), &self.design_point()))
    }

    /// The same of some outputs, then states, at a point.
    pub(super) fn sides_among(&self, rows: &[usize], inputs: &[f64]) -> Vec<SidesOf> {
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
    pub(super) fn plain_slopes(&self, rows: &[usize], inputs: &[f64], put: &mut dyn FnMut(usize, usize, f64)) {
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
                let mut slopes = vec![0.0; columns * (self.outputs.len() + self.task.states.len())];
                self.plain_slopes(rows, &at, &mut |row, column, slope| slopes[row * columns + column] = slope);
                let mut memory = self.plan.memory();
                memory[..columns].copy_from_slice(&at);
                let _ = self.plan.block().evaluate(&mut memory);
                let values = (0..self.outputs.len() + self.task.states.len()).map(|row| memory[self.plan.place(row)]);
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
    pub(super) fn kinks_among(&self, inputs: &[f64], sides: &[SidesOf]) -> Kinks {
        let mut out = vec![[Vec::new(), Vec::new()]; self.outputs.len() + self.task.states.len()];
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
}
