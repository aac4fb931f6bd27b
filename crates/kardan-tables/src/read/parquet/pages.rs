//! Pages of a column chunk from an untrusted file.
//!
//! The pages come from the crate `parquet` as if they were not compressed; this module decompresses them: with a bound, and for
//! gzip and Zstandard without the C libraries that the crate would need. Before the crate decodes a page, its assumptions
//! on the page are checked: it would panic otherwise.

use std::io::{BufReader, Read};

use ::bytes::Bytes;
use ::parquet::basic::{Compression, Encoding, Type};
use ::parquet::column::page::{Page, PageMetadata, PageReader};
use ::parquet::errors::{ParquetError, Result};
use ::parquet::file::reader::{ChunkReader, Length, SerializedPageReader};
use ::parquet::schema::types::ColumnDescriptor;

use super::super::source::Source;

/// Largest size of a page, and of the description of a file, bytes.
pub(super) const LIMIT: usize = 256 << 20;

impl Length for Source {
    fn len(&self) -> u64 {
        self.size
    }
}

impl ChunkReader for Source {
    type T = BufReader<Forward>;

    fn get_read(&self, start: u64) -> Result<Self::T> {
        // The headers of pages are short.
        Ok(BufReader::with_capacity(256, Forward { file: self.clone(), at: start }))
    }

    fn get_bytes(&self, start: u64, length: usize) -> Result<Bytes> {
        if length > LIMIT {
            return Err(lies(format!("{length} bytes are declared at byte {start}, more than the limit")));
        }
        self.bytes(start, length).map(Bytes::from).map_err(|error| lies(error.to_string()))
    }
}

/// Reads on from a position.
pub(in crate::read) struct Forward {
    file: Source,
    at: u64,
}

impl Read for Forward {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        let count = self.file.available(self.at, out.len().min(1 << 16));
        out[..count].copy_from_slice(&self.file.get_bytes(self.at, count).map_err(std::io::Error::other)?);
        self.at += count as u64;
        Ok(count)
    }
}

/// Whether a compression is supported.
pub(super) fn is_read(compression: Compression) -> bool {
    matches!(compression, Compression::UNCOMPRESSED | Compression::SNAPPY | Compression::GZIP(_) | Compression::ZSTD(_))
}

/// Decompresses and checks the pages of a column chunk.
pub(super) struct Inflated {
    pages: SerializedPageReader<Source>,
    compression: Compression,
    /// Whether values may be missing, as marked by levels before them.
    optional: bool,
    /// Bytes of a value.
    width: usize,
    /// Whether there was a dictionary.
    dictionary: bool,
}

fn lies(what: impl Into<String>) -> ParquetError {
    ParquetError::General(what.into())
}

/// Reads a number of 7 bits a byte, at most ten of them.
fn variable_length(bytes: &[u8], at: &mut usize) -> Option<u64> {
    let mut out = 0u64;
    for shift in (0..70).step_by(7) {
        let byte = *bytes.get(*at)?;
        *at += 1;
        out |= u64::from(byte & 0x7f).checked_shl(shift).unwrap_or(0);
        if byte & 0x80 == 0 {
            return Some(out);
        }
    }
    None
}

/// Number of values packed as differences in blocks, with an upper bound; `None` if they do not contain what their headers declare.
fn differences(bytes: &[u8], expected: u64) -> Option<u64> {
    let mut at = 0;
    let mut number = || variable_length(bytes, &mut at);
    let (block, parts, count) = (number()?, number()?, number()?);
    number()?;
    if block > 1 << 24 || parts == 0 || parts > block || !(block / parts).is_multiple_of(32) || count > expected {
        return None;
    }
    let each = block / parts;
    let mut remaining = count.saturating_sub(1);
    while remaining > 0 {
        variable_length(bytes, &mut at)?;
        let widths = bytes.get(at..at + parts as usize)?;
        at += parts as usize;
        for width in widths {
            if remaining == 0 {
                break;
            }
            // The last part may end early.
            let values = remaining.min(each);
            bytes.get(..at + (u64::from(*width) * values).div_ceil(8) as usize).filter(|_| *width <= 64)?;
            at += (u64::from(*width) * each / 8) as usize;
            remaining -= values;
        }
    }
    Some(count)
}

impl Inflated {
    pub fn new(pages: SerializedPageReader<Source>, compression: Compression, column: &ColumnDescriptor) -> Self {
        let width = match column.physical_type() {
            Type::INT96 => 12,
            Type::INT64 | Type::DOUBLE => 8,
            _ => 4,
        };
        Self { pages, compression, optional: column.max_def_level() > 0, width, dictionary: false }
    }

