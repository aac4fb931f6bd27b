//! What a sweep consists of: its samples, blocks, shards.

use std::ops::Range;

use super::goal::{SweepGoal, Target};
use super::points::{Axis, SamplingMethod};
use super::together::{Together, values_at};
use super::varied::Varied;
use crate::results::SweepHead;
use crate::study::Settings;

/// How a model is swept.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SweepSettings {
    /// How many samples, in place of those of the file.
    pub samples: Option<u64>,
    /// The seed, in place of that of the file.
    pub seed: Option<u64>,
    /// Names of the variants, in place of those of the file; empty: those.
    pub variants: Vec<String>,
    /// How runs are integrated; variants and faults of it are not read.
    pub run: Settings,
    /// Steps that a run may take, where [`Progress::most_steps`](crate::study::Progress::most_steps) of the sweep says otherwise than by itself: rows follow from them.
    pub most_steps: Option<usize>,
    /// What it is for.
    pub goal: SweepGoal,
    /// How many lanes there are where runs go side by side, 1, 4 or 8; `None`: as many as machine code has. Results do not depend on it.
    pub lanes: Option<usize>,
}

/// What a sweep consists of, before a run.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepPlan {
    /// What its rows are of.
    pub head: SweepHead,
    /// The part of the blocks that is run; `None`: all of them.
    pub shard: Option<Shard>,
    pub(super) axes: Vec<Axis>,
    pub(super) spread: Vec<Varied>,
    pub(super) together: Vec<Together>,
    pub(super) sampling: SamplingMethod,
    pub(super) goal: SweepGoal,
    pub(super) target: Option<Target>,
    pub(super) block: u64,
    pub(super) lanes: Option<usize>,
}

/// One of as many parts of a sweep: a process of its own runs it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Its number, from 1.
    pub number: u64,
    /// How many there are.
    pub of: u64,
}

impl SweepPlan {
    /// Whether its samples are draws, each with noise of its own; a search and what compares samples pair by pair have the same noise in all of them.
    pub(super) fn draws(&self) -> bool {
        self.sampling.draws() && self.goal.sought().is_none()
    }

    /// The values of a sample, SI: they follow from the seed and its number alone; those of a search from the samples before it too, and are not told here.
    pub fn values(&self, sample: u64) -> Vec<f64> {
        let places: Vec<f64> = self.axes.iter().map(|axis| axis.at(sample)).collect();
        values_at(&self.spread, &self.together, &places)
    }

    /// Samples of a block, which is written as a whole: at most a thousand blocks, but for small ones.
    pub fn block(&self) -> u64 {
        self.block
    }

    /// How many blocks a sweep has come to, of as many as there can be, with so many rows: fewer where it has ended by its goal, which shards have none of.
    pub fn blocks_of(&self, rows: u64) -> u64 {
        let filled = || (rows / self.head.variants.len().max(1) as u64).div_ceil(self.block);
        if self.shard.is_some() { self.blocks() } else { filled() }
    }

    /// How samples are made, in a word.
    pub(super) fn points(&self) -> &'static str {
        match self.goal {
            SweepGoal::Worst(_) => "worst",
            SweepGoal::Rare(_) => "rare",
            SweepGoal::Samples | SweepGoal::Until(_) => self.sampling.word(),
        }
    }

    /// How many blocks there are.
    pub fn blocks(&self) -> u64 {
        self.head.samples.div_ceil(self.block())
    }

    /// The blocks that are run: all of them, or those of the shard.
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
