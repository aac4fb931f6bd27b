//! The plant and the laws of a sampled loop, and the positions of their parts in its state.

use super::jump::{Jump, nonzero};
use super::{LoopPlant, Reads, SampledPart, Teller, on_their_way};
use crate::matrix_parts::{side_by_side, stacked, window};
use crate::{Clock, ExportedSignal, LinearLaw, sizes};
use kardan_math::num::{Matrix, Rational, Scalar, rational_from_f64, shortest_decimal};
use kardan_mechanics::reduce::{FirstOrder, over_states};

/// Numbers over which a loop is put together.
pub(crate) trait Number: Scalar {
    /// A law, without the held readings of slow sensors.
    fn law(part: &SampledPart) -> LinearLaw<Self>;
    /// A gain, which is the double that runs.
    fn gain(value: f64) -> Self;
    /// A time, s, as it is written.
    fn time(value: f64) -> Self;
}

impl Number for f64 {
    fn law(part: &SampledPart) -> LinearLaw {
        part.direct()
    }
    fn gain(value: f64) -> Self {
        value
    }
    fn time(value: f64) -> Self {
        value
    }
}

impl Number for Rational {
    fn law(part: &SampledPart) -> LinearLaw<Self> {
        part.exactly()
    }
    fn gain(value: f64) -> Self {
        rational_from_f64(value).unwrap_or(Rational::ZERO)
    }
    fn time(value: f64) -> Self {
        exact_time(value).unwrap_or(Rational::ZERO)
    }
}

/// A time that follows from others by differences, s, without what rounding left of them; `None` if it is not finite.
pub(super) fn exact_time(value: f64) -> Option<Rational> {
    shortest_decimal(format!("{value:.13e}").parse().ok()?)
}

/// The plant of a loop as equations of first order.
pub(crate) struct FirstOrderPlant<S> {
    equations: FirstOrder<S>,
    basis: Matrix<S>,
    lags: Vec<f64>,
}

impl FirstOrderPlant<f64> {
    fn new(plant: &LoopPlant) -> Self {
        assert_eq!(plant.lags.len(), plant.inputs.len(), "one lag for each input");
        Self { equations: plant.first_order(), basis: plant.basis.clone(), lags: plant.lags.clone() }
    }
}

impl FirstOrderPlant<Rational> {
    /// Before rounding; `None` where that is not known, or something else than dampers determines a coordinate without inertia.
    pub fn exact(plant: &LoopPlant) -> Option<Self> {
        let model = plant.exact.as_ref()?;
        Some(Self { equations: model.first_order()?, basis: model.basis.clone(), lags: plant.lags.clone() })
    }
}

impl<S: Number> FirstOrderPlant<S> {
    fn over_states(&self, rows: [&Matrix<S>; 2]) -> Matrix<S> {
        over_states(rows, &self.basis, &self.equations.moving)
    }
}

/// Gains of a sensor.
fn gains<S: Number>(of: &Matrix<f64>) -> Matrix<S> {
    Matrix::from_fn(of.rows(), of.columns(), |i, j| S::gain(of[(i, j)]))
}

fn unit<S: Scalar>(here: bool) -> S {
    if here { S::one() } else { S::zero() }
}

/// `matrix[place] += value`
fn add<S: Scalar>(matrix: &mut Matrix<S>, place: (usize, usize), value: &S) {
    matrix[place] = matrix[place].plus(value);
}

/// Where the parts of z are in a [`SampledLoop`](super::SampledLoop), and what changes them.
pub(crate) struct Places<'a, S> {
    plant: FirstOrderPlant<S>,
    /// Torque of each motor with a lag.
    lagged: Vec<Option<usize>>,
    pub laws: Vec<LawPlaces<'a, S>>,
    pub size: usize,
}

