//! MAT files of version 5 (`save -v7`, `save -v6`, SciPy): arrays with names, from bytes that may be anything.
//!
//! The element structure is walked here, with every length checked against what is there, and only inflating is left to
//! `miniz_oxide` with a bound: the crates that read MAT files panic on truncated ones (`matrw`) or know neither
//! structures nor all storage types (`matfile`).

use std::borrow::Cow;

use crate::num::{Rational, rational_from_f64};

/// The most bytes that the compressed variables of a file may inflate to, all together.
pub(super) const INFLATED_LIMIT: usize = 256 << 20;
/// The most variables and fields that are looked at.
const ARRAY_LIMIT: usize = 10_000;
/// Structures and cells inside each other.
const DEPTH_LIMIT: usize = 3;
const HEADER: usize = 128;

/// Why a file cannot be read, and at which byte of the file (of its inflated variable).
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Broken {
    /// Not what the format says.
    Damaged(String),
    /// Inflates beyond [`INFLATED_LIMIT`] or has too many parts.
    TooLarge(String),
}

fn damaged<T>(what: impl Into<String>) -> Result<T, Broken> {
    Err(Broken::Damaged(what.into()))
}

/// How numbers are stored.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Storage {
    Signed(usize),
    Unsigned(usize),
    Single,
    Double,
}

impl Storage {
    fn of(data_type: u32) -> Option<Self> {
        Some(match data_type {
            1 => Self::Signed(1),
            2 => Self::Unsigned(1),
            3 => Self::Signed(2),
            4 => Self::Unsigned(2),
            5 => Self::Signed(4),
            6 => Self::Unsigned(4),
            7 => Self::Single,
            9 => Self::Double,
            12 => Self::Signed(8),
            13 => Self::Unsigned(8),
            16 => Self::Unsigned(1), // UTF-8
            17 => Self::Unsigned(2), // UTF-16
            18 => Self::Unsigned(4), // UTF-32
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::Signed(size) | Self::Unsigned(size) => size,
            Self::Single => 4,
            Self::Double => 8,
        }
    }
}

/// A run of stored numbers.
#[derive(Debug, Clone, Copy)]
pub(super) struct Numbers<'a> {
    storage: Storage,
    little: bool,
    bytes: &'a [u8],
}

impl Numbers<'_> {
    pub(super) fn len(&self) -> usize {
        self.bytes.len() / self.storage.size()
    }

    fn word(&self, i: usize) -> u64 {
        let size = self.storage.size();
        word(&self.bytes[i * size..(i + 1) * size], self.little)
    }

    /// The exact value; `Err` with its name if it is not finite.
    pub(super) fn value(&self, i: usize) -> Result<Rational, &'static str> {
        let word = self.word(i);
        let float = match self.storage {
            Storage::Unsigned(_) => return Ok(Rational::from(word)),
            Storage::Signed(size) => {
                let shift = 64 - 8 * size as u32;
                return Ok(Rational::from((word << shift) as i64 >> shift));
            }
            Storage::Single => f64::from(f32::from_bits(word as u32)),
            Storage::Double => f64::from_bits(word),
        };
        rational_from_f64(float).ok_or(if float.is_nan() {
            "NaN"
        } else if float > 0.0 {
            "Inf"
        } else {
            "-Inf"
        })
    }
}

fn word(bytes: &[u8], little: bool) -> u64 {
    let step = |sum: u64, byte: &u8| sum << 8 | u64::from(*byte);
    if little { bytes.iter().rev().fold(0, step) } else { bytes.iter().fold(0, step) }
}

