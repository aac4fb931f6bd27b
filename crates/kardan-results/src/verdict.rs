//! Verdicts on results in one sentence.

use super::{Design, Feedback, LoopAlongPath, Motion, Pole, Stability, ZeroDynamics};

/// A verdict.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Verdict {
    /// Whether it is good without reservations.
    pub sound: bool,
    /// In one sentence.
    pub text: String,
}

impl Design {
    /// The verdict in one sentence; `sound` if the loop is decoupled (or decoupling was not requested), stable, and without low
    /// margins.
    pub fn verdict(&self) -> Verdict {
        let impossible = self.decouplability.possible == Feedback::Impossible;
        let in_blocks = self.blocks_decoupled == Some(true) && self.decouplability.blocks.len() > 1;
        let (decoupled, first) = match (self.decoupled, self.feedback) {
            (Some(false), _) if in_blocks => (true, "Decoupled in blocks by static state feedback"),
            (Some(true), Some(Feedback::Static)) => (true, "Decoupled by static state feedback"),
            (Some(true), Some(Feedback::Block)) => (true, "Decoupled in blocks by static state feedback"),
            (Some(true), Some(Feedback::Dynamic)) => (true, "Decoupled by dynamic state feedback"),
            (Some(true), _) => (true, "Decoupled"),
            (Some(false), _) => (false, "Not decoupled"),
            (None, _) if impossible => (false, "The outputs cannot be decoupled"),
            (None, _) => (true, "Designed; decoupling was not requested"),
        };
        let claimed = first.starts_with("Decoupled");
        let first = if claimed { format!("{first}, {}", proven(self)) } else { first.to_string() };
        let own = self.loop_along_path.as_ref().map(|found| opposite_text(found, claimed)).unwrap_or_default();
        let decoupled = decoupled && self.loop_along_path.as_ref().is_none_or(|found| !claimed || found.acceptable());
        let grows = self.closed_loop_poles.iter().any(|&pole| self.motion(pole) == Motion::Grows);
        let hidden = match self.zero_dynamics.kind() {
            _ if !self.cancels_zeros => "",
            HiddenMotion::Unknown => "",
            HiddenMotion::None => "; no zero dynamics",
            HiddenMotion::Some => match self.zero_dynamics.stability.word {
                Stability::Stable => "; the zero dynamics are stable",
                Stability::Marginal => "; the zero dynamics are marginal",
                Stability::Unstable => "; the zero dynamics are not stable",
                Stability::Undecided => "; whether the zero dynamics are stable is not decided",
            },
        };
        // A law that does not invert the plant does not cancel its zeros.
        let stable =
            !self.cancels_zeros || self.zero_dynamics.is_stable() || self.zero_dynamics.kind() != HiddenMotion::Some;
        let loop_ = self.describe_stability(grows);
        let grows = grows || self.margins.as_ref().is_some_and(|margins| margins.stable == Some(false));
        let opposite = match &self.opposite_side {
            Some(found) if found.margins.stable == Some(false) && !grows => {
                format!(" on the side where {}, unstable where {}", found.reference_side, found.side)
            }
            Some(found) => format!(" on the side where {}", found.reference_side),
            None => String::new(),
        };
        let grows = grows || self.opposite_side.as_ref().is_some_and(|found| found.margins.stable == Some(false));
        let at_limit = self.motor_loads.iter().any(|found| found.motor_load.at_limit());
        let at_limit = if at_limit { "; the scenario drives its motors to their limits" } else { "" };
        let warnings = counted(&self.warnings);
        let grows = grows || self.loop_along_path.as_ref().is_some_and(|found| !found.stable);
        let early = early(self.incomplete_reason.as_deref());
        let low_margins = self.margins.as_ref().is_some_and(|margins| margins.low_margins);
        let good = decoupled && stable && !grows && !low_margins && self.incomplete_reason.is_none();
        Verdict { sound: good, text: format!("{early}{first}{own}{loop_}{opposite}{hidden}{at_limit}{warnings}.") }
    }

    /// Poles without those of integrators without effect (charges), which no output shows: as many at zero.
    pub fn without_integrals(&self, mut poles: Vec<Pole>) -> Vec<Pole> {
        for _ in &self.integrals_without_effect {
            let at_zero = poles.iter().position(|pole| *pole == Pole::default());
            at_zero.map(|place| poles.remove(place));
        }
        poles
    }

