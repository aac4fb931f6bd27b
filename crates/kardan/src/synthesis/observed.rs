use std::sync::Arc;

use kardan_rt::{Health, ModelObserver, Row, Sensor, StateSpace, hold};

use super::observer::{Noise, distinguishable, extend, kalman, luenberger};
use super::sampled::{Block, Clock, Firmware, entries};
use super::{Continuous, ExactLoop, Law, LinearLaw, Plant, Reference, Running, Seen, SynthesisError, named, rounded};
use crate::analysis::{LinearSystem, OutputSignal};
use crate::element::Values;
use crate::equations::Measured;
use crate::num::{Float, Keeper, Matrix, discretise, rational_to_f64};
use crate::reduce::{Kinematics, MechanismData};
use crate::results::{ControllerData, DataMatrix, DataNumber, Design, ExactMatrix, ObserverResult, Pole, ReadSignal};
use crate::schema::{Field, Kind, Sign};

/// Keys of `[control.<name>.observer]`.
pub const OBSERVER: &[Field] = &[
    Field::required(
        "sensors",
        Kind::Outputs,
        "What is measured: angles, speeds, torques of torsion bars; `<sensor>.phi` and so on reads the sensor of that name with its resolution, if the controller has a sample time. In continuous time they are ideal.",
    ),
    Field::optional(
        "disturbances",
        Kind::Words,
        "Shafts on which an unknown constant torque acts, which is estimated too; left out: all reduced coordinates.",
    ),
    Field::optional(
        "plant",
        Kind::Choice(&["linear", "nonlinear"]),
        "The model that it runs: `linear`: that at zero angles; `nonlinear`: the full one, joints and friction fed forward by the \
         law included. Its gain is that at zero angles either way. Left out: nonlinear where the design model of the law is.",
    ),
    Field::optional("method", Kind::Choice(&["poles", "kalman"]), "How its gain is found; left out: poles."),
    Field::optional(
        "poles",
        Kind::Poles,
        "Poles of the error: as many as the longest chain of a sensor has (for every sensor alike), or one for each state \
         of the observer. Required by the method `poles`.",
    ),
    Field::optional(
        "disturbance_rate",
        Kind::Number(Sign::Positive),
        "Kalman: how fast a disturbance may wander, N m/sqrt(s); left out: 10.",
    ),
    Field::optional(
        "speed_noise",
        Kind::Number(Sign::NonNegative),
        "Kalman: noise of the accelerations, rad/s/sqrt(s); the more, the better the loop bears errors of the model. Left out: 0.1, of the law `sampled_noninteracting` 10.",
    ),
    Field::optional(
        "sensor_noise",
        Kind::Number(Sign::Positive),
        "Kalman: noise of each sensor, its unit times sqrt(s); left out: 1e-5, of the law `sampled_noninteracting` what the resolution makes.",
    ),
    Field::optional(
        "compensation",
        Kind::Number(Sign::NonNegative),
        "Which part of the estimated disturbances the law cancels, from 0 to 1; left out: 1.",
    ),
];

/// Numbers of the shafts on which the observer of a controller estimates torques; none without an observer.
///
/// # Errors
/// If a name is no shaft or stands twice.
pub(super) fn disturbances(values: &Values, plant: &Plant) -> Result<Vec<usize>, SynthesisError> {
    let Some(observer) = values.table("observer") else { return Ok(Vec::new()) };
    let Some(names) = observer.words("disturbances") else { return Ok(plant.reduced.coordinates.clone()) };
    let shaft = |name: &String| plant.reduced.shaft(name).ok_or_else(|| SynthesisError::NoShaft { name: name.clone() });
    names.iter().map(shaft).collect()
}

/// Where a reading comes from.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Reading {
    Angle(usize),
    Speed(usize),
    /// Sum of coefficients times angles, less a constant.
    Twist(Vec<(usize, f64)>, f64),
}

impl Reading {
    pub fn read(&self, angles: &[f64], speeds: &[f64]) -> f64 {
        match self {
            Self::Angle(shaft) => angles[*shaft],
            Self::Speed(shaft) => speeds[*shaft],
            Self::Twist(row, rest) => row.iter().map(|(shaft, x)| x * angles[*shaft]).sum::<f64>() - rest,
        }
    }
}

/// A law that sees the plant through an observer: angles and speeds that are not measured, and disturbances, are estimates.
///
/// `x̂′ = A x̂ + B u + L (y − C x̂)` over reduced coordinates, their speeds and disturbance torques, \[diss. (6.45), (6.46)\], run
/// by the block [`StateSpace`] with the signals `[u; y]`; or the nonlinear model in place of A, B and C, run by the block
/// [`ModelObserver`].
pub(super) struct Observed {
    law: Arc<dyn Law>,
    result: ObserverResult,
    data: ControllerData,
    sensors: Vec<OutputSignal>,
    a: Matrix<f64>,
    b: Matrix<f64>,
    /// Rows of the sensors over angles and speeds of all shafts.
    rows: [Matrix<f64>; 2],
    basis: Matrix<f64>,
    disturbances: usize,
    /// As they are at the start of a run.
    seer: Seer,
    model: Model<f64>,
}

