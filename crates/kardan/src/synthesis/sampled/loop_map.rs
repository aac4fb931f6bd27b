//! The linear loop of a plant in continuous time and controllers that are sampled, over one period, exactly.

use super::{Clock, LoopPlant, on_their_way};
use crate::num::{Matrix, discretise, eigenvalues};
use crate::synthesis::{Law, LinearLaw};

/// Parts of the shortest sample time within which two instants are one.
const SAME: f64 = 1e-9;
/// Doublings of the time over which errors of readings add up: 4096 periods.
const DOUBLINGS: usize = 12;
/// Samples within the period after which all clocks begin anew.
const MOST_SAMPLES: usize = 4000;

/// A law in a sampled loop.
pub struct SampledPart {
    /// Its linear part: of [`Firmware`](super::Firmware) if it has a clock.
    pub linear: LinearLaw,
    /// When it runs; `None`: in continuous time.
    pub clock: Option<Clock>,
    /// Numbers of the inputs that it commands, among those of the plant.
    pub inputs: Vec<usize>,
    /// Factor of its commands, 1 for the loop as it is.
    pub gain: f64,
}

impl SampledPart {
    /// A law as it runs, in the loop of that plant.
    ///
    /// # Panics
    /// If it names an input that is not there.
    pub fn of(law: &dyn Law, plant: &LoopPlant) -> Self {
        let number =
            |name: &String| plant.inputs.iter().position(|input| input == name).expect("a law commands inputs");
        Self { linear: law.linear(), clock: law.clock(), inputs: law.inputs().iter().map(number).collect(), gain: 1.0 }
    }
}

/// The exact map of a linear loop over the period after which all clocks begin anew, without limits, friction and rounding:
/// `z(t + T) = Φ z(t)`.
///
/// `z = [q_r; q̇_r; torques of motors with a lag; for each law the commands in force and those on their way, if it has a
/// clock, and its states; if they are asked for, its references and the errors of its readings]`.
#[derive(Debug, Clone, PartialEq)]
pub struct SampledLoop {
    /// Φ.
    pub map: Matrix<f64>,
    /// T, s.
    pub period: f64,
    /// The shortest sample time, s.
    pub sample_time: f64,
    /// The loop between two instants, `ż = F z`.
    pub flow: Matrix<f64>,
    /// What each input of the plant is told, over z, N m.
    pub commands: Matrix<f64>,
    /// Where the references of each law are in z, if they were asked for.
    pub references: Vec<usize>,
    /// Where the errors of the readings of each law are in z, if they were asked for.
    pub errors: Vec<usize>,
}

/// Why there is no map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SampledLoopError {
    /// No law has a clock.
    #[error("no controller is sampled")]
    Continuous,
    /// The sample times have no short common period.
    #[error("the sample times of the controllers have no common period within {MOST_SAMPLES} samples")]
    NoCommonPeriod,
    /// A number overflows.
    #[error("a number of the sampled loop is not finite")]
    NotFinite,
}

/// Where the parts of z are.
struct Places {
    /// Torque of each motor with a lag.
    lagged: Vec<Option<usize>>,
    laws: Vec<LawPlaces>,
    size: usize,
}

struct LawPlaces {
    /// Commands in force; of a law in continuous time nowhere.
    held: usize,
    /// Commands on their way, the next first.
    queue: Vec<usize>,
    states: usize,
    /// Where its references are; `None` if they are left out.
    references: Option<usize>,
    /// Where the errors of its readings are; `None` if they are left out.
    errors: Option<usize>,
}

impl SampledLoop {
    /// The map of a loop.
    ///
    /// Method: between two instants at which something happens the loop is linear with constant coefficients, whose
    /// exponential is exact; what happens (a law computes, a command takes effect) is a matrix. Cost: one exponential for each
    /// different interval.
    ///
    /// # Errors
    /// [`SampledLoopError`]
    ///
    /// # Panics
    /// If the inertia matrix is singular, or shapes do not fit.
    pub fn new(plant: &LoopPlant, parts: &[SampledPart]) -> Result<Self, SampledLoopError> {
        Self::with(plant, parts, None)
    }

