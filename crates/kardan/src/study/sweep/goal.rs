//! Goals of a sweep besides its samples: the requirement of a search, and the stopping rule.

use super::intervals::{CONFIDENCE, clopper_pearson};
use super::rows::is_refusal;
use crate::study::measure::selected_variants::selects;
use crate::study::{Figure, Prepared, Requirement};
use kardan_model::tables::Measure;
use kardan_results::{SweepHead, SweepRow, SweptUntil};
use kardan_schema::diagnostics::{Diagnostic, shortened};

/// The goal of a sweep.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum SweepGoal {
    /// All its samples.
    #[default]
    Samples,
    /// Samples until the half-width of each requirement's interval is at most this value; at most all of them.
    Until(f64),
    /// The worst case of a requirement: by its number from 1, its text, or a unique part of the text.
    Worst(String),
    /// The probability that such a requirement fails, where that is rare.
    Rare(String),
}

impl SweepGoal {
    /// Its option, and the requirement of the search.
    pub(super) fn sought(&self) -> Option<(&'static str, &str)> {
        match self {
            Self::Worst(name) => Some(("--worst", name)),
            Self::Rare(name) => Some(("--rare", name)),
            Self::Samples | Self::Until(_) => None,
        }
    }
}

/// A requirement with bounds, whose margin gives the search direction.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Target {
    /// Its number, from 0.
    pub requirement: usize,
    below: Option<f64>,
    above: Option<f64>,
}

impl Target {
    /// Distance of a run from the bound, SI: at most zero if it fails, and −∞ if it fails without a value.
    pub fn margin(&self, row: &SweepRow) -> f64 {
        let measured = row.measured[self.requirement];
        let least = [self.below.map(|bound| bound - measured), self.above.map(|bound| measured - bound)];
        let margin = least.into_iter().flatten().fold(f64::INFINITY, f64::min);
        match row.passed[self.requirement] > 0.5 {
            true => margin,
            false if margin <= 0.0 => margin,
            false => f64::NEG_INFINITY,
        }
    }

    /// The same for a search: a sample that cannot run is no case, and never the worst one.
    pub fn margin_of_case(&self, row: &SweepRow) -> f64 {
        if is_refusal(&row.reason) { f64::INFINITY } else { self.margin(row) }
    }

    /// The least margin of each sample over its variants, of rows by sample.
    pub fn margins(&self, rows: &[SweepRow], margin: impl Fn(&Self, &SweepRow) -> f64) -> Vec<f64> {
        let of_sample = |rows: &[SweepRow]| rows.iter().map(|row| margin(self, row)).fold(f64::INFINITY, f64::min);
        rows.chunk_by(|one, next| one.sample == next.sample).map(of_sample).collect()
    }
}

/// The requirement of the search, in those chosen variants to which it applies; the others are omitted.
pub(super) fn target(
    prepared: &Prepared,
    (option, name): (&str, &str),
    variants: &mut Vec<String>,
) -> Result<Target, Diagnostic> {
    let all: Vec<String> = prepared.requirements.iter().map(Requirement::describe).collect();
    let help = || {
        let listed: Vec<String> = all.iter().enumerate().map(|(k, text)| format!("{} `{text}`", k + 1)).collect();
        match listed.is_empty() {
            true => "write one: `[[requirement]]`".to_string(),
            false => format!("name it by its number or its text: {}", listed.join(", ")),
        }
    };
    let refused = |message: String, help: String| {
        Diagnostic::error("sweep::requirement", format!("`{option}`: {message}")).help(help)
    };
    let name = name.trim();
    // A number does not match the text.
    let number = name.parse::<usize>().ok();
    let is_part = |k: &usize| number.is_none() && !name.is_empty() && all[*k].contains(name);
    let with: Vec<usize> = (0..all.len()).filter(is_part).collect();
    let found = match (number, &with[..]) {
        (Some(number), _) => number.checked_sub(1).filter(|k| *k < all.len()),
        (None, [only]) => Some(*only),
        (None, _) => all.iter().position(|text| text == name),
    };
    let Some(number) = found else {
        let why = if with.len() > 1 { "several requirements have" } else { "there is no requirement" };
        return Err(refused(format!("{why} `{}`", shortened(name)), help()));
    };
    let requirement = &prepared.requirements[number];
    let measured = match &requirement.figure {
        None => requirement.measure,
        Some(figure) => {
            let found = prepared.figures.iter().find(|one| one.name == *figure).and_then(Figure::measure);
            found.map_or(Measure::Final, |found| found.measure)
        }
    };
    if measured == Measure::Events {
        let message = format!(
            "`{}` is a count: it is satisfied or not, and has no magnitude that gives a search direction",
            all[number]
        );
        return Err(refused(
            message,
            "name a requirement of a signal, or estimate with samples how often it is satisfied".into(),
        ));
    }
    variants.retain(|name| selects(&requirement.variants, name));
    if variants.is_empty() {
        let message = format!("`{}` applies to no chosen variant", all[number]);
        return Err(refused(message, format!("choose one of its variants: `--variant {}`", requirement.variants[0])));
    }
    Ok(Target { requirement: number, below: requirement.below, above: requirement.above })
}

/// Ratio of the samples of successive interim analyses.
const GROWTH: f64 = 1.5;

/// The stopping rule of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct InterimAnalyses {
    /// The blocks after which an interim analysis follows.
    at: Vec<u64>,
    /// Samples of each requirement in each variant, passed and all.
    counts: Vec<[u64; 2]>,
    /// The intermediate result.
    pub status: SweptUntil,
}

impl InterimAnalyses {
    /// For a number of blocks: the last one, and those before it at decreasing steps.
    pub fn new(half_width: f64, blocks: u64, head: &SweepHead) -> Self {
        let mut at: Vec<u64> = Vec::new();
        let mut next = blocks as f64;
        while next >= 1.0 {
            at.push(next as u64);
            next /= GROWTH;
        }
        at.dedup();
        let interim_analyses = at.len() as u64;
        let confidence = 1.0 - (1.0 - CONFIDENCE) / interim_analyses.max(1) as f64;
        let counts = vec![[0; 2]; head.requirements.len() * head.variants.len()];
        let status = SweptUntil { half_width, samples: 0, interim_analyses, confidence, converged: false };
        Self { at, counts, status }
    }

    /// Adds the rows of the next block; those after the first sufficiently narrow analysis are not needed.
    pub fn take(&mut self, block: u64, rows: &[SweepRow], variants: usize) {
        for row in rows {
            for (k, passed) in row.passed.iter().enumerate().filter(|(_, passed)| !passed.is_nan()) {
                let count = &mut self.counts[k * variants + row.variant];
                *count = [count[0] + u64::from(*passed > 0.5), count[1] + 1];
            }
        }
        self.status.samples += rows.len() as u64 / variants.max(1) as u64;
        if self.at.contains(&(block + 1)) {
            let wide = |[passed, all]: &[u64; 2]| {
                let [low, high] = clopper_pearson(*passed, *all, self.status.confidence);
                0.5 * (high - low) > self.status.half_width
            };
            self.status.converged = !self.counts.iter().filter(|[_, all]| *all > 0).any(wide);
        }
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/study/sweep/goal.rs"]
mod tests;
