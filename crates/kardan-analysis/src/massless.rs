//! Motions without inertia: found, and eliminated exactly.

use kardan_math::names::sign;
use kardan_math::num::{Matrix, Rational, Scalar};
use kardan_results::signal_name::Quantity;

use super::LinearSystem;
use super::parts::{kernel, limit_space, reduced_form, rows_of, side_by_side, stacked, window};

/// Names with factors: a direction, or a combination of quantities.
type Combination = Vec<(String, Rational)>;

/// A system from which the motions without inertia are eliminated.
#[derive(Debug, Clone, PartialEq)]
pub struct Eliminated {
    /// The remaining system, with regular E. A state that carries the name of an original one is that quantity.
    pub system: LinearSystem,
    /// States that are no original ones but combinations of them, such as `z1 = a.w + b.w`.
    pub definitions: Vec<(String, Combination)>,
    /// Original states that are no states any more.
    pub removed: Vec<String>,
}

/// Why motions without inertia cannot be eliminated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MasslessError {
    /// Along the direction (angles, or speeds where it ends in `.w`) the equations determine no motion.
    #[error(
        "the motion along {} is not determined by the equations: it has no inertia, and neither damping nor stiffness \
         determine it",
        combination(direction)
    )]
    Undetermined {
        /// The coordinates that take part, with factors.
        direction: Combination,
    },
    /// The output would need a derivative of the input.
    #[error(
        "output `{output}` would depend on derivative {order} of input `{input}`, which acts on the motion along {} without \
         inertia",
        combination(direction)
    )]
    InputDerivative {
        /// The output.
        output: String,
        /// The input.
        input: String,
        /// The highest derivative needed.
        order: usize,
        /// What follows the derivative of the input, with factors.
        direction: Combination,
    },
    /// There are no dynamics: all outputs follow the inputs without delay.
    #[error("no motion is left: without inertia and damping all outputs follow the inputs without delay")]
    Static,
}

/// `` `a` − 2·`b` `` for a message.
pub fn combination(terms: &[(String, Rational)]) -> String {
    signed_sum(terms, "−", |name, size| match size {
        None => format!("`{name}`"),
        Some(size) => format!("{size}·`{name}`"),
    })
}

/// `a - 2 b` for a text.
pub fn plain_combination(terms: &[(String, Rational)]) -> String {
    signed_sum(terms, "-", |name, size| match size {
        None => name.clone(),
        Some(size) => format!("{size} {name}"),
    })
}

/// Terms joined by their signs; `text` gives a term with the size of its factor, `None` for one.
pub(super) fn signed_sum<T>(
    terms: &[(T, Rational)],
    minus: &str,
    text: impl Fn(&T, Option<&Rational>) -> String,
) -> String {
    let mut out = String::new();
    for (term, factor) in terms {
        let negative = *factor < Rational::ZERO;
        let size = if negative { Rational::ZERO.minus(factor) } else { factor.clone() };
        out += &sign(out.is_empty(), negative).replace('-', minus);
        out += &text(term, Some(&size).filter(|size| **size != Rational::ONE));
    }
    out
}

fn named(names: &[String], factors: impl IntoIterator<Item = Rational>) -> Combination {
    let terms: Combination = names.iter().cloned().zip(factors).filter(|(_, factor)| !factor.is_zero()).collect();
    // The first factor becomes one.
    let scale = terms.first().map_or(Rational::ONE, |(_, factor)| Rational::ONE.over(factor));
    terms.into_iter().map(|(name, factor)| (name, factor.times(&scale))).collect()
}

/// A direction without inertia: the coordinates that move in it with factors, or `None` if the inertia matrix is regular.
///
/// Of a basis of all such directions the one with the fewest coordinates is given, the first one of these.
///
/// # Panics
/// If `h` is not square with a row per coordinate.
pub fn massless_direction(coordinates: &[String], h: &Matrix<Rational>) -> Option<Combination> {
    assert!(h.rows() == coordinates.len() && h.columns() == coordinates.len(), "inertia matrix of a different size");
    let still = kernel(h);
    let directions = (0..still.columns()).map(|j| named(coordinates, column(&still, j)));
    directions.min_by_key(Vec::len)
}

