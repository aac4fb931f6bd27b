//! The theorems of chapters 4 and 5 on random rational systems whose structure is known because they are built from it:
//! blocks with known eigenvalues, eigenvectors, inputs and outputs, hidden by unimodular changes of coordinates.
//!
//! Ranks, inverses and Krylov matrices of this file are its own; the known answers come from the construction.

use std::collections::BTreeSet;

use crate::common::{self, Dice, first, golden};
use kardan::analysis::{
    ConstrainedSystem, LinearSystem, OutputSignal, construction, failing_modes, linear_system, structure,
};
use kardan::assemble::DirectionalTerm;
use kardan::equations::Measured;
use kardan::model;
use kardan::num::{Matrix, Polynomial, Rational};
use kardan::results::{Complex, Factor, NamedShare, Structure};

type M = Matrix<Rational>;

// ---- exact arithmetic of its own ----------------------------------------------------------------------------------

fn int(x: i64) -> Rational {
    Rational::from(x)
}

fn frac(n: i64, d: u64) -> Rational {
    Rational::from_parts(n.into(), d.into())
}

fn diagonal(entries: &[Rational]) -> M {
    M::from_fn(entries.len(), entries.len(), |i, j| if i == j { entries[i].clone() } else { int(0) })
}

/// Reduced row echelon form with the pivot columns.
fn reduced_rows(m: &M) -> (Vec<Vec<Rational>>, Vec<usize>) {
    let mut rows: Vec<Vec<Rational>> = (0..m.rows()).map(|i| m.row(i).to_vec()).collect();
    let mut pivots = Vec::new();
    for column in 0..m.columns() {
        let at = pivots.len();
        let Some(pivot) = (at..rows.len()).find(|&i| rows[i][column] != int(0)) else { continue };
        rows.swap(at, pivot);
        let lead = rows[at][column].clone();
        rows[at].iter_mut().for_each(|x| *x = &*x / &lead);
        let head = rows[at].clone();
        for (i, row) in rows.iter_mut().enumerate() {
            let factor = row[column].clone();
            if i != at && factor != int(0) {
                row.iter_mut().zip(&head).for_each(|(x, y)| *x = &*x - &factor * y);
            }
        }
        pivots.push(column);
    }
    (rows, pivots)
}

fn rank(m: &M) -> usize {
    reduced_rows(m).1.len()
}

fn beside(a: &M, b: &M) -> M {
    let width = a.columns();
    M::from_fn(
        a.rows(),
        width + b.columns(),
        |i, j| if j < width { a[(i, j)].clone() } else { b[(i, j - width)].clone() },
    )
}

fn above(a: &M, b: &M) -> M {
    beside(&a.transpose(), &b.transpose()).transpose()
}

/// X with `a X = b`, a regular.
fn solved(a: &M, b: &M) -> M {
    let n = a.rows();
    let (rows, pivots) = reduced_rows(&beside(a, b));
    assert_eq!(pivots, (0..n).collect::<Vec<_>>(), "a singular matrix in a test");
    M::from_fn(n, b.columns(), |i, j| rows[i][n + j].clone())
}

fn negative(m: &M) -> M {
    m.scale(&int(-1))
}

/// `rank [B, GB, G²B, …]`, `G = E⁻¹A`.
fn reached(system: &LinearSystem, inputs: &M) -> usize {
    let n = system.a.rows();
    let (g, mut next) = (solved(&system.e, &system.a), solved(&system.e, inputs));
    let mut krylov = next.clone();
    let mut found = rank(&krylov);
    loop {
        next = g.multiply(&next);
        krylov = beside(&krylov, &next);
        let more = rank(&krylov);
        if more == found || more == n {
            return more;
        }
        found = more;
    }
}

/// Independent left eigenvectors of `E⁻¹A` that no column of `inputs` reaches, at a rational number.
fn defect_at(system: &LinearSystem, lambda: i64, inputs: &M) -> usize {
    let shifted = system.e.scale(&int(lambda)).plus(&negative(&system.a));
    system.a.rows() - rank(&beside(&shifted, inputs))
}

// ---- polynomials --------------------------------------------------------------------------------------------------

/// Coefficients of 1, s, s², …
type P = Vec<i64>;

fn product(a: &[i64], b: &[i64]) -> P {
    let mut out = vec![0; a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            out[i + j] += x * y;
        }
    }
    out
}

fn product_of<'a>(all: impl IntoIterator<Item = &'a P>) -> P {
    all.into_iter().fold(vec![1], |out, p| product(&out, p))
}

fn text(p: &[i64]) -> String {
    Polynomial::new(p.iter().map(|&c| int(c)).collect()).to_string()
}

fn companion(p: &[i64]) -> M {
    let d = p.len() - 1;
    M::from_fn(d, d, |i, j| int(if i + 1 == d { -p[j] } else { i64::from(i + 1 == j) }))
}

/// Companion forms have the polynomial they are named after: `det(sI − A)` by the values at many numbers.
#[test]
fn companions_are_companions() {
    let p = [7, -3, 0, 2, 1];
    for s in -3..=3 {
        let m = diagonal(&vec![int(s); 4]).plus(&negative(&companion(&p)));
        // Expansion of a 4 × 4 determinant.
        let minor = |columns: [usize; 3]| {
            let at = |i: usize, k: usize| m[(i, columns[k])].clone();
            at(1, 0) * (at(2, 1) * at(3, 2) - at(2, 2) * at(3, 1))
                - at(1, 1) * (at(2, 0) * at(3, 2) - at(2, 2) * at(3, 0))
                + at(1, 2) * (at(2, 0) * at(3, 1) - at(2, 1) * at(3, 0))
        };
        let determinant = &m[(0, 0)] * minor([1, 2, 3]) - &m[(0, 1)] * minor([0, 2, 3]) + &m[(0, 2)] * minor([0, 1, 3])
            - &m[(0, 3)] * minor([0, 1, 2]);
        let value = p.iter().rev().fold(0, |sum, c| sum * s + c);
        assert_eq!(determinant, int(value));
    }
}

// ---- random -------------------------------------------------------------------------------------------------------

impl Dice {
    fn pick<T: Clone>(&mut self, all: &[T]) -> T {
        all[self.below(all.len())].clone()
    }

    /// A matrix of whole numbers with determinant ±1, and its inverse.
    fn unimodular(&mut self, n: usize) -> (M, M) {
        let (mut t, mut inverse) = (M::identity(n), M::identity(n));
        for _ in 0..if n > 1 { 2 * n } else { 0 } {
            let (i, step) = (self.below(n), 1 + self.below(n - 1));
            let (j, c) = ((i + step) % n, int(self.pick(&[-1, 1, 2])));
            for k in 0..n {
                t[(i, k)] = &t[(i, k)] + &c * &t[(j, k)];
                inverse[(k, j)] = &inverse[(k, j)] - &c * &inverse[(k, i)];
            }
        }
        assert_eq!(t.multiply(&inverse), M::identity(n));
        (t, inverse)
    }
}

// ---- systems with a known structure -------------------------------------------------------------------------------

/// An irreducible factor: its exponent in each invariant factor, and what inputs and outputs miss.
#[derive(Debug, Clone, PartialEq)]
struct PlantedFactor {
    factor: P,
    exponents: Vec<usize>,
    input_defect: usize,
    output_defect: usize,
}

impl PlantedFactor {
    fn row(&self) -> (String, [usize; 4]) {
        let algebraic = self.exponents.iter().sum();
        (text(&self.factor), [algebraic, self.exponents.len(), self.input_defect, self.output_defect])
    }
}

fn found_row(f: &Factor) -> (String, [usize; 4]) {
    (f.polynomial.clone(), [f.algebraic, f.geometric, f.input_defect, f.output_defect])
}

/// Each dividing the next: the k-th from the end has the k-th largest exponent of every factor.
fn invariant_factors(planted: &[PlantedFactor]) -> Vec<String> {
    let count = most(planted);
    let exponent = |k: &PlantedFactor, at: usize| {
        let mut sorted = k.exponents.clone();
        sorted.sort_unstable_by(|a, b| b.cmp(a));
        sorted.get(count - 1 - at).copied().unwrap_or(0)
    };
    (0..count)
        .map(|at| text(&product_of(planted.iter().flat_map(|k| std::iter::repeat_n(&k.factor, exponent(k, at))))))
        .collect()
}

fn most(planted: &[PlantedFactor]) -> usize {
    planted.iter().map(|k| k.exponents.len()).max().unwrap()
}

