//! A page as plain data: its contents, their order and kind. The modules `html`, `terminal` and `markdown`
//! decide its appearance.
//!
//! Texts are plain: powers are written `s^2`, the minus of numbers is `−`, hard spaces keep together what belongs together.

use std::ops::Range;

use super::text::{figure, number, with_unit};
use kardan_results::{ExactMatrix, NamedMatrix, Verdict};

/// A page.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Page {
    /// Its title.
    pub name: String,
    /// Paragraphs below the title, with empty lines between.
    pub description: String,
    /// The verdict: good or bad, and why.
    pub verdict: Option<Verdict>,
    /// Prominent warnings.
    pub alerts: Vec<Alert>,
    /// The sections, in order.
    pub sections: Vec<Section>,
    /// The data of the charts, as JSON for the script of the page; `None` without charts.
    pub data: Option<String>,
    /// The data of the sweep's run plots, as JSON for their script; `None` without plots.
    pub samples: Option<String>,
}

/// A prominent warning: `Warning`, and its subject.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Alert {
    /// Kind.
    pub kind: String,
    /// What.
    pub text: String,
}

/// A section with its place in the contents.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Section {
    /// Link target; unique in the page.
    pub anchor: String,
    /// Its title.
    pub title: String,
    /// Its contents.
    pub body: Body,
}

/// The role of a sentence.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tone {
    /// A statement.
    Plain,
    /// How to read the adjacent content.
    Hint,
    /// Good news.
    Good,
    /// Bad news.
    Bad,
}

/// A part of a section.
#[derive(Debug, Clone, PartialEq)]
pub enum Block {
    /// A paragraph.
    Text(Tone, String),
    /// A verdict.
    Verdict(Verdict),
    /// Prominent warnings.
    Alert(Alert),
    /// Sentences, each with its own mark.
    List(Vec<String>),
    /// Names with what they are: `States (2): a, b`.
    Names(String, Vec<String>),
    /// A table.
    Table(Table),
    /// Matrices, side by side where there is room.
    Matrices(Vec<Matrix>),
    /// A drawing.
    Picture(Picture),
    /// Curves that can be zoomed.
    Chart(Chart),
    /// A part with a title; with an anchor where it is a section of a whole page within this one.
    Part(Section),
    /// Details, folded where possible.
    Fold(String, Body),
    /// Contents left out where space is limited.
    Detail(Body),
}

/// A table whose first column names the rows unless it contains numbers.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Table {
    /// Titles of the columns; columns of titles that start with `#` contain numbers.
    pub columns: Vec<String>,
    /// As many cells in each row as there are columns.
    pub rows: Vec<Vec<Cell>>,
    /// Number of rows where space is limited.
    pub brief: usize,
}

/// A cell of a table.
#[derive(Debug, Clone, PartialEq)]
pub enum Cell {
    /// A text, or a number with a text after it.
    Text(String),
    /// A formula.
    Code(String),
    /// A command to copy, kept verbatim.
    Verbatim(String),
    /// A verdict: good or bad.
    Mark(bool, String),
    /// The name of this number of rows, this one included; those below have [`Cell::Under`].
    Span(String, usize),
    /// Covered by the cell above.
    Under,
    /// A number that may be known exactly.
    Entry(Entry),
}

/// A number and its exact fraction, if known.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Entry {
    /// Its value; NaN where there is none.
    pub value: f64,
    /// As a fraction.
    pub exact: Option<String>,
}

/// A matrix with its names.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Matrix {
    /// What it is, with its unit.
    pub title: String,
    /// Whether its entries are known exactly.
    pub exact: bool,
    /// Names of the rows.
    pub rows: Vec<String>,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Row by row.
    pub entries: Vec<Vec<Entry>>,
}

/// A drawing.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Picture {
    /// Its title.
    pub title: String,
    /// SVG in HTML.
    pub drawing: String,
    /// How to read it, as HTML: legends have colours.
    pub caption: String,
}

/// A plot that can be zoomed, and the picture that replaces it on paper.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Chart {
    /// Link target.
    pub anchor: String,
    /// Its title.
    pub title: String,
    /// Its index in [`Page::data`].
    pub index: usize,
    /// Whether its picture is shown on the screen too: it cannot be zoomed.
    pub still: bool,
    /// SVG for paper.
    pub svg: String,
    /// What it shows.
    pub caption: String,
}

/// Longer fractions are shown as numbers.
pub(super) const FRACTION: usize = 12;

