//! The matrices of a linear law.

use kardan_rt::functions::hypot;
use kardan_rt::{Bounds, StateSpace};

use super::matrix_parts::{column_range, is_finite, side_by_side, spread};
use super::sampled::entries;
use super::{Block, Clock, ExactLoop, Law, LinearLaw, Observation, Reference, Request, is_single};
use kardan_math::num::{Float, Matrix, discretise, eigenvalues};
use kardan_results::signal_name::Quantity;
use kardan_results::{ControllerData, DataMatrix, DataNumber, Design, ReadSignal};

/// The matrices of a linear law `ξ̇ = A ξ + B s`, `u = C ξ + D s` over the signals `s = [q_r; q̇_r; r; d]`: reduced coordinates
/// (rad), their speeds (rad/s), references, disturbance torques on shafts (N m).
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LinearBlock {
    /// Names of ξ.
    pub states: Vec<String>,
    /// A, states × states.
    pub a: Matrix<f64>,
    /// B, states × signals.
    pub b: Matrix<f64>,
    /// C, inputs × states.
    pub c: Matrix<f64>,
    /// D, inputs × signals.
    pub d: Matrix<f64>,
}

impl LinearBlock {
    /// Static feedback `u = −K x + L r − M d`.
    pub fn gains(k: &Matrix<f64>, l: &Matrix<f64>, m: &Matrix<f64>) -> Self {
        let d = side_by_side(&[&k.scale(&-1.0), l, &m.scale(&-1.0)]);
        Self {
            states: Vec::new(),
            a: Matrix::zeros(0, 0),
            b: Matrix::zeros(0, d.columns()),
            c: Matrix::zeros(d.rows(), 0),
            d,
        }
    }
}

/// A linear law in the loop, run by the block [`StateSpace`].
pub(super) struct Linear {
    pub design: Design,
    pub exact: Option<ExactLoop>,
    references: Vec<Reference>,
    disturbances: usize,
    coordinates: Vec<usize>,
    shafts: usize,
    /// A signal after the others for each input, if the law has anti-windup: see [`Self::against_windup`].
    excess: usize,
    /// Torque limits of its inputs, if [`Self::against_windup`] knows them; else none.
    limits: Vec<Option<f64>>,
    block: LinearBlock,
}

impl Linear {
    /// A law of that design. `design` names the inputs.
    ///
    /// # Panics
    /// If the block's matrices do not fit the numbers of coordinates, references, disturbances and inputs.
    pub fn new(
        request: &Request<'_>,
        mut design: Design,
        exact: Option<ExactLoop>,
        references: Vec<Reference>,
        block: LinearBlock,
    ) -> Self {
        let (plant, disturbances) = (request.plant, request.disturbances);
        let (r, k) = (plant.linear.coordinates.len(), block.states.len());
        let signals = 2 * r + references.len() + disturbances.len();
        assert_eq!((block.a.rows(), block.a.columns(), block.b.rows()), (k, k, k), "states of a law");
        assert_eq!((block.b.columns(), block.d.columns()), (signals, signals), "signals of a law");
        assert_eq!((block.d.rows(), block.c.rows()), (design.inputs.len(), design.inputs.len()), "inputs of a law");
        design.controller_data = data(request, &design, &references, &block);
        let coordinates = plant.reduced.coordinates.clone();
        Self {
            design,
            exact,
            references,
            disturbances: disturbances.len(),
            coordinates,
            shafts: plant.coordinates().len(),
            excess: 0,
            limits: Vec::new(),
            block,
        }
    }

    /// Prevents windup of the law's states while a motor is at its limit: the rates get an additional `L e`, where e is the limited
    /// command minus the command. Within the limits e is zero; while all motors are at their limits ξ
    /// follows `A − L C`, whose eigenvalues all have the real part −β (Bass 1961).
    ///
    /// A law without states, without limits, or whose command does not show its states, stays as it is; so does one whose states
    /// would grow while only some of its motors are at their limits.
    pub fn against_windup(mut self, limits: &[Option<f64>]) -> Self {
        if self.block.states.is_empty() || limits.iter().all(Option::is_none) {
            return self;
        }
        let gain = bass(&self.block.a, &self.block.c);
        let Some(gain) = gain.filter(|gain| rests(&self.block.a, gain, &self.block.c, limits)) else { return self };
        let (inputs, signals) = (limits.len(), self.block.b.columns());
        self.block.b = side_by_side(&[&self.block.b, &gain]);
        self.block.d = side_by_side(&[&self.block.d, &Matrix::zeros(inputs, inputs)]);
        assert_eq!(self.block.d.columns(), signals + inputs, "one limit for each input");
        self.excess = inputs;
        self.limits = limits.to_vec();
        let data = &mut self.design.controller_data;
        for (name, matrix) in [("B", &self.block.b), ("D", &self.block.d)] {
            let place = data.matrices.iter_mut().find(|matrix| matrix.name == name);
            if let Some(place) = place {
                place.values = matrix.to_rows();
            }
        }
        let inputs = &self.design.inputs;
        data.reads.extend(ReadSignal::of_each(Quantity::Excess, inputs));
        let bounds = inputs.iter().zip(limits);
        data.numbers.extend(
            bounds.filter_map(|(input, limit)| Some(DataNumber::new(format!("{input} torque_limit"), (*limit)?))),
        );
        self.design.notes.push(
            "anti-windup of the law's states: `<motor>.excess`, the command after the torque limit minus the command, \
             acts on them"
                .into(),
        );
        self
    }
}

