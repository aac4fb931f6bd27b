//! Tests of `src/text.rs`.

use super::*;

#[test]
fn no_cell_begins_like_a_formula_and_each_reads_back() {
    for text in ["=1+1", "+a", "-rack", "@x", "\t=1", "'=1", "''-1", "＝1", "'quoted'", "a-b", "", "'"] {
        let cell = csv_cell(text);
        assert!(!cell.starts_with(['=', '+', '-', '@', '\t', '＝']), "{cell}");
        assert_eq!(strip_guard(&cell), text);
    }
    assert_eq!(csv_cell("-1.5e-3"), "-1.5e-3");
}
