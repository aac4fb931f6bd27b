//! The blocks of `kardan-rt` with the tables that the library makes for them: the mechanism against `reduce::Dynamics`, the
//! computed-torque law against the independent reference, against the laws designed on the linear model, and against the
//! equations of motion that it is to bring about.
//!
//! Tolerances: both sides evaluate the same sums of at most some fifty products in another order, with sines that may
//! differ in the last bit, so that 1e-13 of the largest entry is asked; where torques follow from a solved system with a
//! condition around 1e3 (the steering system's small inertia), 1e-10.

mod observer;

use crate::common::multipliers::Multipliers;
use crate::common::*;
use kardan::element::UniversalJointCurve;
use kardan::equations::Curve;
use kardan::model::builtin;
use kardan::num::Matrix;
use kardan::reduce::{Dynamics, Kinematics, MechanismData, MechanismError, Reduced, Work};
use kardan::synthesis::{ChannelDesign, Observation, design_noninteracting, effective_inertia};
use kardan_rt::{
    Channel, ComputedTorque, Gain, Measurement, ModelObserver, Noninteracting, PositionLoop, Row, Sensor, Situation,
    StateSpace, Task,
};

/// Numbers in ±1 from a linear congruential generator, the same in every run.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn list(&mut self, length: usize, scale: f64) -> Vec<f64> {
        (0..length).map(|_| scale * self.next()).collect()
    }
}

fn source(name: &str) -> &'static str {
    builtin(name).expect("built in").source
}

/// The steering system at a joint angle, with coordinates of choice.
fn steering(degrees: u32, coordinates: [&str; 3]) -> Reduced {
    let named = format!("coordinates = {coordinates:?}");
    let text = source("sia-steering").replace("coordinates = [\"rk\", \"fs\", \"cj\"]", &named);
    let text = text.replace("beta = \"[0, 10, 20, 30] deg\"", &format!("beta = \"[{degrees}] deg\""));
    first(&text).reduced.clone()
}

const USUAL: [&str; 3] = ["rk", "fs", "cj"];

fn input(reduced: &Reduced, name: &str) -> usize {
    reduced.equations.inputs.iter().position(|input| input.element == name).expect("an input")
}

fn shaft(reduced: &Reduced, name: &str) -> usize {
    reduced.coordinate(name).expect("a shaft")
}

/// Asserts agreement relative to the largest entry.
#[track_caller]
fn agree(found: &[f64], expected: &[f64], tolerance: f64, what: &str) {
    assert_eq!(found.len(), expected.len(), "{what}");
    let scale = expected.iter().fold(1e-300f64, |max, x| max.max(x.abs()));
    for (k, (x, y)) in found.iter().zip(expected).enumerate() {
        assert!((x - y).abs() <= tolerance * scale, "{what} [{k}]: {x} against {y}");
    }
}

