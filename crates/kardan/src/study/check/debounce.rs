//! Monitors whose debounce time exceeds the duration of a run.

use crate::study::read::read_values::quantity;
use kardan_math::units::Dimension;
use kardan_model::{Document, TableReader};
use kardan_schema::diagnostics::{Diagnostic, shortened};
use kardan_schema::schema::Sign;

/// Warns of monitors whose `debounce` is longer than every run, by the ends of the runs, s.
pub(in crate::study) fn late_monitors(document: &Document, ends: &[(String, f64)], out: &mut Vec<Diagnostic>) {
    let longest = ends.iter().map(|(_, end)| *end).fold(0.0, f64::max);
    if document.suppressed.durations || !longest.is_finite() || ends.is_empty() {
        return;
    }
    let reader = TableReader::new(document, &[]);
    for block in document.blocks.iter().filter(|block| block.kind.keyword == "monitor") {
        let what = format!("block `{}`", shortened(&block.name));
        // Their errors have been reported.
        let time = |key: &str| {
            let expected = (Dimension::TIME, Sign::NonNegative);
            quantity(&reader, &block.table, key, expected, &what, &mut Vec::new()).map(|x| x.to_f64())
        };
        // The last of the samples that fill it comes earlier than that.
        let Some((debounce, period)) = time("debounce").zip(time("sample_time")) else { continue };
        if debounce <= longest + period {
            continue;
        }
        let message = format!(
            "{what}: an alarm would come after `debounce` of {debounce} s, and the longest run ends at {longest} s, \
             so no alarm can come"
        );
        let diagnostic = Diagnostic::warning("block::monitor", message)
            .at(block.table.place_of("debounce"), "longer than every run");
        out.push(diagnostic.help("shorten it, or lengthen `duration`"));
    }
}
