use kardan_rt::functions::exp;

use super::Coefficient;
use super::extra::{Extra, ExtraDirection};
use super::teeth::Teeth;
use crate::assemble::{CoefficientKind as Kind, DirectionalTerm, SpringLaw};
use crate::num::{Matrix, dot, echelon};
use crate::reduce::{Kinematics, LawTorques, Reduced, linearise};

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

/// Variances of the measurements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Variances<'a> {
    /// Of the torques of the inputs, (N m)².
    pub torques: &'a [f64],
    /// Of reduced coordinates, their speeds and accelerations.
    pub position: &'a [f64],
    /// (rad/s)²
    pub speed: &'a [f64],
    /// (rad/s²)²
    pub acceleration: &'a [f64],
}

/// A term: its direction over the shafts, its relaxed angle (of a spring).
struct Term {
    row: Vec<(usize, f64)>,
    rest: f64,
}

impl Term {
    fn projection(&self, of: &[f64]) -> f64 {
        self.row.iter().map(|(shaft, a)| a * of[*shaft]).sum()
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
    /// Torques given by expressions: their directions, their formulas, and the open parameters with the values of the file.
    laws: Vec<Vec<(usize, f64)>>,
    law_torques: LawTorques,
    law_values: Vec<f64>,
    /// Harmonics on which these laws depend, and their values.
    law_harmonics: Vec<usize>,
    law_waves: Vec<f64>,
    teeth: Vec<Teeth>,
    /// Backlashes: the direction of each, and its cut.
    plays: Vec<Teeth>,
    /// Current gear loads: T and the sign of the speed along them; none where unknown.
    carried: Vec<Option<[f64; 2]>>,
    /// Inputs with unmeasured torques and independent directions.
    unmeasured: Vec<usize>,
    /// Reflections that rotate their directions into the first rows.
    reflections: Vec<Vec<f64>>,
    extras: Vec<Extra>,
    /// Whether unknown values of gear losses and backlashes are NaN and the window counts nevertheless.
    lenient: bool,
    /// Location of a motion in the logs: its recording, the time since its start (s), and the harmonics of angles there.
    recording: usize,
    time: f64,
    /// Clock reading of the logs, s.
    clock: f64,
    harmonics: Vec<f64>,
    /// Nominal coefficients of the terms of each kind, for the covariance.
    nominal: [Vec<f64>; 4],
    /// Row by row: X, extra columns, y, and the contribution of the noise of each measured quantity.
    all: Vec<f64>,
    width: usize,
    direction: Vec<f64>,
    accelerations: Vec<f64>,
    /// Speeds below which the sign of each friction counts as unknown, rad/s.
    rest_speeds: Vec<f64>,
    /// Half the time over which the sign must stay the same, s.
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
        let plain = |row: Vec<(usize, f64)>| Term { row, rest: 0.0 };
        let spring = |term: &DirectionalTerm<SpringLaw>| Term { row: term.row_f64(), rest: term.value.rest.to_f64() };
        let terms: [Vec<Term>; 4] = [
            equations.inertias.iter().map(|term| plain(term.row_f64())).collect(),
            equations.dampers.iter().map(|term| plain(term.row_f64())).collect(),
            equations.springs.iter().map(spring).collect(),
            equations.frictions.iter().map(|term| plain(term.row_f64())).collect(),
        ];
        let fixed = super::coefficients(reduced).into_iter().flat_map(|one| {
            let Coefficient { kind, terms, value, .. } = one;
            terms.into_iter().map(move |term| (kind as usize, term, value))
        });
        let is_fitted = |kind: usize, term: usize| {
            coefficients.iter().any(|one| one.kind as usize == kind && one.terms.contains(&term))
        };
        let values = |kind: Kind, count: usize| {
            let mut out = vec![0.0; count];
            super::coefficients(reduced)
                .iter()
                .filter(|one| one.kind == kind)
                .for_each(|one| one.terms.iter().for_each(|&term| out[term] = one.value));
            out
        };
        let nominal = [
            values(Kind::Inertia, equations.inertias.len()),
            values(Kind::Damping, equations.dampers.len()),
            values(Kind::Stiffness, equations.springs.len()),
            values(Kind::Friction, equations.frictions.len()),
        ];
        let width = coefficients.len() + 1 + equations.inputs.len() + 3 * reduced.degrees_of_freedom();
        Self {
            fixed: fixed.filter(|(kind, term, value)| *value != 0.0 && !is_fitted(*kind, *term)).collect(),
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
            law_torques: law_torques_of(reduced),
            law_values: Vec::new(),
            law_harmonics: Vec::new(),
            law_waves: Vec::new(),
            teeth: Vec::new(),
            plays: Vec::new(),
            carried: Vec::new(),
            extras: Vec::new(),
            lenient: false,
            recording: 0,
            time: 0.0,
            clock: 0.0,
            harmonics: Vec::new(),
            nominal,
            all: vec![0.0; reduced.degrees_of_freedom() * width],
            width,
            direction: vec![0.0; reduced.degrees_of_freedom()],
            accelerations: vec![0.0; equations.coordinates.len()],
            kinematics: Kinematics::new(reduced),
            terms,
            rest_speeds: vec![rest_speed; equations.frictions.len()],
            half: 0.0,
            error_columns: None,
        }
    }

