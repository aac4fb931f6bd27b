//! The linear model around a position at rest.

use std::collections::BTreeMap;

use super::{
    Contact, FirstOrder, OperatingPoint, Reduced, geometric_stiffness, kinematics, law_slopes_at, pressed_cushions,
    with_inertia,
};
use crate::assemble::DirectionalTerm;
use crate::equations::UnilateralConstraint;
use kardan_math::num::{LastDigits, Matrix, Rational, SparseRow, dense_rows, project, sparse_sum_of_outer};

/// The reduced matrices of a linear(ised) model \[diss. Theorem 4.1\], exact for the stored numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearModel {
    /// Names of the reduced coordinates.
    pub coordinates: Vec<String>,
    /// Names of the inputs, in the order of the columns of `input`.
    pub inputs: Vec<String>,
    /// `H_r = KᵀHK`, kg m² (4.39a).
    pub inertia: Matrix<Rational>,
    /// `D_r = KᵀDK`, N m s/rad (4.39b).
    pub damping: Matrix<Rational>,
    /// `S_r = KᵀSK`, N m/rad (4.39c).
    pub stiffness: Matrix<Rational>,
    /// `F_r = KᵀF` (4.38).
    pub input: Matrix<Rational>,
    /// `K = ∂q/∂q_r`, one row per shaft (4.34).
    pub basis: Matrix<Rational>,
    /// Whether a slope of a law is not known to be a fraction, and was rounded.
    pub rounded: bool,
}

impl LinearModel {
    /// Numbers of the coordinates that have an inertia, whose rates are states.
    pub fn moving(&self) -> Vec<usize> {
        with_inertia(&self.inertia)
    }

    /// Whether a number of it is rounded.
    pub fn is_rounded(&self) -> bool {
        let all = [&self.inertia, &self.damping, &self.stiffness, &self.input, &self.basis];
        self.rounded || all.into_iter().flat_map(Matrix::<Rational>::as_slice).any(LastDigits::is_rounded)
    }

    /// As equations of first order, with the states `[q_r; q̇_r]` without rates of coordinates that have no inertia;
    /// `None` where another element than dampers determines such a coordinate.
    pub fn first_order(&self) -> Option<FirstOrder<Rational>> {
        FirstOrder::new(self.moving(), [&self.inertia, &self.damping, &self.stiffness, &self.input])
    }

    /// Accelerations of shafts, which move only with coordinates that have an inertia: rows over the states of
    /// [`Self::first_order`], and over forces, columns over the coordinates.
    ///
    /// # Panics
    /// If the inertia matrix is singular in coordinates that dampers do not determine.
    pub fn accelerations(&self, shafts: &[usize], forces: &Matrix<Rational>) -> [Matrix<Rational>; 2] {
        let matrices = [&self.inertia, &self.damping, &self.stiffness, forces];
        let found = FirstOrder::new(self.moving(), matrices).expect("reduced inertia is positive definite");
        let r = self.inertia.rows();
        [&found.a, &found.b].map(|rates| {
            Matrix::from_fn(shafts.len(), rates.columns(), |i, j| {
                let shares = found.moving.iter().enumerate();
                let shares = shares.map(|(k, place)| &self.basis[(shafts[i], *place)] * &rates[(r + k, j)]);
                shares.fold(Rational::ZERO, |sum, share| sum + share)
            })
        })
    }

    /// Whether a shaft has an acceleration: it moves only with coordinates that have an inertia.
    pub fn accelerates(&self, shaft: usize) -> bool {
        let moving = self.moving();
        (0..self.basis.columns()).all(|k| moving.contains(&k) || self.basis[(shaft, k)].is_zero())
    }

    /// Row of the basis for a shaft: the direction of its angle in reduced coordinates.
    pub fn direction(&self, shaft: usize) -> Matrix<Rational> {
        Matrix::from_fn(1, self.basis.columns(), |_, j| self.basis[(shaft, j)].clone())
    }
}

/// Linearises a reduced model about rest at the reduced position given (rad), springs taken as relaxed there.
///
/// For constant constraints the basis is exact; a transmission contributes its slope, rounded to `f64` and then exact.
///
/// ```
/// use kardan_mechanics::assemble::assemble;
/// use kardan_math::num::Rational;
/// use kardan_mechanics::reduce::{linearise, reduce};
/// let (document, _) = kardan_model::read(kardan_model::builtin("harmonic-drive").unwrap().source);
/// let (drive, _) = document.model(&[]);
/// let named = ["wg".to_string(), "cs".to_string()];
/// let reduced = reduce(assemble(&drive.all_coordinates, &drive.terms), Some(&named)).unwrap();
/// let linear = linearise(&reduced, &[0.0, 0.0]);
/// // (6.12b) with Table 6.1: the damping given for the axes is the identified d11 exactly.
/// assert_eq!(linear.damping[(0, 0)], Rational::from_parts(5.into(), 10_000_u32.into()));
/// ```
///
/// # Panics
/// If `position` has not one entry per coordinate or gives a slope that is not finite.
pub fn linearise(reduced: &Reduced, position: &[f64]) -> LinearModel {
    linear_model(reduced, &OperatingPoint::unloaded(position), &[], None)
}

/// [`linearise`] at an operating point, under the balancing torques, with the soft stops that are compressed there.
///
/// # Panics
/// As [`linearise`].
pub fn linearise_at(reduced: &Reduced, point: &OperatingPoint) -> LinearModel {
    linear_model(reduced, point, &pressed_cushions(reduced, &point.position), None)
}

