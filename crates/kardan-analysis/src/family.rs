//! A system as a function of parameters in intervals.

use std::borrow::Cow;

use faer::Mat;
use kardan_rt::functions::exp2;

use super::parts::{side_by_side, stacked};
use super::pencil::OutputRow;
use super::{ConstrainedSystem, OutputSignal, Side};
use kardan_math::num::{Matrix, Random, Rational, Scalar, rational_from_f64, rational_to_f64};

/// A parameter with the interval that it may lie in.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Its name.
    pub name: String,
    /// Its value, SI.
    pub nominal: Rational,
    /// Lower end, SI; not above the value.
    pub lower: Rational,
    /// Upper end, SI; not below the value, and above the lower end.
    pub upper: Rational,
    /// SI unit.
    pub unit: String,
    /// The confidence of the interval (0.95), if it is one of confidence; else it is a tolerance.
    pub confidence: Option<f64>,
}

impl Parameter {
    /// `(upper − lower)/2`.
    pub fn half_width(&self) -> Rational {
        self.upper.minus(&self.lower).over(&Rational::from(2))
    }

    /// The middle of the interval.
    fn middle(&self) -> Rational {
        self.upper.plus(&self.lower).over(&Rational::from(2))
    }
}

/// The coefficients of 1, λ, λ² of a matrix polynomial.
pub type Pencil = [Matrix<Rational>; 3];

/// The matrix polynomial that loses column rank at an eigenvalue λ just if that eigenvalue is uncontrollable
/// ([`Side::Inputs`]) or unobservable ([`Side::Outputs`]):
///
/// `[λ²H + λD + S, Cᵀ; C, 0; Fᵀ, 0]`, or with the rows of the outputs in place of Fᵀ.
///
/// A null vector contains the motion of the shafts and the negative multipliers \[diss. (5.15) corrected, (4.36)\]. Before
/// reduction every entry is affine in inertias, dampings, stiffnesses and ratios, so no reduction is applied here.
///
/// # Panics
/// If an output names a shaft that is not there.
pub fn uncontrollability_pencil(system: &ConstrainedSystem, side: Side, outputs: &[OutputSignal]) -> Pencil {
    let (n, c) = (system.coordinates.len(), system.constraints.len());
    let (rows, inputs) = (system.constraint_matrix(), system.input_matrix());
    let last = if side == Side::Inputs { inputs.columns() } else { outputs.len() };
    let mut sums = [system.stiffness_matrix(), system.damping_matrix(), system.inertia_matrix()];
    if side == Side::Inputs && !system.loads.is_empty() {
        // What inputs do not move is a left null vector.
        sums = sums.map(|sum| sum.transpose());
    }
    let below = Matrix::zeros(c + last, n + c);
    let mut pencil = sums.map(|sum| stacked(&[&side_by_side(&[&sum, &Matrix::zeros(n, c)]), &below]));
    for k in 0..c {
        pencil[0].row_mut(n + k)[..n].clone_from_slice(rows.row(k));
        (0..n).for_each(|j| pencil[0][(j, n + k)] = rows[(k, j)].clone());
    }
    if side == Side::Inputs {
        for k in 0..last {
            (0..n).for_each(|j| pencil[0][(n + c + k, j)] = inputs[(j, k)].clone());
        }
        return pencil;
    }
    for (k, output) in outputs.iter().enumerate() {
        let OutputRow { motion, multipliers } = OutputRow::of(system, &output.measured);
        for (coefficient, row) in pencil.iter_mut().zip(&motion) {
            coefficient.row_mut(n + c + k)[..n].clone_from_slice(row.as_slice());
        }
        pencil[0].row_mut(n + c + k)[n..].clone_from_slice(multipliers.as_slice());
    }
    pencil
}

/// A system as a function of its parameters: exact values in the order of the parameters to a system, `None` where there is
/// none.
pub type SystemAt<'a> = dyn Fn(&[Rational]) -> Option<ConstrainedSystem> + Sync + 'a;

/// A matrix polynomial that depends on parameters.
///
/// Deviations y are measured in half widths: parameter i is `nominal + yᵢ (upper − lower)/2`.
pub struct Family<'a> {
    parameters: &'a [Parameter],
    at: &'a SystemAt<'a>,
    side: Side,
    outputs: &'a [OutputSignal],
    base: Pencil,
    affine: Option<Vec<Pencil>>,
    floating: [Mat<f64>; 3],
    slopes: Vec<[Mat<f64>; 3]>,
}

impl<'a> Family<'a> {
    /// The loss pencil of a system over its parameters. `None` if there is no system at the nominal values.
    ///
    /// Whether it is affine is decided by exact differences along each parameter and in four random points of the box; for
    /// entries that are polynomials of the parameters (as all of kardan's elements give) the latter errs with a probability
    /// below 1e-15.
    pub fn new(
        parameters: &'a [Parameter],
        at: &'a SystemAt<'a>,
        side: Side,
        outputs: &'a [OutputSignal],
    ) -> Option<Self> {
        let build = |values: &[Rational]| Some(uncontrollability_pencil(&at(values)?, side, outputs));
        let nominal: Vec<Rational> = parameters.iter().map(|p| p.nominal.clone()).collect();
        let base = build(&nominal)?;
        let affine = slopes(parameters, &nominal, &base, &build);
        let floating = base.each_ref().map(to_mat);
        let slopes = affine.iter().flatten().map(|slope| slope.each_ref().map(to_mat)).collect();
        Some(Self { parameters, at, side, outputs, base, affine, floating, slopes })
    }

