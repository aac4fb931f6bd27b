//! Units of columns from the metadata of an Arrow schema: a flatbuffer in base64, as pyarrow writes it.

/// Names of columns with their units.
pub(super) fn units(schema: &str) -> Vec<(String, String)> {
    decoded(schema).and_then(|bytes| found(&bytes)).unwrap_or_default()
}

fn decoded(text: &str) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(text.len() / 4 * 3);
    let (mut word, mut bits) = (0u32, 0);
    for byte in text.trim_end_matches('=').bytes() {
        let digit = match byte {
            b'A'..=b'Z' => byte - b'A',
            b'a'..=b'z' => byte - b'a' + 26,
            b'0'..=b'9' => byte - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        };
        (word, bits) = (word << 6 | u32::from(digit), bits + 6);
        if bits >= 8 {
            bits -= 8;
            out.push((word >> bits) as u8);
        }
    }
    Some(out)
}

/// A flatbuffer; every place is checked.
struct Buffer<'a>(&'a [u8]);

impl Buffer<'_> {
    fn number(&self, at: usize, count: usize) -> Option<usize> {
        let bytes = self.0.get(at..at.checked_add(count)?)?;
        Some(bytes.iter().rev().fold(0, |sum, byte| sum << 8 | usize::from(*byte)))
    }

    fn follow(&self, at: usize) -> Option<usize> {
        at.checked_add(self.number(at, 4)?)
    }

    /// Where a slot of a table is.
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

fn found(bytes: &[u8]) -> Option<Vec<(String, String)>> {
    let start = if bytes.starts_with(&[0xff; 4]) { 8 } else { 4 };
    let buffer = Buffer(bytes.get(start..)?);
    // Message: header in slot 2. Schema: fields in slot 1. Field: name in slot 0, metadata in slot 6.
    let schema = buffer.child(buffer.follow(0)?, 2)?;
    let mut out = Vec::new();
    for field in buffer.tables(schema, 1)? {
        for pair in buffer.tables(field, 6).unwrap_or_default() {
            if let (Some("unit"), Some(unit), Some(name)) =
                (buffer.text(pair, 0).as_deref(), buffer.text(pair, 1), buffer.text(field, 0))
            {
                out.push((name, unit));
            }
        }
    }
    Some(out)
}