/// The same with other numbers in place of rounded ones, within their last digits.
///
/// # Panics
/// As [`linearise`].
pub fn linearise_near(reduced: &Reduced, point: &OperatingPoint, digits: &mut LastDigits) -> LinearModel {
    linear_model(reduced, point, &pressed_cushions(reduced, &point.position), Some(digits))
}

fn linear_model(
    reduced: &Reduced,
    point: &OperatingPoint,
    pressed: &[Contact],
    digits: Option<&mut LastDigits>,
) -> LinearModel {
    let found = sparse_model_near(reduced, point, pressed, digits);
    let SparseModel { inertia, damping, stiffness, input, basis, rounded } = found;
    let (r, inputs) = (reduced.degrees_of_freedom(), &reduced.equations.inputs);
    LinearModel {
        coordinates: reduced.coordinate_names(),
        inputs: inputs.iter().map(|input| input.element.clone()).collect(),
        inertia: dense_rows(&inertia, r),
        damping: dense_rows(&damping, r),
        stiffness: dense_rows(&stiffness, r),
        input: dense_rows(&input, r).transpose(),
        basis: dense_rows(&basis, r),
        rounded,
    }
}

/// A [`LinearModel`] without its zeros, row by row: memory and time in proportion to the number of terms.
#[derive(Debug, Clone, PartialEq)]
pub struct SparseModel {
    /// H_r.
    pub inertia: Vec<SparseRow>,
    /// D_r.
    pub damping: Vec<SparseRow>,
    /// S_r.
    pub stiffness: Vec<SparseRow>,
    /// The columns of F_r, one for each input.
    pub input: Vec<SparseRow>,
    /// K, one row per shaft.
    pub basis: Vec<SparseRow>,
    /// Whether a slope of a law is not known to be a fraction, and was rounded.
    pub rounded: bool,
}

/// [`linearise`] without the zeros.
///
/// # Panics
/// If `position` has not one entry per coordinate or gives a slope that is not finite.
pub fn sparse_model(reduced: &Reduced, position: &[f64]) -> SparseModel {
    sparse_model_near(reduced, &OperatingPoint::unloaded(position), &[], None)
}

fn sparse_model_near(
    reduced: &Reduced,
    point: &OperatingPoint,
    pressed: &[Contact],
    mut digits: Option<&mut LastDigits>,
) -> SparseModel {
    let position = point.position.as_slice();
    let mut basis = kinematics::exact_basis(reduced, position);
    if let Some(digits) = digits.as_deref_mut() {
        basis.iter_mut().flatten().for_each(|(_, x)| *x = digits.near(x));
    }
    let (r, equations) = (reduced.degrees_of_freedom(), &reduced.equations);
    let reduced_row = |row: &SparseRow| project(row, &basis);
    let (inertias, dampers, springs) = (&equations.inertias, &equations.dampers, &equations.springs);
    let mut slopes = law_slopes_at(reduced, point);
    if let Some(digits) = digits.as_deref_mut() {
        slopes.iter_mut().for_each(|one| one.perturb(digits));
    }
    let laws: Vec<_> = slopes
        .iter()
        .map(|slopes| {
            let row = reduced_row(&slopes.row);
            (row, reduced_row(&slopes.on_positions), reduced_row(&slopes.on_rates))
        })
        .collect();
    let minus_laws = |rows: &mut Vec<SparseRow>, of: &dyn Fn(&(SparseRow, SparseRow, SparseRow)) -> SparseRow| {
        for law in &laws {
            let slopes = of(law);
            for (i, x) in &law.0 {
                let mut row: BTreeMap<usize, Rational> = std::mem::take(&mut rows[*i]).into_iter().collect();
                for (j, y) in &slopes {
                    *row.entry(*j).or_default() -= x * y;
                }
                rows[*i] = row.into_iter().filter(|(_, x)| !x.is_zero()).collect();
            }
        }
    };
    let contacts = pressed.iter().filter_map(|one| match &equations.unilaterals[one.unilateral] {
        DirectionalTerm { row, value: UnilateralConstraint::Cushion { stiffness, damping, .. }, .. } => {
            Some((reduced_row(row), [stiffness.to_rational(), damping.to_rational()]))
        }
        _ => None,
    });
    let contacts: Vec<(SparseRow, [Rational; 2])> = contacts.collect();
    let of_contacts = |which: usize| contacts.iter().map(move |(row, values)| (row.clone(), values[which].clone()));
    let damped = dampers.iter().map(|d| (reduced_row(&d.row), d.value.to_rational()));
    let mut damping = sparse_sum_of_outer(damped.chain(of_contacts(1)), r);
    let mut geometric = geometric_stiffness(reduced, point, &slopes);
    if let Some(digits) = digits {
        geometric.iter_mut().for_each(|one| one.value = digits.near(&one.value));
    }
    let bent = geometric.iter().map(|one| (reduced_row(&one.row), one.value.clone()));
    let stretched = springs.iter().map(|s| (reduced_row(&s.row), s.value.stiffness.to_rational()));
    let mut stiffness = sparse_sum_of_outer(stretched.chain(bent).chain(of_contacts(0)), r);
    minus_laws(&mut damping, &|law| law.2.clone());
    minus_laws(&mut stiffness, &|law| law.1.clone());
    SparseModel {
        inertia: sparse_sum_of_outer(inertias.iter().map(|j| (reduced_row(&j.row), j.value.to_rational())), r),
        damping,
        stiffness,
        input: equations.inputs.iter().map(|input| reduced_row(&input.row)).collect(),
        basis,
        rounded: slopes.iter().any(|one| one.rounded),
    }
}
