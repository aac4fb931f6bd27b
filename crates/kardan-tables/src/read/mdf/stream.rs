//! The records of a data group as one stream of bytes, over all kinds of blocks.

use std::collections::{HashSet, VecDeque};

use super::super::LogError;
use super::super::source::{Source, unsigned};
use super::blocks::{Header, MDF, damaged};

/// Largest size of a decompressed block in bytes (4 MiB in the standard).
const INFLATED_LIMIT: u64 = 64 << 20;
const READ: u64 = 1 << 20;

pub(super) struct Stream {
    source: Source,
    /// The length of the last data block is unreliable: the recording was not finished.
    unfinished: bool,
    /// The next blocks of a list, then the next list.
    ahead: VecDeque<u64>,
    /// Opened blocks, against cycles.
    blocks: HashSet<u64>,
    /// The rest of an uncompressed block.
    at: u64,
    remaining: u64,
    /// The rest of a compressed block.
    inflated: Vec<u8>,
    used: usize,
    /// The data after a truncated uncompressed block.
    after: Option<LogError>,
    failed: Option<LogError>,
    /// The last record was not complete.
    pub cut: bool,
}

impl Stream {
    pub fn open(source: Source, data: u64, unfinished: bool) -> Self {
        Self {
            source,
            unfinished,
            ahead: VecDeque::from([data]),
            blocks: HashSet::new(),
            at: 0,
            remaining: 0,
            inflated: Vec::new(),
            used: 0,
            after: None,
            failed: None,
            cut: false,
        }
    }

    pub fn size(&self) -> u64 {
        self.source.size
    }

    /// Ends the stream with an error, returned after all data before it.
    pub fn fail(&mut self, error: LogError) {
        self.failed = Some(error);
        self.ahead.clear();
        (self.remaining, self.used) = (0, self.inflated.len());
    }

    pub fn failed(&mut self) -> Option<LogError> {
        self.failed.take()
    }

    pub fn has_failed(&self) -> bool {
        self.failed.is_some()
    }

    /// Appends bytes up to a length, fewer only at the end. Bytes before an error are in `out`.
    pub fn fill(&mut self, out: &mut Vec<u8>, length: usize) -> Result<(), LogError> {
        if let Some(error) = self.failed.take() {
            return Err(error);
        }
        while out.len() < length {
            let missing = length - out.len();
            if self.used < self.inflated.len() {
                let count = missing.min(self.inflated.len() - self.used);
                out.extend_from_slice(&self.inflated[self.used..self.used + count]);
                self.used += count;
            } else if self.remaining > 0 {
                let count = (missing as u64).min(self.remaining).min(READ);
                self.source.append(self.at, count as usize, out)?;
                (self.at, self.remaining) = (self.at + count, self.remaining - count);
            } else if let Some(error) = self.after.take() {
                return Err(error);
            } else if !self.next_block()? {
                return Ok(());
            }
        }
        Ok(())
    }

    fn next_block(&mut self) -> Result<bool, LogError> {
        let Some(at) = self.ahead.pop_front() else { return Ok(false) };
        if at == 0 {
            return Ok(true);
        }
        if !self.blocks.insert(at) {
            return Err(damaged(at, "a block of records is listed twice"));
        }
        let header = Header::read(&self.source, at)?;
        match &header.id {
            b"##DT" => {
                self.at = header.data_at();
                self.remaining = header.data_length();
                let available = self.source.size.saturating_sub(self.at);
                if self.unfinished && (self.remaining == 0 || self.remaining > available) {
                    self.remaining = available;
                }
                // The present part of a truncated block is read; the error follows it.
                if self.remaining > available {
                    let what = format!("the block of records at byte {at} has {} bytes", self.remaining);
                    self.after = Some(LogError::Truncated { format: MDF, what, end: self.source.size });
                    self.remaining = available;
                }
            }
            b"##DZ" => self.inflate(&header)?,
            b"##HL" => {
                self.ahead.extend(header.links(&self.source)?.first());
            }
            b"##DL" => {
                let links = header.links(&self.source)?;
                if !self.ahead.is_empty() {
                    return Err(header.unexpected("a block of records inside a list"));
                }
                self.ahead.extend(links.iter().skip(1).chain(links.first()).filter(|at| **at != 0));
            }
            b"##DV" | b"##LD" => {
                return Err(LogError::unsupported(
                    "the MDF file stores its records column by column (MDF 4.2)",
                    "save it as MDF 4.10 or 4.11 (asammdf: `mdf.convert(\"4.10\")`)",
                ));
            }
            _ => return Err(header.unexpected("a block of records")),
        }
        Ok(true)
    }

    fn inflate(&mut self, header: &Header) -> Result<(), LogError> {
        let fields = self.source.bytes(header.data_at(), 24)?;
        let kind = fields[2];
        let width = unsigned(&fields[4..8]) as usize;
        let (length, packed) = (unsigned(&fields[8..16]), unsigned(&fields[16..24]));
        let place = || format!("in the compressed block at byte {}", header.at);
        if length > INFLATED_LIMIT || packed > INFLATED_LIMIT {
            let what = format!(
                "it declares {length} bytes in {packed} compressed ones, more than the limit of {INFLATED_LIMIT}"
            );
            return Err(LogError::damaged(MDF, place(), what));
        }
        if kind > 1 {
            return Err(LogError::unsupported(
                format!("the MDF file is compressed by method {kind}"),
                "save it with compression `deflate` or without",
            ));
        }
        let packed = self.source.bytes(header.data_at() + 24, packed as usize)?;
        let bytes = miniz_oxide::inflate::decompress_to_vec_zlib_with_limit(&packed, length as usize)
            .map_err(|_| LogError::damaged(MDF, place(), "its bytes cannot be decompressed"))?;
        if bytes.len() as u64 != length {
            let what = format!("it contains {} bytes instead of {length}", bytes.len());
            return Err(LogError::damaged(MDF, place(), what));
        }
        self.inflated = if kind == 1 && width > 1 { transposed(&bytes, width) } else { bytes };
        self.used = 0;
        Ok(())
    }
}

/// Records of some width from their bytes column by column; an incomplete record stays at the end.
fn transposed(bytes: &[u8], width: usize) -> Vec<u8> {
    let rows = bytes.len() / width;
    let mut out = bytes.to_vec();
    if rows > 0 {
        for (column, bytes) in bytes[..rows * width].chunks_exact(rows).enumerate() {
            for (row, byte) in bytes.iter().enumerate() {
                out[row * width + column] = *byte;
            }
        }
    }
    out
}