fn compare_with_dynamics(reduced: &Reduced, what: &str) {
    let data = MechanismData::new(reduced);
    let mechanism = data.block();
    let (dynamics, mut work) = Dynamics::new(reduced);
    let (r, equations) = (reduced.degrees_of_freedom(), &reduced.equations);
    let (mut numbers, mut scratch) = (Numbers(7), vec![f64::NAN; mechanism.memory()]);
    let mut kinematics = Kinematics::new(reduced);
    for _ in 0..200 {
        let (position, speed) = (numbers.list(r, 10.0), numbers.list(r, 30.0));
        assert!(dynamics.update(&position, &speed, &mut work));
        let now = mechanism.evaluate(&position, &speed, &mut scratch).expect("memory enough");
        // The shafts one after the other, and the terms along their directions.
        kinematics.update(&position, &speed);
        agree(now.angles, &kinematics.angles, 1e-13, what);
        agree(now.speeds, &kinematics.speeds, 1e-13, what);
        agree(now.basis, &kinematics.basis, 1e-13, what);
        agree(now.bias, &kinematics.bias, 1e-13, what);
        let row_dot = |row: &[(usize, f64)], x: &[f64]| row.iter().map(|(k, c)| c * x[*k]).sum::<f64>();
        let direction = |row: &[(usize, f64)]| -> Vec<f64> {
            (0..r).map(|j| row.iter().map(|(k, c)| c * kinematics.row(*k)[j]).sum()).collect()
        };
        let (mut inertia, mut passive, mut centrifugal) = (vec![0.0; r * r], vec![0.0; r], vec![0.0; r]);
        for body in &equations.inertias {
            let (row, value) = (body.row_f64(), body.value.to_f64());
            let g = direction(&row);
            (0..r * r).for_each(|entry| inertia[entry] += value * g[entry / r] * g[entry % r]);
            (0..r).for_each(|i| centrifugal[i] -= value * row_dot(&row, &kinematics.bias) * g[i]);
        }
        // What cancels in a force.
        let mut size = 0.0f64;
        let mut resist = |row: Vec<(usize, f64)>, torque: f64| {
            let g = direction(&row);
            (0..r).for_each(|i| passive[i] -= torque * g[i]);
            size = size.max(torque.abs());
        };
        for damper in &equations.dampers {
            let row = damper.row_f64();
            let speed = row_dot(&row, &kinematics.speeds);
            resist(row, damper.value.to_f64() * speed);
        }
        for spring in &equations.springs {
            let row = spring.row_f64();
            let twist = row_dot(&row, &kinematics.angles) - spring.value.rest.to_f64();
            resist(row, spring.value.stiffness.to_f64() * twist);
        }
        passive.iter_mut().zip(&centrifugal).for_each(|(force, more)| *force += more);
        agree(now.inertia, &inertia, 1e-13, what);
        let scale = passive.iter().fold(size.max(1e-300), |most, force| most.max(force.abs()));
        for (found, expected) in now.passive.iter().zip(&passive) {
            assert!((found - expected).abs() <= 1e-12 * scale, "{what}: {found} against {expected}, terms of {scale}");
        }
        agree(now.centrifugal, &centrifugal, 1e-12, what);
        agree(now.passive, &work.passive, 1e-13, what);
        agree(now.inputs, &work.input_rows, 1e-13, what);
        agree(now.frictions, &work.friction_rows, 1e-13, what);
        agree(mechanism.frictions, dynamics.friction_torques(), 0.0, what);
        for (speed, friction) in now.friction_speeds.iter().zip(&equations.frictions) {
            agree(&[*speed], &[row_dot(&friction.row_f64(), &kinematics.speeds)], 1e-12, what);
        }
    }
}

/// Through a joint bent by 60 deg: where the readings are as expected, the observer's rates are those of the mechanism, whatever the gain is.
#[test]
fn through_a_bent_joint_the_observer_is_exact() {
    let source = "[model]\ncoordinates = [\"a\"]\n[shaft.a]\ninertia = \"2 kg m^2\"\ndamping = \"0.5 N m s/rad\"\n\
                  [shaft.b]\ninertia = \"3 kg m^2\"\n[spring_damper.s]\nshaft_1 = \"a\"\nstiffness = \"8 N m/rad\"\n\
                  [universal_joint.u]\nshaft_1 = \"b\"\nshaft_2 = \"a\"\nangle = \"60 deg\"\n[motor.m]\nshaft = \"a\"\n";
    let reduced = &first(source).reduced;
    let data = MechanismData::new(reduced);
    // The encoder is on the driven body.
    let sensors = [Sensor { row: Row { first: 0, count: 1 }, speed: false, rest: 0.25 }];
    let observer = ModelObserver {
        mechanism: data.block(),
        inputs: &[0],
        sensors: &sensors,
        entries: &[(1, 1.0)],
        disturbances: &[0],
        gain: &[30.0, 300.0, 2000.0],
        zoh_integral: &[],
        friction_width: None,
    };
    let joint =
        UniversalJointCurve { ratio: kardan_rt::functions::cos(60f64.to_radians()), phase_in: 0.0, phase_out: 0.0 };
    let (mut scratch, mut rates) = (vec![0.0; observer.memory()], [0.0; 3]);
    for k in 0..20 {
        let (q, w, d, u) = (0.4 * f64::from(k), 2.0, -1.5, 0.75);
        let (value, (slope, curvature)) = (joint.value(q), joint.derivatives(q));
        assert!(observer.rates(&[q, w, d], &[u], &[value - 0.25], &mut scratch, &mut rates));
        // (2 + 3 γ′²) q̈ = u + d − 0.5 w − 8 q − 3 γ′ γ″ w²
        let inertia = 2.0 + 3.0 * slope * slope;
        let force = u + d - 0.5 * w - 8.0 * q - 3.0 * slope * curvature * w * w;
        assert!((rates[0] - w).abs() < 1e-11 && rates[2].abs() < 1e-9, "{q}: {rates:?}");
        assert!(
            (rates[1] - force / inertia).abs() < 1e-9 * (1.0 + rates[1].abs()),
            "{q}: {rates:?} {}",
            force / inertia
        );
    }
}

