use std::collections::BTreeSet;

use faer::linalg::solvers::{PartialPivLu, Solve};
use faer::{Mat, MatRef, Side, c64};

use super::{ConstrainedSystem, LinearSystem, Reduction};
use crate::assemble::Along;
use crate::num::{Matrix, Rational, SparseRow, balance, null_vectors, project, rational_to_f64, sparse_echelon};
use crate::results::{Complex, ElementShare, EnergyKind, Factor, Mode, Pole, ShapePart, StoredShare};

/// Up to this number of rigid motions those without damping are told apart exactly.
const EXACT_RIGID_UP_TO: usize = 60;

/// All modes of `λ²H_r + λD_r + S_r`, by size of λ, conjugate pairs once.
///
/// Every eigenvalue is listed as often as it is a root, so that the modes stand for 2 · freedoms roots, pairs for two. The
/// shape runs over all shafts, `K v`, with largest entry 1. Shares of stored energy: kinetic `½ J |λ aᵀv|²` and potential
/// `½ s |aᵀv|²`, for λ = 0 the kinetic energy of a motion with the speeds v; they sum to one, terms of one element
/// together. Shares of the loss: `d |λ aᵀv|²`, none for λ = 0 or without damping. Where negative coefficients make a total
/// vanish (a body that falls from a negative spring keeps the energy zero) there are no shares.
///
/// Method: coordinates in which the inertia is the identity; rigid motions (`S_r v = 0`, exact if no stiffness is negative)
/// are split off, each with a root λ = 0 and, where they meet no damping (`D_r v = 0`, exact), with a second one, so that
/// double roots do not spread as rounding would have them; then QR iteration of the balanced first-order form, or
/// the symmetric eigenvalue problem if nothing is damped (`faer`). Backward stable: the relative residual of each mode is a
/// few hundred ulp. Cost: that of the eigenvalue problem of order 2 · freedoms with vectors.
///
/// `None` if `H_r` is not positive definite, a number is not finite or the iteration fails. The fields `factor`,
/// `controllable` and `observable` stay empty.
///
/// # Panics
/// If the reduction is not one of the system.
pub fn modes(system: &ConstrainedSystem, reduction: &Reduction) -> Option<Vec<Mode>> {
    let r = reduction.freedoms();
    if r == 0 {
        return Some(Vec::new());
    }
    let (h, d, s) = (reduction.inertia(), reduction.damping(), reduction.stiffness());
    if !(h.is_all_finite() && d.is_all_finite() && s.is_all_finite()) {
        return None;
    }
    let rigid = rigid_motions(&reduction.system);
    let pairs = quadratic_pairs(&h, &d, &s, &rigid)?;
    let basis: Vec<Vec<(usize, f64)>> = reduction.basis.iter().map(floats).collect();
    let elements = Elements::new(&reduction.system);
    let mode = |pair: &Pair| {
        let all: Vec<c64> = basis.iter().map(|row| along(row, &pair.vector)).collect();
        let scale = largest(&all);
        let vector: Vec<c64> = pair.vector.iter().map(|x| x / scale).collect();
        let shape = shape(&system.shafts, all.iter().map(|x| x / scale));
        elements.mode(pair.value, &vector, shape)
    };
    Some(sorted(pairs.iter().map(mode).collect()))
}

/// The modes of a mechanical system with the eigenvalues of its exact factors, each as often as it is one: 2 · freedoms roots
/// altogether, whatever rounding makes of multiple ones.
///
/// Shapes and energies are those of [`modes`]: of the null vectors of `λ²H_r + λD_r + S_r`, as many independent ones as the
/// factor says, repeated where an eigenvalue has fewer of them than its multiplicity. `factor`, `controllable` and
/// `observable` are those of the factor. Roots of factors that are not written out come from [`modes`]. `None` if these are
/// needed and there are none.
///
/// # Panics
/// If the reduction is not one of the system.
pub fn exact_modes(system: &ConstrainedSystem, reduction: &Reduction, factors: &[Factor]) -> Option<Vec<Mode>> {
    let r = reduction.freedoms();
    let matrices = [reduction.inertia(), reduction.damping(), reduction.stiffness()];
    if !matrices.iter().all(Mat::is_all_finite) {
        return None;
    }
    let original = matrices.each_ref();
    let band = bandwidth(original);
    let Rigid { free, damped } = rigid_motions(&reduction.system);
    let rigid: Vec<Vec<c64>> = free.iter().chain(&damped).map(|motion| dense(motion, r)).collect();
    let basis: Vec<Vec<(usize, f64)>> = reduction.basis.iter().map(floats).collect();
    let elements = Elements::new(&reduction.system);
    let at = |pole: Pole, count: usize| {
        let vectors = match pole == Complex::default() && rigid.len() == count {
            true => Some(rigid.clone()),
            false => quadratic_null_vectors(original, band, c64::new(pole.re, pole.im), count),
        };
        let mode = |vector: &Vec<c64>| {
            let all: Vec<c64> = basis.iter().map(|row| along(row, vector)).collect();
            let scale = largest(&all);
            let vector: Vec<c64> = vector.iter().map(|x| x / scale).collect();
            let shape = shape(&system.shafts, all.iter().map(|x| x / scale));
            elements.mode(c64::new(pole.re, pole.im), &vector, shape)
        };
        vectors.unwrap_or_default().iter().map(mode).collect()
    };
    with_exact_values(2 * r, factors, at, || modes(system, reduction))
}

