//! The worst case of a requirement, searched by polls around the worst sample so far: along each axis, further along the last direction, and in random directions,
//! at a step that halves if none is worse (Kolda, Lewis, Torczon, SIAM Review 45, 2003, 385). After convergence it starts from another sample.

use super::points::{Axis, STEP, axes};
use crate::study::requests::distribution::normal_below;
use crate::study::requests::sample_space::SampleSpace;
use crate::study::requests::sampling_method::SamplingMethod;
use kardan_math::num::Random;

/// Search range in deviations for an unbounded distribution.
const MOST_DEVIATIONS: f64 = 3.0;
/// First and least step of a search, as fractions of the probability of an axis.
const STEPS: [f64; 2] = [0.2, 1e-5];
/// Least distance along one axis between the start of a search and earlier converged points.
const APART: f64 = 0.1;

/// A point, and the margin there.
#[derive(Debug, Clone, PartialEq)]
struct Tried {
    place: Vec<f64>,
    margin: f64,
}

/// The state of a search.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Worst {
    seed: u64,
    /// First samples, which fill the space.
    axes: Vec<Axis>,
    bounds: Vec<[f64; 2]>,
    /// Samples before the search.
    pub explore: u64,
    tried: Vec<Tried>,
    /// The current point of the search.
    at: Option<Tried>,
    /// The last successful direction.
    way: Vec<f64>,
    step: f64,
    turn: usize,
    /// Points of convergence.
    pub rests: Vec<Vec<f64>>,
    pending: Vec<Vec<f64>>,
    /// The least margin of all, and its sample.
    pub least: Option<(f64, u64)>,
    /// The least margin before the search.
    pub before: Option<f64>,
}

impl Worst {
    /// With this number of samples before the search.
    pub fn new(seed: u64, explore: u64, space: &SampleSpace) -> Self {
        let mixed = |k: usize| space.correlated.iter().any(|group| group.members.contains(&k));
        let open = normal_below(-MOST_DEVIATIONS);
        let bounds = space.varied.iter().enumerate().map(|(k, varied)| {
            let [low, high] = varied.distribution.is_open();
            let end = |is_open: bool| if is_open || mixed(k) { open } else { 0.0 };
            [end(low), 1.0 - end(high)]
        });
        Self {
            seed: Random::named(seed, "worst").next_u64(),
            bounds: bounds.collect(),
            axes: axes(SamplingMethod::LatinHypercube, (seed, explore), space),
            explore,
            tried: Vec::new(),
            at: None,
            way: Vec::new(),
            step: STEPS[0],
            turn: 0,
            rests: Vec::new(),
            pending: Vec::new(),
            least: None,
            before: None,
        }
    }

    /// Points of the next samples.
    pub fn propose(&mut self, samples: std::ops::Range<u64>) -> Vec<Vec<f64>> {
        let count = samples.clone().count();
        let clamped = |place: Vec<f64>, bounds: &[[f64; 2]]| -> Vec<f64> {
            place.iter().zip(bounds).map(|(x, [low, high])| x.clamp(*low, *high)).collect()
        };
        if samples.end <= self.explore {
            let places = samples.map(|number| self.axes.iter().map(|axis| axis.at(number)).collect());
            self.pending = places.map(|place| clamped(place, &self.bounds)).collect();
            return self.pending.clone();
        }
        let at = match &self.at {
            Some(at) => at.place.clone(),
            None => self.begin(samples.start),
        };
        let k = at.len();
        let mut places: Vec<Vec<f64>> = Vec::new();
        let stepped = |factor: f64| at.iter().zip(&self.way).map(|(x, way)| x + factor * way).collect::<Vec<f64>>();
        if !self.way.is_empty() {
            places.extend([stepped(1.0), stepped(3.0)]);
        }
        // Half of them along the axes, which alternate if there are many.
        let on_axes = (2 * k).min(count.div_ceil(2));
        for one in 0..on_axes {
            let (axis, sign) = ((self.turn + one / 2) % k, if one % 2 == 0 { 1.0 } else { -1.0 });
            let mut place = at.clone();
            place[axis] += sign * self.step;
            places.push(place);
        }
        self.turn = (self.turn + on_axes / 2) % k;
        let mut number = 0;
        while places.len() < count {
            let draws = self.seed.wrapping_add(samples.start.wrapping_add(number).wrapping_mul(STEP));
            let mut random = Random::new(Random::new(draws).next_u64());
            // Short ones and long ones.
            let size = self.step * [1.0, 0.5, 0.25, 2.0][(number % 4) as usize];
            places.push(at.iter().map(|x| x + size * random.normal()).collect());
            number += 1;
        }
        places.truncate(count);
        self.pending = places.into_iter().map(|place| clamped(place, &self.bounds)).collect();
        self.pending.clone()
    }

    /// Start of the next search: the worst sample far enough from converged points; a random point if there is none.
    fn begin(&mut self, number: u64) -> Vec<f64> {
        let apart =
            |place: &[f64]| self.rests.iter().all(|rest| rest.iter().zip(place).any(|(a, b)| (a - b).abs() > APART));
        let free = self.tried.iter().filter(|one| apart(&one.place));
        let found = free.reduce(|worst, one| if one.margin < worst.margin { one } else { worst }).cloned();
        let found = found.unwrap_or_else(|| {
            let mut random = Random::new(Random::new(self.seed ^ number).next_u64());
            let place = self.bounds.iter().map(|[low, high]| low + (high - low) * random.unit()).collect();
            Tried { place, margin: f64::INFINITY }
        });
        (self.step, self.way) = (STEPS[0], Vec::new());
        self.at = Some(found.clone());
        found.place
    }

    /// Adds their margins.
    pub fn update(&mut self, first: u64, margins: &[f64]) {
        for (number, margin) in (first..).zip(margins) {
            if *margin < self.least.map_or(f64::INFINITY, |(least, _)| least) {
                self.least = Some((*margin, number));
            }
        }
        let pending = std::mem::take(&mut self.pending);
        let all = pending.into_iter().zip(margins).map(|(place, margin)| Tried { place, margin: *margin });
        let Some(at) = self.at.clone() else {
            self.tried.extend(all);
            self.before = self.least.map(|(least, _)| least);
            return;
        };
        let best = all.reduce(|worst, one| if one.margin < worst.margin { one } else { worst });
        match best.filter(|best| best.margin < at.margin) {
            Some(best) => {
                self.way = best.place.iter().zip(&at.place).map(|(new, old)| new - old).collect();
                let far = self.way.iter().map(|x| x.abs()).fold(0.0, f64::max);
                self.step = (if far >= self.step { 1.5 * self.step } else { (0.5 * self.step).max(far) }).min(0.5);
                self.at = Some(best);
            }
            None => (self.step, self.way) = (0.4 * self.step, Vec::new()),
        }
        if self.step < STEPS[1] {
            self.rests.extend(self.at.take().map(|at| at.place));
        }
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/study/sweep/worst.rs"]
mod tests;