/// What an array holds.
#[derive(Debug, Clone)]
pub(super) enum Content<'a> {
    /// Numbers column by column.
    Full(Numbers<'a>),
    /// Row of each nonzero, where each column starts, the nonzeros.
    Sparse { rows: Vec<usize>, starts: Vec<usize>, values: Numbers<'a> },
    /// Letters column by column.
    Text(Vec<char>),
    /// Fields of a 1×1 structure.
    Struct(Vec<(String, Array<'a>)>),
    /// Cells column by column.
    Cell(Vec<Array<'a>>),
    /// Something else, in words.
    Other(&'static str),
}

/// An array of a MAT file.
#[derive(Debug, Clone)]
pub(super) struct Array<'a> {
    pub(super) name: String,
    pub(super) dimensions: Vec<usize>,
    pub(super) complex: bool,
    pub(super) content: Content<'a>,
}

/// A MAT file whose compressed variables are inflated.
#[derive(Debug)]
pub(super) struct MatFile<'a> {
    little: bool,
    elements: Vec<Cow<'a, [u8]>>,
}

impl<'a> MatFile<'a> {
    /// Splits a file into its variables and inflates them.
    pub(super) fn open(bytes: &'a [u8]) -> Result<Self, Broken> {
        let little = match bytes.get(126..HEADER) {
            Some(b"IM") => true,
            Some(b"MI") => false,
            Some(_) => return damaged("its byte order mark (bytes 126 and 127) is neither `IM` nor `MI`"),
            None => return damaged(format!("it ends inside its header, after {} of {HEADER} bytes", bytes.len())),
        };
        let mut reader = Reader { bytes, at: HEADER, little };
        let mut elements = Vec::new();
        let mut budget = INFLATED_LIMIT;
        while reader.at < bytes.len() {
            if elements.len() == ARRAY_LIMIT {
                return Err(Broken::TooLarge(format!("it has more than {ARRAY_LIMIT} variables")));
            }
            let at = reader.at;
            let (data_type, body) = reader.element()?;
            match data_type {
                14 => elements.push(Cow::Borrowed(body)),
                15 => {
                    let inflated = inflate(body, budget, at)?;
                    budget -= inflated.len();
                    let (data_type, inside) = Reader { bytes: &inflated, at: 0, little }.element()?;
                    if data_type == 14 {
                        elements.push(Cow::Owned(inside.to_vec()));
                    }
                }
                _ => return damaged(format!("at byte {at} there is no variable (element type {data_type})")),
            }
        }
        Ok(Self { little, elements })
    }

    /// The variables with a name.
    pub(super) fn arrays(&self) -> Result<Vec<Array<'_>>, Broken> {
        let mut budget = ARRAY_LIMIT;
        let mut out = Vec::with_capacity(self.elements.len());
        for element in &self.elements {
            let array = Reader { bytes: element, at: 0, little: self.little }.array(DEPTH_LIMIT, &mut budget)?;
            if !array.name.is_empty() {
                out.push(array);
            }
        }
        Ok(out)
    }
}

fn inflate(body: &[u8], budget: usize, at: usize) -> Result<Vec<u8>, Broken> {
    use miniz_oxide::inflate::{TINFLStatus, decompress_to_vec_zlib_with_limit};
    decompress_to_vec_zlib_with_limit(body, budget).map_err(|error| match error.status {
        TINFLStatus::HasMoreOutput => {
            Broken::TooLarge(format!("its compressed variables inflate to more than {} MiB", INFLATED_LIMIT >> 20))
        }
        _ => Broken::Damaged(format!("the compressed variable at byte {at} cannot be inflated")),
    })
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    little: bool,
}

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], Broken> {
        let taken = self.at.checked_add(count).and_then(|end| self.bytes.get(self.at..end));
        let Some(taken) = taken else {
            let left = self.bytes.len() - self.at;
            return damaged(format!("it breaks off: {count} bytes are announced where {left} are left"));
        };
        self.at += count;
        Ok(taken)
    }

    /// Type and body of the next element; padding behind it is passed over.
    fn element(&mut self) -> Result<(u32, &'a [u8]), Broken> {
        let tag = word(self.take(4)?, self.little) as u32;
        if tag >> 16 != 0 {
            let length = (tag >> 16) as usize;
            let body = self.take(4)?;
            return match body.get(..length) {
                Some(body) => Ok((tag & 0xffff, body)),
                None => damaged(format!("a small element announces {length} bytes, more than 4")),
            };
        }
        let length = word(self.take(4)?, self.little) as usize;
        let body = self.take(length)?;
        if tag != 15 {
            // Compressed variables follow each other without padding.
            self.at = (self.at + length.next_multiple_of(8) - length).min(self.bytes.len());
        }
        Ok((tag, body))
    }

    fn numbers(&mut self) -> Result<Numbers<'a>, Broken> {
        let (data_type, bytes) = self.element()?;
        match Storage::of(data_type) {
            Some(storage) if bytes.len().is_multiple_of(storage.size()) => {
                Ok(Numbers { storage, little: self.little, bytes })
            }
            _ => damaged(format!("{} bytes of element type {data_type} are no list of numbers", bytes.len())),
        }
    }

    /// Counts: integers that are not negative.
    fn counts(&mut self) -> Result<Vec<usize>, Broken> {
        let numbers = self.numbers()?;
        match numbers.storage {
            Storage::Signed(4) | Storage::Unsigned(4) => (0..numbers.len())
                .map(|i| match numbers.word(i) {
                    word if word < 1 << 31 => Ok(word as usize),
                    _ => damaged("a dimension or an index is negative"),
                })
                .collect(),
            _ => damaged("dimensions or indices are not stored as 32-bit integers"),
        }
    }

    fn text(&mut self) -> Result<String, Broken> {
        let (_, bytes) = self.element()?;
        Ok(String::from_utf8_lossy(bytes).trim_end_matches('\0').to_string())
    }

    /// The body of an array element.
    fn array(&mut self, depth: usize, budget: &mut usize) -> Result<Array<'a>, Broken> {
        if *budget == 0 {
            return Err(Broken::TooLarge(format!("it has more than {ARRAY_LIMIT} variables, fields and cells")));
        }
        *budget -= 1;
        if self.bytes.is_empty() {
            // An empty field may be stored as nothing at all.
            let content = Content::Other("nothing");
            return Ok(Array { name: String::new(), dimensions: vec![0, 0], complex: false, content });
        }
        let (flags_type, flags) = self.element()?;
        if flags_type != 6 || flags.len() != 8 {
            return damaged("a variable does not begin with its flags");
        }
        let flags = word(&flags[..4], self.little);
        let (class, complex) = (flags & 0xff, flags & 0x0800 != 0);
        if class == 17 {
            let (name, content) = (self.text()?, Content::Other("a MATLAB object"));
            return Ok(Array { name, dimensions: Vec::new(), complex: false, content });
        }
        let dimensions = self.counts()?;
        let Some(count) = dimensions.iter().try_fold(1usize, |product, d| product.checked_mul(*d)) else {
            return damaged("its dimensions are beyond all bounds");
        };
        if dimensions.len() < 2 {
            return damaged("a variable has fewer than two dimensions");
        }
        let name = self.text()?;
        let array = |content| Array { name: name.clone(), dimensions: dimensions.clone(), complex, content };
        let content = match class {
            1 | 2 if depth == 0 => Content::Other("a structure or cell array deep inside others"),
            1 => {
                let mut cells = Vec::new();
                for _ in 0..count {
                    cells.push(self.inner(depth, budget)?);
                }
                Content::Cell(cells)
            }
            2 if count == 1 => {
                let length = match self.counts()?[..] {
                    [length] if length > 0 => length,
                    _ => return damaged(format!("structure `{name}` does not say how long its field names are")),
                };
                let (_, names) = self.element()?;
                let mut fields = Vec::new();
                for field in names.chunks(length) {
                    let end = field.iter().position(|byte| *byte == 0).unwrap_or(field.len());
                    let field = String::from_utf8_lossy(&field[..end]).to_string();
                    fields.push((field, self.inner(depth, budget)?));
                }
                Content::Struct(fields)
            }
            2 => Content::Other("an array of structures"),
            3 => Content::Other("a MATLAB object"),
            4 => {
                let letters = self.letters()?;
                if letters.len() != count {
                    return damaged(format!("text `{name}` has {} letters instead of {count}", letters.len()));
                }
                Content::Text(letters)
            }
            5 => {
                let (rows, starts) = (self.counts()?, self.counts()?);
                let values = self.numbers()?;
                let [height, width] = dimensions[..] else {
                    return damaged(format!("sparse matrix `{name}` has more than two dimensions"));
                };
                let used = starts.last().copied().unwrap_or(0);
                let sound = starts.len() == width + 1
                    && starts.is_sorted()
                    && used <= rows.len()
                    && used <= values.len()
                    && rows[..used].iter().all(|row| *row < height);
                if !sound {
                    return damaged(format!("the indices of sparse matrix `{name}` do not fit its size"));
                }
                Content::Sparse { rows, starts, values }
            }
            6..=15 => {
                let numbers = self.numbers()?;
                if numbers.len() != count {
                    return damaged(format!("`{name}` has {} entries instead of {count}", numbers.len()));
                }
                Content::Full(numbers)
            }
            16 => Content::Other("a function"),
            _ => return damaged(format!("`{name}` is of the unknown class {class}")),
        };
        Ok(array(content))
    }

    fn inner(&mut self, depth: usize, budget: &mut usize) -> Result<Array<'a>, Broken> {
        let (data_type, body) = self.element()?;
        if data_type != 14 {
            return damaged(format!("a field or cell is of element type {data_type}, not an array"));
        }
        Reader { bytes: body, at: 0, little: self.little }.array(depth - 1, budget)
    }

    fn letters(&mut self) -> Result<Vec<char>, Broken> {
        let (data_type, bytes) = self.element()?;
        let utf_16 = |size: usize| -> Vec<char> {
            let units = bytes.chunks_exact(size).map(|unit| word(unit, self.little) as u16);
            char::decode_utf16(units).map(|c| c.unwrap_or('\u{fffd}')).collect()
        };
        Ok(match data_type {
            1 | 2 | 16 => String::from_utf8_lossy(bytes).chars().collect(),
            3 | 4 | 17 => utf_16(2),
            5 | 6 | 18 => bytes
                .chunks_exact(4)
                .map(|unit| char::from_u32(word(unit, self.little) as u32).unwrap_or('\u{fffd}'))
                .collect(),
            _ => return damaged(format!("a text is stored as element type {data_type}")),
        })
    }
}
