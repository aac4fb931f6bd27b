//! The layout of a text: encoding, delimiter, decimal point, positions of names, units and numbers.

use std::collections::HashSet;
use std::io::Read;

use super::super::{Bytes, Channel, CsvOptions, Group, LogError, find_time, make_unique, named_time};
use super::cell::{self, Cell};
use super::encoding::{Encoding, text};
use crate::text::strip_guard;

/// The name of the format in messages.
pub(super) const CSV: &str = "CSV";

/// Examined length of the beginning.
const HEAD: usize = 256 << 10;
/// Examined length if that contains no line end.
const LONG_HEAD: usize = 16 << 20;
/// Number of lines split to compare delimiters, at the beginning and at the end of the examined text.
const SAMPLE: usize = 500;

pub(super) struct Layout {
    pub encoding: Encoding,
    pub delimiter: u8,
    pub point: u8,
    /// Cells of a row.
    pub cells: usize,
    /// Lines before the first row.
    pub first_line: u64,
    /// For each cell, the first stamp if there are any, in ns.
    pub stamps: Vec<Option<i64>>,
    pub cells_of_channels: Vec<usize>,
    pub notes: Vec<String>,
}

impl Layout {
    /// The name of the channel of a cell.
    pub fn name(&self, group: &Group, cell: usize) -> String {
        let channel = self.cells_of_channels.iter().position(|of| *of == cell);
        channel.map_or_else(|| format!("{}", cell + 1), |channel| group.channels[channel].name.clone())
    }
}

pub(super) fn is_comment(line: &[u8]) -> bool {
    let line = line.trim_ascii_start();
    line.starts_with(b"#") && !line.starts_with(b"#N/A") || line.starts_with(b"%") || line.starts_with(b"//")
}

fn no_rows(why: String) -> LogError {
    LogError::NoChannels { format: CSV, why }
}

/// Examines the beginning of a text.
pub(super) fn find(bytes: &dyn Bytes, options: &CsvOptions) -> Result<(Layout, Group), LogError> {
    let mut mark = Vec::new();
    bytes.open()?.take(3).read_to_end(&mut mark)?;
    let encoding = match mark[..] {
        [0xef, 0xbb, 0xbf] => Encoding::Utf8Mark,
        [0xff, 0xfe, ..] => Encoding::Utf16 { little: true },
        [0xfe, 0xff, ..] => Encoding::Utf16 { little: false },
        _ => Encoding::Bytes,
    };
    let mut reader = text(bytes, encoding)?;
    let mut head = Vec::new();
    let mut ended = false;
    for limit in [HEAD, LONG_HEAD] {
        if ended || head.contains(&b'\n') {
            break;
        }
        let missing = limit - head.len();
        reader.by_ref().take(missing as u64).read_to_end(&mut head)?;
        ended = head.len() < limit;
    }
    if head.is_empty() {
        return Err(LogError::Empty);
    }
    if head.iter().take(HEAD).any(|byte| *byte == 0) {
        return Err(LogError::unsupported(
            "the file is neither text (there are zero bytes in it) nor MDF, MAT version 5 or Parquet",
            "export the log as CSV, Parquet, MAT (`save -v7`) or MDF 4",
        ));
    }
    if !ended {
        match head.iter().rposition(|byte| *byte == b'\n') {
            Some(end) => head.truncate(end),
            None => return Err(no_rows(format!("its first {} MiB contain no line end", LONG_HEAD >> 20))),
        }
    }
    let lines: Vec<&[u8]> =
        head.split(|byte| *byte == b'\n').map(|line| line.strip_suffix(b"\r").unwrap_or(line)).collect();
    let first = options.first_row.map(|row| row.max(1) - 1);
    if first.is_some_and(|first| first >= lines.len()) {
        let row = options.first_row.unwrap_or(0);
        return Err(no_rows(format!(
            "the first row of numbers is given as row {row}, after the {} rows read",
            lines.len()
        )));
    }
    let rows: Vec<(usize, &[u8])> = lines
        .iter()
        .copied()
        .enumerate()
        .skip(first.unwrap_or(0))
        .filter(|(_, line)| !is_comment(line) && !line.iter().all(u8::is_ascii_whitespace))
        .collect();
    let Some(form) = form(&rows, options) else {
        let what = if rows.is_empty() { "all rows are blank or comments" } else { "no row of numbers was found" };
        let help = "give the delimiter and the first row of numbers if there are any";
        return Err(no_rows(format!("{what} in the first {} rows; {help}", lines.len())));
    };
    let start = first.unwrap_or(form.start);
    let header = Header::find(&lines[..start], &form, options);
    let (mut layout, group) = form.layout(header, &rows, start, encoding);
    if layout.point == layout.delimiter && options.decimal_comma.is_none() {
        layout.notes.push("a comma in quotes is read as a decimal comma: `\"1,234\"` is 1.234".into());
    }
    Ok((layout, group))
}

