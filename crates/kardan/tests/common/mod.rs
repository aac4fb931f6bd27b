//! What several test binaries share: models to runs, the golden numbers, and arithmetic that is not the library's own.
//!
//! Closed forms are written with [`Q`], an exact fraction of its own making, and solved with [`solve`], a plain Gauss
//! elimination, so that a mistake in `kardan::num` cannot hide itself.

#![allow(dead_code)] // each test binary uses its own part

pub mod grown;
pub mod multipliers;

use std::collections::{BTreeMap, BTreeSet};
use std::ops::{Add, Div, Mul, Neg, Sub};
use std::sync::{Arc, Mutex};

use kardan::analysis::{ConstrainedSystem, LinearSystem, OutputSignal, linear_system};
use kardan::diagnostics::{Severity, plain};
use kardan::equations::Measured;
use kardan::model;
use kardan::num::{Matrix, Rational};
use kardan::reduce::{Dynamics, Reduced, Work};
use kardan::results::{Outcome, Run};
use kardan::simulate::Method;
use kardan::study::{self, Prepared, PreparedVariant, Project, Settings};
use kardan::units::parse_number;

/// How many random models a test draws: a few, or `KARDAN_MODELS`.
pub fn random_models(few: u32) -> u32 {
    std::env::var("KARDAN_MODELS").ok().and_then(|count| count.parse().ok()).unwrap_or(few)
}

/// Reads and checks a model; panics with the mistakes if there are any.
pub fn prepared(source: &str) -> Prepared {
    let (prepared, diagnostics) = study::prepare(source);
    let wrong = diagnostics.iter().any(|d| d.severity == Severity::Error);
    assert!(!wrong, "{}\n---\n{source}", plain(source, &diagnostics));
    prepared
}

/// A project; those of built-in models are opened once and prepared once for all tests of a binary.
pub fn project(source: &str) -> Arc<Project> {
    static BUILT_IN: Mutex<BTreeMap<&str, Arc<Project>>> = Mutex::new(BTreeMap::new());
    let Some(builtin) = model::BUILTIN.iter().find(|builtin| builtin.source == source) else {
        return Arc::new(Project::open(source));
    };
    let mut projects = BUILT_IN.lock().expect("no test fails while it has the lock");
    Arc::clone(projects.entry(builtin.name).or_insert_with(|| Arc::new(Project::open(builtin.source))))
}

/// The variants of a model without errors.
pub fn variants(source: &str) -> Vec<Arc<PreparedVariant>> {
    let project = project(source);
    let diagnostics = project.diagnostics();
    let wrong = diagnostics.iter().any(|d| d.severity == Severity::Error);
    assert!(!wrong, "{}\n---\n{source}", plain(source, diagnostics));
    project.prepared().variants.clone()
}

/// The first variant of a model.
pub fn first(source: &str) -> Arc<PreparedVariant> {
    variants(source).remove(0)
}

/// The first variant of a model at zero angles, its coordinates and their basis.
pub fn constrained(source: &str, inputs: &[&str]) -> (ConstrainedSystem, Vec<usize>, Matrix<Rational>) {
    let reduced = &first(source).reduced;
    let inputs: Vec<String> = inputs.iter().map(ToString::to_string).collect();
    let system = ConstrainedSystem::at(reduced, &vec![0.0; reduced.degrees_of_freedom()], &BTreeSet::new(), &inputs);
    let (coordinates, basis) = system.explicit_basis(&reduced.coordinates);
    (system, coordinates, basis)
}

/// The angle of a shaft as an output: `rk.phi`.
pub fn angle(shaft: &str) -> OutputSignal {
    OutputSignal { name: format!("{shaft}.phi"), measured: Measured::Angle(shaft.into()) }
}

/// A built-in model in its first variant with the angles of shafts as outputs.
pub fn built_in(name: &str, inputs: &[&str], outputs: &[&str]) -> LinearSystem {
    let (system, coordinates, basis) = constrained(model::builtin(name).expect("built in").source, inputs);
    let outputs: Vec<OutputSignal> = outputs.iter().map(|shaft| angle(shaft)).collect();
    linear_system(&system, &coordinates, &basis, &outputs)
}

/// Numbers from a seed (SplitMix64).
pub struct Dice(pub u64);

impl Dice {
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn below(&mut self, n: usize) -> usize {
        (self.next() % n as u64) as usize
    }

    pub fn between(&mut self, low: i64, high: i64) -> i64 {
        low + self.below((high - low + 1) as usize) as i64
    }

