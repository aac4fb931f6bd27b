//! Frequency responses of a loop to errors, readings and references.

use std::sync::Arc;

use faer::Mat;

use super::event_sequence::Periods;
use super::places::Number;
use super::{ExactMap, FirstOrderPlant, LoopPlant, Places, SampledLoop, SampledPart};
use crate::LinearLaw;
use crate::margins::Response;
use crate::matrix_parts::{exactly, selected, window};
use kardan_math::num::{Matrix, Rational, Rounding, Scalar, at_zero, balance, columns_of, rows_of, scaled};
use kardan_mechanics::reduce::motions_over_states;

/// A controller in the loop of a plant, with all controllers as they run.
#[derive(Debug, Clone, Copy)]
pub struct ControlLoop<'a> {
    /// The plant.
    pub plant: &'a LoopPlant,
    /// All controllers.
    pub parts: &'a [SampledPart],
    /// The selected one.
    pub number: usize,
}

/// The sample times of controllers and sensors differ.
struct SeveralTimes;

/// The loop for errors of a controller's readings.
#[derive(Debug, Clone, PartialEq)]
pub struct Readings {
    /// The reading.
    pub names: Vec<String>,
    /// From the errors to the true readings.
    pub loops: Response,
    /// From the errors to the commands of the controller's motors.
    pub commands: Response,
}

