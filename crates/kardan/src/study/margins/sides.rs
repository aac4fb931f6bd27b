//! Where the laws and the blocks of a loop bend or jump at its operating point.

use std::collections::BTreeSet;

use crate::diagnostics::quoted;
use crate::expr::Side;
use crate::study::PreparedVariant;
use crate::study::loop_blocks::loop_blocks;

/// What vanishes where a loop bends, and where it jumps, at its operating point.
pub(in crate::study) struct LoopKinks {
    bends: Vec<String>,
    jumps: Vec<String>,
}

impl LoopKinks {
    /// Those of the laws of a variant, and of the blocks that its loop closes through.
    pub(in crate::study) fn of(variant: &PreparedVariant) -> Self {
        let laws = variant.running.iter().flat_map(|law| law.kinks());
        let blocks = loop_blocks(variant, &variant.loop_plant());
        let (mut bends, mut jumps) = (BTreeSet::new(), BTreeSet::new());
        for [bent, jumping] in laws.chain(blocks.kinks().iter().cloned()) {
            bends.extend(bent);
            jumps.extend(jumping);
        }
        Self { bends: bends.into_iter().collect(), jumps: jumps.into_iter().collect() }
    }

    /// The opposite side of all that bends; `None`: nothing does.
    pub(in crate::study) fn opposite(&self) -> Option<Side> {
        (!self.bends.is_empty()).then(|| Side { below: self.bends.iter().cloned().collect() })
    }

    /// A side in words.
    pub(in crate::study) fn words(&self, side: &Side) -> String {
        let sign = |guard: &String| if side.below.contains(guard) { "<" } else { ">" };
        let all: Vec<String> = self.bends.iter().map(|guard| format!("`{guard}` {} 0", sign(guard))).collect();
        all.join(" and ")
    }

    /// That the loop has no derivative where it jumps.
    pub(in crate::study) fn jumps_in_words(&self) -> Option<String> {
        (!self.jumps.is_empty()).then(|| {
            format!(
                "The loop jumps at its operating point, where {} = 0: it has no linear model there. What is said of its stability and its margins \
                 leaves the jump out; a run shows what it does",
                quoted(self.jumps.iter().map(String::as_str))
            )
        })
    }

    /// What the verdict is about, where the loop bends.
    pub(in crate::study) fn bends_in_words(&self) -> Option<String> {
        (!self.bends.is_empty()).then(|| {
            let others = match self.bends.len() {
                1 => "",
                _ => "; of sides on which only some of these change sign nothing is said",
            };
            format!(
                "The loop bends at its operating point: the poles and margins are those of the side where {}; on the side where {} they are told beside \
                 them. A motion goes through both sides, and that each is stable does not prove that it is{others}",
                self.words(&Side::default()),
                self.words(&self.opposite().unwrap_or_default())
            )
        })
    }
}
