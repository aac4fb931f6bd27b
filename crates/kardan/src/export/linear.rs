//! A linear model for the tools of control engineers: JSON, MATLAB, Python.

use kardan_tables::write::{Texts, Values, mat_matrices};
use serde_json::{Value, json};

use crate::num::{Matrix, Rational};
use crate::results::{Linearised, NamedUnit, Realisations, TransformedSystem};

/// As a JSON object that `kardan analyze --state-space` reads: the matrices exact (whole numbers, fractions as texts), in
/// `decimal` rounded to floating point, names, units and the operating point.
pub fn linear_json(model: &Linearised) -> String {
    let mut all = serde_json::Map::new();
    all.insert("name".into(), json!(model.name));
    all.insert("description".into(), json!(title(model)));
    for (name, matrix) in model.matrices() {
        all.insert(name.into(), rows(matrix, exact));
    }
    for (key, signals) in kinds(model) {
        all.insert(key.into(), signals.iter().map(|one| json!(one.name)).collect());
    }
    let units: serde_json::Map<String, Value> = kinds(model)
        .map(|(key, all)| (key.into(), all.iter().map(|one| json!(one.unit)).collect()))
        .into_iter()
        .collect();
    all.insert("units".into(), units.into());
    let point = |(signal, value): &(NamedUnit, f64)| json!({"name": signal.name, "unit": signal.unit, "value": value});
    all.insert("operating_point".into(), model.operating_point.iter().map(point).collect());
    let decimal: serde_json::Map<String, Value> = model
        .matrices()
        .into_iter()
        .map(|(name, matrix)| (name.into(), rows(matrix, |x| json!(crate::num::rational_to_f64(x)))))
        .collect();
    all.insert("decimal".into(), decimal.into());
    all.insert("notes".into(), json!(model.notes));
    Value::Object(all).to_string()
}

/// As a MAT file of version 5: A, B, C, D (and E) in floating point, `states`, `inputs`, `outputs` and their units as texts,
/// and `operating_point`. `None` if it were larger than the format allows.
pub fn linear_mat(model: &Linearised) -> Option<Vec<u8>> {
    let columns = |matrix: &Matrix<Rational>| matrix.transpose().to_f64().as_slice().to_vec();
    let mut values: Vec<Values<'_>> = model
        .matrices()
        .into_iter()
        .map(|(name, matrix)| Values { name, rows: matrix.rows(), columns: matrix.columns(), values: columns(matrix) })
        .collect();
    let point: Vec<f64> = model.operating_point.iter().map(|(_, value)| *value).collect();
    values.push(Values { name: "operating_point", rows: point.len(), columns: 1, values: point });
    let names = kinds(model).map(|(key, all)| (key, all.iter().map(|one| one.name.as_str()).collect::<Vec<_>>()));
    let units = ["state_units", "input_units", "output_units"].into_iter().zip(kinds(model));
    let units = units.map(|(key, (_, all))| (key, all.iter().map(|one| one.unit.as_str()).collect::<Vec<_>>()));
    let point = model.operating_point.iter().map(|(signal, _)| signal.name.as_str()).collect();
    let texts = names.into_iter().chain(units).chain([("operating_point_names", point)]);
    mat_matrices(&values, &texts.map(|(name, rows)| Texts { name, rows }).collect::<Vec<_>>())
}

/// As a Python program that defines NumPy arrays, lists of names and units, and `system`, a `control.ss` where
/// python-control is installed (`control.dss` does not exist: with an E the program solves for it).
pub fn linear_python(model: &Linearised) -> String {
    let mut out = format!("\"\"\"{}\"\"\"\n\nimport numpy as np\n\n", quoted(&title(model)));
    for (name, matrix) in model.matrices() {
        let row = |i: usize| {
            let entries: Vec<String> =
                matrix.row(i).iter().map(|x| format!("{:?}", crate::num::rational_to_f64(x))).collect();
            format!("    [{}],\n", entries.join(", "))
        };
        let text: String = (0..matrix.rows()).map(row).collect();
        out += &format!("{name} = np.array([\n{text}]).reshape({}, {})\n", matrix.rows(), matrix.columns());
    }
    let list = |names: Vec<&str>| {
        format!("[{}]", names.iter().map(|name| format!("\"{}\"", quoted(name))).collect::<Vec<_>>().join(", "))
    };
    out += "\n";
    for (key, signals) in kinds(model) {
        out += &format!("{key} = {}\n", list(signals.iter().map(|one| one.name.as_str()).collect()));
        out += &format!(
            "{}_units = {}\n",
            &key[..key.len() - 1],
            list(signals.iter().map(|one| one.unit.as_str()).collect())
        );
    }
    let point: Vec<String> = model
        .operating_point
        .iter()
        .map(|(signal, value)| format!("\"{}\": {value:?}", quoted(&signal.name)))
        .collect();
    out += &format!("operating_point = {{{}}}\n\n", point.join(", "));
    let [a, b] = match model.e {
        Some(_) => ["np.linalg.solve(E, A)", "np.linalg.solve(E, B)"],
        None => ["A", "B"],
    };
    out += "try:\n    import control\nexcept ImportError:\n    control = None\n";
    out += "\n\ndef plain(names):\n    \"\"\"python-control takes no dots in names.\"\"\"\n";
    out += "    return [name.replace(\".\", \"_\") for name in names]\n\n\n";
    let names = "states=plain(states), inputs=plain(inputs), outputs=plain(outputs)";
    out += &format!("system = control and control.ss({a}, {b}, C, D, {names})\n");
    out
}

