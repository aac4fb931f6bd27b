use super::jump::Jump;
use super::{LoopPlant, Reads, SampledPart, Teller, on_their_way};
use crate::num::Matrix;
use crate::reduce::FirstOrder;
use crate::synthesis::{Clock, LinearLaw, Told, sizes};

/// Where the parts of z are in a [`SampledLoop`](super::SampledLoop), and what changes them.
pub(super) struct Places<'a> {
    plant: &'a LoopPlant,
    /// Torque of each motor with a lag.
    lagged: Vec<Option<usize>>,
    pub laws: Vec<LawPlaces<'a>>,
    pub size: usize,
}

pub(super) struct LawPlaces<'a> {
    part: &'a SampledPart,
    /// Its linear part, without what slow sensors hold.
    direct: LinearLaw,
    /// Commands in force; of a law in continuous time nowhere.
    pub held: usize,
    /// Commands on their way, the next first.
    queue: Vec<usize>,
    /// Of a late motor: which input, the command that it has received, and those on the wire, the next first.
    wire: Option<(usize, usize, Vec<usize>)>,
    states: usize,
    /// Of each slow sensor the reading that it holds, and the angle that it read last, if it takes differences.
    slow: Vec<(usize, Option<usize>)>,
    /// Where its references are; `None` if they are left out.
    pub references: Option<usize>,
    /// Where the errors of its readings are; `None` if they are left out.
    pub errors: Option<usize>,
    /// Where the torques are that its motors give more than they are told; `None` if they are left out.
    pub excess: Option<usize>,
}

impl LawPlaces<'_> {
    /// Where the errors are that are new when the law computes.
    pub fn fresh(&self) -> impl Iterator<Item = usize> {
        let count = if self.errors.is_some() { self.direct.on_errors.columns() } else { 0 };
        (0..count).filter(|k| !self.is_slow(*k)).filter_map(|k| Some(self.errors? + k))
    }

    fn is_slow(&self, reading: usize) -> bool {
        self.part.slow.iter().any(|(other, _)| *other == reading)
    }

    /// Where the error of a slow sensor is.
    pub fn fresh_of(&self, slow: usize) -> Option<usize> {
        Some(self.errors? + self.part.slow[slow].0)
    }
}

