//! The plan of a sweep: its samples, blocks, shards.

use std::ops::Range;

use super::goal::{SweepGoal, Target};
use super::points::Axis;
use crate::study::Settings;
use crate::study::requests::sample_space::SampleSpace;
use crate::study::requests::sampling_method::SamplingMethod;
use kardan_results::SweepHead;

/// Settings of a sweep.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SweepSettings {
    /// Number of samples, instead of the file's.
    pub samples: Option<u64>,
    /// The seed, instead of the file's.
    pub seed: Option<u64>,
    /// Names of the variants, instead of the file's; empty: those of the file.
    pub variants: Vec<String>,
    /// Integration settings; their variants and faults are ignored.
    pub run: Settings,
    /// Steps that a run may take, where [`Progress::most_steps`](crate::study::Progress::most_steps) of the sweep differs from its default: rows depend on it.
    pub most_steps: Option<usize>,
    /// The goal.
    pub goal: SweepGoal,
    /// Number of lanes of the SIMD ensemble, 1, 4 or 8; `None`: the width of the machine code. Results do not depend on it.
    pub lanes: Option<usize>,
}

/// The plan of a sweep, before a run.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepPlan {
    /// The header of its rows.
    pub head: SweepHead,
    /// The shard of blocks to run; `None`: all of them.
    pub shard: Option<Shard>,
    pub(super) axes: Vec<Axis>,
    pub(super) space: SampleSpace,
    pub(super) goal: SweepGoal,
    pub(super) target: Option<Target>,
    pub(super) block: u64,
    pub(super) lanes: Option<usize>,
}

/// One part of a sweep, for a separate process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Its number, from 1.
    pub number: u64,
    /// The number of shards.
    pub of: u64,
}

impl SweepPlan {
    /// Its sampling method; none of a search, which chooses its samples itself.
    pub(super) fn method(&self) -> Option<SamplingMethod> {
        self.goal.sought().is_none().then_some(self.space.sampling)
    }

    /// Whether its samples are draws, each with its own noise; searches and pairwise comparisons use the same noise in all samples.
    pub(super) fn draws(&self) -> bool {
        self.method().is_some_and(SamplingMethod::draws)
    }

    /// The values of a sample, SI: they depend only on the seed and its number; those of a search also depend on earlier samples, and are not available here.
    pub fn values(&self, sample: u64) -> Vec<f64> {
        let places: Vec<f64> = self.axes.iter().map(|axis| axis.at(sample)).collect();
        self.space.values_at(&places)
    }

    /// Samples of a block, which is written as a whole: at most a thousand blocks, except for small ones.
    pub fn block(&self) -> u64 {
        self.block
    }

    /// Completed blocks of a sweep with this many rows, and their largest number: fewer if it has reached its goal, which shards do not have.
    pub fn blocks_of(&self, rows: u64) -> u64 {
        let filled = || (rows / self.head.variants.len().max(1) as u64).div_ceil(self.block);
        if self.shard.is_some() { self.blocks() } else { filled() }
    }

    /// The word of the sampling method.
    pub(super) fn points(&self) -> &'static str {
        match self.goal {
            SweepGoal::Worst(_) => "worst",
            SweepGoal::Rare(_) => "rare",
            SweepGoal::Samples | SweepGoal::Until(_) => self.space.sampling.word(),
        }
    }

    /// The number of blocks.
    pub fn blocks(&self) -> u64 {
        self.head.samples.div_ceil(self.block())
    }

    /// The blocks to run: all of them, or those of the shard.
    pub fn own_blocks(&self) -> Range<u64> {
        let end = |number: u64, of: u64| (u128::from(self.blocks()) * u128::from(number) / u128::from(of)) as u64;
        self.shard.map_or(0..self.blocks(), |Shard { number, of }| end(number - 1, of)..end(number, of))
    }

    /// The samples of blocks.
    pub fn samples_of(&self, blocks: Range<u64>) -> Range<u64> {
        let at = |block: u64| block.saturating_mul(self.block()).min(self.head.samples);
        at(blocks.start)..at(blocks.end)
    }
}