    /// Checks the assumptions of the decoders on a decompressed page.
    fn check(&mut self, page: &mut Page) -> Result<()> {
        match page {
            // The decoder allocates memory for the declared number of values.
            Page::DictionaryPage { buf, num_values, .. } => match (*num_values as usize).checked_mul(self.width) {
                Some(bytes) if bytes <= buf.len() => {
                    self.dictionary = true;
                    Ok(())
                }
                _ => Err(lies(format!("a dictionary of {} bytes declares {num_values} values", buf.len()))),
            },
            Page::DataPage { buf, num_values, encoding, def_level_encoding, .. } => {
                let levels = match def_level_encoding {
                    _ if !self.optional => 0,
                    Encoding::RLE => {
                        let length = buf.first_chunk::<4>().map(|bytes| u32::from_le_bytes(*bytes));
                        length.and_then(|length| (length as usize).checked_add(4)).unwrap_or(usize::MAX)
                    }
                    #[expect(deprecated)]
                    Encoding::BIT_PACKED => num_values.div_ceil(8) as usize,
                    _ => return Err(lies(format!("levels with the encoding {def_level_encoding} are not allowed"))),
                };
                self.values(encoding, buf, levels, *num_values)
            }
            Page::DataPageV2 { buf, num_values, encoding, def_levels_byte_len, rep_levels_byte_len, .. } => {
                let levels = u64::from(*def_levels_byte_len) + u64::from(*rep_levels_byte_len);
                let levels = u32::try_from(levels).map_err(|_| lies("the levels of a page are too long"))?;
                self.values(encoding, buf, levels as usize, *num_values)
            }
        }
    }

    /// The same of the values after the levels; values in byte streams are assembled here.
    fn values(&self, encoding: &mut Encoding, page: &mut Bytes, levels: usize, count: u32) -> Result<()> {
        let values = page.get(levels..).ok_or_else(|| lies("a page is shorter than its levels"))?;
        match encoding {
            Encoding::PLAIN_DICTIONARY | Encoding::RLE_DICTIONARY if !self.dictionary => {
                return Err(lies("a page refers to a missing dictionary"));
            }
            Encoding::DELTA_BINARY_PACKED => {
                let available = differences(values, u64::from(count))
                    .ok_or_else(|| lies("the differences of a page have not the declared length"))?;
                if available == 0 {
                    (*encoding, *page) = (Encoding::PLAIN, page.slice(..levels));
                }
            }
            Encoding::BYTE_STREAM_SPLIT => {
                let each = values.len() / self.width;
                let joined = (0..each * self.width).map(|k| values[k / self.width + k % self.width * each]);
                let whole: Vec<u8> = page[..levels].iter().copied().chain(joined).collect();
                (*encoding, *page) = (Encoding::PLAIN, whole.into());
            }
            _ => {}
        }
        Ok(())
    }

    fn inflate(&self, bytes: &[u8]) -> Result<Vec<u8>> {
        let broken = |what: &str| ParquetError::General(format!("a page cannot be decompressed: {what}"));
        match self.compression {
            Compression::SNAPPY => {
                let length = snap::raw::decompress_len(bytes).map_err(|error| broken(&error.to_string()))?;
                // A copy of three bytes gives at most 64.
                if length > LIMIT.min(32 * bytes.len() + 64) {
                    return Err(broken(&format!("{} bytes cannot contain {length}", bytes.len())));
                }
                snap::raw::Decoder::new().decompress_vec(bytes).map_err(|error| broken(&error.to_string()))
            }
            Compression::GZIP(_) => {
                let start = gzip_header(bytes).ok_or_else(|| broken("no gzip header"))?;
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

/// The start of the deflated bytes of a gzip member (RFC 1952).
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
        let packed = !matches!(self.compression, Compression::UNCOMPRESSED);
        match &mut page {
            _ if !packed => {}
            Page::DataPage { buf, .. } | Page::DictionaryPage { buf, .. } => *buf = self.inflate(buf)?.into(),
            Page::DataPageV2 { buf, def_levels_byte_len, rep_levels_byte_len, is_compressed, .. } if *is_compressed => {
                let levels = (*def_levels_byte_len as usize).saturating_add(*rep_levels_byte_len as usize);
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
        self.check(&mut page)?;
        Ok(Some(page))
    }

    fn peek_next_page(&mut self) -> Result<Option<PageMetadata>> {
        self.pages.peek_next_page()
    }

    fn skip_next_page(&mut self) -> Result<()> {
        self.pages.skip_next_page()
    }
}
