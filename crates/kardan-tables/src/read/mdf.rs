//! ASAM MDF 4 (`.mf4`), versions 4.00 to 4.20.
//!
//! An own reader, because `mdf4-rs` (0.3.3) loads the whole file and every channel into memory, supports neither
//! unsorted nor unfinished files, and does not check lengths and links. Block numbers and fields are those of the
//! ASAM MDF standard, 4.1; links to unused data (history, events, attachments) are followed only to check that the file does not end before them.

mod blocks;
mod end;
mod field;
mod stream;

use std::sync::Arc;

use rayon::prelude::*;

use super::source::{Source, unsigned};
use super::{BLOCK_ROWS, Block, Bytes, Group, Log, LogError, chosen};
use blocks::{DataGroup, File, Layout, MDF};
use stream::Stream;

/// Number of record bytes decoded at once.
const STEP: usize = 4 << 20;

pub(super) struct MdfLog {
    bytes: Arc<dyn Bytes>,
    file: File,
    groups: Vec<Group>,
    notes: Vec<String>,
    /// Whether the file ends before its last block does.
    truncated: bool,
    reading: Vec<Reading>,
    end_notes: Vec<String>,
    /// Lost data, in a few words each.
    lost: Vec<String>,
}

/// A data group that is being read.
struct Reading {
    data: usize,
    stream: Stream,
    records: Vec<Records>,
    /// Bytes read and not yet split.
    raw: Vec<u8>,
    ended: bool,
    /// Whether to return all waiting records.
    flushing: bool,
}

/// The records of a channel group.
struct Records {
    group: usize,
    fields: Vec<usize>,
    delivered: u64,
    /// Records that are not yet decoded.
    waiting: Vec<u8>,
}

impl MdfLog {
    pub(super) fn open(bytes: Arc<dyn Bytes>) -> Result<Self, LogError> {
        let source = Source::open(&*bytes, MDF)?;
        let (file, groups, mut notes) = blocks::read(&source)?;
        // The last block of an unfinished recording has no length yet.
        let missing = if file.unfinished_length { None } else { end::missing(&source) };
        let truncated = missing.is_some();
        notes.extend(missing.map(|error| error.to_string()));
        Ok(Self { bytes, file, groups, notes, truncated, reading: Vec::new(), end_notes: Vec::new(), lost: Vec::new() })
    }

    /// Decodes some waiting records of a group into a block.
    fn decode(&self, records: &Records, count: usize, block: &mut Block) {
        let layout = self.file.layout(records.group);
        block.reset(records.group, records.fields.len());
        block.rows = count;
        let record_bytes = layout.record_bytes();
        let first = records.delivered;
        let field = |(column, field): (&mut Vec<f64>, &usize)| {
            layout.fields[*field].decode(
                &records.waiting[..count * record_bytes],
                record_bytes,
                layout.data_bytes,
                first,
                column,
            );
        };
        if count * records.fields.len() > 20_000 {
            block.columns.par_iter_mut().zip(&records.fields).for_each(field);
        } else {
            block.columns.iter_mut().zip(&records.fields).for_each(field);
        }
    }
}

impl File {
    /// The delivered share of the rows of what is read, so that groups advance together.
    fn share(&self, reading: &Reading) -> f64 {
        let shares = reading.records.iter().map(|records| {
            let rows = self.layout(records.group).rows;
            rows.map_or(records.delivered as f64 * 1e-12, |rows| records.delivered as f64 / rows.max(1) as f64)
        });
        shares.fold(f64::INFINITY, f64::min)
    }

    fn layout(&self, group: usize) -> &Layout {
        let (data, index) = self.places[group];
        &self.data[data].groups[index]
    }
}

