//! Standing trials of the exact analysis: random systems with planted structure, through the public functions that
//! `kardan analyze` calls, against plain elimination over the fractions that shares nothing with the library.
//!
//! Planted are repeated and nearly repeated eigenvalues, Jordan blocks, unreached and unseen parts, similarities with whole
//! numbers and fractions, scales of 10^±12, and numbers that are multiples of primes.

use dashu_int::ops::Gcd;
use dashu_int::{IBig, UBig};
use dashu_ratio::RBig;
use kardan::results::{Analysis, Mode, Pole, Undecided};
use kardan::study::{self, AnalyzeSettings, Silent};
use serde_json::{Value, json};

type Matrix = Vec<Vec<RBig>>;
/// Coefficients of 1, s, s², …
type Poly = Vec<RBig>;

// ---- an independent exact implementation --------------------------------------------------------------------------

fn int(x: i64) -> RBig {
    RBig::from(x)
}

fn zeros(rows: usize, columns: usize) -> Matrix {
    vec![vec![RBig::ZERO; columns]; rows]
}

fn identity(n: usize) -> Matrix {
    (0..n).map(|i| (0..n).map(|j| int(i64::from(i == j))).collect()).collect()
}

fn times(a: &Matrix, b: &Matrix) -> Matrix {
    let columns = b.first().map_or(0, Vec::len);
    let entry = |row: &Vec<RBig>, j: usize| {
        row.iter().zip(b).filter(|(x, _)| !x.is_zero()).fold(RBig::ZERO, |sum, (x, other)| sum + x * &other[j])
    };
    a.iter().map(|row| (0..columns).map(|j| entry(row, j)).collect()).collect()
}

fn plus(a: &Matrix, factor: &RBig, b: &Matrix) -> Matrix {
    a.iter().zip(b).map(|(a, b)| a.iter().zip(b).map(|(x, y)| x + factor * y).collect()).collect()
}

fn transpose(a: &Matrix, columns: usize) -> Matrix {
    (0..columns).map(|j| a.iter().map(|row| row[j].clone()).collect()).collect()
}

/// Side by side.
fn beside(parts: &[&Matrix], rows: usize) -> Matrix {
    (0..rows).map(|i| parts.iter().flat_map(|part| part[i].clone()).collect()).collect()
}

/// Rows as whole numbers.
fn cleared(a: &Matrix) -> Vec<Vec<IBig>> {
    let row = |row: &Vec<RBig>| {
        let common = row.iter().fold(UBig::ONE, |all, x| {
            let shared = (&all).gcd(x.denominator());
            all / shared * x.denominator()
        });
        row.iter().map(|x| x.numerator() * IBig::from(&common / x.denominator())).collect()
    };
    a.iter().map(row).collect()
}

/// Elimination without fractions (Bareiss): the rank, and the determinant of the rows cleared of denominators if square.
fn bareiss(a: &Matrix) -> (usize, IBig) {
    let mut m = cleared(a);
    let (rows, columns) = (m.len(), m.first().map_or(0, Vec::len));
    let (mut rank, mut last, mut sign) = (0, IBig::ONE, false);
    for column in 0..columns {
        let Some(pivot) = (rank..rows).find(|&i| m[i][column] != IBig::ZERO) else { continue };
        if pivot != rank {
            m.swap(pivot, rank);
            sign = !sign;
        }
        let (above, below) = m.split_at_mut(rank + 1);
        let lead = &above[rank];
        for row in below {
            let factor = row[column].clone();
            for j in 0..columns {
                row[j] = (&lead[column] * &row[j] - &factor * &lead[j]) / &last;
            }
        }
        last = m[rank][column].clone();
        rank += 1;
        if rank == rows {
            break;
        }
    }
    let determinant = if rank == rows && rank == columns { last } else { IBig::ZERO };
    (rank, if sign { -determinant } else { determinant })
}

fn rank(a: &Matrix) -> usize {
    bareiss(a).0
}

fn determinant(a: &Matrix) -> RBig {
    let scale = a.iter().zip(cleared(a)).fold(RBig::ONE, |all, (row, whole)| {
        let k = row.iter().position(|x| !x.is_zero());
        all * k.map_or(RBig::ONE, |k| RBig::from(whole[k].clone()) / &row[k])
    });
    RBig::from(bareiss(a).1) / scale
}

/// `[B, AB, …, Aⁿ⁻¹B]`.
fn krylov(a: &Matrix, b: &Matrix) -> Matrix {
    let n = a.len();
    let mut parts = vec![b.clone()];
    (1..n).for_each(|k| parts.push(times(a, &parts[k - 1])));
    beside(&parts.iter().collect::<Vec<_>>(), n)
}