/// Jordan blocks of whole eigenvalues and copies of companion blocks of quadratic factors, with inputs and outputs that
/// miss a known number of eigenvectors, hidden by a unimodular similarity. Up to ten states.
fn hidden_state_space(dice: &mut Dice) -> (LinearSystem, Vec<PlantedFactor>) {
    let quadratics: [P; 4] = [vec![1, 0, 1], vec![2, 0, 1], vec![1, 1, 1], vec![5, 2, 1]];
    let (m, p) = (1 + dice.below(4), 1 + dice.below(4));
    let mut planted: Vec<PlantedFactor> = Vec::new();
    let (mut blocks, mut b, mut c) = (Vec::new(), Vec::new(), Vec::new());
    let mut states = 0;
    while planted.is_empty() || (planted.len() < 3 && states < 7) {
        let linear = dice.below(3) > 0;
        let factor = if linear { vec![-dice.between(-3, 2), 1] } else { dice.pick(&quadratics) };
        if planted.iter().any(|k| k.factor == factor) {
            continue;
        }
        let geometric = 1 + dice.below(3);
        let sizes: Vec<usize> = (0..geometric).map(|_| if linear { 1 + dice.below(2) } else { 1 }).collect();
        // How the inputs act on the left eigenvectors, and the outputs on the right ones: of a rank to be found.
        let low_rank = |dice: &mut Dice, columns: usize| {
            let full = geometric.min(columns);
            let inner = if dice.below(3) > 0 { full } else { dice.below(full + 1) };
            dice.matrix(geometric, inner, 2).multiply(&dice.matrix(inner, columns, 2))
        };
        let (inputs, outputs) = (low_rank(dice, m), low_rank(dice, p));
        for (k, &size) in sizes.iter().enumerate() {
            let block = if linear {
                M::from_fn(size, size, |i, j| int(if i == j { -factor[0] } else { i64::from(i + 1 == j) }))
            } else {
                companion(&factor)
            };
            let n = block.rows();
            // The left eigenvector of a Jordan block is the last unit vector, the right one the first.
            for i in 0..n {
                let free = linear && n > 1;
                b.push(match (i + 1 == n, free) {
                    (true, _) => inputs.row(k).to_vec(),
                    (_, true) => dice.matrix(1, m, 2).row(0).to_vec(),
                    _ => vec![int(0); m],
                });
                c.push(match (i == 0, free) {
                    (true, _) => outputs.row(k).to_vec(),
                    (_, true) => dice.matrix(1, p, 2).row(0).to_vec(),
                    _ => vec![int(0); p],
                });
            }
            blocks.push(block);
            states += n;
        }
        planted.push(PlantedFactor {
            factor,
            exponents: sizes,
            input_defect: geometric - rank(&inputs),
            output_defect: geometric - rank(&outputs),
        });
    }
    let (a, b, c) = (
        block_diagonal(&blocks),
        M::from_fn(states, m, |i, j| b[i][j].clone()),
        M::from_fn(p, states, |i, j| c[j][i].clone()),
    );
    let (t, inverse) = dice.unimodular(states);
    let hidden = LinearSystem::state_space(t.multiply(&a).multiply(&inverse), t.multiply(&b), c.multiply(&inverse));
    (hidden, planted)
}

fn block_diagonal(blocks: &[M]) -> M {
    let n = blocks.iter().map(M::rows).sum();
    let mut out = M::zeros(n, n);
    let mut at = 0;
    for block in blocks {
        for i in 0..block.rows() {
            out.row_mut(at + i)[at..at + block.rows()].clone_from_slice(block.row(i));
        }
        at += block.rows();
    }
    out
}

/// `H q̈ + D q̇ + S q = F u`, `y = G q`.
#[derive(Debug)]
struct Mechanism {
    h: M,
    d: M,
    s: M,
    f: M,
    g: M,
}

impl Mechanism {
    fn degrees_of_freedom(&self) -> usize {
        self.h.rows()
    }

    fn system(&self) -> LinearSystem {
        let r = self.degrees_of_freedom();
        let upper = beside(&M::zeros(r, r), &M::identity(r));
        let names = |letter: &str, count: usize| (0..count).map(|k| format!("{letter}{k}")).collect::<Vec<_>>();
        LinearSystem {
            states: (0..r).map(|k| format!("q{k}.phi")).chain((0..r).map(|k| format!("q{k}.w"))).collect(),
            inputs: names("u", self.f.columns()),
            outputs: names("y", self.g.rows()),
            e: block_diagonal(&[M::identity(r), self.h.clone()]),
            a: above(&upper, &beside(&negative(&self.s), &negative(&self.d))),
            b: self.forces(&self.f),
            c: beside(&self.g, &M::zeros(self.g.rows(), r)),
            d: M::zeros(self.g.rows(), self.f.columns()),
            degrees_of_freedom: Some(r),
        }
    }

    fn forces(&self, f: &M) -> M {
        above(&M::zeros(self.degrees_of_freedom(), f.columns()), f)
    }

    /// Rank defect of `λ²H + λD + S`.
    fn defect(&self, lambda: i64) -> usize {
        let l = int(lambda);
        let pencil = self.h.scale(&(&l * &l)).plus(&self.d.scale(&l)).plus(&self.s);
        self.degrees_of_freedom() - rank(&pencil)
    }
}

/// Polynomials `s² + d s + s` of single modes, d and s not negative, by their factors.
fn modal(kind: &str) -> Vec<Vec<P>> {
    let (zero, one, two, three): (P, P, P, P) = (vec![0, 1], vec![1, 1], vec![2, 1], vec![3, 1]);
    let swinging = |square: i64| vec![vec![square, 0, 1]];
    match kind {
        "no damping" => vec![vec![zero.clone(), zero], swinging(1), swinging(2), swinging(3)],
        "pure damping" => vec![vec![zero.clone(), zero.clone()], vec![zero.clone(), one], vec![zero, two]],
        _ => vec![
            vec![one.clone(), two.clone()],
            vec![one.clone(), three.clone()],
            vec![two.clone(), three.clone()],
            vec![one.clone(), one.clone()],
            vec![zero.clone(), one],
            vec![zero.clone(), two],
            vec![zero.clone(), zero],
            swinging(4),
            vec![vec![5, 2, 1]],
        ],
    }
}

/// Single modes with common roots, and forces and sensors that miss some of them, hidden by a congruence.
fn hidden_mechanism(dice: &mut Dice, kind: &str) -> (Mechanism, Vec<PlantedFactor>) {
    let pool = modal(kind);
    let r = 2 + dice.below(3);
    let repeated: Vec<Vec<P>> = (0..2).map(|_| dice.pick(&pool)).collect();
    // Few different modes, so that they repeat.
    let modes: Vec<Vec<P>> =
        (0..r).map(|_| if dice.below(3) == 0 { dice.pick(&pool) } else { dice.pick(&repeated) }).collect();
    let inertias: Vec<Rational> = (0..r).map(|_| frac(dice.between(1, 4), 1 + dice.below(3) as u64)).collect();
    let polynomials: Vec<P> = modes.iter().map(product_of).collect();
    let modal = |k: usize| diagonal(&(0..r).map(|i| &inertias[i] * int(polynomials[i][k])).collect::<Vec<_>>());
    let low_rank = |dice: &mut Dice, rows: usize, columns: usize| {
        let inner = dice.below(rows.min(columns) + 1);
        dice.matrix(rows, inner, 1).multiply(&dice.matrix(inner, columns, 1))
    };
    let (m, p) = (1 + dice.below(3), 1 + dice.below(3));
    let (f, g) = (low_rank(dice, r, m), low_rank(dice, p, r));
    let mut factors: Vec<P> = modes.iter().flatten().cloned().collect();
    factors.sort();
    factors.dedup();
    let planted = factors.into_iter().map(|factor| {
        let at: Vec<usize> = (0..r).filter(|&i| modes[i].contains(&factor)).collect();
        let exponents = at.iter().map(|&i| modes[i].iter().filter(|f| **f == factor).count()).collect();
        let acts = rank(&M::from_fn(at.len(), m, |i, j| f[(at[i], j)].clone()));
        let shows = rank(&M::from_fn(p, at.len(), |i, j| g[(i, at[j])].clone()));
        PlantedFactor { factor, exponents, input_defect: at.len() - acts, output_defect: at.len() - shows }
    });
    let planted = planted.collect();
    // q' = T q with fractions: H' = Tᵀ H T, F' = Tᵀ F, G' = G T.
    let scales: Vec<Rational> = (0..r).map(|_| frac(1 + dice.below(3) as i64, 1 + dice.below(2) as u64)).collect();
    let t = dice.unimodular(r).0.multiply(&diagonal(&scales));
    let congruent = |m: M| t.transpose().multiply(&m).multiply(&t);
    let hidden = Mechanism {
        h: congruent(modal(2)),
        d: congruent(modal(1)),
        s: congruent(modal(0)),
        f: t.transpose().multiply(&f),
        g: g.multiply(&t),
    };
    (hidden, planted)
}

fn of(system: &LinearSystem) -> Structure {
    structure(system).unwrap_or_else(|error| panic!("{error}"))
}

/// Factors with all multiplicities and defects, invariant factors.
fn check_factors(found: &Structure, planted: &[PlantedFactor], seed: u64) {
    let mut rows: Vec<_> = found.factors.iter().map(found_row).collect();
    let mut expected: Vec<_> = planted.iter().map(PlantedFactor::row).collect();
    rows.sort();
    expected.sort();
    assert_eq!(rows, expected, "seed {seed}");
    assert_eq!(found.invariant_factors, invariant_factors(planted), "seed {seed}");
}

/// "m are enough": the witness of the certificate and the constructed matrix; "fewer are not": by the defect at a root (the
/// caller) and by trial.
fn check_least(system: &LinearSystem, found: &Structure, least: usize, dice: &mut Dice, seed: u64) {
    let n = system.states.len();
    let offset = system.degrees_of_freedom.unwrap_or(0);
    assert_eq!((found.min_inputs, found.min_outputs), (least, least), "seed {seed}");
    let witness = &found.certificate.inputs.as_ref().unwrap_or_else(|| panic!("no witness, seed {seed}")).witness;
    let b = M::from_fn(n, least, |i, j| int(witness[i][j]));
    assert!((0..offset).all(|i| (0..least).all(|j| b[(i, j)] == int(0))), "forces only, seed {seed}");
    assert_eq!(reached(system, &b), n, "witness, seed {seed}");
    let built = construction(system).unwrap_or_else(|| panic!("no construction, seed {seed}"));
    assert_eq!((built.input.len(), built.input[0].len()), (n - offset, least), "seed {seed}");
    let number = |text: &String| int(text.parse::<i64>().expect("whole numbers"));
    let b = M::from_fn(n, least, |i, j| if i < offset { int(0) } else { number(&built.input[i - offset][j]) });
    assert_eq!(reached(system, &b), n, "construction, seed {seed}");
    // The steps add up to the matrix.
    let mut sum = M::zeros(n - offset, least);
    for step in &built.steps {
        for (i, x) in step.direction.iter().enumerate() {
            sum[(i, step.column)] = &sum[(i, step.column)] + number(x) * number(&step.multiplier);
        }
    }
    assert_eq!(M::from_fn(n - offset, least, |i, j| b[(i + offset, j)].clone()), sum, "seed {seed}");
    // The theorem's order: factors with most eigenvectors first, each begun with what is missing there.
    let geometric = |step: &str| found.factors.iter().find(|f| f.polynomial == step).map(|f| f.geometric);
    let order: Vec<usize> = built.steps.iter().filter_map(|step| geometric(&step.factor)).collect();
    assert!(order.is_sorted_by(|a, b| a >= b), "{order:?}, seed {seed}");
    assert!(
        (1..=least).eq(built.steps[..least].iter().rev().map(|step| step.defect)),
        "{:?}, seed {seed}",
        built.steps
    );
    if least > 1 {
        for _ in 0..2 {
            let fewer = dice.matrix(n - offset, least - 1, 5);
            let b = above(&M::zeros(offset, least - 1), &fewer);
            assert!(reached(system, &b) < n, "fewer inputs, seed {seed}");
        }
    }
}