/// The modes of `E ẋ = A x` with the eigenvalues of the exact factors, each as often as it is one: n roots altogether.
///
/// Shapes are those of [`modes_of_pencil`], as many independent ones as the factor says. Roots of factors that are not
/// written out come from there. `None` if these are needed and there are none.
///
/// ```
/// use kardan::analysis::{LinearSystem, exact_modes_of_pencil, structure};
/// use kardan::num::{Matrix, Rational};
/// // A² = 0: rounding would make ± 1e-8 of the double zero.
/// let a = Matrix::from_fn(2, 2, |_, j| Rational::from(1 - 2 * j as i64));
/// let system = LinearSystem::state_space(a, Matrix::zeros(2, 0), Matrix::zeros(0, 2));
/// let modes = exact_modes_of_pencil(&system, &structure(&system).unwrap().factors).unwrap();
/// assert_eq!(modes.iter().map(|mode| mode.eigenvalue).collect::<Vec<_>>(), [(0.0, 0.0); 2]);
/// ```
pub fn exact_modes_of_pencil(system: &LinearSystem, factors: &[Factor]) -> Option<Vec<Mode>> {
    let (e, a) = (system.e.to_f64(), system.a.to_f64());
    let n = system.states.len();
    let state = state_matrix(&e, &a);
    let scales = if state.is_all_finite() { balance(&state) } else { Vec::new() };
    let balanced = Mat::from_fn(n, n, |i, j| match scales.is_empty() {
        true => 0.0,
        false => state[(i, j)] * scales[j] / scales[i],
    });
    let tolerance = 1e-14 * n as f64 * balanced.norm_l2();
    let at = |pole: Pole, count: usize| {
        let value = c64::new(pole.re, pole.im);
        let vectors = match (scales.is_empty(), count) {
            (true, _) => None,
            (_, 1) => null_vector(balanced.as_ref(), value, tolerance).map(|vector| vec![vector]),
            _ => null_space(
                &Mat::from_fn(n, n, |i, j| c64::new(balanced[(i, j)], 0.0) - if i == j { value } else { c64::ZERO }),
                count,
            ),
        };
        let original = |vector: &Vec<c64>| {
            let vector = vector.iter().zip(&scales).map(|(x, scale)| x * *scale).collect::<Vec<_>>();
            Some(Mode { shape: shape(&system.states, normalised(&vector)?.into_iter()), ..root(value) })
        };
        vectors.unwrap_or_default().iter().filter_map(original).collect()
    };
    with_exact_values(n, factors, at, || modes_of_pencil(&system.states, &e, &a))
}

/// Modes with the roots of the factors as eigenvalues, `count` roots altogether; `at` gives modes of independent vectors to
/// an eigenvalue, as many as it is asked for or none, and `floating` all modes as floating point has them.
fn with_exact_values(
    count: usize,
    factors: &[Factor],
    at: impl Fn(Pole, usize) -> Vec<Mode>,
    floating: impl FnOnce() -> Option<Vec<Mode>>,
) -> Option<Vec<Mode>> {
    let mut out = Vec::new();
    // Every root, those of pairs both.
    let mut known: Vec<Pole> = Vec::new();
    for factor in factors {
        for &pole in &factor.roots {
            known.extend(std::iter::repeat_n(pole, factor.algebraic));
            if pole.im < 0.0 {
                continue;
            }
            let found = at(pole, factor.geometric);
            let mode = |k: usize| Mode {
                factor: factor.polynomial.clone(),
                controllable: factor.input_defect == 0,
                observable: factor.output_defect == 0,
                // Without a vector nothing is said but the eigenvalue.
                ..found.get(k % found.len().max(1)).cloned().unwrap_or_else(|| root(c64::new(pole.re, pole.im)))
            };
            out.extend((0..factor.algebraic).map(mode));
        }
    }
    if known.len() < count {
        // What is left belongs to the factors that are not written out.
        let open: Vec<&Factor> = factors.iter().filter(|factor| factor.roots.is_empty()).collect();
        let of_open = |mode: Mode| Mode {
            factor: match open[..] {
                [one] => one.polynomial.clone(),
                _ => "(not written out)".into(),
            },
            controllable: open.iter().all(|factor| factor.input_defect == 0),
            observable: open.iter().all(|factor| factor.output_defect == 0),
            ..mode
        };
        out.extend(others(floating()?, &known, count)?.into_iter().map(of_open));
    }
    Some(sorted(out))
}

