//! A linear constrained mechanical system as terms along directions.

use std::collections::BTreeSet;
use std::ops::IndexMut;

use super::parts::{columns_of, reduced_form, rows_of};
use kardan_math::num::{LastDigits, Matrix, Rational, Scalar, SparseRow, dense_rows, sparse_echelon, sum_of_outer};
use kardan_math::units::Exact;
use kardan_mechanics::assemble::DirectionalTerm;
use kardan_mechanics::equations::UnilateralConstraint;
use kardan_mechanics::reduce::{
    LawSlopes, OperatingPoint, Reduced, geometric_stiffness, law_slopes_at, pressed_cushions, slopes,
};

/// A constant linear constrained mechanical system `Hq̈ + Dq̇ + Sq = Fτ + Cᵀλ`, `Cq = 0` \[diss. (4.31), (4.36)\], as terms
/// along directions with exact coefficients. Without loads H, D and S are symmetric.
///
/// A model that is not constant and linear is brought to this form at an operating point: a transmission contributes the
/// row of its slope, a stuck friction direction the row of its constraint.
#[derive(Debug, Clone, Default)]
pub struct ConstrainedSystem {
    /// Names of the coordinates q before reduction (shafts; loop charges of a circuit).
    pub coordinates: Vec<String>,
    /// Inertias.
    pub inertias: Vec<DirectionalTerm<Rational>>,
    /// Dampers.
    pub dampers: Vec<DirectionalTerm<Rational>>,
    /// Springs.
    pub springs: Vec<DirectionalTerm<Rational>>,
    /// Torques that follow from angles and speeds in another way.
    pub loads: Vec<DirectionalTerm<LoadSlopes>>,
    /// Rows of C, independent.
    pub constraints: Vec<DirectionalTerm<()>>,
    /// Inputs that are considered.
    pub inputs: Vec<DirectionalTerm<()>>,
}

/// A torque along a row a that depends linearly on angles and speeds: `a (gᵀq + hᵀq̇)`, so that it adds `−a gᵀ` to the stiffness and
/// `−a hᵀ` to the damping.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LoadSlopes {
    /// g
    pub on_positions: SparseRow,
    /// h
    pub on_rates: SparseRow,
    /// Whether an entry is not known to be a fraction, and was rounded.
    pub rounded: bool,
}

impl ConstrainedSystem {
    /// A reduced model at a reduced position (rad), at rest, springs relaxed; the elements in `stuck` stick.
    ///
    /// Only the named inputs remain, in that order. The slope of a transmission that is no fraction is rounded to `f64` once
    /// and exact from there on ([`slopes`]). A stuck direction that follows from other constraints adds no constraint.
    ///
    /// # Panics
    /// If `position` has not one entry per coordinate, gives a slope that is not finite, or an input is not there.
    pub fn at(reduced: &Reduced, position: &[f64], stuck: &BTreeSet<String>, inputs: &[String]) -> Self {
        Self::at_point(reduced, &OperatingPoint::unloaded(position), stuck, inputs)
    }

    /// Cushions that are pressed there act with their stiffness and their damping.
    fn press(&mut self, reduced: &Reduced, position: &[f64], stuck: &BTreeSet<String>) {
        for one in pressed_cushions(reduced, position) {
            let unilateral = &reduced.equations.unilaterals[one.unilateral];
            let UnilateralConstraint::Cushion { stiffness, damping, .. } = &unilateral.value else { continue };
            if stuck.contains(&unilateral.element) {
                continue;
            }
            for (list, value) in [(&mut self.springs, stiffness), (&mut self.dampers, damping)] {
                let value = value.to_rational();
                if !value.is_zero() {
                    list.push(along(unilateral, value));
                }
            }
        }
    }