// ---- theorems 5.1, 5.2, 5.6, 5.7: state space ---------------------------------------------------------------------

/// Reached if and only if `rank [λI − A, B] = n` at every eigenvalue; the defects are those of the construction.
#[test]
fn theorem_5_1_inputs_reach_an_eigenvalue_by_its_left_eigenvectors() {
    let mut reaching = [0, 0];
    for seed in 0..120 {
        let (system, planted) = hidden_state_space(&mut Dice(seed));
        let found = of(&system);
        check_factors(&found, &planted, seed);
        assert_eq!(found.controllable_rank, reached(&system, &system.b), "seed {seed}");
        let all = planted.iter().all(|k| k.input_defect == 0);
        assert_eq!(found.controllable(), all, "seed {seed}");
        reaching[usize::from(all)] += 1;
        for k in planted.iter().filter(|k| k.factor.len() == 2) {
            assert_eq!(defect_at(&system, -k.factor[0], &system.b), k.input_defect, "seed {seed}");
        }
    }
    assert!(reaching.iter().all(|&count| count > 10), "both cases occur: {reaching:?}");
}

/// The same for the outputs: `rank [λI − A; C] = n`.
#[test]
fn theorem_5_6_outputs_show_an_eigenvalue_by_its_right_eigenvectors() {
    for seed in 200..300 {
        let (system, planted) = hidden_state_space(&mut Dice(seed));
        let found = of(&system);
        check_factors(&found, &planted, seed);
        let transposed =
            LinearSystem::state_space(system.a.transpose(), system.c.transpose(), M::zeros(0, system.a.rows()));
        assert_eq!(found.observable_rank, reached(&transposed, &system.c.transpose()), "seed {seed}");
        assert_eq!(found.observable(), planted.iter().all(|k| k.output_defect == 0), "seed {seed}");
        for k in planted.iter().filter(|k| k.factor.len() == 2) {
            assert_eq!(defect_at(&transposed, -k.factor[0], &system.c.transpose()), k.output_defect, "seed {seed}");
        }
    }
}

/// The least number of inputs is the largest number of independent eigenvectors of one eigenvalue; it is attained.
#[test]
fn theorem_5_2_least_inputs_of_a_state_space() {
    for seed in 400..480 {
        let mut dice = Dice(seed);
        let (system, planted) = hidden_state_space(&mut dice);
        let found = of(&system);
        assert_eq!(found.kind, "state space");
        check_least(&system, &found, most(&planted), &mut dice, seed);
    }
}

/// The same for outputs, by way of the transposed system and of the certificate for the outputs.
#[test]
fn theorem_5_7_least_outputs_of_a_state_space() {
    for seed in 500..540 {
        let mut dice = Dice(seed);
        let (system, planted) = hidden_state_space(&mut dice);
        let dual = system.transpose();
        check_least(&dual, &of(&dual), most(&planted), &mut dice, seed);
        let outputs = of(&system).certificate.outputs.unwrap();
        let n = system.states.len();
        let c = M::from_fn(n, outputs.number, |i, j| int(outputs.witness[i][j]));
        assert_eq!((outputs.number, reached(&dual, &c)), (most(&planted), n), "seed {seed}");
    }
}

// ---- theorems 5.3 to 5.5 and 5.8 to 5.10: mechanics ---------------------------------------------------------------

/// `r − min rank (λ²H + λD + S)` forces; the sensors of positions likewise (5.8).
#[test]
fn theorem_5_3_least_forces_of_a_general_mechanism() {
    let mut kinds = BTreeSet::new();
    for seed in 0..60 {
        let mut dice = Dice(1000 + seed);
        let (mechanism, planted) = hidden_mechanism(&mut dice, "general");
        let system = mechanism.system();
        let found = of(&system);
        check_factors(&found, &planted, seed);
        assert_eq!(found.controllable_rank, reached(&system, &system.b), "seed {seed}");
        for k in planted.iter().filter(|k| k.factor.len() == 2) {
            assert_eq!(mechanism.defect(-k.factor[0]), k.exponents.len(), "seed {seed}");
        }
        check_least(&system, &found, most(&planted), &mut dice, seed);
        kinds.insert(found.kind);
    }
    assert!(kinds.contains("general"));
}

/// Sensors of positions: `[λ²H + λD + S; G]`; the transpose of constructed forces serves.
#[test]
fn theorem_5_8_least_position_sensors_of_a_general_mechanism() {
    for seed in 0..40 {
        let mut dice = Dice(2000 + seed);
        let (mechanism, planted) = hidden_mechanism(&mut dice, "general");
        let system = mechanism.system();
        let found = of(&system);
        check_factors(&found, &planted, seed);
        let dual = system.transpose();
        assert_eq!(found.observable_rank, reached(&dual, &system.c.transpose()), "seed {seed}");
        let (n, r, least) = (system.states.len(), mechanism.degrees_of_freedom(), most(&planted));
        let outputs = found.certificate.outputs.as_ref().unwrap();
        let c = M::from_fn(n, least, |i, j| int(outputs.witness[i][j]));
        assert!((r..n).all(|i| (0..least).all(|j| c[(i, j)] == int(0))), "positions only, seed {seed}");
        assert_eq!((found.min_outputs, outputs.number, reached(&dual, &c)), (least, least, n), "seed {seed}");
        let built = construction(&system).unwrap().input;
        let sensors = M::from_fn(n, least, |i, j| if i < r { int(built[i][j].parse().unwrap()) } else { int(0) });
        assert_eq!(reached(&dual, &sensors), n, "seed {seed}");
        if least > 1 {
            let fewer = above(&dice.matrix(r, least - 1, 5), &M::zeros(r, least - 1));
            assert!(reached(&dual, &fewer) < n, "seed {seed}");
        }
    }
}

/// A random semidefinite matrix.
fn semidefinite(dice: &mut Dice, r: usize) -> M {
    let inner = dice.below(r + 1);
    let half = dice.matrix(inner, r, 2);
    half.transpose().multiply(&half)
}

fn definite(dice: &mut Dice, r: usize) -> M {
    let t = dice.unimodular(r).0;
    let d: Vec<Rational> = (0..r).map(|_| frac(dice.between(1, 5), 1 + dice.below(3) as u64)).collect();
    t.transpose().multiply(&diagonal(&d)).multiply(&t)
}

/// Without springs: controllable if and only if F has full rank; any damping.
#[test]
fn theorem_5_4_pure_damping_needs_a_force_for_every_freedom() {
    let mut controllable = [0, 0];
    for seed in 0..60 {
        let mut dice = Dice(3000 + seed);
        let r = 1 + dice.below(4);
        let (h, d) = (definite(&mut dice, r), semidefinite(&mut dice, r));
        let m = 1 + dice.below(r + 1);
        let (f, g) = (dice.matrix(r, m, 1), dice.matrix(1, r, 1));
        let mechanism = Mechanism { h, d, s: M::zeros(r, r), f, g };
        let system = mechanism.system();
        let found = of(&system);
        assert_eq!(found.kind, "pure damping");
        assert_eq!(found.controllable(), rank(&mechanism.f) == r, "seed {seed}");
        assert_eq!(found.controllable_rank, reached(&system, &system.b), "seed {seed}");
        controllable[usize::from(found.controllable())] += 1;
        check_least(&system, &found, r, &mut dice, seed);
    }
    assert!(controllable.iter().all(|&count| count > 10), "{controllable:?}");
    // And on hidden modes, where all factors are known.
    for seed in 0..20 {
        let mut dice = Dice(3500 + seed);
        let (mechanism, planted) = hidden_mechanism(&mut dice, "pure damping");
        let found = of(&mechanism.system());
        check_factors(&found, &planted, seed);
        assert_eq!(found.min_inputs, mechanism.degrees_of_freedom());
    }
}

/// Without springs: observable if and only if there are r independent position sensors.
#[test]
fn theorem_5_9_pure_damping_needs_a_position_sensor_for_every_freedom() {
    let mut observable = [0, 0];
    for seed in 0..60 {
        let mut dice = Dice(4000 + seed);
        let r = 1 + dice.below(4);
        let (h, d) = (definite(&mut dice, r), semidefinite(&mut dice, r));
        let p = 1 + dice.below(r + 1);
        let mechanism = Mechanism { h, d, s: M::zeros(r, r), f: dice.matrix(r, 1, 1), g: dice.matrix(p, r, 1) };
        let system = mechanism.system();
        let found = of(&system);
        assert_eq!(found.observable(), rank(&mechanism.g) == r, "seed {seed}");
        assert_eq!(found.observable_rank, reached(&system.transpose(), &system.c.transpose()), "seed {seed}");
        assert_eq!(found.min_outputs, r);
        observable[usize::from(found.observable())] += 1;
    }
    assert!(observable.iter().all(|&count| count > 10), "{observable:?}");
}

