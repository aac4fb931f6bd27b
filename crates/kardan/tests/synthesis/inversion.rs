//! Inversion of linear systems: built-in models with known answers, and random systems whose answer is known because they
//! are built from it and then hidden by changes of coordinates, feedback and input transformations.
//!
//! Transfer matrices are evaluated at numbers with elimination of this file; the equations checked are the definitions.

use std::collections::BTreeSet;

use crate::common::{self, Dice, angle};
use kardan::analysis::{ConstrainedSystem, LinearSystem, OutputSignal, linear_system};
use kardan::equations::Measured;
use kardan::model;
use kardan::num::{Matrix, Polynomial, Rational};
use kardan::synthesis::inversion::{
    BlockError, FlatParametrisation, FlatnessError, PlannerError, PolynomialMatrix, decouple_blocks, dynamic_extension,
    finest_blocks, flat_parametrisation, obstruction, planner, reasons, structure_algorithm,
};

type M = Matrix<Rational>;

// ---- exact arithmetic of its own ----------------------------------------------------------------------------------

fn int(x: i64) -> Rational {
    Rational::from(x)
}

fn polynomial(coefficients: &[i64]) -> Polynomial {
    Polynomial::new(coefficients.iter().map(|&c| int(c)).collect())
}

fn integers(rows: &[&[i64]]) -> M {
    M::from_fn(rows.len(), rows.first().map_or(0, |row| row.len()), |i, j| int(rows[i][j]))
}

fn negative(m: &M) -> M {
    m.scale(&int(-1))
}

fn value(p: &Polynomial, s: &Rational) -> Rational {
    p.coefficients().iter().rev().fold(int(0), |sum, c| sum * s + c)
}

fn product(a: &Polynomial, b: &Polynomial) -> Polynomial {
    let mut out = vec![int(0); a.coefficients().len() + b.coefficients().len()];
    for (i, x) in a.coefficients().iter().enumerate() {
        for (j, y) in b.coefficients().iter().enumerate() {
            out[i + j] = &out[i + j] + x * y;
        }
    }
    Polynomial::new(out)
}

