//! Whether the loop of a variant is stable: one verdict for all reports.

use crate::study::PreparedVariant;
use kardan_analysis::despite_rounding;
use kardan_math::num::LastDigits;
use kardan_mechanics::reduce::{LinearModel, laws_are_linear, linearise_near};
use kardan_results::{Pole, Stability, StabilityEvidence, StabilityVerdict, ZeroPoleEvidence};
use kardan_synthesis::{ExactMap, ExactMotions, LoopPlant, SampledPart, Slowest, exact_motions_of, roots};

/// Number of trials with other numbers within the last digits of rounded ones.
const PERTURBATIONS: u64 = 8;

/// Relative growth in a sample that counts as slow.
const SLOW: f64 = 1e-4;
/// States of laws and blocks up to which free motions of loops with blocks are counted exactly.
const MOST_STATES: usize = 32;

/// The verdicts about a loop as it is, exact where possible; by default it is not decided.
#[derive(Default)]
pub(in crate::study) struct LoopStability {
    /// Of all motions, including uncontrolled rigid-body modes.
    pub verdict: StabilityVerdict,
    /// Of all others.
    pub controlled: Stability,
    /// The number of uncontrolled rigid-body modes.
    pub zeros: usize,
    /// The evidence that these poles are at zero.
    pub how: ZeroPoleEvidence,
    /// Real parts of poles that are not at zero but indistinguishable from zero in floating point.
    pub next_to_zero: Vec<f64>,
    /// All poles, where the verdict on a loop in continuous time is exact.
    pub poles: Option<Vec<Pole>>,
}

impl LoopStability {
    /// Whether all motions except free ones decay; `None` if that is not decided.
    pub fn controlled_is_stable(&self) -> Option<bool> {
        (self.controlled != Stability::Undecided).then_some(self.controlled == Stability::Stable)
    }
}

/// A loop to analyse for stability.
pub(in crate::study) struct StabilityProblem<'a> {
    pub variant: &'a PreparedVariant,
    pub plant: &'a LoopPlant,
    /// Its parts as they run, with blocks.
    pub parts: &'a [SampledPart],
    /// Whether blocks are among these.
    pub has_blocks: bool,
}