/// Without damping: the largest multiplicity of an eigenvalue of `H⁻¹S`.
#[test]
fn theorem_5_5_least_forces_of_an_undamped_mechanism() {
    for seed in 0..40 {
        let mut dice = Dice(5000 + seed);
        let (mechanism, planted) = hidden_mechanism(&mut dice, "no damping");
        let system = mechanism.system();
        let found = of(&system);
        check_factors(&found, &planted, seed);
        // λ² = −ω²: the multiplicity is the defect of S − ω²H.
        let squares = [0, 1, 2, 3].map(|w| {
            let shifted = mechanism.s.plus(&mechanism.h.scale(&int(-w)));
            mechanism.degrees_of_freedom() - rank(&shifted)
        });
        assert_eq!(squares.into_iter().max(), Some(most(&planted)), "seed {seed}");
        assert_eq!(
            found.kind,
            if mechanism.s == M::zeros(found.states.len() / 2, found.states.len() / 2) {
                "pure damping"
            } else {
                "no damping"
            }
        );
        check_least(&system, &found, most(&planted), &mut dice, seed);
    }
    // Erratum: not the multiplicity of an eigenvalue of S; golden.json `analysis.examples`.
    let expected = &golden()["analysis"]["examples"];
    for (s, d, h, key) in [
        ([1, 1], [0, 0], [1, 2], "S=diag(1,1) H=diag(1,2) D=0 -> min inputs"),
        ([1, 2], [0, 0], [1, 2], "S=diag(1,2) H=diag(1,2) D=0 -> min inputs"),
        ([0, 0], [1, 2], [1, 1], "S=0 D=diag(1,2) H=I -> min inputs"),
    ] {
        let of2 = |x: [i64; 2]| diagonal(&x.map(int));
        let mechanism = Mechanism { h: of2(h), d: of2(d), s: of2(s), f: of2([1, 0]), g: of2([1, 0]) };
        assert_eq!(expected[key], of(&mechanism.system()).min_inputs, "{key}");
    }
}

/// Without damping, sensors of positions.
#[test]
fn theorem_5_10_least_position_sensors_of_an_undamped_mechanism() {
    for seed in 0..40 {
        let mut dice = Dice(6000 + seed);
        let (mechanism, planted) = hidden_mechanism(&mut dice, "no damping");
        let (system, r, least) = (mechanism.system(), mechanism.degrees_of_freedom(), most(&planted));
        let found = of(&system);
        check_factors(&found, &planted, seed);
        let dual = system.transpose();
        let c = &found.certificate.outputs.as_ref().unwrap().witness;
        let sensors = M::from_fn(2 * r, least, |i, j| int(c[i][j]));
        assert_eq!((found.min_outputs, reached(&dual, &sensors)), (least, 2 * r), "seed {seed}");
        if least > 1 {
            let fewer = above(&dice.matrix(r, least - 1, 5), &M::zeros(r, least - 1));
            assert!(reached(&dual, &fewer) < 2 * r, "seed {seed}");
        }
    }
}

/// Uncoupled bodies: what fails is named, with its eigenvalue and how often.
#[test]
fn modes_that_fail_are_named() {
    for seed in 0..40 {
        let mut dice = Dice(7000 + seed);
        let pool: [(i64, P); 4] = [(0, vec![1, 0, 1]), (2, vec![5, 2, 1]), (3, vec![1, 1]), (0, vec![4, 0, 1])];
        let r = 2 + dice.below(3);
        let bodies: Vec<usize> = (0..r).map(|_| dice.below(3)).collect();
        let stiffness = [1, 5, 2, 4];
        let damping: Vec<Rational> = bodies.iter().map(|&k| int(pool[k].0)).collect();
        let stiff: Vec<Rational> = bodies.iter().map(|&k| int(stiffness[k])).collect();
        let driven: Vec<bool> = (0..r).map(|_| dice.below(2) == 0).collect();
        let f = diagonal(&driven.iter().map(|&on| int(i64::from(on))).collect::<Vec<_>>());
        let mechanism = Mechanism { h: M::identity(r), d: diagonal(&damping), s: diagonal(&stiff), g: f.clone(), f };
        let system = mechanism.system();
        let mut found = of(&system);
        failing_modes(&mut found, &mut [], &system, None);
        for list in [&found.uncontrollable, &found.unobservable] {
            // Every body that is not driven fails with each of its factors.
            let mut expected: Vec<(String, usize, Vec<String>)> = Vec::new();
            for kind in 0..3 {
                let still: Vec<usize> = (0..r).filter(|&i| bodies[i] == kind && !driven[i]).collect();
                let factors = if kind == 2 { vec![vec![1, 1], vec![2, 1]] } else { vec![pool[kind].1.clone()] };
                for factor in factors.iter().filter(|_| !still.is_empty()) {
                    let mut names: Vec<String> =
                        still.iter().flat_map(|i| [format!("q{i}.phi"), format!("q{i}.w")]).collect();
                    names.sort();
                    expected.push((text(factor), still.len(), names));
                }
            }
            let mut named: Vec<(String, usize, Vec<String>)> = list
                .iter()
                .map(|mode| {
                    let moving = mode.shafts.iter().filter(|NamedShare { share, .. }| *share > 1e-9);
                    let mut names: Vec<String> = moving.map(|NamedShare { name, .. }| name.clone()).collect();
                    names.sort();
                    (mode.factor.clone(), mode.defect, names)
                })
                .collect();
            named.sort();
            expected.sort();
            assert_eq!(named, expected, "seed {seed}");
            for mode in list {
                let p = [[1, 0, 1], [5, 2, 1], [2, 3, 1]];
                let Complex { re, im } = mode.eigenvalue;
                let size = |c: [i64; 3]| {
                    (c[0] as f64 + c[1] as f64 * re + re * re - im * im).hypot(c[1] as f64 * im + 2.0 * re * im)
                };
                assert!(p.into_iter().any(|c| size(c) < 1e-12), "{:?} is no root, seed {seed}", mode.eigenvalue);
            }
        }
    }
}

// ---- duality ------------------------------------------------------------------------------------------------------

/// Inputs of a system are outputs of its transpose.
#[test]
fn duality_exchanges_inputs_and_outputs() {
    for seed in 0..60 {
        let mut dice = Dice(8000 + seed);
        let system = match seed % 3 {
            0 => hidden_state_space(&mut dice).0,
            1 => hidden_mechanism(&mut dice, "general").0.system(),
            _ => {
                let n = 2 + dice.below(4);
                let (m, p) = (1 + dice.below(2), 1 + dice.below(2));
                let mut system =
                    LinearSystem::state_space(dice.matrix(n, n, 2), dice.matrix(n, m, 2), dice.matrix(p, n, 2));
                system.e = definite(&mut dice, n).multiply(&dice.unimodular(n).0);
                system.d = dice.matrix(p, m, 1);
                system
            }
        };
        let (one, other) = (of(&system), of(&system.transpose()));
        assert_eq!((one.controllable_rank, one.observable_rank), (other.observable_rank, other.controllable_rank));
        assert_eq!((one.min_inputs, one.min_outputs), (other.min_outputs, other.min_inputs), "seed {seed}");
        assert_eq!(one.invariant_factors, other.invariant_factors, "seed {seed}");
        assert_eq!((&one.zeros.polynomial, one.zeros.normal_rank), (&other.zeros.polynomial, other.zeros.normal_rank));
        let rows = |s: &Structure, swapped: bool| {
            let exchange =
                |(text, [a, g, i, o]): (String, [usize; 4])| (text, if swapped { [a, g, o, i] } else { [a, g, i, o] });
            let mut all: Vec<_> = s.factors.iter().map(|f| exchange(found_row(f))).collect();
            all.sort();
            all
        };
        assert_eq!(rows(&one, false), rows(&other, true), "seed {seed}");
        for (i, row) in one.relative_degrees.iter().enumerate() {
            for (j, degree) in row.iter().enumerate() {
                assert_eq!(*degree, other.relative_degrees[j][i], "seed {seed}");
            }
        }
    }
}

// ---- zeros and relative degrees -----------------------------------------------------------------------------------

/// Channels in controllable canonical form: numerators and denominators that are known.
struct Channels {
    numerators: Vec<P>,
    degrees: Vec<usize>,
    system: LinearSystem,
}

fn channels(dice: &mut Dice, count: usize) -> Channels {
    let atoms: [P; 6] = [vec![0, 1], vec![1, 1], vec![2, 1], vec![-1, 1], vec![2, 0, 1], vec![5, 2, 1]];
    let (mut numerators, mut degrees, mut blocks) = (Vec::new(), Vec::new(), Vec::new());
    let (mut b, mut c) = (Vec::new(), Vec::new());
    for k in 0..count {
        let zeros = dice.below(3);
        let numerator = product_of(&(0..zeros).map(|_| dice.pick(&atoms)).collect::<Vec<_>>());
        let degree = numerator.len() - 1 + 1 + dice.below(2);
        let mut denominator: P = (0..degree).map(|_| dice.between(-3, 3)).collect();
        denominator.push(1);
        blocks.push(companion(&denominator));
        for i in 0..degree {
            b.push((0..count).map(|j| int(i64::from(j == k && i + 1 == degree))).collect::<Vec<_>>());
            let entry = numerator.get(i).copied().unwrap_or(0);
            c.push((0..count).map(|j| int(if j == k { entry } else { 0 })).collect::<Vec<_>>());
        }
        degrees.push(degree - (numerator.len() - 1));
        numerators.push(numerator);
    }
    let n = b.len();
    let system = LinearSystem::state_space(
        block_diagonal(&blocks),
        M::from_fn(n, count, |i, j| b[i][j].clone()),
        M::from_fn(count, n, |i, j| c[j][i].clone()),
    );
    Channels { numerators, degrees, system }
}

fn changed(system: &LinearSystem, a: M, b: M, c: M) -> LinearSystem {
    LinearSystem { a, b, c, ..system.clone() }
}