/// A law behind an observer, at every instant.
struct Instant {
    law: Box<dyn Continuous>,
    seer: Seer,
    model: Model<f64>,
}

impl Continuous for Instant {
    fn keep(&mut self, keeper: &mut Keeper<'_>) {
        self.seer.keep(keeper);
        self.law.keep(keeper);
    }

    fn command(&mut self, seen: Seen<'_>, out: &mut [f64]) {
        self.law.command(self.seer.estimate(&seen), out);
    }

    fn rates(&mut self, seen: Seen<'_>, torques: &[f64], out: &mut [f64]) {
        let (own, rest) = out.split_at_mut(2 * self.seer.coordinates.len() + self.seer.told.len());
        self.seer.read(&seen);
        if !self.model.rates(&seen.states[..own.len()], torques, &self.seer, own) {
            own.fill(f64::NAN);
        }
        if !rest.is_empty() {
            self.law.rates(self.seer.estimate(&seen), torques, rest);
        }
    }
}

/// From readings and estimates to what the law sees.
#[derive(Clone)]
struct Seer {
    readings: Vec<Reading>,
    coordinates: Vec<usize>,
    compensation: f64,
    /// What the sensors read at zero coordinates, which the linear model does not know.
    offsets: Vec<f64>,
    kinematics: Kinematics,
    /// Readings that were not finite.
    held: usize,
    // Memory of one evaluation; of the values those that were finite last.
    values: Vec<f64>,
    position: Vec<f64>,
    speed: Vec<f64>,
    told: Vec<f64>,
}

impl Seer {
    fn keep(&mut self, keeper: &mut Keeper<'_>) {
        keeper.numbers(&mut self.values);
        keeper.count(&mut self.held);
    }

    /// Takes the readings: those of the sensors, or ideal ones where there are none. Where one is not finite, the last good one
    /// stays; returns how many are not.
    fn read(&mut self, seen: &Seen<'_>) -> usize {
        if seen.readings.is_empty() {
            for (value, reading) in self.values.iter_mut().zip(&self.readings) {
                *value = reading.read(seen.angles, seen.speeds);
            }
            return 0;
        }
        hold(seen.readings, &mut self.values)
    }

    /// What the law sees, its own states behind those of the observer: estimates, and in their place what is measured.
    fn estimate<'a>(&'a mut self, seen: &Seen<'a>) -> Seen<'a> {
        self.held = self.read(seen);
        let r = self.coordinates.len();
        let own = 2 * r + self.told.len();
        self.position.copy_from_slice(&seen.states[..r]);
        self.speed.copy_from_slice(&seen.states[r..2 * r]);
        for (reading, value) in self.readings.iter().zip(&self.values) {
            let (of, shaft) = match reading {
                Reading::Angle(shaft) => (&mut self.position, shaft),
                Reading::Speed(shaft) => (&mut self.speed, shaft),
                Reading::Twist(..) => continue,
            };
            if let Some(place) = self.coordinates.iter().position(|coordinate| coordinate == shaft) {
                of[place] = *value;
            }
        }
        self.kinematics.update(&self.position, &self.speed);
        for (told, torque) in self.told.iter_mut().zip(&seen.states[2 * r..]) {
            *told = self.compensation * torque;
        }
        Seen {
            angles: &self.kinematics.angles,
            speeds: &self.kinematics.speeds,
            disturbances: &self.told,
            references: seen.references,
            readings: &[],
            states: &seen.states[own..],
        }
    }
}

/// What an observer runs.
#[derive(Clone)]
enum Model<T> {
    /// The linear model at zero angles.
    Linear(Runner<T>),
    Nonlinear(Box<Copied<T>>),
}

impl<T: Float> Model<T> {
    /// Returns whether there is a finite answer; if not, nothing is written.
    fn rates(&mut self, states: &[f64], torques: &[f64], seer: &Seer, out: &mut [f64]) -> bool {
        match self {
            Self::Linear(runner) => runner.rates(states, torques, seer, out),
            Self::Nonlinear(copied) => copied.rates(states, torques, &seer.values, out),
        }
    }

    /// The state at the next sample, of matrices or tables for that. Returns whether there is a finite one; if not, nothing is
    /// written.
    fn next(&mut self, states: &[f64], torques: &[f64], seer: &Seer, out: &mut [f64]) -> bool {
        match self {
            Self::Linear(runner) => runner.rates(states, torques, seer, out),
            Self::Nonlinear(copied) => copied.next(states, torques, &seer.values, out),
        }
    }
}

/// The observer's block [`ModelObserver`] with the memory of one evaluation.
#[derive(Clone)]
struct Copied<T> {
    data: MechanismData<T>,
    inputs: Vec<usize>,
    sensors: Vec<Sensor<T>>,
    entries: Vec<(usize, T)>,
    disturbances: Vec<usize>,
    gain: Vec<T>,
    /// Γ of a sample time; none in continuous time.
    held: Vec<T>,
    friction_width: Option<T>,
    memory: Vec<T>,
    torques: Vec<T>,
    readings: Vec<T>,
    state: Vec<T>,
    result: Vec<T>,
}

