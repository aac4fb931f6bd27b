//! Tables that expressions call: `[table.NAME]`.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::samples::{factor, file_of, in_file, read_rows, unknown, unreadable};
use super::{Functions, unlike};
use crate::keys::key_diagnostic;
use kardan_elements::element::KeyError;
use kardan_expr::expr::{Extrapolation, Lookup};
use kardan_math::num::{Rational, rational_from_f64, rational_to_f64};
use kardan_math::units::Dimension;
use kardan_schema::diagnostics::{Diagnostic, quoted, shortened};
use kardan_schema::schema::{Placed, Table, Value, Values};
use kardan_tables::read::{CsvOptions, in_memory, open};

/// The most points of a table.
const MOST_POINTS: usize = 10_000;

/// The columns of a table: x, y of a surface, and the value, SI.
struct Columns {
    values: Vec<Vec<Rational>>,
    dimensions: Vec<Dimension>,
    /// Whether the points may be in any order.
    sorted: bool,
}

impl<'a> Functions<'a, '_> {
    /// A table by its name; the outer option is `None` if it does not exist, the inner if it has a reported error.
    pub(crate) fn table(&mut self, name: &str, out: &mut Vec<Diagnostic>) -> Option<Option<Arc<Lookup>>> {
        let document = self.document;
        let (name, table) = document.tables.get(name)?;
        if let Some(made) = self.tables.get(name.as_str()) {
            return Some(made.clone());
        }
        let made = self.lookup(name, table, out).map(Arc::new);
        self.tables.insert(name, made.clone());
        Some(made)
    }

    /// Checks all tables, including uncalled ones.
    pub(crate) fn check_tables(&mut self, out: &mut Vec<Diagnostic>) {
        let document = self.document;
        for (name, _) in &document.tables {
            self.table(name, out);
        }
    }

    fn lookup(&self, name: &str, table: &'a Table, out: &mut Vec<Diagnostic>) -> Option<Lookup> {
        let what = format!("table `{}`", shortened(name));
        if !table.unread.is_empty() {
            return None;
        }
        let values = self.reader.values(table.fields, table, &what, &mut Vec::new());
        let columns = match (values.has("file"), table.values.get("points")) {
            (true, Some(_)) => Err(KeyError::new("points", "there are points and a file", "remove one of the two")),
            (false, None) => {
                Err(KeyError::new("points", "there are neither points nor a file", "add `points` or `file`"))
            }
            (false, Some(points)) => Ok(self.points(points, &what, out)?),
            (true, None) => {
                let file = values.word("file").unwrap_or_default();
                let bytes = file_of(self.document, table, file, &what, out)?;
                of_file(bytes, &values).map_err(|error| in_file(file, error))
            }
        };
        let key = if values.has("file") { "file" } else { "points" };
        let cubic = values.word_or_default("interpolation") == "cubic";
        let beyond = if values.word_or_default("extrapolation") == "hold" {
            Extrapolation::Level
        } else {
            Extrapolation::Straight
        };
        let lookup = columns.and_then(|columns| {
            through(columns, cubic, beyond).map_err(|(message, help)| KeyError::new(key, message, help))
        });
        let refuse = |error| out.push(key_diagnostic("table::points", &what, error, (table, &table.place)));
        lookup.map_err(refuse).ok()
    }

    /// Points that are listed.
    fn points(&self, points: &Placed<Value>, what: &str, out: &mut Vec<Diagnostic>) -> Option<Columns> {
        let Value::Map(entries) = &points.value else { return None };
        let before = out.len();
        let mut found: BTreeMap<&str, (Vec<Rational>, Option<Dimension>)> = BTreeMap::new();
        for (name, scalar) in entries {
            let label = format!("`{}` in `points` of {what}", name.value);
            if !["x", "y", "value"].contains(&name.value.as_str()) {
                let diagnostic = Diagnostic::error("key::unknown", format!("{label} is not known"));
                out.push(
                    diagnostic
                        .at(&name.place, "unknown")
                        .help("points have `x` and `value`, and for a surface `y`, a list each"),
                );
                continue;
            }
            let (list, dimension) = found.entry(&name.value).or_default();
            let Some((value, own)) = self.reader.scalar(scalar, None, &label, out) else { continue };
            list.push(value.to_rational());
            match dimension {
                None => *dimension = Some(own),
                Some(common) if common.is_like(&own) => {}
                Some(common) => out.push(unlike(&label, scalar, common, &own)),
            }
        }
        let names = if found.contains_key("y") { &["x", "y", "value"][..] } else { &["x", "value"] };
        if let Some(missing) = names.iter().find(|name| !found.contains_key(*name)) {
            let message = format!("`points` of {what} have no `{missing}`");
            out.push(
                Diagnostic::error("table::points", message)
                    .at(&points.place, "")
                    .help("write `{ x = [...], value = [...] }`"),
            );
        }
        if out.len() > before {
            return None;
        }
        let (values, dimensions) = names.iter().map(|name| found.remove(name).unwrap_or_default()).unzip();
        let dimensions: Vec<Option<Dimension>> = dimensions;
        Some(Columns {
            values,
            dimensions: dimensions.into_iter().map(|found| found.unwrap_or(Dimension::NONE)).collect(),
            sorted: true,
        })
    }
}