pub(crate) struct LawPlaces<'a, S> {
    part: &'a SampledPart,
    /// Its linear part, without the held readings of slow sensors.
    direct: LinearLaw<S>,
    /// Commands in force; of a law in continuous time nowhere.
    pub in_force: usize,
    /// Commands in transit, the next first.
    queue: Vec<usize>,
    /// For a motor with an additional delay: its input, the command that it has received, and those in transit, the next first.
    wire: Option<(usize, usize, Vec<usize>)>,
    states: usize,
    /// For each slow sensor its held reading, and the last angle, if it takes differences.
    slow: Vec<(usize, Option<usize>)>,
    /// Where its references are; `None` if they are left out.
    pub references: Option<usize>,
    /// Where the errors of its readings are; `None` if they are left out.
    pub errors: Option<usize>,
    /// Where the torques are that its motors give in addition to their commands; `None` if they are left out.
    pub excess: Option<usize>,
}

impl<S: Number> LawPlaces<'_, S> {
    /// Where the errors are that are new when the law computes.
    pub fn fresh(&self) -> impl Iterator<Item = usize> {
        let count = if self.errors.is_some() { self.direct.on_errors.columns() } else { 0 };
        (0..count).filter(|k| !self.is_slow(*k)).filter_map(|k| Some(self.errors? + k))
    }

    fn is_slow(&self, reading: usize) -> bool {
        self.part.slow.iter().any(|(candidate, _)| *candidate == reading)
    }

    /// Where the error of a slow sensor is.
    pub fn fresh_of(&self, slow: usize) -> Option<usize> {
        Some(self.errors? + self.part.slow[slow].0)
    }
}

impl<'a> Places<'a, f64> {
    pub fn new(plant: &LoopPlant, parts: &'a [SampledPart], driven: bool) -> Self {
        Self::of(FirstOrderPlant::new(plant), parts, driven)
    }

    /// The sizes of all that adds up to each entry of the matrix of a loop in continuous time, before anything cancels: to the rounding of these it is
    /// known. `None` of a plant with coordinates without inertia.
    pub fn sizes(plant: &LoopPlant, parts: &[SampledPart]) -> Option<Matrix<f64>> {
        let FirstOrder { a, b, moving } = plant.first_order();
        let r = plant.inertia.rows();
        if moving.len() < r {
            return None;
        }
        let inverse = sizes(&plant.inertia.solve(&Matrix::identity(r))?);
        let [springs, dampers] = [&plant.stiffness, &plant.damping].map(|of| inverse.multiply(&sizes(of)));
        let a = stacked(&[&window(&a, 0..r, 0..2 * r), &side_by_side(&[&springs, &dampers])]);
        let equations = FirstOrder { a, b: sizes(&b), moving };
        let laws = parts.iter().map(|part| part.linear.sizes()).collect();
        let plant = FirstOrderPlant { equations, basis: sizes(&plant.basis), lags: plant.lags.clone() };
        Some(sizes(&Places::with(plant, parts, laws, false).flow().0))
    }
}

impl<'a, S: Number> Places<'a, S> {
    pub fn of(plant: FirstOrderPlant<S>, parts: &'a [SampledPart], driven: bool) -> Self {
        Self::with(plant, parts, parts.iter().map(S::law).collect(), driven)
    }

    /// With these laws in place of those of the parts.
    pub fn with(plant: FirstOrderPlant<S>, parts: &'a [SampledPart], laws: Vec<LinearLaw<S>>, driven: bool) -> Self {
        let mut size = plant.equations.a.rows();
        let mut take = |count: usize| {
            size += count;
            size - count
        };
        let lagged = plant.lags.iter().map(|lag| (*lag > 0.0).then(|| take(1))).collect();
        let laws = parts
            .iter()
            .zip(laws)
            .map(|(part, law)| {
                let outputs = part.outputs();
                let waiting = part.clock.map_or(0, on_their_way);
                let in_force = take(if part.clock.is_some() { outputs } else { 0 });
                let queue = (0..waiting).map(|_| take(outputs)).collect();
                let wire = part.clock.zip(part.wire).map(|(clock, wire)| {
                    let waiting = on_their_way(Clock { delay: wire.delay, ..clock });
                    (wire.input, take(1), (0..waiting).map(|_| take(1)).collect())
                });
                let states = take(part.linear.states.rows());
                let slow = part.slow.iter().map(|(_, sensor)| {
                    let reading = take(1);
                    (reading, (sensor.reads == Reads::Differences).then(|| take(1)))
                });
                LawPlaces {
                    part,
                    direct: law,
                    in_force,
                    queue,
                    wire,
                    states,
                    slow: slow.collect(),
                    references: None,
                    errors: None,
                    excess: None,
                }
            })
            .collect::<Vec<_>>();
        let mut out = Self { plant, lagged, laws, size };
        if driven {
            // Behind all others: constants.
            for law in &mut out.laws {
                law.references = Some(out.size);
                law.errors = Some(out.size + law.direct.on_references.columns());
                out.size += law.direct.on_references.columns() + law.direct.on_errors.columns();
                law.excess = Some(out.size);
                out.size += law.part.inputs.len();
            }
        }
        out
    }