/// Echelon form by plain elimination: rows, pivots, and the determinant of a square matrix.
fn eliminated(m: &M) -> (Vec<Vec<Rational>>, Vec<usize>, Rational) {
    let mut rows: Vec<Vec<Rational>> = (0..m.rows()).map(|i| m.row(i).to_vec()).collect();
    let (mut pivots, mut determinant) = (Vec::new(), int(1));
    for column in 0..m.columns() {
        let at = pivots.len();
        let Some(pivot) = (at..rows.len()).find(|&i| rows[i][column] != int(0)) else { continue };
        if pivot != at {
            rows.swap(at, pivot);
            determinant = int(0) - determinant;
        }
        let lead = rows[at][column].clone();
        determinant *= &lead;
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
    if pivots.len() < m.rows() {
        determinant = int(0);
    }
    (rows, pivots, determinant)
}

fn rank(m: &M) -> usize {
    eliminated(m).1.len()
}

fn determinant(m: &M) -> Rational {
    eliminated(m).2
}

/// X with `a X = b`; `None` if a is singular.
fn solved(a: &M, b: &M) -> Option<M> {
    let n = a.rows();
    let beside = M::from_fn(n, n + b.columns(), |i, j| if j < n { a[(i, j)].clone() } else { b[(i, j - n)].clone() });
    let (rows, pivots, _) = eliminated(&beside);
    (pivots.iter().take(n).copied().eq(0..n)).then(|| M::from_fn(n, b.columns(), |i, j| rows[i][n + j].clone()))
}

fn shifted(s: &Rational, a: &M) -> M {
    M::identity(a.rows()).scale(s).plus(&negative(a))
}

/// (sI − A)⁻¹ B; `None` at a pole.
fn response(system: &LinearSystem, s: &Rational) -> Option<M> {
    solved(&shifted(s, &system.a), &system.b)
}

/// H(s); `None` at a pole.
fn transfer(system: &LinearSystem, s: &Rational) -> Option<M> {
    Some(system.c.multiply(&response(system, s)?).plus(&system.d))
}

/// Numbers that are hardly ever poles.
fn numbers() -> Vec<Rational> {
    [(3, 7u64), (-11, 5), (17, 3), (101, 9), (-23, 11), (1009, 13)]
        .map(|(n, d)| Rational::from_parts(n.into(), d.into()))
        .to_vec()
}

impl Dice {
    fn small(&mut self, size: i64) -> i64 {
        self.between(-size, size)
    }

    /// One entry in `sparsity` is not zero.
    fn sparse(&mut self, rows: usize, columns: usize, sparsity: usize) -> M {
        M::from_fn(rows, columns, |_, _| if self.below(sparsity) == 0 { int(self.small(2)) } else { int(0) })
    }

    fn regular(&mut self, n: usize) -> M {
        loop {
            let m = self.matrix(n, n, 2);
            if determinant(&m) != int(0) {
                return m;
            }
        }
    }

    /// All minors different from zero.
    fn generic(&mut self, n: usize) -> M {
        // A Cauchy matrix with other rows each time.
        let shift = self.below(5) as i64;
        M::from_fn(n, n, |i, j| int(1) / int(1 + shift + 2 * i as i64 + j as i64 + (i * i) as i64))
    }

    fn permutation(&mut self, n: usize) -> Vec<usize> {
        let mut out: Vec<usize> = (0..n).collect();
        (1..n).rev().for_each(|i| out.swap(i, self.below(i + 1)));
        out
    }

    /// Sparse systems: rich in structure, often with dependent outputs; with feedthrough now and then.
    fn system(&mut self, n: usize, m: usize, p: usize) -> LinearSystem {
        let sparsity = 2 + self.below(2);
        let (a, b, c) = (self.sparse(n, n, sparsity), self.sparse(n, p, sparsity), self.sparse(m, n, sparsity));
        let mut system = LinearSystem::state_space(a, b, c);
        if self.below(4) == 0 {
            system.d = self.sparse(m, p, 4);
        }
        system
    }

    /// New coordinates, feedback `u = F x + G v`: nothing that static feedback cannot undo.
    fn hidden(&mut self, system: &LinearSystem) -> LinearSystem {
        let (n, p) = (system.a.rows(), system.b.columns());
        let (t, f, g) = (self.regular(n), self.matrix(p, n, 2), self.regular(p));
        let a = system.a.plus(&system.b.multiply(&f));
        let c = system.c.plus(&system.d.multiply(&f));
        LinearSystem {
            a: solved(&t, &a.multiply(&t)).unwrap(),
            b: solved(&t, &system.b.multiply(&g)).unwrap(),
            c: c.multiply(&t),
            d: system.d.multiply(&g),
            ..system.clone()
        }
    }
}

/// Systems side by side, without coupling.
fn side_by_side(systems: &[LinearSystem]) -> LinearSystem {
    let join = |part: &dyn Fn(&LinearSystem) -> &M| {
        let (rows, columns) = systems.iter().fold((0, 0), |(r, c), s| (r + part(s).rows(), c + part(s).columns()));
        let mut out = M::zeros(rows, columns);
        let (mut row, mut column) = (0, 0);
        for m in systems.iter().map(part) {
            for i in 0..m.rows() {
                for j in 0..m.columns() {
                    out[(row + i, column + j)] = m[(i, j)].clone();
                }
            }
            (row, column) = (row + m.rows(), column + m.columns());
        }
        out
    };
    LinearSystem::state_space(join(&|s| &s.a), join(&|s| &s.b), join(&|s| &s.c))
}

/// `second · first`: the outputs of the first are the inputs of the second.
fn in_series(first: &LinearSystem, second: &LinearSystem) -> LinearSystem {
    let (n, k) = (first.a.rows(), second.a.rows());
    let through = second.b.multiply(&first.c);
    let a = M::from_fn(n + k, n + k, |i, j| match (i < n, j < n) {
        (true, true) => first.a[(i, j)].clone(),
        (true, false) => int(0),
        (false, true) => through[(i - n, j)].clone(),
        (false, false) => second.a[(i - n, j - n)].clone(),
    });
    let direct = second.b.multiply(&first.d);
    let b =
        M::from_fn(
            n + k,
            first.b.columns(),
            |i, j| {
                if i < n { first.b[(i, j)].clone() } else { direct[(i - n, j)].clone() }
            },
        );
    let on_first = second.d.multiply(&first.c);
    let c =
        M::from_fn(
            second.c.rows(),
            n + k,
            |i, j| {
                if j < n { on_first[(i, j)].clone() } else { second.c[(i, j - n)].clone() }
            },
        );
    LinearSystem { d: second.d.multiply(&first.d), ..LinearSystem::state_space(a, b, c) }
}

/// diag(1/s^l).
fn integrators(lengths: &[usize]) -> LinearSystem {
    let one = |length: usize| LinearSystem {
        d: integers(&[&[i64::from(length == 0)]]),
        ..LinearSystem::state_space(
            M::from_fn(length, length, |i, j| int(i64::from(i + 1 == j))),
            M::from_fn(length, 1, |i, _| int(i64::from(i + 1 == length))),
            M::from_fn(1, length, |_, j| int(i64::from(j == 0))),
        )
    };
    let parts: Vec<LinearSystem> = lengths.iter().map(|&l| one(l)).collect();
    let d = M::from_fn(lengths.len(), lengths.len(), |i, j| int(i64::from(i == j && lengths[i] == 0)));
    LinearSystem { d, ..side_by_side(&parts) }
}

/// `diag(1/s^k) M diag(1/s^l)` with a matrix M all of whose minors differ from zero.
fn mixed(dice: &mut Dice, outputs: &[usize], inputs: &[usize]) -> LinearSystem {
    let m = outputs.len();
    let gain = LinearSystem {
        d: dice.generic(m),
        ..LinearSystem::state_space(M::zeros(0, 0), M::zeros(0, m), M::zeros(m, 0))
    };
    in_series(&in_series(&integrators(inputs), &gain), &integrators(outputs))
}

fn with_outputs(system: &LinearSystem, rows: &[usize]) -> LinearSystem {
    let pick = |m: &M| M::from_fn(rows.len(), m.columns(), |i, j| m[(rows[i], j)].clone());
    let outputs = rows.iter().map(|&i| system.outputs[i].clone()).collect();
    LinearSystem { c: pick(&system.c), d: pick(&system.d), outputs, ..system.clone() }
}

/// (s + 1)(s + 2)…(s + order + output)
fn dynamics(output: usize, order: usize) -> Polynomial {
    (0..order).fold(polynomial(&[1]), |p, k| product(&p, &polynomial(&[(1 + k + output) as i64, 1])))
}

// ---- built-in models ----------------------------------------------------------------------------------------------

struct BuiltIn {
    constrained: ConstrainedSystem,
    signals: Vec<OutputSignal>,
    system: LinearSystem,
}

/// A model with these inputs; outputs are `rk` (angle), `rk.w` (speed) or `tb` (torque of the torsion bar).
fn from_source(source: &str, inputs: &[&str], outputs: &[&str]) -> BuiltIn {
    let (constrained, coordinates, basis) = common::constrained(source, inputs);
    let signals: Vec<OutputSignal> = outputs
        .iter()
        .map(|&name| match name.split_once('.') {
            _ if name == "tb" => {
                OutputSignal { name: "tb.tau".into(), measured: Measured::SpringTorque("torsion_bar".into()) }
            }
            Some((shaft, _)) => OutputSignal { name: name.into(), measured: Measured::Speed(shaft.into()) },
            None => angle(name),
        })
        .collect();
    let system = linear_system(&constrained, &coordinates, &basis, &signals).explicit().unwrap();
    BuiltIn { constrained, signals, system }
}

fn source(name: &str) -> &'static str {
    model::builtin(name).unwrap().source
}

