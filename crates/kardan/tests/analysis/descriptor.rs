//! Descriptor systems: textbook examples, and random ones against the definitions.

use kardan::analysis::{DecomposedDescriptor, DescriptorError, LinearSystem, descriptor, structure};
use kardan::num::{Matrix, Rational, Scalar, exact_rank};
use kardan::results::Analysis;
use kardan::study;
use serde_json::{Value, json};

fn q(text: &str) -> Rational {
    kardan::units::parse_number(text).unwrap().rational
}

fn whole(rows: &[&[i64]]) -> Matrix<Rational> {
    Matrix::from_fn(rows.len(), rows[0].len(), |i, j| Rational::from(rows[i][j]))
}

fn system([e, a, b, c]: [Matrix<Rational>; 4]) -> LinearSystem {
    LinearSystem { e, ..LinearSystem::state_space(a, b, c) }
}

fn pencil(system: &LinearSystem, s: &Rational) -> Matrix<Rational> {
    system.e.scale(s).minus(&system.a)
}

/// `C (sE − A)⁻¹ B + D`.
fn transfer(system: &LinearSystem, s: &Rational) -> Matrix<Rational> {
    match system.states.is_empty() {
        true => system.d.clone(),
        false => system.c.multiply(&pencil(system, s).solve(&system.b).unwrap()).plus(&system.d),
    }
}

fn beside(parts: &[&Matrix<Rational>]) -> Matrix<Rational> {
    let columns: Vec<(usize, usize)> =
        parts.iter().enumerate().flat_map(|(k, part)| (0..part.columns()).map(move |j| (k, j))).collect();
    Matrix::from_fn(parts[0].rows(), columns.len(), |i, j| parts[columns[j].0][(i, columns[j].1)].clone())
}

/// `s^2 - 3/2 s` at a number.
fn value(polynomial: &str, s: &Rational) -> Rational {
    let spaced = polynomial.replace("- ", "+ -");
    spaced.split("+ ").filter(|term| !term.trim().is_empty()).fold(Rational::ZERO, |sum, term| {
        let parts: Vec<&str> = term.split_whitespace().collect();
        let (sign, first) = parts[0].strip_prefix('-').map_or((1, parts[0]), |unsigned| (-1, unsigned));
        let (factor, power) = if first.starts_with('s') { ("1", first) } else { (first, *parts.get(1).unwrap_or(&"")) };
        let power = if power.is_empty() { 0 } else { power.strip_prefix("s^").map_or(1, |k| k.parse().unwrap()) };
        let term = (0..power).fold(q(factor).times(&Rational::from(sign)), |all, _| all.times(s));
        sum.plus(&term)
    })
}

/// What holds of every descriptor system: the proof `S E T = diag(I, N)`, `S A T = diag(J, I)`, the transfer matrix as the sum
/// of that of the equivalent system and the polynomial part, and the ranks of the definitions.
#[track_caller]
fn check(original: &LinearSystem) -> DecomposedDescriptor {
    let apart = descriptor(original).unwrap();
    let (found, plain) = (&apart.found, &apart.equivalent);
    let n = original.states.len();
    let matrix = |rows: &[Vec<String>]| Matrix::from_fn(n, n, |i, j| q(&rows[i][j]));
    let (left, right) = (matrix(&found.proof.left), matrix(&found.proof.right));
    assert_eq!((exact_rank(&left), exact_rank(&right)), (n, n));
    let on = |matrix: &Matrix<Rational>| left.multiply(&matrix.multiply(&right));
    let (e, a, finite) = (on(&original.e), on(&original.a), found.finite_eigenvalues);
    let corner = |m: &Matrix<Rational>, from: usize, to: usize| {
        Matrix::from_fn(to - from, to - from, |i, j| m[(from + i, from + j)].clone())
    };
    let apart_in =
        |m: &Matrix<Rational>| (0..finite).all(|i| (finite..n).all(|j| m[(i, j)].is_zero() && m[(j, i)].is_zero()));
    assert!(apart_in(&e) && apart_in(&a));
    assert_eq!(
        (corner(&e, 0, finite), corner(&a, finite, n)),
        (Matrix::identity(finite), Matrix::identity(n - finite))
    );
    assert_eq!(corner(&a, 0, finite), plain.a);
    let nilpotent = corner(&e, finite, n);
    let power = |k: usize| (0..k).fold(Matrix::identity(n - finite), |all, _| all.multiply(&nilpotent));
    assert_eq!(exact_rank(&power(found.index)), 0);
    assert!(found.index == 0 || exact_rank(&power(found.index - 1)) > 0);
    // Blocks: the rank of Nᵏ is the sum of what remains of each.
    for k in 0..=found.index {
        let remaining_rank: usize = found.infinite_blocks.iter().map(|order| order.saturating_sub(k)).sum();
        assert_eq!(exact_rank(&power(k)), remaining_rank);
    }
    assert_eq!(found.impulse_free, found.index <= 1);
    for s in ["17/3", "-23/7"].map(q) {
        let (whole, equivalent) = (transfer(original, &s), transfer(plain, &s));
        for (i, output) in original.outputs.iter().enumerate() {
            let proper_row = plain.outputs.iter().position(|other| other == output);
            assert_eq!(proper_row.is_none(), found.improper_outputs.contains(output));
            if let Some(proper_row) = proper_row {
                assert_eq!(whole.row(i), equivalent.row(proper_row), "{output}");
            }
        }
    }
    for (side, dual) in [(&found.controllability, false), (&found.observability, true)] {
        let side_system = if dual { original.transpose() } else { original.clone() };
        let kernel = kardan::num::echelon(&side_system.e, &(0..n).collect::<Vec<_>>()).kernel();
        let impulses = exact_rank(&beside(&[&side_system.e, &side_system.a.multiply(&kernel), &side_system.b]));
        assert_eq!((side.impulse_defect, side.impulse), (n - impulses, impulses == n));
        let ends = exact_rank(&beside(&[&side_system.e, &side_system.b])) == n;
        assert_eq!(side.infinite_defect == 0, ends);
        assert_eq!(side.complete, side.finite.map(|finite| finite && ends));
    }
    apart
}