/// The modes that are left when for each known root the nearest one is taken out of `count` roots; `None` if the modes do not
/// stand for that many.
///
/// Where one root of a pair is taken out, the pair is what rounding has made of two real roots.
fn others(modes: Vec<Mode>, known: &[Pole], count: usize) -> Option<Vec<Mode>> {
    let both = |(k, mode): (usize, &Mode)| {
        let Complex { re, im } = mode.eigenvalue;
        let roots = if im == 0.0 { vec![mode.eigenvalue] } else { vec![mode.eigenvalue, Complex { re, im: -im }] };
        roots.into_iter().map(move |root| (k, root))
    };
    let mut left: Vec<(usize, Pole)> = modes.iter().enumerate().flat_map(both).collect();
    if left.len() != count {
        return None;
    }
    for root in known {
        let distance = |(_, other): &(usize, Pole)| (other.re - root.re).hypot(other.im - root.im);
        let nearest = (0..left.len()).min_by(|&i, &j| distance(&left[i]).total_cmp(&distance(&left[j])))?;
        left.swap_remove(nearest);
    }
    let of_mode = |(k, mode): (usize, Mode)| {
        let roots = left.iter().filter(|(other, _)| *other == k).count();
        match (roots, mode.eigenvalue) {
            (0, _) => None,
            (1, Complex { re, im }) if im != 0.0 => {
                let shape = mode.shape.into_iter().map(|part| part.real()).collect();
                let Mode { natural_frequency, damping_ratio, .. } = root(c64::new(re, 0.0));
                Some(Mode { eigenvalue: Complex { re, im: 0.0 }, natural_frequency, damping_ratio, shape, ..mode })
            }
            _ => Some(mode),
        }
    };
    Some(modes.into_iter().enumerate().filter_map(of_mode).collect())
}

/// Independent null vectors of a matrix whose defect is known, each with largest entry 1.
fn null_space(matrix: &Mat<c64>, count: usize) -> Option<Vec<Vec<c64>>> {
    let vector = |v: &Vec<(f64, f64)>| normalised(&v.iter().map(|(re, im)| c64::new(*re, *im)).collect::<Vec<_>>());
    null_vectors(matrix.as_ref(), count)?.vectors.iter().map(vector).collect()
}

fn dense(row: &SparseRow, length: usize) -> Vec<c64> {
    let mut out = vec![c64::ZERO; length];
    row.iter().for_each(|(i, x)| out[*i] = c64::new(rational_to_f64(x), 0.0));
    out
}

/// E⁻¹A.
fn state_matrix(e: &Matrix<f64>, a: &Matrix<f64>) -> Mat<f64> {
    let n = e.rows();
    let right = Mat::from_fn(n, n, |i, j| a[(i, j)]);
    if n == 0 {
        return right;
    }
    PartialPivLu::new(Mat::from_fn(n, n, |i, j| e[(i, j)]).as_ref()).solve(right)
}

/// The mode of a motion that is known: all shafts move as `v e^{λt}`, with `motion` = v (real and imaginary part for each
/// shaft) and the shares of the energies as in [`modes`].
///
/// Of a motion that stands still (`v = 0`) nothing is said but its eigenvalue.
///
/// # Panics
/// If there is not one entry for each shaft.
pub fn mode_of_motion(system: &ConstrainedSystem, eigenvalue: Pole, motion: &[(f64, f64)]) -> Mode {
    assert_eq!(motion.len(), system.shafts.len(), "one entry for each shaft");
    let vector: Vec<c64> = motion.iter().map(|(re, im)| c64::new(*re, *im)).collect();
    let value = c64::new(eigenvalue.re, eigenvalue.im);
    match normalised(&vector) {
        Some(vector) => {
            let shape = shape(&system.shafts, vector.iter().copied());
            Elements::new(system).mode(value, &vector, shape)
        }
        None => root(value),
    }
}

/// The terms of a system by element and kind.
struct Elements<'a> {
    inertias: Vec<Element<'a>>,
    springs: Vec<Element<'a>>,
    dampers: Vec<Element<'a>>,
}

impl<'a> Elements<'a> {
    fn new(system: &'a ConstrainedSystem) -> Self {
        let [inertias, springs, dampers] = [&system.inertias, &system.springs, &system.dampers].map(|t| by_element(t));
        Self { inertias, springs, dampers }
    }

    fn mode(&self, value: c64, vector: &[c64], shape: Vec<ShapePart>) -> Mode {
        let moving = value.norm() > 0.0;
        let speed = if moving { value.norm_sqr() } else { 1.0 };
        let kinetic = energies(&self.inertias, vector, 0.5 * speed);
        let potential = if moving { energies(&self.springs, vector, 0.5) } else { Vec::new() };
        let lost = if moving { energies(&self.dampers, vector, 1.0) } else { Vec::new() };
        let kinds = kinetic.iter().map(|_| EnergyKind::Kinetic).chain(potential.iter().map(|_| EnergyKind::Potential));
        let kinds: Vec<EnergyKind> = kinds.collect();
        let stored = shares(kinetic.into_iter().chain(potential).collect());
        Mode {
            shape,
            stored: stored
                .into_iter()
                .zip(kinds)
                .map(|(ElementShare { element, share }, energy)| StoredShare { element, energy, share })
                .collect(),
            dissipated: shares(lost),
            ..root(value)
        }
    }
}

