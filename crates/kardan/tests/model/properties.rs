//! Properties of random drivetrains: trees of shafts joined by gears, planetary gears, harmonic drives, universal joints,
//! springs and dampers, with massless shafts among them.
//!
//! The model is written twice: as the text of a model file for the library, and as [`Tree`], from which this file builds
//! the implicit equations (4.19) itself.

use crate::common::multipliers::Multipliers;
use crate::common::*;
use kardan::expr::{Expr, Floating, lower};
use kardan::num::{Definiteness, Rational, definiteness, rational_from_f64};
use kardan::reduce::{Acting, Dynamics, Kinematics, Motion, Reduced, linearise};
use kardan::results::Run;
use kardan::units::Dimension;
use proptest::prelude::*;

/// What joins a shaft to earlier ones.
#[derive(Debug, Clone)]
enum Link {
    Spring { stiffness: f64, damping: f64, friction: f64, rest: f64 },
    Gear { ratio: f64, offset: f64 },
    Joint { degrees: f64, phase: f64, driven: bool },
    Planetary { other: usize, coefficients: [f64; 3] },
    HarmonicDrive { other: usize, ratio: f64, offset: f64 },
}

/// A shaft and what joins it to the tree; the link of the first shaft is not used.
#[derive(Debug, Clone)]
struct Node {
    inertia: f64,
    damping: f64,
    friction: f64,
    parent: usize,
    link: Link,
}

#[derive(Debug, Clone)]
struct Tree {
    nodes: Vec<Node>,
    /// For the order of tables and names.
    shuffle: Vec<usize>,
    /// Reduced positions and speeds, torques of the motor and the disturbance; more than enough of each.
    position: Vec<f64>,
    speed: Vec<f64>,
    torque: [f64; 2],
}

/// A decimal with two digits, so that text and number are the same.
fn decimal(range: std::ops::RangeInclusive<i32>) -> impl Strategy<Value = f64> {
    range.prop_map(|x| f64::from(x) / 100.0)
}

fn node(rough: bool) -> impl Strategy<Value = Node> {
    let ratio = || prop_oneof![decimal(25..=400), decimal(-400..=-25)];
    let friction = move || if rough { decimal(0..=50).boxed() } else { Just(0.0).boxed() };
    let link =
        prop_oneof![
            (decimal(1..=5000), decimal(0..=100), friction(), decimal(-50..=50))
                .prop_map(|(stiffness, damping, friction, rest)| Link::Spring { stiffness, damping, friction, rest }),
            (ratio(), decimal(-100..=100)).prop_map(|(ratio, offset)| Link::Gear { ratio, offset }),
            (decimal(-4000..=4000), decimal(-300..=300), any::<bool>())
                .prop_map(|(degrees, phase, driven)| Link::Joint { degrees, phase, driven }),
            (any::<usize>(), [ratio(), ratio(), ratio()])
                .prop_map(|(other, coefficients)| Link::Planetary { other, coefficients }),
            (any::<usize>(), decimal(100..=900), decimal(-100..=100))
                .prop_map(|(other, ratio, offset)| Link::HarmonicDrive { other, ratio, offset }),
        ];
    let inertia = prop_oneof![3 => decimal(5..=300), 1 => Just(0.0)];
    (inertia, decimal(0..=50), friction(), any::<usize>(), link)
        .prop_map(|(inertia, damping, friction, parent, link)| Node { inertia, damping, friction, parent, link })
}

