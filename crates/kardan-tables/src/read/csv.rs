//! Text with one row per line. The layout is detected from its beginning; rows are read in parallel.

mod cell;
mod encoding;
mod layout;
mod rows;

use std::io::Read;
use std::sync::Arc;

use rayon::prelude::*;

use super::{BLOCK_ROWS, Block, Bytes, CsvOptions, Group, Log, LogError, chosen};
use encoding::text;
use layout::{CSV, Layout};
use rows::{Irregular, Plan, Rows};

/// Amount of text read and parsed at once.
const CHUNK: usize = 8 << 20;
/// The longest line.
const LINE_LIMIT: usize = 64 << 20;

pub(super) struct CsvLog {
    bytes: Arc<dyn Bytes>,
    layout: Layout,
    groups: [Group; 1],
    reading: Option<Reading>,
    found: Noticed,
}

/// Counts for the notes.
#[derive(Default)]
struct Noticed {
    rows: u64,
    irregular: Irregular,
    end: Option<String>,
}

struct Reading {
    source: Lines,
    plan: Plan,
    /// For each chosen channel, its column of `pieces`.
    outputs: Vec<usize>,
    /// Text that is read and not parsed: whole lines, except at the end of the file.
    text: Vec<u8>,
    /// Lines before `text`.
    lines: u64,
    /// Lines still to skip.
    skip: u64,
    pieces: Vec<Rows>,
    piece: usize,
    row: usize,
    failed: Option<LogError>,
}

/// Text read in whole lines.
struct Lines {
    reader: Box<dyn Read + Send>,
    /// The beginning of an incomplete line.
    rest: Vec<u8>,
    ended: bool,
}

impl CsvLog {
    pub(super) fn open(bytes: Arc<dyn Bytes>, options: &CsvOptions) -> Result<Self, LogError> {
        let (layout, group) = layout::find(&*bytes, options)?;
        Ok(Self { bytes, layout, groups: [group], reading: None, found: Noticed::default() })
    }
}

impl Lines {
    /// The next whole lines.
    fn read(&mut self) -> Result<Vec<u8>, LogError> {
        let mut text = std::mem::take(&mut self.rest);
        while !self.ended {
            let before = text.len();
            (&mut self.reader).take(CHUNK as u64).read_to_end(&mut text)?;
            self.ended = text.len() == before;
            if let Some(end) = text[before..].iter().rposition(|byte| *byte == b'\n') {
                self.rest.extend_from_slice(&text[before + end + 1..]);
                text.truncate(before + end + 1);
                break;
            }
            if text.len() > LINE_LIMIT {
                let what = format!("a line has no end within {} MiB", LINE_LIMIT >> 20);
                return Err(LogError::damaged(CSV, "after the last row read", what));
            }
        }
        Ok(text)
    }
}

impl Reading {
    /// Parses the present text and reads the next one in parallel.
    fn advance(&mut self, found: &mut Noticed, name: &dyn Fn(usize) -> String) {
        let mut text = std::mem::take(&mut self.text);
        if self.skip > 0 {
            let mut start = 0;
            while self.skip > 0 && start < text.len() {
                start += text[start..].iter().position(|byte| *byte == b'\n').map_or(text.len() - start, |end| end + 1);
                self.skip -= 1;
                self.lines += 1;
            }
            text.drain(..start);
        }
        let unfinished = text.iter().rposition(|byte| *byte == b'\n').map_or(0, |end| end + 1);
        let tail = text.split_off(unfinished);
        let count = if text.len() < 1 << 16 { 1 } else { 4 * rayon::current_num_threads() };
        let mut bounds = vec![0];
        for k in 1..=count {
            let from = (text.len() * k / count).max(bounds[k - 1]);
            bounds.push(text[from..].iter().position(|byte| *byte == b'\n').map_or(text.len(), |end| from + end + 1));
        }
        self.pieces.resize_with(count, Rows::default);
        let (plan, pieces) = (&self.plan, &mut self.pieces);
        let source = &mut self.source;
        let ((), next) = rayon::join(
            || {
                pieces
                    .par_iter_mut()
                    .zip(bounds.par_windows(2))
                    .for_each(|(piece, ends)| plan.parse(&text[ends[0]..ends[1]], piece))
            },
            || if source.ended { Ok(Vec::new()) } else { source.read() },
        );
        if !tail.is_empty() {
            let mut last = Rows::default();
            self.plan.parse(&tail, &mut last);
            let row = self.lines + self.pieces.iter().map(|piece| piece.lines).sum::<u64>() + 1;
            if last.rows > 0 {
                found.end =
                    Some(format!("the file ends without a line break: the last number of row {row} may be cut"));
                self.pieces.push(last);
            } else if last.found.skipped > 0 {
                found.end = Some(format!("the file ends in the middle of row {row}, which is left out"));
            }
        }
        (self.piece, self.row) = (0, 0);
        let whole_file = self.lines == self.plan.first_line && self.source.ended;
        let (mut rows, mut here) = (0, Irregular::default());
        for piece in &self.pieces {
            rows += piece.rows as u64;
            here.add(&piece.found, self.lines + 1);
            self.lines += piece.lines;
        }
        found.rows += rows;
        found.irregular.add(&here, 0);
        let Irregular { skipped, first_skipped: first, .. } = here;
        let Irregular { odd_cells, first_odd_cell, .. } = &found.irregular;
        match next {
            Ok(next) => self.text = next,
            Err(error) => self.failed = Some(error),
        }
        if skipped > rows && (whole_file || skipped + rows >= 100) {
            let what = format!("from there on {skipped} of {} rows are not rows of numbers", skipped + rows);
            let place = format!("at row {}", first.unwrap_or(self.lines));
            self.failed = Some(LogError::damaged(CSV, place, what));
        } else if let (true, Some((row, cell, text))) = (*odd_cells > 4 * (found.rows + 10), first_odd_cell) {
            let more = odd_cells - 1;
            let what = format!("there is `{text}` instead of a number, and {more} more cells are not numbers");
            self.failed = Some(LogError::damaged(CSV, format!("at row {row}, column `{}`", name(*cell)), what));
        }
        if self.failed.is_some() {
            (self.text, self.source.ended) = (Vec::new(), true);
            self.source.rest.clear();
        }
    }
}