    /// The same at an operating point, under its equilibrium torques.
    ///
    /// # Panics
    /// As [`Self::at`].
    pub fn at_point(reduced: &Reduced, point: &OperatingPoint, stuck: &BTreeSet<String>, inputs: &[String]) -> Self {
        let position = point.position.as_slice();
        let equations = &reduced.equations;
        let constant = |term: &DirectionalTerm<Exact>| along(term, term.value.to_rational());
        let mut constraints: Vec<DirectionalTerm<()>> = equations.constraints.iter().map(|c| along(c, ())).collect();
        constraints.extend(equations.transmissions.iter().zip(slopes(reduced, position)).map(|(t, slope)| {
            let mut entries = vec![(t.driven, Rational::ONE), (t.driving, Rational::ZERO.minus(&slope.value))];
            entries.sort_by_key(|(shaft, _)| *shaft);
            DirectionalTerm { element: t.element.clone(), row: entries, value: () }
        }));
        let at_point = equations.set_valued().filter(|(element, _)| stuck.contains(*element));
        constraints.extend(at_point.map(|(element, own)| DirectionalTerm {
            element: element.into(),
            row: own.to_vec(),
            value: (),
        }));
        let mut out = Self {
            coordinates: equations.coordinates.clone(),
            inertias: equations.inertias.iter().map(constant).collect(),
            dampers: equations.dampers.iter().map(constant).collect(),
            springs: equations.springs.iter().map(|s| along(s, s.value.stiffness.to_rational())).collect(),
            loads: Vec::new(),
            constraints,
            inputs: inputs
                .iter()
                .map(|name| {
                    let input = equations.inputs.iter().find(|i| i.element == *name);
                    along(input.unwrap_or_else(|| panic!("no input `{name}`")), ())
                })
                .collect(),
        };
        let slopes = law_slopes_at(reduced, point);
        out.springs.extend(geometric_stiffness(reduced, point, &slopes));
        out.loads = loads(slopes);
        out.press(reduced, position, stuck);
        out.drop_dependent_constraints();
        out
    }

    /// The same with other numbers in place of rounded ones, within their last digits.
    ///
    /// # Panics
    /// As [`Self::at`].
    pub fn near(
        reduced: &Reduced,
        point: &OperatingPoint,
        stuck: &BTreeSet<String>,
        inputs: &[String],
        digits: &mut LastDigits,
    ) -> Self {
        let mut out = Self::at_point(reduced, point, stuck, inputs);
        let mut slopes = law_slopes_at(reduced, point);
        slopes.iter_mut().for_each(|one| one.perturb(digits));
        out.loads = loads(slopes);
        let values = [&mut out.inertias, &mut out.dampers, &mut out.springs].into_iter().flatten();
        values.for_each(|term| term.value = digits.near(&term.value));
        out.constraints.iter_mut().flat_map(|directional| &mut directional.row).for_each(|(_, x)| *x = digits.near(x));
        out
    }

    /// Whether a number of it is rounded.
    pub fn is_rounded(&self) -> bool {
        let values = [&self.inertias, &self.dampers, &self.springs].into_iter().flatten().map(|term| &term.value);
        let constraints = self.constraints.iter().flat_map(|directional| &directional.row);
        let loads = self.loads.iter().flat_map(|load| load.value.on_positions.iter().chain(&load.value.on_rates));
        self.loads.iter().any(|load| load.value.rounded)
            || values.chain(constraints.chain(loads).map(|(_, x)| x)).any(LastDigits::is_rounded)
    }

    /// The inertia of a shaft itself, without what moves with it, kg m².
    pub fn own_inertia(&self, shaft: usize) -> Rational {
        let own = self.inertias.iter().filter_map(|term| match term.row.as_slice() {
            [(k, x)] if *k == shaft => Some(x.times(x).times(&term.value)),
            _ => None,
        });
        own.fold(Rational::ZERO, |sum, inertia| sum.plus(&inertia))
    }

    /// The number of a coordinate.
    ///
    /// # Panics
    /// If there is none of that name.
    pub(super) fn shaft(&self, name: &str) -> usize {
        self.coordinates.iter().position(|shaft| shaft == name).unwrap_or_else(|| panic!("no shaft `{name}`"))
    }

    /// Retains the first rows of C that are independent.
    fn drop_dependent_constraints(&mut self) {
        let rows = self.constraints.len();
        let order: Vec<usize> = (0..self.coordinates.len()).collect();
        if sparse_echelon(self.constraints.iter().map(|c| &c.row), &order).rank() == rows {
            return;
        }
        let retained = reduced_form(&self.constraint_matrix().transpose()).pivots;
        self.constraints = retained.iter().map(|&row| self.constraints[row].clone()).collect();
    }

