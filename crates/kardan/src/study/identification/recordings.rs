//! Files recorded together, and the table that describes each.

use super::settings::LogFile;
use crate::study::read::read_values::read_word;
use kardan_model::Document;
use kardan_schema::diagnostics::{Diagnostic, quoted};

/// Whether a file name fits a pattern with `*` and `?`.
fn fits(pattern: &str, name: &str) -> bool {
    let (pattern, name): (Vec<char>, Vec<char>) = (pattern.chars().collect(), name.chars().collect());
    // reach[k]: the pattern so far fits the first k characters.
    let mut reach = vec![false; name.len() + 1];
    reach[0] = true;
    for &p in &pattern {
        if p == '*' {
            for k in 1..reach.len() {
                reach[k] |= reach[k - 1];
            }
        } else {
            for k in (1..reach.len()).rev() {
                reach[k] = reach[k - 1] && (p == '?' || p == name[k - 1]);
            }
            reach[0] = false;
        }
    }
    reach[name.len()]
}

/// A name without its folders.
pub(super) fn base(name: &str) -> &str {
    name.rsplit(['/', '\\']).next().unwrap_or(name)
}

/// The number of the table that describes a file: the first match.
pub(super) fn table_of(document: &Document, name: &str) -> Option<usize> {
    document.logs.iter().position(|(_, table)| {
        read_word(table, "file").is_none_or(|pattern| fits(pattern, base(name)) || fits(pattern, name))
    })
}

/// The files in groups that were recorded together: one of each `[log.NAME]` table, in the order given.
pub(super) fn recordings(document: &Document, files: Vec<LogFile>) -> Result<Vec<Vec<LogFile>>, Vec<Diagnostic>> {
    let tables = document.logs.len();
    if tables < 2 {
        return Ok(files.into_iter().map(|file| vec![file]).collect());
    }
    let mut of_table: Vec<Vec<LogFile>> = (0..tables).map(|_| Vec::new()).collect();
    let mut out = Vec::new();
    for file in files {
        match table_of(document, &file.name) {
            Some(k) => of_table[k].push(file),
            None => {
                let patterns = document.logs.iter().filter_map(|(_, table)| read_word(table, "file"));
                let message = format!("no `[log.NAME]` describes `{}`", file.name);
                let help = format!("their files are {}", quoted(patterns));
                out.push(Diagnostic::error("log::no-table", message).help(help));
            }
        }
    }
    let used: Vec<usize> = (0..tables).filter(|&k| !of_table[k].is_empty()).collect();
    let count = used.first().map_or(0, |&k| of_table[k].len());
    if used.iter().any(|&k| of_table[k].len() != count) {
        let each: Vec<String> =
            used.iter().map(|&k| format!("{} of `{}`", of_table[k].len(), document.logs[k].0)).collect();
        let message = format!("kardan joins files of several `[log.NAME]` by time, but there are {}", each.join(", "));
        out.push(Diagnostic::error("log::unpaired", message).help("give the same number of each, in the same order"));
    }
    if !out.is_empty() {
        return Err(out);
    }
    let mut rows: Vec<Vec<LogFile>> = (0..count).map(|_| Vec::new()).collect();
    for list in of_table {
        for (row, file) in rows.iter_mut().zip(list) {
            row.push(file);
        }
    }
    Ok(rows)
}

#[cfg(test)]
#[path = "../../../tests/unit/study/identification/recordings.rs"]
mod tests;
