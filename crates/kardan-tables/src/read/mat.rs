//! MAT files of version 5 as logs.
//!
//! The numbers of a variable are stored column by column, so a column is a range of the file, or of a
//! decompressed variable. Each chosen column has its own decompressor; no variable is ever
//! in memory as a whole.

use std::sync::Arc;

use miniz_oxide::inflate::stream::{InflateState, inflate};
use miniz_oxide::{DataFormat, MZFlush, MZStatus};

use super::mat5::{Array, Broken, Content, Fields, Input, Numbers, Reader, Storage, Stored};
use super::source::{Source, word};
use super::{BLOCK_ROWS, Block, Bytes, Channel, Group, Log, LogError, chosen, find_time, make_unique};

const MAT: &str = "MAT";
const HEADER: u64 = 128;
/// Largest number of examined variables, fields and cells.
const ARRAY_LIMIT: usize = 100_000;
/// Largest number of columns of a matrix.
const COLUMN_LIMIT: usize = 10_000;
const DEPTH_LIMIT: usize = 8;
/// Largest stored size of names, units and notes, bytes: each of very many columns may have a very long name.
const NAME_LIMIT: usize = 10 << 20;
/// Numbers of this many bytes are stored when they are passed.
const SHORT: usize = 64;
/// Bytes of a column read at once.
const STEP: usize = 1 << 20;
/// Bytes of all columns of a group read at once.
const STEPS: usize = 64 << 20;

/// The bytes of a variable, from front to back.
enum Stream {
    Plain(Source),
    Packed(Box<Inflater>),
}

struct Inflater {
    source: Source,
    state: InflateState,
    /// The position of the next compressed bytes.
    at: u64,
    end: u64,
    packed: Vec<u8>,
    used: usize,
    /// Number of delivered bytes.
    delivered: u64,
    ended: bool,
}

impl Stream {
    fn open(source: &Source, variable: Variable) -> Self {
        if !variable.packed {
            return Self::Plain(source.clone());
        }
        Self::Packed(Box::new(Inflater {
            source: source.clone(),
            state: InflateState::new(DataFormat::Zlib),
            at: variable.at,
            end: variable.end,
            packed: Vec::new(),
            used: 0,
            delivered: 0,
            ended: false,
        }))
    }

    /// Appends bytes from a position, which is never before the last one; bytes before an error remain.
    fn append(&mut self, at: u64, count: usize, out: &mut Vec<u8>) -> Result<(), LogError> {
        match self {
            Self::Plain(source) => {
                let available = source.available(at, count);
                source.append(at, available, out)?;
                if available < count { source.append(at + available as u64, count - available, out) } else { Ok(()) }
            }
            Self::Packed(inflater) => {
                let (mut piece, end) = ([0; 4096], at + count as u64);
                while inflater.delivered < end {
                    let before = inflater.delivered;
                    // Bytes before the position are passed.
                    let limit = if before < at { at } else { end };
                    let outcome = inflater.read(&mut piece[..(limit - before).min(4096) as usize]);
                    if before >= at {
                        out.extend_from_slice(&piece[..(inflater.delivered - before) as usize]);
                    }
                    outcome?;
                }
                Ok(())
            }
        }
    }
}

