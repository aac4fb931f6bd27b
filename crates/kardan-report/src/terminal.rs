//! A page as text in so many columns.

use super::model::{Block, Body, Cell, Entry, Matrix, Page, Section, Table, Tone};
use super::prose::rounded;
use kardan_results::bidi_escaped;

/// Default and largest number of columns.
pub(super) const WIDTH: usize = 100;
/// Least number of columns.
const NARROWEST: usize = 30;
/// A matrix with more rows or columns is not shown.
const LARGE: usize = 24;
/// Longer names of rows and columns of a matrix are cut.
const NAME: usize = 16;
/// More names in a row are counted, not shown.
const NAMES: usize = 16;
/// More sentences of a list are counted, not shown.
const ITEMS: usize = 20;
/// Texts in a table are at least as wide.
const LEAST: usize = 8;
/// Digits of rounded entries of a matrix: enough to type them in.
const DIGITS: usize = 9;

/// See [`Page::text_of_width`].
pub(super) fn text(page: &Page, origin: &str, columns: usize) -> String {
    let width = columns.clamp(NARROWEST, WIDTH);
    let mut out = page.name.clone() + &if origin.is_empty() { String::new() } else { format!(" ({origin})") } + "\n";
    if let Some(first) = page.description.split("\n\n").map(str::trim).find(|text| !text.is_empty()) {
        sentence(&mut out, first, width);
    }
    let verdict = page.verdict.iter().cloned().map(Block::Verdict);
    let alerts = page.alerts.iter().cloned().map(Block::Alert);
    let first = Body(verdict.chain(alerts).collect());
    out += if first.0.is_empty() { "" } else { "\n" };
    blocks(&mut out, &first, width);
    for Section { title, body, .. } in &page.sections {
        let mut content = String::new();
        blocks(&mut content, body, width);
        if !content.is_empty() {
            out += &format!("\n{}\n{content}", textwrap::fill(title, wrapping(width)));
        }
    }
    // A terminal obeys control characters.
    let plain = |c: char| match c {
        '−' => '-',
        c if c.is_control() && c != '\n' => '?',
        c => c,
    };
    bidi_escaped(&out).chars().map(plain).collect()
}

/// See [`Page::text_on_screen`].
pub(super) fn on_screen(text: &str, lines: usize) -> String {
    let count = text.lines().count();
    if count <= lines {
        return text.into();
    }
    let first: Vec<&str> = text.lines().take(lines.saturating_sub(1)).collect();
    format!("{}\n… and {} more lines; --verbose prints them\n", first.join("\n"), count - first.len())
}

fn blocks(out: &mut String, body: &Body, width: usize) {
    for block in &body.0 {
        match block {
            Block::Text(Tone::Bad, text) => sentence(out, &format!("WARNING: {text}"), width),
            Block::Text(_, text) => sentence(out, text, width),
            Block::Verdict(verdict) => sentence(out, &verdict.text, width),
            Block::Alert(alert) => sentence(out, &format!("{}: {}", alert.kind.to_uppercase(), alert.text), width),
            Block::List(texts) => {
                texts.iter().take(ITEMS).for_each(|text| sentence(out, text, width));
                more(out, texts.len(), ITEMS);
            }
            Block::Names(what, names) => {
                let shown = if names.is_empty() { "none".into() } else { super::phrases::list(names, NAMES) };
                sentence(out, &format!("{what} ({}): {shown}", names.len()), width);
            }
            Block::Table(found) => table(out, found, width),
            // For a page within this one only the verdict is shown.
            Block::Part(part) if !part.anchor.is_empty() => {}
            Block::Matrices(all) => all.iter().for_each(|one| matrix(out, one, width)),
            Block::Part(Section { title, body, .. }) | Block::Fold(title, body) => {
                let mut content = String::new();
                blocks(&mut content, body, width);
                if !content.is_empty() {
                    sentence(out, &format!("{title}:"), width);
                    *out += &content;
                }
            }
            Block::Picture(_) | Block::Chart(_) | Block::Detail(_) => {}
        }
    }
}

