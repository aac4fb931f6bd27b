//! The rows of a regressor at a motion: columns, known terms, noise and errors, with unmeasured torques eliminated.

use kardan_rt::functions::exp;

use super::{Motion, Regressor, RegressorOptions, direction};
use crate::extra::Extra;
use kardan_math::num::dot;
use kardan_mechanics::assemble::CoefficientKind as Kind;

impl Regressor {
    /// Fills [`Self::all`] and rotates its rows; whether all signs are known.
    pub(super) fn collect(&mut self, motion: Motion<'_>, torques: &[f64], variances: Option<&[f64]>) -> bool {
        let (r, n, w) = (self.degrees_of_freedom, self.width, self.coefficients.len());
        let p = w + self.options.extras.len();
        assert!(torques.len() == self.inputs.len(), "a torque for each input");
        self.kinematics.update(motion.position, motion.speed);
        for (shaft, acceleration) in self.accelerations.iter_mut().enumerate() {
            *acceleration = dot(self.kinematics.row(shaft), motion.acceleration) + self.kinematics.bias[shaft];
        }
        self.all.fill(0.0);
        for (input, (row, torque)) in self.inputs.iter().zip(torques).enumerate() {
            if !self.unmeasured.contains(&input) {
                self.kinematics.project(row, &mut self.direction);
                (0..r).for_each(|i| self.all[i * n + p] += torque * self.direction[i]);
                if let Some(variances) = variances {
                    let spread = variances[input].sqrt();
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
                self.kinematics.project(&term.row, &mut self.direction);
                (0..r).for_each(|i| self.all[i * n + column] += self.direction[i] * signal.unwrap_or(0.0));
            }
        }
        certain
    }

    /// The extra columns.
    fn fill_extras(&mut self, torques: &[f64]) -> bool {
        let (r, n, w) = (self.degrees_of_freedom, self.width, self.coefficients.len());
        let mut certain = true;
        let RegressorOptions { extras, laws, teeth, lenient, .. } = &self.options;
        for (column, extra) in extras.iter().enumerate() {
            let mut signal = self.extra_signal(extra, torques);
            if *lenient && matches!(extra, Extra::Backlash { .. } | Extra::Teeth { .. }) {
                signal = signal.or(Some(f64::NAN));
            }
            certain &= signal.is_some();
            if let Extra::Law { parameter } = *extra {
                for (law, row) in self.laws.iter().enumerate() {
                    let share = laws.torques.share(law, parameter);
                    self.kinematics.project(row, &mut self.direction);
                    (0..r).for_each(|i| self.all[i * n + w + column] -= self.direction[i] * share);
                }
                continue;
            }
            self.kinematics.project(direction(extra, &self.terms, &self.inputs, teeth), &mut self.direction);
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
            self.kinematics.project(&term.row, &mut self.direction);
            let torque = value * signal.unwrap_or(0.0);
            (0..r).for_each(|i| self.all[i * n + p] -= torque * self.direction[i]);
        }
        for &(friction, excess, scale) in &self.stribeck {
            let sign = self.signal(Kind::Friction as usize, friction);
            let term = &self.terms[Kind::Friction as usize][friction];
            certain &= sign.is_some();
            let ratio = term.projection(&self.kinematics.speeds) / scale;
            self.kinematics.project(&term.row, &mut self.direction);
            let torque = excess * exp(-ratio * ratio) * sign.unwrap_or(0.0);
            (0..r).for_each(|i| self.all[i * n + p] -= torque * self.direction[i]);
        }
        for (law, row) in self.laws.iter().enumerate() {
            let torque = self.options.laws.torques.torque(law);
            self.kinematics.project(row, &mut self.direction);
            (0..r).for_each(|i| self.all[i * n + p] += torque * self.direction[i]);
        }
        for k in 0..self.options.teeth.len() {
            let lost = self.lost(k);
            certain &= lost.is_some();
            self.kinematics.project(&self.options.teeth[k].row, &mut self.direction);
            (0..r).for_each(|i| self.all[i * n + p] -= lost.unwrap_or(0.0) * self.direction[i]);
        }
        certain
    }

    /// Contribution of the noise of each measured quantity to the rows.
    fn fill_spreads(&mut self, variances: &[f64]) {
        let (r, n, p) = (self.degrees_of_freedom, self.width, self.columns());
        let first = p + 1 + self.inputs.len();
        // Of accelerations, speeds and positions.
        let of_motion = &variances[self.inputs.len()..];
        for (kind, terms) in self.terms[..3].iter().enumerate() {
            for term in terms {
                self.kinematics.project(&term.row, &mut self.direction);
                for k in 0..r {
                    let share = term.nominal * self.direction[k] * of_motion[kind * r + k].sqrt();
                    (0..r).for_each(|i| self.all[i * n + first + kind * r + k] += share * self.direction[i]);
                }
            }
        }
        for (law, row) in self.laws.iter().enumerate() {
            self.kinematics.project(row, &mut self.direction);
            for (shaft, by_speed, slope) in self.options.laws.torques.slopes(law) {
                let kind = if by_speed { 1 } else { 2 };
                for k in 0..r {
                    let share = slope * self.kinematics.row(shaft)[k] * of_motion[kind * r + k].sqrt();
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
            self.kinematics.project(&self.inputs[input], &mut self.direction);
            (0..r).for_each(|i| self.all[i * n + first + input] = self.direction[i]);
        }
        let fixed = self.fixed.iter().filter(|(kind, ..)| *kind != Kind::Friction as usize);
        let fixed = fixed.map(|(kind, term, value)| (m + kind * r, *kind, *term, *value));
        let sought = error_columns.iter().enumerate().flat_map(|(k, (column, kind))| {
            self.coefficients[*column].1.iter().map(move |term| (m + (3 + k) * r, *kind, *term, 1.0))
        });
        for (place, kind, term, value) in fixed.chain(sought) {
            self.kinematics.project(&self.terms[kind][term].row, &mut self.direction);
            for (i, k) in (0..r).flat_map(|i| (0..r).map(move |k| (i, k))) {
                self.all[i * n + first + place + k] -= value * self.direction[i] * self.direction[k];
            }
        }
        for (law, row) in self.laws.iter().enumerate() {
            self.kinematics.project(row, &mut self.direction);
            for (shaft, by_speed, slope) in self.options.laws.torques.slopes(law) {
                let place = first + m + if by_speed { r } else { 2 * r };
                for (i, k) in (0..r).flat_map(|i| (0..r).map(move |k| (i, k))) {
                    self.all[i * n + place + k] += slope * self.kinematics.row(shaft)[k] * self.direction[i];
                }
            }
        }
    }

    /// Rotates the rows so that unmeasured torques act on the first ones only (Householder).
    fn eliminate(&mut self) {
        let (r, n) = (self.degrees_of_freedom, self.width);
        for k in 0..self.unmeasured.len() {
            let (before, rest) = self.reflections.split_at_mut(k);
            let own = &mut rest[0];
            self.kinematics.project(&self.inputs[self.unmeasured[k]], own);
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
}
