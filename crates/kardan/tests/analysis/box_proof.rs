//! Proofs over boxes of parameters against known losses, random losses and a scan.

use faer::{Mat, c64};
use kardan::analysis::{BoxProof, PencilBox, prove_box};
use kardan::num::{Matrix, Random, Rational, Scalar, rational_to_f64};
use kardan::results::Pole;

fn ratio(a: i64, b: i64) -> Rational {
    Rational::from_parts_signed(a.into(), b.into())
}

fn prove(family: &PencilBox, budget: usize) -> BoxProof {
    prove_box(family, budget, &mut |_| {})
}

#[track_caller]
fn proven(family: &PencilBox, budget: usize) -> usize {
    match prove(family, budget) {
        BoxProof::Proven { cells } => cells,
        other => panic!("{other:?}"),
    }
}

#[track_caller]
fn undecided(family: &PencilBox, budget: usize) -> (usize, Pole) {
    match prove(family, budget) {
        BoxProof::Undecided { cells, at, .. } => (cells, at),
        proven => panic!("{proven:?} in spite of a loss"),
    }
}

/// Bounds of a parameter.
type Range = (Rational, Rational);

fn toleranced(value: Rational, tolerance: &Rational) -> Range {
    let change = value.times(tolerance);
    (value.minus(&change), value.plus(&change))
}

/// `[λ²H + λD + S, Cᵀ; C, 0; Fᵀ, 0]`, term by term.
struct System {
    shafts: usize,
    columns: usize,
    family: PencilBox,
}

const SPRING: usize = 0;
const DAMPER: usize = 1;
const INERTIA: usize = 2;

impl System {
    fn new(shafts: usize, constraints: usize, inputs: usize, parameters: usize) -> Self {
        let (rows, columns) = (shafts + constraints + inputs, shafts + constraints);
        let zeros = || [0; 3].map(|_| Matrix::zeros(rows, columns));
        let slopes = (0..parameters).map(|_| zeros()).collect();
        Self { shafts, columns, family: PencilBox { coefficients: zeros(), slopes } }
    }

    /// Adds `p · left rightᵀ` at a power of λ, where p is number `parameter` within `range`.
    fn outer(
        &mut self,
        power: usize,
        range: &Range,
        parameter: Option<usize>,
        left: &[(usize, i64)],
        right: &[(usize, i64)],
    ) {
        let half = ratio(1, 2);
        let (middle, width) = (range.0.plus(&range.1).times(&half), range.1.minus(&range.0).times(&half));
        let coefficients = &mut self.family.coefficients[power];
        let mut slope = parameter.map(|parameter| &mut self.family.slopes[parameter][power]);
        for &(i, a) in left {
            for &(j, b) in right {
                let share = Rational::from(a * b);
                coefficients[(i, j)] = coefficients[(i, j)].plus(&middle.times(&share));
                if let Some(slope) = &mut slope {
                    slope[(i, j)] = slope[(i, j)].plus(&width.times(&share));
                }
            }
        }
    }

    fn term(&mut self, power: usize, range: &Range, parameter: Option<usize>, direction: &[(usize, i64)]) {
        self.outer(power, range, parameter, direction, direction);
    }

    /// `q_a = γ q_b` as constraint number `index`.
    fn gear(&mut self, index: usize, a: usize, b: usize, range: &Range, parameter: Option<usize>) {
        let row = [(self.shafts + index, 1)];
        let one = (Rational::one(), Rational::one());
        for (left, right) in [(&row, &[(a, 1)]), (&[(a, 1)], &row)] {
            self.outer(0, &one, None, left, right);
        }
        for (left, right) in [(&row, &[(b, -1)]), (&[(b, -1)], &row)] {
            self.outer(0, range, parameter, left, right);
        }
    }

