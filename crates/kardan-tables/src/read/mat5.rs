//! MAT files of version 5 (`save -v7`, `save -v6`, SciPy): named arrays from untrusted bytes.
//!
//! This module traverses the element structure, with every length checked against the available bytes; decompression is left to
//! `miniz_oxide` with a bound: the crates that read MAT files panic on truncated ones (`matrw`) or support neither
//! structures nor all storage types (`matfile`). The traversal is the same for files in memory ([`MatFile`]) and for logs,
//! whose numbers stay in the file (`Input`).

use std::borrow::Cow;

use super::LogError;
use super::source::word;

/// Largest total size of the decompressed variables of a file, bytes.
pub(crate) const INFLATED_LIMIT: usize = 256 << 20;
/// Largest number of examined variables and fields.
const ARRAY_LIMIT: usize = 10_000;
/// Nesting depth of structures and cells.
const DEPTH_LIMIT: usize = 3;
/// Largest length of a field name, bytes; MATLAB allows 63. Each structure of an array stores the names of its fields.
const FIELD_NAME_LIMIT: usize = 1024;
const HEADER: usize = 128;

/// Why a file cannot be read, and at which byte of the file (of its decompressed variable).
#[derive(Debug, Clone, PartialEq)]
pub enum Broken {
    /// It violates the format.
    Damaged(String),
    /// It decompresses beyond `INFLATED_LIMIT` or has too many parts.
    TooLarge(String),
    /// It cannot be read from its source.
    Log(LogError),
}

fn damaged<T>(what: impl Into<String>) -> Result<T, Broken> {
    Err(Broken::Damaged(what.into()))
}

/// How numbers are stored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Storage {
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

    /// The number in a word of this size.
    pub(crate) fn stored(self, word: u64) -> Stored {
        match self {
            Self::Unsigned(_) => Stored::Unsigned(word),
            Self::Signed(size) => {
                let shift = 64 - 8 * size as u32;
                Stored::Signed((word << shift) as i64 >> shift)
            }
            Self::Single => Stored::Float(f64::from(f32::from_bits(word as u32))),
            Self::Double => Stored::Float(f64::from_bits(word)),
        }
    }

    pub(crate) fn size(self) -> usize {
        match self {
            Self::Signed(size) | Self::Unsigned(size) => size,
            Self::Single => 4,
            Self::Double => 8,
        }
    }
}

/// One number, exactly as stored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stored {
    /// A whole number without a sign.
    Unsigned(u64),
    /// A whole number.
    Signed(i64),
    /// A number of floating point.
    Float(f64),
}

/// A run of stored numbers.
#[derive(Debug, Clone, Copy)]
pub struct Numbers<R> {
    pub(crate) storage: Storage,
    pub(crate) little: bool,
    pub(crate) count: usize,
    pub(crate) bytes: R,
}

impl<R> Numbers<R> {
    /// Number of numbers.
    pub fn count(&self) -> usize {
        self.count
    }
}

impl Numbers<&[u8]> {
    fn word(&self, i: usize) -> u64 {
        let size = self.storage.size();
        word(&self.bytes[i * size..(i + 1) * size], self.little)
    }

    /// The stored value; `Err` with its name if it is not finite.
    ///
    /// # Errors
    /// `NaN`, `Inf` or `-Inf`.
    ///
    /// # Panics
    /// If there is no number `i`.
    pub fn value(&self, i: usize) -> Result<Stored, &'static str> {
        match self.storage.stored(self.word(i)) {
            Stored::Float(x) if x.is_nan() => Err("NaN"),
            Stored::Float(f64::INFINITY) => Err("Inf"),
            Stored::Float(f64::NEG_INFINITY) => Err("-Inf"),
            stored => Ok(stored),
        }
    }
}

/// The contents of an array.
#[derive(Debug, Clone)]
pub enum Content<R> {
    /// Numbers column by column.
    Full(Numbers<R>),
    /// A sparse matrix.
    Sparse {
        /// Row of each nonzero.
        rows: Vec<usize>,
        /// Where each column starts.
        starts: Vec<usize>,
        /// The nonzeros.
        values: Numbers<R>,
    },
    /// Letters column by column.
    Text(Vec<char>),
    /// Fields of a 1×1 structure.
    Struct(Fields<R>),
    /// The structures of an array, column by column.
    Structs(Vec<Fields<R>>),
    /// Cells column by column.
    Cell(Vec<Array<R>>),
    /// Something else, with its description.
    Other(&'static str),
}

/// Fields with their names.
pub type Fields<R> = Vec<(String, Array<R>)>;

/// An array of a MAT file.
#[derive(Debug, Clone)]
pub struct Array<R> {
    /// Name.
    pub name: String,
    /// Sizes.
    pub dimensions: Vec<usize>,
    /// Whether there are imaginary parts.
    pub complex: bool,
    /// Its contents.
    pub content: Content<R>,
}

/// A MAT file with decompressed variables.
#[derive(Debug)]
pub struct MatFile<'a> {
    little: bool,
    elements: Vec<Cow<'a, [u8]>>,
}

