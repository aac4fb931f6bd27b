//! A linear model for the tools of control engineers: JSON, MATLAB, Python.

use kardan_tables::write::{Texts, Values, mat_matrices};
use schemars::JsonSchema;
use serde::Serialize;

use super::printed::printed;
use kardan_math::num::{Matrix, Rational, rational_to_f64};
use kardan_results::{Block, Linearised, NamedUnit, Realisations, TransformedSystem};

/// An exact number: a whole one of few digits as it is, another as a text (`"-3/2"`).
#[derive(Serialize, JsonSchema)]
#[serde(untagged)]
enum ExactEntry {
    /// A whole number.
    Whole(i32),
    /// A fraction, or a whole number of many digits.
    Text(String),
}

/// The linear model of a variant at its operating point: `E x' = A x + B u`, `y = C x + D u`, deviations in SI units.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Linearised")]
pub(super) struct LinearView<'a> {
    /// Name of the model.
    name: &'a str,
    /// Its description.
    description: String,
    #[serde(flatten)]
    exact: Matrices<ExactEntry>,
    #[serde(flatten)]
    names: Signals<'a>,
    /// Their SI units.
    units: Signals<'a>,
    /// The coordinates; of an operating point in motion also their speeds and the torques of inputs, else all speeds are zero.
    operating_point: Vec<PointView<'a>>,
    /// The matrices rounded to floating point.
    decimal: Matrices<f64>,
    /// If a torque has a kink at the operating point: the side of this model; else `null`.
    side: Option<&'a str>,
    /// The same on the opposite side of the kink; `null` where there is none.
    opposite_side: Option<Box<LinearView<'a>>>,
    /// Notes to the reader.
    notes: &'a [String],
}

/// Matrices as lists of rows.
#[derive(Serialize, JsonSchema)]
struct Matrices<T> {
    /// E, only where it is not the identity.
    #[serde(rename = "E", skip_serializing_if = "Option::is_none")]
    e: Option<Vec<Vec<T>>>,
    /// A, states × states.
    #[serde(rename = "A")]
    a: Vec<Vec<T>>,
    /// B, a column for each input.
    #[serde(rename = "B")]
    b: Vec<Vec<T>>,
    /// C, a row for each output.
    #[serde(rename = "C")]
    c: Vec<Vec<T>>,
    /// D, outputs × inputs.
    #[serde(rename = "D")]
    d: Vec<Vec<T>>,
}

/// A text for each state, input and output.
#[derive(Serialize, JsonSchema)]
struct Signals<'a> {
    /// Of the states x.
    states: Vec<&'a str>,
    /// Of the inputs u.
    inputs: Vec<&'a str>,
    /// Of the outputs y.
    outputs: Vec<&'a str>,
}

/// The value of a coordinate.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "PointOfCoordinate")]
struct PointView<'a> {
    /// The signal, `rk.phi`.
    name: &'a str,
    /// Its SI unit.
    unit: &'a str,
    /// Its value.
    value: f64,
}

impl<'a> Signals<'a> {
    fn of(model: &'a Linearised, text: fn(&'a NamedUnit) -> &'a str) -> Self {
        let [states, inputs, outputs] = kinds(model).map(|(_, all)| all.iter().map(text).collect());
        Self { states, inputs, outputs }
    }
}

impl<T> Matrices<T> {
    fn of(model: &Linearised, entry: impl Fn(&Rational) -> T) -> Self {
        let rows = |matrix: &Matrix<Rational>| matrix_rows(matrix, &entry);
        let [a, b, c, d] = [&model.a, &model.b, &model.c, &model.d].map(rows);
        Self { e: model.e.as_ref().map(rows), a, b, c, d }
    }
}

/// As a JSON object that `kardan analyze --state-space` reads: the matrices exact (whole numbers, fractions as texts), in
/// `decimal` rounded to floating point, names, units and the operating point.
pub fn linear_json(model: &Linearised) -> String {
    printed(LinearView::of(model))
}

impl<'a> LinearView<'a> {
    fn of(model: &'a Linearised) -> Self {
        let point =
            |(signal, value): &'a (NamedUnit, f64)| PointView { name: &signal.name, unit: &signal.unit, value: *value };
        Self {
            name: &model.name,
            description: title(model),
            exact: Matrices::of(model, exact),
            names: Signals::of(model, |one| &one.name),
            units: Signals::of(model, |one| &one.unit),
            operating_point: model.operating_point.iter().map(point).collect(),
            decimal: Matrices::of(model, rational_to_f64),
            side: model.side.as_deref(),
            opposite_side: model.opposite_side.as_ref().map(|model| Box::new(Self::of(model))),
            notes: &model.notes,
        }
    }
}

