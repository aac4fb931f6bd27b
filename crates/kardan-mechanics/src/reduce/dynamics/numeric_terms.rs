//! The terms of a reduced model as floating-point numbers: directions with coefficients, friction limits, and what fails in a run.

use crate::assemble::{DirectionalTerm, Equations, FrictionLaw, Weakened};
use crate::reduce::Kinematics;

/// Directions of one kind of term over the shafts, as numbers.
#[derive(Debug, Clone)]
pub(super) struct Directions {
    pub(super) rows: Vec<Vec<(usize, f64)>>,
    pub(super) coefficients: Vec<f64>,
    pub(super) varying: Vec<usize>,
}

impl Directions {
    pub(super) fn new<T>(
        terms: &[DirectionalTerm<T>],
        coefficient: impl Fn(&T) -> f64,
        kinematics: &Kinematics,
    ) -> Self {
        let rows: Vec<Vec<(usize, f64)>> = terms.iter().map(DirectionalTerm::row_f64).collect();
        let is_varying = |row: &Vec<(usize, f64)>| row.iter().any(|(shaft, _)| kinematics.is_varying(*shaft));
        let varying: Vec<usize> = (0..rows.len()).filter(|&k| is_varying(&rows[k])).collect();
        let coefficients = terms.iter().map(|term| coefficient(&term.value)).collect();
        Self { rows, coefficients, varying }
    }

    /// These with others of the same kind behind them.
    fn and(mut self, appended: Self) -> Self {
        let first = self.rows.len();
        self.rows.extend(appended.rows);
        self.coefficients.extend(appended.coefficients);
        self.varying.extend(appended.varying.into_iter().map(|k| first + k));
        self
    }

    /// All rows in reduced coordinates, one after the other, at the position of the kinematics.
    pub(super) fn projected(&self, kinematics: &Kinematics, r: usize) -> Vec<f64> {
        let mut out = vec![0.0; self.rows.len() * r];
        for (row, out) in self.rows.iter().zip(out.chunks_exact_mut(r.max(1))) {
            kinematics.project(row, out);
        }
        out
    }
}

/// `Σ c x_shaft` over a row.
pub(super) fn row_dot(row: &[(usize, f64)], x: &[f64]) -> f64 {
    row.iter().map(|(shaft, c)| c * x[*shaft]).sum()
}

/// Springs and dampers of an element that fails in a run, by number: with stiffness and relaxed angle, and with
/// damping.
#[derive(Debug, Clone)]
pub(super) struct Fails {
    pub(super) weakened: Weakened,
    pub(super) springs: Vec<(usize, f64, f64)>,
    pub(super) dampers: Vec<(usize, f64)>,
}

impl Fails {
    pub(super) fn all(equations: &Equations) -> Vec<Self> {
        let of = |(element, weakened): (&String, &Weakened)| {
            let springs = equations.springs.iter().enumerate().filter(|(_, spring)| spring.element == *element);
            let dampers = equations.dampers.iter().enumerate().filter(|(_, damper)| damper.element == *element);
            Self {
                weakened: weakened.clone(),
                springs: springs.map(|(k, one)| (k, one.value.stiffness.to_f64(), one.value.rest.to_f64())).collect(),
                dampers: dampers.map(|(k, one)| (k, one.value.to_f64())).collect(),
            }
        };
        equations.failing.iter().map(of).collect()
    }
}

/// The stick limits of each friction direction, and of the multiplier constraints.
pub(super) fn breakaways(equations: &Equations) -> Vec<f64> {
    let breakaway = |friction: &DirectionalTerm<FrictionLaw>| {
        let FrictionLaw { torque, stribeck } = &friction.value;
        stribeck.as_ref().map_or(torque, |stribeck| &stribeck.breakaway).to_f64()
    };
    let frictions = equations.frictions.iter().map(breakaway).chain(equations.unilaterals.iter().map(|_| 0.0));
    frictions.chain(equations.multiplier_constraints.iter().map(|_| f64::INFINITY)).collect()
}

/// Directions of frictions and of unilateral constraints.
pub(super) fn set_valued(equations: &Equations, kinematics: &Kinematics) -> Directions {
    let unilaterals = Directions::new(&equations.unilaterals, |_| 0.0, kinematics);
    Directions::new(&equations.frictions, |x| x.torque.to_f64(), kinematics).and(unilaterals)
}

/// For each friction direction the excess of breakaway over sliding friction, and the speed over which it decays.
pub(super) fn falls(equations: &Equations, breakaways: &[f64], torques: &[f64]) -> Vec<(f64, f64)> {
    let speed =
        |friction: &DirectionalTerm<FrictionLaw>| friction.value.stribeck.as_ref().map_or(1.0, |s| s.speed.to_f64());
    let frictions = equations.frictions.iter().zip(breakaways).zip(torques);
    let frictions = frictions.map(|((friction, most), torque)| (most - torque, speed(friction)));
    frictions.chain(equations.unilaterals.iter().map(|_| (0.0, 1.0))).collect()
}
