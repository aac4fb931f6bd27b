//! The results of a sweep as JSON, and its rows as Parquet, with the reader of these files.

use kardan_tables::{Column, write};

use super::printed::printed;
use kardan_results::{RowAgain, Sweep, SweepHead, SweepRequirement, SweepRow};

/// Columns before those of the varied values.
const SAMPLE: &str = "sample";
const VARIANT: &str = "variant";
/// The column of differences from the reference.
const DIFFERENCE: &str = "difference";
/// The column of the reason why a run did not reach its end.
const REASON: &str = "reason";
/// The metadata keys: identity of the sweep, its number of samples, and its seed.
const IDENTITY: &str = "kardan:sweep";
const SAMPLES: &str = "kardan:samples";
const SEED: &str = "kardan:seed";
/// Why a file is rejected that another program wrote.
const NO_ROWS: &str = "it contains no rows of a sweep";

/// The results of a sweep as one JSON object on one line, in SI.
///
/// Its keys are described by [`schema`](super::schema()) of `sweep`.
///
/// ```
/// let text = kardan::export::sweep_json(&kardan::results::Sweep::default());
/// assert!(text.starts_with("{\"schema\":\"kardan/2\"") && text.contains("\"figures\":[]"));
/// ```
pub fn sweep_json(found: &Sweep) -> String {
    printed(found)
}

/// Names and units of the columns of numbers after `sample`: varied values, figures, measures of requirements and whether they are satisfied.
fn columns(head: &SweepHead) -> Vec<(String, String)> {
    let mut out: Vec<(String, String)> = head.varied.iter().map(|one| (one.name.clone(), one.unit.clone())).collect();
    out.extend(head.figures.iter().map(|(name, unit)| (format!("figure.{name}"), unit.clone())));
    for (k, SweepRequirement { unit, .. }) in head.requirements.iter().enumerate() {
        out.push((format!("requirement.{}.measured", k + 1), unit.clone()));
        out.push((format!("requirement.{}.passed", k + 1), String::new()));
    }
    out
}

/// Rows of a sweep as an Apache Parquet file: `sample`, varied values, `figure.NAME`, `requirement.K.measured` and `.passed` (1, 0, NaN for those of
/// other variants), `difference` (of runs in lanes from the reference, NaN where they were not compared), all `DOUBLE` and in SI, then the texts `variant` and `reason`. The metadata contain the requirements as text, as `requirement.K`.
///
/// # Errors
/// Those of the encoder; none is known for writing to memory.
pub fn sweep_rows(head: &SweepHead, rows: &[SweepRow]) -> Result<Vec<u8>, write::ParquetError> {
    let columns = columns(head);
    let mut values: Vec<Vec<f64>> = vec![Vec::with_capacity(rows.len()); columns.len() + 2];
    for row in rows {
        let verdicts = row.measured.iter().zip(&row.passed).flat_map(|(measured, passed)| [*measured, *passed]);
        let numbers = [row.sample as f64].into_iter().chain(row.values.iter().copied());
        let numbers = numbers.chain(row.figures.iter().copied()).chain(verdicts);
        let numbers = numbers.chain([row.difference.unwrap_or(f64::NAN)]);
        values.iter_mut().zip(numbers).for_each(|(column, number)| column.push(number));
    }
    let named = [(SAMPLE, "")].into_iter().chain(columns.iter().map(|(name, unit)| (name.as_str(), unit.as_str())));
    let named = named.chain([(DIFFERENCE, "")]);
    let numbers: Vec<Column<'_>> =
        named.zip(&values).map(|((name, unit), values)| Column { name, unit, description: "", values }).collect();
    let variants: Vec<String> = rows.iter().map(|row| head.variants[row.variant].clone()).collect();
    let reasons: Vec<String> = rows.iter().map(|row| row.reason.clone()).collect();
    let texts: Vec<(String, &str)> = head
        .requirements
        .iter()
        .enumerate()
        .map(|(k, one)| (format!("requirement.{}", k + 1), one.text.as_str()))
        .collect();
    let [samples, seed] = [head.samples, head.seed].map(|number| number.to_string());
    let mut metadata = vec![(IDENTITY, head.identity.as_str()), (SAMPLES, &samples), (SEED, &seed)];
    metadata.extend(texts.iter().map(|(key, text)| (key.as_str(), *text)));
    write::rows(&numbers, &[(VARIANT, &variants), (REASON, &reasons)], &metadata)
}

/// Why kardan rejects a file as rows of a sweep.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum RowsError {
    /// The file is damaged; the text says how.
    Damaged(String),
    /// It is of another sweep, with this identity.
    SweepMismatch(String),
}