impl Entry {
    /// The fraction if it is short, else a number of this many digits; and whether a fraction was rounded.
    pub(super) fn rounded_text(&self, digits: usize) -> (String, bool) {
        match &self.exact {
            Some(text) if text.chars().count() <= FRACTION => (text.replace('-', "−"), false),
            exact => (figure(self.value, digits), exact.is_some()),
        }
    }
}

impl Matrix {
    fn new(title: &str, unit: &str, [rows, columns]: [&[String]; 2], entries: Vec<Vec<Entry>>) -> Self {
        let names = (0..entries.len()).map(|k| rows.get(k).cloned().unwrap_or_default());
        Self { title: with_unit(title, unit), exact: false, rows: names.collect(), columns: columns.to_vec(), entries }
    }

    /// Some of its columns as a table, behind the names of its rows.
    pub(super) fn table(&self, columns: Range<usize>) -> Table {
        let titles = self.columns[columns.clone()].iter().map(|name| format!("#{name}"));
        let row = |(name, row): (&String, &Vec<Entry>)| {
            let entries = row.iter().take(columns.end).skip(columns.start).cloned().map(Cell::Entry);
            std::iter::once(Cell::from(name)).chain(entries).collect()
        };
        Table {
            columns: std::iter::once(String::new()).chain(titles).collect(),
            rows: self.rows.iter().zip(&self.entries).map(row).collect(),
            brief: usize::MAX,
        }
    }
}

impl From<&NamedMatrix> for Matrix {
    fn from(matrix: &NamedMatrix) -> Self {
        let entry = |&value: &f64| Entry { value, exact: None };
        let entries = matrix.values.iter().map(|row| row.iter().map(entry).collect()).collect();
        Self::new(&matrix.title, &matrix.unit, [&matrix.rows, &matrix.columns], entries)
    }
}

impl From<&ExactMatrix> for Matrix {
    fn from(matrix: &ExactMatrix) -> Self {
        let title = match (matrix.name.is_empty(), matrix.title.is_empty()) {
            (_, true) => matrix.name.clone(),
            (true, _) => matrix.title.clone(),
            _ => format!("{}: {}", matrix.name, matrix.title),
        };
        let exact = |i: usize, j: usize| matrix.exact.as_ref().and_then(|rows| rows.get(i)?.get(j).cloned());
        let value = |i: usize, j: usize| matrix.values[i].get(j).copied().unwrap_or(f64::NAN);
        let entry = |i: usize, j: usize| Entry { value: value(i, j), exact: exact(i, j) };
        let row = |i: usize| (0..matrix.columns.len()).map(|j| entry(i, j)).collect();
        let entries = (0..matrix.values.len()).map(row).collect();
        let is_exact = matrix.exact.is_some();
        Self { exact: is_exact, ..Self::new(&title, &matrix.unit, [&matrix.rows, &matrix.columns], entries) }
    }
}

impl Cell {
    /// A verdict with its words, the good one first.
    pub(super) fn judged(good: bool, [yes, no]: [&str; 2]) -> Self {
        Self::Mark(good, if good { yes } else { no }.into())
    }

    /// `yes` or `no` where it is decided.
    pub(super) fn decided(verdict: Option<bool>) -> Self {
        verdict.map_or(Self::Mark(false, "not decided".into()), |good| Self::judged(good, ["yes", "no"]))
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Cell::Text(text)
    }
}

impl From<&String> for Cell {
    fn from(text: &String) -> Self {
        Cell::Text(text.clone())
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Cell::Text(text.into())
    }
}

impl From<f64> for Cell {
    /// A number of five significant digits.
    fn from(value: f64) -> Self {
        Cell::Text(number(value))
    }
}

impl From<Option<f64>> for Cell {
    fn from(value: Option<f64>) -> Self {
        Cell::from(value.unwrap_or(f64::NAN))
    }
}

impl From<usize> for Cell {
    fn from(count: usize) -> Self {
        Cell::Text(count.to_string())
    }
}

/// Cells of the values in a row.
macro_rules! row {
    ($($cell:expr),* $(,)?) => { vec![$($crate::model::Cell::from($cell)),*] };
}
pub(super) use row;

/// More rows are counted where there is little room.
const BRIEF: usize = 20;

/// Parts one below the other. What is empty is left out, title and all.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Body(pub Vec<Block>);

impl Body {
    fn with(mut self, block: Block, present: bool) -> Self {
        self.0.extend(present.then_some(block));
        self
    }

    fn text(self, tone: Tone, text: impl Into<String>) -> Self {
        let text = text.into();
        let present = !text.is_empty();
        self.with(Block::Text(tone, text), present)
    }

    /// A paragraph.
    pub fn paragraph(self, text: impl Into<String>) -> Self {
        self.text(Tone::Plain, text)
    }