    /// The same with the references of all laws, and the errors of their readings, as constant states, for answers to steps; a loop without sampled laws is looked
    /// at every `otherwise` seconds.
    ///
    /// # Errors
    /// [`SampledLoopError`]
    ///
    /// # Panics
    /// As [`Self::new`].
    pub fn driven(plant: &LoopPlant, parts: &[SampledPart], otherwise: f64) -> Result<Self, SampledLoopError> {
        Self::with(plant, parts, Some(otherwise))
    }

    fn with(plant: &LoopPlant, parts: &[SampledPart], driven: Option<f64>) -> Result<Self, SampledLoopError> {
        let clocks: Vec<Clock> = parts.iter().filter_map(|part| part.clock).collect();
        let (shortest, period) = if clocks.is_empty() {
            let looked = driven.ok_or(SampledLoopError::Continuous)?;
            (looked, looked)
        } else {
            let shortest = clocks.iter().map(|clock| clock.period).fold(f64::INFINITY, f64::min);
            (shortest, common_period(&clocks, shortest).ok_or(SampledLoopError::NoCommonPeriod)?)
        };
        let places = Places::new(plant, parts, driven.is_some());
        let (flow, commands) = places.flow(plant, parts);
        let moving = Moving::of(&flow);
        // In the steady state: commands of the period before are on their way.
        let mut happenings: Vec<(f64, usize, bool)> = Vec::new();
        for (number, part) in parts.iter().enumerate() {
            let Some(clock) = part.clock else { continue };
            let samples = (period / clock.period).round() as usize;
            for k in 0..samples {
                let at = k as f64 * clock.period;
                happenings.push((at, number, true));
                if clock.delay > 0.0 {
                    let applied = (at + clock.delay) % period;
                    let same = (period - applied).min(applied) < SAME * shortest;
                    happenings.push((if same { 0.0 } else { applied }, number, false));
                }
            }
        }
        // At one instant commands take effect before the laws compute.
        happenings.sort_by(|a, b| {
            let near = (a.0 - b.0).abs() < SAME * shortest;
            if near { (a.2, a.1).cmp(&(b.2, b.1)) } else { a.0.total_cmp(&b.0) }
        });
        let mut map = Matrix::identity(places.size);
        let mut known: Vec<(f64, Matrix<f64>)> = Vec::new();
        let mut time = 0.0;
        let mut pass = |until: f64, map: Matrix<f64>| -> Result<Matrix<f64>, SampledLoopError> {
            let step = until - time;
            if step < SAME * shortest {
                return Ok(map);
            }
            time = until;
            let found = known.iter().find(|(other, _)| (other - step).abs() < SAME * shortest);
            let exponential = match found {
                Some((_, exponential)) => exponential.clone(),
                None => {
                    let found = moving.exponential(&flow, step).ok_or(SampledLoopError::NotFinite)?;
                    known.push((step, found.clone()));
                    found
                }
            };
            Ok(exponential.multiply(&map))
        };
        for (at, number, computes) in happenings {
            map = pass(at, map)?;
            let jump = if computes { places.sample(plant, parts, number) } else { places.apply(parts, number) };
            map = jump.multiply(&map);
        }
        map = pass(period, map)?;
        let finite = map.as_slice().iter().all(|x| x.is_finite());
        let references = places.laws.iter().map(|law| law.references.unwrap_or(places.size)).collect();
        let errors = places.laws.iter().map(|law| law.errors.unwrap_or(places.size)).collect();
        if finite {
            Ok(Self { map, period, sample_time: shortest, flow, commands, references, errors })
        } else {
            Err(SampledLoopError::NotFinite)
        }
    }

    /// The matrix of the loop between two instants, `ż = F z`; without sampled laws that of the whole loop.
    ///
    /// # Panics
    /// As [`Self::new`].
    pub fn flow_of(plant: &LoopPlant, parts: &[SampledPart]) -> Matrix<f64> {
        Places::new(plant, parts, false).flow(plant, parts).0
    }

