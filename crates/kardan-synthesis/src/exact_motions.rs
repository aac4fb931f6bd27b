//! The continuous loop over the rationals, and its poles at zero.

use std::sync::Arc;

use super::matrix_parts::{column_range, side_by_side, spread, stacked, window};
use super::sampled::{FirstOrderPlant, Places};
use super::{Law, LinearLaw, LoopPlant, SampledPart};
use kardan_analysis::{Plane, stability_of};
use kardan_math::num::{Matrix, Rational, Scalar, echelon, exact_rank};
use kardan_mechanics::reduce::LinearModel;
use kardan_results::StabilityVerdict;

/// States up to which the stability of a loop is decided exactly.
pub(super) const MOST: usize = 32;

/// The loop of laws in continuous time over the rationals, and what of it is exactly at zero.
///
/// `z = [q_r; q̇_r; torques of motors with a lag; states of the laws]`, of coordinates without inertia no rates. The plant is exact. So are the gains of a law that is
/// designed exactly and has no observer, of programs and of blocks; other gains are the fractions that their doubles are, and lags the shortest decimals
/// that read back as their doubles.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactMotions {
    /// F of `ż = F z`.
    pub matrix: Matrix<Rational>,
    /// A basis of what powers of F send to zero, columns over z: as many as eigenvalues exactly at zero.
    pub motions: Matrix<Rational>,
    /// How many of these are the same if the laws are sampled, whatever their clocks: the laws measure nothing of them
    /// that changes.
    pub sampled: usize,
    /// Whether all gains are those before rounding; if not, some are the fractions that their doubles are.
    pub before_rounding: bool,
    /// Whether the laws are designed exactly, so that modes at zero stay at zero.
    pub designed: bool,
    /// Whether no law commands anything along these motions: uncontrolled rigid-body modes.
    pub free: bool,
}

impl ExactMotions {
    /// How many eigenvalues are exactly at zero.
    pub fn zeros(&self) -> usize {
        self.motions.columns()
    }

    /// Whether the loop is stable, decided exactly for these gains; `None` above 32 states. A mode at zero is free where no law commands
    /// it, or a design leaves it there, and at most an angle grows, at constant speed.
    pub fn stability(&self) -> Option<StabilityVerdict> {
        if self.matrix.rows() > MOST {
            return None;
        }
        let mut found = stability_of(&self.matrix, Plane::Continuous);
        if found.border.is_empty() {
            return Some(found);
        }
        for motion in found.border.iter_mut().filter(|motion| motion.frequency == 0.0) {
            motion.uncontrolled = (self.free || self.designed) && motion.growth_exponent <= 1;
        }
        Some(StabilityVerdict::exact(false, found.border))
    }
}

/// The loop of a linear model, motors with these lags in s, and laws in continuous time, exactly.
///
/// `None` as of [`exact_motions_of`].
///
/// ```
/// use kardan_math::num::rational_to_f64;
/// use kardan_synthesis::exact_motions;
/// let source = kardan_model::builtin("two-bodies").unwrap().source;
/// let (prepared, _) = kardan::study::prepare(source);
/// let variant = &prepared.variants[0];
/// let model = kardan_mechanics::reduce::linearise(&variant.reduced, &vec![0.0; variant.reduced.degrees_of_freedom()]);
/// // Without a law both bodies rest wherever they are; their own damping takes their common speed away.
/// let found = exact_motions(&model, &vec![0.0; model.inputs.len()], &[]).unwrap();
/// assert_eq!(found.zeros(), 1);
/// ```
///
/// # Panics
/// If there is not one lag for each input, or a law names an input that is not there.
pub fn exact_motions(model: &LinearModel, lags: &[f64], laws: &[Arc<dyn Law>]) -> Option<ExactMotions> {
    let plant = LoopPlant::new(model, lags);
    let parts: Vec<SampledPart> = laws.iter().map(|law| SampledPart::of(&**law, &plant)).collect();
    exact_motions_of(&plant, &parts, laws)
}