fn steering(inputs: &[&str], outputs: &[&str]) -> BuiltIn {
    from_source(source("sia-steering"), inputs, outputs)
}

/// The steering system with a torsion bar that is a spring only.
fn undamped(outputs: &[&str]) -> BuiltIn {
    let changed = source("sia-steering").replace("damping = \"0.02 N m s/rad ± 50 %\"\n", "");
    assert_ne!(changed, source("sia-steering"));
    from_source(&changed, &["wg_motor", "rk_motor"], outputs)
}

fn why(model: &BuiltIn) -> Vec<String> {
    let obstruction = obstruction(&model.system).expect("dependent outputs");
    check_relations(&model.system);
    let notation = |name: &str| if name == "hd" { format!("the harmonic drive `{name}`") } else { format!("`{name}`") };
    reasons(&obstruction, &model.signals, &model.constrained, &notation)
}

/// Theorem 6.4 and its erratum.
#[test]
fn steering_is_flat_only_if_the_torsion_bar_is_undamped() {
    let motors = ["wg_motor", "rk_motor"];
    let flat = |model: &BuiltIn| {
        let flat = flat_parametrisation(&model.system).unwrap();
        check_parametrisation(&model.system, &flat);
        flat
    };
    let theorem = flat(&undamped(&["fs", "cj"]));
    assert!(theorem.is_flat() && theorem.z == polynomial(&[1]));
    assert_eq!(theorem.derivatives(), [4, 4]);
    let damped = flat(&steering(&motors, &["fs", "cj"]));
    assert_eq!((damped.z.to_string(), damped.zeros.to_string()), ("s + 5000".into(), "s + 5000".into()));
    assert!(!damped.is_flat());
    assert_eq!(damped.derivatives(), [3, 3]);
    let controlled = flat(&steering(&motors, &["rk", "fs"]));
    assert_eq!(controlled.z.to_string(), "s^2 + 2060/11 s + 10000000/11");
    assert_eq!(controlled.derivatives(), [2, 2]);
}

#[test]
fn steering_needs_integrators_before_the_wave_generator_to_decouple_wheel_and_joint() {
    let motors = ["wg_motor", "rk_motor"];
    let chains = |model: &BuiltIn| {
        check_extension(&model.system);
        dynamic_extension(&model.system).unwrap().chains()
    };
    assert_eq!(chains(&steering(&motors, &["rk", "fs"])), []);
    assert_eq!(chains(&steering(&motors, &["fs", "cj"])), [("wg_motor".to_string(), 1)]);
    assert_eq!(chains(&undamped(&["fs", "cj"])), [("wg_motor".to_string(), 2)]);
    let extension = dynamic_extension(&undamped(&["fs", "cj"]).system).unwrap();
    assert_eq!(extension.extended.states[6..], ["wg_motor.x1", "wg_motor.x2"]);
    assert_eq!(extension.extended.inputs, ["wg_motor''", "rk_motor"]);
    assert_eq!(extension.relative_degrees, [4, 4]);
    // wg_motor is the first of the two states, rk_motor itself is still an input.
    assert_eq!(extension.from_state, M::from_fn(2, 8, |i, j| int(i64::from((i, j) == (0, 6)))));
    assert_eq!(extension.from_input, integers(&[&[0, 0], &[0, 1]]));
}

#[test]
fn steering_in_blocks() {
    let motors = ["wg_motor", "rk_motor", "driver"];
    assert_eq!(finest_blocks(&steering(&motors, &["rk", "fs", "cj"]).system), Some(vec![vec![0], vec![1], vec![2]]));
    let two = steering(&motors[..2], &["fs", "cj"]);
    assert_eq!(finest_blocks(&two.system), Some(vec![vec![0, 1]]));
    check_blocks(&two.system, &[vec![0, 1]]);
    check_blocks(&steering(&motors[..2], &["rk", "fs"]).system, &[vec![0], vec![1]]);
    // A torque of the torsion bar is as good as an angle.
    check_blocks(&steering(&motors, &["tb", "fs", "cj"]).system, &[vec![0], vec![1], vec![2]]);
    let error = decouple_blocks(&two.system, &[vec![0], vec![1]], &dynamics).unwrap_err();
    assert_eq!(error, BlockError::NotDecouplable { rank: 1, outputs: 2 });
}