fn tree(most: usize, rough: bool) -> impl Strategy<Value = Tree> {
    let state = || prop::collection::vec(-3.0..3.0, 10);
    (prop::collection::vec(node(rough), 2..=most), any::<u64>(), state(), state(), [-9.0..9.0, -9.0..9.0]).prop_map(
        |(mut nodes, seed, position, speed, torque)| {
            for k in 0..nodes.len() {
                let spring = k == 0 || matches!(nodes[k].link, Link::Spring { .. });
                let node = &mut nodes[k];
                node.parent %= k.max(1);
                // What moves on its own needs a mass.
                if spring && node.inertia == 0.0 {
                    node.inertia = 0.35;
                }
                // Three shafts need two earlier ones.
                if let Link::Planetary { other, .. } | Link::HarmonicDrive { other, .. } = &mut node.link {
                    if k < 2 {
                        node.link = Link::Gear { ratio: -2.5, offset: 0.1 };
                    } else {
                        *other = (node.parent + 1 + *other % (k - 1)) % k;
                    }
                }
            }
            let mut shuffle: Vec<usize> = (0..3 * nodes.len() + 2).collect();
            let mut state = seed;
            for k in (1..shuffle.len()).rev() {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                shuffle.swap(k, (state >> 33) as usize % (k + 1));
            }
            Tree { nodes, shuffle, position, speed, torque }
        },
    )
}

/// C of a joint and its γ′, γ″ at an angle of the driving shaft, by (6.106).
fn joint(degrees: f64, phase: f64, driving: f64) -> (f64, f64, f64) {
    let (c, theta) = (degrees.to_radians().cos(), driving + phase);
    let r = theta.cos().powi(2) + (c * theta.sin()).powi(2);
    (c, c / r, c * (1.0 - c * c) * (2.0 * theta).sin() / (r * r))
}

impl Tree {
    /// `s0`, `s1`, … or names in another order.
    fn names(&self, renamed: bool) -> Vec<String> {
        let letter = |k: usize| char::from(b'a' + self.shuffle.iter().position(|x| *x == k).expect("a shuffle") as u8);
        (0..self.nodes.len()).map(|k| if renamed { format!("{}{k}", letter(k)) } else { format!("s{k}") }).collect()
    }

    /// Names of the links, in an order of their own.
    fn link_name(&self, k: usize, renamed: bool) -> String {
        if renamed { format!("link{}", self.shuffle[k]) } else { format!("l{k}") }
    }

    /// Without offsets and phases, so that any coordinates at zero mean all shafts at zero.
    fn aligned(mut self) -> Self {
        for node in &mut self.nodes {
            match &mut node.link {
                Link::Gear { offset, .. } | Link::HarmonicDrive { offset, .. } => *offset = 0.0,
                Link::Joint { phase, .. } => *phase = 0.0,
                Link::Spring { .. } | Link::Planetary { .. } => {}
            }
        }
        self
    }

    /// Shafts that move on their own: the first and those behind springs.
    fn free(&self) -> Vec<usize> {
        let spring = |k: &usize| *k == 0 || matches!(self.nodes[*k].link, Link::Spring { .. });
        (0..self.nodes.len()).filter(spring).collect()
    }