/// det(sI − A) after Faddeev and Le Verrier.
fn characteristic(a: &Matrix) -> Poly {
    let n = a.len();
    let mut out = vec![RBig::ZERO; n + 1];
    out[n] = RBig::ONE;
    let mut m = zeros(n, n);
    for k in 1..=n {
        m = plus(&times(a, &m), &out[n - k + 1], &identity(n));
        let product = times(a, &m);
        let trace = (0..n).fold(RBig::ZERO, |sum, i| sum + &product[i][i]);
        out[n - k] = -trace / int(k as i64);
    }
    out
}

fn poly_times(a: &Poly, b: &Poly) -> Poly {
    let mut out = vec![RBig::ZERO; a.len() + b.len() - 1];
    for (i, x) in a.iter().enumerate() {
        for (j, y) in b.iter().enumerate() {
            out[i + j] = &out[i + j] + x * y;
        }
    }
    out
}

fn power(a: &Poly, exponent: usize) -> Poly {
    (0..exponent).fold(vec![RBig::ONE], |all, _| poly_times(&all, a))
}

fn trimmed(mut p: Poly) -> Poly {
    while p.last().is_some_and(RBig::is_zero) {
        p.pop();
    }
    p
}

fn monic(p: &Poly) -> Poly {
    let p = trimmed(p.clone());
    let Some(leading) = p.last().cloned() else { return p };
    p.iter().map(|x| x / &leading).collect()
}

fn poly_gcd(a: &Poly, b: &Poly) -> Poly {
    let (mut a, mut b) = (monic(a), monic(b));
    while !b.is_empty() {
        let mut remainder = a.clone();
        while remainder.len() >= b.len() {
            let (shift, factor) = (remainder.len() - b.len(), remainder[remainder.len() - 1].clone());
            for (k, x) in b.iter().enumerate() {
                remainder[shift + k] = &remainder[shift + k] - &factor * x;
            }
            remainder = trimmed(remainder);
        }
        (a, b) = (b, monic(&remainder));
    }
    a
}

/// f(A), Horner.
fn value_at_matrix(f: &Poly, a: &Matrix) -> Matrix {
    let n = a.len();
    f.iter().rev().fold(zeros(n, n), |sum, c| plus(&times(&sum, a), c, &identity(n)))
}

/// The polynomial of degree below the number of points with these values at 0, 1, 2, … (Newton).
fn interpolated(values: &[RBig]) -> Poly {
    let mut differences = values.to_vec();
    for k in 1..values.len() {
        for i in (k..values.len()).rev() {
            differences[i] = (&differences[i] - &differences[i - 1]) / int(k as i64);
        }
    }
    let mut out = vec![RBig::ZERO; values.len()];
    let mut basis = vec![RBig::ONE];
    for (k, c) in differences.iter().enumerate() {
        basis.iter().enumerate().for_each(|(i, x)| out[i] = &out[i] + c * x);
        basis = poly_times(&basis, &vec![int(-(k as i64)), RBig::ONE]);
    }
    trimmed(out)
}

/// All choices of k out of n.
fn choices(n: usize, k: usize) -> Vec<Vec<usize>> {
    if k == 0 {
        return vec![Vec::new()];
    }
    let with_last = |last: usize| {
        choices(last, k - 1).into_iter().map(move |mut set| {
            set.push(last);
            set
        })
    };
    (k - 1..n).flat_map(with_last).collect()
}

/// A system `ẋ = A x + B u`, `y = C x + D u`.
#[derive(Debug, Clone)]
struct System {
    a: Matrix,
    b: Matrix,
    c: Matrix,
    d: Matrix,
}

impl System {
    fn inputs(&self) -> usize {
        self.b[0].len()
    }

    /// `[sI − A, −B; C, D]` at a number.
    fn pencil(&self, s: i64) -> Matrix {
        let n = self.a.len();
        let top = |i: usize| {
            let left = (0..n).map(|j| int(s * i64::from(i == j)) - &self.a[i][j]);
            left.chain(self.b[i].iter().map(|x| -x)).collect()
        };
        let bottom = self.c.iter().zip(&self.d).map(|(c, d)| [&c[..], d].concat());
        (0..n).map(top).chain(bottom).collect()
    }

    /// Rank over the rational functions, and the greatest common divisor of all minors of that order, monic: its roots are
    /// the invariant zeros.
    fn zeros(&self) -> (usize, Poly) {
        let n = self.a.len();
        let points: Vec<Matrix> = (0..=n as i64).map(|s| self.pencil(s)).collect();
        // A minor has at most n roots, so at one of n + 1 points the rank is the normal one.
        let normal = points.iter().map(rank).max().unwrap_or(0);
        let (rows, columns) = (n + self.c.len(), n + self.inputs());
        let mut common: Poly = Vec::new();
        for chosen_rows in choices(rows, normal) {
            for chosen in choices(columns, normal) {
                let minor = |m: &Matrix| {
                    determinant(
                        &chosen_rows.iter().map(|&i| chosen.iter().map(|&j| m[i][j].clone()).collect()).collect(),
                    )
                };
                common = poly_gcd(&common, &interpolated(&points.iter().map(minor).collect::<Vec<_>>()));
                if common.len() == 1 {
                    return (normal, common);
                }
            }
        }
        (normal, common)
    }