impl Inflater {
    /// Fills a piece.
    fn read(&mut self, piece: &mut [u8]) -> Result<(), LogError> {
        let mut filled = 0;
        while filled < piece.len() {
            if self.used == self.packed.len() && self.at < self.end {
                self.packed.clear();
                self.used = 0;
                let count = (self.end - self.at).min(16 << 10) as usize;
                let available = self.source.available(self.at, count);
                if available == 0 {
                    let what = "a compressed variable continues".to_owned();
                    return Err(LogError::Truncated { format: MAT, what, end: self.source.size });
                }
                self.source.append(self.at, available, &mut self.packed)?;
                self.at += available as u64;
            }
            let result = inflate(&mut self.state, &self.packed[self.used..], &mut piece[filled..], MZFlush::None);
            self.used += result.bytes_consumed;
            filled += result.bytes_written;
            self.delivered += result.bytes_written as u64;
            let stuck = result.bytes_consumed == 0 && result.bytes_written == 0;
            let over = match result.status {
                Ok(MZStatus::Ok) => stuck && self.used < self.packed.len(),
                Ok(MZStatus::StreamEnd) => true,
                Ok(MZStatus::NeedDict) => true,
                Err(_) => stuck && (self.used < self.packed.len() || self.at == self.end),
            };
            if filled < piece.len() && (over || self.ended) {
                let place = format!("in the compressed variable that ends at byte {}", self.end);
                let what = format!("it cannot be decompressed after {} bytes", self.delivered);
                return Err(LogError::damaged(MAT, place, what));
            }
            self.ended = stuck && self.at == self.end && self.used == self.packed.len();
        }
        Ok(())
    }
}

/// The position of a variable.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Variable {
    packed: bool,
    at: u64,
    end: u64,
}

/// The bytes that the traversal of a variable reads; long runs stay in the file.
struct VariableInput {
    stream: Stream,
    buffer: Vec<u8>,
}

#[derive(Debug, Clone)]
enum Run {
    Here(Vec<u8>),
    At(u64),
}

impl Input for VariableInput {
    type Run = Run;
    const SPARSE: bool = false;
    const TEXT: usize = 1 << 20;

    fn read(&mut self, at: u64, count: usize) -> Result<&[u8], Broken> {
        self.buffer.clear();
        self.stream.append(at, count, &mut self.buffer).map_err(Broken::Log)?;
        Ok(&self.buffer)
    }

    fn run(&mut self, at: u64, count: usize) -> Result<Run, Broken> {
        if count > SHORT {
            return Ok(Run::At(at));
        }
        self.read(at, count).map(|bytes| Run::Here(bytes.to_vec()))
    }
}

/// The position of the values of a channel.
#[derive(Debug, Clone)]
struct Column {
    variable: Variable,
    numbers: Numbers<Run>,
    /// The first value.
    first: usize,
    /// From one value to the next.
    spacing: usize,
}

/// A channel before it has a group.
struct PendingChannel {
    /// Distinguishes channels with equal numbers of rows: structure and raster.
    family: (String, String),
    rows: usize,
    channel: Channel,
    is_time: bool,
    column: Column,
}

pub(super) struct MatLog {
    source: Source,
    groups: Vec<Group>,
    columns: Vec<Vec<Column>>,
    constants: Vec<(String, f64)>,
    notes: Vec<String>,
    damage: Option<LogError>,
    reading: Vec<Reading>,
    pending: Option<LogError>,
}

struct Reading {
    group: usize,
    delivered: usize,
    cursors: Vec<Cursor>,
}

struct Cursor {
    column: Column,
    stream: Stream,
    bytes: Vec<u8>,
}

impl MatLog {
    pub(super) fn open(bytes: Arc<dyn Bytes>) -> Result<Self, LogError> {
        let source = Source::open(&*bytes, MAT)?;
        let mut index = Index {
            source,
            little: true,
            budget: ARRAY_LIMIT,
            names: NAME_LIMIT,
            found: Vec::new(),
            constants: Vec::new(),
            notes: Vec::new(),
        };
        let damage = index.variables().err();
        let Index { source, found, constants, mut notes, names, .. } = index;
        if names == 0 {
            notes.push(format!(
                "the names of variables need more than {} MiB: the remaining ones are left out",
                NAME_LIMIT >> 20
            ));
        }
        if found.is_empty() {
            return Err(damage.unwrap_or_else(|| LogError::NoChannels {
                format: MAT,
                why: "it contains no vector or matrix of numbers with at least two rows".into(),
            }));
        }
        let mut families: Vec<(&(String, String), usize)> = Vec::new();
        for one in &found {
            if !families.contains(&(&one.family, one.rows)) {
                families.push((&one.family, one.rows));
            }
        }
        let (mut groups, mut columns) = (Vec::new(), Vec::new());
        for (family, rows) in families {
            let own = || found.iter().filter(|one| &one.family == family && one.rows == rows);
            let mut channels: Vec<Channel> = own().map(|one| one.channel.clone()).collect();
            make_unique(&mut channels);
            let time = own().position(|one| one.is_time).or_else(|| find_time(&channels));
            let parts = [&family.0[..], &family.1[..]].into_iter().filter(|part| !part.is_empty());
            let name = parts.collect::<Vec<_>>().join(" ");
            groups.push(Group { name, channels, time, rows: Some(rows as u64) });
            columns.push(own().map(|one| one.column.clone()).collect());
        }
        Ok(Self { source, groups, columns, constants, notes, damage, reading: Vec::new(), pending: None })
    }
}