    /// The same with the effect of errors of the measured motion on the rows, by column; after [`Self::with_extras`]. [`Self::errors`] then
    /// fills it, and [`super::Samples::with_errors`] requests it.
    pub fn with_errors(mut self) -> Self {
        let motion = |(column, (kind, _)): (usize, &(usize, Vec<usize>))| {
            (*kind != Kind::Friction as usize).then_some((column, *kind))
        };
        let error_columns: Vec<(usize, usize)> = self.coefficients.iter().enumerate().filter_map(motion).collect();
        self.width += self.inputs.len() + (3 + error_columns.len()) * self.degrees_of_freedom;
        self.all = vec![0.0; self.degrees_of_freedom * self.width];
        self.error_columns = Some(error_columns);
        self
    }

    /// The columns with computed errors.
    pub fn error_columns(&self) -> Option<&[(usize, usize)]> {
        self.error_columns.as_deref()
    }

    /// Slopes of the errors at the motion of the last [`Self::fill_weighted`], in the order of [`super::Errors::slopes`].
    ///
    /// # Panics
    /// If the length does not match.
    pub fn errors(&self, slopes: &mut [f64]) {
        let Some(error_columns) = &self.error_columns else { return };
        let (r, n, rows) = (self.degrees_of_freedom, self.width, self.rows());
        let fixed_columns = self.inputs.len() + 3 * r;
        let first = self.columns() + 1 + fixed_columns;
        let (of_fixed, of_columns) = slopes.split_at_mut(rows * fixed_columns);
        for i in 0..rows {
            let row = &self.all[(r - rows + i) * n + first..(r - rows + i + 1) * n];
            of_fixed[i * fixed_columns..(i + 1) * fixed_columns].copy_from_slice(&row[..fixed_columns]);
            for k in 0..error_columns.len() {
                of_columns[(k * rows + i) * r..][..r].copy_from_slice(&row[fixed_columns + k * r..][..r]);
            }
        }
    }

