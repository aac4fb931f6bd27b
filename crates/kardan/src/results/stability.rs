//! Whether a linear system is stable: one word, how it is known, and what lies on the border.

use std::fmt;

use schemars::JsonSchema;
use serde::Serialize;

use super::Complex;

/// Where the poles of a linear system lie; in discrete time the unit circle stands for the imaginary axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub enum Stability {
    /// All of them inside.
    #[serde(rename = "stable")]
    Stable,
    /// None outside, some on the border, and there as many motions as poles: nothing grows, and not everything dies away.
    #[serde(rename = "marginal")]
    Marginal,
    /// Some outside, or on the border with fewer motions than poles, which grows like a power of the time.
    #[serde(rename = "unstable")]
    Unstable,
    /// It is not known.
    #[default]
    #[serde(rename = "not decided")]
    Undecided,
}

/// How a [`Stability`] is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub enum StabilityEvidence {
    /// Over the rationals.
    #[serde(rename = "exactly")]
    Exactly,
    /// Over the rationals, and the same for some other last digits of rounded numbers, drawn at random: a sample, no proof.
    #[serde(rename = "exactly, and the same for other last digits of rounded numbers that were tried")]
    DespiteRounding,
    /// From a bound on how far the poles are from the border: exponentials to hundreds of digits.
    #[serde(rename = "by certified bounds")]
    Certified,
    /// From eigenvalues in floating point, farther from the border than their rounding.
    #[serde(rename = "floating point, rounding bounded")]
    Bounded,
    /// It is not.
    #[default]
    #[serde(rename = "not known")]
    Unknown,
}

/// What neither dies away nor leaves the border.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, JsonSchema)]
pub struct BorderMotion {
    /// Its frequency, rad/s (of a system without sample time per sample); 0: a free motion, or a constant.
    #[serde(rename = "rad_per_s")]
    pub frequency: f64,
    /// How many poles it is, both of a pair.
    pub poles: usize,
    /// The power of the time with which it grows; 0: it stays.
    pub growth: usize,
    /// Whether it is a part that nobody holds and that moves on at constant speed, which counts as staying.
    pub free: bool,
}

impl BorderMotion {
    /// Whether an exact pole on the imaginary axis is one of it.
    pub fn is_of(&self, pole: Complex) -> bool {
        (self.frequency - pole.im.abs()).abs() <= 1e-12 * self.frequency
    }

    /// Whether it grows, beyond the angle of a free part.
    pub fn grows(&self) -> bool {
        self.growth > 0 && !self.free
    }
}

impl fmt::Display for BorderMotion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let poles = if self.poles == 1 { "1 pole".to_string() } else { format!("{} poles", self.poles) };
        match (self.frequency, self.free) {
            (0.0, true) if self.growth > 0 => write!(f, "a free motion at constant speed ({poles} at zero)")?,
            (0.0, true) => write!(f, "a free motion ({poles} at zero)")?,
            (0.0, false) => write!(f, "a motion that does not decay ({poles} at zero)")?,
            (frequency, _) => write!(f, "an oscillation at {frequency:.6} rad/s ({poles})")?,
        }
        match self.growth {
            _ if self.free => Ok(()),
            0 => Ok(()),
            1 => f.write_str(" that grows like t"),
            power => write!(f, " that grows like t^{power}"),
        }
    }
}

/// Whether a linear system is stable, and how that is known: whoever prints a stability prints this.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
#[serde(into = "StabilityView")]
#[schemars(with = "StabilityView")]
pub struct StabilityVerdict {
    /// The word.
    pub word: Stability,
    /// How it is known.
    pub evidence: StabilityEvidence,
    /// What lies on the border, where nothing lies outside.
    pub border: Vec<BorderMotion>,
    /// Why it is not decided, as a part of a sentence.
    pub why: String,
}

impl StabilityVerdict {
    /// Decided over the rationals from the poles outside and those on the border.
    pub fn exact(outside: bool, border: Vec<BorderMotion>) -> Self {
        let word = match (outside, border.is_empty()) {
            (true, _) => Stability::Unstable,
            (false, true) => Stability::Stable,
            (false, false) if border.iter().any(BorderMotion::grows) => Stability::Unstable,
            (false, false) => Stability::Marginal,
        };
        let border = if outside { Vec::new() } else { border };
        Self { word, evidence: StabilityEvidence::Exactly, border, why: String::new() }
    }

    /// A word without motions on the border.
    pub fn plain(word: Stability, evidence: StabilityEvidence) -> Self {
        Self { word, evidence, ..Self::default() }
    }

    /// Stable but for free parts with so many poles at zero (at one of a map).
    pub fn free(poles: usize) -> Self {
        Self::exact(false, vec![BorderMotion { frequency: 0.0, poles, growth: 0, free: true }])
    }

