//! Matrices and names as given, and their consistency.

use std::collections::BTreeMap;
use std::ops::Range;

use kardan_rt::functions::powi;

use super::system::{DataDigits, StateSpace};
use kardan_analysis::LinearSystem;
use kardan_math::num::{Matrix, Rational, rational_to_f64};
use kardan_schema::diagnostics::{Diagnostic, shortened};

/// The most states, inputs or outputs; at most 4 million entries of a matrix follow.
pub(super) const MOST: usize = 2000;
/// Number of errors of one kind reported one by one for a matrix.
pub(super) const MAX_REPORTED: usize = 8;
/// The longest name.
const NAME_LIMIT: usize = 100;

pub(super) const MATRICES: [&str; 5] = ["A", "B", "C", "D", "E"];
pub(super) const NAMES: [&str; 3] = ["states", "inputs", "outputs"];
/// Keys of the sample time.
pub(super) const SAMPLE_TIMES: [&str; 3] = ["Ts", "dt", "sample_time"];

/// Uncertainty of the numbers of a matrix: sums of squares.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct LastDigits {
    /// Of half a unit of the last digit written.
    pub decimal: f64,
    /// Of the rounding of binary numbers, 2⁻⁵³ of their size.
    pub binary: f64,
    /// Most digits that a number has.
    pub most: usize,
}

/// A number with more digits was written by a program, from a binary number.
const BY_HAND: usize = 14;

impl LastDigits {
    /// Adds a number written as a text; whole numbers and fractions are exact.
    pub fn add_decimal(&mut self, text: &str, value: &Rational) {
        if value.is_int() || text.contains('/') {
            return;
        }
        let text = text.to_ascii_lowercase();
        let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
        let after =
            mantissa.split_once('.').map_or(0, |(_, digits)| digits.chars().filter(char::is_ascii_digit).count());
        let exponent: i32 = exponent.trim().parse().unwrap_or(0);
        let half = 0.5 * powi(10.0, exponent - i32::try_from(after).unwrap_or(i32::MAX / 2));
        self.decimal += half * half;
        let digits = mantissa.chars().filter(char::is_ascii_digit).skip_while(|digit| *digit == '0').count();
        self.most = self.most.max(digits);
        self.add_binary(value);
    }

    /// Adds a binary number; whole numbers are exact.
    pub fn add_binary(&mut self, value: &Rational) {
        if !value.is_int() {
            let rounding = rational_to_f64(value) * f64::EPSILON / 2.0;
            self.binary += rounding * rounding;
        }
    }

    fn and(self, other: Self) -> Self {
        Self {
            decimal: self.decimal + other.decimal,
            binary: self.binary + other.binary,
            most: self.most.max(other.most),
        }
    }
}

/// A matrix as it is given.
#[derive(Debug)]
pub(super) struct ParsedMatrix {
    pub matrix: Matrix<Rational>,
    /// The uncertainty of its numbers.
    pub digits: LastDigits,
    /// Written as a list of numbers, hence neither a row nor a column.
    pub list: bool,
    /// In a text.
    pub span: Option<Range<usize>>,
}

/// The content of a file, as far as readable; parts with reported errors are `None`.
#[derive(Debug, Default)]
pub(super) struct ParsedSystem {
    pub matrices: BTreeMap<&'static str, Option<ParsedMatrix>>,
    pub names: BTreeMap<&'static str, Option<ParsedNames>>,
    /// The sample time of a discrete-time system, s; `Some(None)`: not known.
    pub sample_time: Option<Option<Rational>>,
}

#[derive(Debug)]
pub(super) struct ParsedNames {
    pub names: Vec<String>,
    pub spans: Vec<Range<usize>>,
    pub span: Option<Range<usize>>,
}