/// Kalman's decomposition, the minimal realisation and the staircase form as one JSON object: for each of them its blocks and
/// the matrices T, A, B, C, D exact, with `x = T z`, and rounded in `decimal`.
pub fn realisations_json(found: &Realisations) -> String {
    let one = |system: &TransformedSystem| {
        let matrices = |entry: &dyn Fn(&Rational) -> Value| -> serde_json::Map<String, Value> {
            parts(system).map(|(name, matrix)| (name.to_string(), rows(matrix, entry))).into_iter().collect()
        };
        let mut all = matrices(&exact);
        all.insert("blocks".into(), json!(system.blocks));
        all.insert("decimal".into(), matrices(&|x| json!(crate::num::rational_to_f64(x))).into());
        Value::Object(all)
    };
    let all = forms(found).map(|(name, system)| (name.to_string(), one(system)));
    Value::Object(all.into_iter().collect()).to_string()
}

/// The same as a MAT file of version 5, in floating point: `kalman_T`, `kalman_A`, …, `minimal_A`, …, `staircase_A`, …, and
/// the sizes of the blocks in `kalman_blocks`, …. `None` if it were larger than the format allows.
pub fn realisations_mat(found: &Realisations) -> Option<Vec<u8>> {
    let mut named: Vec<(String, usize, usize, Vec<f64>)> = Vec::new();
    for (form, system) in forms(found) {
        for (name, matrix) in parts(system) {
            let values = matrix.transpose().to_f64().as_slice().to_vec();
            named.push((format!("{form}_{name}"), matrix.rows(), matrix.columns(), values));
        }
        let sizes: Vec<f64> = system.blocks.iter().map(|block| block.states as f64).collect();
        named.push((format!("{form}_blocks"), sizes.len(), 1, sizes));
    }
    let values = named.iter().map(|(name, rows, columns, values)| Values {
        name,
        rows: *rows,
        columns: *columns,
        values: values.clone(),
    });
    mat_matrices(&values.collect::<Vec<_>>(), &[])
}

fn forms(found: &Realisations) -> [(&'static str, &TransformedSystem); 3] {
    [("kalman", &found.kalman), ("minimal", &found.minimal), ("staircase", &found.staircase)]
}

fn parts(system: &TransformedSystem) -> [(&'static str, &Matrix<Rational>); 5] {
    let TransformedSystem { transformation, a, b, c, d, .. } = system;
    [("T", transformation), ("A", a), ("B", b), ("C", c), ("D", d)]
}

fn title(model: &Linearised) -> String {
    let variant = if model.variant.is_empty() { String::new() } else { format!(", variant {}", model.variant) };
    format!("{}{variant}: deviations from the operating point, SI units", model.name)
}

fn kinds(model: &Linearised) -> [(&'static str, &Vec<NamedUnit>); 3] {
    [("states", &model.states), ("inputs", &model.inputs), ("outputs", &model.outputs)]
}

fn rows(matrix: &Matrix<Rational>, entry: impl Fn(&Rational) -> Value) -> Value {
    (0..matrix.rows()).map(|i| matrix.row(i).iter().map(&entry).collect::<Value>()).collect()
}

/// A whole number of few digits as it is, another one as a text.
fn exact(x: &Rational) -> Value {
    let text = x.to_string();
    text.parse::<i32>().map_or(json!(text), |whole| json!(whole))
}

/// Inside double quotes of Python.
fn quoted(text: &str) -> String {
    text.replace('\\', "\\\\").replace('"', "\\\"").replace(['\n', '\r'], " ")
}
