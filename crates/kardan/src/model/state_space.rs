//! A linear system given by its matrices: `A`, `B`, `C`, `D` and possibly `E` in JSON or in a MAT file.

use std::collections::BTreeMap;
use std::ops::Range;

use kardan_tables::read::mat5::{Array, Broken, Content, MatFile, Stored};
use serde_json::value::RawValue;

use crate::analysis::LinearSystem;
use crate::diagnostics::{Diagnostic, Lines, nearest, quoted, shortened};
use crate::num::{Matrix, Rational, Scalar, exact_rank, rational_from_f64};
use crate::units::parse_number;

/// The most states, inputs or outputs; at most 4 million entries of a matrix follow.
const MOST: usize = 2000;
/// Mistakes of one kind that are told one by one for a matrix.
const TOLD: usize = 8;
/// The longest name.
const NAME_LIMIT: usize = 100;
/// The longest file: beyond it nothing that fits into [`MOST`] is written.
const FILE_LIMIT: usize = 1 << 30;

const MATRICES: [&str; 5] = ["A", "B", "C", "D", "E"];
const NAMES: [&str; 3] = ["states", "inputs", "outputs"];
/// Keys that say how long a sample takes.
const SAMPLE_TIMES: [&str; 3] = ["Ts", "dt", "sample_time"];

/// Reads a linear system `E ẋ = A x + B u`, `y = C x + D u` given by its matrices.
///
/// The bytes are a MAT file of version 5 (`save -v7` or `-v6`, SciPy) with variables `A`, `B`, `C`, `D` and `E`, or with a
/// structure that has these fields; or else JSON, an object with these keys. `A` is needed; without `B` there are no
/// inputs, without `C` no outputs, without `D` no feedthrough, without `E` it is the identity. `states`, `inputs` and
/// `outputs` may name the variables, which are `x1`…, `u1`… and `y1`… otherwise.
///
/// Numbers of JSON are taken as written: `0.1` is one tenth; `"1/3"` is one third. Those of a MAT file are the exact
/// values of the binary numbers in it. A list of numbers instead of a matrix is a column in `B` and a row in `C`. Places
/// of diagnostics refer to the text behind a byte order mark.
///
/// ```
/// use kardan::model::read_state_space;
/// let json = br#"{"A": [[0, 1], ["-1/3", -0.1]], "B": [0, 1], "C": [1, 0]}"#;
/// let system = read_state_space(json).unwrap();
/// assert_eq!(system.inputs, ["u1"]);
/// assert_eq!(system.a[(1, 1)], kardan::num::Rational::from_parts((-1).into(), 10u8.into()));
/// ```
///
/// # Errors
/// All mistakes: what cannot be read, matrices that do not fit together, a singular `E`, entries that are no finite
/// numbers, more than 2000 states, inputs or outputs.
pub fn read_state_space(bytes: &[u8]) -> Result<LinearSystem, Vec<Diagnostic>> {
    let one = |mistake| Err(vec![mistake]);
    if bytes.len() > FILE_LIMIT {
        let message =
            format!("the file is larger than {} MiB, too large for the matrices of a system", FILE_LIMIT >> 20);
        return one(Diagnostic::error("state-space::too-large", message).help("is it the file that you meant?"));
    }
    if bytes.starts_with(b"MATLAB 5.0 MAT-file") {
        return read_mat(bytes);
    }
    if bytes.starts_with(b"MATLAB 7.3 MAT-file") || bytes.starts_with(b"\x89HDF\r\n\x1a\n") {
        return one(other_version("7.3 (HDF5)"));
    }
    if bytes.starts_with(b"MATLAB ") {
        return one(other_version("unknown to this program"));
    }
    if is_version_4(bytes) {
        return one(other_version("4"));
    }
    if bytes.starts_with(&[0xff, 0xfe]) || bytes.starts_with(&[0xfe, 0xff]) {
        return one(Diagnostic::error("file::utf-16", "the file is UTF-16 text, JSON is UTF-8")
            .help("save it as UTF-8, or convert it: iconv -f UTF-16 -t UTF-8 OLD > NEW"));
    }
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let text = match std::str::from_utf8(bytes) {
        Ok(text) => text,
        Err(error) => {
            let at = error.valid_up_to();
            let line = bytes[..at].iter().filter(|byte| **byte == b'\n').count() + 1;
            let message = format!(
                "the file is neither a MAT file nor JSON: byte 0x{:02X} at offset {at} (line {line}) is not UTF-8 text",
                bytes[at]
            );
            return one(Diagnostic::error("file::not-utf-8", message).help(
                "give a MAT file written by `save -v7`, or JSON such as {\"A\": [[0, 1], [-2, -3]], \"B\": [0, 1]}",
            ));
        }
    };
    if text.trim().is_empty() {
        return one(Diagnostic::error("file::empty", "the file is empty")
            .help("write at least {\"A\": [[-1]]}; `B`, `C`, `D` and `E` may follow"));
    }
    read_json(text)
}