impl ParsedSystem {
    /// Combines the parts; reports all inconsistencies.
    pub fn system(mut self, mut diagnostics: Vec<Diagnostic>) -> Result<StateSpace, Vec<Diagnostic>> {
        let digits = self.digits();
        let sample_time = self.sample_time.take();
        let mut parsed = |key| self.matrices.remove(key);
        let (a, b, c, d, e) = (parsed("A"), parsed("B"), parsed("C"), parsed("D"), parsed("E"));
        // Some(None): known to be wrong. Unknown sizes are not reported.
        let states = match &a {
            None => {
                diagnostics.push(
                    Diagnostic::error(
                        "state-space::missing",
                        "there is no matrix `A`, and without it there is no system",
                    )
                    .help("give the square matrix A of ẋ = A x + B u under the name `A`"),
                );
                None
            }
            Some(None) => None,
            Some(Some(a)) if a.matrix.rows() != a.matrix.columns() => {
                let message =
                    format!("`A` is {}, but it must be square: a row and a column per state", size(&a.matrix));
                let diagnostic = Diagnostic::error("state-space::shape", message).at_optional(a.span.clone(), "");
                diagnostics.push(diagnostic.help("write one list per row: [[0, 1], [-2, -3]]"));
                None
            }
            Some(Some(a)) if a.matrix.rows() == 0 => {
                let message = "`A` is 0×0: a system without states has no motion";
                let diagnostic = Diagnostic::error("state-space::empty", message).at_optional(a.span.clone(), "");
                diagnostics.push(diagnostic.help("give at least one state: {\"A\": [[-1]]}"));
                None
            }
            Some(Some(a)) => Some(a.matrix.rows()),
        };
        let e = e.map(|e| square(e?, states, &mut diagnostics));
        let b = b.map(|b| beside_states("B", b?, states, &mut diagnostics));
        let c = c.map(|c| beside_states("C", c?, states, &mut diagnostics));
        let inputs = b.as_ref().map_or(Some(0), |b| b.as_ref().map(Matrix::columns));
        let outputs = c.as_ref().map_or(Some(0), |c| c.as_ref().map(Matrix::rows));
        let d = d.map(|d| feedthrough(d?, outputs, inputs, &mut diagnostics));
        let mut name = |key, letter, count: Option<usize>, what| {
            self.names.remove(key).flatten().map_or_else(
                || (1..=count.unwrap_or(0)).map(|i| format!("{letter}{i}")).collect(),
                |names| checked_names(key, names, count, what, &mut diagnostics),
            )
        };
        let states_named = name("states", "x", states, "states (rows of `A`)");
        let inputs_named = name("inputs", "u", inputs, "inputs (columns of `B`)");
        let outputs_named = name("outputs", "y", outputs, "outputs (rows of `C`)");
        let in_order = |mut diagnostics: Vec<Diagnostic>| {
            diagnostics.sort_by_key(|diagnostic| {
                diagnostic.labels.first().map_or(usize::MAX, |label| label.place.span().start)
            });
            diagnostics
        };
        let (Some(n), Some(Some(a)), true) = (states, a, diagnostics.is_empty()) else {
            return Err(in_order(diagnostics));
        };
        let (m, p) = (inputs.unwrap_or(0), outputs.unwrap_or(0));
        let or = |matrix: Option<Option<Matrix<Rational>>>, rows, columns| {
            matrix.flatten().unwrap_or_else(|| Matrix::zeros(rows, columns))
        };
        let system = LinearSystem {
            states: states_named,
            inputs: inputs_named,
            outputs: outputs_named,
            e: e.flatten().unwrap_or_else(|| Matrix::identity(n)),
            a: a.matrix,
            b: or(b, n, m),
            c: or(c, p, n),
            d: or(d, p, m),
            degrees_of_freedom: None,
        };
        Ok(StateSpace { system, sample_time, digits })
    }

    /// The uncertainty of the numbers.
    fn digits(&self) -> DataDigits {
        let of = |names: &[&str]| {
            let parsed = names.iter().filter_map(|name| self.matrices.get(name)?.as_ref());
            parsed.fold(LastDigits::default(), |all, parsed| all.and(parsed.digits))
        };
        let by_hand = of(&MATRICES).most <= BY_HAND && of(&MATRICES).decimal > 0.0;
        let size = |names: &[&str]| if by_hand { of(names).decimal } else { of(names).binary }.sqrt();
        DataDigits { binary: !by_hand, inputs: size(&["A", "B"]), outputs: size(&["A", "C"]), descriptor: size(&["E"]) }
    }
}

fn size(matrix: &Matrix<Rational>) -> String {
    format!("{}×{}", matrix.rows(), matrix.columns())
}

fn square(e: ParsedMatrix, states: Option<usize>, diagnostics: &mut Vec<Diagnostic>) -> Option<Matrix<Rational>> {
    let (rows, columns) = (e.matrix.rows(), e.matrix.columns());
    if rows != columns || states.is_some_and(|n| n != rows) {
        let expected = match states {
            Some(n) => format!("it must be {n}×{n} as `A` is"),
            None => "it must be square".into(),
        };
        let message = format!("`E` is {}, but {expected}", size(&e.matrix));
        let diagnostic = Diagnostic::error("state-space::shape", message).at_optional(e.span, "");
        diagnostics.push(diagnostic.help("leave `E` out if it is the identity"));
        return None;
    }
    Some(e.matrix)
}

