//! Progress of a sweep from block to block: samples that depend on earlier ones, and the stopping rule.

use std::ops::Range;

use super::goal::{InterimAnalyses, SweepGoal, Target};
use super::plan::SweepPlan;
use super::rare::Rare;
use super::worst::Worst;
use kardan_results::SweepRow;

/// The state of a sweep.
pub(super) enum StoppingRule {
    /// Each sample depends only on its number.
    Plain,
    /// The same, with a stopping rule.
    Until(InterimAnalyses),
    /// A search.
    Worst(Target, Box<Worst>),
    /// A subset simulation.
    Rare(Target, Box<Rare>),
}

impl StoppingRule {
    /// The initial state.
    pub fn of(plan: &SweepPlan) -> Self {
        let seed = plan.head.seed;
        match (&plan.goal, &plan.target) {
            (SweepGoal::Until(width), _) => Self::Until(InterimAnalyses::new(*width, plan.blocks(), &plan.head)),
            (SweepGoal::Worst(_), Some(target)) => {
                let explore = plan.samples_of(0..plan.blocks().div_ceil(2)).end;
                Self::Worst(target.clone(), Box::new(Worst::new(seed, explore, &plan.space)))
            }
            (SweepGoal::Rare(_), Some(target)) => {
                Self::Rare(target.clone(), Box::new(Rare::new(seed, plan.block(), &plan.space)))
            }
            _ => Self::Plain,
        }
    }

    /// Whether samples depend on earlier ones.
    pub fn is_led(&self) -> bool {
        matches!(self, Self::Worst(..) | Self::Rare(..))
    }

    /// Whether each sample depends only on its number, and all of them count.
    pub fn is_plain(&self) -> bool {
        matches!(self, Self::Plain)
    }

    /// Values of the samples of the next block; `None` at the end.
    pub fn values(&mut self, plan: &SweepPlan, samples: Range<u64>) -> Option<Vec<Vec<f64>>> {
        match self {
            Self::Until(interim_analyses) if interim_analyses.status.converged => None,
            Self::Plain | Self::Until(_) => Some(samples.map(|sample| plan.values(sample)).collect()),
            Self::Worst(_, worst) => {
                Some(worst.propose(samples).iter().map(|places| plan.space.values_at(places)).collect())
            }
            Self::Rare(_, rare) => {
                Some(rare.propose(samples)?.iter().map(|scores| plan.space.values_of_scores(scores)).collect())
            }
        }
    }

    /// Adds the rows of that block.
    pub fn take(&mut self, plan: &SweepPlan, block: u64, rows: &[SweepRow]) {
        match self {
            Self::Plain => {}
            Self::Until(interim_analyses) => interim_analyses.take(block, rows, plan.head.variants.len()),
            Self::Worst(target, worst) => {
                worst.update(plan.samples_of(block..block + 1).start, &target.margins(rows, Target::margin_of_case));
            }
            Self::Rare(target, rare) => rare.update(&target.margins(rows, Target::margin)),
        }
    }

    /// Whether no further sample is needed.
    pub fn is_done(&self) -> bool {
        match self {
            Self::Until(interim_analyses) => interim_analyses.status.converged,
            Self::Rare(_, rare) => rare.ended.is_some(),
            Self::Plain | Self::Worst(..) => false,
        }
    }
}
