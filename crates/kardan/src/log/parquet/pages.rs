//! Pages of a column chunk from a file that is not trusted.
//!
//! The pages come from the crate `parquet` as if they were not compressed and are inflated here: with a bound, and for
//! gzip and Zstandard without the C libraries that the crate would bring.

use std::io::Read;
use std::sync::{Arc, Mutex, PoisonError};

use ::bytes::Bytes;
use ::parquet::basic::Compression;
use ::parquet::column::page::{Page, PageMetadata, PageReader};
use ::parquet::errors::{ParquetError, Result};
use ::parquet::file::reader::{ChunkReader, Length, SerializedPageReader};

use super::super::source::Source;

/// The most bytes of a page, and of the description of a file.
pub(super) const LIMIT: usize = 256 << 20;

/// A file that is read at several places.
#[derive(Clone)]
pub(super) struct Shared(pub Arc<Mutex<Source>>);

impl Shared {
    pub fn bytes(&self, at: u64, count: usize) -> Result<Vec<u8>> {
        if count > LIMIT {
            return Err(ParquetError::General(format!("{count} bytes are announced at byte {at}, more than are read")));
        }
        let mut source = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        source.bytes(at, count).map_err(|error| ParquetError::General(error.to_string()))
    }
}

impl Length for Shared {
    fn len(&self) -> u64 {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).size
    }
}

impl ChunkReader for Shared {
    type T = Forward;

    fn get_read(&self, start: u64) -> Result<Forward> {
        Ok(Forward { file: self.clone(), at: start, ready: Vec::new(), used: 0 })
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes> {
        self.bytes(start, length).map(Bytes::from)
    }
}

/// Reads on from a place.
pub(super) struct Forward {
    file: Shared,
    at: u64,
    ready: Vec<u8>,
    used: usize,
}

impl Read for Forward {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        if self.used == self.ready.len() {
            // The headers of pages are short.
            let there = self.file.len().saturating_sub(self.at).min(256.max(out.len() as u64).min(1 << 16));
            self.ready = self.file.bytes(self.at, there as usize).map_err(std::io::Error::other)?;
            (self.at, self.used) = (self.at + there, 0);
        }
        let count = out.len().min(self.ready.len() - self.used);
        out[..count].copy_from_slice(&self.ready[self.used..self.used + count]);
        self.used += count;
        Ok(count)
    }
}

/// Whether pages of a compression are read.
pub(super) fn is_read(compression: Compression) -> bool {
    matches!(compression, Compression::UNCOMPRESSED | Compression::SNAPPY | Compression::GZIP(_) | Compression::ZSTD(_))
}

/// Inflates the pages of a column chunk.
pub(super) struct Inflated {
    pub pages: SerializedPageReader<Shared>,
    pub compression: Compression,
}

impl Inflated {
    fn inflate(&self, bytes: &[u8]) -> Result<Vec<u8>> {
        let broken = |what: &str| ParquetError::General(format!("a page cannot be inflated: {what}"));
        match self.compression {
            Compression::SNAPPY => {
                let length = snap::raw::decompress_len(bytes).map_err(|error| broken(&error.to_string()))?;
                // A copy of three bytes makes at most 64.
                if length > LIMIT.min(32 * bytes.len() + 64) {
                    return Err(broken(&format!("{} bytes cannot hold {length}", bytes.len())));
                }
                snap::raw::Decoder::new().decompress_vec(bytes).map_err(|error| broken(&error.to_string()))
            }
            Compression::GZIP(_) => {
                let start = gzip_header(bytes).ok_or_else(|| broken("no header of gzip"))?;
                miniz_oxide::inflate::decompress_to_vec_with_limit(&bytes[start..], LIMIT)
                    .map_err(|error| broken(&error.to_string()))
            }
            Compression::ZSTD(_) => {
                let mut out = Vec::new();
                ruzstd::decoding::StreamingDecoder::new(bytes)
                    .map_err(|error| broken(&error.to_string()))?
                    .take(LIMIT as u64)
                    .read_to_end(&mut out)
                    .map_err(|error| broken(&error.to_string()))?;
                Ok(out)
            }
            _ => Ok(bytes.to_vec()),
        }
    }
}

/// Where the deflated bytes of a gzip member begin (RFC 1952).
fn gzip_header(bytes: &[u8]) -> Option<usize> {
    let [0x1f, 0x8b, 8, flags, ..] = *bytes else { return None };
    let mut at = 10;
    if flags & 4 != 0 {
        at += 2 + usize::from(*bytes.get(at)?) + 256 * usize::from(*bytes.get(at + 1)?);
    }
    for flag in [8, 16] {
        if flags & flag != 0 {
            at += bytes.get(at..)?.iter().position(|byte| *byte == 0)? + 1;
        }
    }
    at += if flags & 2 != 0 { 2 } else { 0 };
    (at <= bytes.len()).then_some(at)
}

impl Iterator for Inflated {
    type Item = Result<Page>;

    fn next(&mut self) -> Option<Self::Item> {
        self.get_next_page().transpose()
    }
}

impl PageReader for Inflated {
    fn get_next_page(&mut self) -> Result<Option<Page>> {
        let Some(mut page) = self.pages.get_next_page()? else { return Ok(None) };
        if matches!(self.compression, Compression::UNCOMPRESSED) {
            return Ok(Some(page));
        }
        match &mut page {
            Page::DataPage { buf, .. } | Page::DictionaryPage { buf, .. } => *buf = self.inflate(buf)?.into(),
            Page::DataPageV2 { buf, def_levels_byte_len, rep_levels_byte_len, is_compressed, .. } if *is_compressed => {
                let levels = *def_levels_byte_len as usize + *rep_levels_byte_len as usize;
                let Some((levels, values)) = buf.split_at_checked(levels) else {
                    return Err(ParquetError::General("a page is shorter than its levels".into()));
                };
                let mut whole = levels.to_vec();
                if !values.is_empty() {
                    whole.extend(self.inflate(values)?);
                }
                (*buf, *is_compressed) = (whole.into(), false);
            }
            Page::DataPageV2 { .. } => {}
        }
        Ok(Some(page))
    }

    fn peek_next_page(&mut self) -> Result<Option<PageMetadata>> {
        self.pages.peek_next_page()
    }

    fn skip_next_page(&mut self) -> Result<()> {
        self.pages.skip_next_page()
    }
}