/// `B` has a row for each state, `C` a column.
fn beside_states(
    name: &str,
    parsed: ParsedMatrix,
    states: Option<usize>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<Matrix<Rational>> {
    let by_rows = name == "B";
    let (rows, columns) = (parsed.matrix.rows(), parsed.matrix.columns());
    if rows == 0 || columns == 0 {
        let n = states.unwrap_or(0);
        return Some(if by_rows { Matrix::zeros(n, 0) } else { Matrix::zeros(0, n) });
    }
    let n = states?;
    let (states_dim, across) = if by_rows { (rows, columns) } else { (columns, rows) };
    // A list is a column of B, a row of C.
    if parsed.list && columns == n {
        return Some(if by_rows { parsed.matrix.transpose() } else { parsed.matrix });
    }
    if states_dim == n && !parsed.list {
        return Some(parsed.matrix);
    }
    let what = if by_rows { "rows" } else { "columns" };
    let message = format!("`{name}` is {}, but it needs {n} {what}, one per state (`A` is {n}×{n})", shape(&parsed));
    let help = match (across == n, by_rows) {
        _ if parsed.list => "a list of numbers is one column of `B`, one row of `C`: give one number per state",
        (true, true) => "is it transposed? a column belongs to an input: [[0], [1]] is one input for two states",
        (true, false) => "is it transposed? a row belongs to an output: [[1, 0]] is one output of two states",
        (false, true) => "give one row per state and one column per input",
        (false, false) => "give one row per output and one column per state",
    };
    diagnostics.push(Diagnostic::error("state-space::shape", message).at_optional(parsed.span, "").help(help));
    None
}

fn shape(parsed: &ParsedMatrix) -> String {
    if parsed.list { format!("a list of {} numbers", parsed.matrix.columns()) } else { size(&parsed.matrix) }
}

fn feedthrough(
    d: ParsedMatrix,
    outputs: Option<usize>,
    inputs: Option<usize>,
    diagnostics: &mut Vec<Diagnostic>,
) -> Option<Matrix<Rational>> {
    let (p, m) = (outputs?, inputs?);
    let (rows, columns) = (d.matrix.rows(), d.matrix.columns());
    let nothing = rows == 0 || columns == 0;
    // `D = 0` is zero of any size.
    if nothing || (rows == 1 && columns == 1 && d.matrix[(0, 0)].is_zero()) {
        return Some(Matrix::zeros(p, m));
    }
    if rows == p && columns == m {
        return Some(d.matrix);
    }
    if d.list && m == 1 && columns == p {
        return Some(d.matrix.transpose());
    }
    let message = format!(
        "`D` is {}, but it must be {p}×{m}: a row per output (row of `C`), a column per input (column of `B`)",
        shape(&d)
    );
    let diagnostic = Diagnostic::error("state-space::shape", message).at_optional(d.span, "");
    diagnostics.push(diagnostic.help("leave `D` out if there is no feedthrough"));
    None
}

fn checked_names(
    key: &str,
    parsed: ParsedNames,
    count: Option<usize>,
    what: &str,
    diagnostics: &mut Vec<Diagnostic>,
) -> Vec<String> {
    let ParsedNames { names, spans, span } = parsed;
    if let Some(count) = count
        && names.len() != count
    {
        let message = format!("`{key}` has {} names for {count} {what}", names.len());
        let diagnostic = Diagnostic::error("state-space::names", message).at_optional(span, "");
        diagnostics.push(diagnostic.help("give one name each, or leave it out"));
    }
    let mut first = BTreeMap::new();
    for (i, name) in names.iter().enumerate() {
        let span = spans.get(i).cloned();
        let mut complain = |message, help: &str| {
            diagnostics.push(Diagnostic::error("state-space::names", message).at_optional(span.clone(), "").help(help));
        };
        let number = i + 1;
        if name.trim().is_empty() {
            complain(format!("name {number} of `{key}` is empty"), "give it a name, such as `x1`");
        } else if name.chars().count() > NAME_LIMIT || name.contains(char::is_control) {
            complain(
                format!("name {number} of `{key}`, `{}`, is no name", shortened(&name.escape_debug().to_string())),
                "use at most 100 letters and no line breaks or other control characters",
            );
        } else if let Some(earlier) = first.insert(name, number) {
            complain(
                format!("name {number} of `{key}` is `{}` as is name {earlier}", shortened(name)),
                "every name may occur once in a list",
            );
        }
    }
    names
}

/// A sample time that is none.
pub(super) fn discrete(key: &str) -> Diagnostic {
    let message = format!("`{key}` is no sample time: a positive number of seconds, or -1 if it is not known");
    Diagnostic::error("state-space::discrete", message)
        .help("leave the key out, or give 0, if the system is in continuous time")
}

/// The meaning of a sample time: 0 is continuous time, −1 discrete time with a sample time that is not known.
///
/// # Errors
/// If it is another negative number.
pub(super) fn sampled(time: Rational) -> Result<Option<Option<Rational>>, ()> {
    match time {
        time if time.is_zero() => Ok(None),
        time if time == Rational::NEG_ONE => Ok(Some(None)),
        time if time < Rational::ZERO => Err(()),
        time => Ok(Some(Some(time))),
    }
}

/// States how many errors are not reported one by one.
pub(super) fn more(name: &str, count: usize, span: Option<&Range<usize>>, diagnostics: &mut Vec<Diagnostic>) {
    if count > MAX_REPORTED {
        let message = format!("`{name}` has {} more entries that are no finite numbers", count - MAX_REPORTED);
        let diagnostic = Diagnostic::error("state-space::entry", message).at_optional(span.cloned(), "");
        diagnostics.push(diagnostic.help("correct the entries that are reported first"));
    }
}
