//! What varies in a sweep, and how its samples are chosen.

use super::correlated::CorrelatedGroup;
use super::distribution::score;
use super::sampling_method::SamplingMethod;
use super::varied::Varied;

/// The varied parameters, and how samples are chosen.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::study) struct SampleSpace {
    /// The varied parameters.
    pub varied: Vec<Varied>,
    /// Those that vary together.
    pub correlated: Vec<CorrelatedGroup>,
    /// The sampling method.
    pub sampling: SamplingMethod,
}

impl SampleSpace {
    /// For each axis the number of its factor: axes that vary together share one.
    pub fn factors(&self) -> Vec<usize> {
        let mut out: Vec<usize> = Vec::new();
        let mut next = 0;
        for axis in 0..self.varied.len() {
            let group = self.correlated.iter().find(|group| group.members.contains(&axis));
            let first = group.and_then(|group| group.members.iter().min());
            let shared = first.filter(|first| **first < axis).map(|first| out[*first]);
            out.push(shared.unwrap_or(next));
            next += usize::from(shared.is_none());
        }
        out
    }

    /// Samples of one group of its method.
    pub fn group(&self) -> u64 {
        let factors = self.factors().iter().max().map_or(0, |last| last + 1) as u64;
        match self.sampling {
            SamplingMethod::Saltelli => factors + 2,
            SamplingMethod::Morris => factors + 1,
            _ => 1,
        }
    }

    /// The number of combinations of a grid with this many levels.
    pub fn combinations(&self, levels: u64) -> u64 {
        self.varied.iter().map(|varied| varied.distribution.levels(levels)).fold(1, u64::saturating_mul)
    }

    /// Values at positions from 0 to 1 on the axes, with the correlations of those that vary together.
    pub fn values_at(&self, places: &[f64]) -> Vec<f64> {
        let on_axes = self.varied.iter().zip(places);
        let mut values: Vec<f64> = on_axes.map(|(varied, place)| varied.distribution.quantile(*place)).collect();
        if !self.correlated.is_empty() {
            let scores = self.mixed(&places.iter().map(|place| score(*place)).collect::<Vec<_>>());
            for member in self.correlated.iter().flat_map(|group| &group.members) {
                values[*member] = self.varied[*member].distribution.of_score(scores[*member]);
            }
        }
        values
    }

    /// The same at scores: independent normal numbers.
    pub fn values_of_scores(&self, scores: &[f64]) -> Vec<f64> {
        let scores = self.mixed(scores);
        self.varied.iter().zip(&scores).map(|(varied, score)| varied.distribution.of_score(*score)).collect()
    }

    /// Correlated scores from independent ones.
    fn mixed(&self, independent: &[f64]) -> Vec<f64> {
        let mut scores = independent.to_vec();
        for CorrelatedGroup { members, factor } in &self.correlated {
            for (i, member) in members.iter().enumerate() {
                scores[*member] = (0..=i).map(|j| factor[(i, j)] * independent[members[j]]).sum();
            }
        }
        scores
    }
}
