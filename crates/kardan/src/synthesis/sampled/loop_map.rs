//! The linear loop of a plant in continuous time and controllers that are sampled, over one period, exactly.

use super::{Clock, on_their_way};
use crate::num::{Matrix, eigenvalues, exponential};
use crate::reduce::LinearModel;
use crate::synthesis::{Law, LinearLaw};

/// Parts of the shortest sample time within which two instants are one.
const SAME: f64 = 1e-9;
/// Samples within the period after which all clocks begin anew.
const MOST_SAMPLES: usize = 4000;

/// A law in a sampled loop.
pub struct SampledPart {
    /// Its linear part: of [`Firmware`](super::Firmware) if it has a clock.
    pub linear: LinearLaw,
    /// When it runs; `None`: in continuous time.
    pub clock: Option<Clock>,
    /// Numbers of the inputs that it commands, among those of the model.
    pub inputs: Vec<usize>,
    /// Factor of its commands, 1 for the loop as it is.
    pub gain: f64,
}

impl SampledPart {
    /// A law as it runs, in the loop of that model.
    ///
    /// # Panics
    /// If it names an input that is not there.
    pub fn of(law: &dyn Law, model: &LinearModel) -> Self {
        let number =
            |name: &String| model.inputs.iter().position(|input| input == name).expect("a law commands inputs");
        Self { linear: law.linear(), clock: law.clock(), inputs: law.inputs().iter().map(number).collect(), gain: 1.0 }
    }
}

/// The exact map of a linear loop over the period after which all clocks begin anew, without limits, friction and rounding:
/// `z(t + T) = Φ z(t)`.
///
/// `z = [q_r; q̇_r; torques of motors with a lag; states of the laws in continuous time; for each sampled law the commands in
/// force, those on their way, its states]`.
#[derive(Debug, Clone, PartialEq)]
pub struct SampledLoop {
    /// Φ.
    pub map: Matrix<f64>,
    /// T, s.
    pub period: f64,
    /// The shortest sample time, s.
    pub sample_time: f64,
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
}

