//! `kardan design` as a whole: its numbers against an independent reference, its proof against the loop that a test closes
//! itself, its JSON, the cross coupling that it measures, what it refuses, and the blocks that firmware would run.
//!
//! Origin of the golden numbers: `golden/golden.json`, see `tests/runs/golden.rs`. Plants are built from its reduced matrices, so
//! that neither the reduction nor the synthesis of the library can hide a mistake of its own.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::common::{self, close, first, golden, list, prepared, rows, solve};
use kardan::diagnostics::{Diagnostic, Severity};
use kardan::export::design_json;
use kardan::model;
use kardan::num::{Matrix, rational_from_f64};
use kardan::results::{Complex, ControllerData, Design, ExactMatrix, Outcome, Physical, Pole, Run};
use kardan::simulate::{Setup, Tolerance, simulate};
use kardan::study::{self, DesignSettings, PreparedVariant, Silent};
use kardan::synthesis::{Block, Clock, Law, LinearLaw, Observation, Reference};
use kardan::units::parse_number;
use kardan_rt::StateSpace;
use proptest::prelude::*;
use serde_json::Value;
use serde_json::value::RawValue;

fn source(name: &str) -> &'static str {
    model::builtin(name).expect("built in").source
}

fn names(list: &[&str]) -> Vec<String> {
    list.iter().map(ToString::to_string).collect()
}

/// A controller that is not in the file.
fn for_channels(inputs: &[&str], outputs: &[&str]) -> DesignSettings {
    DesignSettings { inputs: names(inputs), outputs: names(outputs), ..DesignSettings::default() }
}

fn by(feedback: &str, inputs: &[&str], outputs: &[&str]) -> DesignSettings {
    DesignSettings { feedback: Some(feedback.into()), ..for_channels(inputs, outputs) }
}

fn of_variant(name: &str) -> DesignSettings {
    DesignSettings { variant: Some(name.into()), ..DesignSettings::default() }
}

#[track_caller]
fn designed(source: &str, settings: &DesignSettings) -> Design {
    let found = study::design(source, settings, &Silent);
    found.unwrap_or_else(|diagnostics| panic!("{settings:?}: {diagnostics:?}"))
}

#[track_caller]
fn gain<'a>(design: &'a Design, name: &str) -> &'a ExactMatrix {
    let names: Vec<&str> = design.gains.iter().map(|gain| gain.name.as_str()).collect();
    design.gains.iter().find(|gain| gain.name == name).unwrap_or_else(|| panic!("no gain {name} among {names:?}"))
}

/// Entry by entry within 1e-9 of the golden value, relative to it, with rows and columns found by their names.
#[track_caller]
fn is_golden(matrix: &ExactMatrix, names_of_rows: &[&str], names_of_columns: &[&str], golden: &[Vec<f64>]) {
    assert_eq!((matrix.rows.len(), matrix.columns.len()), (golden.len(), golden[0].len()), "{}", matrix.name);
    let place = |list: &[String], name: &str| {
        list.iter().position(|x| x == name).unwrap_or_else(|| panic!("{}: no {name} among {list:?}", matrix.name))
    };
    let mut worst = 0.0f64;
    for (row, expected) in names_of_rows.iter().zip(golden) {
        for (column, expected) in names_of_columns.iter().zip(expected) {
            let value = matrix.values[place(&matrix.rows, row)][place(&matrix.columns, column)];
            let error = (value - expected).abs();
            assert!(error <= 1e-9 * expected.abs(), "{} ({row}, {column}): {value} against {expected}", matrix.name);
            worst = worst.max(if error > 0.0 { error / expected.abs() } else { 0.0 });
        }
    }
    println!("{}: largest relative difference from golden {worst:.1e}", matrix.name);
}

fn negated(rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    rows.iter().map(|row| row.iter().map(|x| -x).collect()).collect()
}

/// Every pole beside its golden value, each used once.
#[track_caller]
fn are_poles(found: &[Pole], golden: &[Pole], tolerance: f64) {
    let mut unmatched = found.to_vec();
    assert_eq!(unmatched.len(), golden.len(), "{found:?} against {golden:?}");
    for Pole { re, im } in golden {
        let distance = |pole: &Pole| (pole.re - re).hypot(pole.im - im);
        let nearest =
            (0..unmatched.len()).min_by(|&i, &j| distance(&unmatched[i]).total_cmp(&distance(&unmatched[j]))).unwrap();
        let error = distance(&unmatched.swap_remove(nearest));
        assert!(error <= tolerance * re.hypot(*im).max(1.0), "{re} ± {im} j misses by {error:e}: {found:?}");
    }
}

fn poles(value: &Value) -> Vec<Pole> {
    rows(value).iter().map(|pole| Pole::new(pole[0], pole[1])).collect()
}

/// The poles of a designed loop that are known exactly: those of the channels, behind the outputs, and beside them.
fn exact_poles(design: &Design) -> Vec<Pole> {
    let behind = design.zero_dynamics.modes.iter().flat_map(|mode| match mode.pole {
        Pole { im: 0.0, .. } => vec![mode.pole],
        Pole { re, im } => vec![mode.pole, Pole::new(re, -im)],
    });
    let channels = design.channels.iter().flat_map(|channel| channel.poles.clone());
    channels.chain(behind).chain(design.hidden.clone()).collect()
}

// ---- numbers --------------------------------------------------------------------------------------------------------

/// Section 6.1: `hd.feedback_Kx`, `hd.feedback_Kr` (the first is −K).
#[test]
fn golden_feedback_of_the_harmonic_drive() {
    let (golden, design) = (golden(), designed(source("harmonic-drive"), &DesignSettings::default()));
    let hd = &golden["hd"];
    assert_eq!((design.controller.as_str(), design.law.as_str()), ("drive", "computed_torque"));
    assert_eq!(design.outputs, ["cs.phi", "fs_torque.tau"]);
    assert_eq!(design.relative_degrees, [Some(2), Some(0)]);
    let inputs = ["wg_motor", "cs_motor"];
    let states = ["wg.phi", "cs.phi", "wg.w", "cs.w"];
    is_golden(gain(&design, "K"), &inputs, &states, &negated(&rows(&hd["feedback_Kx"])));
    is_golden(gain(&design, "L"), &inputs, &["ref_cs", "ref_torque"], &rows(&hd["feedback_Kr"]));
    let k = |name: &str| hd["k"][name].as_f64().unwrap();
    let first = &design.decoupling_matrix.values[0];
    assert_eq!(
        (design.decoupling_matrix.rows[0].as_str(), &design.decoupling_matrix.columns),
        ("cs.phi''", &design.inputs)
    );
    for (input, expected) in [("wg_motor", k("k11")), ("cs_motor", k("k12"))] {
        close(first[design.inputs.iter().position(|x| x == input).unwrap()], expected, 1e-9, input);
    }
    assert_eq!(design.decoupled, Some(true));
    let transfers: Vec<&str> = design.channels.iter().map(|channel| channel.transfer.as_str()).collect();
    assert_eq!(transfers, ["400/(s^2 + 40 s + 400)", "1"]);
    // What goes on while circular spline and torque rest: the flexspline with d_fs/J_fs, and where it stopped.
    are_poles(&exact_poles(&design)[2..], &[Complex::default(), Pole::new(-100_000_000.0 / 52_516_791.0, 0.0)], 1e-12);
}

/// Section 6.1.5: `hd.observer_L_decoupled` with the poles of 6.1.6.
#[test]
fn golden_observer_of_the_harmonic_drive() {
    let (golden, design) = (golden(), designed(source("harmonic-drive"), &of_variant("position-observer")));
    assert_eq!(design.controller, "observed_drive");
    let observer = design.observer.as_ref().expect("an observer");
    let states = ["wg.w", "cs.w", "wg.phi", "cs.phi", "wg.disturbance", "cs.disturbance"];
    is_golden(&observer.gain, &states, &["wg.phi", "cs.phi"], &rows(&golden["hd"]["observer_L_decoupled"]));
    are_poles(&observer.poles, &[-50.0, -50.1, -50.2, -50.0, -50.1, -50.2].map(|pole| Pole::new(pole, 0.0)), 1e-15);
    assert_eq!((observer.method.as_str(), &observer.disturbances), ("poles", &names(&["wg", "cs"])));
    // Each disturbance acts where a motor does, which takes it away.
    is_golden(gain(&design, "M"), &["wg_motor", "cs_motor"], &["wg", "cs"], &[vec![1.0, 0.0], vec![0.0, 1.0]]);
}

/// Poles of the error, from the printed gain and the golden plant: det(sI − A + L C) over states and disturbances.
#[test]
fn observers_have_their_poles_on_the_reference_plants() {
    let kalman = changed("harmonic-drive-spring", &[("poles = [-200, -210, -220]", "method = \"kalman\"")]);
    let cases = [
        (source("harmonic-drive"), Golden::harmonic_drive()),
        (source("harmonic-drive-spring"), Golden::with_a_spring()),
        (&kalman, Golden::with_a_spring()),
    ];
    for (source, plant) in cases {
        let design = designed(source, &of_variant("position-observer"));
        let observer = design.observer.as_ref().expect("an observer");
        let (n, all) = (plant.states.len(), observer.states.len());
        assert_eq!(observer.states[..n], plant.states);
        let mut a = vec![vec![0.0; all]; all];
        for i in 0..all {
            for j in 0..all {
                let correction = |(k, sensor): (usize, &String)| {
                    let row = &plant.outputs[sensor].0;
                    observer.gain.values[i][k] * row.get(j).unwrap_or(&0.0)
                };
                let torque = |shaft: &String| plant.inputs.iter().position(|input| *input == format!("{shaft}_motor"));
                let plant_entry = match (i < n, j.checked_sub(n)) {
                    (true, None) => plant.a[i][j],
                    (true, Some(k)) => plant.b[i][torque(&observer.disturbances[k]).expect("a motor")],
                    _ => 0.0,
                };
                a[i][j] = plant_entry - observer.sensors.iter().enumerate().map(correction).sum::<f64>();
            }
        }
        let closed = Closed { a, b: Vec::new(), outputs: Vec::new() };
        assert_eq!(observer.poles.len(), all);
        assert!(observer.poles.iter().all(|pole| pole.re < 0.0));
        for s in POINTS {
            let product: f64 = observer.poles.iter().map(|pole| (s - pole.re).hypot(pole.im)).product();
            let error = (closed.characteristic(s) - product).abs() / product;
            assert!(error < 1e-9, "{} at {s}: {error:e}", observer.method);
        }
    }
}