/// Zeros are the roots of the numerators; no change of coordinates, feedback or injection moves them.
#[test]
fn zeros_are_numerator_roots_and_stay_under_feedback_and_injection() {
    for seed in 0..40 {
        let mut dice = Dice(9000 + seed);
        let count = 1 + dice.below(2);
        let Channels { numerators, degrees, system } = channels(&mut dice, count);
        let (n, whole) = (system.states.len(), product_of(&numerators));
        let check = |system: &LinearSystem, what: &str| {
            let zeros = of(system).zeros;
            assert_eq!((zeros.polynomial, zeros.normal_rank), (text(&whole), count), "{what}, seed {seed}");
            // Each value is a root: p(z) = 0 against the size of the terms.
            assert_eq!(zeros.values.len(), whole.len() - 1, "{what}, seed {seed}");
            for Complex { re, im } in zeros.values {
                let horner = |(x, y): (f64, f64), c: &i64| (x * re - y * im + *c as f64, x * im + y * re);
                let value = whole.iter().rev().fold((0.0, 0.0), horner);
                let size: f64 =
                    whole.iter().enumerate().map(|(k, c)| *c as f64 * re.hypot(im).powi(k as i32)).map(f64::abs).sum();
                assert!(value.0.hypot(value.1) < 1e-12 * size.max(1.0), "{what}: {re} {im}, seed {seed}");
            }
        };
        check(&system, "as built");
        let (t, inverse) = dice.unimodular(n);
        let (v, w) = (dice.unimodular(count).0, dice.unimodular(count).0);
        let (a, b, c) = (&system.a, &system.b, &system.c);
        let similar = changed(&system, t.multiply(a).multiply(&inverse), t.multiply(b), c.multiply(&inverse));
        check(&similar, "similar");
        for (i, row) in of(&similar).relative_degrees.iter().enumerate() {
            for (j, degree) in row.iter().enumerate() {
                assert_eq!(*degree, (i == j).then_some(degrees[i]), "relative degree, seed {seed}");
            }
        }
        let mixed = changed(&similar, similar.a.clone(), similar.b.multiply(&v), w.multiply(&similar.c));
        check(&mixed, "inputs and outputs mixed");
        let (k, l) = (dice.matrix(count, n, 2), dice.matrix(n, count, 2));
        let feedback = changed(&mixed, mixed.a.plus(&mixed.b.multiply(&k)), mixed.b.clone(), mixed.c.clone());
        check(&feedback, "state feedback");
        let injection =
            changed(&feedback, feedback.a.plus(&l.multiply(&feedback.c)), feedback.b.clone(), feedback.c.clone());
        check(&injection, "output injection");
        // The least relative degree of each output survives state feedback.
        let least = |s: &LinearSystem| {
            of(s).relative_degrees.iter().map(|row| row.iter().flatten().min().copied()).collect::<Vec<_>>()
        };
        assert_eq!(least(&mixed), least(&feedback), "seed {seed}");
        // E on the left of everything changes nothing.
        let e = definite(&mut dice, n);
        let descriptor = LinearSystem { a: e.multiply(&injection.a), b: e.multiply(&injection.b), e, ..injection };
        check(&descriptor, "with E");
    }
}

/// More outputs than inputs: the common roots; feedthrough; a mode that no input reaches; two inputs that do the same.
#[test]
fn zeros_of_other_shapes() {
    for seed in 0..30 {
        let mut dice = Dice(10_000 + seed);
        let linear = |root: i64| vec![-root, 1];
        let common = linear(dice.between(-3, 3));
        // 4 and 5 differ from each other and from the common root.
        let (one, two) = (product(&common, &linear(4)), product(&common, &linear(5)));
        let mut denominator: P = (0..4).map(|_| dice.between(-3, 3)).collect();
        denominator.push(1);
        let n = 4;
        let a = companion(&denominator);
        let b = M::from_fn(n, 1, |i, _| int(i64::from(i == 3)));
        let row = |p: &P| M::from_fn(1, n, |_, j| int(p.get(j).copied().unwrap_or(0)));
        let (t, inverse) = dice.unimodular(n);
        let hide = |s: &LinearSystem| {
            let (a, b, c) = (t.multiply(&s.a).multiply(&inverse), t.multiply(&s.b), s.c.multiply(&inverse));
            LinearSystem { a, b, c, ..s.clone() }
        };
        let tall = LinearSystem::state_space(a.clone(), b.clone(), above(&row(&one), &row(&two)));
        assert_eq!(of(&hide(&tall)).zeros.polynomial, text(&common), "two outputs, seed {seed}");
        assert_eq!(of(&hide(&tall).transpose()).zeros.polynomial, text(&common), "two inputs, seed {seed}");
        // D = 1: y = c x + u has the numerator c + denominator.
        let numerator = product_of(&[one.clone(), linear(-4), linear(1)]);
        let difference: P = (0..4).map(|k| numerator[k] - denominator[k]).collect();
        let mut direct = LinearSystem::state_space(a.clone(), b.clone(), row(&difference));
        direct.d = M::identity(1);
        let found = of(&hide(&direct));
        assert_eq!((found.zeros.polynomial.as_str(), &found.relative_degrees[0][0]), (&*text(&numerator), &Some(0)));
        // Both inputs do the same: some combination does nothing.
        let duplicated_input = LinearSystem::state_space(a.clone(), beside(&b, &b), row(&one));
        assert_eq!(
            (of(&hide(&duplicated_input)).zeros.polynomial, of(&hide(&duplicated_input)).zeros.normal_rank),
            (text(&one), 1)
        );
        let doubled = LinearSystem::state_space(a.clone(), beside(&b, &b), above(&row(&one), &row(&one)));
        let found = of(&hide(&doubled)).zeros;
        assert_eq!((found.polynomial, found.normal_rank), (text(&one), 1), "seed {seed}");
        // A mode that no input reaches is a zero as well.
        let lambda = dice.between(-3, 3);
        let wide = LinearSystem::state_space(
            block_diagonal(&[a.clone(), diagonal(&[int(lambda)])]),
            above(&b, &M::zeros(1, 1)),
            beside(&row(&one), &M::identity(1)),
        );
        assert_eq!(of(&wide).zeros.polynomial, text(&product(&one, &linear(lambda))), "seed {seed}");
    }
}

/// A chain of bodies: a force needs two integrations per spring, one per damper more.
#[test]
fn relative_degrees_of_chains() {
    for n in 1..7usize {
        let chain = |on: bool| {
            M::from_fn(n, n, |i, j| {
                let ends = i64::from(i > 0) + i64::from(i + 1 < n);
                int(i64::from(on)
                    * if i == j {
                        ends
                    } else if i.abs_diff(j) == 1 {
                        -1
                    } else {
                        0
                    })
            })
        };
        let h = diagonal(&(0..n).map(|k| frac(1 + k as i64, 3)).collect::<Vec<_>>());
        let f = M::from_fn(n, 1, |i, _| int(i64::from(i == 0)));
        for damped in [false, true] {
            let mechanism =
                Mechanism { h: h.clone(), d: chain(damped), s: chain(true), f: f.clone(), g: M::identity(n) };
            let found = of(&mechanism.system()).relative_degrees;
            let expected: Vec<Vec<Option<usize>>> =
                (0..n).map(|k| vec![Some(if damped { 2 + k } else { 2 + 2 * k })]).collect();
            assert_eq!(found, expected, "{n} bodies, damped: {damped}");
        }
    }
}

// ---- the constructive procedure -----------------------------------------------------------------------------------

fn whole(rows: &[&[i64]]) -> M {
    M::from_fn(rows.len(), rows[0].len(), |i, j| int(rows[i][j]))
}

/// Counterexamples to the printed procedure: a number that loses an eigenvalue, complex eigenvectors, Jordan blocks.
#[test]
fn the_construction_avoids_what_the_printed_one_meets() {
    let expected = &golden()["analysis"]["thm52_counterexample"];
    let a = M::from_fn(3, 3, |i, j| int(expected["A"][i][j].as_str().unwrap().parse().unwrap()));
    let printed = M::from_fn(3, 1, |i, _| int(expected["B"][i].as_str().unwrap().parse().unwrap()));
    let no_inputs = |a: M| LinearSystem::state_space(a.clone(), M::zeros(a.rows(), 0), M::zeros(0, a.rows()));
    let mut found = of(&LinearSystem::state_space(a.clone(), printed, M::zeros(0, 3)));
    assert_eq!(expected["true_min_inputs"], found.min_inputs);
    found.factors.retain(|f| f.input_defect > 0);
    assert!(found.factors.len() == 1 && found.factors[0].polynomial == "s - 3" && expected["uncontrollable"]["3"] == 1);
    for (a, least) in [
        (a, 1),
        (whole(&[&[0, 1], &[-1, 0]]), 1),
        (whole(&[&[0, 1, 0, 0], &[-1, 0, 0, 0], &[0, 0, 0, 1], &[0, 0, -1, 0]]), 2),
        (whole(&[&[0, 1, 0], &[0, 0, 1], &[0, 0, 0]]), 1),
        (whole(&[&[0, 0], &[0, 0]]), 2),
        // An irreducible quintic: no root in radicals.
        (companion(&[-1, -1, 0, 0, 0, 1]), 1),
        // A factor that is not split, of degree 5 beside one of degree 2, with two eigenvectors for each root.
        (block_diagonal(&[companion(&whole_seven()), companion(&whole_seven())]), 2),
    ] {
        let system = no_inputs(a);
        let built = construction(&system).expect("small");
        let b = M::from_fn(system.states.len(), least, |i, j| int(built.input[i][j].parse().unwrap()));
        assert_eq!((built.input[0].len(), reached(&system, &b)), (least, system.states.len()), "{built:?}");
    }
    assert_eq!(construction(&no_inputs(M::zeros(0, 0))), None);
    assert_eq!(construction(&no_inputs(M::identity(65))), None);
    assert_eq!(construction(&LinearSystem { e: M::zeros(2, 2), ..no_inputs(M::identity(2)) }), None);
}

/// (s⁵ − s − 1)(s² − 2): no factor of it has rational coefficients of degree one.
fn whole_seven() -> P {
    product(&[-1, -1, 0, 0, 0, 1], &[-2, 0, 1])
}