    /// Eigenvalues of the map, as growth per shortest sample time, largest first; `None` if the iteration fails.
    pub fn multipliers(&self) -> Option<Vec<(f64, f64)>> {
        let mut found = eigenvalues(&self.map)?;
        let part = self.sample_time / self.period;
        if (part - 1.0).abs() > SAME {
            for (re, im) in &mut found {
                let (size, angle) = (re.hypot(*im).powf(part), im.atan2(*re) * part);
                (*re, *im) = (size * angle.cos(), size * angle.sin());
            }
        }
        found.sort_by(|a, b| b.0.hypot(b.1).total_cmp(&a.0.hypot(a.1)));
        Some(found)
    }

    /// Covariance of z at the samples, long after all began at rest, if each reading of a law has an error that is new in each
    /// period, with these variances. What drifts (a wheel that nobody holds) is taken after some thousand periods.
    ///
    /// # Panics
    /// If the loop has no places for errors, or there is not one variance for each of the law's sensors.
    pub fn covariance(&self, law: usize, variances: &[f64]) -> Matrix<f64> {
        let n = self.map.rows();
        let first = self.errors[law];
        assert!(first + variances.len() <= n, "variances of readings that the loop does not have");
        // Constant states are no part of it.
        let constant = |k: usize| {
            let row = self.map.row(k);
            row[k] == 1.0 && row.iter().filter(|x| **x != 0.0).count() == 1
        };
        let still: Vec<bool> = (0..n).map(constant).collect();
        let mut power = Matrix::from_fn(n, n, |i, j| if still[i] || still[j] { 0.0 } else { self.map[(i, j)] });
        let input = Matrix::from_fn(n, variances.len(), |i, j| if still[i] { 0.0 } else { self.map[(i, first + j)] });
        let weighted = Matrix::from_fn(n, variances.len(), |i, j| input[(i, j)] * variances[j]);
        let mut sum = weighted.multiply(&input.transpose());
        for _ in 0..DOUBLINGS {
            sum = sum.plus(&power.multiply(&sum).multiply(&power.transpose()));
            power = power.multiply(&power);
        }
        sum
    }

    /// Spectral radius per shortest sample time; below one the loop is stable.
    pub fn spectral_radius(&self) -> Option<f64> {
        let found = self.multipliers()?;
        Some(found.first().map_or(0.0, |(re, im)| re.hypot(*im)))
    }
}

/// Which entries of z move between two instants, and which constant ones drive them.
struct Moving {
    moving: Vec<usize>,
    driving: Vec<usize>,
}

impl Moving {
    fn of(flow: &Matrix<f64>) -> Self {
        let n = flow.rows();
        let (moving, still): (Vec<usize>, Vec<usize>) = (0..n).partition(|&i| flow.row(i).iter().any(|x| *x != 0.0));
        let driving = still.into_iter().filter(|&j| moving.iter().any(|&i| flow[(i, j)] != 0.0)).collect();
        Self { moving, driving }
    }

    /// `e^{Ft}`; `None` if it overflows.
    fn exponential(&self, flow: &Matrix<f64>, time: f64) -> Option<Matrix<f64>> {
        let Self { moving, driving } = self;
        let part =
            |columns: &[usize]| Matrix::from_fn(moving.len(), columns.len(), |i, j| flow[(moving[i], columns[j])]);
        let found = discretise(&part(moving), &part(driving), time)?;
        let mut out = Matrix::identity(flow.rows());
        for (i, &row) in moving.iter().enumerate() {
            moving.iter().enumerate().for_each(|(j, &column)| out[(row, column)] = found.a[(i, j)]);
            driving.iter().enumerate().for_each(|(j, &column)| out[(row, column)] = found.b[(i, j)]);
        }
        Some(out)
    }
}

/// The period after which all clocks begin anew, s.
fn common_period(clocks: &[Clock], shortest: f64) -> Option<f64> {
    let longest = clocks.iter().map(|clock| clock.period).fold(0.0, f64::max);
    let fits = |period: &f64| {
        clocks.iter().all(|clock| {
            let samples = period / clock.period;
            (samples - samples.round()).abs() * clock.period < SAME * shortest
        })
    };
    let most = MOST_SAMPLES as f64 * shortest;
    (1..=MOST_SAMPLES).map(|k| k as f64 * longest).take_while(|period| *period <= most).find(fits)
}