    /// C, one row per constraint.
    pub fn constraint_matrix(&self) -> Matrix<Rational> {
        dense_rows(&self.constraints, self.coordinates.len())
    }

    /// F, one column per input.
    pub fn input_matrix(&self) -> Matrix<Rational> {
        dense_rows(&self.inputs, self.coordinates.len()).transpose()
    }

    /// `Σ J a aᵀ`.
    pub fn inertia_matrix(&self) -> Matrix<Rational> {
        sum(&self.inertias, self.coordinates.len())
    }

    /// `Σ d a aᵀ`.
    pub fn damping_matrix(&self) -> Matrix<Rational> {
        let sum = sum(&self.dampers, self.coordinates.len());
        minus_loads(sum, &self.loads, |slopes| &slopes.on_rates)
    }

    /// `Σ s a aᵀ`.
    pub fn stiffness_matrix(&self) -> Matrix<Rational> {
        let sum = sum(&self.springs, self.coordinates.len());
        minus_loads(sum, &self.loads, |slopes| &slopes.on_positions)
    }

    /// Chosen coordinates and K with `CK = 0`, identity on them (4.34): as many of `preferred` as are independent, then
    /// others by number.
    pub fn explicit_basis(&self, preferred: &[usize]) -> (Vec<usize>, Matrix<Rational>) {
        let (coordinates, rows) = self.sparse_basis(preferred);
        let basis = dense_rows(&rows, coordinates.len());
        (coordinates, basis)
    }

    /// The same with K as sparse rows, one for each coordinate.
    pub(super) fn sparse_basis(&self, preferred: &[usize]) -> (Vec<usize>, Vec<SparseRow>) {
        let n = self.coordinates.len();
        let mut is_preferred = vec![false; n];
        for &shaft in preferred {
            assert!(!is_preferred[shaft], "shaft {shaft} is preferred twice");
            is_preferred[shaft] = true;
        }
        // Columns late in the order stay free.
        let mut order: Vec<usize> = (0..n).rev().filter(|&shaft| !is_preferred[shaft]).collect();
        order.extend(preferred.iter().rev());
        let eliminated = sparse_echelon(self.constraints.iter().map(|c| &c.row), &order);
        let free = |shaft: &usize| !eliminated.rows.contains_key(shaft);
        let mut coordinates: Vec<usize> = preferred.iter().copied().filter(free).collect();
        coordinates.extend((0..n).filter(|shaft| free(shaft) && !is_preferred[*shaft]));
        let basis = eliminated.kernel(n, &coordinates);
        (coordinates, basis)
    }
}

/// Another value along the direction of a term.
fn along<T, V>(term: &DirectionalTerm<T>, value: V) -> DirectionalTerm<V> {
    DirectionalTerm { element: term.element.clone(), row: term.row.clone(), value }
}

fn sum(terms: &[DirectionalTerm<Rational>], shafts: usize) -> Matrix<Rational> {
    sum_of_outer(terms.iter().map(|term| (&term.row, term.value.clone())), shafts)
}

/// The effect of laws on small motions.
fn loads(slopes: Vec<LawSlopes>) -> Vec<DirectionalTerm<LoadSlopes>> {
    let load = |LawSlopes { element, row, on_positions, on_rates, rounded, .. }: LawSlopes| {
        let value = LoadSlopes { on_positions, on_rates, rounded };
        DirectionalTerm { element, row, value }
    };
    slopes.into_iter().map(load).collect()
}

/// A sum of terms without `Σ a gᵀ`, exact or in floating point.
pub(super) fn minus_loads<S: Scalar, M: IndexMut<(usize, usize), Output = S>>(
    mut sum: M,
    loads: &[DirectionalTerm<LoadSlopes>],
    of: impl Fn(&LoadSlopes) -> &SparseRow,
) -> M {
    for load in loads {
        for (i, x) in &load.row {
            for (j, y) in of(&load.value) {
                let entry = &mut sum[(*i, *j)];
                *entry = entry.minus(&S::from_rational(x).times(&S::from_rational(y)));
            }
        }
    }
    sum
}