impl Copied<f64> {
    fn new(
        law: &dyn Law,
        plant: &Plant,
        readings: &[Reading],
        disturbances: &[usize],
        gain: &Matrix<f64>,
    ) -> Result<Self, SynthesisError> {
        let equations = &plant.reduced.equations;
        let number = |name: &String| {
            equations.inputs.iter().position(|input| input.element == *name).expect("a law commands inputs")
        };
        let (sensors, terms) = sensors(readings);
        let states = gain.rows();
        let mut out = Self {
            data: MechanismData::new(&plant.reduced)
                .map_err(|why| SynthesisError::NoBlock { reason: why.to_string() })?,
            inputs: law.inputs().iter().map(number).collect(),
            torques: vec![0.0; law.inputs().len()],
            readings: vec![0.0; sensors.len()],
            sensors,
            entries: terms,
            disturbances: disturbances.to_vec(),
            gain: entries(gain),
            held: Vec::new(),
            friction_width: law.friction_width(),
            memory: Vec::new(),
            state: vec![0.0; states],
            result: vec![0.0; states],
        };
        out.memory = vec![0.0; out.block().memory()];
        Ok(out)
    }

    /// How the rates change with the state and with `[u; y]`, at rest at a position: central differences.
    fn slopes(&self, position: &[f64], readings: &[f64]) -> [Matrix<f64>; 2] {
        let mut copied = self.clone();
        let (n, m, r) = (self.state.len(), self.inputs.len(), position.len());
        let mut at: Vec<f64> = position.to_vec();
        at.resize(n + m, 0.0);
        at.extend_from_slice(readings);
        let mut rates = |at: &[f64]| {
            let mut out = vec![0.0; n];
            copied.rates(&at[..n], &at[n..n + m], &at[n + m..], &mut out);
            out
        };
        let mut slopes = Matrix::zeros(n, at.len());
        for j in 0..at.len() {
            // Angles bend the model, and friction bends over its width; all else is linear.
            let step = match (j, self.friction_width) {
                (j, Some(width)) if j >= r => (SLOPE_STEP * width).min(SLOPE_STEP),
                _ => SLOPE_STEP,
            };
            let middle = at[j];
            at[j] = middle + step;
            let above = rates(&at);
            at[j] = middle - step;
            let below = rates(&at);
            at[j] = middle;
            (0..n).for_each(|i| slopes[(i, j)] = (above[i] - below[i]) / (2.0 * step));
        }
        let columns = |first: usize, count: usize| Matrix::from_fn(n, count, |i, j| slopes[(i, first + j)]);
        [columns(0, n), columns(n, m + readings.len())]
    }

    /// The tables and lists of the block for a file, beside those of the mechanism.
    fn tables(&self) -> Vec<(String, Vec<Vec<f64>>)> {
        let numbers = |list: &[usize]| list.iter().map(|k| vec![*k as f64]).collect::<Vec<_>>();
        let gain = self.gain.chunks(self.sensors.len().max(1)).map(<[f64]>::to_vec).collect();
        let own = [
            ("commanded", numbers(&self.inputs)),
            ("sensors", sensor_table(&self.sensors)),
            ("sensor_entries", self.entries.iter().map(|(shaft, x)| vec![*shaft as f64, *x]).collect()),
            ("disturbances", numbers(&self.disturbances)),
            ("gain", gain),
        ];
        let own = own.into_iter().map(|(name, rows)| (name.to_string(), rows));
        self.data.tables(|x| x).into_iter().chain(own).collect()
    }
}

/// Step of central differences, rad, rad/s or N m.
const SLOPE_STEP: f64 = 1e-5;

impl<T: Float> Copied<T> {
    fn block(&self) -> ModelObserver<'_, T> {
        ModelObserver {
            mechanism: self.data.block(),
            inputs: &self.inputs,
            sensors: &self.sensors,
            entries: &self.entries,
            disturbances: &self.disturbances,
            gain: &self.gain,
            held: &self.held,
            friction_width: self.friction_width,
        }
    }

    /// The same in another precision, for a sample time with that Γ.
    fn cast<U: Float>(&self, held: &Matrix<f64>) -> Copied<U> {
        let to = |x: T| U::from_f64(x.to_f64());
        let list = |values: &[T]| values.iter().map(|x| to(*x)).collect::<Vec<U>>();
        let sensor = |sensor: &Sensor<T>| Sensor { row: sensor.row, speed: sensor.speed, rest: to(sensor.rest) };
        Copied {
            data: self.data.cast(to),
            inputs: self.inputs.clone(),
            sensors: self.sensors.iter().map(sensor).collect(),
            entries: self.entries.iter().map(|(shaft, x)| (*shaft, to(*x))).collect(),
            disturbances: self.disturbances.clone(),
            gain: list(&self.gain),
            held: entries(held),
            friction_width: self.friction_width.map(to),
            memory: list(&self.memory),
            torques: list(&self.torques),
            readings: list(&self.readings),
            state: list(&self.state),
            result: list(&self.result),
        }
    }

    fn take(&mut self, states: &[f64], torques: &[f64], readings: &[f64]) -> Vec<T> {
        T::narrow(states, &mut self.state);
        T::narrow(torques, &mut self.torques);
        T::narrow(readings, &mut self.readings);
        std::mem::take(&mut self.memory)
    }

    fn rates(&mut self, states: &[f64], torques: &[f64], readings: &[f64], out: &mut [f64]) -> bool {
        let mut memory = self.take(states, torques, readings);
        let mut result = std::mem::take(&mut self.result);
        let found = self.block().rates(&self.state, &self.torques, &self.readings, &mut memory, &mut result);
        if found {
            T::widen(&result, out);
        }
        (self.memory, self.result) = (memory, result);
        found
    }

    fn next(&mut self, states: &[f64], torques: &[f64], readings: &[f64], out: &mut [f64]) -> bool {
        let mut memory = self.take(states, torques, readings);
        let mut state = std::mem::take(&mut self.state);
        let found = self.block().step(&mut state, &self.torques, &self.readings, &mut memory);
        if found {
            T::widen(&state, out);
        }
        (self.memory, self.state) = (memory, state);
        found
    }
}

