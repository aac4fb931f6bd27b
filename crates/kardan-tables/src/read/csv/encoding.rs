//! The text of a file in any encoding, as UTF-8.

use std::io::{self, BufRead, Cursor, Read};

use crate::read::{Bytes, ReadSeek};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Encoding {
    /// UTF-8 or any single bytes.
    Bytes,
    Utf8Mark,
    Utf16 {
        little: bool,
    },
}

/// The text without its byte order mark, as UTF-8 or as single bytes.
pub(super) fn text(bytes: &dyn Bytes, encoding: Encoding) -> io::Result<Box<dyn Read + Send>> {
    let mut reader = bytes.open()?;
    let mut mark = [0; 3];
    let length = match encoding {
        Encoding::Bytes => 0,
        Encoding::Utf8Mark => 3,
        Encoding::Utf16 { .. } => 2,
    };
    reader.read_exact(&mut mark[..length])?;
    Ok(match encoding {
        Encoding::Utf16 { little } => Box::new(Utf16 { reader, little, ready: Cursor::default(), half: Vec::new() }),
        _ => Box::new(reader),
    })
}

/// UTF-16 read as UTF-8.
struct Utf16 {
    reader: Box<dyn ReadSeek>,
    little: bool,
    ready: Cursor<Vec<u8>>,
    /// Bytes of an incomplete character.
    half: Vec<u8>,
}

impl Read for Utf16 {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        while self.ready.fill_buf()?.is_empty() {
            let mut raw = std::mem::take(&mut self.half);
            let length_before = raw.len();
            (&mut self.reader).take(1 << 16).read_to_end(&mut raw)?;
            let ended = raw.len() == length_before;
            if ended && raw.is_empty() {
                return Ok(0);
            }
            let unit = if self.little { u16::from_le_bytes } else { u16::from_be_bytes };
            let mut units: Vec<u16> = raw.chunks_exact(2).map(|pair| unit([pair[0], pair[1]])).collect();
            let mut used = 2 * units.len();
            if !ended && units.last().is_some_and(|unit| (0xd800..0xdc00).contains(unit)) {
                units.pop();
                used -= 2;
            }
            if !ended {
                self.half.extend_from_slice(&raw[used..]);
            }
            let text: String = char::decode_utf16(units).map(|c| c.unwrap_or('\u{fffd}')).collect();
            self.ready = Cursor::new(text.into_bytes());
        }
        self.ready.read(out)
    }
}