/// Diagonal matrices force the procedure to come back to a column: many eigenvalues, one input, each needs its own state.
#[test]
fn the_construction_returns_to_a_column_and_changes_its_sign() {
    let n = 8;
    let system = LinearSystem::state_space(
        diagonal(&(0..n).map(|k| int(k as i64)).collect::<Vec<_>>()),
        M::zeros(n, 0),
        M::zeros(0, n),
    );
    let built = construction(&system).unwrap();
    assert_eq!(built.steps.len(), n);
    assert!(built.input.iter().all(|row| row[0] != "0"));
    // Here 1 would cancel: after b = e1 the left eigenvector (1, −1) of λ = 0 is lost by adding 1 e2.
    let a = whole(&[&[2, -2], &[1, -1]]);
    let system = LinearSystem::state_space(a, M::zeros(2, 0), M::zeros(0, 2));
    assert_eq!(reached(&system, &whole(&[&[1], &[1]])), 1);
    for seed in 0..30 {
        let mut dice = Dice(11_000 + seed);
        // Two eigenvalues with left eigenvectors that share no state with each other but through T.
        let n = 3 + dice.below(3);
        let (t, inverse) = dice.unimodular(n);
        let eigenvalues: Vec<Rational> = (0..n).map(|k| int(k as i64 % 4)).collect();
        let a = t.multiply(&diagonal(&eigenvalues)).multiply(&inverse);
        let system = LinearSystem::state_space(a, M::zeros(n, 0), M::zeros(0, n));
        let least = if n > 4 { 2 } else { 1 };
        check_least(&system, &of(&system), least, &mut dice, seed);
    }
}

/// As large as allowed: 32 bodies in a chain with decimals.
#[test]
fn the_construction_of_a_long_chain() {
    let n = 32;
    let links = |size: u64| {
        M::from_fn(n, n, |i, j| {
            let c = |k: usize| frac(100 + k as i64 % 7, size);
            match (i as i64 - j as i64).abs() {
                0 => (if i > 0 { c(i) } else { int(0) }) + if i + 1 < n { c(i + 1) } else { int(0) },
                1 => int(0) - c(i.max(j)),
                _ => int(0),
            }
        })
    };
    let h = diagonal(&(0..n).map(|k| frac(11 + k as i64 % 5, 1000)).collect::<Vec<_>>());
    let mechanism = Mechanism { h, d: links(100), s: links(3), f: M::zeros(n, 0), g: M::zeros(0, n) };
    let built = construction(&mechanism.system()).expect("64 states");
    // A force on the first body reaches every state of a chain.
    assert_eq!(built.rows[0], "q0");
    assert!(
        built.input.iter().enumerate().all(|(i, row)| row == &[if i == 0 { "1" } else { "0" }]),
        "{:?}",
        built.input
    );
    assert_eq!(built.steps.len(), 1);
}

// ---- chapter 4: what does not depend on the basis -----------------------------------------------------------------

fn directional_term<T>(element: &str, row: &[(usize, Rational)], value: T) -> DirectionalTerm<T> {
    let mut row: Vec<_> = row.iter().filter(|(_, x)| *x != int(0)).cloned().collect();
    row.sort_by_key(|(j, _)| *j);
    DirectionalTerm { element: element.into(), row, value }
}

/// Bodies, couplings and independent constraints.
fn constrained(dice: &mut Dice) -> ConstrainedSystem {
    let n = 3 + dice.below(3);
    let m = 1 + dice.below(n - 2);
    let mut system = ConstrainedSystem { coordinates: (0..n).map(|k| format!("s{k}")).collect(), ..Default::default() };
    for k in 0..n {
        system.inertias.push(directional_term(&format!("s{k}"), &[(k, int(1))], frac(dice.between(1, 9), 10)));
    }
    for k in 0..3 {
        let (i, step) = (dice.below(n), 1 + dice.below(n - 1));
        let row = [(i, int(1)), ((i + step) % n, int(dice.pick(&[-2, -1, 1, 3])))];
        system.springs.push(directional_term(&format!("c{k}"), &row, int(dice.between(1, 9))));
        system.dampers.push(directional_term(&format!("c{k}"), &row, frac(dice.between(1, 9), 7)));
        system.inertias.push(directional_term(&format!("c{k}"), &row, frac(dice.between(1, 9), 5)));
    }
    // The shaft that each row begins with stands in no other row.
    for k in 0..m {
        let mut row = vec![(k, int(1))];
        row.extend((m..n).map(|j| (j, int(dice.between(-3, 3)))));
        system.constraints.push(directional_term(&format!("g{k}"), &row, ()));
    }
    system.inputs.push(directional_term("first", &[(0, int(1))], ()));
    system.inputs.push(directional_term("between", &[(0, int(-1)), (n - 1, int(2))], ()));
    system
}

/// All shaft angles, then every constraint torque on every shaft that its row has.
fn signals(system: &ConstrainedSystem) -> Vec<OutputSignal> {
    let angles = system.coordinates.iter().map(|shaft| Measured::Angle(shaft.clone()));
    let torques = system.constraints.iter().flat_map(|c| {
        c.row.iter().map(|(j, _)| Measured::ConstraintTorque(c.element.clone(), system.coordinates[*j].clone()))
    });
    angles.chain(torques).map(|measured| OutputSignal { name: format!("{measured:?}"), measured }).collect()
}

/// Accelerations and constraint torques of the reduced equations are those of (4.36) with the multipliers as unknowns,
/// exactly, at any state and torque, in any basis; and `τ_c = −P (Fτ − Dq̇ − Sq)` with P of (4.56).
#[test]
fn theorems_4_1_and_4_5_hold_exactly_in_any_basis() {
    for seed in 0..60 {
        let mut dice = Dice(12_000 + seed);
        let system = constrained(&mut dice);
        let (n, m) = (system.coordinates.len(), system.constraints.len());
        let (h, d, s) = (system.inertia_matrix(), system.damping_matrix(), system.stiffness_matrix());
        let (c, f) = (system.constraint_matrix(), system.input_matrix());
        let outputs = signals(&system);
        let (coordinates, k) = system.explicit_basis(&[dice.below(n)]);
        let r = n - m;
        assert_eq!((rank(&k), c.multiply(&k)), (r, M::zeros(m, r)), "seed {seed}");
        let (t, inverse) = dice.unimodular(r);
        let scale = frac(dice.between(1, 5), 3);
        let (t, inverse) = (t.scale(&scale), inverse.scale(&(int(1) / scale)));
        let (z, v, u) = (dice.matrix(r, 1, 4), dice.matrix(r, 1, 4), dice.matrix(2, 1, 4));
        // The implicit equations.
        let force =
            f.multiply(&u).plus(&negative(&d.multiply(&k).multiply(&v))).plus(&negative(&s.multiply(&k).multiply(&z)));
        let implicit = above(&beside(&h, &negative(&c.transpose())), &beside(&c, &M::zeros(m, m)));
        let solution = solved(&implicit, &above(&force, &M::zeros(m, 1)));
        let torque = |constraint: usize, shaft: usize| &c[(constraint, shaft)] * &solution[(n + constraint, 0)];
        let mobility = solved(&h, &c.transpose());
        let p = c.transpose().multiply(&solved(&c.multiply(&mobility), &mobility.transpose()));
        let by_projector = negative(&p.multiply(&force));
        assert_eq!(p.multiply(&p), p);
        for (basis, z, v) in
            [(k.clone(), z.clone(), v.clone()), (k.multiply(&t), inverse.multiply(&z), inverse.multiply(&v))]
        {
            let linear = linear_system(&system, &coordinates, &basis, &outputs);
            let x = above(&z, &v);
            let rates = solved(&linear.e, &linear.a.multiply(&x).plus(&linear.b.multiply(&u)));
            let acceleration = basis.multiply(&M::from_fn(r, 1, |i, _| rates[(r + i, 0)].clone()));
            assert_eq!(acceleration, M::from_fn(n, 1, |i, _| solution[(i, 0)].clone()), "seed {seed}");
            let y = linear.c.multiply(&x).plus(&linear.d.multiply(&u));
            let mut sum = M::zeros(n, 1);
            let places =
                system.constraints.iter().enumerate().flat_map(|(g, c)| c.row.iter().map(move |(j, _)| (g, *j)));
            for (at, (g, j)) in places.enumerate() {
                assert_eq!(y[(n + at, 0)], torque(g, j), "constraint torque of g{g} on s{j}, seed {seed}");
                sum[(j, 0)] = &sum[(j, 0)] + &y[(n + at, 0)];
            }
            assert_eq!(sum, by_projector, "seed {seed}");
        }
    }
}

/// Every answer on structure is that of the mechanism, not of the coordinates chosen (Theorems 4.1, 4.2: congruence).
#[test]
fn theorem_4_2_no_result_depends_on_the_basis() {
    for seed in 0..25 {
        let mut dice = Dice(13_000 + seed);
        let system = constrained(&mut dice);
        let outputs: Vec<OutputSignal> = signals(&system).into_iter().take(2).collect();
        let invariants = |coordinates: &[usize], basis: &M| {
            let s = of(&linear_system(&system, coordinates, basis, &outputs));
            let mut factors: Vec<_> = s.factors.iter().map(found_row).collect();
            factors.sort();
            let numbers = [s.controllable_rank, s.observable_rank, s.min_inputs, s.min_outputs, s.zeros.normal_rank];
            (numbers, factors, s.invariant_factors, s.zeros.polynomial, s.relative_degrees, s.kind)
        };
        let (coordinates, basis) = system.explicit_basis(&[]);
        let expected = invariants(&coordinates, &basis);
        let last = system.coordinates.len() - 1;
        let (other_coordinates, other_basis) = system.explicit_basis(&[last, last - 1]);
        assert_eq!(invariants(&other_coordinates, &other_basis), expected, "seed {seed}");
        let (t, _) = dice.unimodular(coordinates.len());
        assert_eq!(invariants(&coordinates, &basis.multiply(&t.scale(&frac(2, 7)))), expected, "seed {seed}");
    }
}

// ---- golden systems -----------------------------------------------------------------------------------------------