/// As a MAT file of version 5: A, B, C, D (and E) in floating point, `states`, `inputs`, `outputs` and their units as texts,
/// and `operating_point`. `None` if it were larger than the format allows.
pub fn linear_mat(model: &Linearised) -> Option<Vec<u8>> {
    let all = all_matrices(model);
    let mut values: Vec<Values<'_>> = all.iter().map(|(name, matrix)| mat_values(name, matrix)).collect();
    values.push(mat_column("operating_point", model.operating_point.iter().map(|(_, value)| *value)));
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
    for (name, matrix) in all_matrices(model) {
        let row = |i: usize| {
            let entries: Vec<String> = matrix.row(i).iter().map(|x| format!("{:?}", rational_to_f64(x))).collect();
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
    out += "\n\ndef plain(names):\n    \"\"\"Names for python-control, which allows no dots.\"\"\"\n";
    out += "    return [name.replace(\".\", \"_\") for name in names]\n\n\n";
    let names = "states=plain(states), inputs=plain(inputs), outputs=plain(outputs)";
    out += &format!("system = control and control.ss({a}, {b}, C, D, {names})\n");
    out
}

/// Kalman's decomposition, the minimal realisation and the staircase form of a system, each with `x = T z`.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Realisations")]
pub(super) struct RealisationsView<'a> {
    /// Kalman's decomposition.
    kalman: FormView<'a>,
    /// The minimal realisation: what is controllable and observable.
    minimal: FormView<'a>,
    /// The staircase form.
    staircase: FormView<'a>,
}

/// A form of the system: `T`, and `z' = A z + B u`, `y = C z + D u`, as lists of rows.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Form")]
struct FormView<'a> {
    #[serde(flatten)]
    exact: FormMatrices<ExactEntry>,
    /// The blocks of z.
    blocks: &'a [Block],
    /// The matrices rounded to floating point.
    decimal: FormMatrices<f64>,
}

/// Matrices as lists of rows.
#[derive(Serialize, JsonSchema)]
struct FormMatrices<T> {
    /// The states x from those of the form: `x = T z`.
    #[serde(rename = "T")]
    transformation: Vec<Vec<T>>,
    /// A.
    #[serde(rename = "A")]
    a: Vec<Vec<T>>,
    /// B.
    #[serde(rename = "B")]
    b: Vec<Vec<T>>,
    /// C.
    #[serde(rename = "C")]
    c: Vec<Vec<T>>,
    /// D.
    #[serde(rename = "D")]
    d: Vec<Vec<T>>,
}

impl<T> FormMatrices<T> {
    fn of(system: &TransformedSystem, entry: impl Fn(&Rational) -> T) -> Self {
        let [transformation, a, b, c, d] = parts(system).map(|(_, matrix)| matrix_rows(matrix, &entry));
        Self { transformation, a, b, c, d }
    }
}

/// Kalman's decomposition, the minimal realisation and the staircase form as one JSON object: for each of them its blocks and
/// the matrices T, A, B, C, D exact, with `x = T z`, and rounded in `decimal`.
pub fn realisations_json(found: &Realisations) -> String {
    let [kalman, minimal, staircase] = forms(found).map(|(_, system)| FormView {
        exact: FormMatrices::of(system, exact),
        blocks: &system.blocks,
        decimal: FormMatrices::of(system, rational_to_f64),
    });
    printed(RealisationsView { kalman, minimal, staircase })
}

/// The same as a MAT file of version 5, in floating point: `kalman_T`, `kalman_A`, …, `minimal_A`, …, `staircase_A`, …, and
/// the sizes of the blocks in `kalman_blocks`, …. `None` if it were larger than the format allows.
pub fn realisations_mat(found: &Realisations) -> Option<Vec<u8>> {
    let named = forms(found).map(|(form, system)| {
        let matrices = parts(system).map(|(name, matrix)| (format!("{form}_{name}"), matrix));
        (matrices, format!("{form}_blocks"), &system.blocks)
    });
    let values = named.iter().flat_map(|(matrices, name, blocks)| {
        let matrices = matrices.iter().map(|(name, matrix)| mat_values(name, matrix));
        matrices.chain([mat_column(name, blocks.iter().map(|block| block.states as f64))])
    });
    mat_matrices(&values.collect::<Vec<_>>(), &[])
}

fn mat_values<'n>(name: &'n str, matrix: &Matrix<Rational>) -> Values<'n> {
    let values = matrix.transpose().to_f64().as_slice().to_vec();
    Values { name, rows: matrix.rows(), columns: matrix.columns(), values: values.into() }
}

fn mat_column(name: &str, values: impl Iterator<Item = f64>) -> Values<'_> {
    let values: Vec<f64> = values.collect();
    Values { name, rows: values.len(), columns: 1, values: values.into() }
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

/// The matrices by name, those of the opposite side of a kink with the suffix `_opposite`.
fn all_matrices(model: &Linearised) -> Vec<(String, &Matrix<Rational>)> {
    let opposite = model.opposite_side.iter().flat_map(|model| model.matrices());
    let own = model.matrices().into_iter().map(|(name, matrix)| (name.to_string(), matrix));
    own.chain(opposite.map(|(name, matrix)| (format!("{name}_opposite"), matrix))).collect()
}

fn kinds(model: &Linearised) -> [(&'static str, &Vec<NamedUnit>); 3] {
    [("states", &model.states), ("inputs", &model.inputs), ("outputs", &model.outputs)]
}

fn matrix_rows<T>(matrix: &Matrix<Rational>, entry: impl Fn(&Rational) -> T) -> Vec<Vec<T>> {
    (0..matrix.rows()).map(|i| matrix.row(i).iter().map(&entry).collect()).collect()
}

/// A whole number of few digits as it is, another one as a text.
fn exact(x: &Rational) -> ExactEntry {
    let text = x.to_string();
    text.parse::<i32>().map_or(ExactEntry::Text(text), ExactEntry::Whole)
}

/// Inside double quotes of Python.
fn quoted(text: &str) -> String {
    text.replace('\\', "\\\\").replace('"', "\\\"").replace(['\n', '\r'], " ")
}