    /// Of every pair of output and input.
    fn relative_degrees(&self) -> Vec<Vec<Option<usize>>> {
        let n = self.a.len();
        let mut markov = vec![self.d.clone()];
        let mut power = self.b.clone();
        for _ in 0..n {
            markov.push(times(&self.c, &power));
            power = times(&self.a, &power);
        }
        let degree = |i: usize, j: usize| markov.iter().position(|m| !m[i][j].is_zero());
        (0..self.c.len()).map(|i| (0..self.inputs()).map(|j| degree(i, j)).collect()).collect()
    }

    fn json(&self, e: Option<&Matrix>) -> Value {
        let reported = |m: &Matrix| -> Value {
            m.iter().map(|row| row.iter().map(ToString::to_string).collect::<Vec<_>>()).collect::<Vec<_>>().into()
        };
        let mut out = json!({ "A": reported(&self.a) });
        let (driven, shown) = (self.inputs() > 0, !self.c.is_empty());
        for (key, matrix, present) in [("B", &self.b, driven), ("C", &self.c, shown), ("D", &self.d, driven && shown)] {
            if present {
                out[key] = reported(matrix);
            }
        }
        if let Some(e) = e {
            out["E"] = reported(e);
            out["A"] = reported(&times(e, &self.a));
            if driven {
                out["B"] = reported(&times(e, &self.b));
            }
        }
        out
    }
}

/// `s^3 - 3/2 s + 2` as coefficients.
fn read(text: &str) -> Poly {
    let mut out: Poly = Vec::new();
    let spaced = text.replace("- ", "-").replace("+ ", "");
    let mut tokens = spaced.split(' ').peekable();
    while let Some(token) = tokens.next() {
        let is_power = |token: &str| token.trim_start_matches('-').starts_with('s');
        let (factor, of) = if is_power(token) {
            (if token.starts_with('-') { "-1" } else { "1" }, token.trim_start_matches('-'))
        } else if tokens.peek().is_some_and(|next| next.starts_with('s')) {
            (token, tokens.next().unwrap())
        } else {
            (token, "")
        };
        let exponent = match of {
            "" => 0,
            "s" => 1,
            of => of.strip_prefix("s^").unwrap().parse().unwrap(),
        };
        out.resize(out.len().max(exponent + 1), RBig::ZERO);
        out[exponent] = &out[exponent] + factor.parse::<RBig>().unwrap_or_else(|_| panic!("{factor} in {text}"));
    }
    out
}

// ---- random systems -----------------------------------------------------------------------------------------------

struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0 >> 33
    }

    fn whole(&mut self, low: i64, high: i64) -> i64 {
        low + (self.next() % (high - low + 1) as u64) as i64
    }

    fn pick<'a, T>(&mut self, all: &'a [T]) -> &'a T {
        &all[self.next() as usize % all.len()]
    }
}

/// Primes that the analysis once used for every system: the largest ones below 2⁶¹, and those that its seeds drew.
fn notorious() -> Vec<u64> {
    let seeds = [1, 3].map(kardan::num::Random::new);
    let drawn = seeds
        .into_iter()
        .flat_map(|mut random| (0..4).map(|_| kardan::num::random_prime(&mut random)).collect::<Vec<_>>());
    drawn.chain([(1 << 61) - 1, (1 << 61) - 31, (1 << 61) - 229]).collect()
}

fn ten_to(exponent: i32) -> RBig {
    let size = RBig::from(UBig::from(10u8).pow(exponent.unsigned_abs() as usize));
    if exponent < 0 { RBig::ONE / size } else { size }
}

/// Numbers that eigenvalues and entries are made of.
fn numbers(dice: &mut Dice, primes: &[u64]) -> Vec<RBig> {
    let near = int(dice.whole(-3, 3)) + ten_to(-dice.whole(12, 30) as i32);
    let prime = RBig::from(*dice.pick(primes));
    let product = primes.iter().fold(RBig::ONE, |all, &p| all * RBig::from(p));
    let small = int(dice.whole(-3, 3));
    let kinds = [
        vec![RBig::ZERO, small.clone(), int(dice.whole(-3, 3))],
        vec![small.clone(), near, RBig::ZERO],
        vec![small.clone(), &small + &prime, prime],
        vec![RBig::ZERO, product],
        vec![small.clone() * ten_to(12), small * ten_to(-12), RBig::ZERO],
        vec![int(-1) / int(3), int(2) / int(7)],
    ];
    dice.pick(&kinds).clone()
}

