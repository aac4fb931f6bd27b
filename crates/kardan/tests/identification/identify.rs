//! Identification: the regressor against the equations of motion, what can be determined at all, and least squares.

use crate::common::{self, Dice, explicit, variants};
use kardan::identify::{
    Coefficient, Excitation, FitOptions, LeastSquares, Motion, Regressor, Samples, Steadiness, Where, coefficients,
    fit, steady_segments, undetermined,
};
use kardan::model::builtin;
use kardan::num::{Matrix, Rational};
use kardan::reduce::{Dynamics, Reduced};

fn reduced(source: &str, variant: usize) -> Reduced {
    variants(source)[variant].reduced.clone()
}

fn built_in(name: &str, variant: usize) -> Reduced {
    reduced(builtin(name).expect("built in").source, variant)
}

fn named(all: &[Coefficient], names: &[&str]) -> Vec<Coefficient> {
    names.iter().map(|name| all.iter().find(|one| one.name == *name).expect("a coefficient").clone()).collect()
}

fn unit(dice: &mut Dice) -> f64 {
    dice.between(-1_000_000, 1_000_000) as f64 / 1e6
}

/// At any motion the accelerations of the equations of motion satisfy `X θ = y` with the coefficients of the model, whichever of
/// them are asked for: with constant directions and through a bent joint.
#[test]
fn the_regressor_is_the_torque_balance() {
    let mut dice = Dice(5);
    for (name, variant) in [("sia-steering", 0), ("sia-steering", 3), ("harmonic-drive", 2), ("sia-steering-ecu", 1)] {
        let model = built_in(name, variant);
        let (dynamics, mut work) = Dynamics::new(&model);
        let all = coefficients(&model);
        let (r, inputs) = (model.degrees_of_freedom(), model.equations.inputs.len());
        for trial in 0..12 {
            let selected: Vec<Coefficient> = all.iter().filter(|_| trial == 0 || dice.below(2) == 1).cloned().collect();
            let p = selected.len();
            let mut regressor = Regressor::new(&model, &selected, &[], 1e-9);
            assert_eq!((regressor.rows(), regressor.columns()), (r, p));
            let position: Vec<f64> = (0..r).map(|_| unit(&mut dice)).collect();
            let speed: Vec<f64> = (0..r).map(|_| 3.0 * unit(&mut dice)).collect();
            let torques: Vec<f64> = (0..inputs).map(|_| 2.0 * unit(&mut dice)).collect();
            dynamics.update(&position, &speed, &mut work);
            let frictions: Vec<f64> = (0..dynamics.friction_count())
                .map(|k| dynamics.friction_torques()[k] * dynamics.friction_speed(k, &work).signum())
                .collect();
            let found = explicit(&model, &dynamics, &work, &torques, &frictions);
            let (mut x, mut y) = (vec![0.0; r * p], vec![0.0; r]);
            let motion = Motion { position: &position, speed: &speed, acceleration: &found.reduced };
            assert!(regressor.fill(motion, &torques, &mut x, &mut y), "all directions move");
            let size = found.reduced.iter().fold(1.0f64, |max, x| max.max(x.abs()));
            for i in 0..r {
                let predicted: f64 = (0..p).map(|k| x[i * p + k] * selected[k].value).sum();
                assert!((predicted - y[i]).abs() < 1e-10 * size, "{name} {variant}: row {i}: {predicted} {}", y[i]);
            }
            // A torque that nobody measured may be anything: a row less, and the balance holds.
            let hidden = dice.below(inputs);
            let mut blind = Regressor::new(&model, &selected, &[hidden], 1e-9);
            assert_eq!(blind.rows(), r - 1);
            let mut wrong = torques.clone();
            wrong[hidden] = 1e3 * unit(&mut dice);
            let (mut x, mut y) = (vec![0.0; (r - 1) * p], vec![0.0; r - 1]);
            assert!(blind.fill(motion, &wrong, &mut x, &mut y));
            for i in 0..r - 1 {
                let predicted: f64 = (0..p).map(|k| x[i * p + k] * selected[k].value).sum();
                assert!(
                    (predicted - y[i]).abs() < 1e-10 * size,
                    "{name} {variant}: {hidden} unknown: {predicted} {}",
                    y[i]
                );
            }
        }
    }
}

