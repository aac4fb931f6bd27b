//! Numbers scheduled over an angle, linear between the rows of a table.

use crate::Real;
use crate::dense::row;

/// Numbers over an angle that repeat after a period: rows at equal distances, linear between them.
///
/// Row k of N belongs to k/N of the period. Rows contain finite numbers.
///
/// ```
/// use kardan_rt::Schedule;
/// let schedule = Schedule::new(&[1.0, 10.0, 3.0, 30.0], 2, 4.0).unwrap();
/// let mut now = [0.0; 2];
/// for (angle, expected) in [(0.0, [1.0, 10.0]), (0.5, [1.5, 15.0]), (2.0, [3.0, 30.0]), (3.0, [2.0, 20.0]), (-3.5, [1.5, 15.0])] {
///     assert!(schedule.at(angle, &mut now));
///     assert_eq!(now, expected);
/// }
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Schedule<'a, T> {
    rows: &'a [T],
    width: usize,
    count: usize,
    period: T,
}

impl<'a, T: Real> Schedule<'a, T> {
    /// Rows of `width` numbers, over a period in rad. `None` if there is no row, the numbers do not fill whole rows, or the period
    /// is not above zero.
    pub fn new(rows: &'a [T], width: usize, period: T) -> Option<Self> {
        let count = rows.len().checked_div(width)?;
        let whole = count > 0 && rows.len() == count.checked_mul(width)? && period > T::ZERO && period.is_finite();
        whole.then_some(Self { rows, width, count, period })
    }

    /// The numbers at an angle, rad: `(1 − s) aₖ + s aₖ₊₁` with the rows before and behind it; at the angle of a row that row, as
    /// far as the angle is exact.
    ///
    /// Returns false and leaves `out` as it is if the angle is not finite or `out` is shorter than a row.
    #[inline]
    #[must_use = "false: nothing was written"]
    pub fn at(&self, angle: T, out: &mut [T]) -> bool {
        let turns = angle / self.period;
        let place = (turns - turns.floor()) * T::count(self.count);
        let Some(out) = out.get_mut(..self.width) else { return false };
        if !place.is_finite() {
            return false;
        }
        let before = place.whole().min(self.count.saturating_sub(1));
        let next = before.saturating_add(1);
        let behind = if next < self.count { next } else { 0 };
        let share = place - T::count(before);
        let (before, behind) = (row(self.rows, before, self.width), row(self.rows, behind, self.width));
        for ((out, a), b) in out.iter_mut().zip(before).zip(behind) {
            *out = (T::ONE - share) * *a + share * *b;
        }
        true
    }
}
