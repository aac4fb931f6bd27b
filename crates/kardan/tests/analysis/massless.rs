//! Motions without inertia eliminated exactly: the transfer matrix stays, and small inertias lead to the same limit.

use kardan::analysis::{Eliminated, LinearSystem, MasslessError, eliminate_massless, massless_direction};
use kardan::assemble::assemble;
use kardan::model;
use kardan::num::{Matrix, Rational, eigenvalues};
use kardan::reduce::{LinearModel, linearise, reduce};
use proptest::prelude::*;

type M = Matrix<Rational>;

fn q(numerator: i64, denominator: u64) -> Rational {
    Rational::from_parts(numerator.into(), denominator.into())
}

fn ints(rows: &[&[i64]]) -> M {
    Matrix::from_fn(rows.len(), rows.first().map_or(0, |row| row.len()), |i, j| q(rows[i][j], 1))
}

fn names(letters: &str) -> Vec<String> {
    letters.split_whitespace().map(String::from).collect()
}

fn minus(m: &M) -> M {
    m.scale(&q(-1, 1))
}

#[derive(Debug, Clone)]
struct Mechanics {
    coordinates: Vec<String>,
    h: M,
    d: M,
    s: M,
    f: M,
    c_pos: M,
    c_vel: M,
    through: M,
}

impl Mechanics {
    /// Angles are the outputs.
    fn new(coordinates: &str, h: M, d: M, s: M, f: M) -> Self {
        let (r, m) = (h.rows(), f.columns());
        let (c_pos, c_vel) = (Matrix::identity(r), Matrix::zeros(r, r));
        Self { coordinates: names(coordinates), h, d, s, f, c_pos, c_vel, through: Matrix::zeros(r, m) }
    }

    fn eliminate(&self) -> Result<Eliminated, MasslessError> {
        let inputs: Vec<String> = (1..=self.f.columns()).map(|i| format!("u{i}")).collect();
        let outputs: Vec<String> = (1..=self.c_pos.rows()).map(|i| format!("y{i}")).collect();
        let (r, m) = (self.h.rows(), inputs.len());
        let quarters =
            |parts: [&M; 4]| Matrix::from_fn(2 * r, 2 * r, |i, j| parts[2 * (i / r) + j / r][(i % r, j % r)].clone());
        let (zero, one) = (Matrix::zeros(r, r), Matrix::identity(r));
        let pencil = LinearSystem {
            states: (1..=2 * r).map(|i| format!("x{i}")).collect(),
            e: quarters([&one, &zero, &zero, &self.h]),
            a: quarters([&zero, &one, &minus(&self.s), &minus(&self.d)]),
            b: Matrix::from_fn(2 * r, m, |i, j| if i < r { Rational::ZERO } else { self.f[(i - r, j)].clone() }),
            c: Matrix::from_fn(outputs.len(), 2 * r, |i, j| {
                if j < r { self.c_pos[(i, j)].clone() } else { self.c_vel[(i, j - r)].clone() }
            }),
            d: self.through.clone(),
            inputs,
            outputs,
            degrees_of_freedom: None,
        };
        eliminate_massless(&self.coordinates, &pencil)
    }

    /// `(C₀ + s C₁)(s²H + sD + S)⁻¹F + D₀`.
    fn transfer(&self, at: &Rational) -> Option<M> {
        let pencil = self.h.scale(&(at * at)).plus(&self.d.scale(at)).plus(&self.s);
        Some(self.c_pos.plus(&self.c_vel.scale(at)).multiply(&pencil.solve(&self.f)?).plus(&self.through))
    }
}

fn transfer(system: &LinearSystem, at: &Rational) -> Option<M> {
    let pencil = system.e.scale(at).plus(&minus(&system.a));
    Some(system.c.multiply(&pencil.solve(&system.b)?).plus(&system.d))
}

fn points() -> Vec<Rational> {
    vec![q(1, 1), q(-7, 3), q(22, 5), q(1001, 13), q(1, 97), q(-13, 11)]
}