/// The modes of `E ẋ = A x`: roots of `det(λE − A)`, by size, conjugate pairs once; the shape is over the states.
///
/// States have no common unit, so the largest entry, which becomes 1, depends on the units; there are no energies. Method:
/// `E⁻¹A`, balanced, then QR iteration (`faer`). `None` if E is singular, a number is not finite or the iteration fails.
///
/// # Panics
/// If E and A are not square of the number of states.
pub fn modes_of_pencil(states: &[String], e: &Matrix<f64>, a: &Matrix<f64>) -> Option<Vec<Mode>> {
    let n = states.len();
    assert!([e.rows(), e.columns(), a.rows(), a.columns()] == [n; 4], "pencil and states of different sizes");
    if n == 0 {
        return Some(Vec::new());
    }
    let pairs: Vec<Pair> = state_pairs(&state_matrix(e, a), null_vector)?;
    let mode = |pair: &Pair| Mode { shape: shape(states, pair.vector.iter().copied()), ..root(pair.value) };
    Some(sorted(pairs.iter().map(mode).collect()))
}

/// An eigenvalue with imaginary part ≥ 0 and its eigenvector.
struct Pair {
    value: c64,
    vector: Vec<c64>,
}

fn root(value: c64) -> Mode {
    let size = value.norm();
    Mode {
        eigenvalue: Complex::new(value.re, value.im),
        natural_frequency: size,
        // Not −0 where nothing is damped.
        damping_ratio: if size > 0.0 { 0.0 - value.re / size } else { 1.0 },
        ..Mode::default()
    }
}

fn sorted(mut modes: Vec<Mode>) -> Vec<Mode> {
    modes.sort_by(|a, b| {
        let size = a.natural_frequency.total_cmp(&b.natural_frequency);
        size.then(a.eigenvalue.re.total_cmp(&b.eigenvalue.re)).then(a.eigenvalue.im.total_cmp(&b.eigenvalue.im))
    });
    modes
}

fn shape(names: &[String], values: impl Iterator<Item = c64>) -> Vec<ShapePart> {
    names
        .iter()
        .zip(values)
        .map(|(name, x)| ShapePart { name: name.clone(), value: Complex::new(x.re, x.im) })
        .collect()
}

fn floats(row: &SparseRow) -> Vec<(usize, f64)> {
    row.iter().map(|(j, x)| (*j, rational_to_f64(x))).collect()
}

fn along(row: &[(usize, f64)], x: &[c64]) -> c64 {
    row.iter().map(|(j, factor)| x[*j] * *factor).sum()
}

/// With largest entry 1; `None` if that is impossible.
fn normalised(x: &[c64]) -> Option<Vec<c64>> {
    // In two steps, so that the size of a complex divisor cannot overflow.
    let size = x.iter().fold(0.0f64, |max, x| max.max(x.re.abs()).max(x.im.abs()));
    let x: Vec<c64> = x.iter().map(|x| c64::new(x.re / size, x.im / size)).collect();
    let largest = largest(&x);
    let x: Vec<c64> = x.iter().map(|x| x / largest).collect();
    x.iter().all(|x| x.re.is_finite() && x.im.is_finite()).then_some(x)
}

fn largest(x: &[c64]) -> c64 {
    x.iter().copied().fold(c64::ZERO, |best, x| if x.norm() > best.norm() { x } else { best })
}

/// A coefficient and its direction.
type TermAlong = (f64, Vec<(usize, f64)>);

/// An element and its terms of one kind.
type Element<'a> = (&'a str, Vec<TermAlong>);

/// The terms of each element together, in the order in which the elements first appear.
fn by_element(terms: &[Along<Rational>]) -> Vec<Element<'_>> {
    let mut places = std::collections::HashMap::new();
    let mut out: Vec<Element> = Vec::new();
    for term in terms {
        let place = *places.entry(term.element.as_str()).or_insert_with(|| {
            out.push((term.element.as_str(), Vec::new()));
            out.len() - 1
        });
        out[place].1.push((rational_to_f64(&term.value), term.row_f64()));
    }
    out
}

/// `factor Σ c |aᵀx|²` for each element.
fn energies<'a>(elements: &[Element<'a>], x: &[c64], factor: f64) -> Vec<(&'a str, f64)> {
    let energy = |(value, row): &TermAlong| value * along(row, x).norm_sqr();
    elements.iter().map(|(name, terms)| (*name, factor * terms.iter().map(energy).sum::<f64>())).collect()
}

/// Parts of the sum; empty if there is none (negative coefficients can cancel others).
fn shares(parts: Vec<(&str, f64)>) -> Vec<ElementShare> {
    let sum: f64 = parts.iter().map(|(_, part)| part).sum();
    let size: f64 = parts.iter().map(|(_, part)| part.abs()).sum();
    if !(sum.abs() > 1e-12 * size) {
        return Vec::new();
    }
    parts.into_iter().map(|(element, part)| ElementShare { element: element.to_string(), share: part / sum }).collect()
}