impl Log for CsvLog {
    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn choose(&mut self, selection: &[(usize, usize)]) -> Result<(), LogError> {
        let channels = chosen(&self.groups, selection)?.remove(0);
        self.reading = None;
        self.found = Noticed::default();
        if channels.is_empty() {
            return Ok(());
        }
        let cells: Vec<usize> = channels.iter().map(|channel| self.layout.cells_of_channels[*channel]).collect();
        let (plan, outputs) = Plan::new(&self.layout, &cells);
        let reader = text(&*self.bytes, self.layout.encoding)?;
        let mut source = Lines { reader, rest: Vec::new(), ended: false };
        let text = source.read()?;
        let (skip, pieces) = (self.layout.first_line, Vec::new());
        self.reading =
            Some(Reading { source, plan, outputs, text, lines: 0, skip, pieces, piece: 0, row: 0, failed: None });
        Ok(())
    }

    fn next(&mut self, block: &mut Block) -> Result<bool, LogError> {
        let Some(reading) = &mut self.reading else { return Ok(false) };
        block.reset(0, reading.outputs.len());
        loop {
            while block.rows < BLOCK_ROWS && reading.piece < reading.pieces.len() {
                let piece = &reading.pieces[reading.piece];
                let end = piece.rows.min(reading.row + BLOCK_ROWS - block.rows);
                for (column, output) in block.columns.iter_mut().zip(&reading.outputs) {
                    column.extend_from_slice(&piece.columns[*output][reading.row..end]);
                }
                block.rows += end - reading.row;
                reading.row = end;
                if end == piece.rows {
                    (reading.piece, reading.row) = (reading.piece + 1, 0);
                }
            }
            if block.rows > 0 {
                return Ok(true);
            }
            if reading.text.is_empty() && reading.source.rest.is_empty() {
                let failed = reading.failed.take();
                if failed.is_some() || reading.source.ended {
                    self.reading = None;
                    return failed.map_or(Ok(false), Err);
                }
            }
            reading.advance(&mut self.found, &|cell| self.layout.name(&self.groups[0], cell));
        }
    }

    fn notes(&self) -> Vec<String> {
        let mut notes = self.layout.notes.clone();
        let found = &self.found.irregular;
        if let (1.., Some(row)) = (found.skipped, found.first_skipped) {
            let rows = if found.skipped == 1 { "row is left out: it has" } else { "rows are left out: they have" };
            let cells = self.layout.cells;
            let skipped = found.skipped;
            notes
                .push(format!("{skipped} {rows} not the {cells} cells of the others, or no number (first: row {row})"));
        }
        if let Some((row, cell, text)) = &found.first_odd_cell {
            let name = self.layout.name(&self.groups[0], *cell);
            let count = found.odd_cells;
            let cells = if count == 1 { "cell is not a number and counts" } else { "cells are not numbers and count" };
            notes.push(format!("{count} {cells} as missing (first: row {row}, column `{name}`: `{text}`)"));
        }
        notes.extend(self.found.end.clone());
        notes
    }

    fn damage(&self) -> Vec<String> {
        let skipped = match self.found.irregular.skipped {
            0 => None,
            1 => Some("1 row is left out".to_owned()),
            many => Some(format!("{many} rows are left out")),
        };
        skipped.into_iter().chain(self.found.end.as_ref().map(|_| "it ends in the middle of a row".into())).collect()
    }
}