/// Lines break at blanks alone: units such as `N m s/rad` contain other break points, and line breaks must not depend on the features that
/// other crates turn on.
fn wrapping<'a>(width: usize) -> textwrap::Options<'a> {
    textwrap::Options::new(width).word_separator(textwrap::WordSeparator::AsciiSpace)
}

/// A paragraph, wrapped and indented.
fn sentence(out: &mut String, text: &str, width: usize) {
    let text = rounded(&text.split_whitespace().collect::<Vec<_>>().join(" "));
    let options = wrapping(width).initial_indent("  ").subsequent_indent("    ");
    *out += &textwrap::fill(&text, options);
    out.push('\n');
}

/// Adds the number of rows not shown.
fn more(out: &mut String, all: usize, shown: usize) {
    if all > shown {
        *out += &format!("  … and {} more; --json gives all\n", all - shown);
    }
}

fn cell(cell: &Cell) -> String {
    match cell {
        Cell::Text(text) | Cell::Code(text) | Cell::Span(text, _) | Cell::Mark(true, text) => rounded(text),
        Cell::Verbatim(text) => text.clone(),
        // Units have no other case.
        Cell::Mark(false, text) if text.contains(|c: char| c.is_ascii_digit()) => format!("{text} (!)"),
        Cell::Mark(false, text) => text.to_uppercase(),
        Cell::Under => String::new(),
        Cell::Entry(entry) => entry.rounded_text(DIGITS).0,
    }
}

/// A name of a parameter or a signal, which must not be split over two lines.
fn is_name(word: &str) -> bool {
    let inner = word.trim_matches(|c: char| !c.is_alphanumeric());
    inner.starts_with(char::is_alphabetic) && inner.contains(['.', '_', '-']) && !inner.contains('/')
}

/// A table as wide as its contents, at most `width`: first it wraps the titles above numbers, then texts between
/// their words, the widest first, and in the end words, but no names. On a screen that is too narrow, it is written row by row.
fn table(out: &mut String, table: &Table, width: usize) {
    let number = |k: usize| table.columns[k].starts_with('#');
    let count = |text: &str| text.chars().count();
    let titles: Vec<String> =
        table.columns.iter().map(|title| title.strip_prefix('#').unwrap_or(title).into()).collect();
    let shown = table.rows.iter().take(table.brief).map(|row| row.iter().map(cell).collect::<Vec<_>>());
    let shown: Vec<Vec<String>> = shown.collect();
    let widest = |k: usize| shown.iter().filter_map(|row| row.get(k)).map(|cell| count(cell)).max().unwrap_or(0);
    let mut widths: Vec<usize> = (0..titles.len()).map(|k| widest(k).max(count(&titles[k]))).collect();
    let word = |text: &str| text.split(' ').map(count).max().unwrap_or(0);
    let longest =
        |k: usize| shown.iter().filter_map(|row| row.get(k)).map(|cell| word(cell)).fold(word(&titles[k]), usize::max);
    let longest: Vec<usize> = (0..titles.len()).map(longest).collect();
    let name = |text: &str| text.split(' ').filter(|word| is_name(word)).map(count).max().unwrap_or(0);
    let names = |k: usize| shown.iter().filter_map(|row| row.get(k)).map(|cell| name(cell)).max().unwrap_or(0);
    let least = |k: usize| if number(k) { word(&titles[k]).max(widest(k)) } else { LEAST.max(names(k).min(width / 2)) };
    let least: Vec<usize> = (0..titles.len()).map(least).collect();
    let too_wide = |widths: &[usize]| 2 * widths.len() + widths.iter().sum::<usize>() > width;
    let narrow = |widths: &mut [usize], least: &dyn Fn(usize) -> usize| {
        while too_wide(widths) {
            let narrower = (0..widths.len()).filter(|&k| widths[k] > least(k));
            match narrower.max_by_key(|&k| (number(k), widths[k] > longest[k], widths[k], std::cmp::Reverse(k))) {
                Some(k) => widths[k] -= 1,
                None => break,
            }
        }
    };
    narrow(&mut widths, &|k| least[k]);
    let named = titles.first().is_some_and(|_| !number(0));
    if width >= WIDTH && !named {
        // Rows without a name stay rows, if necessary with names in two lines.
        narrow(&mut widths, &|k| if number(k) { least[k] } else { LEAST });
    }
    if (width < WIDTH || named) && too_wide(&widths) {
        shown.iter().for_each(|row| record(out, &titles, row, width));
        more(out, table.rows.len(), table.brief);
        return;
    }
    let titled = titles.iter().any(|title| !title.is_empty());
    for row in titled.then_some(&titles).into_iter().chain(&shown) {
        let cells: Vec<Vec<String>> = row.iter().zip(&widths).map(|(cell, &width)| lines(cell, width)).collect();
        for line in 0..cells.iter().map(Vec::len).max().unwrap_or(0) {
            let mut text = String::new();
            for (k, &width) in widths.iter().enumerate().take(cells.len()) {
                let part = cells[k].get(line).map_or("", String::as_str);
                text += &if number(k) { format!("  {part:>width$}") } else { format!("  {part:width$}") };
            }
            *out += &format!("{}\n", text.trim_end());
        }
    }
    more(out, table.rows.len(), table.brief);
}