    pub fn matrix(&mut self, rows: usize, columns: usize, size: i64) -> Matrix<Rational> {
        Matrix::from_fn(rows, columns, |_, _| Rational::from(self.between(-size, size)))
    }
}

/// No designs beside the runs: their margins take longer than a run.
pub fn runs_only() -> Settings {
    Settings { runs_only: true, ..Settings::default() }
}

/// Runs the first variant to its end.
pub fn run(source: &str) -> Run {
    let project = project(source);
    let first = project.prepared().variants.first().map(|variant| variant.name.clone());
    let settings = Settings { variants: first.into_iter().collect(), ..runs_only() };
    let mut study = project
        .run(&settings, &study::Silent)
        .unwrap_or_else(|diagnostics| panic!("{}\n---\n{source}", plain(source, &diagnostics)));
    let run = study.runs.remove(0);
    assert_eq!(run.outcome, Outcome::Completed, "{source}");
    run
}

/// Runs a model with one variant to its end by a method, at the tolerance given or at that of the model.
pub fn run_by(source: &str, method: Method, tolerance: Option<f64>) -> Run {
    let settings = Settings { method, tolerance, ..runs_only() };
    let mut study = project(source)
        .run(&settings, &study::Silent)
        .unwrap_or_else(|diagnostics| panic!("{}\n---\n{source}", plain(source, &diagnostics)));
    let run = study.runs.remove(0);
    assert_eq!(run.outcome, Outcome::Completed, "{source}");
    run
}

/// The values of a signal.
pub fn signal<'a>(run: &'a Run, name: &str) -> &'a [f64] {
    let names: Vec<&str> = run.series.signals.iter().map(|s| s.name.as_str()).collect();
    &run.series.signal(name).unwrap_or_else(|| panic!("no signal {name} among {names:?}")).values
}

/// The value of a signal in the row at a time.
pub fn at(run: &Run, name: &str, time: f64) -> f64 {
    let row =
        run.series.time.iter().position(|t| (t - time).abs() < 1e-12).unwrap_or_else(|| panic!("no row at {time}"));
    signal(run, name)[row]
}

/// The time of the first event with these words.
pub fn time_of(run: &Run, what: &str) -> f64 {
    let found = run.events.iter().find(|event| event.description == what);
    found.unwrap_or_else(|| panic!("no event {what:?} among {:?}", run.events)).time
}

/// The independent reference numbers; their origin is told in `tests/runs/golden.rs`.
pub fn golden() -> serde_json::Value {
    serde_json::from_str(include_str!("../golden/golden.json")).expect("golden.json is JSON")
}

/// A list of numbers.
pub fn list(value: &serde_json::Value) -> Vec<f64> {
    let entries = value.as_array().expect("a list");
    entries.iter().map(|x| x.as_f64().expect("a number")).collect()
}

/// A list of rows.
pub fn rows(value: &serde_json::Value) -> Vec<Vec<f64>> {
    value.as_array().expect("a list of rows").iter().map(list).collect()
}

/// Asserts `|value − expected| ≤ tolerance · max(1, |expected|)`.
#[track_caller]
pub fn close(value: f64, expected: f64, tolerance: f64, what: &str) {
    let error = (value - expected).abs();
    assert!(error <= tolerance * expected.abs().max(1.0), "{what}: {value} against {expected} (error {error:e})");
}

/// Asserts that an exact matrix agrees with printed numbers to a relative error (of the largest entry).
#[track_caller]
pub fn agrees(code: &Matrix<Rational>, expected: &[Vec<f64>], tolerance: f64, what: &str) {
    assert_eq!((code.rows(), code.columns()), (expected.len(), expected[0].len()), "{what}: shape");
    let scale = expected.iter().flatten().fold(0.0f64, |max, x| max.max(x.abs()));
    for (i, row) in code.to_rows().iter().enumerate() {
        for (j, value) in row.iter().enumerate() {
            let error = (value - expected[i][j]).abs();
            assert!(error <= tolerance * scale, "{what} ({i}, {j}): {value} against {}", expected[i][j]);
        }
    }
}

/// Asserts that an exact matrix is a closed form, entry by entry, as fractions.
#[track_caller]
pub fn same(code: &Matrix<Rational>, closed: &[Vec<Q>], what: &str) {
    assert_eq!((code.rows(), code.columns()), (closed.len(), closed[0].len()), "{what}: shape");
    for (i, row) in closed.iter().enumerate() {
        for (j, entry) in row.iter().enumerate() {
            assert_eq!(code[(i, j)], entry.rational(), "{what}: entry ({i}, {j})");
        }
    }
}

