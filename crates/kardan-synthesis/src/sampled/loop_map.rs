//! The linear loop of a plant in continuous time and controllers that are sampled, over one period, exactly.

use std::f64::consts::TAU;

use faer::c64;
use kardan_rt::functions::{atan2, cos, exp, hypot, ln_1p, powf, sin};

use super::event_sequence::{EventSequence, LoopEvent, Periods, SAME, SampledLoopError, map_from};
use super::jump::Jump;
use super::places::Places;
use super::{LoopPlant, SampledPart};
use crate::matrix_parts::is_finite;
use kardan_math::num::{AtZero, Matrix, Rounding, at_zero, balance, discretise, eigenvalues, isolated, selected};
use kardan_results::Stability;

/// Doublings of the time over which errors of readings add up: 4096 periods.
const DOUBLINGS: usize = 12;
/// Relative distance to an eigenvalue at which its vector is computed.
const BESIDE: f64 = 1e-9;
/// Distances to the limit of stability below which the error of an eigenvalue is bounded by its condition.
const CLOSE: f64 = 1e-4;
/// Size of numbers from which on terms may cancel to a small part of them, whose rounding moves eigenvalues farther than that.
const CANCELS: f64 = 1e8;
/// Size of the eigenvalues of a change `Φ − 1` below which they may be at zero: a chain of two is spread by rounding to less.
const NEAR_ZERO: f64 = 1e-6;
/// The accuracy of the largest entries of a loop, in roundings times its size.
const ROUNDINGS: f64 = 8.0;

/// The exact map of a linear loop over the common period of all clocks, without limits, friction and rounding:
/// `z(t + T) = Φ z(t)`.
///
/// `z = [q_r; q̇_r; torques of motors with a lag; for each law the commands in force and those in transit, if it has a clock,
/// its states, and the readings of sensors with a sample time of their own; if requested, references and the errors
/// of readings]`.
#[derive(Debug, Clone, PartialEq)]
pub struct SampledLoop {
    /// Φ.
    pub map: Matrix<f64>,
    /// T, s.
    pub period: f64,
    /// The shortest sample time of a law, s.
    pub sample_time: f64,
    /// The loop between two instants, `ż = F z`.
    pub flow: Matrix<f64>,
    /// The command of each input of the plant, over z, N m.
    pub commands: Matrix<f64>,
    /// Where the references of each law are in z, if requested.
    pub references: Vec<usize>,
    /// Where the errors of the readings of each law are in z, if requested.
    pub errors: Vec<usize>,
    /// Where the torques are in z that the motors of each law give in addition to their commands, if requested.
    pub(super) excess: Vec<usize>,
    /// Where the commands of each law are that are in force.
    pub(super) in_force: Vec<usize>,
    /// After which happening new commands of each law are in force; `None` if that is more than once in a period.
    applied: Vec<Option<usize>>,
    /// Reduced coordinates, which are first in z.
    degrees_of_freedom: usize,
    /// Where constants begin in z: references and errors.
    pub(super) constants: usize,
    jumps: Vec<Jump<f64>>,
    event_sequence: Vec<LoopEvent>,
    /// The number of events at the first instant.
    at_first: usize,
}

/// The motion of a loop that grows most, or decays least.
#[derive(Debug, Clone, PartialEq)]
pub struct Slowest {
    /// Growth per shortest sample time; of a loop in continuous time per second, e^σ. Zero if every motion is free.
    pub growth: f64,
    /// rad/s
    pub frequency: f64,
    /// Whether no motion grows, to the rounding of the loop: the criterion of searches for a limit.
    pub stable: bool,
    /// Whether it is stable but for the motions left out; not decided where a motion is as near to the border as rounding may be off.
    pub word: Stability,
    /// The number of uncontrolled rigid-body modes, exactly at zero (at one of a map) to the rounding of the loop, which are left out: constant angles, and speeds
    /// that are constant.
    pub free: usize,
    /// How many motions are left out: those, and more if requested.
    pub excluded: usize,
    /// The largest growth rate among them, 1/s; 0 for those that are exactly at zero.
    pub drift: f64,
    /// The size below which numbers counted as zero, 1/s.
    pub rounding: f64,
    /// Whether numbers of its map are so large that terms may cancel to a small part.
    pub large_terms: bool,
}