    /// The same with more columns, after those of the coefficients.
    ///
    /// # Panics
    /// If a number is not that of a friction, a spring or an input.
    pub fn with_extras(mut self, extras: &[Extra]) -> Self {
        for extra in extras {
            let exists = match extra.direction() {
                ExtraDirection::Friction(k) => k < self.terms[Kind::Friction as usize].len(),
                ExtraDirection::Spring(k) => k < self.terms[Kind::Stiffness as usize].len(),
                ExtraDirection::Input(k) => k < self.inputs.len(),
                ExtraDirection::Teeth(k) => k < self.teeth.len(),
                ExtraDirection::Laws => true,
            };
            assert!(exists, "a friction, a spring, an input or a gear of the model");
            assert!(
                !matches!(extra, Extra::Load { input, .. } if *input >= self.inputs.len()),
                "an input of the model"
            );
        }
        let fitted = |extra: &Extra, k: usize| matches!(extra, Extra::Stribeck { friction } if *friction == k);
        self.stribeck.retain(|(k, ..)| !extras.iter().any(|extra| fitted(extra, *k)));
        self.width += extras.len();
        self.width -= self.extras.len();
        self.extras = extras.to_vec();
        let all = extras.iter().filter_map(Extra::harmonic).chain(self.law_harmonics.iter().copied());
        let harmonics = all.max().map_or(0, |most| most + 1);
        self.harmonics = vec![0.0; harmonics];
        self.all = vec![0.0; self.degrees_of_freedom * self.width];
        self
    }

    /// The same with torques of expressions with open parameters, at these values for the propagated noise, and the numbers of the
    /// harmonics that they use; before [`Self::with_extras`].
    pub fn with_laws(mut self, torques: LawTorques, values: &[f64], harmonics: &[usize]) -> Self {
        self.law_torques = torques;
        self.law_values = values.to_vec();
        self.law_harmonics = harmonics.to_vec();
        self.law_waves = vec![0.0; harmonics.len()];
        self
    }

    /// The same with load-dependent gear losses; before [`Self::with_extras`].
    pub fn with_teeth(mut self, teeth: Vec<Teeth>) -> Self {
        self.carried = vec![None; teeth.len()];
        self.teeth = teeth;
        self
    }

    /// The same, but windows with unknown gear losses and backlashes count: their columns are NaN.
    pub fn lenient(mut self, lenient: bool) -> Self {
        self.lenient = lenient;
        self
    }

    /// The same with backlashes, whose torques are among the unmeasured ones.
    pub fn with_plays(mut self, plays: Vec<Teeth>) -> Self {
        self.plays = plays;
        self
    }

    /// The angle of a backlash (rad) and the torque along it (N m) at the motion of the last [`Self::fill`], without the contribution of the columns to that
    /// torque, which `parts` receives: for each column by its value. `None` if the sign of a friction that enters it is unknown.
    ///
    /// # Panics
    /// If there is no such backlash, or not a part for each column.
    pub fn play(&self, play: usize, torques: &[f64], parts: &mut [f64]) -> Option<[f64; 2]> {
        assert!(parts.len() == self.columns(), "a part for each column");
        let own = &self.plays[play];
        let projection = |row: &[(usize, f64)]| row.iter().map(|(shaft, x)| x * own.cut[*shaft]).sum::<f64>();
        let mut fixed = self.cut(own, torques)?;
        parts.fill(0.0);
        let (of_terms, of_extras) = parts.split_at_mut(self.coefficients.len());
        for (part, (kind, terms)) in of_terms.iter_mut().zip(&self.coefficients) {
            for &term in terms {
                let lever = self.terms[*kind][term].projection(&own.cut);
                if lever != 0.0 {
                    let share = lever * self.signal(*kind, term)?;
                    *part += share;
                    fixed -= self.nominal[*kind][term] * share;
                }
            }
        }
        for (part, extra) in of_extras.iter_mut().zip(&self.extras) {
            let lever = match extra.direction() {
                ExtraDirection::Friction(k) => self.terms[Kind::Friction as usize][k].projection(&own.cut),
                ExtraDirection::Spring(k) => self.terms[Kind::Stiffness as usize][k].projection(&own.cut),
                ExtraDirection::Input(k) => projection(&self.inputs[k]),
                ExtraDirection::Teeth(k) => projection(&self.teeth[k].row),
                ExtraDirection::Laws => 0.0,
            };
            if lever != 0.0 {
                *part = lever * self.extra_signal(extra, torques)?;
            }
            if let Extra::Law { parameter } = *extra {
                for (law, row) in self.laws.iter().enumerate() {
                    let share = -projection(row) * self.law_torques.share(law, parameter);
                    *part += share;
                    fixed -= self.law_values[parameter] * share;
                }
            }
        }
        Some([own.projection(&self.kinematics.angles), fixed])
    }