/// The block and the compiled dynamics are two evaluations of one model.
#[test]
fn mechanism_is_the_reduced_model() {
    for degrees in [0, 10, 20, 30] {
        for coordinates in [USUAL, ["rk", "fs", "cs"], ["wg", "rk", "fs"], ["cj", "wg", "rk"]] {
            compare_with_dynamics(&steering(degrees, coordinates), &format!("{degrees} deg, {coordinates:?}"));
        }
    }
    for name in ["harmonic-drive", "harmonic-drive-spring", "two-bodies", "rlc-ladder"] {
        compare_with_dynamics(&first(source(name)).reduced, name);
    }
    // Offsets, rests and phases; the inverse of a joint comes first.
    let odd = "[model]\ncoordinates = [\"a\"]\n[shaft.a]\ninertia = \"1 kg m^2\"\ndamping = \"0.1 N m s/rad\"\n\
               [shaft.b]\ninertia = \"2 kg m^2\"\ndamping = \"0.2 N m s/rad\"\n[shaft.c]\ninertia = \"3 kg m^2\"\n\
               [universal_joint.u]\nshaft_1 = \"a\"\nshaft_2 = \"b\"\nangle = \"40 deg\"\nphase = \"0.3 rad\"\n\
               [gear.g]\nshaft_1 = \"b\"\nshaft_2 = \"c\"\nratio = \"-7/3\"\noffset = \"0.5 rad\"\n\
               [spring_damper.s]\nshaft_1 = \"c\"\nstiffness = \"5 N m/rad\"\nrest = \"0.7 rad\"\n\
               [spring_damper.t]\nshaft_1 = \"a\"\nstiffness = \"4 N m/rad\"\nrest = \"-0.2 rad\"\n";
    compare_with_dynamics(&first(odd).reduced, "offsets and rests");
}

/// (6.117)-(6.120) against the independent reference.
#[test]
fn mechanism_agrees_with_the_reference() {
    let golden = golden();
    for degrees in [10, 30] {
        let reduced = steering(degrees, USUAL);
        let data = MechanismData::new(&reduced);
        let mechanism = data.block();
        let expected = &golden["sia"]["nonlinear_evaluation"][format!("{degrees}")];
        let mut scratch = vec![0.0; mechanism.memory()];
        let now = mechanism
            .evaluate(&list(&expected["q_rk_fs_cj"]), &list(&expected["v"]), &mut scratch)
            .expect("memory enough");
        agree(now.inertia, &rows(&expected["M"]).concat(), 1e-13, "M");
        let force: Vec<f64> = list(&expected["h_without_coulomb"]).iter().map(|x| -x).collect();
        agree(now.passive, &force, 1e-13, "h");
        for (column, name) in ["driver", "wg_motor", "rk_motor"].iter().enumerate() {
            let row = &now.inputs[3 * input(&reduced, name)..][..3];
            let expected: Vec<f64> = rows(&expected["F"]).iter().map(|row| row[column]).collect();
            agree(row, &expected, 1e-13, "F");
        }
        let mut friction = [0.0; 3];
        for (k, coulomb) in mechanism.frictions.iter().enumerate() {
            let torque = coulomb * now.friction_speeds[k].signum();
            friction.iter_mut().zip(&now.frictions[3 * k..]).for_each(|(sum, g)| *sum += torque * g);
        }
        agree(&friction, &list(&expected["friction_generalised"]), 1e-12, "friction");
    }
}