/// Brings `H q̈ + D q̇ + S q = F u`, `y = C₀ q + C₁ q̇ + D₀ u` with singular H to a regular [`LinearSystem`] with the same
/// transfer matrix, exactly; `pencil` is that of [`linear_system`](super::linear_system).
///
/// The states are original ones `q.phi`, `q.w` as far as possible.
///
/// Method: the pencil sE − A of `x = [q; q̇]`, `E = diag(I, H)`, is split into its finite part V and its infinite part W
/// (Wong sequences over the rationals, as in Berger, Ilchmann, Trenn 2012): `x = V z + W f`, where z moves by differential
/// equations and `N ḟ = f + B_f u` with nilpotent N gives f from u at once. With L A W = 0 the equations of z are
/// `L E V ż = L A V z + L B u`. Cost O(n⁴) rational operations at worst.
///
/// # Errors
/// If the pencil is singular, an output needs derivatives of an input, or no state is left.
///
/// # Panics
/// If there are not two states for each coordinate.
pub fn eliminate_massless(coordinates: &[String], pencil: &LinearSystem) -> Result<Eliminated, MasslessError> {
    let (r, n) = (coordinates.len(), 2 * coordinates.len());
    assert_eq!(pencil.states.len(), n, "a pencil in angles and speeds");
    let LinearSystem { inputs, outputs, e, a, b, c, d, .. } = pencil;
    let (m, p) = (inputs.len(), outputs.len());
    let names: Vec<String> =
        [Quantity::Angle, Quantity::Speed].iter().flat_map(|k| coordinates.iter().map(|q| k.of(q))).collect();

    // Common kernel of H, D, S: named first because it is the most informative.
    let free = kernel(&stacked(&[&window(e, r..n, r..n), &window(a, r..n, r..n), &window(a, r..n, 0..r)]));
    if free.columns() > 0 {
        return Err(MasslessError::Undetermined { direction: named(coordinates, column(&free, 0)) });
    }
    // The largest V with A V ⊂ E V, where the differential equations live, and the limit of W ← E⁻¹(A W) from zero, where the equations
    // are algebraic.
    let finite = limit_space(a, e, Matrix::identity(n));
    let infinite = limit_space(e, a, Matrix::zeros(n, 0));
    let common = kernel(&side_by_side(&[&finite, &infinite]));
    if common.columns() > 0 {
        let part = window(&common, 0..finite.columns(), 0..1);
        return Err(MasslessError::Undetermined {
            direction: quantity(coordinates, &names, &finite.multiply(&part), 0),
        });
    }
    if finite.columns() == 0 {
        return Err(MasslessError::Static);
    }

    let (k, width) = (finite.columns(), infinite.columns());
    let follows = following(e, a, b, &finite, &infinite);
    for (order, follow) in follows.iter().enumerate().skip(1).rev() {
        let output_map = c.multiply(follow);
        let place = (0..p).flat_map(|i| (0..m).map(move |j| (i, j))).find(|place| !output_map[*place].is_zero());
        if let Some((i, j)) = place {
            return Err(MasslessError::InputDerivative {
                output: outputs[i].clone(),
                input: inputs[j].clone(),
                order,
                direction: quantity(coordinates, &names, follow, j),
            });
        }
    }
    let through = d.minus(&c.multiply(&follows[0]));

    let reached = follows.iter().skip(1).fold(follows[0].clone(), |all, follow| side_by_side(&[&all, follow]));
    let (states, definitions, chosen) = choose_states(&names, &finite, &reached);
    // V with M V = 1.
    let basis = finite.multiply(&chosen.multiply(&finite).solve(&Matrix::identity(k)).expect("independent by choice"));
    let left = kernel(&a.multiply(&infinite).transpose()).transpose();
    let removed = names.iter().filter(|name| !states.contains(name)).cloned().collect();
    let system = LinearSystem {
        states,
        inputs: inputs.clone(),
        outputs: outputs.clone(),
        e: left.multiply(e).multiply(&basis),
        a: left.multiply(a).multiply(&basis),
        b: left.multiply(b),
        c: c.multiply(&basis),
        d: through,
        degrees_of_freedom: (width == 0).then_some(r),
    };
    Ok(Eliminated { system, definitions, removed })
}