/// Delimiter and decimal point, and the cells with numbers.
struct Form {
    delimiter: u8,
    point: u8,
    cells: usize,
    /// For each cell, whether there are numbers (or stamps) in it.
    numeric: Vec<bool>,
    start: usize,
}

fn cells_of(line: &[u8], delimiter: u8, point: u8) -> Vec<Cell> {
    let mut cells = Vec::new();
    cell::split(line, delimiter, &mut cells);
    cells.iter().map(|text| cell::read(text, point)).collect()
}

fn is_value(cell: &Cell) -> bool {
    matches!(cell, Cell::Number(_) | Cell::Stamp(_))
}

/// The form with most rows of numbers among the rows read; of equal ones that with most cells.
fn form(rows: &[(usize, &[u8])], options: &CsvOptions) -> Option<Form> {
    let delimiters = options.delimiter.map_or_else(|| b"\t;,| ".to_vec(), |delimiter| vec![delimiter]);
    let points: &[u8] = match options.decimal_comma {
        None => b".,",
        Some(false) => b".",
        Some(true) => b",",
    };
    let mut best: Option<((f64, usize), Form)> = None;
    for &delimiter in &delimiters {
        for &point in points.iter().filter(|point| **point != delimiter || are_quoted(rows, delimiter)) {
            if let Some((share, form)) = try_form(rows, delimiter, point) {
                // Whole numbers between commas are not a column of decimal commas.
                let score = (if form.cells == 1 { 0.5 * share } else { share }, form.cells);
                if best.as_ref().is_none_or(|(candidate, _)| score > *candidate) {
                    best = Some((score, form));
                }
            }
        }
    }
    best.map(|(_, form)| form)
}

/// Whether there are numbers in quotes that contain the delimiter: `"1,5","2,5"`.
fn are_quoted(rows: &[(usize, &[u8])], delimiter: u8) -> bool {
    let is_one = |cell: &&[u8]| {
        let inside = cell::unquoted(cell);
        inside.contains(&delimiter) && matches!(cell::read(inside, delimiter), Cell::Number(_))
    };
    let mut cells = Vec::new();
    rows.iter().take(SAMPLE).any(|(_, line)| {
        cell::split(line, delimiter, &mut cells);
        cells.iter().any(&is_one)
    })
}

fn try_form(rows: &[(usize, &[u8])], delimiter: u8, point: u8) -> Option<(f64, Form)> {
    let (front, back) = (rows.len().min(SAMPLE), rows.len().saturating_sub(SAMPLE).max(rows.len().min(SAMPLE)));
    let sample: Vec<Vec<Cell>> =
        rows[..front].iter().chain(&rows[back..]).map(|(_, line)| cells_of(line, delimiter, point)).collect();
    let plain = |row: &&Vec<Cell>| row.iter().any(is_value) && !row.contains(&Cell::Text);
    let mut judged: Vec<&Vec<Cell>> = sample.iter().filter(plain).collect();
    if 5 * judged.len() < sample.len() && sample.len() >= 4 {
        // Some cells are texts: the last rows decide, which no header reaches in a long file.
        judged = sample[sample.len() / 2..].iter().collect();
    }
    let mut counts = std::collections::BTreeMap::new();
    for row in &judged {
        *counts.entry(row.len()).or_insert(0usize) += 1;
    }
    let cells = *counts.iter().max_by_key(|(cells, count)| (**count, **cells))?.0;
    let judged: Vec<&Vec<Cell>> = judged.into_iter().filter(|row| row.len() == cells).collect();
    let mut numeric = vec![false; cells];
    let mut good = 0;
    for (index, numeric) in numeric.iter_mut().enumerate() {
        let texts = judged.iter().filter(|row| row[index] == Cell::Text).count();
        *numeric = 2 * texts < judged.len() && judged.iter().any(|row| is_value(&row[index]));
        good += judged.len() - texts;
    }
    if !numeric.contains(&true) {
        return None;
    }
    let share = good as f64 / (cells * judged.len()) as f64 * judged.len() as f64 / sample.len() as f64;
    let mut form = Form { delimiter, point, cells, numeric, start: 0 };
    // The first row of numbers that is followed by such rows.
    let are_rows: Vec<bool> = rows.iter().map(|(_, line)| form.is_row(line)).collect();
    let goes_on = |index: &usize| {
        let next = &are_rows[*index..are_rows.len().min(index + 8)];
        next[0] && 2 * next.iter().filter(|is_row| **is_row).count() >= next.len().min(3)
    };
    let mut start = (0..rows.len()).find(goes_on)?;
    // A row with numbers below a header that is not a row of units is a row of numbers with an error: the reader reports it.
    while start > 1 && form.has_parse_errors(rows[start - 1].1) {
        start -= 1;
    }
    form.start = rows[start].0;
    Some((share, form))
}