/// (6.20)-(6.27), corrected: gains on (wg, cs, wg′, cs′) and on (φ_cs reference, T_c,fs reference) are the reference's.
#[test]
fn harmonic_drive_law_agrees_with_the_reference() {
    let golden = golden();
    let reduced = first(source("harmonic-drive")).reduced.clone();
    let data = MechanismData::with_cuts(&reduced, &[("hd", "fs")]).expect("the flexspline can be cut");
    let position_loop = PositionLoop { natural_frequency: 20.0, damping_ratio: 1.0 };
    let gains = list(&golden["hd"]["position_gains"]);
    assert_eq!(gains, [20.0 * 20.0, 2.0 * 20.0]);
    let tasks = [Task::Position { shaft: shaft(&reduced, "cs"), position_loop }, Task::ConstraintTorque { cut: 0 }];
    let inputs = ["wg_motor", "cs_motor"].map(|name| input(&reduced, name));
    let law = ComputedTorque { mechanism: data.block(), tasks: &tasks, inputs: &inputs, friction_width: None };
    let mut scratch = vec![0.0; law.memory()];
    let mut response = |k: usize| {
        let mut unit = [0.0; 6];
        unit[k] = 1.0;
        let mut torques = [f64::NAN; 2];
        let now = Situation { position: &unit[..2], speed: &unit[2..4], references: &unit[4..], disturbances: &[] };
        assert!(law.torques(now, &mut scratch, &mut torques));
        torques
    };
    let (on_state, on_references) = (rows(&golden["hd"]["feedback_Kx"]), rows(&golden["hd"]["feedback_Kr"]));
    for k in 0..6 {
        for (motor, torque) in response(k).into_iter().enumerate() {
            let expected = if k < 4 { on_state[motor][k] } else { on_references[motor][k - 4] };
            close(torque, expected, 1e-12, &format!("motor {motor}, signal {k}"));
        }
    }
}

/// One constraint torque of the library at given motor torques.
fn constraint_torque(
    reduced: &Reduced,
    dynamics: &Dynamics,
    work: &Work,
    torques: &[f64],
    element: &str,
    shaft: usize,
) -> f64 {
    let none = vec![0.0; dynamics.friction_count()];
    let result = explicit(reduced, dynamics, work, torques, &none);
    let mut multipliers = Multipliers::new(reduced);
    let mut lambda = vec![0.0; multipliers.elements.len()];
    multipliers.solve(&work.kinematics, &result.force, &mut lambda);
    let k = multipliers.elements.iter().position(|name| name == element).expect("a constraint");
    lambda[k] * multipliers.coefficient(k, shaft, &work.kinematics)
}

/// Any constraint torque follows its reference, on either end of a bent joint too, beside a position (4.18).
#[test]
fn constraint_torques_follow_their_references() {
    for degrees in [0, 20, 30] {
        let reduced = steering(degrees, USUAL);
        let (dynamics, mut work) = Dynamics::new(&reduced);
        let inputs = ["wg_motor", "rk_motor"].map(|name| input(&reduced, name));
        let position_loop = PositionLoop { natural_frequency: 20.0, damping_ratio: 0.7 };
        for (element, name) in [("hd", "fs"), ("hd", "cs"), ("hd", "wg"), ("cardan", "cj"), ("cardan", "cs")] {
            let data = MechanismData::with_cuts(&reduced, &[(element, name)]).expect("a cut");
            let tasks =
                [Task::ConstraintTorque { cut: 0 }, Task::Position { shaft: shaft(&reduced, "rk"), position_loop }];
            let law = ComputedTorque { mechanism: data.block(), tasks: &tasks, inputs: &inputs, friction_width: None };
            let (mut scratch, mut numbers) = (vec![0.0; law.memory()], Numbers(3));
            for _ in 0..20 {
                let (position, speed) = (numbers.list(3, 4.0), numbers.list(3, 6.0));
                let references = [3.0 * numbers.next(), numbers.next()];
                let mut found = [0.0; 2];
                let now = Situation { position: &position, speed: &speed, references: &references, disturbances: &[] };
                assert!(law.torques(now, &mut scratch, &mut found), "{element} {name}");
                dynamics.update(&position, &speed, &mut work);
                let mut torques = vec![0.0; reduced.equations.inputs.len()];
                (torques[inputs[0]], torques[inputs[1]]) = (found[0], found[1]);
                let torque = constraint_torque(&reduced, &dynamics, &work, &torques, element, shaft(&reduced, name));
                let scale = found[0].abs().max(1.0) * 51.0;
                assert!((torque - references[0]).abs() < 1e-10 * scale, "{element} {name}: {torque}, {references:?}");
            }
        }
    }
}