impl Slowest {
    /// Of the loop of a plant without at least so many motions, those that change least; `None` if it cannot be computed.
    pub fn of(plant: &LoopPlant, parts: &[SampledPart], excluded: usize) -> Option<Self> {
        if parts.iter().all(|part| part.clock.is_none()) {
            return Self::continuous(plant, parts, (excluded, true));
        }
        SampledLoop::new(plant, parts).ok()?.slowest_excluding(excluded)
    }

    /// Of a loop in continuous time `ż = F z`; `excluded`: at least so many motions, those next to zero; `judged`: with its word, which takes time.
    pub(super) fn continuous(
        plant: &LoopPlant,
        parts: &[SampledPart],
        (excluded, judged): (usize, bool),
    ) -> Option<Self> {
        let sizes = Places::sizes(plant, parts);
        let found = NonzeroSpectrum::of(
            &SampledLoop::flow_of(plant, parts),
            sizes.as_ref().map_or(Rounding::OfLargest, Rounding::OfEach),
            excluded,
        )?;
        let (re, im) =
            found.nonzero.iter().copied().max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((f64::NEG_INFINITY, 0.0));
        let stable = re < 0.0 || re <= found.error((re, im), 0.0);
        let word = if judged { found.word(0.0, |(re, _)| re) } else { Stability::Undecided };
        let drift = found.dropped.iter().map(|(re, _)| *re).fold(0.0, f64::max);
        let (free, excluded, rounding) = (found.zeros, found.excluded(), found.rounding);
        Some(Self {
            growth: exp(re),
            frequency: im.abs(),
            stable,
            word,
            free,
            excluded,
            drift,
            rounding,
            large_terms: false,
        })
    }
}

/// Eigenvalues of a matrix without those at zero.
struct NonzeroSpectrum {
    /// How many are at zero.
    zeros: usize,
    nonzero: Vec<(f64, f64)>,
    /// Those that are left out in addition to the ones at zero.
    dropped: Vec<(f64, f64)>,
    /// Entries on the diagonal of isolated states.
    isolated: Vec<f64>,
    /// The matrix on the others, without the motions at zero.
    rest: Matrix<f64>,
    /// By how much the terms of its entries are larger than these, if they cancel to a small part.
    cancelled: Option<Matrix<f64>>,
    /// To its coordinates, and from them.
    sides: [Matrix<f64>; 2],
    coupled: Vec<usize>,
    /// Below which size numbers counted as zero.
    rounding: f64,
}

impl NonzeroSpectrum {
    fn of(matrix: &Matrix<f64>, rounding: Rounding<'_>, excluded: usize) -> Option<Self> {
        if !is_finite(matrix) {
            return None;
        }
        let [isolated, coupled] = isolated(matrix);
        let rest = selected(matrix, &coupled, &coupled);
        let own = if let Rounding::OfEach(sizes) = rounding {
            Some((sizes, selected(sizes, &coupled, &coupled)))
        } else {
            None
        };
        let split = at_zero(&rest, own.as_ref().map_or(rounding, |(_, own)| Rounding::OfEach(own)))?;
        let diagonal = |k: usize| matrix[(k, k)];
        // Scales of the coordinates leave the diagonal as it is.
        let largest = (0..matrix.rows()).map(|k| diagonal(k).abs()).fold(0.0, f64::max);
        let largest = largest.max(if matches!(rounding, Rounding::OfOne) { 1.0 } else { 0.0 });
        let least = 2.0 * ROUNDINGS * matrix.rows() as f64 * f64::EPSILON * largest;
        let rounding_of =
            |k: usize| own.as_ref().map_or(least, |(sizes, _)| 2.0 * ROUNDINGS * f64::EPSILON * sizes[(k, k)]);
        let (zero, isolated): (Vec<usize>, Vec<usize>) =
            isolated.into_iter().partition(|&k| diagonal(k).abs() <= rounding_of(k));
        let isolated: Vec<f64> = isolated.into_iter().map(diagonal).collect();
        let mut nonzero = eigenvalues(&split.rest)?;
        nonzero.extend(isolated.iter().map(|x| (*x, 0.0)));
        // The next to zero come first.
        nonzero.sort_by(|a, b| size(*a).total_cmp(&size(*b)).then(a.1.total_cmp(&b.1)));
        let zeros = zero.len() + split.motions.columns();
        let more = excluded.saturating_sub(zeros).min(nonzero.len());
        let dropped = nonzero.drain(..more).collect();
        let (sides, rounding) = ([split.left, split.right], split.rounding.max(least));
        Some(Self { zeros, nonzero, dropped, isolated, rest: split.rest, cancelled: None, sides, coupled, rounding })
    }

