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

impl<'a> Table<'a> {
    /// The time under this name, then the columns.
    ///
    /// # Panics
    /// If a column is not as long as the time.
    pub(crate) fn with_time(&self, name: &'a str) -> Vec<Column<'a>> {
        let time = Column { name, unit: "s", description: "time", values: self.time };
        for column in &self.columns {
            assert_eq!(
                column.values.len(),
                self.time.len(),
                "the length of `{}` differs from that of time",
                column.name
            );
        }
        std::iter::once(time).chain(self.columns.iter().copied()).collect()
    }
}
