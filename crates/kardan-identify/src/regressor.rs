//! The torque balance as a linear equation in the coefficients of a model.

mod rows;
mod signals;

use super::Coefficient;
use super::extra::{Extra, ExtraFriction};
use super::samples::Room;
use super::teeth::Teeth;
use kardan_math::num::{Matrix, dot, echelon};
use kardan_mechanics::assemble::{CoefficientKind as Kind, TermCoefficient};
use kardan_mechanics::reduce::{Kinematics, LawTorques, Reduced, linearise};

/// Motion of a plant: reduced coordinates (rad), their speeds (rad/s) and accelerations (rad/s²).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion<'a> {
    /// q_r
    pub position: &'a [f64],
    /// q̇_r
    pub speed: &'a [f64],
    /// q̈_r
    pub acceleration: &'a [f64],
}

/// Torques of expressions, some of whose parameters are open.
#[derive(Debug, Clone)]
pub struct OpenLaws {
    /// The torques.
    pub torques: LawTorques,
    /// The values of the open parameters for the propagated noise.
    pub values: Vec<f64>,
    /// The numbers of the harmonics that they use.
    pub harmonics: Vec<usize>,
}

/// What a regressor contains besides the coefficients of a model.
pub struct RegressorOptions {
    /// Further columns, after those of the coefficients.
    pub extras: Vec<Extra>,
    /// Torques of expressions.
    pub laws: OpenLaws,
    /// Load-dependent gear losses.
    pub teeth: Vec<Teeth>,
    /// Backlashes, whose torques are among the unmeasured ones.
    pub backlashes: Vec<Teeth>,
    /// Whether windows with unknown gear losses and backlashes count: their columns are NaN.
    pub lenient: bool,
    /// Time of a mean, s: a sign is known if the speed does not change it over that time.
    pub window: f64,
    /// The speed of each friction below which its sign is unknown, rad/s.
    pub rest_speeds: Vec<f64>,
    /// Whether samples contain the effect of errors of the measured motion.
    pub errors: bool,
}

/// A term: its direction over the shafts, its relaxed angle (of a spring), and its coefficient in the model.
struct Term {
    row: Vec<(usize, f64)>,
    rest: f64,
    nominal: f64,
}

impl Term {
    fn projection(&self, of: &[f64]) -> f64 {
        along(&self.row, of)
    }
}

/// The torque balance as a linear equation `X θ = y` in coefficients of a model, at any motion:
/// each term with the direction a and the coefficient c contributes `c g s` with `g = Kᵀa` and
/// `s = aᵀφ̈` (inertia), `aᵀφ̇` (damping), `aᵀφ − rest` (stiffness), `sgn aᵀφ̇` (Coulomb friction) to the reduced torques
/// `Σ Kᵀb τ` of the inputs \[diss. (6.28), (6.39), general\]. Coefficients that are not requested enter y with their values.
pub struct Regressor {
    kinematics: Kinematics,
    degrees_of_freedom: usize,
    /// Terms of each kind.
    terms: [Vec<Term>; 4],
    coefficients: Vec<(usize, Vec<usize>)>,
    /// Coefficients that are known: kind, term, value.
    fixed: Vec<(usize, usize, f64)>,
    /// Stribeck friction that is known: friction, c_b − c, v_s.
    stribeck: Vec<(usize, f64, f64)>,
    inputs: Vec<Vec<(usize, f64)>>,
    /// Directions of the torques given by expressions.
    laws: Vec<Vec<(usize, f64)>>,
    /// Values of the harmonics on which these depend.
    law_waves: Vec<f64>,
    options: RegressorOptions,
    /// Current gear loads: T and the sign of the speed along them; none where unknown.
    carried: Vec<Option<[f64; 2]>>,
    /// Inputs with unmeasured torques and independent directions.
    unmeasured: Vec<usize>,
    /// Reflections that rotate their directions into the first rows.
    reflections: Vec<Vec<f64>>,
    /// Location of a motion in the logs: its recording, the time since its start (s), and the harmonics of angles there.
    recording: usize,
    time: f64,
    /// Clock reading of the logs, s.
    clock: f64,
    harmonics: Vec<f64>,
    /// Row by row: X, extra columns, y, and the contribution of the noise of each measured quantity.
    all: Vec<f64>,
    width: usize,
    direction: Vec<f64>,
    accelerations: Vec<f64>,
    /// Half the time over which a sign must stay the same, s.
    half: f64,
    /// Columns with computed errors, with the part of the motion that they multiply.
    error_columns: Option<Vec<(usize, usize)>>,
}

