use super::Coefficient;
use crate::assemble::CoefficientKind as Kind;
use crate::num::{Matrix, dot, echelon};
use crate::reduce::{Kinematics, Reduced, linearise};

/// Where a plant is, and how it moves: reduced coordinates (rad), their speeds (rad/s) and accelerations (rad/s²).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion<'a> {
    /// q_r
    pub position: &'a [f64],
    /// q̇_r
    pub speed: &'a [f64],
    /// q̈_r
    pub acceleration: &'a [f64],
}

/// A term: its direction over the shafts, its relaxed angle (of a spring).
struct Term {
    row: Vec<(usize, f64)>,
    rest: f64,
}

/// The torque balance as a linear equation `X θ = y` in coefficients of a model, at any motion:
/// each term with the direction a and the coefficient c contributes `c g s` with `g = Kᵀa` and
/// `s = aᵀφ̈` (inertia), `aᵀφ̇` (damping), `aᵀφ − rest` (stiffness), `sgn aᵀφ̇` (Coulomb friction) to the reduced torques
/// `Σ Kᵀb τ` of the inputs \[diss. (6.28), (6.39), general\]. Coefficients that are not asked for stand in y with their values.
pub struct Regressor {
    kinematics: Kinematics,
    freedoms: usize,
    /// Terms of each kind.
    terms: [Vec<Term>; 4],
    wanted: Vec<(usize, Vec<usize>)>,
    /// Coefficients that are known: kind, term, value.
    known: Vec<(usize, usize, f64)>,
    inputs: Vec<Vec<(usize, f64)>>,
    /// Inputs whose torques nobody measured, with independent directions.
    unmeasured: Vec<usize>,
    /// Reflections that turn their directions into the first rows.
    reflections: Vec<Vec<f64>>,
    all: Vec<f64>,
    direction: Vec<f64>,
    accelerations: Vec<f64>,
    /// Speed below which the sign of a friction is not taken, rad/s.
    rest_speed: f64,
}

impl Regressor {
    /// The regressor of a model for these coefficients, all others as known. Torques of the inputs `unmeasured` (numbers in the
    /// equations) are eliminated, which costs a row for each independent one. Below `rest_speed` (rad/s) along a direction with
    /// friction nobody knows its sign.
    ///
    /// # Panics
    /// If a number is not that of an input.
    pub fn new(reduced: &Reduced, wanted: &[Coefficient], unmeasured: &[usize], rest_speed: f64) -> Self {
        let equations = &reduced.equations;
        let input = linearise(reduced, &vec![0.0; reduced.freedoms()]).input;
        let columns = Matrix::from_fn(input.rows(), unmeasured.len(), |i, j| input[(i, unmeasured[j])].clone());
        let independent = echelon(&columns, &(0..unmeasured.len()).collect::<Vec<_>>()).pivots;
        let unmeasured: Vec<usize> = independent.into_iter().map(|k| unmeasured[k]).collect();
        let plain = |row: Vec<(usize, f64)>| Term { row, rest: 0.0 };
        let terms = [
            equations.inertias.iter().map(|term| plain(term.row_f64())).collect(),
            equations.dampers.iter().map(|term| plain(term.row_f64())).collect(),
            equations
                .springs
                .iter()
                .map(|term| Term { row: term.row_f64(), rest: term.value.rest.to_f64() })
                .collect::<Vec<_>>(),
            equations.frictions.iter().map(|term| plain(term.row_f64())).collect(),
        ];
        let known = super::coefficients(reduced).into_iter().flat_map(|one| {
            let Coefficient { kind, terms, value, .. } = one;
            terms.into_iter().map(move |term| (kind as usize, term, value))
        });
        let asked =
            |kind: usize, term: usize| wanted.iter().any(|one| one.kind as usize == kind && one.terms.contains(&term));
        Self {
            known: known.filter(|(kind, term, value)| *value != 0.0 && !asked(*kind, *term)).collect(),
            wanted: wanted.iter().map(|one| (one.kind as usize, one.terms.clone())).collect(),
            inputs: equations.inputs.iter().map(|input| input.row_f64()).collect(),
            freedoms: reduced.freedoms(),
            reflections: vec![vec![0.0; reduced.freedoms()]; unmeasured.len()],
            unmeasured,
            all: vec![0.0; reduced.freedoms() * (wanted.len() + 1)],
            direction: vec![0.0; reduced.freedoms()],
            accelerations: vec![0.0; equations.shafts.len()],
            kinematics: Kinematics::new(reduced),
            terms,
            rest_speed,
        }
    }