impl SampledLoop {
    /// The map of a loop. `lags` are the time constants of the motors, s, zero for none, one for each input of the model.
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
    pub fn new(model: &LinearModel, lags: &[f64], parts: &[SampledPart]) -> Result<Self, SampledLoopError> {
        let clocks: Vec<Clock> = parts.iter().filter_map(|part| part.clock).collect();
        let shortest = clocks.iter().map(|clock| clock.period).fold(f64::INFINITY, f64::min);
        if clocks.is_empty() {
            return Err(SampledLoopError::Continuous);
        }
        let period = common_period(&clocks, shortest).ok_or(SampledLoopError::NoCommonPeriod)?;
        let places = Places::new(model, lags, parts);
        let flow = places.flow(model, lags, parts);
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
                    let found = exponential(&flow.scale(&step)).ok_or(SampledLoopError::NotFinite)?;
                    known.push((step, found.clone()));
                    found
                }
            };
            Ok(exponential.multiply(&map))
        };
        for (at, number, computes) in happenings {
            map = pass(at, map)?;
            let jump = if computes { places.sample(model, parts, number) } else { places.apply(parts, number) };
            map = jump.multiply(&map);
        }
        map = pass(period, map)?;
        let finite = map.as_slice().iter().all(|x| x.is_finite());
        if finite { Ok(Self { map, period, sample_time: shortest }) } else { Err(SampledLoopError::NotFinite) }
    }

    /// The matrix of the loop between two instants, `ż = F z`; without sampled laws that of the whole loop.
    ///
    /// # Panics
    /// As [`Self::new`].
    pub fn flow(model: &LinearModel, lags: &[f64], parts: &[SampledPart]) -> Matrix<f64> {
        Places::new(model, lags, parts).flow(model, lags, parts)
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

    /// Spectral radius per shortest sample time; below one the loop is stable.
    pub fn spectral_radius(&self) -> Option<f64> {
        let found = self.multipliers()?;
        Some(found.first().map_or(0.0, |(re, im)| re.hypot(*im)))
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
    fn new(model: &LinearModel, lags: &[f64], parts: &[SampledPart]) -> Self {
        assert_eq!(lags.len(), model.inputs.len(), "one lag for each input");
        let mut size = 2 * model.inertia.rows();
        let mut take = |count: usize| {
            size += count;
            size - count
        };
        let lagged = lags.iter().map(|lag| (*lag > 0.0).then(|| take(1))).collect();
        let laws = parts
            .iter()
            .map(|part| {
                let inputs = part.inputs.len();
                let waiting = part.clock.map_or(0, on_their_way);
                LawPlaces {
                    held: take(if part.clock.is_some() { inputs } else { 0 }),
                    queue: (0..waiting).map(|_| take(inputs)).collect(),
                    states: take(part.linear.states.rows()),
                }
            })
            .collect();
        Self { lagged, laws, size }
    }

    /// The command of a law over z: what it says now, whether sampled or not.
    fn command(&self, model: &LinearModel, part: &SampledPart, number: usize) -> Matrix<f64> {
        let r = model.inertia.rows();
        let basis = model.basis.to_f64();
        let (on_angles, on_speeds) = (part.linear.on_angles.multiply(&basis), part.linear.on_speeds.multiply(&basis));
        let first = self.laws[number].states;
        let states = part.linear.states.rows();
        Matrix::from_fn(part.inputs.len(), self.size, |i, j| {
            part.gain
                * match j {
                    j if j < r => on_angles[(i, j)],
                    j if j < 2 * r => on_speeds[(i, j - r)],
                    j if (first..first + states).contains(&j) => part.linear.on_states[(i, j - first)],
                    _ => 0.0,
                }
        })
    }

    /// What goes into the rates (or the next values) of a law's states, over z, with these torques of its inputs.
    fn rates(&self, model: &LinearModel, part: &SampledPart, number: usize, torques: &Matrix<f64>) -> Matrix<f64> {
        let r = model.inertia.rows();
        let basis = model.basis.to_f64();
        let (angles, speeds) = (part.linear.angles.multiply(&basis), part.linear.speeds.multiply(&basis));
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
        }
        out
    }

    /// The matrix of the loop between two instants: ż = F z.
    fn flow(&self, model: &LinearModel, lags: &[f64], parts: &[SampledPart]) -> Matrix<f64> {
        let r = model.inertia.rows();
        let inertia = model.inertia.to_f64();
        let solve = |matrix: &Matrix<f64>| inertia.solve(matrix).expect("reduced inertia is positive definite");
        let (stiffness, damping) = (solve(&model.stiffness.to_f64()), solve(&model.damping.to_f64()));
        let per_torque = solve(&model.input.to_f64());
        let mut flow = Matrix::zeros(self.size, self.size);
        for i in 0..r {
            flow[(i, r + i)] = 1.0;
            for j in 0..r {
                flow[(r + i, j)] = -stiffness[(i, j)];
                flow[(r + i, r + j)] = -damping[(i, j)];
            }
        }
        // Commands of all inputs over z.
        let mut commands = Matrix::zeros(model.inputs.len(), self.size);
        for (number, part) in parts.iter().enumerate() {
            let own = self.command(model, part, number);
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
                        flow[(*place, j)] += (commands[(input, j)] - own) / lags[input];
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
            let rates = self.rates(model, part, number, &torques);
            let first = self.laws[number].states;
            for i in 0..rates.rows() {
                for j in 0..self.size {
                    flow[(first + i, j)] += rates[(i, j)];
                }
            }
        }
        flow
    }

    /// A law computes: its commands go on their way, its states become those of the next sample.
    fn sample(&self, model: &LinearModel, parts: &[SampledPart], number: usize) -> Matrix<f64> {
        let part = &parts[number];
        let Some(clock) = part.clock else { unreachable!("only sampled laws compute at an instant") };
        let LawPlaces { held, queue, states } = &self.laws[number];
        let m = part.inputs.len();
        let command = self.command(model, part, number);
        // The torques until the next sample: in force now, then those on their way, one after the other.
        let row = |place: usize| Matrix::from_fn(m, self.size, |i, j| f64::from(u8::from(j == place + i)));
        // Part of the sample time after which the next command on its way takes effect.
        let part_of_sample =
            if queue.is_empty() { 0.0 } else { clock.delay / clock.period - (on_their_way(clock) as f64 - 1.0) };
        let torques = match queue.len() {
            0 => command.clone(),
            // After the shift below the first on its way is the oldest one.
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
        set(*states, &self.rates(model, part, number, &torques));
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