#[test]
fn impossible_outputs_are_explained_by_elements() {
    let drive = from_source(source("harmonic-drive"), &["wg_motor", "cs_motor"], &["wg", "cs", "fs"]);
    let kinematic = "for all inputs: the harmonic drive `hd` ties them together";
    assert_eq!(
        why(&drive),
        ["3 outputs, 2 inputs".to_string(), format!("wg.phi - 51 cs.phi + 50 fs.phi = 0 {kinematic}")]
    );
    let motors = ["wg_motor", "rk_motor", "driver"];
    assert_eq!(
        why(&steering(&motors, &["fs", "cs", "wg"])),
        [format!("50 fs.phi - 51 cs.phi + wg.phi = 0 {kinematic}")]
    );
    assert_eq!(why(&steering(&motors, &["cs", "cj"])), ["cs.phi = cj.phi for all inputs: `cardan` ties them together"]);
    assert_eq!(
        why(&steering(&["wg_motor", "driver"], &["rk", "cj"])),
        ["(5 s^2 + 3 s + 10000) rk.phi = (2 s + 10000) cj.phi for all inputs: rk moves only through `torsion_bar`"]
    );
    assert_eq!(
        why(&steering(&["wg_motor", "driver"], &["cs", "rk"])),
        ["(2 s + 10000) cs.phi = (5 s^2 + 3 s + 10000) rk.phi for all inputs: `cardan` and `torsion_bar` tie \
         them together"]
    );
    assert_eq!(
        why(&steering(&["wg_motor", "rk_motor"], &["rk", "rk.w"])),
        ["s rk.phi = rk.w for all inputs: they measure the same motion"]
    );
    assert_eq!(
        why(&steering(&["wg_motor", "driver"], &["tb", "rk"])),
        ["(s + 5000) tb.tau = -(250 s^2 + 50 s) rk.phi for all inputs: rk moves only through `torsion_bar`"]
    );
    // The wave generator alone: everything hangs together.
    let one = why(&steering(&["wg_motor"], &["fs", "cj"]));
    assert_eq!(one[0], "2 outputs, 1 input");
    assert!(one[1].ends_with("tie them together") && one[1].contains("torsion_bar"), "{one:?}");
    let unreached =
        LinearSystem::state_space(integers(&[&[0, 0], &[0, -1]]), integers(&[&[1], &[0]]), integers(&[&[0, 1]]));
    let found = obstruction(&unreached).unwrap();
    assert_eq!(reasons(&found, &[], &ConstrainedSystem::default(), &str::to_string), ["no input reaches y1"]);
}

// ---- the definitions ----------------------------------------------------------------------------------------------

fn check_structure(system: &LinearSystem) {
    let found = structure_algorithm(system);
    let m = system.c.rows();
    let full = found.rank() == m;
    let sum: usize = found.orders.iter().flatten().sum();
    assert!(found.orders.iter().flatten().all(|&order| order <= system.a.rows()));
    assert_eq!(rank(&found.d), found.rank());
    let determined = M::from_fn(found.determined.len(), system.a.rows(), |i, j| found.determined[i].row[j].clone());
    assert_eq!(rank(&determined), found.determined.len());
    let mut ranks = BTreeSet::new();
    for s in numbers() {
        let (Some(h), Some(x)) = (transfer(system, &s), response(system, &s)) else { continue };
        let p = found.operator.evaluate(&s);
        assert_eq!(p.multiply(&h), found.c.multiply(&x).plus(&found.d));
        let size = determinant(&p);
        assert!(size != int(0));
        if full {
            let power = (0..sum).fold(int(1), |power, _| power * &s);
            assert!(size == power || size == int(0) - power);
        }
        for determined in &found.determined {
            let operator = M::from_fn(1, m, |_, j| value(&determined.operator[j], &s));
            let row = M::from_fn(1, determined.row.len(), |_, j| determined.row[j].clone());
            assert_eq!(operator.multiply(&h), row.multiply(&x));
        }
        ranks.insert(rank(&h));
    }
    assert_eq!(ranks.last().copied().unwrap_or(0), found.rank());
}

/// π(s) H(s) = 0 at more numbers than the degree, and the relations are a minimal basis.
fn check_relations(system: &LinearSystem) {
    let found = obstruction(system).unwrap();
    let (n, m) = (system.a.rows(), system.c.rows());
    assert_eq!(found.relations.len() + found.rank, m);
    let degree = |relation: &Vec<Polynomial>| relation.iter().map(Polynomial::degree).max().unwrap();
    let highest = found.relations.iter().map(degree).max().unwrap();
    assert!(highest <= n);
    // det(sI − A) π H is a polynomial of at most this degree.
    let (mut checked, mut s) = (0, int(1));
    while checked < n + highest + 1 {
        s += int(1);
        let Some(h) = transfer(system, &s) else { continue };
        let rows = M::from_fn(found.relations.len(), m, |i, j| value(&found.relations[i][j], &s));
        assert!(rows.multiply(&h).as_slice().iter().all(|x| *x == int(0)));
        assert_eq!(rank(&rows), found.relations.len());
        checked += 1;
    }
    // Row reduced: the leading coefficients are independent.
    let leading = M::from_fn(found.relations.len(), m, |i, j| {
        found.relations[i][j].coefficients().get(degree(&found.relations[i])).cloned().unwrap_or(int(0))
    });
    assert_eq!(rank(&leading), found.relations.len());
}

