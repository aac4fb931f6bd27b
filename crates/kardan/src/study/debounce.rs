//! Monitors that wait longer than a run takes.

use super::read::quantity;
use crate::diagnostics::{Diagnostic, shortened};
use crate::model::{Document, TableReader};
use crate::schema::Sign;
use crate::units::Dimension;

/// Warns of monitors whose `debounce` no run lasts, by the ends of the runs, s.
pub(super) fn late_monitors(document: &Document, ends: &[(String, f64)], out: &mut Vec<Diagnostic>) {
    let longest = ends.iter().map(|(_, end)| *end).fold(0.0, f64::max);
    if document.suppressed.durations || !longest.is_finite() || ends.is_empty() {
        return;
    }
    let reader = TableReader::new(document, &[]);
    for block in document.blocks.iter().filter(|block| block.kind.keyword == "monitor") {
        let what = format!("block `{}`", shortened(&block.name));
        // What is wrong with them was told.
        let time = |key: &str| {
            let expected = (Dimension::TIME, Sign::NonNegative);
            quantity(&reader, &block.table, key, expected, &what, &mut Vec::new()).map(|x| x.to_f64())
        };
        // The last of as many samples as fill it is nearer than that.
        let Some((debounce, period)) = time("debounce").zip(time("sample_time")) else { continue };
        if debounce <= longest + period {
            continue;
        }
        let message = format!(
            "{what}: an alarm would come after `debounce` of {debounce} s, and the longest run ends at {longest} s, \
             so no alarm can come"
        );
        let place = TableReader::place(&block.table, "debounce");
        let diagnostic = Diagnostic::warning("block::monitor", message).at(place, "longer than every run");
        out.push(diagnostic.help("shorten it, or lengthen `duration`"));
    }
}