    /// How to read the adjacent content.
    pub fn hint(self, text: impl Into<String>) -> Self {
        self.text(Tone::Hint, text)
    }

    /// A verdict.
    pub fn judge(self, good: bool, text: impl Into<String>) -> Self {
        self.text(if good { Tone::Good } else { Tone::Bad }, text)
    }

    /// Sentences, each with its own mark.
    pub fn list(self, texts: impl IntoIterator<Item = String>) -> Self {
        let texts: Vec<String> = texts.into_iter().collect();
        let present = !texts.is_empty();
        self.with(Block::List(texts), present)
    }

    /// Names with what they are.
    pub fn names(self, what: &str, names: &[String]) -> Self {
        self.with(Block::Names(what.into(), names.to_vec()), true)
    }

    /// A table; columns of titles that start with `#` contain numbers.
    pub fn table(self, columns: &[impl AsRef<str>], rows: impl IntoIterator<Item = Vec<Cell>>) -> Self {
        self.table_of(BRIEF, columns, rows)
    }

    /// A table with at most this number of rows where space is limited.
    pub fn table_of(
        self,
        brief: usize,
        columns: &[impl AsRef<str>],
        rows: impl IntoIterator<Item = Vec<Cell>>,
    ) -> Self {
        let rows: Vec<Vec<Cell>> = rows.into_iter().collect();
        debug_assert!(rows.iter().all(|row| row.len() == columns.len()), "a cell for each column");
        let (columns, present) = (columns.iter().map(|name| name.as_ref().into()).collect(), !rows.is_empty());
        self.with(Block::Table(Table { columns, rows, brief }), present)
    }

    /// Matrices; those without entries are left out.
    pub fn matrices<'a, M: 'a>(self, all: impl IntoIterator<Item = &'a M>) -> Self
    where
        Matrix: From<&'a M>,
    {
        let all: Vec<Matrix> = all.into_iter().map(Matrix::from).filter(|one| !one.entries.is_empty()).collect();
        let present = !all.is_empty();
        self.with(Block::Matrices(all), present)
    }

    /// Drawings.
    pub fn pictures(mut self, pictures: impl IntoIterator<Item = Picture>) -> Self {
        self.0.extend(pictures.into_iter().map(Block::Picture));
        self
    }

    /// A part with a title.
    pub fn part(self, title: &str, body: Body) -> Self {
        let present = !body.0.is_empty();
        self.with(Block::Part(Section { anchor: String::new(), title: title.into(), body }), present)
    }

    /// Details, folded where possible.
    pub fn fold(self, title: &str, body: Body) -> Self {
        let present = !body.0.is_empty();
        self.with(Block::Fold(title.into(), body), present)
    }

    /// Contents left out where space is limited.
    pub fn detail(self, body: Body) -> Self {
        let present = !body.0.is_empty();
        self.with(Block::Detail(body), present)
    }

    /// Appends another body.
    pub fn and(mut self, other: Body) -> Self {
        self.0.extend(other.0);
        self
    }
}

impl Page {
    /// The non-empty sections: anchor, title, body.
    pub(super) fn sections<T: Into<String>>(all: impl IntoIterator<Item = (T, T, Body)>) -> Vec<Section> {
        let present = all.into_iter().filter(|(_, _, body)| !body.0.is_empty());
        present.map(|(anchor, title, body)| Section { anchor: anchor.into(), title: title.into(), body }).collect()
    }

    /// The whole page as a section of another one; `hint` names its source.
    pub(super) fn into_section(self, anchor: &str, title: &str, hint: &str) -> Section {
        let alerts = self.alerts.into_iter().map(Block::Alert);
        let mut body = Body(self.verdict.map(Block::Verdict).into_iter().chain(alerts).collect()).hint(hint);
        // The surrounding page already shows the mechanism.
        let sections = self.sections.into_iter().filter(|one| one.anchor != Section::MECHANISM);
        body.0.extend(sections.map(|one| {
            let anchor = format!("{anchor}-{}", one.anchor);
            Block::Part(Section { anchor, ..one })
        }));
        Section { anchor: anchor.into(), title: title.into(), body }
    }
}

impl Section {
    /// The anchor of the drawing of the mechanism.
    pub(super) const MECHANISM: &'static str = "mechanism";

    /// The same, left out where there is little room.
    pub(super) fn detail(self) -> Self {
        Self { body: Body::default().detail(self.body), ..self }
    }
}

/// A box for each warning.
pub(super) fn warnings(texts: &[String]) -> Vec<Alert> {
    texts.iter().map(|text| Alert { kind: "Warning".into(), text: text.clone() }).collect()
}