/// Essential order: by how much an output alone raises the sum of the orders at infinity.
fn integrators_needed(system: &LinearSystem) -> usize {
    let m = system.c.rows();
    let sum = |rows: &[usize]| structure_algorithm(&with_outputs(system, rows)).orders.iter().flatten().sum::<usize>();
    let all: Vec<usize> = (0..m).collect();
    let total = sum(&all);
    let essential = |i: usize| total - sum(&all.iter().copied().filter(|&j| j != i).collect::<Vec<_>>());
    all.iter().map(|&i| essential(i)).sum::<usize>() - total
}

fn check_extension(system: &LinearSystem) {
    let extension = dynamic_extension(system).unwrap();
    let extended = &extension.extended;
    let m = system.c.rows();
    assert_eq!(rank(&extension.decoupling_matrix), m);
    assert_eq!(extended.states.len(), system.a.rows() + extension.integrators.len());
    assert_eq!(extended.states.len(), extended.a.rows());
    let chains: usize = extension.chains().iter().map(|(_, length)| length).sum();
    assert_eq!(chains, extension.integrators.len());
    if m == system.b.columns() {
        assert_eq!(extension.integrators.len(), integrators_needed(system));
    }
    for s in numbers() {
        let (Some(h), Some(x)) = (transfer(system, &s), response(extended, &s)) else { continue };
        let u = extension.from_state.multiply(&x).plus(&extension.from_input);
        assert_eq!(transfer(extended, &s).unwrap(), h.multiply(&u));
        // The first states are those of the plant under this u.
        let n = system.a.rows();
        let plant = M::from_fn(n, x.columns(), |i, j| x[(i, j)].clone());
        assert_eq!(plant, response(system, &s).unwrap().multiply(&u));
    }
    let each: Vec<Vec<usize>> = (0..m).map(|i| vec![i]).collect();
    assert_eq!(finest_blocks(extended), Some(each.clone()));
    check_blocks(extended, &each);
}

fn check_blocks(system: &LinearSystem, blocks: &[Vec<usize>]) {
    let law = decouple_blocks(system, blocks, &dynamics).unwrap();
    let closed = LinearSystem {
        a: system.a.plus(&negative(&system.b.multiply(&law.k))),
        b: system.b.multiply(&law.l),
        c: system.c.plus(&negative(&system.d.multiply(&law.k))),
        d: system.d.multiply(&law.l),
        ..system.clone()
    };
    let m = system.c.rows();
    let polynomials = (0..m).map(|i| dynamics(i, law.orders[i]));
    let characteristic = polynomials.fold(law.hidden.clone(), |all, p| product(&all, &p));
    assert_eq!(characteristic.degree(), system.a.rows());
    for s in numbers() {
        assert_eq!(determinant(&shifted(&s, &closed.a)), value(&characteristic, &s));
        let Some(h) = transfer(&closed, &s) else { continue };
        assert!(determinant(&h) != int(0));
        for (number, block) in blocks.iter().enumerate() {
            for (&i, j) in block.iter().flat_map(|i| (0..m).map(move |j| (i, j))) {
                assert!(block.contains(&j) || h[(i, j)] == int(0), "output {i} answers to reference {j}");
            }
            let size = block.len();
            let own = M::from_fn(size, size, |i, j| h[(block[i], block[j])].clone());
            let operator = law.operators[number].evaluate(&s);
            assert_eq!(operator.multiply(&own), law.reference_gains[number]);
            let expected = block.iter().fold(int(1), |all, &i| all * value(&dynamics(i, law.orders[i]), &s));
            let found = determinant(&operator);
            assert!(found == expected || found == int(0) - expected);
        }
    }
    // At rest outputs and references agree; modes that outputs do not show may have their pole there.
    for (operator, gain) in law.operators.iter().zip(&law.reference_gains) {
        assert_eq!(&operator.evaluate(&int(0)), gain);
    }
}

fn same(a: &PolynomialMatrix, b: &PolynomialMatrix) {
    assert_eq!((a.rows(), a.columns()), (b.rows(), b.columns()));
    for i in 0..a.rows() {
        assert_eq!(a.row(i), b.row(i));
    }
}

fn check_parametrisation(system: &LinearSystem, flat: &FlatParametrisation) {
    let (n, m) = (system.a.rows(), system.c.rows());
    let pencil = PolynomialMatrix::from_fn(n, n, |i, j| {
        Polynomial::new(vec![int(0) - &system.a[(i, j)], int(i64::from(i == j))])
    });
    let constant = PolynomialMatrix::constant;
    same(&pencil.multiply(&flat.x), &constant(&system.b).multiply(&flat.u));
    same(
        &constant(&system.c).multiply(&flat.x).plus(&constant(&system.d).multiply(&flat.u)),
        &PolynomialMatrix::from_fn(m, m, |i, j| if i == j { flat.z.clone() } else { Polynomial::default() }),
    );
    // Lowest terms: no factor of z divides everything.
    if flat.z.degree() > 0 {
        for factor in flat.z.simple_factors() {
            let divides = |m: &PolynomialMatrix| {
                (0..m.rows()).all(|i| m.row(i).iter().all(|p| p.divide(&factor).1 == Polynomial::default()))
            };
            assert!(!(divides(&flat.x) && divides(&flat.u)), "{factor} in {}", flat.z);
        }
    }
    assert_eq!(flat.zeros.divide(&flat.z).1, Polynomial::default());
    // The zeros are the roots of det [sI − A, −B; C, D].
    let mut ratio = None;
    for s in numbers() {
        let system_matrix = M::from_fn(n + m, n + m, |i, j| match (i < n, j < n) {
            (true, true) => &s * int(i64::from(i == j)) - &system.a[(i, j)],
            (true, false) => int(0) - &system.b[(i, j - n)],
            (false, true) => system.c[(i - n, j)].clone(),
            (false, false) => system.d[(i - n, j - n)].clone(),
        });
        let zero = value(&flat.zeros, &s);
        if zero != int(0) {
            let found = determinant(&system_matrix) / zero;
            assert_eq!(*ratio.get_or_insert_with(|| found.clone()), found);
        }
    }
    assert!(ratio.is_none_or(|ratio| ratio != int(0)));
}

