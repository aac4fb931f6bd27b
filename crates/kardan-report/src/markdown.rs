//! A page as Markdown, with the tables of GitHub.

use super::model::{Alert, Block, Body, Cell, Chart, Page, Section, Table, Tone};
use super::prose::{Piece, pieces, rounded};
use kardan_results::bidi_escaped;

/// A matrix with more rows or columns is not shown.
const LARGE: usize = 40;
/// More rows of a table are counted, not shown.
const ROWS: usize = 100;
/// Digits of rounded entries of a matrix.
const DIGITS: usize = 9;

/// See [`Page::markdown`].
pub(super) fn markdown(page: &Page) -> String {
    let mut out = format!("# {}\n", escape(&page.name));
    for paragraph in page.description.split("\n\n").filter(|paragraph| !paragraph.trim().is_empty()) {
        out += &format!("\n{}\n", escape(paragraph));
    }
    if let Some(verdict) = &page.verdict {
        out += &format!("\n**{}**\n", escape(&verdict.text));
    }
    blocks(&mut out, &Body(page.alerts.iter().cloned().map(Block::Alert).collect()), 2);
    for Section { title, body, .. } in &page.sections {
        out += &format!("\n## {}\n", escape(title));
        blocks(&mut out, body, 3);
    }
    bidi_escaped(&out).into_owned()
}

fn blocks(out: &mut String, body: &Body, level: usize) {
    for block in &body.0 {
        match block {
            Block::Text(Tone::Plain, text) => *out += &format!("\n{}\n", escape(text)),
            Block::Text(Tone::Hint, text) => *out += &format!("\n*{}*\n", escape(text)),
            Block::Text(Tone::Good | Tone::Bad, text) => *out += &format!("\n**{}**\n", escape(text)),
            Block::Verdict(verdict) => *out += &format!("\n**{}**\n", escape(&verdict.text)),
            Block::Alert(Alert { kind, text }) => *out += &format!("\n> **{}:** {}\n", escape(kind), escape(text)),
            Block::List(texts) => {
                out.push('\n');
                texts.iter().for_each(|text| *out += &format!("- {}\n", escape(text)));
            }
            Block::Names(what, names) => {
                let codes: Vec<String> = names.iter().map(|name| code(&rounded(name))).collect();
                let codes = if codes.is_empty() { "none".into() } else { codes.join(", ") };
                *out += &format!("\n{} ({}): {codes}\n", escape(what), names.len());
            }
            Block::Table(found) => table(out, found),
            Block::Matrices(all) => {
                for one in all {
                    let (height, width) = (one.entries.len(), one.columns.len());
                    *out += &format!("\n**{}**\n", escape(&one.title));
                    if height.max(width) > LARGE {
                        *out += &format!("\n{height} × {width}: see the exported data.\n");
                        continue;
                    }
                    table(out, &one.table(0..width));
                }
            }
            Block::Part(Section { title, body, .. }) | Block::Fold(title, body) => {
                *out += &format!("\n{} {}\n", "#".repeat(level), escape(title));
                blocks(out, body, (level + 1).min(6));
            }
            Block::Detail(body) => blocks(out, body, level),
            // `kardan run` writes the plots beside the report.
            Block::Chart(Chart { title, anchor, caption, .. }) => {
                *out += &format!("\n![{}]({anchor}.svg)\n", escape(title));
                if !caption.is_empty() {
                    *out += &format!("\n*{}*\n", escape(caption));
                }
            }
            // Markdown has no drawings.
            Block::Picture(_) => {}
        }
    }
}

/// A table with as many cells in each row as there are columns.
fn table(out: &mut String, table: &Table) {
    out.push('\n');
    let mut line = |cells: &mut dyn Iterator<Item = String>| {
        out.push('|');
        cells.for_each(|cell| *out += &format!(" {cell} |"));
        out.push('\n');
    };
    let titles = table.columns.iter().map(|title| title.strip_prefix('#').unwrap_or(title));
    line(&mut titles.map(escape));
    line(&mut table.columns.iter().map(|title| if title.starts_with('#') { "---:" } else { "---" }.to_string()));
    let shown = ROWS.max(table.brief);
    for row in table.rows.iter().take(shown) {
        line(&mut row.iter().map(cell));
    }
    let rest = table.rows.len().saturating_sub(shown);
    if rest > 0 {
        *out += &format!("\n*{rest} more are in the exported data.*\n");
    }
}

fn cell(cell: &Cell) -> String {
    match cell {
        Cell::Text(text) | Cell::Span(text, _) => escape(text),
        Cell::Code(text) => code(&rounded(text)),
        Cell::Verbatim(text) => code(text),
        Cell::Mark(good, text) => format!("{} {}", if *good { "✓" } else { "✗" }, escape(text)),
        Cell::Under => String::new(),
        Cell::Entry(entry) => escape(&entry.rounded_text(DIGITS).0),
    }
}

/// A name or a formula as it is; a vertical line would end the cell of a table.
fn code(text: &str) -> String {
    let text: String = text.chars().filter(|&c| c != '`').map(|c| if c.is_control() { ' ' } else { c }).collect();
    if text.trim().is_empty() { String::new() } else { format!("`{}`", text.replace('|', "\\|")) }
}

/// The text on one line: text between backticks as code, long fractions as decimals, and other characters that Markdown
/// would interpret escaped by a backslash.
fn escape(text: &str) -> String {
    let text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    let mut out = String::with_capacity(text.len());
    for piece in pieces(&text) {
        match piece {
            Piece::Plain(text) => plain(text, &mut out),
            Piece::Code(text) => out += &code(&rounded(text)),
            Piece::Fraction(_, decimals) => out += &decimals,
        }
    }
    out
}

fn plain(text: &str, out: &mut String) {
    let mut before = ' ';
    let mut rest = text.chars().peekable();
    while let Some(c) = rest.next() {
        let inside = before.is_alphanumeric() && rest.peek().is_some_and(|next| next.is_alphanumeric());
        match c {
            '\\' | '`' | '*' | '<' | '>' | '[' | ']' | '|' | '#' | '~' | '&' | '$' => out.extend(['\\', c]),
            // Names often contain them, and Markdown ignores them within a word.
            '_' if !inside => out.extend(['\\', c]),
            '+' | '-' if out.is_empty() => out.extend(['\\', c]),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
        before = c;
    }
}