    /// With how much larger than the entries of the whole matrix their terms are.
    fn with_cancelled(self, cancelled: &Matrix<f64>) -> Self {
        let [left, right] = self.sides.each_ref().map(crate::sizes);
        let own = left.multiply(&selected(cancelled, &self.coupled, &self.coupled)).multiply(&right);
        Self { cancelled: Some(own), ..self }
    }

    fn excluded(&self) -> usize {
        self.zeros + self.dropped.len()
    }

    /// Whether all controlled motions are inside the border, by the distance of each eigenvalue from it.
    fn word(&self, added: f64, beyond: impl Fn((f64, f64)) -> f64) -> Stability {
        let size = self.rest.as_slice().iter().fold(0.0f64, |most, x| most.max(x.abs()));
        let near = |value: &&(f64, f64)| self.cancelled.is_some() || beyond(**value) > -CLOSE * size.max(1.0);
        let signs = self.nonzero.iter().filter(near).map(|value| {
            let (beyond, error) = (beyond(*value), self.error(*value, added));
            if beyond.abs() <= error { Stability::Undecided } else { outside(beyond > 0.0) }
        });
        let signs: Vec<Stability> = signs.collect();
        let found = [Stability::Unstable, Stability::Undecided].into_iter().find(|word| signs.contains(word));
        found.unwrap_or(Stability::Stable)
    }

    /// How far rounding may move one of the eigenvalues of the matrix, plus one that is added to it for the diagonal.
    fn error(&self, value: (f64, f64), added: f64) -> f64 {
        if value.1 == 0.0 && self.isolated.contains(&value.0) {
            // It is outside already.
            return 0.0;
        }
        let n = self.rest.rows();
        let shifted = Matrix::from_fn(n, n, |i, j| self.rest[(i, j)] + if i == j { added } else { 0.0 });
        error(&shifted, self.cancelled.as_ref(), (value.0 + added, value.1))
    }
}

fn outside(is_outside: bool) -> Stability {
    if is_outside { Stability::Unstable } else { Stability::Stable }
}