impl<'a> MatFile<'a> {
    /// Splits a file into its variables and decompresses them.
    pub fn open(bytes: &'a [u8]) -> Result<Self, Broken> {
        let little = match bytes.get(126..HEADER) {
            Some(b"IM") => true,
            Some(b"MI") => false,
            Some(_) => return damaged("its byte order mark (bytes 126 and 127) is neither `IM` nor `MI`"),
            None => return damaged(format!("it ends inside its header, after {} of {HEADER} bytes", bytes.len())),
        };
        let mut reader = Reader::new(Slice(bytes), little, HEADER as u64, bytes.len() as u64);
        let mut elements = Vec::new();
        let mut budget = INFLATED_LIMIT;
        while !reader.ended() {
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
                    let (data_type, inside) = whole(&inflated, little).element()?;
                    if data_type == 14 {
                        elements.push(Cow::Owned(inside.to_vec()));
                    }
                }
                _ => return damaged(format!("at byte {at} there is no variable (element type {data_type})")),
            }
        }
        Ok(Self { little, elements })
    }

    /// The named variables.
    pub fn arrays(&self) -> Result<Vec<Array<&[u8]>>, Broken> {
        let mut budget = ARRAY_LIMIT;
        let mut out = Vec::with_capacity(self.elements.len());
        for element in &self.elements {
            let array = whole(element, self.little).array(DEPTH_LIMIT, &mut budget)?;
            if !array.name.is_empty() {
                out.push(array);
            }
        }
        Ok(out)
    }
}

fn whole(bytes: &[u8], little: bool) -> Reader<Slice<'_>> {
    Reader::new(Slice(bytes), little, 0, bytes.len() as u64)
}

fn inflate(body: &[u8], budget: usize, at: u64) -> Result<Vec<u8>, Broken> {
    use miniz_oxide::inflate::{TINFLStatus, decompress_to_vec_zlib_with_limit};
    decompress_to_vec_zlib_with_limit(body, budget).map_err(|error| match error.status {
        TINFLStatus::HasMoreOutput => {
            Broken::TooLarge(format!("its compressed variables decompress to more than {} MiB", INFLATED_LIMIT >> 20))
        }
        _ => Broken::Damaged(format!("the compressed variable at byte {at} cannot be decompressed")),
    })
}

/// The source of the bytes of elements.
pub(crate) trait Input {
    /// A run of bytes, or its position.
    type Run;
    /// Whether sparse matrices are read: their indices must be in memory.
    const SPARSE: bool;
    /// Largest length of a text or of names, bytes.
    const TEXT: usize;

    /// Reads a few bytes from a position, which is never before the last one.
    fn read(&mut self, at: u64, count: usize) -> Result<&[u8], Broken>;

    /// A run of bytes from a position.
    fn run(&mut self, at: u64, count: usize) -> Result<Self::Run, Broken>;
}

/// Bytes in memory.
struct Slice<'a>(&'a [u8]);

impl<'a> Input for Slice<'a> {
    type Run = &'a [u8];
    const SPARSE: bool = true;
    const TEXT: usize = usize::MAX;

    fn read(&mut self, at: u64, count: usize) -> Result<&[u8], Broken> {
        self.run(at, count)
    }

    fn run(&mut self, at: u64, count: usize) -> Result<&'a [u8], Broken> {
        let at = at as usize;
        match at.checked_add(count).and_then(|end| self.0.get(at..end)) {
            Some(bytes) => Ok(bytes),
            None => damaged("it breaks off"),
        }
    }
}

/// Reads elements in sequence.
pub(crate) struct Reader<I> {
    pub(crate) input: I,
    pub(crate) at: u64,
    end: u64,
    little: bool,
}

/// Type, position and length of the body of an element, and the start of the next.
#[derive(Clone, Copy)]
struct Tag {
    data_type: u32,
    at: u64,
    length: usize,
    next: u64,
}

impl<I: Input> Reader<I> {
    /// Reads the bytes between two positions.
    pub(crate) fn new(input: I, little: bool, at: u64, end: u64) -> Self {
        Self { input, at, end, little }
    }

