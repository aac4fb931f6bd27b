//! Lines to numbers.

use super::super::decimal;
use super::cell::{self, Cell};
use super::layout::{Layout, is_comment};

/// The cells to read of a line.
pub(super) struct Plan {
    delimiter: u8,
    point: u8,
    cells: usize,
    /// For each cell of a line, its column.
    columns: Vec<Option<usize>>,
    /// For each column: whether it contains stamps, and the first one.
    stamps: Vec<Option<i64>>,
    pub(super) first_line: u64,
}

/// Some rows.
#[derive(Default)]
pub(super) struct Rows {
    pub(super) columns: Vec<Vec<f64>>,
    pub(super) rows: usize,
    pub(super) lines: u64,
    pub(super) found: Irregular,
}

/// What is irregular in some lines.
#[derive(Default)]
pub(super) struct Irregular {
    /// Lines that are no rows, and the first one.
    pub(super) skipped: u64,
    pub(super) first_skipped: Option<u64>,
    pub(super) odd_cells: u64,
    /// Line, cell and its text.
    pub(super) first_odd_cell: Option<(u64, usize, String)>,
}

impl Irregular {
    /// Adds what is irregular in lines after `before` others.
    pub(super) fn add(&mut self, other: &Self, before: u64) {
        self.skipped += other.skipped;
        self.first_skipped = self.first_skipped.or(other.first_skipped.map(|line| before + line));
        self.odd_cells += other.odd_cells;
        if let (None, Some((line, cell, text))) = (&self.first_odd_cell, &other.first_odd_cell) {
            self.first_odd_cell = Some((before + line, *cell, text.clone()));
        }
    }
}

impl Plan {
    /// A plan for some cells, and for each of these its column.
    pub(super) fn new(layout: &Layout, selection: &[usize]) -> (Self, Vec<usize>) {
        let mut columns = vec![None; layout.cells];
        let mut stamps = Vec::new();
        let outputs = selection
            .iter()
            .map(|&cell| {
                *columns[cell].get_or_insert_with(|| {
                    stamps.push(layout.stamps[cell]);
                    stamps.len() - 1
                })
            })
            .collect();
        let (delimiter, point, first_line) = (layout.delimiter, layout.point, layout.first_line);
        (Self { delimiter, point, cells: layout.cells, columns, stamps, first_line }, outputs)
    }

    /// Parses whole lines; `rows` is emptied first.
    pub(super) fn parse(&self, text: &[u8], rows: &mut Rows) {
        let mut columns = std::mem::take(&mut rows.columns);
        columns.resize_with(self.stamps.len(), Vec::new);
        columns.iter_mut().for_each(Vec::clear);
        *rows = Rows { columns, ..Rows::default() };
        let mut at = 0;
        let mut cells = Vec::new();
        while at < text.len() {
            match self.plain(&text[at..], &mut rows.columns) {
                Some(length) => {
                    rows.rows += 1;
                    at += length;
                }
                None => {
                    rows.columns.iter_mut().for_each(|column| column.truncate(rows.rows));
                    let end = text[at..].iter().position(|byte| *byte == b'\n').map_or(text.len(), |end| at + end);
                    let line = text[at..end].strip_suffix(b"\r").unwrap_or(&text[at..end]);
                    cell::split(line, self.delimiter, &mut cells);
                    self.any(line, &mut cells, rows);
                    at = end + 1;
                }
            }
            rows.lines += 1;
        }
    }

    /// A line of plain numbers at the start of a text; returns its length with its end.
    #[inline]
    fn plain(&self, text: &[u8], columns: &mut [Vec<f64>]) -> Option<usize> {
        if self.delimiter == self.point {
            return None;
        }
        let blanks = self.delimiter == b' ';
        let mut at = 0;
        for (cell, column) in self.columns.iter().enumerate() {
            while let Some(b' ') = text.get(at) {
                at += 1;
            }
            if let Some(column) = column {
                if self.stamps[*column].is_some() {
                    return None;
                }
                let (value, length) = decimal::leading(&text[at..], self.point)?;
                columns[*column].push(value);
                at += length;
            } else {
                let stop = |byte: &u8| *byte == self.delimiter || matches!(byte, b'\n' | b'"');
                at += text[at..].iter().position(stop)?;
            }
            if cell + 1 == self.cells {
                while blanks && text.get(at) == Some(&b' ') {
                    at += 1;
                }
                if text.get(at) == Some(&b'\r') {
                    at += 1;
                }
                return (text.get(at) == Some(&b'\n')).then_some(at + 1);
            }
            if text.get(at) != Some(&self.delimiter) {
                return None;
            }
            at += 1;
        }
        None
    }

    /// Any line.
    fn any(&self, line: &[u8], cells: &mut Vec<&[u8]>, rows: &mut Rows) {
        if is_comment(line) || line.iter().all(|byte| byte.is_ascii_whitespace()) {
            return;
        }
        // An extra delimiter at the end is common.
        if cells.len() == self.cells + 1 && cells.last().is_some_and(|cell| cell.is_empty()) {
            cells.pop();
        }
        let mut numbers = 0;
        let mut odd = Vec::new();
        if cells.len() == self.cells {
            for (index, column) in self.columns.iter().enumerate() {
                let Some(column) = *column else { continue };
                let value = match (cell::read(cells[index], self.point), self.stamps[column]) {
                    (Cell::Number(value), None) => Some(value),
                    (Cell::Stamp(ns), Some(first)) => Some((i128::from(ns) - i128::from(first)) as f64 / 1e9),
                    (Cell::Missing, _) => {
                        rows.columns[column].push(f64::NAN);
                        continue;
                    }
                    _ => None,
                };
                match value {
                    Some(_) => numbers += 1,
                    None => odd.push(index),
                }
                rows.columns[column].push(value.unwrap_or(f64::NAN));
            }
        }
        if cells.len() != self.cells || (numbers == 0 && !odd.is_empty()) {
            rows.columns.iter_mut().for_each(|column| column.truncate(rows.rows));
            rows.found.skipped += 1;
            rows.found.first_skipped.get_or_insert(rows.lines);
            return;
        }
        rows.rows += 1;
        rows.found.odd_cells += odd.len() as u64;
        if let (Some(&cell), None) = (odd.first(), &rows.found.first_odd_cell) {
            let text = String::from_utf8_lossy(&cells[cell][..cells[cell].len().min(40)]).into_owned();
            rows.found.first_odd_cell = Some((rows.lines, cell, text));
        }
    }
}