impl StabilityProblem<'_> {
    /// The exact loop in continuous time, of sampled laws one with the same uncontrolled motions; `None` for these with blocks where floating point finds
    /// that all motions decay, where commands follow from each other in a circle, and where rounded gains leave less motions free than floating point finds.
    pub fn exact(&self, found: &Slowest) -> Option<ExactMotions> {
        let laws = &self.variant.designed;
        if self.parts.iter().all(|part| part.clock.is_none()) {
            return exact_motions_of(self.plant, self.parts, laws);
        }
        let states = self.parts.iter().map(|part| part.linear.states.rows()).sum::<usize>();
        let is_clear = found.word == Stability::Stable && found.excluded == 0;
        if self.has_blocks && (is_clear || states > MOST_STATES) || SampledPart::are_in_circle(self.parts) {
            return None;
        }
        if self.has_blocks || laws.iter().any(|law| law.clock().is_some()) {
            let parts: Vec<SampledPart> = self.parts.iter().map(SampledPart::without_clock).collect();
            let exact = exact_motions_of(self.plant, &parts, &[]);
            return exact.filter(|exact| exact.before_rounding || exact.sampled >= found.excluded);
        }
        let parts: Vec<SampledPart> = laws.iter().map(|law| SampledPart::of(&**law, self.plant)).collect();
        exact_motions_of(self.plant, &parts, laws)
    }

    /// Whether slopes are rounded, which floating point does not bound: their terms may cancel.
    fn has_rounded_slopes(&self) -> bool {
        self.variant.linear_model().rounded || self.parts.iter().any(|part| part.rounding.is_some())
    }

    /// A verdict of floating point, if it is the same within the rounding of slopes.
    fn confirm_bounded(&self, mut decided: LoopStability, found: &Slowest) -> LoopStability {
        let is_rounded = self.variant.linear_model().is_rounded();
        let is_same = |seed: u64| {
            let (plant, parts) = self.near(is_rounded, seed);
            Slowest::of(&plant, &parts, found.excluded).is_some_and(|near| near.word == found.word)
        };
        if (1..=PERTURBATIONS).all(is_same) {
            if decided.verdict.evidence == StabilityEvidence::Bounded {
                decided.verdict.evidence = StabilityEvidence::Tried;
            }
            return decided;
        }
        let verdict = StabilityVerdict::undecided("it depends on the last digits of rounded numbers");
        LoopStability { verdict, controlled: Stability::Undecided, ..decided }
    }

    /// The loop with other numbers in place of rounded ones, within their last digits.
    fn near(&self, is_rounded: bool, seed: u64) -> (LoopPlant, Vec<SampledPart>) {
        let mut digits = LastDigits::new(seed);
        let mut plant = self.plant.clone();
        if is_rounded {
            let reduced = &self.variant.reduced;
            let model = linearise_near(reduced, &self.variant.point, &mut digits);
            plant = LoopPlant { slow_sensors: plant.slow_sensors, ..LoopPlant::new(&model, &reduced.equations.lags()) };
            plant = plant.with_block_torques(reduced);
        }
        (plant, self.parts.iter().map(|part| part.near(&mut digits)).collect())
    }

    /// The verdict, combined with that of floating point.
    pub fn decide(&self, found: &Slowest, exact: Option<&ExactMotions>) -> LoopStability {
        let mut decided = match self.parts.iter().all(|part| part.clock.is_none()) {
            true => self.continuous(found, exact),
            false => self.sampled(found, exact),
        };
        let by_floats = matches!(decided.verdict.evidence, StabilityEvidence::Bounded | StabilityEvidence::Unknown);
        if by_floats && decided.controlled != Stability::Undecided && self.has_rounded_slopes() {
            decided = self.confirm_bounded(decided, found);
        }
        // For motions that do not grow in the linear model the nonlinear one decides.
        let is_bent =
            !laws_are_linear(&self.variant.reduced) || self.variant.designed.iter().any(|law| law.is_nonlinear());
        if is_bent && decided.controlled == Stability::Marginal {
            decided.verdict = decided.verdict.of_linearisation();
            decided.controlled = Stability::Undecided;
        }
        decided
    }

    fn continuous(&self, found: &Slowest, exact: Option<&ExactMotions>) -> LoopStability {
        let Some((exact, verdict)) = exact.and_then(|exact| Some((exact, exact.stability()?))) else {
            return rounded(found);
        };
        // Rounding of the gains moves poles that a design leaves at zero.
        if exact.zeros() != found.excluded && !exact.before_rounding && found.word == Stability::Stable {
            return rounded(found);
        }
        let verdict = self.confirm_despite_rounding(verdict, exact, found);
        if verdict.word == Stability::Undecided {
            let because = verdict.why;
            let decided = rounded(found);
            // Rounding does not change verdicts that floating point bounds, but for that of slopes.
            return match decided.verdict.word {
                _ if self.has_rounded_slopes() => LoopStability {
                    verdict: StabilityVerdict::undecided(because),
                    controlled: Stability::Undecided,
                    ..decided
                },
                Stability::Undecided => LoopStability { verdict: StabilityVerdict::undecided(because), ..decided },
                _ => decided,
            };
        }
        let free = verdict.border.iter().any(|motion| motion.uncontrolled);
        let zeros = if free { exact.zeros() } else { 0 };
        let poles = roots(&kardan_math::num::characteristic_polynomial(&exact.matrix));
        let is_zero = |pole: &&Pole| (pole.re, pole.im) == (0.0, 0.0);
        let more = found.excluded.saturating_sub(zeros.max(poles.iter().filter(is_zero).count()));
        let beside_zero = poles.iter().filter(|pole| !is_zero(pole)).take(more);
        LoopStability {
            controlled: verdict.excluding_free().word,
            zeros,
            how: evidence(exact),
            next_to_zero: beside_zero.map(|pole| pole.re).collect(),
            poles: Some(poles),
            verdict,
        }
    }

    /// The verdict on the loop with its given numbers, if it is the same within the last digits of rounded ones.
    fn confirm_despite_rounding(
        &self,
        verdict: StabilityVerdict,
        exact: &ExactMotions,
        found: &Slowest,
    ) -> StabilityVerdict {
        let model = self.variant.linear_model();
        let is_rounded = model.is_rounded();
        if exact.before_rounding && !is_rounded {
            return verdict;
        }
        // Rounding that is bounded changes nothing where floating point agrees.
        if !self.has_rounded_slopes() && found.excluded == 0 && found.word == verdict.word {
            return StabilityVerdict { evidence: StabilityEvidence::DespiteRounding, ..verdict };
        }
        let perturbed_verdict = |seed: u64| {
            let (plant, parts) = self.near(is_rounded, seed);
            exact_motions_of(&plant, &parts, &self.variant.designed)?.stability()
        };
        despite_rounding(verdict, (1..=PERTURBATIONS).filter_map(perturbed_verdict))
    }

    fn sampled(&self, found: &Slowest, exact: Option<&ExactMotions>) -> LoopStability {
        let at_one = exact.map_or(0, |exact| exact.sampled);
        let model = self.variant.linear_model();
        // A torque that depends on blocks is not part of the linear model. With blocks the exact map takes long.
        let is_clear = self.has_blocks && found.word == Stability::Stable;
        let verdict = match is_clear || model.inputs.len() != self.plant.inputs.len() {
            true => None,
            false => ExactMap::stability_of(self.plant, self.parts, at_one),
        };
        let verdict = verdict.map(|verdict| self.confirm_sampled_despite_rounding(verdict, &model, at_one, found));
        let is_decided = |verdict: &StabilityVerdict| verdict.word != Stability::Undecided;
        let Some(verdict) = verdict.clone().filter(is_decided) else {
            let decided = rounded(found);
            // Floating point does not bound what rounding did to slopes, and slow growth may be what rounding left of large terms that cancel.
            let is_slow = found.large_terms && found.word == Stability::Unstable && found.growth < 1.0 + SLOW;
            let why = "it grows as slowly as rounding of the large terms of its map may let it appear";
            let verdict = verdict.or_else(|| is_slow.then(|| StabilityVerdict::undecided(why)));
            if let Some(verdict) = verdict.filter(|_| is_slow || self.has_rounded_slopes()) {
                return LoopStability { verdict, controlled: Stability::Undecided, ..decided };
            }
            let how = match exact {
                Some(exact) if exact.sampled == found.excluded => evidence(exact),
                _ => return decided,
            };
            let verdict = match (found.word, found.excluded) {
                (Stability::Stable, 1..) => {
                    StabilityVerdict { evidence: StabilityEvidence::Bounded, ..StabilityVerdict::free(found.excluded) }
                }
                _ => decided.verdict,
            };
            return LoopStability { verdict, how, ..decided };
        };
        LoopStability {
            controlled: verdict.excluding_free().word,
            zeros: exact.map_or(found.excluded, |exact| exact.sampled),
            how: match exact {
                Some(exact) => evidence(exact),
                None if verdict.border.is_empty() => ZeroPoleEvidence::ToRounding(found.rounding),
                None => ZeroPoleEvidence::Rounded,
            },
            verdict,
            ..LoopStability::default()
        }
    }

    /// The same for a sampled loop.
    fn confirm_sampled_despite_rounding(
        &self,
        verdict: StabilityVerdict,
        model: &LinearModel,
        at_one: usize,
        found: &Slowest,
    ) -> StabilityVerdict {
        let is_rounded = model.is_rounded();
        let agrees =
            !self.has_rounded_slopes() && found.excluded == at_one && found.word == verdict.excluding_free().word;
        let all_exact = !is_rounded && self.parts.iter().all(|part| !part.is_rounded());
        if agrees || all_exact || verdict.word == Stability::Undecided {
            return verdict;
        }
        let perturbed_verdict = |seed: u64| {
            let (plant, parts) = self.near(is_rounded, seed);
            ExactMap::stability_of(&plant, &parts, at_one)
        };
        despite_rounding(verdict, (1..=PERTURBATIONS).filter_map(perturbed_verdict))
    }
}

fn evidence(exact: &ExactMotions) -> ZeroPoleEvidence {
    if exact.before_rounding { ZeroPoleEvidence::Design } else { ZeroPoleEvidence::Rounded }
}

/// The verdict of eigenvalues in floating point, with a bound on their rounding.
fn rounded(found: &Slowest) -> LoopStability {
    let verdict = match (found.word, found.excluded) {
        (Stability::Undecided, _) => {
            StabilityVerdict::undecided("a pole is as near to the border as eigenvalues in floating point may be off")
        }
        (Stability::Stable, zeros @ 1..) => StabilityVerdict::undecided(format!(
            "{zeros} {} at zero to rounding only; all else is stable (eigenvalues in floating point, their rounding bounded)",
            if zeros == 1 { "pole is" } else { "poles are" }
        )),
        (word, _) => StabilityVerdict::plain(word, StabilityEvidence::Bounded),
    };
    LoopStability {
        verdict,
        controlled: found.word,
        zeros: found.excluded,
        how: ZeroPoleEvidence::ToRounding(found.rounding),
        ..LoopStability::default()
    }
}