/// How far the rounding of a matrix may move an eigenvalue, to first order: its condition times that of the largest entries, and what that of terms does
/// which are larger than their entries by so much.
fn error(matrix: &Matrix<f64>, cancelled: Option<&Matrix<f64>>, value: (f64, f64)) -> f64 {
    let n = matrix.rows();
    let scales = balance(&faer::Mat::from_fn(n, n, |i, j| matrix[(i, j)]));
    let balanced = Matrix::from_fn(n, n, |i, j| matrix[(i, j)] * scales[j] / scales[i]);
    let own = balanced.as_slice().iter().map(|x| x * x).sum::<f64>().sqrt();
    // Right and left vector by inverse iteration, as real vectors of double length.
    let near = (value.0 * (1.0 + BESIDE), value.1 * (1.0 + BESIDE));
    let shifted = |a: &Matrix<f64>, im: f64| {
        Matrix::from_fn(2 * n, 2 * n, |i, j| {
            let same = f64::from(u8::from(i % n == j % n));
            match (i < n, j < n) {
                (true, false) => im * same,
                (false, true) => -im * same,
                _ => a[(i % n, j % n)] - near.0 * same,
            }
        })
    };
    let start = Matrix::from_fn(2 * n, 1, |i, _| 1.0 + sin(i as f64));
    let vector = |a: &Matrix<f64>, im: f64| {
        let once = shifted(a, im).solve(&start)?;
        let largest = once.as_slice().iter().fold(0.0f64, |max, x| max.max(x.abs()));
        let x = shifted(a, im).solve(&once.scale(&(1.0 / largest)))?;
        let largest = x.as_slice().iter().fold(0.0f64, |max, x| max.max(x.abs()));
        let x = x.scale(&(1.0 / largest));
        is_finite(&x).then_some(x)
    };
    let (right, left) = (vector(&balanced, near.1), vector(&balanced.transpose(), -near.1));
    let (condition, moved) = match (right, left) {
        (Some(x), Some(y)) => {
            let sum = |a: usize, b: usize| (0..n).map(|k| y[(a + k, 0)] * x[(b + k, 0)]).sum::<f64>();
            let inner_product = hypot(sum(0, 0) + sum(n, n), sum(0, n) - sum(n, 0));
            let length = |x: &Matrix<f64>| x.as_slice().iter().map(|x| x * x).sum::<f64>().sqrt();
            let size = |vector: &Matrix<f64>, k: usize| hypot(vector[(k, 0)], vector[(n + k, 0)]);
            let row = |of: &Matrix<f64>, i: usize| {
                let terms = (0..n).map(|j| of[(i, j)] * scales[j] / scales[i] * size(&x, j));
                size(&y, i) * terms.sum::<f64>()
            };
            let moved = cancelled.map_or(0.0, |of| (0..n).map(|i| row(of, i)).sum::<f64>());
            ((length(&x) * length(&y) / inner_product).max(1.0), moved / inner_product)
        }
        _ => (1.0, 0.0),
    };
    ROUNDINGS * f64::EPSILON * (n as f64 * own * condition + moved)
}

impl SampledLoop {
    /// The map of a loop.
    ///
    /// Method: between two instants at which something happens the loop is linear with constant coefficients, whose
    /// exponential is exact; what happens (a law computes, a command takes effect, a sensor reads) changes some rows. Cost: one
    /// exponential for each different interval.
    ///
    /// # Errors
    /// [`SampledLoopError`]
    ///
    /// # Panics
    /// If the inertia matrix is singular, or shapes do not fit.
    pub fn new(plant: &LoopPlant, parts: &[SampledPart]) -> Result<Self, SampledLoopError> {
        Self::with(plant, parts, None)
    }