impl Linear {
    /// The linear block at every instant or at a sample time; `None` if a number overflows there.
    fn block_at(&self, clock: Option<Clock>) -> Option<LinearBlock> {
        let mut block = self.block.clone();
        if let Some(clock) = clock.filter(|_| !block.states.is_empty()) {
            let sampled = discretise(&block.a, &block.b, clock.period)?;
            (block.a, block.b) = (sampled.a, sampled.b);
        }
        Some(block)
    }
}

/// Whether ξ comes to rest whichever of the motors with a limit are at it, or does at least not grow faster than without L.
fn rests(a: &Matrix<f64>, gain: &Matrix<f64>, c: &Matrix<f64>, limits: &[Option<f64>]) -> bool {
    let limited: Vec<usize> = (0..limits.len()).filter(|k| limits[*k].is_some()).collect();
    let slowest = |matrix: &Matrix<f64>| Some(eigenvalues(matrix)?.iter().fold(f64::MIN, |max, (re, _)| max.max(*re)));
    let Some(open_loop) = slowest(a) else { return false };
    (1..1usize << limited.len().min(MOST_SUBSETS)).all(|subset| {
        let at_limit =
            |k: usize| limited.iter().position(|candidate| *candidate == k).is_some_and(|bit| subset >> bit & 1 == 1);
        let part = Matrix::from_fn(a.rows(), c.rows(), |i, k| if at_limit(k) { gain[(i, k)] } else { 0.0 });
        let closed = a.minus(&part.multiply(c));
        slowest(&closed).is_some_and(|slowest| slowest < 0.0 || slowest <= open_loop * (1.0 + 1e-9))
    })
}

/// Motors of which all subsets are tried.
const MOST_SUBSETS: usize = 10;
/// Time constants of the fastest motion of A in which A − L C brings all states to rest.
const BASS: f64 = 2.0;

/// L such that all eigenvalues of A − L C have the real part −β: with `(A + βI)ᵀ Z + Z (A + βI) = 2 Cᵀ C` it is `Z⁻¹ Cᵀ`. `None` if
/// (A, C) is not observable or a number overflows.
fn bass(a: &Matrix<f64>, c: &Matrix<f64>) -> Option<Matrix<f64>> {
    let n = a.rows();
    let fastest = eigenvalues(a)?.into_iter().map(|(re, im)| hypot(re, im)).fold(0.0, f64::max);
    let beta = BASS * fastest.max(1.0);
    let shifted = Matrix::from_fn(n, n, |i, j| a[(i, j)] + if i == j { beta } else { 0.0 });
    let right = c.transpose().multiply(c).scale(&2.0);
    // One equation for each entry of Z.
    let equations = Matrix::from_fn(n * n, n * n, |row, column| {
        let ((i, j), (k, l)) = ((row / n, row % n), (column / n, column % n));
        let left = if l == j { shifted[(k, i)] } else { 0.0 };
        left + if k == i { shifted[(l, j)] } else { 0.0 }
    });
    let z = equations.solve(&Matrix::from_fn(n * n, 1, |row, _| right[(row / n, row % n)]))?;
    let gain = Matrix::from_fn(n, n, |i, j| z[(i * n + j, 0)]).solve(&c.transpose())?;
    is_finite(&gain).then_some(gain)
}

/// The block [`StateSpace`] with the memory of one evaluation.
struct StateSpaceBlock<T> {
    a: Vec<T>,
    b: Vec<T>,
    c: Vec<T>,
    d: Vec<T>,
    coordinates: Vec<usize>,
    references: usize,
    /// Torque limits of the inputs, if their excess is a signal.
    limits: Vec<Option<T>>,
    signals: Vec<T>,
    state: Vec<T>,
    result: Vec<T>,
}

impl<T: Float> StateSpaceBlock<T> {
    fn new(block: &LinearBlock, coordinates: &[usize], references: usize, limits: &[Option<f64>]) -> Self {
        let (states, inputs) = (block.states.len(), block.d.rows());
        Self {
            a: entries(&block.a),
            b: entries(&block.b),
            c: entries(&block.c),
            d: entries(&block.d),
            coordinates: coordinates.to_vec(),
            references,
            limits: limits.iter().map(|limit| limit.map(T::from_f64)).collect(),
            signals: vec![T::ZERO; block.d.columns()],
            state: vec![T::ZERO; states],
            result: vec![T::ZERO; states.max(inputs)],
        }
    }