impl Form {
    fn is_row(&self, line: &[u8]) -> bool {
        let mut row = cells_of(line, self.delimiter, self.point);
        if row.len() == self.cells + 1 && row.last() == Some(&Cell::Missing) {
            row.pop();
        }
        row.len() == self.cells
            && row.iter().any(is_value)
            && row.iter().zip(&self.numeric).all(|(cell, numeric)| !numeric || *cell != Cell::Text)
    }

    /// Whether it has numbers and texts in the columns of numbers, and is not a row of units.
    fn has_parse_errors(&self, line: &[u8]) -> bool {
        let cells = cells_of(line, self.delimiter, self.point);
        let mut texts = Vec::new();
        cell::split(line, self.delimiter, &mut texts);
        let texts: Vec<String> = texts.iter().map(|text| String::from_utf8_lossy(text).trim().to_owned()).collect();
        cells.len() == self.cells && cells.iter().any(is_value) && !are_units(&texts)
    }

    fn layout(self, header: Header, rows: &[(usize, &[u8])], start: usize, encoding: Encoding) -> (Layout, Group) {
        let rows = rows.iter().filter(|(line, _)| *line >= start);
        let values: Vec<Vec<Cell>> = rows
            .take(SAMPLE)
            .map(|(_, line)| cells_of(line, self.delimiter, self.point))
            .filter(|row| row.len() >= self.cells)
            .collect();
        let stamp = |index: usize| {
            let stamps: Vec<i64> = values
                .iter()
                .filter_map(|row| match row[index] {
                    Cell::Stamp(ns) => Some(ns),
                    _ => None,
                })
                .collect();
            let numbers = values.iter().filter(|row| matches!(row[index], Cell::Number(_))).count();
            if stamps.len() > numbers { stamps.first().copied() } else { None }
        };
        let stamps: Vec<Option<i64>> = (0..self.cells).map(stamp).collect();
        let mut notes = Vec::new();
        let mut channels = Vec::new();
        let mut cells_of_channels = Vec::new();
        for index in 0..self.cells {
            let (mut name, mut unit) = header.of(index);
            if is_label(&name) {
                let increasing = values.windows(2).all(|pair| match (pair[0][index], pair[1][index]) {
                    (Cell::Number(a), Cell::Number(b)) => a < b,
                    (a, b) => is_value(&a) && is_value(&b),
                });
                name = if increasing { "time".into() } else { String::new() };
            }
            let is_named = !name.is_empty();
            if !is_named {
                name = format!("column {}", index + 1);
            }
            if !self.numeric[index] {
                if values.iter().any(|row| row[index] == Cell::Text) {
                    notes.push(format!("`{name}` contains text and is left out"));
                    continue;
                }
                if !is_named {
                    continue;
                }
            }
            if stamps[index].is_some() {
                unit = "s".into();
            }
            channels.push(Channel { name, unit });
            cells_of_channels.push(index);
        }
        make_unique(&mut channels);
        let of_stamps = || cells_of_channels.iter().position(|cell| stamps[*cell].is_some());
        let time = find_time(&channels).or_else(of_stamps);
        let group = Group { name: String::new(), channels, time, rows: None };
        let Self { delimiter, point, cells, .. } = self;
        let first_line = start as u64;
        (Layout { encoding, delimiter, point, cells, first_line, stamps, cells_of_channels, notes }, group)
    }
}

/// Names and units above the numbers.
#[derive(Default)]
struct Header {
    names: Vec<String>,
    units: Vec<String>,
    /// Whether names are quotients of a quantity and its unit.
    quotients: bool,
}