/// Jordan and companion blocks, hidden by a similarity; some parts are not driven or not measured.
fn random_system(dice: &mut Dice, primes: &[u64]) -> System {
    let n = dice.whole(1, 5) as usize;
    let values = numbers(dice, primes);
    let mut a = zeros(n, n);
    let mut begins = Vec::new();
    let mut at = 0;
    while at < n {
        begins.push(at);
        let size = (dice.whole(1, 3) as usize).min(n - at);
        if size == 2 && dice.whole(0, 1) == 0 {
            // s² + p s + q
            a[at][at + 1] = RBig::ONE;
            a[at + 1][at] = dice.pick(&values).clone();
            a[at + 1][at + 1] = dice.pick(&values).clone();
        } else {
            let value = dice.pick(&values).clone();
            for k in at..at + size {
                a[k][k] = value.clone();
                if k + 1 < at + size {
                    a[k][k + 1] = RBig::ONE;
                }
            }
        }
        at += size;
    }
    let (m, p) = (dice.whole(0, 2) as usize, dice.whole(0, 2) as usize);
    let entry = |dice: &mut Dice| match dice.whole(0, 4) {
        0 => dice.pick(&values).clone(),
        1 => int(dice.whole(-2, 2)),
        2 => RBig::from(*dice.pick(primes)),
        _ => RBig::ZERO,
    };
    let matrix = |rows: usize, columns: usize, dice: &mut Dice| -> Matrix {
        (0..rows).map(|_| (0..columns).map(|_| entry(dice)).collect()).collect()
    };
    let (mut b, mut c) = (matrix(n, m, dice), matrix(p, n, dice));
    let d = if dice.whole(0, 3) == 0 { matrix(p, m, dice) } else { zeros(p, m) };
    // T x: elementary steps, each with its inverse, and scales.
    for _ in 0..dice.whole(0, 2 * n as i64) {
        let (i, j) = (dice.whole(0, n as i64 - 1) as usize, dice.whole(0, n as i64 - 1) as usize);
        let factor = match dice.whole(0, 5) {
            0 => int(1) / int(dice.whole(2, 5)),
            1 => ten_to(dice.whole(-12, 12) as i32),
            _ => int(dice.whole(-2, 2)),
        };
        if i == j {
            if !factor.is_zero() {
                for m in [&mut a, &mut b] {
                    m[i].iter_mut().for_each(|x| *x = &*x * &factor);
                }
                for row in a.iter_mut().chain(&mut c) {
                    row[i] = &row[i] / &factor;
                }
            }
            continue;
        }
        for m in [&mut a, &mut b] {
            let other = m[j].clone();
            m[i].iter_mut().zip(&other).for_each(|(x, y)| *x = &*x + &factor * y);
        }
        for row in a.iter_mut().chain(&mut c) {
            row[j] = &row[j] - &factor * &row[i];
        }
    }
    System { a, b, c, d }
}

/// A matrix with determinant one.
fn unimodular(n: usize, dice: &mut Dice) -> Matrix {
    let mut out = identity(n);
    for _ in 0..2 * n {
        let (i, j) = (dice.whole(0, n as i64 - 1) as usize, dice.whole(0, n as i64 - 1) as usize);
        if i != j {
            let (factor, other) = (int(dice.whole(-2, 2)), out[j].clone());
            out[i].iter_mut().zip(&other).for_each(|(x, y)| *x = &*x + &factor * y);
        }
    }
    out
}

// ---- comparison ---------------------------------------------------------------------------------------------------

fn analyse(text: &str, certify: bool) -> Analysis {
    let settings = AnalyzeSettings { certify, ..AnalyzeSettings::default() };
    study::analyze_state_space(text.as_bytes(), &settings, &Silent)
        .unwrap_or_else(|diagnostics| panic!("{text}: {diagnostics:?}"))
}

fn roots(modes: &[Mode]) -> usize {
    modes.iter().map(|mode| if mode.eigenvalue.im == 0.0 { 1 } else { 2 }).sum()
}

/// The modes are as many as the states; the zeros among them are those of χ; each belongs to a factor that says how often.
fn check_modes(found: &Analysis, chi: &Poly, at: &str) {
    let n = chi.len() - 1;
    assert_eq!(roots(&found.modes), n, "{at}: {:?}", found.modes);
    let zero = chi.iter().take_while(|x| x.is_zero()).count();
    let at_zero: Vec<&Mode> = found.modes.iter().filter(|mode| mode.factor == "s").collect();
    assert_eq!(at_zero.len(), zero, "{at}: {:?}", found.modes);
    assert!(at_zero.iter().all(|mode| mode.eigenvalue == Pole::default()), "{at}: {:?}", found.modes);
    for factor in &found.structure.factors {
        let of: Vec<Mode> = found.modes.iter().filter(|mode| mode.factor == factor.polynomial).cloned().collect();
        assert_eq!(roots(&of), factor.algebraic * factor.roots.len(), "{at}: {}", factor.polynomial);
        assert!(of.iter().all(|mode| mode.controllable == (factor.input_defect == 0)), "{at}");
        assert!(of.iter().all(|mode| mode.observable == (factor.output_defect == 0)), "{at}");
    }
}