/// At rational points that are no poles, exactly.
fn same_transfer(mechanics: &Mechanics, eliminated: &Eliminated) {
    let mut compared = 0;
    for at in points() {
        if let (Some(before), Some(after)) = (mechanics.transfer(&at), transfer(&eliminated.system, &at)) {
            assert_eq!(before, after, "at s = {at}");
            compared += 1;
        }
    }
    assert!(compared >= 3, "too many of the points are poles");
}

fn poles(system: &LinearSystem) -> Vec<(f64, f64)> {
    eigenvalues(&system.e.solve(&system.a).unwrap().to_f64()).unwrap()
}

#[test]
fn a_damped_massless_shaft_keeps_its_angle_as_a_state() {
    // Body a, massless b; spring and damper between them, damper at b.
    let m = Mechanics::new(
        "a b",
        ints(&[&[3, 0], &[0, 0]]),
        ints(&[&[1, -1], &[-1, 3]]),
        ints(&[&[5, -5], &[-5, 5]]),
        ints(&[&[0], &[1]]),
    );
    let out = m.eliminate().unwrap();
    assert_eq!(out.system.states, ["a.phi", "b.phi", "a.w"]);
    assert_eq!((out.removed.join(" "), out.definitions.len()), ("b.w".into(), 0));
    same_transfer(&m, &out);
    // The speed of b follows its torque at once: a feedthrough.
    let speeds = Mechanics { c_pos: Matrix::zeros(2, 2), c_vel: Matrix::identity(2), ..m };
    let out = speeds.eliminate().unwrap();
    assert_eq!(out.system.d, Matrix::from_fn(2, 1, |i, _| if i == 1 { q(1, 3) } else { q(0, 1) }));
    same_transfer(&speeds, &out);
}

#[test]
fn an_undamped_massless_shaft_is_eliminated_statically() {
    let m = Mechanics::new(
        "a b",
        ints(&[&[3, 0], &[0, 0]]),
        ints(&[&[2, 0], &[0, 0]]),
        ints(&[&[5, -5], &[-5, 7]]),
        ints(&[&[0], &[1]]),
    );
    let out = m.eliminate().unwrap();
    assert_eq!(out.system.states, ["a.phi", "a.w"]);
    assert_eq!(out.system.d[(1, 0)], q(1, 7));
    same_transfer(&m, &out);
    // Its speed would need the derivative of the torque.
    let speeds = Mechanics { c_pos: Matrix::zeros(2, 2), c_vel: Matrix::identity(2), ..m };
    match speeds.eliminate().unwrap_err() {
        MasslessError::InputDerivative { output, input, order, direction } => {
            assert_eq!((output.as_str(), input.as_str(), order), ("y2", "u1", 1));
            assert_eq!(direction, [("b.w".to_string(), q(1, 1))]);
        }
        other => panic!("{other}"),
    }
    // Without a torque on it the speed is that of the spring's end: no derivative.
    let driven = Mechanics { f: ints(&[&[1], &[0]]), ..speeds };
    same_transfer(&driven, &driven.eliminate().unwrap());
}

#[test]
fn a_massless_direction_across_coordinates_gives_a_combination() {
    // Only the sum of the angles has inertia, and both shafts are driven against their dampers.
    let m = Mechanics::new(
        "a b",
        ints(&[&[1, 1], &[1, 1]]),
        ints(&[&[2, 0], &[0, 3]]),
        ints(&[&[1, 0], &[0, 4]]),
        ints(&[&[1, 0], &[0, 1]]),
    );
    let out = m.eliminate().unwrap();
    assert_eq!(out.system.states, ["a.phi", "b.phi", "z1"]);
    assert_eq!(out.definitions, [("z1".to_string(), vec![("a.w".to_string(), q(1, 1)), ("b.w".to_string(), q(1, 1))])]);
    assert_eq!(out.removed, ["a.w", "b.w"]);
    same_transfer(&m, &out);
    // Undriven, an original speed will do.
    let quiet = Mechanics { f: Matrix::zeros(2, 2), ..m };
    let out = quiet.eliminate().unwrap();
    assert_eq!((out.system.states.join(" "), out.definitions.len()), ("a.phi b.phi a.w".into(), 0));
    assert_eq!(
        massless_direction(&quiet.coordinates, &quiet.h),
        Some(vec![("a".into(), q(1, 1)), ("b".into(), q(-1, 1))])
    );
}

