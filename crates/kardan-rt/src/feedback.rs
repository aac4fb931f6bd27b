//! Constant gain matrices and sums of their products with signals.

use crate::Real;
use crate::dense::{all_finite, at, copy, dot, row};

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
    /// assert!(gain.add_to(&[10.0, 1.0], &mut out));
    /// assert_eq!(out, [12.0, 134.0]);
    /// assert!(kardan_rt::Gain::new(&[1.0, 2.0, 3.0], 2).is_none());
    /// ```
    pub fn new(entries: &'a [T], columns: usize) -> Option<Self> {
        (entries.len().checked_rem(columns) == Some(0)).then_some(Self { entries, columns })
    }

    /// Row k times x, over the shorter of both; 0 behind the last row.
    #[inline]
    pub(crate) fn row_times(&self, k: usize, x: &[T]) -> T {
        dot(row(self.entries, k, self.columns), x)
    }

    /// An entry; 0 outside of the matrix.
    #[inline]
    pub(crate) fn entry(&self, row_number: usize, column: usize) -> T {
        at(row(self.entries, row_number, self.columns), column)
    }

    /// Adds `G·x` to `out`; one entry of `x` per column, one of `out` per row.
    ///
    /// Returns false and leaves `out` as it is if a sum is not finite.
    #[inline]
    #[must_use = "false: nothing was added"]
    pub fn add_to(&self, x: &[T], out: &mut [T]) -> bool {
        let columns = self.columns.max(1);
        let mut rows = self.entries.chunks_exact(columns);
        let finite = out.iter().all(|value| rows.next().map_or(*value, |row| sum(*value, row, x)).is_finite());
        if finite {
            self.accumulate(x, out);
        }
        finite
    }

    /// [`add_to`](Self::add_to) without a check of the sums, for blocks that check them before they output them.
    #[inline]
    pub(crate) fn accumulate(&self, x: &[T], out: &mut [T]) {
        let columns = self.columns.max(1);
        let (mut rows, mut values) = (self.entries, out);
        // Four rows at once: one sum waits for itself at each term, four wait together.
        while let (Some((four, next_rows)), true) =
            (rows.split_at_checked(columns.saturating_mul(4)), values.len() >= 4)
        {
            let Some((block, next_values)) = core::mem::take(&mut values).split_at_mut_checked(4) else { break };
            four_sums(block, four, columns, x);
            (rows, values) = (next_rows, next_values);
        }
        // Rows are split off one by one: counting them would need a division, which costs as much as a row.
        for value in values {
            let Some((row, next_rows)) = rows.split_at_checked(columns) else { return };
            *value = sum(*value, row, x);
            rows = next_rows;
        }
    }
}

/// Adds the products of four rows and x to four values, each in the order of [`sum`].
#[inline]
fn four_sums<T: Real>(values: &mut [T], rows: &[T], columns: usize, x: &[T]) {
    let [a, b, c, d] = values else { return };
    let Some((first, rows)) = rows.split_at_checked(columns) else { return };
    let Some((second, rows)) = rows.split_at_checked(columns) else { return };
    let Some((third, fourth)) = rows.split_at_checked(columns) else { return };
    let pairs = first.iter().zip(second).zip(third.iter().zip(fourth));
    for (((first, second), (third, fourth)), x) in pairs.zip(x) {
        (*a, *b) = (*a + *first * *x, *b + *second * *x);
        (*c, *d) = (*c + *third * *x, *d + *fourth * *x);
    }
}

#[inline]
fn sum<T: Real>(start: T, row: &[T], x: &[T]) -> T {
    row.iter().zip(x).fold(start, |sum, (gain, state)| sum + *gain * *state)
}

/// `out = G x + H y`. Returns false and leaves `out` unchanged if an entry of x, y or the result is not finite. For
/// many outputs the sums are formed two times, which needs no memory.
#[inline]
pub fn combine<T: Real>((g, x): (&Gain<'_, T>, &[T]), (h, y): (&Gain<'_, T>, &[T]), out: &mut [T]) -> bool {
    // An entry that no row uses is checked too: the block must report that it is not a number.
    let finite_inputs = all_finite(x) && all_finite(y);
    let mut buffer = [T::ZERO; 8];
    if let Some(found) = buffer.get_mut(..out.len()) {
        g.accumulate(x, found);
        h.accumulate(y, found);
        let finite = finite_inputs && all_finite(found);
        if finite {
            copy(found, out);
        }
        return finite;
    }
    let entry = |k: usize| {
        let first = sum(T::ZERO, row(g.entries, k, g.columns.max(1)), x);
        sum(first, row(h.entries, k, h.columns.max(1)), y)
    };
    let finite = finite_inputs && (0..out.len()).all(|k| entry(k).is_finite());
    if finite {
        for (k, value) in out.iter_mut().enumerate() {
            *value = entry(k);
        }
    }
    finite
}
