//! The blocks with the channels and the positions of their records.

use std::collections::HashSet;

use super::super::source::{Source, unsigned};
use super::super::{Channel, Group, LogError, find_time, make_unique};
use super::field::{Conversion, Field, Kind};

/// The name of the format in messages.
pub(super) const MDF: &str = "MDF";

/// The position of a channel group: data group, channel group in it.
type Place = (usize, usize);

/// Largest length of text, block and record, bytes.
const TEXT_LIMIT: u64 = 64 << 10;
const BLOCK_LIMIT: u64 = 1 << 20;
const RECORD_LIMIT: usize = 16 << 20;
/// Largest number of links of a block: a list of blocks of records in a file of hundreds of GB.
const LINK_LIMIT: u64 = 1 << 20;
/// Nesting depth of structures.
const DEPTH_LIMIT: usize = 4;

pub(super) struct File {
    pub data: Vec<DataGroup>,
    /// The position of each group.
    pub places: Vec<Place>,
    /// Whether the length of the last block of records is unknown.
    pub unfinished_length: bool,
}

/// Records in one stream.
pub(super) struct DataGroup {
    pub data: u64,
    pub id_bytes: usize,
    pub groups: Vec<Layout>,
}

/// The records of a channel group.
pub(super) struct Layout {
    pub id: u64,
    /// The number of the [`Group`] if it has channels.
    pub group: Option<usize>,
    pub rows: Option<u64>,
    /// Records of variable length (texts): skipped.
    pub variable: bool,
    pub data_bytes: usize,
    pub invalid_bytes: usize,
    pub fields: Vec<Field>,
}

impl Layout {
    pub fn record_bytes(&self) -> usize {
        self.data_bytes + self.invalid_bytes
    }
}

/// The file is damaged at a byte.
pub(super) fn damaged(at: u64, what: impl Into<String>) -> LogError {
    LogError::damaged(MDF, format!("at byte {at}"), what)
}

/// A block without its contents.
pub(super) struct Header {
    pub id: [u8; 4],
    pub at: u64,
    length: u64,
    links: u64,
}

impl Header {
    pub fn read(source: &Source, at: u64) -> Result<Self, LogError> {
        let bytes = source.bytes(at, 24)?;
        let id = [bytes[0], bytes[1], bytes[2], bytes[3]];
        let (length, links) = (unsigned(&bytes[8..16]), unsigned(&bytes[16..24]));
        let header = Self { id, at, length, links };
        if !id.starts_with(b"##") {
            return Err(damaged(at, "a link points there, but no block begins there"));
        }
        // A block of records that a crash left without its length has length 0.
        let unfinished = length == 0 && links == 0 && &id == b"##DT";
        if !unfinished && (links > LINK_LIMIT || length < 24 + 8 * links) {
            let what = format!("block {} declares {length} bytes with {links} links", header.name());
            return Err(damaged(at, what));
        }
        Ok(header)
    }

    pub fn name(&self) -> String {
        String::from_utf8_lossy(&self.id[2..]).into_owned()
    }

    pub fn data_at(&self) -> u64 {
        self.at + 24 + 8 * self.links
    }

    pub fn end(&self) -> u64 {
        self.at.saturating_add(self.length)
    }

    pub fn data_length(&self) -> u64 {
        self.length.saturating_sub(24 + 8 * self.links)
    }

    pub fn links(&self, source: &Source) -> Result<Vec<u64>, LogError> {
        let bytes = source.bytes(self.at + 24, 8 * self.links as usize)?;
        Ok(bytes.chunks_exact(8).map(unsigned).collect())
    }

    pub fn unexpected(&self, expected: &str) -> LogError {
        damaged(self.at, format!("expected {expected} there, found {}", self.name()))
    }
}

/// A block with its links and its data.
struct Read {
    links: Vec<u64>,
    data: Vec<u8>,
    at: u64,
    what: &'static str,
}

impl Read {
    fn link(&self, index: usize) -> u64 {
        self.links.get(index).copied().unwrap_or(0)
    }

    /// A number of the data.
    fn number(&self, at: usize, count: usize) -> Result<u64, LogError> {
        match self.data.get(at..at + count) {
            Some(bytes) => Ok(unsigned(bytes)),
            None => Err(damaged(self.at, format!("{} is too short", self.what))),
        }
    }