#[test]
fn regular_inertia_changes_nothing() {
    let (h, d) = (ints(&[&[2, 1], &[1, 2]]), ints(&[&[1, 0], &[0, 0]]));
    let m = Mechanics::new("a b", h.clone(), d, ints(&[&[3, -3], &[-3, 3]]), ints(&[&[1], &[0]]));
    let out = m.eliminate().unwrap();
    assert_eq!(out.system.states, ["a.phi", "b.phi", "a.w", "b.w"]);
    assert_eq!((out.system.degrees_of_freedom, out.removed.len()), (Some(2), 0));
    for (i, j) in [(0, 0), (0, 1), (1, 1)] {
        assert_eq!(out.system.e[(2 + i, 2 + j)], h[(i, j)]);
    }
    assert_eq!(massless_direction(&m.coordinates, &h), None);
    same_transfer(&m, &out);
}

#[test]
fn what_cannot_be_eliminated_is_refused_with_its_direction() {
    let zero = || Matrix::zeros(2, 2);
    let free = Mechanics::new("a b", ints(&[&[1, 0], &[0, 0]]), zero(), ints(&[&[1, 0], &[0, 0]]), ints(&[&[1], &[0]]));
    assert_eq!(free.eliminate().unwrap_err(), MasslessError::Undetermined { direction: vec![("b".into(), q(1, 1))] });
    assert!(free.eliminate().unwrap_err().to_string().contains("along `b` is not determined"));
    // No common kernel, but S is indefinite: det(s²H + S) = 0 for all s.
    let singular = Mechanics::new("a b", zero(), zero(), ints(&[&[1, 1], &[1, 1]]), ints(&[&[1], &[0]]));
    assert!(matches!(singular.eliminate().unwrap_err(), MasslessError::Undetermined { .. }));
    let (h, s) = (ints(&[&[1, 0], &[0, 0]]), ints(&[&[0, 0], &[0, 0]]));
    let weak = Mechanics::new("a b", h, ints(&[&[1, 0], &[0, 0]]), s, ints(&[&[1], &[1]]));
    assert!(matches!(weak.eliminate().unwrap_err(), MasslessError::Undetermined { .. }));
    let rigid = Mechanics::new("a", ints(&[&[0]]), ints(&[&[0]]), ints(&[&[2]]), ints(&[&[1]]));
    assert_eq!(rigid.eliminate().unwrap_err(), MasslessError::Static);
    // The massless shaft follows its torque without delay through an indefinite coupling to the body's acceleration.
    let inverse =
        Mechanics::new("a b", ints(&[&[1, 0], &[0, 0]]), zero(), ints(&[&[0, 1], &[1, 0]]), ints(&[&[0], &[1]]));
    match inverse.eliminate() {
        Err(MasslessError::Static | MasslessError::InputDerivative { .. }) => {}
        other => panic!("{other:?}"),
    }
}

// ---- section 6.2 of the source: the harmonic drive with a spring ----------------------------------------------------