impl Places {
    fn new(plant: &LoopPlant, parts: &[SampledPart], driven: bool) -> Self {
        assert_eq!(plant.lags.len(), plant.inputs.len(), "one lag for each input");
        let mut size = 2 * plant.inertia.rows();
        let mut take = |count: usize| {
            size += count;
            size - count
        };
        let lagged = plant.lags.iter().map(|lag| (*lag > 0.0).then(|| take(1))).collect();
        let laws = parts
            .iter()
            .map(|part| {
                let inputs = part.inputs.len();
                let waiting = part.clock.map_or(0, on_their_way);
                LawPlaces {
                    held: take(if part.clock.is_some() { inputs } else { 0 }),
                    queue: (0..waiting).map(|_| take(inputs)).collect(),
                    states: take(part.linear.states.rows()),
                    references: driven.then(|| take(part.linear.on_references.columns())),
                    errors: driven.then(|| take(part.linear.on_errors.columns())),
                }
            })
            .collect();
        Self { lagged, laws, size }
    }

    /// The command of a law over z: what it says now, whether sampled or not.
    fn command(&self, plant: &LoopPlant, part: &SampledPart, number: usize) -> Matrix<f64> {
        let r = plant.inertia.rows();
        let (on_angles, on_speeds) =
            (part.linear.on_angles.multiply(&plant.basis), part.linear.on_speeds.multiply(&plant.basis));
        let first = self.laws[number].states;
        let states = part.linear.states.rows();
        let told = |i: usize, j: usize| {
            let reference = self.reference(part, number, j).map(|k| part.linear.on_references[(i, k)]);
            reference.or_else(|| self.error(part, number, j).map(|k| part.linear.on_errors[(i, k)]))
        };
        Matrix::from_fn(part.inputs.len(), self.size, |i, j| {
            part.gain
                * match j {
                    j if j < r => on_angles[(i, j)],
                    j if j < 2 * r => on_speeds[(i, j - r)],
                    j if (first..first + states).contains(&j) => part.linear.on_states[(i, j - first)],
                    j => told(i, j).unwrap_or(0.0),
                }
        })
    }

    /// What goes into the rates (or the next values) of a law's states, over z, with these torques of its inputs.
    fn rates(&self, plant: &LoopPlant, part: &SampledPart, number: usize, torques: &Matrix<f64>) -> Matrix<f64> {
        let r = plant.inertia.rows();
        let (angles, speeds) = (part.linear.angles.multiply(&plant.basis), part.linear.speeds.multiply(&plant.basis));
        let mut out = part.linear.torques.multiply(torques);
        let first = self.laws[number].states;
        for i in 0..out.rows() {
            for j in 0..r {
                out[(i, j)] += angles[(i, j)];
                out[(i, r + j)] += speeds[(i, j)];
            }
            for j in 0..part.linear.states.rows() {
                out[(i, first + j)] += part.linear.states[(i, j)];
            }
            for j in 0..self.size {
                if let Some(k) = self.reference(part, number, j) {
                    out[(i, j)] += part.linear.references[(i, k)];
                }
                if let Some(k) = self.error(part, number, j) {
                    out[(i, j)] += part.linear.errors[(i, k)];
                }
            }
        }
        out
    }

    /// Which reference of a law is at a place.
    fn reference(&self, part: &SampledPart, number: usize, place: usize) -> Option<usize> {
        let first = self.laws[number].references?;
        place.checked_sub(first).filter(|k| *k < part.linear.on_references.columns())
    }

    /// Which reading's error of a law is at a place.
    fn error(&self, part: &SampledPart, number: usize, place: usize) -> Option<usize> {
        let first = self.laws[number].errors?;
        place.checked_sub(first).filter(|k| *k < part.linear.on_errors.columns())
    }

