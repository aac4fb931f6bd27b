//! Exact solution of loops that are linear between the breakpoints of the scenario.
//!
//! With `z = (x, 1, t − t₀)` a segment is `ż = M z`, so `z(t) = e^{M (t − t₀)} z₀`: one matrix exponential for each
//! spacing of the rows and a product for each row, or for eight rows at once, for any stiffness. Every signal is affine
//! in x and t, and the work of the inputs and the loss have quadratic rates `zᵀ Q z`; see [`Recurrence`].
//!
//! The matrices are read from the machine by evaluating it at unit vectors. Exact expressions decide before whether it
//! is linear. Their rounding errors are measured: read with vectors of another length they round differently, and where
//! the two solutions differ by more than the tolerance (stiff springs between large angles), the integrator takes over
//! the loop.

use std::ops::Range;

use super::{Machine, outputs::Outputs, recurrence::Recurrence};
use faer::Mat;
use kardan_math::num::{LANES, Matrix, Panels, balance, dot, exponential, product, scaled, unscaled};

/// The integrator takes over more states: a product for each row grows with their square.
pub(super) const MOST_STATES: usize = 16;
/// Spacings of rows whose exponentials are stored.
const MOST_SPACINGS: usize = 8;
/// Rows that are computed at once.
pub(super) const BLOCK: usize = LANES;
/// Length of the vectors that the equations are read with a second time.
const OTHER_LENGTH: f64 = 0.7;
/// Difference of two spacings, in units in the last place of the time, that is that of the times' rounding.
const ROUNDED: f64 = 8.0;

/// The loop between two breakpoints.
pub(super) struct LinearSegment {
    /// States without the two energies.
    states: usize,
    from: f64,
    until: f64,
    /// M, of order states + 2.
    generator: Matrix<f64>,
    /// Those that balance it.
    scales: Vec<f64>,
    /// z at the end.
    end: Vec<f64>,
    /// Work of the inputs and loss, J.
    energies: [f64; 2],
    /// Signals over z, row by row; `None`: each row is evaluated, as a sensor reads at times of its own.
    readout: Option<Matrix<f64>>,
    spacings: Vec<Spacing>,
    /// The row reached.
    at: f64,
    z: Vec<f64>,
    scratch: Vec<f64>,
    pub(super) evaluations: u64,
}

impl LinearSegment {
    /// The segment that begins at a state; `None` if numbers overflow on the way to its end, or rounding changes a state by more than
    /// a `tolerance` of its largest size on the way.
    pub(super) fn new(
        machine: &mut Machine,
        outputs: &mut Outputs,
        (from, until): (f64, f64),
        state: &[f64],
        tolerance: f64,
    ) -> Option<Self> {
        let states = machine.size() - 2;
        let order = states + 2;
        let mut probe =
            Probe { machine, from, state: vec![0.0; states + 2], slope: vec![0.0; states + 2], evaluations: 0 };
        let (generator, powers) = probe.equations(states, 1.0);
        let (other, _) = probe.equations(states, OTHER_LENGTH);
        let z: Vec<f64> =
            (0..order).map(|i| if i < states { state[i] } else { f64::from(u8::from(i == states)) }).collect();
        let scales = balance(&Mat::from_fn(order, order, |i, j| generator[(i, j)]));
        let [mut recurrence, mut beside] = [
            Recurrence::new(&generator, &powers, &scales, &z, until - from)?,
            Recurrence::new(&other, &[], &scales, &z, until - from)?,
        ];
        let (mut largest, mut apart) = (vec![0.0f64; states], vec![0.0f64; states]);
        while recurrence.remaining_steps > 0 {
            recurrence.step();
            beside.step();
            for ((largest, apart), (x, other)) in
                largest.iter_mut().zip(&mut apart).zip(recurrence.z.iter().zip(&beside.z))
            {
                *largest = larger(*largest, x.abs());
                *apart = larger(*apart, (x - other).abs());
            }
        }
        // Angles and speeds are compared with the others of their kind.
        let r = probe.machine.degrees_of_freedom();
        let exact = [0..r, r..2 * r, 2 * r..states].into_iter().all(|kind| {
            let most = largest[kind.clone()].iter().copied().fold(0.0, f64::max);
            apart[kind].iter().all(|x| *x <= tolerance * most)
        });
        if !exact {
            return None;
        }
        let (readout, evaluations) = (probe.readout(states, outputs), probe.evaluations);
        let end = recurrence.z;
        let energies = [state[states] + recurrence.work[0], state[states + 1] + recurrence.work[1]];
        let finite = end.iter().chain(&energies).all(|x| x.is_finite());
        finite.then(|| Self {
            states,
            from,
            until,
            generator,
            scales,
            end,
            energies,
            readout,
            spacings: Vec::new(),
            at: from,
            scratch: vec![0.0; order],
            z,
            evaluations,
        })
    }

