use std::sync::Arc;

use super::{ExactLaw, Law};
use crate::analysis::{Plane, stability_of};
use crate::num::{LastDigits, Matrix, Rational, Scalar, echelon, exact_rank, rational_from_f64};
use crate::reduce::{LinearModel, over_states};
use crate::results::StabilityVerdict;

/// States up to which the stability of a loop is decided exactly.
pub(super) const MOST: usize = 32;

/// The loop of laws in continuous time over the rationals, and what of it is exactly at zero.
///
/// `z = [q_r; q̇_r; torques of motors with a lag; states of the laws]`, of coordinates without inertia no rates. The plant is exact. So are the gains of a law that is
/// designed exactly and has no observer; other gains are the fractions that their doubles are, and lags the shortest decimals
/// that read back as their doubles.
#[derive(Debug, Clone, PartialEq)]
pub struct ExactMotions {
    /// F of `ż = F z`.
    pub matrix: Matrix<Rational>,
    /// A basis of what powers of F send to zero, columns over z: as many as eigenvalues exactly at zero.
    pub motions: Matrix<Rational>,
    /// How many of these go on in the same way if the laws are sampled, whatever their clocks: of those the laws see nothing
    /// that changes.
    pub sampled: usize,
    /// Whether all gains are those before rounding; if not, some are the fractions that their doubles are.
    pub designed: bool,
    /// Whether no law commands anything along these motions: parts move on that nobody holds.
    pub free: bool,
}

impl ExactMotions {
    /// How many eigenvalues are exactly at zero.
    pub fn zeros(&self) -> usize {
        self.motions.columns()
    }

    /// Whether the loop is stable, decided exactly for these gains; `None` above 32 states. What is at zero is free where no law commands
    /// anything along it, or a design leaves it there, and at most an angle grows, at constant speed.
    pub fn stability(&self) -> Option<StabilityVerdict> {
        if self.matrix.rows() > MOST {
            return None;
        }
        let mut found = stability_of(&self.matrix, Plane::Continuous);
        if found.border.is_empty() {
            return Some(found);
        }
        for motion in found.border.iter_mut().filter(|motion| motion.frequency == 0.0) {
            motion.free = (self.free || self.designed) && motion.growth <= 1;
        }
        Some(StabilityVerdict::exact(false, found.border))
    }
}

/// The loop of a linear model, motors with these lags in s, and laws in continuous time, exactly.
///
/// Eigenvalues at zero are counted by ranks: a staircase of kernels over the rationals, after a rank modulo a prime has told
/// that there are some. `None` if a law is made for a sample time, or a number is not finite.
///
/// ```
/// use kardan::num::rational_to_f64;
/// use kardan::synthesis::exact_motions;
/// let source = kardan::model::builtin("two-bodies").unwrap().source;
/// let (prepared, _) = kardan::study::prepare(source);
/// let variant = &prepared.variants[0];
/// let model = kardan::reduce::linearise(&variant.reduced, &vec![0.0; variant.reduced.degrees_of_freedom()]);
/// // Without a law both bodies rest wherever they are; their own damping takes their common speed away.
/// let found = exact_motions(&model, &vec![0.0; model.inputs.len()], &[]).unwrap();
/// assert_eq!(found.zeros(), 1);
/// ```
///
/// # Panics
/// If the inertia matrix is singular, there is not one lag for each input, or a law names an input that is not there.
pub fn exact_motions(model: &LinearModel, lags: &[f64], laws: &[Arc<dyn Law>]) -> Option<ExactMotions> {
    exact_motions_near(model, lags, laws, None)
}