    /// The same with the references of all laws, and the errors of their readings, as constant states, for step responses;
    /// a loop without sampled laws is evaluated every `otherwise` seconds.
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
        let periods = Periods::of(parts, driven)?;
        let Periods { period, shortest } = periods;
        // Growth is reported per sample of the laws, however often blocks compute.
        let of_laws = parts.iter().filter(|part| !part.is_task()).filter_map(|part| part.clock);
        let of_laws = of_laws.map(|clock| clock.period).fold(f64::INFINITY, f64::min);
        let sample_time = if of_laws.is_finite() { of_laws } else { shortest };
        let places = Places::new(plant, parts, driven.is_some());
        let (flow, commands) = places.flow();
        let moving = Moving::of(&flow);
        let found = EventSequence::over(parts, &periods, &places, |time| moving.exponential(&flow, time))?;
        let map = found.map(places.size);
        let EventSequence { jumps, events: event_sequence, applied, at_first, .. } = found;
        if !is_finite(&map) {
            return Err(SampledLoopError::NotFinite);
        }
        let references: Vec<usize> = places.laws.iter().map(|law| law.references.unwrap_or(places.size)).collect();
        let errors = places.laws.iter().map(|law| law.errors.unwrap_or(places.size)).collect();
        let excess = places.laws.iter().map(|law| law.excess.unwrap_or(places.size)).collect();
        let in_force = places.laws.iter().map(|law| law.in_force).collect();
        let once = |all: Vec<usize>| if let [one] = all[..] { Some(one) } else { None };
        let applied = applied.into_iter().map(once).collect();
        let constants = references.first().copied().unwrap_or(places.size);
        let degrees_of_freedom = plant.inertia.rows();
        Ok(Self {
            map,
            period,
            sample_time,
            flow,
            commands,
            references,
            errors,
            excess,
            in_force,
            applied,
            degrees_of_freedom,
            constants,
            jumps,
            event_sequence,
            at_first: at_first.unwrap_or_default(),
        })
    }

    /// The matrix of the loop between two instants, `ż = F z`; without sampled laws that of the whole loop.
    ///
    /// # Panics
    /// As [`Self::new`].
    pub fn flow_of(plant: &LoopPlant, parts: &[SampledPart]) -> Matrix<f64> {
        Places::new(plant, parts, false).flow().0
    }

    /// The eigenvalues at zero of a loop without sampled laws, to the rounding of the terms of each entry of its matrix.
    pub(super) fn at_zero_of(plant: &LoopPlant, parts: &[SampledPart]) -> Option<AtZero> {
        let flow = Self::flow_of(plant, parts);
        at_zero(&flow, Places::sizes(plant, parts).as_ref().map_or(Rounding::OfLargest, Rounding::OfEach))
    }

    /// Lets one period pass. `observe` receives z at the end of each interval after which a law computes, and at the end.
    pub fn pass(&self, z: &mut [f64], observe: &mut dyn FnMut(&[f64])) {
        let mut memory = Vec::new();
        for event in &self.event_sequence {
            match event {
                LoopEvent::Jump(jump) => self.jumps[*jump].change(z, &mut memory),
                LoopEvent::Observe => observe(z),
                LoopEvent::Fresh(_) | LoopEvent::Launch(_) => {}
            }
        }
    }

    /// The map if the commands are multiplied by a complex number: real and imaginary part, without constants.
    pub(super) fn with_factor(&self, factor: c64) -> [Matrix<f64>; 2] {
        let n = self.map.rows();
        let (mut re, mut im) = (Matrix::identity(n), Matrix::zeros(n, n));
        for event in &self.event_sequence {
            match event {
                LoopEvent::Jump(jump) => {
                    self.jumps[*jump].change_rows(&mut re);
                    self.jumps[*jump].change_rows(&mut im);
                }
                LoopEvent::Launch(place) => {
                    for j in 0..n {
                        let entry = factor * c64::new(re[(*place, j)], im[(*place, j)]);
                        (re[(*place, j)], im[(*place, j)]) = (entry.re, entry.im);
                    }
                }
                LoopEvent::Observe | LoopEvent::Fresh(_) => {}
            }
        }
        [re, im].map(|m| Matrix::from_fn(self.constants, self.constants, |i, j| m[(i, j)]))
    }

    /// The map over some periods, Φᵏ.
    pub fn after(&self, periods: usize) -> Matrix<f64> {
        let mut square = self.map.clone();
        let mut out: Option<Matrix<f64>> = None;
        let mut rest = periods;
        while rest > 0 {
            if rest & 1 == 1 {
                out = Some(out.map_or_else(|| square.clone(), |out| out.multiply(&square)));
            }
            rest >>= 1;
            if rest > 0 {
                square = square.multiply(&square);
            }
        }
        out.unwrap_or_else(|| Matrix::identity(self.map.rows()))
    }

    /// Eigenvalues of the map, as growth per shortest sample time, largest first, without those of constant references and
    /// errors; `None` if the iteration fails.
    pub fn multipliers(&self) -> Option<Vec<(f64, f64)>> {
        let n = self.constants;
        // Nothing acts on constants: Φ is block triangular.
        let mut found = eigenvalues(&Matrix::from_fn(n, n, |i, j| self.map[(i, j)]))?;
        found.sort_by(|a, b| size(*b).total_cmp(&size(*a)));
        found.iter_mut().for_each(|multiplier| *multiplier = power(*multiplier, self.sample_time / self.period));
        Some(found)
    }

    /// The uncontrolled rigid-body modes, columns over z without constants: an eigenvalue at one of the map.
    pub fn free(&self) -> Option<Matrix<f64>> {
        Some(at_zero(&self.change(), Rounding::OfOne)?.motions)
    }

    /// Φ − 1 on all but constants: what stays is an eigenvalue at zero.
    pub(super) fn change(&self) -> Matrix<f64> {
        Matrix::from_fn(self.constants, self.constants, |i, j| self.map[(i, j)] - f64::from(u8::from(i == j)))
    }

    /// The motion that grows most, or decays least, but for uncontrolled rigid-body modes (a wheel that turns freely), which
    /// stay exactly; growth zero if there is no other. `None` if the iteration fails.
    pub fn slowest(&self) -> Option<Slowest> {
        self.slowest_excluding(0)
    }

    /// The same without at least so many motions, those that change least.
    pub fn slowest_excluding(&self, excluded: usize) -> Option<Slowest> {
        self.slowest_of((excluded, true))
    }

    /// The same; the name of the motion takes time and is computed on request only.
    pub(super) fn slowest_of(&self, (excluded, judged): (usize, bool)) -> Option<Slowest> {
        let (change, cancelled) = self.accurate_change();
        let large_terms = cancelled.is_some();
        let found = NonzeroSpectrum::of(&change, Rounding::OfOne, excluded)?;
        let found = if let Some(cancelled) = &cancelled { found.with_cancelled(cancelled) } else { found };
        let per_second = |change: (f64, f64)| 0.5 * ln_1p(growth(change)) / self.period;
        let drift = found.dropped.iter().map(|change| per_second(*change)).fold(0.0, f64::max);
        let (free, excluded, rounding) = (found.zeros, found.excluded(), found.rounding / self.period);
        let Some(change) = found.nonzero.iter().copied().max_by(|a, b| growth(*a).total_cmp(&growth(*b))) else {
            let (stable, word) = (true, Stability::Stable);
            return Some(Slowest {
                growth: 0.0,
                frequency: 0.0,
                stable,
                word,
                free,
                excluded,
                drift,
                rounding,
                large_terms,
            });
        };
        let own = (1.0 + change.0, change.1);
        let beyond = 0.5 * growth(change);
        let stable = match beyond {
            beyond if beyond < 0.0 => true,
            beyond if beyond > CLOSE && found.cancelled.is_none() => false,
            beyond => beyond <= found.error(change, 1.0),
        };
        let frequency = self.turn(own).abs() / self.period;
        let word = if judged { found.word(1.0, |change| 0.5 * growth(change)) } else { Stability::Undecided };
        let growth = self.per_sample(growth(change));
        Some(Slowest { growth, frequency, stable, word, free, excluded, drift, rounding, large_terms })
    }

    /// The growth of [`Slowest`] without so many motions, those that change least, from the eigenvalues of the whole map, in half the time: it is the same where
    /// all that may be at zero are left out anyway. `None` where terms cancel, where more of them are near zero, or it is as near to one as rounding may be off.
    pub(super) fn clear_growth(&self, excluded: usize) -> Option<f64> {
        let (change, None) = self.accurate_change() else { return None };
        let found = eigenvalues(&change)?;
        let near_zero = found.iter().take_while(|change| size(**change) <= NEAR_ZERO).count();
        let most = found.get(excluded..)?.iter().map(|change| growth(*change)).max_by(f64::total_cmp)?;
        let clear = near_zero <= excluded && !(0.0..=2.0 * CLOSE).contains(&most);
        clear.then(|| self.per_sample(most))
    }

    /// Growth per shortest sample time, of a relative growth of the square of the size in a period.
    fn per_sample(&self, growth: f64) -> f64 {
        powf((1.0 + growth).max(0.0), 0.5 * self.sample_time / self.period)
    }

    /// The map from just after new commands of a law are in force to the same instant a period later; `None` if that is more
    /// than once in a period.
    pub(super) fn between_commands(&self, law: usize) -> Option<Matrix<f64>> {
        Some(self.map_from(self.applied[law]?, &self.jumps))
    }

    /// The map over a period that begins with this event.
    fn map_from(&self, first: usize, jumps: &[Jump<f64>]) -> Matrix<f64> {
        map_from(first, &self.event_sequence, jumps, self.map.rows())
    }

    /// Whether numbers are so large that terms may cancel to a small part.
    pub(super) fn has_large_terms(&self) -> bool {
        self.jumps.iter().any(|jump| jump.largest() > CANCELS)
    }

    /// The change over a period, and where numbers are so large that terms may cancel to a small part by how much the terms of each entry are larger than
    /// the entry. Then the period begins just after all that happens at the first instant, with the same eigenvalues: commands that are a small part of
    /// their terms, as those of blocks with fast poles, are computed within it.
    fn accurate_change(&self) -> (Matrix<f64>, Option<Matrix<f64>>) {
        if !self.has_large_terms() {
            return (self.change(), None);
        }
        let sizes: Vec<Jump<f64>> = self.jumps.iter().map(Jump::sizes).collect();
        let one = |i: usize, j: usize| f64::from(u8::from(i == j));
        let [map, sizes] = [&self.jumps, &sizes].map(|jumps| self.map_from(self.at_first, jumps));
        let of = |entry: &dyn Fn(usize, usize) -> f64| Matrix::from_fn(self.constants, self.constants, entry);
        let cancelled = of(&|i, j| (sizes[(i, j)] - map[(i, j)].abs()).max(0.0));
        (of(&|i, j| map[(i, j)] - one(i, j)), Some(cancelled))
    }

    /// By which angle the motion of an eigenvalue of the map turns in a period, rad: its angle, and whole turns, which are counted
    /// from sample to sample.
    fn turn(&self, (re, im): (f64, f64)) -> f64 {
        let angle = atan2(im, re);
        if self.period < (1.0 + SAME) * self.sample_time {
            return angle;
        }
        // The eigenvector by one step of inverse iteration: (Φ − λ)(x + iy) = w.
        let n = self.constants;
        let near = (re * (1.0 + BESIDE), im * (1.0 + BESIDE));
        let shifted = Matrix::from_fn(2 * n, 2 * n, |i, j| {
            let (row, column) = (i % n, j % n);
            let on_diagonal = |x: f64| if row == column { x } else { 0.0 };
            match (i < n, j < n) {
                (true, true) | (false, false) => self.map[(row, column)] - on_diagonal(near.0),
                (true, false) => on_diagonal(near.1),
                (false, true) => on_diagonal(-near.1),
            }
        });
        let start = Matrix::from_fn(2 * n, 1, |i, _| 1.0 + sin(i as f64));
        let Some(found) = shifted.solve(&start) else { return angle };
        let largest = found.as_slice().iter().fold(0.0f64, |max, x| max.max(x.abs()));
        let part = |first: usize| {
            let mut z = vec![0.0; self.map.rows()];
            (0..n).for_each(|k| z[k] = found[(first + k, 0)] / largest);
            let mut positions = vec![z[..self.degrees_of_freedom].to_vec()];
            self.pass(&mut z, &mut |z| positions.push(z[..self.degrees_of_freedom].to_vec()));
            positions
        };
        let (x, y) = (part(0), part(n));
        let rotation: f64 = (1..x.len())
            .map(|k| {
                let sum = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
                let inner_product = sum(&x[k - 1], &x[k]) + sum(&y[k - 1], &y[k]);
                atan2(sum(&x[k - 1], &y[k]) - sum(&y[k - 1], &x[k]), inner_product)
            })
            .sum();
        angle + TAU * ((rotation - angle) / TAU).round()
    }

    /// Spectral radius per shortest sample time; below one the loop is stable.
    pub fn spectral_radius(&self) -> Option<f64> {
        Some(self.multipliers()?.first().map_or(0.0, |found| size(*found)))
    }

    /// The response of rows over z to errors of the readings of one law: root mean squares long after a start at rest, at the worst
    /// instant. Each error is new whenever its sensor reads, with these variances. What drifts (a wheel that no law controls)
    /// is taken after some thousand periods.
    ///
    /// # Panics
    /// If the loop has no places for errors, or there is not one variance for each of the law's sensors.
    pub fn noise(&self, law: usize, variances: &[f64], rows: &[Vec<f64>]) -> Vec<f64> {
        let n = self.map.rows();
        let first = self.errors[law];
        assert!(first + variances.len() <= n, "variances of readings that the loop does not have");
        let variance = |place: usize| place.checked_sub(first).and_then(|k| variances.get(k)).copied().unwrap_or(0.0);
        let pass = |sum: &mut Matrix<f64>, observe: &mut dyn FnMut(&Matrix<f64>)| {
            for event in &self.event_sequence {
                match event {
                    LoopEvent::Jump(jump) => {
                        self.jumps[*jump].change_rows(sum);
                        *sum = sum.transpose();
                        self.jumps[*jump].change_rows(sum);
                    }
                    LoopEvent::Fresh(place) => {
                        (0..n).for_each(|k| (sum[(*place, k)], sum[(k, *place)]) = (0.0, 0.0));
                        sum[(*place, *place)] = variance(*place);
                    }
                    LoopEvent::Observe => observe(sum),
                    LoopEvent::Launch(_) => {}
                }
            }
        };
        let still = |k: usize| k >= self.constants;
        let states = |matrix: &Matrix<f64>| {
            Matrix::from_fn(n, n, |i, j| if still(i) || still(j) { 0.0 } else { matrix[(i, j)] })
        };
        let mut once = Matrix::zeros(n, n);
        pass(&mut once, &mut |_| {});
        let mut sum = states(&once);
        let mut power = states(&self.map);
        for _ in 0..DOUBLINGS {
            sum = sum.plus(&power.multiply(&sum).multiply(&power.transpose()));
            power = power.multiply(&power);
        }
        let mut out = vec![0.0f64; rows.len()];
        pass(&mut sum, &mut |sum| {
            for (out, row) in out.iter_mut().zip(rows) {
                let spread = |i: usize| -> f64 { (0..n).map(|j| sum[(i, j)] * row[j]).sum() };
                let square: f64 = (0..n).filter(|i| row[*i] != 0.0).map(|i| row[i] * spread(i)).sum();
                *out = out.max(square.max(0.0).sqrt());
            }
        });
        out
    }
}