/// The columns of Proposition 6.2, with the corrected transpose of (6.38), for the harmonic drive at constant speeds.
#[test]
fn columns_of_the_source() {
    let model = built_in("harmonic-drive", 2);
    let wg = model.coordinate_names().iter().position(|name| name == "wg").expect("a coordinate");
    assert_eq!(model.degrees_of_freedom(), 2);
    let selected = named(
        &coefficients(&model),
        &["wg.damping", "cs.damping", "fs.damping", "wg.friction", "cs.friction", "fs.friction"],
    );
    let mut regressor = Regressor::new(&model, &selected, &[], 1e-6);
    for (w_wg, w_cs) in [(30.0, 0.4), (-20.0, 1.3), (50.0, 2.0), (-70.0, -0.1)] {
        let mut speed = [w_cs; 2];
        speed[wg] = w_wg;
        let motion = Motion { position: &[0.0; 2], speed: &speed, acceleration: &[0.0; 2] };
        let (mut x, mut y) = ([0.0; 12], [0.0; 2]);
        assert!(regressor.fill(motion, &vec![0.0; model.equations.inputs.len()], &mut x, &mut y));
        let i = 50.0;
        let w_fs = -w_wg / i + (i + 1.0) / i * w_cs;
        let upper =
            [w_wg, 0.0, w_wg / (i * i) - (i + 1.0) / (i * i) * w_cs, f64::signum(w_wg), 0.0, -w_fs.signum() / i];
        let lower = [
            0.0,
            w_cs,
            -(i + 1.0) / (i * i) * w_wg + ((i + 1.0) / i).powi(2) * w_cs,
            0.0,
            f64::signum(w_cs),
            (i + 1.0) / i * w_fs.signum(),
        ];
        for k in 0..6 {
            assert!((x[wg * 6 + k] - upper[k]).abs() < 1e-12, "{k}: {} {}", x[wg * 6 + k], upper[k]);
            assert!((x[(1 - wg) * 6 + k] - lower[k]).abs() < 1e-12, "{k}: {} {}", x[(1 - wg) * 6 + k], lower[k]);
        }
    }
    // Where the flexspline rests its Coulomb torque has no sign.
    let mut speed = [1.0; 2];
    speed[wg] = 51.0;
    let motion = Motion { position: &[0.0; 2], speed: &speed, acceleration: &[0.0; 2] };
    let torques = vec![0.0; model.equations.inputs.len()];
    assert!(!regressor.fill(motion, &torques, &mut [0.0; 12], &mut [0.0; 2]));
}

