//! The recorded signals of the runs of a sweep.

use std::collections::BTreeSet;

use crate::study::Prepared;
use kardan_math::units::Expression;
use kardan_simulate::Recorded;

/// The signals of requirements and figures, with those that their expressions name; they are bit-identical to those of a run
/// that records all.
pub(super) fn recorded_signals(prepared: &Prepared) -> Recorded {
    let texts = prepared.measured().flat_map(|one| [Some(&one.signal), one.over.as_ref()]);
    let tracks = prepared.all().flat_map(|variant| &variant.computed.tracks);
    let texts = texts.chain(tracks.map(|track| Some(&track.cones.reached)));
    let mut names: BTreeSet<String> = BTreeSet::new();
    for text in texts.flatten() {
        if let Ok(law) = Expression::parse_law(text) {
            names.extend(law.names().into_iter().map(String::from));
        }
        names.insert(text.clone());
    }
    Recorded { names: names.into_iter().collect(), as_all: true }
}