    /// The same with a separate speed for each friction of the equations, below which its sign is unknown, rad/s.
    ///
    /// # Panics
    /// If there is not one for each.
    pub fn with_rest_speeds(mut self, speeds: &[f64]) -> Self {
        assert_eq!(speeds.len(), self.rest_speeds.len(), "one for each friction");
        self.rest_speeds.copy_from_slice(speeds);
        self
    }

    /// The same for means over a time (s): a sign is known if the speed does not change it over that time.
    pub fn with_window(mut self, width: f64) -> Self {
        self.half = width / 2.0;
        self
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
        self.coefficients.len() + self.extras.len()
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
        let (r, p, n) = (self.degrees_of_freedom, self.columns(), self.width);
        let rows = self.rows();
        assert!(x.len() == rows * p && y.len() == rows, "lengths of a regressor");
        for i in 0..rows {
            let row = &self.all[(r - rows + i) * n..(r - rows + i + 1) * n];
            x[i * p..(i + 1) * p].copy_from_slice(&row[..p]);
            y[i] = row[p];
        }
        certain
    }

    /// [`Self::fill`] with the covariance of the rows (rows × rows) that variances of the measurements give at the model's own values,
    /// and the speeds (rad/s, without sign) along the frictions of the extra columns.
    ///
    /// # Panics
    /// If a length does not fit.
    pub fn fill_weighted(
        &mut self,
        motion: Motion<'_>,
        torques: &[f64],
        variances: Variances<'_>,
        (x, y): (&mut [f64], &mut [f64]),
        (covariance, speeds): (&mut [f64], &mut [f64]),
    ) -> bool {
        let certain = self.collect(motion, torques, Some(variances));
        let (r, p, n) = (self.degrees_of_freedom, self.columns(), self.width);
        let rows = self.rows();
        let lengths = x.len() == rows * p && y.len() == rows && covariance.len() == rows * rows;
        assert!(lengths && speeds.len() == self.extras.len(), "lengths of a regressor");
        let row = |i: usize| &self.all[(r - rows + i) * n..(r - rows + i + 1) * n];
        let noise = p + 1 + self.inputs.len() + 3 * r;
        for i in 0..rows {
            x[i * p..(i + 1) * p].copy_from_slice(&row(i)[..p]);
            y[i] = row(i)[p];
            for j in 0..rows {
                covariance[i * rows + j] = dot(&row(i)[p + 1..noise], &row(j)[p + 1..noise]);
            }
        }
        for (speed, extra) in speeds.iter_mut().zip(&self.extras) {
            *speed = match extra.direction() {
                ExtraDirection::Friction(k) => {
                    self.terms[Kind::Friction as usize][k].projection(&self.kinematics.speeds).abs()
                }
                _ => 0.0,
            };
        }
        certain
    }

