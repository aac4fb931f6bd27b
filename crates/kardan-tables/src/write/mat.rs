//! MAT files of version 5.

use std::borrow::Cow;
use std::collections::HashSet;

use crate::Table;

/// MATLAB's limit for names.
const NAME: usize = 63;

/// Gives the table as a MAT file (version 5, not compressed): the column `time` (s) and one column of doubles for each
/// column, bit for bit. Names that MATLAB does not accept are changed: `rk.phi` becomes `rk_phi`, a second one
/// `rk_phi_2`. The rows of the texts `names` and `units` are the name and the unit of each column in the order of the
/// file, time first.
///
/// `None` if a column is longer than the 2 GiB that the format allows.
///
/// # Panics
/// If the length of a column differs from that of the time.
///
/// ```
/// use kardan_tables::{Column, Table, read, write};
///
/// let angle = Column { name: "rk.phi", unit: "rad", description: "", values: &[0.5, 0.6] };
/// let bytes = write::mat(&Table { time: &[0.0, 0.1], columns: vec![angle] }).unwrap();
///
/// let log = read::open(read::in_memory(bytes), &Default::default()).unwrap();
/// assert_eq!((log.groups()[0].time, log.groups()[0].channels[1].name.as_str()), (Some(0), "rk_phi"));
/// ```
pub fn mat(table: &Table<'_>) -> Option<Vec<u8>> {
    let columns = table.with_time("time");
    let mut used: HashSet<String> = ["names", "units"].map(String::from).into();
    let names: Vec<String> = columns.iter().map(|column| valid(column.name, &mut used)).collect();
    let rows = table.time.len();
    let matrices = names.iter().zip(&columns);
    let matrices = matrices.map(|(name, column)| Values { name, rows, columns: 1, values: column.values.into() });
    let names = Texts { name: "names", rows: columns.iter().map(|column| column.name).collect() };
    let units = Texts { name: "units", rows: columns.iter().map(|column| column.unit).collect() };
    mat_matrices(&matrices.collect::<Vec<_>>(), &[names, units])
}

/// A matrix of doubles, column by column.
#[derive(Debug, Clone)]
pub struct Values<'a> {
    /// A valid MATLAB name.
    pub name: &'a str,
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub columns: usize,
    /// One column after the other.
    pub values: Cow<'a, [f64]>,
}

/// Texts, a row for each.
#[derive(Debug, Clone)]
pub struct Texts<'a> {
    /// A valid MATLAB name.
    pub name: &'a str,
    /// The texts.
    pub rows: Vec<&'a str>,
}

/// Gives matrices and texts as a MAT file (version 5, not compressed), bit for bit.
///
/// `None` if a matrix is larger than the 2 GiB that the format allows.
///
/// # Panics
/// If the number of values of a matrix differs from its size.
pub fn mat_matrices(matrices: &[Values<'_>], all_texts: &[Texts<'_>]) -> Option<Vec<u8>> {
    let mut out = b"MATLAB 5.0 MAT-file, written by kardan".to_vec();
    out.resize(124, b' ');
    out.extend(0x0100u16.to_le_bytes());
    out.extend(b"IM");
    for matrix in matrices {
        assert_eq!(matrix.values.len(), matrix.rows * matrix.columns, "`{}` has a different size", matrix.name);
        if matrix.values.len() >= (1 << 31) / 8 - 16 {
            return None;
        }
        array(&mut out, 6, [matrix.rows, matrix.columns], matrix.name, |out| {
            out.extend(9u32.to_le_bytes());
            out.extend((8 * matrix.values.len() as u32).to_le_bytes());
            out.extend(matrix.values.iter().flat_map(|value| value.to_le_bytes()));
        });
    }
    all_texts.iter().for_each(|one| texts(&mut out, one.name, &one.rows));
    Some(out)
}

/// A valid and unused MATLAB name.
fn valid(name: &str, used: &mut HashSet<String>) -> String {
    let mut plain: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).take(NAME).collect();
    if !plain.starts_with(|c: char| c.is_ascii_alphabetic()) {
        plain = format!("x{plain}");
        plain.truncate(NAME);
    }
    let mut unique = plain.clone();
    let mut count = 1;
    while !used.insert(unique.clone()) {
        count += 1;
        let end = format!("_{count}");
        unique = format!("{}{end}", &plain[..plain.len().min(NAME - end.len())]);
    }
    unique
}

/// An element: type, length, body, padding to eight bytes.
fn element(out: &mut Vec<u8>, data_type: u32, body: &[u8]) {
    out.extend(data_type.to_le_bytes());
    out.extend((body.len() as u32).to_le_bytes());
    out.extend(body);
    out.resize(out.len().next_multiple_of(8), 0);
}

/// An array: class, size and name, then what `content` writes.
fn array(out: &mut Vec<u8>, class: u32, [rows, columns]: [usize; 2], name: &str, content: impl FnOnce(&mut Vec<u8>)) {
    out.extend(14u32.to_le_bytes());
    let length = out.len();
    out.extend([0; 4]);
    let start = out.len();
    element(out, 6, &[class.to_le_bytes(), [0; 4]].concat());
    element(out, 5, &[(rows as i32).to_le_bytes(), (columns as i32).to_le_bytes()].concat());
    element(out, 1, name.as_bytes());
    content(out);
    let byte_count = (out.len() - start) as u32;
    out[length..start].copy_from_slice(&byte_count.to_le_bytes());
}

/// Texts as the rows of an array of letters, filled up with blanks.
fn texts(out: &mut Vec<u8>, name: &str, rows: &[&str]) {
    let rows: Vec<Vec<u16>> = rows.iter().map(|row| row.encode_utf16().collect()).collect();
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    array(out, 4, [rows.len(), columns], name, |out| {
        let letter = |column: usize| rows.iter().map(move |row| row.get(column).copied().unwrap_or(u16::from(b' ')));
        let letters: Vec<u8> = (0..columns).flat_map(letter).flat_map(u16::to_le_bytes).collect();
        element(out, 4, &letters);
    });
}