/// A row of a table that is too wide: its first cell, and the others below it with their titles.
fn record(out: &mut String, titles: &[String], row: &[String], width: usize) {
    for (k, (title, cell)) in titles.iter().zip(row).enumerate().filter(|(_, (_, cell))| !cell.is_empty()) {
        let text = if k == 0 || title.is_empty() { cell.clone() } else { format!("{title}: {cell}") };
        let [first, rest] = if k == 0 { ["  ", "    "] } else { ["    ", "      "] };
        let options = wrapping(width).initial_indent(first).subsequent_indent(rest);
        *out += &textwrap::fill(&text.replace('\u{a0}', " "), options);
        out.push('\n');
    }
}

/// The lines of a cell; hard spaces do not break, and become plain ones.
fn lines(cell: &str, width: usize) -> Vec<String> {
    textwrap::wrap(cell, wrapping(width.max(1))).iter().map(|line| line.replace('\u{a0}', " ")).collect()
}

/// A matrix with its names, in as many pieces as its columns need.
fn matrix(out: &mut String, matrix: &Matrix, available: usize) {
    let (height, width) = (matrix.entries.len(), matrix.columns.len());
    let fits = height.max(width) <= LARGE;
    let rounded = fits && matrix.entries.iter().flatten().any(|entry| entry.rounded_text(DIGITS).1);
    let exact = match (matrix.exact, rounded) {
        (true, false) => ", exact",
        (true, true) => ", long fractions rounded",
        (false, _) => "",
    };
    sentence(out, &format!("{}{exact}", matrix.title), available);
    if !fits {
        *out += &format!("  {height} × {width}; --json gives all\n");
        return;
    }
    let cut = |names: &[String]| names.iter().map(|name| super::drawing::cut(name, NAME)).collect();
    let matrix = &Matrix { rows: cut(&matrix.rows), columns: cut(&matrix.columns), ..matrix.clone() };
    let left = matrix.rows.iter().map(|name| name.chars().count()).max().unwrap_or(0);
    let size = |entry: &Entry| entry.rounded_text(DIGITS).0.chars().count();
    let wide = |j: usize| {
        let cells = matrix.entries.iter().filter_map(|row| row.get(j)).map(size);
        cells.chain([matrix.columns[j].chars().count()]).max().unwrap_or(0) + 2
    };
    let mut from = 0;
    while from < width {
        let mut room = available.saturating_sub(left + 2);
        let mut until = from;
        while until < width && (until == from || wide(until) <= room) {
            room = room.saturating_sub(wide(until));
            until += 1;
        }
        table(out, &matrix.table(from..until), available);
        from = until;
    }
}