/// Reduced matrices with the inertias of the circular spline and the flexspline and the damping of the torsion bar given.
fn drive(circular_spline: &str, flexspline: &str, damped: bool) -> LinearModel {
    let source = model::builtin("harmonic-drive-spring").unwrap().source;
    let mut text = source
        .replace("[shaft.cs]             # massless", &format!("[shaft.cs]\ninertia = \"{circular_spline} kg m^2\"\n"));
    let body = "[shaft.fs]\ninertia = \"50000 kg mm^2\"\ndamping = \"0.01 N m s/rad\"";
    assert!(text != source && text.contains(body));
    let damping = if damped { "0.01" } else { "0" };
    text = text
        .replace(body, &format!("[shaft.fs]\ninertia = \"{flexspline} kg m^2\"\ndamping = \"{damping} N m s/rad\""));
    let (document, diagnostics) = model::read(&text);
    assert!(diagnostics.is_empty(), "{diagnostics:?}");
    let first = &document.variant_settings()[0];
    let (model, diagnostics) = document.model_with(&first.settings, first.controls.as_deref());
    assert!(diagnostics.is_empty(), "{diagnostics:?}");
    let named = ["wg", "rk", "fs"].map(String::from);
    let reduced = reduce(assemble(&model.all_coordinates, &model.terms), Some(&named)).unwrap();
    let position = vec![0.0; reduced.degrees_of_freedom()];
    linearise(&reduced, &position)
}

fn mechanics(model: &LinearModel) -> Mechanics {
    let r = model.coordinates.len();
    Mechanics {
        coordinates: model.coordinates.clone(),
        h: model.inertia.clone(),
        d: model.damping.clone(),
        s: model.stiffness.clone(),
        f: model.input.clone(),
        c_pos: Matrix::identity(r),
        c_vel: Matrix::zeros(r, r),
        through: Matrix::zeros(r, model.inputs.len()),
    }
}

/// As in section 6.2 the circular spline has no inertia: no reduced direction is without, and small J_cs lead to it.
#[test]
fn the_massless_circular_spline_is_the_limit() {
    let limit = mechanics(&drive("0", "0.05", true)).eliminate().unwrap();
    assert!(limit.removed.is_empty());
    let expected = poles(&limit.system);
    let mut last = f64::INFINITY;
    for small in ["1e-4", "1e-6", "1e-8"] {
        let found = poles(&mechanics(&drive(small, "0.05", true)).eliminate().unwrap().system);
        let gap = found.iter().zip(&expected).map(|(a, b)| (a.0 - b.0).hypot(a.1 - b.1)).fold(0.0, f64::max);
        assert!(gap < 0.2 * last, "{small}: {gap} after {last}");
        last = gap;
    }
}

/// With the flexspline massless too a reduced direction has no inertia; its fast pole runs away, the others converge.
#[test]
fn a_massless_flexspline_is_the_limit() {
    let model = drive("0", "0", true);
    assert_eq!(massless_direction(&model.coordinates, &model.inertia), Some(vec![("fs".into(), q(1, 1))]));
    let m = mechanics(&model);
    let limit = m.eliminate().unwrap();
    assert_eq!((limit.system.states.len(), limit.removed.join(" ")), (5, "fs.w".into()));
    same_transfer(&m, &limit);
    let expected = poles(&limit.system);
    let size = expected.iter().map(|z| z.0.hypot(z.1)).fold(0.0, f64::max);
    let mut last = f64::INFINITY;
    for small in ["1e-7", "1e-9", "1e-11"] {
        let found = poles(&mechanics(&drive("0", small, true)).eliminate().unwrap().system);
        let fast = found.last().unwrap();
        assert!(fast.0 < -10.0 * size, "{fast:?}");
        let gap = found.iter().zip(&expected).map(|(a, b)| (a.0 - b.0).hypot(a.1 - b.1)).fold(0.0, f64::max);
        assert!(gap < 0.2 * last, "{small}: {gap} after {last}: {found:?} {expected:?}");
        last = gap;
    }
    assert!(last < 1e-4 * size, "{last}");
}

// ---- random systems -------------------------------------------------------------------------------------------------

fn entries(count: usize) -> impl Strategy<Value = Vec<i64>> {
    prop::collection::vec(-2i64..3, count)
}

