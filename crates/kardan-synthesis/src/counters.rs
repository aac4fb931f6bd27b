//! Charges that are integrators without effect.

use std::sync::Arc;

use super::{Law, Plant, linear_combination};
use kardan_analysis::LinearSystem;
use kardan_math::num::{Matrix, Rational, Scalar, columns_of, rational_from_f64, reduced_form};

/// Directions of charges that change nothing: the charge through a source or a motor, or of several the sum that flows past a capacitor. They
/// are integrators without effect, and no law controls them. Exact.
#[derive(Debug, Clone, PartialEq)]
pub struct Counters {
    /// One column for each, a row for each reduced coordinate.
    pub directions: Matrix<Rational>,
    /// For each the coordinate that measures it, in which the others are zero: without this coordinate the rest of the state is determined.
    pub measured: Vec<usize>,
}

impl Counters {
    /// The directions that these rows over the reduced coordinates do not measure; entries after these do not matter.
    fn null_directions<'a>(plant: &Plant, rows: impl Iterator<Item = &'a [Rational]>) -> Self {
        let coordinates = &plant.reduced.coordinates;
        let is_charge = |k: &usize| plant.reduced.equations.domain(coordinates[*k]).counts();
        let charges: Vec<usize> = (0..coordinates.len()).filter(is_charge).collect();
        let rows: Vec<&[Rational]> = if charges.is_empty() { Vec::new() } else { rows.collect() };
        let matrix = Matrix::from_fn(rows.len(), charges.len(), |i, j| rows[i][charges[j]].clone());
        Self::kernel(&matrix, &charges, coordinates.len())
    }

    /// The directions that a matrix over these charges, of so many coordinates, sends to zero.
    fn kernel(matrix: &Matrix<Rational>, charges: &[usize], coordinates: usize) -> Self {
        let e = reduced_form(matrix);
        let (kernel, place) = (e.kernel(), |k: usize| charges.iter().position(|charge| *charge == k));
        Self {
            directions: Matrix::from_fn(coordinates, kernel.columns(), |i, j| {
                place(i).map_or(Rational::ZERO, |i| kernel[(i, j)].clone())
            }),
            measured: e.free().into_iter().map(|k| charges[k]).collect(),
        }
    }

    /// Each as a combination of charges.
    pub fn names(&self, plant: &Plant) -> Vec<String> {
        let names: Vec<String> = plant.motions(0).into_iter().map(|read| read.signal).collect();
        self.combinations(&names)
    }

    fn combinations(&self, names: &[String]) -> Vec<String> {
        let columns = self.directions.transpose();
        (0..columns.rows()).map(|j| linear_combination(names, columns.row(j))).collect()
    }
}

/// The states of a system without its integrators without effect: `z = P x`, in coordinates in which their charges are zero.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ReducedStates {
    /// Numbers of the states that are left.
    pub retained: Vec<usize>,
    /// P, states that are left × states: the identity on these.
    pub projection: Matrix<Rational>,
}

impl ReducedStates {
    /// Of so many states, the reduced coordinates before all others.
    pub fn of(counters: &Counters, states: usize) -> Self {
        let retained: Vec<usize> = (0..states).filter(|k| !counters.measured.contains(k)).collect();
        let projection = Matrix::from_fn(retained.len(), states, |i, j| {
            let counter = counters.measured.iter().position(|k| *k == j);
            match counter.filter(|_| retained[i] < counters.directions.rows()) {
                Some(counter) => Rational::ZERO.minus(&counters.directions[(retained[i], counter)]),
                None if retained[i] == j => Rational::ONE,
                None => Rational::ZERO,
            }
        });
        Self { retained, projection }
    }

    /// All of them.
    pub fn all(states: usize) -> Self {
        Self { retained: (0..states).collect(), projection: Matrix::identity(states) }
    }

    /// The system over the remaining states. E is the identity.
    pub fn system(&self, system: &LinearSystem) -> LinearSystem {
        let on_retained = |m: &Matrix<Rational>| columns_of(m, &self.retained);
        let names = (0..self.retained.len()).map(|i| linear_combination(&system.states, self.projection.row(i)));
        LinearSystem {
            states: names.collect(),
            inputs: system.inputs.clone(),
            outputs: system.outputs.clone(),
            e: Matrix::identity(self.retained.len()),
            a: self.columns(&on_retained(&system.a)),
            b: self.columns(&system.b),
            c: on_retained(&system.c),
            d: system.d.clone(),
            degrees_of_freedom: system.degrees_of_freedom.filter(|_| self.retained.len() == system.states.len()),
        }
    }

    /// Columns over the states as columns over the remaining ones.
    pub fn columns(&self, columns: &Matrix<Rational>) -> Matrix<Rational> {
        self.projection.multiply(columns)
    }
}

/// Charges among these states that act on nothing, as text, whether no output shows them, and the system of all other states. None where there are none,
/// or where E is singular.
pub fn remove_counting_charges(system: &LinearSystem, charges: &[usize]) -> Option<(Vec<String>, bool, LinearSystem)> {
    let states = system.states.len();
    let matrix = Matrix::from_fn(states, charges.len(), |i, j| system.a[(i, charges[j])].clone());
    let counters = Counters::kernel(&matrix, charges, states);
    if counters.measured.is_empty() {
        return None;
    }
    let hidden = system.c.multiply(&counters.directions).as_slice().iter().all(Scalar::is_zero);
    let rest = ReducedStates::of(&counters, states).system(&system.explicit()?);
    Some((counters.combinations(&system.states), hidden, rest))
}

/// The charges that neither A nor C of a plant's system know, without those that a law acts by, whose rows over the reduced
/// coordinates are given.
pub(super) fn counters_beside(plant: &Plant, system: &LinearSystem, acting: &[Matrix<Rational>]) -> Counters {
    Counters::null_directions(plant, [&system.a, &system.c].into_iter().chain(acting).flat_map(rows))
}

fn rows(matrix: &Matrix<Rational>) -> impl Iterator<Item = &[Rational]> {
    (0..matrix.rows()).map(|i| matrix.row(i))
}

/// Charges on which neither the plant nor laws depend: each is a pole of their loop exactly at zero. None where a law is made for a sample time.
pub fn counting_charges(plant: &Plant, laws: &[Arc<dyn Law>]) -> Counters {
    if laws.iter().any(|law| law.clock().is_some()) {
        let unit = Matrix::identity(plant.reduced.degrees_of_freedom());
        return Counters::null_directions(plant, rows(&unit));
    }
    let acting: Vec<Matrix<Rational>> = laws.iter().flat_map(|law| acts_by(&**law, &plant.linear.basis)).collect();
    Counters::null_directions(plant, std::iter::once(&plant.linear.stiffness).chain(&acting).flat_map(rows))
}

/// The dependence of a law on the reduced coordinates, for its commands and for its states.
pub(super) fn acts_by(law: &dyn Law, basis: &Matrix<Rational>) -> [Matrix<Rational>; 2] {
    let linear = law.linear();
    [&linear.on_angles, &linear.angles].map(|rows| {
        // NaN is not zero.
        let exact = |i: usize, j: usize| rational_from_f64(rows[(i, j)]).unwrap_or(Rational::ONE);
        Matrix::from_fn(rows.rows(), rows.columns(), exact).multiply(basis)
    })
}