    /// Inertias `j`, a spring `s` between, dampers `d` between and to the ground: parameters 0, 1, 2 on shafts 0 and 1.
    fn bodies_of_appendix_b(&mut self, j: Range, s: Range, d: Range) {
        self.term(INERTIA, &j, Some(0), &[(0, 1)]);
        self.term(INERTIA, &j, Some(0), &[(1, 1)]);
        self.term(SPRING, &s, Some(1), &[(0, 1), (1, -1)]);
        self.term(DAMPER, &d, Some(2), &[(0, 1), (1, -1)]);
        self.term(DAMPER, &d, Some(2), &[(0, 1)]);
        self.term(DAMPER, &d, Some(2), &[(1, 1)]);
    }

    fn input(&mut self, index: usize, shaft: usize) {
        self.family.coefficients[0][(self.columns + index, shaft)] = Rational::one();
    }
}

/// Two equal bodies of appendix B: a loss exactly where `d² = sJ` or `s = 0`.
fn two_bodies(j: Range, s: Range, d: Range) -> PencilBox {
    let mut system = System::new(2, 0, 1, 3);
    system.bodies_of_appendix_b(j, s, d);
    system.input(0, 1);
    system.family
}

/// The same with a third body of inertia k geared to the first, `q₁ = γ q₃`: a loss where `d² = s (J + k/γ²)`.
fn geared_bodies(j: Range, s: Range, d: Range, k: Range, gamma: Range) -> PencilBox {
    let mut system = System::new(3, 1, 1, 5);
    system.bodies_of_appendix_b(j, s, d);
    system.term(INERTIA, &k, Some(3), &[(2, 1)]);
    system.gear(0, 0, 2, &gamma, Some(4));
    system.input(0, 1);
    system.family
}

fn range(a: (i64, i64), b: (i64, i64)) -> Range {
    (ratio(a.0, a.1), ratio(b.0, b.1))
}

#[test]
fn two_equal_bodies() {
    let tolerance = ratio(1, 5);
    let toleranced_bodies =
        |j, s, d| two_bodies(toleranced(j, &tolerance), toleranced(s, &tolerance), toleranced(d, &tolerance));
    assert!(proven(&toleranced_bodies(ratio(1, 1), ratio(2, 1), ratio(1, 2)), 1000) < 50);
    // The surface crosses the box.
    undecided(&toleranced_bodies(ratio(1, 1), ratio(1, 1), ratio(1, 1)), 100_000);
    undecided(&toleranced_bodies(ratio(1, 1), ratio(1, 1), ratio(5, 4)), 100_000);
    // From the other side it touches a corner, along d it crosses a segment.
    undecided(&two_bodies(range((1, 2), (1, 1)), range((1, 4), (1, 1)), range((1, 1), (3, 2))), 100_000);
    undecided(&two_bodies(range((1, 1), (1, 1)), range((1, 1), (1, 1)), range((1, 2), (3, 2))), 100_000);
    // s = 0.
    undecided(&two_bodies(range((1, 1), (2, 1)), range((0, 1), (1, 1)), range((2, 1), (3, 1))), 100_000);
}

#[test]
fn a_surface_that_touches_a_corner_is_found() {
    // Numbers exact in binary and others.
    for (a, b) in [(1, 1), (2, 3), (7, 5), (1, 1000), (12345, 7)] {
        let (j, s) = (range((1, 1), (3, 1)), range((a * a, b * b), (4 * a * a, b * b)));
        let (cells, at) = undecided(&two_bodies(j.clone(), s.clone(), range((a, 3 * b), (a, b))), 100_000);
        // The loss is at λ = −s/d; cells shrink towards it.
        let expected = -a as f64 / b as f64;
        assert!((at.re - expected).hypot(at.im) < 1e-5 * expected.abs(), "{at:?} instead of {expected}");
        assert!(cells < 2000, "{cells} cells");
        let (a, b) = (99 * a, 100 * b);
        proven(&two_bodies(j, s, range((a, 3 * b), (a, b))), 10_000);
    }
}