/// Constant speeds of the harmonic drive give Table 6.1 back, its negative equivalent damping with it: the reduced damping matrix
/// is positive definite all the same \[diss. 6.1.4\].
#[test]
fn table_6_1_from_constant_speeds() {
    let model = built_in("harmonic-drive", 2);
    let all = coefficients(&model);
    let names = ["wg.damping", "cs.damping", "fs.damping", "wg.friction", "cs.friction", "fs.friction"];
    let selected = named(&all, &names);
    assert_eq!(undetermined(&model, &selected, &[], Excitation::Steady), Vec::<Vec<Rational>>::new());
    let (dynamics, mut work) = Dynamics::new(&model);
    let mut regressor = Regressor::new(&model, &selected, &[], 1e-6);
    let mut problem = LeastSquares::new(6);
    let inputs = model.equations.inputs.len();
    let (mut x, mut y) = ([0.0; 12], [0.0; 2]);
    for w_first in [-60.0, -25.0, 10.0, 45.0] {
        for w_second in [-1.5, -0.3, 0.8, 2.0] {
            let speed = [w_first, w_second];
            dynamics.update(&[0.0; 2], &speed, &mut work);
            // Torques of the inputs that hold these speeds, by least squares over the inputs' directions.
            let mut needed = [0.0; 2];
            for i in 0..2 {
                needed[i] = -work.passive[i];
                for k in 0..dynamics.friction_count() {
                    let torque = dynamics.friction_torques()[k] * dynamics.friction_speed(k, &work).signum();
                    needed[i] += torque * work.friction_rows[2 * k + i];
                }
            }
            let directions: Vec<Vec<f64>> =
                (0..2).map(|i| (0..2).map(|k| work.input_rows[2 * k + i]).collect()).collect();
            let mut torques = common::solve(&directions, &needed);
            torques.resize(inputs, 0.0);
            let motion = Motion { position: &[0.0; 2], speed: &speed, acceleration: &[0.0; 2] };
            assert!(regressor.fill(motion, &torques, &mut x, &mut y));
            (0..2).for_each(|i| problem.add(&x[6 * i..6 * i + 6], y[i], 1.0));
        }
    }
    let found = problem.solve().expect("rows");
    assert_eq!((found.rank, found.rows), (6, 32));
    let d = |name: &str| found.values[names.iter().position(|other| *other == name).expect("asked for")];
    for (one, value) in selected.iter().zip(&found.values) {
        assert!((one.value - value).abs() < 1e-10, "{}: {value} {}", one.name, one.value);
    }
    // (6.34) with i = 50, and the remark below it.
    let (wg, cs, fs) = (d("wg.damping"), d("cs.damping"), d("fs.damping"));
    let (d11, d12, d22) = (wg + fs / 2500.0, -51.0 / 2500.0 * fs, cs + 1.02 * 1.02 * fs);
    for (found, table) in [(d11, 0.0005), (d12, -0.0004), (d22, 0.0081)] {
        assert!((found - table).abs() < 1e-9, "{found} {table}");
    }
    assert!(cs < 0.0 && d11 > 0.0 && d11 * d22 - d12 * d12 > 0.0);
}

