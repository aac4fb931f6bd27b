//! Selection of the fitted samples of the logs, and the fit.

use super::extra::{ExtraTerm, Law};
use super::numbers::short;
use super::plant::{Columns, Plant, columns};
use super::request::FitRequest;
use super::rows::{Built, Material, rows, settled};
use kardan_identify::{Excitation, Fit, FitOptions, Samples, cross_validate, fit};
use kardan_mechanics::assemble::CoefficientKind as Kind;
use kardan_results::WindowCount;
use kardan_schema::diagnostics::Diagnostic;

/// The automatic choice takes steady segments if they have this many rows per parameter, and at least this fraction of the windows.
const PLENTY: usize = 3;
const RARE: usize = 5;
/// Folds of the cross-validation.
const FOLDS: usize = 5;
/// Blocks of consecutive windows per fold.
const BLOCKS: usize = 20;

/// The fitted samples of the logs, and the reason for the choice.
pub(super) struct Chosen {
    pub method: Excitation,
    pub columns: Columns,
    pub built: Built,
    /// The steady segments, where these are fitted.
    steady: Option<Samples>,
    pub notes: Vec<String>,
    /// Contradictions between logs and model, independent of the fit.
    pub warnings: Vec<String>,
}

impl Chosen {
    /// The samples of a model; at the places of others, with the covariances there, where given.
    pub fn new(
        method: Excitation,
        plant: &Plant,
        request: &FitRequest,
        material: &Material<'_>,
        aligned: Option<&Samples>,
    ) -> Self {
        let columns = columns(plant, request, method);
        let mut built = rows(plant, request, &columns, material);
        if let Some(reference) = aligned {
            built.samples = built.samples.aligned(reference);
        }
        let steady = (method == Excitation::Steady).then(|| settled(&built, request, material.window));
        Self { method, columns, built, steady, notes: Vec::new(), warnings: Vec::new() }
    }

    /// The fitted samples.
    pub fn samples(&self) -> &Samples {
        self.steady.as_ref().unwrap_or(&self.built.samples)
    }

    pub fn into_samples(self) -> Samples {
        self.steady.unwrap_or(self.built.samples)
    }

    /// Counts of the windows.
    pub fn windows(&self) -> WindowCount {
        let used = self.samples().windows.iter().sum();
        let moving = if self.method == Excitation::Steady { self.built.samples.len() - used } else { 0 };
        WindowCount { unsteady: moving, used, ..self.built.count }
    }

    pub fn fit_options(&self, request: &FitRequest) -> FitOptions {
        let nonnegative = |name: &String| request.nonnegative.contains(name);
        let identifiable = self.columns.identified().map(|one| nonnegative(&one.name));
        FitOptions {
            loss: request.loss,
            nonnegative: identifiable
                .chain(request.extras.iter().map(|extra| nonnegative(&extra.name) || nonnegative(&extra.term)))
                .collect(),
            shapes: request.extras.iter().map(ExtraTerm::shape).collect(),
            serial: self.method == Excitation::Free,
        }
    }

    /// The fit of all samples.
    pub fn fit(&self, options: &FitOptions) -> Result<Fit, Vec<Diagnostic>> {
        let all: Vec<usize> = (0..self.samples().len()).collect();
        let finite = |fit: &Fit| {
            let is_determined = |(x, error): (&f64, &f64)| x.is_finite() && !(error.is_nan() && *x != 0.0);
            fit.scale.is_finite() && fit.values.iter().zip(&fit.standard_errors).all(is_determined)
        };
        fit(self.samples(), &all, options).filter(finite).ok_or_else(|| vec![too_large()])
    }
}

/// Chooses between segments of constant speed and all windows, unless the user chose, and builds the rows.
pub(super) fn choose(plant: &Plant, request: &FitRequest, material: &Material<'_>) -> Result<Chosen, Vec<Diagnostic>> {
    let by = |method: Excitation| Chosen::new(method, plant, request, material, None);
    let needed = |chosen: &Chosen| chosen.columns.identifiable.len() + 2 * request.extras.len();
    let enough = |chosen: &Chosen, samples: &Samples| samples.len() * samples.rows > needed(chosen);
    let over_angle = |extra: &ExtraTerm| matches!(extra.law, Law::Parameter { over_angle: true, .. });
    let inertial = request.unknowns.iter().any(|one| matches!(one.keys[0].1, Kind::Inertia | Kind::Stiffness))
        || request.extras.iter().any(over_angle);
    let mut chosen = by(request.method.unwrap_or(if inertial { Excitation::Free } else { Excitation::Steady }));
    let samples = chosen.samples();
    let plenty = samples.len() * samples.rows >= PLENTY * needed(&chosen)
        && samples.windows.iter().sum::<usize>() >= chosen.built.samples.len() / RARE;
    let free = request.method.is_none() && chosen.method == Excitation::Steady;
    if free && !plenty && enough(&chosen, &chosen.built.samples) {
        let note = format!(
            "the logs have {} segments of constant speed, few for {} parameters: kardan uses all samples, with filtered derivatives \
             (`--method steady` uses the segments only)",
            samples.len(),
            needed(&chosen)
        );
        chosen = by(Excitation::Free);
        chosen.notes.push(note);
    }
    if chosen.columns.identifiable.is_empty() && request.extras.is_empty() {
        let message = "a log of this kind identifies none of the requested parameters";
        let help = match chosen.method {
            Excitation::Steady => "at constant speed all accelerations are zero: use `--method dynamic`",
            Excitation::Free => "they do not enter the torque balance of the moving parts",
        };
        return Err(vec![Diagnostic::error("identify::structure", message).help(help)]);
    }
    if !enough(&chosen, chosen.samples()) {
        return Err(vec![too_little(&chosen, needed(&chosen), material.window)]);
    }
    Ok(chosen)
}

/// Cross-validated predictions, sample by sample, row by row; and the fold of each sample.
pub(super) fn cross_validated(
    samples: &Samples,
    method: Excitation,
    options: &FitOptions,
) -> (Option<Vec<f64>>, Vec<usize>) {
    let folds = folds(samples, method);
    (cross_validate(samples, &folds, options), folds)
}

/// The fold of each sample: segments in turn, or blocks of windows that follow each other.
fn folds(samples: &Samples, method: Excitation) -> Vec<usize> {
    let n = samples.len();
    let folds = FOLDS.min(n);
    (0..n)
        .map(|k| if method == Excitation::Steady { k % folds } else { (k * folds * BLOCKS / n.max(1)) % folds })
        .collect()
}

fn too_little(chosen: &Chosen, needed: usize, window: f64) -> Diagnostic {
    let (count, steady) = (&chosen.built.count, chosen.method == Excitation::Steady);
    let message = format!(
        "{} {} are too few for {needed} parameters: of {} windows of {} s, {} lack samples of a channel, and in {} a \
         friction sticks or its sign is unknown",
        chosen.samples().len(),
        if steady { "segments of constant speed" } else { "windows" },
        count.all,
        short(window),
        count.incomplete,
        count.sticking,
    );
    let help = if steady {
        "use `--method dynamic`, a wider `steady_tolerance`, or a shorter `--window`; or request fewer parameters"
    } else {
        "log longer, use a shorter `--window`, lower `rest_speed`, or request fewer parameters"
    };
    Diagnostic::error("identify::too-few-samples", message).help(help)
}

fn too_large() -> Diagnostic {
    Diagnostic::error("identify::overflow", "the logs contain numbers too large to compute with").help(
        "check units and factors of the channels, and whether a large number marks a missing reading (leave such a reading \
         empty)",
    )
}