/// The steering law at a straight joint is the one designed on the linear model, (6.124) and the corrected (6.130).
#[test]
fn computed_torque_is_the_linear_law_where_that_is_exact() {
    let variant = first(source("sia-steering"));
    let reduced = &variant.reduced;
    let data = MechanismData::new(reduced);
    let position_loop = PositionLoop { natural_frequency: 20.0, damping_ratio: 0.7 };
    let tasks =
        [Task::Position { shaft: shaft(reduced, "rk"), position_loop }, Task::Torque { shaft: shaft(reduced, "fs") }];
    let inputs = ["rk_motor", "wg_motor"].map(|name| input(reduced, name));
    let law = ComputedTorque { mechanism: data.block(), tasks: &tasks, inputs: &inputs, friction_width: None };
    let linear = variant.designed[0].clone();
    assert_eq!(linear.inputs(), ["rk_motor", "wg_motor"]);
    let mut linear = linear.run();
    let (dynamics, mut work) = Dynamics::new(reduced);
    let (mut scratch, mut numbers) = (vec![0.0; law.memory()], Numbers(11));
    for _ in 0..50 {
        let (position, speed, references) = (numbers.list(3, 3.0), numbers.list(3, 9.0), numbers.list(2, 2.0));
        dynamics.update(&position, &speed, &mut work);
        let (mut found, mut expected) = ([0.0; 2], [0.0; 2]);
        let now = Situation { position: &position, speed: &speed, references: &references, disturbances: &[] };
        assert!(law.torques(now, &mut scratch, &mut found));
        let (angles, speeds) = (&work.kinematics.angles, &work.kinematics.speeds);
        let observation = Observation {
            time: 0.0,
            angles,
            speeds,
            disturbances: &[],
            references: &references,
            readings: &[],
            states: &[],
        };
        linear.command(observation, &mut expected);
        agree(&found, &expected, 1e-11, "torques");
    }
}

/// The defining equations at a bent joint: φ̈_rk = v and J̃ φ̈_fs = u2 + T_fs, with what the driver does not told, the road
/// told as a disturbance, and the friction of the feed-forward acting.
#[test]
fn computed_torque_decouples_a_bent_joint() {
    let reduced = steering(30, USUAL);
    let data = MechanismData::new(&reduced);
    let (rk, fs) = (shaft(&reduced, "rk"), shaft(&reduced, "fs"));
    let position_loop = PositionLoop { natural_frequency: 20.0, damping_ratio: 0.7 };
    let tasks = [Task::Torque { shaft: fs }, Task::Position { shaft: rk, position_loop }];
    let inputs = ["wg_motor", "rk_motor"].map(|name| input(&reduced, name));
    let width = 0.05;
    let law = ComputedTorque { mechanism: data.block(), tasks: &tasks, inputs: &inputs, friction_width: Some(width) };
    let (dynamics, mut work) = Dynamics::new(&reduced);
    let (mut scratch, mut numbers) = (vec![0.0; law.memory()], Numbers(5));
    for _ in 0..50 {
        let (position, speed) = (numbers.list(3, 3.0), numbers.list(3, 9.0));
        let (u2, reference, driver, road) = (numbers.next(), numbers.next(), numbers.next(), 10.0 * numbers.next());
        let mut disturbances = [0.0; 5];
        disturbances[rk] = road;
        let mut found = [0.0; 2];
        let now =
            Situation { position: &position, speed: &speed, references: &[u2, reference], disturbances: &disturbances };
        assert!(law.torques(now, &mut scratch, &mut found));

        dynamics.update(&position, &speed, &mut work);
        let mut torques = vec![0.0; reduced.equations.inputs.len()];
        (torques[inputs[0]], torques[inputs[1]]) = (found[0], found[1]);
        torques[input(&reduced, "driver")] = driver;
        torques[input(&reduced, "T_dist")] = road;
        let frictions: Vec<f64> = (0..dynamics.friction_count())
            .map(|k| {
                let w = dynamics.friction_speed(k, &work);
                dynamics.friction_torques()[k] * w / w.hypot(width)
            })
            .collect();
        let shafts = explicit(&reduced, &dynamics, &work, &torques, &frictions).shafts;
        let expected = position_loop.acceleration(reference, position[0], speed[0], 0.0).expect("numbers");
        close(shafts[rk], expected, 1e-10, "φ̈_rk");
        let mut solution = work.kinematics.row(fs).to_vec();
        work.factor.solve(&mut solution);
        let mobility = dot(&solution, work.kinematics.row(fs));
        // Single shares of φ̈_fs are up to 1e4 rad/s² (50 · T_wg / J); block and plan sum them in other orders, some 1e-12 apart.
        close(shafts[fs], (u2 + driver) * mobility, 1e-8, "φ̈_fs");
    }
    // At a straight joint the inertia felt is (6.129).
    let straight = first(source("sia-steering"));
    let data = MechanismData::new(&straight.reduced);
    let mut scratch = vec![0.0; data.block().memory()];
    let now = data.block().evaluate(&[0.0; 3], &[0.0; 3], &mut scratch).expect("memory enough");
    let matrix: Vec<Vec<f64>> = now.inertia.chunks(3).map(<[f64]>::to_vec).collect();
    let inertia = kardan::num::rational_to_f64(&effective_inertia(&straight.design_models[0].linear, fs));
    close(
        1.0 / dot(&solve(&matrix, &now.basis[3 * fs..3 * fs + 3]), &now.basis[3 * fs..3 * fs + 3]),
        inertia,
        1e-12,
        "J̃",
    );
}