/// The same of a loop as it runs: the parts of its laws first, in their order.
///
/// Eigenvalues at zero are counted by ranks: a staircase of kernels over the rationals, after a rank modulo a prime has shown
/// that there are some. `None` if a part has a sample time, the plant is not known before rounding, something else than a damper determines a coordinate without
/// inertia, or a number is not finite.
///
/// # Panics
/// If there are less parts than laws.
pub fn exact_motions_of(plant: &LoopPlant, parts: &[SampledPart], laws: &[Arc<dyn Law>]) -> Option<ExactMotions> {
    let finite = |part: &SampledPart| part.linear.is_finite();
    if parts.iter().any(|part| part.clock.is_some())
        || !parts.iter().all(finite)
        || !plant.lags.iter().all(|lag| lag.is_finite())
    {
        return None;
    }
    let own = |k: usize| laws.get(k).filter(|_| parts[k].reads.is_empty()).and_then(|law| designed(&**law, plant));
    let exact: Vec<Option<LinearLaw<Rational>>> = (0..parts.len()).map(own).collect();
    let designed = exact.iter().all(Option::is_some);
    let before_rounding = exact.iter().zip(parts).all(|(exact, part)| exact.is_some() || !part.is_rounded());
    let exactly = exact.into_iter().zip(parts).map(|(exact, part)| exact.unwrap_or_else(|| part.exactly())).collect();
    let places = Places::with(FirstOrderPlant::exact(plant)?, parts, exactly, false);
    let (matrix, commands) = places.flow();
    let n = matrix.rows();
    let motions = if exact_rank(&matrix) == n { Matrix::zeros(n, 0) } else { sent_to_zero(&matrix) };
    // What a law reads and commands, and its states, must not change along the motion: S Fᵏ z = 0, k ≥ 1.
    let signals = places.signals(&matrix);
    let mut moved = motions.clone();
    let mut changes = Vec::new();
    for _ in 0..motions.columns() {
        moved = matrix.multiply(&moved);
        changes.push(signals.multiply(&moved));
    }
    let changes = stacked(&changes.iter().collect::<Vec<_>>());
    let sampled = motions.columns() - if changes.rows() == 0 { 0 } else { exact_rank(&changes) };
    let free = commands.multiply(&motions).as_slice().iter().all(Scalar::is_zero);
    Some(ExactMotions { matrix, motions, sampled, before_rounding, designed, free })
}

/// A law that is designed exactly and has no observer, before its gains are rounded, over all shafts.
fn designed(law: &dyn Law, plant: &LoopPlant) -> Option<LinearLaw<Rational>> {
    let exact = law.exact()?.law?;
    let (shafts, moving) = (plant.basis.rows(), &plant.moving);
    let count = plant.basis.columns();
    if !law.sensors().is_empty() || exact.a.rows() != law.states().len() || exact.d.columns() != count + moving.len() {
        return None;
    }
    // The shaft that is a reduced coordinate itself.
    let is_unit = |shaft: usize, k: usize| (0..count).all(|j| plant.basis[(shaft, j)] == f64::from(u8::from(j == k)));
    let shaft = |k: usize| (0..shafts).find(|shaft| is_unit(*shaft, k));
    let places: Vec<usize> = (0..count).map(shaft).collect::<Option<_>>()?;
    let moving: Vec<usize> = moving.iter().map(|k| places[*k]).collect();
    let on_angles = |of: &Matrix<Rational>| spread(&column_range(of, 0..count), &places, shafts);
    let on_speeds = |of: &Matrix<Rational>| spread(&column_range(of, count..of.columns()), &moving, shafts);
    let states = exact.a.rows();
    let commands = exact.d.rows();
    Some(LinearLaw {
        angles: on_angles(&exact.b),
        speeds: on_speeds(&exact.b),
        disturbances: Matrix::zeros(states, 0),
        torques: Matrix::zeros(states, commands),
        on_states: exact.c,
        references: Matrix::zeros(states, 0),
        errors: Matrix::zeros(states, 0),
        states: exact.a,
        ..LinearLaw::gains(on_angles(&exact.d), on_speeds(&exact.d), Matrix::zeros(commands, 0))
    })
}

/// A basis of the generalised null space.
fn sent_to_zero(matrix: &Matrix<Rational>) -> Matrix<Rational> {
    let n = matrix.rows();
    let mut basis = Matrix::<Rational>::zeros(n, 0);
    loop {
        // F x = V y: as V is independent, x determines y.
        let k = basis.columns();
        let both = side_by_side(&[matrix, &basis.scale(&Rational::NEG_ONE)]);
        let order: Vec<usize> = (n..n + k).chain(0..n).collect();
        let kernel = echelon(&both, &order).kernel();
        if kernel.columns() == k {
            return basis;
        }
        basis = window(&kernel, 0..n, 0..kernel.columns());
    }
}