/// By which part the square of the size of a motion grows in a period, of an eigenvalue of Φ − 1: `|1 + μ|² − 1`, which loses no digits next to zero.
fn growth((re, im): (f64, f64)) -> f64 {
    2.0 * re + re * re + im * im
}

fn size((re, im): (f64, f64)) -> f64 {
    hypot(re, im)
}

/// A power of a complex number.
fn power((re, im): (f64, f64), exponent: f64) -> (f64, f64) {
    if exponent == 1.0 {
        return (re, im);
    }
    let (size, angle) = (powf(hypot(re, im), exponent), atan2(im, re) * exponent);
    (size * cos(angle), size * sin(angle))
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
    fn exponential(&self, flow: &Matrix<f64>, time: f64) -> Option<Jump<f64>> {
        let Self { moving, driving } = self;
        let found = discretise(&selected(flow, moving, moving), &selected(flow, moving, driving), time)?;
        let mut out = Jump::new();
        for (i, &row) in moving.iter().enumerate() {
            let own = moving.iter().copied().zip(found.a.row(i).iter().copied());
            let driven = driving.iter().copied().zip(found.b.row(i).iter().copied());
            out.push(row, own.chain(driven).filter(|(_, x)| *x != 0.0).collect());
        }
        Some(out)
    }
}
