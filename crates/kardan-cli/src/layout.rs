//! Text in 100 columns: headings, paragraphs and tables.

use std::fmt::Write;

pub const WIDTH: usize = 100;

/// The title of a section.
pub fn heading(out: &mut String, title: &str) {
    let _ = writeln!(out, "\n{title}");
}

/// A paragraph, wrapped and indented.
pub fn sentence(out: &mut String, text: &str) {
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let options = textwrap::Options::new(WIDTH).initial_indent("  ").subsequent_indent("    ");
    let _ = writeln!(out, "{}", textwrap::fill(&text, options));
}

/// How a column stands.
#[derive(Clone, Copy, PartialEq)]
enum Column {
    /// Text, broken into lines where the table would be too wide.
    Text,
    /// Right-aligned, never broken.
    Number,
}

/// A table as wide as its contents, at most [`WIDTH`]: the widest texts give way. A header that starts with `#` stands
/// above numbers.
pub fn table(out: &mut String, headers: &[&str], rows: &[Vec<String>], limit: usize) {
    let columns: Vec<Column> =
        headers.iter().map(|header| if header.starts_with('#') { Column::Number } else { Column::Text }).collect();
    let headers: Vec<String> =
        headers.iter().map(|header| header.strip_prefix('#').unwrap_or(header).to_owned()).collect();
    let shown = &rows[..rows.len().min(limit)];
    let width = |k: usize| {
        let cells = shown.iter().chain([&headers]).filter_map(|row| row.get(k));
        cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let mut widths: Vec<usize> = (0..headers.len()).map(width).collect();
    while 2 * widths.len() + widths.iter().sum::<usize>() > WIDTH {
        let texts = widths.iter_mut().zip(&columns).filter(|(_, column)| **column == Column::Text);
        match texts.map(|(width, _)| width).max() {
            Some(widest) if *widest > 8 => *widest -= 1,
            _ => break,
        }
    }
    let titled = headers.iter().any(|header| !header.is_empty());
    for row in titled.then_some(&headers).into_iter().chain(shown) {
        let cells: Vec<Vec<String>> = row.iter().zip(&widths).map(|(cell, &width)| lines(cell, width)).collect();
        for k in 0..cells.iter().map(Vec::len).max().unwrap_or(0) {
            let mut line = String::new();
            for ((cell, &width), column) in cells.iter().zip(&widths).zip(&columns) {
                let part = cell.get(k).map_or("", String::as_str);
                let _ = match column {
                    Column::Text => write!(line, "  {part:width$}"),
                    Column::Number => write!(line, "  {part:>width$}"),
                };
            }
            let _ = writeln!(out, "{}", line.trim_end());
        }
    }
    more(out, rows.len(), limit);
}

/// Says how many rows were not shown.
pub fn more(out: &mut String, all: usize, shown: usize) {
    if all > shown {
        let _ = writeln!(out, "  … and {} more; --json gives all", all - shown);
    }
}

/// The lines of a cell; hard spaces do not break, and become plain ones.
fn lines(cell: &str, width: usize) -> Vec<String> {
    textwrap::wrap(cell, width.max(1)).iter().map(|line| line.replace('\u{a0}', " ")).collect()
}

/// The text, shortened to that many characters.
pub fn cut(text: &str, width: usize) -> String {
    if text.chars().count() <= width {
        return text.to_owned();
    }
    text.chars().take(width.saturating_sub(1)).chain(['…']).collect()
}