/// The observer's block [`StateSpace`] with the memory of one evaluation.
#[derive(Clone)]
struct Runner<T> {
    a: Vec<T>,
    b: Vec<T>,
    signals: Vec<T>,
    state: Vec<T>,
    result: Vec<T>,
}

impl<T: Float> Runner<T> {
    fn new(a: &Matrix<f64>, b: &Matrix<f64>) -> Self {
        let zeros = |count: usize| vec![T::ZERO; count];
        Self {
            a: entries(a),
            b: entries(b),
            signals: zeros(b.columns()),
            state: zeros(a.rows()),
            result: zeros(a.rows()),
        }
    }

    /// `A x̂ + B [u; y]`; the readings are those that the seer has taken. Returns whether these are numbers; if not, nothing is
    /// written.
    fn rates(&mut self, states: &[f64], torques: &[f64], seer: &Seer, out: &mut [f64]) -> bool {
        let (inputs, readings) = self.signals.split_at_mut(torques.len());
        T::narrow(torques, inputs);
        for ((signal, value), offset) in readings.iter_mut().zip(&seer.values).zip(&seer.offsets) {
            *signal = T::from_f64(value - offset);
        }
        T::narrow(states, &mut self.state);
        let Some(block) = StateSpace::new(&self.a, &self.b, &[], &[], self.state.len(), self.signals.len()) else {
            unreachable!("the matrices fit each other by construction");
        };
        let found = block.rates(&self.state, &self.signals, &mut self.result);
        if found {
            T::widen(&self.result, out);
        }
        found
    }
}

/// A law behind an observer, at a sample time.
struct Sampled<T> {
    law: Box<dyn Block>,
    seer: Seer,
    /// States of the observer.
    own: usize,
    model: Model<T>,
    /// Whether the estimate was kept as it was at the last sample, because it overflowed.
    kept: bool,
}

impl<T: Float> Block for Sampled<T> {
    fn keep(&mut self, keeper: &mut Keeper<'_>) {
        self.seer.keep(keeper);
        keeper.flag(&mut self.kept);
        self.law.keep(keeper);
    }

    fn command(&mut self, seen: Seen<'_>, out: &mut [f64]) {
        self.law.command(self.seer.estimate(&seen), out);
    }

    fn next(&mut self, seen: Seen<'_>, torques: &[f64], out: &mut [f64]) {
        let (own, rest) = out.split_at_mut(self.own);
        self.seer.read(&seen);
        self.kept = !self.model.next(&seen.states[..self.own], torques, &self.seer, own);
        if self.kept {
            own.copy_from_slice(&seen.states[..self.own]);
        }
        self.law.next(self.seer.estimate(&seen), torques, rest);
    }

    fn health(&self) -> Health {
        let Health { readings_held, estimate_kept, .. } = self.law.health();
        Health {
            readings_held: readings_held + self.seer.held,
            estimate_kept: estimate_kept || self.kept,
            ..self.law.health()
        }
    }
}