#[test]
fn boxes_close_to_the_surface_are_proven() {
    // The corner has d = (1 − gap) √(sJ).
    for (gap, most) in [(10i64, 50), (100, 200), (1000, 400), (10_000, 600), (100_000, 800), (1_000_000, 1000)] {
        let near = (ratio(9, 10), Rational::one().minus(&ratio(1, gap)));
        let family = two_bodies(range((1, 1), (11, 10)), range((1, 1), (11, 10)), near);
        proven(&family, most);
    }
}

#[test]
fn a_gear_ratio_with_a_tolerance() {
    let one = || range((1, 1), (3, 2));
    let family = |s: Range, d: Range| geared_bodies(one(), s, d, one(), range((1, 1), (2, 1)));
    // J + k/γ² from 5/4 to 3, so that s (J + k/γ²) is from 5/4 to 9/2.
    proven(&family(one(), range((1, 2), (1, 1))), 1000);
    proven(&family(one(), range((9, 4), (3, 1))), 1000);
    undecided(&family(one(), range((1, 2), (3, 2))), 10_000);
    undecided(&family(one(), range((1, 2), (3, 1))), 10_000);
    // Corners: J = k = 1, γ = 2, s = 5, d = 5/2; J = k = 3/2, γ = 1, s = 3, d = 3.
    let (_, at) = undecided(&family(range((5, 1), (6, 1)), range((1, 1), (5, 2))), 10_000);
    assert!((at.re + 2.0).hypot(at.im) < 1e-3, "{at:?}");
    let (_, at) = undecided(&family(range((2, 1), (3, 1)), range((3, 1), (4, 1))), 10_000);
    assert!((at.re + 1.0).hypot(at.im) < 1e-3, "{at:?}");
    proven(&family(range((5, 1), (6, 1)), range((1, 1), (249, 100))), 2000);
    proven(&family(range((2, 1), (3, 1)), range((301, 100), (4, 1))), 2000);
}

/// Numbers with real and imaginary part.
type Complex = (Rational, Rational);

fn times(a: &Complex, b: &Complex) -> Complex {
    (a.0.times(&b.0).minus(&a.1.times(&b.1)), a.0.times(&b.1).plus(&a.1.times(&b.0)))
}

fn part(random: &mut Random, density: u64) -> i64 {
    if random.below(100) < density { random.below(19) as i64 - 9 } else { 0 }
}

/// A family with `L(λ₀, x₀) v = 0`, exactly.
fn with_loss(random: &mut Random, lambda: &Complex, at: &[Rational], width: &Rational) -> PencilBox {
    let n = 1 + random.below(5) as usize;
    let m = n + random.below(4) as usize;
    let (dense, sparse) = (40 + random.below(60), 10 + random.below(60));
    let mut coefficients =
        [0; 3].map(|_| Matrix::from_fn(m, n, |_, _| ratio(part(random, dense), 1 + random.below(4) as i64)));
    let slopes: Vec<[Matrix<Rational>; 3]> = at
        .iter()
        .map(|_| {
            let only = random.below(4) as usize;
            std::array::from_fn(|k| {
                let rank_one = random.below(2) == 0;
                let left: Vec<i64> = (0..m).map(|_| part(random, sparse)).collect();
                let right: Vec<i64> = (0..n).map(|_| part(random, sparse)).collect();
                Matrix::from_fn(m, n, |i, j| {
                    let x = if rank_one { left[i] * right[j] } else { part(random, sparse) };
                    if only < 3 && only != k { Rational::zero() } else { ratio(x, 3).times(width) }
                })
            })
        })
        .collect();
    let chosen = random.below(n as u64) as usize;
    let real = lambda.1.is_zero();
    let vector: Vec<Complex> = (0..n)
        .map(|j| {
            let mut entry = || ratio(part(random, 70), 1 + random.below(5) as i64);
            let (re, im) = (entry(), entry());
            if j == chosen {
                (Rational::one(), Rational::zero())
            } else if real {
                (re, Rational::zero())
            } else {
                (re, im)
            }
        })
        .collect();
    let mut power = (Rational::one(), Rational::zero());
    let mut image = vec![(Rational::zero(), Rational::zero()); m];
    for k in 0..3 {
        let mut level = coefficients[k].clone();
        for (slope, x) in slopes.iter().zip(at) {
            level = level.plus(&slope[k].scale(x));
        }
        for i in 0..m {
            for j in 0..n {
                let term = times(&times(&power, &vector[j]), &(level[(i, j)].clone(), Rational::zero()));
                image[i] = (image[i].0.plus(&term.0), image[i].1.plus(&term.1));
            }
        }
        power = times(&power, lambda);
    }
    for i in 0..m {
        let slope = if real { Rational::zero() } else { image[i].1.over(&lambda.1) };
        let constant = image[i].0.minus(&lambda.0.times(&slope));
        coefficients[0][(i, chosen)] = coefficients[0][(i, chosen)].minus(&constant);
        coefficients[1][(i, chosen)] = coefficients[1][(i, chosen)].minus(&slope);
    }
    PencilBox { coefficients, slopes }
}