/// A text in UTF-8, or else in Latin-1.
fn decoded(bytes: &[u8]) -> String {
    let bytes = cell::unquoted(bytes);
    let text =
        std::str::from_utf8(bytes).map_or_else(|_| bytes.iter().map(|byte| char::from(*byte)).collect(), str::to_owned);
    strip_guard(text.replace("\"\"", "\"").trim()).to_owned()
}

fn strip_comment_mark(line: &[u8]) -> &[u8] {
    let line = line.trim_ascii_start();
    let marks = line.iter().take_while(|byte| matches!(byte, b'#' | b'%' | b'/')).count();
    if marks > 0 && is_comment(line) { &line[marks..] } else { line }
}

impl Header {
    fn find(lines: &[&[u8]], form: &Form, options: &CsvOptions) -> Self {
        let split = |line: &[u8]| {
            let mut cells = Vec::new();
            // Blanks at the start count if a tab begins the row.
            cell::split(strip_comment_mark(line), form.delimiter, &mut cells);
            cells.into_iter().map(decoded).collect::<Vec<_>>()
        };
        let row_cells = |row: Option<usize>| {
            row.map(|row| row.checked_sub(1).and_then(|row| lines.get(row)).map(|line| split(line)).unwrap_or_default())
        };
        let mut candidates: Vec<Vec<String>> = lines
            .iter()
            .filter(|line| !line.iter().all(u8::is_ascii_whitespace))
            .map(|line| split(line))
            .filter(|cells| cells.len().abs_diff(form.cells) <= usize::from(form.cells > 1))
            .filter(|cells| cells.iter().any(|cell| cell::read(cell.as_bytes(), form.point) == Cell::Text))
            .collect();
        let (names, units) = (row_cells(options.names_row), row_cells(options.units_row));
        let mut header = Self::default();
        let last = candidates.pop();
        let before = candidates.pop();
        if let Some(names) = names {
            header.units = units.or_else(|| last.filter(|last| *last != names && are_units(last))).unwrap_or_default();
            header.names = names;
        } else if let Some(units) = units {
            header.names = [last, before].into_iter().flatten().find(|row| *row != units).unwrap_or_default();
            header.units = units;
        } else if let Some(last) = last {
            match before {
                Some(before) if are_units(&last) => (header.names, header.units) = (before, last),
                // Units and second names in one row, as some recorders write.
                Some(before) if is_time_unit(&last[0]) && before.iter().all(|cell| !cell.is_empty()) => {
                    for (index, upper) in before.into_iter().enumerate() {
                        let lower = last.get(index).cloned().unwrap_or_default();
                        let is_unit = is_unit(&lower);
                        header.names.push(if is_unit || lower.is_empty() {
                            upper
                        } else {
                            format!("{upper}: {lower}")
                        });
                        header.units.push(if is_unit { lower } else { String::new() });
                    }
                }
                _ => header.names = last,
            }
        }
        header.quotients = are_quotients(&header.names);
        header
    }

    /// Name and unit of a cell; the unit may follow the name.
    fn of(&self, index: usize) -> (String, String) {
        let name = self.names.get(index).cloned().unwrap_or_default();
        let unit = self.units.get(index).map_or("", |unit| strip_brackets(unit));
        if is_label(unit) {
            return (name, String::new());
        }
        if !unit.is_empty() || !self.units.is_empty() {
            return (name, unit.to_owned());
        }
        let split = |open: char, close: char| {
            let (front, unit) = name.strip_suffix(close)?.rsplit_once(open)?;
            Some((front.trim().to_owned(), unit.trim().to_owned())).filter(|(front, _)| !front.is_empty())
        };
        if let Some((quantity, unit)) = quotient(&name).filter(|_| self.quotients) {
            return (quantity.trim().to_owned(), strip_brackets(unit.trim()).to_owned());
        }
        if let Some(pair) = split('[', ']').filter(|(_, unit)| unit.parse::<i64>().is_err()) {
            return pair;
        }
        if let Some(pair) = split('(', ')').filter(|(_, unit)| is_unit(unit)) {
            return pair;
        }
        if let Some((front, unit)) = name.rsplit_once(" / ")
            && is_unit(unit.trim())
        {
            return (front.trim().to_owned(), unit.trim().to_owned());
        }
        (name, String::new())
    }
}

fn strip_brackets(cell: &str) -> &str {
    let inside =
        |open: char, close: char| cell.strip_prefix(open)?.strip_suffix(close).filter(|cell| !cell.contains(close));
    inside('[', ']').or_else(|| inside('(', ')')).unwrap_or(cell).trim()
}