impl Observed {
    /// Puts the observer that the keys ask for before a law.
    ///
    /// # Errors
    /// If the sensors do not show what is to be estimated, or the poles do not fit.
    pub fn new(law: Arc<dyn Law>, values: &Values, plant: &Plant, disturbed: &[usize]) -> Result<Self, SynthesisError> {
        if let Some(share) = values.number("compensation").filter(|share| *share > 1.0) {
            return Err(SynthesisError::NotAShare { share });
        }
        let compensation = values.number("compensation").unwrap_or(1.0);
        let friction = law.friction_width().is_some();
        let nonlinear = match values.word("plant") {
            Some(word) => word == "nonlinear",
            None => friction || !plant.is_linear(),
        };
        let more = friction || (law.on_full_model() && !plant.is_linear());
        if more && !nonlinear && compensation > 0.0 && !disturbed.is_empty() {
            return Err(SynthesisError::CancelledTwice);
        }
        let sensors: Vec<OutputSignal> = values
            .words("sensors")
            .unwrap_or_default()
            .iter()
            .map(|name| plant.output(name))
            .collect::<Result<_, _>>()?;
        let readings: Vec<Reading> = sensors.iter().map(|sensor| reading(sensor, plant)).collect::<Result<_, _>>()?;
        let inputs = law.inputs().to_vec();
        let system = plant.system(&inputs, &sensors);
        let (torques, _) = plant.torques(disturbed, &[]);
        let names: Vec<String> = disturbed.iter().map(|&k| plant.shafts()[k].clone()).collect();
        let states: Vec<String> = names.iter().map(|name| format!("{name}.disturbance")).collect();
        let extended = extend(&system, &torques, &states);
        let (gain, poles, notes) = gain(values, &extended)?;
        let floating = Matrix::from_fn(gain.values.len(), sensors.len(), |i, j| gain.values[i][j]);
        let (a, b, c) = (extended.a.to_f64(), extended.b.to_f64(), extended.c.to_f64());
        let correction = floating.multiply(&c);
        let a = Matrix::from_fn(a.rows(), a.columns(), |i, j| a[(i, j)] - correction[(i, j)]);
        let (m, p) = (inputs.len(), sensors.len());
        let b = Matrix::from_fn(a.rows(), m + p, |i, j| if j < m { b[(i, j)] } else { floating[(i, j - m)] });
        let mut sentences = told_apart(plant, &system)?;
        sentences.extend(notes);
        let method = values.word("method").unwrap_or("poles").to_string();
        let result = ObserverResult {
            sensors: sensors.iter().map(|sensor| sensor.name.clone()).collect(),
            states: extended.states.clone(),
            disturbances: names,
            poles,
            method,
            gain,
            distinguishable: sentences,
        };
        let r = plant.linear.coordinates.len();
        let mut kinematics = Kinematics::new(&plant.reduced);
        kinematics.update(&vec![0.0; r], &vec![0.0; r]);
        let rows = rows(&readings, plant.shafts().len());
        let seer = Seer {
            offsets: readings.iter().map(|one| one.read(&kinematics.angles, &kinematics.speeds)).collect(),
            values: readings.iter().map(|one| one.read(&kinematics.angles, &kinematics.speeds)).collect(),
            held: 0,
            readings,
            coordinates: plant.reduced.coordinates.clone(),
            compensation,
            kinematics,
            position: vec![0.0; r],
            speed: vec![0.0; r],
            told: vec![0.0; disturbed.len()],
        };
        let model = if nonlinear {
            Model::Nonlinear(Box::new(Copied::new(&*law, plant, &seer.readings, disturbed, &floating)?))
        } else {
            Model::Linear(Runner::new(&a, &b))
        };
        let mut out = Self {
            data: ControllerData::default(),
            rows,
            sensors,
            basis: plant.linear.basis.to_f64(),
            disturbances: disturbed.len(),
            model,
            seer,
            a,
            b,
            law,
            result,
        };
        out.data = out.observer_data(&inputs);
        Ok(out)
    }

    fn observer_data(&self, inputs: &[String]) -> ControllerData {
        let unit = |name: &String| match name.rsplit_once('.').map(|(_, tail)| tail) {
            Some("phi") => "rad",
            Some("w") => "rad/s",
            _ => "N m",
        };
        let torques = inputs.iter().map(|input| ReadSignal::new(format!("{input}.tau"), "N m"));
        let sensors = self.result.sensors.iter().map(|name| ReadSignal::new(name, unit(name)));
        let (n, signals) = (self.a.rows(), self.b.columns());
        let matrices = [
            ("A", self.a.clone()),
            ("B", self.b.clone()),
            ("C", Matrix::identity(n)),
            ("D", Matrix::zeros(n, signals)),
        ];
        if let Model::Nonlinear(copied) = &self.model {
            let error = ("error".to_string(), self.a.to_rows());
            let width = copied.friction_width.map(|width| DataNumber::new("friction_width", width));
            return ControllerData {
                block: "ModelObserver".into(),
                reads: torques.chain(sensors).collect(),
                writes: self.result.states.clone(),
                sample_time: None,
                single: false,
                matrices: copied
                    .tables()
                    .into_iter()
                    .chain([error])
                    .map(|(name, rows)| DataMatrix::new(name, rows))
                    .collect(),
                numbers: [
                    DataNumber::new("shafts", copied.data.shafts.len() as f64),
                    DataNumber::new("compensation", self.seer.compensation),
                ]
                .into_iter()
                .chain(width)
                .collect(),
            };
        }
        ControllerData {
            block: "StateSpace".into(),
            reads: torques.chain(sensors).collect(),
            writes: self.result.states.clone(),
            sample_time: None,
            single: false,
            matrices: matrices.into_iter().map(|(name, matrix)| DataMatrix::new(name, matrix.to_rows())).collect(),
            numbers: std::iter::once(DataNumber::new("compensation", self.seer.compensation))
                .chain(
                    self.result
                        .sensors
                        .iter()
                        .zip(&self.seer.offsets)
                        .map(|(name, x)| DataNumber::new(format!("{name} offset"), *x)),
                )
                .collect(),
        }
    }

    fn own(&self) -> usize {
        self.a.rows()
    }

    /// Γ = ∫ exp((A − L C) t) dt over a sample time.
    fn held(&self, clock: Clock) -> Option<Matrix<f64>> {
        Some(discretise(&self.a, &Matrix::identity(self.own()), clock.period)?.b)
    }