#[test]
fn a_loss_in_the_box_is_never_overlooked() {
    for seed in 0..2000 {
        let random = &mut Random::new(seed);
        let q = random.below(4) as usize;
        let at: Vec<Rational> = (0..q)
            .map(|_| match random.below(4) {
                0 => Rational::from(1),
                1 => Rational::from(-1),
                2 => ratio(random.below(17) as i64 - 8, 8),
                _ => ratio(random.below(201) as i64 - 100, 100),
            })
            .collect();
        let fraction = |random: &mut Random| ratio(random.below(201) as i64 - 100, 1 + random.below(60) as i64);
        let lambda = match random.below(8) {
            0 => (Rational::zero(), Rational::zero()),
            1 | 2 => (fraction(random), Rational::zero()),
            3 => (ratio(random.below(17) as i64 - 8, 8), ratio(1, 4)),
            4 => (Rational::from(1_000_000_000_000_i64), fraction(random)),
            _ => (fraction(random), fraction(random)),
        };
        let width = [ratio(1, 100), ratio(1, 10), ratio(1, 1)][random.below(3) as usize].clone();
        undecided(&with_loss(random, &lambda, &at, &width), 500);
    }
}

/// Bodies in a row, springs and dampers between neighbours and further apart, all with tolerances.
fn chain(n: usize, inputs: &[usize], parameters: usize, tolerance: &Rational, random: &mut Random) -> PencilBox {
    let mut system = System::new(n, 0, inputs.len(), parameters);
    let mut terms = Vec::new();
    for i in 0..n {
        terms.push((INERTIA, ratio(10 + random.below(20) as i64, 10), vec![(i, 1)]));
        if i + 1 < n {
            terms.push((SPRING, ratio(10 + random.below(40) as i64, 1), vec![(i, 1), (i + 1, -1)]));
            terms.push((DAMPER, ratio(1 + random.below(10) as i64, 10), vec![(i, 1), (i + 1, -1)]));
        }
    }
    terms.push((DAMPER, ratio(1, 5), vec![(0, 1)]));
    // Which of them have tolerances.
    for k in 0..terms.len() {
        let other = k + random.below((terms.len() - k) as u64) as usize;
        terms.swap(k, other);
    }
    for (k, (power, value, direction)) in terms.into_iter().enumerate() {
        let range = toleranced(value, tolerance);
        if k < parameters {
            system.term(power, &range, Some(k), &direction);
        } else {
            let middle = range.0.plus(&range.1).times(&ratio(1, 2));
            system.term(power, &(middle.clone(), middle), None, &direction);
        }
    }
    for (k, &shaft) in inputs.iter().enumerate() {
        system.input(k, shaft);
    }
    system.family
}

