//! Random-access bytes with a known end.

use std::io::{Read, SeekFrom};

use super::{Bytes, LogError, ReadSeek};

pub(super) struct Source {
    reader: Box<dyn ReadSeek>,
    format: &'static str,
    /// Number of bytes.
    pub size: u64,
    at: u64,
}

impl Source {
    pub fn open(bytes: &dyn Bytes, format: &'static str) -> Result<Self, LogError> {
        let mut reader = bytes.open()?;
        let size = reader.seek(SeekFrom::End(0))?;
        Ok(Self { reader, format, size, at: size })
    }

    /// Appends `count` bytes from a position; it allocates memory only for present bytes.
    pub fn append(&mut self, at: u64, count: usize, out: &mut Vec<u8>) -> Result<(), LogError> {
        if at.checked_add(count as u64).is_none_or(|end| end > self.size) {
            let what = format!("expected {count} bytes at byte {at}");
            return Err(LogError::Truncated { format: self.format, what, end: self.size });
        }
        if self.at != at {
            self.reader.seek(SeekFrom::Start(at))?;
        }
        self.at = u64::MAX;
        let read = (&mut self.reader).take(count as u64).read_to_end(out)?;
        if read < count {
            let what = format!("it shrank while kardan read it: {read} of {count} bytes remain at byte {at}");
            return Err(LogError::Truncated { format: self.format, what, end: at + read as u64 });
        }
        self.at = at + count as u64;
        Ok(())
    }

    pub fn bytes(&mut self, at: u64, count: usize) -> Result<Vec<u8>, LogError> {
        let mut out = Vec::new();
        self.append(at, count, &mut out)?;
        Ok(out)
    }
}
