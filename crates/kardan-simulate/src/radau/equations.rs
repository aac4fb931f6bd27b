//! The equations that the method for stiff loops integrates.

use std::ops::{AddAssign, Mul};

use kardan_math::num::{SparseLu, SparseOrder, StateArchive};

/// The equations to integrate.
pub(crate) trait Equations {
    /// The rates of all states.
    fn rates(&mut self, time: f64, state: &[f64], out: &mut [f64]);
    /// Their derivatives at a state, as linear equations, without the last states, which no equation depends on.
    fn linearise(&mut self, time: f64, state: &[f64], out: &mut Descriptor);
}

/// Relative change of a state where derivatives are differences: half of their digits are correct.
const CHANGE: f64 = 1e-8;

/// `E ẋ = A x`, linear equations of the motion near a state. Behind the states are algebraic variables, such as
/// constraint torques.
#[derive(Debug, Clone, Default)]
pub(crate) struct Descriptor {
    /// The number of states, and of further unknowns.
    pub(super) size: usize,
    /// Row and column of each entry, those of E first.
    pub(super) places: Vec<(usize, usize)>,
    values: Vec<f64>,
    /// How many entries E has.
    mass: usize,
    /// States that do not move.
    pub(super) still: Vec<usize>,
}

impl Descriptor {
    /// Without entries, for `size` unknowns.
    pub(crate) fn clear(&mut self, size: usize) {
        (self.size, self.mass) = (size, 0);
        self.places.clear();
        self.values.clear();
        self.still.clear();
    }

    /// Adds to E; before anything is added to A.
    pub(crate) fn mass(&mut self, row: usize, column: usize, value: f64) {
        debug_assert_eq!(self.mass, self.places.len());
        self.rate(row, column, value);
        self.mass += 1;
    }

    /// Adds to A.
    pub(crate) fn rate(&mut self, row: usize, column: usize, value: f64) {
        self.places.push((row, column));
        self.values.push(value);
    }

    /// A state at rest.
    pub(crate) fn still(&mut self, state: usize) {
        self.still.push(state);
    }

    /// Whether all entries are finite numbers.
    pub(super) fn is_finite(&self) -> bool {
        self.values.iter().all(|value| value.is_finite())
    }

    /// Becomes `ẋ = A x` for the first states, one for each size: A from differences of the rates, on the other side
    /// where one side is undefined. States at rest stay at rest. Returns the number of evaluations.
    pub(super) fn differ(
        &mut self,
        (time, state, slope): (f64, &[f64], &[f64]),
        sizes: impl Iterator<Item = f64>,
        equations: &mut impl Equations,
    ) -> u64 {
        let (sizes, still): (Vec<f64>, _) = (sizes.collect(), std::mem::take(&mut self.still));
        let n = sizes.len();
        self.clear(n);
        self.still = still;
        (0..n).for_each(|i| self.mass(i, i, 1.0));
        let (mut perturbed, mut rates, mut evaluations) = (state.to_vec(), slope.to_vec(), 0);
        for (column, size) in sizes.into_iter().enumerate() {
            for change in [CHANGE * size, -CHANGE * size] {
                perturbed[column] = state[column] + change;
                equations.rates(time, &perturbed, &mut rates);
                evaluations += 1;
                if rates[..n].iter().all(|rate| rate.is_finite()) {
                    break;
                }
            }
            let change = perturbed[column] - state[column];
            for row in 0..n {
                self.rate(row, column, (rates[row] - slope[row]) / change);
            }
            perturbed[column] = state[column];
        }
        evaluations
    }

    /// Archives the entries; false if the restored ones do not fit.
    pub(super) fn archive_state(&mut self, archive: &mut StateArchive<'_>) -> bool {
        let [mut rows, mut columns]: [Vec<usize>; 2] =
            [self.places.iter().map(|(i, _)| *i).collect(), self.places.iter().map(|(_, j)| *j).collect()];
        [&mut self.size, &mut self.mass].into_iter().for_each(|count| archive.count(count));
        [&mut rows, &mut columns, &mut self.still].into_iter().for_each(|list| archive.counts(list));
        archive.numbers(&mut self.values);
        let inside = |list: &[usize]| list.iter().all(|i| *i < self.size);
        let fits = rows.len() == columns.len() && rows.len() == self.values.len() && self.mass <= rows.len();
        let fits = fits && inside(&rows) && inside(&columns) && inside(&self.still);
        self.places = if fits { rows.into_iter().zip(columns).collect() } else { Vec::new() };
        fits
    }

    /// The derivatives of the rates of n states by each of them, row by row; NaN where they are not determined.
    pub(crate) fn solve(&self, n: usize, out: &mut [f64]) {
        let entries = self.places.iter().zip(&self.values).enumerate();
        let (present, rates): (Vec<_>, Vec<_>) = entries.partition(|(k, (place, _))| *k < self.mass || place.1 >= n);
        let places: Vec<(usize, usize)> = present.iter().map(|(_, (place, _))| **place).collect();
        let numbers: Vec<f64> = present.iter().map(|(k, (_, x))| if *k < self.mass { **x } else { -**x }).collect();
        let (order, mut factors) = (SparseOrder::new(self.size, &places), SparseLu::default());
        let order = order.filter(|order| factors.factor(order, &numbers));
        let Some(order) = order else { return out.fill(f64::NAN) };
        let mut right = vec![0.0; self.size];
        for column in 0..n {
            right.fill(0.0);
            let own = rates.iter().filter(|(_, (place, _))| place.1 == column);
            own.for_each(|(_, (place, x))| right[place.0] += **x);
            factors.solve(&order, &mut right);
            self.still.iter().for_each(|i| right[*i] = 0.0);
            right.iter().take(n).enumerate().for_each(|(row, x)| out[row * n + column] = *x);
        }
    }

    /// `σ E − A`.
    pub(super) fn shifted<T: Copy + Mul<f64, Output = T> + From<f64>>(&self, shift: T, out: &mut Vec<T>) {
        let value = |(k, value): (usize, &f64)| if k < self.mass { shift * *value } else { T::from(-value) };
        out.clear();
        out.extend(self.values.iter().enumerate().map(value));
    }

    /// `E b`, for b over the states.
    pub(super) fn weigh<T: Copy + Default + AddAssign + Mul<f64, Output = T>>(&self, b: &[T], out: &mut Vec<T>) {
        out.clear();
        out.resize(self.size, T::default());
        let mass = self.places.iter().zip(&self.values).take(self.mass);
        mass.for_each(|((i, j), value)| out[*i] += b[*j] * *value);
    }
}