    /// The linear part of an observer `x̂′ = A x̂ + B [u; y]`, or of its sampled form, around that of a law.
    /// `basis`: K of the model where it is linear.
    fn around(&self, a: &Matrix<f64>, b: &Matrix<f64>, law: &LinearLaw, basis: &Matrix<f64>) -> LinearLaw {
        let (n, k, shafts) = (a.rows(), law.states.rows(), basis.rows());
        let (r, m) = (self.seer.coordinates.len(), law.on_angles.rows());
        // How angles and speeds that the law sees follow from estimates and from true ones: measured coordinates are true.
        let measured = |speed: bool| -> Vec<bool> {
            let of = |reading: &Reading, shaft: usize| match reading {
                Reading::Angle(s) => !speed && *s == shaft,
                Reading::Speed(s) => speed && *s == shaft,
                Reading::Twist(..) => false,
            };
            self.seer
                .coordinates
                .iter()
                .map(|&shaft| self.seer.readings.iter().any(|reading| of(reading, shaft)))
                .collect()
        };
        let [true_angles, true_speeds] = [measured(false), measured(true)];
        let split = |on_angles: &Matrix<f64>, on_speeds: &Matrix<f64>, on_disturbances: &Matrix<f64>| {
            let rows = on_angles.rows();
            let (over_q, over_w) = (on_angles.multiply(basis), on_speeds.multiply(basis));
            let mut states = Matrix::zeros(rows, n);
            let (mut angles, mut speeds) = (Matrix::zeros(rows, shafts), Matrix::zeros(rows, shafts));
            for i in 0..rows {
                for j in 0..r {
                    if true_angles[j] {
                        angles[(i, self.seer.coordinates[j])] = over_q[(i, j)];
                    } else {
                        states[(i, j)] = over_q[(i, j)];
                    }
                    if true_speeds[j] {
                        speeds[(i, self.seer.coordinates[j])] = over_w[(i, j)];
                    } else {
                        states[(i, r + j)] = over_w[(i, j)];
                    }
                }
                for j in 0..on_disturbances.columns().min(self.disturbances) {
                    states[(i, 2 * r + j)] = self.seer.compensation * on_disturbances[(i, j)];
                }
            }
            (states, angles, speeds)
        };
        let (command_states, on_angles, on_speeds) = split(&law.on_angles, &law.on_speeds, &law.on_disturbances);
        let (rate_states, angles, speeds) = split(&law.angles, &law.speeds, &law.disturbances);
        let below = |upper: &Matrix<f64>, lower: &Matrix<f64>| {
            Matrix::from_fn(n + k, lower.columns(), |i, j| if i < n { upper[(i, j)] } else { lower[(i - n, j)] })
        };
        // Measured coordinates pass to the law with their errors.
        let through = |on_angles: &Matrix<f64>, on_speeds: &Matrix<f64>| {
            let (over_q, over_w) = (on_angles.multiply(basis), on_speeds.multiply(basis));
            let place = |shaft: &usize| self.seer.coordinates.iter().position(|coordinate| coordinate == shaft);
            Matrix::from_fn(on_angles.rows(), self.seer.readings.len(), |i, j| match &self.seer.readings[j] {
                Reading::Angle(shaft) => place(shaft).map_or(0.0, |k| over_q[(i, k)]),
                Reading::Speed(shaft) => place(shaft).map_or(0.0, |k| over_w[(i, k)]),
                Reading::Twist(..) => 0.0,
            })
        };
        let correct = Matrix::from_fn(n, self.seer.readings.len(), |i, j| b[(i, m + j)]);
        LinearLaw {
            states: Matrix::from_fn(n + k, n + k, |i, j| match (i < n, j < n) {
                (true, true) => a[(i, j)],
                (true, false) => 0.0,
                (false, true) => rate_states[(i - n, j)],
                (false, false) => law.states[(i - n, j - n)],
            }),
            angles: below(&correct.multiply(&self.rows[0]), &angles),
            speeds: below(&correct.multiply(&self.rows[1]), &speeds),
            disturbances: Matrix::zeros(n + k, 0),
            torques: below(&Matrix::from_fn(n, m, |i, j| b[(i, j)]), &law.torques),
            on_states: Matrix::from_fn(m, n + k, |i, j| {
                if j < n { command_states[(i, j)] } else { law.on_states[(i, j - n)] }
            }),
            on_angles,
            on_speeds,
            on_disturbances: Matrix::zeros(m, 0),
            references: below(&Matrix::zeros(n, law.references.columns()), &law.references),
            on_references: law.on_references.clone(),
            errors: below(&correct, &through(&law.angles, &law.speeds)),
            on_errors: through(&law.on_angles, &law.on_speeds),
        }
    }
}