impl ControlLoop<'_> {
    /// The loop for errors of the motors' torques, a channel for each motor of the controller; uncontrolled rigid-body modes are
    /// left out. `None` if the loop has several clocks and this controller commands more than once in their common period, or if it cannot be computed.
    pub fn motors(&self) -> Option<Response> {
        let part = &self.parts[self.number];
        let m = part.inputs.len();
        let period = match self.period() {
            Ok(period) => period,
            Err(SeveralTimes) => Some(self.common_period()?),
        };
        let Some(period) = period else {
            let [flow, b, c] = self.motors_in(&Places::new(self.plant, self.parts, true))?;
            let sizes = Places::sizes(self.plant, self.parts);
            let found = response_excluding_free(&flow, sizes.as_ref(), [&b, &c, &Matrix::zeros(m, m)], None)?;
            let exact = self.exact_places(self.parts).and_then(|places| self.motors_in(&places));
            return Some(match exact {
                Some([flow, b, c]) => found.before_rounding(only_between(&flow, [&b, &c, &Matrix::zeros(m, m)])),
                None => found,
            });
        };
        part.clock?;
        let found = SampledLoop::driven(self.plant, self.parts, period).ok()?;
        let (n, excess, first) = (found.constants, found.excess[self.number], found.in_force[self.number]);
        let exact = || ExactMap::between_commands(self.plant, self.parts, self.number);
        let map = if found.has_large_terms() { exact() } else { None };
        let map = map.or_else(|| found.between_commands(self.number))?;
        let b = window(&map, 0..n, excess..excess + m);
        let c = Matrix::from_fn(m, n, |i, j| f64::from(u8::from(j == first + i)));
        response_excluding_free(&map, None, [&b, &c, &Matrix::zeros(m, m)], Some(period))
    }

    /// The matrix, B and C of the loop in continuous time for errors of the motors' torques.
    fn motors_in<S: Number>(&self, places: &Places<'_, S>) -> Option<[Matrix<S>; 3]> {
        let inputs = &self.parts[self.number].inputs;
        let (flow, commands) = places.flow();
        let (n, excess) = (places.laws.first()?.references?, places.laws[self.number].excess?);
        let b = window(&flow, 0..n, excess..excess + inputs.len());
        let c = Matrix::from_fn(inputs.len(), n, |i, j| commands[(inputs[i], j)].clone());
        Some([flow, b, c])
    }

    /// The loop in continuous time before rounding, where no number of it is rounded.
    fn exact_places<'a>(&self, parts: &'a [SampledPart]) -> Option<Places<'a, Rational>> {
        let is_rounded = |part: &SampledPart| part.clock.is_some() || !part.linear.is_finite() || part.is_rounded();
        if parts.iter().any(is_rounded) || self.plant.exact.as_ref()?.is_rounded() {
            return None;
        }
        Some(Places::of(FirstOrderPlant::exact(self.plant)?, parts, true))
    }

    /// The same for errors of the controller's readings.
    ///
    /// A law with sensors reads these, `sensors` has each one's row over `[q_r; q̇_r]`; another one reads the angles and speeds of
    /// the coordinates that it uses; `motions` has the names of angle and speed of each.
    ///
    /// # Panics
    /// If there is not one row for each sensor, and one pair of names for each coordinate.
    pub fn readings(&self, sensors: &[(String, Vec<Rational>)], motions: &[[String; 2]]) -> Option<Readings> {
        let period = self.period().ok()?;
        let mut parts = self.parts.to_vec();
        let part = &mut parts[self.number];
        if !part.slow.is_empty() || (period.is_some() && part.clock.is_none()) {
            return None;
        }
        assert_eq!(motions.len(), self.plant.basis.rows(), "names for each coordinate");
        let read = if part.linear.on_errors.columns() > 0 {
            assert_eq!(part.linear.on_errors.columns(), sensors.len(), "one row for each sensor");
            sensors.to_vec()
        } else {
            self.motions_as_sensors(part, motions)
        };
        let (names, rows): (Vec<String>, Vec<Vec<Rational>>) = read.into_iter().unzip();
        let (errors, inputs) = (names.len(), part.inputs.clone());
        let m = inputs.len();
        let mut direct = Matrix::zeros(m, errors);
        let (n, first, map, command) = if let Some(period) = period {
            // Commands in force, which follow the readings after the delay: the size is that of the commands themselves.
            let found = SampledLoop::driven(self.plant, &parts, period).ok()?;
            let in_force = found.in_force[self.number];
            let command = Matrix::from_fn(m, found.constants, |i, j| f64::from(u8::from(j == in_force + i)));
            (found.constants, found.errors[self.number], found.map, command)
        } else {
            let places = Places::new(self.plant, &parts, true);
            let (flow, commands) = places.flow();
            let (n, first) = (places.laws.first()?.references?, places.laws[self.number].errors?);
            direct = Matrix::from_fn(m, errors, |i, j| commands[(inputs[i], first + j)]);
            (n, first, flow, Matrix::from_fn(m, n, |i, j| commands[(inputs[i], j)]))
        };
        let b = window(&map, 0..n, first..first + errors);
        let zero = Rational::ZERO;
        let exact_c = Matrix::from_fn(errors, n, |i, j| rows[i].get(j).unwrap_or(&zero).clone());
        let c = exact_c.to_f64();
        let sizes = if period.is_none() { Places::sizes(self.plant, &parts) } else { None };
        let mut loops =
            response_excluding_free(&map, sizes.as_ref(), [&b, &c, &Matrix::zeros(errors, errors)], period)?;
        if let Some(places) = self.exact_places(&parts) {
            let (flow, _) = places.flow();
            let b = window(&flow, 0..n, first..first + errors);
            loops = loops.before_rounding(only_between(&flow, [&b, &exact_c, &Matrix::zeros(errors, errors)]));
        }
        let commands = response_excluding_free(&map, sizes.as_ref(), [&b, &command, &direct], period)?;
        Some(Readings { names, loops, commands })
    }

    /// Gives a law without sensors errors of the angles and speeds that it uses: their names and their rows.
    fn motions_as_sensors(&self, part: &mut SampledPart, motions: &[[String; 2]]) -> Vec<(String, Vec<Rational>)> {
        let linear = &part.linear;
        let basis = self.plant.exact.as_ref().map_or_else(|| exactly(&self.plant.basis), |model| model.basis.clone());
        let motion_rows = motions_over_states(&basis, &self.plant.moving);
        let used =
            |a: &Matrix<f64>, b: &Matrix<f64>, k: usize| [a, b].iter().any(|m| (0..m.rows()).any(|i| m[(i, k)] != 0.0));
        let angles = (0..motions.len()).filter(|k| used(&linear.angles, &linear.on_angles, *k));
        let mut all: Vec<(bool, usize)> = angles.map(|k| (false, k)).collect();
        all.extend((0..motions.len()).filter(|k| used(&linear.speeds, &linear.on_speeds, *k)).map(|k| (true, k)));
        part.linear = reading(linear, &all);
        part.exact = part.exact.as_deref().map(|exact| Arc::new(reading(exact, &all)));
        let row = |(speed, k): &(bool, usize)| motion_rows[usize::from(*speed)].row(*k).to_vec();
        all.iter().map(|one| (motions[one.1][usize::from(one.0)].clone(), row(one))).collect()
    }

    /// From the controller's references to rows over `[q_r; q̇_r]`; of a sampled loop as they are just before it computes.
    pub fn references(&self, rows: &[Vec<f64>]) -> Option<Response> {
        let period = self.period().ok()?;
        let count = self.parts[self.number].linear.on_references.columns();
        let (n, first, map) = if let Some(period) = period {
            let found = SampledLoop::driven(self.plant, self.parts, period).ok()?;
            (found.constants, found.references[self.number], found.map)
        } else {
            let places = Places::new(self.plant, self.parts, true);
            (places.laws.first()?.references?, places.laws[self.number].references?, places.flow().0)
        };
        let a = window(&map, 0..n, 0..n);
        let b = window(&map, 0..n, first..first + count);
        let c = Matrix::from_fn(rows.len(), n, |i, j| rows[i].get(j).copied().unwrap_or(0.0));
        Response::state_space([&a, &b, &c, &Matrix::zeros(rows.len(), count)], period)
    }

    /// The sample time of the controller, if all others fit into it: the loop is then the same at each of its samples.
    fn common_period(&self) -> Option<f64> {
        let own = self.parts[self.number].clock?.period;
        let all = Periods::of(self.parts, None).ok()?.period;
        ((all / own - 1.0).abs() < 1e-9).then_some(own)
    }

    /// The sample time that all have in common; `None` in continuous time.
    fn period(&self) -> Result<Option<f64>, SeveralTimes> {
        let slow = self.parts.iter().flat_map(|part| part.slow.iter().map(|(_, sensor)| sensor.period));
        let mut all = self.parts.iter().filter_map(|part| part.clock.map(|clock| clock.period)).chain(slow);
        let first = all.next();
        let same = |candidate: f64| first.is_some_and(|first| (candidate / first - 1.0).abs() < 1e-9);
        if all.all(same) { Ok(first) } else { Err(SeveralTimes) }
    }
}