fn other_version(version: &str) -> Diagnostic {
    Diagnostic::error("mat::version", format!("the file is a MAT file of version {version}; version 5 is read"))
        .help("save it with `save -v7 FILE A B C D` (SciPy: savemat(FILE, ..., format=\"5\"))")
}

/// A version 4 file has no header: it begins with the type `MOPT`, the size and the length of the name of a matrix.
fn is_version_4(bytes: &[u8]) -> bool {
    let Some((head, _)) = bytes.split_first_chunk::<20>() else { return false };
    let plausible = |read: fn([u8; 4]) -> u32| {
        let number = |i: usize| read([head[4 * i], head[4 * i + 1], head[4 * i + 2], head[4 * i + 3]]);
        let (kind, name) = (number(0), number(4));
        let digits = (kind / 1000, kind / 100 % 10, kind / 10 % 10, kind % 10);
        digits.0 <= 4 && digits.1 == 0 && digits.2 <= 5 && digits.3 <= 2 && number(3) <= 1 && (1..=64).contains(&name)
    };
    plausible(u32::from_le_bytes) || plausible(u32::from_be_bytes)
}

/// A matrix as it was found.
#[derive(Debug)]
struct Found {
    matrix: Matrix<Rational>,
    /// Written as a list of numbers, hence neither a row nor a column.
    list: bool,
    /// In a text.
    span: Option<Range<usize>>,
}

/// What a file says, as far as it could be read; what is wrong in itself has been told already and is `None`.
#[derive(Debug, Default)]
struct Parts {
    matrices: BTreeMap<&'static str, Option<Found>>,
    names: BTreeMap<&'static str, Option<Names>>,
}

#[derive(Debug)]
struct Names {
    names: Vec<String>,
    spans: Vec<Range<usize>>,
    span: Option<Range<usize>>,
}

fn place(diagnostic: Diagnostic, span: &Option<Range<usize>>) -> Diagnostic {
    match span {
        Some(span) => diagnostic.at(span.clone(), ""),
        None => diagnostic,
    }
}