    /// The model file.
    fn text(&self, renamed: bool, shuffled: bool, coordinates: bool) -> String {
        let names = self.names(renamed);
        let mut tables = Vec::new();
        for (k, node) in self.nodes.iter().enumerate() {
            tables.push(format!(
                "[shaft.{}]\ninertia = \"{} kg m^2\"\ndamping = \"{} N m s/rad\"\nfriction = \"{} N m\"\n",
                names[k], node.inertia, node.damping, node.friction
            ));
            if k == 0 {
                continue;
            }
            let (own, parent, link) = (&names[k], &names[node.parent], self.link_name(k, renamed));
            tables.push(match &node.link {
                Link::Spring { stiffness, damping, friction, rest } => format!(
                    "[spring_damper.{link}]\nshaft_1 = \"{own}\"\nshaft_2 = \"{parent}\"\n\
                     stiffness = \"{stiffness} N m/rad\"\ndamping = \"{damping} N m s/rad\"\nfriction = \"{friction} N m\"\n\
                     rest = \"{rest} rad\"\n"
                ),
                Link::Gear { ratio, offset } => format!(
                    "[gear.{link}]\nshaft_1 = \"{own}\"\nshaft_2 = \"{parent}\"\nratio = {ratio:?}\noffset = \"{offset} rad\"\n"
                ),
                Link::Joint { degrees, phase, driven } => {
                    let (one, two) = if *driven { (own, parent) } else { (parent, own) };
                    format!(
                        "[universal_joint.{link}]\nshaft_1 = \"{one}\"\nshaft_2 = \"{two}\"\nangle = \"{degrees} deg\"\n\
                         phase = \"{phase} rad\"\n"
                    )
                }
                Link::Planetary { other, coefficients: [a, b, c] } => format!(
                    "[planetary.{link}]\ncoefficients = {{ {own} = {a:?}, {parent} = {b:?}, {} = {c:?} }}\n",
                    names[*other]
                ),
                Link::HarmonicDrive { other, ratio, offset } => format!(
                    "[harmonic_drive.{link}]\nwave_generator = \"{}\"\ncircular_spline = \"{parent}\"\n\
                     flexspline = \"{own}\"\nratio = {ratio:?}\noffset = \"{offset} rad\"\n",
                    names[*other]
                ),
            });
        }
        tables.push(format!("[motor.m]\nshaft = \"{}\"\n", names[0]));
        tables.push(format!("[disturbance.load]\nshaft = \"{}\"\n", names[self.nodes.len() - 1]));
        if shuffled {
            let place = |k: usize| self.shuffle.iter().position(|x| *x == k);
            let mut order: Vec<usize> = (0..tables.len()).collect();
            order.sort_by_key(|k| place(*k));
            tables = order.into_iter().map(|k| tables[k].clone()).collect();
        }
        let mut out = String::new();
        if coordinates {
            let free: Vec<String> = self.free().iter().map(|k| format!("\"{}\"", names[*k])).collect();
            out = format!("[model]\ncoordinates = [{}]\n", free.join(", "));
        }
        out + &tables.concat()
    }

    /// Torque steps, a pulse on the other end, and initial speeds if the coordinates are named.
    fn scenario(&self, initial: bool) -> String {
        let [motor, load] = self.torque.map(|x| (100.0 * x).round() / 100.0);
        let mut out = "[scenario]\nduration = \"0.4 s\"\noutput_step = \"10 ms\"\n".to_string();
        if initial {
            let names = self.names(false);
            let free = self.free();
            let entries =
                free.iter().enumerate().map(|(k, s)| format!("\"{}.w\" = \"{} rad/s\"", names[*s], self.speed[k]));
            out += &format!("initial = {{ {} }}\n", entries.collect::<Vec<_>>().join(", "));
        }
        for (time, signal, value) in [("0.05", "m.tau", motor), ("0.1", "load", load), ("0.2", "load", 0.0)] {
            out += &format!("[[scenario.event]]\nat = \"{time} s\"\nsignal = \"{signal}\"\nto = \"{value} N m\"\n");
        }
        out
    }

    /// Rows of J (by link) and entries of j at angles and speeds of all shafts.
    fn constraints(&self, angles: &[f64], speeds: &[f64]) -> Vec<(usize, Vec<f64>, f64)> {
        let mut out = Vec::new();
        for (k, node) in self.nodes.iter().enumerate().skip(1) {
            let mut row = vec![0.0; self.nodes.len()];
            let mut bias = 0.0;
            match &node.link {
                Link::Spring { .. } => continue,
                Link::Gear { ratio, .. } => (row[k], row[node.parent]) = (1.0, -ratio),
                Link::Joint { degrees, phase, driven } => {
                    let (one, two) = if *driven { (k, node.parent) } else { (node.parent, k) };
                    let (_, slope, curvature) = joint(*degrees, *phase, angles[two]);
                    (row[one], row[two]) = (1.0, -slope);
                    bias = -curvature * speeds[two] * speeds[two];
                }
                Link::Planetary { other, coefficients: [a, b, c] } => {
                    (row[k], row[node.parent], row[*other]) = (*a, *b, *c);
                }
                Link::HarmonicDrive { other, ratio, .. } => {
                    (row[k], row[node.parent], row[*other]) = (*ratio, -(ratio + 1.0), 1.0);
                }
            }
            out.push((k, row, bias));
        }
        out
    }