/// Motions that stretch no spring, over the coordinates.
struct Rigid {
    /// Those that also meet no damping.
    free: Vec<SparseRow>,
    /// Others, so that both together are a basis.
    damped: Vec<SparseRow>,
}

/// The kernel of `S_r`, split by `D_r`, exact. Empty if a stiffness is negative, when springs can cancel each other.
fn rigid_motions(reduced: &ConstrainedSystem) -> Rigid {
    let n = reduced.shafts.len();
    let columns: Vec<usize> = (0..n).collect();
    if reduced.springs.iter().any(|spring| spring.value < Rational::ZERO) {
        return Rigid { free: Vec::new(), damped: Vec::new() };
    }
    let stretching = reduced.springs.iter().filter(|spring| !spring.value.is_zero()).map(|spring| &spring.row);
    let kernel = kernel_columns(stretching, &columns);
    if kernel.len() > EXACT_RIGID_UP_TO {
        return Rigid { free: Vec::new(), damped: kernel };
    }
    // Rows of D_r Z, one for each coordinate.
    let motions = transposed(&kernel, n);
    let mut loss: Vec<SparseRow> = vec![Vec::new(); n];
    for damper in &reduced.dampers {
        let speed = project(&damper.row, &motions);
        for (i, x) in &damper.row {
            let mut sum = std::mem::take(&mut loss[*i]);
            sum.extend(speed.iter().map(|(j, y)| (*j, &damper.value * x * y)));
            loss[*i] = merged(sum);
        }
    }
    let numbers: Vec<usize> = (0..kernel.len()).collect();
    let lost = sparse_echelon(&loss, &numbers);
    let combined = |weights: &SparseRow| project(weights, &kernel);
    Rigid {
        free: kernel_columns(&loss, &numbers).iter().map(combined).collect(),
        damped: lost.rows.keys().map(|&k| kernel[k].clone()).collect(),
    }
}

/// Adds entries of the same column.
fn merged(mut entries: SparseRow) -> SparseRow {
    entries.sort_by_key(|(j, _)| *j);
    let mut out: SparseRow = Vec::new();
    for (j, x) in entries {
        match out.last_mut() {
            Some((last, sum)) if *last == j => *sum += x,
            _ => out.push((j, x)),
        }
    }
    out.retain(|(_, x)| !x.is_zero());
    out
}

/// A basis of the kernel, one sparse vector for each dimension.
fn kernel_columns<'a>(rows: impl IntoIterator<Item = &'a SparseRow>, columns: &[usize]) -> Vec<SparseRow> {
    let echelon = sparse_echelon(rows, columns);
    let free: Vec<usize> = columns.iter().copied().filter(|j| !echelon.rows.contains_key(j)).collect();
    transposed(&echelon.kernel(columns.len(), &free), free.len())
}

fn transposed(rows: &[SparseRow], columns: usize) -> Vec<SparseRow> {
    let mut out = vec![Vec::new(); columns];
    for (i, row) in rows.iter().enumerate() {
        for (j, x) in row {
            out[*j].push((i, x.clone()));
        }
    }
    out
}

/// Eigenvalues and vectors of `λ²H + λD + S`, all symmetric, H definite.
fn quadratic_pairs(h: &Mat<f64>, d: &Mat<f64>, s: &Mat<f64>, rigid: &Rigid) -> Option<Vec<Pair>> {
    let r = h.nrows();
    let original = [h, d, s];
    let factor = h.llt(Side::Lower).ok()?;
    let l = factor.L();
    let unit_inertia = |m: &Mat<f64>| {
        let mut half = m.clone();
        l.solve_lower_triangular_in_place(&mut half);
        let mut out = half.transpose().to_owned();
        l.solve_lower_triangular_in_place(&mut out);
        out
    };
    let (free, known) = (rigid.free.len(), rigid.free.len() + rigid.damped.len());
    let (mut d, mut s) = (unit_inertia(d), unit_inertia(s));
    let mut motions = Mat::<f64>::zeros(r, known);
    for (k, motion) in rigid.free.iter().chain(&rigid.damped).enumerate() {
        for (i, x) in motion {
            motions[(*i, k)] = rational_to_f64(x);
        }
    }
    // Orthonormal axes: first the free rigid motions, then the damped ones, then the others.
    let axes = (known > 0).then(|| (l.transpose() * &motions).qr().compute_Q());
    if let Some(q) = &axes {
        d = q.transpose() * &d * q;
        s = q.transpose() * &s * q;
    }
    let (values, mut vectors, unsolved) =
        if d.norm_max() == 0.0 { undamped_pairs(&s, known)? } else { damped_pairs(&d, &s, free, known)? };
    if let Some(q) = &axes {
        vectors = [q * &vectors[0], q * &vectors[1]];
    }
    for part in &mut vectors {
        l.transpose().solve_upper_triangular_in_place(part);
    }
    let exact = |k: usize| Pair { value: c64::ZERO, vector: (0..r).map(|i| c64::new(motions[(i, k)], 0.0)).collect() };
    let mut out: Vec<Pair> = (0..free).chain(0..known).map(exact).collect();
    let band = bandwidth(original);
    for (k, value) in values.into_iter().enumerate() {
        let vector: Vec<c64> = if unsolved.contains(&k) {
            quadratic_null_vectors(original, band, value, 1)?.swap_remove(0)
        } else {
            (0..r).map(|i| c64::new(vectors[0][(i, k)], vectors[1][(i, k)])).collect()
        };
        out.push(Pair { value, vector: normalised(&vector)? });
    }
    Some(out)
}