/// ```text
///   u --[ R ]--+        C v' = i,  0 = w − R i,  0 = v + w − u      R = 2 Ω, C = 1/4 F
///              = C      v/u = 1/(RC s + 1),  i/u = C s/(RC s + 1)
/// ```
#[test]
fn a_circuit_with_redundant_variables_is_of_index_one() {
    let e = Matrix::from_fn(3, 3, |i, j| if i + j == 0 { q("1/4") } else { Rational::ZERO });
    let a = whole(&[&[0, 1, 0], &[0, -2, 1], &[1, 0, 1]]);
    let original = system([e, a, whole(&[&[0], &[0], &[-1]]), whole(&[&[1, 0, 0], &[0, 1, 0]])]);
    let DecomposedDescriptor { found, equivalent } = check(&original);
    assert_eq!((found.index, found.finite_eigenvalues, found.infinite_blocks.as_slice()), (1, 1, [1, 1].as_slice()));
    assert_eq!(equivalent.a, Matrix::from_fn(1, 1, |_, _| q("-2")));
    assert_eq!(equivalent.d, Matrix::from_fn(2, 1, |i, _| q(["0", "1/2"][i])));
    assert!(found.controllability.complete == Some(false) && found.controllability.finite == Some(true));
    assert!(found.controllability.impulse && found.observability.impulse && found.polynomial_part.is_empty());
    assert_eq!(found.orders_at_infinity, Some(vec![]));
    let current = LinearSystem { c: whole(&[&[0, 1, 0]]), outputs: vec!["i".into()], ..original };
    let current = LinearSystem { d: Matrix::zeros(1, 1), ..current };
    assert_eq!(check(&current).found.zeros.unwrap().polynomial, "s");
}

/// A capacitor at a source: the current is `C u'`, and no state is left.
#[test]
fn a_capacitor_at_a_source_has_no_state_space() {
    let original = system([
        whole(&[&[3, 0], &[0, 0]]),
        whole(&[&[0, 1], &[1, 0]]),
        whole(&[&[0], &[-1]]),
        whole(&[&[0, 1], &[1, 0]]),
    ]);
    let found = check(&original).found;
    assert_eq!((found.index, found.finite_eigenvalues), (2, 0));
    assert_eq!(found.improper_outputs, ["y1"]);
    let part = &found.polynomial_part[0];
    assert_eq!((part.output.as_str(), part.input.as_str(), part.polynomial.as_str()), ("y1", "u1", "3 s"));
    assert_eq!(found.orders_at_infinity, Some(vec![-1]));
    // As a file: words, and no motions.
    let text = json!({"E": [[3, 0], [0, 0]], "A": [[0, 1], [1, 0]], "B": [0, -1], "C": [[0, 1], [1, 0]]});
    let analysis = analysis(&text);
    assert!(analysis.modes.is_empty() && analysis.descriptor.is_some() && analysis.notes[0].contains("no finite"));
}

