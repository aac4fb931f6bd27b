//! Parameters that vary together: `[[sweep.correlated]]`, with a matrix that is proven to be a correlation matrix before any draw.

use std::str;

use super::distribution::Distribution;
use super::varied::{Varied, add, parameter};
use crate::study::measure::requirement_verdict::in_digits;
use crate::study::read::read_values::{key_error, read_word};
use kardan_math::num::{Definiteness, Matrix, Rational, Scalar, definiteness, rational_from_f64, rational_to_f64};
use kardan_math::units::parse_number;
use kardan_model::Document;
use kardan_schema::diagnostics::{Diagnostic, shortened};
use kardan_schema::schema::Table;

/// Most parameters of one matrix: the decision uses exact fractions.
const MOST_CORRELATED: usize = 40;
/// Permitted rounding of the numbers of a file: this fraction is added to its variances if they are no covariance without it.
const ROUNDED: f64 = 1e-12;
/// Most listed partners of a parameter.
const MAX_LISTED: usize = 5;

/// Parameters that vary together, and the matrix that computes their scores from independent ones.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::study) struct CorrelatedGroup {
    /// Their numbers among all varied parameters.
    pub members: Vec<usize>,
    /// Lower triangle F, rows of length one: `F Fᵀ` are the correlations.
    pub factor: Matrix<f64>,
}

/// A matrix with the moments of its rows, SI.
struct CorrelationSpec {
    names: Vec<String>,
    /// Means and standard deviations; none for correlations only.
    moments: Option<Vec<(Option<f64>, f64)>>,
    matrix: Matrix<Rational>,
}

/// Reads all of them; a normal distribution of a file replaces a tolerance.
pub(in crate::study) fn correlated(
    document: &Document,
    varied: &mut Vec<Varied>,
    tolerances: bool,
    out: &mut Vec<Diagnostic>,
) -> Vec<CorrelatedGroup> {
    let mut found: Vec<CorrelatedGroup> = Vec::new();
    for (number, table) in document.sweep.tables("correlated").iter().enumerate() {
        let what = format!("entry {} of `[[sweep.correlated]]`", number + 1);
        let before = out.len();
        // Duplicate names were reported.
        if table.unread.contains(&"parameters") {
            continue;
        }
        let correlation = match correlation(document, table) {
            Ok(found) => found,
            Err((key, message, help)) => {
                out.push(key_error("sweep::correlation", format!("{what}: {message}"), (table, key, "here"), help));
                continue;
            }
        };
        let Some(factor) = decided(&correlation, table, &what, out) else { continue };
        if let Some(moments) = &correlation.moments {
            for (name, (mean, deviation)) in correlation.names.iter().zip(moments) {
                let Some(parameter) = parameter(document, name, (table.place_of("file"), &what), out) else { continue };
                let mean = mean.unwrap_or_else(|| parameter.value.to_f64());
                let distribution =
                    Distribution::Normal { mean, deviation: *deviation, from: f64::NEG_INFINITY, to: f64::INFINITY };
                let one = Varied::new(name, parameter.dimension, distribution);
                if tolerances {
                    varied.retain(|candidate| candidate.name != one.name);
                }
                add(varied, Some(one), table, out);
            }
        }
        let members: Vec<usize> =
            correlation.names.iter().filter_map(|name| member((varied, &found), name, (table, &what), out)).collect();
        if out.len() == before {
            describe_correlations(varied, &members, &factor);
            found.push(CorrelatedGroup { members, factor });
        }
    }
    found
}

/// The number of a varied parameter, if its values are ordered and no other matrix contains it.
fn member(
    (varied, groups): (&[Varied], &[CorrelatedGroup]),
    name: &str,
    (table, what): (&Table, &str),
    out: &mut Vec<Diagnostic>,
) -> Option<usize> {
    let mut refuse = |why: &str, help: &str| {
        let message = format!("{what}: `{}` {why}", shortened(name));
        let key = if table.values.contains_key("parameters") { "parameters" } else { "file" };
        out.push(key_error("sweep::correlation", message, (table, key, "here"), help));
        None
    };
    let Some(number) = varied.iter().position(|one| one.name == name) else {
        return refuse("does not vary", "vary it with `[[sweep.vary]]` or a tolerance, or remove it here");
    };
    if matches!(varied[number].distribution, Distribution::Listed(_)) {
        return refuse("is a list of values", "a correlation needs a distribution: `[[sweep.vary]]`");
    }
    if groups.iter().any(|group| group.members.contains(&number)) {
        return refuse("already varies together with other parameters", "write one matrix for all of them");
    }
    Some(number)
}