/// An exact fraction that can be copied; panics on overflow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Q {
    numerator: i128,
    denominator: i128,
}

fn gcd(a: i128, b: i128) -> i128 {
    if b == 0 { a.abs() } else { gcd(b, a % b) }
}

/// The fraction `numerator/denominator`.
pub fn frac(numerator: i128, denominator: i128) -> Q {
    assert!(denominator != 0, "division by zero");
    let common = gcd(numerator, denominator) * denominator.signum();
    Q { numerator: numerator / common, denominator: denominator / common }
}

/// A whole number.
pub fn int(number: i128) -> Q {
    frac(number, 1)
}

impl Q {
    /// For the library.
    pub fn rational(self) -> Rational {
        parse_number(&self.text()).expect("a fraction").to_rational()
    }

    /// `numerator/denominator`, as a model file takes it.
    pub fn text(self) -> String {
        format!("{}/{}", self.numerator, self.denominator)
    }

    /// The nearest float but for one rounding of numerator and denominator each.
    pub fn f64(self) -> f64 {
        self.numerator as f64 / self.denominator as f64
    }
}

impl Add for Q {
    type Output = Q;
    fn add(self, other: Q) -> Q {
        let common = gcd(self.denominator, other.denominator);
        let left = self.numerator.checked_mul(other.denominator / common).expect("overflow");
        let right = other.numerator.checked_mul(self.denominator / common).expect("overflow");
        let denominator = (self.denominator / common).checked_mul(other.denominator).expect("overflow");
        frac(left.checked_add(right).expect("overflow"), denominator)
    }
}

impl Mul for Q {
    type Output = Q;
    fn mul(self, other: Q) -> Q {
        let (left, right) = (frac(self.numerator, other.denominator), frac(other.numerator, self.denominator));
        Q {
            numerator: left.numerator.checked_mul(right.numerator).expect("overflow"),
            denominator: left.denominator.checked_mul(right.denominator).expect("overflow"),
        }
    }
}

impl Neg for Q {
    type Output = Q;
    fn neg(self) -> Q {
        Q { numerator: -self.numerator, denominator: self.denominator }
    }
}

impl Sub for Q {
    type Output = Q;
    fn sub(self, other: Q) -> Q {
        self + -other
    }
}

impl Div for Q {
    type Output = Q;
    fn div(self, other: Q) -> Q {
        self.mul(frac(other.denominator, other.numerator))
    }
}

/// Solves a dense system by Gauss elimination with partial pivoting and one step of refinement.
pub fn solve(matrix: &[Vec<f64>], right: &[f64]) -> Vec<f64> {
    let eliminate = |b: &[f64]| {
        let n = b.len();
        let mut a: Vec<Vec<f64>> = matrix.iter().zip(b).map(|(row, x)| [row.as_slice(), &[*x]].concat()).collect();
        for k in 0..n {
            let pivot = (k..n).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs())).expect("rows are left");
            a.swap(k, pivot);
            assert!(a[k][k] != 0.0, "singular matrix in a test");
            for i in k + 1..n {
                let factor = a[i][k] / a[k][k];
                for j in k..=n {
                    a[i][j] -= factor * a[k][j];
                }
            }
        }
        let mut x = vec![0.0; n];
        for i in (0..n).rev() {
            let known: f64 = (i + 1..n).map(|j| a[i][j] * x[j]).sum();
            x[i] = (a[i][n] - known) / a[i][i];
        }
        x
    };
    let mut x = eliminate(right);
    let left: Vec<f64> = matrix.iter().zip(right).map(|(row, b)| b - dot(row, &x)).collect();
    x.iter_mut().zip(eliminate(&left)).for_each(|(x, correction)| *x += correction);
    x
}

/// The inner product.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// The explicit form at one point: accelerations of the coordinates, all shafts and the constraint torques.
pub struct Explicit {
    /// q̈_r, rad/s².
    pub reduced: Vec<f64>,
    /// q̈ = K q̈_r + k, rad/s².
    pub shafts: Vec<f64>,
    /// τ_c, one entry per shaft, N m.
    pub force: Vec<f64>,
}