/// Traverses the variables.
struct Index {
    source: Source,
    little: bool,
    budget: usize,
    /// Remaining bytes for names.
    names: usize,
    found: Vec<PendingChannel>,
    constants: Vec<(String, f64)>,
    notes: Vec<String>,
}

impl Index {
    /// Whether this many bytes of names may still be stored; after the first refusal no more are.
    fn afford(&mut self, bytes: usize) -> bool {
        self.names = self.names.saturating_sub(bytes + 16);
        self.names > 0
    }

    fn leave_out(&mut self, path: &str, why: &str) {
        if self.afford(path.len() + why.len()) {
            self.notes.push(format!("`{path}` {why}"));
        }
    }

    fn variables(&mut self) -> Result<(), LogError> {
        let end = self.source.size;
        let header = self.source.bytes(0, HEADER as usize)?;
        self.little = match &header[126..] {
            b"IM" => true,
            b"MI" => false,
            _ => return Err(LogError::damaged(MAT, "at byte 126", "the byte order mark is neither `IM` nor `MI`")),
        };
        let mut at = HEADER;
        while at < end {
            let tag = self.source.bytes(at, 8)?;
            let (kind, length) = (word(&tag[..4], self.little), word(&tag[4..], self.little));
            let body = at + 8;
            let variable = Variable { packed: kind == 15, at: body, end: body + length };
            if !matches!(kind, 14 | 15) {
                let what = format!("no variable begins there (element type {kind})");
                return Err(LogError::damaged(MAT, format!("at byte {at}"), what));
            }
            self.variable(variable).map_err(|broken| match broken {
                Broken::Log(error) => error,
                Broken::Damaged(what) | Broken::TooLarge(what) => {
                    LogError::damaged(MAT, format!("in the variable at byte {at}"), what)
                }
            })?;
            at = variable.end;
            if variable.end > end {
                let what = format!("the variable at byte {} has {length} bytes", body - 8);
                return Err(LogError::Truncated { format: MAT, what, end });
            }
        }
        Ok(())
    }

    fn variable(&mut self, variable: Variable) -> Result<(), Broken> {
        let input = VariableInput { stream: Stream::open(&self.source, variable), buffer: Vec::new() };
        let mut reader = Reader::new(input, self.little, variable.at, variable.end);
        if variable.packed {
            reader = Reader::new(reader.input, self.little, 0, 8);
            let tag = reader.input.read(0, 8)?;
            let (kind, length) = (word(&tag[..4], self.little), word(&tag[4..], self.little));
            if kind != 14 {
                return Ok(());
            }
            reader = Reader::new(reader.input, self.little, 8, 8 + length);
        }
        let array = reader.array(DEPTH_LIMIT, &mut self.budget)?;
        if !array.name.is_empty() {
            let name = array.name.clone();
            let family = match array.content {
                Content::Struct(_) | Content::Structs(_) => name.clone(),
                _ => String::new(),
            };
            self.flatten(&name, &array, variable, &(family, String::new()));
        }
        Ok(())
    }

