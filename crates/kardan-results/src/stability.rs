//! Stability of a linear system: verdict, evidence, and motions on the stability boundary.

use std::fmt;

use schemars::JsonSchema;
use serde::Serialize;

use super::Complex;

/// Location of the poles of a linear system; in discrete time the boundary is the unit circle instead of the imaginary axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Stability {
    /// All of them inside.
    Stable,
    /// None outside, some on the boundary, and these semisimple: no motion grows, and not all decay.
    Marginal,
    /// Some outside, or not semisimple on the boundary, which grows like a power of the time.
    Unstable,
    /// Not decided.
    #[default]
    #[serde(rename = "not decided")]
    Undecided,
}

/// The evidence of a [`Stability`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub enum StabilityEvidence {
    /// Over the rationals.
    #[serde(rename = "exactly")]
    Exactly,
    /// Over the rationals, and the same for some other last digits of rounded numbers, drawn at random: a sample, no proof.
    #[serde(rename = "exactly, and the same for other last digits of rounded numbers that were tried")]
    DespiteRounding,
    /// From a bound on the distance of the poles to the boundary: exponentials to hundreds of digits.
    #[serde(rename = "by certified bounds")]
    Certified,
    /// From eigenvalues in floating point, farther from the boundary than their rounding.
    #[serde(rename = "floating point, rounding bounded")]
    Bounded,
    /// The same, also for some other slopes within their rounding, drawn at random: a sample, no proof.
    #[serde(rename = "floating point, and the same for other slopes within their rounding that were tried")]
    Tried,
    /// Not decided.
    #[default]
    #[serde(rename = "not known")]
    Unknown,
}

/// A motion on the stability boundary.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, JsonSchema)]
pub struct BorderMotion {
    /// Its frequency, rad/s (of a system without sample time per sample); 0: a free motion, or a constant.
    #[serde(rename = "rad_per_s")]
    pub frequency: f64,
    /// Its number of poles, both of a pair.
    pub poles: usize,
    /// The power of the time with which it grows; 0: it does not grow.
    pub growth_exponent: usize,
    /// Whether it is an uncontrolled part that moves on at constant speed, which does not count as growth.
    pub uncontrolled: bool,
}

impl BorderMotion {
    /// Whether an exact pole on the imaginary axis belongs to it.
    pub fn is_of(&self, pole: Complex) -> bool {
        (self.frequency - pole.im.abs()).abs() <= 1e-12 * self.frequency
    }

    /// Whether it grows, except for the angle of a free part.
    pub fn grows(&self) -> bool {
        self.growth_exponent > 0 && !self.uncontrolled
    }
}

impl fmt::Display for BorderMotion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let poles = if self.poles == 1 { "1 pole".to_string() } else { format!("{} poles", self.poles) };
        match (self.frequency, self.uncontrolled) {
            (0.0, true) if self.growth_exponent > 0 => write!(f, "a free motion at constant speed ({poles} at zero)")?,
            (0.0, true) => write!(f, "a free motion ({poles} at zero)")?,
            (0.0, false) => write!(f, "a motion that does not decay ({poles} at zero)")?,
            (frequency, _) => write!(f, "an oscillation at {frequency:.6} rad/s ({poles})")?,
        }
        match self.growth_exponent {
            _ if self.uncontrolled => Ok(()),
            0 => Ok(()),
            1 => f.write_str(" that grows like t"),
            power => write!(f, " that grows like t^{power}"),
        }
    }
}

/// The stability of a linear system with its evidence; all outputs print this.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
#[serde(into = "StabilityView")]
#[schemars(with = "StabilityView")]
pub struct StabilityVerdict {
    /// The word.
    pub word: Stability,
    /// The evidence.
    pub evidence: StabilityEvidence,
    /// Motions on the boundary, if no pole is outside.
    pub border: Vec<BorderMotion>,
    /// Why it is not decided, as a part of a sentence.
    pub why: String,
}

impl StabilityVerdict {
    /// Decided over the rationals from the poles outside and those on the boundary.
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

    /// A verdict without motions on the boundary.
    pub fn plain(word: Stability, evidence: StabilityEvidence) -> Self {
        Self { word, evidence, ..Self::default() }
    }

    /// Stable except for free parts with this number of poles at zero (at one of a map).
    pub fn free(poles: usize) -> Self {
        Self::exact(false, vec![BorderMotion { frequency: 0.0, poles, growth_exponent: 0, uncontrolled: true }])
    }

    /// Not decided, and why.
    pub fn undecided(why: impl Into<String>) -> Self {
        Self { why: why.into(), ..Self::default() }
    }

    /// The verdict on a nonlinear system by its linearisation: not decided with poles on the boundary and none outside.
    #[must_use]
    pub fn of_linearisation(self) -> Self {
        let controlled = self.excluding_free();
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

    /// The same without the motions of free parts.
    pub fn excluding_free(&self) -> Self {
        let border: Vec<BorderMotion> = self.border.iter().copied().filter(|motion| !motion.uncontrolled).collect();
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

    /// The motion of a pole computed in floating point, per second; `fastest`: the magnitude of the fastest one.
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

/// The behaviour of a motion of the closed loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// It decays.
    Decays,
    /// It neither decays nor grows: exactly on the imaginary axis.
    Stays,
    /// It grows.
    Grows,
    /// Not decided: nearer to the axis than the floating-point error.
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
            StabilityEvidence::Tried => {
                " (eigenvalues in floating point, equal for the other slopes within their rounding that were tried)"
            }
            StabilityEvidence::Unknown => "",
        })?;
        if self.border.is_empty() {
            return Ok(());
        }
        let motions: Vec<String> = self.border.iter().map(BorderMotion::to_string).collect();
        write!(f, ": {}", motions.join(", "))
    }
}

/// The stability of a linear system in JSON.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Stability")]
struct StabilityView {
    /// The word.
    stability: Stability,
    /// Whether all motions decay; `null` if it is not decided.
    stable: Option<bool>,
    /// The evidence.
    stability_method: StabilityEvidence,
    /// Motions on the boundary, if no pole is outside.
    boundary_modes: Vec<BorderMotion>,
    /// Why it is not decided; empty if it is.
    undecided_reason: String,
}

impl From<StabilityVerdict> for StabilityView {
    fn from(verdict: StabilityVerdict) -> Self {
        Self {
            stability: verdict.word,
            stable: verdict.is_stable(),
            stability_method: verdict.evidence,
            boundary_modes: verdict.border,
            undecided_reason: verdict.why,
        }
    }
}
