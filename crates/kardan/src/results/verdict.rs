//! What is said of a result in one sentence.

use super::{Design, Feedback, Margins, Passage, Pole, ZeroDynamics};

/// What came of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Verdict {
    /// Whether nothing stands against it.
    pub sound: bool,
    /// In one sentence.
    pub text: String,
}

impl Design {
    /// What came of it in one sentence; `true` if the loop is decoupled (or nobody claimed it), nothing grows, and it is not hardly
    /// stable.
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
            (None, _) => (true, "Designed; it is not claimed to decouple"),
        };
        let claimed = first.starts_with("Decoupled");
        let first = if claimed { format!("{first}, {}", proven(self)) } else { first.to_string() };
        let own = self.passage.as_ref().map(|found| there(found, claimed)).unwrap_or_default();
        let decoupled = decoupled && self.passage.as_ref().is_none_or(|found| !claimed || found.acceptable());
        let grows = self.closed_loop_poles.iter().any(|&pole| self.motion(pole) == Motion::Grows);
        let hidden = match self.zero_dynamics.kind() {
            _ if !self.cancels_zeros => "",
            HiddenMotion::Unknown => "",
            HiddenMotion::None => "; no zero dynamics",
            HiddenMotion::Some if self.zero_dynamics.stable => "; the zero dynamics are stable",
            HiddenMotion::Some => "; the zero dynamics are not stable",
        };
        // A law that does not invert the plant leaves its zeros alone.
        let stable =
            !self.cancels_zeros || self.zero_dynamics.stable || self.zero_dynamics.kind() != HiddenMotion::Some;
        let sampled = self.margins.as_ref().filter(|margins| margins.sample_time.is_some());
        let loop_ = match sampled {
            Some(margins) if margins.stable == Some(false) => "; at its sample time the loop is unstable",
            _ if grows && self.exact_poles => "; the closed loop is unstable",
            _ if grows => "; the closed loop is unstable, as floating point tells",
            Some(Margins { stable: None, .. }) => "; whether it is stable at its sample times is not known",
            Some(Margins { hardly: true, .. }) => "; stable at its sample time, but hardly",
            Some(_) => "; stable at its sample time",
            None => match &self.margins {
                Some(Margins { stable: Some(false), .. }) => "; in continuous time the loop is unstable",
                Some(Margins { stable: None, .. }) => "; whether it is stable in continuous time is not known",
                Some(Margins { hardly: true, .. }) => "; stable in continuous time, but hardly",
                Some(_) => "; stable in continuous time",
                None => "",
            },
        };
        let grows = grows || self.margins.as_ref().is_some_and(|margins| margins.stable == Some(false));
        let opposite = match &self.opposite_side {
            Some(found) if found.margins.stable == Some(false) && !grows => {
                format!(" on the side where {}, unstable where {}", found.own, found.side)
            }
            Some(found) => format!(" on the side where {}", found.own),
            None => String::new(),
        };
        let grows = grows || self.opposite_side.as_ref().is_some_and(|found| found.margins.stable == Some(false));
        let strained = self.strains.iter().any(|found| found.strain.strained());
        let strained = if strained { "; the scenario drives its motors to their limits" } else { "" };
        let warnings = counted(&self.warnings);
        let grows = grows || self.passage.as_ref().is_some_and(|found| !found.stable);
        let early = early(self.unfinished.as_deref());
        let hardly = self.margins.as_ref().is_some_and(|margins| margins.hardly);
        let good = decoupled && stable && !grows && !hardly && self.unfinished.is_none();
        Verdict { sound: good, text: format!("{early}{first}{own}{loop_}{opposite}{hidden}{strained}{warnings}.") }
    }

    /// The motion of a pole of the closed loop: exact for exact poles. Eigenvalues in floating point decide nothing within a
    /// millionth of the fastest one around the axis, where rounding puts multiple poles at zero.
    pub fn motion(&self, pole: Pole) -> Motion {
        let fastest = self.closed_loop_poles.iter().map(|pole| pole.abs()).fold(0.0, f64::max);
        let unsure = if self.exact_poles { 0.0 } else { 1e-6 * fastest };
        match pole.re {
            re if re < -unsure => Motion::Decays,
            re if re > unsure => Motion::Grows,
            _ if self.exact_poles => Motion::Stays,
            _ => Motion::Unknown,
        }
    }
}

impl ZeroDynamics {
    /// Whether there are motions behind the outputs.
    pub fn kind(&self) -> HiddenMotion {
        match self.polynomial.as_str() {
            "" if self.modes.is_empty() => HiddenMotion::Unknown,
            "" | "1" if self.modes.is_empty() => HiddenMotion::None,
            _ => HiddenMotion::Some,
        }
    }
}

/// Whether something moves while the outputs are held still.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HiddenMotion {
    /// It was not asked.
    Unknown,
    /// There are none.
    None,
    /// There are some.
    Some,
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

/// `; 2 warnings`
pub(super) fn counted(warnings: &[String]) -> String {
    match warnings.len() {
        0 => String::new(),
        1 => "; 1 warning".into(),
        many => format!("; {many} warnings"),
    }
}

/// What stands before a verdict on something that ended early.
pub(super) fn early(unfinished: Option<&str>) -> String {
    unfinished.map_or(String::new(), |why| format!("NOT COMPLETE, {why}. "))
}

/// How far the proof reaches: `proven exactly`, with its conditions.
fn proven(design: &Design) -> &'static str {
    if !design.rounded.is_empty() {
        return "proven for the linear design model with rounded rows of its constraints";
    }
    match (&design.passage, &design.observer) {
        (None, None) => "proven exactly",
        (None, Some(_)) => "proven exactly for the true state",
        (Some(_), None) => "proven exactly for the linear design model",
        (Some(_), Some(_)) => "proven exactly for the linear design model and the true state",
    }
}

/// What the loop with the parameters of the variant does, as a part of a sentence.
fn there(found: &Passage, claimed: bool) -> String {
    let how =
        if found.turned.is_empty() { "with the parameters of the variant" } else { "where the variant's joints stand" };
    match found.worst() {
        _ if !found.stable => format!("; {how} the loop is unstable"),
        Some(worst) if claimed && worst.largest > worst.acceptable => format!("; {how} it is coupled"),
        Some(_) if claimed => format!("; {how} the coupling is acceptable"),
        _ => String::new(),
    }
}