/// L at λ and x in floating point.
fn level(family: &PencilBox, lambda: c64, x: &[f64]) -> Mat<c64> {
    let of = &family.coefficients[0];
    Mat::from_fn(of.rows(), of.columns(), |i, j| {
        let mut sum = c64::new(0.0, 0.0);
        for k in (0..3).rev() {
            let slopes = family.slopes.iter().zip(x).map(|(slope, x)| x * rational_to_f64(&slope[k][(i, j)]));
            sum = sum * lambda + rational_to_f64(&family.coefficients[k][(i, j)]) + slopes.sum::<f64>();
        }
        sum
    })
}

/// Smallest singular value of L at the poles of its upper square block, `[λ²H + λD + S; Fᵀ]`, least over samples of x.
fn scan(family: &PencilBox, samples: usize, random: &mut Random) -> f64 {
    let n = family.coefficients[0].columns();
    let mut least = f64::INFINITY;
    for _ in 0..samples {
        let x: Vec<f64> = family
            .slopes
            .iter()
            .map(|_| [-1.0, 1.0, random.below(2001) as f64 / 1000.0 - 1.0][random.below(3) as usize])
            .collect();
        let real = |k: usize| {
            let at = |k: usize, i: usize, j: usize| {
                let slopes = family.slopes.iter().zip(&x).map(|(slope, x)| x * rational_to_f64(&slope[k][(i, j)]));
                rational_to_f64(&family.coefficients[k][(i, j)]) + slopes.sum::<f64>()
            };
            Matrix::from_fn(n, n, |i, j| at(k, i, j))
        };
        let (h, d, s) = (real(2), real(1), real(0));
        let (a, b) = (h.solve(&s).unwrap(), h.solve(&d).unwrap());
        let state = Matrix::from_fn(2 * n, 2 * n, |i, j| match (i < n, j < n) {
            (true, true) => 0.0,
            (true, false) => f64::from(u8::from(j - n == i)),
            (false, true) => -a[(i - n, j)],
            (false, false) => -b[(i - n, j - n)],
        });
        for (re, im) in kardan::num::eigenvalues(&state).unwrap() {
            let level = level(family, c64::new(re, im), &x);
            least = least.min(*level.singular_values().unwrap().last().unwrap());
        }
    }
    least
}

#[test]
fn chains_are_proven_and_a_scan_agrees() {
    let random = &mut Random::new(5);
    for (n, inputs, parameters, tolerance) in [
        (2, vec![0], 3, (1, 10)),
        (3, vec![2], 5, (1, 10)),
        (5, vec![0], 6, (1, 10)),
        (5, vec![0], 14, (1, 10)),
        (5, vec![1, 3], 6, (1, 10)),
        (5, vec![0, 4], 14, (1, 10)),
        (5, vec![0, 2, 4], 6, (1, 4)),
        (7, vec![0, 3], 10, (1, 20)),
    ] {
        for _ in 0..3 {
            let family = chain(n, &inputs, parameters, &ratio(tolerance.0, tolerance.1), random);
            let cells = proven(&family, 1000);
            assert!(cells < 200, "{cells} cells for {n} bodies, {parameters} parameters");
            let least = scan(&family, 10, random);
            assert!(least > 1e-4, "{least:e} in spite of a proof");
        }
    }
}

/// Two bodies with the same `s/J` on one driven body: a loss where `s₁ J₂ = s₂ J₁`.
fn star(branches: &[Rational], tolerance: &Rational) -> PencilBox {
    let k = branches.len();
    let mut system = System::new(k + 1, 0, 1, 2 * k + 1);
    system.term(INERTIA, &toleranced(ratio(1, 1), tolerance), Some(2 * k), &[(0, 1)]);
    for (i, stiffness) in branches.iter().enumerate() {
        system.term(INERTIA, &toleranced(ratio(1, 1), tolerance), Some(2 * i), &[(i + 1, 1)]);
        system.term(SPRING, &toleranced(stiffness.clone(), tolerance), Some(2 * i + 1), &[(0, 1), (i + 1, -1)]);
    }
    system.input(0, 0);
    system.family
}