/// The pairs of the metadata with the rows, if no bit of them has changed; the identity of their sweep.
fn read(bytes: Vec<u8>) -> Result<(String, write::Rows), String> {
    let read = write::read_rows(bytes).map_err(|error| format!("it cannot be read: {error}"))?;
    let identity = named(&read.metadata, IDENTITY).cloned();
    identity.map(|identity| (identity, read)).ok_or_else(|| NO_ROWS.into())
}

/// What has this name: a value of the metadata, a column.
fn named<'r, T>(all: &'r [(String, T)], name: &str) -> Option<&'r T> {
    all.iter().find(|(candidate, _)| candidate == name).map(|(_, value)| value)
}

/// How many samples the sweep of a file of rows has, and its seed.
///
/// # Errors
/// The file is damaged, or contains no rows of a sweep.
pub fn samples_and_seed(bytes: Vec<u8>) -> Result<(u64, u64), String> {
    let (_, read) = read(bytes)?;
    let number = |key: &str| named(&read.metadata, key).and_then(|value| value.parse().ok());
    number(SAMPLES).zip(number(SEED)).ok_or_else(|| NO_ROWS.into())
}

/// The identity of the sweep of rows, and each row with the numbers of its columns: the varied values among others.
///
/// # Errors
/// The file is damaged, or contains no rows of a sweep.
pub fn rows_of_any_sweep(bytes: Vec<u8>) -> Result<(String, Vec<RowAgain>), String> {
    let (identity, read) = read(bytes)?;
    let columns = named(&read.numbers, SAMPLE).zip(named(&read.texts, VARIANT));
    let (samples, variants) = columns.ok_or(NO_ROWS)?;
    if read.numbers.iter().any(|(_, column)| column.len() != samples.len()) || variants.len() < samples.len() {
        return Err("its columns have different lengths".into());
    }
    let row = |k: usize| RowAgain {
        sample: samples[k] as u64,
        variant: variants[k].clone(),
        values: read.numbers.iter().map(|(name, values)| (name.clone(), values[k])).collect(),
    };
    Ok((identity, (0..samples.len()).map(row).collect()))
}

/// Reads such rows again.
///
/// # Errors
/// The file is damaged, or of another sweep.
pub fn read_sweep_rows(head: &SweepHead, bytes: Vec<u8>) -> Result<Vec<SweepRow>, RowsError> {
    let (identity, read) = read(bytes).map_err(RowsError::Damaged)?;
    match identity == head.identity {
        true => own_rows(head, &read).map_err(RowsError::Damaged),
        false => Err(RowsError::SweepMismatch(identity)),
    }
}

/// The rows of this sweep.
fn own_rows(head: &SweepHead, read: &write::Rows) -> Result<Vec<SweepRow>, String> {
    let columns = columns(head);
    let lost = |name: &str| format!("it has no column `{name}`");
    let number = |name: &str| named(&read.numbers, name).ok_or_else(|| lost(name));
    let text = |name: &str| named(&read.texts, name).ok_or_else(|| lost(name));
    let (samples, variants, reasons) = (number(SAMPLE)?, text(VARIANT)?, text(REASON)?);
    let differences = number(DIFFERENCE)?;
    let values: Vec<&Vec<f64>> = columns.iter().map(|(name, _)| number(name)).collect::<Result<_, _>>()?;
    if values.iter().chain([&differences]).any(|column| column.len() != samples.len())
        || variants.len().min(reasons.len()) < samples.len()
    {
        return Err("its columns have different lengths".into());
    }
    let (varied, figures) = (head.varied.len(), head.figures.len());
    let row = |k: usize| {
        let at = |columns: &[&Vec<f64>]| columns.iter().map(|column| column[k]).collect::<Vec<f64>>();
        let verdicts = &values[varied + figures..];
        let every_other = |first: usize| verdicts.iter().skip(first).step_by(2).map(|column| column[k]).collect();
        let variant = head.variants.iter().position(|name| *name == variants[k]);
        Ok(SweepRow {
            sample: samples[k] as u64,
            variant: variant.ok_or_else(|| format!("there is no variant `{}`", variants[k]))?,
            reason: reasons[k].clone(),
            values: at(&values[..varied]),
            measured: every_other(0),
            passed: every_other(1),
            figures: at(&values[varied..varied + figures]),
            difference: Some(differences[k]).filter(|difference| !difference.is_nan()),
        })
    };
    (0..samples.len()).map(row).collect()
}