/// A law with errors of angles, and of speeds, that it uses.
fn reading<S: Scalar>(law: &LinearLaw<S>, all: &[(bool, usize)]) -> LinearLaw<S> {
    let pick = |angles: &Matrix<S>, speeds: &Matrix<S>| {
        Matrix::from_fn(angles.rows(), all.len(), |i, j| {
            let (speed, k) = all[j];
            let of = if speed { speeds } else { angles };
            of[(i, k)].clone()
        })
    };
    LinearLaw { errors: pick(&law.angles, &law.speeds), on_errors: pick(&law.on_angles, &law.on_speeds), ..law.clone() }
}

/// Relative size below which a motion is not observed, or not driven.
const NEGLIGIBLE: f64 = 1e-12;

/// The loop for errors that enter by B and signals `C z + D w`, without the uncontrolled rigid-body modes that are not driven or not observed: those that
/// are stay as integrators. `entries`: sizes to whose rounding the entries of the matrix are known.
fn response_excluding_free(
    matrix: &Matrix<f64>,
    entries: Option<&Matrix<f64>>,
    [b, c, d]: [&Matrix<f64>; 3],
    period: Option<f64>,
) -> Option<Response> {
    let states = between(matrix, b, c);
    let n = states.len();
    let one = |i: usize, j: usize| f64::from(u8::from(period.is_some() && i == j));
    let rates = Matrix::from_fn(n, n, |i, j| matrix[(states[i], states[j])] - one(i, j));
    let entries = entries.map(|sizes| selected(sizes, &states, &states));
    let (b, c) = (rows_of(b, &states), columns_of(c, &states));
    let [a, b, c] = split_free(&rates, (entries.as_ref(), period.is_some()), [&b, &c])?;
    let a = if period.is_some() { a.plus(&Matrix::identity(a.rows())) } else { a };
    Response::state_space([&a, &b, &c, d], period)
}