#[test]
fn branches_are_distinguished() {
    // 11/9 squared is 1.49: frequencies that meet at ±10 % only where their ratio is below.
    let branches = [ratio(1, 1), ratio(3, 2), ratio(9, 4), ratio(27, 8)];
    proven(&star(&branches, &ratio(9, 100)), 2000);
    proven(&star(&branches, &ratio(1, 10)), 20_000);
    undecided(&star(&branches, &ratio(11, 100)), 2000);
    // At J₁ = s₂ = 9/10 and J₂ = s₁ = 11/10 exactly, in a corner of the box; undamped, at λ = ±j √(11/9).
    let (_, at) = undecided(&star(&[ratio(1, 1), ratio(121, 81)], &ratio(1, 10)), 100_000);
    assert!(at.re.hypot(at.im - (11f64 / 9.0).sqrt()) < 1e-2, "{at:?}");
}

#[test]
fn gear_trains_are_proven() {
    // Motor, gear, spring and damper, gear, ..., with tolerances: two shafts and four parameters per stage.
    for stages in 1..=3 {
        let tolerance = ratio(1, 10);
        let about = |a, b| toleranced(ratio(a, b), &tolerance);
        let exactly = |x: Rational| (x.clone(), x);
        let mut system = System::new(2 * stages, stages, 1, 4 * stages);
        for k in 0..stages {
            let (a, b, first) = (2 * k, 2 * k + 1, 4 * k);
            system.term(INERTIA, &about(1, 10), Some(first), &[(a, 1)]);
            system.term(INERTIA, &about(2, 1), Some(first + 1), &[(b, 1)]);
            system.gear(k, a, b, &about(5, 1), Some(first + 2));
            if k > 0 {
                system.term(SPRING, &about(30, 1), Some(first + 3), &[(a - 1, 1), (a, -1)]);
                system.term(DAMPER, &exactly(ratio(1, 20)), None, &[(a - 1, 1), (a, -1)]);
            } else {
                system.term(DAMPER, &about(1, 5), Some(first + 3), &[(b, 1)]);
            }
        }
        system.input(0, 0);
        proven(&system.family, 1000);
        // Without the input everything is lost.
        system.family.coefficients[0][(3 * stages, 0)] = Rational::zero();
        undecided(&system.family, 1000);
    }
}

fn power_of_ten(power: i64) -> Rational {
    let power_of = |n: u64| (0..n).fold(Rational::one(), |x, _| x.times(&Rational::from(10)));
    if power < 0 { Rational::one().over(&power_of(power.unsigned_abs())) } else { power_of(power as u64) }
}

/// Rows, columns and λ in units that are powers of ten, up to `10^±most`.
fn in_other_units(family: &PencilBox, most: u64, random: &mut Random) -> PencilBox {
    let of = &family.coefficients[0];
    let mut power = || random.below(2 * most + 1) as i64 - most as i64;
    let rows: Vec<i64> = (0..of.rows()).map(|_| power()).collect();
    let columns: Vec<i64> = (0..of.columns()).map(|_| power()).collect();
    let unit = power();
    let scaled = |part: &[Matrix<Rational>; 3]| {
        std::array::from_fn(|k| {
            Matrix::from_fn(of.rows(), of.columns(), |i, j| {
                part[k][(i, j)].times(&power_of_ten(rows[i] + columns[j] + unit * k as i64))
            })
        })
    };
    PencilBox { coefficients: scaled(&family.coefficients), slopes: family.slopes.iter().map(scaled).collect() }
}

