//! Tables of signals over time.

/// A signal of a [`Table`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Column<'a> {
    /// Name.
    pub name: &'a str,
    /// Unit of the values.
    pub unit: &'a str,
    /// One sentence; may be empty.
    pub description: &'a str,
    /// One value for each time.
    pub values: &'a [f64],
}

/// Signals on one time grid.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table<'a> {
    /// Time, s.
    pub time: &'a [f64],
    /// The signals, each as long as `time`.
    pub columns: Vec<Column<'a>>,
}

impl Table<'_> {
    /// Checks that every column is as long as the time.
    ///
    /// # Panics
    /// If one is not.
    pub(crate) fn check(&self) {
        for column in &self.columns {
            assert_eq!(
                column.values.len(),
                self.time.len(),
                "the length of `{}` differs from that of time",
                column.name
            );
        }
    }
}