    /// The action of a law on places other than those of plant and states: with `on_references` (or `references`) and `on_errors` (or
    /// `errors`) it multiplies its references and readings' errors, the held readings of slow sensors, and the signals of other parts.
    fn enter_references(&self, law: &LawPlaces<'_, S>, [references, errors]: [&Matrix<S>; 2], out: &mut Matrix<S>) {
        let exported: Vec<(usize, Vec<(usize, S)>)> =
            law.part.reads.iter().map(|(reference, teller)| (*reference, self.exported(*teller))).collect();
        for i in 0..out.rows() {
            if let Some(first) = law.references {
                (0..references.columns()).for_each(|k| add(out, (i, first + k), &references[(i, k)]));
            }
            if let Some(first) = law.errors {
                let direct = (0..errors.columns()).filter(|k| !law.is_slow(*k));
                direct.for_each(|k| add(out, (i, first + k), &errors[(i, k)]));
            }
            for ((reading, _), (in_force, _)) in law.part.slow.iter().zip(&law.slow) {
                add(out, (i, *in_force), &errors[(i, *reading)]);
            }
            for (reference, row) in &exported {
                let gain = &references[(i, *reference)];
                row.iter().for_each(|(place, x)| add(out, (i, *place), &gain.times(x)));
            }
        }
    }

    /// The signal that a part exports, over z: at a sample the tasks have computed before, and a law exports the value of its last sample.
    fn exported(&self, Teller { part, exported }: Teller) -> Vec<(usize, S)> {
        let law = &self.laws[part];
        match exported {
            ExportedSignal::State(k) => vec![(law.states + k, S::one())],
            ExportedSignal::Command(k) if law.part.clock.is_some() => {
                vec![(law.queue.last().copied().unwrap_or(law.in_force) + k, S::one())]
            }
            // At every instant it follows from what it reads there.
            ExportedSignal::Command(k) => nonzero(self.command(part).row(k)),
        }
    }

    /// The present command of a law over z, whether sampled or not.
    fn command(&self, number: usize) -> Matrix<S> {
        let law = &self.laws[number];
        let on_plant = self.plant.over_states([&law.direct.on_angles, &law.direct.on_speeds]);
        let states = law.states..law.states + law.direct.states.rows();
        let mut out = Matrix::from_fn(law.part.outputs(), self.size, |i, j| match j {
            j if j < on_plant.columns() => on_plant[(i, j)].clone(),
            j if states.contains(&j) => law.direct.on_states[(i, j - states.start)].clone(),
            _ => S::zero(),
        });
        self.enter_references(law, [&law.direct.on_references, &law.direct.on_errors], &mut out);
        out
    }

    /// The inputs of the rates (or the next values) of a law's states, over z, with these torques of its inputs.
    fn rates(&self, number: usize, torques: &Matrix<S>) -> Matrix<S> {
        let law = &self.laws[number];
        let from_plant = self.plant.over_states([&law.direct.angles, &law.direct.speeds]);
        let mut out = law.direct.torques.multiply(torques);
        for i in 0..out.rows() {
            for j in 0..from_plant.columns() {
                add(&mut out, (i, j), &from_plant[(i, j)]);
            }
            for j in 0..law.direct.states.rows() {
                add(&mut out, (i, law.states + j), &law.direct.states[(i, j)]);
            }
        }
        self.enter_references(law, [&law.direct.references, &law.direct.errors], &mut out);
        out
    }