/// Points of a file.
fn of_file(bytes: Arc<[u8]>, values: &Values) -> Result<Columns, KeyError> {
    let mut log = open(in_memory(bytes), &CsvOptions::default()).map_err(unreadable)?;
    let groups = log.groups().to_vec();
    let group = groups.first().ok_or_else(|| KeyError::new("file", "there are no columns", "is it a table?"))?;
    let names = || quoted(group.channels.iter().map(|channel| channel.name.as_str()).take(24));
    let columns: Vec<usize> = match values.names("columns") {
        Some(names) => {
            let column = |name: &String| group.channel(name).ok_or_else(|| unknown("columns", name, group));
            names.iter().map(column).collect::<Result<_, _>>()?
        }
        None => (0..group.channels.len()).collect(),
    };
    if !(2..=3).contains(&columns.len()) {
        let message = format!("{} columns are neither a curve nor a surface", columns.len());
        let help = format!("name two or three by `columns`, the value last; there are {}", names());
        return Err(KeyError::new(if values.has("columns") { "columns" } else { "file" }, message, help));
    }
    let units = values.names("units");
    if let Some(units) = units.filter(|units| units.len() != columns.len()) {
        let message = format!("{} units for {} columns", units.len(), columns.len());
        return Err(KeyError::new("units", message, "give one for each column"));
    }
    let mut factors = Vec::new();
    for (k, column) in columns.iter().enumerate() {
        let key = if units.is_some() { "units" } else { "file" };
        let unit = units.map_or(group.channels[*column].unit.as_str(), |units| units[k].as_str());
        factors.push(factor(unit, key)?);
    }
    let chosen: Vec<(usize, usize)> = columns.iter().map(|column| (0, *column)).collect();
    let mut found: Vec<Vec<Rational>> = vec![Vec::new(); columns.len()];
    read_rows(&mut *log, &chosen, "correct or remove the row", |block| {
        for ((list, column), (factor, _)) in found.iter_mut().zip(&block.columns).zip(&factors) {
            for value in column {
                let row = list.len() + 1;
                list.push(rational_from_f64(value * factor).ok_or_else(|| {
                    let message = format!("a value of row {row} is no number");
                    KeyError::new("file", message, "is a cell empty, or a row too short?")
                })?);
            }
        }
        if found[0].len() > MOST_POINTS {
            return Err(KeyError::new("file", format!("more than {MOST_POINTS} rows"), "reduce the number of rows"));
        }
        Ok(())
    })?;
    Ok(Columns {
        values: found,
        dimensions: factors.into_iter().map(|(_, dimension)| dimension).collect(),
        sorted: false,
    })
}

/// The curve or surface through points.
fn through(columns: Columns, cubic: bool, beyond: Extrapolation) -> Result<Lookup, (String, &'static str)> {
    let Columns { mut values, dimensions, sorted } = columns;
    let value = values.pop().unwrap_or_default();
    if value.is_empty() {
        return Err(("there are no points".into(), "give at least one"));
    }
    let rises = |list: &[Rational], what: &str| match list.windows(2).position(|pair| pair[0] >= pair[1]) {
        Some(k) => {
            let [before, after] = [k, k + 1].map(|k| rational_to_f64(&list[k]));
            let message = format!("{what} does not rise: {after} after {before} (point {})", k + 2);
            Err((message, "sort the points, with one for each position"))
        }
        None => Ok(()),
    };
    let failed = || ("the points do not form a table".to_string(), "check their numbers");
    if let [x] = &values[..] {
        if x.len() != value.len() {
            return Err((
                format!("{} positions and {} values do not form points", x.len(), value.len()),
                "give one value for each position",
            ));
        }
        let points: Vec<_> = x.iter().cloned().zip(value).collect();
        rises(x, "x")?;
        return Lookup::curve(dimensions[0], dimensions[1], &points, cubic, beyond).ok_or_else(failed);
    }
    let (mut x, mut y) = (values.remove(0), values.remove(0));
    let value = if sorted {
        rises(&x, "x")?;
        rises(&y, "y")?;
        value
    } else {
        let points: BTreeMap<(Rational, Rational), Rational> =
            y.iter().cloned().zip(x.iter().cloned()).zip(value.iter().cloned()).collect();
        for list in [&mut x, &mut y] {
            list.sort();
            list.dedup();
        }
        if points.len() != value.len() {
            return Err(("a point of the grid has two values".into(), "keep one row for each point of the grid"));
        }
        let grid = y.iter().flat_map(|y| x.iter().map(move |x| (y.clone(), x.clone())));
        let missing: Vec<_> = grid.filter(|place| !points.contains_key(place)).collect();
        if let Some((y, x)) = missing.first() {
            let at = |value: &Rational, dimension: &Dimension| match dimension.si() {
                unit if unit.is_empty() => rational_to_f64(value).to_string(),
                unit => format!("{} {unit}", rational_to_f64(value)),
            };
            let [x, y] = [at(x, &dimensions[0]), at(y, &dimensions[1])];
            let more = match missing.len() {
                1 => String::new(),
                count => format!(", and at {} more points", count - 1),
            };
            let message = format!("the grid has no value where the first column is {x} and the second {y}{more}");
            return Err((message, "give one row for each point of the grid"));
        }
        points.into_values().collect()
    };
    if x.len() * y.len() != value.len() {
        let message = format!(
            "a grid of {} points along x and {} along y needs {} values, there are {}",
            x.len(),
            y.len(),
            x.len() * y.len(),
            value.len()
        );
        return Err((
            message,
            "give one value for each point of the grid: for all x at the first y, then at the second",
        ));
    }
    Lookup::surface([dimensions[0], dimensions[1]], dimensions[2], [x, y], &value, cubic, beyond).ok_or_else(failed)
}
