//! The signals of a run as a table, in SI, for `kardan_tables` to write.

use kardan_tables::write::{self, ParquetError, csv_cell};
use kardan_tables::{Column, Table};

use kardan_results::{Run, Series, Study};

/// The run as CSV, see [`write::csv`].
///
/// # Panics
/// If the number of values of a signal differs from the number of times.
pub fn csv(run: &Run) -> Vec<u8> {
    write::csv(&table(&run.series))
}

/// The run as a Parquet file, see [`write::parquet`]; its metadata contain `model`, `variant` and `parameter:<name>`, as written in
/// the model file.
///
/// # Errors
/// Those of the encoder; none is known for writing to memory.
///
/// # Panics
/// If the number of values of a signal differs from the number of times.
pub fn parquet(model: &str, run: &Run) -> Result<Vec<u8>, ParquetError> {
    let parameters: Vec<_> = run.parameters.iter().map(|one| (format!("parameter:{}", one.name), &one.text)).collect();
    let mut metadata = vec![("model", model), ("variant", run.name.as_str())];
    metadata.extend(parameters.iter().map(|(key, text)| (key.as_str(), text.as_str())));
    write::parquet(&table(&run.series), &metadata)
}

/// A series as a MAT file, see [`write::mat`]. `None` if a column is longer than the 2 GiB that the format allows.
///
/// # Panics
/// If the number of values of a signal differs from the number of times.
pub fn mat(series: &Series) -> Option<Vec<u8>> {
    write::mat(&table(series))
}

/// Series as an MDF file, a group for each, see [`write::mdf`].
///
/// # Panics
/// If the number of values of a signal differs from that of the times of its raster.
///
/// ```
/// use kardan::results::{Physical, Series, Signal};
/// use kardan::tables::read;
///
/// let angle = Signal { name: "rk.phi".into(), physical: Physical::Angle, description: String::new(), values: vec![0.5, 0.6] };
/// let bytes = kardan::export::mdf(&[("run", &Series { time: vec![0.0, 0.1], signals: vec![angle] })]);
///
/// let log = read::open(read::in_memory(bytes), &Default::default()).unwrap();
/// assert_eq!((log.groups()[0].rows, log.groups()[0].channels[1].unit.as_str()), (Some(2), "rad"));
/// ```
pub fn mdf(rasters: &[(&str, &Series)]) -> Vec<u8> {
    let tables: Vec<_> = rasters.iter().map(|(name, series)| (*name, table(series))).collect();
    write::mdf(&tables.iter().map(|(name, table)| (*name, table)).collect::<Vec<_>>())
}

/// The figures of all runs as CSV, a row for each with its variant, in SI; `None` if the model has no figures. A figure that a run does not have
/// is an empty cell.
pub fn figures_csv(study: &Study) -> Option<String> {
    let mut out = String::from("variant,figure,value,unit\n");
    let rows = study.runs.iter().flat_map(|run| run.figures.iter().map(move |figure| (run, figure)));
    for (run, figure) in rows.clone() {
        let value = figure.value.filter(|value| value.is_finite());
        let value = value.map(|value| zmij::Buffer::new().format(value).to_string()).unwrap_or_default();
        out += &format!("{},{},{value},{}\n", csv_cell(&run.name), csv_cell(&figure.name), csv_cell(&figure.unit));
    }
    rows.clone().next().map(|_| out)
}

fn table(series: &Series) -> Table<'_> {
    let columns = series.signals.iter().map(|signal| Column {
        name: &signal.name,
        unit: signal.physical.unit(),
        description: &signal.description,
        values: &signal.values,
    });
    Table { time: &series.time, columns: columns.collect() }
}