/// x and u of the planner are X/z and U/z times f(0)/f, exactly.
fn check_planner(flat: &FlatParametrisation, filters: &[Polynomial]) {
    let plan = planner(flat, filters).unwrap();
    assert_eq!(plan.states.len(), plan.a.rows());
    let n = flat.states.len();
    for s in numbers() {
        let Some(h) = transfer(&plan, &s) else { continue };
        let z = value(&flat.z, &s);
        let (x, u) = (flat.x.evaluate(&s), flat.u.evaluate(&s));
        let expected = M::from_fn(h.rows(), h.columns(), |i, j| {
            let of_output = if i < n { &x[(i, j)] } else { &u[(i - n, j)] };
            of_output / &z * value(&filters[j], &int(0)) / value(&filters[j], &s)
        });
        assert_eq!(h, expected);
    }
}

// ---- random systems -----------------------------------------------------------------------------------------------

#[test]
fn definitions_hold_and_extensions_exist_iff_the_rank_is_full() {
    let (mut possible, mut impossible, mut extended, mut combined) = (0, 0, 0, 0);
    for seed in 0..400 {
        let mut dice = Dice(seed);
        let (n, m) = (1 + dice.below(7), 1 + dice.below(3));
        let p = m + usize::from(dice.below(4) == 0) - usize::from(m > 1 && dice.below(6) == 0);
        let system = dice.system(n, m, p);
        check_structure(&system);
        let normal = numbers().iter().filter_map(|s| transfer(&system, s)).map(|h| rank(&h)).max().unwrap();
        assert_eq!(obstruction(&system).is_none(), normal == m, "seed {seed}");
        assert_eq!(dynamic_extension(&system).is_ok(), normal == m, "seed {seed}");
        assert_eq!(finest_blocks(&system).is_some(), normal == m, "seed {seed}");
        if normal < m {
            check_relations(&system);
            impossible += 1;
            continue;
        }
        possible += 1;
        check_extension(&system);
        let extension = dynamic_extension(&system).unwrap();
        extended += usize::from(!extension.integrators.is_empty());
        combined += usize::from(extension.integrators.iter().any(|i| !i.is_plain()));
        check_blocks(&system, &finest_blocks(&system).unwrap());
    }
    assert!(
        possible > 100 && impossible > 100 && extended > 5 && combined > 2,
        "{possible} {impossible} {extended} {combined}"
    );
}

#[test]
fn inverses_hold_on_random_square_systems() {
    let (mut flat_ones, mut with_zeros, mut planned) = (0, 0, 0);
    for seed in 0..300 {
        let mut dice = Dice(1000 + seed);
        let (n, m) = (1 + dice.below(7), 1 + dice.below(3));
        let system = match seed % 3 {
            // No zeros.
            0 => {
                let (outputs, inputs) =
                    (0..m).map(|_| (1 + dice.below(2), dice.below(2))).unzip::<_, _, Vec<_>, Vec<_>>();
                let system = mixed(&mut dice, &outputs, &inputs);
                dice.hidden(&system)
            }
            // Zeros at the eigenvalues of A - BC, far to the left.
            1 => {
                let system = dice.system(n, m, m);
                let a = system.a.plus(&M::identity(n).scale(&int(-12)));
                LinearSystem { a, d: M::identity(m), ..system }
            }
            _ => dice.system(n, m, m),
        };
        match flat_parametrisation(&system) {
            Err(error) => {
                assert!(matches!(error, FlatnessError::Dependent(_)));
                assert!(obstruction(&system).is_some());
            }
            Ok(flat) => {
                check_parametrisation(&system, &flat);
                flat_ones += usize::from(flat.is_flat());
                with_zeros += usize::from(flat.z.degree() > 0);
                let filters: Vec<Polynomial> =
                    flat.derivatives().iter().map(|&k| dynamics(1, k + dice.below(2))).collect();
                match planner(&flat, &filters) {
                    Ok(_) => {
                        check_planner(&flat, &filters);
                        planned += usize::from(flat.z.degree() > 0);
                    }
                    Err(error) => assert!(matches!(error, PlannerError::UnstableInverse { .. }), "{error}"),
                }
            }
        }
    }
    assert!(flat_ones > 30 && with_zeros > 30 && planned > 5, "{flat_ones} {with_zeros} {planned}");
}