    /// c(q) of every constraint; of a joint in the form (6.100), free of branches.
    fn residuals(&self, angles: &[f64]) -> Vec<f64> {
        let mut out = Vec::new();
        for (k, node) in self.nodes.iter().enumerate().skip(1) {
            let parent = angles[node.parent];
            out.push(match &node.link {
                Link::Spring { .. } => continue,
                Link::Gear { ratio, offset } => angles[k] - ratio * parent + offset,
                Link::Joint { degrees, phase, driven } => {
                    let (one, two) = if *driven { (angles[k], parent) } else { (parent, angles[k]) };
                    let (c, theta) = (degrees.to_radians().cos(), two + phase);
                    one.sin() * theta.cos() - c * one.cos() * theta.sin()
                }
                Link::Planetary { other, coefficients: [a, b, c] } => a * angles[k] + b * parent + c * angles[*other],
                Link::HarmonicDrive { other, ratio, offset } => {
                    angles[*other] - (ratio + 1.0) * parent + ratio * angles[k] + offset
                }
            });
        }
        out
    }

    /// Torques on all shafts but those of constraints and Coulomb friction.
    fn torques(&self, angles: &[f64], speeds: &[f64]) -> Vec<f64> {
        let mut out: Vec<f64> = self.nodes.iter().zip(speeds).map(|(node, w)| -node.damping * w).collect();
        for (k, node) in self.nodes.iter().enumerate().skip(1) {
            if let Link::Spring { stiffness, damping, rest, .. } = &node.link {
                let p = node.parent;
                let torque = stiffness * (angles[k] - angles[p] - rest) + damping * (speeds[k] - speeds[p]);
                out[k] -= torque;
                out[p] += torque;
            }
        }
        out[0] += self.torque[0];
        out[self.nodes.len() - 1] += self.torque[1];
        out
    }

    /// Where each shaft stands in the library's order.
    fn places(&self, shafts: &[String]) -> Vec<usize> {
        self.names(false).iter().map(|name| shafts.iter().position(|s| s == name).expect("a shaft")).collect()
    }
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(1.0, |max, x| max.max(x.abs()))
}