impl Regressor {
    /// The regressor of a model for these coefficients, all others as known. Torques of the inputs `unmeasured` (numbers in the
    /// equations) are eliminated, which removes a row for each independent one. Below `rest_speed` (rad/s) along a direction with
    /// friction its sign is unknown.
    ///
    /// # Panics
    /// If a number is not that of an input.
    pub fn new(reduced: &Reduced, coefficients: &[Coefficient], unmeasured: &[usize], rest_speed: f64) -> Self {
        let equations = &reduced.equations;
        let input = linearise(reduced, &vec![0.0; reduced.degrees_of_freedom()]).input;
        let columns = Matrix::from_fn(input.rows(), unmeasured.len(), |i, j| input[(i, unmeasured[j])].clone());
        let independent = echelon(&columns, &(0..unmeasured.len()).collect::<Vec<_>>()).pivots;
        let unmeasured: Vec<usize> = independent.into_iter().map(|k| unmeasured[k]).collect();
        let mut terms: [Vec<Term>; 4] = [const { Vec::new() }; 4];
        for TermCoefficient { kind, term, row, value, .. } in equations.coefficients() {
            let rest = if kind == Kind::Stiffness { equations.springs[term].value.rest.to_f64() } else { 0.0 };
            terms[kind as usize].push(Term { row, rest, nominal: value });
        }
        let mut fixed = Vec::new();
        for Coefficient { kind, terms, value, .. } in super::coefficients(reduced) {
            for term in terms {
                let is_fitted = coefficients.iter().any(|one| one.kind == kind && one.terms.contains(&term));
                if value != 0.0 && !is_fitted {
                    fixed.push((kind as usize, term, value));
                }
            }
        }
        let formulas: Vec<_> = equations.laws.iter().map(|law| law.value.as_ref()).collect();
        let torques = LawTorques::new(reduced, &formulas, &[], &[]).expect("no parameter is open");
        let options = RegressorOptions {
            extras: Vec::new(),
            laws: OpenLaws { torques, values: Vec::new(), harmonics: Vec::new() },
            teeth: Vec::new(),
            backlashes: Vec::new(),
            lenient: false,
            window: 0.0,
            rest_speeds: vec![rest_speed; equations.frictions.len()],
            errors: false,
        };
        let width = coefficients.len() + 1 + equations.inputs.len() + 3 * reduced.degrees_of_freedom();
        Self {
            fixed,
            stribeck: equations
                .frictions
                .iter()
                .enumerate()
                .filter_map(|(k, term)| {
                    let found = term.value.stribeck.as_ref()?;
                    Some((k, found.breakaway.to_f64() - term.value.torque.to_f64(), found.speed.to_f64()))
                })
                .collect(),
            coefficients: coefficients.iter().map(|one| (one.kind as usize, one.terms.clone())).collect(),
            inputs: equations.inputs.iter().map(|input| input.row_f64()).collect(),
            degrees_of_freedom: reduced.degrees_of_freedom(),
            reflections: vec![vec![0.0; reduced.degrees_of_freedom()]; unmeasured.len()],
            unmeasured,
            laws: equations.laws.iter().map(|law| law.row_f64()).collect(),
            law_waves: Vec::new(),
            options,
            carried: Vec::new(),
            recording: 0,
            time: 0.0,
            clock: 0.0,
            harmonics: Vec::new(),
            all: vec![0.0; reduced.degrees_of_freedom() * width],
            width,
            direction: vec![0.0; reduced.degrees_of_freedom()],
            accelerations: vec![0.0; equations.coordinates.len()],
            kinematics: Kinematics::new(reduced),
            terms,
            half: 0.0,
            error_columns: None,
        }
    }

    /// The columns with computed errors.
    pub fn error_columns(&self) -> Option<&[(usize, usize)]> {
        self.error_columns.as_deref()
    }

    /// Slopes of the errors at the motion of the last [`Self::fill_sample`], in the order of [`super::Errors::slopes`].
    fn copy_slopes(&self, slopes: &mut [f64]) {
        let Some(error_columns) = &self.error_columns else { return };
        let (r, rows) = (self.degrees_of_freedom, self.rows());
        let fixed_columns = self.inputs.len() + 3 * r;
        let first = self.columns() + 1 + fixed_columns;
        let (of_fixed, of_columns) = slopes.split_at_mut(rows * fixed_columns);
        for i in 0..rows {
            let row = &self.row(i)[first..];
            of_fixed[i * fixed_columns..(i + 1) * fixed_columns].copy_from_slice(&row[..fixed_columns]);
            for k in 0..error_columns.len() {
                of_columns[(k * rows + i) * r..][..r].copy_from_slice(&row[fixed_columns + k * r..][..r]);
            }
        }
    }

