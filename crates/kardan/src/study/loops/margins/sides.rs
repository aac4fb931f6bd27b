//! Kinks and jumps of the model, the laws and the blocks of a loop at its operating point.

use std::collections::BTreeSet;

use crate::study::PreparedVariant;
use crate::study::check::kinks::Kinks;
use crate::study::loops::loop_blocks;
use kardan_mechanics::reduce::law_slopes_at;
use kardan_schema::diagnostics::quoted;

/// The guards that vanish where a loop has a kink, and where it jumps, at its operating point.
pub(in crate::study) struct LoopKinks {
    pub kinks: Kinks,
    jumps: Vec<String>,
}

impl LoopKinks {
    /// Those of the torques and the laws of a variant, and of the blocks that its loop closes through.
    pub(in crate::study) fn of(variant: &PreparedVariant) -> Self {
        let laws = variant.implemented.iter().flat_map(|law| law.kinks());
        let blocks = loop_blocks::blocks(variant, &variant.loop_plant()).of_loop;
        let slopes = law_slopes_at(&variant.reduced, &variant.point);
        let mut guards: BTreeSet<String> = slopes.into_iter().flat_map(|one| one.kinks).collect();
        let mut jumps = BTreeSet::new();
        for [kinks, jumping] in laws.chain(blocks.kinks().iter().cloned()) {
            guards.extend(kinks);
            jumps.extend(jumping);
        }
        Self { kinks: Kinks { guards }, jumps: jumps.into_iter().collect() }
    }

    /// That the loop has no derivative where it jumps.
    pub(in crate::study) fn jump_note(&self) -> Option<String> {
        (!self.jumps.is_empty()).then(|| {
            format!(
                "The loop jumps at its operating point, where {} = 0: it has no linear model there. Its stability \
                 and margins do not include the jump; a run shows its effect",
                quoted(&self.jumps)
            )
        })
    }

    /// The side that the verdict is for, if the loop has a kink.
    pub(in crate::study) fn kink_note(&self) -> Option<String> {
        self.kinks.opposite().map(|_| self.kinks.explained("The loop", "poles and margins"))
    }
}