/// The multipliers by [`Motion::multipliers`] at the point of a tree.
fn multipliers_of_expressions(reduced: &Reduced, tree: &Tree, result: &Explicit) -> Vec<f64> {
    let mut motion = Motion::new(reduced);
    let r = reduced.degrees_of_freedom();
    let mut arguments: Vec<f64> = tree.position[..r].iter().chain(&tree.speed[..r]).copied().collect();
    let mut symbols = motion.symbols.clone();
    let mut more = |name: &str, values: &[f64]| -> Vec<Expr> {
        let new = |k| motion.graph.new_symbol(format!("{name}.{k}"), Dimension::NONE);
        let new: Vec<Expr> = (0..values.len()).map(new).collect();
        symbols.extend(new.iter().filter_map(|expr| motion.graph.symbol_of(*expr)));
        arguments.extend(values);
        new
    };
    let (accelerations, inputs) =
        (more("acceleration", &result.reduced), more("torque", &[tree.torque[1], tree.torque[0]]));
    let acting = Acting { accelerations: &accelerations, inputs: &inputs, frictions: &[] };
    let exprs = motion.multipliers(reduced, acting);
    lower(&motion.graph, &exprs, &mut Floating::<f64>::default(), |symbol| {
        arguments[symbols.iter().position(|other| *other == symbol).expect("given")]
    })
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 150, failure_persistence: None, ..ProptestConfig::default() })]

    /// The reduced inertia is positive definite and everything symmetric, exactly, at any position; J K = 0 exactly.
    #[test]
    fn reduced_matrices_are_symmetric_and_definite(tree in tree(7, true)) {
        let reduced = first(&tree.text(false, false, false)).reduced.clone();
        let r = reduced.degrees_of_freedom();
        prop_assert_eq!(r, tree.free().len());
        let model = linearise(&reduced, &tree.position[..r]);
        for matrix in [&model.inertia, &model.damping, &model.stiffness] {
            prop_assert_eq!(matrix, &matrix.transpose());
        }
        prop_assert_eq!(definiteness(&model.inertia), Definiteness::Positive);
        for matrix in [&model.damping, &model.stiffness] {
            let indefinite = matches!(definiteness(matrix), Definiteness::Indefinite { .. });
            prop_assert!(!indefinite);
        }
        let zero = reduced.equations.constraint_matrix().multiply(&model.basis);
        prop_assert!(zero.as_slice().iter().all(|x| *x == Rational::ZERO));
        // A transmission's row holds with the slope that the basis was made with.
        let mut kinematics = Kinematics::new(&reduced);
        kinematics.update(&tree.position[..r], &vec![0.0; r]);
        for t in &reduced.equations.transmissions {
            let slope = t.curve.derivatives(kinematics.angles[t.driving]).0;
            for column in 0..r {
                let (y, x) = (&model.basis[(t.driven, column)], &model.basis[(t.driving, column)]);
                let y = kardan::num::rational_to_f64(y);
                let x = kardan::num::rational_to_f64(&(rational_from_f64(slope).expect("finite") * x));
                // The inverse of a slope is rounded once, and so are chains of them: eight roundings at most.
                prop_assert!((y - x).abs() <= 1e-14 * largest(&[y, x]), "{y} against {x}");
            }
        }
    }

    /// (4.15): c(γ) = 0, J K = 0 and J k + j = 0, with the rows written in this file.
    ///
    /// Rounding: an angle of size a moves the sine by 1e-16·a, and a chain of six links adds six such errors; 1e-12 of
    /// the largest term leaves two digits.
    #[test]
    fn constraints_hold_in_explicit_form(tree in tree(7, true)) {
        let reduced = first(&tree.text(false, false, false)).reduced.clone();
        let (r, place) = (reduced.degrees_of_freedom(), tree.places(&reduced.equations.coordinates));
        let mut kinematics = Kinematics::new(&reduced);
        kinematics.update(&tree.position[..r], &tree.speed[..r]);
        let of = |x: &[f64]| -> Vec<f64> { place.iter().map(|p| x[*p]).collect() };
        let (angles, speeds, bias) = (of(&kinematics.angles), of(&kinematics.speeds), of(&kinematics.bias));
        for residual in tree.residuals(&angles) {
            prop_assert!(residual.abs() <= 1e-12 * largest(&angles), "c = {residual:e}");
        }
        for (_, row, j) in tree.constraints(&angles, &speeds) {
            prop_assert!(dot(&row, &speeds).abs() <= 1e-12 * largest(&speeds) * largest(&row), "J q̇");
            for column in 0..r {
                let basis: Vec<f64> = place.iter().map(|p| kinematics.row(*p)[column]).collect();
                prop_assert!(dot(&row, &basis).abs() <= 1e-12 * largest(&basis) * largest(&row), "J K");
            }
            let size = largest(&bias) * largest(&row);
            prop_assert!((dot(&row, &bias) + j).abs() <= 1e-12 * size.max(j.abs()), "J k + j");
        }
    }

    /// The implicit form (4.19), assembled and solved here, and the explicit form (4.23) give the same accelerations and
    /// the same constraint torques.
    ///
    /// Tolerances relative to the largest value: the condition number of (4.19) reaches 1e6 with ratios of four in chains
    /// of six, which leaves ten digits of the accelerations and nine of the multipliers.
    #[test]
    fn implicit_and_explicit_form_agree(tree in tree(7, false)) {
        let reduced = first(&tree.text(false, false, false)).reduced.clone();
        let (r, n, place) = (reduced.degrees_of_freedom(), tree.nodes.len(), tree.places(&reduced.equations.coordinates));
        let (dynamics, mut work) = Dynamics::new(&reduced);
        prop_assert!(dynamics.update(&tree.position[..r], &tree.speed[..r], &mut work));
        // Inputs by name: `load`, `m`.
        let result = explicit(&reduced, &dynamics, &work, &[tree.torque[1], tree.torque[0]], &[]);
        let kinematics = &work.kinematics;
        let of = |x: &[f64]| -> Vec<f64> { place.iter().map(|p| x[*p]).collect() };
        let (angles, speeds) = (of(&kinematics.angles), of(&kinematics.speeds));
        let rows = tree.constraints(&angles, &speeds);
        let size = n + rows.len();
        let (mut matrix, mut right) = (vec![vec![0.0; size]; size], tree.torques(&angles, &speeds));
        for k in 0..n {
            matrix[k][k] = tree.nodes[k].inertia;
        }
        for (k, (_, row, j)) in rows.iter().enumerate() {
            right.push(-j);
            for s in 0..n {
                matrix[s][n + k] = row[s];
                matrix[n + k][s] = row[s];
            }
        }
        let solution = solve(&matrix, &right);
        let scale = largest(&solution[..n]);
        for (value, expected) in of(&result.shafts).iter().zip(&solution) {
            prop_assert!((value - expected).abs() <= 1e-10 * scale, "acceleration {value} against {expected}");
        }
        let mut multipliers = Multipliers::new(&reduced);
        let mut lambda = vec![0.0; rows.len()];
        multipliers.solve(kinematics, &result.force, &mut lambda);
        let scale = largest(&solution[n..]);
        for (k, (link, row, _)) in rows.iter().enumerate() {
            let name = tree.link_name(*link, false);
            let number = multipliers.elements.iter().position(|e| *e == name).expect("a constraint");
            prop_assert!((lambda[number] + solution[n + k]).abs() <= 1e-9 * scale, "{name}: {} against {}", lambda[number], -solution[n + k]);
            for s in 0..n {
                let coefficient = multipliers.coefficient(number, place[s], kinematics);
                prop_assert!((coefficient - row[s]).abs() <= 1e-12 * largest(row), "J of {name}");
            }
        }
        // As expressions of the motion, accelerations and torques they have the same values.
        let found = multipliers_of_expressions(&reduced, &tree, &result);
        for (found, numeric) in found.iter().zip(&lambda) {
            prop_assert!((found - numeric).abs() <= 1e-9 * scale, "{found} against {numeric}");
        }
        // Ideal constraints do no work (4.17).
        let power: f64 = result.force.iter().zip(&kinematics.speeds).map(|(f, w)| f * w).sum();
        let shares: f64 = result.force.iter().zip(&kinematics.speeds).map(|(f, w)| (f * w).abs()).sum();
        prop_assert!(power.abs() <= 1e-9 * shares.max(1.0), "power {power:e} of {shares:e}");
    }

    /// Named coordinates and those chosen automatically give the same motion of the shafts at one point.
    #[test]
    fn coordinates_do_not_matter(tree in tree(7, false)) {
        let chosen = first(&tree.text(false, false, false)).reduced.clone();
        let named = first(&tree.text(false, false, true)).reduced.clone();
        let r = named.degrees_of_freedom();
        let (from, mut point) = Dynamics::new(&named);
        from.update(&tree.position[..r], &tree.speed[..r], &mut point);
        let (to, mut image) = Dynamics::new(&chosen);
        let of = |x: &[f64]| -> Vec<f64> { chosen.coordinates.iter().map(|shaft| x[*shaft]).collect() };
        to.update(&of(&point.kinematics.angles), &of(&point.kinematics.speeds), &mut image);
        let inputs = [tree.torque[1], tree.torque[0]];
        let (one, two) = (explicit(&named, &from, &point, &inputs, &[]), explicit(&chosen, &to, &image, &inputs, &[]));
        // As for the implicit form; an angle may come back through an inverse joint and lose a digit more.
        for (a, b) in [
            (&point.kinematics.angles, &image.kinematics.angles),
            (&point.kinematics.speeds, &image.kinematics.speeds),
            (&one.shafts, &two.shafts),
            (&one.force, &two.force),
        ] {
            let scale = largest(a);
            for (x, y) in a.iter().zip(b) {
                prop_assert!((x - y).abs() <= 1e-9 * scale, "{x} against {y}");
            }
        }
    }
}