impl Log for MdfLog {
    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn choose(&mut self, selection: &[(usize, usize)]) -> Result<(), LogError> {
        let channels = chosen(&self.groups, selection)?;
        self.reading.clear();
        self.end_notes.clear();
        self.lost = if self.truncated { vec!["it is truncated".into()] } else { Vec::new() };
        for (data, of) in self.file.data.iter().enumerate() {
            let selection =
                of.groups.iter().filter_map(|layout| layout.group).filter(|group| !channels[*group].is_empty());
            let records: Vec<Records> = selection
                .map(|group| Records { group, fields: channels[group].clone(), delivered: 0, waiting: Vec::new() })
                .collect();
            if !records.is_empty() {
                let stream = Stream::open(Source::open(&*self.bytes, MDF)?, of.data, self.file.unfinished_length);
                self.reading.push(Reading { data, stream, records, raw: Vec::new(), ended: false, flushing: false });
            }
        }
        Ok(())
    }

    fn next(&mut self, block: &mut Block) -> Result<bool, LogError> {
        loop {
            let share = |k: &usize| self.file.share(&self.reading[*k]);
            let next = (0..self.reading.len()).min_by(|a, b| share(a).total_cmp(&share(b)));
            let Some(next) = next else { return Ok(false) };
            let mut reading = self.reading.swap_remove(next);
            // After an error the other groups continue without loss.
            if self.advance(&mut reading, block)? {
                self.reading.push(reading);
                let last = self.reading.len() - 1;
                self.reading.swap(next, last);
                return Ok(true);
            }
            self.note_end(&reading);
        }
    }

    fn notes(&self) -> Vec<String> {
        self.notes.iter().chain(&self.end_notes).cloned().collect()
    }

    fn damage(&self) -> Vec<String> {
        self.lost.clone()
    }
}

impl MdfLog {
    fn named(&self, reading: &Reading) -> String {
        let names: Vec<String> =
            reading.records.iter().map(|records| format!("`{}`", self.groups[records.group].name)).collect();
        names.join(", ")
    }

    /// Notes irregular ends of groups: an incomplete record, and wrong counters.
    fn note_end(&mut self, reading: &Reading) {
        if reading.stream.cut {
            self.end_notes.push(format!("the recording stops in the middle of a record of {}", self.named(reading)));
            self.lost.push("it ends in the middle of a record".into());
        }
        for records in &reading.records {
            let (name, delivered) = (&self.groups[records.group].name, records.delivered);
            match self.groups[records.group].rows {
                _ if delivered == 0 => {
                    self.end_notes.push(format!("the group `{name}` has no records"));
                    self.lost.push(format!("group `{name}` is empty"));
                }
                Some(rows) if rows < delivered => self.end_notes.push(format!(
                    "the group `{name}` has {delivered} records, and its cycle counter is {rows}: all are read"
                )),
                _ => {}
            }
        }
    }

    /// Number of records with measurements. After the declared count, a record of zeros ends them: the rest of a block may be
    /// space that was never written.
    fn valid_rows(layout: &Layout, raw: &[u8], available: usize, delivered: u64) -> usize {
        let Some(rows) = layout.rows else { return available };
        let counted = usize::try_from(rows.max(1).saturating_sub(delivered)).unwrap_or(usize::MAX).min(available);
        let record = raw.len() / available.max(1);
        let more = raw.chunks_exact(record.max(1)).skip(counted);
        counted + more.take_while(|bytes| bytes.iter().any(|byte| *byte != 0)).count()
    }

    /// The next records of some group of a data group. They wait, separated by groups, until there are enough or the stream ends.
    fn advance(&self, reading: &mut Reading, block: &mut Block) -> Result<bool, LogError> {
        let data = &self.file.data[reading.data];
        loop {
            let record_bytes = |records: &Records| self.file.layout(records.group).record_bytes();
            let waiting = |records: &Records| records.waiting.len() / record_bytes(records);
            if reading.flushing
                && let Some(index) = reading.records.iter().position(|records| waiting(records) > 0)
            {
                let records = &reading.records[index];
                let count = waiting(records).min(BLOCK_ROWS);
                let bytes = count * record_bytes(records);
                self.decode(records, count, block);
                reading.records[index].waiting.drain(..bytes);
                reading.records[index].delivered += count as u64;
                return Ok(true);
            }
            if reading.ended {
                return reading.stream.failed().map_or(Ok(false), Err);
            }
            self.read_on(data, reading);
        }
    }