    /// Not decided, and why.
    pub fn undecided(why: impl Into<String>) -> Self {
        Self { why: why.into(), ..Self::default() }
    }

    /// The verdict on a nonlinear system by its linearisation: where nothing is outside and something on the border, that decides nothing.
    #[must_use]
    pub fn of_linearisation(self) -> Self {
        let controlled = self.without_free();
        if controlled.border.is_empty() || self.word == Stability::Undecided {
            return self;
        }
        let motions: Vec<String> = controlled.border.iter().map(BorderMotion::to_string).collect();
        let why = format!(
            "the linearisation has {} on the stability boundary, and does not decide the stability of the nonlinear model",
            motions.join(", ")
        );
        Self { border: self.border, ..Self::undecided(why) }
    }

    /// Whether all motions decay; `None` if that is not decided.
    pub fn is_stable(&self) -> Option<bool> {
        (self.word != Stability::Undecided).then_some(self.word == Stability::Stable)
    }

    /// Whether it is decided without floating point.
    pub fn is_proven(&self) -> bool {
        use StabilityEvidence::{Certified, DespiteRounding, Exactly};
        self.word != Stability::Undecided && matches!(self.evidence, Exactly | DespiteRounding | Certified)
    }

    /// The same without what free parts do.
    pub fn without_free(&self) -> Self {
        let border: Vec<BorderMotion> = self.border.iter().copied().filter(|motion| !motion.free).collect();
        let word = match self.word {
            Stability::Marginal if border.is_empty() => Stability::Stable,
            word => word,
        };
        Self { word, border, ..self.clone() }
    }

    /// The word alone.
    pub fn word(&self) -> &'static str {
        match self.word {
            Stability::Stable => "stable",
            Stability::Marginal => "marginal",
            Stability::Unstable => "UNSTABLE",
            Stability::Undecided => "not decided",
        }
    }

    /// What becomes of the motion of a pole that was found in floating point, per second; `fastest`: the size of the fastest one.
    pub fn motion(&self, pole: Complex, fastest: f64) -> Motion {
        let unsure = 1e-6 * fastest;
        let beside = |motion: &&BorderMotion| (motion.frequency - pole.im.abs()).abs() <= unsure;
        let on_border = self.border.iter().find(beside).filter(|_| pole.re.abs() <= unsure);
        match (self.word, on_border) {
            _ if !self.is_proven() && pole.re.abs() <= unsure => Motion::Unknown,
            (Stability::Stable, _) if self.is_proven() => Motion::Decays,
            (_, Some(motion)) if motion.grows() => Motion::Grows,
            (_, Some(_)) => Motion::Stays,
            _ if pole.re < -unsure => Motion::Decays,
            _ if pole.re > unsure => Motion::Grows,
            _ => Motion::Unknown,
        }
    }
}

/// What becomes of a motion of the closed loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// It dies out.
    Decays,
    /// It stays: exactly on the imaginary axis.
    Stays,
    /// It grows.
    Grows,
    /// Not decided: as near to the axis as floating point may be off.
    Unknown,
}

impl fmt::Display for StabilityVerdict {
    /// `marginal (decided exactly): an oscillation at 1 rad/s (2 poles)`
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())?;
        if self.word == Stability::Undecided {
            return if self.why.is_empty() { Ok(()) } else { write!(f, ": {}", self.why) };
        }
        f.write_str(match self.evidence {
            StabilityEvidence::Exactly => " (decided exactly)",
            StabilityEvidence::DespiteRounding => {
                " (decided exactly for the rounded numbers, and equal for the other last digits that were tried)"
            }
            StabilityEvidence::Certified => " (certified: poles bounded away from the stability boundary)",
            StabilityEvidence::Bounded => " (eigenvalues in floating point, their rounding bounded)",
            StabilityEvidence::Unknown => "",
        })?;
        if self.border.is_empty() {
            return Ok(());
        }
        let motions: Vec<String> = self.border.iter().map(BorderMotion::to_string).collect();
        write!(f, ": {}", motions.join(", "))
    }
}

/// Whether a linear system is stable, as JSON has it.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Stability")]
struct StabilityView {
    /// The word.
    stability: Stability,
    /// Whether all motions decay; `null` if it is not decided.
    stable: Option<bool>,
    /// How it is known.
    stability_evidence: StabilityEvidence,
    /// What lies on the border, where nothing lies outside.
    border_motions: Vec<BorderMotion>,
    /// Why it is not decided; empty if it is.
    not_decided_because: String,
}

impl From<StabilityVerdict> for StabilityView {
    fn from(verdict: StabilityVerdict) -> Self {
        Self {
            stability: verdict.word,
            stable: verdict.is_stable(),
            stability_evidence: verdict.evidence,
            border_motions: verdict.border,
            not_decided_because: verdict.why,
        }
    }
}