/// What cannot be done is told, whatever is measured; nothing panics, and the last torques stay.
#[test]
fn bad_situations_are_reported() {
    let reduced = steering(20, USUAL);
    let cut = |cuts: &[(&str, &str)]| MechanismData::with_cuts(&reduced, cuts);
    for cuts in [&[("hd", "rk")][..], &[("torsion_bar", "rk")], &[("hd", "fs"), ("hd", "fs")], &[("x", "y")]] {
        assert!(matches!(cut(cuts), Err(MechanismError { .. })), "{cuts:?}");
    }
    let data = cut(&[("hd", "fs")]).expect("a cut");
    let fs = shaft(&reduced, "fs");
    let inputs = ["wg_motor", "rk_motor"].map(|name| input(&reduced, name));
    let law = |tasks| ComputedTorque { mechanism: data.block(), tasks, inputs: &inputs, friction_width: None };
    let try_it = |law: ComputedTorque<'_, f64>, position: &[f64], reference: f64, scratch_size: usize| {
        let (mut scratch, mut torques) = (vec![0.0; scratch_size], [1.0, 2.0]);
        let now = Situation { position, speed: &[0.0; 3], references: &[reference, 0.0], disturbances: &[] };
        let found = law.torques(now, &mut scratch, &mut torques);
        assert!(found || torques == [1.0, 2.0]);
        assert!(torques.iter().all(|x| x.is_finite()));
        found
    };
    let position_loop = PositionLoop { natural_frequency: 20.0, damping_ratio: 0.7 };
    let good = [Task::Torque { shaft: fs }, Task::Position { shaft: shaft(&reduced, "rk"), position_loop }];
    let enough = law(&good).memory();
    assert!(try_it(law(&good), &[0.1; 3], 1.0, enough));
    for short in 0..enough {
        assert!(!try_it(law(&good), &[0.1; 3], 1.0, short), "{short} of {enough}");
    }
    for bad in [f64::NAN, f64::INFINITY, -f64::INFINITY] {
        assert!(!try_it(law(&good), &[0.1; 3], bad, enough));
        for k in 0..3 {
            let mut position = [0.1; 3];
            position[k] = bad;
            assert!(!try_it(law(&good), &position, 1.0, enough), "{k}");
        }
    }
    assert!(!try_it(law(&good), &[0.1; 2], 1.0, enough), "a coordinate is missing");
    let still = ComputedTorque { friction_width: Some(0.0), ..law(&good) };
    assert!(try_it(still, &[0.1; 3], 1.0, enough), "the sign of a speed of zero is zero");
    // The same task twice, a cut and a shaft that are not there, one task less than inputs.
    let duplicate_tasks = [Task::Torque { shaft: fs }, Task::Torque { shaft: fs }];
    let no_cut = [Task::ConstraintTorque { cut: 1 }, good[1]];
    let no_shaft = [Task::Torque { shaft: 99 }, good[1]];
    for tasks in [&duplicate_tasks[..], &no_cut, &no_shaft, &good[..1]] {
        assert!(!try_it(law(tasks), &[0.1; 3], 1.0, 1000), "{tasks:?}");
    }
}