    /// Number of rows of one motion: the degrees of freedom, less one for each independent torque that nobody measured.
    pub fn rows(&self) -> usize {
        self.freedoms - self.unmeasured.len()
    }

    /// Number of columns: the coefficients asked for.
    pub fn columns(&self) -> usize {
        self.wanted.len()
    }

    /// Fills X (rows × columns, row by row) and y at a motion under torques of all inputs, N m, in the order of the equations;
    /// what stands for those that are not measured does not matter.
    ///
    /// False, and neither is to be used, if the sign of a Coulomb friction is not known there: it rests, or nearly. Allocates
    /// nothing.
    ///
    /// # Panics
    /// If a length does not fit.
    pub fn fill(&mut self, motion: Motion<'_>, torques: &[f64], x: &mut [f64], y: &mut [f64]) -> bool {
        let (r, p) = (self.freedoms, self.wanted.len());
        let (rows, n) = (self.rows(), p + 1);
        assert!(x.len() == rows * p && y.len() == rows && torques.len() == self.inputs.len(), "lengths of a regressor");
        self.kinematics.update(motion.position, motion.speed);
        for (shaft, acceleration) in self.accelerations.iter_mut().enumerate() {
            *acceleration = dot(self.kinematics.row(shaft), motion.acceleration) + self.kinematics.bias[shaft];
        }
        // [X y], row by row.
        self.all.fill(0.0);
        for (input, (row, torque)) in self.inputs.iter().zip(torques).enumerate() {
            if !self.unmeasured.contains(&input) {
                project(row, &self.kinematics, &mut self.direction);
                (0..r).for_each(|i| self.all[i * n + p] += torque * self.direction[i]);
            }
        }
        let mut certain = true;
        for (column, (kind, terms)) in self.wanted.iter().enumerate() {
            for &term in terms {
                let term = &self.terms[*kind][term];
                let signal = self.signal(*kind, term);
                certain &= signal.is_some();
                project(&term.row, &self.kinematics, &mut self.direction);
                (0..r).for_each(|i| self.all[i * n + column] += self.direction[i] * signal.unwrap_or(0.0));
            }
        }
        for &(kind, term, value) in &self.known {
            let term = &self.terms[kind][term];
            let signal = self.signal(kind, term);
            certain &= signal.is_some();
            project(&term.row, &self.kinematics, &mut self.direction);
            let torque = value * signal.unwrap_or(0.0);
            (0..r).for_each(|i| self.all[i * n + p] -= torque * self.direction[i]);
        }
        self.eliminate();
        for i in 0..rows {
            let row = &self.all[(r - rows + i) * n..(r - rows + i + 1) * n];
            x[i * p..(i + 1) * p].copy_from_slice(&row[..p]);
            y[i] = row[p];
        }
        certain
    }

    /// Turns the rows so that torques that nobody measured act on the first ones alone (Householder).
    fn eliminate(&mut self) {
        let (r, n) = (self.freedoms, self.wanted.len() + 1);
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

    /// s of a term; `None` for a friction whose sign is not known.
    fn signal(&self, kind: usize, term: &Term) -> Option<f64> {
        let along = |of: &[f64]| -> f64 { term.row.iter().map(|(shaft, a)| a * of[*shaft]).sum() };
        if kind == Kind::Inertia as usize {
            return Some(along(&self.accelerations));
        }
        if kind == Kind::Stiffness as usize {
            return Some(along(&self.kinematics.angles) - term.rest);
        }
        let speed = along(&self.kinematics.speeds);
        if kind == Kind::Damping as usize {
            return Some(speed);
        }
        (speed.abs() > self.rest_speed).then(|| speed.signum())
    }
}

/// `g = Kᵀa`
fn project(row: &[(usize, f64)], kinematics: &Kinematics, out: &mut [f64]) {
    out.fill(0.0);
    for (shaft, a) in row {
        out.iter_mut().zip(kinematics.row(*shaft)).for_each(|(g, k)| *g += a * k);
    }
}