impl<'a> Places<'a> {
    pub fn new(plant: &'a LoopPlant, parts: &'a [SampledPart], driven: bool) -> Self {
        assert_eq!(plant.lags.len(), plant.inputs.len(), "one lag for each input");
        let mut size = plant.states();
        let mut take = |count: usize| {
            size += count;
            size - count
        };
        let lagged = plant.lags.iter().map(|lag| (*lag > 0.0).then(|| take(1))).collect();
        let laws = parts
            .iter()
            .map(|part| {
                let outputs = part.outputs();
                let waiting = part.clock.map_or(0, on_their_way);
                let held = take(if part.clock.is_some() { outputs } else { 0 });
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
                    direct: part.direct(),
                    held,
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

    /// What a law makes of places beside those of plant and states: with `on_references` (or `references`) and `on_errors` (or
    /// `errors`) it multiplies its references and readings' errors, the readings that slow sensors hold, and what other parts tell it.
    fn enter_references(&self, law: &LawPlaces<'_>, [references, errors]: [&Matrix<f64>; 2], out: &mut Matrix<f64>) {
        let told: Vec<(usize, Vec<(usize, f64)>)> =
            law.part.reads.iter().map(|(reference, teller)| (*reference, self.told(*teller))).collect();
        for i in 0..out.rows() {
            if let Some(first) = law.references {
                (0..references.columns()).for_each(|k| out[(i, first + k)] += references[(i, k)]);
            }
            if let Some(first) = law.errors {
                let direct = (0..errors.columns()).filter(|k| !law.is_slow(*k));
                direct.for_each(|k| out[(i, first + k)] += errors[(i, k)]);
            }
            for ((reading, _), (held, _)) in law.part.slow.iter().zip(&law.slow) {
                out[(i, *held)] += errors[(i, *reading)];
            }
            for (reference, row) in &told {
                row.iter().for_each(|(place, x)| out[(i, *place)] += references[(i, *reference)] * x);
            }
        }
    }

    /// What a part tells, over z: at a sample the tasks have computed before, and a law tells what it found at its last one.
    fn told(&self, Teller { part, told }: Teller) -> Vec<(usize, f64)> {
        let law = &self.laws[part];
        match told {
            Told::State(k) => vec![(law.states + k, 1.0)],
            Told::Command(k) if law.part.clock.is_some() => {
                vec![(law.queue.last().copied().unwrap_or(law.held) + k, 1.0)]
            }
            // At every instant it follows from what it reads there.
            Told::Command(k) => {
                let command = self.command(part);
                command.row(k).iter().copied().enumerate().filter(|(_, x)| *x != 0.0).collect()
            }
        }
    }

    /// The command of a law over z: what it says now, whether sampled or not.
    fn command(&self, number: usize) -> Matrix<f64> {
        let law = &self.laws[number];
        let on_plant = self.plant.over_states([&law.direct.on_angles, &law.direct.on_speeds]);
        let states = law.states..law.states + law.direct.states.rows();
        let mut out = Matrix::from_fn(law.part.outputs(), self.size, |i, j| match j {
            j if j < on_plant.columns() => on_plant[(i, j)],
            j if states.contains(&j) => law.direct.on_states[(i, j - states.start)],
            _ => 0.0,
        });
        self.enter_references(law, [&law.direct.on_references, &law.direct.on_errors], &mut out);
        out
    }

    /// What goes into the rates (or the next values) of a law's states, over z, with these torques of its inputs.
    fn rates(&self, number: usize, torques: &Matrix<f64>) -> Matrix<f64> {
        let law = &self.laws[number];
        let from_plant = self.plant.over_states([&law.direct.angles, &law.direct.speeds]);
        let mut out = law.direct.torques.multiply(torques);
        for i in 0..out.rows() {
            for j in 0..from_plant.columns() {
                out[(i, j)] += from_plant[(i, j)];
            }
            for j in 0..law.direct.states.rows() {
                out[(i, law.states + j)] += law.direct.states[(i, j)];
            }
        }
        self.enter_references(law, [&law.direct.references, &law.direct.errors], &mut out);
        out
    }

    /// The matrix of the loop between two instants, ż = F z, and what each input is told. A motor gives what it is told, and what
    /// it gives beyond that, times the gain of its law, of which the law knows nothing.
    pub fn flow(&self) -> (Matrix<f64>, Matrix<f64>) {
        self.put_together(&self.plant.first_order())
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
        let a = Matrix::from_fn(2 * r, 2 * r, |i, j| match (i.checked_sub(r), j.checked_sub(r)) {
            (Some(i), Some(j)) => dampers[(i, j)],
            (Some(i), None) => springs[(i, j)],
            _ => a[(i, j)],
        });
        let plant = LoopPlant { basis: sizes(&plant.basis), ..plant.clone() };
        let sized = |part: &SampledPart| SampledPart { linear: part.linear.sizes(), ..part.clone() };
        let parts: Vec<SampledPart> = parts.iter().map(sized).collect();
        let first_order = FirstOrder { a, b: sizes(&b), moving };
        Some(sizes(&Places::new(&plant, &parts, false).put_together(&first_order).0))
    }

    fn put_together(&self, FirstOrder { a, b, .. }: &FirstOrder<f64>) -> (Matrix<f64>, Matrix<f64>) {
        let plant = self.plant;
        let own = a.rows();
        let mut flow = Matrix::zeros(self.size, self.size);
        for i in 0..own {
            (0..own).for_each(|j| flow[(i, j)] = a[(i, j)]);
        }
        // Commands of all inputs over z.
        let mut commands = Matrix::zeros(plant.inputs.len(), self.size);
        for (number, law) in self.laws.iter().enumerate() {
            if law.part.clock.is_some() {
                for (i, &input) in law.part.inputs.iter().enumerate() {
                    let received = law.wire.as_ref().filter(|(wired, ..)| *wired == i).map(|(_, place, _)| *place);
                    commands[(input, received.unwrap_or(law.held + i))] += 1.0;
                }
                continue;
            }
            let own = self.command(number);
            for (i, &input) in law.part.inputs.iter().enumerate() {
                (0..self.size).for_each(|j| commands[(input, j)] += own[(i, j)]);
            }
        }
        let mut gains = vec![1.0; plant.inputs.len()];
        let mut excess = vec![None; plant.inputs.len()];
        for law in &self.laws {
            for (i, &input) in law.part.inputs.iter().enumerate() {
                gains[input] = law.part.gains[i];
                excess[input] = law.excess.map(|first| first + i);
            }
        }
        for (input, place) in self.lagged.iter().enumerate() {
            let more = |j: usize| f64::from(u8::from(excess[input] == Some(j)));
            for j in 0..self.size {
                match place {
                    Some(place) => {
                        let torque = f64::from(u8::from(j == *place));
                        flow[(*place, j)] += (commands[(input, j)] + more(j) - torque) / plant.lags[input];
                        (0..own).for_each(|i| flow[(i, j)] += gains[input] * b[(i, input)] * torque);
                    }
                    None => {
                        let torque = gains[input] * (commands[(input, j)] + more(j));
                        (0..own).for_each(|i| flow[(i, j)] += b[(i, input)] * torque);
                    }
                }
            }
        }
        let flows = |law: &LawPlaces<'_>| law.part.clock.is_none() || law.direct.flowing;
        for (number, law) in self.laws.iter().enumerate().filter(|(_, law)| flows(law)) {
            let torque = |i: usize, j: usize| match law.part.inputs.get(i).map(|input| (*input, self.lagged[*input])) {
                Some((_, Some(place))) => f64::from(u8::from(j == place)),
                Some((input, None)) => commands[(input, j)],
                None => 0.0,
            };
            let rates = self.rates(number, &Matrix::from_fn(law.part.outputs(), self.size, torque));
            for i in 0..rates.rows() {
                for j in 0..self.size {
                    flow[(law.states + i, j)] += rates[(i, j)];
                }
            }
        }
        (flow, commands)
    }

    /// A law computes: its commands go on their way, its states become those of the next sample.
    pub fn compute(&self, number: usize) -> Jump {
        let law = &self.laws[number];
        let Some(clock) = law.part.clock else { unreachable!("only sampled laws compute at an instant") };
        let m = law.part.outputs();
        let command = self.command(number);
        // The torques until the next sample: in force now, then those on their way, one after the other.
        let row = |place: usize| Matrix::from_fn(m, self.size, |i, j| f64::from(u8::from(j == place + i)));
        let torques = match law.queue.len() {
            0 => command.clone(),
            waiting => {
                // Part of the sample time after which the next command on its way takes effect.
                let before = clock.delay / clock.period - (waiting as f64 - 1.0);
                let after = if waiting == 1 { command.clone() } else { row(law.queue[0]) };
                row(law.held).scale(&before).plus(&after.scale(&(1.0 - before)))
            }
        };
        let mut out = Jump::default();
        if !law.direct.flowing {
            out.set(law.states, &self.rates(number, &torques));
        }
        // The last place is free: the command that was in it has moved on when the one before took effect.
        out.set(law.queue.last().copied().unwrap_or(law.held), &command);
        if let Some(place) = self.launched(number).filter(|_| law.queue.is_empty()) {
            let input = law.wire.as_ref().map_or(0, |wire| wire.0);
            out.push(place, command.row(input).iter().copied().enumerate().filter(|(_, x)| *x != 0.0).collect());
        }
        out
    }

    /// Where a command is put that starts on the wire of a law.
    pub fn launched(&self, number: usize) -> Option<usize> {
        let (_, received, waiting) = self.laws[number].wire.as_ref()?;
        Some(waiting.last().copied().unwrap_or(*received))
    }

    /// The next command on the wire of a law reaches its motor, those behind it move up.
    pub fn arrive(&self, number: usize) -> Jump {
        let mut out = Jump::default();
        let Some((_, received, waiting)) = &self.laws[number].wire else { return out };
        let chain: Vec<usize> = std::iter::once(*received).chain(waiting.iter().copied()).collect();
        chain.windows(2).for_each(|pair| out.push(pair[0], vec![(pair[1], 1.0)]));
        out
    }

    /// The next command of a law that is on its way takes effect, those behind it move up.
    pub fn apply(&self, number: usize) -> Jump {
        let LawPlaces { held, queue, part, wire, .. } = &self.laws[number];
        let mut out = Jump::default();
        let chain: Vec<usize> = std::iter::once(*held).chain(queue.iter().copied()).collect();
        for pair in chain.windows(2) {
            (0..part.outputs()).for_each(|i| out.push(pair[0] + i, vec![(pair[1] + i, 1.0)]));
        }
        if let (Some(place), Some((input, ..)), Some(next)) = (self.launched(number), wire, queue.first()) {
            out.push(place, vec![(next + input, 1.0)]);
        }
        out
    }

    /// A slow sensor of a law reads.
    pub fn read(&self, number: usize, slow: usize) -> Jump {
        let law = &self.laws[number];
        let (held, last) = law.slow[slow];
        let sensor = &law.part.slow[slow].1;
        let row = Matrix::from_fn(1, self.plant.basis.rows(), |_, k| {
            sensor.row.iter().filter(|(shaft, _)| *shaft == k).map(|(_, x)| x).sum::<f64>()
        });
        let none = Matrix::zeros(1, row.columns());
        let [angles, speeds] = if sensor.reads == Reads::Speeds { [&none, &row] } else { [&row, &none] };
        let seen = self.plant.over_states([angles, speeds]);
        let seen: Vec<(usize, f64)> = seen.row(0).iter().copied().enumerate().filter(|(_, x)| *x != 0.0).collect();
        let mut out = Jump::default();
        let mut reading = seen.clone();
        if let Some(last) = last {
            reading.push((last, -1.0));
            reading.iter_mut().for_each(|(_, x)| *x /= sensor.period);
            out.push(last, seen);
        }
        reading.extend(law.fresh_of(slow).map(|place| (place, 1.0)));
        out.push(held, reading);
        out
    }
}
