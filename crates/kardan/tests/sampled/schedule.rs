//! A sampled law that follows where the joints of its plant stand: at every point it is the law designed there, between points it
//! stays close to one, with a straight joint it is the law without points, and a turned column alone asks for no torque.

use std::sync::Arc;

use crate::common::prepared;
use kardan::model::builtin;
use kardan::num::Matrix;
use kardan::results::{ControllerData, DataNumber};
use kardan::study;
use kardan::synthesis::{Clock, Law, Observation, Plant, design_law};

const LAW: &str = "[control.column]\nlaw = \"sampled_noninteracting\"\n";

/// The built-in steering with these keys of the controller `column`, at two joint angles.
fn source(keys: &str) -> String {
    let source = builtin("sia-steering-ecu").expect("built in").source;
    let (head, tail) = source.split_once("[[variant]]").expect("variants");
    let (_, tail) = tail.split_once("# ---- bodies").expect("bodies");
    let (tail, _) = tail.split_once("[[requirement]]").expect("requirements");
    assert!(tail.contains(LAW));
    let variants = [("straight", 0), ("bent", 30)].map(|(name, angle)| {
        format!("[[variant]]\nname = \"{name}\"\nset = {{ beta = \"{angle} deg\" }}\ncontrols = [\"column\", \"driver_model\"]\n")
    });
    format!("{head}{}# {}", variants.concat(), tail.replace(LAW, &format!("{LAW}{keys}\n")))
}

/// The controller `column` of a variant with these keys, designed at a position of the column (rad), or as the file says.
fn law(keys: &str, variant: &str, column: Option<f64>) -> (Arc<dyn Law>, Plant) {
    let prepared = prepared(&source(keys));
    let variant = prepared.variants.iter().find(|one| one.name == variant).expect("a variant");
    let control = &variant.model.controls[0];
    assert_eq!(control.name, "column");
    let plant = match column {
        Some(angle) => Plant::new(variant.reduced.clone(), vec![0.0, 0.0, angle]),
        None => variant.design_models[0].clone(),
    };
    assert_eq!(plant.linear.coordinates, ["rk", "fs", "cj"]);
    (design_law(control.law, &control.name, &control.values, &plant).expect("a design"), plant)
}

fn table<'a>(data: &'a ControllerData, name: &str) -> &'a [Vec<f64>] {
    &data.matrices.iter().find(|matrix| matrix.name == name).unwrap_or_else(|| panic!("no {name}")).values
}

const PARTS: [&str; 7] = ["prediction", "input", "output", "correction", "feedback", "force_input", "on_forces"];

/// The matrices of a point, by name; those of the governor too.
fn point(data: &ControllerData, k: usize) -> Vec<(String, Matrix<f64>)> {
    let row = &table(data, "schedule")[k];
    let names = PARTS.into_iter().chain(["governor on_state", "governor on_model", "governor on_references"]);
    let mut first = 0;
    let parts: Vec<_> = names
        .map(|name| {
            let shape = &table(data, &format!("shape of {name}"))[0];
            let (rows, columns) = (shape[0] as usize, shape[1] as usize);
            let start = first;
            first += rows * columns;
            (name.to_string(), Matrix::from_fn(rows, columns, |i, j| row[start + i * columns + j]))
        })
        .collect();
    assert_eq!(first, row.len(), "the shapes cover a row");
    parts
}

fn matrix(rows: &[Vec<f64>]) -> Matrix<f64> {
    Matrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
}