/// Two masses (1 kg, 2 kg) held together, a spring 3 N/m at the first: index 3, `3 s² + 3` finite. The constraint force
/// responds to `u` at once, and to a distance w that is prescribed with its acceleration.
#[test]
fn a_constrained_mechanism_is_of_index_three() {
    let e = whole(&[&[1, 0, 0, 0, 0], &[0, 1, 0, 0, 0], &[0, 0, 1, 0, 0], &[0, 0, 0, 2, 0], &[0; 5]]);
    let a = whole(&[&[0, 0, 1, 0, 0], &[0, 0, 0, 1, 0], &[-3, 0, 0, 0, 1], &[0, 0, 0, 0, -1], &[1, -1, 0, 0, 0]]);
    let b = whole(&[&[0, 0], &[0, 0], &[1, 0], &[0, 0], &[0, -1]]);
    let c = whole(&[&[1, 0, 0, 0, 0], &[0, 0, 0, 0, 1]]);
    let original = system([e, a, b, c]);
    let DecomposedDescriptor { found, equivalent } = check(&original);
    assert_eq!((found.index, found.finite_eigenvalues, found.infinite_blocks.as_slice()), (3, 2, [3].as_slice()));
    assert_eq!(structure(&equivalent).unwrap().invariant_factors, ["s^2 + 1"]);
    assert_eq!(found.improper_outputs, ["y2"]);
    // λ = −2 x₂'' with 3 x₂'' + 3 x₂ = u − w'' − 3 w: −2 s² w''/3 + …: the polynomial part is 2/3 s².
    let parts: Vec<_> =
        found.polynomial_part.iter().map(|part| (part.input.as_str(), part.polynomial.as_str())).collect();
    assert_eq!(parts, [("u2", "2/3 s^2")]);
    // Without w all is proper, and the force meets no impulse any more.
    let forced = LinearSystem {
        b: whole(&[&[0], &[0], &[1], &[0], &[0]]),
        d: Matrix::zeros(2, 1),
        inputs: vec!["u".into()],
        ..original
    };
    let DecomposedDescriptor { found, equivalent } = check(&forced);
    assert!(
        found.improper_outputs.is_empty()
            && !found.controllability.impulse
            && found.controllability.finite == Some(true)
    );
    assert_eq!(equivalent.d, Matrix::from_fn(2, 1, |i, _| q(["0", "-2/3"][i])));
}

fn analysis(file: &Value) -> Analysis {
    let found = study::analyze_state_space(file.to_string().as_bytes(), &Default::default(), &study::Silent);
    found.unwrap_or_else(|diagnostics| panic!("{diagnostics:?}"))
}

/// The rows told make zero for all s.
#[test]
fn a_singular_pencil_shows_its_rows() {
    // Row 2 is s times row 1; rows 1 and 3 are the same.
    for (e, a, rows) in [
        (whole(&[&[0, 0], &[1, 0]]), whole(&[&[-1, 0], &[0, 0]]), 2),
        (whole(&[&[1, 2, 0], &[0, 1, 1], &[1, 2, 0]]), whole(&[&[0, 1, 1], &[1, 0, 0], &[0, 1, 1]]), 2),
        (whole(&[&[1, 0, 0], &[0, 1, 0], &[0, 0, 0]]), whole(&[&[0, 1, 0], &[0, 0, 1], &[0, 0, 0]]), 1),
    ] {
        let n = e.rows();
        let original = system([e, a, Matrix::zeros(n, 0), Matrix::zeros(0, n)]);
        let Err(DescriptorError::Singular(why)) = descriptor(&original) else { panic!("regular") };
        assert_eq!(why.equations.len(), rows);
        for s in ["5", "-7/3"].map(q) {
            let pencil = pencil(&original, &s);
            for j in 0..n {
                let sum = why.equations.iter().fold(Rational::ZERO, |sum, (row, factor)| {
                    sum.plus(&factor.as_ref().unwrap().evaluate(&s).times(&pencil[(*row, j)]))
                });
                assert!(sum.is_zero());
            }
        }
    }
    let text = json!({"E": [[0, 0], [1, 0]], "A": [[-1, 0], [0, 0]]}).to_string();
    let reported = study::analyze_state_space(text.as_bytes(), &Default::default(), &study::Silent).unwrap_err();
    assert_eq!(reported[0].code, "state-space::singular");
    assert!(reported[0].message.contains("(s) · row 1 + (-1) · row 2"), "{}", reported[0].message);
}

