//! The side of the kinks of a model that its linearisation belongs to, as text.

use std::collections::BTreeSet;

use kardan_expr::expr::Side;

/// The guards that vanish at an operating point and have different slopes on their two sides.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(in crate::study) struct Kinks {
    pub guards: BTreeSet<String>,
}

impl Kinks {
    /// The side on which all guards have the opposite sign; `None`: there is no kink.
    pub(in crate::study) fn opposite(&self) -> Option<Side> {
        (!self.guards.is_empty()).then(|| Side { below: self.guards.clone() })
    }

    /// A side as text: ``a.phi` > 0`.
    pub(in crate::study) fn description(&self, side: &Side) -> String {
        let sign = |guard: &String| if side.below.contains(guard) { "<" } else { ">" };
        let all: Vec<String> = self.guards.iter().map(|guard| format!("`{guard}` {} 0", sign(guard))).collect();
        all.join(" and ")
    }

    /// The side that is analysed first, and the opposite one, as text.
    pub(in crate::study) fn describe_sides(&self) -> [String; 2] {
        [Side::default(), self.opposite().unwrap_or_default()].map(|side| self.description(&side))
    }

    /// Explains which results belong to which side, for a model or a loop that has these kinks at its operating point.
    pub(in crate::study) fn explained(&self, whose: &str, results: &str) -> String {
        let count_text = match self.guards.len() {
            1 => "",
            _ => "; sides on which only some of these change their sign are not analysed",
        };
        let [own, opposite] = self.describe_sides();
        format!(
            "{whose} has a kink at its operating point: {results} are those of the side where {own}; those of the \
             side where {opposite} are listed too. A motion passes through both sides, and that each is stable does \
             not prove that it is{count_text}"
        )
    }
}