    fn ended(&self) -> bool {
        self.at >= self.end
    }

    fn check_range(&self, at: u64, count: usize) -> Result<(), Broken> {
        let remaining = self.end.saturating_sub(at);
        if count as u64 > remaining {
            return damaged(format!("it is truncated: {count} bytes are declared, and {remaining} remain"));
        }
        Ok(())
    }

    /// The tag of the next element; the element with its padding is skipped.
    fn tag(&mut self) -> Result<Tag, Broken> {
        let (at, little) = (self.at, self.little);
        self.check_range(at, 4)?;
        let first = word(self.input.read(at, 4)?, little) as u32;
        let tag = if first >> 16 != 0 {
            let length = (first >> 16) as usize;
            self.check_range(at + 4, 4)?;
            if length > 4 {
                return damaged(format!("a small element declares {length} bytes, more than 4"));
            }
            Tag { data_type: first & 0xffff, at: at + 4, length, next: at + 8 }
        } else {
            self.check_range(at + 4, 4)?;
            let length = word(self.input.read(at + 4, 4)?, little) as usize;
            self.check_range(at + 8, length)?;
            // Compressed variables follow each other without padding.
            let padded = if first == 15 { length } else { length.next_multiple_of(8) };
            Tag { data_type: first, at: at + 8, length, next: (at + 8 + padded as u64).min(self.end) }
        };
        self.at = tag.next;
        Ok(tag)
    }

    /// Type and body of the next element.
    fn element(&mut self) -> Result<(u32, I::Run), Broken> {
        let tag = self.tag()?;
        Ok((tag.data_type, self.input.run(tag.at, tag.length)?))
    }

    /// Type and body of the next element, which is read.
    fn small(&mut self) -> Result<(u32, &[u8]), Broken> {
        let tag = self.tag()?;
        if tag.length > I::TEXT {
            return Err(Broken::TooLarge(format!("names or sizes of it have {} bytes", tag.length)));
        }
        Ok((tag.data_type, self.input.read(tag.at, tag.length)?))
    }

    fn numbers(&mut self) -> Result<Numbers<I::Run>, Broken> {
        let tag = self.tag()?;
        match Storage::of(tag.data_type) {
            Some(storage) if tag.length.is_multiple_of(storage.size()) => {
                let bytes = self.input.run(tag.at, tag.length)?;
                Ok(Numbers { storage, little: self.little, count: tag.length / storage.size(), bytes })
            }
            _ => damaged(format!("{} bytes of element type {} are not a list of numbers", tag.length, tag.data_type)),
        }
    }

    /// Counts: integers that are not negative.
    fn counts(&mut self) -> Result<Vec<usize>, Broken> {
        let little = self.little;
        let (data_type, bytes) = self.small()?;
        match Storage::of(data_type) {
            Some(Storage::Signed(4) | Storage::Unsigned(4)) if bytes.len().is_multiple_of(4) => bytes
                .chunks_exact(4)
                .map(|bytes| match word(bytes, little) {
                    word if word < 1 << 31 => Ok(word as usize),
                    _ => damaged("a dimension or an index is negative"),
                })
                .collect(),
            _ => damaged("dimensions or indices are not stored as 32-bit integers"),
        }
    }

    fn text(&mut self) -> Result<String, Broken> {
        let (_, bytes) = self.small()?;
        Ok(String::from_utf8_lossy(bytes).trim_end_matches('\0').to_string())
    }

    /// The field names of a structure.
    fn fields(&mut self, name: &str) -> Result<Vec<String>, Broken> {
        let length = match self.counts()?[..] {
            [length] if length > FIELD_NAME_LIMIT => {
                let what =
                    format!("structure `{name}` has field names of {length} bytes, more than {FIELD_NAME_LIMIT}");
                return Err(Broken::TooLarge(what));
            }
            [length] if length > 0 => length,
            _ => return damaged(format!("structure `{name}` does not declare the length of its field names")),
        };
        let (_, names) = self.small()?;
        let field = |field: &[u8]| {
            let end = field.iter().position(|byte| *byte == 0).unwrap_or(field.len());
            String::from_utf8_lossy(&field[..end]).to_string()
        };
        Ok(names.chunks(length).map(field).collect())
    }

