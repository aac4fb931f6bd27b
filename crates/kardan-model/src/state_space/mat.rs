//! A system in a MAT file.

use kardan_tables::read::mat5::{Array, Broken, Content, MatFile, Stored};

use super::parsed::{
    LastDigits, MATRICES, MAX_REPORTED, MOST, NAMES, ParsedMatrix, ParsedNames, ParsedSystem, SAMPLE_TIMES, discrete,
    more, sampled,
};
use super::system::StateSpace;
use kardan_math::num::{Matrix, Rational, Scalar, rational_from_f64};
use kardan_schema::diagnostics::{Diagnostic, quoted};

/// A variable or a field with its name.
type Part<'a> = (String, Array<&'a [u8]>);

/// Reads the variables, or the fields of the one structure that has an `A`.
pub(super) fn read_mat(bytes: &[u8]) -> Result<StateSpace, Vec<Diagnostic>> {
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
    let mut diagnostics = Vec::new();
    let has_a = |arrays: &[Part<'_>]| arrays.iter().any(|(name, _)| name == "A");
    let variables: Vec<Part<'_>> = arrays.into_iter().map(|array| (array.name.clone(), array)).collect();
    if has_a(&variables) {
        return parsed(&variables, "", &mut diagnostics).system(diagnostics);
    }
    let systems: Vec<(&str, &[Part<'_>])> = variables
        .iter()
        .filter_map(|(name, array)| match &array.content {
            Content::Struct(fields) if has_a(fields) => Some((name.as_str(), fields.as_slice())),
            _ => None,
        })
        .collect();
    match systems[..] {
        [(name, fields)] => parsed(fields, &format!("{name}."), &mut diagnostics).system(diagnostics),
        [] => {
            let names = quoted(variables.iter().map(|(name, _)| name.as_str()));
            let contents = if variables.is_empty() { "nothing".into() } else { format!("only {names}") };
            let message = format!("there is no matrix `A` and no structure with a field `A` in the file, {contents}");
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
            let message = format!("the file contains more than one system: {names} have a field `A`");
            Err(vec![
                Diagnostic::error("state-space::ambiguous", message).help("save one of them: `save -v7 FILE sys`"),
            ])
        }
    }
}

fn parsed(fields: &[Part<'_>], prefix: &str, diagnostics: &mut Vec<Diagnostic>) -> ParsedSystem {
    let mut parsed = ParsedSystem::default();
    for (name, array) in fields {
        if let Some(key) = MATRICES.iter().find(|key| *key == name) {
            parsed.matrices.insert(key, matrix(&format!("{prefix}{name}"), array, diagnostics));
        } else if let Some(key) = NAMES.iter().find(|key| *key == name) {
            let names = names(array);
            if names.is_none() {
                let message = format!("`{prefix}{name}` is no list of names");
                diagnostics.push(
                    Diagnostic::error("state-space::names", message).help("give a cell array of texts: {'a', 'b'}"),
                );
            }
            parsed.names.insert(key, names.map(|names| ParsedNames { names, spans: Vec::new(), span: None }));
        } else if SAMPLE_TIMES.contains(&name.as_str()) {
            let time = match &array.content {
                Content::Full(numbers) if numbers.count() == 1 => {
                    numbers.value(0).ok().map(|time| sampled(exact(time)))
                }
                Content::Full(numbers) if numbers.count() == 0 => Some(Ok(None)),
                _ => None,
            };
            match time {
                Some(Ok(time)) => parsed.sample_time = time,
                _ => diagnostics.push(discrete(&format!("{prefix}{name}"))),
            }
        }
    }
    parsed
}

fn matrix(name: &str, array: &Array<&[u8]>, diagnostics: &mut Vec<Diagnostic>) -> Option<ParsedMatrix> {
    let mut refuse = |code, message: String, help: &str| {
        diagnostics.push(Diagnostic::error(code, message).help(help));
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
        _ => unreachable!("reported above"),
    }
    if bad.is_empty() {
        let mut digits = LastDigits::default();
        matrix.as_slice().iter().for_each(|value| digits.add_binary(value));
        return Some(ParsedMatrix { matrix, digits, list: false, span: None });
    }
    for (i, j, what) in bad.iter().take(MAX_REPORTED) {
        let message = format!("`{name}({}, {})` is {what}, not a finite number", i + 1, j + 1);
        diagnostics
            .push(Diagnostic::error("number::not-finite", message).help("every coefficient must be a finite number"));
    }
    more(name, bad.len(), None, diagnostics);
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

/// GivenNames from a cell array of texts, or from the rows of a text.
fn names(array: &Array<&[u8]>) -> Option<Vec<String>> {
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