/// Everything that is exact, against the implementation above.
fn check(system: &System, found: &Analysis, at: &str) {
    let n = system.a.len();
    let structure = &found.structure;
    let (transposed, outputs) = (transpose(&system.a, n), transpose(&system.c, n));
    assert_eq!(structure.controllable_rank, rank(&krylov(&system.a, &system.b)), "controllability of {at}");
    assert_eq!(structure.observable_rank, rank(&krylov(&transposed, &outputs)), "observability of {at}");
    let chi = characteristic(&system.a);
    check_modes(found, &chi, at);
    let product = structure
        .factors
        .iter()
        .fold(vec![RBig::ONE], |all, factor| poly_times(&all, &power(&read(&factor.polynomial), factor.algebraic)));
    assert_eq!(product, chi, "factors of {at}");
    let invariant = structure.invariant_factors.iter().fold(vec![RBig::ONE], |all, f| poly_times(&all, &read(f)));
    assert_eq!(invariant, chi, "invariant factors of {at}");
    let least = structure.invariant_factors.last().map(|f| value_at_matrix(&read(f), &system.a));
    assert_eq!(least, Some(zeros(n, n)), "the largest one annihilates: {at}");
    let mut largest = 0;
    for factor in &structure.factors {
        let f = read(&factor.polynomial);
        let degree = f.len() - 1;
        let value = value_at_matrix(&f, &system.a);
        assert_eq!(n - rank(&value), degree * factor.geometric, "eigenvectors of {} in {at}", factor.polynomial);
        largest = largest.max(factor.geometric);
        // Left vectors w with w f(A) = 0 and w AᵏB = 0: the eigenvectors that no input reaches, for all roots of f.
        let missed = |a: &Matrix, value: &Matrix, b: &Matrix| {
            let mut parts = vec![value.clone(), b.clone()];
            (1..degree).for_each(|k| parts.push(times(a, &parts[k])));
            n - rank(&beside(&parts.iter().collect::<Vec<_>>(), n))
        };
        let inputs = missed(&system.a, &value, &system.b);
        assert_eq!(inputs, degree * factor.input_defect, "inputs at {} in {at}", factor.polynomial);
        let shown = missed(&transposed, &transpose(&value, n), &outputs);
        assert_eq!(shown, degree * factor.output_defect, "outputs at {} in {at}", factor.polynomial);
    }
    assert_eq!((structure.min_inputs, structure.min_outputs), (largest, largest), "least numbers of {at}");
    if system.inputs() > 0 {
        assert_eq!(structure.relative_degrees, system.relative_degrees(), "relative degrees of {at}");
    }
    let (normal, polynomial) = system.zeros();
    assert_eq!(structure.zeros.normal_rank + n, normal, "normal rank of {at}");
    assert_eq!(read(&structure.zeros.polynomial), polynomial, "zeros of {at}");
    assert_eq!(structure.zeros.values.len(), polynomial.len() - 1, "zeros of {at}");
}

#[test]
fn polynomials_are_read() {
    let text = |p: &[i64]| p.iter().map(|&x| int(x)).collect::<Poly>();
    assert_eq!(read("s^3 - 2 s + 1"), text(&[1, -2, 0, 1]));
    assert_eq!(read("1"), text(&[1]));
    assert_eq!(read("s"), text(&[0, 1]));
    assert_eq!(read("s^2 - s - 3/2"), vec![int(-3) / int(2), int(-1), int(1)]);
}

/// The implementation above against values known by hand.
#[test]
fn the_other_implementation_is_right() {
    let whole = |rows: &[&[i64]]| -> Matrix { rows.iter().map(|row| row.iter().map(|&x| int(x)).collect()).collect() };
    let a = whole(&[&[0, 1], &[-2, -3]]);
    assert_eq!(characteristic(&a), [2, 3, 1].map(int));
    assert_eq!(determinant(&whole(&[&[0, 2], &[3, 4]])), int(-6));
    assert_eq!(rank(&whole(&[&[1, 2, 3], &[2, 4, 6], &[0, 0, 1]])), 2);
    assert_eq!(interpolated(&[int(1), int(2), int(5)]), [1, 0, 1].map(int));
    assert_eq!(poly_gcd(&[2, 3, 1].map(int).to_vec(), &[3, 4, 1].map(int).to_vec()), [1, 1].map(int));
    assert_eq!(choices(4, 2).len(), 6);
    // y = x₁ + x₂ of the chain: (s + 1) over (s + 1) (s + 2), relative degree one.
    let system = System { a, b: whole(&[&[0], &[1]]), c: whole(&[&[1, 1]]), d: whole(&[&[0]]) };
    assert_eq!(system.zeros(), (3, [1, 1].map(int).to_vec()));
    assert_eq!(system.relative_degrees(), [[Some(1)]]);
}