/// The same with other gains in place of rounded ones, within their last digits.
///
/// # Panics
/// As [`exact_motions`].
pub fn exact_motions_near(
    model: &LinearModel,
    lags: &[f64],
    laws: &[Arc<dyn Law>],
    mut digits: Option<&mut LastDigits>,
) -> Option<ExactMotions> {
    assert_eq!(lags.len(), model.inputs.len(), "one lag for each input");
    let mut part = |law: &Arc<dyn Law>| Part::of(&**law, model, digits.as_deref_mut());
    let known: Vec<(Part, bool)> = laws.iter().map(&mut part).collect::<Option<_>>()?;
    let designed = known.iter().all(|(_, designed)| *designed);
    let parts: Vec<Part> = known.into_iter().map(|(part, _)| part).collect();
    let Whole { matrix, signals, commands } = whole(model, lags, &parts)?;
    let n = matrix.rows();
    let motions = if exact_rank(&matrix) == n { Matrix::zeros(n, 0) } else { sent_to_zero(&matrix) };
    // What a law reads and commands, and its states, must not change along the motion: S Fᵏ z = 0, k ≥ 1.
    let mut rows = Vec::new();
    let mut moved = motions.clone();
    for _ in 0..motions.columns() {
        moved = matrix.multiply(&moved);
        let seen = signals.multiply(&moved);
        (0..seen.rows()).for_each(|i| rows.push(seen.row(i).to_vec()));
    }
    let seen = Matrix::from_fn(rows.len(), motions.columns(), |i, j| rows[i][j].clone());
    let sampled = motions.columns() - if rows.is_empty() { 0 } else { exact_rank(&seen) };
    let free = commands.multiply(&motions).as_slice().iter().all(Scalar::is_zero);
    Some(ExactMotions { matrix, motions, sampled, designed, free })
}

/// A basis of the generalised null space.
fn sent_to_zero(matrix: &Matrix<Rational>) -> Matrix<Rational> {
    let n = matrix.rows();
    let mut known = Matrix::<Rational>::zeros(n, 0);
    loop {
        // F x = V y: as V is independent, x determines y.
        let k = known.columns();
        let both =
            Matrix::from_fn(n, n + k, |i, j| if j < n { matrix[(i, j)].clone() } else { -known[(i, j - n)].clone() });
        let order: Vec<usize> = (n..n + k).chain(0..n).collect();
        let kernel = echelon(&both, &order).kernel();
        if kernel.columns() == k {
            return known;
        }
        known = Matrix::from_fn(n, kernel.columns(), |i, j| kernel[(i, j)].clone());
    }
}

/// A law in the loop.
struct Part {
    law: ExactLaw,
    /// Bτ, states × inputs.
    torques: Matrix<Rational>,
    inputs: Vec<usize>,
}

impl Part {
    /// And whether its gains are those before rounding.
    fn of(law: &dyn Law, model: &LinearModel, mut digits: Option<&mut LastDigits>) -> Option<(Self, bool)> {
        if law.clock().is_some() {
            return None;
        }
        let number =
            |name: &String| model.inputs.iter().position(|input| input == name).expect("a law commands inputs");
        let inputs: Vec<usize> = law.inputs().iter().map(number).collect();
        let states = law.states().len();
        let moving = model.moving();
        let width = model.basis.columns() + moving.len();
        let exact = law
            .exact()
            .and_then(|exact| exact.law)
            .filter(|exact| law.sensors().is_empty() && exact.a.rows() == states && exact.d.columns() == width);
        if let Some(exact) = exact {
            return Some((Self { torques: Matrix::zeros(states, inputs.len()), law: exact, inputs }, true));
        }
        let linear = law.linear();
        let mut gains = |of: &Matrix<f64>| {
            let exact = fractions(of)?;
            let Some(digits) = digits.as_deref_mut() else { return Some(exact) };
            let near = exact.as_slice().iter().map(|x| digits.near(x)).collect::<Vec<_>>();
            Some(Matrix::from_fn(of.rows(), of.columns(), |i, j| near[i * of.columns() + j].clone()))
        };
        let [a, c, torques] = [gains(&linear.states)?, gains(&linear.on_states)?, gains(&linear.torques)?];
        let mut over = |angles: &Matrix<f64>, speeds: &Matrix<f64>| {
            Some(over_states([&gains(angles)?, &gains(speeds)?], &model.basis, &moving))
        };
        let (b, d) = (over(&linear.angles, &linear.speeds)?, over(&linear.on_angles, &linear.on_speeds)?);
        Some((Self { torques, law: ExactLaw { a, b, c, d }, inputs }, false))
    }
}

/// The decimal with the fewest digits that reads back as this double; `None` if it is not finite.
pub(super) fn shortest_decimal(value: f64) -> Option<Rational> {
    if !value.is_finite() {
        return None;
    }
    let text = format!("{value:e}");
    let (digits, exponent) = text.split_once('e')?;
    let (whole, part) = digits.split_once('.').unwrap_or((digits, ""));
    let number: i64 = format!("{whole}{part}").parse().ok()?;
    let exponent: i32 = exponent.parse::<i32>().ok()? - i32::try_from(part.len()).ok()?;
    let ten = (0..exponent.unsigned_abs()).fold(Rational::ONE, |power, _| power.times(&Rational::from(10)));
    let number = Rational::from(number);
    Some(if exponent < 0 { number.over(&ten) } else { number.times(&ten) })
}

