//! Comma-separated values.

use crate::Table;
use crate::text::csv_cell;

/// Gives the table as CSV (RFC 4180, lines end in `\n`): the header `t` and the names as [`csv_cell`] writes them, then one line for each time.
///
/// Every number is the shortest decimal that reads back as the same `f64`; very small and very large ones have an
/// exponent. Minus zero is written as `0`, a number that is not finite as `NaN`, `inf` or `-inf`.
///
/// # Panics
/// If the length of a column differs from that of the time.
pub fn csv(table: &Table<'_>) -> Vec<u8> {
    let columns = table.with_time("t");
    let mut out = Vec::with_capacity(64 + columns.len() * table.time.len() * 20);
    // Each cell has its delimiter behind it, the last one the end of its line.
    let last = columns.len() - 1;
    let ends = move |column: usize| if column == last { b'\n' } else { b',' };
    for (k, column) in columns.iter().enumerate() {
        out.extend_from_slice(csv_cell(column.name).as_bytes());
        out.push(ends(k));
    }
    let mut buffer = zmij::Buffer::new();
    for row in 0..table.time.len() {
        for (k, column) in columns.iter().enumerate() {
            out.extend_from_slice(decimal(&mut buffer, column.values[row]));
            out.push(ends(k));
        }
    }
    out
}

fn decimal(buffer: &mut zmij::Buffer, value: f64) -> &[u8] {
    if value == 0.0 {
        return b"0";
    }
    let text = buffer.format(value).as_bytes();
    text.strip_suffix(b".0").unwrap_or(text)
}

#[cfg(test)]
#[path = "../../tests/unit/write/csv.rs"]
mod tests;