/// `Σ a aᵀ` of rank at most `rank`.
fn semidefinite(r: usize, rank: usize) -> impl Strategy<Value = M> {
    entries(r * rank).prop_map(move |x| {
        let a = Matrix::from_fn(r, rank, |i, j| q(x[i * rank + j], 1));
        a.multiply(&a.transpose())
    })
}

fn random() -> impl Strategy<Value = Mechanics> {
    (1usize..5, 0usize..3, 0usize..4, 0usize..4, 1usize..3).prop_flat_map(|(r, h, d, s, m)| {
        let full = move |rows: usize, columns: usize| {
            entries(rows * columns).prop_map(move |x| Matrix::from_fn(rows, columns, |i, j| q(x[i * columns + j], 1)))
        };
        (semidefinite(r, h), semidefinite(r, d), semidefinite(r, s), full(r, m), full(2, r), full(2, r), full(2, m))
            .prop_map(move |(h, d, s, f, c_pos, c_vel, through)| Mechanics {
                coordinates: (1..=r).map(|i| format!("q{i}")).collect(),
                h,
                d,
                s,
                f,
                c_pos,
                c_vel,
                through,
            })
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// What is eliminated has the transfer matrix of before and a regular E; what is refused could not be.
    #[test]
    fn the_transfer_matrix_stays(m in random()) {
        let regular = points().iter().any(|at| m.transfer(at).is_some());
        match m.eliminate() {
            Ok(out) => {
                prop_assert!(regular);
                prop_assert!(out.system.e.solve(&Matrix::identity(out.system.states.len())).is_some());
                for at in points() {
                    if let (Some(before), Some(after)) = (m.transfer(&at), transfer(&out.system, &at)) {
                        prop_assert_eq!(before, after);
                    }
                }
                let retained = out.system.states.len() - out.definitions.len();
                prop_assert_eq!(retained + out.removed.len(), 2 * m.coordinates.len());
            }
            Err(MasslessError::Undetermined { direction }) => {
                prop_assert!(!regular);
                prop_assert!(!direction.is_empty());
            }
            Err(MasslessError::InputDerivative { direction, .. }) => {
                prop_assert!(!direction.is_empty());
                // Improper: it grows with s.
                let size = |at| m.transfer(&q(at, 1)).map(|g| {
                    g.to_f64().as_slice().iter().map(|x| x.abs()).fold(0.0, f64::max)
                });
                if let (Some(near), Some(far)) = (size(10_000_019), size(1_000_000_000_039)) {
                    prop_assert!(far > 1000.0 * near, "{} {}", near, far);
                }
            }
            Err(MasslessError::Static) => {
                // det(s²H + sD + S) does not depend on s.
                let one = |at: Rational| m.transfer(&at);
                prop_assert!(one(q(1, 1)).is_some() && one(q(5, 7)).is_some());
            }
        }
    }

    /// States that keep a name are that quantity: as outputs they give the state itself.
    #[test]
    fn a_state_with_an_original_name_is_that_quantity(m in random()) {
        if let Ok(out) = m.eliminate() {
            let r = m.coordinates.len();
            for (k, state) in out.system.states.iter().enumerate() {
                let (coordinate, kind) = match state.rsplit_once('.') {
                    Some((name, kind)) => (m.coordinates.iter().position(|c| c == name).unwrap(), kind),
                    None => continue,
                };
                let pick = Matrix::from_fn(1, r, |_, j| q(i64::from(j == coordinate), 1));
                let zero = Matrix::zeros(1, r);
                let (c_pos, c_vel) = if kind == "phi" { (pick, zero) } else { (zero, pick) };
                let single_output = Mechanics { c_pos, c_vel, through: Matrix::zeros(1, m.f.columns()), ..m.clone() };
                let system = single_output.eliminate().unwrap().system;
                let unit = Matrix::from_fn(1, system.states.len(), |_, j| q(i64::from(j == k), 1));
                prop_assert_eq!(&system.c, &unit);
                prop_assert_eq!(&system.d, &Matrix::zeros(1, m.f.columns()));
            }
        }
    }
}