    /// Fills [`Self::all`] and rotates its rows; whether all signs are known.
    fn collect(&mut self, motion: Motion<'_>, torques: &[f64], variances: Option<Variances<'_>>) -> bool {
        let (r, n, w) = (self.degrees_of_freedom, self.width, self.coefficients.len());
        let p = w + self.extras.len();
        assert!(torques.len() == self.inputs.len(), "a torque for each input");
        self.kinematics.update(motion.position, motion.speed);
        for (shaft, acceleration) in self.accelerations.iter_mut().enumerate() {
            *acceleration = dot(self.kinematics.row(shaft), motion.acceleration) + self.kinematics.bias[shaft];
        }
        self.all.fill(0.0);
        for (input, (row, torque)) in self.inputs.iter().zip(torques).enumerate() {
            if !self.unmeasured.contains(&input) {
                project(row, &self.kinematics, &mut self.direction);
                (0..r).for_each(|i| self.all[i * n + p] += torque * self.direction[i]);
                if let Some(variances) = variances {
                    let spread = variances.torques[input].sqrt();
                    (0..r).for_each(|i| self.all[i * n + p + 1 + input] = spread * self.direction[i]);
                }
            }
        }
        let mut certain = self.take_laws();
        self.carry(torques);
        certain &= self.fill_terms();
        certain &= self.fill_extras(torques);
        certain &= self.fill_fixed();
        if let Some(variances) = variances {
            self.fill_spreads(variances);
            self.fill_slopes();
        }
        self.eliminate();
        certain
    }

    /// The columns of the coefficients; whether all signs are known.
    fn fill_terms(&mut self) -> bool {
        let (r, n) = (self.degrees_of_freedom, self.width);
        let mut certain = true;
        for (column, (kind, terms)) in self.coefficients.iter().enumerate() {
            for &term in terms {
                let signal = self.signal(*kind, term);
                let term = &self.terms[*kind][term];
                certain &= signal.is_some();
                project(&term.row, &self.kinematics, &mut self.direction);
                (0..r).for_each(|i| self.all[i * n + column] += self.direction[i] * signal.unwrap_or(0.0));
            }
        }
        certain
    }

    /// The extra columns.
    fn fill_extras(&mut self, torques: &[f64]) -> bool {
        let (r, n, w) = (self.degrees_of_freedom, self.width, self.coefficients.len());
        let mut certain = true;
        for (column, extra) in self.extras.iter().enumerate() {
            let mut signal = self.extra_signal(extra, torques);
            if self.lenient && matches!(extra, Extra::Backlash { .. } | Extra::Teeth { .. }) {
                signal = signal.or(Some(f64::NAN));
            }
            certain &= signal.is_some();
            if let Extra::Law { parameter } = *extra {
                for (law, row) in self.laws.iter().enumerate() {
                    let share = self.law_torques.share(law, parameter);
                    project(row, &self.kinematics, &mut self.direction);
                    (0..r).for_each(|i| self.all[i * n + w + column] -= self.direction[i] * share);
                }
                continue;
            }
            let row = match extra.direction() {
                ExtraDirection::Friction(k) => &self.terms[Kind::Friction as usize][k].row,
                ExtraDirection::Spring(k) => &self.terms[Kind::Stiffness as usize][k].row,
                ExtraDirection::Input(k) => &self.inputs[k],
                ExtraDirection::Teeth(k) => &self.teeth[k].row,
                ExtraDirection::Laws => continue,
            };
            project(row, &self.kinematics, &mut self.direction);
            (0..r).for_each(|i| self.all[i * n + w + column] = self.direction[i] * signal.unwrap_or(0.0));
        }
        certain
    }

    /// Known terms, in y.
    fn fill_fixed(&mut self) -> bool {
        let (r, n, p) = (self.degrees_of_freedom, self.width, self.columns());
        let mut certain = true;
        for &(kind, term, value) in &self.fixed {
            let signal = self.signal(kind, term);
            let term = &self.terms[kind][term];
            certain &= signal.is_some();
            project(&term.row, &self.kinematics, &mut self.direction);
            let torque = value * signal.unwrap_or(0.0);
            (0..r).for_each(|i| self.all[i * n + p] -= torque * self.direction[i]);
        }
        for &(friction, excess, scale) in &self.stribeck {
            let sign = self.signal(Kind::Friction as usize, friction);
            let term = &self.terms[Kind::Friction as usize][friction];
            certain &= sign.is_some();
            let ratio = term.projection(&self.kinematics.speeds) / scale;
            project(&term.row, &self.kinematics, &mut self.direction);
            let torque = excess * exp(-ratio * ratio) * sign.unwrap_or(0.0);
            (0..r).for_each(|i| self.all[i * n + p] -= torque * self.direction[i]);
        }
        for (law, row) in self.laws.iter().enumerate() {
            let torque = self.law_torques.torque(law);
            project(row, &self.kinematics, &mut self.direction);
            (0..r).for_each(|i| self.all[i * n + p] += torque * self.direction[i]);
        }
        for k in 0..self.teeth.len() {
            let lost = self.lost(k);
            certain &= lost.is_some();
            project(&self.teeth[k].row, &self.kinematics, &mut self.direction);
            (0..r).for_each(|i| self.all[i * n + p] -= lost.unwrap_or(0.0) * self.direction[i]);
        }
        certain
    }