/// A system with its modes at zero as integrators, where these are driven and observed.
///
/// With V spanning the motions at zero, `A V = V N`, all else in R and `A R = V G + R A₂`, the rows `Wᵀ = V⁺ + X R⁺` with `X A₂ = N X − G` have
/// `Wᵀ A = N Wᵀ` and `Wᵀ V = 1`: as powers of N end at zero, X is found in as many steps as there are motions. These add `C V N^k Wᵀ B / s^(k+1)`; the rest is
/// what A does on the null space of Wᵀ, `R − V X`.
fn split_free(
    a: &Matrix<f64>,
    (entries, sampled): (Option<&Matrix<f64>>, bool),
    [b, c]: [&Matrix<f64>; 2],
) -> Option<[Matrix<f64>; 3]> {
    let scales = balance(&Mat::from_fn(a.rows(), a.rows(), |i, j| a[(i, j)]));
    let (a, entries) = (scaled(a, &scales), entries.map(|entries| scaled(entries, &scales)));
    let b = &Matrix::from_fn(b.rows(), b.columns(), |i, j| b[(i, j)] / scales[i]);
    let c = &Matrix::from_fn(c.rows(), c.columns(), |i, j| c[(i, j)] * scales[j]);
    let own = |entries: Option<&Matrix<f64>>, a: &Matrix<f64>| match entries {
        _ if sampled => at_zero(a, Rounding::OfOne),
        Some(entries) => at_zero(a, Rounding::OfEach(entries)),
        None => at_zero(a, Rounding::OfLargest),
    };
    let split = own(entries.as_ref(), &a)?;
    let (v, count) = (&split.motions, split.motions.columns());
    let mut out = [split.rest.clone(), split.left.multiply(b), c.multiply(&split.right)];
    if count == 0 {
        return Some(out);
    }
    let n = a.rows();
    let (right, rest) = (&split.right, &split.rest);
    let whole = Matrix::from_fn(n, n, |i, j| if j < count { v[(i, j)] } else { right[(i, j - count)] });
    let dual = whole.solve(&Matrix::identity(n))?;
    let dual = Matrix::from_fn(count, n, |i, j| dual[(i, j)]);
    let (chain, across) = (dual.multiply(&a).multiply(v), dual.multiply(&a).multiply(right));
    let mut x = Matrix::zeros(count, n - count);
    for _ in 0..=count {
        let right = chain.multiply(&x).minus(&across);
        x = rest.transpose().solve(&right.transpose())?.transpose();
    }
    let w = dual.plus(&x.multiply(&split.left));
    out[2] = c.multiply(&right.minus(&v.multiply(&x)));
    // Each product with the size that it may have: lengths of rows and columns, to the rounding of which it is known.
    let length = |of: &[f64]| of.iter().map(|x| x * x).sum::<f64>().sqrt();
    let product = |rows: &Matrix<f64>, columns: &Matrix<f64>| {
        let columns = columns.transpose();
        let sized = |i: usize, j: usize| length(rows.row(i)) * length(columns.row(j));
        (rows.multiply(&columns.transpose()), Matrix::from_fn(rows.rows(), columns.rows(), sized))
    };
    let ((observed, observed_sizes), (mut driven, mut driven_sizes)) = (product(c, v), product(&w, b));
    let chain_sizes = product(&w, v).1.scale(&length(a.as_slice()));
    let mut shares = Vec::new();
    for _ in 0..count {
        let (found, sized) = (observed.multiply(&driven), observed_sizes.multiply(&driven_sizes));
        shares.push(Matrix::from_fn(c.rows(), b.columns(), |i, j| {
            if found[(i, j)].abs() > NEGLIGIBLE * sized[(i, j)] { found[(i, j)] } else { 0.0 }
        }));
        (driven, driven_sizes) = (chain.multiply(&driven), chain_sizes.multiply(&driven_sizes));
    }
    add_integrators(&shares, &mut out);
    Some(out)
}