/// Section 6.2: states, G, K, L, the canonically decoupled form, poles and zeros.
#[test]
fn golden_decoupling_of_the_drive_with_a_spring() {
    let (golden, design) = (golden(), designed(source("harmonic-drive-spring"), &DesignSettings::default()));
    let hds = &golden["hds"];
    let states = ["rk.phi", "wg.phi - 51 rk.phi + 50 fs.phi", "wg.w", "rk.w", "fs.w"];
    let inputs = ["wg_motor", "rk_motor"];
    assert_eq!((design.controller.as_str(), design.law.as_str()), ("decoupled", "decoupling"));
    assert_eq!(design.states, states);
    assert_eq!(design.outputs, ["rk.phi", "fs_torque.tau"]);
    assert_eq!(design.relative_degrees, [Some(2), Some(1)]);
    assert_eq!(list(&hds["relative_degrees"]), [2.0, 1.0]);
    is_golden(&design.decoupling_matrix, &["rk.phi''", "fs_torque.tau'"], &inputs, &rows(&hds["G"]));
    is_golden(gain(&design, "K"), &inputs, &states, &rows(&hds["K"]));
    is_golden(gain(&design, "L"), &inputs, &["ref_rk", "ref_torque"], &rows(&hds["L"]));
    let form = design.canonical.as_ref().expect("a canonical form");
    assert_eq!((form.sizes.as_slice(), form.ranks.as_slice()), (&[2, 3, 0, 0][..], &[3, 2][..]));
    assert_eq!((list(&hds["p"]), list(&hds["rank_L"])), (vec![2.0, 3.0], vec![3.0, 2.0]));
    let x = ["x1", "x2", "x3", "x4", "x5"];
    is_golden(&form.transformation, &x, &states, &rows(&hds["Q"]));
    is_golden(&form.a, &x, &x, &rows(&hds["A_cd"]));
    is_golden(&form.b, &x, &["v1", "v2"], &rows(&hds["B_cd"]));
    is_golden(&form.c, &["rk.phi", "fs_torque.tau"], &x, &rows(&hds["C_cd"]));
    // Zero dynamics: the wave generator against the flexspline never comes back, its speed does quickly.
    let zeros: Vec<Pole> = design.zero_dynamics.modes.iter().map(|mode| mode.pole).collect();
    are_poles(&zeros, &[Complex::default(), Pole::new(-10_000.0, 0.0)], 1e-12);
    assert_eq!(list(&hds["zeros_state5"]), [0.0, -10_000.0]);
    assert!(!design.zero_dynamics.is_stable(), "a zero at zero is not stable");
    let warned = design.warnings.join(" ");
    assert!(warned.contains("at zero") && warned.contains("integrator"), "{warned}");
    // All six states of the plant: the five of the reference, and the sum of angles that no output shows.
    let mut expected = poles(&hds["closed_loop_eigs_state5"]);
    expected.push(Complex::default());
    are_poles(&design.hidden, &[Complex::default()], 0.0);
    are_poles(&exact_poles(&design), &expected, 1e-9);
    // Floating point splits the double pole at zero by the root of the rounding.
    are_poles(&design.closed_loop_poles, &expected, 1e-3);
}

/// Section 6.3: Kx, and Ku for accelerations (the golden one is for an acceleration and a torque), poles and zeros.
#[test]
fn golden_noninteracting_control_of_the_steering() {
    let (golden, design) = (golden(), designed(source("sia-steering"), &DesignSettings::default()));
    let sia = &golden["sia"];
    let states = ["rk.phi", "fs.phi", "cj.phi", "rk.w", "fs.w", "cj.w"];
    let inputs = ["wg_motor", "rk_motor"];
    assert_eq!(
        (design.controller.as_str(), design.other_controllers.as_slice()),
        ("column", &names(&["driver_model"])[..])
    );
    assert_eq!(design.relative_degrees, [Some(2), Some(2)]);
    is_golden(gain(&design, "Kx"), &inputs, &states, &rows(&sia["Kx"]));
    let inertia = sia["coefficients"]["Jfs_t"].as_f64().unwrap();
    let per_acceleration: Vec<Vec<f64>> = rows(&sia["Ku"]).iter().map(|row| vec![row[0], row[1] * inertia]).collect();
    is_golden(gain(&design, "Ku"), &inputs, &["rk.phi''", "fs.phi''"], &per_acceleration);
    let zeros: Vec<Pole> = design.zero_dynamics.modes.iter().map(|mode| mode.pole).collect();
    are_poles(&zeros, &poles(&sia["zero_dynamics_roots"])[..1], 1e-12);
    assert!(design.zero_dynamics.is_stable());
    assert_eq!(design.zero_dynamics.polynomial, "11 s^2 + 2060 s + 10000000");
    assert!(design.warnings.iter().any(|warning| warning.contains("lightly damped (9.821 %")), "{:?}", design.warnings);
    are_poles(&design.closed_loop_poles, &poles(&sia["closed_loop_eigs"]), 1e-9);
    assert_eq!(design.decoupled, Some(true));
    for entry in &design.transfer {
        let own = matches!((entry.output.as_str(), entry.reference.as_str()), ("rk.phi", "ref_rk") | ("fs.phi", "u2"));
        assert_eq!(entry.numerator.is_empty(), !own, "{entry:?}");
    }
    // The rack: 20 rad/s, 0.7. The wheel feels u2 through the inertia that is felt there, J~fs phi'' = u2.
    assert_eq!(design.channels[0].transfer, "400/(s^2 + 28 s + 400)");
    let wheel = design.transfer.iter().find(|entry| entry.output == "fs.phi" && entry.reference == "u2").unwrap();
    let numbers = |texts: &[String]| texts.iter().map(|text| fraction(text)).collect::<Vec<f64>>();
    assert_eq!(numbers(&wheel.denominator), [0.0, 0.0, 1.0]);
    assert_eq!(wheel.numerator.len(), 1);
    close(numbers(&wheel.numerator)[0] * inertia, 1.0, 1e-12, "J~fs of the wheel");
}

/// Theorem 6.4 and its erratum: (fs, cj) needs dynamic feedback, and is flat only without the damping of the torsion bar.
#[test]
fn outputs_of_theorem_6_4() {
    let settings = by("dynamic", &["wg_motor", "rk_motor"], &["fs.phi", "cj.phi"]);
    let design = designed(source("sia-steering"), &settings);
    let (flat, golden) = (design.flatness.as_ref().expect("a verdict"), golden());
    assert!(!flat.flat);
    let zeros = poles(&golden["analysis"]["ranks"]["sia"]["zeros_outputs_fs_cj_roots"]);
    are_poles(&flat.poles, &zeros, 1e-12);
    are_poles(&design.zero_dynamics.modes.iter().map(|mode| mode.pole).collect::<Vec<_>>(), &zeros, 1e-12);
    assert_eq!((design.decoupled, design.zero_dynamics.is_stable()), (Some(true), true));
    assert_eq!((design.decouplability.rank, design.decouplability.normal_rank), (1, 2));
    let undamped = source("sia-steering").replace("damping = \"0.02 N m s/rad ± 50 %\"", "damping = \"0 N m s/rad\"");
    let design = designed(&undamped, &settings);
    assert!(design.flatness.as_ref().is_some_and(|flat| flat.flat && flat.poles.is_empty()), "{:?}", design.flatness);
    assert!(design.zero_dynamics.modes.is_empty() && design.zero_dynamics.is_stable());
}

// ---- the loop, closed by the test -----------------------------------------------------------------------------------

/// `ẋ = A x + B u`, `y = C x + D u`, from golden matrices.
struct Golden {
    states: Vec<String>,
    a: Vec<Vec<f64>>,
    inputs: Vec<&'static str>,
    b: Vec<Vec<f64>>,
    /// Rows of C and D by name of the output.
    outputs: BTreeMap<String, (Vec<f64>, Vec<f64>)>,
}