/// Appends its partners to the text of its distribution.
fn describe_correlations(varied: &mut [Varied], members: &[usize], factor: &Matrix<f64>) {
    let correlations = factor.multiply(&factor.transpose());
    for (i, member) in members.iter().enumerate() {
        let mut partners: Vec<(f64, usize)> = (0..members.len())
            .filter(|j| *j != i && correlations[(i, *j)].abs() > 5e-4)
            .map(|j| (correlations[(i, j)], members[j]))
            .collect();
        partners.sort_by(|a, b| b.0.abs().total_cmp(&a.0.abs()));
        let shown: Vec<String> = partners
            .iter()
            .take(MAX_LISTED)
            .map(|(c, other)| format!("{} with `{}`", in_digits((c * 1e3).round() / 1e3), varied[*other].name))
            .collect();
        if !shown.is_empty() {
            let more = if partners.len() > MAX_LISTED { ", ..." } else { "" };
            varied[*member].text += &format!("; correlation {}{more}", shown.join(", "));
        }
    }
}

/// Why a table has no matrix: the key, the message, and help.
type Refused = (&'static str, String, &'static str);

/// The matrix of a table, from either source.
fn correlation(document: &Document, table: &Table) -> Result<CorrelationSpec, Refused> {
    let names = table.plain_names("parameters");
    match (read_word(table, "correlation"), read_word(table, "file")) {
        (Some(_), Some(_)) => Err(("file", "the table has both `correlation` and `file`".into(), "remove one of them")),
        (None, None) => Err(("parameters", "the table has no matrix".into(), "write `correlation` or `file`")),
        (Some(_), None) if names.len() < 2 => {
            let help = "name them in the order of the matrix";
            Err(("parameters", "the table needs at least two parameters".into(), help))
        }
        (Some(text), None) => {
            let help = "write it row by row: \"1, 0.8; 0.8, 1\"";
            parse_matrix(text, names).map_err(|message| ("correlation", message, help))
        }
        (None, Some(file)) => {
            let bytes = match document.files.get(file) {
                Some(Ok(bytes)) => Ok(bytes),
                Some(Err(why)) => Err(why.clone()),
                None => Err(format!("the caller did not supply the file `{}`", shortened(file))),
            };
            let read = bytes.and_then(|bytes| {
                let text = str::from_utf8(bytes).map_err(|_| format!("`{}` is not a text file", shortened(file)))?;
                of_file(text, &names).map_err(|why| format!("`{}`: {why}", shortened(file)))
            });
            let help = "give the output of `kardan identify --json`, or {\"names\": [\"a.inertia\", \"b.inertia\"], \"covariance\": [[1, 0], [0, 1]]}";
            read.map_err(|message| ("file", message, help))
        }
    }
}

/// A matrix in a model file, in exact numbers.
fn parse_matrix(text: &str, names: Vec<String>) -> Result<CorrelationSpec, String> {
    let mut entries: Vec<Vec<Rational>> = Vec::new();
    for (i, row) in text.trim().trim_end_matches(';').split(';').enumerate() {
        let cells = row.split(|c: char| c == ',' || c.is_whitespace()).filter(|word| !word.is_empty());
        let number = |word: &str| {
            let read =
                parse_number(word).map_err(|_| format!("`{}` in row {} is not a number", shortened(word), i + 1));
            Ok(read?.to_rational())
        };
        entries.push(cells.map(number).collect::<Result<_, String>>()?);
    }
    let n = names.len();
    square(&entries, n)?;
    if let Some(i) = (0..n).find(|i| entries[*i][*i] != Rational::one()) {
        return Err(format!(
            "the correlation of `{}` with itself must be 1, not {}",
            shortened(&names[i]),
            rational_to_f64(&entries[i][i])
        ));
    }
    Ok(CorrelationSpec { names, moments: None, matrix: Matrix::from_fn(n, n, |i, j| entries[i][j].clone()) })
}