/// Adds `Σ_k shares[k]/s^(k+1)` to a system: for each input that moves something a chain of integrators.
fn add_integrators(shares: &[Matrix<f64>], [a, b, c]: &mut [Matrix<f64>; 3]) {
    for input in 0..b.columns() {
        let column = |share: &Matrix<f64>| (0..c.rows()).map(|i| share[(i, input)]).collect::<Vec<f64>>();
        let columns: Vec<Vec<f64>> = shares.iter().map(column).collect();
        let length = columns.iter().rposition(|column| column.iter().any(|x| *x != 0.0)).map_or(0, |last| last + 1);
        let (n, total) = (a.rows(), a.rows() + length);
        let inside = |i: usize, j: usize| i < n && j < n;
        // ẋ₀ = w, ẋ_k = x_{k−1}
        *a = Matrix::from_fn(total, total, |i, j| match inside(i, j) {
            true => a[(i, j)],
            false => f64::from(u8::from(j >= n && i == j + 1)),
        });
        *b = Matrix::from_fn(total, b.columns(), |i, j| {
            if i < n { b[(i, j)] } else { f64::from(u8::from(i == n && j == input)) }
        });
        *c = Matrix::from_fn(c.rows(), total, |i, j| if j < n { c[(i, j)] } else { columns[j - n][i] });
    }
}

/// A system with only the states that contribute to the response from B to C.
fn only_between<S: Scalar>(matrix: &Matrix<S>, [b, c, d]: [&Matrix<S>; 3]) -> [Matrix<S>; 4] {
    let states = between(matrix, b, c);
    [selected(matrix, &states, &states), rows_of(b, &states), columns_of(c, &states), d.clone()]
}

/// The states that are reached from B and that reach the rows of C: the others do not contribute to the response.
fn between<S: Scalar>(matrix: &Matrix<S>, b: &Matrix<S>, c: &Matrix<S>) -> Vec<usize> {
    let n = b.rows();
    let spread = |mut reached: Vec<bool>, acts: &dyn Fn(usize, usize) -> bool| {
        let mut next: Vec<usize> = (0..n).filter(|&k| reached[k]).collect();
        while let Some(k) = next.pop() {
            for next_state in 0..n {
                if !reached[next_state] && acts(k, next_state) {
                    reached[next_state] = true;
                    next.push(next_state);
                }
            }
        }
        reached
    };
    let entered = (0..n).map(|i| b.row(i).iter().any(|x| !x.is_zero())).collect();
    let observed = (0..n).map(|j| (0..c.rows()).any(|i| !c[(i, j)].is_zero())).collect();
    let reached = spread(entered, &|from, to| !matrix[(to, from)].is_zero());
    let reaching = spread(observed, &|to, from| !matrix[(to, from)].is_zero());
    (0..n).filter(|&k| reached[k] && reaching[k]).collect()
}

#[cfg(test)]
#[path = "../../tests/unit/sampled/responses.rs"]
mod tests;