/// Evaluates `H_r q̈_r = F_r τ − h_r` \[diss. (4.23)\] and (4.36) with the library, at the point of the last update.
///
/// `frictions` are the torques along the friction directions, positive in the sense of their motion.
pub fn explicit(reduced: &Reduced, dynamics: &Dynamics, work: &Work, inputs: &[f64], frictions: &[f64]) -> Explicit {
    let r = dynamics.degrees_of_freedom;
    let mut acceleration = work.passive.clone();
    for i in 0..r {
        acceleration[i] += (0..inputs.len()).map(|k| inputs[k] * work.input_rows[k * r + i]).sum::<f64>();
        acceleration[i] -= (0..frictions.len()).map(|k| frictions[k] * work.friction_rows[k * r + i]).sum::<f64>();
    }
    work.factor.solve(&mut acceleration);
    let n = reduced.equations.coordinates.len();
    let shafts: Vec<f64> =
        (0..n).map(|s| dot(work.kinematics.row(s), &acceleration) + work.kinematics.bias[s]).collect();
    let force = constraint_force(reduced, work, &shafts, inputs, frictions);
    Explicit { reduced: acceleration, shafts, force }
}

/// `τ_c = H q̈ + D q̇ + S q + friction − F τ` \[diss. (4.36)\] over all shafts, N m, from their accelerations.
fn constraint_force(reduced: &Reduced, work: &Work, shafts: &[f64], inputs: &[f64], frictions: &[f64]) -> Vec<f64> {
    let (equations, kinematics) = (&reduced.equations, &work.kinematics);
    let mut out = vec![0.0; shafts.len()];
    let mut add = |row: &[(usize, f64)], torque: f64| row.iter().for_each(|(shaft, c)| out[*shaft] += torque * c);
    let along = |row: &[(usize, f64)], x: &[f64]| row.iter().map(|(shaft, c)| c * x[*shaft]).sum::<f64>();
    for term in &equations.inertias {
        let row = term.row_f64();
        add(&row, term.value.to_f64() * along(&row, shafts));
    }
    for term in &equations.dampers {
        let row = term.row_f64();
        add(&row, term.value.to_f64() * along(&row, &kinematics.speeds));
    }
    for term in &equations.springs {
        let row = term.row_f64();
        let twist = along(&row, &kinematics.angles) - term.value.rest.to_f64();
        add(&row, term.value.stiffness.to_f64() * twist);
    }
    for ((_, row), torque) in equations.set_valued().zip(frictions) {
        row.iter().for_each(|(shaft, c)| add(&[(*shaft, c.to_f64().value())], *torque));
    }
    for (term, torque) in equations.inputs.iter().zip(inputs) {
        add(&term.row_f64(), -torque);
    }
    out
}

/// A matrix of exact fractions.
pub type Exact = Vec<Vec<Q>>;

/// `a · b`.
pub fn product(a: &Exact, b: &Exact) -> Exact {
    let entry = |row: &Vec<Q>, j: usize| row.iter().zip(b).fold(int(0), |sum, (x, other)| sum + *x * other[j]);
    a.iter().map(|row| (0..b[0].len()).map(|j| entry(row, j)).collect()).collect()
}

/// `a − b`.
pub fn difference(a: &Exact, b: &Exact) -> Exact {
    a.iter().zip(b).map(|(x, y)| x.iter().zip(y).map(|(x, y)| *x - *y).collect()).collect()
}

/// `aᵀ`.
pub fn transposed(a: &Exact) -> Exact {
    (0..a[0].len()).map(|j| a.iter().map(|row| row[j]).collect()).collect()
}

/// A matrix with the entries given on its diagonal.
pub fn diagonal(entries: &[Q]) -> Exact {
    (0..entries.len()).map(|i| (0..entries.len()).map(|j| if i == j { entries[i] } else { int(0) }).collect()).collect()
}

/// `a⁻¹` by Gauss-Jordan elimination.
pub fn inverse(a: &Exact) -> Exact {
    let n = a.len();
    let unit = diagonal(&vec![int(1); n]);
    let mut work: Exact = a.iter().zip(&unit).map(|(row, unit)| [row.as_slice(), unit].concat()).collect();
    for k in 0..n {
        let pivot = (k..n).find(|&i| work[i][k] != int(0)).expect("a regular matrix");
        work.swap(k, pivot);
        let scale = work[k][k];
        work[k].iter_mut().for_each(|x| *x = *x / scale);
        for i in 0..n {
            let factor = work[i][k];
            if i != k && factor != int(0) {
                for j in 0..2 * n {
                    work[i][j] = work[i][j] - factor * work[k][j];
                }
            }
        }
    }
    work.into_iter().map(|row| row[n..].to_vec()).collect()
}

/// Every entry as a float.
pub fn floats(a: &Exact) -> Vec<Vec<f64>> {
    a.iter().map(|row| row.iter().map(|x| x.f64()).collect()).collect()
}
