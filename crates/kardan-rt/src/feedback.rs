use crate::Real;
use crate::dense::{at, dot, row};

/// A constant gain matrix, row by row: `out += G·x`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gain<'a, T> {
    entries: &'a [T],
    columns: usize,
}

impl<'a, T: Real> Gain<'a, T> {
    /// A matrix of the given number of columns; `None` if the entries do not fill whole rows.
    ///
    /// ```
    /// let gain = kardan_rt::Gain::new(&[1.0, 2.0, 3.0, 4.0], 2).unwrap();
    /// let mut out = [0.0, 100.0];
    /// gain.add_to(&[10.0, 1.0], &mut out);
    /// assert_eq!(out, [12.0, 134.0]);
    /// assert!(kardan_rt::Gain::new(&[1.0, 2.0, 3.0], 2).is_none());
    /// ```
    pub fn new(entries: &'a [T], columns: usize) -> Option<Self> {
        (entries.len().checked_rem(columns) == Some(0)).then_some(Self { entries, columns })
    }

    /// Row k times x, over the shorter of both; 0 behind the last row.
    #[inline]
    pub fn row_times(&self, k: usize, x: &[T]) -> T {
        dot(row(self.entries, k, self.columns), x)
    }

    /// An entry; 0 outside of the matrix.
    #[inline]
    pub fn entry(&self, row_number: usize, column: usize) -> T {
        at(row(self.entries, row_number, self.columns), column)
    }

    /// Adds `G·x` to `out`; one entry of `x` per column, one of `out` per row.
    #[inline]
    pub fn add_to(&self, x: &[T], out: &mut [T]) {
        let columns = self.columns.max(1);
        // Rows are split off one by one: to count them would take a division, which costs as much as a row.
        let mut rows = self.entries;
        for value in out {
            let Some((row, next_rows)) = rows.split_at_checked(columns) else { return };
            let mut sum = *value;
            for (gain, state) in row.iter().zip(x) {
                sum = sum + *gain * *state;
            }
            *value = sum;
            rows = next_rows;
        }
    }
}