impl Golden {
    /// From `H q'' + D q' + S q = F u`; angles and speeds of `shafts` are outputs, each a combination of coordinates.
    fn new(
        coordinates: &[&str],
        [h, d, s, f]: [Vec<Vec<f64>>; 4],
        inputs: &[&'static str],
        shafts: &[(&str, Vec<f64>)],
    ) -> Self {
        let r = coordinates.len();
        let zero = || vec![0.0; 2 * r];
        let (mut a, mut b) = (vec![zero(); 2 * r], vec![vec![0.0; inputs.len()]; 2 * r]);
        for j in 0..r {
            a[j][r + j] = 1.0;
            let column = |m: &[Vec<f64>], j: usize| m.iter().map(|row| row[j]).collect::<Vec<f64>>();
            for (i, (x, y)) in solve(&h, &column(&s, j)).into_iter().zip(solve(&h, &column(&d, j))).enumerate() {
                (a[r + i][j], a[r + i][r + j]) = (-x, -y);
            }
        }
        for j in 0..inputs.len() {
            let column: Vec<f64> = f.iter().map(|row| row[j]).collect();
            solve(&h, &column).into_iter().enumerate().for_each(|(i, x)| b[r + i][j] = x);
        }
        let mut outputs = BTreeMap::new();
        for (shaft, row) in shafts {
            let (mut angle, mut speed) = (zero(), zero());
            angle[..r].copy_from_slice(row);
            speed[r..].copy_from_slice(row);
            outputs.insert(format!("{shaft}.phi"), (angle, vec![0.0; inputs.len()]));
            outputs.insert(format!("{shaft}.w"), (speed, vec![0.0; inputs.len()]));
        }
        let all = |tail: &str| coordinates.iter().map(|name| format!("{name}.{tail}")).collect::<Vec<_>>();
        Self { states: [all("phi"), all("w")].concat(), a, inputs: inputs.to_vec(), b, outputs }
    }

    /// An output `inertia·φ″ + damping·φ′` of a shaft: the torque that moves it.
    fn with_torque(mut self, name: &str, shaft: &str, inertia: f64, damping: f64) -> Self {
        let n = self.states.len();
        let speed = &self.outputs[&format!("{shaft}.w")].0;
        let over = |matrix: &[Vec<f64>], j: usize| (0..n).map(|i| speed[i] * matrix[i][j]).sum::<f64>();
        let c = (0..n).map(|j| inertia * over(&self.a, j) + damping * speed[j]).collect();
        let d = (0..self.inputs.len()).map(|j| inertia * over(&self.b, j)).collect();
        self.outputs.insert(name.into(), (c, d));
        self
    }

    fn harmonic_drive() -> Self {
        let golden = golden();
        let hd = &golden["hd"];
        let zero = vec![vec![0.0; 2]; 2];
        let unit = vec![vec![1.0, 0.0], vec![0.0, 1.0]];
        let fs = vec![-1.0 / 50.0, 51.0 / 50.0];
        let shafts = [("wg", vec![1.0, 0.0]), ("cs", vec![0.0, 1.0]), ("fs", fs)];
        Self::new(&["wg", "cs"], [rows(&hd["Hr"]), rows(&hd["Dr"]), zero, unit], &["wg_motor", "cs_motor"], &shafts)
            .with_torque("fs_torque.tau", "fs", 10297.41e-6, hd["axis_damping"]["dfs"].as_f64().unwrap())
    }

    fn with_a_spring() -> Self {
        let golden = golden();
        let hds = &golden["hds"];
        let f = vec![vec![1.0, 0.0], vec![0.0, 1.0], vec![0.0, 0.0]];
        let unit = |k: usize| (0..3).map(|i| f64::from(u8::from(i == k))).collect::<Vec<f64>>();
        let cs = vec![1.0 / 51.0, 0.0, 50.0 / 51.0];
        let shafts = [("wg", unit(0)), ("rk", unit(1)), ("fs", unit(2)), ("cs", cs)];
        let matrices = [rows(&hds["Hr"]), rows(&hds["Dr"]), rows(&hds["Sr"]), f];
        Self::new(&["wg", "rk", "fs"], matrices, &["wg_motor", "rk_motor"], &shafts).with_torque(
            "fs_torque.tau",
            "fs",
            0.05,
            0.0,
        )
    }

    fn steering() -> Self {
        let golden = golden();
        let sia = &golden["sia"];
        let unit = |k: usize| (0..3).map(|i| f64::from(u8::from(i == k))).collect::<Vec<f64>>();
        // At 0° the joint turns both its shafts alike.
        let shafts =
            [("rk", unit(0)), ("fs", unit(1)), ("cj", unit(2)), ("cs", unit(2)), ("wg", vec![0.0, -50.0, 51.0])];
        let matrices = [rows(&sia["Hr"]), rows(&sia["Dr"]), rows(&sia["Sr"]), rows(&sia["Fr"])];
        Self::new(&["rk", "fs", "cj"], matrices, &["driver", "wg_motor", "rk_motor"], &shafts)
    }

    /// The plant under a designed controller.
    fn under(&self, design: &Design) -> Closed {
        let control = Control::new(design, self);
        let (n, k, m) = (self.states.len(), control.a.len(), design.inputs.len());
        let columns: Vec<usize> =
            design.inputs.iter().map(|input| self.inputs.iter().position(|x| x == input).unwrap()).collect();
        let references = control.from_references.first().map_or(0, Vec::len);
        // u over [x; ξ] and over r.
        let on = |i: usize, j: usize| if j < n { control.on_state[i][j] } else { control.c[i][j - n] };
        let mut a = vec![vec![0.0; n + k]; n + k];
        let mut b = vec![vec![0.0; references]; n + k];
        for i in 0..n {
            for j in 0..n + k {
                let direct = if j < n { self.a[i][j] } else { 0.0 };
                a[i][j] = direct + (0..m).map(|u| self.b[i][columns[u]] * on(u, j)).sum::<f64>();
            }
            for j in 0..references {
                b[i][j] = (0..m).map(|u| self.b[i][columns[u]] * control.from_references[u][j]).sum();
            }
        }
        for i in 0..k {
            a[n + i][..n].copy_from_slice(&control.b_state[i]);
            a[n + i][n..].copy_from_slice(&control.a[i]);
            b[n + i].copy_from_slice(&control.b_references[i]);
        }
        let outputs = design.outputs.iter().map(|name| {
            let (c, d) = &self.outputs[name];
            let over = |j: usize| (0..m).map(|u| d[columns[u]] * on(u, j)).sum::<f64>();
            let row: Vec<f64> = (0..n + k).map(|j| if j < n { c[j] + over(j) } else { over(j) }).collect();
            let direct = |j: usize| (0..m).map(|u| d[columns[u]] * control.from_references[u][j]).sum::<f64>();
            (row, (0..references).map(direct).collect())
        });
        Closed { outputs: outputs.collect(), a, b }
    }
}

/// `ξ̇ = A ξ + B_x x + B_r r`, `u = C ξ + D_x x + D_r r`.
struct Control {
    a: Vec<Vec<f64>>,
    b_state: Vec<Vec<f64>>,
    b_references: Vec<Vec<f64>>,
    c: Vec<Vec<f64>>,
    on_state: Vec<Vec<f64>>,
    from_references: Vec<Vec<f64>>,
}

impl Control {
    /// From what the design hands out: matrices of the block, else gains K and L, else Kx and Ku of position loops.
    fn new(design: &Design, plant: &Golden) -> Self {
        let (states, n) = (&plant.states, plant.states.len());
        let pick = |rows: &[Vec<f64>], columns: &[String]| -> Vec<Vec<f64>> {
            let place = |name: &String| columns.iter().position(|column| column == name).expect("a state");
            rows.iter().map(|row| states.iter().map(|state| row[place(state)]).collect()).collect()
        };
        let stateless = |on_state, from_references| {
            let (a, b_state, b_references) = (Vec::new(), Vec::new(), Vec::new());
            Self { a, b_state, b_references, c: vec![Vec::new(); design.inputs.len()], on_state, from_references }
        };
        let data = &design.controller_data;
        if data.block == "StateSpace" {
            let reads: Vec<String> = data.reads.iter().map(|one| one.signal.clone()).collect();
            let [a, b, c, d] = ["A", "B", "C", "D"].map(|name| matrix(data, name));
            let references = |rows: &[Vec<f64>]| rows.iter().map(|row| row[n..].to_vec()).collect::<Vec<_>>();
            let (b_state, on_state) = (pick(&b, &reads), pick(&d, &reads));
            return Self { a, b_state, b_references: references(&b), c, on_state, from_references: references(&d) };
        }
        if design.gains.iter().any(|gain| gain.name == "K") {
            let (k, l) = (gain(design, "K"), gain(design, "L"));
            return stateless(negated(&pick(&k.values, &k.columns)), l.values.clone());
        }
        let (kx, ku) = (gain(design, "Kx"), gain(design, "Ku"));
        let mut on_state = pick(&kx.values, &kx.columns);
        // v = 400 (r − y) − 28 y′.
        for (i, row) in on_state.iter_mut().enumerate() {
            for (k, output) in design.outputs.iter().enumerate() {
                let speed = &plant.outputs[&output.replace(".phi", ".w")].0;
                for (j, x) in row.iter_mut().enumerate() {
                    *x -= ku.values[i][k] * (400.0 * plant.outputs[output].0[j] + 28.0 * speed[j]);
                }
            }
        }
        stateless(on_state, ku.values.iter().map(|row| row.iter().map(|x| 400.0 * x).collect()).collect())
    }
}

fn matrix(data: &ControllerData, name: &str) -> Vec<Vec<f64>> {
    data.matrices.iter().find(|matrix| matrix.name == name).expect("a matrix").values.clone()
}

/// A closed loop: `ẋ = A x + B r` and the rows of the outputs over x and r.
struct Closed {
    a: Vec<Vec<f64>>,
    b: Vec<Vec<f64>>,
    outputs: Vec<(Vec<f64>, Vec<f64>)>,
}

impl Closed {
    fn pencil(&self, s: f64) -> Vec<Vec<f64>> {
        let unit = |i: usize, j: usize| if i == j { s } else { 0.0 };
        (0..self.a.len()).map(|i| (0..self.a.len()).map(|j| unit(i, j) - self.a[i][j]).collect()).collect()
    }

    /// T(s) = C (sI − A)⁻¹ B + D, outputs × references.
    fn transfer(&self, s: f64) -> Vec<Vec<f64>> {
        let pencil = self.pencil(s);
        let columns: Vec<Vec<f64>> = (0..self.b[0].len())
            .map(|j| solve(&pencil, &self.b.iter().map(|row| row[j]).collect::<Vec<_>>()))
            .collect();
        let entry = |(c, d): &(Vec<f64>, Vec<f64>), j: usize| common::dot(c, &columns[j]) + d[j];
        self.outputs.iter().map(|row| (0..columns.len()).map(|j| entry(row, j)).collect()).collect()
    }

    /// det(sI − A).
    fn characteristic(&self, s: f64) -> f64 {
        let (mut a, mut product) = (self.pencil(s), 1.0);
        for k in 0..a.len() {
            let pivot = (k..a.len()).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs())).unwrap();
            if pivot != k {
                a.swap(k, pivot);
                product = -product;
            }
            product *= a[k][k];
            for i in k + 1..a.len() {
                let factor = a[i][k] / a[k][k];
                for j in k..a.len() {
                    a[i][j] -= factor * a[k][j];
                }
            }
        }
        product
    }
}

/// A printed fraction as the test reads it.
fn fraction(text: &str) -> f64 {
    let (top, bottom) = text.split_once('/').unwrap_or((text, "1"));
    top.parse::<f64>().unwrap() / bottom.parse::<f64>().unwrap()
}

fn printed(numerator: &[String], denominator: &[String], s: f64) -> f64 {
    let at = |texts: &[String]| texts.iter().rev().fold(0.0, |sum, text| sum * s + fraction(text));
    at(numerator) / at(denominator)
}

/// Points on the real axis to the right of all poles: slow, as the loop, and fast.
const POINTS: [f64; 4] = [0.7, 3.0, 25.0, 400.0];

/// The printed transfer matrix is that of the loop, and its off-diagonal zeros are zeros of the loop; det(sI − A) of the
/// whole loop is the product over the printed poles.
fn check_loop(plant: &Golden, design: &Design, blocks: bool, tolerance: f64) -> Result<f64, String> {
    let closed = plant.under(design);
    let mut worst = 0.0f64;
    for s in POINTS {
        let found = closed.transfer(s);
        for (i, output) in design.outputs.iter().enumerate() {
            for (j, value) in found[i].iter().enumerate() {
                let entry = &design.transfer[i * found[i].len() + j];
                if entry.output != *output {
                    return Err(format!("the entry of {output} is that of {}", entry.output));
                }
                let expected = printed(&entry.numerator, &entry.denominator, s);
                // A torque per angle is large at a high frequency; a row is measured by its own channel.
                let error = (value - expected).abs() / expected.abs().max(found[i][i].abs());
                worst = worst.max(error);
                if error > tolerance {
                    return Err(format!("{output} from {} at {s}: {value} against {expected}", entry.reference));
                }
            }
        }
        if design.decoupled == Some(true) && !blocks {
            let real: f64 = exact_poles(design).iter().map(|pole| (s - pole.re).hypot(pole.im)).product();
            let error = (closed.characteristic(s) - real).abs() / real;
            worst = worst.max(error);
            if error > tolerance {
                return Err(format!("det at {s}: {} against {real}: {design:?}", closed.characteristic(s)));
            }
        }
    }
    Ok(worst)
}

/// decoupled ⇔ all numerators of other channels are empty.
fn check_verdict(design: &Design) -> Result<(), String> {
    let own = |output: &str, reference: &str| {
        design.channels.iter().any(|channel| channel.output == output && channel.reference == reference)
    };
    let coupled =
        design.transfer.iter().any(|entry| !own(&entry.output, &entry.reference) && !entry.numerator.is_empty());
    match design.decoupled {
        Some(decoupled) if decoupled == coupled => Err(format!("decoupled {decoupled}: {:?}", design.transfer)),
        _ => Ok(()),
    }
}