/// What cannot be determined: exact combinations, for constant speeds and for any motion; and they leave the regressor's equation
/// as it is.
#[test]
fn what_no_data_can_identify() {
    let source = "\
[model]
name = \"shared\"
coordinates = [\"b\", \"c\"]
[shaft.a]
inertia = \"1 kg m^2\"
friction = \"0.2 N m\"
damping = \"0.1 N m s/rad\"
[shaft.b]
inertia = \"2 kg m^2\"
friction = \"0.3 N m\"
damping = \"0.2 N m s/rad\"
[shaft.c]
inertia = \"3 kg m^2\"
friction = \"0.1 N m\"
[gear.g]
shaft_1 = \"a\"
shaft_2 = \"b\"
ratio = 3
[spring_damper.s]
shaft_1 = \"b\"
shaft_2 = \"c\"
stiffness = \"50 N m/rad\"
damping = \"0.5 N m s/rad\"
[motor.m]
shaft = \"a\"
";
    let model = reduced(source, 0);
    let all = coefficients(&model);
    let dependencies = undetermined(&model, &all, &[], Excitation::Free);
    // Inertias, dampings and frictions of the two geared shafts.
    assert_eq!(dependencies.len(), 3, "{dependencies:?}");
    let mut regressor = Regressor::new(&model, &all, &[], 1e-9);
    let p = all.len();
    let mut dice = Dice(9);
    for _ in 0..20 {
        let mut draw = || -> Vec<f64> { (0..2).map(|_| unit(&mut dice)).collect() };
        let (position, speed, acceleration) = (draw(), draw(), draw());
        let motion = Motion { position: &position, speed: &speed, acceleration: &acceleration };
        let (mut x, mut y) = (vec![0.0; 2 * p], vec![0.0; 2]);
        assert!(regressor.fill(motion, &[0.7], &mut x, &mut y));
        for combination in &dependencies {
            for i in 0..2 {
                let sum: f64 = (0..p).map(|k| x[i * p + k] * kardan::num::rational_to_f64(&combination[k])).sum();
                assert!(sum.abs() < 1e-12, "{combination:?}");
            }
        }
    }
    // At constant speeds neither the inertias nor the damping of the spring show, and the geared shafts stay tied.
    let steady = undetermined(&model, &all, &[], Excitation::Steady);
    let unidentifiable = |name: &str| {
        let column = all.iter().position(|one| one.name == name).expect("a coefficient");
        steady.iter().any(|combination| (0..p).all(|k| (k == column) != (combination[k] == Rational::ZERO)))
    };
    for name in ["a.inertia", "b.inertia", "c.inertia", "s.damping"] {
        assert!(unidentifiable(name), "{name}: {steady:?}");
    }
    assert!(!unidentifiable("s.stiffness") && !unidentifiable("c.friction") && steady.len() == 6, "{}", steady.len());
    // A bent joint parts what an in-line one ties together.
    let names = ["cs.inertia", "cj.inertia"];
    let straight = built_in("sia-steering", 0);
    let bent = built_in("sia-steering", 3);
    assert_eq!(undetermined(&straight, &named(&coefficients(&straight), &names), &[], Excitation::Free).len(), 1);
    assert_eq!(undetermined(&bent, &named(&coefficients(&bent), &names), &[], Excitation::Free).len(), 0);
}

/// Least squares against exact normal equations over the rationals, with weights, in one piece and in two.
#[test]
fn least_squares() {
    let mut dice = Dice(3);
    for (rows, p) in [(7, 2), (40, 5), (700, 6)] {
        let x = dice.matrix(rows, p, 9);
        let y = dice.matrix(rows, 1, 9);
        let weights: Vec<i64> = (0..rows).map(|_| dice.between(1, 3)).collect();
        let weighted = |of: &Matrix<Rational>| {
            Matrix::from_fn(rows, of.columns(), |i, j| of[(i, j)].clone() * Rational::from(weights[i] * weights[i]))
        };
        let normal = x.transpose().multiply(&weighted(&x));
        let exact = normal.solve(&x.transpose().multiply(&weighted(&y))).expect("full rank");
        let (xf, yf) = (x.to_f64(), y.to_f64());
        let mut halves = [LeastSquares::new(p), LeastSquares::new(p)];
        let mut whole = LeastSquares::new(p);
        for i in 0..rows {
            whole.add(xf.row(i), yf[(i, 0)], weights[i] as f64);
            halves[i % 2].add(xf.row(i), yf[(i, 0)], weights[i] as f64);
        }
        let [mut first, second] = halves;
        first.merge(&second);
        assert_eq!((first.count(), whole.count()), (rows, rows));
        let inverse = normal.to_f64().solve(&Matrix::identity(p)).expect("regular");
        for found in [whole.solve().expect("rows"), first.solve().expect("rows")] {
            assert_eq!((found.rank, found.rows, found.undetermined.len()), (p, rows, 0));
            let squares = (0..rows).map(|i| {
                let fit: f64 = (0..p).map(|j| xf[(i, j)] * exact.to_f64()[(j, 0)]).sum();
                (weights[i] as f64 * (fit - yf[(i, 0)])).powi(2)
            });
            let residual = (squares.sum::<f64>() / (rows - p) as f64).sqrt();
            assert!((found.residual / residual - 1.0).abs() < 1e-11, "{} {residual}", found.residual);
            for j in 0..p {
                let expected = kardan::num::rational_to_f64(&exact[(j, 0)]);
                assert!((found.values[j] - expected).abs() < 1e-11, "{} {expected}", found.values[j]);
                let error = residual * inverse[(j, j)].sqrt();
                assert!((found.standard_errors[j] / error - 1.0).abs() < 1e-9);
                for k in 0..p {
                    let both = (inverse[(j, j)] * inverse[(k, k)]).sqrt();
                    assert!((found.correlation[(j, k)] - inverse[(j, k)] / both).abs() < 1e-9);
                }
            }
        }
    }
}

/// Columns of which one is the sum of two others: the fit is found all the same, and the combination is named.
#[test]
fn columns_that_depend_on_each_other() {
    let mut dice = Dice(8);
    let mut problem = LeastSquares::new(3);
    for _ in 0..50 {
        let (a, b) = (unit(&mut dice), 1e3 * unit(&mut dice));
        problem.add(&[a, b, a + b], 2.0 * a - 3.0 * b, 1.0);
    }
    let found = problem.solve().expect("rows");
    assert_eq!((found.rank, found.undetermined.len()), (2, 1));
    // θ₁ + θ₃ = 2 and θ₂ + θ₃ = −3, whatever θ₃ is.
    assert!(
        (found.values[0] + found.values[2] - 2.0).abs() < 1e-6
            && (found.values[1] + found.values[2] + 3.0).abs() < 1e-9
    );
    let dependency = &found.undetermined[0];
    assert!(
        (dependency[0] / dependency[2] + 1.0).abs() < 1e-6 && (dependency[1] / dependency[2] + 1.0).abs() < 1e-6,
        "{dependency:?}"
    );
    assert!(found.standard_errors.iter().all(|error| error.is_infinite()));
    assert!(LeastSquares::new(2).solve().is_none());
    problem.add(&[f64::NAN, 0.0, 0.0], 1.0, 1.0);
    assert!(problem.solve().is_none());
}

/// In many draws of noise the standard errors hold the truth as often as they must.
#[test]
fn standard_errors_are_those_of_the_values() {
    let mut dice = Dice(21);
    let truth = [2.0, -1.0, 0.5];
    let (draws, mut inside, mut spread) = (400, 0, 0.0);
    for _ in 0..draws {
        let mut problem = LeastSquares::new(3);
        for _ in 0..60 {
            let x = [unit(&mut dice), unit(&mut dice), 1.0];
            // Nearly normal: twelve even draws.
            let noise: f64 = (0..12).map(|_| 0.5 * unit(&mut dice)).sum::<f64>() * 0.1;
            let y: f64 = x.iter().zip(truth).map(|(x, t)| x * t).sum::<f64>() + noise;
            problem.add(&x, y, 1.0);
        }
        let found = problem.solve().expect("rows");
        for k in 0..3 {
            let off = (found.values[k] - truth[k]) / found.standard_errors[k];
            inside += usize::from(off.abs() < 2.0024); // Student's t, 57 degrees of freedom, 95 %
            spread += off * off;
        }
    }
    let share = inside as f64 / (3 * draws) as f64;
    assert!((share - 0.95).abs() < 0.03, "{share}");
    let spread = spread / (3 * draws) as f64;
    assert!((spread - 57.0 / 55.0).abs() < 0.15, "{spread}");
}

/// The accelerations of a simulated run, by differences of its speeds, satisfy the regressor's equation; through a bent joint, with
/// friction, springs and a torque from outside. The evaluation allocates nothing.
#[test]
fn the_regressor_against_a_simulated_run() {
    let source = "\
[model]
name = \"bent\"
coordinates = [\"a\", \"c\"]
[shaft.a]
inertia = \"0.02 kg m^2\"
damping = \"0.05 N m s/rad\"
friction = \"0.1 N m\"
[shaft.b]
inertia = \"0.01 kg m^2\"
[shaft.c]
inertia = \"0.03 kg m^2\"
damping = \"0.02 N m s/rad\"
[universal_joint.joint]
shaft_1 = \"b\"
shaft_2 = \"a\"
angle = \"35 deg\"
[spring_damper.s]
shaft_1 = \"b\"
shaft_2 = \"c\"
stiffness = \"20 N m/rad\"
damping = \"0.03 N m s/rad\"
[motor.m]
shaft = \"a\"
[scenario]
duration = \"1 s\"
output_step = \"0.5 ms\"
initial = { \"a.w\" = \"4 rad/s\", \"c.w\" = \"4 rad/s\" }
[[scenario.event]]
at = \"0 s\"
signal = \"m.tau\"
to = \"1.5 N m\"
over = \"1 s\"
";
    let model = reduced(source, 0);
    let run = common::run(source);
    let all = coefficients(&model);
    let p = all.len();
    let mut regressor = Regressor::new(&model, &all, &[], 1e-3);
    let names = model.coordinate_names();
    let of = |name: &str, tail: &str| common::signal(&run, &format!("{name}.{tail}")).to_vec();
    let (angles, speeds): (Vec<_>, Vec<_>) = names.iter().map(|name| (of(name, "phi"), of(name, "w"))).unzip();
    let (torque, time) = (of("m", "tau"), &run.series.time);
    let (mut x, mut y) = (vec![0.0; 2 * p], vec![0.0; 2]);
    let (mut checked, mut largest) = (0, 0.0f64);
    for k in (1..time.len() - 1).step_by(7) {
        let (before, after) = (time[k] - time[k - 1], time[k + 1] - time[k]);
        if (before / after - 1.0).abs() > 1e-6 {
            continue;
        }
        let at = |series: &[Vec<f64>], row: usize| -> Vec<f64> { series.iter().map(|values| values[row]).collect() };
        let (position, speed) = (at(&angles, k), at(&speeds, k));
        let acceleration: Vec<f64> =
            speeds.iter().map(|values| (values[k + 1] - values[k - 1]) / (time[k + 1] - time[k - 1])).collect();
        let motion = Motion { position: &position, speed: &speed, acceleration: &acceleration };
        let allocated = allocation_counter::measure(|| {
            assert!(regressor.fill(motion, &[torque[k]], &mut x, &mut y));
        });
        assert_eq!(allocated.count_total, 0);
        for i in 0..2 {
            let predicted: f64 = (0..p).map(|k| x[i * p + k] * all[k].value).sum();
            largest = largest.max((predicted - y[i]).abs());
        }
        checked += 1;
    }
    // Differences over 1 ms of motions at some 50 rad/s are right to 4e-4 of accelerations of some 50 rad/s².
    assert!(checked > 200 && largest < 1e-3, "{checked} {largest}");
}

/// Samples of one row each with the columns and the right side given.
fn plain_samples(rows: &[(&[f64], f64)]) -> Samples {
    let mut samples = Samples::new(1, rows[0].0.len(), 0, 1, 0);
    for (k, (x, y)) in rows.iter().enumerate() {
        let place = Where { log: 0, section: 0, time: k as f64, duration: 1.0 };
        let room = samples.push(place, [&[0.0], &[1.0], &[0.0]]);
        room.x.copy_from_slice(x);
        (room.y[0], room.covariance[0]) = (*y, 1.0);
    }
    samples
}

/// Two groups of unlike spread, a column each: the mean of a group has the standard error `s/√n` and n − 1 degrees of freedom of its
/// own group \[Welch 1947\], whatever the other one does; with a column for both, their difference is Welch's, whose degrees of freedom
/// at equal spreads are `(1/n₁ + 1/n₂)²/(1/(n₁²(n₁−1)) + 1/(n₂²(n₂−1)))`.
#[test]
fn standard_errors_allow_for_unlike_spread() {
    let mut dice = Dice(8);
    let groups: Vec<Vec<f64>> = [(6, 0.1), (15, 3.0)]
        .iter()
        .map(|(n, spread)| (0..*n).map(|_| 1.0 + spread * unit(&mut dice)).collect())
        .collect();
    let spread_of = |values: &[f64]| {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        (mean, (values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0) / n).sqrt())
    };
    let fitted = |columns: [[f64; 2]; 2]| {
        let rows: Vec<(&[f64], f64)> =
            (0..2).flat_map(|g| groups[g].iter().map(move |y| (g, *y))).map(|(g, y)| (&columns[g][..], y)).collect();
        let samples = plain_samples(&rows);
        let chosen: Vec<usize> = (0..samples.len()).collect();
        fit(&samples, &chosen, &FitOptions::default()).expect("a fit")
    };
    let own = fitted([[1.0, 0.0], [0.0, 1.0]]);
    let (first, second) = (spread_of(&groups[0]), spread_of(&groups[1]));
    for (k, (mean, error)) in [first, second].into_iter().enumerate() {
        assert!((own.values[k] - mean).abs() < 1e-12 && (own.standard_errors[k] / error - 1.0).abs() < 1e-12);
        assert!(
            (own.degrees_of_freedom[k] - (groups[k].len() as f64 - 1.0)).abs() < 1e-9,
            "{:?}",
            own.degrees_of_freedom
        );
    }
    // Student's 0.975 at five degrees of freedom.
    assert!((own.quantile(0, 0.95) - 2.570_582).abs() < 1e-5);
    let both = fitted([[1.0, 0.0], [1.0, 1.0]]);
    assert!((both.standard_errors[1] / first.1.hypot(second.1) - 1.0).abs() < 1e-12);
    let (a, b) = (6.0_f64, 15.0_f64);
    let welch = (1.0 / a + 1.0 / b).powi(2) / (1.0 / (a * a * (a - 1.0)) + 1.0 / (b * b * (b - 1.0)));
    assert!((both.degrees_of_freedom[1] - welch).abs() < 1e-9, "{} for {welch}", both.degrees_of_freedom[1]);
}

/// Windows of these speeds in turn, calm ones but where `true` says that the speed is changing.
fn trajectory(speeds: &[(f64, bool)]) -> Samples {
    let mut samples = Samples::new(1, 1, 0, 1, 0);
    for (k, (speed, moving)) in speeds.iter().enumerate() {
        let place = Where { log: 0, section: 0, time: 0.05 * k as f64, duration: 0.05 };
        let acceleration = if *moving { 20.0 } else { 0.0 };
        samples.push(place, [&[0.0], &[*speed], &[acceleration]]);
    }
    samples
}

/// A set point is one segment though it wobbles; two set points are two, and a return is not the same visit.
#[test]
fn a_wobble_does_not_split_a_set_point() {
    let constant = |speed: f64, windows: usize| vec![(speed, false); windows];
    let segments = |parts: &[Vec<(f64, bool)>]| {
        let samples = trajectory(&parts.concat());
        steady_segments(&samples, &[0.0], Steadiness::default())
    };
    // Two percent of 10 rad/s count as still: a hop of 0.5 rad/s does not.
    let hop = vec![(2.3, true), (2.5, true), (2.3, true)];
    assert_eq!(segments(&[constant(10.0, 8), constant(2.0, 7), hop.clone(), constant(2.05, 9)]), [1..7, 9..26]);
    // Nor do two pieces make one that are each too short alone and unlike.
    let short = segments(&[constant(10.0, 8), constant(2.0, 4), hop, constant(4.0, 4)]);
    assert!(short.len() == 1 && short[0] == (1..7), "{short:?}");
    let away = vec![(6.0, true); 3];
    assert_eq!(segments(&[constant(10.0, 8), away.clone(), constant(10.0, 8)]), [1..7, 12..18]);
    assert_eq!(segments(&[constant(2.0, 8), constant(10.0, 8), constant(2.0, 8)]), [1..7, 9..15, 17..23]);
}