    fn flatten(&mut self, path: &str, array: &Array<Run>, variable: Variable, family: &(String, String)) {
        match &array.content {
            Content::Full(numbers) => self.numbers(path, "", array, numbers, variable, family, false),
            Content::Struct(fields) => self.fields(path, fields, variable, family),
            Content::Structs(structs) => {
                for (k, fields) in structs.iter().enumerate() {
                    self.fields(&format!("{path}({})", k + 1), fields, variable, family);
                }
            }
            Content::Cell(cells) => {
                for (k, cell) in cells.iter().enumerate() {
                    self.flatten(&format!("{path}{{{}}}", k + 1), cell, variable, family);
                }
            }
            Content::Text(_) | Content::Other("nothing") => {}
            Content::Sparse { .. } => self.leave_out(path, "is a sparse matrix and left out"),
            Content::Other(what) => self.leave_out(path, &format!("is {what} and left out")),
        }
    }

    fn fields(&mut self, path: &str, fields: &Fields<Run>, variable: Variable, family: &(String, String)) {
        let text = |names: &[&str]| {
            let of = |name: &&str| {
                fields.iter().find_map(|(field, array)| match &array.content {
                    Content::Text(letters) if field == name => {
                        Some(letters.iter().collect::<String>().trim().to_owned()).filter(|text| !text.is_empty())
                    }
                    _ => None,
                })
            };
            names.iter().find_map(of)
        };
        // ControlDesk: X and Y are structures with Name, Data, Unit and Raster. Simulink: signals with label and values.
        let named = text(&["Name", "label", "title", "blockName"]);
        let unit = text(&["Unit", "unit", "units"]).unwrap_or_default();
        let family = (family.0.clone(), text(&["Raster"]).unwrap_or_else(|| family.1.clone()));
        let is_time = path.rsplit('.').next().is_some_and(|last| last == "X" || last.starts_with("X("));
        for (field, array) in fields {
            match (&array.content, &named) {
                (Content::Full(numbers), Some(name)) if matches!(&field[..], "Data" | "values" | "data") => {
                    self.numbers(name, &unit, array, numbers, variable, &family, is_time);
                }
                _ => self.flatten(&format!("{path}.{field}"), array, variable, &family),
            }
        }
    }

    #[allow(clippy::too_many_arguments)]
    fn numbers(
        &mut self,
        path: &str,
        unit: &str,
        array: &Array<Run>,
        numbers: &Numbers<Run>,
        variable: Variable,
        family: &(String, String),
        is_time: bool,
    ) {
        let sides: Vec<usize> = array.dimensions.iter().copied().filter(|side| *side != 1).collect();
        let (rows, columns, across) = match sides[..] {
            _ if array.complex => return self.leave_out(path, "is complex and left out"),
            [] => {
                if let (Run::Here(bytes), true) = (&numbers.bytes, self.afford(path.len())) {
                    self.constants.push((path.to_owned(), value(numbers.storage, numbers.little, bytes)));
                }
                return;
            }
            [rows] => (rows, 1, false),
            [rows, columns] if rows >= columns => (rows, columns, false),
            [columns, rows] => (rows, columns, true),
            _ => return self.leave_out(path, "has more than two dimensions and is left out"),
        };
        if columns > COLUMN_LIMIT || columns > self.budget {
            return self.leave_out(path, &format!("has {columns} columns, too many, and is left out"));
        }
        self.budget -= columns;
        for k in 0..if rows == 0 { 0 } else { columns } {
            let name = match (columns, across) {
                (1, _) => path.to_owned(),
                (_, false) => format!("{path}(:,{})", k + 1),
                (_, true) => format!("{path}({},:)", k + 1),
            };
            if !self.afford(name.len() + unit.len() + family.0.len() + family.1.len()) {
                return;
            }
            let (first, spacing) = if across { (k, columns) } else { (k * rows, 1) };
            let column = Column { variable, numbers: numbers.clone(), first, spacing };
            let channel = Channel { name, unit: unit.to_owned() };
            self.found.push(PendingChannel { family: family.clone(), rows, channel, is_time, column });
        }
    }
}