/// `diag(1/s^k) M diag(1/s^l)`: all channels must wait for the slowest input, Σ (max l − l_j) integrators.
#[test]
fn expected_numbers_of_integrators() {
    for seed in 0..60 {
        let mut dice = Dice(2000 + seed);
        let m = 2 + dice.below(2);
        let outputs: Vec<usize> = (0..m).map(|_| 1 + dice.below(2)).collect();
        let inputs: Vec<usize> = (0..m).map(|_| dice.below(3)).collect();
        let system = mixed(&mut dice, &outputs, &inputs);
        let slowest = *inputs.iter().max().unwrap();
        let expected: usize = inputs.iter().map(|l| slowest - l).sum();
        let plain = dynamic_extension(&system).unwrap();
        let chains: Vec<(String, usize)> =
            (0..m).filter(|&j| inputs[j] < slowest).map(|j| (format!("u{}", j + 1), slowest - inputs[j])).collect();
        let mut found = plain.chains();
        found.sort();
        assert_eq!(found, chains, "seed {seed}: k {outputs:?}, l {inputs:?}");
        let hidden = dice.hidden(&system);
        let extension = dynamic_extension(&hidden).unwrap();
        assert_eq!(extension.integrators.len(), expected);
        assert_eq!(extension.relative_degrees, outputs.iter().map(|k| k + slowest).collect::<Vec<_>>());
        assert_eq!(finest_blocks(&hidden).unwrap().len() == m, expected == 0);
        check_extension(&hidden);
    }
}

/// y_{m+1} = y₁′ + 2 y₂ − y₃: the only relation is found as it is.
#[test]
fn a_relation_that_is_built_in_is_found() {
    for seed in 0..60 {
        let mut dice = Dice(3000 + seed);
        let outputs: Vec<usize> = (0..3).map(|_| 2 + dice.below(2)).collect();
        let inputs: Vec<usize> = (0..3).map(|_| dice.below(2)).collect();
        let base = mixed(&mut dice, &outputs, &inputs);
        let base = dice.hidden(&base);
        let weights = integers(&[&[0, 2, -1]]);
        let first = with_outputs(&base, &[0]).c.multiply(&base.a);
        let last = first.plus(&weights.multiply(&base.c));
        let c = M::from_fn(4, base.a.rows(), |i, j| if i < 3 { base.c[(i, j)].clone() } else { last[(0, j)].clone() });
        let system = LinearSystem::state_space(base.a.clone(), base.b.clone(), c);
        let found = obstruction(&system).unwrap();
        assert_eq!(
            found.relations,
            [vec![polynomial(&[0, 1]), polynomial(&[2]), polynomial(&[-1]), polynomial(&[-1])]]
        );
        assert_eq!(found.notation(&found.relations[0]), "s y1 + 2 y2 - y3 - y4 = 0");
        check_relations(&system);
        assert!(finest_blocks(&system).is_none() && dynamic_extension(&system).is_err());
    }
}

#[test]
fn blocks_that_are_built_in_are_found() {
    for seed in 0..40 {
        let mut dice = Dice(4000 + seed);
        let mut parts = Vec::new();
        let mut blocks = Vec::new();
        let mut count = 0;
        for _ in 0..1 + dice.below(3) {
            let size = 1 + dice.below(2);
            let outputs: Vec<usize> = (0..size).map(|_| 1 + dice.below(2)).collect();
            let inputs: Vec<usize> = (0..size).collect();
            parts.push(mixed(&mut dice, &outputs, &inputs));
            blocks.push((count..count + size).collect::<Vec<_>>());
            count += size;
        }
        let order = dice.permutation(count);
        let system = with_outputs(&dice.hidden(&side_by_side(&parts)), &order);
        let mut expected: Vec<Vec<usize>> =
            blocks.iter().map(|block| (0..count).filter(|&place| block.contains(&order[place])).collect()).collect();
        expected.sort();
        let found = finest_blocks(&system).unwrap();
        assert_eq!(found, expected, "seed {seed}");
        check_blocks(&system, &found);
        // Coarser blocks work too.
        check_blocks(&system, &[(0..count).collect()]);
    }
}

#[test]
fn more_than_eight_outputs_are_merged_into_blocks() {
    let mut dice = Dice(5000);
    let parts: Vec<LinearSystem> = [&[1][..], &[1, 1], &[1, 2], &[2], &[1, 1], &[1]]
        .iter()
        .map(|outputs| mixed(&mut dice, outputs, &(0..outputs.len()).collect::<Vec<_>>()))
        .collect();
    let found = finest_blocks(&side_by_side(&parts)).unwrap();
    assert_eq!(found, [vec![0], vec![1, 2], vec![3, 4], vec![5], vec![6, 7], vec![8]]);
}

#[test]
fn planners_of_the_steering_system() {
    let motors = ["wg_motor", "rk_motor"];
    for (model, length) in
        [(undamped(&["fs", "cj"]), 8), (steering(&motors, &["fs", "cj"]), 8), (steering(&motors, &["rk", "fs"]), 8)]
    {
        let flat = flat_parametrisation(&model.system).unwrap();
        let filters: Vec<Polynomial> = flat.derivatives().iter().map(|&k| dynamics(20, k)).collect();
        check_planner(&flat, &filters);
        assert_eq!(planner(&flat, &filters).unwrap().states.len(), length);
        let short: Vec<Polynomial> = flat.derivatives().iter().map(|&k| dynamics(20, k - 1)).collect();
        let needed = flat.derivatives()[0];
        let output = flat.outputs[0].clone();
        assert_eq!(planner(&flat, &short), Err(PlannerError::Degree { output, needed }));
    }
}