    /// Commands of all inputs over z.
    fn commands(&self) -> Matrix<S> {
        let mut commands = Matrix::zeros(self.plant.lags.len(), self.size);
        for (number, law) in self.laws.iter().enumerate() {
            if law.part.clock.is_some() {
                for (i, &input) in law.part.inputs.iter().enumerate() {
                    let received = law.wire.as_ref().filter(|(sent, ..)| *sent == i).map(|(_, place, _)| *place);
                    add(&mut commands, (input, received.unwrap_or(law.in_force + i)), &S::one());
                }
                continue;
            }
            let own = self.command(number);
            for (i, &input) in law.part.inputs.iter().enumerate() {
                (0..self.size).for_each(|j| add(&mut commands, (input, j), &own[(i, j)]));
            }
        }
        commands
    }

    /// The matrix of the loop between two instants, ż = F z, and the command of each input. A motor gives its command, and what
    /// it gives in addition, times the gain of its law, which the law does not know.
    pub fn flow(&self) -> (Matrix<S>, Matrix<S>) {
        let FirstOrder { a, b, .. } = &self.plant.equations;
        let own = a.rows();
        let mut flow = Matrix::zeros(self.size, self.size);
        for i in 0..own {
            (0..own).for_each(|j| flow[(i, j)] = a[(i, j)].clone());
        }
        let commands = self.commands();
        let inputs = self.plant.lags.len();
        let (mut gains, mut excess) = (vec![S::one(); inputs], vec![None; inputs]);
        for law in &self.laws {
            for (i, &input) in law.part.inputs.iter().enumerate() {
                gains[input] = S::gain(law.part.gains[i]);
                excess[input] = law.excess.map(|first| first + i);
            }
        }
        for (input, place) in self.lagged.iter().enumerate() {
            let commanded = |j: usize| commands[(input, j)].plus(&unit(excess[input] == Some(j)));
            for j in 0..self.size {
                let torque = match place {
                    Some(place) => {
                        let torque = unit::<S>(j == *place);
                        let rate = commanded(j).minus(&torque).over(&S::time(self.plant.lags[input]));
                        add(&mut flow, (*place, j), &rate);
                        torque
                    }
                    None => commanded(j),
                };
                if place.is_some() {
                    (0..own).for_each(|i| add(&mut flow, (i, j), &gains[input].times(&b[(i, input)]).times(&torque)));
                } else {
                    let torque = gains[input].times(&torque);
                    (0..own).for_each(|i| add(&mut flow, (i, j), &b[(i, input)].times(&torque)));
                }
            }
        }
        self.add_rates(&commands, &mut flow);
        (flow, commands)
    }

    /// Of a loop in continuous time with this matrix, over z: what its laws command, how their states change, and these.
    pub fn signals(&self, flow: &Matrix<S>) -> Matrix<S> {
        let mut rows: Vec<Vec<S>> = Vec::new();
        for (number, law) in self.laws.iter().enumerate() {
            let command = self.command(number);
            rows.extend((0..command.rows()).map(|i| command.row(i).to_vec()));
            for place in law.states..law.states + law.direct.states.rows() {
                rows.push(flow.row(place).to_vec());
                rows.push((0..self.size).map(|j| unit(j == place)).collect());
            }
        }
        Matrix::from_fn(rows.len(), self.size, |i, j| rows[i][j].clone())
    }

    /// The rates of the states of laws in continuous time, and of those with a clock whose states go on between samples.
    fn add_rates(&self, commands: &Matrix<S>, flow: &mut Matrix<S>) {
        let flows = |law: &LawPlaces<'_, S>| law.part.clock.is_none() || law.direct.flowing;
        for (number, law) in self.laws.iter().enumerate().filter(|(_, law)| flows(law)) {
            let torque = |i: usize, j: usize| match law.part.inputs.get(i).map(|input| (*input, self.lagged[*input])) {
                Some((_, Some(place))) => unit(j == place),
                Some((input, None)) => commands[(input, j)].clone(),
                None => S::zero(),
            };
            let rates = self.rates(number, &Matrix::from_fn(law.part.outputs(), self.size, torque));
            for i in 0..rates.rows() {
                for j in 0..self.size {
                    add(flow, (law.states + i, j), &rates[(i, j)]);
                }
            }
        }
    }