pub(super) fn reading(sensor: &OutputSignal, plant: &Plant) -> Result<Reading, SynthesisError> {
    let shaft = |name: &String| plant.reduced.shaft(name).expect("an output names a shaft");
    Ok(match &sensor.measured {
        Measured::Angle(name) => Reading::Angle(shaft(name)),
        Measured::Speed(name) => Reading::Speed(shaft(name)),
        Measured::SpringTorque(element) => {
            let springs = plant.reduced.equations.springs.iter().filter(|spring| spring.element == *element);
            let (mut row, mut rest) = (Vec::new(), 0.0);
            for spring in springs {
                let stiffness = spring.value.stiffness.to_f64();
                row.extend(spring.row.iter().map(|(shaft, x)| (*shaft, stiffness * rational_to_f64(x))));
                rest += stiffness * spring.value.rest.to_f64();
            }
            Reading::Twist(row, rest)
        }
        Measured::ConstraintTorque(..) | Measured::ComplianceTorque(..) | Measured::NetTorque(_) => {
            return Err(SynthesisError::NotASensor { signal: sensor.name.clone() });
        }
    })
}

/// The readings as a block reads them: what a sensor is, and the list of shafts and coefficients that its row is a part of.
pub(super) fn sensors(readings: &[Reading]) -> (Vec<Sensor<f64>>, Vec<(usize, f64)>) {
    let mut terms = Vec::new();
    let one = |reading: &Reading| {
        let first = terms.len();
        let (speed, rest) = match reading {
            Reading::Angle(shaft) => {
                terms.push((*shaft, 1.0));
                (false, 0.0)
            }
            Reading::Speed(shaft) => {
                terms.push((*shaft, 1.0));
                (true, 0.0)
            }
            Reading::Twist(row, rest) => {
                terms.extend_from_slice(row);
                (false, *rest)
            }
        };
        Sensor { row: Row { first, count: terms.len() - first }, speed, rest }
    };
    (readings.iter().map(one).collect(), terms)
}

/// The sensors as rows of a table.
pub(super) fn sensor_table(sensors: &[Sensor<f64>]) -> Vec<Vec<f64>> {
    let sensor = |sensor: &Sensor<f64>| {
        let Row { first, count } = sensor.row;
        vec![first as f64, count as f64, f64::from(u8::from(sensor.speed)), sensor.rest]
    };
    sensors.iter().map(sensor).collect()
}

/// The readings as rows over angles and speeds of all shafts.
pub(super) fn rows(readings: &[Reading], shafts: usize) -> [Matrix<f64>; 2] {
    let mut angles = Matrix::zeros(readings.len(), shafts);
    let mut speeds = Matrix::zeros(readings.len(), shafts);
    for (i, reading) in readings.iter().enumerate() {
        match reading {
            Reading::Angle(shaft) => angles[(i, *shaft)] = 1.0,
            Reading::Speed(shaft) => speeds[(i, *shaft)] = 1.0,
            Reading::Twist(row, _) => row.iter().for_each(|(shaft, x)| angles[(i, *shaft)] += x),
        }
    }
    [angles, speeds]
}

/// The gain L with the poles of the error and what must be known.
fn gain(values: &Values, extended: &LinearSystem) -> Result<(ExactMatrix, Vec<Pole>, Vec<String>), SynthesisError> {
    let failed = |error| SynthesisError::Observer { sensors: extended.outputs.clone(), error: Box::new(error) };
    let kalman_keys = ["disturbance_rate", "speed_noise", "sensor_noise"];
    let idle = match values.word("method") {
        Some("kalman") => values.has("poles").then_some("poles"),
        _ => kalman_keys.into_iter().find(|key| values.has(key)),
    };
    if let Some(key) = idle {
        let method = values.word("method").unwrap_or("poles").to_string();
        return Err(SynthesisError::IdleKey { key, method });
    }
    let title = ("observer_gain", "observer gain L of x' = A x + B u + L (y - C x)", "");
    if values.word("method") == Some("kalman") {
        let number = |key: &str, otherwise: f64| values.number(key).unwrap_or(otherwise).powi(2);
        let process = extended.states.iter().map(|state| match state.rsplit_once('.').map(|(_, tail)| tail) {
            Some("phi") => 0.0,
            Some("w") => number("speed_noise", 0.1),
            _ => number("disturbance_rate", 10.0),
        });
        let noise = Noise {
            process: process.collect(),
            measurement: vec![number("sensor_noise", 1e-5); extended.outputs.len()],
        };
        let found = kalman(extended, &noise).map_err(failed)?;
        let notes =
            vec![format!("the Riccati equation of the filter holds with the relative residual {:.1e}", found.residual)];
        return Ok((rounded(title, &extended.states, &extended.outputs, &found.gain), found.poles, notes));
    }
    let Some(poles) = values.poles("poles") else { return Err(SynthesisError::ObserverPoles) };
    let poles: Vec<_> = poles.iter().map(|(re, im)| (re.to_rational(), im.to_rational())).collect();
    if let Some((re, _)) = poles.iter().find(|(re, _)| rational_to_f64(re) >= 0.0) {
        return Err(SynthesisError::ObserverUnstable { real: rational_to_f64(re) });
    }
    let found = luenberger(extended, &poles).map_err(failed)?;
    Ok((named(title, &extended.states, &extended.outputs, &found.gain), found.poles, found.notes))
}