    fn floats(&self, at: usize, count: usize) -> Option<Vec<f64>> {
        let bytes = self.data.get(at..at.checked_add(8 * count)?)?;
        Some(bytes.chunks_exact(8).map(|bytes| f64::from_bits(unsigned(bytes))).collect())
    }
}

struct Traversal<'a> {
    source: &'a Source,
    /// Whether the numbers of rows are unknown: the recording was not finished.
    uncounted: bool,
    /// Visited blocks of chains, against cycles.
    visited: HashSet<u64>,
    notes: Vec<String>,
    groups: Vec<Group>,
    /// The data group and the position in it of each of `groups`.
    places: Vec<Place>,
}

pub(super) fn read(source: &Source) -> Result<(File, Vec<Group>, Vec<String>), LogError> {
    let start = source.bytes(0, 64)?;
    let unfinished = start.starts_with(b"UnFinMF ");
    let version = unsigned(&start[28..30]);
    let version_text = String::from_utf8_lossy(&start[8..16]).trim_matches(['\0', ' ']).to_owned();
    if version < 400 || !start[8..16].starts_with(b"4.") {
        return Err(LogError::unsupported(
            format!("the file is MDF of version {version_text} ({version}); version 4 is read"),
            "convert it to MDF 4 (asammdf: `MDF(FILE).convert(\"4.10\").save(...)`)",
        ));
    }
    let flags = if unfinished { unsigned(&start[60..62]) } else { 0 };
    let uncounted = unfinished && flags & 1 != 0;
    let (visited, notes, groups, places) = (HashSet::new(), Vec::new(), Vec::new(), Vec::new());
    let mut traversal = Traversal { source, uncounted, visited, notes, groups, places };
    if unfinished {
        traversal.notes.push("the recording was not finished (UnFinMF): all complete records are read".into());
    }
    let header = traversal.block(64, b"##HD", "the header")?;
    let mut data = Vec::new();
    let mut next = header.link(0);
    while next != 0 {
        // Records before damage in the chain are still read.
        match traversal.data_group(next, data.len()) {
            Ok((group, after)) => {
                data.push(group);
                next = after;
            }
            Err(error) if traversal.groups.is_empty() => return Err(error),
            Err(error) => {
                traversal.notes.push(format!("groups are missing: {error}"));
                break;
            }
        }
    }
    let Traversal { notes, groups, places, .. } = traversal;
    if groups.is_empty() {
        let why = match notes.first() {
            Some(note) => format!("no group contains readable numbers ({note})"),
            None => "no group contains numbers; was anything recorded?".into(),
        };
        return Err(LogError::NoChannels { format: MDF, why });
    }
    Ok((File { data, places, unfinished_length: unfinished }, groups, notes))
}

