//! Motions without inertia that dampers hold: states of first order.

use std::collections::BTreeMap;

use super::motion::{Motion, Relaxing, SparseRow};
use super::{Reduced, Relaxation, linearise};
use crate::expr::Expr;
use crate::num::{Definiteness, Matrix, Rational, Scalar, definiteness, echelon};
use crate::units::Exact;

/// Why motions without inertia are no states of first order.
#[derive(Debug, Clone, PartialEq)]
pub enum NoRelaxation {
    /// The ratio of a transmission changes with its angle.
    Bends,
    /// A friction acts along them.
    Friction(Vec<String>),
    /// The reduced coordinates that were named move without inertia together with others.
    Coordinates,
    /// The damping along them is not positive definite.
    Damping,
}

/// Takes the motions without inertia of a model apart from the others, exactly; `None` if there are none.
///
/// # Errors
/// [`NoRelaxation`]
pub fn relaxation(reduced: &Reduced) -> Result<Option<Relaxation>, NoRelaxation> {
    let r = reduced.degrees_of_freedom();
    let model = linearise(reduced, &vec![0.0; r]);
    let e = echelon(&model.inertia, &(0..r).collect::<Vec<_>>());
    let (places, directions) = (e.free(), e.kernel());
    if places.is_empty() {
        return Ok(None);
    }
    if !reduced.equations.transmissions.is_empty() {
        return Err(NoRelaxation::Bends);
    }
    if (0..r).any(|i| !places.contains(&i) && directions.row(i).iter().any(|x| !x.is_zero())) {
        return Err(NoRelaxation::Coordinates);
    }
    let shafts = model.basis.multiply(&directions);
    let moves = |row: &Vec<(usize, Rational)>| {
        let share = |column: usize| {
            row.iter().fold(Rational::ZERO, |sum, (shaft, x)| sum.plus(&x.times(&shafts[(*shaft, column)])))
        };
        (0..places.len()).any(|column| !share(column).is_zero())
    };
    let frictions = reduced.equations.frictions.iter().filter(|term| moves(&term.row));
    let frictions: Vec<String> = frictions.map(|term| term.element.clone()).collect();
    if !frictions.is_empty() {
        return Err(NoRelaxation::Friction(frictions));
    }
    let across = directions.transpose().multiply(&model.damping);
    let own = across.multiply(&directions);
    if definiteness(&own) != Definiteness::Positive {
        return Err(NoRelaxation::Damping);
    }
    let compliance = own.solve(&Matrix::identity(places.len())).expect("a definite matrix is regular");
    let carried = directions.multiply(&compliance.multiply(&across));
    let transform = Matrix::from_fn(r, r, |i, j| match places.binary_search(&j) {
        Ok(column) => directions[(i, column)].clone(),
        Err(_) if i == j => Rational::ONE.minus(&carried[(i, j)]),
        Err(_) => Rational::ZERO.minus(&carried[(i, j)]),
    });
    let inverse = transform.solve(&Matrix::identity(r)).expect("columns of two complements");
    Ok(Some(Relaxation { places, transform, inverse, compliance }))
}

impl Reduced {
    /// The states of a run at reduced coordinates `position` and speeds `speed`: these, or of motions that relax y in the place of a speed. The
    /// place of y among the angles holds its integral, which nothing depends on.
    pub fn state(&self, position: &[f64], speed: &[f64]) -> Vec<f64> {
        let mut state = [position, speed].concat();
        let Some(relaxation) = &self.relaxation else { return state };
        let r = position.len();
        let inverse = relaxation.inverse.to_f64();
        let along = |k: usize, x: &[f64]| inverse.row(k).iter().zip(x).map(|(entry, x)| entry * x).sum::<f64>();
        for &place in &relaxation.places {
            (state[place], state[r + place]) = (0.0, along(place, position));
        }
        state
    }
}

impl Motion {
    /// Writes angles, speeds and directions of the reduced coordinates over x and y, while y stands still.
    pub(super) fn set_relaxing(&mut self, reduced: &Reduced, position: &[Expr], speed: &[Expr]) {
        let Some(relaxation) = &reduced.relaxation else { return };
        for (k, &shaft) in reduced.coordinates.iter().enumerate() {
            let (mut angle, mut rate) = (Vec::new(), Vec::new());
            self.basis[shaft].clear();
            for (j, entry) in relaxation.transform.row(k).iter().enumerate().filter(|(_, entry)| !entry.is_zero()) {
                let relaxes = relaxation.places.contains(&j);
                angle.push((if relaxes { speed[j] } else { position[j] }, entry.clone()));
                if !relaxes {
                    rate.push((speed[j], entry.clone()));
                }
                let entry = self.graph.number(entry.clone());
                self.basis[shaft].insert(j, entry);
            }
            self.angles[shaft] = self.graph.sum(Rational::ZERO, &angle);
            self.speeds[shaft] = self.graph.sum(Rational::ZERO, &rate);
        }
    }

    /// Begins to relax: what forces there are without inputs moves y.
    pub(super) fn begin_to_relax(&mut self, reduced: &Reduced) {
        let Some(relaxation) = &reduced.relaxation else { return };
        let Relaxation { places, compliance, .. } = relaxation.clone();
        self.relaxing = Some(Box::new(Relaxing { places, compliance, standing: self.speeds.clone() }));
        self.relax(&self.passive.clone());
    }

    /// A damper: its torque while y stands still acts along x, and `D_y` stands where the inertia of x does. What else it does cancels with others.
    pub(super) fn damp_relaxing(
        &mut self,
        reduced: &Reduced,
        row: &[(usize, Rational)],
        (torque, coefficient): (Expr, &Exact),
        inertia: &mut BTreeMap<(usize, usize), Vec<(Expr, Rational)>>,
    ) {
        let Some(relaxation) = &reduced.relaxation else { return };
        let row = self.along(row);
        let (relaxes, moves): (SparseRow, SparseRow) =
            row.into_iter().partition(|(place, _)| relaxation.places.contains(place));
        self.passive_terms.add(&mut self.graph, &moves, torque, &Rational::from(-1));
        let coefficient = self.exact(coefficient);
        for (i, first) in &relaxes {
            for (j, second) in relaxes.range(..=i) {
                let product = self.graph.product(&[(coefficient, 1), (*first, 1), (*second, 1)]);
                inertia.entry((*i, *j)).or_default().push((product, Rational::ONE));
            }
        }
    }

    /// Speeds of all shafts with `ẏ = D_y⁻¹ f_y`, from the forces along the reduced coordinates; without motions that relax nothing changes.
    pub fn relax(&mut self, forces: &[Expr]) {
        let Some(relaxing) = self.relaxing.take() else { return };
        let Relaxing { places, compliance, standing } = &*relaxing;
        let rates: Vec<Expr> = (0..places.len())
            .map(|k| {
                let terms = places.iter().zip(compliance.row(k)).map(|(&place, entry)| (forces[place], entry.clone()));
                let sum = self.graph.sum(Rational::ZERO, &terms.collect::<Vec<_>>());
                self.graph.group(sum)
            })
            .collect();
        for (shaft, standing) in standing.iter().enumerate() {
            let mut terms = vec![(*standing, Rational::ONE)];
            for (place, rate) in places.iter().zip(&rates) {
                let Some(entry) = self.basis[shaft].get(place) else { continue };
                let share = self.graph.number_of(*entry).cloned().expect("directions that relax are constant");
                terms.push((*rate, share));
            }
            if terms.len() > 1 {
                self.speeds[shaft] = self.graph.sum(Rational::ZERO, &terms);
            }
        }
        self.relaxing = Some(relaxing);
    }
}