    /// The matrix of the loop between two instants, ż = F z, and what each input is told.
    fn flow(&self, plant: &LoopPlant, parts: &[SampledPart]) -> (Matrix<f64>, Matrix<f64>) {
        let r = plant.inertia.rows();
        let solve = |matrix: &Matrix<f64>| plant.inertia.solve(matrix).expect("reduced inertia is positive definite");
        let (stiffness, damping) = (solve(&plant.stiffness), solve(&plant.damping));
        let per_torque = solve(&plant.input);
        let mut flow = Matrix::zeros(self.size, self.size);
        for i in 0..r {
            flow[(i, r + i)] = 1.0;
            for j in 0..r {
                flow[(r + i, j)] = -stiffness[(i, j)];
                flow[(r + i, r + j)] = -damping[(i, j)];
            }
        }
        // Commands of all inputs over z.
        let mut commands = Matrix::zeros(plant.inputs.len(), self.size);
        for (number, part) in parts.iter().enumerate() {
            let own = self.command(plant, part, number);
            for (i, &input) in part.inputs.iter().enumerate() {
                match part.clock {
                    Some(_) => commands[(input, self.laws[number].held + i)] += 1.0,
                    None => (0..self.size).for_each(|j| commands[(input, j)] += own[(i, j)]),
                }
            }
        }
        for (input, place) in self.lagged.iter().enumerate() {
            for j in 0..self.size {
                match place {
                    Some(place) => {
                        let own = f64::from(u8::from(j == *place));
                        flow[(*place, j)] += (commands[(input, j)] - own) / plant.lags[input];
                        (0..r).for_each(|i| flow[(r + i, j)] += per_torque[(i, input)] * own);
                    }
                    None => (0..r).for_each(|i| flow[(r + i, j)] += per_torque[(i, input)] * commands[(input, j)]),
                }
            }
        }
        for (number, part) in parts.iter().enumerate().filter(|(_, part)| part.clock.is_none()) {
            let torque = |i: usize, j: usize| match self.lagged[part.inputs[i]] {
                Some(place) => f64::from(u8::from(j == place)),
                None => commands[(part.inputs[i], j)],
            };
            let torques = Matrix::from_fn(part.inputs.len(), self.size, torque);
            let rates = self.rates(plant, part, number, &torques);
            let first = self.laws[number].states;
            for i in 0..rates.rows() {
                for j in 0..self.size {
                    flow[(first + i, j)] += rates[(i, j)];
                }
            }
        }
        (flow, commands)
    }

    /// A law computes: its commands go on their way, its states become those of the next sample.
    fn sample(&self, plant: &LoopPlant, parts: &[SampledPart], number: usize) -> Matrix<f64> {
        let part = &parts[number];
        let Some(clock) = part.clock else { unreachable!("only sampled laws compute at an instant") };
        let LawPlaces { held, queue, states, .. } = &self.laws[number];
        let m = part.inputs.len();
        let command = self.command(plant, part, number);
        // The torques until the next sample: in force now, then those on their way, one after the other.
        let row = |place: usize| Matrix::from_fn(m, self.size, |i, j| f64::from(u8::from(j == place + i)));
        // Part of the sample time after which the next command on its way takes effect.
        let part_of_sample =
            if queue.is_empty() { 0.0 } else { clock.delay / clock.period - (on_their_way(clock) as f64 - 1.0) };
        let torques = match queue.len() {
            0 => command.clone(),
            _ => {
                let before = row(*held).scale(&part_of_sample);
                let after = if queue.len() == 1 { command.clone() } else { row(queue[0]) };
                before.plus(&after.scale(&(1.0 - part_of_sample)))
            }
        };
        let mut out = Matrix::identity(self.size);
        let mut set = |place: usize, rows: &Matrix<f64>| {
            for i in 0..rows.rows() {
                for j in 0..self.size {
                    out[(place + i, j)] = rows[(i, j)];
                }
            }
        };
        set(*states, &self.rates(plant, part, number, &torques));
        match queue.last() {
            None => set(*held, &command),
            // The last place is free: the command that was in it has moved on when the one before took effect.
            Some(last) => set(*last, &command),
        }
        out
    }

    /// The next command on its way takes effect, those behind it move up.
    fn apply(&self, parts: &[SampledPart], number: usize) -> Matrix<f64> {
        let LawPlaces { held, queue, .. } = &self.laws[number];
        let m = parts[number].inputs.len();
        let mut out = Matrix::identity(self.size);
        let chain: Vec<usize> = std::iter::once(*held).chain(queue.iter().copied()).collect();
        for pair in chain.windows(2) {
            for i in 0..m {
                out[(pair[0] + i, pair[0] + i)] = 0.0;
                out[(pair[0] + i, pair[1] + i)] = 1.0;
            }
        }
        out
    }
}