/// Quantity and unit of `n/(1/min)`, as ISO 80000 and DIN 1313 write what a column of numbers is.
fn quotient(name: &str) -> Option<(&str, &str)> {
    let (quantity, unit) = name.split_once('/')?;
    let is_unit = matches!(unit.trim(), "1" | "-") || is_unit(unit);
    // In `v (m/s)` the `/` is one of the unit.
    let is_whole = !quantity.trim().is_empty() && quantity.matches('(').count() == quantity.matches(')').count();
    (is_whole && is_unit).then_some((quantity, unit))
}

/// Whether the unit of a name is in brackets behind it: `w [U/min]`, `v (m/s)`.
fn has_unit_behind(name: &str) -> bool {
    let in_brackets = name.strip_suffix(')').and_then(|front| front.rsplit_once('('));
    name.ends_with(']') || in_brackets.is_some_and(|(front, unit)| !front.trim_end().ends_with('/') && is_unit(unit))
}

/// Whether names without a unit behind them are such quotients: most of them, every one with a `/`, and no duplicate quantity. Else the `/` belongs to
/// names.
fn are_quotients(names: &[String]) -> bool {
    let plain = || names.iter().filter(|name| !has_unit_behind(name));
    let slashed = || plain().filter(|name| name.contains('/'));
    let quantities: Option<HashSet<&str>> =
        slashed().map(|name| quotient(name).map(|(quantity, _)| quantity)).collect();
    let count = slashed().count();
    count > 0 && 2 * count >= plain().count() && quantities.is_some_and(|quantities| quantities.len() == count)
}

/// Words that mark the kind of a header row.
fn is_label(cell: &str) -> bool {
    let cell = cell.trim_end_matches(':').to_lowercase();
    matches!(
        &cell[..],
        "unit" | "units" | "einheit" | "einheiten" | "channel name" | "channel" | "kanal" | "name" | "names"
    )
}

fn are_units(cells: &[String]) -> bool {
    // `1` may mean no unit, and decides nothing.
    let cells = || cells.iter().filter(|cell| cell.parse::<f64>().is_err());
    let units = cells().filter(|cell| is_unit(strip_brackets(cell))).count();
    let texts = cells().filter(|cell| !cell.is_empty() && *cell != "-" && !is_label(cell)).count();
    let is_time = |cell: &String| {
        (named_time(cell) && cell.len() > 1)
            || quotient(cell).is_some_and(|(name, unit)| named_time(name) && is_time_unit(unit))
    };
    units > 0 && 2 * units >= texts && !cells().any(is_time)
}

fn is_time_unit(cell: &str) -> bool {
    matches!(strip_brackets(cell), "s" | "sec" | "ms" | "us" | "µs" | "μs" | "ns" | "min" | "h")
}

/// Whether a cell reads like a unit: a product of powers of known symbols.
fn is_unit(cell: &str) -> bool {
    const SYMBOLS: &[&str] = &[
        "s", "sec", "second", "seconds", "min", "h", "d", "Hz", "m", "g", "t", "N", "Nm", "NM", "Ncm", "Nmm", "Nms",
        "J", "W", "Wh", "V", "A", "VA", "ohm", "Ohm", "Ω", "F", "H", "T", "Wb", "C", "K", "Pa", "bar", "psi", "rad",
        "deg", "°", "grad", "degC", "°C", "rev", "U", "r", "rpm", "RPM", "Upm", "UPM", "rps", "1", "%", "l", "L", "in",
        "ft", "lb", "lbf", "lbs", "oz", "mph", "mi", "kmh", "kph", "inc", "counts", "pulses", "pls", "px", "dB", "bit",
        "eV", "cd", "mol", "lx", "Ah", "ppm", "cps", "dps", "B",
    ];
    const PREFIXES: &[&str] = &["k", "M", "G", "m", "c", "d", "u", "µ", "μ", "n", "p", "h", "da"];
    let is_symbol = |part: &str| {
        let part = part.trim_end_matches(|c: char| c.is_ascii_digit() || matches!(c, '²' | '³' | '-' | '⁻' | '¹'));
        part.is_empty()
            || SYMBOLS.contains(&part)
            || PREFIXES.iter().any(|prefix| part.strip_prefix(prefix).is_some_and(|symbol| SYMBOLS.contains(&symbol)))
    };
    let cell = cell.trim();
    cell.chars().count() <= 16
        && cell.chars().any(|c| c.is_alphabetic() || matches!(c, '%' | '°'))
        && cell.split(['*', '/', '·', '^', ' ', '.', '(', ')', '⋅']).all(is_symbol)
}