/// Reports a matrix that is not square, or not symmetric.
fn square(entries: &[Vec<Rational>], n: usize) -> Result<(), String> {
    if let Some((i, row)) = entries.iter().enumerate().find(|(_, row)| row.len() != n) {
        return Err(format!("row {} has {} entries for {n} parameters", i + 1, row.len()));
    }
    if entries.len() != n {
        return Err(format!("the matrix has {} rows for {n} parameters", entries.len()));
    }
    if n > MOST_CORRELATED {
        return Err(format!("{n} parameters exceed the limit of {MOST_CORRELATED}"));
    }
    for (i, j) in (0..n).flat_map(|i| (0..i).map(move |j| (i, j))) {
        if entries[i][j] != entries[j][i] {
            let [below, above] = [&entries[i][j], &entries[j][i]].map(rational_to_f64);
            return Err(format!(
                "it is not symmetric: {below} in row {}, column {}, and {above} in the transposed entry",
                i + 1,
                j + 1
            ));
        }
    }
    Ok(())
}

/// The matrix of a file: of an identification, or names with a covariance.
fn of_file(text: &str, chosen: &[String]) -> Result<CorrelationSpec, String> {
    use serde_json::Value as Json;
    let json: Json = serde_json::from_str(text).map_err(|error| format!("it is not valid JSON: {error}"))?;
    let texts = |of: &Json| -> Option<Vec<String>> {
        of.as_array()?.iter().map(|name| name.as_str().map(String::from)).collect()
    };
    let numbers = |of: &Json| -> Option<Vec<f64>> {
        of.as_array()?.iter().map(|x| x.as_f64().filter(|x| x.is_finite())).collect()
    };
    let rows = |of: &Json| -> Option<Vec<Vec<f64>>> { of.as_array()?.iter().map(numbers).collect() };
    let (names, matrix, moments) = if let Some(found) = json.get("correlation") {
        let names = found.get("names").and_then(texts).ok_or("`correlation` has no list `names`")?;
        let matrix = found.get("values").and_then(rows).ok_or("`correlation` has no rows of numbers `values`")?;
        let parameters = json.get("parameters").and_then(Json::as_array).ok_or("it has no list `parameters`")?;
        let of = |name: &String| {
            let one = parameters.iter().find(|one| one.get("name").and_then(Json::as_str) == Some(name))?;
            let number = |key: &str| one.get(key).and_then(Json::as_f64).filter(|x| x.is_finite());
            Some((number("value"), number("standard_error")?))
        };
        (names.clone(), matrix, names.iter().map(of).collect::<Vec<_>>())
    } else {
        let names = json.get("names").and_then(texts).ok_or("it has no list `names`, and no `correlation`")?;
        let matrix = json.get("covariance").and_then(rows).ok_or("it has no rows of numbers `covariance`")?;
        let means = match json.get("means") {
            Some(means) => Some(
                numbers(means)
                    .filter(|means| means.len() == names.len())
                    .ok_or("`means` and `names` have different lengths")?,
            ),
            None => None,
        };
        let deviation = |k: usize| matrix.get(k).and_then(|row| row.get(k)).map(|variance| variance.sqrt());
        let of = |k: usize| Some((means.as_ref().map(|means| means[k]), deviation(k)?));
        (names.clone(), matrix.clone(), (0..names.len()).map(of).collect())
    };
    if names.is_empty() {
        return Err("its `names` are empty: name the varied parameters in the order of its matrix".into());
    }
    if let Some((_, name)) = names.iter().enumerate().find(|(k, name)| names[..*k].contains(name)) {
        return Err(format!(
            "its `names` contain `{}` more than once: remove one, with its row and its column",
            shortened(name)
        ));
    }
    let exact: Vec<Vec<Rational>> =
        matrix.iter().map(|row| row.iter().map(|x| rational_from_f64(*x).unwrap_or_default()).collect()).collect();
    let chosen_names: Vec<String> = if chosen.is_empty() { names.clone() } else { chosen.to_vec() };
    let place = |name: &String| {
        names.iter().position(|candidate| candidate == name).ok_or_else(|| format!("it has no `{}`", shortened(name)))
    };
    let places: Vec<usize> = chosen_names.iter().map(place).collect::<Result<_, _>>()?;
    if let Some(row) = exact.iter().find(|row| row.len() != names.len()).or(exact.get(names.len())) {
        return Err(format!(
            "its matrix is not square: {} names, {} rows, one of {} numbers",
            names.len(),
            exact.len(),
            row.len()
        ));
    }
    if exact.len() != names.len() {
        return Err(format!("its matrix is not square: {} names, {} rows", names.len(), exact.len()));
    }
    let own: Vec<Vec<Rational>> =
        places.iter().map(|i| places.iter().map(|j| exact[*i][*j].clone()).collect()).collect();
    square(&own, places.len())?;
    let moments = places.iter().zip(&chosen_names).map(|(k, name)| match moments[*k] {
        Some((mean, deviation)) if deviation > 0.0 => Ok((mean, deviation)),
        _ => Err(format!(
            "`{}` has no standard deviation above zero: it was not determined, or does not vary",
            shortened(name)
        )),
    });
    let moments = moments.collect::<Result<Vec<_>, String>>()?;
    let n = places.len();
    Ok(CorrelationSpec {
        names: chosen_names,
        moments: Some(moments),
        matrix: Matrix::from_fn(n, n, |i, j| own[i][j].clone()),
    })
}