/// A built-in model with torques and angle sensors on shafts; `tb` is the twist of the torsion bar.
fn built_in(name: &str, forces: &[&str], sensors: &[&str]) -> LinearSystem {
    let variant = first(model::builtin(name).expect("built in").source);
    let position = vec![0.0; variant.reduced.degrees_of_freedom()];
    let mut system = ConstrainedSystem::at(&variant.reduced, &position, &BTreeSet::new(), &[]);
    let number = |shaft: &str| system.coordinates.iter().position(|s| s == shaft).expect("a shaft");
    let inputs = forces.iter().map(|shaft| directional_term(shaft, &[(number(shaft), int(1))], ())).collect();
    let (coordinates, basis) = system.explicit_basis(&variant.reduced.coordinates);
    let outputs: Vec<OutputSignal> = sensors
        .iter()
        .map(|sensor| OutputSignal {
            name: sensor.to_string(),
            measured: match *sensor {
                "tb" => Measured::SpringTorque("torsion_bar".into()),
                shaft => Measured::Angle(shaft.into()),
            },
        })
        .collect();
    system.inputs = inputs;
    linear_system(&system, &coordinates, &basis, &outputs)
}

/// `100*s**2*(s + 10000)/7` or `4335*s**3 + 24409*s**2 + 1`, one factor or with powers of s in front, as monic text.
fn monic(sympy: &str) -> String {
    let start = sympy.find('(').map(|at| (&sympy[..at], &sympy[at + 1..sympy.find(')').expect("closed")]));
    let (front, sum) = start.unwrap_or(("", sympy));
    let shift = if front.contains("s**2") { 2 } else { usize::from(front.contains('s')) };
    let mut coefficients: Vec<i64> = Vec::new();
    for term in sum.split(" + ") {
        let (c, power) = match term.split_once('s') {
            None => (term, 0),
            Some((c, p)) => (c.trim_end_matches('*'), p.strip_prefix("**").map_or(1, |p| p.parse().expect("a power"))),
        };
        coefficients.resize(coefficients.len().max(power + 1), 0);
        coefficients[power] = if c.is_empty() { 1 } else { c.parse().expect("a whole number") };
    }
    let leading = int(*coefficients.last().expect("terms"));
    let zeros = std::iter::repeat_n(int(0), shift);
    Polynomial::new(zeros.chain(coefficients.iter().map(|&c| int(c) / &leading)).collect()).to_string()
}

/// Geometric multiplicities by factor.
fn check_multiplicities(found: &Structure, expected: &serde_json::Value, what: &str) {
    let mut expected: Vec<(String, usize)> = expected
        .as_object()
        .expect("factors")
        .iter()
        .map(|(factor, count)| (monic(factor), count.as_u64().expect("a count") as usize))
        .collect();
    let mut found: Vec<(String, usize)> = found.factors.iter().map(|f| (f.polynomial.clone(), f.geometric)).collect();
    expected.sort();
    found.sort();
    assert_eq!(found, expected, "{what}");
}

fn rank_of(value: &serde_json::Value) -> usize {
    value.as_u64().unwrap_or_else(|| panic!("{value} is no rank")) as usize
}

/// golden.json `analysis.ranks.hd`, with the extended observer (6.45): loads as constant states.
#[test]
fn harmonic_drive_and_its_observer() {
    let expected = &golden()["analysis"]["ranks"]["hd"];
    let both = built_in("harmonic-drive", &["wg", "cs"], &["wg", "cs"]);
    let found = of(&both);
    assert_eq!(expected["min_inputs"], found.min_inputs);
    assert_eq!(rank_of(&expected["ctrb_rank"]), found.controllable_rank);
    assert_eq!(rank_of(&expected["obsv_rank_q"]), found.observable_rank);
    check_multiplicities(&found, &expected["mult"], "harmonic drive");
    let one = of(&built_in("harmonic-drive", &["wg"], &["cs"]));
    assert_eq!(rank_of(&expected["ctrb_rank_wg_only"]), one.controllable_rank);
    assert_eq!(rank_of(&expected["obsv_rank_one_position"]), one.observable_rank);
    // x = (q̇, q, τ_d): H q̈ = −D q̇ + τ_d + τ_a.
    let part = |m: &M, i: usize, j: usize| M::from_fn(2, 2, |k, l| m[(2 * i + k, 2 * j + l)].clone());
    let (h, minus_d) = (part(&both.e, 1, 1), part(&both.a, 1, 1));
    assert_eq!(part(&both.a, 1, 0), M::zeros(2, 2), "no spring");
    let (zero, unit) = (M::zeros(2, 2), M::identity(2));
    let a = above(&beside(&beside(&minus_d, &zero), &unit), &above(&beside(&unit, &M::zeros(2, 4)), &M::zeros(2, 6)));
    let observer = |sensors: &M| LinearSystem {
        e: block_diagonal(&[h.clone(), unit.clone(), unit.clone()]),
        ..LinearSystem::state_space(
            a.clone(),
            above(&unit, &M::zeros(4, 2)),
            beside(&beside(&M::zeros(sensors.rows(), 2), sensors), &M::zeros(sensors.rows(), 2)),
        )
    };
    let expected = &expected["ext_observer"];
    let found = of(&observer(&unit));
    assert_eq!(rank_of(&expected["obsv_rank"]), found.observable_rank);
    assert_eq!(expected["min_outputs"], found.min_outputs);
    check_multiplicities(&found, &expected["mult"], "observer");
    // The coordinates are wg, cs.
    assert_eq!(both.states[1], "cs.phi");
    assert_eq!(rank_of(&expected["rank_with_phi_cs_only"]), of(&observer(&whole(&[&[0, 1]]))).observable_rank);
}

/// golden.json `analysis.ranks.hds`: six states, and the five of (6.61) as corrected, with both outputs of the decoupling.
#[test]
fn harmonic_drive_with_a_spring_in_six_and_five_states() {
    let all = golden();
    let expected = &all["analysis"]["ranks"]["hds"];
    // States: wg, rk, fs and their speeds.
    let six = built_in("harmonic-drive-spring", &["wg", "rk"], &["rk"]);
    assert_eq!(six.states, ["wg.phi", "rk.phi", "fs.phi", "wg.w", "rk.w", "fs.w"]);
    let rates = solved(&six.e, &six.a);
    // T_fs = J_fs φ̈_fs (6.62): the net torque; J_fs stands in E because H_r is diagonal here.
    let net_torque =
        |rates: &M, inertia: &Rational, row: usize| M::from_fn(1, rates.columns(), |_, j| inertia * &rates[(row, j)]);
    let torque = net_torque(&rates, &six.e[(5, 5)], 5);
    let with = |system: &LinearSystem, c: M| LinearSystem {
        outputs: (0..c.rows()).map(|k| format!("y{k}")).collect(),
        d: M::zeros(c.rows(), system.b.columns()),
        c,
        ..system.clone()
    };
    let angle = six.c.clone();
    let state6 = &expected["state6"];
    let found = of(&with(&six, above(&angle, &torque)));
    assert_eq!([found.min_inputs, found.controllable_rank, found.observable_rank], [2, 6, 5].map(|x| x));
    for (key, value) in [
        ("n", found.states.len()),
        ("min_inputs", found.min_inputs),
        ("ctrb_rank", found.controllable_rank),
        ("obsv_rank", found.observable_rank),
        ("obsv_rank_phi_rk_only", of(&with(&six, angle.clone())).observable_rank),
        ("obsv_rank_Tfs_only", of(&with(&six, torque)).observable_rank),
        ("ctrb_rank_wg", of(&built_in("harmonic-drive-spring", &["wg"], &["rk"])).controllable_rank),
        ("ctrb_rank_rk", of(&built_in("harmonic-drive-spring", &["rk"], &["rk"])).controllable_rank),
    ] {
        assert_eq!(state6[key], value, "{key}");
    }
    for (key, sensors) in [
        ("obsv_rank_enc_wg", &["wg"][..]),
        ("obsv_rank_enc_rk", &["rk"]),
        ("obsv_rank_enc_fs", &["fs"]),
        ("obsv_rank_enc_wg_rk", &["wg", "rk"]),
        ("obsv_rank_enc_wg_fs", &["wg", "fs"]),
        ("obsv_rank_enc_rk_fs", &["rk", "fs"]),
        ("obsv_rank_enc_all", &["wg", "rk", "fs"]),
    ] {
        assert_eq!(state6[key], of(&built_in("harmonic-drive-spring", &["wg"], sensors)).observable_rank, "{key}");
    }
    check_multiplicities(&found, &state6["mult"], "six states");
    assert_eq!(found.zeros.polynomial, monic(state6["zeros"].as_str().unwrap()));

    // x' = (φ_rk, z, q̇) with z = nᵀq, n = (1, −51, 50): S = k n nᵀ.
    let n = [1, -51, 50];
    let quotient = M::from_fn(5, 6, |i, j| {
        int(match i {
            0 => i64::from(j == 1),
            1 => {
                if j < 3 {
                    n[j]
                } else {
                    0
                }
            }
            _ => i64::from(j == i + 1),
        })
    });
    let a = M::from_fn(5, 5, |i, j| match (i, j) {
        (0, 3) => int(1),
        (1, 2..) => int(n[j - 2]),
        (2.., 1) => six.a[(i + 1, 0)].clone(), // −k n_i n_1, n_1 = 1
        (2.., 2..) => six.a[(i + 1, j + 1)].clone(),
        _ => int(0),
    });
    let e = block_diagonal(&[M::identity(2), M::from_fn(3, 3, |i, j| six.e[(3 + i, 3 + j)].clone())]);
    let b = M::from_fn(5, 2, |i, j| if i < 2 { int(0) } else { six.b[(i + 1, j)].clone() });
    // Every motion of the six states is one of the five: L E₆⁻¹A₆ = E₅⁻¹A₅ L, L E₆⁻¹B₆ = E₅⁻¹B₅.
    let five_rates = solved(&e, &a);
    assert_eq!(quotient.multiply(&rates), five_rates.multiply(&quotient));
    assert_eq!(quotient.multiply(&solved(&six.e, &six.b)), solved(&e, &b));
    common::agrees(&five_rates, &common::rows(&all["hds"]["A5"]), 1e-15, "A5");
    common::agrees(&solved(&e, &b), &common::rows(&all["hds"]["B5"]), 1e-15, "B5");
    let angle = whole(&[&[1, 0, 0, 0, 0]]);
    let torque = net_torque(&five_rates, &e[(4, 4)], 4);
    common::agrees(&above(&angle, &torque), &common::rows(&all["hds"]["C5"]), 1e-15, "C5");
    let five = LinearSystem { e, ..LinearSystem::state_space(a, b.clone(), above(&angle, &torque)) };
    let found = of(&five);
    let state5 = &expected["state5"];
    let column = |j: usize| LinearSystem {
        inputs: vec!["u".into()],
        b: M::from_fn(5, 1, |i, _| b[(i, j)].clone()),
        d: M::zeros(2, 1),
        ..five.clone()
    };
    for (key, value) in [
        ("n", found.states.len()),
        ("min_inputs", found.min_inputs),
        ("ctrb_rank", found.controllable_rank),
        ("ctrb_rank_wg", of(&column(0)).controllable_rank),
        ("ctrb_rank_rk", of(&column(1)).controllable_rank),
        ("obsv_rank", found.observable_rank),
        ("obsv_rank_phi_rk_only", of(&with(&five, angle)).observable_rank),
        ("obsv_rank_Tfs_only", of(&with(&five, torque)).observable_rank),
    ] {
        assert_eq!(state5[key], value, "{key}");
    }
    assert_eq!(golden()["analysis"]["min_inputs"]["hds_state5"], found.min_inputs);
    check_multiplicities(&found, &state5["mult"], "five states");
    assert_eq!(found.zeros.polynomial, monic(state5["zeros"].as_str().unwrap()));
    let degrees: Vec<usize> = found.relative_degrees.iter().map(|row| *row.iter().flatten().min().unwrap()).collect();
    assert_eq!(all["hds"]["relative_degrees"], serde_json::json!(degrees));
    assert_eq!(construction(&five).unwrap().input[0].len(), 1);
}