impl Traversal<'_> {
    fn block(&mut self, at: u64, id: &[u8; 4], what: &'static str) -> Result<Read, LogError> {
        let header = Header::read(self.source, at)?;
        if header.id != *id {
            return Err(header.unexpected(what));
        }
        let links = header.links(self.source)?;
        let data = self.source.bytes(header.data_at(), header.data_length().min(BLOCK_LIMIT) as usize)?;
        Ok(Read { links, data, at, what })
    }

    /// A block of a chain, which is visited only once.
    fn chained(&mut self, at: u64, id: &[u8; 4], what: &'static str) -> Result<Read, LogError> {
        if !self.visited.insert(at) {
            return Err(damaged(at, format!("the links form a cycle to {what}")));
        }
        self.block(at, id, what)
    }

    /// A text; `None` if it cannot be read.
    fn text(&mut self, at: u64) -> String {
        if at == 0 {
            return String::new();
        }
        let Ok(header) = Header::read(self.source, at) else { return String::new() };
        if !matches!(&header.id, b"##TX" | b"##MD") {
            return String::new();
        }
        let length = header.data_length().min(TEXT_LIMIT) as usize;
        let Ok(bytes) = self.source.bytes(header.data_at(), length) else { return String::new() };
        let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(bytes.len());
        let text = String::from_utf8_lossy(&bytes[..end]).into_owned();
        let inside = || text.split_once("<TX>")?.1.split_once("</TX>");
        let text = if &header.id == b"##MD" { inside().map_or("", |(text, _)| text) } else { &text };
        text.trim().to_owned()
    }

    fn data_group(&mut self, at: u64, index: usize) -> Result<(DataGroup, u64), LogError> {
        let block = self.chained(at, b"##DG", "a data group")?;
        let id_bytes = block.number(0, 1)? as usize;
        if !matches!(id_bytes, 0 | 1 | 2 | 4 | 8) {
            let what = format!("a data group declares record numbers of {id_bytes} bytes");
            return Err(damaged(at, what));
        }
        let mut group = DataGroup { data: block.link(2), id_bytes, groups: Vec::new() };
        let mut next = block.link(1);
        while next != 0 {
            let (mut layout, found, after) = self.channel_group(next)?;
            if let Some(found) = found {
                layout.group = Some(self.groups.len());
                self.places.push((index, group.groups.len()));
                self.groups.push(found);
            }
            group.groups.push(layout);
            next = after;
        }
        if group.groups.len() > 1 && id_bytes == 0 {
            let what = "a data group has several groups of channels, but its records have no numbers";
            return Err(damaged(at, what));
        }
        Ok((group, block.link(0)))
    }

    fn channel_group(&mut self, at: u64) -> Result<(Layout, Option<Group>, u64), LogError> {
        let block = self.chained(at, b"##CG", "a group of channels")?;
        let (id, rows, flags) = (block.number(0, 8)?, block.number(8, 8)?, block.number(16, 2)?);
        let (data_bytes, invalid_bytes) = (block.number(24, 4)? as usize, block.number(28, 4)? as usize);
        let variable = flags & 1 != 0;
        let (data_bytes, invalid_bytes) = if variable { (0, 0) } else { (data_bytes, invalid_bytes) };
        if data_bytes.saturating_add(invalid_bytes) > RECORD_LIMIT {
            let what = format!("a group of channels declares records of {data_bytes} bytes");
            return Err(damaged(at, what));
        }
        let rows = (!self.uncounted).then_some(rows);
        let mut layout = Layout { id, group: None, rows, variable, data_bytes, invalid_bytes, fields: Vec::new() };
        let mut name = self.text(block.link(2));
        if name.is_empty() && block.link(3) != 0 {
            name = self
                .block(block.link(3), b"##SI", "a source")
                .map_or_else(|_| String::new(), |source| self.text(source.link(0)));
        }
        if name.is_empty() {
            name = format!("group {}", self.groups.len() + 1);
        }
        let mut group = Group { name, channels: Vec::new(), time: None, rows };
        if flags & 8 != 0 {
            self.notes.push(format!("`{}` has its time in another group (MDF 4.2) and is left out", group.name));
        } else if !variable && layout.record_bytes() > 0 {
            let mut master = None;
            self.channels(block.link(1), "", &mut layout, &mut group, &mut master, DEPTH_LIMIT)?;
            make_unique(&mut group.channels);
            group.time = master.or_else(|| find_time(&group.channels));
        }
        let found = (!group.channels.is_empty()).then_some(group);
        Ok((layout, found, block.link(0)))
    }

    fn channels(
        &mut self,
        mut next: u64,
        prefix: &str,
        layout: &mut Layout,
        group: &mut Group,
        master: &mut Option<usize>,
        depth: usize,
    ) -> Result<(), LogError> {
        while next != 0 {
            let block = self.chained(next, b"##CN", "a channel")?;
            next = block.link(0);
            let name = format!("{prefix}{}", self.text(block.link(2)));
            let composition = block.link(1);
            if composition != 0
                && let Ok(header) = Header::read(self.source, composition)
            {
                if &header.id == b"##CN" && depth > 0 {
                    self.channels(composition, &format!("{name}."), layout, group, master, depth - 1)?;
                    continue;
                }
                self.notes.push(format!("`{name}` is an array and is left out"));
                continue;
            }
            match self.channel(&block, layout)? {
                Ok((field, unit)) => {
                    let (kind, sync) = (block.number(0, 1)?, block.number(1, 1)?);
                    let is_time = matches!(kind, 2 | 3) && sync <= 1;
                    if is_time && master.is_none() {
                        *master = Some(layout.fields.len());
                    }
                    let mut unit = if unit.is_empty() { self.text(block.link(6)) } else { unit };
                    if unit.is_empty() && is_time {
                        unit = "s".into();
                    }
                    layout.fields.push(field);
                    group.channels.push(Channel { name, unit });
                }
                Err(why) => self.notes.push(format!("`{name}` {why} and is left out")),
            }
        }
        Ok(())
    }

    /// The field and the unit of a channel, or why it is not a channel of numbers.
    fn channel(&mut self, block: &Read, layout: &Layout) -> Result<Result<(Field, String), String>, LogError> {
        let (kind, data_type) = (block.number(0, 1)?, block.number(2, 1)?);
        let (bit, byte, bits) = (block.number(3, 1)? as u32, block.number(4, 4)? as usize, block.number(8, 4)?);
        let (flags, invalid_bit) = (block.number(12, 4)?, block.number(16, 4)? as usize);
        let (stored, big_endian) = match (kind, data_type) {
            (1 | 4 | 5, _) => return Ok(Err("has values of variable length".into())),
            (3 | 6, _) => (Kind::Index, false),
            (_, 0 | 1) => (Kind::Unsigned, data_type == 1),
            (_, 2 | 3) => (Kind::Signed, data_type == 3),
            (_, 4 | 5) => (Kind::Float, data_type == 5),
            _ => return Ok(Err("contains no numbers (text, bytes or dates)".into())),
        };
        let sound = match stored {
            Kind::Index => true,
            Kind::Float => matches!(bits, 16 | 32 | 64) && bit == 0,
            _ => (1..=64).contains(&bits) && bit < 8,
        };
        if !sound {
            return Err(damaged(block.at, format!("a channel has {bits} bits from bit {bit} on")));
        }
        let invalid = (layout.invalid_bytes > 0 && flags & 2 != 0).then_some(invalid_bit);
        if flags & 1 != 0 {
            return Ok(Err("has only invalid values".into()));
        }
        let (conversion, unit) = match block.link(4) {
            0 => (Conversion::None, String::new()),
            at => match self.conversion(at)? {
                Ok(found) => found,
                Err(why) => return Ok(Err(why)),
            },
        };
        let field = Field { kind: stored, big_endian, byte, bit, bits: bits as u32, invalid, conversion };
        if byte.checked_add(field.bytes()).is_none_or(|end| stored != Kind::Index && end > layout.data_bytes) {
            let what = format!("a channel is outside the {} bytes of its record", layout.data_bytes);
            return Err(damaged(block.at, what));
        }
        let unit = match self.text(block.link(6)) {
            own if own.is_empty() => unit,
            own => own,
        };
        Ok(Ok((field, unit)))
    }

    fn conversion(&mut self, at: u64) -> Result<Result<(Conversion, String), String>, LogError> {
        let block = self.block(at, b"##CC", "a conversion")?;
        let unit = self.text(block.link(1));
        let (kind, count) = (block.number(0, 1)?, block.number(6, 2)? as usize);
        let Some(values) = block.floats(24, count) else {
            let what = format!("a conversion declares {count} numbers, but has fewer");
            return Err(damaged(at, what));
        };
        let conversion = match (kind, &values[..]) {
            (0, _) => Conversion::None,
            (1, [offset, factor, ..]) => Conversion::Linear { offset: *offset, factor: *factor },
            (2, &[a, b, c, d, e, f, ..]) => Conversion::Rational([a, b, c, d, e, f]),
            (3, _) => return Ok(Err("is converted by a formula".into())),
            (4 | 5, _) => {
                let pairs: Vec<(f64, f64)> = values.chunks_exact(2).map(|pair| (pair[0], pair[1])).collect();
                if !pairs.is_sorted_by(|a, b| a.0 < b.0) {
                    return Err(damaged(at, "the keys of a table do not increase"));
                }
                Conversion::Table { pairs, between: kind == 4 }
            }
            (6, _) => {
                let rows = values.chunks_exact(3).map(|row| (row[0], row[1], row[2])).collect();
                let default = if values.len() % 3 == 1 { values[values.len() - 1] } else { f64::NAN };
                Conversion::Ranges { rows, default }
            }
            // Numbers that encode words stay numbers.
            (7..=11, _) => Conversion::None,
            _ => {
                let what = format!("a conversion of kind {kind} has {count} numbers");
                return Err(damaged(at, what));
            }
        };
        Ok(Ok((conversion, unit)))
    }
}