/// A linear system `E ẋ = A x + B u`, `y = C x + D u` with exact entries; E is regular but for
/// [`descriptor`](super::descriptor()).
///
/// E is not inverted, so that the fractions stay short.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearSystem {
    /// Names of the states x: `rk.phi`, `rk.w`.
    pub states: Vec<String>,
    /// Names of the inputs u.
    pub inputs: Vec<String>,
    /// Names of the outputs y.
    pub outputs: Vec<String>,
    /// E, square.
    pub e: Matrix<Rational>,
    /// A, square.
    pub a: Matrix<Rational>,
    /// B, one column per input.
    pub b: Matrix<Rational>,
    /// C, one row per output.
    pub c: Matrix<Rational>,
    /// D, outputs × inputs.
    pub d: Matrix<Rational>,
    /// Number of degrees of freedom if the states are `[q_r; q̇_r]` with `E = diag(I, H_r)`, `A = [0 I; −S_r −D_r]`.
    pub degrees_of_freedom: Option<usize>,
}

impl LinearSystem {
    /// `ẋ = A x + B u`, `y = C x`, with states x1…, inputs u1…, outputs y1….
    ///
    /// # Panics
    /// If the shapes do not fit each other.
    pub fn state_space(a: Matrix<Rational>, b: Matrix<Rational>, c: Matrix<Rational>) -> Self {
        let n = a.rows();
        assert!(a.columns() == n && b.rows() == n && c.columns() == n, "matrices of different shapes");
        let names = |letter: &str, count: usize| (1..=count).map(|k| format!("{letter}{k}")).collect::<Vec<_>>();
        Self {
            states: names("x", n),
            inputs: names("u", b.columns()),
            outputs: names("y", c.rows()),
            e: Matrix::identity(n),
            d: Matrix::zeros(c.rows(), b.columns()),
            a,
            b,
            c,
            degrees_of_freedom: None,
        }
    }

    /// The same system over some of its states, of which alone it knows rates: E has zeros in the rows and columns of the others, which their rows
    /// of A give from these and the inputs. `None` if they do not.
    pub fn over(&self, retained: &[usize]) -> Option<Self> {
        let eliminated: Vec<usize> = (0..self.states.len()).filter(|k| !retained.contains(k)).collect();
        let own = rows_of(&self.a, &eliminated);
        // −x of the others, over the retained ones and the inputs.
        let square = columns_of(&own, &eliminated);
        let (on_retained, on_inputs) =
            (square.solve(&columns_of(&own, retained))?, square.solve(&rows_of(&self.b, &eliminated))?);
        let (upper, output_columns) = (rows_of(&self.a, retained), columns_of(&self.c, &eliminated));
        let through = columns_of(&upper, &eliminated);
        Some(Self {
            states: retained.iter().map(|k| self.states[*k].clone()).collect(),
            e: columns_of(&rows_of(&self.e, retained), retained),
            a: columns_of(&upper, retained).minus(&through.multiply(&on_retained)),
            b: rows_of(&self.b, retained).minus(&through.multiply(&on_inputs)),
            c: columns_of(&self.c, retained).minus(&output_columns.multiply(&on_retained)),
            d: self.d.minus(&output_columns.multiply(&on_inputs)),
            degrees_of_freedom: None,
            ..self.clone()
        })
    }

    /// The same system with E = I: A and B multiplied by the inverse of E; `None` if E is singular.
    pub fn explicit(&self) -> Option<Self> {
        let n = self.states.len();
        Some(Self { e: Matrix::identity(n), a: self.e.solve(&self.a)?, b: self.e.solve(&self.b)?, ..self.clone() })
    }

    /// The dual system, `Eᵀ ẋ = Aᵀ x + Cᵀ u`, `y = Bᵀ x + Dᵀ u`: its inputs are the outputs of this one.
    pub fn transpose(&self) -> Self {
        Self {
            states: self.states.clone(),
            inputs: self.outputs.clone(),
            outputs: self.inputs.clone(),
            e: self.e.transpose(),
            a: self.a.transpose(),
            b: self.c.transpose(),
            c: self.b.transpose(),
            d: self.d.transpose(),
            degrees_of_freedom: None,
        }
    }
}

/// The kind of element to place.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// Motors, for controllability.
    Inputs,
    /// Sensors, for observability.
    Outputs,
}
