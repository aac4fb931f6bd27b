//! Random-access bytes with a known end.

use std::io::{Read, SeekFrom};
use std::sync::{Arc, Mutex, PoisonError};

use super::{Bytes, LogError, ReadSeek};

/// Bytes that are read at several positions; clones share one reader.
#[derive(Clone)]
pub(super) struct Source {
    /// The reader and its position.
    reader: Arc<Mutex<(Box<dyn ReadSeek>, u64)>>,
    format: &'static str,
    /// Number of bytes.
    pub size: u64,
}

impl Source {
    pub fn open(bytes: &dyn Bytes, format: &'static str) -> Result<Self, LogError> {
        let mut reader = bytes.open()?;
        let size = reader.seek(SeekFrom::End(0))?;
        Ok(Self { reader: Arc::new(Mutex::new((reader, size))), format, size })
    }

    /// Appends `count` bytes from a position; it allocates memory only for present bytes.
    pub fn append(&self, at: u64, count: usize, out: &mut Vec<u8>) -> Result<(), LogError> {
        if at.checked_add(count as u64).is_none_or(|end| end > self.size) {
            let what = format!("expected {count} bytes at byte {at}");
            return Err(LogError::Truncated { format: self.format, what, end: self.size });
        }
        let (reader, position) = &mut *self.reader.lock().unwrap_or_else(PoisonError::into_inner);
        if *position != at {
            reader.seek(SeekFrom::Start(at))?;
        }
        *position = u64::MAX;
        let read = reader.take(count as u64).read_to_end(out)?;
        if read < count {
            let what = format!("it shrank while kardan read it: {read} of {count} bytes remain at byte {at}");
            return Err(LogError::Truncated { format: self.format, what, end: at + read as u64 });
        }
        *position = at + count as u64;
        Ok(())
    }

    pub fn bytes(&self, at: u64, count: usize) -> Result<Vec<u8>, LogError> {
        let mut out = Vec::new();
        self.append(at, count, &mut out)?;
        Ok(out)
    }

    /// How many of `count` bytes from a position there are.
    pub fn available(&self, at: u64, count: usize) -> usize {
        self.size.saturating_sub(at).min(count as u64) as usize
    }
}

/// A whole number of at most eight bytes, little or big endian.
pub(super) fn word(bytes: &[u8], little: bool) -> u64 {
    let step = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
    if little { bytes.iter().rev().fold(0, step) } else { bytes.iter().fold(0, step) }
}

/// A little-endian [`word`].
pub(super) fn unsigned(bytes: &[u8]) -> u64 {
    word(bytes, true)
}