type Vectors = [Mat<f64>; 2]; // real and imaginary parts

/// Eigenvalues, their vectors, and the numbers of those without a vector.
type Found = (Vec<c64>, Vectors, BTreeSet<usize>);

/// Without damping: `−λ²` are the eigenvalues of S beyond the `known` rigid motions.
fn undamped_pairs(s: &Mat<f64>, known: usize) -> Option<Found> {
    let (r, flexible) = (s.nrows(), s.nrows() - known);
    if flexible == 0 {
        return Some((Vec::new(), [Mat::zeros(r, 0), Mat::zeros(r, 0)], BTreeSet::new()));
    }
    let eigen = s.submatrix(known, known, flexible, flexible).self_adjoint_eigen(Side::Lower).ok()?;
    let (mut values, mut of) = (Vec::new(), Vec::new());
    for k in 0..flexible {
        let square = eigen.S()[k];
        let root = square.abs().sqrt();
        values.push(if square > 0.0 { c64::new(0.0, root) } else { c64::new(-root, 0.0) });
        of.push(k);
        if square <= 0.0 {
            values.push(c64::new(root, 0.0));
            of.push(k);
        }
    }
    let real = Mat::from_fn(r, of.len(), |i, k| if i < known { 0.0 } else { eigen.U()[(i - known, of[k])] });
    let imaginary = Mat::zeros(r, of.len());
    Some((values, [real, imaginary], BTreeSet::new()))
}

/// First-order form with the states `ω y` (motions beyond the rigid ones) and all speeds but those of free rigid motions,
/// which are constant.
fn damped_pairs(d: &Mat<f64>, s: &Mat<f64>, free: usize, known: usize) -> Option<Found> {
    let r = s.nrows();
    let angles = r - known;
    let omega = if s.norm_max() > 0.0 { s.norm_max().sqrt() } else { 1.0 };
    let mut a = Mat::<f64>::zeros(angles + r - free, angles + r - free);
    for i in known..r {
        a[(i - known, angles + i - free)] = omega;
        for j in known..r {
            a[(angles + i - free, j - known)] = -s[(i, j)] / omega;
        }
    }
    for i in free..r {
        for j in free..r {
            a[(angles + i - free, angles + j - free)] = -d[(i, j)];
        }
    }
    // A vector without entries stands for none.
    let pairs = state_pairs(&a, |_, _, _| Some(Vec::new()))?;
    let unsolved: BTreeSet<usize> = (0..pairs.len()).filter(|&k| pairs[k].vector.is_empty()).collect();
    // λ times the motion, which needs no division by a small λ.
    let mut vectors = [Mat::zeros(r, pairs.len()), Mat::zeros(r, pairs.len())];
    for (k, pair) in pairs.iter().enumerate().filter(|(k, _)| !unsolved.contains(k)) {
        let moved = |i: usize| pair.value * pair.vector[i - known] * (1.0 / omega);
        let mut motion: Vec<c64> =
            (free..r).map(|i| if i < known { pair.vector[angles + i - free] } else { moved(i) }).collect();
        if largest(&motion) == c64::ZERO {
            // λ = 0 that was not split off: the angles are the motion.
            motion = (free..r).map(|i| if i < known { c64::ZERO } else { pair.vector[i - known] }).collect();
        }
        for (i, x) in normalised(&motion)?.into_iter().enumerate() {
            vectors[0][(free + i, k)] = x.re;
            vectors[1][(free + i, k)] = x.im;
        }
    }
    Some((pairs.into_iter().map(|pair| pair.value).collect(), vectors, unsolved))
}