    /// A law computes: its commands enter the delay, its states become those of the next sample.
    pub(super) fn compute(&self, number: usize) -> Jump<S> {
        let law = &self.laws[number];
        let Some(clock) = law.part.clock else { unreachable!("only sampled laws compute at an instant") };
        let m = law.part.outputs();
        let command = self.command(number);
        // The torques until the next sample: in force now, then those in transit, one after the other.
        let row = |place: usize| Matrix::from_fn(m, self.size, |i, j| unit(j == place + i));
        let torques = match law.queue.len() {
            0 => command.clone(),
            waiting => {
                // Part of the sample time after which the next command on its way takes effect.
                let whole = (1..waiting).fold(S::zero(), |sum, _| sum.plus(&S::one()));
                let before = S::time(clock.delay).over(&S::time(clock.period)).minus(&whole);
                let after = if waiting == 1 { command.clone() } else { row(law.queue[0]) };
                row(law.in_force).scale(&before).plus(&after.scale(&S::one().minus(&before)))
            }
        };
        let mut out = Jump::new();
        if !law.direct.flowing {
            out.set(law.states, &self.rates(number, &torques));
        }
        // The last place is free: the command that was in it has moved on when the one before took effect.
        out.set(law.queue.last().copied().unwrap_or(law.in_force), &command);
        if let Some(place) = self.launched(number).filter(|_| law.queue.is_empty()) {
            let input = law.wire.as_ref().map_or(0, |wire| wire.0);
            out.push(place, nonzero(command.row(input)));
        }
        out
    }

    /// The place of a new command in transit of a law.
    pub fn launched(&self, number: usize) -> Option<usize> {
        let (_, received, waiting) = self.laws[number].wire.as_ref()?;
        Some(waiting.last().copied().unwrap_or(*received))
    }

    /// The next delayed command of a law reaches its motor, the following ones move up.
    pub(super) fn arrive(&self, number: usize) -> Jump<S> {
        let mut out = Jump::new();
        let Some((_, received, waiting)) = &self.laws[number].wire else { return out };
        let chain: Vec<usize> = std::iter::once(*received).chain(waiting.iter().copied()).collect();
        chain.windows(2).for_each(|pair| out.push(pair[0], vec![(pair[1], S::one())]));
        out
    }

    /// The next command of a law in transit takes effect, the following ones move up.
    pub(super) fn apply(&self, number: usize) -> Jump<S> {
        let LawPlaces { in_force, queue, part, wire, .. } = &self.laws[number];
        let mut out = Jump::new();
        let chain: Vec<usize> = std::iter::once(*in_force).chain(queue.iter().copied()).collect();
        for pair in chain.windows(2) {
            (0..part.outputs()).for_each(|i| out.push(pair[0] + i, vec![(pair[1] + i, S::one())]));
        }
        if let (Some(place), Some((input, ..)), Some(next)) = (self.launched(number), wire, queue.first()) {
            out.push(place, vec![(next + input, S::one())]);
        }
        out
    }

    /// A slow sensor of a law reads.
    pub(super) fn read(&self, number: usize, slow: usize) -> Jump<S> {
        let law = &self.laws[number];
        let (in_force, last) = law.slow[slow];
        let sensor = &law.part.slow[slow].1;
        let row: Matrix<f64> = Matrix::from_fn(1, self.plant.basis.rows(), |_, k| {
            sensor.row.iter().filter(|(shaft, _)| *shaft == k).map(|(_, x)| x).sum::<f64>()
        });
        let (row, none) = (gains::<S>(&row), Matrix::zeros(1, self.plant.basis.rows()));
        let [angles, speeds] = if sensor.reads == Reads::Speeds { [&none, &row] } else { [&row, &none] };
        let slopes = nonzero(self.plant.over_states([angles, speeds]).row(0));
        let mut out = Jump::new();
        let mut reading = slopes.clone();
        if let Some(last) = last {
            reading.push((last, S::zero().minus(&S::one())));
            reading.iter_mut().for_each(|(_, x)| *x = x.over(&S::time(sensor.period)));
            out.push(last, slopes);
        }
        reading.extend(law.fresh_of(slow).map(|place| (place, S::one())));
        out.push(in_force, reading);
        out
    }
}