    /// The same with further columns, laws, gear losses and backlashes.
    ///
    /// # Panics
    /// If a number is not that of a friction, a spring, an input or a gear, or a friction has no speed of rest.
    pub fn with(mut self, options: RegressorOptions) -> Self {
        let RegressorOptions { extras, laws, teeth, .. } = &options;
        assert_eq!(options.rest_speeds.len(), self.options.rest_speeds.len(), "one for each friction");
        for extra in extras {
            let exists = match *extra {
                Extra::Friction { law: ExtraFriction::Load(input), .. } if input >= self.inputs.len() => false,
                Extra::Friction { friction, .. } => friction < self.terms[Kind::Friction as usize].len(),
                Extra::Backlash { spring, .. } => spring < self.terms[Kind::Stiffness as usize].len(),
                Extra::Offset { input } => input < self.inputs.len(),
                Extra::Teeth { teeth: number, .. } => number < teeth.len(),
                Extra::Law { .. } => true,
            };
            assert!(exists, "a friction, a spring, an input or a gear of the model");
        }
        let fitted = |k: usize| Extra::Friction { friction: k, law: ExtraFriction::Stribeck };
        self.stribeck.retain(|(k, ..)| !extras.contains(&fitted(*k)));
        self.law_waves = vec![0.0; laws.harmonics.len()];
        let harmonics = extras.iter().filter_map(Extra::harmonic).chain(laws.harmonics.iter().copied());
        self.harmonics = vec![0.0; harmonics.max().map_or(0, |most| most + 1)];
        self.carried = vec![None; teeth.len()];
        self.width += extras.len();
        self.half = options.window / 2.0;
        if options.errors {
            let kinds = self.coefficients.iter().map(|(kind, _)| *kind).enumerate();
            let error_columns: Vec<_> = kinds.filter(|(_, kind)| *kind != Kind::Friction as usize).collect();
            self.width += self.inputs.len() + (3 + error_columns.len()) * self.degrees_of_freedom;
            self.error_columns = Some(error_columns);
        }
        self.all = vec![0.0; self.degrees_of_freedom * self.width];
        self.options = options;
        self
    }

    /// The angle of a backlash (rad) and the torque along it (N m) at the motion of the last [`Self::fill`], without the contribution of the columns to that
    /// torque, which `parts` receives: for each column by its value. `None` if the sign of a friction that enters it is unknown.
    ///
    /// # Panics
    /// If there is no such backlash, or not a part for each column.
    pub fn backlash(&self, backlash: usize, torques: &[f64], parts: &mut [f64]) -> Option<[f64; 2]> {
        assert!(parts.len() == self.columns(), "a part for each column");
        let RegressorOptions { extras, laws, backlashes, .. } = &self.options;
        let own = &backlashes[backlash];
        let mut fixed = self.cut(own, torques)?;
        parts.fill(0.0);
        let (of_terms, of_extras) = parts.split_at_mut(self.coefficients.len());
        for (part, (kind, terms)) in of_terms.iter_mut().zip(&self.coefficients) {
            for &term in terms {
                let lever = self.terms[*kind][term].projection(&own.cut);
                if lever != 0.0 {
                    let share = lever * self.signal(*kind, term)?;
                    *part += share;
                    fixed -= self.terms[*kind][term].nominal * share;
                }
            }
        }
        for (part, extra) in of_extras.iter_mut().zip(extras) {
            let lever = along(direction(extra, &self.terms, &self.inputs, &self.options.teeth), &own.cut);
            if lever != 0.0 {
                *part = lever * self.extra_signal(extra, torques)?;
            }
            if let Extra::Law { parameter } = *extra {
                for (law, row) in self.laws.iter().enumerate() {
                    let share = -along(row, &own.cut) * laws.torques.share(law, parameter);
                    *part += share;
                    fixed -= laws.values[parameter] * share;
                }
            }
        }
        Some([own.projection(&self.kinematics.angles), fixed])
    }

    /// Location of the next motion in the logs, for extra columns and laws that need it: its recording, the time since its start and its clock
    /// reading (s), and the harmonics of angles there by their numbers.
    ///
    /// # Panics
    /// If there are fewer harmonics than extra columns need.
    pub fn at(&mut self, recording: usize, [time, clock]: [f64; 2], harmonics: &[f64]) {
        (self.recording, self.time, self.clock) = (recording, time, clock);
        let count = self.harmonics.len();
        self.harmonics.copy_from_slice(&harmonics[..count]);
    }