fn value(storage: Storage, little: bool, bytes: &[u8]) -> f64 {
    match storage.stored(word(bytes, little)) {
        Stored::Unsigned(x) => x as f64,
        Stored::Signed(x) => x as f64,
        Stored::Float(x) => x,
    }
}

impl Cursor {
    /// Appends values; those before an error remain.
    fn read(&mut self, from: usize, count: usize, out: &mut Vec<f64>) -> Result<(), LogError> {
        let Column { numbers: Numbers { storage, little, ref bytes, .. }, first, spacing, .. } = self.column;
        let width = storage.size();
        let start = (first + from * spacing) * width;
        let length = ((count - 1) * spacing + 1) * width;
        self.bytes.clear();
        let outcome = match bytes {
            Run::Here(bytes) => {
                self.bytes.extend_from_slice(bytes.get(start..start + length).unwrap_or(&[]));
                Ok(())
            }
            Run::At(at) => self.stream.append(at + start as u64, length, &mut self.bytes),
        };
        let values = self.bytes.chunks(spacing * width).filter_map(|chunk| chunk.get(..width));
        match storage {
            Storage::Double if little => {
                out.extend(values.map(|bytes| bytes.try_into().map_or(f64::NAN, f64::from_le_bytes)));
            }
            _ => out.extend(values.map(|bytes| value(storage, little, bytes))),
        }
        outcome
    }
}

impl Log for MatLog {
    fn groups(&self) -> &[Group] {
        &self.groups
    }

    fn choose(&mut self, selection: &[(usize, usize)]) -> Result<(), LogError> {
        let channels = chosen(&self.groups, selection)?;
        self.reading.clear();
        self.pending = if selection.is_empty() { None } else { self.damage.clone() };
        for (group, channels) in channels.into_iter().enumerate().filter(|(_, channels)| !channels.is_empty()) {
            let cursor = |channel: &usize| {
                let column = self.columns[group][*channel].clone();
                let stream = Stream::open(&self.source, column.variable);
                Cursor { column, stream, bytes: Vec::new() }
            };
            self.reading.push(Reading { group, delivered: 0, cursors: channels.iter().map(cursor).collect() });
        }
        Ok(())
    }

    fn next(&mut self, block: &mut Block) -> Result<bool, LogError> {
        let share =
            |reading: &Reading| reading.delivered as f64 / self.groups[reading.group].rows.unwrap_or(1).max(1) as f64;
        let next = (0..self.reading.len()).min_by(|a, b| share(&self.reading[*a]).total_cmp(&share(&self.reading[*b])));
        let Some(next) = next else { return self.pending.take().map_or(Ok(false), Err) };
        let reading = &mut self.reading[next];
        let rows = self.groups[reading.group].rows.unwrap_or(0) as usize;
        let widths =
            || reading.cursors.iter().map(|cursor| cursor.column.spacing * cursor.column.numbers.storage.size());
        let most = (STEP / widths().max().unwrap_or(8)).min(STEPS / widths().sum::<usize>().max(1));
        let count = (rows - reading.delivered).min(BLOCK_ROWS).min(most.max(1));
        let from = reading.delivered;
        let error =
            block.fill(reading.group, &mut reading.cursors, count, |cursor, column| cursor.read(from, count, column));
        let available = block.rows;
        reading.delivered += available;
        if available < count || reading.delivered == rows {
            self.reading.remove(next);
        }
        if let Some(error) = error {
            if available == 0 {
                self.pending = None;
                return Err(error);
            }
            self.pending = Some(error);
        }
        if available == 0 { self.next(block) } else { Ok(true) }
    }

    fn notes(&self) -> Vec<String> {
        self.notes.clone()
    }

    fn constants(&self) -> &[(String, f64)] {
        &self.constants
    }
}