    /// The body of an array element.
    pub(crate) fn array(&mut self, depth: usize, budget: &mut usize) -> Result<Array<I::Run>, Broken> {
        if *budget == 0 {
            return Err(Broken::TooLarge(format!("it has more than {ARRAY_LIMIT} variables, fields and cells")));
        }
        *budget -= 1;
        if self.ended() {
            // An empty field may be stored without any bytes.
            let content = Content::Other("nothing");
            return Ok(Array { name: String::new(), dimensions: vec![0, 0], complex: false, content });
        }
        let little = self.little;
        let (flags_type, flags) = self.small()?;
        if flags_type != 6 || flags.len() != 8 {
            return damaged("a variable does not begin with its flags");
        }
        let flags = word(&flags[..4], little);
        let (class, complex) = (flags & 0xff, flags & 0x0800 != 0);
        if class == 17 {
            let (name, content) = (self.text()?, Content::Other("a MATLAB object"));
            return Ok(Array { name, dimensions: Vec::new(), complex: false, content });
        }
        let dimensions = self.counts()?;
        let Some(count) = dimensions.iter().try_fold(1usize, |product, d| product.checked_mul(*d)) else {
            return damaged("its dimensions are too large");
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
            2 => {
                let names = self.fields(&name)?;
                let mut structs = Vec::new();
                for _ in 0..if names.is_empty() && count != 1 { 0 } else { count } {
                    let mut fields = Vec::new();
                    for field in &names {
                        fields.push((field.clone(), self.inner(depth, budget)?));
                    }
                    structs.push(fields);
                }
                if count == 1 { Content::Struct(structs.remove(0)) } else { Content::Structs(structs) }
            }
            3 => Content::Other("a MATLAB object"),
            4 => {
                let Some(letters) = self.letters()? else {
                    return Ok(array(Content::Other("a long text")));
                };
                if letters.len() != count {
                    return damaged(format!("text `{name}` has {} letters instead of {count}", letters.len()));
                }
                Content::Text(letters)
            }
            5 if !I::SPARSE => Content::Other("a sparse matrix"),
            5 => self.sparse(&name, &dimensions)?,
            6..=15 => {
                let numbers = self.numbers()?;
                if numbers.count() != count {
                    return damaged(format!("`{name}` has {} entries instead of {count}", numbers.count()));
                }
                Content::Full(numbers)
            }
            16 => Content::Other("a function"),
            _ => return damaged(format!("`{name}` is of the unknown class {class}")),
        };
        Ok(array(content))
    }

    fn sparse(&mut self, name: &str, dimensions: &[usize]) -> Result<Content<I::Run>, Broken> {
        let (rows, starts) = (self.counts()?, self.counts()?);
        let values = self.numbers()?;
        let [height, width] = dimensions[..] else {
            return damaged(format!("sparse matrix `{name}` has more than two dimensions"));
        };
        let used = starts.last().copied().unwrap_or(0);
        let sound = starts.len() == width + 1
            && starts.is_sorted()
            && used <= rows.len()
            && used <= values.count()
            && rows[..used].iter().all(|row| *row < height);
        if !sound {
            return damaged(format!("the indices of sparse matrix `{name}` do not fit its size"));
        }
        Ok(Content::Sparse { rows, starts, values })
    }

    fn inner(&mut self, depth: usize, budget: &mut usize) -> Result<Array<I::Run>, Broken> {
        let tag = self.tag()?;
        if tag.data_type != 14 {
            return damaged(format!("a field or cell is of element type {}, not an array", tag.data_type));
        }
        let (end, next) = (self.end, self.at);
        (self.at, self.end) = (tag.at, tag.at + tag.length as u64);
        let array = self.array(depth - 1, budget);
        (self.at, self.end) = (next, end);
        array
    }

    /// A text, if it is within the limit.
    fn letters(&mut self) -> Result<Option<Vec<char>>, Broken> {
        let (little, tag) = (self.little, self.tag()?);
        if tag.length > I::TEXT {
            return Ok(None);
        }
        let (data_type, bytes) = (tag.data_type, self.input.read(tag.at, tag.length)?);
        let utf_16 = |size: usize| -> Vec<char> {
            let units = bytes.chunks_exact(size).map(|unit| word(unit, little) as u16);
            char::decode_utf16(units).map(|c| c.unwrap_or('\u{fffd}')).collect()
        };
        Ok(Some(match data_type {
            1 | 2 | 16 => String::from_utf8_lossy(bytes).chars().collect(),
            3 | 4 | 17 => utf_16(2),
            5 | 6 | 18 => bytes
                .chunks_exact(4)
                .map(|unit| char::from_u32(word(unit, little) as u32).unwrap_or('\u{fffd}'))
                .collect(),
            _ => return damaged(format!("a text is stored as element type {data_type}")),
        }))
    }
}