/// Which torques on any shafts the sensors could tell apart, \[diss. (6.41)-(6.43)\].
pub(super) fn told_apart(plant: &Plant, system: &LinearSystem) -> Result<Vec<String>, SynthesisError> {
    let all: Vec<usize> = (0..plant.shafts().len()).collect();
    let (torques, _) = plant.torques(&all, &[]);
    let names: Vec<String> = plant.shafts().iter().map(|shaft| format!("T_{shaft}")).collect();
    let failed = |error| SynthesisError::Observer { sensors: system.outputs.clone(), error: Box::new(error) };
    Ok(distinguishable(system, &torques, &names).map_err(failed)?.sentences)
}

impl Law for Observed {
    fn inputs(&self) -> &[String] {
        self.law.inputs()
    }

    fn references(&self) -> &[Reference] {
        self.law.references()
    }

    fn states(&self) -> Vec<String> {
        self.result.states.iter().map(|state| format!("estimate of {state}")).chain(self.law.states()).collect()
    }

    fn start(&self, angles: &[f64], speeds: &[f64], out: &mut [f64]) {
        let (own, rest) = out.split_at_mut(self.own());
        own.fill(0.0);
        for (state, &shaft) in own.iter_mut().zip(&self.seer.coordinates) {
            *state = angles[shaft];
        }
        self.law.start(angles, speeds, rest);
    }

    fn run(&self) -> Running {
        match self.law.run() {
            Running::Continuous(law) => {
                Running::Continuous(Box::new(Instant { law, seer: self.seer.clone(), model: self.model.clone() }))
            }
            // A law with a clock of its own brings its own observer.
            sampled @ Running::Sampled(..) => sampled,
        }
    }

    fn sensors(&self) -> &[OutputSignal] {
        &self.sensors
    }

    fn firmware(&self, clock: Clock) -> Option<Firmware> {
        let law = self.law.firmware(clock)?;
        let held = discretise(&self.a, &self.b, clock.period)?;
        let (seer, own) = (self.seer.clone(), self.own());
        let linear = self.around(&held.a, &held.b, &law.linear, &self.basis);
        let law = law.block;
        let block: Box<dyn Block> = match (&self.model, clock.single) {
            (Model::Linear(_), true) => Box::new(Sampled {
                law,
                seer,
                own,
                kept: false,
                model: Model::Linear(Runner::<f32>::new(&held.a, &held.b)),
            }),
            (Model::Linear(_), false) => Box::new(Sampled {
                law,
                seer,
                own,
                kept: false,
                model: Model::Linear(Runner::<f64>::new(&held.a, &held.b)),
            }),
            (Model::Nonlinear(copied), single) => {
                let held = self.held(clock)?;
                if single {
                    Box::new(Sampled {
                        law,
                        seer,
                        own,
                        kept: false,
                        model: Model::Nonlinear(Box::new(copied.cast::<f32>(&held))),
                    })
                } else {
                    Box::new(Sampled {
                        law,
                        seer,
                        own,
                        kept: false,
                        model: Model::Nonlinear(Box::new(copied.cast::<f64>(&held))),
                    })
                }
            }
        };
        Some(Firmware { linear, block })
    }

    fn linear(&self) -> LinearLaw {
        self.around(&self.a, &self.b, &self.law.linear(), &self.basis)
    }

    fn linear_at(&self, position: &[f64], clock: Option<Clock>) -> Option<LinearLaw> {
        let law = self.law.linear_at(position, clock)?;
        let (mut kinematics, r) = (self.seer.kinematics.clone(), position.len());
        kinematics.update(position, &vec![0.0; r]);
        let basis = Matrix::from_fn(kinematics.angles.len(), r, |i, j| kinematics.basis[i * r + j]);
        let Model::Nonlinear(copied) = &self.model else {
            let Some(clock) = clock else { return Some(self.around(&self.a, &self.b, &law, &basis)) };
            let held = discretise(&self.a, &self.b, clock.period)?;
            return Some(self.around(&held.a, &held.b, &law, &basis));
        };
        let read = |reading: &Reading| reading.read(&kinematics.angles, &kinematics.speeds);
        let readings: Vec<f64> = self.seer.readings.iter().map(read).collect();
        let [a, b] = copied.slopes(position, &readings);
        let Some(clock) = clock else { return Some(self.around(&a, &b, &law, &basis)) };
        // x̂⁺ = x̂ + Γ x̂′
        let held = self.held(clock)?;
        let next = Matrix::identity(a.rows()).plus(&held.multiply(&a));
        Some(self.around(&next, &held.multiply(&b), &law, &basis))
    }

    fn bends(&self) -> bool {
        matches!(self.model, Model::Nonlinear(_)) || self.law.bends()
    }

    fn friction_width(&self) -> Option<f64> {
        self.law.friction_width()
    }

    fn on_full_model(&self) -> bool {
        self.law.on_full_model()
    }

    fn exact(&self) -> Option<ExactLoop> {
        self.law.exact()
    }

    fn describe(&self) -> Design {
        let mut design = self.law.describe();
        design.observer = Some(self.result.clone());
        design.observer_data = Some(self.data.clone());
        if matches!(self.model, Model::Nonlinear(_)) {
            design.notes.push(
                "the observer runs the full nonlinear model, with the gain for zero angles; the poles of its error are those there"
                    .into(),
            );
        }
        design.notes.push(
            "what is proven of the loop holds for the true state; while the observer's error dies out, the outputs feel it".into(),
        );
        design
    }
}