impl Parts {
    /// Puts the parts together; all that does not fit is told.
    fn system(mut self, mut mistakes: Vec<Diagnostic>) -> Result<LinearSystem, Vec<Diagnostic>> {
        let mut found = |key| self.matrices.remove(key);
        let (a, b, c, d, e) = (found("A"), found("B"), found("C"), found("D"), found("E"));
        // Some(None): known to be wrong. Sizes that are not known are not complained about.
        let states = match &a {
            None => {
                mistakes.push(
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
                let mistake = Diagnostic::error("state-space::shape", message);
                mistakes.push(place(mistake, &a.span).help("write one list per row: [[0, 1], [-2, -3]]"));
                None
            }
            Some(Some(a)) if a.matrix.rows() == 0 => {
                let mistake =
                    Diagnostic::error("state-space::empty", "`A` is 0×0: a system without states has no motion");
                mistakes.push(place(mistake, &a.span).help("give at least one state: {\"A\": [[-1]]}"));
                None
            }
            Some(Some(a)) => Some(a.matrix.rows()),
        };
        let e = e.map(|e| e.map(|e| self::square(e, states, &mut mistakes)));
        let b = b.map(|b| b.map(|b| column(b, states, &mut mistakes)));
        let c = c.map(|c| c.map(|c| row(c, states, &mut mistakes)));
        let inputs = match &b {
            None => Some(0),
            Some(b) => b.as_ref().and_then(|b| b.as_ref().map(Matrix::columns)),
        };
        let outputs = match &c {
            None => Some(0),
            Some(c) => c.as_ref().and_then(|c| c.as_ref().map(Matrix::rows)),
        };
        let d = d.map(|d| d.map(|d| feedthrough(d, outputs, inputs, &mut mistakes)));
        let mut name = |key, letter, count: Option<usize>, what| {
            self.names.remove(key).flatten().map_or_else(
                || (1..=count.unwrap_or(0)).map(|i| format!("{letter}{i}")).collect(),
                |names| checked_names(key, names, count, what, &mut mistakes),
            )
        };
        let states_named = name("states", "x", states, "states (rows of `A`)");
        let inputs_named = name("inputs", "u", inputs, "inputs (columns of `B`)");
        let outputs_named = name("outputs", "y", outputs, "outputs (rows of `C`)");
        let in_order = |mut mistakes: Vec<Diagnostic>| {
            mistakes.sort_by_key(|mistake| mistake.labels.first().map_or(usize::MAX, |label| label.place.span().start));
            mistakes
        };
        let (Some(n), Some(Some(a)), true) = (states, a, mistakes.is_empty()) else { return Err(in_order(mistakes)) };
        let (m, p) = (inputs.unwrap_or(0), outputs.unwrap_or(0));
        let or = |matrix: Option<Option<Option<Matrix<Rational>>>>, rows, columns| {
            matrix.flatten().flatten().unwrap_or_else(|| Matrix::zeros(rows, columns))
        };
        Ok(LinearSystem {
            states: states_named,
            inputs: inputs_named,
            outputs: outputs_named,
            e: e.flatten().flatten().unwrap_or_else(|| Matrix::identity(n)),
            a: a.matrix,
            b: or(b, n, m),
            c: or(c, p, n),
            d: or(d, p, m),
            degrees_of_freedom: None,
        })
    }
}

fn size(matrix: &Matrix<Rational>) -> String {
    format!("{}×{}", matrix.rows(), matrix.columns())
}

fn square(e: Found, states: Option<usize>, mistakes: &mut Vec<Diagnostic>) -> Option<Matrix<Rational>> {
    let (rows, columns) = (e.matrix.rows(), e.matrix.columns());
    if rows != columns || states.is_some_and(|n| n != rows) {
        let expected = match states {
            Some(n) => format!("it must be {n}×{n} as `A` is"),
            None => "it must be square".into(),
        };
        let mistake = Diagnostic::error("state-space::shape", format!("`E` is {}, but {expected}", size(&e.matrix)));
        mistakes.push(place(mistake, &e.span).help("leave `E` out if it is the identity"));
        return None;
    }
    let rank = exact_rank(&e.matrix);
    if rank < rows {
        let message = format!(
            "`E` is singular (rank {rank} of {rows}): this is a descriptor system with algebraic equations, which is not \
             accepted"
        );
        let mistake = Diagnostic::error("state-space::singular", message);
        mistakes.push(place(mistake, &e.span).help(
            "solve the algebraic equations for some of the states and give what remains, with a regular `E` or without one",
        ));
        return None;
    }
    Some(e.matrix)
}

fn column(b: Found, states: Option<usize>, mistakes: &mut Vec<Diagnostic>) -> Option<Matrix<Rational>> {
    if b.matrix.rows() == 0 || b.matrix.columns() == 0 {
        return Some(Matrix::zeros(states.unwrap_or(0), 0));
    }
    let n = states?;
    if b.matrix.rows() == n && !(b.list && n != 1) {
        return Some(b.matrix);
    }
    if b.matrix.rows() == 1 && b.matrix.columns() == n {
        return Some(b.matrix.transpose());
    }
    let message = format!("`B` is {}, but it needs {n} rows, one per state (`A` is {n}×{n})", shape(&b));
    let turned = b.matrix.columns() == n;
    mistakes.push(place(Diagnostic::error("state-space::shape", message), &b.span).help(if turned {
        "is it transposed? a column belongs to an input"
    } else {
        "give one row per state and one column per input"
    }));
    None
}

fn row(c: Found, states: Option<usize>, mistakes: &mut Vec<Diagnostic>) -> Option<Matrix<Rational>> {
    if c.matrix.rows() == 0 || c.matrix.columns() == 0 {
        return Some(Matrix::zeros(0, states.unwrap_or(0)));
    }
    let n = states?;
    if c.matrix.columns() == n {
        return Some(c.matrix);
    }
    if c.matrix.columns() == 1 && c.matrix.rows() == n {
        return Some(c.matrix.transpose());
    }
    let message = format!("`C` is {}, but it needs {n} columns, one per state (`A` is {n}×{n})", shape(&c));
    let turned = c.matrix.rows() == n;
    mistakes.push(place(Diagnostic::error("state-space::shape", message), &c.span).help(if turned {
        "is it transposed? a row belongs to an output"
    } else {
        "give one row per output and one column per state"
    }));
    None
}

fn shape(found: &Found) -> String {
    if found.list { format!("a list of {} numbers", found.matrix.columns()) } else { size(&found.matrix) }
}

fn feedthrough(
    d: Found,
    outputs: Option<usize>,
    inputs: Option<usize>,
    mistakes: &mut Vec<Diagnostic>,
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
    mistakes.push(
        place(Diagnostic::error("state-space::shape", message), &d.span)
            .help("leave `D` out if there is no feedthrough"),
    );
    None
}

fn checked_names(
    key: &str,
    given: Names,
    count: Option<usize>,
    what: &str,
    mistakes: &mut Vec<Diagnostic>,
) -> Vec<String> {
    let Names { names, spans, span } = given;
    if let Some(count) = count
        && names.len() != count
    {
        let message = format!("`{key}` has {} names for {count} {what}", names.len());
        mistakes.push(
            place(Diagnostic::error("state-space::names", message), &span).help("give one name each, or leave it out"),
        );
    }
    let mut first = BTreeMap::new();
    for (i, name) in names.iter().enumerate() {
        let span = spans.get(i).cloned();
        let mut complain = |message, help: &str| {
            mistakes.push(place(Diagnostic::error("state-space::names", message), &span).help(help));
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

// ---------------------------------------------------------------------------------------------------------------- MAT

/// A variable or a field with its name.
type Part<'a> = (String, Array<&'a [u8]>);

fn read_mat(bytes: &[u8]) -> Result<LinearSystem, Vec<Diagnostic>> {
    let broken = |broken| {
        vec![match broken {
            Broken::Damaged(what) => Diagnostic::error("mat::damaged", format!("the MAT file is damaged: {what}"))
                .help("was it copied completely and as binary? write it again with `save -v7 FILE A B C D`"),
            Broken::TooLarge(what) => Diagnostic::error("mat::too-large", format!("the MAT file is too large: {what}"))
                .help("save only the matrices of the system: `save -v7 FILE A B C D`"),
            Broken::Log(error) => Diagnostic::error("mat::damaged", error.to_string()),
        }]
    };
    let file = MatFile::open(bytes).map_err(broken)?;
    let arrays = file.arrays().map_err(broken)?;
    let mut mistakes = Vec::new();
    let has_a = |arrays: &[Part<'_>]| arrays.iter().any(|(name, _)| name == "A");
    let variables: Vec<Part<'_>> = arrays.into_iter().map(|array| (array.name.clone(), array)).collect();
    if has_a(&variables) {
        return mat_parts(&variables, "", &mut mistakes).system(mistakes);
    }
    let systems: Vec<(&str, &[Part<'_>])> = variables
        .iter()
        .filter_map(|(name, array)| match &array.content {
            Content::Struct(fields) if has_a(fields) => Some((name.as_str(), fields.as_slice())),
            _ => None,
        })
        .collect();
    match systems[..] {
        [(name, fields)] => {
            if let Some(key) = SAMPLE_TIMES.iter().find(|key| {
                let field = fields.iter().find(|(name, _)| name == *key);
                field.is_some_and(|(_, array)| match &array.content {
                    Content::Full(numbers) if numbers.count() == 1 => numbers.value(0).map(exact) != Ok(Rational::ZERO),
                    _ => false,
                })
            }) {
                mistakes.push(discrete(&format!("{name}.{key}")));
            }
            mat_parts(fields, &format!("{name}."), &mut mistakes).system(mistakes)
        }
        [] => {
            let names = quoted(variables.iter().map(|(name, _)| name.as_str()));
            let there = if variables.is_empty() { "nothing".into() } else { format!("only {names}") };
            let message = format!("there is no matrix `A` and no structure with a field `A` in the file, {there}");
            let object = variables.iter().find(|(_, array)| matches!(array.content, Content::Other("a MATLAB object")));
            let help = match object {
                Some((name, _)) => {
                    format!("take the matrices out of the object: [A, B, C, D] = ssdata({name}); save -v7 FILE A B C D")
                }
                None => "save the matrices under their names: `save -v7 FILE A B C D`".into(),
            };
            Err(vec![Diagnostic::error("state-space::missing", message).help(help)])
        }
        _ => {
            let names = quoted(systems.iter().map(|(name, _)| *name));
            let message = format!("the file holds more than one system: {names} have a field `A`");
            Err(vec![
                Diagnostic::error("state-space::ambiguous", message).help("save one of them: `save -v7 FILE sys`"),
            ])
        }
    }
}

fn discrete(key: &str) -> Diagnostic {
    let message = format!("`{key}` gives a sample time: this is a discrete-time system, which is not accepted");
    Diagnostic::error("state-space::discrete", message)
        .help("give the continuous-time system (d2c), or leave the key out")
}

fn mat_parts(fields: &[Part<'_>], prefix: &str, mistakes: &mut Vec<Diagnostic>) -> Parts {
    let mut parts = Parts::default();
    for (name, array) in fields {
        if let Some(key) = MATRICES.iter().find(|key| *key == name) {
            parts.matrices.insert(key, mat_matrix(&format!("{prefix}{name}"), array, mistakes));
        } else if let Some(key) = NAMES.iter().find(|key| *key == name) {
            let names = mat_names(array);
            if names.is_none() {
                let message = format!("`{prefix}{name}` is no list of names");
                mistakes.push(
                    Diagnostic::error("state-space::names", message).help("give a cell array of texts: {'a', 'b'}"),
                );
            }
            parts.names.insert(key, names.map(|names| Names { names, spans: Vec::new(), span: None }));
        }
    }
    parts
}

fn mat_matrix(name: &str, array: &Array<&[u8]>, mistakes: &mut Vec<Diagnostic>) -> Option<Found> {
    let mut refuse = |code, message: String, help: &str| {
        mistakes.push(Diagnostic::error(code, message).help(help));
        None
    };
    let what = match &array.content {
        Content::Full(_) | Content::Sparse { .. } => None,
        Content::Text(_) => Some("a text"),
        Content::Struct(_) => Some("a structure"),
        Content::Cell(_) => Some("a cell array"),
        Content::Structs(_) => Some("an array of structures"),
        Content::Other(what) => Some(*what),
    };
    if let Some(what) = what {
        return refuse(
            "state-space::type",
            format!("`{name}` is {what}, not a matrix of numbers"),
            "save it as a matrix",
        );
    }
    let [rows, columns] = array.dimensions[..] else {
        let sizes: Vec<String> = array.dimensions.iter().map(usize::to_string).collect();
        let message = format!("`{name}` is an array of size {}, not a matrix", sizes.join("×"));
        return refuse("state-space::type", message, "give a matrix of two dimensions");
    };
    if rows > MOST || columns > MOST {
        let message = format!("`{name}` is {rows}×{columns}: at most {MOST} states, inputs or outputs are accepted");
        return refuse("state-space::too-large", message, "exact answers of larger systems would take too long");
    }
    if array.complex {
        let message = format!("`{name}` is complex; the equations of a system have real coefficients");
        return refuse("state-space::complex", message, "save the real part if the imaginary part is zero: real(A)");
    }
    let mut matrix = Matrix::<Rational>::zeros(rows, columns);
    let mut bad = Vec::new();
    match &array.content {
        Content::Full(numbers) => {
            for (i, j) in (0..columns).flat_map(|j| (0..rows).map(move |i| (i, j))) {
                match numbers.value(j * rows + i) {
                    Ok(value) => matrix[(i, j)] = exact(value),
                    Err(what) => bad.push((i, j, what)),
                }
            }
        }
        Content::Sparse { rows, starts, values } => {
            for j in 0..columns {
                for k in starts[j]..starts[j + 1] {
                    match values.value(k) {
                        Ok(value) => matrix[(rows[k], j)] = matrix[(rows[k], j)].plus(&exact(value)),
                        Err(what) => bad.push((rows[k], j, what)),
                    }
                }
            }
        }
        _ => unreachable!("told above"),
    }
    if bad.is_empty() {
        return Some(Found { matrix, list: false, span: None });
    }
    for (i, j, what) in bad.iter().take(TOLD) {
        let message = format!("`{name}({}, {})` is {what}, not a finite number", i + 1, j + 1);
        mistakes
            .push(Diagnostic::error("number::not-finite", message).help("every coefficient must be a finite number"));
    }
    more(name, bad.len(), None, mistakes);
    None
}

/// The exact value of a stored number.
fn exact(stored: Stored) -> Rational {
    match stored {
        Stored::Unsigned(number) => Rational::from(number),
        Stored::Signed(number) => Rational::from(number),
        Stored::Float(number) => rational_from_f64(number).unwrap_or(Rational::ZERO),
    }
}

/// Says how many mistakes are not told one by one.
fn more(name: &str, count: usize, span: Option<&Range<usize>>, mistakes: &mut Vec<Diagnostic>) {
    if count > TOLD {
        let message = format!("`{name}` has {} more entries that are no finite numbers", count - TOLD);
        let mistake = Diagnostic::error("state-space::entry", message).help("correct the entries that are told first");
        mistakes.push(place(mistake, &span.cloned()));
    }
}

/// Names from a cell array of texts, or from the rows of a text.
fn mat_names(array: &Array<&[u8]>) -> Option<Vec<String>> {
    match &array.content {
        Content::Cell(cells) => cells
            .iter()
            .map(|cell| match &cell.content {
                Content::Text(letters) => Some(letters.iter().collect()),
                Content::Other("nothing") => Some(String::new()),
                _ => None,
            })
            .collect(),
        Content::Text(letters) => {
            let rows = *array.dimensions.first()?;
            let row = |i: usize| letters.iter().skip(i).step_by(rows.max(1)).collect::<String>();
            (rows <= MOST).then(|| (0..rows).map(|i| row(i).trim_end().to_string()).collect())
        }
        Content::Full(numbers) if numbers.count() == 0 => Some(Vec::new()),
        _ => None,
    }
}

// --------------------------------------------------------------------------------------------------------------- JSON

fn read_json(text: &str) -> Result<LinearSystem, Vec<Diagnostic>> {
    // Checks the syntax and keeps numbers as they are written; no depth is too deep for it.
    if let Err(error) = serde_json::from_str::<&RawValue>(text) {
        return Err(vec![syntax(text, &error)]);
    }
    let json = Json { text };
    let whole = json.trimmed(0..text.len());
    if json.kind(&whole) != "an object" {
        let message = format!("expected an object with the matrix `A`, found {}", json.kind(&whole));
        let shown = whole.start..(whole.start + 1);
        return Err(vec![
            Diagnostic::error("state-space::type", message)
                .at(shown, "here")
                .help("write {\"A\": [[0, 1], [-2, -3]], \"B\": [0, 1], \"C\": [1, 0]}"),
        ]);
    }
    let mut mistakes = Vec::new();
    let mut parts = Parts::default();
    let mut seen: BTreeMap<String, Range<usize>> = BTreeMap::new();
    let mut unknown = 0;
    for (key_span, value) in json.members(&whole) {
        let key = json.string(&key_span);
        if let Some(first) = seen.get(&key) {
            let message = format!("`{}` is given twice", shortened(&key));
            mistakes.push(
                Diagnostic::error("state-space::duplicate", message)
                    .at(key_span, "again here")
                    .at(first.clone(), "first here")
                    .help("keep one of them"),
            );
            continue;
        }
        seen.insert(key.clone(), key_span.clone());
        if let Some(name) = MATRICES.iter().find(|name| **name == key) {
            parts.matrices.insert(name, json.matrix(name, &value, &mut mistakes));
        } else if let Some(name) = NAMES.iter().find(|name| **name == key) {
            parts.names.insert(name, json.names(name, &value, &mut mistakes));
        } else if SAMPLE_TIMES.contains(&key.as_str()) {
            let zero = parse_number(&text[value.clone()]).is_ok_and(|number| number.is_zero());
            if !zero && json.kind(&value) != "null" {
                mistakes.push(discrete(&key).at(key_span, "here"));
            }
        } else if !matches!(key.as_str(), "name" | "description") {
            unknown += 1;
            if unknown <= TOLD {
                let keys = || MATRICES.into_iter().chain(NAMES).chain(["name", "description"]);
                let help = match nearest(&key, keys()) {
                    Some(near) => format!("did you mean `{near}`?"),
                    None => format!("known keys: {}", quoted(keys())),
                };
                let message = format!("unknown key `{}`", shortened(&key));
                mistakes.push(Diagnostic::error("state-space::unknown", message).at(key_span, "here").help(help));
            }
        }
    }
    parts.system(mistakes)
}

fn syntax(text: &str, error: &serde_json::Error) -> Diagnostic {
    let start = text.split_inclusive('\n').take(error.line().saturating_sub(1)).map(str::len).sum::<usize>();
    let at = text.floor_char_boundary((start + error.column().saturating_sub(1)).min(text.len()));
    let end = (at..=text.len()).skip(1).find(|end| text.is_char_boundary(*end)).unwrap_or(at);
    let what = error.to_string();
    let what = what.split(" at line ").next().unwrap_or_default();
    // serde_json stops behind the first letter of a word that JSON does not know.
    let word_start = text[..at].trim_end_matches(|c: char| c.is_ascii_alphabetic()).len();
    let help = if ["NaN", "nan", "Inf", "inf"].iter().any(|word| text[word_start..].starts_with(word)) {
        "NaN and Infinity are no numbers of JSON, and no coefficients of a system"
    } else {
        "write JSON such as {\"A\": [[0, 1], [-2, -3]], \"B\": [0, 1], \"C\": [1, 0]}, or give a MAT file"
    };
    // Columns of characters, as they are told everywhere; serde_json counts bytes.
    let (line, column) = Lines::new(text).line_column(text, at);
    let message = format!("this is no JSON: {what} (line {line}, column {column})");
    Diagnostic::error("json::syntax", message).at(at..end, "here").help(help)
}

/// Finds its way in a text that is known to be JSON.
struct Json<'a> {
    text: &'a str,
}

impl Json<'_> {
    fn kind(&self, value: &Range<usize>) -> &'static str {
        match self.text.as_bytes().get(value.start) {
            Some(b'{') => "an object",
            Some(b'[') => "a list",
            Some(b'"') => "a text",
            Some(b't' | b'f') => "a truth value",
            Some(b'n') => "null",
            _ => "a number",
        }
    }

    fn trimmed(&self, span: Range<usize>) -> Range<usize> {
        let inside = &self.text[span.clone()];
        let start = span.start + (inside.len() - inside.trim_start().len());
        start..start + inside.trim().len()
    }

    /// The end of the value that starts at `at`.
    fn end(&self, at: usize) -> usize {
        let bytes = self.text.as_bytes();
        let (mut depth, mut i) = (0usize, at);
        while i < bytes.len() {
            match bytes[i] {
                b'"' => {
                    i += 1;
                    while i < bytes.len() && bytes[i] != b'"' {
                        i += if bytes[i] == b'\\' { 2 } else { 1 };
                    }
                }
                b'[' | b'{' => depth += 1,
                b']' | b'}' => {
                    if depth == 0 {
                        return i; // closes what contains a number
                    }
                    depth -= 1;
                }
                b',' | b':' | b' ' | b'\n' | b'\r' | b'\t' if depth == 0 => return i,
                _ => {
                    i += 1;
                    continue;
                }
            }
            i += 1;
            if depth == 0 {
                return i.min(bytes.len());
            }
        }
        bytes.len()
    }

    /// The values of a list or of an object; in an object, keys and values in turn.
    fn items(&self, list: &Range<usize>) -> Vec<Range<usize>> {
        let bytes = self.text.as_bytes();
        let mut out = Vec::new();
        let (mut i, last) = (list.start + 1, list.end.saturating_sub(1));
        while i < last {
            if matches!(bytes[i], b',' | b':' | b' ' | b'\n' | b'\r' | b'\t') {
                i += 1;
            } else {
                let end = self.end(i).max(i + 1);
                out.push(i..end);
                i = end;
            }
        }
        out
    }

    fn members(&self, object: &Range<usize>) -> Vec<(Range<usize>, Range<usize>)> {
        self.items(object).chunks_exact(2).map(|pair| (pair[0].clone(), pair[1].clone())).collect()
    }

    fn string(&self, span: &Range<usize>) -> String {
        let raw = &self.text[span.clone()];
        // An escaped half of a surrogate pair is the one text that is JSON and cannot be decoded.
        serde_json::from_str(raw).unwrap_or_else(|_| raw.trim_matches('"').to_string())
    }

    fn matrix(&self, name: &str, value: &Range<usize>, mistakes: &mut Vec<Diagnostic>) -> Option<Found> {
        let mut refuse = |code, message: String, span: &Range<usize>, help: &str| {
            mistakes.push(Diagnostic::error(code, message).at(span.clone(), "").help(help));
            None
        };
        let head = |span: &Range<usize>| match self.kind(span) {
            "a list" | "an object" => span.start..span.start + 1,
            _ => span.clone(),
        };
        let rows = match self.kind(value) {
            "a list" => self.items(value),
            "a number" | "a text" => vec![value.clone()],
            kind => {
                let message = format!("`{name}` is {kind}, not a matrix");
                return refuse(
                    "state-space::type",
                    message,
                    &head(value),
                    "write one list per row: [[0, 1], [-2, -3]]",
                );
            }
        };
        let lists = rows.iter().filter(|row| self.kind(row) == "a list").count();
        if lists == 0 {
            // One row, or a list of numbers; the caller of `Found` knows what is meant.
            self.wide(name, rows.len(), value, mistakes)?;
            let list = self.kind(value) == "a list" && !rows.is_empty();
            let columns = rows.len();
            let entries = self.entries(name, &[rows], value, list, mistakes)?;
            let height = usize::from(columns > 0);
            let matrix = Matrix::from_fn(height, columns, |_, j| entries[j].clone());
            return Some(Found { matrix, list, span: Some(head(value)) });
        }
        if lists < rows.len() {
            let (number, row) = rows.iter().enumerate().find(|(_, row)| self.kind(row) != "a list")?;
            let message = format!("row {} of `{name}` is {}, not a list of numbers", number + 1, self.kind(row));
            return refuse("state-space::type", message, &head(row), "write one list per row: [[0, 1], [-2, -3]]");
        }
        self.wide(name, rows.len(), value, mistakes)?;
        let cells: Vec<Vec<Range<usize>>> = rows.iter().map(|row| self.items(row)).collect();
        let columns = cells[0].len();
        let ragged: Vec<usize> = (1..rows.len()).filter(|i| cells[*i].len() != columns).collect();
        for i in ragged.iter().take(TOLD) {
            let message = format!(
                "row {} of `{name}` has {} entries, but row 1 has {columns}: all rows must be equally long",
                i + 1,
                cells[*i].len()
            );
            mistakes.push(
                Diagnostic::error("state-space::ragged", message)
                    .at(head(&rows[*i]), "this row")
                    .at(head(&rows[0]), "row 1")
                    .help("is a comma or an entry missing?"),
            );
        }
        if !ragged.is_empty() {
            return None;
        }
        self.wide(name, columns, value, mistakes)?;
        let entries = self.entries(name, &cells, value, false, mistakes)?;
        let matrix = Matrix::from_fn(rows.len(), columns, |i, j| entries[i * columns + j].clone());
        Some(Found { matrix, list: false, span: Some(head(value)) })
    }

    /// Complains about too many rows or columns.
    fn wide(&self, name: &str, count: usize, value: &Range<usize>, mistakes: &mut Vec<Diagnostic>) -> Option<()> {
        if count <= MOST {
            return Some(());
        }
        let message =
            format!("`{name}` has {count} rows or columns: at most {MOST} states, inputs or outputs are accepted");
        mistakes.push(
            Diagnostic::error("state-space::too-large", message)
                .at(value.start..value.start + 1, "")
                .help("exact answers of larger systems would take too long"),
        );
        None
    }

    /// All entries row by row, unless one of them is no number.
    fn entries(
        &self,
        name: &str,
        rows: &[Vec<Range<usize>>],
        value: &Range<usize>,
        list: bool,
        mistakes: &mut Vec<Diagnostic>,
    ) -> Option<Vec<Rational>> {
        let mut out = Vec::with_capacity(rows.iter().map(Vec::len).sum());
        let mut bad = 0;
        for (i, row) in rows.iter().enumerate() {
            for (j, span) in row.iter().enumerate() {
                match self.entry(span) {
                    Ok(number) => out.push(number),
                    Err((code, reason, help)) => {
                        bad += 1;
                        if bad <= TOLD {
                            let place = match self.kind(value) {
                                "a list" if list => format!("entry {} of `{name}`", j + 1),
                                "a list" => format!("entry {} of row {} of `{name}`", j + 1, i + 1),
                                _ => format!("`{name}`"),
                            };
                            let span = match self.kind(span) {
                                "a list" | "an object" => span.start..span.start + 1,
                                _ => span.clone(),
                            };
                            mistakes.push(
                                Diagnostic::error(code, format!("{place}: {reason}")).at(span, "here").help(help),
                            );
                        }
                    }
                }
            }
        }
        more(name, bad, Some(&(value.start..value.start + 1)), mistakes);
        (bad == 0).then_some(out)
    }

    fn entry(&self, span: &Range<usize>) -> Result<Rational, (&'static str, String, String)> {
        let text = match self.kind(span) {
            "a number" => self.text[span.clone()].to_string(),
            "a text" => self.string(span),
            "null" => {
                let reason = "null is not a number (NaN and Infinity are often saved as null)".to_string();
                return Err(("number::not-finite", reason, "every coefficient must be a finite number".into()));
            }
            kind => {
                let help = "write a number or a text such as \"1/3\"".into();
                return Err(("state-space::entry", format!("{kind} is not a number"), help));
            }
        };
        let number = parse_number(&text).map_err(|error| {
            let help = error.help.unwrap_or_else(|| "write a number or a text such as \"1/3\"".into());
            (error.code, error.message, help)
        })?;
        if number.pi != 0 {
            let reason = format!("`{}` has a factor π and is no rational number", shortened(&text));
            let help = "write it as a decimal with as many digits as you mean".into();
            return Err(("state-space::irrational", reason, help));
        }
        Ok(number.rational)
    }

    fn names(&self, key: &str, value: &Range<usize>, mistakes: &mut Vec<Diagnostic>) -> Option<Names> {
        let mut refuse = |message: String, span: Range<usize>| {
            let help = format!("write a list of texts: \"{key}\": [\"a\", \"b\"]");
            mistakes.push(Diagnostic::error("state-space::names", message).at(span, "here").help(help));
        };
        let start = value.start..value.start + 1;
        if self.kind(value) != "a list" {
            refuse(format!("`{key}` is {}, not a list of names", self.kind(value)), start);
            return None;
        }
        let spans = self.items(value);
        if spans.len() > MOST {
            refuse(format!("`{key}` has {} names: at most {MOST} are accepted", spans.len()), start);
            return None;
        }
        let bad = spans.iter().enumerate().find(|(_, span)| self.kind(span) != "a text");
        if let Some((i, span)) = bad {
            refuse(format!("name {} of `{key}` is {}, not a text", i + 1, self.kind(span)), span.start..span.start + 1);
            return None;
        }
        Some(Names { names: spans.iter().map(|span| self.string(span)).collect(), spans, span: Some(start) })
    }
}