/// Random pencils with known structure: finite eigenvalues on the diagonal of J, blocks at infinity, turned by random matrices.
#[test]
fn random_pencils_come_apart() {
    let mut seed = 11u64;
    let mut small = move |size: i64| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 40) as i64 % (2 * size + 1) - size
    };
    for (eigenvalues, blocks, sides) in [
        (vec![1i64, 1, -2], vec![2usize, 1], [(2, 1), (2, 2)]),
        (vec![], vec![3], [(1, 1), (2, 2)]),
        (vec![0, 5], vec![2, 2], [(1, 1), (2, 1)]),
        (vec![-1, 2, 3], vec![2, 1, 1], [(1, 1), (1, 2)]),
    ] {
        let finite = eigenvalues.len();
        let n = finite + blocks.iter().sum::<usize>();
        let mut e = Matrix::<Rational>::identity(n);
        let mut a = Matrix::<Rational>::identity(n);
        (0..finite).for_each(|i| a[(i, i)] = Rational::from(eigenvalues[i]));
        let mut begin = finite;
        for order in &blocks {
            for i in begin..begin + order {
                e[(i, i)] = Rational::ZERO;
                if i + 1 < begin + order {
                    e[(i, i + 1)] = Rational::ONE;
                }
            }
            begin += order;
        }
        for (inputs, outputs) in sides {
            let mut random =
                |rows: usize, columns: usize| Matrix::from_fn(rows, columns, |_, _| Rational::from(small(2)));
            let regular = |random: &mut dyn FnMut(usize, usize) -> Matrix<Rational>| {
                std::iter::repeat_with(|| random(n, n)).find(|m| exact_rank(m) == n).unwrap()
            };
            let (left, right) = (regular(&mut random), regular(&mut random));
            let transform = |m: &Matrix<Rational>| left.multiply(&m.multiply(&right));
            let original = system([transform(&e), transform(&a), random(n, inputs), random(outputs, n)]);
            let apart = check(&original);
            let mut sorted = blocks.clone();
            sorted.sort_by(|one, other| other.cmp(one));
            assert_eq!((&apart.found.infinite_blocks, apart.found.finite_eigenvalues), (&sorted, finite));
            against_definitions(&original, &apart, &eigenvalues);
        }
    }
}

/// Finite modes by Hautus' ranks; the polynomial part, the zeros and the orders at infinity by values of the transfer matrix.
fn against_definitions(original: &LinearSystem, apart: &DecomposedDescriptor, eigenvalues: &[i64]) {
    let found = &apart.found;
    let n = original.states.len();
    let hautus = |system: &LinearSystem| {
        let full = |value: &i64| exact_rank(&beside(&[&pencil(system, &Rational::from(*value)), &system.b])) == n;
        eigenvalues.iter().all(full)
    };
    assert_eq!(found.controllability.finite, Some(hautus(original)));
    assert_eq!(found.observability.finite, Some(hautus(&original.transpose())));
    // The transfer matrix less the polynomial part stays bounded.
    let far = q("1e30");
    let whole = transfer(original, &far);
    for (i, output) in original.outputs.iter().enumerate() {
        for (j, input) in original.inputs.iter().enumerate() {
            let part = found.polynomial_part.iter().find(|part| part.output == *output && part.input == *input);
            let proper_part = whole[(i, j)].minus(&part.map_or(Rational::ZERO, |part| value(&part.polynomial, &far)));
            assert!(Scalar::to_f64(&proper_part).abs() < 1e9);
        }
    }
    if original.inputs.len() != original.outputs.len() {
        return;
    }
    // det of the transfer matrix grows as s to minus the sum of the orders at infinity; its zeros are those found.
    let rosenbrock = |s: &Rational| {
        let (m, upper) = (original.inputs.len(), pencil(original, s));
        Matrix::from_fn(n + m, n + m, |i, j| match (i < n, j < n) {
            (true, true) => upper[(i, j)].clone(),
            (true, false) => Rational::ZERO.minus(&original.b[(i, j - n)]),
            (false, true) => original.c[(i - n, j)].clone(),
            (false, false) => original.d[(i - n, j - n)].clone(),
        })
    };
    assert_eq!(found.normal_rank, Some(exact_rank(&rosenbrock(&far)) - n));
    if found.normal_rank != Some(original.inputs.len()) {
        return;
    }
    let minor = |s: &Rational| determinant(&transfer(original, s));
    let growth = Scalar::to_f64(&(minor(&q("1e31")) / minor(&far))).abs().log10().round() as i64;
    assert_eq!(-growth, found.orders_at_infinity.as_ref().unwrap().iter().sum::<i64>());
    let zeros = &found.zeros.as_ref().unwrap().polynomial;
    let ratio = |s: &Rational| determinant(&rosenbrock(s)) / value(zeros, s);
    assert_eq!(ratio(&q("17/3")), ratio(&q("-9/5")));
}

fn determinant(m: &Matrix<Rational>) -> Rational {
    let n = m.rows();
    if n == 0 {
        return Rational::ONE;
    }
    (0..n).fold(Rational::ZERO, |sum, j| {
        if m[(0, j)].is_zero() {
            return sum;
        }
        let minor = Matrix::from_fn(n - 1, n - 1, |i, k| m[(i + 1, if k < j { k } else { k + 1 })].clone());
        let term = m[(0, j)].times(&determinant(&minor));
        if j % 2 == 0 { sum.plus(&term) } else { sum.minus(&term) }
    })
}