/// golden.json `analysis.ranks.sia`: all sets of sensors, without and with loads on rack and flexspline as constant states;
/// all sets of motors; zeros.
#[test]
fn steering_column_with_every_set_of_sensors() {
    let expected = &golden()["analysis"]["ranks"]["sia"];
    let sets = expected["observability"].as_object().expect("sets of sensors");
    assert_eq!(sets.len(), 25);
    for (set, ranks) in sets {
        let sensors: Vec<&str> = set.split('+').collect();
        let system = built_in("sia-steering", &["rk", "fs"], &sensors);
        let found = of(&system);
        assert_eq!(ranks["rank6"], found.observable_rank, "{set}");
        let extended = LinearSystem {
            e: block_diagonal(&[system.e.clone(), M::identity(2)]),
            ..LinearSystem::state_space(
                above(&beside(&system.a, &system.b), &M::zeros(2, 8)),
                M::zeros(8, 0),
                beside(&system.c, &M::zeros(sensors.len(), 2)),
            )
        };
        assert_eq!(ranks["rank8_with_dist"], of(&extended).observable_rank, "{set} with loads");
        assert_eq!(golden()["analysis"]["min_inputs"]["sia"], found.min_outputs);
    }
    for (set, rank) in expected["ctrb_rank_axis_pairs"].as_object().expect("pairs of motors") {
        let found = of(&built_in("sia-steering", &set.split('+').collect::<Vec<_>>(), &["rk"]));
        assert_eq!(*rank, found.controllable_rank, "{set}");
    }
    for (key, set) in [
        ("ctrb_rank_wg_rk", &["wg", "rk"][..]),
        ("ctrb_rank_wg", &["wg"]),
        ("ctrb_rank_rk", &["rk"]),
        ("ctrb_rank_fs", &["fs"]),
        ("ctrb_rank_fs_wg", &["fs", "wg"]),
    ] {
        assert_eq!(expected[key], of(&built_in("sia-steering", set, &["rk"])).controllable_rank, "{key}");
    }
    for (outputs, key) in [(["rk", "fs"], "zeros_outputs_rk_fs"), (["fs", "cj"], "zeros_outputs_fs_cj")] {
        let zeros = of(&built_in("sia-steering", &["wg", "rk"], &outputs)).zeros;
        let printed = expected[key].as_str().unwrap();
        let factor = printed[..printed.rfind('/').unwrap()].trim_start_matches('-');
        assert_eq!(zeros.polynomial, monic(factor), "{key}");
        let mut roots = common::rows(&expected[format!("{key}_roots")]);
        roots.sort_by(|a, b| a[1].total_cmp(&b[1]));
        let mut values = zeros.values;
        values.sort_by(|a, b| a.im.total_cmp(&b.im));
        for (value, root) in values.iter().zip(&roots) {
            assert!((value.re - root[0]).hypot(value.im - root[1]) < 1e-12 * root[0].hypot(root[1]), "{key}");
        }
        assert_eq!(values.len(), roots.len());
    }
    let stiffness = built_in("sia-steering", &["rk"], &["rk"]);
    let s = M::from_fn(3, 3, |i, j| stiffness.a[(3 + i, j)].clone());
    assert_eq!(expected["rank_S"], rank(&s));
}

/// Appendix B for any J, s, d ≥ 0: the eigenvalues (B.5), the kernels (B.7), (B.9), (B.11), (B.13) with the errata at s = 0,
/// and the verdict: one motor on any body if and only if s ≠ 0 and d² ≠ sJ.
#[test]
fn appendix_b_for_random_parameters() {
    let times = |a: &[Rational], b: &[Rational]| {
        let mut out = vec![int(0); a.len() + b.len() - 1];
        for (i, x) in a.iter().enumerate() {
            for (j, y) in b.iter().enumerate() {
                out[i + j] = &out[i + j] + x * y;
            }
        }
        out
    };
    let polynomial_text = |p: &[Rational]| Polynomial::new(p.to_vec()).to_string();
    let mut cases = BTreeSet::new();
    for seed in 0..150 {
        let mut dice = Dice(14_000 + seed);
        let j = frac(dice.between(1, 6), 1 + dice.below(4) as u64);
        let k = frac(dice.between(0, 5), 1 + dice.below(4) as u64);
        let (s, d) = match seed % 3 {
            0 => (&k * &k * &j, &k * &j), // d² = sJ
            1 => (frac(dice.between(0, 2), 2), frac(dice.between(0, 2), 2)),
            _ => (frac(dice.between(1, 9), 2), frac(dice.between(0, 9), 5)),
        };
        let minus = |x: &Rational| int(0) - x;
        let pair = |a: &Rational, b: Rational| M::from_fn(2, 2, |i, k| if i == k { a.clone() } else { b.clone() });
        let found = |force: [i64; 2]| {
            let f = M::from_fn(2, 1, |i, _| int(force[i]));
            let (h, d, s) = (pair(&j, int(0)), pair(&(&d + &d), minus(&d)), pair(&s, minus(&s)));
            of(&Mechanism { h, d, s, g: f.transpose(), f }.system())
        };
        let what = format!("J = {j}, s = {s}, d = {d}");
        let springless = s == int(0);
        let singular = &d * &d == &s * &j;
        // λ₁, λ₂ move both bodies together, λ₃, λ₄ against each other.
        let symmetric = times(&[int(0), int(1)], &[&d / &j, int(1)]);
        let antisymmetric = [(&s + &s) / &j, int(3) * &d / &j, int(1)];
        let all = times(&symmetric, &antisymmetric);
        let root = |x: &Rational| vec![x.clone(), int(1)];
        let (zero, second) = (root(&int(0)), root(&(&d / &j)));
        let expected = match (springless, singular) {
            (true, true) => vec![times(&zero, &zero), times(&zero, &zero)],
            (true, false) => vec![zero.clone(), times(&symmetric, &root(&(int(3) * &d / &j)))],
            (false, true) => vec![second.clone(), times(&symmetric, &root(&(int(2) * &d / &j)))],
            (false, false) => vec![all.clone()],
        };
        let one = found([0, 1]);
        assert_eq!(one.invariant_factors, expected.iter().map(|p| polynomial_text(p)).collect::<Vec<_>>(), "{what}");
        let enough = !springless && !singular;
        for one in [&one, &found([1, 0])] {
            assert_eq!(
                (one.controllable(), one.observable(), one.min_inputs),
                (enough, enough, expected.len()),
                "{what}"
            );
        }
        for f in &one.factors {
            let double = (f.polynomial == "s" && springless) || (f.polynomial == polynomial_text(&second) && singular);
            assert_eq!(f.geometric, if double { 2 } else { 1 }, "{} for {what}", f.polynomial);
        }
        if enough {
            // Items 1 to 3: torques in opposite directions miss λ₁ and λ₂, equal ones the others.
            for (force, missed) in [([1, -1], &symmetric[..]), ([1, 1], &antisymmetric[..])] {
                let found = found(force);
                assert_eq!((found.controllable_rank, found.observable_rank), (2, 2), "{what}");
                let uncontrollable = found.factors.iter().filter(|f| f.input_defect > 0);
                let product = uncontrollable.fold(vec![int(1)], |product, f| {
                    let own = [&zero, &second].into_iter().find(|p| polynomial_text(p) == f.polynomial).cloned();
                    let part =
                        own.or_else(|| antisymmetric_part(&f.polynomial, &antisymmetric)).expect("a known factor");
                    (0..f.algebraic).fold(product, |product, _| times(&product, &part))
                });
                assert_eq!(polynomial_text(&product), polynomial_text(missed), "{what}");
            }
        }
        cases.insert((springless, singular));
    }
    assert_eq!(cases.len(), 4);
}

/// The quadratic factor or one of its rational roots, by its text.
fn antisymmetric_part(factor: &str, antisymmetric: &[Rational; 3]) -> Option<Vec<Rational>> {
    let parts = Polynomial::new(antisymmetric.to_vec()).simple_factors();
    parts.into_iter().find(|p| p.to_string() == factor).map(|p| p.coefficients().to_vec())
}