    /// Writes the state at the end.
    pub(super) fn finish(&self, state: &mut [f64]) {
        state[..self.states].copy_from_slice(&self.end[..self.states]);
        state[self.states..].copy_from_slice(&self.energies);
    }

    /// Whether a time lies in it, before its end.
    pub(super) fn covers(&self, time: f64) -> bool {
        self.from <= time && time < self.until
    }

    /// Advances to a later time of the segment.
    pub(super) fn advance(&mut self, time: f64) {
        let step = time - self.at;
        if step <= 0.0 {
            return;
        }
        let place = self.spacing(step, rounding(time));
        apply(&self.spacings[place].power, &self.z, &mut self.scratch);
        self.arrive(time, step - self.spacings[place].step);
    }

    /// Advances by eight rows, and returns each signal's values in them; false if they must be read one by one: if they
    /// are not evenly spaced, are not before a time, or are too few.
    pub(super) fn read_block(&mut self, rows: &[f64], before: f64, mut out: impl FnMut(usize, &[f64; BLOCK])) -> bool {
        let Some(&time) = rows.get(BLOCK - 1).filter(|time| **time < before.min(self.until)) else { return false };
        let step = (time - self.at) / BLOCK as f64;
        let near = rounding(time);
        let even = |(j, row): (usize, &f64)| (row - (self.at + (j + 1) as f64 * step)).abs() <= near;
        if self.readout.is_none() || !rows[..BLOCK].iter().enumerate().all(even) {
            return false;
        }
        // The matrices of a block cost as much as this many rows.
        let many = rows.get(BLOCK * self.z.len()).is_some_and(|row| *row < before.min(self.until));
        let place = self.spacing(step, near / BLOCK as f64);
        let spacing = &mut self.spacings[place];
        if let Some(readout) = self.readout.as_ref().filter(|_| spacing.block.is_none() && many) {
            spacing.block = Some(Block::new(readout, &spacing.power));
        }
        let Some(block) = &spacing.block else { return false };
        block.signals.products(&self.z).enumerate().for_each(|(signal, values)| out(signal, &values));
        block.power.apply(&self.z, &mut self.scratch);
        let late = time - self.at - BLOCK as f64 * spacing.step;
        self.arrive(time, late);
        true
    }

    /// Moves to a time, with the z of an earlier time in the scratch memory.
    fn arrive(&mut self, time: f64, late: f64) {
        std::mem::swap(&mut self.z, &mut self.scratch);
        if late != 0.0 {
            // The rounding error of the times, to first order.
            apply(&self.generator, &self.z, &mut self.scratch);
            self.z.iter_mut().zip(&self.scratch).for_each(|(z, rate)| *z += late * rate);
        }
        self.at = time;
    }

    /// The index of a spacing, or of one that is equal to rounding.
    fn spacing(&mut self, step: f64, near: f64) -> usize {
        if let Some(place) = self.spacings.iter().position(|spacing| (spacing.step - step).abs() <= near) {
            return place;
        }
        // No overflow at the end implies none before.
        let order = self.z.len();
        let power = exponential(&scaled(&self.generator, &self.scales).scale(&step));
        let power = power.map(|power| unscaled(&power, &self.scales));
        let power = power.unwrap_or_else(|| Matrix::from_fn(order, order, |_, _| f64::NAN));
        if self.spacings.len() == MOST_SPACINGS {
            self.spacings.remove(0);
        }
        self.spacings.push(Spacing { step, power, block: None });
        self.spacings.len() - 1
    }

    /// The signals at the time reached, one after the other; false if they must be evaluated.
    pub(super) fn read(&self, mut out: impl FnMut(usize, f64)) -> bool {
        let Some(readout) = &self.readout else { return false };
        (0..readout.rows()).for_each(|k| out(k, dot(readout.row(k), &self.z)));
        true
    }

    /// Writes the state at the time reached, without the energies.
    pub(super) fn write(&self, state: &mut [f64]) {
        state[..self.states].copy_from_slice(&self.z[..self.states]);
    }
}

/// A spacing of the rows.
struct Spacing {
    step: f64,
    /// Φ, `e^{Mh}`.
    power: Matrix<f64>,
    block: Option<Block>,
}

/// Eight spacings at once.
struct Block {
    /// Signals over the z at the begin: those of the readout R after 1, 2, …, 8 spacings, `R Φʲ`, one signal after the other.
    signals: Panels,
    /// Φ⁸.
    power: Panels,
}

