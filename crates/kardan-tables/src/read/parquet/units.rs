//! Column metadata of an Arrow schema: a flatbuffer in base64, as pyarrow writes it into the metadata.

use super::super::source::unsigned;
use crate::text::BASE64;

/// The metadata of a column.
pub(super) struct Field {
    pub name: String,
    /// `unit` of its metadata.
    pub unit: Option<String>,
    /// If its whole numbers are durations: their number per second.
    pub per_second: Option<f64>,
}

/// The number of the type `Duration`.
const DURATION: usize = 18;

/// The top-level columns.
pub(super) fn fields(schema: &str) -> Vec<Field> {
    decoded(schema).and_then(|bytes| found(&bytes)).unwrap_or_default()
}

fn decoded(text: &str) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(text.len() / 4 * 3);
    let (mut word, mut bits) = (0u32, 0);
    for byte in text.trim_end_matches('=').bytes() {
        let digit = BASE64.iter().position(|digit| *digit == byte)?;
        (word, bits) = (word << 6 | digit as u32, bits + 6);
        if bits >= 8 {
            bits -= 8;
            out.push((word >> bits) as u8);
        }
    }
    Some(out)
}

/// A flatbuffer; every access is checked.
struct Buffer<'a>(&'a [u8]);

impl Buffer<'_> {
    fn number(&self, at: usize, count: usize) -> Option<usize> {
        let bytes = self.0.get(at..at.checked_add(count)?)?;
        Some(unsigned(bytes) as usize)
    }

    fn follow(&self, at: usize) -> Option<usize> {
        at.checked_add(self.number(at, 4)?)
    }

    /// The position of a slot of a table.
    fn slot(&self, table: usize, slot: usize) -> Option<usize> {
        let back = self.number(table, 4)? as u32 as i32;
        let directory = usize::try_from(i64::try_from(table).ok()? - i64::from(back)).ok()?;
        let place = 4 + 2 * slot;
        if place + 2 > self.number(directory, 2)? {
            return None;
        }
        match self.number(directory + place, 2)? {
            0 => None,
            offset => Some(table + offset),
        }
    }

    fn child(&self, table: usize, slot: usize) -> Option<usize> {
        self.follow(self.slot(table, slot)?)
    }

    fn text(&self, table: usize, slot: usize) -> Option<String> {
        let at = self.child(table, slot)?;
        let bytes = self.0.get(at + 4..(at + 4).checked_add(self.number(at, 4)?)?)?;
        Some(String::from_utf8_lossy(bytes).into_owned())
    }

    /// The tables of a list.
    fn tables(&self, table: usize, slot: usize) -> Option<Vec<usize>> {
        let at = self.child(table, slot)?;
        let count = self.number(at, 4)?.min(self.0.len() / 4);
        (0..count).map(|k| self.follow(at + 4 + 4 * k)).collect()
    }
}

fn found(bytes: &[u8]) -> Option<Vec<Field>> {
    let start = if bytes.starts_with(&[0xff; 4]) { 8 } else { 4 };
    let buffer = Buffer(bytes.get(start..)?);
    // Message: header in slot 2. Schema: fields in slot 1. Field: name in slot 0, type in slots 2 and 3, metadata in slot 6.
    let schema = buffer.child(buffer.follow(0)?, 2)?;
    let unit = |field: usize| {
        let pairs = buffer.tables(field, 6)?;
        buffer.text(*pairs.iter().find(|pair| buffer.text(**pair, 0).as_deref() == Some("unit"))?, 1)
    };
    let per_second = |field: usize| {
        if buffer.number(buffer.slot(field, 2)?, 1)? != DURATION {
            return None;
        }
        // Milliseconds are the default.
        let kind = buffer.child(field, 3)?;
        let unit = buffer.slot(kind, 0).map_or(Some(1), |at| buffer.number(at, 2))?;
        [1.0, 1e3, 1e6, 1e9].get(unit).copied()
    };
    let of =
        |field: usize| Some(Field { name: buffer.text(field, 0)?, unit: unit(field), per_second: per_second(field) });
    Some(buffer.tables(schema, 1)?.into_iter().filter_map(of).collect())
}