    /// Commands, or the right side of the state equation. Returns whether they are finite.
    fn evaluate(&mut self, observation: Observation<'_>, states: bool, out: &mut [f64]) -> bool {
        let r = self.coordinates.len();
        let (position, rest) = self.signals.split_at_mut(r);
        let (speed, rest) = rest.split_at_mut(r);
        let (references, rest) = rest.split_at_mut(self.references);
        let (disturbances, excess) = rest.split_at_mut(rest.len() - self.limits.len());
        excess.fill(T::ZERO);
        for (k, &shaft) in self.coordinates.iter().enumerate() {
            position[k] = T::from_f64(observation.angles[shaft]);
            speed[k] = T::from_f64(observation.speeds[shaft]);
        }
        T::narrow(observation.references, references);
        T::narrow(observation.disturbances, disturbances);
        T::narrow(observation.states, &mut self.state);
        let Some(block) = StateSpace::new(&self.a, &self.b, &self.c, &self.d, self.state.len(), self.signals.len())
        else {
            unreachable!("the matrices fit each other, as `Linear::new` has checked");
        };
        if states && !self.limits.is_empty() {
            let (inputs, first) = (self.limits.len(), self.signals.len() - self.limits.len());
            if !block.outputs(&self.state, &self.signals, &mut self.result[..inputs]) {
                return false;
            }
            for ((k, limit), command) in self.limits.iter().enumerate().zip(&self.result) {
                let bounds = Bounds { torque: *limit, change: None };
                self.signals[first + k] = bounds.nearest(*command, *command) - *command;
            }
        }
        let result = &mut self.result[..out.len()];
        let found = match states {
            true => block.rates(&self.state, &self.signals, result),
            false => block.outputs(&self.state, &self.signals, result),
        };
        T::widen(result, out);
        found
    }
}

impl<T: Float> Block for StateSpaceBlock<T> {
    fn command(&mut self, observation: Observation<'_>, out: &mut [f64]) -> bool {
        self.evaluate(observation, false, out)
    }

    fn states(&mut self, observation: Observation<'_>, _: &[f64], out: &mut [f64]) -> bool {
        self.evaluate(observation, true, out)
    }
}

fn data(request: &Request<'_>, design: &Design, references: &[Reference], block: &LinearBlock) -> ControllerData {
    let mut reads = [0, 1].map(|rate| request.plant.motions(rate)).concat();
    reads.extend(references.iter().map(|r| ReadSignal::new(&r.name, r.physical.unit())));
    let shafts = request.plant.coordinates();
    reads.extend(ReadSignal::of_each(Quantity::Disturbance, request.disturbances.iter().map(|&k| &shafts[k])));
    let matrices = [("A", &block.a), ("B", &block.b), ("C", &block.c), ("D", &block.d)];
    ControllerData {
        block: "StateSpace".into(),
        reads,
        writes: design.inputs.clone(),
        matrices: matrices.into_iter().map(|(name, matrix)| DataMatrix::new(name, matrix.to_rows())).collect(),
        ..ControllerData::default()
    }
}

impl Law for Linear {
    fn inputs(&self) -> &[String] {
        &self.design.inputs
    }

    fn references(&self) -> &[Reference] {
        &self.references
    }

    fn states(&self) -> Vec<String> {
        self.block.states.clone()
    }

    fn block(&self, clock: Option<Clock>) -> Option<Box<dyn Block>> {
        let block = self.block_at(clock)?;
        let (coordinates, references) = (&self.coordinates, self.references.len());
        Some(match is_single(clock) {
            true => Box::new(StateSpaceBlock::<f32>::new(&block, coordinates, references, &self.limits)),
            false => Box::new(StateSpaceBlock::<f64>::new(&block, coordinates, references, &self.limits)),
        })
    }

    fn linear_sampled(&self, clock: Clock) -> Option<LinearLaw> {
        self.linear().sampled(clock.period)
    }

    fn linear(&self) -> LinearLaw {
        let (r, n) = (self.coordinates.len(), self.shafts);
        let over_shafts =
            |matrix: &Matrix<f64>, first: usize| spread(&column_range(matrix, first..first + r), &self.coordinates, n);
        let last = |matrix: &Matrix<f64>| {
            let end = matrix.columns() - self.excess;
            column_range(matrix, end - self.disturbances..end)
        };
        let on_references = |matrix: &Matrix<f64>| column_range(matrix, 2 * r..2 * r + self.references.len());
        let LinearBlock { a, b, c, d, .. } = &self.block;
        LinearLaw {
            states: a.clone(),
            angles: over_shafts(b, 0),
            speeds: over_shafts(b, r),
            disturbances: last(b),
            torques: Matrix::zeros(a.rows(), self.design.inputs.len()),
            on_states: c.clone(),
            on_angles: over_shafts(d, 0),
            on_speeds: over_shafts(d, r),
            on_disturbances: last(d),
            references: on_references(b),
            on_references: on_references(d),
            errors: Matrix::zeros(a.rows(), 0),
            on_errors: Matrix::zeros(c.rows(), 0),
            flowing: false,
        }
    }

    fn exact(&self) -> Option<ExactLoop> {
        self.exact.clone()
    }

    fn describe(&self) -> Design {
        self.design.clone()
    }
}

#[cfg(test)]
#[path = "../tests/unit/linear_law.rs"]
mod tests;