/// The factor of a positive semidefinite matrix, decided with exact fractions; otherwise a direction in which it is not.
fn decided(correlation: &CorrelationSpec, table: &Table, what: &str, out: &mut Vec<Diagnostic>) -> Option<Matrix<f64>> {
    let n = correlation.names.len();
    let mut matrix = correlation.matrix.clone();
    let mut verdict = definiteness(&matrix);
    if let (Definiteness::Indefinite { .. }, true) = (&verdict, correlation.moments.is_some()) {
        // A rounded matrix of a file is certainly semidefinite with this addition on its diagonal.
        let more = Rational::one().plus(&rational_from_f64(ROUNDED).unwrap_or_default());
        let wider =
            Matrix::from_fn(n, n, |i, j| if i == j { matrix[(i, j)].times(&more) } else { matrix[(i, j)].clone() });
        if !matches!(definiteness(&wider), Definiteness::Indefinite { .. }) {
            (matrix, verdict) = (wider, Definiteness::Positive);
        }
    }
    let Definiteness::Indefinite { witness } = verdict else { return Some(factor(&matrix)) };
    let largest = witness.iter().map(|x| rational_to_f64(x).abs()).fold(0.0, f64::max);
    let part = |x: &Rational| in_digits((rational_to_f64(x) / largest * 1e4).round() / 1e4);
    let direction: Vec<String> = witness
        .iter()
        .zip(&correlation.names)
        .filter(|(x, _)| !x.is_zero())
        .map(|(x, name)| format!("{} of `{name}`", part(x)))
        .collect();
    let variance = quadratic(&correlation.matrix, &witness);
    let message = format!(
        "{what}: these correlations are impossible: the sum of {} would have the negative variance {:.3e}",
        direction.join(", "),
        variance / (largest * largest)
    );
    let key = if correlation.moments.is_some() { "file" } else { "correlation" };
    let help = "correct the matrix: it must be positive semidefinite";
    out.push(key_error("sweep::correlation", message, (table, key, "not semidefinite"), help));
    None
}

fn quadratic(matrix: &Matrix<Rational>, at: &[Rational]) -> f64 {
    let n = at.len();
    let terms = (0..n).flat_map(|i| (0..n).map(move |j| (i, j)));
    let sum = terms.fold(Rational::zero(), |sum, (i, j)| sum.plus(&at[i].times(&matrix[(i, j)]).times(&at[j])));
    rational_to_f64(&sum)
}

/// Lower triangle with rows of length one whose product with its transpose are the correlations of a semidefinite matrix: L √D of its exact L D Lᵀ.
fn factor(matrix: &Matrix<Rational>) -> Matrix<f64> {
    let n = matrix.rows();
    let mut rest = matrix.clone();
    let mut out = Matrix::zeros(n, n);
    for k in 0..n {
        let pivot = rest[(k, k)].clone();
        // The column of a zero pivot is zero.
        if pivot.is_zero() {
            continue;
        }
        let size = rational_to_f64(&pivot).sqrt();
        for i in k..n {
            out[(i, k)] = rational_to_f64(&rest[(i, k)]) / size;
        }
        for i in k + 1..n {
            let slope = rest[(i, k)].over(&pivot);
            for j in k + 1..n {
                let less = slope.times(&rest[(k, j)]);
                rest[(i, j)] = rest[(i, j)].minus(&less);
            }
        }
    }
    for i in 0..n {
        let length = (0..=i).map(|j| out[(i, j)] * out[(i, j)]).sum::<f64>().sqrt();
        (0..=i).for_each(|j| out[(i, j)] /= length);
    }
    out
}

#[cfg(test)]
#[path = "../../../tests/unit/study/requests/correlated.rs"]
mod tests;