#[test]
fn printed_loops_are_those_of_the_reference_plants() {
    let driverless = plant_only("sia-steering");
    let both = ["wg_motor", "rk_motor"];
    let cases: Vec<(&str, DesignSettings, Golden)> = vec![
        (source("harmonic-drive"), DesignSettings::default(), Golden::harmonic_drive()),
        (
            source("harmonic-drive"),
            for_channels(&["wg_motor", "cs_motor"], &["cs.phi", "fs_torque"]),
            Golden::harmonic_drive(),
        ),
        (source("harmonic-drive-spring"), DesignSettings::default(), Golden::with_a_spring()),
        (source("harmonic-drive-spring"), for_channels(&both, &["rk.phi", "fs.phi"]), Golden::with_a_spring()),
        (&driverless, for_channels(&both, &["rk.phi", "fs.phi"]), Golden::steering()),
        (&driverless, by("dynamic", &both, &["fs.phi", "cj.phi"]), Golden::steering()),
        (&driverless, by("block", &both, &["fs.phi", "cj.phi"]), Golden::steering()),
        (&driverless, for_channels(&["wg_motor"], &["fs.phi"]), Golden::steering()),
    ];
    for (source, settings, plant) in cases {
        let design = designed(source, &settings);
        check_verdict(&design).unwrap();
        let worst = check_loop(&plant, &design, settings.feedback.as_deref() == Some("block"), 1e-7)
            .unwrap_or_else(|why| panic!("{settings:?}: {why}"));
        println!("{} {:?} {:?}: loop within {worst:.1e}", design.law, design.outputs, design.inputs);
    }
}

/// The model without its controllers and what the scenario does with their references.
fn plant_only(name: &str) -> String {
    let mut document = toml_lines::tables(source(name));
    document.retain(|(head, _)| {
        let dropped = ["[control", "[[control", "[[scenario", "[[requirement", "[[plot", "[[variant]]", "[variants]"];
        !dropped.iter().any(|start| head.starts_with(start))
    });
    document.into_iter().map(|(head, body)| format!("{head}\n{body}")).collect()
}

/// Just enough of TOML to leave tables out.
mod toml_lines {
    /// Heads of tables with their bodies.
    pub type Lines = Vec<(String, String)>;

    pub fn tables(source: &str) -> Lines {
        let mut out: Lines = vec![(String::new(), String::new())];
        for line in source.lines() {
            if line.starts_with('[') {
                out.push((line.into(), String::new()));
            } else if let Some((_, body)) = out.last_mut() {
                body.push_str(line);
                body.push('\n');
            }
        }
        out
    }
}

// ---- the JSON object ------------------------------------------------------------------------------------------------

type Raw = BTreeMap<String, Box<RawValue>>;

fn raw(text: &str) -> Raw {
    serde_json::from_str(text).unwrap_or_else(|why| panic!("{why}: {text}"))
}

/// The fields between brackets, commas and quotes: numbers as they are printed, fractions without their quotes.
fn fields(text: &str) -> Vec<String> {
    let separate = |c: char| matches!(c, '[' | ']' | ',' | '"');
    text.split(separate).map(str::trim).filter(|field| !field.is_empty()).map(str::to_string).collect()
}

/// Every printed fraction has the printed number as its nearest `f64`, bit for bit. Gives how many there are.
#[track_caller]
fn fractions_are_the_numbers(matrix: &RawValue) -> usize {
    let keys = raw(matrix.get());
    let (values, exact) = (fields(keys["values"].get()), fields(keys["exact"].get()));
    if keys["exact"].get() == "null" {
        return 0;
    }
    assert_eq!(values.len(), exact.len());
    for (value, exact) in values.iter().zip(&exact) {
        let value: f64 = value.parse().expect("a number");
        let fraction = parse_number(exact).expect("a fraction").to_rational();
        let distance = |x: f64| {
            let minus = kardan::num::Rational::from(-1) * rational_from_f64(x).expect("finite");
            let difference = fraction.clone() + minus;
            if difference < kardan::num::Rational::ZERO { -difference } else { difference }
        };
        let own = distance(value);
        assert!(own <= distance(value.next_up()) && own <= distance(value.next_down()), "{exact} is not {value:e}");
    }
    values.len()
}

fn check_json(design: &Design, simulated: bool) {
    let text = design_json(design);
    let object: Value = serde_json::from_str(&text).expect("JSON");
    let keys = raw(&text);
    let strings = |key: &str| -> Vec<String> {
        object[key].as_array().expect(key).iter().map(|x| x.as_str().expect(key).to_string()).collect()
    };
    assert_eq!(object["law"], design.law.as_str());
    assert_eq!((strings("inputs"), strings("outputs")), (design.inputs.clone(), design.outputs.clone()));
    assert!(!strings("states").is_empty() && !design.outputs.is_empty() && !design.inputs.is_empty());
    let degrees = object["relative_degrees"].as_array().expect("degrees");
    assert_eq!(degrees.len(), design.outputs.len());
    let mut numbers = fractions_are_the_numbers(&keys["decoupling_matrix"]);
    let gains = raw(keys["gains"].get());
    assert!(gains.len() >= 2, "{:?}", gains.keys());
    numbers += gains.values().map(|gain| fractions_are_the_numbers(gain)).sum::<usize>();
    if object["canonical"] != Value::Null {
        let canonical = raw(keys["canonical"].get());
        numbers += ["Q", "A", "B", "C"].iter().map(|name| fractions_are_the_numbers(&canonical[*name])).sum::<usize>();
    }
    assert!(numbers >= design.inputs.len() * design.states.len(), "{numbers}");
    for gain in object["gains"].as_object().expect("gains").values() {
        let (rows_of_gain, columns) =
            (gain["rows"].as_array().unwrap().len(), gain["columns"].as_array().unwrap().len());
        for key in ["values", "exact"] {
            let rows = gain[key].as_array().expect(key);
            assert!(rows.len() == rows_of_gain && rows.iter().all(|row| row.as_array().unwrap().len() == columns));
        }
    }
    assert_eq!(rows(&object["closed_loop_poles"]).len(), design.closed_loop_poles.len());
    assert!(object["zero_dynamics"]["poles"].is_array());
    assert!(object["zero_dynamics"]["stable"].is_boolean() || design.decoupled != Some(true));
    let coupling = object["cross_coupling"].as_array().expect("cross_coupling");
    let expected = if simulated { design.outputs.len() * design.channels.len() } else { 0 };
    assert_eq!(coupling.len(), expected);
    for entry in coupling {
        assert!(entry["peak"].is_f64() && entry["rms"].is_f64() && entry["failure"].is_null(), "{entry}");
    }
    let mentioned = |key: &str| entries(&object["transfer"], key);
    assert_eq!(mentioned("output").len(), design.outputs.len().pow(2));
    for key in ["canonical", "channels", "observer", "decoupled", "flatness", "controller_data", "warnings", "notes"] {
        assert!(object.get(key).is_some(), "no {key}");
    }
}

fn entries(list: &Value, key: &str) -> Vec<String> {
    list.as_array().expect("a list").iter().map(|entry| entry[key].as_str().expect(key).to_string()).collect()
}

#[test]
fn json_of_every_built_in_model_and_of_requested_controllers() {
    let both = ["wg_motor", "rk_motor"];
    let none = DesignSettings::default;
    let cases = [
        ("sia-steering", none()),
        ("sia-steering", of_variant("beta-20deg")),
        ("sia-steering", for_channels(&both, &["rk.phi", "fs.phi"])),
        ("sia-steering", by("dynamic", &both, &["fs.phi", "cj.phi"])),
        ("sia-steering", by("block", &both, &["fs.phi", "cj.phi"])),
        ("harmonic-drive", none()),
        ("harmonic-drive", of_variant("torque-observer")),
        ("harmonic-drive-spring", none()),
        ("harmonic-drive-spring", of_variant("torque-observer")),
        ("harmonic-drive-spring", for_channels(&both, &["rk.phi", "fs.phi"])),
        ("harmonic-drive-spring", for_channels(&["wg_motor"], &["fs.phi"])),
        ("two-bodies", none()),
        ("two-bodies", for_channels(&["motor_1"], &["body_2.phi"])),
    ];
    for (name, settings) in cases {
        check_json(&designed(source(name), &settings), false);
    }
    check_json(&designed(source("sia-steering"), &DesignSettings { simulate: true, ..none() }), true);
    // A circuit has no motor to decouple with.
    let diagnostics = refused(source("rlc-ladder"), &none());
    assert_reported(&diagnostics, "control::no-motor", &["no motor"]);
}

// ---- cross coupling -------------------------------------------------------------------------------------------------

#[test]
fn no_channel_of_the_linear_loops_moves_another() {
    let smooth: String =
        source("sia-steering").lines().filter(|line| !line.starts_with("friction")).map(|l| format!("{l}\n")).collect();
    let both = ["wg_motor", "rk_motor"];
    let cases = [
        (source("harmonic-drive").to_string(), DesignSettings::default()),
        (source("harmonic-drive-spring").to_string(), DesignSettings::default()),
        (source("harmonic-drive-spring").to_string(), of_variant("position-observer")),
        (smooth, DesignSettings::default()),
        // Without the driver model, whose torque on the wheel is a load that this law does not know.
        (plant_only("sia-steering").replace("friction = ", "# "), by("dynamic", &both, &["fs.phi", "cj.phi"])),
        // With Coulomb friction: the wheel sticks while the rack moves.
        (source("sia-steering").to_string(), DesignSettings::default()),
    ];
    for (source, settings) in cases {
        let design = designed(&source, &DesignSettings { simulate: true, ..settings });
        assert_eq!(design.cross_coupling.len(), 4);
        for found in &design.cross_coupling {
            let (peak, what) =
                (found.peak.unwrap(), format!("{}: {} to {}", design.model, found.reference, found.output));
            let rms = found.rms.unwrap();
            println!("{what}: peak {peak:.2e}, rms {rms:.2e}");
            assert_eq!(found.failure, None, "{what}");
            assert!(if found.same_channel { peak > 0.04 } else { peak < 1e-9 }, "{what}: {peak}");
            assert!(rms <= peak);
        }
    }
    let simulated = DesignSettings { simulate: true, ..of_variant("position-friction") };
    let rough = designed(source("harmonic-drive"), &simulated);
    // Friction couples: `hd_summary.hd_coulomb_nocomp_pos.max_abs_Tc_fs`, and nothing but stiction the other way.
    let golden = golden();
    let expected = golden["hd_summary"]["hd_coulomb_nocomp_pos"]["max_abs_Tc_fs"].as_f64().unwrap();
    close(rough.cross_coupling[1].peak.unwrap(), expected, 1e-6, "friction of the harmonic drive");
    assert_eq!(rough.cross_coupling[2].peak, Some(0.0));
}

/// The noninteracting law (6.124), (6.130), (6.137) with golden gains, or with the sign that is printed in (6.130).
#[derive(Clone)]
struct Printed {
    inputs: Vec<String>,
    references: Vec<Reference>,
    /// Shafts rk, fs, cj.
    shafts: [usize; 3],
    kx: Vec<Vec<f64>>,
    ku: Vec<Vec<f64>>,
}

