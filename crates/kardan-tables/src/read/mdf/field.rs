//! Values of one channel from records.

use kardan_rt::functions::powi;

/// How a number is stored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Kind {
    Unsigned,
    Signed,
    Float,
    /// No bytes: the number of the record.
    Index,
}

/// The conversion of a stored value to a physical one.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Conversion {
    None,
    Linear {
        offset: f64,
        factor: f64,
    },
    /// (a x² + b x + c) / (d x² + e x + f)
    Rational([f64; 6]),
    /// Pairs of keys and values, keys increasing.
    Table {
        pairs: Vec<(f64, f64)>,
        between: bool,
    },
    /// Lower and upper bound and value, and the value elsewhere.
    Ranges {
        rows: Vec<(f64, f64, f64)>,
        default: f64,
    },
}

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Field {
    pub kind: Kind,
    pub big_endian: bool,
    pub byte: usize,
    pub bit: u32,
    pub bits: u32,
    /// The bit after the data that marks a value as invalid.
    pub invalid: Option<usize>,
    pub conversion: Conversion,
}

impl Field {
    /// Bytes of the record that are read.
    pub fn bytes(&self) -> usize {
        if self.kind == Kind::Index { 0 } else { (self.bit + self.bits).div_ceil(8) as usize }
    }

    /// Appends the values of all records, which have `record_bytes` bytes; `first` is the number of the first one.
    pub fn decode(&self, records: &[u8], record_bytes: usize, data_bytes: usize, first: u64, out: &mut Vec<f64>) {
        let start = out.len();
        let aligned = self.bit == 0 && self.bits == 8 * self.bytes() as u32;
        match self.bits {
            _ if self.kind == Kind::Index => {
                let count = records.len() / record_bytes;
                out.extend((first..first + count as u64).map(|index| index as f64));
            }
            8 if aligned => self.convert(self.words::<1>(records, record_bytes), out),
            16 if aligned => self.convert(self.words::<2>(records, record_bytes), out),
            32 if aligned => self.convert(self.words::<4>(records, record_bytes), out),
            64 if aligned => self.convert(self.words::<8>(records, record_bytes), out),
            _ => self.convert(records.chunks_exact(record_bytes).map(|record| self.word(record)), out),
        }
        self.conversion.apply(&mut out[start..]);
        if let Some(bit) = self.invalid {
            for (value, record) in out[start..].iter_mut().zip(records.chunks_exact(record_bytes)) {
                if record.get(data_bytes + bit / 8).is_some_and(|byte| byte >> (bit % 8) & 1 == 1) {
                    *value = f64::NAN;
                }
            }
        }
    }

    /// Appends the numbers that are stored in these bits.
    fn convert(&self, words: impl Iterator<Item = u64>, out: &mut Vec<f64>) {
        match (self.kind, self.bits) {
            (Kind::Float, 64) => out.extend(words.map(f64::from_bits)),
            (Kind::Float, 32) => out.extend(words.map(|word| f64::from(f32::from_bits(word as u32)))),
            (Kind::Float, _) => out.extend(words.map(|word| half(word as u16))),
            (Kind::Signed, bits) => {
                let shift = 64 - bits;
                out.extend(words.map(|word| ((word << shift) as i64 >> shift) as f64));
            }
            _ => out.extend(words.map(|word| word as f64)),
        }
    }

    /// The bits of values of whole bytes.
    fn words<const SIZE: usize>(&self, records: &[u8], record_bytes: usize) -> impl Iterator<Item = u64> {
        records.chunks_exact(record_bytes).map(move |record| {
            let mut bytes = [0; 8];
            bytes[..SIZE].copy_from_slice(&record[self.byte..self.byte + SIZE]);
            if self.big_endian { u64::from_be_bytes(bytes) >> (64 - 8 * SIZE) } else { u64::from_le_bytes(bytes) }
        })
    }

    /// The bits of any value.
    fn word(&self, record: &[u8]) -> u64 {
        let bytes = &record[self.byte..self.byte + self.bytes()];
        let step = |sum: u128, byte: &u8| sum << 8 | u128::from(*byte);
        let word = if self.big_endian { bytes.iter().fold(0, step) } else { bytes.iter().rev().fold(0, step) };
        let word = (word >> self.bit) as u64;
        if self.bits < 64 { word & ((1 << self.bits) - 1) } else { word }
    }
}

/// A number of 16 bits according to IEEE 754.
fn half(bits: u16) -> f64 {
    let sign = if bits >> 15 == 1 { -1.0 } else { 1.0 };
    let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023));
    sign * match exponent {
        0 => fraction * powi(2.0, -24),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1024.0 + fraction) * powi(2.0, exponent - 25),
    }
}

impl Conversion {
    pub fn apply(&self, values: &mut [f64]) {
        match self {
            Self::None => {}
            Self::Linear { offset, factor } => values.iter_mut().for_each(|x| *x = *x * factor + offset),
            Self::Rational([a, b, c, d, e, f]) => {
                values.iter_mut().for_each(|x| *x = ((a * *x + b) * *x + c) / ((d * *x + e) * *x + f));
            }
            Self::Table { pairs, between } => values.iter_mut().for_each(|x| *x = look_up(pairs, *x, *between)),
            Self::Ranges { rows, default } => values.iter_mut().for_each(|x| {
                let inside = |(low, high, _): &&(f64, f64, f64)| *low <= *x && *x <= *high;
                *x = rows.iter().find(inside).map_or(*default, |row| row.2);
            }),
        }
    }
}

fn look_up(pairs: &[(f64, f64)], x: f64, between: bool) -> f64 {
    let (Some(first), Some(last)) = (pairs.first(), pairs.last()) else { return x };
    if x.is_nan() {
        return x;
    }
    let above = pairs.partition_point(|(key, _)| *key <= x);
    if above == 0 {
        return first.1;
    }
    if above == pairs.len() {
        return last.1;
    }
    let ((x0, y0), (x1, y1)) = (pairs[above - 1], pairs[above]);
    if between {
        y0 + (y1 - y0) * ((x - x0) / (x1 - x0))
    } else if x - x0 > x1 - x {
        y1
    } else {
        y0
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/read/mdf/field.rs"]
mod tests;