fn fractions(matrix: &Matrix<f64>) -> Option<Matrix<Rational>> {
    let all: Vec<Rational> = matrix.as_slice().iter().map(|x| rational_from_f64(*x)).collect::<Option<_>>()?;
    Some(Matrix::from_fn(matrix.rows(), matrix.columns(), |i, j| all[i * matrix.columns() + j].clone()))
}

/// A loop over z.
struct Whole {
    /// F.
    matrix: Matrix<Rational>,
    /// What the laws command and how their states change.
    signals: Matrix<Rational>,
    /// What inputs are told.
    commands: Matrix<Rational>,
}

fn whole(model: &LinearModel, lags: &[f64], parts: &[Part]) -> Option<Whole> {
    let plant = model.first_order().expect("reduced inertia is positive definite");
    let whole = plant.a.rows();
    let mut n = whole;
    let mut take = |count: usize| {
        n += count;
        n - count
    };
    let lagged: Vec<Option<usize>> = lags.iter().map(|lag| (*lag > 0.0).then(|| take(1))).collect();
    let firsts: Vec<usize> = parts.iter().map(|part| take(part.law.a.rows())).collect();
    let over = |first: usize, states: &Matrix<Rational>, plant: &Matrix<Rational>| {
        Matrix::from_fn(plant.rows(), n, |i, j| match j {
            j if j < whole => plant[(i, j)].clone(),
            j if (first..first + states.columns()).contains(&j) => states[(i, j - first)].clone(),
            _ => Rational::ZERO,
        })
    };
    let own: Vec<Matrix<Rational>> =
        parts.iter().zip(&firsts).map(|(part, &first)| over(first, &part.law.c, &part.law.d)).collect();
    let mut commands = Matrix::<Rational>::zeros(model.inputs.len(), n);
    for (part, own) in parts.iter().zip(&own) {
        for (i, &input) in part.inputs.iter().enumerate() {
            (0..n).for_each(|j| commands[(input, j)] = commands[(input, j)].plus(&own[(i, j)]));
        }
    }
    let mut flow = Matrix::<Rational>::zeros(n, n);
    for i in 0..whole {
        (0..whole).for_each(|j| flow[(i, j)] = plant.a[(i, j)].clone());
    }
    let at = |place: usize, j: usize| if j == place { Rational::ONE } else { Rational::ZERO };
    for (input, place) in lagged.iter().enumerate() {
        let torque: Vec<Rational> = match place {
            Some(place) => {
                let rate = Rational::ONE.over(&shortest_decimal(lags[input])?);
                for j in 0..n {
                    flow[(*place, j)] = rate.times(&commands[(input, j)].minus(&at(*place, j)));
                }
                (0..n).map(|j| at(*place, j)).collect()
            }
            None => commands.row(input).to_vec(),
        };
        for i in (0..whole).filter(|i| !plant.b[(*i, input)].is_zero()) {
            for (j, torque) in torque.iter().enumerate().filter(|(_, x)| !x.is_zero()) {
                flow[(i, j)] = flow[(i, j)].plus(&plant.b[(i, input)].times(torque));
            }
        }
    }
    let mut signals: Vec<Vec<Rational>> =
        own.iter().flat_map(|own| (0..own.rows()).map(|i| own.row(i).to_vec())).collect();
    for (part, &first) in parts.iter().zip(&firsts) {
        let commanded = |i: usize, j: usize| match lagged[part.inputs[i]] {
            Some(place) => at(place, j),
            None => commands[(part.inputs[i], j)].clone(),
        };
        let commanded = part.torques.multiply(&Matrix::from_fn(part.inputs.len(), n, commanded));
        let plant = over(first, &part.law.a, &part.law.b);
        for i in 0..part.law.a.rows() {
            (0..n).for_each(|j| flow[(first + i, j)] = plant[(i, j)].plus(&commanded[(i, j)]));
            // What drives the states, and the states themselves.
            signals.push((0..n).map(|j| flow[(first + i, j)].clone()).collect());
            signals.push((0..n).map(|j| at(first + i, j)).collect());
        }
    }
    let signals = Matrix::from_fn(signals.len(), n, |i, j| signals[i][j].clone());
    Some(Whole { matrix: flow, signals, commands })
}