/// Several hundred systems; every fifth certified, every third with a descriptor matrix.
#[test]
fn random_systems_agree_with_plain_elimination() {
    let primes = notorious();
    let mut dice = Dice(20_261_122);
    let mut kinds = [0; 5];
    for round in 0..360 {
        // Longer numbers are refused.
        let (system, text) = loop {
            let system = random_system(&mut dice, &primes);
            let e = (round % 3 == 0).then(|| unimodular(system.a.len(), &mut dice));
            let text = system.json(e.as_ref()).to_string();
            if text.split('"').all(|number| number.len() <= 256) {
                break (system, text);
            }
        };
        let at = format!("system {round}: {text}");
        let found = analyse(&text, round % 5 == 0);
        check(&system, &found, &at);
        let structure = &found.structure;
        if round % 5 == 0 {
            assert!(structure.certificate.proven && structure.undecided == Undecided::default(), "{at}");
        }
        kinds[0] += usize::from(structure.controllable());
        kinds[1] += usize::from(!structure.controllable());
        kinds[2] += usize::from(structure.factors.iter().any(|f| f.geometric < f.algebraic));
        kinds[3] += usize::from(structure.min_inputs > 1);
        kinds[4] += usize::from(structure.zeros.values.len() > 1);
    }
    assert!(kinds.iter().all(|&count| count > 20), "every kind comes often: {kinds:?}");
}

/// Systems that fall apart modulo the primes that were once the same for every system.
#[test]
fn no_prime_can_be_relied_upon() {
    let primes = notorious();
    let product = primes.iter().fold(RBig::ONE, |all, &p| all * RBig::from(p));
    let mut multiples: Vec<RBig> = primes.iter().map(|&p| RBig::from(p)).collect();
    multiples.extend([RBig::from(1_806_122_528_306_898_383u64), product]);
    for (k, x) in multiples.into_iter().enumerate() {
        let whole = |rows: [[&RBig; 2]; 2]| -> Matrix { rows.map(|row| row.map(RBig::clone).to_vec()).to_vec() };
        let (none, one) = (RBig::ZERO, RBig::ONE);
        for (a, b) in [
            (whole([[&none, &one], [&none, &none]]), [&none, &x]),
            (whole([[&none, &none], [&none, &x]]), [&one, &one]),
            (whole([[&none, &x], [&none, &none]]), [&none, &one]),
            (whole([[&x, &one], [&none, &none]]), [&x, &one]),
        ] {
            let b: Matrix = b.map(|x| vec![x.clone()]).to_vec();
            let system = System { a, b, c: vec![vec![x.clone(), one.clone()]], d: zeros(1, 1) };
            let text = system.json(None).to_string();
            for certify in [false, true] {
                let found = analyse(&text, certify);
                check(&system, &found, &format!("multiple {k}, certify {certify}: {text}"));
                assert!(found.structure.certificate.proven || !certify, "{text}");
            }
        }
    }
}

/// What is printed of a system is the same in every run, though the primes that decide about it are not.
#[test]
fn results_are_the_same_each_time() {
    let primes = notorious();
    let mut dice = Dice(5);
    for _ in 0..20 {
        let text = random_system(&mut dice, &primes[..4]).json(None).to_string();
        for certify in [false, true] {
            let reported = || kardan::export::analysis_json(&analyse(&text, certify));
            assert_eq!(reported(), reported(), "{text}");
        }
    }
}