#[test]
fn what_is_wrong_is_refused() {
    let system = integrators(&[1, 2]);
    assert_eq!(decouple_blocks(&system, &[vec![0]], &dynamics), Err(BlockError::NotAPartition { output: 1 }));
    assert_eq!(decouple_blocks(&system, &[vec![0, 7]], &dynamics), Err(BlockError::NotAPartition { output: 7 }));
    assert_eq!(
        decouple_blocks(&system, &[vec![0], vec![1]], &|_, _| polynomial(&[1, 1])),
        Err(BlockError::Polynomial { output: 1, order: 2 })
    );
    let wide = LinearSystem::state_space(integers(&[&[0]]), integers(&[&[1, 2]]), integers(&[&[1]]));
    assert_eq!(flat_parametrisation(&wide), Err(FlatnessError::NotSquare { outputs: 1, inputs: 2 }));
    // y = x₁′ − x₁ of a double integrator: a zero at +1.
    let unstable =
        LinearSystem::state_space(integers(&[&[0, 1], &[0, 0]]), integers(&[&[0], &[1]]), integers(&[&[-1, 1]]));
    let flat = flat_parametrisation(&unstable).unwrap();
    let filter = [polynomial(&[1, 1])];
    let refused = PlannerError::UnstableInverse { polynomial: polynomial(&[-1, 1]), zeros: vec![(1.0, 0.0)] };
    assert_eq!(planner(&flat, &filter), Err(refused));
    let body = flat_parametrisation(&integrators(&[2])).unwrap();
    assert_eq!(planner(&body, &[]), Err(PlannerError::Count { found: 0, outputs: 1 }));
    for bad in [&[0, 0, 1][..], &[1, 2, 2], &[1, 0, 1], &[]] {
        assert_eq!(planner(&body, &[polynomial(bad)]), Err(PlannerError::Filter { output: "y1".into() }));
    }
    // A pole at the origin is given if it is asked for; references then act as they are.
    let law = decouple_blocks(&system, &[vec![0], vec![1]], &|_, order| dynamics(0, order - 1).clone()).unwrap_err();
    assert_eq!(law, BlockError::Polynomial { output: 0, order: 1 });
    let powers = |_: usize, order: usize| Polynomial::new([vec![int(0); order], vec![int(1)]].concat());
    let law = decouple_blocks(&system, &[vec![0], vec![1]], &powers).unwrap();
    assert_eq!((law.k, law.l), (M::zeros(2, 3), M::identity(2)));
}

#[test]
fn systems_with_no_states_outputs_or_inputs() {
    let empty =
        |n: usize, m: usize, p: usize| LinearSystem::state_space(M::identity(n), M::zeros(n, p), M::zeros(m, n));
    assert_eq!(finest_blocks(&empty(2, 0, 1)), Some(vec![]));
    assert_eq!(dynamic_extension(&empty(0, 0, 0)).unwrap().integrators, []);
    assert_eq!(flat_parametrisation(&empty(1, 0, 0)).unwrap().zeros, polynomial(&[-1, 1]));
    let blind = obstruction(&empty(2, 2, 0)).unwrap();
    assert_eq!((blind.rank, blind.relations.len()), (0, 2));
    let gain = LinearSystem { d: M::identity(2), ..empty(0, 2, 2) };
    assert!(flat_parametrisation(&gain).unwrap().is_flat());
    check_blocks(&gain, &[vec![0], vec![1]]);
}

/// Thirty states: dense systems and a chain of fifteen bodies.
#[test]
fn thirty_states() {
    let mut dice = Dice(6000);
    let chain = |m: &mut M| {
        for i in 0..15 {
            m[(i, 15 + i)] = int(1);
            for j in [i.wrapping_sub(1), i + 1].into_iter().filter(|&j| j < 15) {
                m[(15 + i, j)] = Rational::from_parts((10 + j as i64).into(), (7 + i as u64).into());
                m[(15 + i, i)] = &m[(15 + i, i)] - &m[(15 + i, j)];
            }
        }
    };
    let mut bodies = M::zeros(30, 30);
    chain(&mut bodies);
    let bodies = LinearSystem::state_space(
        bodies,
        M::from_fn(30, 2, |i, j| int(i64::from(i == 15 + 7 * j))),
        M::from_fn(2, 30, |i, j| int(i64::from(j == 6 + 8 * i))),
    );
    let dense = LinearSystem::state_space(dice.matrix(30, 30, 9), dice.matrix(30, 3, 9), dice.matrix(3, 30, 9));
    for (name, system) in [("bodies", &bodies), ("dense", &dense)] {
        let start = std::time::Instant::now();
        let lap = |what: &str| println!("{name}: {what} after {:?}", start.elapsed());
        let flat = flat_parametrisation(system).unwrap();
        lap("parametrisation");
        let extension = dynamic_extension(system).unwrap();
        lap("extension");
        let blocks = finest_blocks(system).unwrap();
        lap("blocks");
        let law = decouple_blocks(system, &blocks, &dynamics).unwrap();
        lap("law");
        assert_eq!(law.hidden, flat.zeros);
        assert!(extension.integrators.len() <= 30);
    }
}