    /// Number of rows of one motion: the degrees of freedom, less one for each independent unmeasured torque.
    pub fn rows(&self) -> usize {
        self.degrees_of_freedom - self.unmeasured.len()
    }

    /// Number of columns: the requested coefficients, and the additional columns.
    pub fn columns(&self) -> usize {
        self.coefficients.len() + self.options.extras.len()
    }

    /// Fills X (rows × columns, row by row) and y at a motion under torques of all inputs, N m, in the order of the equations;
    /// the values for unmeasured ones are irrelevant.
    ///
    /// False, and neither is to be used, if the sign of a Coulomb friction is unknown there: it sticks, or nearly. Allocates
    /// nothing.
    ///
    /// # Panics
    /// If a length does not fit.
    pub fn fill(&mut self, motion: Motion<'_>, torques: &[f64], x: &mut [f64], y: &mut [f64]) -> bool {
        let certain = self.collect(motion, torques, None);
        self.copy_rows(x, y);
        certain
    }

    /// A row that remains after the elimination.
    fn row(&self, number: usize) -> &[f64] {
        let at = (self.unmeasured.len() + number) * self.width;
        &self.all[at..at + self.width]
    }

    /// Copies the rows that remain to X and y.
    fn copy_rows(&self, x: &mut [f64], y: &mut [f64]) {
        let (rows, p) = (self.rows(), self.columns());
        assert!(x.len() == rows * p && y.len() == rows, "lengths of a regressor");
        for i in 0..rows {
            x[i * p..(i + 1) * p].copy_from_slice(&self.row(i)[..p]);
            y[i] = self.row(i)[p];
        }
    }

    /// [`Self::fill`] for a sample, with the covariance of the rows (rows × rows) that variances of the measurements, in the order of
    /// [`super::Errors::variances`], give at the model's own values; the speeds (rad/s, without sign) along the frictions of the
    /// extra columns; and the errors, where stored.
    ///
    /// # Panics
    /// If a length does not fit.
    pub fn fill_sample(&mut self, motion: Motion<'_>, torques: &[f64], variances: &[f64], room: Room<'_>) -> bool {
        let certain = self.collect(motion, torques, Some(variances));
        let Room { x, y, covariance, speeds, errors } = room;
        self.copy_rows(x, y);
        if let Some((slopes, spread)) = errors {
            self.copy_slopes(slopes);
            spread.copy_from_slice(variances);
        }
        let (rows, first, extras) = (self.rows(), self.columns() + 1, &self.options.extras);
        assert!(covariance.len() == rows * rows && speeds.len() == extras.len(), "lengths of a regressor");
        let noise = |i: usize| &self.row(i)[first..first + self.inputs.len() + 3 * self.degrees_of_freedom];
        for i in 0..rows {
            for j in 0..rows {
                covariance[i * rows + j] = dot(noise(i), noise(j));
            }
        }
        let frictions = &self.terms[Kind::Friction as usize];
        for (speed, extra) in speeds.iter_mut().zip(extras) {
            *speed = match extra {
                Extra::Friction { friction, .. } => frictions[*friction].projection(&self.kinematics.speeds).abs(),
                _ => 0.0,
            };
        }
        certain
    }

    /// Gear loads at the motion of the last [`Self::fill`] and the sign of the speed along them; none where unknown.
    pub fn carried(&self) -> &[Option<[f64; 2]>] {
        &self.carried
    }
}

/// The part of a quantity of the shafts along a direction.
fn along(row: &[(usize, f64)], of: &[f64]) -> f64 {
    row.iter().map(|(shaft, a)| a * of[*shaft]).sum()
}

/// The direction of an extra column over the shafts; empty for laws, each of which has its own.
fn direction<'a>(
    extra: &Extra,
    terms: &'a [Vec<Term>; 4],
    inputs: &'a [Vec<(usize, f64)>],
    teeth: &'a [Teeth],
) -> &'a [(usize, f64)] {
    match *extra {
        Extra::Backlash { spring, .. } => &terms[Kind::Stiffness as usize][spring].row,
        Extra::Offset { input } => &inputs[input],
        Extra::Teeth { teeth: number, .. } => &teeth[number].row,
        Extra::Friction { friction, .. } => &terms[Kind::Friction as usize][friction].row,
        Extra::Law { .. } => &[],
    }
}