impl Printed {
    fn new(variant: &PreparedVariant, wrong: bool) -> Self {
        let golden = golden();
        let (mut kx, ku) = (rows(&golden["sia"]["Kx"]), rows(&golden["sia"]["Ku"]));
        if wrong {
            // In the braces of (6.130), "+ Jwg/J~cj dsp" where it must be "-": they are multiplied by Ku of the torque.
            let braces = kx[0][3] / ku[0][1];
            let right = -2550.0 * 50e-6 / golden["sia"]["coefficients"]["Jcj_t"].as_f64().unwrap() * 0.02;
            close(braces, right, 1e-12, "the term of the rack's speed");
            kx[0][3] = -kx[0][3];
        }
        let reference = |name: &str, physical| Reference { name: name.into(), physical, description: name.into() };
        Self {
            inputs: names(&["wg_motor", "rk_motor"]),
            references: vec![reference("ref_rk", Physical::Angle), reference("u2", Physical::Torque)],
            shafts: ["rk", "fs", "cj"].map(|name| variant.reduced.coordinate(name).expect("a shaft")),
            kx,
            ku,
        }
    }
}

impl Law for Printed {
    fn inputs(&self) -> &[String] {
        &self.inputs
    }

    fn references(&self) -> &[Reference] {
        &self.references
    }

    fn block(&self, _: Option<Clock>) -> Option<Box<dyn Block>> {
        Some(Box::new(self.clone()))
    }

    fn linear_sampled(&self, _: Clock) -> Option<LinearLaw> {
        Some(self.linear())
    }

    fn linear(&self) -> LinearLaw {
        LinearLaw::gains(Matrix::zeros(2, 5), Matrix::zeros(2, 5), Matrix::zeros(2, 2))
    }

    fn describe(&self) -> Design {
        Design::default()
    }
}

impl Block for Printed {
    fn command(&mut self, observation: Observation<'_>, out: &mut [f64]) -> bool {
        let of = |values: &[f64]| self.shafts.map(|shaft| values[shaft]);
        let state = [of(observation.angles), of(observation.speeds)].concat();
        let rack = 400.0 * (observation.references[0] - state[0]) - 28.0 * state[3];
        for (k, torque) in out.iter_mut().enumerate() {
            *torque = common::dot(&self.kx[k], &state) + common::dot(&self.ku[k], &[rack, observation.references[1]]);
        }
        true
    }
}

/// A step of the rack by π at 1 s for two seconds, with the driver model in the loop.
fn rack_step(friction: bool, law: impl FnOnce(&PreparedVariant) -> Option<Arc<dyn Law>>) -> Run {
    let retained = |line: &&str| friction || !line.starts_with("friction");
    let text: String = source("sia-steering").lines().filter(retained).map(|line| format!("{line}\n")).collect();
    let variant = first(&text);
    let mut scenario = variant.scenario.clone();
    scenario.duration = 3.0;
    scenario.times.retain(|time| *time <= 3.0);
    scenario.events.truncate(1);
    assert_eq!((scenario.events[0].at, scenario.events[0].to), (1.0, std::f64::consts::PI));
    let mut laws = variant.designed.clone();
    if let Some(law) = law(&variant) {
        let column = laws.iter().position(|law| law.inputs().len() == 2).expect("the column");
        laws[column] = law;
    }
    let setup = Setup { reduced: &variant.reduced, laws: &laws, scenario: &scenario };
    let result = simulate(setup, Tolerance::default(), &mut |_| None);
    assert_eq!(result.outcome, Outcome::Completed);
    result
}

fn values<'a>(run: &'a Run, name: &str) -> &'a [f64] {
    &run.series.signal(name).expect("a signal").values
}

fn largest(run: &Run, name: &str) -> f64 {
    values(run, name).iter().fold(0.0, |max, x| if x.abs() > f64::abs(max) { *x } else { max })
}

/// The erratum of (6.130): without it the rack kicks the steering wheel.
#[test]
fn printed_sign_of_6_130_couples_and_the_right_one_does_not() {
    for (friction, torque, angle) in [(false, -1.197, 0.0414), (true, -0.959, 0.032)] {
        let wrong = rack_step(friction, |variant| Some(Arc::new(Printed::new(variant, true))));
        let (kick, rotation) = (largest(&wrong, "driver.tau"), largest(&wrong, "fs.phi"));
        println!("printed sign, friction {friction}: T_fs peak {kick:.4} N m, phi_fs {rotation:.5} rad");
        // As many digits as the erratum has.
        assert!((kick - torque).abs() < 6e-4, "{kick}");
        assert!((rotation.abs() - angle).abs() < 3e-4, "{rotation}");
        if friction {
            let offset = *values(&wrong, "fs.phi").last().unwrap();
            assert!((offset.abs() - 0.0073).abs() < 1e-4, "{offset}");
        }
        let golden_law = rack_step(friction, |variant| Some(Arc::new(Printed::new(variant, false))));
        let designed_law = rack_step(friction, |_| None);
        for (run, whose) in [(&golden_law, "golden gains"), (&designed_law, "the designed law")] {
            let (kick, rotation) = (largest(run, "driver.tau"), largest(run, "fs.phi"));
            println!("{whose}, friction {friction}: T_fs peak {kick:.2e} N m, phi_fs {rotation:.2e} rad");
            if friction {
                assert_eq!((kick, rotation), (0.0, 0.0), "{whose}: stiction holds");
            } else {
                assert!(kick.abs() < 1e-10 && rotation.abs() < 1e-12, "{whose}: {kick} {rotation}");
            }
        }
        close(*values(&designed_law, "rk.phi").last().unwrap(), std::f64::consts::PI, 2e-3, "the rack arrives");
    }
}

// ---- what is refused ------------------------------------------------------------------------------------------------

#[track_caller]
fn refused(source: &str, settings: &DesignSettings) -> Vec<Diagnostic> {
    let mut found =
        study::design(source, settings, &Silent).err().unwrap_or_else(|| panic!("{settings:?} is designed"));
    found.retain(|diagnostic| diagnostic.severity == Severity::Error);
    assert!(!found.is_empty(), "{settings:?}: no error");
    for diagnostic in &found {
        assert!(diagnostic.labels.iter().all(|label| label.place.span().end <= source.len()), "{diagnostic:?}");
        assert!(diagnostic.help.as_ref().is_some_and(|help| !help.is_empty()), "no help: {diagnostic:?}");
    }
    found
}

#[track_caller]
fn assert_reported(found: &[Diagnostic], code: &str, fragments: &[&str]) {
    let text = |diagnostic: &Diagnostic| format!("{} help: {:?}", diagnostic.message, diagnostic.help);
    let hit = |diagnostic: &&Diagnostic| {
        diagnostic.code == code && fragments.iter().all(|word| text(diagnostic).contains(word))
    };
    assert!(found.iter().any(|diagnostic| hit(&diagnostic)), "no [{code}] with {fragments:?}: {found:#?}");
}

#[track_caller]
fn changed(name: &str, changes: &[(&str, &str)]) -> String {
    let mut text = source(name).to_string();
    for (from, to) in changes {
        assert!(text.contains(from), "{name} has no {from:?}");
        text = text.replacen(from, to, 1);
    }
    text
}

#[test]
fn settings_that_cannot_be_designed() {
    let both = ["wg_motor", "rk_motor"];
    let all = ["wg_motor", "rk_motor", "driver"];
    let law = |law: &str, settings: DesignSettings| DesignSettings { law: Some(law.into()), ..settings };
    let control = |name: &str| DesignSettings { control: Some(name.into()), ..DesignSettings::default() };
    let feedback = |name: &str| DesignSettings { feedback: Some(name.into()), ..DesignSettings::default() };
    let cases: Vec<(DesignSettings, &str, &[&str])> = vec![
        // Static feedback fails; the way out is named.
        (
            for_channels(&both, &["fs.phi", "cj.phi"]),
            "control::design",
            &["static", "rank 1 instead of 2", "1 integrator before wg_motor", "feedback = \"dynamic\""],
        ),
        (
            law("noninteracting", for_channels(&both, &["fs.phi", "cj.phi"])),
            "control::design",
            &["`fs.phi`, `cj.phi`", "static state feedback", "rank 1"],
        ),
        (law("computed_torque", for_channels(&both, &["fs.phi", "cj.phi"])), "control::design", &["rank 1"]),
        // Nothing helps: the gear ties the outputs.
        (
            for_channels(&all, &["fs.phi", "wg.phi", "cs.phi"]),
            "control::design",
            &["no feedback at all", "`hd` ties them"],
        ),
        (by("dynamic", &all, &["fs.phi", "wg.phi", "cs.phi"]), "control::design", &["no feedback at all", "`hd` ties"]),
        (by("block", &all, &["fs.phi", "wg.phi", "cs.phi"]), "control::design", &["no feedback at all", "`hd` ties"]),
        (for_channels(&["wg_motor"], &["fs.phi", "rk.phi"]), "control::design", &["2 outputs, 1 input"]),
        (for_channels(&both, &["fs.phi", "rk.phi", "cj.phi"]), "control::design", &["3 outputs, 2 inputs"]),
        // Names.
        (for_channels(&both, &["fs.phi", "fs.phi"]), "name::duplicate", &["output `fs.phi`", "twice"]),
        (
            for_channels(&["wg_motor", "wg_motor"], &["fs.phi", "rk.phi"]),
            "name::duplicate",
            &["input `wg_motor`", "twice"],
        ),
        (
            for_channels(&["wg_moto", "rk_motor"], &["fs.phi", "rk.phi"]),
            "name::unknown",
            &["`wg_moto`", "mean `wg_motor`"],
        ),
        (for_channels(&both, &["fs.phi", "rk.ph"]), "name::unknown", &["`rk.ph`", "mean `rk.phi`"]),
        (for_channels(&both, &["fs.phi", ""]), "name::empty", &["name of an output is empty"]),
        (control("colum"), "name::unknown", &["no controller `colum`", "mean `column`"]),
        (of_variant("beta-40deg"), "variant::unknown", &["`beta-40deg`", "did you mean `beta-"]),
        (
            law("decuopling", for_channels(&both, &["fs.phi", "rk.phi"])),
            "name::unknown",
            &["law `decuopling`", "`decoupling`"],
        ),
        // Keys that a law has not.
        (
            feedback("dynamic"),
            "control::feedback",
            &["`noninteracting`", "no choice of feedback", "leave `--feedback` out"],
        ),
        (law("position_loop", for_channels(&["wg_motor"], &["fs.phi"])), "control::needs-keys", &["keys of its own"]),
        (law("noninteracting", for_channels(&both, &["fs.phi"])), "control::channel-count", &[]),
        (
            law("computed_torque", for_channels(&["rk_motor"], &["fs.phi"])),
            "control::design",
            &["`rk_motor`", "`fs.phi`"],
        ),
        (law("noninteracting", for_channels(&both, &["fs.w", "rk.phi"])), "name::unknown", &["`fs.w`", "angle"]),
    ];
    for (settings, code, fragments) in cases {
        assert_reported(&refused(source("sia-steering"), &settings), code, fragments);
    }
}