#[test]
fn units_and_the_order_of_rows_do_not_matter() {
    let random = &mut Random::new(3);
    let chain = chain(4, &[0], 6, &ratio(1, 10), random);
    let one = || range((1, 1), (3, 2));
    let geared = |d| geared_bodies(one(), one(), d, one(), range((1, 1), (2, 1)));
    for most in [0, 1, 3, 10, 30] {
        for _ in 0..5 {
            proven(&in_other_units(&chain, most, random), 2000);
            proven(&in_other_units(&geared(range((1, 2), (1, 1))), most, random), 2000);
            undecided(&in_other_units(&geared(range((1, 2), (3, 2))), most, random), 2000);
            let corner = two_bodies(one(), one(), range((1, 2), (1, 1)));
            undecided(&in_other_units(&corner, most, random), 2000);
        }
    }
    let reversed = |part: &[Matrix<Rational>; 3]| {
        part.each_ref().map(|matrix| {
            let rows = matrix.rows();
            Matrix::from_fn(rows, matrix.columns(), |i, j| matrix[(rows - 1 - i, j)].clone())
        })
    };
    let reversed =
        PencilBox { coefficients: reversed(&chain.coefficients), slopes: chain.slopes.iter().map(reversed).collect() };
    proven(&reversed, 2000);
}

fn constant(rows: &[&[i64]]) -> Matrix<Rational> {
    Matrix::from_fn(rows.len(), rows.first().map_or(0, |row| row.len()), |i, j| Rational::from(rows[i][j]))
}

fn constant_pencil(s: &[&[i64]], d: &[&[i64]], h: &[&[i64]]) -> PencilBox {
    PencilBox { coefficients: [constant(s), constant(d), constant(h)], slopes: Vec::new() }
}

#[test]
fn nothing_to_decide_or_nothing_to_prove() {
    let empty = |m, n| PencilBox { coefficients: [0; 3].map(|_| Matrix::zeros(m, n)), slopes: Vec::new() };
    assert_eq!(proven(&empty(0, 0), 0), 0);
    assert_eq!(proven(&empty(3, 0), 0), 0);
    assert_eq!(undecided(&empty(0, 2), 100).0, 0);
    assert_eq!(undecided(&empty(4, 2), 100).0, 0);
    // Constant matrices.
    assert_eq!(proven(&constant_pencil(&[&[1, 2], &[3, 4]], &[&[0, 0], &[0, 0]], &[&[0, 0], &[0, 0]]), 0), 0);
    assert_eq!(undecided(&constant_pencil(&[&[1, 2], &[2, 4]], &[&[0, 0], &[0, 0]], &[&[0, 0], &[0, 0]]), 0).0, 0);
    // λ² + 1 alone, with λ, with 1, with λ² − 1, with λ² + λ + 1, with (λ² + 1)(1, 2).
    undecided(&constant_pencil(&[&[1]], &[&[0]], &[&[1]]), 1000);
    proven(&constant_pencil(&[&[1], &[0]], &[&[0], &[1]], &[&[1], &[0]]), 100);
    assert_eq!(proven(&constant_pencil(&[&[1], &[1]], &[&[0], &[0]], &[&[1], &[0]]), 0), 0);
    proven(&constant_pencil(&[&[1], &[-1]], &[&[0], &[0]], &[&[1], &[1]]), 100);
    proven(&constant_pencil(&[&[1], &[1]], &[&[0], &[1]], &[&[1], &[1]]), 100);
    undecided(&constant_pencil(&[&[1], &[2]], &[&[0], &[0]], &[&[1], &[2]]), 1000);
    // More columns than rows.
    undecided(&constant_pencil(&[&[1, 1]], &[&[1, 0]], &[&[1, 0]]), 1000);
    // No budget.
    assert_eq!(undecided(&constant_pencil(&[&[1], &[0]], &[&[0], &[1]], &[&[1], &[0]]), 0).0, 0);
}