impl Block {
    fn new(readout: &Matrix<f64>, power: &Matrix<f64>) -> Self {
        let (count, order) = (readout.rows(), power.rows());
        let mut signals = Matrix::zeros(BLOCK * count, order);
        let [mut here, mut next] = [readout.clone(), readout.clone()];
        for j in 0..BLOCK {
            product(&here, power, &mut next);
            (0..count).for_each(|k| signals.row_mut(BLOCK * k + j).copy_from_slice(next.row(k)));
            std::mem::swap(&mut here, &mut next);
        }
        let [mut whole, mut doubled] = [power.clone(), power.clone()];
        for _ in 0..BLOCK.ilog2() {
            product(&whole, &whole, &mut doubled);
            std::mem::swap(&mut whole, &mut doubled);
        }
        Self { signals: Panels::new(&signals), power: Panels::new(&whole) }
    }
}

/// Largest difference of two times that differ only by rounding.
fn rounding(time: f64) -> f64 {
    ROUNDED * f64::EPSILON * time.abs()
}

fn apply(matrix: &Matrix<f64>, x: &[f64], out: &mut [f64]) {
    out.iter_mut().enumerate().for_each(|(i, out)| *out = dot(matrix.row(i), x));
}

/// The larger of two numbers; the first if one is none. Takes less time than [`f64::max`].
fn larger(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}

/// Reads the equations from the machine.
struct Probe<'a> {
    machine: &'a mut Machine,
    from: f64,
    state: Vec<f64>,
    slope: Vec<f64>,
    evaluations: u64,
}

impl Probe<'_> {
    /// Rates at a sum of unit vectors of (x, t − t₀), each times a number.
    fn rates(&mut self, at: &[(usize, f64)]) -> &[f64] {
        let time = self.place(at);
        self.machine.derivative(time, &self.state, &mut self.slope);
        self.evaluations += 1;
        &self.slope
    }

    /// Sets the state there; returns the time.
    fn place(&mut self, at: &[(usize, f64)]) -> f64 {
        let states = self.state.len() - 2;
        self.state.fill(0.0);
        let mut time = self.from;
        for &(k, x) in at {
            if k < states { self.state[k] += x } else { time += x }
        }
        time
    }

    /// Functions that are affine in (x, t − t₀) as rows over z, `read` at vectors of a length.
    fn affine(
        &mut self,
        states: usize,
        length: f64,
        mut read: impl FnMut(&mut Self, &[(usize, f64)]) -> Vec<f64>,
    ) -> Matrix<f64> {
        let rest = read(self, &[]);
        let mut out = Matrix::zeros(rest.len(), states + 2);
        rest.iter().enumerate().for_each(|(k, value)| out[(k, states)] = *value);
        let steady = self.machine.is_steady();
        for variable in (0..=states).filter(|&k| k < states || !steady) {
            let column = if variable < states { variable } else { states + 1 };
            let (plus, minus) = (read(self, &[(variable, length)]), read(self, &[(variable, -length)]));
            (0..rest.len()).for_each(|k| out[(k, column)] = (plus[k] - minus[k]) / (2.0 * length));
        }
        out
    }

    /// M, and Q of the power of the inputs and of the loss, read with vectors of a length.
    fn equations(&mut self, states: usize, length: f64) -> (Matrix<f64>, [Matrix<f64>; 2]) {
        let order = states + 2;
        // Rates, and pairs of factors whose products add up to the powers.
        let rows = self.affine(states, length, |probe, at| {
            let mut values = probe.rates(at)[..states].to_vec();
            values.extend(probe.machine.power_factors().into_iter().flatten().flatten());
            values
        });
        let mut generator = Matrix::from_fn(order, order, |i, j| if i < states { rows[(i, j)] } else { 0.0 });
        generator[(states + 1, states)] = 1.0;
        let quadratic = |factors: Range<usize>| {
            let entry = |i: usize, j: usize| {
                let products = factors.clone().step_by(2).map(|k| (rows.row(k), rows.row(k + 1)));
                products.map(|(a, b)| 0.5 * (a[i] * b[j] + a[j] * b[i])).sum()
            };
            Matrix::from_fn(order, order, entry)
        };
        let inputs = states + 2 * self.machine.power_factors()[0].len();
        (generator, [quadratic(states..inputs), quadratic(inputs..rows.rows())])
    }

    /// The signals over z.
    fn readout(&mut self, states: usize, outputs: &mut Outputs) -> Option<Matrix<f64>> {
        if outputs.samples() {
            return None;
        }
        Some(self.affine(states, 1.0, |probe, at| {
            let time = probe.place(at);
            outputs.observe(probe.machine, time, &probe.state);
            probe.evaluations += 1;
            (0..outputs.signals.len()).map(|k| outputs.value(k)).collect()
        }))
    }
}
