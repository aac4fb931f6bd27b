//! Lagrange multipliers of all constraints from the constraint torques of the shafts, in floating point.

use std::sync::Arc;

use kardan::equations::Curve;
use kardan::num::{Lu, Rational, rational_to_f64};
use kardan::reduce::{Kinematics, Reduced};

/// One row of the constraint Jacobian J.
#[derive(Debug, Clone)]
enum Row {
    Linear(Vec<(usize, f64)>),
    Curve { driven: usize, driving: usize, curve: Arc<dyn Curve> },
}

/// Lagrange multipliers of all constraints, `τ_c = Jᵀλ` \[diss. (4.18)\], by element name.
///
/// Linear constraints come first, transmissions after them, each kind sorted by element name; linear constraints that
/// follow from others come last, and the torques that these share with them are split as [`Reduced::split`] defines.
/// The multiplier of a transmission is the torque on its driven shaft.
#[derive(Debug, Clone)]
pub struct Multipliers {
    /// The element of each constraint.
    pub elements: Vec<String>,
    rows: Vec<Row>,
    dependents: Vec<usize>,
    matrix: Vec<f64>,
    solver: Lu,
    /// Each multiplier as a combination of those that the independent rows would have alone; empty if all rows are
    /// independent.
    split: Vec<Vec<(usize, f64)>>,
}

impl Multipliers {
    /// Prepares the constraints of a reduced model.
    pub fn new(reduced: &Reduced) -> Self {
        let equations = &reduced.equations;
        let linear = equations.constraints.iter().map(|c| (c.element.clone(), Row::Linear(c.row_f64())));
        let curves = equations.transmissions.iter().map(|t| {
            (t.element.clone(), Row::Curve { driven: t.driven, driving: t.driving, curve: Arc::clone(&t.curve) })
        });
        let redundant =
            reduced.redundant.iter().map(|r| (r.constraint.element.clone(), Row::Linear(r.constraint.row_f64())));
        let (elements, rows): (Vec<String>, Vec<Row>) = linear.chain(curves).chain(redundant).unzip();
        let count = rows.len() - reduced.redundant.len();
        let shares = |row: Vec<(usize, Rational)>| row.iter().map(|(k, x)| (*k, rational_to_f64(x))).collect();
        let split = match count == rows.len() {
            true => Vec::new(),
            false => reduced.split(count).into_iter().map(shares).collect(),
        };
        Self {
            elements,
            rows,
            dependents: reduced.dependents(),
            matrix: vec![0.0; count * count],
            solver: Lu::new(count),
            split,
        }
    }

    /// Coefficient of a shaft in a constraint, at the current position.
    pub fn coefficient(&self, constraint: usize, shaft: usize, kinematics: &Kinematics) -> f64 {
        match &self.rows[constraint] {
            Row::Linear(row) => row.iter().find(|(s, _)| *s == shaft).map_or(0.0, |(_, c)| *c),
            Row::Curve { driven, .. } if *driven == shaft => 1.0,
            Row::Curve { driving, curve, .. } if *driving == shaft => -curve.derivatives(kinematics.angles[shaft]).0,
            Row::Curve { .. } => 0.0,
        }
    }

    /// Finds λ from the generalised constraint force τ_c (one entry per shaft), N m.
    ///
    /// The equations of the dependent shafts suffice: their part of J is regular because they were eliminated.
    pub fn solve(&mut self, kinematics: &Kinematics, force: &[f64], out: &mut [f64]) {
        let count = self.dependents.len();
        for (i, &shaft) in self.dependents.iter().enumerate() {
            for k in 0..count {
                self.matrix[i * count + k] = self.coefficient(k, shaft, kinematics);
            }
            out[i] = force[shaft];
        }
        self.solver.factor(&self.matrix);
        self.solver.solve(&mut out[..count]);
        if !self.split.is_empty() {
            let minimal = out[..count].to_vec();
            let sum = |shares: &Vec<(usize, f64)>| shares.iter().map(|(row, share)| share * minimal[*row]).sum();
            out.iter_mut().zip(&self.split).for_each(|(out, shares)| *out = sum(shares));
        }
    }
}