#[test]
fn dependent_everywhere_or_at_infinity() {
    // Equal columns.
    let equal =
        constant_pencil(&[&[1, 1], &[2, 2], &[0, 0]], &[&[0, 0], &[1, 1], &[3, 3]], &[&[1, 1], &[0, 0], &[0, 0]]);
    assert!(undecided(&equal, 100_000).0 < 100);
    // A column that is λ times another one, and one of zeros.
    let multiple =
        constant_pencil(&[&[1, 0], &[2, 0], &[0, 0]], &[&[3, 1], &[1, 2], &[5, 0]], &[&[0, 3], &[0, 1], &[0, 5]]);
    assert!(undecided(&multiple, 100_000).0 < 100);
    assert!(
        undecided(&constant_pencil(&[&[1, 0], &[0, 0]], &[&[0, 0], &[1, 0]], &[&[1, 0], &[0, 0]]), 100_000).0 < 100
    );
    // The inertias are singular on the kernel of F: the leading columns are dependent, a loss at infinity.
    let ones = [1, 1, 1];
    let singular = constant_pencil(
        &[&[2, -1, 0], &[-1, 3, 1], &[0, 1, 5], &[1, 0, 0]],
        &[&[1, 0, 0], &[0, 1, 0], &[0, 0, 1], &[0, 0, 0]],
        &[&ones, &ones, &ones, &[0, 0, 0]],
    );
    let (cells, at) = undecided(&singular, 100_000);
    assert!(cells < 2000 && at.re.hypot(at.im) > 1e6, "{cells} cells, {at:?}");
    // Massless motions are fine otherwise: with a damper, and with a spring.
    let massless = |damper: i64| {
        constant_pencil(
            &[&[2, -1, -1], &[-1, 3, 0], &[-1, 0, 4], &[1, 0, 0]],
            &[&[1, -damper, 0], &[-damper, damper, 0], &[0, 0, 1], &[0, 0, 0]],
            &[&[1, 0, 0], &[0, 0, 0], &[0, 0, 1], &[0, 0, 0]],
        )
    };
    proven(&massless(1), 1000);
    proven(&massless(0), 1000);
    // An inertia that may vanish: a loss where J = −1 at λ = −1, not at J = 0 thanks to the damper.
    let vanishing = |least| {
        let mut system = System::new(2, 0, 1, 1);
        system.term(INERTIA, &(least, Rational::one()), Some(0), &[(0, 1)]);
        system.term(INERTIA, &range((1, 1), (1, 1)), None, &[(1, 1)]);
        system.term(SPRING, &range((1, 1), (1, 1)), None, &[(0, 1), (1, -1)]);
        system.term(SPRING, &range((1, 1), (1, 1)), None, &[(0, 1)]);
        system.term(DAMPER, &range((1, 1), (1, 1)), None, &[(0, 1), (1, -1)]);
        system.input(0, 1);
        system.family
    };
    assert!(undecided(&vanishing(ratio(-1, 1)), 100_000).0 < 2000);
    proven(&vanishing(ratio(-99, 100)), 2000);
    proven(&vanishing(ratio(0, 1)), 2000);
}

#[test]
fn progress_rises_to_one() {
    let family = star(&[ratio(1, 1), ratio(3, 2), ratio(9, 4)], &ratio(9, 100));
    let mut fractions = vec![0.0];
    let proof = prove_box(&family, 2000, &mut |done| {
        assert!(done >= *fractions.last().unwrap() && done <= 1.0);
        fractions.push(done);
    });
    assert!(fractions.len() > 2 && fractions.last() == Some(&1.0));
    assert_eq!(proof, prove(&family, 2000));
    // The budget is kept.
    let BoxProof::Proven { cells } = proof else { panic!("{proof:?}") };
    assert_eq!(undecided(&family, cells - 1).0, cells - 1);
}