/// Law and observer with their memory, in either precision.
struct Controller<'a, T> {
    law: ComputedTorque<'a, T>,
    observer: StateSpace<'a, T>,
    scratch: Vec<T>,
    state: [T; 6],
    next: [T; 6],
    torques: [T; 2],
}

impl<'a, T: kardan_rt::Real> Controller<'a, T> {
    fn new(law: ComputedTorque<'a, T>, [a, b]: &'a [Vec<T>; 2]) -> Self {
        let observer = StateSpace::new(a, b, &[], &[], 6, 3).expect("shapes");
        let scratch = vec![T::ZERO; law.memory()];
        Self { law, observer, scratch, state: [T::ZERO; 6], next: [T::ZERO; 6], torques: [T::ZERO; 2] }
    }

    fn step(&mut self, readings: &[T], references: &[T]) {
        let (position, speed) = self.state.split_at(3);
        let now = Situation { position, speed, references, disturbances: &[] };
        assert!(self.law.torques(now, &mut self.scratch, &mut self.torques));
        assert!(self.observer.step(&mut self.state, readings, &mut self.next));
    }
}

/// A constraint torque in the cut 0 and an angle.
fn tasks<T>(shaft: usize, to: impl Fn(f64) -> T) -> [Task<T>; 2] {
    let position_loop = PositionLoop { natural_frequency: to(20.0), damping_ratio: to(0.7) };
    [Task::ConstraintTorque { cut: 0 }, Task::Position { shaft, position_loop }]
}

/// Same inputs, same bits; single precision close by; nothing allocated.
#[test]
fn steps_are_deterministic_and_do_not_allocate() {
    let reduced = steering(20, USUAL);
    let wide = MechanismData::with_cuts(&reduced, &[("hd", "fs")]).expect("a cut");
    let narrow = wide.cast(|x| x as f32);
    let inputs = ["wg_motor", "rk_motor"].map(|name| input(&reduced, name));
    let rk = shaft(&reduced, "rk");
    let (wide_tasks, narrow_tasks) = (tasks(rk, |x| x), tasks(rk, |x| x as f32));
    // A stable "observer" whose state follows three readings.
    let mut matrices = [vec![0.0; 36], vec![0.0; 18]];
    for k in 0..6 {
        matrices[0][7 * k] = 0.9;
        matrices[1][3 * k + k % 3] = 0.1;
    }
    let narrow_matrices = matrices.each_ref().map(|m| m.iter().map(|x| *x as f32).collect::<Vec<f32>>());
    let run = || {
        let law =
            ComputedTorque { mechanism: wide.block(), tasks: &wide_tasks, inputs: &inputs, friction_width: Some(0.1) };
        let narrow_law = ComputedTorque {
            mechanism: narrow.block(),
            tasks: &narrow_tasks,
            inputs: &inputs,
            friction_width: Some(0.1),
        };
        let mut wide = Controller::new(law, &matrices);
        let mut narrow = Controller::new(narrow_law, &narrow_matrices);
        let (mut numbers, mut bits) = (Numbers(17), 0u64);
        let mut steps = || {
            for _ in 0..100 {
                let readings = [numbers.next(), numbers.next(), numbers.next()];
                let references = [numbers.next(), numbers.next()];
                wide.step(&readings, &references);
                narrow.step(&readings.map(|x| x as f32), &references.map(|x| x as f32));
                for (wide, narrow) in wide.torques.iter().zip(narrow.torques) {
                    bits = bits.rotate_left(5) ^ wide.to_bits() ^ u64::from(narrow.to_bits());
                    // Shares of up to 1e3 N m cancel each other; each is rounded to 1e-7 some ten times.
                    assert!((wide - f64::from(narrow)).abs() < 1e-3 * wide.abs().max(10.0), "{wide} against {narrow}");
                }
            }
        };
        assert_eq!(allocation_counter::measure(&mut steps).count_total, 0, "a step allocated");
        bits
    };
    let bits = run();
    assert_eq!(bits, run());
    let one = allocation_counter::measure(|| drop(std::hint::black_box(vec![bits; 3])));
    assert_eq!(one.count_total, 1, "the counter counts");
}