    /// Contribution of the noise of each measured quantity to the rows.
    fn fill_spreads(&mut self, variances: Variances<'_>) {
        let (r, n, p) = (self.degrees_of_freedom, self.width, self.columns());
        let first = p + 1 + self.inputs.len();
        let of = [variances.acceleration, variances.speed, variances.position];
        for (kind, variance) in of.iter().enumerate() {
            for (term, value) in self.terms[kind].iter().zip(&self.nominal[kind]) {
                project(&term.row, &self.kinematics, &mut self.direction);
                for k in 0..r {
                    let share = value * self.direction[k] * variance[k].sqrt();
                    (0..r).for_each(|i| self.all[i * n + first + kind * r + k] += share * self.direction[i]);
                }
            }
        }
        for (law, row) in self.laws.iter().enumerate() {
            project(row, &self.kinematics, &mut self.direction);
            for (shaft, by_speed, slope) in self.law_torques.slopes(law) {
                let (kind, variance) = if by_speed { (1, variances.speed) } else { (2, variances.position) };
                for k in 0..r {
                    let share = slope * self.kinematics.row(shaft)[k] * variance[k].sqrt();
                    (0..r).for_each(|i| self.all[i * n + first + kind * r + k] -= share * self.direction[i]);
                }
            }
        }
    }

    /// Contribution of errors of the torques and of the motion to y − Xθ, through known terms and through each column.
    fn fill_slopes(&mut self) {
        let Some(error_columns) = &self.error_columns else { return };
        let (r, n, m) = (self.degrees_of_freedom, self.width, self.inputs.len());
        let first = self.columns() + 1 + m + 3 * r;
        for input in (0..m).filter(|input| !self.unmeasured.contains(input)) {
            project(&self.inputs[input], &self.kinematics, &mut self.direction);
            (0..r).for_each(|i| self.all[i * n + first + input] = self.direction[i]);
        }
        let fixed = self.fixed.iter().filter(|(kind, ..)| *kind != Kind::Friction as usize);
        let fixed = fixed.map(|(kind, term, value)| (m + kind * r, *kind, *term, *value));
        let sought = error_columns.iter().enumerate().flat_map(|(k, (column, kind))| {
            self.coefficients[*column].1.iter().map(move |term| (m + (3 + k) * r, *kind, *term, 1.0))
        });
        for (place, kind, term, value) in fixed.chain(sought) {
            project(&self.terms[kind][term].row, &self.kinematics, &mut self.direction);
            for (i, k) in (0..r).flat_map(|i| (0..r).map(move |k| (i, k))) {
                self.all[i * n + first + place + k] -= value * self.direction[i] * self.direction[k];
            }
        }
        for (law, row) in self.laws.iter().enumerate() {
            project(row, &self.kinematics, &mut self.direction);
            for (shaft, by_speed, slope) in self.law_torques.slopes(law) {
                let place = first + m + if by_speed { r } else { 2 * r };
                for (i, k) in (0..r).flat_map(|i| (0..r).map(move |k| (i, k))) {
                    self.all[i * n + place + k] += slope * self.kinematics.row(shaft)[k] * self.direction[i];
                }
            }
        }
    }