#[test]
fn keys_that_cannot_be_designed() {
    let frequency = "natural_frequency = \"20 rad/s\"\ndamping_ratio = 0.7\n";
    let inputs = "inputs = [\"wg_motor\", \"rk_motor\"]\n";
    let third = "[[control.decoupled.channels]]\noutput = \"wg.phi\"\nreference = \"ref_wg\"\n\n[control.observed]\n";
    let cases: &[((&str, &str), &str, &[&str])] = &[
        ((frequency, "poles = [\"-14 + 3j\", -5]\n"), "control::design", &["`rk.phi`", "-14 + 3 j", "conjugate"]),
        ((frequency, "poles = [-14, -15, -16]\n"), "control::design", &["relative degree 2", "there are 3"]),
        ((frequency, "poles = []\n"), "list::length", &["`poles`", "empty list"]),
        ((frequency, "poles = [14, -15]\n"), "control::design", &["real part 14", "negative"]),
        ((frequency, "poles = [0, -15]\n"), "control::design", &["real part 0", "negative"]),
        ((frequency, "poles = [-1e400, -15]\n"), "number::range", &[]),
        ((frequency, "natural_frequency = \"1e200 rad/s\"\n"), "number::range", &["`decoupled`", "too large"]),
        ((frequency, "natural_frequency = \"0 rad/s\"\n"), "number::sign", &["more than zero"]),
        ((frequency, "natural_frequency = \"20 N m\"\n"), "unit::dimension", &["natural_frequency"]),
        ((frequency, "natural_frequency = \"20 rad/s\"\npoles = [-3, -4]\n"), "control::design", &["both", "`poles`"]),
        ((frequency, "damping_ratio = -0.7\n"), "number::sign", &["damping_ratio"]),
        ((inputs, "inputs = [\"wg_motor\", \"rk_motr\"]\n"), "name::unknown", &["`rk_motr`", "`rk_motor`"]),
        ((inputs, "inputs = []\n"), "list::length", &["`inputs`", "0 names"]),
        ((inputs, &format!("{inputs}sample_time = \"0 s\"\n")), "number::sign", &["`sample_time`", "more than zero"]),
        ((inputs, &format!("{inputs}sample_time = \"-1 ms\"\n")), "number::sign", &["`sample_time`", "more than zero"]),
        ((inputs, &format!("{inputs}sample_time = \"2 s\"\n")), "control::design", &["2 s is longer than 1 s"]),
        ((inputs, &format!("{inputs}feedback = \"dynamc\"\n")), "choice::unknown", &["`dynamc`", "dynamic"]),
        (("output = \"fs_torque\"\n", "output = \"rk.phi\"\n"), "control::design", &["`rk.phi`", "two channels"]),
        (("output = \"fs_torque\"\n", "output = \"fs_torqe\"\n"), "name::unknown", &["`fs_torqe`", "fs_torque"]),
        (
            ("[control.observed]\n", third),
            "control::design",
            &["3 outputs, 2 inputs", "`hd` and the spring damper `torsion_bar` tie"],
        ),
    ];
    for ((from, to), code, fragments) in cases {
        let text = changed("harmonic-drive-spring", &[(from, to)]);
        assert_reported(&refused(&text, &DesignSettings::default()), code, fragments);
    }
}

#[test]
fn observers_that_cannot_be_designed() {
    let poles = "poles = [-200, -210, -220]\n";
    let sensors = "sensors = [\"wg.phi\", \"rk.phi\", \"fs.phi\"]\n";
    let disturbances = "disturbances = [\"wg\", \"rk\"]\n";
    let cases: &[((&str, &str), &str, &[&str])] = &[
        ((poles, ""), "control::design", &["observer needs `poles`", "kalman"]),
        ((poles, "poles = [200, -210, -220]\n"), "control::design", &["real part 200", "negative real part"]),
        ((poles, "poles = [-200, -210]\n"), "control::design", &["2 poles", "3 (the same for every sensor)", "8 (for"]),
        ((poles, "poles = [\"-200 + 3j\", -210, -220]\n"), "control::design", &["-200 + 3j", "self-conjugate"]),
        ((poles, "poles = [-1e120, -2e120, -3e120]\n"), "number::range", &["`observed`", "too large"]),
        ((poles, "method = \"kalmann\"\n"), "choice::unknown", &["`kalmann`", "kalman"]),
        ((poles, "method = \"kalman\"\nsensor_noise = 0\n"), "number::sign", &["`sensor_noise`", "more than zero"]),
        ((poles, "method = \"kalman\"\nspeed_noise = -1\n"), "number::sign", &["`speed_noise`", "negative"]),
        ((poles, "method = \"kalman\"\ndisturbance_rate = 0\n"), "number::sign", &["`disturbance_rate`"]),
        ((poles, "method = \"kalman\"\nsensor_noise = 1e-150\n"), "control::design", &["Riccati", "noises"]),
        ((poles, "method = \"kalman\"\nsensor_noise = 1e200\n"), "control::design", &["noise of wg.phi"]),
        ((poles, "method = \"kalman\"\ndisturbance_rate = 1e160\n"), "control::design", &["noise of wg.dist"]),
        ((poles, &format!("{poles}compensation = -1\n")), "number::sign", &["`compensation`"]),
        ((sensors, "sensors = [\"wg.phi\"]\n"), "control::design", &["with wg.phi only 5 of 8", "add a sensor"]),
        ((sensors, "sensors = [\"rk.w\", \"wg.w\"]\n"), "control::design", &["rk.w and wg.w only 6 of 8 states"]),
        ((sensors, "sensors = []\n"), "control::design", &["0 of 8 states"]),
        (
            (sensors, "sensors = [\"wg.phi\", \"rk.phi\", \"fs_torque\"]\n"),
            "control::design",
            &["`fs_torque.tau` depends directly on the motor torques"],
        ),
        ((sensors, "sensors = [\"wg.phi\", \"wg.phi\"]\n"), "name::duplicate", &["`wg.phi`", "twice"]),
        ((sensors, "sensors = [\"wg.phi\", \"rk.ph\"]\n"), "name::unknown", &["`rk.ph`", "`rk.phi`"]),
        ((disturbances, "disturbances = [\"wg\", \"rt\"]\n"), "control::design", &["no shaft `rt`"]),
        ((disturbances, "disturbances = [\"wg\", \"wg\"]\n"), "name::duplicate", &["`wg`", "twice"]),
        ((disturbances, "disturbances = []\n"), "control::design", &["2 (the same for every sensor) or 6 (for"]),
    ];
    for ((from, to), code, fragments) in cases {
        let text = changed("harmonic-drive-spring", &[(from, to)]);
        assert_reported(&refused(&text, &of_variant("position-observer")), code, fragments);
    }
    let kalman = (poles, "method = \"kalman\"\n");
    let blind = changed("harmonic-drive-spring", &[kalman, (sensors, "sensors = [\"wg.phi\"]\n")]);
    assert_reported(
        &refused(&blind, &of_variant("position-observer")),
        "control::design",
        &["no sensor shows", "do not decay"],
    );
    let force = changed("harmonic-drive", &[("[\"wg.phi\", \"cs.phi\"]\ndist", "[\"wg.phi\", \"fs_torque\"]\ndist")]);
    let found = refused(&force, &of_variant("position-observer"));
    assert_reported(&found, "control::design", &["`fs_torque.tau`", "an observer cannot measure it"]);
}

/// Two ways of opposite sign from the motor to the output: with `2 k1 < k2` a passive drive has a zero in the right half
/// plane, `(k1 + 0 s)(s² + s + 2 k2) − k2² = 0`.
const TWO_WAYS: &str = r#"
[shaft.a]
inertia = "1 kg m^2"
damping = "1 N m s/rad"

[shaft.b]

[shaft.m]
inertia = "1 kg m^2"
damping = "1 N m s/rad"

[gear.back]
shaft_1 = "a"
shaft_2 = "b"
ratio = -1

[spring_damper.direct]
shaft_1 = "a"
shaft_2 = "cs"
stiffness = "10 N m/rad"

[spring_damper.into]
shaft_1 = "b"
shaft_2 = "m"
stiffness = "100 N m/rad"

[spring_damper.out]
shaft_1 = "m"
shaft_2 = "cs"
stiffness = "100 N m/rad"

[motor.far]
shaft = "a"

[shaft.cs]
inertia = "1 kg m^2"
damping = "1 N m s/rad"
"#;

/// Behind it a harmonic drive, so that static feedback cannot part its two shafts.
const DRIVE_BEHIND: &str = r#"
[shaft.wg]
inertia = "1 kg m^2"

[shaft.fs]
inertia = "1 kg m^2"

[harmonic_drive.hd]
wave_generator = "wg"
circular_spline = "cs"
flexspline = "fs"
ratio = 2

[motor.near]
shaft = "wg"
"#;

#[test]
fn unstable_zero_dynamics_are_refused() {
    // 10 (s² + s + 200) − 10000 = 0.
    let root = -0.5 + (0.25f64 + 800.0).sqrt();
    let root = format!("{root:.6} 1/s");
    for settings in
        [for_channels(&["far"], &["cs.phi"]), by("dynamic", &["far"], &["cs.phi"]), by("block", &["far"], &["cs.phi"])]
    {
        let found = refused(TWO_WAYS, &settings);
        assert_reported(
            &found,
            "control::design",
            &["zero dynamics are unstable", &root, "s^2 + s - 800 = 0", "choose other outputs"],
        );
    }
    let behind = format!("{TWO_WAYS}{DRIVE_BEHIND}");
    let outputs = ["cs.phi", "fs.phi"];
    let found = refused(&behind, &by("dynamic", &["far", "near"], &outputs));
    assert_reported(&found, "control::design", &["zero dynamics are unstable", &root, "s^2 + s - 800 = 0"]);
    assert_reported(
        &refused(&behind, &for_channels(&["far", "near"], &outputs)),
        "control::design",
        &["rank 1 instead of 2"],
    );
    // With the ways turned round the same drive passes.
    let mild = TWO_WAYS.replace("\"10 N m/rad\"", "\"1000 N m/rad\"");
    assert!(designed(&mild, &for_channels(&["far"], &["cs.phi"])).zero_dynamics.is_stable());
    // Negative damping behind the output is refused with the model.
    let active = "[shaft.a]\ninertia = \"1 kg m^2\"\n[shaft.b]\ninertia = \"1 kg m^2\"\ndamping = \"-0.5 N m s/rad\"\n\
                  [spring_damper.s]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nstiffness = \"100 N m/rad\"\n\
                  [motor.m]\nshaft = \"a\"\n";
    assert_reported(&refused(active, &for_channels(&["m"], &["a.phi"])), "damping::not-passive", &["`b`"]);
}

// ---- any controller at all -------------------------------------------------------------------------------------------

fn some_of(names: &'static [&'static str], most: usize) -> impl Strategy<Value = Vec<String>> {
    proptest::sample::subsequence(names, 0..=most).prop_shuffle().prop_map(|picked| self::names(&picked))
}