    /// The parameters.
    pub fn parameters(&self) -> &[Parameter] {
        self.parameters
    }

    /// The pencil at the nominal values and, if it is affine in the parameters, its slopes for y.
    pub fn exact(&self) -> (&Pencil, Option<&[Pencil]>) {
        (&self.base, self.affine.as_deref())
    }

    /// Whether the parameter changes the pencil; taken for granted if it is not affine.
    pub fn depends_on(&self, parameter: usize) -> bool {
        let nonzero = |slope: &Pencil| slope.iter().any(|k| k.as_slice().iter().any(|x| !x.is_zero()));
        self.affine.as_ref().is_none_or(|slopes| nonzero(&slopes[parameter]))
    }

    /// Coefficients at y. `None` if there is no system.
    pub fn at(&self, y: &[f64]) -> Option<[Mat<f64>; 3]> {
        if self.affine.is_none() {
            let values: Option<Vec<Rational>> = self.parameters.iter().zip(y).map(|(p, &y)| value(p, y)).collect();
            let pencil = uncontrollability_pencil(&(self.at)(&values?)?, self.side, self.outputs);
            // A constraint that depends on others here and not there changes the size.
            return are_equal_in_size(&pencil, &self.base).then(|| pencil.each_ref().map(to_mat));
        }
        let mut out = self.floating.clone();
        for (slope, &y) in self.slopes.iter().zip(y) {
            for k in 0..3 {
                out[k] += faer::Scale(y) * &slope[k];
            }
        }
        Some(out)
    }

    /// Derivatives of the coefficients for every entry of y: exact slopes, or central differences of exact values.
    pub fn derivatives(&self, y: &[f64]) -> Option<Cow<'_, [[Mat<f64>; 3]]>> {
        if self.affine.is_some() {
            return Some(Cow::Borrowed(&self.slopes));
        }
        // The values are exact, so a short step costs no digits.
        let step = exp2(-20f64);
        (0..y.len())
            .map(|i| {
                let end = |sign: f64| {
                    let mut y = y.to_vec();
                    y[i] += sign * step;
                    self.at(&y)
                };
                let (above, below) = (end(1.0)?, end(-1.0)?);
                Some([0, 1, 2].map(|k| faer::Scale(0.5 / step) * (&above[k] - &below[k])))
            })
            .collect::<Option<_>>()
            .map(Cow::Owned)
    }
}

impl std::fmt::Debug for Family<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Family").field("parameters", &self.parameters).finish_non_exhaustive()
    }
}

/// The exact value of a parameter at a deviation of y half widths.
fn value(parameter: &Parameter, y: f64) -> Option<Rational> {
    Some(parameter.nominal.plus(&parameter.half_width().times(&rational_from_f64(y)?)))
}

pub(super) fn to_mat(m: &Matrix<Rational>) -> Mat<f64> {
    Mat::from_fn(m.rows(), m.columns(), |i, j| rational_to_f64(&m[(i, j)]))
}

fn are_equal_in_size(one: &Pencil, other: &Pencil) -> bool {
    (one[0].rows(), one[0].columns()) == (other[0].rows(), other[0].columns())
}

/// Slopes for y if the pencil is affine.
fn slopes(
    parameters: &[Parameter],
    nominal: &[Rational],
    base: &Pencil,
    build: &impl Fn(&[Rational]) -> Option<Pencil>,
) -> Option<Vec<Pencil>> {
    let same_size = |pencil: &Pencil| are_equal_in_size(pencil, base);
    let pencil_at = |i: usize, x: Rational| {
        let mut values = nominal.to_vec();
        values[i] = x;
        build(&values).filter(same_size)
    };
    let mut slopes = Vec::new();
    for (i, parameter) in parameters.iter().enumerate() {
        let low = pencil_at(i, parameter.lower.clone())?;
        let middle = pencil_at(i, parameter.middle())?;
        let high = pencil_at(i, parameter.upper.clone())?;
        let slope = [0, 1, 2].map(|k| high[k].minus(&middle[k]));
        if (0..3).any(|k| middle[k].minus(&low[k]) != slope[k]) {
            return None;
        }
        slopes.push(slope);
    }
    // Products of parameters show where several move at once; no model can know the places.
    let mut random = Random::unforeseen(1);
    for _ in 0..4 {
        let y: Vec<Rational> = parameters
            .iter()
            .map(|_| Rational::from_parts((random.below(1 << 32) as i64 - (1 << 31)).into(), (1u64 << 31).into()))
            .collect();
        let values: Vec<Rational> =
            parameters.iter().zip(&y).map(|(p, y)| p.middle().plus(&p.half_width().times(y))).collect();
        let moved = build(&values).filter(same_size)?;
        let deviations: Vec<Rational> =
            parameters.iter().zip(&values).map(|(p, x)| x.minus(&p.nominal).over(&p.half_width())).collect();
        for k in 0..3 {
            for (at, x) in moved[k].as_slice().iter().enumerate() {
                let sum = slopes.iter().zip(&deviations).fold(base[k].as_slice()[at].clone(), |sum, (slope, y)| {
                    let entry = &slope[k].as_slice()[at];
                    if entry.is_zero() { sum } else { sum.plus(&entry.times(y)) }
                });
                if sum != *x {
                    return None;
                }
            }
        }
    }
    Some(slopes)
}