    /// Whether the loop is stable, as a part of a sentence; `grows`: a pole is unstable.
    fn describe_stability(&self, grows: bool) -> String {
        let Some(margins) = &self.margins else {
            return match (grows, self.exact_poles) {
                (false, _) => String::new(),
                (true, true) => "; the closed loop is unstable".into(),
                (true, false) => "; the closed loop is unstable (in floating point)".into(),
            };
        };
        let (at, all) = match margins.sample_time {
            Some(_) => ("at its sample time", "at its sample times"),
            None => ("in continuous time", "in continuous time"),
        };
        let low = if margins.low_margins { ", with low margins" } else { "" };
        let (free, undecided) = match margins.uncontrolled_poles {
            0 => (String::new(), "a pole is at the border to rounding".into()),
            1 => {
                (" except for a pole at zero of an uncontrolled motion".into(), "a pole is at zero to rounding".into())
            }
            poles => {
                let free = format!(" except for {poles} poles at zero of uncontrolled motions");
                (free, format!("{poles} poles are at zero to rounding"))
            }
        };
        match (margins.stable, margins.stability.word) {
            (_, Stability::Unstable) => format!("; {at} the loop is unstable"),
            (Some(false), _) => format!("; {at} the loop is marginal"),
            (None, _) => format!("; whether it is stable {all} is not known"),
            (Some(true), Stability::Undecided) => {
                format!("; whether it is stable {at} is not decided: {undecided}, all others decay{low}")
            }
            (Some(true), _) => format!("; stable {at}{free}{low}"),
        }
    }

    /// The motion of a pole of the closed loop: exact for exact poles. Others decide nothing within a millionth of the fastest one around the
    /// axis, where rounding moves multiple poles at zero; there the verdict on the loop decides.
    pub fn motion(&self, pole: Pole) -> Motion {
        let verdict = self.margins.as_ref().map(|margins| margins.stability.clone()).unwrap_or_default();
        let fastest = self.closed_loop_poles.iter().map(|pole| pole.abs()).fold(0.0, f64::max);
        match pole.re {
            _ if !self.exact_poles => verdict.motion(pole, fastest),
            re if re < 0.0 => Motion::Decays,
            re if re > 0.0 => Motion::Grows,
            _ if verdict.border.iter().any(|motion| motion.grows() && motion.is_of(pole)) => Motion::Grows,
            _ => Motion::Stays,
        }
    }
}

impl ZeroDynamics {
    /// Whether the zero dynamics are stable.
    pub fn is_stable(&self) -> bool {
        self.stability.is_stable() == Some(true)
    }

    /// Whether there are zero dynamics.
    pub fn kind(&self) -> HiddenMotion {
        match self.polynomial.as_str() {
            "" if self.modes.is_empty() => HiddenMotion::Unknown,
            "" | "1" if self.modes.is_empty() => HiddenMotion::None,
            _ => HiddenMotion::Some,
        }
    }
}

/// Whether there is motion while all outputs are zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HiddenMotion {
    /// Not requested.
    Unknown,
    /// There is none.
    None,
    /// There is some.
    Some,
}

/// `; 2 warnings`
pub(super) fn counted(warnings: &[String]) -> String {
    match warnings.len() {
        0 => String::new(),
        1 => "; 1 warning".into(),
        many => format!("; {many} warnings"),
    }
}

/// Prefix of a verdict on a computation that ended early.
pub(super) fn early(unfinished: Option<&str>) -> String {
    unfinished.map_or(String::new(), |why| format!("NOT COMPLETE, {why}. "))
}

/// Scope of the proof: `proven exactly`, with its conditions.
fn proven(design: &Design) -> &'static str {
    if !design.rounded.is_empty() {
        return "proven for the linear design model with rounded rows of its constraints";
    }
    match (&design.loop_along_path, &design.observer) {
        (None, None) => "proven exactly",
        (None, Some(_)) => "proven exactly for the true state",
        (Some(_), None) => "proven exactly for the linear design model",
        (Some(_), Some(_)) => "proven exactly for the linear design model and the true state",
    }
}

/// The loop with the parameters of the variant, as a part of a sentence.
fn opposite_text(found: &LoopAlongPath, claimed: bool) -> String {
    let how = if found.rotated_coordinates.is_empty() {
        "with the parameters of the variant"
    } else {
        "at the joint positions of the variant"
    };
    match found.worst() {
        _ if !found.stable => format!("; {how} the loop is unstable"),
        Some(worst) if claimed && worst.largest > worst.acceptable => format!("; {how} it is coupled"),
        Some(_) if claimed => format!("; {how} the coupling is acceptable"),
        _ => String::new(),
    }
}