/// A² = 0 and the like: what rounding makes a pair or a cluster is as many zeros as there are.
#[test]
fn nilpotent_systems_have_their_zeros_only() {
    let found = analyse(r#"{"A":[[1,-1],[1,-1]]}"#, false);
    assert_eq!(found.modes.iter().map(|mode| mode.eigenvalue).collect::<Vec<_>>(), [Pole::default(); 2]);
    let mut dice = Dice(77);
    for round in 0..40 {
        let n = dice.whole(2, 7) as usize;
        let mut a = zeros(n, n);
        for i in 0..n {
            for j in i + 1..n {
                a[i][j] = int(dice.whole(-3, 3));
            }
        }
        if round % 2 == 0 {
            a[n - 1][n - 1] = int(dice.whole(-2, 2));
        }
        let t = unimodular(n, &mut dice);
        // T A T⁻¹ by way of E = T⁻¹: with E ẋ = A E x.
        let matrix_json =
            |a: Matrix| System { a, b: zeros(n, 0), c: zeros(0, n), d: Vec::new() }.json(None)["A"].clone();
        let text = json!({ "A": matrix_json(times(&a, &t)), "E": matrix_json(t) }).to_string();
        check_modes(&analyse(&text, false), &characteristic(&a), &text);
    }
}

/// Different real roots, by Sturm's chain from −∞ to ∞.
fn real_roots(p: &Poly) -> usize {
    let derivative = |p: &Poly| p.iter().enumerate().skip(1).map(|(k, x)| int(k as i64) * x).collect::<Poly>();
    let mut chain = vec![trimmed(p.clone()), trimmed(derivative(p))];
    while chain[chain.len() - 1].len() > 1 {
        let divisor = &chain[chain.len() - 1];
        let mut remainder = chain[chain.len() - 2].clone();
        while remainder.len() >= divisor.len() {
            let factor = &remainder[remainder.len() - 1] / &divisor[divisor.len() - 1];
            let shift = remainder.len() - divisor.len();
            divisor.iter().enumerate().for_each(|(k, x)| remainder[shift + k] = &remainder[shift + k] - &factor * x);
            remainder.pop();
            remainder = trimmed(remainder);
            if remainder.is_empty() {
                break;
            }
        }
        if remainder.iter().all(RBig::is_zero) {
            break;
        }
        chain.push(remainder.iter().map(|x| -x.clone()).collect());
    }
    let changes = |odd: bool| {
        let signs = chain.iter().filter(|p| !p.iter().all(RBig::is_zero)).map(|p| {
            let positive = p[p.len() - 1] > RBig::ZERO;
            positive != (odd && p.len() % 2 == 0)
        });
        let signs: Vec<bool> = signs.collect();
        signs.windows(2).filter(|pair| pair[0] != pair[1]).count()
    };
    changes(true) - changes(false)
}

/// 330 small matrices of whole numbers: as many modes as states, the zeros and the different real ones as many as Sturm's chain
/// counts on the polynomial of Faddeev and Le Verrier, their sum the trace.
#[test]
fn small_whole_matrices() {
    assert_eq!(real_roots(&[0, 0, -1, 0, 1].map(int).to_vec()), 3);
    assert_eq!(real_roots(&[4, 4, 1].map(int).to_vec()), 1);
    assert_eq!(real_roots(&[1, 0, 1].map(int).to_vec()), 0);
    let mut dice = Dice(330);
    let (mut singular, mut repeated) = (0, 0);
    for round in 0..330 {
        let n = 2 + round % 5;
        let mut a: Matrix = (0..n).map(|_| (0..n).map(|_| int(dice.whole(-3, 3))).collect()).collect();
        match round % 3 {
            // Singular: a row that is the difference of two.
            1 if n > 2 => a[2] = (0..n).map(|j| &a[0][j] - &a[1][j]).collect(),
            // Twice the same row: a zero, and often a chain.
            2 => a[1] = a[0].clone(),
            _ => {}
        }
        let text = System { a: a.clone(), b: zeros(n, 0), c: zeros(0, n), d: Vec::new() }.json(None)["A"].clone();
        let text = json!({ "A": text }).to_string();
        let (found, chi) = (analyse(&text, false), characteristic(&a));
        check_modes(&found, &chi, &text);
        let mut real: Vec<f64> =
            found.modes.iter().filter(|mode| mode.eigenvalue.im == 0.0).map(|mode| mode.eigenvalue.re).collect();
        repeated += usize::from(real.len() > real_roots(&chi));
        real.sort_by(f64::total_cmp);
        real.dedup();
        assert_eq!(real.len(), real_roots(&chi), "{text}: {:?}", found.modes);
        let sum: f64 =
            found.modes.iter().map(|mode| mode.eigenvalue.re * if mode.eigenvalue.im == 0.0 { 1.0 } else { 2.0 }).sum();
        let trace = (0..n).fold(RBig::ZERO, |sum, i| sum + &a[i][i]);
        assert!((sum - trace.to_f64().value()).abs() < 1e-12 * 18.0, "{text}: {sum}");
        singular += usize::from(chi[0].is_zero());
    }
    assert!(singular > 150 && repeated > 10, "{singular} {repeated}");
}

/// More states than have their characteristic polynomial written out: the zeros are exact all the same.
#[test]
fn long_systems_have_n_modes() {
    let n = 70;
    let mut a = zeros(n, n);
    let mut dice = Dice(3);
    for i in 0..n {
        // Three at zero in one chain, the others apart.
        a[i][i] = int(if i < 3 { 0 } else { -(i as i64) });
        if i + 1 < n {
            a[i][i + 1] = int(dice.whole(1, 3));
        }
    }
    let system = System { a: a.clone(), b: zeros(n, 0), c: zeros(0, n), d: Vec::new() };
    let found = analyse(&json!({ "A": system.json(None)["A"] }).to_string(), false);
    assert_eq!(roots(&found.modes), n);
    assert_eq!(found.modes.iter().filter(|mode| mode.eigenvalue == Pole::default()).count(), 3, "{:?}", found.modes);
    let sum: f64 =
        found.modes.iter().map(|mode| mode.eigenvalue.re * if mode.eigenvalue.im == 0.0 { 1.0 } else { 2.0 }).sum();
    let trace: f64 = (3..n).map(|i| -(i as f64)).sum();
    assert!((sum / trace - 1.0).abs() < 1e-6, "{sum} {trace}");
}

// ---- mechanical chains --------------------------------------------------------------------------------------------

/// Bodies in a row with springs and dampers between them and against the housing, a motor and a sensor on some of them.
fn chain(dice: &mut Dice) -> (String, System) {
    let n = dice.whole(2, 4) as usize;
    // Equal parts more often than not, so that motions come in copies; now and then far apart, or multiples of a prime.
    let sizes = ["1", "1", "2", "1e-3", "2305843009213693951", "1e6"];
    let palette = [dice.whole(0, 5) as usize, dice.whole(0, 2) as usize];
    let size = |dice: &mut Dice| sizes[*dice.pick(&palette)];
    let exact = |text: &str| -> RBig {
        match text.split_once('e') {
            Some((factor, exponent)) => factor.parse::<RBig>().unwrap() * ten_to(exponent.parse().unwrap()),
            None => text.parse().unwrap(),
        }
    };
    let mut text = String::from("[model]\nname = \"chain\"\n");
    let (mut h, mut d, mut s) = (vec![RBig::ZERO; n], zeros(n, n), zeros(n, n));
    let damped = dice.whole(0, 2) > 0;
    for i in 0..n {
        let inertia = size(dice);
        text += &format!("[shaft.b{i}]\ninertia = \"{inertia} kg m^2\"\n");
        h[i] = exact(inertia);
        if damped && dice.whole(0, 1) == 0 {
            let damping = size(dice);
            text += &format!("damping = \"{damping} N m s/rad\"\n");
            d[i][i] = &d[i][i] + exact(damping);
        }
    }
    for i in 0..n - 1 {
        let (stiffness, damping) = (size(dice), if damped { size(dice) } else { "0" });
        text += &format!(
            "[spring_damper.k{i}]\nshaft_1 = \"b{i}\"\nshaft_2 = \"b{}\"\nstiffness = \"{stiffness} N m/rad\"\n",
            i + 1
        );
        if damped {
            text += &format!("damping = \"{damping} N m s/rad\"\n");
        }
        for (matrix, value) in [(&mut s, exact(stiffness)), (&mut d, exact(damping))] {
            for (x, y, sign) in [(i, i, 1), (i + 1, i + 1, 1), (i, i + 1, -1), (i + 1, i, -1)] {
                matrix[x][y] = &matrix[x][y] + int(sign) * &value;
            }
        }
    }
    let (motor, sensor) = (dice.whole(0, n as i64 - 1) as usize, dice.whole(0, n as i64 - 1) as usize);
    text += &format!("[motor.m]\nshaft = \"b{motor}\"\n[analysis]\noutputs = [\"b{sensor}.phi\"]\n");
    let mut a = zeros(2 * n, 2 * n);
    for i in 0..n {
        a[i][n + i] = RBig::ONE;
        for j in 0..n {
            a[n + i][j] = -&s[i][j] / &h[i];
            a[n + i][n + j] = -&d[i][j] / &h[i];
        }
    }
    let mut b = zeros(2 * n, 1);
    b[n + motor][0] = RBig::ONE / &h[motor];
    let mut c = zeros(1, 2 * n);
    c[0][sensor] = RBig::ONE;
    (text, System { a, b, c, d: zeros(1, 1) })
}

#[test]
fn mechanical_chains_agree_with_plain_elimination() {
    let mut dice = Dice(16);
    let mut kinds = [0; 3];
    for round in 0..60 {
        let (text, system) = chain(&mut dice);
        let settings = AnalyzeSettings { certify: round % 5 == 0, ..AnalyzeSettings::default() };
        let found =
            study::analyze(&text, &settings, &Silent).unwrap_or_else(|diagnostics| panic!("{text}: {diagnostics:?}"));
        check(&system, &found, &text);
        let structure = &found.structure;
        for mode in &found.modes {
            let stored: f64 = mode.stored.iter().map(|one| one.share).sum();
            assert!((stored - 1.0).abs() < 1e-9, "{text}: {mode:?}");
        }
        kinds[0] += usize::from(structure.controllable());
        kinds[1] += usize::from(!structure.controllable());
        kinds[2] += usize::from(structure.min_inputs > 1);
    }
    assert!(kinds.iter().all(|&count| count > 3), "every kind comes often: {kinds:?}");
}