/// Asserts that the energy balance of a run closes.
///
/// The integrator keeps a relative 1e-10 per step in speeds, and the work integrals are of the same order as the
/// solution; a run of 0.4 s takes up to some thousand steps, hence 1e-7 of the energy that was moved.
fn balanced(run: &Run) -> Result<(), TestCaseError> {
    let e = run.energy;
    let scale = e.input.abs() + e.stored.abs() + e.dissipated.abs() + 1e-6;
    prop_assert!(e.residual.abs() <= 1e-7 * scale, "{e:?}, effort {:?}", run.effort);
    prop_assert!(e.dissipated >= -1e-12 * scale, "{e:?}");
    let parts = e.input - e.stored - e.dissipated;
    prop_assert!((parts - e.residual).abs() <= 1e-12 * scale, "the balance is what it says: {e:?}");
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, max_shrink_iters: 200, ..ProptestConfig::default() })]

    #[test]
    fn frictionless_energy_balance(tree in tree(5, false)) {
        balanced(&run(&(tree.text(false, false, true) + &tree.scenario(true))))?;
    }

    #[test]
    fn energy_balance_with_friction(tree in tree(5, true)) {
        balanced(&run(&(tree.text(false, false, true) + &tree.scenario(true))))?;
    }

    /// The order of the tables changes nothing at all; other names change the order of sums, hence rounding only.
    #[test]
    fn order_and_names_do_not_matter(tree in tree(5, true).prop_map(Tree::aligned)) {
        let scenario = tree.scenario(false);
        let plain = run(&(tree.text(false, false, false) + &scenario));
        let shuffled = run(&(tree.text(false, true, false) + &scenario));
        prop_assert_eq!(&plain.series, &shuffled.series);
        prop_assert_eq!(&plain.events, &shuffled.events);
        prop_assert_eq!(plain.energy, shuffled.energy);
        let renamed = run(&(tree.text(true, false, false) + &scenario));
        same_motion(&tree, &plain, &renamed, true)?;
    }

    /// A run in named coordinates and one in those chosen automatically show the same shafts.
    #[test]
    fn runs_in_other_coordinates_show_the_same_motion(tree in tree(5, true).prop_map(Tree::aligned)) {
        let scenario = tree.scenario(false);
        let chosen = run(&(tree.text(false, false, false) + &scenario));
        let named = run(&(tree.text(false, false, true) + &scenario));
        same_motion(&tree, &chosen, &named, false)?;
    }
}

/// Angles and speeds of all shafts agree to 1e-6 of the largest: a relative 1e-10 per step, some hundred steps, and events
/// of friction that are located from each run's own rounding.
fn same_motion(tree: &Tree, one: &Run, two: &Run, renamed: bool) -> Result<(), TestCaseError> {
    for (name, other) in tree.names(false).iter().zip(tree.names(renamed)) {
        for suffix in ["phi", "w"] {
            let (a, b) = (signal(one, &format!("{name}.{suffix}")), signal(two, &format!("{other}.{suffix}")));
            prop_assert_eq!(a.len(), b.len());
            let scale = largest(a);
            for (row, (x, y)) in a.iter().zip(b).enumerate() {
                prop_assert!(
                    (x - y).abs() <= 1e-6 * scale,
                    "{name}.{suffix} at {} s: {x} against {y}; events {:?} against {:?}",
                    one.series.time[row],
                    one.events,
                    two.events
                );
            }
        }
    }
    Ok(())
}
