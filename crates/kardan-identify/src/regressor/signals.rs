//! The signals that coefficients multiply at a motion: of terms, of extra columns, of torques by expressions and of gear loads.

use super::{Regressor, along};
use crate::extra::{Extra, ExtraFriction};
use crate::teeth::Teeth;
use kardan_mechanics::assemble::CoefficientKind as Kind;
use kardan_mechanics::reduce::Kinematics;

impl Regressor {
    /// s of a term; `None` for a friction with an unknown sign.
    pub(super) fn signal(&self, kind: usize, number: usize) -> Option<f64> {
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
        (speed.abs() > self.options.rest_speeds[number] + change).then(|| speed.signum())
    }

    /// s of an extra column; `None` if a sign that it needs is unknown.
    pub(super) fn extra_signal(&self, extra: &Extra, torques: &[f64]) -> Option<f64> {
        Some(match *extra {
            Extra::Friction { friction, law } => {
                let sign = self.signal(Kind::Friction as usize, friction);
                let speed = self.terms[Kind::Friction as usize][friction].projection(&self.kinematics.speeds);
                match law {
                    ExtraFriction::Stribeck => sign?,
                    ExtraFriction::Load(input) => sign? * torques[input].abs(),
                    ExtraFriction::Sense => 1.0,
                    ExtraFriction::SenseDamping => sign? * speed,
                    ExtraFriction::Quadratic => sign? * speed * speed,
                    ExtraFriction::Recording { recording, last } => {
                        let of = |number: usize| f64::from(u8::from(self.recording == number));
                        sign? * (of(recording) - of(last))
                    }
                    ExtraFriction::Drift => sign? * self.time,
                    ExtraFriction::Cogging(harmonic) => self.harmonics[harmonic],
                    ExtraFriction::Ripple(harmonic) => sign? * self.harmonics[harmonic],
                }
            }
            Extra::Offset { .. } => 1.0,
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

    /// Torques given by expressions at this motion; whether none jumps in the window.
    pub(super) fn take_laws(&mut self) -> bool {
        let Kinematics { angles, speeds, .. } = &self.kinematics;
        let laws = &mut self.options.laws;
        let waves = self.law_waves.iter_mut().zip(&laws.harmonics);
        waves.for_each(|(wave, harmonic)| *wave = self.harmonics[*harmonic]);
        laws.torques.update(angles, speeds, self.clock, [0.0; 2], &self.law_waves);
        laws.torques.is_smooth(self.half, speeds, &self.accelerations)
    }

    /// The gear loads, with unknown coefficients at the values of the file.
    pub(super) fn carry(&mut self, torques: &[f64]) {
        for k in 0..self.options.teeth.len() {
            let own = &self.options.teeth[k];
            let speed = own.projection(&self.kinematics.speeds);
            let certain = speed.abs() > own.rest_speed + self.half * own.projection(&self.accelerations).abs();
            self.carried[k] = match own.row.is_empty() {
                true => Some([0.0, 1.0]),
                false => self.cut(own, torques).filter(|_| certain).map(|carried| [carried, speed.signum()]),
            };
        }
    }

    /// T of a cut; `None` if the sign of a friction that enters it is unknown.
    pub(super) fn cut(&self, own: &Teeth, torques: &[f64]) -> Option<f64> {
        let mut carried = 0.0;
        for (kind, terms) in self.terms.iter().enumerate() {
            for (number, term) in terms.iter().enumerate() {
                let (lever, value) = (term.projection(&own.cut), term.nominal);
                if lever != 0.0 && value != 0.0 {
                    carried += lever * value * self.signal(kind, number)?;
                }
            }
        }
        for (input, row) in self.inputs.iter().enumerate().filter(|(input, _)| !self.unmeasured.contains(input)) {
            carried -= along(row, &own.cut) * torques[input];
        }
        let laws = &self.options.laws;
        for (law, row) in self.laws.iter().enumerate() {
            let open = laws.values.iter().enumerate().map(|(k, value)| value * laws.torques.share(law, k));
            carried -= along(row, &own.cut) * (laws.torques.torque(law) + open.sum::<f64>());
        }
        Some(carried)
    }

    /// Gear losses, with the values of the file.
    pub(super) fn lost(&mut self, teeth: usize) -> Option<f64> {
        let own = &mut self.options.teeth[teeth];
        if own.loss.is_none() && own.fixed == [0.0; 2] {
            return Some(0.0);
        }
        let [carried, sign] = self.carried[teeth]?;
        let speed = own.projection(&self.kinematics.speeds).abs();
        let back = carried * sign > 0.0;
        let part = own.share_of_cut(own.fixed[usize::from(back)], back) * carried.abs();
        let Kinematics { angles, speeds, .. } = &self.kinematics;
        let besides = own.loss.as_mut().map_or(0.0, |loss| {
            loss.update(angles, speeds, self.clock, [carried.abs(), speed], &[]);
            loss.torque(0)
        });
        Some(sign * (part + besides))
    }
}