/// Eigenvalues with imaginary part ≥ 0 and eigenvectors of a matrix.
///
/// `faer` returns overflowing or wrong vectors for eigenvalues that are nearly defective several times over, so every vector
/// is checked by its residual; `otherwise` finds another one, of the balanced matrix with a residual below the tolerance.
fn state_pairs(a: &Mat<f64>, otherwise: impl Fn(MatRef<'_, f64>, c64, f64) -> Option<Vec<c64>>) -> Option<Vec<Pair>> {
    if !a.is_all_finite() {
        return None;
    }
    let n = a.nrows();
    if n == 0 {
        return Some(Vec::new());
    }
    let scales = balance(a);
    let balanced = Mat::from_fn(n, n, |i, j| a[(i, j)] * scales[j] / scales[i]);
    let eigen = balanced.eigen().ok()?;
    let kept: Vec<usize> = (0..n).filter(|&k| eigen.S()[k].im >= 0.0).collect();
    let vectors: Vec<Option<Vec<c64>>> =
        kept.iter().map(|&k| normalised(&(0..n).map(|i| eigen.U()[(i, k)]).collect::<Vec<_>>())).collect();
    let part = |of: fn(&c64) -> f64| {
        Mat::from_fn(n, kept.len(), |i, k| vectors[k].as_ref().map_or(0.0, |vector| of(&vector[i])))
    };
    let images = [&balanced * part(|x| x.re), &balanced * part(|x| x.im)];
    let tolerance = 1e-14 * n as f64 * balanced.norm_l2();
    let mut out = Vec::new();
    for (k, vector) in vectors.into_iter().enumerate() {
        let value = eigen.S()[kept[k]];
        let solves = |vector: &Vec<c64>| {
            (0..n).all(|i| (c64::new(images[0][(i, k)], images[1][(i, k)]) - value * vector[i]).norm() <= tolerance)
        };
        let vector = vector.filter(solves).or_else(|| otherwise(balanced.as_ref(), value, tolerance))?;
        let vector: Vec<c64> = vector.iter().zip(&scales).map(|(x, scale)| x * *scale).collect();
        out.push(Pair { value, vector: if vector.is_empty() { vector } else { normalised(&vector)? } });
    }
    Some(out)
}

/// The eigenvector to a known eigenvalue: one step of inverse iteration, `(A − λ)x = b`, whose residual is `‖b‖/‖x‖`; if that
/// is not small or x overflows, the singular value decomposition.
fn null_vector(a: MatRef<'_, f64>, value: c64, tolerance: f64) -> Option<Vec<c64>> {
    let n = a.nrows();
    let value = value + c64::new(f64::EPSILON * a.norm_l2(), 0.0);
    let shifted = Mat::from_fn(n, n, |i, j| c64::new(a[(i, j)], 0.0) - if i == j { value } else { c64::ZERO });
    // No symmetry of the system is in the way of this right-hand side.
    let right = Mat::from_fn(n, 1, |i, _| c64::new(1.0 / (1.0 + i as f64), 0.0));
    let x: Vec<c64> = PartialPivLu::new(shifted.as_ref()).solve(&right).col(0).iter().copied().collect();
    let size = largest(&x).norm();
    if size.is_finite() && right.norm_l2() <= tolerance * size {
        return normalised(&x);
    }
    let null = null_vectors(shifted.as_ref(), 1)?;
    Some(null.vectors[0].iter().map(|(re, im)| c64::new(*re, *im)).collect())
}

/// Largest distance of an entry from the diagonal.
fn bandwidth(matrices: [&Mat<f64>; 3]) -> usize {
    let r = matrices[0].nrows();
    let occupied = |i: usize, j: usize| matrices.iter().any(|m| m[(i, j)] != 0.0);
    (0..r)
        .flat_map(|j| (0..r).map(move |i| (i, j)))
        .filter(|&(i, j)| occupied(i, j))
        .map(|(i, j)| i.abs_diff(j))
        .max()
        .unwrap_or(0)
}

/// The null vectors of `λ²H + λD + S` at a known eigenvalue, `count` of them: inverse iteration within the band for a single
/// one, else the singular value decomposition.
fn quadratic_null_vectors([h, d, s]: [&Mat<f64>; 3], band: usize, value: c64, count: usize) -> Option<Vec<Vec<c64>>> {
    let r = h.nrows();
    let size = value.norm();
    let largest_of = |i: usize| h[(i, i)].abs() * size * size + d[(i, i)].abs() * size + s[(i, i)].abs();
    // Rows and columns of the size of one, as inertias may differ by powers of ten.
    let scales: Vec<f64> = (0..r).map(|i| 1.0 / largest_of(i).max(f64::MIN_POSITIVE).sqrt()).collect();
    let entry =
        |i: usize, j: usize| (value * value * h[(i, j)] + value * d[(i, j)] + s[(i, j)]) * (scales[i] * scales[j]);
    // The eigenvalue is as exact as rounding of the largest ones leaves it.
    let fastest =
        (0..r).map(|i| (s[(i, i)].abs() / h[(i, i)]).sqrt() + d[(i, i)].abs() / h[(i, i)]).fold(size, f64::max);
    let tolerance = 1e-14 * r as f64 * fastest / size.max(f64::MIN_POSITIVE);
    let unscaled = |x: &[c64]| normalised(&x.iter().zip(&scales).map(|(x, scale)| x * *scale).collect::<Vec<_>>());
    let mut x: Vec<c64> = (0..r).map(|i| c64::new(1.0 / (1.0 + i as f64), 0.0)).collect();
    for _ in 0..if count == 1 { 2 } else { 0 } {
        let before = x.iter().map(|x| x.norm_sqr()).sum::<f64>().sqrt();
        x = solve_banded(r, band, entry, x);
        let after = largest(&x).norm();
        if !after.is_finite() || after == 0.0 {
            break;
        }
        if before <= tolerance * after {
            return Some(vec![unscaled(&x)?]);
        }
        x.iter_mut().for_each(|x| *x /= after);
    }
    null_space(&Mat::from_fn(r, r, entry), count)?.iter().map(|x| unscaled(x)).collect()
}

/// Gaussian elimination with row exchanges of a matrix whose entries lie within `band` of the diagonal; a pivot that
/// vanishes is taken as the rounding unit. Cost O(n · band²).
fn solve_banded(n: usize, band: usize, entry: impl Fn(usize, usize) -> c64, mut x: Vec<c64>) -> Vec<c64> {
    // Row i holds the columns from i − band to i + 2 band.
    let width = 3 * band + 1;
    let mut rows = vec![c64::ZERO; n * width];
    let at = |i: usize, j: usize| i * width + j + band - i;
    for i in 0..n {
        for j in i.saturating_sub(band)..(i + band + 1).min(n) {
            rows[at(i, j)] = entry(i, j);
        }
    }
    for k in 0..n {
        let below = (k + band + 1).min(n);
        let last = (k + 2 * band + 1).min(n);
        let pivot =
            (k..below).fold(k, |best, i| if rows[at(i, k)].norm() > rows[at(best, k)].norm() { i } else { best });
        if pivot != k {
            (k..last).for_each(|j| rows.swap(at(k, j), at(pivot, j)));
            x.swap(k, pivot);
        }
        if rows[at(k, k)].norm() < f64::EPSILON {
            rows[at(k, k)] = c64::new(f64::EPSILON, 0.0);
        }
        let inverse = rows[at(k, k)].inv();
        for i in k + 1..below {
            let factor = rows[at(i, k)] * inverse;
            if factor == c64::ZERO {
                continue;
            }
            for j in k + 1..last {
                let above = rows[at(k, j)];
                rows[at(i, j)] -= factor * above;
            }
            let above = x[k];
            x[i] -= factor * above;
        }
    }
    for k in (0..n).rev() {
        let sum = (k + 1..(k + 2 * band + 1).min(n)).fold(x[k], |sum, j| sum - rows[at(k, j)] * x[j]);
        x[k] = sum * rows[at(k, k)].inv();
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::num::Random;

    /// What is left beside known roots stands for the others, whatever rounding has made of them.
    #[test]
    fn known_roots_are_taken_out() {
        let mode = |re: f64, im: f64| root(c64::new(re, im));
        let values = |modes: Vec<Mode>| modes.iter().map(|mode| mode.eigenvalue).collect::<Vec<_>>();
        // Three zeros as a real root and a pair; a pair far away.
        let spread = vec![mode(1e-5, 0.0), mode(-5e-6, 8.7e-6), mode(-1.0, 2.0)];
        assert_eq!(values(others(spread.clone(), &[Complex::default(); 3], 5).unwrap()), [Complex::new(-1.0, 2.0)]);
        // With two zeros known the third stays, real.
        assert_eq!(
            values(others(spread.clone(), &[Complex::default(); 2], 5).unwrap()),
            [Complex::new(-5e-6, 0.0), Complex::new(-1.0, 2.0)]
        );
        let pair = [Complex::new(-1.0, 2.0), Complex::new(-1.0, -2.0)];
        assert_eq!(values(others(spread.clone(), &pair, 5).unwrap()).len(), 2);
        assert!(others(spread, &[], 4).is_none(), "five roots are not four");
    }

    /// Against the product: `A x = b`, with small pivots on the diagonal so that rows are exchanged.
    #[test]
    fn banded_systems_are_solved() {
        for (n, band) in [(1, 0), (5, 0), (6, 1), (30, 3), (12, 11)] {
            let mut random = Random::new(n as u64);
            let mut number = || c64::new(2.0 * random.unit() - 1.0, 2.0 * random.unit() - 1.0);
            let a = Mat::from_fn(n, n, |i, j| match i.abs_diff(j) {
                0 => number() * if band > 0 { 1e-3 } else { 1.0 },
                apart if apart <= band => number(),
                _ => c64::ZERO,
            });
            let b: Vec<c64> = (0..n).map(|_| number()).collect();
            let x = solve_banded(n, band, |i, j| a[(i, j)], b.clone());
            for i in 0..n {
                let sum = (0..n).fold(c64::ZERO, |sum, j| sum + a[(i, j)] * x[j]);
                assert!((sum - b[i]).norm() < 1e-9, "n = {n}, band = {band}");
            }
        }
    }

    /// `(λ² + 3)` of the difference of two equal bodies: the vector is (1, −1), whatever the scale of one coordinate.
    #[test]
    fn a_null_vector_of_the_quadratic() {
        let unit = [1.0, 1e-4];
        let scaled = |m: [[f64; 2]; 2]| Mat::from_fn(2, 2, |i, j| m[i][j] * unit[i] * unit[j]);
        let (h, d) = (scaled([[1.0, 0.0], [0.0, 1.0]]), scaled([[0.0, 0.0], [0.0, 0.0]]));
        let s = scaled([[2.0, -1.0], [-1.0, 2.0]]);
        let v = &quadratic_null_vectors([&h, &d, &s], 1, c64::new(0.0, 3f64.sqrt()), 1).unwrap()[0];
        assert!((v[0] * 1e4 + v[1]).norm() < 1e-10, "{v:?}");
    }
}