/// Law and observer as blocks in a sampled loop at 10 kHz, one sample of delay by the predictor: the rack follows, the
/// wheel does not feel it, and the torques that nobody measures are found.
#[test]
fn sampled_law_with_observer_in_the_loop() {
    let variant = first(source("sia-steering"));
    let (model, period) = (&variant.design_models[0].linear, 1e-4);
    let number = |name: &str| shaft(&variant.reduced, name);
    let design = {
        let input = |name: &str| model.inputs.iter().position(|input| input == name).expect("an input");
        let channels = [("fs", "wg_motor"), ("rk", "rk_motor")]
            .map(|(output, motor)| ChannelDesign { shaft: number(output), input: input(motor) });
        design_noninteracting(model, &channels, &|_| Default::default()).expect("can be decoupled")
    };
    let inertia: Vec<f64> = design.effective_inertia.iter().map(kardan::num::rational_to_f64).collect();
    let position_loop = PositionLoop { natural_frequency: 20.0, damping_ratio: 0.7 };
    let channels = [
        Channel::Torque { inverse_inertia: 1.0 / inertia[0] },
        Channel::Position { position_loop, inverse_inertia: 1.0 / inertia[1] },
    ];
    let (on_state, on_accelerations) = (design.state_gain.to_f64(), design.acceleration_gain.to_f64());
    let law = Noninteracting {
        state_gain: Gain::new(on_state.as_slice(), 6).expect("whole rows"),
        acceleration_gain: Gain::new(on_accelerations.as_slice(), 2).expect("whole rows"),
        channels: &channels,
    };
    let predictor = observer::predictor(model, ["wg", "cs", "rk", "cj"].map(number), period);
    let block = StateSpace::new(&predictor.a, &predictor.b, &[], &[], 8, 5).expect("shapes");

    // The plant with the driver, who holds the wheel by (6.138), and the road.
    let (a, b) = observer::continuous(model, &["wg_motor", "rk_motor", "driver", "T_dist"]);
    let hands = [400.0 * inertia[0], 28.0 * inertia[0]];
    let with_driver = Matrix::from_fn(6, 6, |i, j| a[(i, j)] - if j % 3 == 1 { b[(i, 2)] * hands[j / 3] } else { 0.0 });
    let (phi, gamma) = observer::sampled(&with_driver, &b, period);
    let plant_b: Vec<f64> = (0..6).flat_map(|i| [gamma[(i, 0)], gamma[(i, 1)], gamma[(i, 3)]]).collect();
    let sensors: Vec<f64> = (0..3).flat_map(|i| predictor.sensors.row(i)[..6].to_vec()).collect();
    let plant = StateSpace::new(phi.as_slice(), &plant_b, &sensors, &[0.0; 9], 6, 3).expect("shapes");

    let (mut x, mut estimate, mut next) = ([0.0; 6], [0.0; 8], [0.0; 8]);
    let (mut accelerations, mut torques, mut readings) = ([0.0; 2], [0.0; 2], [0.0; 3]);
    let mut felt = 0.0f64;
    let (reference, road) = (0.4, -3.0);
    for k in 0..15_000 {
        let road = if k < 7_500 { 0.0 } else { road };
        let [rk, fs, _, w_rk, w_fs, _, _, load] = estimate;
        let measured = Measurement {
            state: &estimate[..6],
            positions: &[fs, rk],
            speeds: &[w_fs, w_rk],
            references: &[0.0, reference],
            loads: &[0.0, load],
        };
        assert!(law.torques(measured, &mut accelerations, &mut torques));
        assert!(plant.outputs(&x, &[0.0; 3], &mut readings));
        let [wg, cs, bar] = readings;
        assert!(block.step(&mut estimate, &[torques[0], torques[1], wg, cs, bar], &mut next));
        assert!(plant.step(&mut x, &[torques[0], torques[1], road], &mut next[..6]));
        if k < 7_500 {
            felt = felt.max((hands[0] * x[1] + hands[1] * x[4]).abs());
        }
    }
    // e^(−0.7·20·0.75 s) = 3e-5 of the step and of the load's excursion is left.
    close(x[0], reference, 1e-4, "the rack stays at its reference under load");
    close(estimate[7], road, 1e-3, "the load is found");
    for k in 0..6 {
        close(estimate[k], x[k], 1e-4, "the estimate");
    }
    // Without sampling it would be nothing; friction of the wheel alone is 0.2 N m.
    assert!(felt < 0.05, "the driver feels {felt} N m");
}