/// `f = −Σ Nⁱ B_f u⁽ⁱ⁾`, from `N ḟ = f + B_f u` in coordinates of W: what follows the inputs and their derivatives at once.
fn following(
    e: &Matrix<Rational>,
    a: &Matrix<Rational>,
    b: &Matrix<Rational>,
    finite: &Matrix<Rational>,
    infinite: &Matrix<Rational>,
) -> Vec<Matrix<Rational>> {
    let (k, width) = (finite.columns(), infinite.columns());
    let split = side_by_side(&[&e.multiply(finite), &a.multiply(infinite)]);
    let solved = split.solve(&side_by_side(&[&e.multiply(infinite), b])).expect("regular: the pencil is");
    let nilpotent = window(&solved, k..k + width, 0..width);
    let mut power = window(&solved, k..k + width, width..solved.columns());
    let mut out = vec![infinite.multiply(&power)];
    for _ in 1..=width {
        power = nilpotent.multiply(&power);
        out.push(infinite.multiply(&power));
    }
    out
}

/// The states z = M x, M V regular: original ones that inputs do not move at once, then combinations of such.
fn choose_states(
    names: &[String],
    finite: &Matrix<Rational>,
    reached: &Matrix<Rational>,
) -> (Vec<String>, Vec<(String, Combination)>, Matrix<Rational>) {
    let (n, k) = (names.len(), finite.columns());
    let unit = |i: usize| Matrix::from_fn(1, n, |_, j| if i == j { Rational::ONE } else { Rational::ZERO });
    let still = kernel(&reached.transpose()).transpose();
    let originals = (0..n).filter(|i| reached.row(*i).iter().all(|x| x.is_zero())).map(|i| (Some(i), unit(i)));
    let combinations = (0..still.rows()).map(|i| (None, rows_of(&still, &[i])));
    let candidates: Vec<(Option<usize>, Matrix<Rational>)> = originals.chain(combinations).collect();
    let rows = Matrix::from_fn(candidates.len(), n, |i, j| candidates[i].1[(0, j)].clone());
    // Pivot columns of the transpose are the first independent rows.
    let images = rows.multiply(finite).transpose();
    let retained = reduced_form(&images).pivots;
    assert_eq!(retained.len(), k, "z is determined by what inputs do not move at once");
    let (mut states, mut definitions) = (Vec::new(), Vec::new());
    let mut chosen = Matrix::<Rational>::zeros(k, n);
    for (row, candidate) in retained.iter().enumerate() {
        let (original, functional) = &candidates[*candidate];
        let mut functional: Vec<Rational> = functional.row(0).to_vec();
        match original {
            Some(i) => states.push(names[*i].clone()),
            None => {
                let lead = functional.iter().find(|x| !x.is_zero()).expect("a row of a basis").clone();
                functional.iter_mut().for_each(|x| *x = x.over(&lead));
                let name = (definitions.len() + 1..)
                    .map(|i| format!("z{i}"))
                    .find(|name| !names.contains(name))
                    .expect("endless");
                definitions.push((name.clone(), named(names, functional.clone())));
                states.push(name);
            }
        }
        chosen.row_mut(row).clone_from_slice(&functional);
    }
    (states, definitions, chosen)
}

/// The angles of a column of states as coordinates, or if it has none its speeds.
fn quantity(coordinates: &[String], names: &[String], x: &Matrix<Rational>, j: usize) -> Combination {
    let angles = named(coordinates, column(x, j).into_iter().take(coordinates.len()));
    if angles.is_empty() { named(names, column(x, j)) } else { angles }
}

fn column(matrix: &Matrix<Rational>, j: usize) -> Vec<Rational> {
    (0..matrix.rows()).map(|i| matrix[(i, j)].clone()).collect()
}