    /// Torques given by expressions at this motion; whether none jumps in the window.
    fn take_laws(&mut self) -> bool {
        let Kinematics { angles, speeds, .. } = &self.kinematics;
        let waves = self.law_waves.iter_mut().zip(&self.law_harmonics);
        waves.for_each(|(wave, harmonic)| *wave = self.harmonics[*harmonic]);
        self.law_torques.update(angles, speeds, self.clock, [0.0; 2], &self.law_waves);
        self.law_torques.is_smooth(self.half, speeds, &self.accelerations)
    }

    /// The gear loads, with unknown coefficients at the values of the file.
    fn carry(&mut self, torques: &[f64]) {
        for k in 0..self.teeth.len() {
            let own = &self.teeth[k];
            let speed = own.projection(&self.kinematics.speeds);
            let certain = speed.abs() > own.rest_speed + self.half * own.projection(&self.accelerations).abs();
            self.carried[k] = match own.row.is_empty() {
                true => Some([0.0, 1.0]),
                false => self.cut(own, torques).filter(|_| certain).map(|carried| [carried, speed.signum()]),
            };
        }
    }

    /// T of a cut; `None` if the sign of a friction that enters it is unknown.
    fn cut(&self, own: &Teeth, torques: &[f64]) -> Option<f64> {
        let mut carried = 0.0;
        for (kind, terms) in self.terms.iter().enumerate() {
            for (number, term) in terms.iter().enumerate() {
                let (lever, value) = (term.projection(&own.cut), self.nominal[kind][number]);
                if lever != 0.0 && value != 0.0 {
                    carried += lever * value * self.signal(kind, number)?;
                }
            }
        }
        let projection = |row: &[(usize, f64)]| row.iter().map(|(shaft, x)| x * own.cut[*shaft]).sum::<f64>();
        for (input, row) in self.inputs.iter().enumerate().filter(|(input, _)| !self.unmeasured.contains(input)) {
            carried -= projection(row) * torques[input];
        }
        for (law, row) in self.laws.iter().enumerate() {
            let open = self.law_values.iter().enumerate().map(|(k, value)| value * self.law_torques.share(law, k));
            carried -= projection(row) * (self.law_torques.torque(law) + open.sum::<f64>());
        }
        Some(carried)
    }

    /// Gear loads at the motion of the last [`Self::fill`] and the sign of the speed along them; none where unknown.
    pub fn carried(&self) -> &[Option<[f64; 2]>] {
        &self.carried
    }

    /// Gear losses, with the values of the file.
    fn lost(&mut self, teeth: usize) -> Option<f64> {
        if self.teeth[teeth].loses_nothing() {
            return Some(0.0);
        }
        let [carried, sign] = self.carried[teeth]?;
        let speed = self.teeth[teeth].projection(&self.kinematics.speeds).abs();
        let own = &mut self.teeth[teeth];
        let back = carried * sign > 0.0;
        let part = own.share_of_cut(own.fixed[usize::from(back)], back) * carried.abs();
        let Kinematics { angles, speeds, .. } = &self.kinematics;
        let besides = own.loss.as_mut().map_or(0.0, |loss| {
            loss.update(angles, speeds, self.clock, [carried.abs(), speed], &[]);
            loss.torque(0)
        });
        Some(sign * (part + besides))
    }