/// The largest difference over the largest entry.
fn apart(one: &Matrix<f64>, other: &Matrix<f64>) -> f64 {
    assert_eq!((one.rows(), one.columns()), (other.rows(), other.columns()));
    let size = other.as_slice().iter().fold(0.0f64, |max, x| max.max(x.abs()));
    one.as_slice().iter().zip(other.as_slice()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / size
}

/// Every number of every point is that of the law designed there alone.
#[test]
fn at_every_point_it_is_the_point_law() {
    let scheduled = law("", "bent", None).0.describe().controller_data;
    assert_eq!(scheduled.block, "ScheduledRegulator");
    assert_eq!(table(&scheduled, "schedule").len(), 16);
    for k in 0..16 {
        // The forces that the scheduled design knows beside are rounded along with all else.
        let error = from_a_design(&scheduled, k, 0.0);
        assert!(error <= 1e-7, "point {k}: {error}");
    }
}

/// The largest difference between the numbers at a share of the way from one point to the next and those of a law designed there.
fn from_a_design(scheduled: &ControllerData, k: usize, share: f64) -> f64 {
    let count = table(scheduled, "schedule").len();
    let angle = std::f64::consts::PI * (k as f64 + share) / count as f64;
    let point_design = law("schedule = 1", "bent", Some(angle)).0.describe().controller_data;
    assert_eq!(point_design.block, "Regulator");
    let (here, next) = (point(scheduled, k), point(scheduled, (k + 1) % count));
    let error = |name: &&str| {
        let of = |all: &[(String, Matrix<f64>)]| all.iter().find(|(other, _)| other == name).unwrap().1.clone();
        apart(&of(&here).scale(&(1.0 - share)).plus(&of(&next).scale(&share)), &matrix(table(&point_design, name)))
    };
    PARTS[..5].iter().map(error).fold(0.0, f64::max)
}

/// Half way between two points the numbers differ from those of a law designed there by less than 1 % of the largest of their kind;
/// with twice the points by a fourth of that, as straight lines through smooth curves do.
#[test]
fn between_points_it_stays_close_to_a_design() {
    let [coarse, fine] = ["", "schedule = 32"].map(|keys| law(keys, "bent", None).0.describe().controller_data);
    let worst = |data: &ControllerData, places: &[usize]| {
        places.iter().map(|k| from_a_design(data, *k, 0.5)).fold(0.0, f64::max)
    };
    let [coarse, fine] = [worst(&coarse, &[0, 2, 4, 7, 11]), worst(&fine, &[0, 4, 8, 15, 22])];
    assert!(coarse < 0.01 && coarse > 1e-5, "{coarse}");
    assert!(fine < 0.3 * coarse && fine > 0.2 * coarse, "{fine} {coarse}");
}

/// One sample of a law: its commands and its next states.
fn sample(law: &dyn Law, single: bool, states: &[f64], readings: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let mut block = law.block(Some(Clock { single, ..law.clock().expect("sampled") })).expect("finite");
    let (mut out, mut next) = (vec![0.0; 2], vec![0.0; states.len()]);
    let references = [0.3, 1.5];
    let observation = Observation {
        time: 0.0,
        angles: &[],
        speeds: &[],
        disturbances: &[],
        references: &references,
        readings,
        states,
    };
    assert!(block.command(observation, &mut out));
    assert!(block.states(observation, &[], &mut next));
    (out, next)
}

/// The block at a point, with readings that differ from what it expects by so much, does what the block of the law designed there
/// does with the same difference; in single precision too. Speeds are zero, so that no force of theirs is in it.
#[test]
fn the_block_at_a_point_is_that_of_the_point_law() {
    let (scheduled, _) = law("", "bent", None);
    for k in [0, 3, 8, 13] {
        let angle = std::f64::consts::PI * k as f64 / 16.0;
        let (point_law, plant) = law("schedule = 1", "bent", Some(angle));
        let data = point_law.describe().controller_data;
        let offset =
            |name: &str| data.numbers.iter().find(|DataNumber { name: other, .. }| other == name).expect("told").value;
        let offsets = ["rk_encoder.phi", "wg_encoder.phi", "bar.tau"].map(|name| offset(&format!("{name} offset")));
        let mut states = vec![0.0; point_law.states().len()];
        let estimate = [angle + 0.01, -0.2, angle];
        states[..3].copy_from_slice(&estimate);
        (states[6], states[7], states[8], states[9]) = (0.2, -0.1, 0.3, -0.4);
        let n = table(&data, "prediction").len();
        (states[n], states[n + 2]) = (0.25, 0.5);
        let mut kinematics = kardan::reduce::Kinematics::new(&plant.reduced);
        kinematics.update(&estimate, &[0.0; 3]);
        let shaft = |name: &str| kinematics.angles[plant.reduced.coordinate(name).expect("a shaft")];
        let exact = [shaft("rk"), shaft("wg"), 100.0 * (shaft("rk") - shaft("cj"))];
        let c = matrix(table(&data, "output"));
        let error = [3e-4, -5e-3, 0.02];
        let linear: Vec<f64> =
            (0..3).map(|i| (0..n).map(|j| c[(i, j)] * states[j]).sum::<f64>() + offsets[i] + error[i]).collect();
        let bent: Vec<f64> = (0..3).map(|i| exact[i] + error[i]).collect();
        let expected = sample(&*point_law, false, &states, &linear);
        for (single, tolerance) in [(false, 1e-8), (true, 2e-3)] {
            let found = sample(&*scheduled, single, &states, &bent);
            // All but the last readings, which are kept as they are.
            let of = |(commands, next): &(Vec<f64>, Vec<f64>)| [commands.clone(), next[..n + 4].to_vec()].concat();
            for (number, (x, y)) in of(&found).iter().zip(of(&expected)).enumerate() {
                assert!((x - y).abs() <= tolerance * y.abs().max(1.0), "point {k} {single} {number}: {x} {y}");
            }
        }
    }
}

/// With a straight joint there is nothing to follow: the law is, bit for bit, the one that is designed straight ahead alone.
#[test]
fn a_straight_joint_changes_no_bit() {
    for keys in ["", "schedule = 24"] {
        let (one, other) =
            (law(keys, "straight", None).0.describe(), law("schedule = 1", "straight", None).0.describe());
        assert_eq!(one.controller_data, other.controller_data);
        assert_eq!((one.controller_data.block.as_str(), one.notes), ("Regulator", other.notes));
    }
    let bent = law("schedule = 1", "bent", None).0;
    assert!(!bent.is_nonlinear() && bent.describe().controller_data.block == "Regulator");
}

/// Where the column stands at rest, and its reference with it, nothing is asked of the motors; as little as rounding leaves.
#[test]
fn a_rotated_column_in_equilibrium_needs_no_torque() {
    let (scheduled, plant) = law("", "bent", None);
    let mut kinematics = kardan::reduce::Kinematics::new(&plant.reduced);
    for angle in [0.3, std::f64::consts::FRAC_PI_2, 2.9, -7.7, 40.0] {
        kinematics.update(&[angle, 0.5 * angle, angle], &[0.0; 3]);
        let mut states = vec![0.0; scheduled.states().len()];
        scheduled.start(&kinematics.angles, &kinematics.speeds, &mut states);
        let mut block = scheduled.block(scheduled.clock()).expect("finite");
        for _ in 0..50 {
            let observation = Observation {
                time: 0.0,
                angles: &kinematics.angles,
                speeds: &kinematics.speeds,
                disturbances: &[],
                references: &[angle, 0.0],
                readings: &[],
                states: &states,
            };
            let (mut out, mut next) = ([1.0; 2], states.clone());
            assert!(block.command(observation, &mut out));
            assert!(block.states(observation, &[], &mut next));
            assert!(block.health() == kardan_rt::Health::default(), "{:?}", block.health());
            states = next;
            assert!(out.iter().all(|x| x.abs() < 1e-7 * angle.abs().max(1.0)), "{angle}: {out:?}");
        }
    }
}

/// What is said of the loop at a position is the loop of the law designed there, at every point; and the loop that is looked at
/// over half a turn is stable throughout.
#[test]
fn the_linear_part_at_a_point_is_that_of_the_point_law() {
    let (scheduled, _) = law("", "bent", None);
    assert!(scheduled.is_nonlinear());
    for k in [0, 5, 8] {
        let angle = std::f64::consts::PI * f64::from(k) / 16.0;
        let at_point = scheduled.linear_at(&[angle, 0.0, angle], scheduled.clock()).expect("finite");
        // As a law of its own it stands at zero, so the rows of its readings are those of the straight column.
        let (point_law, _) = law("schedule = 1", "bent", Some(angle));
        let expected = point_law.linear();
        for (one, other) in [
            (&at_point.states, &expected.states),
            (&at_point.angles, &expected.angles),
            (&at_point.on_states, &expected.on_states),
            (&at_point.on_angles, &expected.on_angles),
            (&at_point.on_references, &expected.on_references),
        ] {
            assert!(apart(one, other) < 1e-7, "point {k}: {}", apart(one, other));
        }
    }
}

/// A number of positions is whole; and a spring that acts through the joint cannot be followed: asked for, that is a mistake, else
/// it is told.
#[test]
fn what_cannot_be_followed_is_reported() {
    for points in ["0.5", "2.5", "300"] {
        let found = study::check(&source(&format!("schedule = {points}")));
        assert!(found.iter().any(|d| d.message.contains("`schedule` is")), "{points}: {found:?}");
    }
    let bent = |keys: &str| {
        source(keys).replace(
            "[motor.wg_motor]",
            "[spring_damper.through]\nshaft_1 = \"cs\"\nshaft_2 = \"rk\"\nstiffness = \"1 N m/rad\"\ndamping = \"0 N m s/rad\"\n\n[motor.wg_motor]",
        )
    };
    let found = study::check(&bent("schedule = 8"));
    assert!(found.iter().any(|d| d.message.contains("the spring of `through` acts through a joint")), "{found:?}");
    let prepared = prepared(&bent(""));
    let variant = prepared.variants.iter().find(|one| one.name == "bent").expect("a variant");
    let design = variant.designed[0].describe();
    assert_eq!(design.controller_data.block, "Regulator");
    assert!(design.notes.iter().any(|note| note.contains("acts through a joint")), "{:?}", design.notes);
}