    /// Reads more records of a data group.
    fn read_on(&self, data: &DataGroup, reading: &mut Reading) {
        let (first, layout) = (&reading.records[0], self.file.layout(reading.records[0].group));
        // Records of a sorted data group are read in whole blocks.
        let record = data.id_bytes + layout.record_bytes();
        let target = if data.is_sorted() {
            BLOCK_ROWS.min((STEP / record).max(1)) * record
        } else {
            reading.raw.len() + (1 << 20)
        };
        if let Err(error) = reading.stream.fill(&mut reading.raw, target) {
            reading.stream.fail(error);
        }
        let mut ended = reading.raw.len() < target;
        if data.is_sorted() {
            let read = reading.raw.len() / record;
            let valid = Self::valid_rows(layout, &reading.raw[..read * record], read, first.delivered);
            if valid < read {
                reading.raw.truncate(valid * record);
                ended = true;
                // Damage behind the rows does not matter.
                if valid > 0 {
                    reading.stream.failed();
                }
            }
        }
        let damage = match data.split(&reading.raw, &mut reading.records) {
            Ok(used) => {
                reading.raw.drain(..used);
                (!ended && reading.raw.len() > 64 << 20).then(|| "a record is longer than 64 MiB".to_owned())
            }
            Err(what) => Some(format!("{what} (file of {} bytes)", reading.stream.size())),
        };
        if let Some(what) = damage {
            let place = format!("in the records of {}", self.named(reading));
            reading.stream.fail(LogError::damaged(MDF, place, what));
            (reading.ended, reading.flushing) = (true, true);
            return;
        }
        let waiting = reading.records.iter().map(|records| records.waiting.len()).sum::<usize>();
        (reading.ended, reading.flushing) = (ended, ended || data.is_sorted() || waiting >= STEP);
        if ended {
            reading.stream.cut = !reading.raw.is_empty() && (!data.is_sorted() || layout.rows.is_none());
            let short = reading.records.iter().find_map(|records| {
                let layout = self.file.layout(records.group);
                let available = records.delivered + (records.waiting.len() / layout.record_bytes()) as u64;
                layout.rows.filter(|rows| available < *rows).map(|rows| (records.group, available, rows))
            });
            if let Some((group, available, rows)) = short
                && !reading.stream.has_failed()
            {
                let what = format!("group `{}` has {available} of the {rows} declared rows", self.groups[group].name);
                reading.stream.fail(LogError::Truncated { format: MDF, what, end: reading.stream.size() });
            }
        }
    }
}

impl DataGroup {
    fn is_sorted(&self) -> bool {
        self.groups.len() == 1
    }

    /// Passes complete records to their groups; returns the number of used bytes.
    fn split(&self, raw: &[u8], out: &mut [Records]) -> Result<usize, String> {
        if self.is_sorted() && self.id_bytes == 0 {
            let whole = raw.len() - raw.len() % self.groups[0].record_bytes();
            out[0].waiting.extend_from_slice(&raw[..whole]);
            return Ok(whole);
        }
        let mut at = 0;
        let destination: Vec<Option<usize>> = self
            .groups
            .iter()
            .map(|layout| out.iter().position(|records| Some(records.group) == layout.group))
            .collect();
        while raw.len() - at > self.id_bytes {
            let id = unsigned(&raw[at..at + self.id_bytes]);
            let Some(index) = self.groups.iter().position(|layout| self.is_sorted() || layout.id == id) else {
                return Err(format!("a record has the unknown number {id}"));
            };
            let layout = &self.groups[index];
            let start = at + self.id_bytes;
            let length = if layout.variable {
                let Some(length) = raw.get(start..start + 4) else { break };
                4 + unsigned(length) as usize
            } else {
                layout.record_bytes()
            };
            let Some(record) = raw.get(start..start + length) else { break };
            if let Some(to) = destination[index] {
                out[to].waiting.extend_from_slice(record);
            }
            at = start + length;
        }
        Ok(at)
    }
}