    /// Rotates the rows so that unmeasured torques act on the first ones only (Householder).
    fn eliminate(&mut self) {
        let (r, n) = (self.degrees_of_freedom, self.width);
        for k in 0..self.unmeasured.len() {
            let (before, rest) = self.reflections.split_at_mut(k);
            let own = &mut rest[0];
            project(&self.inputs[self.unmeasured[k]], &self.kinematics, own);
            for (first, reflection) in before.iter().enumerate() {
                let share = 2.0 * dot(&reflection[first..], &own[first..]);
                own[first..].iter_mut().zip(&reflection[first..]).for_each(|(x, v)| *x -= share * v);
            }
            own[..k].fill(0.0);
            let norm = dot(own, own).sqrt();
            own[k] += if own[k] > 0.0 { norm } else { -norm };
            let size = dot(own, own).sqrt();
            if size > 0.0 {
                own.iter_mut().for_each(|x| *x /= size);
            }
            for column in 0..n {
                let share = 2.0 * (k..r).map(|i| own[i] * self.all[i * n + column]).sum::<f64>();
                (k..r).for_each(|i| self.all[i * n + column] -= share * own[i]);
            }
        }
    }

    /// s of an extra column; `None` if a sign that it needs is unknown.
    fn extra_signal(&self, extra: &Extra, torques: &[f64]) -> Option<f64> {
        let sign = |friction: usize| self.signal(Kind::Friction as usize, friction);
        let speed = |friction: usize| self.terms[Kind::Friction as usize][friction].projection(&self.kinematics.speeds);
        Some(match *extra {
            Extra::Stribeck { friction } => sign(friction)?,
            Extra::Load { friction, input } => sign(friction)? * torques[input].abs(),
            Extra::Sense { .. } | Extra::Offset { .. } => 1.0,
            Extra::SenseDamping { friction } => sign(friction)? * speed(friction),
            Extra::Quadratic { friction } => sign(friction)? * speed(friction) * speed(friction),
            Extra::Recording { friction, recording, last } => {
                let of = |number: usize| f64::from(u8::from(self.recording == number));
                sign(friction)? * (of(recording) - of(last))
            }
            Extra::Drift { friction } => sign(friction)? * self.time,
            Extra::Cogging { harmonic, .. } => self.harmonics[harmonic],
            Extra::Ripple { friction, harmonic } => sign(friction)? * self.harmonics[harmonic],
            Extra::Backlash { spring, clear } => {
                let term = &self.terms[Kind::Stiffness as usize][spring];
                let twist = term.projection(&self.kinematics.angles) - term.rest;
                let change = self.half * term.projection(&self.kinematics.speeds).abs();
                (twist.abs() > clear + change).then(|| -twist.signum())?
            }
            Extra::Teeth { teeth, back } => {
                let [carried, sign] = self.carried[teeth]?;
                if (carried * sign > 0.0) == back { sign * carried.abs() } else { 0.0 }
            }
            Extra::Law { .. } => 0.0,
        })
    }

    /// s of a term; `None` for a friction with an unknown sign.
    fn signal(&self, kind: usize, number: usize) -> Option<f64> {
        let term = &self.terms[kind][number];
        let projection = |of: &[f64]| term.projection(of);
        if kind == Kind::Inertia as usize {
            return Some(projection(&self.accelerations));
        }
        if kind == Kind::Stiffness as usize {
            return Some(projection(&self.kinematics.angles) - term.rest);
        }
        let speed = projection(&self.kinematics.speeds);
        if kind == Kind::Damping as usize {
            return Some(speed);
        }
        let change = self.half * projection(&self.accelerations).abs();
        (speed.abs() > self.rest_speeds[number] + change).then(|| speed.signum())
    }
}

/// The laws of torques of a model, with all parameters known.
fn law_torques_of(reduced: &Reduced) -> LawTorques {
    let formulas: Vec<_> = reduced.equations.laws.iter().map(|law| law.value.as_ref()).collect();
    LawTorques::new(reduced, &formulas, &[], &[]).expect("no parameter is open")
}

/// `g = Kᵀa`
fn project(row: &[(usize, f64)], kinematics: &Kinematics, out: &mut [f64]) {
    out.fill(0.0);
    for (shaft, a) in row {
        out.iter_mut().zip(kinematics.row(*shaft)).for_each(|(g, k)| *g += a * k);
    }
}