fn any_settings(
    inputs: &'static [&'static str],
    outputs: &'static [&'static str],
) -> impl Strategy<Value = DesignSettings> {
    let laws = ["decoupling", "decoupling", "decoupling", "noninteracting", "computed_torque", "position_loop"];
    let feedback = proptest::option::of(proptest::sample::select(&["static", "dynamic", "block"][..]));
    (proptest::sample::select(laws.to_vec()), some_of(inputs, inputs.len()), some_of(outputs, 3), feedback).prop_map(
        |(law, inputs, outputs, feedback)| DesignSettings {
            law: Some(law.into()),
            inputs,
            outputs,
            feedback: feedback.filter(|_| law == "decoupling").map(str::to_string),
            ..DesignSettings::default()
        },
    )
}

/// An error that says something, or a design whose proof holds on the golden plant.
fn error_or_proof(source: &str, plant: &Golden, settings: &DesignSettings) -> Result<(), TestCaseError> {
    match study::design(source, settings, &Silent) {
        Err(diagnostics) => {
            let errors: Vec<_> =
                diagnostics.iter().filter(|diagnostic| diagnostic.severity == Severity::Error).collect();
            prop_assert!(!errors.is_empty() && errors.iter().all(|error| error.message.len() > 20), "{diagnostics:?}");
        }
        Ok(design) => {
            prop_assert_eq!(design.inputs.len(), settings.inputs.len().max(design.inputs.len()));
            check_verdict(&design).map_err(TestCaseError::fail)?;
            let blocks = settings.feedback.as_deref() == Some("block");
            prop_assert!(design.decoupled == Some(true) || blocks, "{:?}", design.decoupled);
            check_loop(plant, &design, blocks, 1e-5).map_err(TestCaseError::fail)?;
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 50, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_controller_of_the_steering(settings in any_settings(
        &["wg_motor", "rk_motor", "driver"],
        &["rk.phi", "fs.phi", "cj.phi", "cs.phi", "wg.phi", "rk.w", "fs.w", "cj.w", "cs.w", "wg.w"],
    )) {
        error_or_proof(&plant_only("sia-steering"), &Golden::steering(), &settings)?;
    }

    #[test]
    fn any_controller_of_the_drive_with_a_spring(settings in any_settings(
        &["wg_motor", "rk_motor"],
        &["rk.phi", "fs.phi", "cs.phi", "wg.phi", "rk.w", "fs.w", "cs.w", "wg.w", "fs_torque.tau"],
    )) {
        error_or_proof(&plant_only("harmonic-drive-spring"), &Golden::with_a_spring(), &settings)?;
    }

    #[test]
    fn any_controller_of_the_harmonic_drive(settings in any_settings(
        &["wg_motor", "cs_motor"],
        &["wg.phi", "cs.phi", "fs.phi", "wg.w", "cs.w", "fs.w", "fs_torque.tau"],
    )) {
        error_or_proof(&plant_only("harmonic-drive"), &Golden::harmonic_drive(), &settings)?;
    }
}

/// A number of any size as a file may give it.
fn any_number() -> impl Strategy<Value = String> {
    (-9.99f64..9.99, prop_oneof![-3i32..3, -40i32..40, -330i32..330]).prop_map(|(x, e)| format!("{x:.2}e{e}"))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    /// Frequencies, poles, noises and plant parameters of any size: an error, or finite numbers; never a panic.
    #[test]
    fn numbers_of_any_size(
        channel in any_number(), ratio in any_number(), pole in any_number(), other in any_number(),
        inertia in any_number(), stiffness in any_number(), kalman in any::<bool>(), change in 0usize..8,
    ) {
        let observer =
            if kalman { format!("method = \"kalman\"\nsensor_noise = {other}\n") } else { format!("poles = [{other}, {pole}, -3]\n") };
        let changes = [
            ("natural_frequency = \"20 rad/s\"\ndamping_ratio = 0.7", format!("natural_frequency = \"{channel} rad/s\"\ndamping_ratio = {ratio}")),
            ("natural_frequency = \"20 rad/s\"\ndamping_ratio = 0.7", format!("poles = [{pole}, {other}]")),
            ("crossover_frequency = \"20 rad/s\"", format!("crossover_frequency = \"{channel} rad/s\"")),
            ("poles = [-200, -210, -220]\n", observer),
            ("inertia = \"100 kg mm^2\"", format!("inertia = \"{inertia} kg mm^2\"")),
            ("stiffness = \"100 N m/rad\"", format!("stiffness = \"{stiffness} N m/rad\"")),
            ("ratio = 50", format!("ratio = {ratio}")),
            ("damping = \"0.01 N m s/rad\"", format!("damping = \"{other} N m s/rad\"")),
        ];
        let text = changed("harmonic-drive-spring", &[(changes[change].0, &changes[change].1)]);
        for variant in ["position", "position-observer"] {
            match study::design(&text, &of_variant(variant), &Silent) {
                Err(diagnostics) => prop_assert!(diagnostics.iter().any(|diagnostic| diagnostic.severity == Severity::Error)),
                Ok(design) => {
                    let gains = design.gains.iter().chain(design.observer.as_ref().map(|observer| &observer.gain));
                    for gain in gains {
                        prop_assert!(gain.values.iter().flatten().all(|x| x.is_finite()), "{}", gain.name);
                    }
                    check_verdict(&design).map_err(TestCaseError::fail)?;
                }
            }
        }
    }
}

// ---- what runs in firmware ------------------------------------------------------------------------------------------

/// Numbers in ±`scale` from a linear congruential generator, the same in every run.
struct Numbers(u64);

impl Numbers {
    fn list(&mut self, length: usize, scale: f64) -> Vec<f64> {
        let next = |_| {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            scale * ((self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0)
        };
        (0..length).map(next).collect()
    }
}

/// The matrices of a block, each flat.
struct Flat {
    matrices: [Vec<f64>; 4],
    states: usize,
    signals: usize,
}

impl Flat {
    fn new(data: &ControllerData) -> Self {
        assert_eq!(data.block, "StateSpace");
        let matrices = ["A", "B", "C", "D"].map(|name| matrix(data, name));
        let (states, signals) = (matrices[0].len(), data.reads.len());
        Self { matrices: matrices.map(|rows| rows.concat()), states, signals }
    }

    fn block(&self) -> StateSpace<'_, f64> {
        let [a, b, c, d] = &self.matrices;
        StateSpace::new(a, b, c, d, self.states, self.signals).expect("matrices that fit")
    }
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|x| x.to_bits()).collect()
}

/// The exported block gives the same bits as the law that was designed and simulated.
fn check_block(text: &str, variant: &str, control: &str) {
    let prepared = prepared(text);
    let variant = prepared.variants.iter().find(|v| v.name == variant || variant.is_empty()).expect("a variant");
    let number = variant.model.controls.iter().position(|c| c.name == control).expect("a control");
    let law = variant.designed[number].clone();
    let design = law.describe();
    let exported = Flat::new(&design.controller_data);
    let observer = design.observer_data.as_ref().map(|data| (data, Flat::new(data)));
    let shafts = variant.reduced.equations.coordinates.clone();
    let mut numbers = Numbers(11);
    for _ in 0..100 {
        let (angles, speeds) = (numbers.list(shafts.len(), 20.0), numbers.list(shafts.len(), 50.0));
        let (references, states) = (numbers.list(law.references().len(), 3.0), numbers.list(law.states().len(), 10.0));
        let torques = numbers.list(law.inputs().len(), 5.0);
        let disturbances = [];
        let observation = Observation {
            time: 0.0,
            angles: &angles,
            speeds: &speeds,
            disturbances: &disturbances,
            references: &references,
            readings: &[],
            states: &states,
        };
        let (mut commands, mut rates) = (vec![f64::NAN; torques.len()], vec![f64::NAN; states.len()]);
        let mut block = law.block(law.clock()).expect("its own clock");
        assert!(block.command(observation, &mut commands));
        assert!(block.states(observation, &torques, &mut rates));
        let own = observer.as_ref().map_or(0, |(_, flat)| flat.states);
        // Measured angles and speeds are read as they are, the others and the disturbances are estimates.
        let read = |name: &str| -> f64 {
            let (head, tail) = name.split_once('.').unwrap_or((name, ""));
            let shaft = || shafts.iter().position(|shaft| shaft == head).expect("a shaft");
            if let Some(k) = law.references().iter().position(|reference| reference.name == name) {
                return references[k];
            }
            let estimate = observer.as_ref().filter(|(data, _)| !data.reads.iter().any(|one| one.signal == name));
            match (estimate, tail) {
                (Some((data, _)), _) => {
                    let part = if tail == "disturbance" { data.numbers[0].value } else { 1.0 };
                    part * states[data.writes.iter().position(|state| state == name).expect("an estimate")]
                }
                (None, "w") => speeds[shaft()],
                (None, _) => angles[shaft()],
            }
        };
        let signals: Vec<f64> = design.controller_data.reads.iter().map(|one| read(&one.signal)).collect();
        let mut out = vec![f64::NAN; commands.len()];
        assert!(exported.block().outputs(&states[own..], &signals, &mut out));
        assert_eq!(bits(&out), bits(&commands), "{control}: {out:?} against {commands:?}");
        let mut next = vec![f64::NAN; exported.states];
        assert!(exported.block().rates(&states[own..], &signals, &mut next));
        assert_eq!(bits(&next), bits(&rates[own..]), "{control}: rates");
        if let Some((data, flat)) = &observer {
            let sensor = |name: &String| match law.inputs().iter().position(|input| format!("{input}.tau") == *name) {
                Some(input) => torques[input],
                None => angles[shafts.iter().position(|shaft| format!("{shaft}.phi") == *name).expect("an angle")],
            };
            let signals: Vec<f64> = data.reads.iter().map(|one| sensor(&one.signal)).collect();
            let mut next = vec![f64::NAN; own];
            assert!(flat.block().rates(&states[..own], &signals, &mut next));
            assert_eq!(bits(&next), bits(&rates[..own]), "{control}: observer");
        }
    }
}

/// `[control.NAME]` of the law `decoupling` with channels of the default dynamics.
fn with_control(name: &str, feedback: &str, inputs: &[&str], outputs: &[&str]) -> String {
    let mut text = plant_only(name);
    text += &format!("\n[control.own]\nlaw = \"decoupling\"\nfeedback = \"{feedback}\"\ninputs = {inputs:?}\n");
    for (k, output) in outputs.iter().enumerate() {
        text += &format!("\n[[control.own.channels]]\noutput = \"{output}\"\nreference = \"r{k}\"\n");
    }
    text
}

#[test]
fn exported_blocks_give_the_bits_of_the_law() {
    check_block(source("harmonic-drive-spring"), "position", "decoupled");
    check_block(source("harmonic-drive-spring"), "torque-observer", "observed");
    let both = ["wg_motor", "rk_motor"];
    check_block(&with_control("sia-steering", "static", &both, &["rk.phi", "fs.phi"]), "", "own");
    check_block(&with_control("sia-steering", "dynamic", &both, &["fs.phi", "cj.phi"]), "", "own");
    check_block(&with_control("sia-steering", "block", &both, &["fs.phi", "cj.phi"]), "", "own");
    check_block(&with_control("two-bodies", "static", &["motor_1"], &["body_2.phi"]), "", "own");
    check_block(
        &with_control("harmonic-drive", "static", &["wg_motor", "cs_motor"], &["cs.phi", "fs_torque"]),
        "",
        "own",
    );
}

#[test]
fn closed_loop_poles_of_a_double_zero() {
    let (golden, design) = (golden(), designed(source("harmonic-drive-spring"), &DesignSettings::default()));
    let mut expected = poles(&golden["hds"]["closed_loop_eigs_state5"]);
    expected.push(Complex::default());
    are_poles(&design.closed_loop_poles, &expected, 1e-9);
    assert!(design.closed_loop_poles.iter().all(|pole| pole.re <= 0.0));
}

#[test]
fn gains_exceeding_single_precision_are_refused() {
    let from = "natural_frequency = \"20 rad/s\"";
    for name in ["harmonic-drive-spring", "sia-steering"] {
        let text = changed(name, &[(from, "natural_frequency = \"1e25 rad/s\"")]);
        assert_reported(&refused(&text, &DesignSettings::default()), "number::range", &["too large"]);
    }
}

#[test]
fn unstable_zeros_of_blocks_are_refused() {
    let behind = format!("{TWO_WAYS}{DRIVE_BEHIND}");
    let found = refused(&behind, &by("block", &["far", "near"], &["cs.phi", "fs.phi"]));
    assert_reported(&found, "control::design", &["zero dynamics are unstable", "s^2 + s - 800 = 0"]);
}

#[test]
fn zero_dynamics_of_blocks_with_spare_motors() {
    for (name, plant, inputs, outputs) in [
        ("harmonic-drive-spring", Golden::with_a_spring(), &["wg_motor", "rk_motor"][..], &["fs.w"][..]),
        ("sia-steering", Golden::steering(), &["wg_motor", "rk_motor", "driver"], &["rk.phi", "fs.phi"]),
    ] {
        let design = designed(&plant_only(name), &by("block", inputs, outputs));
        check_loop(&plant, &design, false, 1e-7).unwrap();
    }
}

/// State feedback of one output cancels no zeros and has nothing to be decoupled from; a law that inverts the plant does.
#[test]
fn only_laws_that_invert_the_plant_are_judged_by_its_zeros() {
    let one = for_channels(&["motor_1"], &["body_1.phi"]);
    let text = changed("two-bodies", &[("0.5 N m s/rad ± 20 %", "0.05 N m s/rad")]);
    for (law, cancels) in [("lqr", false), ("decoupling", true)] {
        let design = designed(&text, &DesignSettings { law: Some(law.into()), ..one.clone() });
        assert_eq!((design.cancels_zeros, design.decoupled), (cancels, cancels.then_some(true)), "{law}");
        assert_eq!(design.zero_dynamics.modes.len(), 1, "{law}");
        let shown: Vec<_> = design.zero_dynamics.modes.iter().filter(|mode| mode.warning.is_some()).collect();
        assert_eq!(!shown.is_empty(), cancels, "{law}: {shown:?}");
    }
}

#[test]
fn unknown_feedback_is_refused() {
    let settings = by("sometimes", &["wg_motor", "rk_motor"], &["fs.phi", "rk.phi"]);
    assert_reported(&refused(source("sia-steering"), &settings), "choice::unknown", &["`sometimes`", "dynamic"]);
}

#[test]
fn a_controller_of_another_variant_is_found() {
    let settings = DesignSettings { control: Some("observed_drive".into()), ..DesignSettings::default() };
    let design = designed(source("harmonic-drive"), &settings);
    assert_eq!((design.controller.as_str(), design.variant.as_str()), ("observed_drive", "position-observer"));
}

#[test]
fn angle_and_speed_of_one_shaft_depend_on_each_other() {
    let found = refused(source("sia-steering"), &for_channels(&["wg_motor", "rk_motor"], &["rk.phi", "rk.w"]));
    assert_reported(&found, "control::design", &["no feedback at all"]);
    assert!(found.iter().all(|one| !one.message.contains("ref_rk")), "{found:#?}");
}

#[test]
fn controller_data_are_exported() {
    for (name, block) in [("sia-steering", "Noninteracting"), ("harmonic-drive", "ComputedTorque")] {
        let data = designed(source(name), &DesignSettings::default()).controller_data;
        assert_eq!(data.block, block);
        assert!(!data.matrices.is_empty() || !data.numbers.is_empty(), "{name}: {data:?}");
    }
}

#[test]
fn observer_and_sample_time_are_exported() {
    let text = source("harmonic-drive-spring")
        .replace("law = \"decoupling\"\n", "law = \"decoupling\"\nsample_time = \"0.1 ms\"\n");
    let design = designed(&text, &of_variant("position-observer"));
    let sampled = design.observer_data.as_ref().unwrap().sample_time;
    let json: Value = serde_json::from_str(&design_json(&design)).unwrap();
    let file: Value = serde_json::from_str(&kardan::export::controller_json(&design)).unwrap();
    assert_eq!(sampled, Some(1e-4));
    assert_eq!(json["observer_data"], file["observer"]);
    assert!(json["observer_data"].is_object(), "{file:#}");
}

#[test]
fn settings_out_of_range_or_ineffective_are_reported() {
    let poles = "poles = [-200, -210, -220]\n";
    let place = |text: &str, what: &str| {
        let found = refused(text, &of_variant("position-observer"));
        assert!(found.iter().all(|one| !one.labels.is_empty()), "{what} has no place: {found:#?}");
    };
    let mut wrong = Vec::new();
    for (what, to) in [
        ("compensation from 0 to 1", format!("{poles}compensation = 7\n")),
        ("poles beside kalman", format!("method = \"kalman\"\n{poles}")),
        ("noise beside poles", format!("{poles}sensor_noise = 1e-4\n")),
    ] {
        let text = changed("harmonic-drive-spring", &[(poles, &to)]);
        if study::design(&text, &of_variant("position-observer"), &Silent).is_ok() && study::check(&text).is_empty() {
            wrong.push(what);
        }
    }
    assert!(wrong.is_empty(), "accepted without a word: {wrong:?}");
    place(&changed("harmonic-drive-spring", &[(poles, "poles = [200, -210, -220]\n")]), "an unstable pole");
}

#[test]
fn no_sensors_have_a_place() {
    let text = changed("harmonic-drive-spring", &[("sensors = [\"wg.phi\", \"rk.phi\", \"fs.phi\"]", "sensors = []")]);
    let found = refused(&text, &of_variant("position-observer"));
    assert!(found.iter().all(|one| !one.labels.is_empty()), "{found:#?}");
}

#[test]
fn help_does_not_end_in_nothing() {
    let found = refused(source("rlc-ladder"), &DesignSettings::default());
    assert!(found.iter().all(|one| !one.help.as_deref().unwrap_or("").ends_with("there are ")), "{found:#?}");
}

#[test]
fn feedback_of_the_law_is_reported() {
    let design = designed(source("harmonic-drive-spring"), &DesignSettings::default());
    assert!(design.feedback.is_some());
}

#[test]
fn an_unused_controller_is_reported() {
    let bad = "[control.observed]\n";
    let tied = "[control.tied]\nlaw = \"decoupling\"\ninputs = [\"wg_motor\"]\n\n[[control.tied.channels]]\noutput = \"wg.phi\"\nreference = \"a\"\n\n\
                [[control.tied.channels]]\noutput = \"fs.phi\"\nreference = \"b\"\n\n[control.observed]\n";
    let text = changed("harmonic-drive-spring", &[(bad, tied)]);
    assert!(!study::check(&text).is_empty());
}

/// A second controller that lets the driver's motor follow the rack couples what the first one parts.
#[test]
fn other_controllers_that_couple_the_outputs_are_reported() {
    let original = designed(source("sia-steering"), &DesignSettings::default());
    let coupled = "the outputs are coupled: ref_rk moves fs.phi";
    assert!(!original.warnings.iter().any(|warning| warning.contains(coupled)), "{:?}", original.warnings);
    let (from, to) = (
        "output = \"fs.phi\"\ninput = \"driver\"",
        "output = \"rk.phi\"\ninertia = \"0.05 kg m^2\"\ninput = \"driver\"",
    );
    let both = designed(&changed("sia-steering", &[(from, to)]), &DesignSettings::default());
    assert_eq!(both.decoupled, Some(true));
    assert!(both.warnings.iter().any(|warning| warning.contains(coupled)), "{:?}", both.warnings);
}

/// A spring that is not relaxed moves the shafts without any step; what the step does in a linear model is the same.
#[test]
fn cross_coupling_leaves_out_what_moves_by_itself() {
    let settings = DesignSettings { simulate: true, ..for_channels(&["motor_1"], &["body_1.phi"]) };
    let (from, to) = ("stiffness = \"s\"\n", "stiffness = \"s\"\nrest = \"0.5 rad\"\n");
    let tense = designed(&changed("two-bodies", &[(from, to)]), &settings);
    let relaxed = designed(source("two-bodies"), &settings);
    let peak = |design: &Design| design.cross_coupling[0].peak.unwrap();
    assert!((peak(&tense) - peak(&relaxed)).abs() < 1e-6 * peak(&relaxed), "{} {}", peak(&tense), peak(&relaxed));
}

#[test]
fn friction_is_cancelled_once() {
    let (from, to) = ("[control.observed_drive]\n", "[control.observed_drive]\nfriction_width = \"1 rad/s\"\n");
    let text = changed("harmonic-drive", &[(from, to)]);
    let settings = of_variant("position-observer");
    // An observer that runs the full model has the friction in it, and its estimate is what is left.
    assert!(designed(&text, &settings).observer.is_some());
    // A linear one takes it for a torque from outside, which would be cancelled once more.
    let none = "sensors = [\"wg.phi\", \"cs.phi\"]\n";
    let text = text.replace(none, &format!("{none}plant = \"linear\"\n"));
    assert_reported(&refused(&text, &settings), "control::design", &["cancel"]);
    let text = text.replace(none, &format!("{none}compensation = 0\n"));
    assert!(designed(&text, &settings).observer.is_some());
}

/// Friction keeps the shaft from its reference unless the estimate of it is cancelled.
#[test]
fn compensation_scales_what_is_cancelled() {
    let error = |share: f64| {
        let none = "sensors = [\"wg.phi\", \"cs.phi\"]\n";
        let text = changed("harmonic-drive", &[(none, &format!("{none}compensation = {share:?}\n"))]);
        let variant = common::prepared(&text).variants.into_iter().find(|v| v.name == "position-observer").unwrap();
        let setup = Setup { reduced: &variant.reduced, laws: &variant.designed, scenario: &variant.scenario };
        let run = simulate(setup, Tolerance::default(), &mut |_| None);
        (values(&run, "cs.phi").last().unwrap() - values(&run, "ref_cs").last().unwrap()).abs()
    };
    let (none, half, all) = (error(0.0), error(0.5), error(1.0));
    assert!(none > 1.2 * half && half > 2.0 * all, "{none} {half} {all}");
}
